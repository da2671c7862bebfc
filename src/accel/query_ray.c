/* Rays. Leaves are tested in single precision (ray8.h). Of a nearest hit only what may be nearer than the nearest sure one is
 * decided in double precision; any sure hit answers a shadow query. */
#include "accel/bvh8.h"
#include "accel/ray8.h"
#include "accel/ubvh.h"
#include "base/number.h"
#include "keller/ray.h"

enum { CANDIDATES = 16 };

typedef struct {
    const KellerAccel *accel;
    Ray8 ray;
    KellerRange clip;
    float near, inner_near, inner_far; /* clip: near rounded down; near and far rounded inwards */
    uint32_t count;                 /* of triangles that may be hit, at t = low or later */
    struct {
        uint32_t leaf, lane;
        float low;
    } candidate[CANDIDATES];
    bool found;
    KellerRayHit hit;
    Seen *seen;                     /* all: NULL where triangles are in one leaf each */
    KellerVisitRay visit;
    void *context;
    KellerAccelWork *work;
} Query;

static inline void prepare(const KellerAccel *a, KellerVec3 origin, KellerVec3 direction, KellerRange clip, KellerAccelWork *work,
                           Query *q, KellerConeLanes *l)
{
    /* one by one: clearing all of it first would cost as much as the rest */
    q->accel = a;
    q->clip = clip;
    q->work = work;
    q->count = 0;
    q->found = false;
    ray8_make(a, origin, direction, clip, &q->ray, l);
    if (a->kind == &tree_ubvh) ray8_origin(a, &q->ray, l);
    q->near = l->near;
    q->inner_near = float_up(clip.near);
    q->inner_far = float_down(clip.far);
}

/* Decides candidates in double precision. Nearest: all that may still be; `any`: until one is hit. */
static float decide(Query *q, bool any, float far)
{
    KellerRay exact = keller_ray(q->ray.origin, q->ray.direction);
    for (uint32_t i = 0; i < q->count; i++) {
        if (q->candidate[i].low > far) continue;
        const TriangleBlock *block = &q->accel->triangles[q->candidate[i].leaf];
        int lane = (int)q->candidate[i].lane;
        KellerVec3 v[3];
        KellerRayHit hit = {.triangle = block->id[lane]};
        if (hit.triangle == KELLER_NONE) continue; /* the box of an edge */
        KellerRange clip = q->clip;
        if (q->found) clip.far = q->hit.t;
        triangle_in(q->accel, block, lane, v);
        if (!keller_ray_triangle(&exact, v[0], v[1], v[2], clip, &hit.t, NULL)) continue;
        if (!q->found || hit.t < q->hit.t || hit.triangle < q->hit.triangle) q->hit = hit;
        q->found = true;
        if (any) break;
        float nearer = float_up(hit.t);
        far = nearer < far ? nearer : far;
    }
    q->count = 0;
    return far;
}

/* A triangle that may be hit, at `low` or later, waits to be decided. */
static inline __attribute__((always_inline)) float offer(Query *q, uint32_t leaf, uint32_t lane, float low, bool any, float far)
{
    if (q->count == CANDIDATES) far = decide(q, any, far);
    if (any && q->found) return -INFINITY;
    q->candidate[q->count].leaf = leaf;
    q->candidate[q->count].lane = lane;
    q->candidate[q->count++].low = low;
    return far;
}

static inline __attribute__((always_inline)) float visit_first(Query *q, uint32_t leaf, float far, bool any)
{
    _Alignas(32) float low[8], high[8];
    const TriangleBlock *block = &q->accel->triangles[leaf];
    Ray8Block tested;
    uint32_t mask = ray8_meets(&q->ray, block, q->near, far, &tested);
    q->work->triangles += lanes_used(block->id);
    if (!mask) return far;
    uint32_t sure = mask & ray8_sure(&q->ray, &tested, q->inner_near, q->inner_far, low, high);
    for (uint32_t rest = sure; rest; rest &= rest - 1) {
        float end = high[__builtin_ctz(rest)];
        far = end < far ? end : far;
    }
    if (any && sure) {
        q->found = true;
        return -INFINITY;
    }
    for (; mask; mask &= mask - 1) {
        int i = __builtin_ctz(mask);
        if (block->id[i] == KELLER_NONE || low[i] > far) continue;
        far = offer(q, leaf, (uint32_t)i, low[i], any, far);
        if (far == -INFINITY) return far;
    }
    return far;
}

