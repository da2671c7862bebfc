/* Cone and axis-aligned box (paper, section 3.1.3): four parallel edges in four lanes, three times; the three pairs of faces in
 * three lanes. cone_frame.h says why what comes out is conservative; a linear form's extremes over a box need no corners. */
#include "geom/cone_lanes.h"

typedef struct {
    const KellerCone *cone;
    KellerRange clip;
    double lower[3], upper[3];     /* of the box, from the cone's origin */
    double x[3], y[3], z[3];       /* the cone's (stretched) axes' components along the box's */
    double slack, z_slack, low, high;
} Box;

static Box box_of(const KellerCone *c, KellerVec3 lower, KellerVec3 upper, KellerRange clip)
{
    KellerVec3 lo = v3_sub(lower, c->origin), hi = v3_sub(upper, c->origin), y = v3_scale(c->minor, c->e);
    Box b = {c, cone_clip(c, clip), {lo.x, lo.y, lo.z}, {hi.x, hi.y, hi.z}, {c->major.x, c->major.y, c->major.z},
             {y.x, y.y, y.z}, {c->directrix.x, c->directrix.y, c->directrix.z}, 0, 0, 0, 0};
    double size = 0;
    for (int k = 0; k < 3; k++) {
        double p = b.z[k] * b.lower[k], q = b.z[k] * b.upper[k];
        b.low += lesser(p, q);
        b.high += greater(p, q);
        size += greater(fabs(b.lower[k]), fabs(b.upper[k]));
    }
    b.slack = cone_slack(c, size);
    b.z_slack = cone_z_slack(size);
    return b;
}

/* ---- the Boolean test -------------------------------------------------------------------------------------------- */

/* Surely missed: by z, by the box around the section, or by the supporting plane that faces the middle of the box. The
 * paper grows the edges' range to do without the faces; a plane that separates does without faces and edges. All lengths are
 * doubled, which saves the halves of middle and extent. */
bool keller_cone_meets_box(const KellerCone *c, KellerVec3 lower, KellerVec3 upper, KellerRange clip)
{
    KellerVec3 X = c->major, Y = c->minor, Z = c->directrix, lo = v3_sub(lower, c->origin), hi = v3_sub(upper, c->origin);
    KellerVec3 m = v3_add(lo, hi), h = v3_sub(hi, lo);
    double T = c->tan_alpha, size = norm1(m) + h.x + h.y + h.z, z_slack = cone_z_slack(size);
    double z = v3_dot(Z, m), hz = fabs(Z.x) * h.x + fabs(Z.y) * h.y + fabs(Z.z) * h.z, high = z + hz;
    double near = 2 * greater(c->z_near, clip.near), far = 2 * lesser(c->z_far, clip.far);
    double x = v3_dot(X, m), y = c->e * v3_dot(Y, m), x0 = 2 * c->x0 + cone_slack(c, size) + KELLER_CONE_SLACK * c->x0;
    double hx = fabs(X.x) * h.x + fabs(X.y) * h.y + fabs(X.z) * h.z,
           hy = c->e * (fabs(Y.x) * h.x + fabs(Y.y) * h.y + fabs(Y.z) * h.z);
    double dx = greater(fabs(x) - hx, 0), dy = greater(fabs(y) - hy, 0), R = lesser(high, far) * T + x0;
    /* |p| times the greatest L_u over the box: its value in the middle and what a corner adds */
    double square = x * x + y * y, rho = sqrt(square + TINY), slope = rho * T, ey = c->e * y;
    double corner = fabs(slope * Z.x - (x * X.x + ey * Y.x)) * h.x + fabs(slope * Z.y - (x * X.y + ey * Y.y)) * h.y +
                    fabs(slope * Z.z - (x * X.z + ey * Y.z)) * h.z;
    /* one decision, as none of its parts can be foreseen */
    return (high >= near - z_slack) & (z - hz <= far + z_slack) & (near <= far) & (R >= 0) & (dx * dx + dy * dy <= R * R) &
           (rho * x0 + slope * z - square + corner >= 0);
}

/* ---- the range -------------------------------------------------------------------------------------------------- */

typedef struct {
    double low, high;              /* bounds by duality: the true range is inside */
    double near_z, far_z;          /* the best points found, in the frame with y stretched; near_z = INFINITY: none */
    KellerVec3 near, far;
    bool missed;
} Extremes;

