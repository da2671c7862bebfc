/* Rays: the walk with a frustum of no width, then eight triangles at a time in single precision (the edge functions of
 * keller/ray.h with their error bounds), then keller_ray_triangle on what is left. */
#include <omp.h>

#include "accel/leaf.h"
#include "base/number.h"
#include "base/simd.h"
#include "keller/ray.h"

#define UNIT 0x1p-24

/* What a leaf needs. Sheared coordinates x' = x - Sx z, y' = y - Sy z with |Sx|, |Sy| <= 1 are off by less than 12 UNIT M each,
 * M = size + max |o_k|: vertex and origin rounded, two differences, Sx and a product (9 M), the vertex's shares (2 M). */
typedef struct {
    const KellerAccel *accel;
    KellerRay exact;
    KellerRange clip;
    int axis[3];
    float origin[3], shear[2], rate; /* rate: t for a unit of z */
    float error, error_t;
    float first;                    /* clip.near, rounded down */
    Seen *seen;                     /* NULL: repeats do no harm */
    KellerVisitRay visit;           /* NULL: nearest, or any */
    void *context;
    bool any, found;
    KellerRayHit hit;
    KellerAccelWork *work;
} Query;

/* A frustum of no width; z is t. Only what the walk reads of thin cones is set. Boxes are grown by 8 UNIT M (cone_lanes.c asks for 6). */
static void prepare(const KellerAccel *a, KellerVec3 origin, KellerVec3 direction, KellerRange clip, KellerAccelWork *work,
                    Query *q, KellerConeLanes *l)
{
    /* one by one: clearing all of both first would cost as much as the rest */
    q->accel = a;
    q->clip = clip;
    q->work = work;
    q->seen = NULL;
    q->visit = NULL;
    q->context = NULL;
    q->any = q->found = false;
    KellerVec3 from = v3_sub(origin, a->middle);
    const double o[3] = {from.x, from.y, from.z}, d[3] = {direction.x, direction.y, direction.z};
    double most = greater(fabs(d[0]), greater(fabs(d[1]), fabs(d[2])));
    double reach = a->size + greater(fabs(o[0]), greater(fabs(o[1]), fabs(o[2]))), width = 8 * UNIT * reach;
    l->near = float_down(clip.near);
    l->far = float_up(clip.far);
    l->slack = (float)width;
    l->tan_alpha = l->x0 = 0;
    d4 D = d4_set(d[0], d[1], d[2], most), sign = d4_or(d4_set1(1), d4_and(d4_set1(-0.0), D));
    d4 rate = d4_div(sign, d4_max(d4_abs(D), d4_set1(0x1p-26 * most))), at = d4_set(o[0], o[1], o[2], 0);
    float lane[3][4];
    d4_store_floats(lane[0], d4_add(at, d4_mul(sign, d4_set1(width))));
    d4_store_floats(lane[1], d4_sub(at, d4_mul(sign, d4_set1(width))));
    d4_store_floats(lane[2], rate);
    for (int k = 0; k < 3; k++) {
        l->enter[k] = lane[0][k];
        l->leave[k] = lane[1][k];
        l->enter_rate[k] = l->leave_rate[k] = lane[2][k];
    }
    q->exact = keller_ray(origin, direction);
    for (int k = 0; k < 3; k++) {
        q->axis[k] = q->exact.axis[k];
        q->origin[k] = (float)o[q->axis[k]];
    }
    q->shear[0] = (float)q->exact.shear[0];
    q->shear[1] = (float)q->exact.shear[1];
    q->rate = (float)(1 / d[q->axis[2]]);
    q->error = float_up(24 * UNIT * reach);
    q->error_t = float_up(8 * UNIT * reach * fabs(1 / d[q->axis[2]]));
    q->first = l->near;
}

/* Lanes of a block whose triangle the ray may meet between `first` and `far`. An edge function b x c is off by
 * error (|b| + |c| + error): 2 x 12 UNIT M for the coordinates, the rest for its own roundings. */
