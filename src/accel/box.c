/* One box against a frustum, and the leaves of a binary tree as blocks. */
#include "accel/box.h"

#include <stdlib.h>
#include <string.h>

bool accel_meets(const KellerConeLanes *lanes, const float lower[3], const float upper[3], float *distance)
{
    return box_meets(lanes, box_wide(lanes), lower, upper, distance);
}

bool accel_contains(const KellerConeLanes *lanes, const float lower[3], const float upper[3])
{
    return box_contained(lanes, lower, upper);
}

void leaves_free(Leaves *leaves)
{
    free(leaves->begin);
    free(leaves->refs);
    memset(leaves, 0, sizeof *leaves);
}

/* Nodes are depth first and refs in the order of the leaves: the leaves' beginnings are the blocks'. */
KellerStatus leaves_of(const SahTree *tree, Leaves *leaves, KellerError *error)
{
    *leaves = (Leaves){0};
    size_t most = (size_t)tree->node_count / 2 + 2, refs = (size_t)tree->ref_count + 1;
    leaves->begin = malloc(most * sizeof *leaves->begin);
    leaves->refs = malloc(refs * sizeof *leaves->refs);
    if (!leaves->begin || !leaves->refs) {
        leaves_free(leaves);
        return keller_error_memory(error, most * sizeof *leaves->begin + refs * sizeof *leaves->refs);
    }
    for (uint32_t i = 0; i < tree->node_count; i++)
        if (tree->nodes[i].count) leaves->begin[leaves->block_count++] = tree->nodes[i].first;
    leaves->begin[leaves->block_count] = tree->ref_count;
    if (tree->ref_count) memcpy(leaves->refs, tree->refs, tree->ref_count * sizeof *tree->refs);
    return KELLER_OK;
}
