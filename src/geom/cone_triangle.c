/* Cone and triangle (paper, section 3.1.4). The three edges are worked in lanes 0 to 2, the plane of the triangle in lane 3;
 * cone_frame.h says why what comes out is conservative. */
#include "geom/cone_lanes.h"

typedef struct {
    d4 x[3], y[3], z[3], R[3];     /* [k]: lane i has corner i + k (mod 3); lane 3 is lane 0 */
    d4 slack;
    double low, high, z_slack;     /* z of the lowest and highest corner */
} Corners;

static inline d4 dot3(d4 x, d4 y, d4 z, KellerVec3 v)
{
    return d4_add(d4_add(d4_mul(x, d4_set1(v.x)), d4_mul(y, d4_set1(v.y))), d4_mul(z, d4_set1(v.z)));
}

static inline Corners corners(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerVec3 c)
{
    KellerVec3 o = cone->origin;
    d4 x = d4_sub(d4_set(a.x, b.x, c.x, a.x), d4_set1(o.x)), y = d4_sub(d4_set(a.y, b.y, c.y, a.y), d4_set1(o.y)),
       z = d4_sub(d4_set(a.z, b.z, c.z, a.z), d4_set1(o.z));
    Corners k;
    k.x[0] = dot3(x, y, z, cone->major);
    k.y[0] = d4_mul(dot3(x, y, z, cone->minor), d4_set1(cone->e));
    k.z[0] = dot3(x, y, z, cone->directrix);
    k.R[0] = d4_add(d4_mul(k.z[0], d4_set1(cone->tan_alpha)), d4_set1(cone->x0));
    double size = d4_hmax(d4_add(d4_add(d4_abs(x), d4_abs(y)), d4_abs(z)));
    k.slack = d4_set1(cone_slack(cone, size));
    k.z_slack = cone_z_slack(size);
    k.low = d4_hmin(k.z[0]);
    k.high = d4_hmax(k.z[0]);
    return k;
}

static inline void rotate(Corners *k)
{
    for (int i = 1; i < 3; i++) {
        k->x[i] = i == 1 ? d4_rotate(k->x[0]) : d4_rotate2(k->x[0]);
        k->y[i] = i == 1 ? d4_rotate(k->y[0]) : d4_rotate2(k->y[0]);
        k->z[i] = i == 1 ? d4_rotate(k->z[0]) : d4_rotate2(k->z[0]);
        k->R[i] = i == 1 ? d4_rotate(k->R[0]) : d4_rotate2(k->R[0]);
    }
}

/* |p| L_u of corner i + k, u = p/|p| */
static inline d4 form(const Corners *c, int k, d4 px, d4 py, d4 rho, d4 slack)
{
    return d4_sub(d4_mul(rho, d4_add(c->R[k], slack)), d4_add(d4_mul(px, c->x[k]), d4_mul(py, c->y[k])));
}

/* Which corners are inside. */
static inline d4 inside(const Corners *k)
{
    d4 R = d4_add(k->R[0], k->slack), x = k->x[0], y = k->y[0];
    return d4_and(d4_le(d4_set1(0), R), d4_le(d4_add(d4_mul(x, x), d4_mul(y, y)), d4_mul(R, R)));
}

/* The lowest and the highest corner are inside: the paper's case 1 for both ends of the range. */
static inline bool ends_inside(const Corners *k, d4 in)
{
    return d4_mask(d4_and(in, d4_le(k->z[0], d4_set1(k->low)))) && d4_mask(d4_and(in, d4_le(d4_set1(k->high), k->z[0])));
}

/* The edges' directions and the terms that both the separation and the roots need. */
typedef struct {
    d4 lx, ly, lz, Rl;
    d4 A;                          /* |l|^2 - Rl^2, the quadratic's leading coefficient (eq. 6) */
    d4 l2, side, cross, dot;       /* |l|^2, a x l, |a x l|, a.l */
} Edges;

