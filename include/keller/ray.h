/* keller/ray.h -- a watertight ray-triangle test in double precision.
 *
 * Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013: the vertices are sheared so that the
 * ray runs along an axis, and each edge is judged by a function of its two sheared vertices alone, which has exactly
 * the opposite sign for the neighbour on the other side. Zero counts as inside. So no ray slips through between
 * triangles that share vertices (the same coordinates): one of those around the shared edge or vertex is hit, or more.
 *
 *     KellerRay ray = keller_ray(v3(0, 0, 0), v3(0, 0, 1));
 *     double t, weight[3];
 *     if (keller_ray_triangle(&ray, a, b, c, (KellerRange){0, INFINITY}, &t, weight)) ...     // at (0, 0, t)
 *
 * Coordinates are below 1e100 in magnitude. All functions are pure; nothing is allocated. */
#ifndef KELLER_RAY_H
#define KELLER_RAY_H
#include <stdbool.h>
#include "keller/cone.h"

/* A ray made ready: filled by keller_ray, used for any number of triangles. */
typedef struct {
    double origin[3];
    double shear[3]; /* along axis[0] and axis[1] per unit of axis[2]; direction per unit of axis[2] */
    int axis[3];     /* the two lesser axes, then the one along which the direction is greatest */
} KellerRay;

/* The ray {origin + t direction}; direction is finite and not zero, of any length. */
KellerRay keller_ray(KellerVec3 origin, KellerVec3 direction);

/* Whether the ray meets the closed triangle abc, from either side, at a t within the closed range `clip` (t in units of
 * the direction's length; negative t are behind the origin). Then *t is where, and weight[0..2] (>= 0, sum 1 to
 * rounding) are the barycentric coordinates of the point: weight[0] a + weight[1] b + weight[2] c; each pointer may be
 * NULL.
 *
 * A triangle that is a segment or a point, or that lies in a plane with the ray, is not hit: its neighbours are. The
 * point of the weights is in the triangle, and off the ray by a few rounding units of its distance from the origin,
 * however thin the triangle; t is its place along the ray. So where the ray grazes the triangle at an angle, t is
 * uncertain by those units over the sine of the angle; it never leaves the range of the vertices' t. */
bool keller_ray_triangle(const KellerRay *ray, KellerVec3 a, KellerVec3 b, KellerVec3 c, KellerRange clip, double *t,
                         double weight[3]);
#endif