/* The same of boxes around triangles, which need not be tested any more. */
static inline __attribute__((always_inline)) float met_first(Query *q, const UbvhMet *met, float far, bool any)
{
    q->work->triangles += met->tested;
    for (uint32_t rest = met->sure; rest; rest &= rest - 1) {
        float end = met->high[__builtin_ctz(rest)];
        far = end < far ? end : far;
    }
    if (any && met->sure) {
        q->found = true;
        return -INFINITY;
    }
    for (uint32_t k = 0; k < 2; k++)
        for (uint32_t rest = k ? met->second : met->first; rest; rest &= rest - 1) {
            int i = __builtin_ctz(rest);
            uint32_t place = (met->child[i] & UBVH_PLACE) + k;
            if (met->low[k][i] > far) continue;
            fetch_block(&q->accel->triangles[place / 8]); /* its first touch: to be decided on later */
            far = offer(q, place / 8, place % 8, met->low[k][i], any, far);
            if (far == -INFINITY) return far;
        }
    return far;
}

static float visit_nearest(void *context, uint32_t leaf, bool inside, float far)
{
    (void)inside;
    return visit_first(context, leaf, far, false);
}

static float visit_any(void *context, uint32_t leaf, bool inside, float far)
{
    (void)inside;
    return visit_first(context, leaf, far, true);
}

static float met_nearest(void *context, const UbvhMet *met, float far) { return met_first(context, met, far, false); }
static float met_any(void *context, const UbvhMet *met, float far) { return met_first(context, met, far, true); }

/* Decides on a triangle, and hands it out. */
static inline bool decide_one(Query *q, const KellerRay *exact, const TriangleBlock *block, int lane)
{
    KellerVec3 v[3];
    KellerRayHit hit = {.triangle = block->id[lane]};
    if (hit.triangle == KELLER_NONE) return false;
    triangle_in(q->accel, block, lane, v);
    if (!keller_ray_triangle(exact, v[0], v[1], v[2], q->clip, &hit.t, NULL)) return false;
    if (q->seen && seen_before(q->seen, hit.triangle)) return false;
    q->found = q->visit(q->context, hit);
    return q->found;
}

static float met_all(void *context, const UbvhMet *met, float far)
{
    Query *q = context;
    q->work->triangles += met->tested;
    if (!(met->first | met->second)) return far;
    KellerRay exact = keller_ray(q->ray.origin, q->ray.direction);
    for (uint32_t k = 0; k < 2; k++)
        for (uint32_t rest = k ? met->second : met->first; rest; rest &= rest - 1) {
            uint32_t place = (met->child[__builtin_ctz(rest)] & UBVH_PLACE) + k;
            if (decide_one(q, &exact, &q->accel->triangles[place / 8], (int)(place % 8))) return -INFINITY;
        }
    return far;
}

static float visit_all(void *context, uint32_t leaf, bool inside, float far)
{
    (void)inside;
    Query *q = context;
    const TriangleBlock *block = &q->accel->triangles[leaf];
    Ray8Block tested;
    uint32_t mask = ray8_meets(&q->ray, block, q->near, far, &tested);
    q->work->triangles += lanes_used(block->id);
    if (!mask) return far;
    KellerRay exact = keller_ray(q->ray.origin, q->ray.direction);
    for (; mask; mask &= mask - 1)
        if (decide_one(q, &exact, block, __builtin_ctz(mask))) return -INFINITY;
    return far;
}

static const WalkHow plain_walk = {0};

#define WALK(q, lanes, visit, met)                                                                                          \
    do {                                                                                                               \
        const KellerAccel *a_ = (q)->accel;                                                                            \
        uint64_t *nodes_ = &(q)->work->nodes;                                                                          \
        if (!a_->triangles) break;                                                                                     \
        if (a_->kind == &tree_bvh8) bvh8_walk_thin(a_->tree, lanes, visit, q, a_->triangles, nodes_, false);                          \
        else if (a_->kind == &tree_bvh8_mask) bvh8_walk_thin(a_->tree, lanes, visit, q, a_->triangles, nodes_, true);                 \
        else if (a_->kind == &tree_ubvh && !((const Ubvh *)a_->tree)->dop14) \
            ubvh_walk_ray(a_->tree, lanes, (q)->inner_near, (q)->inner_far, met, visit, q, nodes_); \
        else a_->kind->walk(a_->tree, lanes, &plain_walk, visit, q, nodes_);                                                 \
    } while (0)

