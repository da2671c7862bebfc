/* keller/cone.h -- the elliptic conic frustum and its intersection tests.
 *
 * Emre, Kanak, Steinberg, "High-Performance Elliptical Cone Tracing", 2025, section 3. A point with local coordinates
 * (x, y, z) -- along the major axis, the minor axis and the directrix, from the origin -- is inside if
 *     x^2 + e^2 y^2 <= (z tan_alpha + x0)^2   and   z_near <= z <= z_far,   e = 1/sqrt(1 - eccentricity^2) (eqs 1, 2).
 * tan_alpha = 0 makes a cylinder, tan_alpha = x0 = 0 a ray. Distances are z: projected on the directrix.
 *
 * The tests are conservative: they may report an intersection that is not there, by a relative slack of KELLER_CONE_SLACK
 * of the coordinates' size, but never miss one; a range contains the true range. */
#ifndef KELLER_CONE_H
#define KELLER_CONE_H
#include <stdbool.h>
#include <stddef.h>
#include "keller/vec.h"

typedef struct {
    KellerVec3 origin;
    KellerVec3 directrix, major, minor;  /* orthonormal; major x minor = directrix */
    double x0;                           /* major semi-axis at the origin, m, >= 0 */
    double tan_alpha;                    /* tangent of the half-angle along the major axis, >= 0 */
    double e;                            /* major/minor axis ratio, >= 1 */
    double z_near, z_far;                /* m, 0 <= z_near <= z_far, z_far may be INFINITY */
} KellerCone;

/* A closed interval of z; empty if near > far. */
typedef struct {
    double near, far;
} KellerRange;

/* Relative slack of every comparison: 64 double-precision rounding units cover the at most 40 rounded operations between
 * a coordinate and a decision, each of relative error 2^-53 (docs/architecture.md). */
#define KELLER_CONE_SLACK (64 * 0x1p-53)

/* ---- construction --------------------------------------------------------------------------------------------- */

/* A round cone with its apex at `origin` along the unit vector `directrix`; half_angle in [0, pi/2). z from 0 to inf. */
KellerCone keller_cone_round(KellerVec3 origin, KellerVec3 directrix, double half_angle);

/* A narrow elliptic cone with its apex at `apex` that contains all `count` >= 1 points and, the cone being convex,
 * their convex hull; false if no cone of half-angle below 80 degrees around the mean direction does. */
bool keller_cone_around(KellerVec3 apex, size_t count, const KellerVec3 *points, KellerCone *cone);

/* A frustum that contains every ray that starts in the convex hull of the `source_count` >= 1 points (a point, a piece of
 * edge, the corners of a patch, or their mirror images) and runs in one of the directions that are non-negative
 * combinations of the `count` >= 1 given ones: the base ellipse is laid along the sources (this is what x0 and the
 * eccentricity are for). The directrix is the normalised sum of the directions. False if the directions do not fit into
 * a half-angle below 80 degrees. Rays have all started at z <= *z_start (may be NULL). */
bool keller_cone_fan(size_t source_count, const KellerVec3 *sources, size_t count, const KellerVec3 *directions,
                     KellerCone *cone, double *z_start);

/* The mirror image in the plane {p : normal.p = offset}. */
KellerCone keller_cone_mirror(const KellerCone *cone, KellerVec3 normal, double offset);

/* ---- tests: each returns the range of z over which the frustum (clipped to `clip` and its own z range) meets the
 * primitive, empty if it does not; nearest and farthest points where asked (NULL otherwise) ---------------------- */

bool keller_cone_contains(const KellerCone *cone, KellerVec3 p);
KellerRange keller_cone_plane(const KellerCone *cone, KellerVec3 normal, double offset, KellerRange clip,
                              KellerVec3 *nearest, KellerVec3 *farthest);
KellerRange keller_cone_edge(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerRange clip, KellerVec3 *nearest,
                             KellerVec3 *farthest);
KellerRange keller_cone_triangle(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerVec3 c, KellerRange clip,
                                 KellerVec3 *nearest, KellerVec3 *farthest);
/* Boolean, conservative; the box is [lower, upper]. */
bool keller_cone_box(const KellerCone *cone, KellerVec3 lower, KellerVec3 upper, KellerRange clip);
#endif
