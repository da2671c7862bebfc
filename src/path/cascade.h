/* The ray tube of a path with several diffractions: how it spreads, and the distance parameters of each edge's coefficient. */
#ifndef KELLER_PATH_CASCADE_H
#define KELLER_PATH_CASCADE_H
#include "path/internal.h"

/* Distances (m) before and behind each diffraction, in order, to give to keller_diffract_field. */
typedef struct {
    uint32_t count;
    double before[KELLER_MAX_BENDS], behind[KELLER_MAX_BENDS];
} Cascade;

/* The factor (1/m) that the field of a wave of 1/r from the transmitter has at the end of the path, but for what
 * keller_diffract_field puts to it with these distances. docs/theory.md, "Several diffractions". Exchanging the ends exchanges
 * the distances and leaves the field's magnitude as it is, to rounding. */
double path_cascade(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, Cascade *cascade);
#endif
