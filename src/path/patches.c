/* Faces cut into patches. All sums are over the triangles of a face, so that it does not matter how they divide it. */
#include <math.h>
#include <stdlib.h>

#include "base/number.h"
#include "path/scatter.h"
#include "path/solve.h"

enum { MOST_CORNERS = 3 + 4, DEEPEST = 6 };

static const double least_share = 1e-9; /* of a cell: less than this of a face in it is rounding */

typedef struct {
    double u, v;
} Flat;

/* Area (m^2) and moments (m^3) of what has been added up. */
typedef struct {
    double area, u, v;
} Sum;

typedef struct {
    double low[2], high[2];     /* m, along u and v */
} Cell;

/* A face and axes in its plane. */
typedef struct {
    const KellerScene *scene;
    const KellerFace *face;
    uint32_t id;
    KellerVec3 u, v;
    Patches *patches;
} Cutter;

static KellerVec3 vertex_of(const Cutter *c, uint32_t triangle, int i)
{
    return c->scene->vertices[c->scene->triangles[triangle][i]];
}

static uint32_t flat_triangle(const Cutter *c, uint32_t triangle, Flat polygon[MOST_CORNERS])
{
    for (int i = 0; i < 3; i++) {
        KellerVec3 p = vertex_of(c, triangle, i);
        polygon[i] = (Flat){v3_dot(p, c->u), v3_dot(p, c->v)};
    }
    return 3;
}

/* What of a convex polygon is on one side of the line u = at, or v = at (Sutherland and Hodgman 1974). */
static uint32_t clip(const Flat *from, uint32_t count, int axis, double at, bool above, Flat *to)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < count; i++) {
        Flat p = from[i], q = from[(i + 1) % count];
        double a = (axis == 0 ? p.u : p.v) - at, b = (axis == 0 ? q.u : q.v) - at;
        bool p_in = above ? a >= 0 : a <= 0, q_in = above ? b >= 0 : b <= 0;
        if (p_in) to[n++] = p;
        if (p_in == q_in || a == 0 || b == 0) continue;
        double t = a / (a - b);
        Flat r = {p.u + t * (q.u - p.u), p.v + t * (q.v - p.v)};
        if (axis == 0) r.u = at;
        else r.v = at;
        to[n++] = r;
    }
    return n;
}

static uint32_t between(const Flat *from, uint32_t count, int axis, double low, double high, Flat to[MOST_CORNERS])
{
    Flat half[MOST_CORNERS];
    return clip(half, clip(from, count, axis, low, true, half), axis, high, false, to);
}

static void add_polygon(const Flat *p, uint32_t count, Sum *sum)
{
    for (uint32_t i = 2; i < count; i++) {
        double a = (p[i - 1].u - p[0].u) * (p[i].v - p[0].v) - (p[i - 1].v - p[0].v) * (p[i].u - p[0].u);
        a = 0.5 * fabs(a);
        sum->area += a;
        sum->u += a * (p[0].u + p[i - 1].u + p[i].u) / 3;
        sum->v += a * (p[0].v + p[i - 1].v + p[i].v) / 3;
    }
}

static bool push(Patches *patches, const Patch *patch)
{
    if (patches->count == patches->capacity) {
        size_t more = patches->capacity + patches->capacity / 2 + 64;
        Patch *grown = realloc(patches->list, more * sizeof *grown);
        if (!grown) return false;
        patches->list = grown;
        patches->capacity = more;
    }
    patches->list[patches->count++] = *patch;
    return true;
}

static Sum part_in(const Cutter *c, const Cell *cell)
{
    Sum sum = {0, 0, 0};
    for (uint32_t i = c->face->triangle_begin; i < c->face->triangle_end; i++) {
        Flat a[MOST_CORNERS], b[MOST_CORNERS];
        uint32_t n = flat_triangle(c, c->scene->face_triangles[i], a);
        n = between(a, n, 0, cell->low[0], cell->high[0], b);
        n = between(b, n, 1, cell->low[1], cell->high[1], a);
        add_polygon(a, n, &sum);
    }
    return sum;
}

