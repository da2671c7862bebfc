/* The ray tube of a path with several diffractions: how it spreads, and the distance parameters of each edge's coefficient. */
#ifndef KELLER_PATH_CASCADE_H
#define KELLER_PATH_CASCADE_H
#include "path/edges.h"
#include "wave/chain.h"

/* How each diffraction, in order, stands in the tube: see ChainPlace. */
typedef struct {
    uint32_t count;
    double before, behind;      /* m: the lengths of the path before the first edge and behind the last one */
    ChainPlace place[KELLER_MAX_BENDS]; /* of several */
    double along[KELLER_MAX_BENDS]; /* 1/m: second derivative of the path's length by its place along the edge, over sin^2 beta0, the
                                       places on the other edges being the best ones */
} Cascade;

/* The factor (1/m) that the field of a wave of 1/r from the transmitter has at the end of the path, but for the coefficients
 * (and for the spreading that keller_diffract_field gives a single one). docs/theory.md, "Several diffractions". Exchanging the
 * ends reverses the places and leaves the factor as it is, to rounding. */
double path_cascade(const KellerScene *scene, const KellerPath *path, const PathEdges *edges, KellerVec3 tx, Cascade *cascade);
#endif
