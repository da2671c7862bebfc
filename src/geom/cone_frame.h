/* The frame of a cone, shared by its tests: y is stretched by e, so that the cone is round,
 *     |(x, y)| <= R(z) = z T + x0,   T = tan_alpha,
 * and F(p) = R(z) - |(x, y)| is concave. Every decision rests on the linear forms L_u(p) = R(z) - u.(x, y) with |u| <= 1,
 * none of which is below F:
 *   separation  a convex set misses the cone if some L_u is negative on all its vertices;
 *   duality     no point of the set inside the cone has a z below min over its vertices of z - lambda L_u, lambda >= 0,
 *               nor above the max of z + lambda L_u.
 * u and lambda may come from any inexact formula; only L_u has to be evaluated with a bounded error.
 *
 * That error (unit u = 2^-53, S the 1-norm of q = p - origin, all axes' components at most 1): q is exact to u per
 * component, x and z to 4 u S, y to 5 u e S, R to 6 u T S + u x0; u normalised numerically has a norm of at most 1 + 3 u;
 * evaluating L_u adds 3 u (|R| + |x| + |y|). In all at most u (12.5 e S + 9 T S + 4 x0) < 16 u ((e + T) S + x0), a quarter
 * of cone_slack: the rest covers vertices made from others (clipped edges, corners of boxes) and products with lambda. */
#ifndef KELLER_GEOM_CONE_FRAME_H
#define KELLER_GEOM_CONE_FRAME_H
#include "base/number.h"
#include "keller/cone.h"

#define TAN_MAX 5.671281819617709 /* tan 80 degrees: the widest cone that a constructor makes */
/* Added to squared lengths, so that a vector divided by its length is never longer than 1, even where squares underflow. */
#define TINY 1e-290
#define LAMBDA_MAX 1e150

static const KellerRange CONE_EMPTY = {INFINITY, -INFINITY};

static inline double norm1(KellerVec3 q) { return fabs(q.x) + fabs(q.y) + fabs(q.z); }

static inline KellerVec3 cone_rotate(const KellerCone *c, KellerVec3 q)
{
    return v3(v3_dot(q, c->major), v3_dot(q, c->minor) * c->e, v3_dot(q, c->directrix));
}

/* A slack for L_u, for points of 1-norm up to `size` from the origin; that of z alone. */
static inline double cone_slack(const KellerCone *c, double size)
{
    return KELLER_CONE_SLACK * ((c->e + c->tan_alpha) * size + c->x0);
}
static inline double cone_z_slack(double size) { return KELLER_CONE_SLACK * size; }

/* A point of the frame, in world coordinates. */
static inline KellerVec3 cone_world(const KellerCone *c, double x, double y, double z)
{
    return v3_madd(v3_madd(v3_madd(c->origin, c->directrix, z), c->major, x), c->minor, y / c->e);
}

static inline KellerRange cone_clip(const KellerCone *c, KellerRange clip)
{
    return (KellerRange){greater(c->z_near, clip.near), lesser(c->z_far, clip.far)};
}
#endif
