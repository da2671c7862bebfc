/* Welds vertices, leaves out degenerate and duplicate triangles, and puts everything in canonical order. */
#include "mesh/build.h"

#include <assert.h>
#include <string.h>

/* Vertices nearer than this share of the contact tolerance are one: 1 unit in the last place of the single precision
 * that files carry, at the scene's diagonal. */
#define WELD_SHARE 0.25
/* A triangle lower than this share of the contact tolerance is left out. It is a T-junction and no more; what it
 * covers, 1e-10 m in a scene of metres, is still far above the rounding of double precision (2e-12 m at 10 km from
 * the origin), so that its neighbours, which touch, leave nothing a ray could slip through but what rounding leaves
 * anyway. */
#define HEIGHT_SHARE 1e-4

static KellerTriangleShape shape_of(KellerVec3 a, KellerVec3 b, KellerVec3 c)
{
    KellerVec3 cross = v3_cross(v3_sub(b, a), v3_sub(c, a));
    double twice = v3_norm(cross), longest = fmax(v3_distance(a, b), fmax(v3_distance(b, c), v3_distance(c, a)));
    return (KellerTriangleShape){v3_unit(cross), 0.5 * twice, longest > 0 ? twice / longest : 0};
}

/* ---- names in order ---- */

typedef struct {
    const char *name;
    uint32_t index;
} Name;

static int by_name(const void *x, const void *y)
{
    const Name *a = x, *b = y;
    int order = strcmp(a->name, b->name);
    return order ? order : (a->index > b->index) - (a->index < b->index);
}

/* Sorts names; rank[i] is the place of names[i].index == i. */
static void rank_names(size_t count, Name *names, uint32_t *rank)
{
    qsort(names, count, sizeof *names, by_name);
    for (size_t i = 0; i < count; i++) rank[names[i].index] = (uint32_t)i;
}

static bool copy_names(KellerBuild *build, const KellerSoup *soup, uint32_t *material_rank, uint32_t *object_rank)
{
    KellerScene *scene = build->scene;
    size_t most = soup->material_count > soup->object_count ? soup->material_count : soup->object_count;
    Name *names = keller_mesh_allocate(build, most, sizeof *names);
    scene->materials = keller_mesh_allocate(build, soup->material_count, sizeof *scene->materials);
    scene->objects = keller_mesh_allocate(build, soup->object_count, sizeof *scene->objects);
    bool ok = names && scene->materials && scene->objects;
    for (size_t i = 0; ok && i < soup->material_count; i++) names[i] = (Name){soup->materials[i].name, (uint32_t)i};
    if (ok) rank_names(soup->material_count, names, material_rank);
    for (size_t i = 0; ok && i < soup->material_count; i++) {
        scene->materials[i] = soup->materials[names[i].index];
        scene->materials[i].name = strdup(names[i].name);
        scene->material_count++;
        ok = scene->materials[i].name != NULL;
    }
    for (size_t i = 0; ok && i < soup->object_count; i++) names[i] = (Name){soup->objects[i], (uint32_t)i};
    if (ok) rank_names(soup->object_count, names, object_rank);
    for (size_t i = 0; ok && i < soup->object_count; i++) {
        scene->objects[i] = strdup(names[i].name);
        scene->object_count++;
        ok = scene->objects[i] != NULL;
    }
    free(names);
    return ok;
}

/* ---- vertices ---- */

/* The vertices that triangles use, without negative zeros; place[v] is KELLER_NONE for the others. */
static size_t used_vertices(const KellerSoup *soup, uint32_t *place, KellerVec3 *points)
{
    memset(place, 0xff, soup->vertex_count * sizeof *place);
    size_t count = 0;
    for (size_t t = 0; t < soup->triangle_count; t++)
        for (int i = 0; i < 3; i++) {
            uint32_t v = soup->triangles[t][i];
            assert(v < soup->vertex_count);
            if (place[v] != KELLER_NONE) continue;
            place[v] = (uint32_t)count;
            KellerVec3 p = soup->vertices[v];
            points[count++] = v3(p.x + 0.0, p.y + 0.0, p.z + 0.0);
        }
    return count;
}

