/* One box against a frustum made ready for eight: the tests of src/geom/cone_lanes.c, lane for lane, to be inlined. */
#ifndef KELLER_ACCEL_BOX_H
#define KELLER_ACCEL_BOX_H
#include <math.h>
#include "accel/internal.h"
#include "base/simd.h"
#include "geom/cone_lanes.h"

static inline float box_dot(const float a[3], const float b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* The bounds on z that the half-space beyond `first` (the side that the frustum comes from) sets along axis k, and that on
 * this side of `last`: form (a) there. */
static inline void box_enter(const KellerConeLanes *c, int k, float first, float *near)
{
    float in = (first - c->enter[k]) * c->enter_rate[k];
    *near = in > *near ? in : *near;
}

static inline void box_leave(const KellerConeLanes *c, int k, float last, float *near, float *far)
{
    float out = (last - c->leave[k]) * c->leave_rate[k];
    if ((c->enter_rate[k] < 0) == (c->leave_rate[k] < 0)) *far = out < *far ? out : *far;
    else *near = out > *near ? out : *near; /* opens wider than it leans */
}

/* What only wide frusta are asked: the box's own z, and the plane that supports the frustum on the side of its centre. */
static inline bool box_meets_wide(const KellerConeLanes *c, const float lower[3], const float upper[3], float *near,
                                  float *far)
{
    float p[3], h[3]; /* centre and extents, doubled */
    for (int k = 0; k < 3; k++) {
        p[k] = lower[k] + upper[k] - 2 * c->origin[k];
        h[k] = upper[k] - lower[k];
    }
    const float *X = c->axis[0], *Y = c->axis[1], *D = c->axis[2];
    float x = box_dot(p, X), y = box_dot(p, Y), z = box_dot(p, D), square = x * x + y * y;
    float rho = sqrtf(square > 1e-30f ? square : 1e-30f), slope = rho * c->tan_alpha, reach = 0, reach_z = 0;
    for (int k = 0; k < 3; k++) {
        reach += fabsf(x * X[k] + y * Y[k] - slope * D[k]) * h[k];
        reach_z += fabsf(D[k]) * h[k];
    }
    if (square - slope * z - reach > rho * (2 * c->x0)) return false;
    float low = (z - reach_z) * 0.5f - c->slack, high = (z + reach_z) * 0.5f + c->slack;
    *near = low > *near ? low : *near;
    *far = high < *far ? high : *far;
    return true;
}

static inline bool box_meets(const KellerConeLanes *c, bool wide, const float lower[3], const float upper[3],
                             float *distance)
{
    float near = c->near, far = c->far;
    if (lower[0] > upper[0]) return false;
    for (int k = 0; k < 3; k++) {
        bool down = c->enter_rate[k] < 0; /* upper is the side that the frustum enters by */
        box_enter(c, k, down ? upper[k] : lower[k], &near);
        box_leave(c, k, down ? lower[k] : upper[k], &near, &far);
    }
    if (wide && !box_meets_wide(c, lower, upper, &near, &far)) return false;
    *distance = near;
    return near <= far;
}

/* Where the box begins, whether or not the frustum meets it. */
static inline float box_begins(const KellerConeLanes *c, const float lower[3], const float upper[3])
{
    float low = -c->slack;
    for (int k = 0; k < 3; k++) {
        float D = c->axis[2][k];
        low += D * ((D < 0 ? upper[k] : lower[k]) - c->origin[k]);
    }
    return low;
}

static inline KellerVec3 box_corner(const float p[3]) { return v3((double)p[0], (double)p[1], (double)p[2]); }

/* What orders a box among its siblings; slabs: where the frustum's bounds on it begin. */
static inline float box_key(const KellerConeLanes *c, const WalkHow *how, const float lower[3], const float upper[3],
                            float slabs)
{
    const float *D = c->axis[2];
    float key = -INFINITY;
    switch (how->order) {
    case KELLER_ORDER_EXACT:
        return (float)keller_cone_box(how->cone, box_corner(lower), box_corner(upper), (KellerRange){0, INFINITY}, NULL, NULL).near;
    case KELLER_ORDER_DIRECTRIX:
        for (int k = 0; k < 3; k++) {
            float in = ((D[k] < 0 ? upper[k] : lower[k]) - c->origin[k]) / D[k];
            key = in > key ? in : key; /* parallel to the sides: infinite or not a number, and then no bound */
        }
        return key < INFINITY ? key : slabs;
    case KELLER_ORDER_MIDPOINT:
        key = 0;
        for (int k = 0; k < 3; k++) key += D[k] * (0.5f * (lower[k] + upper[k]) - c->origin[k]);
        return key;
    default:
        return slabs;
    }
}

/* The accurate test, for a leaf's box. */
static inline bool box_meets_exactly(const WalkHow *how, const float lower[3], const float upper[3])
{
    return keller_cone_meets_box(how->cone, box_corner(lower), box_corner(upper), (KellerRange){0, INFINITY});
}

static inline f8 box_form(const f8 q[3], const float a[3])
{
    return f8_add(f8_add(f8_mul(q[0], f8_set1(a[0])), f8_mul(q[1], f8_set1(a[1]))), f8_mul(q[2], f8_set1(a[2])));
}

/* All corners in, and by more than the rounding errors: `inset` and twice the slack of z, as for triangles in
 * cone_leaf.c. */
static inline bool box_contained(const KellerConeLanes *c, const float l[3], const float u[3])
{
    const f8 q[3] = {f8_sub(f8_set(l[0], u[0], l[0], u[0], l[0], u[0], l[0], u[0]), f8_set1(c->origin[0])),
                     f8_sub(f8_set(l[1], l[1], u[1], u[1], l[1], l[1], u[1], u[1]), f8_set1(c->origin[1])),
                     f8_sub(f8_set(l[2], l[2], l[2], l[2], u[2], u[2], u[2], u[2]), f8_set1(c->origin[2]))};
    f8 x = box_form(q, c->axis[0]), y = box_form(q, c->axis[1]), z = box_form(q, c->axis[2]), twice = f8_set1(2 * c->slack);
    f8 R = f8_sub(f8_add(f8_mul(z, f8_set1(c->tan_alpha)), f8_set1(c->x0)), f8_set1(c->inset));
    f8 in = f8_and(f8_le(f8_set1(0), R), f8_le(f8_add(f8_mul(x, x), f8_mul(y, y)), f8_mul(R, R)));
    in = f8_and(in, f8_le(f8_add(f8_set1(c->near), twice), z));
    return f8_mask(f8_and(in, f8_le(z, f8_sub(f8_set1(c->far), twice)))) == 0xff;
}
#endif
