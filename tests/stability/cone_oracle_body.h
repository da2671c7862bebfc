/* The text of the oracle, without an include guard: cone_oracle.c defines the number N, its functions ROOT and ABS, and
 * NAME, which makes each function's name its own, and includes it for each number. */

typedef struct {
    N x, y, z;
} NAME(Vec);

/* The cone, its axes as the rows of a matrix, and the inverse: columns of cofactors over the determinant. */
typedef struct {
    N origin[3], axis[3][3], inverse[3][3];
    N e, T, x0;
} NAME(Frame);

static NAME(Frame) NAME(frame_of)(const KellerCone *c)
{
    const KellerVec3 row[3] = {c->major, c->minor, c->directrix};
    NAME(Frame) f = {.origin = {c->origin.x, c->origin.y, c->origin.z}, .e = c->e, .T = c->tan_alpha, .x0 = c->x0};
    for (int i = 0; i < 3; i++) {
        f.axis[i][0] = row[i].x;
        f.axis[i][1] = row[i].y;
        f.axis[i][2] = row[i].z;
    }
    N determinant = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
            f.inverse[j][i] = f.axis[i1][j1] * f.axis[i2][j2] - f.axis[i1][j2] * f.axis[i2][j1];
        }
    for (int j = 0; j < 3; j++) determinant += f.axis[0][j] * f.inverse[j][0];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) f.inverse[j][i] /= determinant;
    return f;
}

/* A direction, or a point relative to the origin, in the frame in which y is stretched by e. */
static NAME(Vec) NAME(turn)(const NAME(Frame) *f, N x, N y, N z)
{
    const N (*m)[3] = f->axis;
    return (NAME(Vec)){m[0][0] * x + m[0][1] * y + m[0][2] * z, f->e * (m[1][0] * x + m[1][1] * y + m[1][2] * z),
                       m[2][0] * x + m[2][1] * y + m[2][2] * z};
}

static NAME(Vec) NAME(local_of)(const NAME(Frame) *f, KellerVec3 p)
{
    return NAME(turn)(f, p.x - f->origin[0], p.y - f->origin[1], p.z - f->origin[2]);
}

