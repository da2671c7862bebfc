/* keller/cone.h -- the elliptic conic frustum and its intersection tests.
 *
 * Emre, Kanak, Steinberg, "High-Performance Elliptical Cone Tracing", 2025, section 3. A point with local coordinates
 * (x, y, z) -- along the major axis, the minor axis and the directrix, from the origin -- is inside if
 *     x^2 + e^2 y^2 <= R(z)^2,  R(z) = z tan_alpha + x0 >= 0,  z_near <= z <= z_far,   e = 1/sqrt(1 - eccentricity^2)
 * (eqs 1, 2). tan_alpha = 0 makes a cylinder, tan_alpha = x0 = 0 a ray. Distances are z: projected on the directrix.
 *
 * Every test is conservative, and proven so (docs/numerics.md): it may report an intersection that is not there, by a slack
 * of a few rounding units of the primitive's coordinates relative to the cone's origin, but never misses one; a range
 * contains the true range. The Boolean form of a test says yes exactly where its range is not empty, unless noted.
 *
 *     KellerCone cone = keller_cone_round(v3(0, 0, 0), v3(0, 0, 1), 0.1);     // half-angle 0.1 rad along +z
 *     KellerVec3 nearest;
 *     KellerRange r = keller_cone_triangle(&cone, a, b, c, (KellerRange){0, INFINITY}, &nearest, NULL);
 *     if (r.near <= r.far) ...                                                // met, nowhere nearer than r.near
 *
 * Coordinates are finite, below 1e100 in magnitude and, where not 0, above 1e-100; ranges are as tight as stated between
 * 1e-75 and 1e75. The eight-wide forms ask for size times max(e, tan_alpha) below 1e17. All functions are pure; nothing is
 * allocated. */
#ifndef KELLER_CONE_H
#define KELLER_CONE_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "keller/vec.h"

typedef struct {
    KellerVec3 origin;
    KellerVec3 directrix, major, minor;  /* orthonormal to a few rounding units; major x minor = directrix */
    double x0;                           /* major semi-axis at the origin, m, >= 0 */
    double tan_alpha;                    /* tangent of the half-angle along the major axis, >= 0 */
    double e;                            /* major/minor axis ratio, >= 1 */
    double z_near, z_far;                /* m, 0 <= z_near <= z_far, z_far may be INFINITY */
} KellerCone;

/* A closed interval of z; empty if near > far. */
typedef struct {
    double near, far;
} KellerRange;

/* Relative slack of every comparison, in double precision: the rounding errors of a coordinate in the cone's frame and of
 * the one linear form that decides sum up to a quarter of it (src/geom/cone_frame.h, docs/numerics.md). */
#define KELLER_CONE_SLACK (64 * 0x1p-53)
/* The same for the tests on eight single-precision boxes or vertices. */
#define KELLER_CONE_SLACK_FLOAT (64 * 0x1p-24f)

/* ---- construction (cone_build.c) ------------------------------------------------------------------------------- */

/* A round cone with its apex at `origin` along the unit vector `directrix`; half_angle in [0, pi/2). z from 0 to inf. */
KellerCone keller_cone_round(KellerVec3 origin, KellerVec3 directrix, double half_angle);

/* The frustum of the paper's parameters: half_angle in [0, pi/2) rad, eccentricity in [0, 1), x0 >= 0 m; `major` is any
 * direction not along the unit vector `directrix`, and is made perpendicular to it. z from 0 to inf. */
KellerCone keller_cone_elliptic(KellerVec3 origin, KellerVec3 directrix, KellerVec3 major, double half_angle,
                                double eccentricity, double x0);

/* The smallest elliptic cone with its apex at `apex` that contains all `count` >= 1 points, in any order, and, the cone
 * being convex, their convex hull (a polygon, say): smallest in the area of the section perpendicular to its own
 * directrix, to within 1 %. False if no cone of half-angle below 80 degrees was found, or a point is the apex. z from 0. */
bool keller_cone_around(KellerVec3 apex, size_t count, const KellerVec3 *points, KellerCone *cone);

/* The same around a cell of the sphere of directions: polar angle from `pole` (unit vector) in [polar.near, polar.far],
 * within [0, pi]; azimuth from `zero` (perpendicular to pole) towards pole x zero in [azimuth.near, azimuth.far], rad, at
 * most 2 pi wide. Cells that share a border leave no gap. False if the cell does not fit into a half-angle below 80
 * degrees: split it. */
