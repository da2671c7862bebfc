/* Rays. Leaves are tested eight triangles at a time in single precision, by the edge functions of keller/ray.h with their error
 * bounds: most triangles are surely missed, some surely hit, and few are left to keller_ray_triangle: of a nearest hit, what
 * may be nearer than the nearest sure one. */
#include <omp.h>

#include "accel/bvh8.h"
#include "accel/leaf.h"
#include "base/number.h"
#include "keller/ray.h"

#define UNIT 0x1p-24
/* In units of M = size + max |o_k|, which no coordinate relative to the origin exceeds. Boxes are grown by 8 (cone_lanes.c asks
 * for 6). Sheared coordinates x' = x - Sx z, y' = y - Sy z with |Sx|, |Sy| <= 1 are off by less than 12 each: vertex and
 * origin rounded, two differences, Sx and a product (9), the vertex's shares (2). An edge function b x c is off by
 * error (|b| + |c| + error), error being 2 x 12 for the coordinates and the rest for its own roundings. t of a corner is off
 * by 8 |1/d|, and the mean of three t, with weights of one sign, by 5 more. */
#define BOX_ERROR (8 * UNIT)
#define EDGE_ERROR (24 * UNIT)
#define T_ERROR (16 * UNIT)

enum { CANDIDATES = 16 };

typedef struct {
    const KellerAccel *accel;
    KellerVec3 origin, direction;
    KellerRange clip;
    int axis[3];                    /* two lesser ones, then the one along which the direction is greatest */
    float from[3], shear[2], rate;  /* rate: t for a unit of z */
    float edge_error, t_error;
    float near, inner_near, inner_far; /* clip: near rounded down; near and far rounded inwards */
    uint32_t count;                 /* of triangles that may be hit, at t = low or later */
    struct {
        uint32_t leaf, lane;
        float low;
    } candidate[CANDIDATES];
    bool found;
    KellerRayHit hit;
    Seen *seen;                     /* ALL: NULL where triangles are in one leaf each */
    KellerVisitRay visit;
    void *context;
    KellerAccelWork *work;
} Query;

/* The ray as a frustum of no width, z being t: what a walk reads of thin ones. */
static void prepare(const KellerAccel *a, KellerVec3 origin, KellerVec3 direction, KellerRange clip, KellerAccelWork *work,
                    Query *q, KellerConeLanes *l)
{
    /* one by one: clearing all of it first would cost as much as the rest */
    q->accel = a;
    q->origin = origin;
    q->direction = direction;
    q->clip = clip;
    q->work = work;
    q->count = 0;
    q->found = false;
    KellerVec3 from = v3_sub(origin, a->middle);
    const double o[3] = {from.x, from.y, from.z}, d[3] = {direction.x, direction.y, direction.z};
    double x = fabs(d[0]), y = fabs(d[1]), z = fabs(d[2]), most = greater(x, greater(y, z));
    int last = z >= most ? 2 : y >= most ? 1 : 0;
    q->axis[0] = last == 0 ? 1 : 0;
    q->axis[1] = last == 2 ? 1 : 2;
    q->axis[2] = last;
    double reach = a->size + greater(fabs(o[0]), greater(fabs(o[1]), fabs(o[2]))), width = BOX_ERROR * reach;
    d4 D = d4_set(d[0], d[1], d[2], most), sign = d4_or(d4_set1(1), d4_and(d4_set1(-0.0), D));
    d4 rate = d4_div(sign, d4_max(d4_abs(D), d4_set1(0x1p-26 * most))), at = d4_set(o[0], o[1], o[2], 0);
    double inverse = d4_first(d4_div(d4_set1(1), d4_set1(d[last])));
    d4_store_floats(l->enter, d4_add(at, d4_mul(sign, d4_set1(width))));
    d4_store_floats(l->leave, d4_sub(at, d4_mul(sign, d4_set1(width))));
    d4_store_floats(l->enter_rate, rate);
    d4_store_floats(l->leave_rate, rate);
    l->tan_alpha = l->x0 = 0;
    l->slack = (float)width;
    l->near = q->near = float_down(clip.near);
    l->far = float_up(clip.far);
    q->inner_near = float_up(clip.near);
    q->inner_far = float_down(clip.far);
    for (int k = 0; k < 3; k++) q->from[k] = (float)o[q->axis[k]];
    q->shear[0] = (float)(d[q->axis[0]] * inverse);
    q->shear[1] = (float)(d[q->axis[1]] * inverse);
    q->rate = (float)inverse;
    q->edge_error = (float)(1.0001 * EDGE_ERROR * reach);
    q->t_error = (float)(1.0001 * T_ERROR * reach * fabs(inverse));
}

