/* The elliptic conic frustum in its local frame with y stretched by e: there the cross-section is a circle of radius
 * R(z) = z tan_alpha + x0, and every test is one on a circular cone (Emre et al. 2025, section 3). */
#include "keller/cone.h"

#include <assert.h>

#include "base/number.h"

#define TAN_MAX 5.671281819617709 /* tan 80 degrees */

static const KellerRange EMPTY = {INFINITY, -INFINITY};

static KellerRange include(KellerRange r, double z) { return (KellerRange){lesser(r.near, z), greater(r.far, z)}; }

/* A point in the stretched local frame. */
static KellerVec3 local(const KellerCone *c, KellerVec3 p)
{
    KellerVec3 q = v3_sub(p, c->origin);
    return v3(v3_dot(q, c->major), v3_dot(q, c->minor) * c->e, v3_dot(q, c->directrix));
}

static double size1(KellerVec3 p) { return fabs(p.x) + fabs(p.y) + fabs(p.z); }

static bool inside(const KellerCone *c, KellerVec3 p, double slack)
{
    double R = p.z * c->tan_alpha + c->x0 + slack;
    return R >= 0 && p.x * p.x + p.y * p.y <= R * R;
}

static KellerRange clip_of(const KellerCone *c, KellerRange clip)
{
    return (KellerRange){greater(c->z_near, clip.near), lesser(c->z_far, clip.far)};
}

/* ---- construction --------------------------------------------------------------------------------------------- */

KellerCone keller_cone_round(KellerVec3 origin, KellerVec3 directrix, double half_angle)
{
    KellerCone c = {.origin = origin, .directrix = directrix, .tan_alpha = tan(half_angle), .e = 1, .z_far = INFINITY};
    c.major = v3_perpendicular(directrix);
    c.minor = v3_cross(directrix, c.major);
    return c;
}

/* Turns major and minor into the principal axes of the points (x, y) and sets e to the ratio of their extents there. */
static void lay_ellipse(KellerCone *c, size_t count, const double (*xy)[2], double e_max)
{
    double xx = 0, yy = 0, xy_sum = 0;
    for (size_t i = 0; i < count; i++) {
        xx += xy[i][0] * xy[i][0];
        yy += xy[i][1] * xy[i][1];
        xy_sum += xy[i][0] * xy[i][1];
    }
    double angle = 0.5 * atan2(2 * xy_sum, xx - yy), co = cos(angle), si = sin(angle), a = 0, b = 0;
    for (size_t i = 0; i < count; i++) {
        a = greater(a, fabs(co * xy[i][0] + si * xy[i][1]));
        b = greater(b, fabs(-si * xy[i][0] + co * xy[i][1]));
    }
    if (b > a) { /* the longer extent is the major axis */
        double t = co;
        co = -si;
        si = t;
        t = a;
        a = b;
        b = t;
    }
    KellerVec3 major = v3_unit(v3_add(v3_scale(c->major, co), v3_scale(c->minor, si)));
    major = v3_unit(v3_madd(major, c->directrix, -v3_dot(major, c->directrix)));
    c->major = major;
    c->minor = v3_cross(c->directrix, major);
    c->e = a > 0 ? lesser(a / greater(b, a / e_max), e_max) : 1;
}

