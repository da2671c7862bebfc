/* Eight triangles or edges against one cone, in single precision: what is left decides between few, in double precision.
 *
 * The same two facts as in cone_frame.h: a primitive misses the cone if some linear form L_u = R - u.(x, y), |u| <= 1, is
 * negative at all its corners, and F is greatest on an edge. L_u at a corner is off by (10.4 sqrt(2) + 3 sqrt(3) + 2 sqrt(3))
 * u e M, a corner's x and y (cone_lanes.c), the two products and sums, and |u| <= 1 + 2u, and R by (10.4 + 3 sqrt(3) + 2.7)
 * u T M + 3u x0: within the 0.7 s ((e + T) M + x0) = 44u (...) that KellerConeLanes' x0 holds. */
#include "geom/cone_lanes.h"

#define FEW 1

typedef struct {
    f8 x, y, z, R;
} Corner;

static inline Corner corner(const KellerConeLanes *c, const KellerVertex8 *v)
{
    const f8 q[3] = {f8_sub(f8_load(v->p[0]), f8_set1(c->origin[0])), f8_sub(f8_load(v->p[1]), f8_set1(c->origin[1])),
                     f8_sub(f8_load(v->p[2]), f8_set1(c->origin[2]))};
    Corner k = {dot8(q, c->axis[0]), dot8(q, c->axis[1]), dot8(q, c->axis[2]), f8_set1(0)};
    k.R = f8_add(f8_mul(k.z, f8_set1(c->tan_alpha)), f8_set1(c->x0));
    return k;
}

static inline f8 inside(const KellerConeLanes *c, const Corner *k)
{
    f8 R = f8_sub(k->R, f8_set1(c->inset)), slack = f8_set1(2 * c->slack);
    f8 in = f8_and(f8_le(f8_set1(0), R), f8_le(f8_add(f8_mul(k->x, k->x), f8_mul(k->y, k->y)), f8_mul(R, R)));
    in = f8_and(in, f8_le(f8_add(f8_set1(c->near), slack), k->z));
    return f8_and(in, f8_le(k->z, f8_sub(f8_set1(c->far), slack)));
}

/* |p| L_u, u = p / |p| */
static inline f8 form(const Corner *k, f8 px, f8 py, f8 rho)
{
    return f8_sub(f8_mul(rho, k->R), f8_add(f8_mul(px, k->x), f8_mul(py, k->y)));
}

/* The point of the edge a-b where F is greatest (cone_triangle.c, separated). */
static inline void deepest(const Corner *a, const Corner *b, f8 *px, f8 *py, f8 *rho)
{
    f8 zero = f8_set1(0), one = f8_set1(1);
    f8 lx = f8_sub(b->x, a->x), ly = f8_sub(b->y, a->y), Rl = f8_sub(b->R, a->R);
    f8 l2 = f8_add(f8_mul(lx, lx), f8_mul(ly, ly)), A = f8_sub(l2, f8_mul(Rl, Rl)), root = f8_sqrt(f8_max(A, zero));
    f8 side = f8_sub(f8_mul(a->x, ly), f8_mul(a->y, lx)), dot = f8_add(f8_mul(a->x, lx), f8_mul(a->y, ly));
    f8 inverse = f8_div(one, f8_mul(l2, root)), scale = f8_mul(inverse, root), flat = f8_lt(zero, A);
    f8 t = f8_mul(f8_sub(f8_mul(f8_abs(side), Rl), f8_mul(dot, root)), inverse);
    f8 between = f8_and(flat, f8_and(f8_lt(zero, t), f8_lt(t, one)));
    t = f8_blend(flat, f8_max(f8_min(t, one), zero), f8_and(f8_lt(zero, Rl), one));
    f8 turn = f8_or(root, f8_and(side, f8_set1(-0.0f)));
    *px = f8_blend(between, f8_mul(scale, f8_add(f8_mul(Rl, lx), f8_mul(turn, ly))), f8_add(a->x, f8_mul(t, lx)));
    *py = f8_blend(between, f8_mul(scale, f8_sub(f8_mul(Rl, ly), f8_mul(turn, lx))), f8_add(a->y, f8_mul(t, ly)));
    *rho = f8_sqrt(f8_add(f8_add(f8_mul(*px, *px), f8_mul(*py, *py)), f8_set1(TINY_FLOAT)));
}