/* Extreme over the box, the greater (sign = 1) or the lesser (-1), of the linear form c.q, four forms in lanes. */
static inline d4 extreme(const Box *b, const d4 c[3], int sign)
{
    d4 sum = d4_set1(0);
    for (int k = 0; k < 3; k++) {
        d4 p = d4_mul(c[k], d4_set1(b->lower[k])), q = d4_mul(c[k], d4_set1(b->upper[k]));
        sum = d4_add(sum, sign > 0 ? d4_max(p, q) : d4_min(p, q));
    }
    return sum;
}

/* |p| times the greatest L_u over the box, u = p/|p| */
static inline d4 greatest(const Box *b, d4 px, d4 py, d4 rho)
{
    d4 c[3], T = d4_mul(rho, d4_set1(b->cone->tan_alpha));
    for (int k = 0; k < 3; k++)
        c[k] = d4_sub(d4_mul(T, d4_set1(b->z[k])), d4_add(d4_mul(px, d4_set1(b->x[k])), d4_mul(py, d4_set1(b->y[k]))));
    return d4_add(extreme(b, c, 1), d4_mul(rho, d4_set1(b->cone->x0 + b->slack)));
}

/* The dual bound of four choices of u = p/|p| and lambda (given over |p|): sign = 1 from below, -1 from above. */
static inline d4 dual(const Box *b, d4 px, d4 py, d4 rho, d4 lambda, int sign)
{
    d4 c[3], T = d4_mul(rho, d4_set1(b->cone->tan_alpha)), s = d4_set1(sign);
    lambda = d4_mul(s, d4_min(d4_max(lambda, d4_set1(0)), d4_set1(LAMBDA_MAX)));
    for (int k = 0; k < 3; k++) {
        d4 L = d4_sub(d4_mul(T, d4_set1(b->z[k])), d4_add(d4_mul(px, d4_set1(b->x[k])), d4_mul(py, d4_set1(b->y[k]))));
        c[k] = d4_sub(d4_set1(b->z[k]), d4_mul(lambda, L));
    }
    return d4_sub(extreme(b, c, -sign), d4_mul(lambda, d4_mul(rho, d4_set1(b->cone->x0 + 2 * b->slack))));
}

static void take_bounds(Extremes *e, d4 low, d4 high)
{
    e->low = greater(e->low, d4_hmax(d4_max(low, d4_set1(e->low))));
    e->high = lesser(e->high, d4_hmin(d4_min(high, d4_set1(e->high))));
}

static void take_point(Extremes *e, double x, double y, double z)
{
    if (z < e->near_z) {
        e->near_z = z;
        e->near = v3(x, y, z);
    }
    if (z > e->far_z) {
        e->far_z = z;
        e->far = v3(x, y, z);
    }
}

