/* Divide and conquer without a stored structure (Mora 2011): a batch of rays or cones and all primitives are parted together, in
 * place, until one or the other are few; then all are tested against all (algorithm 1).
 *
 * What is parted are the primitives, by the middle of their boxes: each is on one side, and a side's space is the box of what is there.
 * The paper cuts space, which has primitives on both sides and wants them clipped. Rays and cones go to both sides that they meet,
 * one side after the other; nearer hits of the first leave out what lies behind them in the second ("secondary rays", section
 * 3.4). Memory is what dac_*_bytes say, and a stack of DAC_DEPTH steps. */
#ifndef KELLER_ACCEL_DAC_H
#define KELLER_ACCEL_DAC_H
#include "accel/leaf.h"
#include "accel/sah_split.h"

enum {
    DAC_FEW = 16,                   /* primitives that are not parted any more */
    DAC_ASKERS = 2,                 /* rays or cones for which primitives are not parted any more */
    DAC_CARE = 2,                   /* so many times more askers than primitives: by the surface-area heuristic, not the mean */
    DAC_HALVE = 64,                 /* below, sides are even by count */
    DAC_DEPTH = DAC_HALVE + 32
};

typedef struct {
    SahRef *refs;
    uint32_t count;
    f8 box;                         /* negative lower sides, upper sides: of all */
    f4 middle;                      /* the mean of the middles of their boxes, twice */
    int depth;
} DacSet;

/* The triangles, or the edges, of an accelerator of kind tree_dacrt; refs has room for all. */
DacSet dac_triangles(const KellerAccel *accel, SahRef *refs);
DacSet dac_edges(const KellerAccel *accel, SahRef *refs);
/* Parts a set of two or more in two, in place. Returns the axis; low: what has its middles before on it. Of what many ask, the more
 * carefully: `askers` of them. */
int dac_part(const DacSet *set, size_t askers, DacSet *low, DacSet *high);
AccelBox dac_box(const DacSet *set);
/* Up to eight triangles, or edges, of the set from number `first` on, in a block; the rest of it repeats the last. */
void dac_triangle_block(const KellerAccel *accel, const DacSet *set, uint32_t first, TriangleBlock *block);
void dac_edge_block(const KellerAccel *accel, const DacSet *set, uint32_t first, EdgeBlock *block);

/* ---- batches ------------------------------------------------------------------------------------------------------ */

size_t dac_rays_bytes(const KellerAccel *accel, size_t count);
size_t dac_cones_bytes(const KellerAccel *accel, size_t count);
/* keller_accel_rays_nearest by one thread in that much memory, 64-byte aligned. */
void dac_rays_nearest(const KellerAccel *accel, void *memory, size_t count, const KellerVec3 *origins, const KellerVec3 *directions,
                      KellerRange clip, KellerRayHit *hits, KellerAccelWork *work);
void dac_cones_nearest(const KellerAccel *accel, void *memory, size_t count, const KellerCone *cones, KellerRange clip,
                       KellerConeHit *hits, KellerAccelWork *work);
/* keller_accel_cones. */
void dac_cones_all(const KellerAccel *accel, void *memory, size_t count, const KellerCone *cones, KellerRange clip,
                   KellerVisitCones visit, KellerVisitCones visit_edge, void *context, KellerAccelWork *work);
#endif