static inline Edges edges_of(const Corners *k)
{
    Edges e;
    e.lx = d4_sub(k->x[1], k->x[0]);
    e.ly = d4_sub(k->y[1], k->y[0]);
    e.lz = d4_sub(k->z[1], k->z[0]);
    e.Rl = d4_sub(k->R[1], k->R[0]);
    e.l2 = d4_add(d4_mul(e.lx, e.lx), d4_mul(e.ly, e.ly));
    e.A = d4_sub(e.l2, d4_mul(e.Rl, e.Rl));
    e.side = d4_sub(d4_mul(k->x[0], e.ly), d4_mul(k->y[0], e.lx));
    e.cross = d4_abs(e.side);
    e.dot = d4_add(d4_mul(k->x[0], e.lx), d4_mul(k->y[0], e.ly));
    return e;
}

/* Is there a plane between triangle and cone? F is concave, so where the triangle is outside its greatest F lies on an edge,
 * and the supporting plane there separates (docs/numerics.md). On a line F is greatest at
 * t = (|a x l| Rl / sqrt(A) - a.l) / |l|^2 if A > 0, else at an end. Between the ends u follows from the line's direction
 * alone (u.l = Rl): its point near the axis would be mostly rounding. */
static inline bool separated(const Corners *k, const Edges *e)
{
    d4 zero = d4_set1(0), one = d4_set1(1), root = d4_sqrt(d4_max(e->A, zero));
    d4 inverse = d4_div(one, d4_mul(e->l2, root)), scale = d4_mul(inverse, root);
    d4 t = d4_mul(d4_sub(d4_mul(e->cross, e->Rl), d4_mul(e->dot, root)), inverse);
    d4 flat = d4_lt(zero, e->A), end = d4_and(d4_lt(zero, e->Rl), one);
    d4 between = d4_and(flat, d4_and(d4_lt(zero, t), d4_lt(t, one)));
    t = d4_blend(flat, d4_max(d4_min(t, one), zero), end);
    d4 turn = d4_or(root, d4_and(e->side, d4_set1(-0.0)));
    d4 ux = d4_mul(scale, d4_add(d4_mul(e->Rl, e->lx), d4_mul(turn, e->ly))),
       uy = d4_mul(scale, d4_sub(d4_mul(e->Rl, e->ly), d4_mul(turn, e->lx)));
    d4 px = d4_blend(between, ux, d4_add(k->x[0], d4_mul(t, e->lx))),
       py = d4_blend(between, uy, d4_add(k->y[0], d4_mul(t, e->ly))), rho = length_of(px, py);
    d4 most = d4_max(form(k, 0, px, py, rho, k->slack),
                     d4_max(form(k, 1, px, py, rho, k->slack), form(k, 2, px, py, rho, k->slack)));
    return d4_mask(d4_lt(most, zero)) != 0;
}

/* One end of the range of z: sign = 1 the near end, -1 the far one. */
typedef struct {
    d4 bound;                      /* by duality, from each edge and, lane 3, the plane */
    d4 t, px, py, rho;             /* the point of the edge's line, or of the plane's section, that gave it */
} End;

/* The roots of eq. 6 for the cone grown by the slack, as numerators and denominators: which of the two is where the edge
 * enters (F grows with t) depends on the sign of B alone; the plane's extreme points are those of eq. 5. */
