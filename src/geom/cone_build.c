/* Construction of elliptic conic frusta; the smallest around points is in cone_ellipse.c. */
#include "geom/cone_frame.h"

#include <assert.h>

KellerCone keller_cone_round(KellerVec3 origin, KellerVec3 directrix, double half_angle)
{
    KellerCone c = {.origin = origin, .directrix = directrix, .tan_alpha = tan(half_angle), .e = 1, .z_far = INFINITY};
    c.major = v3_perpendicular(directrix);
    c.minor = v3_cross(directrix, c.major);
    return c;
}

KellerCone keller_cone_elliptic(KellerVec3 origin, KellerVec3 directrix, KellerVec3 major, double half_angle,
                                double eccentricity, double x0)
{
    assert(half_angle >= 0 && half_angle < M_PI / 2 && eccentricity >= 0 && eccentricity < 1 && x0 >= 0);
    KellerCone c = {.origin = origin, .directrix = directrix, .tan_alpha = tan(half_angle), .z_far = INFINITY};
    c.x0 = x0;
    for (int i = 0; i < 2; i++) /* again: what is left of a direction near the directrix has lost digits */
        major = v3_unit(v3_madd(major, directrix, -v3_dot(major, directrix)));
    c.major = major;
    c.minor = v3_cross(directrix, major);
    c.e = 1 / sqrt((1 - eccentricity) * (1 + eccentricity)); /* eq. 1 */
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
    double p = xx - yy, q = 2 * xy_sum, r = length2(p, q), a = 0, b = 0; /* the axes are turned by half the angle of (p, q) */
    double co = r > 0 ? sqrt(0.5 * (1 + fabs(p) / r)) : 1, si = r > 0 ? 0.5 * q / (r * co) : 0;
    if (p < 0) {
        double t = co;
        co = fabs(si);
        si = copysign(t, q);
    }
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
    /* One eccentricity must serve both the footprint and the directions: lay it by the one that is longer against
     * its own spread. Directions decide for a point source. */
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
        KellerVec3 q = cone_rotate(cone, v3_sub(sources[i], cone->origin));
        x0 = greater(x0, sqrt(q.x * q.x + q.y * q.y));
        size = greater(size, norm1(sources[i]));
    }
    /* Rounding of the constructed axes and of the sources: a little wider. */
    cone->tan_alpha = t * (1 + 1e-12) + 1e-12;
    cone->x0 = source_count > 1 ? x0 * (1 + 1e-12) + cone->e * size * KELLER_CONE_SLACK : 0;
    /* level with the lowest source only up to rounding: back by as much, so that all sources have z >= 0 */
    double back = source_count > 1 ? size * KELLER_CONE_SLACK : 0;
    cone->origin = v3_madd(middle, cone->directrix, z_low - back);
    if (z_start) *z_start = z_high - z_low + 2 * back;
    return true;
}

/* The corners of a cell of the sphere about the unit vector `pole`, and what covers its bulge: among the planes
 * through the apex only meridians are sides; a parallel is a cone, convex away from its own pole. Beyond the chord
 * of an arc of a parallel the tangent planes at its ends meet in a direction: of the plane polygon that is tangent
 * to the parallel at the ends of `arcs` equal arcs, these are the corners. All parallels curve outwards on the side
 * of the equator only, so only one border bulges out of the cell. At most 4 + arcs directions. */
static size_t cell_hull(KellerVec3 pole, KellerVec3 zero, KellerRange polar, KellerRange azimuth, int arcs,
                        KellerVec3 *hull)
{
    KellerVec3 side = v3_cross(pole, zero);
    double half = 0.5 * (azimuth.far - azimuth.near) / arcs;
    size_t count = 0;
    for (int i = 0; i < 2; i++) {
        double z = cos(i ? polar.far : polar.near), r = sin(i ? polar.far : polar.near);
        bool bulges = i ? z > 0 : z < 0;
        for (int k = bulges ? -1 : 0; k <= (bulges ? arcs : 1); k++) {
            double phi = k < 0 ? azimuth.near : azimuth.near + (2 * k + 1) * half, reach = r;
            if (!bulges) phi = k ? azimuth.far : azimuth.near;
            else if (k == arcs) phi = azimuth.far;
            else if (k >= 0) reach = r / cos(half);
            hull[count++] = v3_madd(v3_madd(v3_scale(pole, z), zero, reach * cos(phi)), side, reach * sin(phi));
        }
    }
    return count;
}

