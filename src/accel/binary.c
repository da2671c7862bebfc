/* The binary tree that both hierarchies are made from, and its leaves as blocks. */
#include "accel/internal.h"

#include <stdlib.h>
#include <string.h>

KellerStatus binary_tree(const TreeInput *input, SahTree *tree, KellerError *error)
{
    SahOptions options = sah_defaults();
    options.cost_ratio = input->cost_ratio;
    options.spatial = input->spatial > 0;
    options.budget = input->spatial;
    options.threads = input->threads;
    return sah_build(input->count, input->boxes, input->clip, input->clip_context, &options, tree, error);
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