static inline void ends_of(const KellerCone *cone, const Corners *k, const Edges *e, End *near, End *far)
{
    d4 zero = d4_set1(0), R = d4_add(k->R[0], k->slack), grown = d4_add(k->slack, k->slack);
    /* discriminant |l R - a Rl|^2 - |a x l|^2 by Lagrange's identity: a difference of squares that are free of cancellation;
     * what rounding leaves wrong in a root, the bound by duality corrects to second order */
    d4 sx = d4_sub(d4_mul(e->lx, R), d4_mul(k->x[0], e->Rl)), sy = d4_sub(d4_mul(e->ly, R), d4_mul(k->y[0], e->Rl));
    d4 square = d4_add(d4_mul(sx, sx), d4_mul(sy, sy));
    d4 root = d4_sqrt(d4_max(d4_sub(square, d4_mul(e->cross, e->cross)), zero));
    d4 B = d4_sub(e->dot, d4_mul(R, e->Rl));
    d4 C = d4_sub(d4_add(d4_mul(k->x[0], k->x[0]), d4_mul(k->y[0], k->y[0])), d4_mul(R, R));
    d4 forth = d4_le(zero, B), q = d4_blend(forth, d4_neg(d4_add(B, root)), d4_sub(root, B));
    d4 rising = d4_le(zero, e->lz);
    /* the near end is where a rising edge enters, (-B - root)/A, or a falling one leaves, (-B + root)/A */
    d4 second = d4_xor(rising, forth), qa = d4_div(q, e->A), cq = d4_div(C, q);
    near->t = d4_blend(second, cq, qa);
    far->t = d4_blend(second, qa, cq);

    /* lane 3: the normal of the triangle, turned up */
    d4 mx = d4_rotate(e->lx), my = d4_rotate(e->ly), mz = d4_rotate(e->lz);
    d4 nx = d4_sub(d4_mul(e->ly, mz), d4_mul(e->lz, my)), ny = d4_sub(d4_mul(e->lz, mx), d4_mul(e->lx, mz)),
       nz = d4_sub(d4_mul(e->lx, my), d4_mul(e->ly, mx));
    d4 up = d4_and(nz, d4_set1(-0.0)), lane3 = d4_lt(d4_set(0, 0, 0, -1), zero), T = d4_set1(cone->tan_alpha);
    nx = d4_xor(nx, up);
    ny = d4_xor(ny, up);
    nz = d4_xor(nz, up);
    d4 d = d4_add(d4_add(d4_mul(nx, k->x[0]), d4_mul(ny, k->y[0])), d4_mul(nz, k->z[0]));
    d4 g = length_of(nx, ny), gT = d4_mul(g, T);
    /* a hyperbola's forward branch is on the other side where the plane passes behind the apex */
    d4 behind = d4_and(d4_lt(nz, gT), d4_lt(d4_add(d4_mul(T, d), d4_mul(nz, d4_set1(cone->x0))), zero));
    d4 turn = d4_and(behind, d4_set1(-0.0));

    for (int i = 0; i < 2; i++) {
        End *end = i ? far : near;
        d4 flip = i ? d4_set1(-0.0) : turn;
        end->px = d4_blend(lane3, d4_xor(nx, flip), d4_add(k->x[0], d4_mul(end->t, e->lx)));
        end->py = d4_blend(lane3, d4_xor(ny, flip), d4_add(k->y[0], d4_mul(end->t, e->ly)));
        end->rho = length_of(end->px, end->py);
        /* lambda / |p| = dz/dt over dL/dt along the edge; 1 / (g T + n_z) and its like for the plane */
        d4 rate = d4_sub(d4_mul(end->rho, e->Rl), d4_add(d4_mul(end->px, e->lx), d4_mul(end->py, e->ly)));
        d4 over = d4_blend(lane3, i ? d4_sub(nz, gT) : d4_add(gT, d4_xor(nz, turn)), i ? d4_neg(rate) : rate);
        d4 lambda = d4_div(d4_blend(lane3, d4_set1(1), e->lz), over);
        lambda = d4_min(d4_max(lambda, zero), d4_set1(LAMBDA_MAX)); /* NaN becomes 0: any lambda >= 0 is valid */
        d4 v[3];
        for (int j = 0; j < 3; j++) {
            d4 step = d4_mul(lambda, form(k, j, end->px, end->py, end->rho, grown));
            v[j] = i ? d4_add(k->z[j], step) : d4_sub(k->z[j], step);
        }
        end->bound = i ? d4_max(v[0], d4_max(v[1], v[2])) : d4_min(v[0], d4_min(v[1], v[2]));
    }
}