bool keller_cone_cell(KellerVec3 apex, KellerVec3 pole, KellerVec3 zero, KellerRange polar, KellerRange azimuth,
                      KellerCone *cone)
{
    enum { ARCS = 48 }; /* of a whole turn; the polygon around an arc is 1 / cos(pi / ARCS) = 0.2 % wider at most */
    assert(polar.near >= 0 && polar.near <= polar.far && polar.far <= M_PI && azimuth.near <= azimuth.far);
    double wide = azimuth.far - azimuth.near;
    assert(wide <= 2 * M_PI * (1 + 1e-12));
    if (wide >= M_PI && polar.near <= M_PI / 2 && polar.far >= M_PI / 2) return false; /* half the equator or more */
    KellerVec3 hull[4 + ARCS];
    int arcs = (int)greater(3, lesser(ceil(wide * (ARCS / (2 * M_PI))), ARCS));
    size_t count = cell_hull(pole, zero, polar, azimuth, arcs, hull);
    bool fits = keller_cone_around(v3(0, 0, 0), count, hull, cone); /* free of the apex's rounding */
    cone->origin = apex;
    return fits;
}

bool keller_cone_mirrored(KellerVec3 apex, KellerVec3 normal, double offset, size_t count, const KellerVec3 *footprint,
                          KellerCone *cone)
{
    KellerVec3 image = v3_mirror_point(apex, normal, offset);
    if (!keller_cone_around(image, count, footprint, cone)) return false;
    double z = INFINITY, size = norm1(apex) + norm1(image) + fabs(offset);
    for (size_t i = 0; i < count; i++) {
        z = lesser(z, v3_dot(v3_sub(footprint[i], image), cone->directrix));
        size = greater(size, norm1(footprint[i]));
    }
    /* The image is rounded, by less than `error`. Seen from the true image, a ray through the footprint at z turns
     * by up to error / z, in minor slopes counted e times; and the origin is rounded again where it is moved to. */
    double error = 8 * 0x1p-53 * size;
    cone->tan_alpha += 2 * error * (cone->e + cone->tan_alpha) / z;
    if (!(cone->tan_alpha < TAN_MAX)) return false;
    z = greater(0, z - error);
    cone->origin = v3_madd(image, cone->directrix, z);
    cone->x0 = cone->tan_alpha * z * (1 + 1e-12) + error * (cone->e + cone->tan_alpha);
    return true;
}

