/* Eight boxes or vertices against one cone, in single precision (Emre et al. 2025, sections 4.2 and 4.3).
 *
 * The paper's listing 5 enlarges every box by the cone's greatest radius within it and sends a ray through its slabs,
 * which gets worse with the half-angle. Here the slabs widen along the ray as the cone does: its section at z reaches
 * s_k R(z) to either side along world axis k, s_k^2 = X_k^2 + (Y_k / e)^2, so for a point of the box inside the cone
 *
 *     (a)   z (D_k + s_k T) >= lower_k - o_k - s_k x0   and   z (D_k - s_k T) <= upper_k - o_k + s_k x0,   k = 0, 1, 2:
 *
 * six bounds on z at the price of a ray's, exact for a ray. Wide cones also have the box's own interval of z, and the
 * plane that supports the cone on the side of the box's centre c (the form L_u of cone_frame.h with u = c / |c|, at the
 * box's best corner). For thin ones these remove next to nothing.
 *
 * Rounding. Let u = 2^-24, M = size + max |o_k|, T = tan_alpha; |b_k - o_k| <= M for every coordinate b of a box or
 * vertex. Rounding in double precision, 2^-29 of ours, is lost in the roundings up below.
 *   (a), widened by w: t = (b - c) r is off by u |c| + 4u |b - c| <= 5u (M + x0), in units of b; keeping the
 *     coefficients D_k +- s_k T away from 0 shifts them by 2^-26, times |z| <= sqrt(3) M: w = 6u (M + x0). A widened
 *     bound of another sign than the true one is beyond z = 0, where the frustum is not: no harm.
 *   A difference b - o is off by u |o| + u M, the centre of a box less o by no more; a form over three of them by 4u of
 *     its terms besides (coefficients, products, two sums): (2 + 4) sqrt(3) u M = 10.4u M, and 10.4u e M for y.
 *   z, low and high of a box: 10.4u M, 5 sqrt(3) u M for the half extents, 2u M at the end: 22u M.
 *   Plane, in units of 2M, as centre and extents are doubled, and divided by rho: u.(x, y) is off by 10.4 sqrt(2) u e,
 *     and 2 sqrt(3) u e for the square; T z by (10.4 + 3 sqrt(3)) u T; normal times half extents by 8 sqrt(6) u e
 *     (sum |X_k| <= sqrt(3), |u_x| + e |u_y| <= sqrt(2) e) + 9 sqrt(3) u T; the first subtraction by sqrt(3) u (e + T),
 *     the second by u of the threshold; that |u| <= 1 + 2u only, by 2 sqrt(3) u T: 40u e M + 37u T M + 5u x0 in all.
 *   Vertex: sqrt(x^2 + y^2) is off by (10.4 sqrt(2) + 1.5 sqrt(3)) u e M, R by (10.4 + 3 sqrt(3) + 1.7) u T M + 2u x0.
 * So with s = KELLER_CONE_SLACK_FLOAT = 64u: near, far and w hold s (M + x0); R holds 0.7 s ((e + T) M + x0),
 * which covers the plane, and accepts no vertex further outside than (0.7 s + 18u) < s of that. Squares stay finite for
 * coordinates up to 1e15 m with e to 2300 and T to 1e4; a distance below 1e-15 m is taken as 1e-15 m, which only
 * shortens u. */
#include "geom/cone_lanes.h"

#define THIN_TAN 1e-4
#define FLOOR 1e-9

