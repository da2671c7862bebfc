/* The shortest way from a point to a point by way of points on straight lines, in this order. */
#ifndef KELLER_PATH_SHORTEST_H
#define KELLER_PATH_SHORTEST_H
#include <stdbool.h>
#include <stddef.h>
#include "keller/vec.h"

/* The line of an edge, mirrored along with the rest of the path where that has been unfolded. */
typedef struct {
    KellerVec3 origin, direction;   /* m; unit */
    double length;                  /* m: the edge is where t is in [0, length] */
} EdgeLine;

/* Finds t[0 .. n): the points origin + t direction on n >= 1 lines that make |source - q1| + |q1 - q2| + ... + |qn - target|
 * least, by closed form for one line and by Newton's method for more, to the last bits. The length is convex in t, so where
 * its gradient vanishes is the only place that counts, whatever the lines.
 *
 * False where the least is not a stationary point of a smooth function, and no diffracted ray: where a leg has no length
 * (the lines meet in a point, as edges at a vertex do, and the shortest way leads through it), where a leg runs along one
 * of the lines that it joins (an end on the edge's own line, an edge met from along it, edges that lie in one line). Lengths
 * below `rounding` (m) count as none. Where the least is beyond the ends of an edge, t says so. */
bool path_shortest(KellerVec3 source, KellerVec3 target, size_t n, const EdgeLine *line, double rounding, double *t);
#endif