bool keller_cone_keller(KellerVec3 a, KellerVec3 b, KellerVec3 source, KellerVec3 zero, KellerRange azimuth,
                        KellerCone *cone, double *z_start)
{
    enum { ARCS = 4 }; /* as many as keller_cone_fan has room for */
    double wide = azimuth.far - azimuth.near;
    assert(wide >= 0 && wide < M_PI);
    KellerVec3 along = v3_unit(v3_sub(b, a)), end[2] = {b, a};
    if (!(v3_norm(along) > 0)) return false;
    /* The angle to the edge falls along it; it is that of the outgoing rays with the edge (Keller's law). */
    double angle[2], noise = KELLER_CONE_SLACK * (norm1(a) + norm1(b));
    for (int i = 0; i < 2; i++) {
        KellerVec3 in = v3_sub(end[i], source);
        double across = v3_norm(v3_cross(along, in));
        if (!(across > noise + KELLER_CONE_SLACK * norm1(source))) return false;
        angle[i] = atan2(across, v3_dot(along, in));
    }
    KellerVec3 hull[4 + ARCS];
    int arcs = (int)greater(1, lesser(ceil(wide * 8 / M_PI), ARCS));
    size_t count = cell_hull(along, zero, (KellerRange){angle[0], greater(angle[0], angle[1])}, azimuth, arcs, hull);
    return keller_cone_fan(2, end, count, hull, cone, z_start);
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

/* The half x >= 0 of the section is a half disk once y is stretched; the smallest ellipse around it,
 *     ((x - R/3) / (2R/3))^2 + (e y / (2R/sqrt 3))^2 <= 1,
 * is the one through the corners (R, 0), (0, R), (0, -R), and holds the half circle too. Over all z that is an oblique
 * cone. Its plane of symmetry y = 0 cuts it in the slopes T and -T/3, so its directrix has the mean of their angles,
 * psi, and its half-angle there, gamma, is half their difference. The other half-angle follows from the determinant of
 * the cone's matrix: tan = B sqrt(tan gamma / A) for the slopes A = 2T/3 and B = 2T / (sqrt(3) e) of the semi-axes. All
 * is kept over T, so that it stays finite as T goes to 0. The child's origin is the foot of the perpendicular from
 * the parent's on the child's axis, so that z' = x sin psi + z cos psi, which is not negative in the half. */
void keller_cone_split(const KellerCone *cone, KellerCone child[2])
{
    KellerCone c = *cone; /* one of the children may be the parent */
    double T = c.tan_alpha, H = sqrt((1 + T * T) * (1 + T * T / 9));
    /* tan gamma / T and tan psi / T, from the tangents of the angles' difference and sum */
    /* H - T^2/3 without its cancellation; unbounded at 90 degrees only */
    double rest = (1 + 10 * T * T / 9) / (H + T * T / 3), g = 4.0 / 3 / (1 + rest), k = 2.0 / 3 / (H + 1 + T * T / 3);
    double h = 2 / sqrt(3) * sqrt(1.5 * g) / c.e; /* tangent of the half-angle along y, over T */
    double co = 1 / sqrt(1 + k * T * k * T), si = k * T * co;
    bool turned = h > g;
    double ratio = turned ? h : g, e = turned ? h / g : g / h;
    /* rounding of the axes, in minor slopes: an angle, of which the tangent is 1 + T^2 as sensitive */
    double error = 64 * 0x1p-53 * e * (1 + T * T);
    /* rounding of a moved origin: it goes back by as much, so that z = 0 there is still before all of the half */
    double shift = c.x0 > 0 ? 8 * 0x1p-53 * (norm1(c.origin) + c.x0) : 0;
    for (int i = 0; i < 2; i++) {
        double sign = i ? -1 : 1;
        KellerVec3 in_plane = c.major, directrix = c.directrix, minor = c.minor;
        if (T > 0) { /* a cylinder's, or a ray's, stay as they are to the bit */
            directrix = v3_unit(v3_madd(v3_scale(c.directrix, co), c.major, sign * si));
            in_plane = v3_madd(v3_scale(c.major, co), c.directrix, -sign * si);
            in_plane = v3_unit(v3_madd(in_plane, directrix, -v3_dot(in_plane, directrix)));
            minor = v3_cross(directrix, in_plane);
        }
        KellerCone *q = &child[i];
        q->origin = v3_madd(v3_madd(c.origin, in_plane, sign * k * c.x0 * co), directrix, -shift);
        q->directrix = directrix;
        q->major = turned ? minor : in_plane;
        q->minor = turned ? v3_scale(in_plane, -1) : minor;
        q->e = e;
        q->tan_alpha = ratio * T * (1 + 1e-12) + (T > 0 ? error : 0);
        q->x0 = ratio * c.x0 * co * (1 + 1e-12) + e * shift;
        /* the directrix is rounded, and points lie up to R to the side */
        q->z_near = greater(0, c.z_near * (co * (1 - 1e-12) - 64 * 0x1p-53 * T) - 64 * 0x1p-53 * c.x0);
        q->z_far = (c.z_far * (co + T * si) + c.x0 * si) * (1 + 1e-12) + 2 * shift;
    }
}