/* The four edges along the box's axis k: separation, roots (eq. 6 with the discriminant by Lagrange's identity), bounds. */
static void edges(const Box *b, int k, bool points, Extremes *e)
{
    int i = (k + 1) % 3, j = (k + 2) % 3;
    double length = b->upper[k] - b->lower[k], T1 = b->cone->tan_alpha;
    d4 qi = d4_set(b->lower[i], b->upper[i], b->lower[i], b->upper[i]),
       qj = d4_set(b->lower[j], b->lower[j], b->upper[j], b->upper[j]), zero = d4_set1(0), one = d4_set1(1);
    d4 ax = d4_add(d4_set1(b->x[k] * b->lower[k]), d4_add(d4_mul(d4_set1(b->x[i]), qi), d4_mul(d4_set1(b->x[j]), qj))),
       ay = d4_add(d4_set1(b->y[k] * b->lower[k]), d4_add(d4_mul(d4_set1(b->y[i]), qi), d4_mul(d4_set1(b->y[j]), qj))),
       az = d4_add(d4_set1(b->z[k] * b->lower[k]), d4_add(d4_mul(d4_set1(b->z[i]), qi), d4_mul(d4_set1(b->z[j]), qj)));
    double lx1 = b->x[k] * length, ly1 = b->y[k] * length, lz1 = b->z[k] * length, Rl1 = lz1 * T1;
    double l2 = lx1 * lx1 + ly1 * ly1, A = l2 - Rl1 * Rl1;
    d4 lx = d4_set1(lx1), ly = d4_set1(ly1), lz = d4_set1(lz1), Rl = d4_set1(Rl1);
    d4 R = d4_add(d4_mul(az, d4_set1(T1)), d4_set1(b->cone->x0 + b->slack));
    d4 side = d4_sub(d4_mul(ax, ly), d4_mul(ay, lx)), cross = d4_abs(side), dot = d4_add(d4_mul(ax, lx), d4_mul(ay, ly));
    d4 t = Rl1 > 0 ? one : zero;
    if (A > 0) t = d4_div(d4_sub(d4_mul(cross, d4_set1(Rl1 / sqrt(A))), dot), d4_set1(l2));
    d4 between = d4_and(d4_lt(zero, t), d4_lt(t, one));
    t = d4_max(d4_min(t, one), zero);
    d4 px = d4_add(ax, d4_mul(t, lx)), py = d4_add(ay, d4_mul(t, ly));
    if (A > 0) { /* between the ends, from the edges' direction (cone_triangle.c) */
        d4 turn = d4_or(d4_set1(sqrt(A)), d4_and(side, d4_set1(-0.0))), scale = d4_set1(1 / l2);
        px = d4_blend(between, d4_mul(scale, d4_add(d4_mul(Rl, lx), d4_mul(turn, ly))), px);
        py = d4_blend(between, d4_mul(scale, d4_sub(d4_mul(Rl, ly), d4_mul(turn, lx))), py);
    }
    if (d4_mask(d4_lt(greatest(b, px, py, length_of(px, py)), zero))) {
        e->missed = true;
        return;
    }
    d4 sx = d4_sub(d4_mul(lx, R), d4_mul(ax, Rl)), sy = d4_sub(d4_mul(ly, R), d4_mul(ay, Rl));
    d4 s = d4_sqrt(d4_add(d4_mul(sx, sx), d4_mul(sy, sy)));
    d4 root = d4_sqrt(d4_max(d4_mul(d4_add(s, cross), d4_sub(s, cross)), zero));
    d4 rho = d4_sqrt(d4_add(d4_mul(ax, ax), d4_mul(ay, ay)));
    d4 B = d4_sub(dot, d4_mul(R, Rl)), C = d4_mul(d4_sub(rho, R), d4_add(rho, R));
    d4 forth = d4_le(zero, B), q = d4_blend(forth, d4_neg(d4_add(B, root)), d4_sub(root, B));
    d4 qa = d4_div(q, d4_set1(A)), cq = d4_div(C, q), enters = d4_blend(forth, qa, cq), leaves = d4_blend(forth, cq, qa);
    d4 bound[2], ends[2] = {lz1 >= 0 ? enters : leaves, lz1 >= 0 ? leaves : enters};
    for (int end = 0; end < 2; end++) {
        px = d4_add(ax, d4_mul(ends[end], lx));
        py = d4_add(ay, d4_mul(ends[end], ly));
        rho = length_of(px, py);
        d4 rate = d4_sub(d4_mul(rho, Rl), d4_add(d4_mul(px, lx), d4_mul(py, ly)));
        bound[end] = dual(b, px, py, rho, d4_div(lz, end ? d4_neg(rate) : rate), end ? -1 : 1);
        if (!points) continue;
        /* an edge steeper than the envelope does not leave */
        d4 u = end && !(A > 0) ? d4_set1(lz1 >= 0) : d4_min(d4_max(ends[end], zero), one);
        double x[4], y[4], z[4], F[4];
        d4 X = d4_add(ax, d4_mul(u, lx)), Y = d4_add(ay, d4_mul(u, ly));
        d4_store(x, X), d4_store(y, Y), d4_store(z, d4_add(az, d4_mul(u, lz)));
        d4_store(F, d4_sub(d4_add(R, d4_mul(u, Rl)), length_of(X, Y)));
        for (int lane = 0; lane < 4; lane++)
            if (F[lane] >= -3 * b->slack) take_point(e, x[lane], y[lane], z[lane]);
    }
    take_bounds(e, bound[0], bound[1]);
}

/* Is the frame's point in the box, or outside by rounding? `face` is an axis of the box whose coordinate need not be looked
 * at, -1 for none. */
static bool in_box(const Box *b, double x, double y, double z, int face)
{
    const KellerCone *c = b->cone;
    for (int k = 0; k < 3; k++) {
        double q = b->x[k] * x + b->y[k] / c->e * (y / c->e) + b->z[k] * z;
        if (k != face && (q < b->lower[k] - b->z_slack || q > b->upper[k] + b->z_slack)) return false;
    }
    return true;
}

/* The six faces: the extreme points of the sections with their planes (eqs 4 and 5), which bound, too, the part of the box
 * behind a face. A normal n, turned up, has x, y, z in the frame, y divided by e. */
