/* Cone and plane, point, and the Boolean test on boxes (paper, sections 3.1.1, 3.1.3). */
#include "geom/cone_frame.h"

bool keller_cone_contains(const KellerCone *cone, KellerVec3 p)
{
    KellerVec3 q = v3_sub(p, cone->origin), r = cone_rotate(cone, q);
    double size = norm1(q), z_slack = cone_z_slack(size), R = r.z * cone->tan_alpha + cone->x0 + cone_slack(cone, size);
    return R >= 0 && r.x * r.x + r.y * r.y <= R * R && r.z >= cone->z_near - z_slack && r.z <= cone->z_far + z_slack;
}

bool keller_cone_contains_box(const KellerCone *cone, KellerVec3 lower, KellerVec3 upper)
{
    for (int i = 0; i < 8; i++)
        if (!keller_cone_contains(cone, v3(i & 1 ? upper.x : lower.x, i & 2 ? upper.y : lower.y, i & 4 ? upper.z : lower.z)))
            return false;
    return true;
}

/* ---- plane ------------------------------------------------------------------------------------------------------ */

/* offset - normal.origin with the error of one rounding of the result and some 2^-100 of its terms (Ogita, Rump and Oishi
 * 2005, algorithm 5.3): far from the world's origin the plain sum would lose what the local frame is there to keep. */
static double plane_distance(KellerVec3 normal, double offset, KellerVec3 origin)
{
    const double n[3] = {normal.x, normal.y, normal.z}, o[3] = {origin.x, origin.y, origin.z};
    double sum = offset, lost = 0;
    for (int k = 0; k < 3; k++) {
        double p = -n[k] * o[k], low = product_error(-n[k], o[k], p), s = sum + p, part = s - sum;
        lost += low + ((sum - (s - part)) + (p - part));
        sum = s;
    }
    return sum + lost;
}

KellerRange keller_cone_plane(const KellerCone *cone, KellerVec3 normal, double offset, KellerRange clip,
                              KellerVec3 *nearest, KellerVec3 *farthest)
{
    clip = cone_clip(cone, clip);
    double x0 = cone->x0, T = cone->tan_alpha, d = plane_distance(normal, offset, cone->origin);
    double nx = v3_dot(normal, cone->major), ny = v3_dot(normal, cone->minor) / cone->e,
           nz = v3_dot(normal, cone->directrix), g = length2(nx, ny);
    /* The plane meets the section at z if |d - nz z| <= g R(z): eq. 4 with the u of eq. 5, as two half-lines of z,
     *     (nz + g T) z >= d - g x0   and   (nz - g T) z <= d + g x0,
     * which hold together also where an extreme is at infinity or on the other nappe. z >= 0, so slack on a coefficient only
     * ever lets more z through. The frame is orthonormal to some units and nx, ny, nz to 4: */
    double slack = KELLER_CONE_SLACK * (fabs(d) + x0) + 0x1p-98 * (fabs(offset) + norm1(cone->origin)), tilt = KELLER_CONE_SLACK * (1 + T);
    double c1 = nz + g * T + tilt, c2 = nz - g * T - tilt, d1 = d - g * x0 - slack, d2 = d + g * x0 + slack;
    KellerRange r = {greater(clip.near, 0), clip.far};
    if (c1 > 0) r.near = greater(r.near, d1 / c1);
    else if (c1 < 0) r.far = lesser(r.far, d1 / c1);
    else if (d1 > 0) return CONE_EMPTY;
    if (c2 > 0) r.far = lesser(r.far, d2 / c2);
    else if (c2 < 0) r.near = greater(r.near, d2 / c2);
    else if (d2 < 0) return CONE_EMPTY;
    /* the two quotients' roundings */
    r.near = greater(greater(clip.near, 0), r.near * (1 - 0x1p-50));
    r.far = lesser(clip.far, r.far * (1 + 0x1p-50));
    if (!(r.near <= r.far)) return CONE_EMPTY;
    for (int i = 0; i < 2; i++) {
        KellerVec3 *point = i ? farthest : nearest;
        if (!point) continue;
        double z = i ? r.far : r.near, R = z * T + x0;
        if (!isfinite(z)) {
            *point = v3(INFINITY, INFINITY, INFINITY);
            continue;
        }
        /* the point of the plane's trace at z that is nearest to the axis, in the stretched frame */
        double s = g > 0 ? (d - nz * z) / (g * g) : 0, most = g > 0 ? R / g : 0;
        s = greater(-most, lesser(most, s));
        *point = cone_world(cone, nx * s, ny * s, z);
    }
    return r;
}

bool keller_cone_meets_plane(const KellerCone *cone, KellerVec3 normal, double offset, KellerRange clip)
{
    KellerRange r = keller_cone_plane(cone, normal, offset, clip, NULL, NULL);
    return r.near <= r.far;
}
