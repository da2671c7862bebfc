/* The k-d tree's nodes, as the builder leaves them and the walk reads them. */
#ifndef KELLER_ACCEL_KDTREE_H
#define KELLER_ACCEL_KDTREE_H
#include "accel/internal.h"

/* Eight bytes. Nodes are depth first: the lower child is the next. */
typedef struct {
    union {
        float plane;
        uint32_t blocks;     /* of a leaf, consecutive; may be 0 */
    };
    uint32_t link;           /* 4 * (nodes to the upper child; of a leaf, its first block) + axis, 3 for a leaf */
} KdNode;

enum { KD_LEAF = 3, KD_DEPTH = 50 }; /* most inner nodes on a way down: 8 + 1.3 log2 of 2^30 is 47 */

typedef struct {
    KdNode *nodes;
    uint32_t node_count, block_count;
    AccelBox box;            /* of all */
} KdTree;

KellerStatus kdtree_build(const TreeInput *input, void **tree, Leaves *leaves, KellerError *error);
#endif