static void bounds(KellerScene *scene, size_t count, const KellerVec3 *points)
{
    scene->lower = scene->upper = count ? points[0] : v3(0, 0, 0);
    for (size_t i = 1; i < count; i++) {
        KellerVec3 p = points[i];
        scene->lower = v3(fmin(scene->lower.x, p.x), fmin(scene->lower.y, p.y), fmin(scene->lower.z, p.z));
        scene->upper = v3(fmax(scene->upper.x, p.x), fmax(scene->upper.y, p.y), fmax(scene->upper.z, p.z));
    }
}

typedef struct {
    KellerVec3 p;
    uint32_t index;
} Ordered;

static int by_position(const void *x, const void *y)
{
    return keller_mesh_compare(((const Ordered *)x)->p, ((const Ordered *)y)->p);
}

/* ---- triangles ---- */

typedef struct {
    uint32_t vertex[3], material, object, source;
} Row;

static int by_row(const void *x, const void *y)
{
    const uint32_t *a = (const uint32_t *)x, *b = (const uint32_t *)y;
    for (size_t i = 0; i < sizeof(Row) / sizeof(uint32_t); i++)
        if (a[i] != b[i]) return a[i] < b[i] ? -1 : 1;
    return 0;
}

static void sort_corners(uint32_t v[3])
{
    for (int i = 0; i < 3; i++) {
        int j = i < 2 ? 0 : 1; /* compare 0-1, 0-2, 1-2 */
        int k = i == 0 ? 1 : 2;
        if (v[j] > v[k]) {
            uint32_t swap = v[j];
            v[j] = v[k];
            v[k] = swap;
        }
    }
}

/* Rows of triangles in canonical order, in the numbers of `points`; returns how many. */
static size_t fill_rows(KellerBuild *build, const KellerSoup *soup, const uint32_t *place, const KellerVec3 *points,
                        const uint32_t *stands, const uint32_t *material_rank, const uint32_t *object_rank, Row *rows)
{
    KellerSceneReport *report = &build->scene->report;
    size_t count = 0;
    for (size_t t = 0; t < soup->triangle_count; t++) {
        Row row = {.source = (uint32_t)t};
        for (int i = 0; i < 3; i++) row.vertex[i] = stands[place[soup->triangles[t][i]]];
        const uint32_t *v = row.vertex;
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0] ||
            shape_of(points[v[0]], points[v[1]], points[v[2]]).height < HEIGHT_SHARE * build->contact) {
            report->degenerate++;
            continue;
        }
        assert(soup->material[t] < soup->material_count && soup->object[t] < soup->object_count);
        row.material = material_rank[soup->material[t]];
        row.object = object_rank[soup->object[t]];
        rows[count++] = row;
    }
    return count;
}

/* Numbers the vertices that the rows use by position and renames them in the rows. */
static bool number_vertices(KellerBuild *build, size_t point_count, const KellerVec3 *points, size_t row_count,
                            Row *rows)
{
    KellerScene *scene = build->scene;
    uint32_t *number = keller_mesh_allocate(build, point_count, sizeof *number);
    Ordered *order = keller_mesh_allocate(build, point_count, sizeof *order);
    bool ok = number && order;
    if (ok) {
        size_t count = 0;
        for (size_t r = 0; r < row_count; r++)
            for (int i = 0; i < 3; i++) {
                uint32_t v = rows[r].vertex[i];
                if (number[v]) continue;
                number[v] = 1;
                order[count++] = (Ordered){points[v], v};
            }
        qsort(order, count, sizeof *order, by_position);
        scene->vertices = keller_mesh_allocate(build, count, sizeof *scene->vertices);
        ok = scene->vertices != NULL;
        for (size_t i = 0; ok && i < count; i++) {
            scene->vertices[i] = order[i].p;
            number[order[i].index] = (uint32_t)i;
        }
        scene->vertex_count = ok ? count : 0;
        for (size_t r = 0; ok && r < row_count; r++) {
            for (int i = 0; i < 3; i++) rows[r].vertex[i] = number[rows[r].vertex[i]];
            sort_corners(rows[r].vertex);
        }
    }
    free(number);
    free(order);
    return ok;
}

