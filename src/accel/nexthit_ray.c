/* Rays: eight triangles at a time in single precision, and keller_ray_triangle on what is left. The error bounds are those of
 * query_ray.c: with M = size + max |o_k|, sheared coordinates are off by less than 12 UNIT M each. */
#include "accel/nexthit.h"
#include "base/number.h"
#include "base/simd.h"

#define UNIT 0x1p-24

/* The frustum of no width, grown by 8 UNIT M, of which the trees' tests of thin frusta read the slabs. */
static void prepare_slabs(KellerNexthit *it, d4 from, KellerVec3 direction, double most, double width)
{
    KellerConeLanes *l = &it->lanes;
    d4 d = d4_set(direction.x, direction.y, direction.z, most), sign = d4_or(d4_set1(1), d4_and(d4_set1(-0.0), d));
    d4 rate = d4_div(sign, d4_max(d4_abs(d), d4_set1(0x1p-26 * most))), grown = d4_mul(sign, d4_set1(width));
    float enter[4], leave[4], rates[4];
    d4_store_floats(enter, d4_add(from, grown));
    d4_store_floats(leave, d4_sub(from, grown));
    d4_store_floats(rates, rate);
    for (int k = 0; k < 3; k++) {
        l->enter[k] = enter[k];
        l->leave[k] = leave[k];
        l->enter_rate[k] = l->leave_rate[k] = rates[k];
    }
    l->near = float_down(it->clip.near);
    l->far = float_up(it->clip.far);
    l->slack = (float)width;
    l->tan_alpha = l->x0 = 0;
}

void nexthit_prepare_ray(KellerNexthit *it, KellerVec3 origin, KellerVec3 direction)
{
    NexthitRay *r = &it->ray;
    KellerVec3 from = v3_sub(origin, it->accel->middle);
    const double o[3] = {from.x, from.y, from.z}, d[3] = {direction.x, direction.y, direction.z};
    r->exact = keller_ray(origin, direction);
    for (int k = 0; k < 3; k++) {
        r->axis[k] = r->exact.axis[k];
        r->origin[k] = (float)o[r->axis[k]];
    }
    double most = d[r->axis[2]], rate = 1 / most, reach = it->accel->size + greater(fabs(o[0]), greater(fabs(o[1]), fabs(o[2])));
    r->shear[0] = (float)r->exact.shear[0];
    r->shear[1] = (float)r->exact.shear[1];
    r->rate = (float)rate;
    r->error = float_up(24 * UNIT * reach);
    r->error_t = float_up(8 * UNIT * reach * fabs(rate));
    prepare_slabs(it, d4_set(o[0], o[1], o[2], 0), direction, fabs(most), 8 * UNIT * reach);
}

typedef struct {
    f8 x, y, t;
} Corner8;

static inline Corner8 corner_of(const NexthitRay *r, const KellerVertex8 *v)
{
    f8 z = f8_sub(f8_load(v->p[r->axis[2]]), f8_set1(r->origin[2]));
    return (Corner8){f8_sub(f8_sub(f8_load(v->p[r->axis[0]]), f8_set1(r->origin[0])), f8_mul(z, f8_set1(r->shear[0]))),
                     f8_sub(f8_sub(f8_load(v->p[r->axis[1]]), f8_set1(r->origin[1])), f8_mul(z, f8_set1(r->shear[1]))),
                     f8_mul(z, f8_set1(r->rate))};
}

/* Adds the lanes in which an edge function is surely above, or below, 0: it is off by error (|p| + |q| + error). */
static inline void judge(const Corner8 *p, const Corner8 *q, f8 size, f8 error, f8 *above, f8 *below)
{
    f8 e = f8_sub(f8_mul(p->x, q->y), f8_mul(p->y, q->x)), bound = f8_mul(error, f8_add(size, error));
    *above = f8_or(*above, f8_lt(bound, e));
    *below = f8_or(*below, f8_lt(e, f8_neg(bound)));
}

/* Lanes whose triangle the ray may meet between `first` and `far`. */
static inline uint32_t may_meet(const NexthitRay *r, const TriangleBlock *block, float first, float far)
{
    const Corner8 a = corner_of(r, &block->corner[0]), b = corner_of(r, &block->corner[1]), c = corner_of(r, &block->corner[2]);
    f8 error = f8_set1(r->error), above = f8_set1(0), below = above;
    f8 sa = f8_add(f8_abs(a.x), f8_abs(a.y)), sb = f8_add(f8_abs(b.x), f8_abs(b.y)), sc = f8_add(f8_abs(c.x), f8_abs(c.y));
    judge(&a, &b, f8_add(sa, sb), error, &above, &below);
    judge(&b, &c, f8_add(sb, sc), error, &above, &below);
    judge(&c, &a, f8_add(sc, sa), error, &above, &below);
    f8 low = f8_sub(f8_min(a.t, f8_min(b.t, c.t)), f8_set1(r->error_t));
    f8 high = f8_add(f8_max(a.t, f8_max(b.t, c.t)), f8_set1(r->error_t));
    f8 within = f8_and(f8_le(low, f8_set1(far)), f8_le(f8_set1(first), high));
    return (uint32_t)f8_mask(f8_andnot(f8_and(above, below), within));
}

uint32_t nexthit_ray_block(KellerNexthit *it, uint32_t number, double far, Found hit[8])
{
    const TriangleBlock *block = &it->accel->triangles[number];
    const KellerRange clip = {it->clip.near, lesser(far, it->clip.far)};
    uint32_t n = 0;
    it->work->triangles += lanes_used(block->id);
    for (uint32_t mask = may_meet(&it->ray, block, it->lanes.near, float_up(clip.far)); mask; mask &= mask - 1) {
        uint32_t id = block->id[__builtin_ctz(mask)];
        KellerVec3 v[3];
        double t;
        if (id == KELLER_NONE) continue;
        triangle_of(it->accel, id, v);
        if (keller_ray_triangle(&it->ray.exact, v[0], v[1], v[2], clip, &t, NULL)) hit[n++] = found_of(it, t, id, v);
    }
    return n;
}