bool keller_cone_fan(size_t source_count, const KellerVec3 *sources, size_t count, const KellerVec3 *directions,
                     KellerCone *cone, double *z_start)
{
    enum { MOST = 8 };
    assert(source_count >= 1 && source_count <= MOST && count >= 1 && count <= MOST);
    KellerVec3 sum = v3(0, 0, 0), middle = v3(0, 0, 0);
    for (size_t i = 0; i < count; i++) sum = v3_add(sum, v3_unit(directions[i]));
    for (size_t i = 0; i < source_count; i++) middle = v3_madd(middle, sources[i], 1.0 / (double)source_count);
    *cone = keller_cone_round(middle, v3_unit(sum), 0);
    if (!(v3_norm(sum) > 1e-6)) return false;
    double slope[MOST][2], foot[MOST][2], z_low = 0, z_high = 0;
    for (size_t i = 0; i < count; i++) {
        double dz = v3_dot(directions[i], cone->directrix);
        if (!(dz > 0.1 * v3_norm(directions[i]))) return false;
        slope[i][0] = v3_dot(directions[i], cone->major) / dz;
        slope[i][1] = v3_dot(directions[i], cone->minor) / dz;
    }
    for (size_t i = 0; i < source_count; i++) {
        KellerVec3 q = v3_sub(sources[i], middle);
        foot[i][0] = v3_dot(q, cone->major);
        foot[i][1] = v3_dot(q, cone->minor);
        double z = v3_dot(q, cone->directrix);
        z_low = lesser(z_low, z);
        z_high = greater(z_high, z);
    }
    /* One eccentricity must serve both the footprint and the directions: lay it by the one that is longer against its own
     * spread. Directions decide for a point source. */
    if (source_count == 1) {
        lay_ellipse(cone, count, slope, 1e3);
    } else {
        double both[2 * MOST][2], reach = 0, spread = 0;
        for (size_t i = 0; i < source_count; i++) reach = greater(reach, length2(foot[i][0], foot[i][1]));
        for (size_t i = 0; i < count; i++) spread = greater(spread, length2(slope[i][0], slope[i][1]));
        for (size_t i = 0; i < source_count; i++)
            for (int j = 0; j < 2; j++) both[i][j] = reach > 0 ? foot[i][j] / reach : 0;
        for (size_t i = 0; i < count; i++)
            for (int j = 0; j < 2; j++) both[source_count + i][j] = spread > 0 ? slope[i][j] / spread : 0;
        lay_ellipse(cone, source_count + count, both, 1e3);
    }
    double t = 0, x0 = 0, size = 0;
    for (size_t i = 0; i < count; i++) {
        double dz = v3_dot(directions[i], cone->directrix);
        double x = v3_dot(directions[i], cone->major) / dz, y = cone->e * v3_dot(directions[i], cone->minor) / dz;
        t = greater(t, sqrt(x * x + y * y));
    }
    if (!(t < TAN_MAX)) return false;
    for (size_t i = 0; i < source_count; i++) {
        KellerVec3 q = local(cone, sources[i]);
        x0 = greater(x0, sqrt(q.x * q.x + q.y * q.y));
        size = greater(size, size1(sources[i]));
    }
    /* Rounding of the constructed axes and of the sources: a little wider. */
    cone->tan_alpha = t * (1 + 1e-12) + 1e-12;
    cone->x0 = x0 > 0 ? x0 * (1 + 1e-12) + cone->e * size * KELLER_CONE_SLACK : 0;
    cone->origin = v3_madd(middle, cone->directrix, z_low);
    if (z_start) *z_start = z_high - z_low;
    return true;
}

bool keller_cone_around(KellerVec3 apex, size_t count, const KellerVec3 *points, KellerCone *cone)
{
    KellerVec3 directions[8];
    assert(count >= 1 && count <= 8);
    for (size_t i = 0; i < count; i++) directions[i] = v3_sub(points[i], apex);
    return keller_cone_fan(1, &apex, count, directions, cone, NULL);
}

KellerCone keller_cone_mirror(const KellerCone *cone, KellerVec3 normal, double offset)
{
    KellerCone c = *cone;
    c.origin = v3_mirror_point(cone->origin, normal, offset);
    c.directrix = v3_mirror_direction(cone->directrix, normal);
    c.major = v3_mirror_direction(cone->major, normal);
    c.minor = v3_scale(v3_mirror_direction(cone->minor, normal), -1); /* keep the frame right-handed */
    return c;
}

/* ---- tests ---------------------------------------------------------------------------------------------------- */

bool keller_cone_contains(const KellerCone *cone, KellerVec3 p)
{
    KellerVec3 q = local(cone, p);
    double slack = KELLER_CONE_SLACK * (size1(q) + cone->e * (size1(p) + size1(cone->origin)) + cone->x0);
    return inside(cone, q, slack) && q.z >= cone->z_near - slack && q.z <= cone->z_far + slack;
}

