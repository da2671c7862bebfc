/* Rays: eight triangles at a time in single precision, and keller_ray_triangle on what is left. The error bounds are those of
 * query_ray.c: with M = size + max |o_k|, sheared coordinates are off by less than 12 UNIT M each. */
#include "accel/nexthit.h"
#include "base/number.h"
#include "base/simd.h"

#define UNIT 0x1p-24

/* Boxes are grown by 8 UNIT M (cone_lanes.c asks for 6). The errors have a thousandth to spare for being rounded to nearest. */
void nexthit_prepare_ray(KellerNexthit *it, KellerVec3 origin, KellerVec3 direction)
{
    NexthitRay *r = &it->ray;
    const KellerVec3 from = v3_sub(origin, it->accel->middle);
    const double o[3] = {from.x, from.y, from.z}, d[3] = {direction.x, direction.y, direction.z};
    double x = fabs(d[0]), y = fabs(d[1]), z = fabs(d[2]), most = greater(x, greater(y, z));
    int last = z >= most ? 2 : y >= most ? 1 : 0;
    double reach = it->accel->size + greater(fabs(o[0]), greater(fabs(o[1]), fabs(o[2])));
    d4 D = d4_set(d[0], d[1], d[2], d[last]), at = d4_set(o[0], o[1], o[2], 0), sign = d4_or(d4_set1(1), d4_and(d4_set1(-0.0), D));
    d4 rate = d4_div(sign, d4_max(d4_abs(D), d4_set1(0x1p-26 * most))), grown = d4_mul(sign, d4_set1(8 * UNIT * reach));
    double rates[4];
    d4_store(rates, rate);
    d4_store_floats(r->lanes.enter, d4_add(at, grown));
    d4_store_floats(r->lanes.leave, d4_sub(at, grown));
    d4_store_floats(r->lanes.rate, rate);
    r->lanes.near = float_down(it->clip.near);
    r->lanes.far = float_up(it->clip.far);
    r->origin = origin;
    r->direction = direction;
    r->made = false;
    r->axis[0] = last == 0;
    r->axis[1] = last == 2 ? 1 : 2;
    r->axis[2] = last;
    for (int k = 0; k < 3; k++) r->from[k] = (float)o[r->axis[k]];
    r->rate = (float)rates[3];
    r->shear[0] = (float)(d[r->axis[0]] * rates[3]);
    r->shear[1] = (float)(d[r->axis[1]] * rates[3]);
    r->error = (float)(1.001 * 24 * UNIT * reach);
    r->t_error = (float)(1.001 * 8 * UNIT * reach * fabs(rates[3]));
}

typedef struct {
    f8 x, y, t;
} Corner8;

static inline Corner8 corner_of(const NexthitRay *r, const KellerVertex8 *v)
{
    f8 z = f8_sub(f8_load(v->p[r->axis[2]]), f8_set1(r->from[2]));
    return (Corner8){f8_sub(f8_sub(f8_load(v->p[r->axis[0]]), f8_set1(r->from[0])), f8_mul(z, f8_set1(r->shear[0]))),
                     f8_sub(f8_sub(f8_load(v->p[r->axis[1]]), f8_set1(r->from[1])), f8_mul(z, f8_set1(r->shear[1]))),
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
    f8 low = f8_sub(f8_min(a.t, f8_min(b.t, c.t)), f8_set1(r->t_error));
    f8 high = f8_add(f8_max(a.t, f8_max(b.t, c.t)), f8_set1(r->t_error));
    f8 within = f8_and(f8_le(low, f8_set1(far)), f8_le(f8_set1(first), high));
    return (uint32_t)f8_mask(f8_andnot(f8_and(above, below), within));
}

uint32_t nexthit_ray_block(KellerNexthit *it, uint32_t number, double far, Found hit[8])
{
    const TriangleBlock *block = &it->accel->triangles[number];
    NexthitRay *r = &it->ray;
    const KellerRange clip = {it->clip.near, lesser(far, it->clip.far)};
    /* wanted in part, and two steps away: a triangle's vertices are found by its numbers */
    for (int i = 0; i < 8; i++) __builtin_prefetch(&it->accel->input.triangles[block->id[i] == KELLER_NONE ? 0 : block->id[i]]);
    uint32_t n = 0, mask = may_meet(r, block, r->lanes.near, float_up(clip.far));
    it->work->triangles += lanes_used(block->id);
    if (mask && !r->made) {
        r->exact = keller_ray(r->origin, r->direction);
        r->made = true;
    }
    for (; mask; mask &= mask - 1) {
        uint32_t id = block->id[__builtin_ctz(mask)];
        KellerVec3 v[3];
        double t;
        if (id == KELLER_NONE) continue;
        triangle_of(it->accel, id, v);
        if (keller_ray_triangle(&r->exact, v[0], v[1], v[2], clip, &t, NULL)) hit[n++] = found_of(it, t, id);
    }
    return n;
}
