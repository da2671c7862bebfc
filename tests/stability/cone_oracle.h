/* cone_oracle.h -- the slow, obvious answer to every test of keller/cone.h, for the tests and the measurements.
 *
 * A frustum is convex and so is every primitive, hence the z of their common points fill one interval. Its ends are
 * among a few points that can be listed: vertices inside, the points where an edge enters and leaves the cone (eq. 6),
 * the highest and lowest point of the section of a face's plane (eqs 4, 5) or its point on the axis where they lie on
 * the face, and the apex where it lies in the box. The clip planes then cut the interval.
 *
 * The doubles of a cone are taken as exact: a point's coordinates in the cone's frame are the exact products with the
 * stored axes, whether or not those are exactly orthonormal. The same text (cone_oracle_body.h) is compiled twice: for
 * long double (64 bits), fast, and for __float128 (113 bits), which decides. */
#ifndef TEST_CONE_ORACLE_H
#define TEST_CONE_ORACLE_H
#include "keller/cone.h"
#include <stdbool.h>

typedef struct {
    bool met;
    long double near, far; /* where met; may be infinite for planes and lines */
} ConeTruth;

/* `grow` widens the cone by that share of the size of the primitive's coordinates in the cone's stretched frame: 0
 * asks for the truth; a few units more than the number's own rounding makes the answer one that misses nothing. */
typedef struct {
    ConeTruth (*plane)(const KellerCone *cone, KellerVec3 normal, double offset, KellerRange clip, double grow);
    ConeTruth (*line)(const KellerCone *cone, KellerVec3 p, KellerVec3 direction, KellerRange clip, double grow);
    ConeTruth (*edge)(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerRange clip, double grow);
    ConeTruth (*triangle)(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerVec3 c, KellerRange clip,
                          double grow);
    ConeTruth (*box)(const KellerCone *cone, KellerVec3 lower, KellerVec3 upper, KellerRange clip, double grow);
    bool (*contains)(const KellerCone *cone, KellerVec3 p, double grow);
    /* z of a point, and how far it lies outside the infinite cone (negative: inside), both in m: the distance along the
     * line to the axis. */
    long double (*z)(const KellerCone *cone, KellerVec3 p);
    long double (*outside)(const KellerCone *cone, KellerVec3 p);
} ConeOracle;

extern const ConeOracle cone_oracle_long, cone_oracle_quad;

/* grow for the long double oracle where it must miss nothing: 64 of its units. */
#define CONE_ORACLE_GROW 0x1p-58
#endif