/* One of several triangles with the same vertices and material is enough (the object first in order keeps it), if it says
 * how many it stands for. */
static bool keep_rows(KellerBuild *build, size_t count, Row *rows, uint32_t *materials)
{
    KellerScene *scene = build->scene;
    qsort(rows, count, sizeof *rows, by_row);
    scene->triangle_sheets = keller_mesh_allocate(build, count, sizeof *scene->triangle_sheets);
    if (!scene->triangle_sheets) return false;
    size_t kept = 0;
    for (size_t r = 0; r < count; r++) {
        const Row *row = &rows[r], *last = kept ? &rows[kept - 1] : NULL;
        if (last && !memcmp(last->vertex, row->vertex, sizeof row->vertex) && last->material == row->material) {
            scene->triangle_sheets[kept - 1]++;
            scene->report.duplicate++;
            continue;
        }
        scene->triangle_sheets[kept] = 1;
        rows[kept++] = *row;
    }
    scene->triangles = keller_mesh_allocate(build, kept, sizeof *scene->triangles);
    scene->triangle_object = keller_mesh_allocate(build, kept, sizeof *scene->triangle_object);
    scene->triangle_source = keller_mesh_allocate(build, kept, sizeof *scene->triangle_source);
    build->shape = keller_mesh_allocate(build, kept, sizeof *build->shape);
    if (!scene->triangles || !scene->triangle_object || !scene->triangle_source || !build->shape) return false;
    scene->triangle_count = kept;
    for (uint32_t t = 0; t < kept; t++) {
        memcpy(scene->triangles[t], rows[t].vertex, sizeof rows[t].vertex);
        scene->triangle_object[t] = rows[t].object;
        scene->triangle_source[t] = rows[t].source;
        materials[t] = rows[t].material;
        build->shape[t] = shape_of(keller_mesh_corner(scene, t, 0), keller_mesh_corner(scene, t, 1),
                                   keller_mesh_corner(scene, t, 2));
    }
    return true;
}

bool keller_mesh_clean(KellerBuild *build, const KellerSoup *soup)
{
    KellerScene *scene = build->scene;
    scene->report.read_triangles = soup->triangle_count;
    uint32_t *material_rank = keller_mesh_allocate(build, soup->material_count, sizeof *material_rank);
    uint32_t *object_rank = keller_mesh_allocate(build, soup->object_count, sizeof *object_rank);
    uint32_t *place = keller_mesh_allocate(build, soup->vertex_count, sizeof *place);
    uint32_t *stands = keller_mesh_allocate(build, soup->vertex_count, sizeof *stands);
    KellerVec3 *points = keller_mesh_allocate(build, soup->vertex_count, sizeof *points);
    Row *rows = keller_mesh_allocate(build, soup->triangle_count, sizeof *rows);
    build->material = keller_mesh_allocate(build, soup->triangle_count, sizeof *build->material);
    bool ok = material_rank && object_rank && place && stands && points && rows && build->material;
    ok = ok && copy_names(build, soup, material_rank, object_rank);
    if (ok) {
        size_t count = used_vertices(soup, place, points);
        bounds(scene, count, points);
        scene->contact = build->contact = keller_scene_contact(v3_distance(scene->lower, scene->upper));
        ok = keller_mesh_weld(build, count, points, WELD_SHARE * build->contact, stands);
        for (size_t i = 0; ok && i < count; i++) scene->report.welded_vertices += stands[i] != i;
        if (ok) {
            size_t row_count = fill_rows(build, soup, place, points, stands, material_rank, object_rank, rows);
            ok = number_vertices(build, count, points, row_count, rows) &&
                 keep_rows(build, row_count, rows, build->material);
            bounds(scene, scene->vertex_count, scene->vertices);
        }
    }
    free(material_rank);
    free(object_rank);
    free(place);
    free(stands);
    free(points);
    free(rows);
    return ok;
}