void cone_lanes_make(const KellerCone *cone, KellerVec3 o, KellerRange clip, double size, KellerConeLanes *lanes)
{
    const double e = cone->e, T = cone->tan_alpha, x0 = cone->x0;
    const KellerVec3 axis[3] = {cone->major, v3_scale(cone->minor, e), cone->directrix};
    lanes->origin[0] = (float)o.x;
    lanes->origin[1] = (float)o.y;
    lanes->origin[2] = (float)o.z;
    lanes->tan_alpha = (float)T;
    for (int i = 0; i < 3; i++) {
        lanes->axis[i][0] = (float)axis[i].x;
        lanes->axis[i][1] = (float)axis[i].y;
        lanes->axis[i][2] = (float)axis[i].z;
    }
    const double unit = (double)KELLER_CONE_SLACK_FLOAT;
    /* squares below 2^-126 lose bits: nothing counts as smaller than 1e-15 m */
    double reach = size + greater(fabs(o.x), greater(fabs(o.y), fabs(o.z))) + FLOOR, slack = unit * (reach + x0);
    lanes->x0 = float_up(x0 + 0.7 * unit * ((e + T) * reach + x0));
    lanes->inset = float_up(1.5 * unit * ((e + T) * reach + x0));
    lanes->frame_error = (float)(16 * 0x1p-24 * (e * reach + x0));
    lanes->near = float_down(greater(cone->z_near, clip.near) - slack);
    lanes->far = float_up(lesser(cone->z_far, clip.far) + slack);
    lanes->slack = float_up(slack);
    /* the slabs of the three axes, in lanes */
    d4 at = d4_set(o.x, o.y, o.z, 0), X = d4_set(axis[0].x, axis[0].y, axis[0].z, 0),
       Y = d4_mul(d4_set(axis[1].x, axis[1].y, axis[1].z, 0), d4_set1(1 / (e * e))),
       D = d4_set(axis[2].x, axis[2].y, axis[2].z, 1), minus = d4_set1(-0.0), least = d4_set1(0x1p-26);
    d4 sign = d4_or(d4_set1(1), d4_and(minus, D)), spread = d4_set1(1);
    /* s_k is at most 1, and of the thinnest cones without a base not worth the root */
    if (T > THIN_TAN || x0 > 0) spread = d4_sqrt(d4_add(d4_mul(X, X), d4_mul(Y, Y)));
    d4 width = d4_mul(sign, d4_add(d4_mul(spread, d4_set1(x0)), d4_set1(slack)));
    d4 opening = d4_mul(spread, d4_set1(T)), in = d4_add(d4_abs(D), opening), out = d4_sub(d4_abs(D), opening);
    out = d4_or(d4_max(d4_abs(out), least), d4_and(minus, out));
    d4_store_floats(lanes->enter, d4_add(at, width));
    d4_store_floats(lanes->leave, d4_sub(at, width));
    d4_store_floats(lanes->enter_rate, d4_div(sign, d4_max(in, least)));
    d4_store_floats(lanes->leave_rate, d4_div(sign, out));
}

KellerConeLanes keller_cone_lanes(const KellerCone *cone, KellerRange clip, double size)
{
    KellerConeLanes lanes;
    cone_lanes_make(cone, cone->origin, clip, size, &lanes);
    return lanes;
}

uint32_t keller_cone_meets_box8(const KellerConeLanes *cone, const KellerBox8 *boxes, float *distance)
{
    const float *D = cone->axis[2];
    f8 near = f8_set1(cone->near), far = f8_set1(cone->far), infinite = f8_set1(INFINITY), zero = f8_set1(0);
    const float *side = boxes->lower[0]; /* rows of 8: lower sides 0 to 2, upper ones 3 to 5 */
    for (int k = 0; k < 3; k++) {
        int first = cone->enter_rate[k] < 0 ? 8 * (k + 3) : 8 * k; /* the side that the cone enters by */
        f8 enter_rate = f8_set1(cone->enter_rate[k]), leave_rate = f8_set1(cone->leave_rate[k]);
        f8 in = f8_mul(f8_sub(f8_load(side + first), f8_set1(cone->enter[k])), enter_rate);
        f8 out = f8_mul(f8_sub(f8_load(side + (8 * (2 * k + 3) - first)), f8_set1(cone->leave[k])), leave_rate);
        /* where the cone opens wider than it leans, this side bounds from below too */
        f8 below = f8_lt(f8_mul(enter_rate, leave_rate), zero);
        near = f8_max(near, f8_max(in, f8_blend(below, out, f8_neg(infinite))));
        far = f8_min(far, f8_blend(below, infinite, out));
    }
    f8 ok = f8_le(f8_load(boxes->lower[0]), f8_load(boxes->upper[0]));
    if (cone_lanes_wide(cone)) {
        f8 c[3], h[3], n[3]; /* centre and half extents, doubled, as all lengths here */
        for (int k = 0; k < 3; k++) {
            f8 lower = f8_load(boxes->lower[k]), upper = f8_load(boxes->upper[k]);
            c[k] = f8_sub(f8_add(lower, upper), f8_set1(2 * cone->origin[k]));
            h[k] = f8_sub(upper, lower);
        }
        f8 x = dot8(c, cone->axis[0]), y = dot8(c, cone->axis[1]), z = dot8(c, D), half = f8_set1(0.5f);
        /* u = (x, y) / rho; everything times rho, to save the division */
        f8 square = f8_add(f8_mul(x, x), f8_mul(y, y)), rho = f8_sqrt(f8_max(square, f8_set1(TINY_FLOAT)));
        f8 slope = f8_mul(rho, f8_set1(cone->tan_alpha));
        for (int k = 0; k < 3; k++) {
            n[k] = f8_add(f8_mul(x, f8_set1(cone->axis[0][k])), f8_mul(y, f8_set1(cone->axis[1][k])));
            n[k] = f8_mul(f8_abs(f8_sub(n[k], f8_mul(slope, f8_set1(D[k])))), h[k]);
            h[k] = f8_mul(f8_abs(f8_set1(D[k])), h[k]);
        }
        f8 reach = f8_add(f8_add(n[0], n[1]), n[2]), reach_z = f8_add(f8_add(h[0], h[1]), h[2]);
        f8 beyond = f8_sub(f8_sub(square, f8_mul(slope, z)), reach), slack = f8_set1(cone->slack);
        ok = f8_and(ok, f8_le(beyond, f8_mul(rho, f8_set1(2 * cone->x0))));
        near = f8_max(near, f8_sub(f8_mul(f8_sub(z, reach_z), half), slack));
        far = f8_min(far, f8_add(f8_mul(f8_add(z, reach_z), half), slack));
    }
    f8_store(distance, near);
    return (uint32_t)f8_mask(f8_and(ok, f8_le(near, far)));
}