/* ---- the points ------------------------------------------------------------------------------------------------ */

typedef struct {
    double b, c, z;                /* the point a + b (b - a) + c (c - a) and its z */
} Candidate;

/* Weights of the plane's extreme point, lane 3 of `end`, if it is inside the triangle. */
static bool on_plane(const KellerCone *cone, const Corners *k, const End *end, Candidate *found)
{
    double x[4], y[4], z[4], px[4], py[4], rho[4], bound[4];
    d4_store(x, k->x[0]), d4_store(y, k->y[0]), d4_store(z, k->z[0]);
    d4_store(px, end->px), d4_store(py, end->py), d4_store(rho, end->rho), d4_store(bound, end->bound);
    /* the bound may lie behind the apex by its slack, and then the apex is the point */
    double T = cone->tan_alpha, at = T > 0 ? greater(bound[3], -cone->x0 / T) : bound[3], R = greater(at * T + cone->x0, 0);
    if (!(fabs(at) < INFINITY) || !(rho[3] > 0)) return false;
    KellerVec3 a = v3(x[0], y[0], z[0]), ab = v3_sub(v3(x[1], y[1], z[1]), a), ac = v3_sub(v3(x[2], y[2], z[2]), a);
    KellerVec3 ap = v3_sub(v3(R * px[3] / rho[3], R * py[3] / rho[3], at), a), n = v3_cross(ab, ac);
    double nn = v3_dot(n, n), b = v3_dot(v3_cross(ap, ac), n) / nn, c = v3_dot(v3_cross(ab, ap), n) / nn;
    if (!(b >= 0 && c >= 0 && b + c <= 1)) return false;
    *found = (Candidate){b, c, at};
    return true;
}

/* The best of the edges' ends (which stand for the corners too) and the plane's extreme point. sign = 1: the lowest z. */
static Candidate point_of(const KellerCone *cone, const Corners *k, const Edges *e, const End *end, double sign)
{
    double t[4], A[4], lz[4], z[4], R[4], F[4], slack = d4_first(k->slack);
    d4_store(A, e->A), d4_store(lz, e->lz), d4_store(z, k->z[0]), d4_store(t, end->t);
    for (int i = 0; i < 3; i++) {
        /* steeper than the envelope, an edge does not leave; and what is not a number is not on the edge */
        if (!(A[i] > 0) && sign < 0) t[i] = lz[i] >= 0;
        t[i] = t[i] > 0 ? lesser(t[i], 1) : 0;
    }
    d4 T = d4_set(t[0], t[1], t[2], 0), x = d4_add(k->x[0], d4_mul(T, e->lx)), y = d4_add(k->y[0], d4_mul(T, e->ly));
    d4_store(R, d4_add(k->R[0], d4_mul(T, e->Rl)));
    d4_store(F, d4_sub(d4_add(k->R[0], d4_mul(T, e->Rl)), length_of(x, y)));
    Candidate best, plane;
    int chosen = -1, least_bad = 0;
    double best_z = INFINITY;
    for (int i = 0; i < 3; i++) {
        double at = z[i] + t[i] * lz[i];
        if (F[i] > F[least_bad]) least_bad = i;
        if (F[i] >= -4 * slack && sign * at < best_z) {
            best_z = sign * at;
            chosen = i;
        }
    }
    if (on_plane(cone, k, end, &plane) && sign * plane.z < best_z) return plane;
    int i = chosen >= 0 ? chosen : least_bad;
    best.z = z[i] + t[i] * lz[i];
    best.b = i == 0 ? t[0] : i == 1 ? 1 - t[1] : 0;
    best.c = i == 0 ? 0 : i == 1 ? t[1] : 1 - t[2];
    return best;
}