KellerRange keller_cone_plane(const KellerCone *cone, KellerVec3 normal, double offset, KellerRange clip,
                              KellerVec3 *nearest, KellerVec3 *farthest)
{
    clip = clip_of(cone, clip);
    double nx = v3_dot(normal, cone->major), ny = v3_dot(normal, cone->minor) / cone->e,
           nz = v3_dot(normal, cone->directrix), d = offset - v3_dot(normal, cone->origin), g = length2(nx, ny);
    /* The plane meets the cross-section at z if |d - nz z| <= g R(z): two half-lines of z, eq. 4 with u from eq. 5. Walk
     * through the sign cases by intersecting d - nz z <= g R and -(d - nz z) <= g R. */
    double slack = KELLER_CONE_SLACK * (fabs(offset) + size1(cone->origin) + fabs(d) + cone->x0);
    double gR = g * cone->x0 + slack;
    KellerRange r = clip;
    double c1 = nz + g * cone->tan_alpha, c2 = nz - g * cone->tan_alpha; /* c1 z >= d - g x0,  c2 z <= d + g x0 */
    if (c1 > 0) r.near = greater(r.near, (d - gR) / c1);
    else if (c1 < 0) r.far = lesser(r.far, (d - gR) / c1);
    else if (d > gR) return EMPTY;
    if (c2 > 0) r.far = lesser(r.far, (d + gR) / c2);
    else if (c2 < 0) r.near = greater(r.near, (d + gR) / c2);
    else if (d < -gR) return EMPTY;
    if (r.near > r.far) return EMPTY;
    for (int i = 0; i < 2; i++) {
        KellerVec3 *point = i ? farthest : nearest;
        if (!point) continue;
        double z = i ? r.far : r.near, R = z * cone->tan_alpha + cone->x0;
        if (!isfinite(z)) {
            *point = v3(INFINITY, INFINITY, INFINITY);
            continue;
        }
        /* the point of the line plane-cross-section nearest to the axis lies in the ellipse: x = nx s, y = ny s / e */
        double s = g > 0 ? (d - nz * z) / (g * g) : 0, most = g > 0 ? R / g : 0;
        s = greater(-most, lesser(most, s));
        *point = v3_madd(v3_madd(v3_madd(cone->origin, cone->directrix, z), cone->major, nx * s), cone->minor,
                         ny * s / cone->e);
    }
    return r;
}

/* The interval of t in [0, 1] in which a + t (b - a), in the stretched local frame, is inside the infinite forward cone;
 * false if there is none. With R linear in t, the discriminant of eq. 6 is |l Ra - a Rl|^2 - |a x l|^2 (Lagrange's
 * identity in the Minkowski metric): a difference of squares of quantities that are themselves free of cancellation. */
static bool edge_interval(const KellerCone *c, KellerVec3 a, KellerVec3 b, double slack, double *t1, double *t2)
{
    bool in_a = inside(c, a, slack), in_b = inside(c, b, slack);
    *t1 = 0;
    *t2 = 1;
    if (in_a && in_b) return true;
    if (a.x == b.x && a.y == b.y && a.z == b.z) return false; /* a point, outside */
    double lx = b.x - a.x, ly = b.y - a.y, Ra = a.z * c->tan_alpha + c->x0 + slack, Rl = (b.z - a.z) * c->tan_alpha;
    double px = lx * Ra - a.x * Rl, py = ly * Ra - a.y * Rl, P = length2(px, py), Q = fabs(a.x * ly - a.y * lx);
    double err = KELLER_CONE_SLACK * (fabs(a.x) + fabs(a.y) + fabs(Ra)) * (fabs(lx) + fabs(ly) + fabs(Rl));
    if (P + err < Q) return false;
    double D = (P + Q) * greater(P - Q + 2 * err, 0) + err * err, root = sqrt(D);
    double A = lx * lx + ly * ly - Rl * Rl, B = a.x * lx + a.y * ly - Ra * Rl, C = a.x * a.x + a.y * a.y - Ra * Ra;
    double q = -(B + copysign(root, B));
    if (!(fabs(q) > 0)) return true; /* along the envelope: take it whole */
    double r1 = q / A, r2 = C / q;
    if (A != 0 && r1 > r2) {
        double t = r1;
        r1 = r2;
        r2 = t;
    }
    if (!(A != 0)) { /* parallel to the envelope: one root */
        if (B < 0) *t1 = greater(*t1, r2);
        else *t2 = lesser(*t2, r2);
    } else if (A > 0) { /* inside between the roots, on one nappe */
        if (!in_a && !in_b && Ra + Rl * greater(0, lesser(1, -B / A)) < 0) return false;
        *t1 = greater(*t1, r1);
        *t2 = lesser(*t2, r2);
    } else if (Rl > 0) { /* steeper than the envelope: from the forward root on */
        *t1 = greater(*t1, r2);
    } else {
        *t2 = lesser(*t2, r1);
    }
    if (in_a) *t1 = 0;
    if (in_b) *t2 = 1;
    return *t1 <= *t2;
}

