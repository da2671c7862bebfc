/* listings.h -- listings 1 to 5 of the cone paper (Emre, Kanak and Steinberg 2025, sections 3.1 and 4.3) as they are
 * printed, written from the text alone, in single and in double precision: the peer of keller/cone.h in
 * docs/numerics.md. Where the print leaves something open, the reading that answers best was taken:
 *   the slip in listing 4, line 10, p_near for p_far, is mended;
 *   points at infinity, not on the edge or not numbers are left out of a range instead of making it infinite;
 *   sums of the quadratic's coefficients and its discriminant are compensated (twice the working precision);
 *   an edge's range includes its ends where they are inside, which listings 3 and 4 see to outside of listing 2;
 *   a range whose ends have crossed is empty.
 * A vertex is local as of equation 2; no comparison has a tolerance, as none is printed. */
#ifndef BENCH_LISTINGS_H
#define BENCH_LISTINGS_H
#include "keller/cone.h"

typedef struct {
    const char *name;
    KellerRange (*plane)(const KellerCone *cone, KellerVec3 normal, double offset, KellerRange clip);
    KellerRange (*edge)(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerRange clip);
    KellerRange (*box)(const KellerCone *cone, KellerVec3 lower, KellerVec3 upper, KellerRange clip);
    KellerRange (*triangle)(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerVec3 c, KellerRange clip);
    uint32_t (*box8)(const KellerCone *cone, const KellerBox8 *boxes, double max_dist, double distance[8]);
} Listings;

extern const Listings listings_float, listings_double;
#endif