bool keller_cone_cell(KellerVec3 apex, KellerVec3 pole, KellerVec3 zero, KellerRange polar, KellerRange azimuth,
                      KellerCone *cone);

/* The cone of what `apex` sends through a flat polygon (the footprint) of the mirror plane {p : normal.p = offset} and the
 * mirror sends back: its apex is the mirror image; its origin is moved up to the footprint, where it has x0 > 0, so that
 * z = 0 lies at the footprint's nearest point or before. False as keller_cone_around. */
bool keller_cone_mirrored(KellerVec3 apex, KellerVec3 normal, double offset, size_t count, const KellerVec3 *footprint,
                          KellerCone *cone);

/* A frustum that contains every ray that starts in the convex hull of the `source_count` >= 1 points (a point, a piece of
 * edge, the corners of a patch, or their mirror images) and runs in one of the directions that are non-negative
 * combinations of the `count` >= 1 given ones: the base ellipse is laid along the sources (this is what x0 and the
 * eccentricity are for). At most 8 of each. The directrix is the normalised sum of the directions. False if the directions
 * do not fit into a half-angle below 80 degrees. Rays have all started at z <= *z_start (may be NULL). */
bool keller_cone_fan(size_t source_count, const KellerVec3 *sources, size_t count, const KellerVec3 *directions,
                     KellerCone *cone, double *z_start);

/* The frustum of what the piece of edge from a to b diffracts when lit from the point `source`: all rays that leave a point
 * of the piece at the angle at which the source's ray meets the edge there (Keller's cones), at azimuths about the edge in
 * [azimuth.near, azimuth.far] from the unit vector `zero` (perpendicular to the edge) towards unit(b - a) x zero, less
 * than pi wide. The origin ellipse lies along the piece. False if the fan does not fit into a half-angle below 80 degrees:
 * split the piece or the azimuths; false also if the source lies on the edge's line or a = b. */
bool keller_cone_keller(KellerVec3 a, KellerVec3 b, KellerVec3 source, KellerVec3 zero, KellerRange azimuth,
                        KellerCone *cone, double *z_start);

/* The mirror image in the plane {p : normal.p = offset}; normal is a unit vector. */
KellerCone keller_cone_mirror(const KellerCone *cone, KellerVec3 normal, double offset);

/* Two children that together cover the parent: each the smallest elliptic frustum around one half of it, cut by the plane
 * of directrix and minor axis. Children may reach outside the parent. */
void keller_cone_split(const KellerCone *cone, KellerCone child[2]);

/* ---- tests: each returns the range of z over which the frustum, clipped to `clip` and to its own z range, meets the
 * primitive, empty if it does not; the nearest and farthest points where asked (NULL otherwise). A point lies on the
 * primitive and inside the clipped cone up to rounding, at the range's end as a rule; where a primitive only touches the
 * envelope it may be another point of it. Points are not written where the range is empty. ---------------------------- */

/* The plane {p : normal.p = offset}, normal a unit vector. A point at infinity has infinite coordinates. */
KellerRange keller_cone_plane(const KellerCone *cone, KellerVec3 normal, double offset, KellerRange clip,
                              KellerVec3 *nearest, KellerVec3 *farthest);
/* The line {p + t direction}, direction not zero; the segment from a to b (a = b is a point). */
KellerRange keller_cone_line(const KellerCone *cone, KellerVec3 p, KellerVec3 direction, KellerRange clip,
                             KellerVec3 *nearest, KellerVec3 *farthest);
KellerRange keller_cone_edge(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerRange clip, KellerVec3 *nearest,
                             KellerVec3 *farthest);
/* The triangle with its interior; degenerate triangles are segments or points. */
KellerRange keller_cone_triangle(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerVec3 c, KellerRange clip,
                                 KellerVec3 *nearest, KellerVec3 *farthest);
/* The solid box [lower, upper]; sides may be zero. */
KellerRange keller_cone_box(const KellerCone *cone, KellerVec3 lower, KellerVec3 upper, KellerRange clip,
                            KellerVec3 *nearest, KellerVec3 *farthest);

/* Boolean forms: true exactly where the range above is not empty. */
bool keller_cone_meets_plane(const KellerCone *cone, KellerVec3 normal, double offset, KellerRange clip);
/* As keller_cone_line. */
bool keller_cone_meets_line(const KellerCone *cone, KellerVec3 p, KellerVec3 direction, KellerRange clip);
/* As keller_cone_edge. */
bool keller_cone_meets_edge(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerRange clip);
/* As keller_cone_triangle. */
bool keller_cone_meets_triangle(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerVec3 c, KellerRange clip);
/* For traversal: never false where keller_cone_box is not empty, but true also for some boxes that pass near the cone. */
bool keller_cone_meets_box(const KellerCone *cone, KellerVec3 lower, KellerVec3 upper, KellerRange clip);