/* The lanes of a block whose triangle the ray may meet between `near` and `far`, from low on; *sure: surely meets within the
 * clip, at most at high. 32-byte aligned. */
static inline uint32_t meets(const Query *q, const TriangleBlock *block, float far, uint32_t *sure, float low[8], float high[8])
{
    f8 x[3], y[3], t[3], s[3], e[3], bound[3], error = f8_set1(q->edge_error), t_error = f8_set1(q->t_error);
    for (int j = 0; j < 3; j++) {
        const KellerVertex8 *v = &block->corner[j];
        f8 z = f8_sub(f8_load(v->p[q->axis[2]]), f8_set1(q->from[2]));
        x[j] = f8_sub(f8_sub(f8_load(v->p[q->axis[0]]), f8_set1(q->from[0])), f8_mul(z, f8_set1(q->shear[0])));
        y[j] = f8_sub(f8_sub(f8_load(v->p[q->axis[1]]), f8_set1(q->from[1])), f8_mul(z, f8_set1(q->shear[1])));
        t[j] = f8_mul(z, f8_set1(q->rate));
        s[j] = f8_add(f8_abs(x[j]), f8_abs(y[j]));
    }
    for (int j = 0; j < 3; j++) { /* the function of the side opposite to corner j */
        int a = (j + 1) % 3, b = (j + 2) % 3;
        e[j] = f8_sub(f8_mul(x[a], y[b]), f8_mul(y[a], x[b]));
        bound[j] = f8_mul(error, f8_add(f8_add(s[a], s[b]), error));
    }
    f8 beyond = f8_min(f8_sub(e[0], bound[0]), f8_min(f8_sub(e[1], bound[1]), f8_sub(e[2], bound[2]))), zero = f8_set1(0);
    f8 before = f8_max(f8_add(e[0], bound[0]), f8_max(f8_add(e[1], bound[1]), f8_add(e[2], bound[2])));
    f8 negative = f8_or(f8_lt(e[0], f8_neg(bound[0])), f8_or(f8_lt(e[1], f8_neg(bound[1])), f8_lt(e[2], f8_neg(bound[2]))));
    f8 positive = f8_or(f8_lt(bound[0], e[0]), f8_or(f8_lt(bound[1], e[1]), f8_lt(bound[2], e[2])));
    f8 first = f8_min(t[0], f8_min(t[1], t[2])), last = f8_max(t[0], f8_max(t[1], t[2]));
    f8 in = f8_and(f8_le(f8_sub(first, t_error), f8_set1(far)), f8_le(f8_set1(q->near), f8_add(last, t_error)));
    uint32_t mask = (uint32_t)f8_mask(f8_andnot(f8_and(positive, negative), in));
    *sure = 0;
    if (!mask) return 0;
    /* with weights E_j for e_j the mean of the t_j changes by |sum (E_j - e_j) (t_j - mean)| / |sum E_j| */
    f8 sum = f8_add(e[0], f8_add(e[1], e[2])), off = f8_add(bound[0], f8_add(bound[1], bound[2]));
    f8 mean = f8_div(f8_add(f8_mul(e[0], t[0]), f8_add(f8_mul(e[1], t[1]), f8_mul(e[2], t[2]))), sum);
    f8 wrong = f8_div(f8_mul(f8_sub(last, first), f8_mul(off, f8_set1(1.001f))), f8_sub(f8_abs(sum), off));
    f8 margin = f8_add(wrong, t_error), begin = f8_sub(mean, margin), end = f8_add(mean, margin);
    f8 one_side = f8_or(f8_lt(zero, beyond), f8_lt(before, zero));
    f8 certain = f8_and(one_side, f8_and(f8_le(f8_set1(q->inner_near), begin), f8_le(end, f8_set1(q->inner_far))));
    *sure = (uint32_t)f8_mask(certain);
    f8_store(low, f8_max(f8_blend(one_side, begin, f8_sub(first, t_error)), f8_sub(first, t_error)));
    f8_store(high, end);
    return mask;
}