/* In which lanes are all corners outside one of the supporting planes at u = (+-1, 0), (0, +-1) or between? */
static inline f8 beside(const Corner *k, int count)
{
    f8 right = f8_set1(INFINITY), left = right, up = right, down = right, a = right, b = right, c = right, d = right;
    f8 diagonal = f8_set1(0.70710677f); /* rounded down: |u| < 1 */
    for (int i = 0; i < count; i++) {
        f8 s = f8_mul(f8_add(k[i].x, k[i].y), diagonal), t = f8_mul(f8_sub(k[i].x, k[i].y), diagonal), R = k[i].R;
        right = f8_min(right, f8_sub(k[i].x, R));
        left = f8_min(left, f8_sub(f8_neg(k[i].x), R));
        up = f8_min(up, f8_sub(k[i].y, R));
        down = f8_min(down, f8_sub(f8_neg(k[i].y), R));
        a = f8_min(a, f8_sub(s, R));
        b = f8_min(b, f8_sub(f8_neg(s), R));
        c = f8_min(c, f8_sub(t, R));
        d = f8_min(d, f8_sub(f8_neg(t), R));
    }
    f8 most = f8_max(f8_max(f8_max(right, left), f8_max(up, down)), f8_max(f8_max(a, b), f8_max(c, d)));
    return f8_lt(f8_set1(0), most);
}

/* The range of z of the corners, and which lanes it and the planes leave. */
static inline f8 first_look(const KellerConeLanes *c, const Corner *k, int count, float *near, float *far)
{
    f8 low = k[0].z, high = k[0].z;
    for (int i = 1; i < count; i++) {
        low = f8_min(low, k[i].z);
        high = f8_max(high, k[i].z);
    }
    /* c->near and c->far hold the slack of z */
    f8 left = f8_and(f8_le(f8_set1(c->near), high), f8_le(low, f8_set1(c->far)));
    f8_store(near, f8_sub(low, f8_set1(c->slack)));
    f8_store(far, f8_add(high, f8_set1(c->slack)));
    return f8_andnot(beside(k, count), left);
}

uint32_t keller_cone_meets_triangle8(const KellerConeLanes *cone, const KellerVertex8 vertices[3], float *near, float *far,
                                     uint32_t *contained)
{
    const Corner k[3] = {corner(cone, &vertices[0]), corner(cone, &vertices[1]), corner(cone, &vertices[2])};
    f8 left = first_look(cone, k, 3, near, far), in = f8_and(inside(cone, &k[0]), f8_and(inside(cone, &k[1]), inside(cone, &k[2])));
    *contained = (uint32_t)f8_mask(in);
    uint32_t mask = (uint32_t)f8_mask(left);
    /* few are cheaper to leave to the caller's exact test */
    if (__builtin_popcount(mask & ~*contained) <= FEW) return mask | *contained;
    for (int i = 0; i < 3 && mask & ~*contained; i++) {
        f8 px, py, rho;
        deepest(&k[i], &k[(i + 1) % 3], &px, &py, &rho);
        f8 most = f8_max(form(&k[0], px, py, rho), f8_max(form(&k[1], px, py, rho), form(&k[2], px, py, rho)));
        mask &= ~(uint32_t)f8_mask(f8_lt(most, f8_set1(0)));
    }
    return mask | *contained;
}

/* A side from a to b, seen along the directrix: the cross product of its ends, by how much it is off, and that or more of it with
 * which the frustum, of radius R there, lies on one side of its line. The cross product is off by (10.4 + 3.5) u e M (|a| + |b|),
 * corners and products, and by the square of the former; |l| may be taken too large, by its 1-norm. */