/* The point at z = at between two of which one lies before it and one behind: inside, as triangle and cone are convex. */
static KellerVec3 place(KellerVec3 a, KellerVec3 b, KellerVec3 c, Candidate near, Candidate far, double at)
{
    Candidate p = at >= far.z ? far : near;
    if (at > near.z && at < far.z) {
        double s = (at - near.z) / (far.z - near.z);
        p.b += s * (far.b - near.b);
        p.c += s * (far.c - near.c);
    }
    return v3_madd(v3_madd(a, v3_sub(b, a), p.b), v3_sub(c, a), p.c);
}

/* ---- the test -------------------------------------------------------------------------------------------------- */

static KellerRange range_of(const Corners *k, const End *near, const End *far)
{
    double low = d4_hmax(d4_max(near->bound, d4_set1(k->low))), high = d4_hmin(d4_min(far->bound, d4_set1(k->high)));
    low = lesser(low, k->high);
    high = greater(high, k->low);
    /* what passed the separation counts as met: bounds that cross, by rounding, are kept as a range */
    return (KellerRange){lesser(low, high) - k->z_slack, greater(low, high) + k->z_slack};
}

static KellerRange intersect(KellerRange a, KellerRange b)
{
    KellerRange r = {greater(a.near, b.near), lesser(a.far, b.far)};
    return r.near <= r.far ? r : CONE_EMPTY;
}

/* Surely missed. One decision for all, as none of its parts can be foreseen: a branch for each would cost more than what it
 * saves. */
static inline bool missed(const Corners *k, const Edges *e, d4 in, KellerRange clip)
{
    int beside = (d4_mask(in) == 0) & (int)separated(k, e);
    return beside | (k->high < clip.near - k->z_slack) | (k->low > clip.far + k->z_slack);
}

/* The range within the clip, empty if missed; *near, *far: what point_of needs, where asked for. */
static inline KellerRange test(const KellerCone *cone, Corners *k, Edges *e, KellerRange clip, bool points, End *near,
                               End *far)
{
    d4 in = inside(k);
    rotate(k);
    *e = edges_of(k);
    if (missed(k, e, in, clip)) return CONE_EMPTY;
    if (!points && ends_inside(k, in)) return intersect((KellerRange){k->low - k->z_slack, k->high + k->z_slack}, clip);
    ends_of(cone, k, e, near, far);
    return intersect(range_of(k, near, far), clip);
}

KellerRange keller_cone_triangle(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerVec3 c, KellerRange clip,
                                 KellerVec3 *nearest, KellerVec3 *farthest)
{
    clip = cone_clip(cone, clip);
    Corners k = corners(cone, a, b, c);
    Edges e;
    End near, far;
    bool points = nearest || farthest;
    KellerRange r = test(cone, &k, &e, clip, points, &near, &far);
    if (r.near <= r.far && points) {
        Candidate first = point_of(cone, &k, &e, &near, 1), last = point_of(cone, &k, &e, &far, -1);
        if (nearest) *nearest = place(a, b, c, first, last, greater(first.z, clip.near));
        if (farthest) *farthest = place(a, b, c, first, last, lesser(last.z, clip.far));
    }
    return r;
}

bool keller_cone_meets_triangle(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerVec3 c, KellerRange clip)
{
    clip = cone_clip(cone, clip);
    Corners k = corners(cone, a, b, c);
    d4 in = inside(&k);
    rotate(&k);
    Edges e = edges_of(&k);
    int out = missed(&k, &e, in, clip);
    if (out | ((k.low >= clip.near) & (k.high <= clip.far))) return !out; /* the clip cuts nothing off */
    End near, far;
    ends_of(cone, &k, &e, &near, &far);
    KellerRange r = intersect(range_of(&k, &near, &far), clip);
    return r.near <= r.far;
}

bool keller_cone_contains_triangle(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerVec3 c)
{
    return keller_cone_contains(cone, a) && keller_cone_contains(cone, b) && keller_cone_contains(cone, c);
}