static inline uint32_t may_meet(const Query *q, const TriangleBlock *block, float far)
{
    f8 x[3], y[3], t[3], error = f8_set1(q->error), zero = f8_set1(0);
    for (int j = 0; j < 3; j++) {
        const KellerVertex8 *v = &block->corner[j];
        f8 z = f8_sub(f8_load(v->p[q->axis[2]]), f8_set1(q->origin[2]));
        x[j] = f8_sub(f8_sub(f8_load(v->p[q->axis[0]]), f8_set1(q->origin[0])), f8_mul(z, f8_set1(q->shear[0])));
        y[j] = f8_sub(f8_sub(f8_load(v->p[q->axis[1]]), f8_set1(q->origin[1])), f8_mul(z, f8_set1(q->shear[1])));
        t[j] = f8_mul(z, f8_set1(q->rate));
    }
    f8 positive = f8_lt(zero, zero), negative = positive, s[3];
    for (int j = 0; j < 3; j++) s[j] = f8_add(f8_abs(x[j]), f8_abs(y[j]));
    for (int j = 0; j < 3; j++) {
        int k = (j + 1) % 3;
        f8 e = f8_sub(f8_mul(x[j], y[k]), f8_mul(y[j], x[k]));
        f8 bound = f8_mul(error, f8_add(f8_add(s[j], s[k]), error));
        positive = f8_or(positive, f8_lt(bound, e));
        negative = f8_or(negative, f8_lt(e, f8_neg(bound)));
    }
    f8 low = f8_sub(f8_min(t[0], f8_min(t[1], t[2])), f8_set1(q->error_t)),
       high = f8_add(f8_max(t[0], f8_max(t[1], t[2])), f8_set1(q->error_t));
    f8 in = f8_and(f8_le(low, f8_set1(far)), f8_le(f8_set1(q->first), high));
    return (uint32_t)f8_mask(f8_andnot(f8_and(positive, negative), in));
}

static float visit_block(void *context, uint32_t b, bool inside, float far)
{
    (void)inside;
    Query *q = context;
    const TriangleBlock *block = &q->accel->triangles[b];
    q->work->triangles += lanes_used(block->id);
    for (uint32_t mask = may_meet(q, block, far); mask; mask &= mask - 1) {
        uint32_t id = block->id[__builtin_ctz(mask)];
        KellerVec3 v[3];
        KellerRayHit hit = {.triangle = id};
        if (id == KELLER_NONE) continue;
        triangle_of(q->accel, id, v);
        KellerRange clip = q->clip;
        if (!q->visit && !q->any && q->found) clip.far = q->hit.t;
        if (!keller_ray_triangle(&q->exact, v[0], v[1], v[2], clip, &hit.t, NULL)) continue;
        if (q->visit) {
            if (q->seen && seen_before(q->seen, id)) continue;
            q->found = q->visit(q->context, hit);
            if (q->found) return -INFINITY;
            continue;
        }
        if (!q->found || hit.t < q->hit.t || (hit.t == q->hit.t && id < q->hit.triangle)) q->hit = hit;
        q->found = true;
        if (q->any) return -INFINITY;
        float nearer = float_up(hit.t);
        far = nearer < far ? nearer : far;
    }
    return far;
}

static void walk(Query *q, const KellerConeLanes *lanes)
{
    const KellerAccel *a = q->accel;
    a->kind->walk(a->triangle_tree, lanes, false, visit_block, q, &q->work->nodes);
}

bool keller_accel_ray_nearest(const KellerAccel *accel, KellerVec3 origin, KellerVec3 direction, KellerRange clip,
                              KellerRayHit *hit, KellerAccelWork *work)
{
    Query q;
    KellerConeLanes lanes;
    prepare(accel, origin, direction, clip, work, &q, &lanes);
    walk(&q, &lanes);
    if (q.found) *hit = q.hit;
    return q.found;
}

bool keller_accel_ray_any(const KellerAccel *accel, KellerVec3 origin, KellerVec3 direction, KellerRange clip,
                          KellerAccelWork *work)
{
    Query q;
    KellerConeLanes lanes;
    prepare(accel, origin, direction, clip, work, &q, &lanes);
    q.any = true;
    walk(&q, &lanes);
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
    if (accel->repeats) {
        q.seen = &seen;
        seen_start(&seen);
    }
    walk(&q, &lanes);
    if (accel->repeats) seen_end(&seen);
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
    accel->kind->walk(accel->triangle_tree, &lanes, false, visit_segment, &s, &work->nodes);
    if (s.seen) seen_end(&seen);
    return s.stopped;
}