/* The part of the face in a cell as a patch, or as several. */
static bool add_part(const Cutter *c, const Cell *cell, const Sum *sum, int depth)
{
    double width = cell->high[0] - cell->low[0], height = cell->high[1] - cell->low[1];
    if (!(sum->area > least_share * width * height)) return true;
    KellerVec3 middle = v3_scale(c->face->normal, c->face->offset);
    middle = v3_madd(v3_madd(middle, c->u, sum->u / sum->area), c->v, sum->v / sum->area);
    Patch patch = {.middle = middle, .area = sum->area, .face = c->id};
    if (path_face_weight(c->scene, c->id, middle, -1, &patch.triangle) > 0) return push(c->patches, &patch);
    if (depth == DEEPEST) { /* beside the face by less than a cell of that depth */
        patch.triangle = c->scene->face_triangles[c->face->triangle_begin];
        return push(c->patches, &patch);
    }
    for (int i = 0; i < 4; i++) {
        Cell quarter = *cell;
        if (i & 1) quarter.low[0] += 0.5 * width;
        else quarter.high[0] -= 0.5 * width;
        if (i & 2) quarter.low[1] += 0.5 * height;
        else quarter.high[1] -= 0.5 * height;
        Sum part = part_in(c, &quarter);
        if (!add_part(c, &quarter, &part, depth + 1)) return false;
    }
    return true;
}

typedef struct {
    Cell box;                   /* of the whole face */
    uint32_t count[2];
    double step[2];
} Grid;

static Cell cell_at(const Grid *g, uint32_t i, uint32_t j)
{
    return (Cell){{g->box.low[0] + i * g->step[0], g->box.low[1] + j * g->step[1]},
                  {g->box.low[0] + (i + 1) * g->step[0], g->box.low[1] + (j + 1) * g->step[1]}};
}

static uint32_t place(const Grid *g, int axis, double x)
{
    double at = floor((x - g->box.low[axis]) / g->step[axis]);
    return at < 0 ? 0 : at >= g->count[axis] ? g->count[axis] - 1 : (uint32_t)at;
}

/* Adds a triangle to the sums of the cells that it reaches into, row by row. */
static void add_triangle(const Cutter *c, const Grid *g, uint32_t triangle, Sum *sums)
{
    Flat whole[MOST_CORNERS], row[MOST_CORNERS], part[MOST_CORNERS];
    uint32_t n = flat_triangle(c, triangle, whole);
    double low = lesser(whole[0].v, lesser(whole[1].v, whole[2].v)), high = greater(whole[0].v, greater(whole[1].v, whole[2].v));
    for (uint32_t j = place(g, 1, low), last = place(g, 1, high); j <= last; j++) {
        Cell cell = cell_at(g, 0, j);
        uint32_t m = between(whole, n, 1, cell.low[1], cell.high[1], row);
        if (m < 3) continue;
        double left = row[0].u, right = row[0].u;
        for (uint32_t i = 1; i < m; i++) left = lesser(left, row[i].u), right = greater(right, row[i].u);
        for (uint32_t i = place(g, 0, left), end = place(g, 0, right); i <= end; i++) {
            cell = cell_at(g, i, j);
            add_polygon(part, between(row, m, 0, cell.low[0], cell.high[0], part), &sums[(size_t)j * g->count[0] + i]);
        }
    }
}

