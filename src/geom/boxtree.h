/* geom/boxtree.h -- a static tree of axis-aligned boxes in double precision, for the construction of the scene: what is
 * near a segment. (The accelerators of the search are another matter: see accel/.) */
#ifndef KELLER_GEOM_BOXTREE_H
#define KELLER_GEOM_BOXTREE_H
#include <stddef.h>
#include <stdint.h>
#include "keller/vec.h"

typedef struct KellerBoxTree KellerBoxTree;

/* Builds the tree over `count` boxes [lower[i], upper[i]]; count <= 2^32 - 2, finite corners. The arrays are copied.
 * NULL if memory runs out. */
KellerBoxTree *keller_boxtree_build(size_t count, const KellerVec3 *lower, const KellerVec3 *upper);
void keller_boxtree_free(KellerBoxTree *tree);

/* Called once for every box found, in an order that depends only on the boxes and their order. */
typedef void (*KellerBoxVisit)(void *context, uint32_t item);

/* All boxes that, grown by `margin` on every side, meet the segment a-b: a superset of what is within margin of it. */
void keller_boxtree_segment(const KellerBoxTree *tree, KellerVec3 a, KellerVec3 b, double margin, KellerBoxVisit visit,
                            void *context);
#endif
