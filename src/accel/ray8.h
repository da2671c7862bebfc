/* A ray against blocks of eight triangles in single precision, by the edge functions of keller/ray.h with their error bounds:
 * most triangles are surely missed, some surely hit, and few are left to keller_ray_triangle. */
#ifndef KELLER_ACCEL_RAY8_H
#define KELLER_ACCEL_RAY8_H
#include "accel/leaf.h"
#include "base/simd.h"

typedef struct {
    KellerVec3 origin, direction;
    int axis[3];                    /* two lesser ones, then the one along which the direction is greatest */
    float from[3], shear[2], rate;  /* x' = x - shear z and so for y; rate: t for a unit of z */
    float edge_error, t_error;      /* of sheared coordinates, twice; of t */
} Ray8;

/* Makes a ray ready, and *slabs what walks read of thin frusta, z being t: slabs, near and far. */
void ray8_make(const KellerAccel *accel, KellerVec3 origin, KellerVec3 direction, KellerRange clip, Ray8 *ray,
               KellerConeLanes *slabs);

/* What "ubvh" reads of a ray besides: origin, directrix and slack, that of a frustum. */
void ray8_origin(const KellerAccel *accel, const Ray8 *ray, KellerConeLanes *slabs);

/* What the test of a block leaves for ray8_sure. */
typedef struct {
    f8 t[3], e[3], bound[3], first, last; /* of the corners; of the sides opposite to them; least and greatest t */
} Ray8Block;

/* The lanes of a block whose triangle the ray may meet between `near` and `far`. */
static inline uint32_t ray8_meets(const Ray8 *q, const TriangleBlock *block, float near, float far, Ray8Block *b)
{
    f8 x[3], y[3], s[3], error = f8_set1(q->edge_error), t_error = f8_set1(q->t_error);
    for (int j = 0; j < 3; j++) {
        const KellerVertex8 *v = &block->corner[j];
        f8 z = f8_sub(f8_load(v->p[q->axis[2]]), f8_set1(q->from[2]));
        x[j] = f8_sub(f8_sub(f8_load(v->p[q->axis[0]]), f8_set1(q->from[0])), f8_mul(z, f8_set1(q->shear[0])));
        y[j] = f8_sub(f8_sub(f8_load(v->p[q->axis[1]]), f8_set1(q->from[1])), f8_mul(z, f8_set1(q->shear[1])));
        b->t[j] = f8_mul(z, f8_set1(q->rate));
        s[j] = f8_add(f8_abs(x[j]), f8_abs(y[j]));
    }
    f8 above = f8_set1(0), below = above;
    for (int j = 0; j < 3; j++) {
        int a = (j + 1) % 3, c = (j + 2) % 3;
        b->e[j] = f8_sub(f8_mul(x[a], y[c]), f8_mul(y[a], x[c]));
        b->bound[j] = f8_mul(error, f8_add(f8_add(s[a], s[c]), error));
        above = f8_or(above, f8_lt(b->bound[j], b->e[j]));
        below = f8_or(below, f8_lt(b->e[j], f8_neg(b->bound[j])));
    }
    b->first = f8_sub(f8_min(b->t[0], f8_min(b->t[1], b->t[2])), t_error);
    b->last = f8_add(f8_max(b->t[0], f8_max(b->t[1], b->t[2])), t_error);
    f8 in = f8_and(f8_le(b->first, f8_set1(far)), f8_le(f8_set1(near), b->last));
    return (uint32_t)f8_mask(f8_andnot(f8_and(above, below), in));
}

/* The lanes whose triangle is surely met within [near, far], at high or before. low: where it is met at the earliest, for all
 * lanes. 32-byte aligned. With weights E_j for e_j the mean of the t_j changes by |sum (E_j - e_j) (t_j - mean)| / |sum E_j|. */
static inline uint32_t ray8_sure(const Ray8 *q, const Ray8Block *b, float near, float far, float low[8], float high[8])
{
    const f8 *e = b->e, *bound = b->bound, *t = b->t;
    f8 above = f8_min(f8_sub(e[0], bound[0]), f8_min(f8_sub(e[1], bound[1]), f8_sub(e[2], bound[2]))), zero = f8_set1(0);
    f8 below = f8_max(f8_add(e[0], bound[0]), f8_max(f8_add(e[1], bound[1]), f8_add(e[2], bound[2])));
    f8 sum = f8_add(e[0], f8_add(e[1], e[2])), off = f8_add(bound[0], f8_add(bound[1], bound[2]));
    /* quotients first: products of areas and lengths would leave single precision sooner */
    f8 inverse = f8_div(f8_set1(1), sum);
    f8 mean = f8_add(f8_mul(f8_mul(e[0], inverse), t[0]),
                     f8_add(f8_mul(f8_mul(e[1], inverse), t[1]), f8_mul(f8_mul(e[2], inverse), t[2])));
    f8 wrong = f8_mul(f8_div(f8_mul(off, f8_set1(1.001f)), f8_sub(f8_abs(sum), off)), f8_sub(b->last, b->first));
    f8 margin = f8_add(wrong, f8_set1(q->t_error)), begin = f8_sub(mean, margin), end = f8_add(mean, margin);
    f8 one_side = f8_or(f8_lt(zero, above), f8_lt(below, zero));
    f8_store(low, f8_max(f8_blend(one_side, begin, b->first), b->first));
    f8_store(high, end);
    return (uint32_t)f8_mask(f8_and(one_side, f8_and(f8_le(f8_set1(near), begin), f8_le(end, f8_set1(far)))));
}
#endif