static KellerRange edge_local(const KellerCone *c, KellerVec3 a, KellerVec3 b, KellerRange clip, double slack, double *ta,
                              double *tb)
{
    double t1, t2;
    if (greater(a.z, b.z) < clip.near - slack || lesser(a.z, b.z) > clip.far + slack) return EMPTY;
    if (!edge_interval(c, a, b, slack, &t1, &t2)) return EMPTY;
    double z1 = a.z + t1 * (b.z - a.z), z2 = a.z + t2 * (b.z - a.z);
    if (z1 > z2) {
        double t = z1;
        z1 = z2;
        z2 = t;
        t = t1;
        t1 = t2;
        t2 = t;
    }
    if (z2 < clip.near - slack || z1 > clip.far + slack) return EMPTY;
    if (z1 < clip.near && z2 > z1) t1 += (t2 - t1) * (clip.near - z1) / (z2 - z1), z1 = clip.near;
    if (z2 > clip.far && z2 > z1) t2 = t1 + (t2 - t1) * (clip.far - z1) / (z2 - z1), z2 = clip.far;
    *ta = t1;
    *tb = t2;
    return (KellerRange){greater(z1 - slack, clip.near), lesser(z2 + slack, greater(clip.far, z1))};
}

KellerRange keller_cone_edge(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerRange clip, KellerVec3 *nearest,
                             KellerVec3 *farthest)
{
    clip = clip_of(cone, clip);
    KellerVec3 la = local(cone, a), lb = local(cone, b);
    double slack = KELLER_CONE_SLACK * (size1(la) + size1(lb) + cone->x0 +
                                        cone->e * (size1(a) + size1(b) + size1(cone->origin)));
    double t1, t2;
    KellerRange r = edge_local(cone, la, lb, clip, slack, &t1, &t2);
    if (r.near > r.far) return EMPTY;
    if (nearest) *nearest = v3_madd(a, v3_sub(b, a), greater(0, lesser(1, t1)));
    if (farthest) *farthest = v3_madd(a, v3_sub(b, a), greater(0, lesser(1, t2)));
    return r;
}

/* Is p, a point of the triangle's plane, inside the triangle (normal n, not unit), or outside by less than slack? */
static bool in_triangle(KellerVec3 p, KellerVec3 a, KellerVec3 b, KellerVec3 c, KellerVec3 n, double slack)
{
    KellerVec3 ab = v3_cross(v3_sub(b, a), v3_sub(p, a)), bc = v3_cross(v3_sub(c, b), v3_sub(p, b)),
               ca = v3_cross(v3_sub(a, c), v3_sub(p, c));
    double s = slack * v3_norm(n);
    return v3_dot(ab, n) >= -s * v3_distance(a, b) && v3_dot(bc, n) >= -s * v3_distance(b, c) &&
           v3_dot(ca, n) >= -s * v3_distance(c, a);
}