/* Containment in the frustum (not clipped further): never false for what is inside; true also for what is outside by no
 * more than the slack. A box or triangle is contained when its vertices are. */
bool keller_cone_contains(const KellerCone *cone, KellerVec3 p);
/* All three vertices. */
bool keller_cone_contains_triangle(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerVec3 c);
/* All eight vertices of [lower, upper]. */
bool keller_cone_contains_box(const KellerCone *cone, KellerVec3 lower, KellerVec3 upper);

/* ---- eight at a time, in single precision (cone_lanes.c, cone_leaf.c) -------------------------------------------------------- */

/* A frustum made ready for them, within `clip`. `size` bounds the magnitude of every coordinate (m) of the boxes and
 * vertices that will be tested; the slack is KELLER_CONE_SLACK_FLOAT of it and of the origin's. */
typedef struct {
    float origin[3];
    float axis[3][3];                 /* major, e minor, directrix */
    float tan_alpha, x0, near, far;   /* x0, near, far hold the slack */
    float slack, inset;               /* of z; what R must be less to hold only what is surely inside */
    float frame_error;                /* of x and of e y, and of a cross product per unit of its factors */
    float enter[4], enter_rate[4], leave[4], leave_rate[4]; /* slabs that widen with z, an axis a lane: cone_lanes.c */
} KellerConeLanes;
KellerConeLanes keller_cone_lanes(const KellerCone *cone, KellerRange clip, double size);

/* Eight boxes or vertices as arrays of lanes; 32-byte aligned. A lane with lower > upper in x is empty: never met. */
typedef struct {
    _Alignas(32) float lower[3][8];
    _Alignas(32) float upper[3][8];
} KellerBox8;
typedef struct {
    _Alignas(32) float p[3][8];
} KellerVertex8;

/* Bit i of the result: the frustum may meet box i (never 0 where it does). distance[i] (32-byte aligned) is a z that no
 * point of box i inside the frustum comes before, for every lane whose bit is set. */
uint32_t keller_cone_meets_box8(const KellerConeLanes *cone, const KellerBox8 *boxes, float *distance);
/* Bit i: vertex i is inside the frustum, or outside by no more than the slack. */
uint32_t keller_cone_contains_vertex8(const KellerConeLanes *cone, const KellerVertex8 *vertices);
/* All eight corners of the box [lower, upper] inside, or outside by no more than the slack. */
bool keller_cone_contains_corners(const KellerConeLanes *cone, const float lower[3], const float upper[3]);
/* Bit i: the frustum surely contains box i (0 also for some that it does contain). */
uint32_t keller_cone_contains_box8(const KellerConeLanes *cone, const KellerBox8 *boxes);
/* For eight triangles that the frustum contains, vertex j of triangle i being vertices[j].p[.][i]: the z of the nearest and
 * of the farthest vertex of each (32-byte aligned), widened by the slack. */
void keller_cone_contained_triangle8(const KellerConeLanes *cone, const KellerVertex8 vertices[3], float *near,
                                     float *far);
/* Bit i: the frustum may meet triangle i (never 0 where it does); *contained: it surely contains it. near[i] and far[i]
 * (32-byte aligned): z of the triangle's nearest and farthest vertex, widened by the slack. Leaves of a hierarchy. */
uint32_t keller_cone_meets_triangle8(const KellerConeLanes *cone, const KellerVertex8 vertices[3], float *near, float *far,
                                     uint32_t *contained);
/* The same, faster and made for thin cones: it leaves some triangles that pass by a corner. *pierced: the directrix surely
 * passes through triangle i within the frustum, at[i] or before (at is 32-byte aligned, and written only where the result is
 * not 0). */
uint32_t keller_cone_pierces_triangle8(const KellerConeLanes *cone, const KellerVertex8 vertices[3], float *near, float *far,
                                       uint32_t *pierced, float *at);
/* keller_cone_meets_triangle8 for eight edges. */
uint32_t keller_cone_meets_edge8(const KellerConeLanes *cone, const KellerVertex8 ends[2], float *near, float *far,
                                 uint32_t *contained);
#endif
