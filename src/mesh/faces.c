/* Faces: coplanar, edge-connected triangles of one material, grown from the largest triangle outwards. */
#include "mesh/build.h"

#include <string.h>

/* Growth is repeated with the plane fitted to what was found, because a small seed's plane does not reach far; it ends
 * when a round finds what the last one did. */
enum { MOST_ROUNDS = 12 };

typedef struct {
    KellerVec3 normal;
    double offset;
} Plane;

/* Triangles that meet along a side, joined by the mesh or only touching, or of which one lies with a side inside the
 * other: where sheets overlap, it must not depend on how they are cut whether a side of one meets a side of the other.
 * Ranges by triangle. */
typedef struct {
    size_t *begin;
    uint32_t *other;
} Neighbours;

typedef struct {
    uint32_t t, u;
} Pair;

static int by_pair(const void *x, const void *y)
{
    const Pair *a = x, *b = y;
    if (a->t != b->t) return a->t < b->t ? -1 : 1;
    return (a->u > b->u) - (a->u < b->u);
}

static bool add_pairs(KellerBuild *build, uint32_t t, uint32_t u, Pair **pairs, size_t *count, size_t *capacity)
{
    if (t == u || build->material[t] != build->material[u]) return true;
    if (!keller_mesh_reserve(build, (void **)pairs, capacity, *count + 2, sizeof **pairs)) return false;
    (*pairs)[(*count)++] = (Pair){t, u};
    (*pairs)[(*count)++] = (Pair){u, t};
    return true;
}

static bool find_neighbours(KellerBuild *build, Neighbours *neighbours)
{
    const KellerAdjacency *adjacency = &build->adjacency;
    size_t triangles = build->scene->triangle_count, count = 0, capacity = 0;
    Pair *pairs = NULL;
    bool ok = true;
    for (uint32_t e = 0; ok && e < adjacency->edge_count; e++) {
        uint32_t begin = adjacency->begin[e], end = adjacency->begin[e + 1];
        /* A chain over the triangles of one edge would not do where materials alternate: the first of each material
         * stands for it, so that many triangles at one edge do not make the list quadratic. */
        for (uint32_t i = begin; ok && i < end; i++) {
            uint32_t t = adjacency->triangles[i];
            for (uint32_t k = begin; ok && k < end; k++) {
                if (build->material[adjacency->triangles[k]] != build->material[t]) continue;
                if (end - begin <= 16) {
                    if (k > i) ok = add_pairs(build, t, adjacency->triangles[k], &pairs, &count, &capacity);
                } else {
                    ok = add_pairs(build, t, adjacency->triangles[k], &pairs, &count, &capacity);
                    break;
                }
            }
        }
        const KellerTouch *touch = build->touches + build->touch_begin[e];
        for (uint32_t i = 0; ok && i < build->touch_number[e]; i++)
            for (uint32_t k = begin; ok && k < end && touch[i].kind != KELLER_TOUCH_THROUGH && !touch[i].mesh; k++)
                ok = add_pairs(build, adjacency->triangles[k], touch[i].triangle, &pairs, &count, &capacity);
    }
    neighbours->begin = keller_mesh_allocate(build, triangles + 1, sizeof *neighbours->begin);
    neighbours->other = keller_mesh_allocate(build, count, sizeof *neighbours->other);
    ok = ok && neighbours->begin && neighbours->other;
    if (ok && count) {
        qsort(pairs, count, sizeof *pairs, by_pair);
        size_t kept = 0;
        for (size_t i = 0; i < count; i++) {
            if (i && !by_pair(&pairs[i], &pairs[i - 1])) continue;
            neighbours->other[kept++] = pairs[i].u;
            neighbours->begin[pairs[i].t + 1] = kept;
        }
        for (size_t t = 1; t <= triangles; t++)
            if (neighbours->begin[t] < neighbours->begin[t - 1]) neighbours->begin[t] = neighbours->begin[t - 1];
    }
    free(pairs);
    return ok;
}

/* The sum of the triangles' area vectors, all turned to the reference's side (Newell): for the triangles of a plane
 * polygon it is the polygon's own area vector, however it is cut. The centroid gives the offset. Thin triangles, which
 * may stand at right angles to the face, only count where there are no others. */
