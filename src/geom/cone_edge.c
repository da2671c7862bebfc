/* Cone and line, cone and edge (paper, section 3.1.2). */
#include "geom/cone_frame.h"

/* A line a + t l of the stretched frame, with the radius Ra + t Rl at each of its points, slack included. */
typedef struct {
    KellerVec3 a, l;
    double Ra, Rl;
} Line;

/* Narrows [t1, t2] to where L_u >= 0, u = p/|p|: F <= L_u, so nothing inside is lost, whatever p is. False: nothing is left.
 * The line may run to infinity, where L_u is its slope. */
static bool narrow(const Line *s, double px, double py, double *t1, double *t2)
{
    double rho = sqrt(px * px + py * py + TINY);
    double at = rho * s->Ra - (px * s->a.x + py * s->a.y), slope = rho * s->Rl - (px * s->l.x + py * s->l.y);
    if (slope > 0) *t1 = greater(*t1, -at / slope);
    else if (slope < 0) *t2 = lesser(*t2, -at / slope);
    else if (at < 0) return false;
    return !(*t1 > *t2);
}

/* The part of the line, t in [0, t_max], inside the cone. First the point where F is greatest: if that is outside, its
 * supporting plane separates. Between the ends that plane is parallel to the line (u.l = Rl). Then the roots of eq. 6, each
 * made safe and sharper by the supporting plane there, which is a step of Newton's method on a concave function. With R linear in t the discriminant is |l Ra - a Rl|^2 - |a x l|^2
 * (Lagrange's identity): a difference of squares that are themselves free of cancellation. */
static bool inside(const Line *s, double t_max, double *t1, double *t2)
{
    double ax = s->a.x, ay = s->a.y, lx = s->l.x, ly = s->l.y, Ra = s->Ra, Rl = s->Rl;
    double l2 = lx * lx + ly * ly, A = l2 - Rl * Rl, side = ax * ly - ay * lx, cross = fabs(side), dot = ax * lx + ay * ly;
    *t1 = 0;
    *t2 = t_max;
    double t = Rl > 0 ? t_max : 0;
    if (A > 0) t = greater(0, lesser(t_max, (cross * Rl / sqrt(A) - dot) / l2));
    if (A > 0 && t > 0 && t < t_max) { /* from the line's direction alone: its point near the axis is mostly rounding */
        double turn = copysign(sqrt(A), side);
        if (!narrow(s, (Rl * lx + turn * ly) / l2, (Rl * ly - turn * lx) / l2, t1, t2)) return false;
    } else if (t < INFINITY && !narrow(s, ax + t * lx, ay + t * ly, t1, t2)) {
        return false;
    }
    /* the supporting plane that a line tends to at infinity: the only one for a line through the apex */
    if (t_max == INFINITY && !narrow(s, lx, ly, t1, t2)) return false;
    double px = lx * Ra - ax * Rl, py = ly * Ra - ay * Rl, P = length2(px, py);
    double root = sqrt(greater((P + cross) * (P - cross), 0));
    double B = dot - Ra * Rl, C = (length2(ax, ay) - Ra) * (length2(ax, ay) + Ra), q = B >= 0 ? -(B + root) : root - B;
    double ends[2] = {q / A, C / q};
    for (int i = 0; i < 2; i++)
        if (fabs(ends[i]) < INFINITY && !narrow(s, ax + ends[i] * lx, ay + ends[i] * ly, t1, t2)) return false;
    return true;
}

static double along(double z, double lz, double t) { return t > 0 && lz != 0 ? z + t * lz : z; }

/* The range of the part [t1, t2] of a line, and its ends' parameters within the clip. */
static KellerRange range_of(double z, double lz, double z_slack, double slope_slack, KellerRange clip, double *t1, double *t2)
{
    if (lz < 0) {
        double t = *t1;
        *t1 = *t2;
        *t2 = t;
    }
    double z1 = along(z, lz, *t1), z2 = along(z, lz, *t2);
    /* the slope is known to slope_slack only, so either end may be the lower one, and an unlimited one anywhere */
    double s1 = *t1 < INFINITY ? *t1 * slope_slack : 0, s2 = *t2 < INFINITY ? *t2 * slope_slack : 0;
    double near = lesser(z1 - s1, z2 - s2) - z_slack, far = greater(z1 + s1, z2 + s2) + z_slack;
    if (greater(*t1, *t2) == INFINITY && fabs(lz) <= slope_slack) near = -INFINITY, far = INFINITY;
    KellerRange r = {greater(near, clip.near), lesser(far, clip.far)};
    if (!(r.near <= r.far)) return CONE_EMPTY;
    if (z1 < clip.near && lz != 0) *t1 = (clip.near - z) / lz;
    if (z2 > clip.far && lz != 0) *t2 = (clip.far - z) / lz;
    return r;
}

