/* Which triangles touch an edge, and along which piece of it: sides that run along it, whether or not the mesh joins
 * them, and triangles whose interior it runs through. What pierces an edge or touches it in a point does not count. */
#include "mesh/build.h"

/* Steps over thin triangles, so that a heap of slivers cannot make the search long. */
enum { MOST_THIN = 64 };

typedef struct {
    KellerBuild *build;
    uint32_t edge;
    KellerVec3 a, d;      /* first vertex and unit direction */
    double length;
    bool ok;
} Search;

static bool add(Search *search, KellerTouch touch)
{
    KellerBuild *build = search->build;
    if (build->touch_count / KELLER_MESH_CROWD > build->adjacency.edge_count + KELLER_MESH_CROWD) {
        build->crowded = true;
        return search->ok = false;
    }
    if (!keller_mesh_reserve(build, (void **)&build->touches, &build->touch_capacity, build->touch_count + 1,
                             sizeof *build->touches))
        return search->ok = false;
    build->touches[build->touch_count++] = touch;
    return true;
}

/* The least overlap that counts. Two contact tolerances keep what merely meets the end of the edge out; short edges and
 * short sides may count with half their length. */
static double least_overlap(const Search *search, double side)
{
    return fmin(2 * search->build->contact, 0.5 * fmin(search->length, side));
}

static bool on_edge(const Search *search, uint32_t vertex, double t)
{
    KellerVec3 p = search->build->scene->vertices[vertex];
    return v3_distance(p, v3_madd(search->a, search->d, t)) <= search->build->contact;
}

/* The common piece of the edge and the mesh edge `other`, projected. */
static bool overlap(const Search *search, uint32_t other, KellerTouch *touch, double *apart)
{
    const KellerScene *scene = search->build->scene;
    const uint32_t *ends = search->build->adjacency.vertices[other];
    uint32_t v0 = ends[0], v1 = ends[1];
    double t0 = v3_dot(v3_sub(scene->vertices[v0], search->a), search->d);
    double t1 = v3_dot(v3_sub(scene->vertices[v1], search->a), search->d);
    if (t0 > t1) {
        double t = t0;
        uint32_t v = v0;
        t0 = t1, t1 = t;
        v0 = v1, v1 = v;
    }
    KellerVec3 p = scene->vertices[v0], way = v3_sub(scene->vertices[v1], p);
    const uint32_t *own = search->build->adjacency.vertices[search->edge];
    touch->begin = fmax(t0, 0);
    touch->end = fmin(t1, search->length);
    touch->begin_vertex = t0 < 0 ? own[0] : on_edge(search, v0, t0) ? v0 : KELLER_NONE;
    touch->end_vertex = t1 > search->length ? own[1] : on_edge(search, v1, t1) ? v1 : KELLER_NONE;
    touch->edge = other;
    double least = least_overlap(search, v3_norm(way));
    if (!(touch->end - touch->begin >= least) || !(least > 0)) return false;
    KellerVec3 at0 = v3_madd(p, way, (touch->begin - t0) / (t1 - t0)),
               at1 = v3_madd(p, way, (touch->end - t0) / (t1 - t0));
    *apart = fmax(v3_distance(at0, v3_madd(search->a, search->d, touch->begin)),
                  v3_distance(at1, v3_madd(search->a, search->d, touch->end)));
    return true;
}

/* The side of the triangle that runs along the edge, within the contact tolerance all the way; the nearest if two
 * do. */
static bool along_side(const Search *search, uint32_t triangle, KellerTouch *touch)
{
    double best = search->build->contact;
    bool found = false;
    for (int i = 0; i < 3; i++) {
        KellerTouch candidate = *touch;
        double apart;
        if (!overlap(search, search->build->adjacency.edge[triangle][i], &candidate, &apart)) continue;
        if (apart > best || (found && apart == best)) continue;
        best = apart;
        *touch = candidate;
        found = true;
    }
    touch->kind = KELLER_TOUCH_SIDE;
    return found;
}

