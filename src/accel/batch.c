/* Batches of queries: one after another, or, without a structure, all at once. */
#include <omp.h>
#include <stdlib.h>

#include "accel/dac.h"

/* A batch is cut into a part a thread where there are threads to it, but not into parts of fewer than so many. */
enum { PART = 256 };

static size_t parts_of(size_t count, int threads)
{
    size_t most = (size_t)(threads > 0 ? threads : omp_get_max_threads()), parts = (count + PART - 1) / PART;
    return parts < most ? parts : most;
}

/* A region of more threads than there are parts wakes them for nothing. */
static int team_of(size_t count, int threads) { return count > PART ? (int)parts_of(count, threads) : 1; }

static size_t part_begin(size_t count, size_t part, size_t parts) { return count / parts * part + (count % parts) * part / parts; }

/* For parts that differ by one. */
static size_t room(const KellerAccel *a, size_t count, size_t parts, size_t (*bytes)(const KellerAccel *, size_t))
{
    return parts ? (bytes(a, (count + parts - 1) / parts) + 63) / 64 * 64 : 0;
}

size_t keller_accel_rays_bytes(const KellerAccel *accel, size_t count, int threads)
{
    size_t parts = parts_of(count, threads);
    return accel->kind == &tree_dacrt ? parts * room(accel, count, parts, dac_rays_bytes) : 0;
}

size_t keller_accel_cones_bytes(const KellerAccel *accel, size_t count, int threads)
{
    size_t parts = parts_of(count, threads);
    return accel->kind == &tree_dacrt ? parts * room(accel, count, parts, dac_cones_bytes) : 0;
}

static void *memory_for(size_t bytes) { return bytes ? aligned_alloc(64, bytes) : NULL; }

static void add(KellerAccelWork *to, const KellerAccelWork *from)
{
#pragma omp critical(keller_accel_work)
    {
        to->nodes += from->nodes;
        to->triangles += from->triangles;
        to->edges += from->edges;
    }
}

/* ---- rays -------------------------------------------------------------------------------------------------------- */

static void rays_one_by_one(const KellerAccel *accel, size_t count, const KellerVec3 *origins, const KellerVec3 *directions,
                            KellerRange clip, KellerRayHit *hits, int threads, KellerAccelWork *work)
{
    uint64_t nodes = 0, triangles = 0;
    int team = team_of(count, threads);
#pragma omp parallel for schedule(dynamic, PART) reduction(+ : nodes, triangles) num_threads(team) if (team > 1)
    for (size_t i = 0; i < count; i++) {
        KellerAccelWork own = {0};
        if (!keller_accel_ray_nearest(accel, origins[i], directions[i], clip, &hits[i], &own))
            hits[i] = (KellerRayHit){INFINITY, KELLER_NONE};
        nodes += own.nodes;
        triangles += own.triangles;
    }
    work->nodes += nodes;
    work->triangles += triangles;
}

void keller_accel_rays_nearest(const KellerAccel *accel, size_t count, const KellerVec3 *origins, const KellerVec3 *directions,
                               KellerRange clip, KellerRayHit *hits, int threads, KellerAccelWork *work)
{
    size_t parts = parts_of(count, threads), each = room(accel, count, parts, dac_rays_bytes);
    char *memory = memory_for(keller_accel_rays_bytes(accel, count, threads));
    if (!memory) { /* another structure, or no memory */
        rays_one_by_one(accel, count, origins, directions, clip, hits, threads, work);
        return;
    }
#pragma omp parallel for schedule(static, 1) num_threads((int)parts) if (parts > 1)
    for (size_t i = 0; i < parts; i++) {
        size_t begin = part_begin(count, i, parts), end = part_begin(count, i + 1, parts);
        KellerAccelWork own = {0};
        dac_rays_nearest(accel, memory + i * each, end - begin, origins + begin, directions + begin, clip, hits + begin, &own);
        add(work, &own);
    }
    free(memory);
}

/* ---- cones ------------------------------------------------------------------------------------------------------- */

static void cones_one_by_one(const KellerAccel *accel, size_t count, const KellerCone *cones, KellerRange clip, KellerConeHit *hits,
                             int threads, KellerAccelWork *work)
{
    uint64_t nodes = 0, triangles = 0;
    int team = team_of(count, threads);
#pragma omp parallel for schedule(dynamic, 64) reduction(+ : nodes, triangles) num_threads(team) if (team > 1)
    for (size_t i = 0; i < count; i++) {
        KellerAccelWork own = {0};
        if (!keller_accel_cone_nearest(accel, &cones[i], clip, &hits[i], &own))
            hits[i] = (KellerConeHit){{INFINITY, -INFINITY}, KELLER_NONE};
        nodes += own.nodes;
        triangles += own.triangles;
    }
    work->nodes += nodes;
    work->triangles += triangles;
}

void keller_accel_cones_nearest(const KellerAccel *accel, size_t count, const KellerCone *cones, KellerRange clip, KellerConeHit *hits,
                                int threads, KellerAccelWork *work)
{
    size_t parts = parts_of(count, threads), each = room(accel, count, parts, dac_cones_bytes);
    char *memory = memory_for(keller_accel_cones_bytes(accel, count, threads));
    if (!memory) {
        cones_one_by_one(accel, count, cones, clip, hits, threads, work);
        return;
    }
#pragma omp parallel for schedule(static, 1) num_threads((int)parts) if (parts > 1)
    for (size_t i = 0; i < parts; i++) {
        size_t begin = part_begin(count, i, parts), end = part_begin(count, i + 1, parts);
        KellerAccelWork own = {0};
        dac_cones_nearest(accel, memory + i * each, end - begin, cones + begin, clip, hits + begin, &own);
        add(work, &own);
    }
    free(memory);
}

/* One cone of a batch, for the visitors of a query of its own. */
typedef struct {
    KellerVisitCones visit, visit_edge;
    void *context;
    size_t query;
} One;

static double visit_triangle(void *context, uint32_t primitive, KellerRange range)
{
    const One *o = context;
    return o->visit(o->context, o->query, primitive, range);
}

static double visit_edge_of(void *context, uint32_t primitive, KellerRange range)
{
    const One *o = context;
    return o->visit_edge(o->context, o->query, primitive, range);
}

void keller_accel_cones(const KellerAccel *accel, size_t count, const KellerCone *cones, KellerRange clip, KellerVisitCones visit,
                        KellerVisitCones visit_edge, void *context, KellerAccelWork *work)
{
    void *memory = memory_for(keller_accel_cones_bytes(accel, count, 1));
    if (memory) {
        dac_cones_all(accel, memory, count, cones, clip, visit, visit_edge, context, work);
        free(memory);
        return;
    }
    for (size_t i = 0; i < count; i++) {
        One one = {visit, visit_edge, context, i};
        keller_accel_cone(accel, &cones[i], clip, visit ? visit_triangle : NULL, visit_edge ? visit_edge_of : NULL, &one, work);
    }
}