static inline f8 side(const KellerConeLanes *c, const Corner *a, const Corner *b, f8 R, f8 *wrong, f8 *bound)
{
    f8 l = f8_add(f8_abs(f8_sub(b->x, a->x)), f8_abs(f8_sub(b->y, a->y))), error = f8_set1(c->frame_error);
    f8 size = f8_add(f8_add(f8_abs(a->x), f8_abs(a->y)), f8_add(f8_abs(b->x), f8_abs(b->y)));
    *wrong = f8_mul(error, f8_add(size, error));
    *bound = f8_add(f8_mul(R, l), *wrong);
    return f8_sub(f8_mul(a->x, b->y), f8_mul(a->y, b->x));
}

/* The radius at z, or at the far end. */
static inline f8 radius(const KellerConeLanes *c, f8 z)
{
    return f8_add(f8_mul(f8_min(z, f8_set1(c->far)), f8_set1(c->tan_alpha)), f8_set1(c->x0));
}

/* Seen along the directrix, the frustum lies in a disc of the radius that it has at the triangle's far end. It is parted from
 * the triangle by the line of a side if its middle is farther from it than that, on the outer side; which side that is need
 * not be known: the middle is left of one side's line, and right of another's, only if it is outside. Where all three cross
 * products have one sign beyond their errors, the directrix passes through the triangle, at their mean of z, which is off as
 * derived in accel/ray8.h, and by 10.4 u M for z and 5 u M for the mean: less than the slack of z. */
uint32_t keller_cone_pierces_triangle8(const KellerConeLanes *cone, const KellerVertex8 vertices[3], float *near, float *far,
                                       uint32_t *pierced, float *at)
{
    const Corner k[3] = {corner(cone, &vertices[0]), corner(cone, &vertices[1]), corner(cone, &vertices[2])};
    f8 low = f8_min(k[0].z, f8_min(k[1].z, k[2].z)), high = f8_max(k[0].z, f8_max(k[1].z, k[2].z)), slack = f8_set1(cone->slack);
    f8 R = radius(cone, high), zero = f8_set1(0), e[3], wrong[3], left = f8_lt(zero, zero), right = left, bound;
    for (int j = 0; j < 3; j++) { /* the side opposite to corner j */
        e[j] = side(cone, &k[(j + 1) % 3], &k[(j + 2) % 3], R, &wrong[j], &bound);
        left = f8_or(left, f8_lt(bound, e[j]));
        right = f8_or(right, f8_lt(e[j], f8_neg(bound)));
    }
    f8 in = f8_and(f8_le(f8_set1(cone->near), high), f8_le(low, f8_set1(cone->far)));
    uint32_t mask = (uint32_t)f8_mask(f8_andnot(f8_and(left, right), in));
    f8_store(near, f8_sub(low, slack));
    f8_store(far, f8_add(high, slack));
    *pierced = 0;
    if (!mask) return 0;
    f8 least = f8_min(f8_sub(e[0], wrong[0]), f8_min(f8_sub(e[1], wrong[1]), f8_sub(e[2], wrong[2])));
    f8 most = f8_max(f8_add(e[0], wrong[0]), f8_max(f8_add(e[1], wrong[1]), f8_add(e[2], wrong[2])));
    f8 sum = f8_add(e[0], f8_add(e[1], e[2])), off = f8_add(wrong[0], f8_add(wrong[1], wrong[2]));
    f8 mean = f8_div(f8_add(f8_mul(e[0], k[0].z), f8_add(f8_mul(e[1], k[1].z), f8_mul(e[2], k[2].z))), sum);
    f8 margin = f8_add(f8_div(f8_mul(f8_sub(high, low), f8_mul(off, f8_set1(1.001f))), f8_sub(f8_abs(sum), off)), slack);
    f8 begin = f8_sub(mean, margin), end = f8_add(mean, margin), twice = f8_add(slack, slack);
    f8 through = f8_and(f8_or(f8_lt(zero, least), f8_lt(most, zero)), f8_le(f8_add(f8_set1(cone->near), twice), begin));
    *pierced = mask & (uint32_t)f8_mask(f8_and(through, f8_le(end, f8_sub(f8_set1(cone->far), twice))));
    f8_store(at, end);
    return mask;
}

