/* Cones: the walk, then eight triangles or edges at a time in single precision; those surely contained have their range from
 * their vertices, the others go through keller_cone_triangle or keller_cone_edge. */
#include <omp.h>

#include "accel/leaf.h"
#include "base/number.h"

/* From this half-angle on, boxes wholly inside the cone are common enough to look for (tangent). */
#define CONTAINED_TAN 0.01

typedef enum { ALL, NEAREST, ANY } Wanted;

typedef struct {
    const KellerAccel *accel;
    const KellerCone *cone;
    KellerConeLanes lanes;
    KellerRange clip, whole;        /* still of interest; of the cone and the query both, which ranges are cut to */
    Wanted wanted;
    Seen *seen;
    KellerVisitCone visit;
    void *context;
    bool found;
    KellerConeHit hit;
    KellerAccelWork *work;
} Query;

static inline Query query(const KellerAccel *a, const KellerCone *cone, KellerRange clip, Wanted wanted, KellerAccelWork *work)
{
    KellerCone moved = *cone;
    moved.origin = v3_sub(cone->origin, a->middle);
    Query q = {.accel = a, .cone = cone, .wanted = wanted, .hit.primitive = KELLER_NONE, .work = work};
    q.clip = q.whole = (KellerRange){greater(cone->z_near, clip.near), lesser(cone->z_far, clip.far)};
    q.lanes = keller_cone_lanes(&moved, clip, a->size);
    return q;
}

/* A primitive that is met; returns the new far end of interest. */
static double met(Query *q, uint32_t id, bool edge, KellerRange range, double far)
{
    q->found = true;
    if (q->wanted == ALL && edge && q->accel->scene) {
        for (uint32_t i = q->accel->wedge_begin[id]; i < q->accel->wedge_begin[id + 1]; i++) {
            far = lesser(far, q->visit(q->context, q->accel->wedge[i], range));
            if (far == -INFINITY) break;
        }
        return far;
    }
    if (q->wanted == ALL) return lesser(far, q->visit(q->context, id, range));
    if (q->hit.primitive == KELLER_NONE || range.near < q->hit.range.near ||
        (range.near == q->hit.range.near && id < q->hit.primitive))
        q->hit = (KellerConeHit){range, id};
    return lesser(far, range.near);
}

/* The walk's far end: boxes are left out only where all that they hold lies behind clip.far. */
static float walk_far(const Query *q)
{
    float far = (float)(q->clip.far + (double)q->lanes.slack);
    return (double)far < q->clip.far ? nextafterf(far, INFINITY) : far;
}

/* Triangles (count 3) or edges (2) of a block that the single-precision tests left; near and last: the range of their vertices. */
static inline float finish(Query *q, uint32_t mask, uint32_t contained, const float *near, const float *last,
                           const uint32_t *ids, int count, float far)
{
    const KellerAccel *a = q->accel;
    for (; mask; mask &= mask - 1) {
        int i = __builtin_ctz(mask);
        uint32_t id = ids[i];
        if (id == KELLER_NONE || (double)near[i] > q->clip.far) continue;
        bool inside = contained >> i & 1;
        KellerRange range = {greater((double)near[i], q->whole.near), lesser((double)last[i], q->whole.far)};
        if (inside && q->wanted == ANY) {
            q->found = true;
            return -INFINITY;
        }
        if (!inside || q->wanted == NEAREST) {
            KellerVec3 v[3];
            if (count == 3) triangle_of(a, id, v);
            else edge_of(a, id, v);
            if (q->wanted == ANY) {
                if (!keller_cone_meets_triangle(q->cone, v[0], v[1], v[2], q->clip)) continue;
                q->found = true;
                return -INFINITY;
            }
            range = count == 3 ? keller_cone_triangle(q->cone, v[0], v[1], v[2], q->whole, NULL, NULL)
                               : keller_cone_edge(q->cone, v[0], v[1], q->whole, NULL, NULL);
            if (range.near > range.far || range.near > q->clip.far) continue;
        }
        if (q->seen && seen_before(q->seen, id)) continue;
        double old = q->clip.far;
        q->clip.far = met(q, id, count == 2, range, old);
        if (q->clip.far == old) continue;
        if (q->clip.far == -INFINITY) return -INFINITY;
        far = walk_far(q);
    }
    return far;
}