static uint32_t corner_near(const Search *search, uint32_t triangle, double t)
{
    const KellerScene *scene = search->build->scene;
    KellerVec3 p = v3_madd(search->a, search->d, t);
    for (int i = 0; i < 3; i++)
        if (v3_distance(p, keller_mesh_corner(scene, triangle, i)) <= search->build->contact)
            return scene->triangles[triangle][i];
    return KELLER_NONE;
}

/* Depth of the point at t inside the triangle: the least of the distances from the three sides. */
static double depth(const double at0[3], const double slope[3], double t)
{
    return fmin(at0[0] + slope[0] * t, fmin(at0[1] + slope[1] * t, at0[2] + slope[2] * t));
}

static bool through_inside(const Search *search, uint32_t triangle, KellerTouch *touch)
{
    const KellerBuild *build = search->build;
    KellerVec3 normal = build->shape[triangle].normal, corner[3];
    for (int i = 0; i < 3; i++) corner[i] = keller_mesh_corner(build->scene, triangle, i);
    double at0[3], slope[3], t[5];
    double begin = 0, end = search->length;
    for (int i = 0; i < 3; i++) {
        KellerVec3 inward = v3_unit(v3_cross(normal, v3_sub(corner[(i + 1) % 3], corner[i])));
        at0[i] = v3_dot(inward, v3_sub(search->a, corner[i]));
        slope[i] = v3_dot(inward, search->d);
        if (slope[i] > 0) begin = fmax(begin, -at0[i] / slope[i]);
        else if (slope[i] < 0) end = fmin(end, -at0[i] / slope[i]);
        else if (at0[i] < 0) return false;
    }
    if (!(end - begin >= least_overlap(search, INFINITY))) return false;
    /* The edge leaves the plane at neither end: it lies in it. */
    double off = v3_dot(normal, v3_sub(search->a, corner[0])), rise = v3_dot(normal, search->d);
    if (fabs(off + rise * begin) > build->contact || fabs(off + rise * end) > build->contact) return false;
    /* It gets deeper into the triangle than the tolerance, or it only cuts a corner or runs along the border. The
     * depth is concave and piecewise linear: its maximum is at an end or where two of the three distances are equal. */
    t[0] = begin, t[1] = end;
    for (int i = 0; i < 3; i++) t[2 + i] = (at0[(i + 1) % 3] - at0[i]) / (slope[i] - slope[(i + 1) % 3]);
    double deepest = 0;
    for (int i = 0; i < 5; i++)
        if (t[i] >= begin && t[i] <= end) deepest = fmax(deepest, depth(at0, slope, t[i]));
    if (deepest <= build->contact) return false;
    const uint32_t *own = build->adjacency.vertices[search->edge];
    *touch = (KellerTouch){begin, end, begin > 0 ? corner_near(search, triangle, begin) : own[0],
                           end < search->length ? corner_near(search, triangle, end) : own[1], triangle, KELLER_NONE,
                           KELLER_TOUCH_INSIDE, false};
    return true;
}

static bool at_edge(const KellerAdjacency *adjacency, uint32_t triangle, uint32_t edge)
{
    const uint32_t *sides = adjacency->edge[triangle];
    return sides[0] == edge || sides[1] == edge || sides[2] == edge;
}

/* False if the edge stays farther than the tolerance from the triangle: what is left of it near the plane is outside
 * one of the sides. Most triangles whose box is near are dismissed here, so it does without square roots. */