/* Thin cones: an edge is parted from the frustum by its own line, or by a plane beside an axis. */
static inline uint32_t meets_edge8_thin(const KellerConeLanes *cone, const KellerVertex8 ends[2], float *near, float *far)
{
    const Corner a = corner(cone, &ends[0]), b = corner(cone, &ends[1]);
    f8 low = f8_min(a.z, b.z), high = f8_max(a.z, b.z), slack = f8_set1(cone->slack), R = radius(cone, high), wrong, bound;
    f8 e = side(cone, &a, &b, R, &wrong, &bound);
    f8 x = f8_max(f8_min(a.x, b.x), f8_neg(f8_max(a.x, b.x))), y = f8_max(f8_min(a.y, b.y), f8_neg(f8_max(a.y, b.y)));
    f8 beside_it = f8_or(f8_lt(bound, f8_abs(e)), f8_lt(R, f8_max(x, y)));
    f8 in = f8_and(f8_le(f8_set1(cone->near), high), f8_le(low, f8_set1(cone->far)));
    f8_store(near, f8_sub(low, slack));
    f8_store(far, f8_add(high, slack));
    return (uint32_t)f8_mask(f8_andnot(beside_it, in));
}

uint32_t keller_cone_meets_edge8(const KellerConeLanes *cone, const KellerVertex8 ends[2], float *near, float *far,
                                 uint32_t *contained)
{
    if (!cone_lanes_wide(cone)) {
        *contained = 0;
        return meets_edge8_thin(cone, ends, near, far);
    }
    const Corner k[2] = {corner(cone, &ends[0]), corner(cone, &ends[1])};
    f8 left = first_look(cone, k, 2, near, far), in = f8_and(inside(cone, &k[0]), inside(cone, &k[1]));
    *contained = (uint32_t)f8_mask(in);
    uint32_t mask = (uint32_t)f8_mask(left);
    if (__builtin_popcount(mask & ~*contained) <= FEW) return mask | *contained;
    f8 px, py, rho;
    deepest(&k[0], &k[1], &px, &py, &rho);
    f8 most = f8_max(form(&k[0], px, py, rho), form(&k[1], px, py, rho));
    return (mask & ~(uint32_t)f8_mask(f8_lt(most, f8_set1(0)))) | *contained;
}

/* Centre and half extents in the frame make a box around the box: if that one's corners are inside, so is all of it. */
uint32_t keller_cone_contains_box8(const KellerConeLanes *cone, const KellerBox8 *boxes)
{
    f8 c[3], h[3], half = f8_set1(0.5f);
    for (int k = 0; k < 3; k++) {
        f8 lower = f8_load(boxes->lower[k]), upper = f8_load(boxes->upper[k]);
        c[k] = f8_sub(f8_mul(half, f8_add(lower, upper)), f8_set1(cone->origin[k]));
        h[k] = f8_mul(half, f8_sub(upper, lower));
    }
    f8 reach[3];
    for (int i = 0; i < 3; i++) {
        float wide[3] = {fabsf(cone->axis[i][0]), fabsf(cone->axis[i][1]), fabsf(cone->axis[i][2])};
        reach[i] = dot8(h, wide);
    }
    f8 x = f8_add(f8_abs(dot8(c, cone->axis[0])), reach[0]), y = f8_add(f8_abs(dot8(c, cone->axis[1])), reach[1]),
       z = dot8(c, cone->axis[2]), low = f8_sub(z, reach[2]), high = f8_add(z, reach[2]), slack = f8_set1(2 * cone->slack);
    f8 R = f8_sub(f8_add(f8_mul(low, f8_set1(cone->tan_alpha)), f8_set1(cone->x0)), f8_set1(cone->inset));
    f8 in = f8_and(f8_le(f8_set1(0), R), f8_le(f8_add(f8_mul(x, x), f8_mul(y, y)), f8_mul(R, R)));
    in = f8_and(in, f8_le(f8_add(f8_set1(cone->near), slack), low));
    return (uint32_t)f8_mask(f8_and(in, f8_le(high, f8_sub(f8_set1(cone->far), slack))));
}