static float visit_triangles(void *context, uint32_t b, bool inside, float far)
{
    Query *q = context;
    const TriangleBlock *block = &q->accel->triangles[b];
    _Alignas(32) float near[8], last[8];
    uint32_t contained = 0xff, mask = 0xff;
    q->work->triangles += lanes_used(block->id);
    /* split primitives reach out of their part's box */
    if (inside && !q->accel->repeats) keller_cone_contained_triangle8(&q->lanes, block->corner, near, last);
    else mask = keller_cone_meets_triangle8(&q->lanes, block->corner, near, last, &contained);
    return mask ? finish(q, mask, contained, near, last, block->id, 3, far) : far;
}

static float visit_edges(void *context, uint32_t b, bool inside, float far)
{
    (void)inside; /* an edge is found to be contained at little cost */
    Query *q = context;
    const EdgeBlock *block = &q->accel->edges[b];
    _Alignas(32) float near[8], last[8];
    uint32_t contained, mask = keller_cone_meets_edge8(&q->lanes, block->corner, near, last, &contained);
    q->work->edges += lanes_used(block->id);
    return mask ? finish(q, mask, contained, near, last, block->id, 2, far) : far;
}

static void walk(Query *q, bool edges)
{
    const KellerAccel *a = q->accel;
    Seen seen;
    bool repeats = a->repeats && q->wanted == ALL, wide = q->cone->tan_alpha > CONTAINED_TAN;
    if (repeats) {
        q->seen = &seen;
        seen_start(&seen);
    }
    if (q->clip.near <= q->clip.far)
        a->kind->walk(edges ? a->edge_tree : a->triangle_tree, &q->lanes, wide, edges ? visit_edges : visit_triangles, q,
                      &q->work->nodes);
    if (repeats) seen_end(&seen);
    q->seen = NULL;
}

static void all(const KellerAccel *accel, bool edges, const KellerCone *cone, KellerRange clip, KellerVisitCone visit,
                void *context, KellerAccelWork *work)
{
    Query q = query(accel, cone, clip, ALL, work);
    q.visit = visit;
    q.context = context;
    walk(&q, edges);
}

void keller_accel_cone(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, KellerVisitCone visit,
                       void *context, KellerAccelWork *work)
{
    all(accel, false, cone, clip, visit, context, work);
}

void keller_accel_cone_wedges(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, KellerVisitCone visit,
                              void *context, KellerAccelWork *work)
{
    all(accel, true, cone, clip, visit, context, work);
}

bool keller_accel_cone_nearest(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, KellerConeHit *hit,
                               KellerAccelWork *work)
{
    Query q = query(accel, cone, clip, NEAREST, work);
    walk(&q, false);
    if (q.found) *hit = q.hit;
    return q.found;
}

bool keller_accel_cone_any(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, KellerAccelWork *work)
{
    Query q = query(accel, cone, clip, ANY, work);
    walk(&q, false);
    return q.found;
}

typedef struct {
    KellerVisitCone visit;
    void *context;
    double end;
} Window;

/* Only where ranges begin decides. */
static double in_window(void *context, uint32_t primitive, KellerRange range)
{
    Window *w = context;
    if (range.near > w->end) return INFINITY;
    return w->visit(w->context, primitive, range);
}

bool keller_accel_cone_window(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, double depth,
                              KellerConeHit *nearest, KellerVisitCone visit, KellerVisitCone visit_edge, void *context,
                              KellerAccelWork *work)
{
    Query q = query(accel, cone, clip, NEAREST, work);
    walk(&q, false);
    bool found = q.found;
    if (found) *nearest = q.hit;
    Window w = {NULL, context, found ? q.hit.range.near + depth : INFINITY};
    const KellerRange window = {q.whole.near, lesser(q.whole.far, w.end)};
    q.wanted = ALL;
    q.visit = in_window;
    q.context = &w;
    for (int edges = 0; edges < 2; edges++) {
        w.visit = edges ? visit_edge : visit;
        if (!w.visit || (!edges && !found)) continue;
        q.clip = window;
        q.lanes.far = walk_far(&q);
        walk(&q, edges);
    }
    return found;
}

void keller_accel_cones_nearest(const KellerAccel *accel, size_t count, const KellerCone *cones, KellerRange clip,
                                KellerConeHit *hits, int threads, KellerAccelWork *work)
{
    uint64_t nodes = 0, triangles = 0;
#pragma omp parallel for schedule(dynamic, 64) reduction(+ : nodes, triangles) num_threads(threads > 0 ? threads : omp_get_max_threads())
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