static bool comes_near(const Search *search, uint32_t triangle)
{
    const KellerBuild *build = search->build;
    KellerVec3 normal = build->shape[triangle].normal, corner[3];
    for (int i = 0; i < 3; i++) corner[i] = keller_mesh_corner(build->scene, triangle, i);
    double reach = 2 * build->contact, off = v3_dot(normal, v3_sub(search->a, corner[0])),
           rise = v3_dot(normal, search->d);
    double begin = 0, end = search->length;
    if (fabs(rise) > 1e-12) {
        double t0 = (-reach - off) / rise, t1 = (reach - off) / rise, first = t0 < t1 ? t0 : t1,
               last = t0 < t1 ? t1 : t0;
        if (first > begin) begin = first;
        if (last < end) end = last;
        if (begin > end) return false;
    } else if (fabs(off) > reach) {
        return false;
    }
    KellerVec3 p = v3_sub(v3_madd(search->a, search->d, begin), corner[0]);
    KellerVec3 q = v3_sub(v3_madd(search->a, search->d, end), corner[0]);
    for (int i = 0; i < 3; i++) {
        KellerVec3 side = v3_sub(corner[(i + 1) % 3], corner[i]), inward = v3_cross(normal, side);
        KellerVec3 from = v3_sub(corner[i], corner[0]);
        double at_p = v3_dot(inward, v3_sub(p, from)), at_q = v3_dot(inward, v3_sub(q, from));
        double most = at_p > at_q ? at_p : at_q;
        if (most < 0 && most * most > reach * reach * v3_dot(side, side)) return false;
    }
    return true;
}

static void visit(void *context, uint32_t triangle)
{
    Search *search = context;
    const KellerBuild *build = search->build;
    if (!search->ok || keller_mesh_thin(build, triangle) || at_edge(&build->adjacency, triangle, search->edge)) return;
    if (!comes_near(search, triangle)) return;
    KellerTouch touch = {.triangle = triangle};
    if (along_side(search, triangle, &touch) || through_inside(search, triangle, &touch)) add(search, touch);
}

/* A thin triangle at the edge only hides what lies behind it: goes on over its other sides to triangles that have a
 * width. A side counts as long as it runs along the edge, each thin triangle no farther away than the tolerance. */
static bool look_through(Search *search, uint32_t thin)
{
    KellerBuild *build = search->build;
    const KellerAdjacency *adjacency = &build->adjacency;
    uint32_t list[MOST_THIN] = {thin}, steps[MOST_THIN] = {1}, count = 1;
    for (uint32_t head = 0; head < count; head++)
        for (int i = 0; i < 3; i++) {
            uint32_t side = adjacency->edge[list[head]][i];
            KellerTouch touch = {.kind = KELLER_TOUCH_THROUGH};
            double apart;
            if (side == search->edge || !overlap(search, side, &touch, &apart)) continue;
            if (apart > steps[head] * build->contact) continue;
            for (uint32_t k = adjacency->begin[side]; k < adjacency->begin[side + 1]; k++) {
                uint32_t t = touch.triangle = adjacency->triangles[k];
                bool known = at_edge(adjacency, t, search->edge) && !keller_mesh_thin(build, t);
                for (uint32_t j = 0; j < count && !known; j++) known = list[j] == t;
                if (known) continue;
                if (!keller_mesh_thin(build, t)) {
                    if (!add(search, touch)) return false;
                } else if (count < MOST_THIN) {
                    steps[count] = steps[head] + 1;
                    list[count++] = t;
                }
            }
        }
    return true;
}

static int by_place(const void *x, const void *y)
{
    const KellerTouch *a = x, *b = y;
    if (a->begin != b->begin) return a->begin < b->begin ? -1 : 1;
    if (a->end != b->end) return a->end < b->end ? -1 : 1;
    if (a->triangle != b->triangle) return a->triangle < b->triangle ? -1 : 1;
    if (a->edge != b->edge) return a->edge < b->edge ? -1 : 1;
    return (a->kind > b->kind) - (a->kind < b->kind);
}