static N NAME(dot)(NAME(Vec) a, NAME(Vec) b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
/* Takes from n what it has along l. */
static void NAME(lean)(NAME(Vec) *n, NAME(Vec) l)
{
    N ll = NAME(dot)(l, l), share = ll > 0 ? NAME(dot)(*n, l) / ll : 0;
    *n = (NAME(Vec)){n->x - share * l.x, n->y - share * l.y, n->z - share * l.z};
}
static N NAME(size_of)(NAME(Vec) a) { return ABS(a.x) + ABS(a.y) + ABS(a.z); }
static N NAME(larger)(N a, N b) { return a > b ? a : b; }
static N NAME(smaller)(N a, N b) { return a < b ? a : b; }

static bool NAME(inside)(const NAME(Frame) *f, NAME(Vec) p)
{
    N R = p.z * f->T + f->x0;
    return R >= 0 && p.x * p.x + p.y * p.y <= R * R;
}

/* What has been collected: an interval of z of the cone without its clip planes. */
typedef struct {
    N low, high;
} NAME(Span);

static const NAME(Span) NAME(nothing) = {(N)INFINITY, -(N)INFINITY};

static void NAME(take)(NAME(Span) *s, N z)
{
    if (z < s->low) s->low = z;
    if (z > s->high) s->high = z;
}

static ConeTruth NAME(clipped)(const KellerCone *c, KellerRange clip, NAME(Span) s)
{
    N near = NAME(larger)(s.low, NAME(larger)(c->z_near, clip.near));
    N far = NAME(smaller)(s.high, NAME(smaller)(c->z_far, clip.far));
    return (ConeTruth){near <= far, (long double)near, (long double)far};
}

/* The interval of t in which a + t l is inside the cone: A t^2 + 2 B t + C <= 0 (eq. 6) and R >= 0. The discriminant
 * B^2 - A C is P^2 - Q^2 by Lagrange's identity in the metric of signature (+, +, -). `grow` is added to P relative to
 * its terms. False: nowhere. */
static bool NAME(line_interval)(const NAME(Frame) *f, NAME(Vec) a, NAME(Vec) l, N grow, N *t1, N *t2)
{
    const N infinite = (N)INFINITY;
    N Ra = a.z * f->T + f->x0, Rl = l.z * f->T, la = ROOT(a.x * a.x + a.y * a.y), ll = ROOT(l.x * l.x + l.y * l.y);
    N A = (ll - ABS(Rl)) * (ll + ABS(Rl)), B = a.x * l.x + a.y * l.y - Ra * Rl, C = (la - ABS(Ra)) * (la + ABS(Ra));
    N px = l.x * Ra - a.x * Rl, py = l.y * Ra - a.y * Rl, Q = ABS(a.x * l.y - a.y * l.x);
    N P = ROOT(px * px + py * py) + grow * (la + ABS(Ra)) * (ll + ABS(Rl));
    *t1 = -infinite;
    *t2 = infinite;
    if (!(ll > 0) && !(ABS(Rl) > 0)) return Ra >= 0 && C <= 0; /* x, y and R do not change */
    if (A == 0) {                                              /* parallel to a generator */
        if (B == 0) { /* in a tangent plane: on the generator, or never inside */
            if (C > 0) return false;
            *(Rl > 0 ? t1 : t2) = -Ra / Rl;
            return true;
        }
        if ((B < 0) != (Rl > 0)) return false; /* inside the backward cone */
        *(B < 0 ? t1 : t2) = -C / (2 * B);
        return true;
    }
    if (P < Q) {
        if (A > 0) return false;
        P = Q; /* steeper than the envelope: it enters the cone; rounding */
    }
    N root = ROOT((P - Q) * (P + Q)), q = B > 0 ? -(B + root) : root - B, r1 = q / A, r2 = q != 0 ? C / q : r1;
    if (r1 > r2) {
        N t = r1;
        r1 = r2;
        r2 = t;
    }
    if (A > 0) {
        if (Ra - Rl * (B / A) < 0) return false; /* both on the backward cone */
        *t1 = r1;
        *t2 = r2;
    } else if (Rl > 0) {
        *t1 = r2;
    } else {
        *t2 = r1;
    }
    return true;
}

static N NAME(depth_at)(const NAME(Frame) *f, NAME(Vec) a, NAME(Vec) b, N t)
{
    N x = a.x + t * (b.x - a.x), y = a.y + t * (b.y - a.y), z = a.z + t * (b.z - a.z);
    return z * f->T + f->x0 - ROOT(x * x + y * y);
}

/* The interval of [0, 1] in which a + t (b - a) is inside, from nothing but the depth, which is concave: its highest
 * point by thirds, then the ends by halves. For edges along a generator, the cone being grown by more than the depth's
 * rounding. */
static bool NAME(halved_interval)(const NAME(Frame) *f, NAME(Vec) a, NAME(Vec) b, bool in_a, bool in_b, N *t1, N *t2)
{
    N low = 0, high = 1, inside = in_a ? 0 : 1;
    for (int i = 0; !in_a && !in_b && i < 120; i++) {
        N third = (high - low) / 3, one = low + third, two = high - third;
        N depth_one = NAME(depth_at)(f, a, b, one), depth_two = NAME(depth_at)(f, a, b, two);
        if (depth_one < depth_two) low = one;
        else high = two;
        inside = depth_one < depth_two ? two : one;
        if (depth_one >= 0 || depth_two >= 0) in_a = in_b = true; /* found one */
    }
    if (NAME(depth_at)(f, a, b, inside) < 0 && !in_a && !in_b) return false;
    for (int end = 0; end < 2; end++) {
        N out = end, in = inside;
        if (NAME(depth_at)(f, a, b, out) >= 0) in = out;
        for (int i = 0; in != out && i < 70; i++) {
            N middle = (in + out) / 2;
            if (NAME(depth_at)(f, a, b, middle) >= 0) in = middle;
            else out = middle;
        }
        *(end ? t2 : t1) = out; /* outwards */
    }
    return true;
}

static void NAME(take_edge)(const NAME(Frame) *f, NAME(Vec) a, NAME(Vec) b, N grow, NAME(Span) *s)
{
    bool in_a = NAME(inside)(f, a), in_b = NAME(inside)(f, b);
    if (in_a) NAME(take)(s, a.z);
    if (in_b) NAME(take)(s, b.z);
    if (in_a && in_b) return;
    NAME(Vec) l = {b.x - a.x, b.y - a.y, b.z - a.z};
    N t1, t2, steep = ABS(l.z * f->T), flat = ROOT(l.x * l.x + l.y * l.y);
    if (grow > 0 && ABS(flat - steep) < 0x1p-20 * flat) { /* the roots hang on rounding */
        if (!NAME(halved_interval)(f, a, b, in_a, in_b, &t1, &t2)) return;
    } else if (!NAME(line_interval)(f, a, l, grow, &t1, &t2)) {
        return;
    }
    t1 = NAME(larger)(t1, 0);
    t2 = NAME(smaller)(t2, 1);
    if (!(t1 <= t2)) return;
    NAME(take)(s, t1 <= 0.5 ? a.z + t1 * l.z : b.z - (1 - t1) * l.z);
    NAME(take)(s, t2 <= 0.5 ? a.z + t2 * l.z : b.z - (1 - t2) * l.z);
}

/* Where the plane n.p = d (in the stretched frame) meets the cone: candidate 0 and 1 are the points of extreme z (eqs
 * 4, 5), 2 the point on the axis. False: there is none such. */
static bool NAME(plane_point)(const NAME(Frame) *f, NAME(Vec) n, N d, int which, NAME(Vec) *p)
{
    N g = ROOT(n.x * n.x + n.y * n.y);
    if (which == 2) {
        if (n.z == 0) return false;
        *p = (NAME(Vec)){0, 0, d / n.z};
        return p->z * f->T + f->x0 >= 0;
    }
    N sign = which ? 1 : -1, slope = n.z + sign * f->T * g;
    if (slope == 0 || g == 0) return false;
    N z = (d - sign * f->x0 * g) / slope, R = z * f->T + f->x0;
    *p = (NAME(Vec)){sign * R * n.x / g, sign * R * n.y / g, z};
    return R >= 0;
}

static ConeTruth NAME(plane)(const KellerCone *cone, KellerVec3 normal, double offset, KellerRange clip, double grow)
{
    NAME(Frame) f = NAME(frame_of)(cone);
    /* n.(inverse * p) = (inverse^T n).p */
    N n[3], d = offset - (normal.x * f.origin[0] + normal.y * f.origin[1] + normal.z * f.origin[2]);
    for (int i = 0; i < 3; i++)
        n[i] = normal.x * f.inverse[0][i] + normal.y * f.inverse[1][i] + normal.z * f.inverse[2][i];
    n[1] /= f.e;
    /* |d - n_z z| <= g R(z), which for g = 0 still needs R >= 0: three half-lines of z, k[0] z >= k[1] */
    N g = ROOT(n[0] * n[0] + n[1] * n[1]), wide = g * f.x0 + grow * (ABS(d) + g * f.x0);
    N half[3][2] = {{g * f.T + n[2], d - wide}, {g * f.T - n[2], -d - wide}, {f.T, -f.x0 * (1 + (N)grow)}};
    NAME(Span) s = {-(N)INFINITY, (N)INFINITY};
    for (int i = 0; i < 3; i++) {
        N z = half[i][1] / half[i][0];
        if (half[i][0] > 0)
            s.low = NAME(larger)(s.low, z);
        else if (half[i][0] < 0)
            s.high = NAME(smaller)(s.high, z);
        else if (half[i][1] > 0)
            s = NAME(nothing);
    }
    return NAME(clipped)(cone, clip, s);
}

static void NAME(grow_by)(NAME(Frame) *f, double grow, int count, const NAME(Vec) *v, N *slack)
{
    *slack = 0;
    if (!(grow > 0)) return;
    for (int i = 0; i < count; i++) *slack = NAME(larger)(*slack, NAME(size_of)(v[i]));
    *slack = grow * (f->e * *slack + f->x0); /* y is the difference of terms e times as large */
    f->x0 += *slack;
}

static ConeTruth NAME(line)(const KellerCone *cone, KellerVec3 p, KellerVec3 direction, KellerRange clip, double grow)
{
    NAME(Frame) f = NAME(frame_of)(cone);
    NAME(Vec) a = NAME(local_of)(&f, p), l = NAME(turn)(&f, direction.x, direction.y, direction.z);
    NAME(Span) s = NAME(nothing);
    N slack, t1, t2;
    NAME(grow_by)(&f, grow, 1, &a, &slack);
    if (NAME(line_interval)(&f, a, l, grow, &t1, &t2)) {
        NAME(take)(&s, l.z != 0 ? a.z + t1 * l.z : a.z);
        NAME(take)(&s, l.z != 0 ? a.z + t2 * l.z : a.z);
    }
    return NAME(clipped)(cone, clip, s);
}

static ConeTruth NAME(edge)(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerRange clip, double grow)
{
    NAME(Frame) f = NAME(frame_of)(cone);
    NAME(Vec) v[2] = {NAME(local_of)(&f, a), NAME(local_of)(&f, b)};
    NAME(Span) s = NAME(nothing);
    N slack;
    NAME(grow_by)(&f, grow, 2, v, &slack);
    NAME(take_edge)(&f, v[0], v[1], grow, &s);
    return NAME(clipped)(cone, clip, s);
}

/* Is p, a point of the plane of the triangle with normal n, in the triangle, or outside by no more than slack? */
static bool NAME(on_triangle)(NAME(Vec) p, const NAME(Vec) v[3], NAME(Vec) n, N slack)
{
    const N P[3] = {p.x, p.y, p.z}, nn[3] = {n.x, n.y, n.z};
    N V[3][3];
    for (int i = 0; i < 3; i++) {
        V[i][0] = v[i].x;
        V[i][1] = v[i].y;
        V[i][2] = v[i].z;
    }
    for (int k = 0; k < 3; k++) /* a triangle of no width has no inside to bound it along itself: its bounds do */
        if (P[k] < NAME(smaller)(V[0][k], NAME(smaller)(V[1][k], V[2][k])) - slack ||
            P[k] > NAME(larger)(V[0][k], NAME(larger)(V[1][k], V[2][k])) + slack)
            return false;
    /* projected along the largest component of the normal */
    int k = ABS(n.x) >= ABS(n.y) && ABS(n.x) >= ABS(n.z) ? 0
            : ABS(n.y) >= ABS(n.z)                       ? 1
                                                         : 2,
        i1 = (k + 1) % 3, i2 = (k + 2) % 3;
    N turn = nn[k] > 0 ? 1 : -1;
    for (int i = 0; i < 3; i++) {
        const N *from = V[i], *to = V[(i + 1) % 3];
        N ex = to[i1] - from[i1], ey = to[i2] - from[i2];
        if (turn * (ex * (P[i2] - from[i2]) - ey * (P[i1] - from[i1])) < -slack * (ABS(ex) + ABS(ey))) return false;
    }
    return true;
}

static ConeTruth NAME(triangle)(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerVec3 c, KellerRange clip,
                                double grow)
{
    NAME(Frame) f = NAME(frame_of)(cone);
    NAME(Vec) v[3] = {NAME(local_of)(&f, a), NAME(local_of)(&f, b), NAME(local_of)(&f, c)}, p;
    NAME(Span) s = NAME(nothing);
    N slack;
    NAME(grow_by)(&f, grow, 3, v, &slack);
    for (int i = 0; i < 3; i++) NAME(take_edge)(&f, v[i], v[(i + 1) % 3], grow, &s);
    NAME(Vec) l = {v[1].x - v[0].x, v[1].y - v[0].y, v[1].z - v[0].z};
    NAME(Vec) m = {v[2].x - v[0].x, v[2].y - v[0].y, v[2].z - v[0].z};
    NAME(Vec) n = {l.y * m.z - l.z * m.y, l.z * m.x - l.x * m.z, l.x * m.y - l.y * m.x};
    /* the normal of a sliver, made perpendicular to its sides again */
    N ll = NAME(dot)(l, l), along = ll > 0 ? NAME(dot)(m, l) / ll : 0;
    m = (NAME(Vec)){m.x - along * l.x, m.y - along * l.y, m.z - along * l.z};
    NAME(lean)(&n, l);
    NAME(lean)(&n, m);
    NAME(lean)(&n, l);
    N d = n.x * v[0].x + n.y * v[0].y + n.z * v[0].z;
    if (n.x != 0 || n.y != 0 || n.z != 0)
        for (int which = 0; which < 3; which++)
            if (NAME(plane_point)(&f, n, d, which, &p) && NAME(on_triangle)(p, v, n, slack)) NAME(take)(&s, p.z);
    return NAME(clipped)(cone, clip, s);
}

/* Is p, in the stretched frame, in the box but for the axis `but` (3: for none)? Bounds are from the cone's origin. */
static bool NAME(in_box)(const NAME(Frame) *f, NAME(Vec) p, N bound[3][2], int but, N slack)
{
    for (int k = 0; k < 3; k++) {
        N q = f->inverse[k][0] * p.x + f->inverse[k][1] * (p.y / f->e) + f->inverse[k][2] * p.z;
        if (k != but && (q < bound[k][0] - slack || q > bound[k][1] + slack)) return false;
    }
    return true;
}

static ConeTruth NAME(box)(const KellerCone *cone, KellerVec3 lower, KellerVec3 upper, KellerRange clip, double grow)
{
    NAME(Frame) f = NAME(frame_of)(cone);
    N bound[3][2] = {{lower.x - f.origin[0], upper.x - f.origin[0]},
                     {lower.y - f.origin[1], upper.y - f.origin[1]},
                     {lower.z - f.origin[2], upper.z - f.origin[2]}};
    NAME(Vec) v[8], p;
    for (int i = 0; i < 8; i++) v[i] = NAME(turn)(&f, bound[0][i & 1], bound[1][i >> 1 & 1], bound[2][i >> 2]);
    NAME(Span) s = NAME(nothing);
    N slack;
    NAME(grow_by)(&f, grow, 8, v, &slack);
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 3; k++)
            if (!(i >> k & 1)) NAME(take_edge)(&f, v[i], v[i | 1 << k], grow, &s);
    for (int k = 0; k < 3; k++) {
        NAME(Vec) n = {f.inverse[k][0], f.inverse[k][1] / f.e, f.inverse[k][2]};
        for (int side = 0; side < 2; side++)
            for (int which = 0; which < 3; which++)
                if (NAME(plane_point)(&f, n, bound[k][side], which, &p) && NAME(in_box)(&f, p, bound, k, slack))
                    NAME(take)(&s, p.z);
    }
    if (f.T > 0) {
        p = (NAME(Vec)){0, 0, -f.x0 / f.T};
        if (NAME(in_box)(&f, p, bound, 3, slack)) NAME(take)(&s, p.z);
    }
    return NAME(clipped)(cone, clip, s);
}

static bool NAME(contains)(const KellerCone *cone, KellerVec3 point, double grow)
{
    NAME(Frame) f = NAME(frame_of)(cone);
    NAME(Vec) p = NAME(local_of)(&f, point);
    N slack;
    NAME(grow_by)(&f, grow, 1, &p, &slack);
    return NAME(inside)(&f, p) && p.z >= cone->z_near - slack && p.z <= cone->z_far + slack;
}

static long double NAME(z)(const KellerCone *cone, KellerVec3 p)
{
    NAME(Frame) f = NAME(frame_of)(cone);
    return (long double)NAME(local_of)(&f, p).z;
}

static long double NAME(outside)(const KellerCone *cone, KellerVec3 point)
{
    NAME(Frame) f = NAME(frame_of)(cone);
    NAME(Vec) p = NAME(local_of)(&f, point);
    N r = ROOT(p.x * p.x + p.y * p.y), y = p.y / f.e, R = p.z * f.T + f.x0;
    /* on the way to the axis x, y and the ellipse shrink alike; behind the apex there is no ellipse to reach */
    return (long double)(r > 0 && R >= 0 ? (r - R) / r * ROOT(p.x * p.x + y * y) : -R);
}