static KellerRange edge(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerRange clip, double *t1, double *t2)
{
    KellerVec3 qa = v3_sub(a, cone->origin), qb = v3_sub(b, cone->origin), la = cone_rotate(cone, qa),
               lb = cone_rotate(cone, qb);
    double size = greater(norm1(qa), norm1(qb)), slack = cone_slack(cone, size), z_slack = cone_z_slack(size);
    if (greater(la.z, lb.z) < clip.near - z_slack || lesser(la.z, lb.z) > clip.far + z_slack) return CONE_EMPTY;
    double Ra = la.z * cone->tan_alpha + cone->x0 + slack, Rb = lb.z * cone->tan_alpha + cone->x0 + slack;
    if (Ra >= 0 && Rb >= 0 && la.x * la.x + la.y * la.y <= Ra * Ra && lb.x * lb.x + lb.y * lb.y <= Rb * Rb) {
        KellerRange r = {greater(lesser(la.z, lb.z) - z_slack, clip.near), lesser(greater(la.z, lb.z) + z_slack, clip.far)};
        double lz = lb.z - la.z, cut[2] = {(greater(clip.near, lesser(la.z, lb.z)) - la.z) / lz,
                                           (lesser(clip.far, greater(la.z, lb.z)) - la.z) / lz};
        *t1 = lz != 0 ? cut[0] : 0;
        *t2 = lz != 0 ? cut[1] : 1;
        return r.near <= r.far ? r : CONE_EMPTY;
    }
    Line s = {la, v3_sub(lb, la), Ra, (lb.z - la.z) * cone->tan_alpha};
    if (!inside(&s, 1, t1, t2)) return CONE_EMPTY;
    return range_of(la.z, s.l.z, z_slack, 0, clip, t1, t2);
}

KellerRange keller_cone_edge(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerRange clip, KellerVec3 *nearest,
                             KellerVec3 *farthest)
{
    double t1, t2;
    KellerRange r = edge(cone, a, b, cone_clip(cone, clip), &t1, &t2);
    if (r.near > r.far) return r;
    if (nearest) *nearest = v3_madd(a, v3_sub(b, a), greater(0, lesser(1, t1)));
    if (farthest) *farthest = v3_madd(a, v3_sub(b, a), greater(0, lesser(1, t2)));
    return r;
}

bool keller_cone_meets_edge(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerRange clip)
{
    double t1, t2;
    KellerRange r = edge(cone, a, b, cone_clip(cone, clip), &t1, &t2);
    return r.near <= r.far;
}

/* One of a line's two halves from p. Errors grow along it, so the slack does: the cone is grown by an angle too. */
static KellerRange half_line(const KellerCone *cone, KellerVec3 p, KellerVec3 direction, KellerRange clip, KellerVec3 *nearest,
                             KellerVec3 *farthest)
{
    KellerVec3 q = v3_sub(p, cone->origin), a = cone_rotate(cone, q), l = cone_rotate(cone, direction);
    double slope_slack = cone_z_slack(norm1(direction)), t1, t2;
    Line s = {a, l, a.z * cone->tan_alpha + cone->x0 + cone_slack(cone, norm1(q)),
              l.z * cone->tan_alpha + KELLER_CONE_SLACK * (cone->e + cone->tan_alpha) * norm1(direction)};
    if (!inside(&s, INFINITY, &t1, &t2)) return CONE_EMPTY;
    KellerRange r = range_of(a.z, l.z, cone_z_slack(norm1(q)), slope_slack, clip, &t1, &t2);
    const KellerVec3 nowhere = {INFINITY, INFINITY, INFINITY};
    if (nearest) *nearest = t1 < INFINITY ? v3_madd(p, direction, greater(0, t1)) : nowhere;
    if (farthest) *farthest = t2 < INFINITY ? v3_madd(p, direction, greater(0, t2)) : nowhere;
    return r;
}

KellerRange keller_cone_line(const KellerCone *cone, KellerVec3 p, KellerVec3 direction, KellerRange clip,
                             KellerVec3 *nearest, KellerVec3 *farthest)
{
    clip = cone_clip(cone, clip);
    KellerVec3 n[2], f[2];
    KellerRange half[2], r = CONE_EMPTY;
    for (int i = 0; i < 2; i++) {
        half[i] = half_line(cone, p, v3_scale(direction, i ? -1 : 1), clip, &n[i], &f[i]);
        if (half[i].near > half[i].far) continue;
        if (half[i].near < r.near && nearest) *nearest = n[i];
        if (half[i].far > r.far && farthest) *farthest = f[i];
        r = (KellerRange){lesser(r.near, half[i].near), greater(r.far, half[i].far)};
    }
    return r;
}

bool keller_cone_meets_line(const KellerCone *cone, KellerVec3 p, KellerVec3 direction, KellerRange clip)
{
    KellerRange r = keller_cone_line(cone, p, direction, clip, NULL, NULL);
    return r.near <= r.far;
}
