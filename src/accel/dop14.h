/* The 8-wide hierarchy of 14-DOPs, boxes with their corners cut off (Kacerik and Bittner, "SAH-Optimized k-DOP Hierarchies for Ray
 * Tracing", PACMCGIT 7(3), 2024), built for comparison with the skewed ones: more slabs a node, but the same for all. */
#ifndef KELLER_ACCEL_DOP14_H
#define KELLER_ACCEL_DOP14_H
#include "accel/internal.h"

typedef struct Dop14 Dop14;

/* Over the leaves of a binary tree, block for block. Free with dop14_free. Errors: KELLER_FAILED (memory). */
KellerStatus dop14_make(const TreeInput *input, const SahTree *binary, Dop14 **tree, KellerError *error);
void dop14_free(Dop14 *tree);
size_t dop14_bytes(const Dop14 *tree);
bool dop14_empty(const Dop14 *tree);
/* As TreeKind's. Of a ray, too, origin, directrix and slack are read. */
void dop14_walk(const Dop14 *tree, const KellerConeLanes *lanes, LeafVisit visit, void *context, uint64_t *nodes);
uint32_t dop14_open(const Dop14 *tree, uint32_t node, const KellerConeLanes *lanes, TreeChild child[8]);
#endif