bool keller_accel_ray_nearest(const KellerAccel *accel, KellerVec3 origin, KellerVec3 direction, KellerRange clip,
                              KellerRayHit *hit, KellerAccelWork *work)
{
    Query q;
    KellerConeLanes lanes;
    prepare(accel, origin, direction, clip, work, &q, &lanes);
    WALK(&q, &lanes, visit_nearest, met_nearest);
    if (q.count) decide(&q, false, INFINITY);
    if (q.found) *hit = q.hit;
    return q.found;
}

bool keller_accel_ray_any(const KellerAccel *accel, KellerVec3 origin, KellerVec3 direction, KellerRange clip,
                          KellerAccelWork *work)
{
    Query q;
    KellerConeLanes lanes;
    prepare(accel, origin, direction, clip, work, &q, &lanes);
    WALK(&q, &lanes, visit_any, met_any);
    if (!q.found && q.count) decide(&q, true, INFINITY);
    return q.found;
}

bool keller_accel_ray_all(const KellerAccel *accel, KellerVec3 origin, KellerVec3 direction, KellerRange clip,
                          KellerVisitRay visit, void *context, KellerAccelWork *work)
{
    Seen seen;
    Query q;
    KellerConeLanes lanes;
    prepare(accel, origin, direction, clip, work, &q, &lanes);
    q.visit = visit;
    q.context = context;
    q.seen = accel->repeats ? &seen : NULL;
    if (q.seen) seen_start(&seen);
    WALK(&q, &lanes, visit_all, met_all);
    if (q.seen) seen_end(&seen);
    return q.found;
}

/* ---- segments ---------------------------------------------------------------------------------------------------- */

typedef struct {
    const KellerAccel *accel;
    const KellerConeLanes *lanes;
    Seen *seen;
    KellerVisitTriangle visit;
    void *context;
    bool stopped;
    KellerAccelWork *work;
} Segment;

static float visit_segment(void *context, uint32_t b, bool inside, float far)
{
    (void)inside;
    Segment *s = context;
    if (!s->accel->triangles) return far;
    const TriangleBlock *block = &s->accel->triangles[b];
    _Alignas(32) float z1[8], z2[8];
    uint32_t contained, mask = keller_cone_meets_triangle8(s->lanes, block->corner, z1, z2, &contained);
    s->work->triangles += lanes_used(block->id);
    for (; mask; mask &= mask - 1) {
        uint32_t id = block->id[__builtin_ctz(mask)];
        if (id == KELLER_NONE || (s->seen && seen_before(s->seen, id))) continue;
        if (s->visit(s->context, id)) {
            s->stopped = true;
            return -INFINITY;
        }
    }
    return far;
}

bool keller_accel_segment(const KellerAccel *accel, KellerVec3 a, KellerVec3 b, double margin,
                          KellerVisitTriangle visit, void *context, KellerAccelWork *work)
{
    /* a cylinder that reaches `margin` beyond both ends holds all that is within margin of the segment */
    double length = v3_distance(a, b);
    KellerVec3 along = length > 0 ? v3_scale(v3_sub(b, a), 1 / length) : v3(0, 0, 1);
    KellerCone cone = keller_cone_round(v3_madd(v3_sub(a, accel->middle), along, -margin), along, 0);
    cone.x0 = margin;
    cone.z_far = length + 2 * margin;
    KellerConeLanes lanes = keller_cone_lanes(&cone, (KellerRange){0, INFINITY}, accel->size);
    Seen seen;
    Segment s = {accel, &lanes, accel->repeats ? &seen : NULL, visit, context, false, work};
    if (s.seen) seen_start(&seen);
    accel->kind->walk(accel->tree, &lanes, &plain_walk, visit_segment, &s, &work->nodes);
    if (s.seen) seen_end(&seen);
    return s.stopped;
}