/* Decides candidates in double precision. Nearest: all that may still be; `any`: until one is hit. */
static float decide(Query *q, bool any, float far)
{
    KellerRay exact = keller_ray(q->origin, q->direction);
    for (uint32_t i = 0; i < q->count; i++) {
        if (q->candidate[i].low > far) continue;
        const TriangleBlock *block = &q->accel->triangles[q->candidate[i].leaf];
        int lane = (int)q->candidate[i].lane;
        KellerVec3 v[3];
        KellerRayHit hit = {.triangle = block->id[lane]};
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

static inline __attribute__((always_inline)) float visit_first(Query *q, uint32_t leaf, float far, bool any)
{
    _Alignas(32) float low[8], high[8];
    const TriangleBlock *block = &q->accel->triangles[leaf];
    uint32_t sure, mask = meets(q, block, far, &sure, low, high);
    q->work->triangles += lanes_used(block->id);
    if (!mask) return far;
    for (uint32_t rest = sure & mask; rest; rest &= rest - 1) {
        float end = high[__builtin_ctz(rest)];
        far = end < far ? end : far;
    }
    if (any && sure & mask) {
        q->found = true;
        return -INFINITY;
    }
    for (; mask; mask &= mask - 1) {
        int i = __builtin_ctz(mask);
        if (block->id[i] == KELLER_NONE || low[i] > far) continue;
        if (q->count == CANDIDATES) far = decide(q, any, far);
        if (any && q->found) return -INFINITY;
        q->candidate[q->count].leaf = leaf;
        q->candidate[q->count].lane = (uint32_t)i;
        q->candidate[q->count++].low = low[i];
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

static float visit_all(void *context, uint32_t leaf, bool inside, float far)
{
    (void)inside;
    Query *q = context;
    _Alignas(32) float low[8], high[8];
    const TriangleBlock *block = &q->accel->triangles[leaf];
    uint32_t sure, mask = meets(q, block, far, &sure, low, high);
    q->work->triangles += lanes_used(block->id);
    if (!mask) return far;
    KellerRay exact = keller_ray(q->origin, q->direction);
    for (; mask; mask &= mask - 1) {
        KellerVec3 v[3];
        int lane = __builtin_ctz(mask);
        KellerRayHit hit = {.triangle = block->id[lane]};
        if (hit.triangle == KELLER_NONE) continue;
        triangle_in(q->accel, block, lane, v);
        if (!keller_ray_triangle(&exact, v[0], v[1], v[2], q->clip, &hit.t, NULL)) continue;
        if (q->seen && seen_before(q->seen, hit.triangle)) continue;
        q->found = q->visit(q->context, hit);
        if (q->found) return -INFINITY;
    }
    return far;
}

static const WalkHow plain_walk = {0};

#define WALK(q, lanes, visit)                                                                                          \
    do {                                                                                                               \
        const KellerAccel *a_ = (q)->accel;                                                                            \
        uint64_t *nodes_ = &(q)->work->nodes;                                                                          \
        if (!a_->triangles) break;                                                                                     \
        if (a_->kind == &tree_bvh8) bvh8_walk_thin(a_->tree, lanes, visit, q, a_->triangles, nodes_);                                 \
        else a_->kind->walk(a_->tree, lanes, &plain_walk, visit, q, nodes_);                                                 \
    } while (0)

bool keller_accel_ray_nearest(const KellerAccel *accel, KellerVec3 origin, KellerVec3 direction, KellerRange clip,
                              KellerRayHit *hit, KellerAccelWork *work)
{
    Query q;
    KellerConeLanes lanes;
    prepare(accel, origin, direction, clip, work, &q, &lanes);
    WALK(&q, &lanes, visit_nearest);
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
    WALK(&q, &lanes, visit_any);
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
    WALK(&q, &lanes, visit_all);
    if (q.seen) seen_end(&seen);
    return q.found;
}

void keller_accel_rays_nearest(const KellerAccel *accel, size_t count, const KellerVec3 *origins,
                               const KellerVec3 *directions, KellerRange clip, KellerRayHit *hits, int threads,
                               KellerAccelWork *work)
{
    uint64_t nodes = 0, triangles = 0;
#pragma omp parallel for schedule(dynamic, 256) reduction(+ : nodes, triangles) num_threads(threads > 0 ? threads : omp_get_max_threads())
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