/* The grid over a face; false: too many cells. */
static bool grid_over(const Cutter *c, double size, Grid *g)
{
    g->box = (Cell){{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    for (uint32_t i = c->face->triangle_begin; i < c->face->triangle_end; i++) {
        Flat p[MOST_CORNERS];
        flat_triangle(c, c->scene->face_triangles[i], p);
        for (int j = 0; j < 3; j++) {
            g->box.low[0] = lesser(g->box.low[0], p[j].u), g->box.high[0] = greater(g->box.high[0], p[j].u);
            g->box.low[1] = lesser(g->box.low[1], p[j].v), g->box.high[1] = greater(g->box.high[1], p[j].v);
        }
    }
    const double whole = 1e-9; /* of a cell: a side that is so much more than a multiple of the size is that multiple, rounded */
    double cells[2];
    for (int axis = 0; axis < 2; axis++) {
        double side = g->box.high[axis] - g->box.low[axis];
        cells[axis] = greater(1, ceil(side / size - whole));
        g->step[axis] = side / cells[axis];
    }
    if (cells[0] * cells[1] > MOST_PATCHES) return false;
    for (int axis = 0; axis < 2; axis++) g->count[axis] = (uint32_t)cells[axis];
    return true;
}

static KellerStatus cut_face(const Cutter *c, double size, KellerError *error)
{
    Grid g = {0};
    Patches *patches = c->patches;
    size_t cells = grid_over(c, size, &g) ? (size_t)g.count[0] * g.count[1] : MOST_PATCHES;
    if (cells + patches->count > MOST_PATCHES)
        return keller_error(error, KELLER_BAD_INPUT, "patches of %g m make more than %u of them; expected larger ones, or fewer "
                            "surfaces that scatter", size, MOST_PATCHES);
    Sum *sums = calloc(cells, sizeof *sums);
    if (!sums) return keller_error_memory(error, cells * sizeof *sums);
    for (uint32_t i = c->face->triangle_begin; i < c->face->triangle_end; i++)
        add_triangle(c, &g, c->scene->face_triangles[i], sums);
    bool room = true;
    for (uint32_t j = 0; j < g.count[1] && room; j++)
        for (uint32_t i = 0; i < g.count[0] && room; i++) {
            Cell cell = cell_at(&g, i, j);
            room = add_part(c, &cell, &sums[(size_t)j * g.count[0] + i], 0);
        }
    free(sums);
    return room ? KELLER_OK : keller_error_memory(error, patches->capacity * sizeof *patches->list);
}

KellerStatus patches_of(const KellerScene *scene, double size, Patches *patches, KellerError *error)
{
    *patches = (Patches){0};
    KellerStatus status = KELLER_OK;
    for (uint32_t i = 0; i < scene->face_count && status == KELLER_OK; i++) {
        const KellerFace *f = &scene->faces[i];
        if (!(scene->materials[f->material].diffuse.coefficient > 0)) continue;
        Cutter c = {.scene = scene, .face = f, .id = i, .patches = patches};
        KellerVec3 level = v3_cross(v3(0, 0, 1), f->normal);
        /* floors have the axes of the scene, also where they are level but for rounding */
        c.u = v3_norm(level) > KELLER_FLAT_ANGLE ? v3_unit(level) : v3_unit(v3_madd(v3(1, 0, 0), f->normal, -f->normal.x));
        c.v = v3_cross(f->normal, c.u);
        status = cut_face(&c, size, error);
    }
    if (status != KELLER_OK) patches_free(patches);
    return status;
}

void patches_free(Patches *patches)
{
    free(patches->list);
    *patches = (Patches){0};
}

/* ---- phases --------------------------------------------------------------------------------------------------------------- */

/* SplitMix64's finisher (Steele, Lea and Flood 2014). */
static uint64_t mixed(uint64_t x)
{
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
    x = (x ^ x >> 27) * 0x94d049bb133111ebu;
    return x ^ x >> 31;
}

void patch_phase(KellerVec3 middle, double phase[2])
{
    /* m: far above rounding; no multiple of it and a half is a round number, on which the middle of a patch could be by design */
    const double quantum = 6.180339887498949e-4;
    const double coordinate[3] = {middle.x, middle.y, middle.z};
    uint64_t state = 0;
    for (int i = 0; i < 3; i++) state = mixed(state + 0x9e3779b97f4a7c15u + (uint64_t)llround(coordinate[i] / quantum));
    for (int i = 0; i < 2; i++) {
        state = mixed(state + 0x9e3779b97f4a7c15u);
        phase[i] = 2 * M_PI * 0x1p-53 * (double)(state >> 11);
    }
}