static Plane fit(const KellerBuild *build, const uint32_t *list, size_t count, Plane reference)
{
    bool all_thin = true;
    for (size_t i = 0; i < count && all_thin; i++) all_thin = keller_mesh_thin(build, list[i]);
    const KellerScene *scene = build->scene;
    KellerVec3 origin = keller_mesh_corner(scene, list[0], 0), sum = {0, 0, 0}, first = {0, 0, 0};
    double total = 0;
    for (size_t i = 0; i < count; i++) {
        uint32_t t = list[i];
        if (!all_thin && keller_mesh_thin(build, t)) continue;
        KellerVec3 a = keller_mesh_corner(scene, t, 0), b = keller_mesh_corner(scene, t, 1);
        KellerVec3 c = keller_mesh_corner(scene, t, 2);
        KellerVec3 vector = v3_cross(v3_sub(b, a), v3_sub(c, a));
        double area = build->shape[t].area;
        sum = v3_madd(sum, vector, v3_dot(vector, reference.normal) < 0 ? -0.5 : 0.5);
        KellerVec3 centre = v3_scale(v3_add(v3_add(v3_sub(a, origin), v3_sub(b, origin)), v3_sub(c, origin)), 1.0 / 3);
        first = v3_madd(first, centre, area);
        total += area;
    }
    if (!(v3_norm(sum) > 0)) return reference;
    KellerVec3 normal = v3_unit(sum);
    return (Plane){normal, v3_dot(normal, origin) + v3_dot(normal, first) / total};
}

typedef struct {
    KellerBuild *build;
    Neighbours neighbours;
    uint32_t *face, *round; /* by triangle */
    uint32_t *list;         /* the face being grown */
    uint32_t rounds;
} Growth;

static bool fits(const KellerBuild *build, uint32_t t, Plane plane)
{
    for (int i = 0; i < 3; i++)
        if (fabs(v3_dot(plane.normal, keller_mesh_corner(build->scene, t, i)) - plane.offset) > build->contact)
            return false;
    /* Below this height the corners' tolerance alone turns the normal by the flat angle: distance decides. */
    if (build->shape[t].height * KELLER_FLAT_ANGLE < build->contact) return true;
    return v3_norm(v3_cross(build->shape[t].normal, plane.normal)) <= KELLER_FLAT_ANGLE;
}

/* All triangles that hang together with the seed and fit the plane, which is tested as it is: no drift. */
static size_t spread(Growth *growth, uint32_t seed, Plane plane)
{
    uint32_t round = ++growth->rounds;
    size_t count = 0;
    growth->list[count++] = seed;
    growth->round[seed] = round;
    for (size_t head = 0; head < count; head++) {
        uint32_t t = growth->list[head];
        for (size_t i = growth->neighbours.begin[t]; i < growth->neighbours.begin[t + 1]; i++) {
            uint32_t u = growth->neighbours.other[i];
            if (growth->face[u] != KELLER_NONE || growth->round[u] == round || !fits(growth->build, u, plane)) continue;
            growth->round[u] = round;
            growth->list[count++] = u;
        }
    }
    return count;
}

static Plane grow(Growth *growth, uint32_t seed, size_t *count)
{
    const KellerBuild *build = growth->build;
    KellerVec3 normal = build->shape[seed].normal, corner = keller_mesh_corner(build->scene, seed, 0);
    Plane plane = {normal, v3_dot(normal, corner)};
    plane = fit(build, &seed, 1, plane);
    size_t found = 0;
    for (int i = 0; i < MOST_ROUNDS; i++) {
        size_t now = spread(growth, seed, plane);
        plane = fit(build, growth->list, now, plane);
        if (now == found) break;
        found = now;
        if (now == 1) break;
    }
    *count = spread(growth, seed, plane);
    return fit(build, growth->list, *count, plane);
}

/* The first component that is not zero is positive; zero means below any rounding, so that rounding does not turn
 * it. */
static Plane canonical(Plane plane)
{
    const double zero = 1e-9;
    KellerVec3 n = plane.normal;
    double lead = fabs(n.x) > zero ? n.x : fabs(n.y) > zero ? n.y : n.z;
    if (lead < 0) plane = (Plane){v3_scale(n, -1), -plane.offset};
    plane.normal = v3_add(plane.normal, v3(0, 0, 0)); /* no negative zeros */
    plane.offset += 0.0;
    return plane;
}

/* ---- order ---- */

typedef struct {
    double area;
    uint32_t triangle;
} Seed;