/* z of the vertices; in[i] all ones where vertex i is inside */
static inline f8 z_inside(const KellerConeLanes *cone, const f8 vertex[3], f8 *in)
{
    const f8 q[3] = {f8_sub(vertex[0], f8_set1(cone->origin[0])), f8_sub(vertex[1], f8_set1(cone->origin[1])),
                     f8_sub(vertex[2], f8_set1(cone->origin[2]))};
    f8 x = dot8(q, cone->axis[0]), y = dot8(q, cone->axis[1]), z = dot8(q, cone->axis[2]);
    f8 R = f8_add(f8_mul(z, f8_set1(cone->tan_alpha)), f8_set1(cone->x0));
    *in = f8_and(f8_le(f8_set1(cone->near), z), f8_le(z, f8_set1(cone->far)));
    *in = f8_and(*in, f8_le(f8_set1(0), R));
    *in = f8_and(*in, f8_le(f8_add(f8_mul(x, x), f8_mul(y, y)), f8_mul(R, R)));
    return z;
}

uint32_t keller_cone_contains_vertex8(const KellerConeLanes *cone, const KellerVertex8 *vertices)
{
    const f8 v[3] = {f8_load(vertices->p[0]), f8_load(vertices->p[1]), f8_load(vertices->p[2])};
    f8 in;
    z_inside(cone, v, &in);
    return (uint32_t)f8_mask(in);
}

bool keller_cone_contains_corners(const KellerConeLanes *cone, const float lower[3], const float upper[3])
{
    const float *l = lower, *u = upper;
    const f8 v[3] = {f8_set(l[0], u[0], l[0], u[0], l[0], u[0], l[0], u[0]),
                     f8_set(l[1], l[1], u[1], u[1], l[1], l[1], u[1], u[1]),
                     f8_set(l[2], l[2], l[2], l[2], u[2], u[2], u[2], u[2])};
    f8 in;
    z_inside(cone, v, &in);
    return f8_mask(in) == 0xff;
}

void keller_cone_contained_triangle8(const KellerConeLanes *cone, const KellerVertex8 vertices[3], float *near,
                                     float *far)
{
    f8 low, high;
    for (int j = 0; j < 3; j++) {
        f8 q[3];
        for (int k = 0; k < 3; k++) q[k] = f8_sub(f8_load(vertices[j].p[k]), f8_set1(cone->origin[k]));
        f8 z = dot8(q, cone->axis[2]);
        low = j ? f8_min(low, z) : z;
        high = j ? f8_max(high, z) : z;
    }
    f8_store(near, f8_sub(low, f8_set1(cone->slack)));
    f8_store(far, f8_add(high, f8_set1(cone->slack)));
}