bool keller_mesh_touch(KellerBuild *build, uint32_t edge)
{
    if (build->touch_number[edge]) return true;
    const KellerScene *scene = build->scene;
    const KellerAdjacency *adjacency = &build->adjacency;
    const uint32_t *ends = adjacency->vertices[edge];
    KellerVec3 a = scene->vertices[ends[0]], b = scene->vertices[ends[1]];
    Search search = {build, edge, a, v3_unit(v3_sub(b, a)), v3_distance(a, b), true};
    size_t begin = build->touch_count;
    for (uint32_t k = adjacency->begin[edge]; k < adjacency->begin[edge + 1]; k++) {
        uint32_t t = adjacency->triangles[k];
        KellerTouch touch = {0, search.length, ends[0], ends[1], t, edge, KELLER_TOUCH_SIDE, true};
        if (!add(&search, touch) || (keller_mesh_thin(build, t) && !look_through(&search, t))) return false;
    }
    keller_boxtree_segment(build->tree, a, b, build->contact, visit, &search);
    if (!search.ok) return false;
    build->touch_begin[edge] = begin;
    build->touch_number[edge] = (uint32_t)(build->touch_count - begin);
    qsort(build->touches + begin, build->touch_count - begin, sizeof *build->touches, by_place);
    return true;
}

/* Two triangles of one material that continue each other. */
static bool plainly_flat(const KellerBuild *build, uint32_t edge)
{
    const KellerAdjacency *adjacency = &build->adjacency;
    uint32_t begin = adjacency->begin[edge];
    if (adjacency->begin[edge + 1] - begin != 2) return false;
    uint32_t t = adjacency->triangles[begin], u = adjacency->triangles[begin + 1];
    if (keller_mesh_thin(build, t) || keller_mesh_thin(build, u) || build->material[t] != build->material[u])
        return false;
    if (v3_norm(v3_cross(build->shape[t].normal, build->shape[u].normal)) > KELLER_FLAT_ANGLE) return false;
    const KellerScene *scene = build->scene;
    KellerVec3 a = scene->vertices[adjacency->vertices[edge][0]], b = scene->vertices[adjacency->vertices[edge][1]];
    KellerVec3 across = v3_cross(build->shape[t].normal, v3_sub(b, a));
    double side[2] = {0, 0};
    for (int i = 0; i < 3; i++) {
        side[0] += v3_dot(across, v3_sub(keller_mesh_corner(scene, t, i), a));
        side[1] += v3_dot(across, v3_sub(keller_mesh_corner(scene, u, i), a));
    }
    return side[0] * side[1] < 0;
}

bool keller_mesh_touch_creases(KellerBuild *build)
{
    const KellerScene *scene = build->scene;
    size_t edges = build->adjacency.edge_count, count = scene->triangle_count;
    build->touch_begin = keller_mesh_allocate(build, edges, sizeof *build->touch_begin);
    build->touch_number = keller_mesh_allocate(build, edges, sizeof *build->touch_number);
    KellerVec3 *lower = keller_mesh_allocate(build, count, sizeof *lower);
    KellerVec3 *upper = keller_mesh_allocate(build, count, sizeof *upper);
    bool ok = build->touch_begin && build->touch_number && lower && upper;
    for (uint32_t t = 0; ok && t < count; t++) {
        KellerVec3 a = keller_mesh_corner(scene, t, 0), b = keller_mesh_corner(scene, t, 1);
        KellerVec3 c = keller_mesh_corner(scene, t, 2);
        lower[t] = v3(fmin(a.x, fmin(b.x, c.x)), fmin(a.y, fmin(b.y, c.y)), fmin(a.z, fmin(b.z, c.z)));
        upper[t] = v3(fmax(a.x, fmax(b.x, c.x)), fmax(a.y, fmax(b.y, c.y)), fmax(a.z, fmax(b.z, c.z)));
    }
    if (ok) {
        build->tree = keller_boxtree_build(count, lower, upper);
        ok = build->tree != NULL;
        if (!ok) build->bytes = (unsigned long long)count * 200;
    }
    free(lower);
    free(upper);
    for (uint32_t e = 0; ok && e < edges; e++)
        if (!plainly_flat(build, e)) ok = keller_mesh_touch(build, e);
    return ok;
}