static int by_area(const void *x, const void *y)
{
    const Seed *a = x, *b = y;
    if (a->area != b->area) return a->area > b->area ? -1 : 1;
    return (a->triangle > b->triangle) - (a->triangle < b->triangle);
}

/* A face's rank: material, then its first vertex -- a corner of the polygon, whatever its triangles -- then its first
 * triangle. */
typedef struct {
    uint32_t material, vertex, triangle, index;
    Plane plane;
} Rank;

static int by_rank(const void *x, const void *y)
{
    const Rank *a = x, *b = y;
    if (a->material != b->material) return a->material < b->material ? -1 : 1;
    if (a->vertex != b->vertex) return a->vertex < b->vertex ? -1 : 1;
    return (a->triangle > b->triangle) - (a->triangle < b->triangle);
}

static bool store(KellerBuild *build, size_t count, Rank *ranks)
{
    KellerScene *scene = build->scene;
    uint32_t *number = keller_mesh_allocate(build, count, sizeof *number);
    scene->faces = keller_mesh_allocate(build, count, sizeof *scene->faces);
    scene->face_triangles = keller_mesh_allocate(build, scene->triangle_count, sizeof *scene->face_triangles);
    bool ok = number && scene->faces && scene->face_triangles;
    if (ok) {
        scene->face_count = count;
        for (uint32_t t = 0; t < scene->triangle_count; t++) {
            Rank *rank = &ranks[scene->triangle_face[t]];
            rank->material = build->material[t];
            if (scene->triangles[t][0] < rank->vertex) rank->vertex = scene->triangles[t][0];
            if (t < rank->triangle) rank->triangle = t;
        }
        qsort(ranks, count, sizeof *ranks, by_rank);
        for (uint32_t f = 0; f < count; f++) {
            number[ranks[f].index] = f;
            Plane plane = canonical(ranks[f].plane);
            scene->faces[f] =
                (KellerFace){.normal = plane.normal, .offset = plane.offset, .material = ranks[f].material};
        }
        for (size_t t = 0; t < scene->triangle_count; t++) {
            scene->triangle_face[t] = number[scene->triangle_face[t]];
            scene->faces[scene->triangle_face[t]].triangle_end++;
        }
        uint32_t begin = 0;
        for (size_t f = 0; f < count; f++) {
            KellerFace *face = &scene->faces[f];
            face->triangle_begin = begin;
            begin += face->triangle_end;
            face->triangle_end = face->triangle_begin;
        }
        for (uint32_t t = 0; t < scene->triangle_count; t++)
            scene->face_triangles[scene->faces[scene->triangle_face[t]].triangle_end++] = t;
    }
    free(number);
    return ok;
}

bool keller_mesh_faces(KellerBuild *build)
{
    KellerScene *scene = build->scene;
    size_t triangles = scene->triangle_count, count = 0;
    Growth growth = {.build = build};
    scene->triangle_face = keller_mesh_allocate(build, triangles, sizeof *scene->triangle_face);
    growth.face = scene->triangle_face;
    growth.round = keller_mesh_allocate(build, triangles, sizeof *growth.round);
    growth.list = keller_mesh_allocate(build, triangles, sizeof *growth.list);
    Seed *seeds = keller_mesh_allocate(build, triangles, sizeof *seeds);
    Rank *ranks = keller_mesh_allocate(build, triangles, sizeof *ranks);
    bool ok =
        growth.face && growth.round && growth.list && seeds && ranks && find_neighbours(build, &growth.neighbours);
    if (ok) {
        memset(growth.face, 0xff, triangles * sizeof *growth.face);
        for (uint32_t t = 0; t < triangles; t++) seeds[t] = (Seed){build->shape[t].area, t};
        qsort(seeds, triangles, sizeof *seeds, by_area);
        for (size_t s = 0; s < triangles; s++) {
            if (growth.face[seeds[s].triangle] != KELLER_NONE) continue;
            size_t members;
            Plane plane = grow(&growth, seeds[s].triangle, &members);
            for (size_t i = 0; i < members; i++) growth.face[growth.list[i]] = (uint32_t)count;
            ranks[count] =
                (Rank){.vertex = KELLER_NONE, .triangle = KELLER_NONE, .index = (uint32_t)count, .plane = plane};
            count++;
        }
        ok = store(build, count, ranks);
    }
    free(growth.round);
    free(growth.list);
    free(growth.neighbours.begin);
    free(growth.neighbours.other);
    free(seeds);
    free(ranks);
    return ok;
}