static void faces(const Box *b, bool points, Extremes *e)
{
    const KellerCone *c = b->cone;
    double e2 = c->e * c->e, T1 = c->tan_alpha;
    double sign[3];
    for (int k = 0; k < 3; k++) sign[k] = b->z[k] < 0 ? -1 : 1;
    d4 nx = d4_set(sign[0] * b->x[0], sign[1] * b->x[1], sign[2] * b->x[2], 0),
       ny = d4_set(sign[0] * b->y[0] / e2, sign[1] * b->y[1] / e2, sign[2] * b->y[2] / e2, 0),
       nz = d4_set(fabs(b->z[0]), fabs(b->z[1]), fabs(b->z[2]), 1), one = d4_set1(1);
    d4 g = length_of(nx, ny), gT = d4_mul(g, d4_set1(T1)), mx = d4_neg(nx), my = d4_neg(ny);
    d4 near = dual(b, nx, ny, g, d4_div(one, d4_add(gT, nz)), 1), branch = dual(b, mx, my, g, d4_div(one, d4_sub(gT, nz)), 1),
       far = dual(b, mx, my, g, d4_div(one, d4_sub(nz, gT)), -1);
    take_bounds(e, near, far);
    take_bounds(e, branch, d4_set1(e->high));
    if (!points) return;
    double G[4], x[4], y[4], z[4];
    d4_store(G, g), d4_store(x, nx), d4_store(y, ny), d4_store(z, nz);
    for (int k = 0; k < 3; k++)
        for (int side = 0; side < 4; side++) {
            double d = sign[k] * (side & 1 ? b->upper[k] : b->lower[k]), s = side & 2 ? -1 : 1;
            double at = (d - s * G[k] * c->x0) / (z[k] + s * G[k] * T1), R = at * T1 + c->x0;
            if (!(fabs(at) < INFINITY) || R < 0) continue;
            double px = s * x[k] / G[k] * R, py = s * y[k] / G[k] * R;
            if (in_box(b, px, py, at, k)) take_point(e, px, py, at);
        }
    /* the apex, or the axis where the clip cuts it, may be inside the box, and then no face is met there */
    double apex = T1 > 0 ? -c->x0 / T1 : -INFINITY, cut[3] = {apex, b->clip.near, b->clip.far};
    for (int i = 0; i < 3; i++)
        if (fabs(cut[i]) < INFINITY && cut[i] >= apex && in_box(b, 0, 0, cut[i], -1)) take_point(e, 0, 0, cut[i]);
}

static double within(double a, double lo, double hi) { return greater(lo, lesser(hi, a)); }

/* The point at z = at, between the nearest and the farthest of the unclipped cone; put onto the box, which rounding left. */
static KellerVec3 place(const Box *b, const Extremes *e, double at, KellerVec3 lower, KellerVec3 upper)
{
    KellerVec3 p = at >= e->far_z ? e->far : e->near;
    if (at > e->near_z && at < e->far_z) p = v3_madd(p, v3_sub(e->far, e->near), (at - e->near_z) / (e->far_z - e->near_z));
    p = cone_world(b->cone, p.x, p.y, p.z);
    return v3(within(p.x, lower.x, upper.x), within(p.y, lower.y, upper.y), within(p.z, lower.z, upper.z));
}

KellerRange keller_cone_box(const KellerCone *cone, KellerVec3 lower, KellerVec3 upper, KellerRange clip, KellerVec3 *nearest,
                            KellerVec3 *farthest)
{
    if (!keller_cone_meets_box(cone, lower, upper, clip)) return CONE_EMPTY;
    Box b = box_of(cone, lower, upper, clip);
    bool points = nearest || farthest;
    Extremes e = {.low = b.low, .high = b.high, .near_z = INFINITY, .far_z = -INFINITY};
    for (int k = 0; k < 3; k++) {
        edges(&b, k, points, &e);
        if (e.missed) return CONE_EMPTY;
    }
    faces(&b, points, &e);
    double low = lesser(e.low, b.high), high = greater(e.high, b.low);
    KellerRange r = {greater(lesser(low, high) - b.z_slack, b.clip.near), lesser(greater(low, high) + b.z_slack, b.clip.far)};
    if (!(r.near <= r.far)) return CONE_EMPTY;
    if (points && e.near_z == INFINITY) { /* met by slack only: the middle of the box stands for it */
        KellerVec3 m = cone_rotate(cone, v3_sub(v3_scale(v3_add(lower, upper), 0.5), cone->origin));
        take_point(&e, m.x, m.y, m.z);
    }
    if (nearest) *nearest = place(&b, &e, greater(e.near_z, b.clip.near), lower, upper);
    if (farthest) *farthest = place(&b, &e, lesser(e.far_z, b.clip.far), lower, upper);
    return r;
}