KellerRange keller_cone_triangle(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerVec3 c, KellerRange clip,
                                 KellerVec3 *nearest, KellerVec3 *farthest)
{
    clip = clip_of(cone, clip);
    KellerVec3 v[3] = {local(cone, a), local(cone, b), local(cone, c)}, w[3] = {a, b, c};
    double slack = KELLER_CONE_SLACK * (size1(v[0]) + size1(v[1]) + size1(v[2]) + cone->x0 +
                                        cone->e * (size1(a) + size1(b) + size1(c) + size1(cone->origin)));
    double z_low = lesser(v[0].z, lesser(v[1].z, v[2].z)), z_high = greater(v[0].z, greater(v[1].z, v[2].z));
    KellerRange possible = {greater(clip.near, z_low - slack), lesser(clip.far, z_high + slack)}, r = EMPTY;
    if (possible.near > possible.far) return EMPTY;
    /* most triangles that a traversal offers are cut off by the cone's tangent plane on their side */
    double mx = v[0].x + v[1].x + v[2].x, my = v[0].y + v[1].y + v[2].y, m = length2(mx, my);
    if (m > 0) {
        double beyond = INFINITY;
        for (int i = 0; i < 3; i++) beyond = lesser(beyond, (v[i].x * mx + v[i].y * my) / m - v[i].z * cone->tan_alpha);
        if (beyond > cone->x0 + slack) return EMPTY;
    }
    KellerVec3 near_point = a, far_point = a;
    /* cases 1 and 3: vertices and edges (an edge's range includes its vertices') */
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3;
        double t1 = 0, t2 = 1;
        KellerRange e = edge_local(cone, v[i], v[j], clip, slack, &t1, &t2);
        if (e.near > e.far) continue;
        if (e.near < r.near) near_point = v3_madd(w[i], v3_sub(w[j], w[i]), greater(0, lesser(1, t1)));
        if (e.far > r.far) far_point = v3_madd(w[i], v3_sub(w[j], w[i]), greater(0, lesser(1, t2)));
        r = (KellerRange){lesser(r.near, e.near), greater(r.far, e.far)};
    }
    /* case 2: the section of the cone with the triangle's plane has its extreme points, or its cut by a clip plane, or the
     * axis inside the triangle. In the stretched frame: plane n.p = d. */
    KellerVec3 n = v3_cross(v3_sub(v[1], v[0]), v3_sub(v[2], v[0]));
    double g = length2(n.x, n.y), d = v3_dot(n, v[0]), n_norm = sqrt(g * g + n.z * n.z);
    if (n_norm > 0) {
        double ux = g > 0 ? n.x / g : 1, uy = g > 0 ? n.y / g : 0;
        for (int i = 0; i < 5; i++) {
            double z, s; /* candidate: z, and the signed distance s from the axis along u */
            if (i < 2) {
                double sign = i ? 1 : -1, den = n.z + sign * cone->tan_alpha * g;
                z = (d - sign * cone->x0 * g) / den;
                s = sign * (z * cone->tan_alpha + cone->x0);
            } else if (i < 4) {
                z = i == 2 ? clip.near : clip.far;
                s = g > 0 ? (d - n.z * z) / g : 0;
                if (!(fabs(s) <= z * cone->tan_alpha + cone->x0 + slack)) continue;
            } else {
                z = d / n.z;
                s = 0;
            }
            if (!isfinite(z) || !isfinite(s) || z * cone->tan_alpha + cone->x0 < -slack) continue;
            if (z < clip.near - slack || z > clip.far + slack) continue;
            KellerVec3 p = v3(s * ux, s * uy, z);
            if (!in_triangle(p, v[0], v[1], v[2], n, slack)) continue;
            z = greater(possible.near, lesser(possible.far, z));
            KellerVec3 world = v3_madd(v3_madd(v3_madd(cone->origin, cone->major, p.x), cone->minor, p.y / cone->e),
                                       cone->directrix, p.z);
            if (z - slack < r.near) near_point = world;
            if (z + slack > r.far) far_point = world;
            r = include(include(r, z - slack), z + slack);
        }
    }
    if (r.near > r.far) return EMPTY;
    if (nearest) *nearest = near_point;
    if (farthest) *farthest = far_point;
    return (KellerRange){greater(r.near, possible.near), lesser(r.far, possible.far)};
}

bool keller_cone_box(const KellerCone *cone, KellerVec3 lower, KellerVec3 upper, KellerRange clip)
{
    clip = clip_of(cone, clip);
    KellerVec3 h = v3_scale(v3_sub(upper, lower), 0.5), m = v3_scale(v3_add(upper, lower), 0.5), c = local(cone, m);
    KellerVec3 D = cone->directrix, X = cone->major, Y = cone->minor;
    double hz = fabs(D.x) * h.x + fabs(D.y) * h.y + fabs(D.z) * h.z;
    double hx = fabs(X.x) * h.x + fabs(X.y) * h.y + fabs(X.z) * h.z;
    double hy = cone->e * (fabs(Y.x) * h.x + fabs(Y.y) * h.y + fabs(Y.z) * h.z);
    double slack = KELLER_CONE_SLACK * (size1(c) + hx + hy + hz + cone->x0 + cone->e * (size1(m) + size1(cone->origin)));
    double low = c.z - hz, high = c.z + hz;
    if (high < clip.near - slack || low > clip.far + slack) return false;
    double R = lesser(high, clip.far) * cone->tan_alpha + cone->x0 + slack;
    double dx = greater(fabs(c.x) - hx, 0), dy = greater(fabs(c.y) - hy, 0);
    if (R < 0 || dx * dx + dy * dy > R * R) return false;
    /* the tangent plane of the cone that faces the box's middle separates them? */
    double r = length2(c.x, c.y);
    if (r <= 0) return true;
    double ux = c.x / r, uy = c.y / r, t = cone->tan_alpha;
    KellerVec3 n = v3_sub(v3_add(v3_scale(X, ux), v3_scale(Y, uy * cone->e)), v3_scale(D, t));
    return r - t * c.z - (fabs(n.x) * h.x + fabs(n.y) * h.y + fabs(n.z) * h.z) <= cone->x0 + slack;
}
