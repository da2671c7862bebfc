/* The binary hierarchy. A node of 64 bytes holds its two children's boxes; the blocks below a node are consecutive, so that
 * a subtree that the frustum contains (Emre et al. 2025, section 4.2) is a range of blocks. */
#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "accel/box.h"

enum {
    LEAF = 1u << 31,         /* in `child`; the rest is a block, else a node */
    STACK = 128,             /* the builder promises a depth of SAH_DEPTH + 32, and one node a level waits */
    FEW = 4                  /* contained blocks not worth telling the nearer from the farther */
};

typedef struct {
    AccelBox box[2];
    uint32_t child[2];
    uint32_t middle;         /* first block below the right child */
    uint32_t unused;
} Node;

typedef struct {
    Node *nodes;
    AccelBox box;            /* of all */
    uint32_t node_count, block_count;
} Bvh;

/* A subtree to be visited: its blocks are first .. end. */
typedef struct {
    uint32_t child, first, end;
    float distance;
    bool inside;
} Entry;

/* Fills in the subtree below the tree's node `from`, its first block being `block`; returns what to call it by. */
static uint32_t convert(Bvh *bvh, const SahTree *tree, uint32_t from, uint32_t *block)
{
    const SahNode *node = &tree->nodes[from];
    if (node->count) return (uint32_t)LEAF | (*block)++;
    uint32_t number = bvh->node_count++;
    Node *to = &bvh->nodes[number];
    to->box[0] = tree->nodes[node->left].box;
    to->box[1] = tree->nodes[node->right].box;
    to->child[0] = convert(bvh, tree, node->left, block);
    to->middle = *block;
    to->child[1] = convert(bvh, tree, node->right, block);
    to->unused = 0;
    return number;
}

static void bvh_free(void *tree)
{
    Bvh *bvh = tree;
    if (!bvh) return;
    free(bvh->nodes);
    free(bvh);
}

static KellerStatus bvh_build(const TreeInput *input, void **tree, Leaves *leaves, KellerError *error)
{
    SahOptions options = sah_defaults();
    options.cost_ratio = input->cost_ratio;
    options.spatial = input->spatial > 0;
    options.budget = input->spatial;
    options.threads = input->threads;
    SahTree sah;
    *tree = NULL;
    *leaves = (Leaves){0};
    KellerStatus status = sah_build(input->count, input->boxes, input->clip, input->clip_context, &options, &sah, error);
    if (status != KELLER_OK) return status;
    status = leaves_of(&sah, leaves, error);
    Bvh *bvh = calloc(1, sizeof *bvh);
    size_t bytes = ((size_t)sah.node_count / 2 + 1) * sizeof *bvh->nodes;
    if (bvh) bvh->nodes = aligned_alloc(64, bytes);
    if (status == KELLER_OK && (!bvh || !bvh->nodes)) status = keller_error_memory(error, bytes);
    if (status == KELLER_OK) {
        if (sah.node_count) {
            bvh->box = sah.nodes[0].box;
            convert(bvh, &sah, 0, &bvh->block_count);
        }
        *tree = bvh;
    } else {
        leaves_free(leaves);
        bvh_free(bvh);
    }
    sah_free(&sah);
    return status;
}

static size_t bvh_bytes(const void *tree)
{
    const Bvh *bvh = tree;
    return !bvh ? 0 : sizeof *bvh + ((size_t)bvh->node_count + 1) * sizeof *bvh->nodes;
}

static void bvh_walk(const void *tree, const KellerConeLanes *lanes, bool contained, LeafVisit visit, void *context,
                     uint64_t *nodes)
{
    const Bvh *bvh = tree;
    const bool wide = box_wide(lanes);
    float far = lanes->far;
    Entry stack[STACK];
    int top = 0;
    if (!bvh || bvh->block_count == 0) return;
    Entry at = {bvh->node_count ? 0 : (uint32_t)LEAF, 0, bvh->block_count, 0, false};
    ++*nodes;
    if (!box_meets(lanes, wide, bvh->box.lower, bvh->box.upper, &at.distance)) return;
    at.inside = contained && box_contained(lanes, bvh->box.lower, bvh->box.upper);
    for (;;) {
        if (at.distance <= far && (at.child & LEAF || (at.inside && at.end - at.first <= FEW))) {
            for (uint32_t b = at.first; b < at.end && at.distance <= far; b++) far = visit(context, b, at.inside, far);
        } else if (at.distance <= far) {
            const Node *node = &bvh->nodes[at.child];
            Entry child[2];
            bool met[2];
            ++*nodes;
            for (int i = 0; i < 2; i++) {
                const AccelBox *box = &node->box[i];
                child[i] = (Entry){node->child[i], i ? node->middle : at.first, i ? at.end : node->middle, 0, at.inside};
                if (at.inside) { /* only to see the nearer ones first */
                    child[i].distance = box_begins(lanes, box->lower, box->upper);
                    met[i] = true;
                } else {
                    met[i] = box_meets(lanes, wide, box->lower, box->upper, &child[i].distance);
                    child[i].inside = met[i] && contained && box_contained(lanes, box->lower, box->upper);
                }
                met[i] = met[i] && child[i].distance <= far;
            }
            if (met[0] && met[1]) {
                bool swap = child[1].distance < child[0].distance;
                assert(top < STACK);
                stack[top++] = child[!swap];
                at = child[swap];
                continue;
            }
            if (met[0] || met[1]) {
                at = child[met[1]];
                continue;
            }
        }
        if (top == 0) return;
        at = stack[--top];
    }
}

const TreeKind tree_bvh = {"bvh", 2, bvh_build, bvh_free, bvh_bytes, bvh_walk};
