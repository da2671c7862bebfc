/* The 8-wide hierarchy (paper, section 4.3): the binary tree collapsed so that one vector test serves a node. A node is four
 * cache lines, children are numbers, so the block of nodes can be moved or stored as it is. */
#include <stdlib.h>
#include <string.h>

#include "accel/box.h"
#include "accel/bvh8.h"
#include "accel/wide.h"
#include "base/number.h"
#include "base/simd.h"

#define LEAF TREE_LEAF
typedef Bvh8Node Node;
typedef Bvh8 Tree;

static void tree_free(void *tree)
{
    Tree *t = tree;
    if (!t) return;
    masks_free(t->masks);
    free(t->nodes);
    free(t);
}

static size_t tree_bytes(const void *tree)
{
    const Tree *t = tree;
    return t ? t->node_count * sizeof(Node) + masks_bytes(t->masks) : 0;
}

/* ---- building ---------------------------------------------------------------------------------------------------- */

static uint32_t collapse(const SahTree *binary, const WidePlan *plans, uint32_t root, Tree *t, uint32_t *block)
{
    uint32_t id = t->node_count++, child[8], n = wide_children(binary, plans, 8, root, child);
    Node node;
    for (uint32_t i = 0; i < 8; i++) {
        const SahNode *c = i < n ? &binary->nodes[child[i]] : NULL;
        for (int k = 0; k < 3; k++) { /* unused lanes: begin beyond all, end before */
            node.boxes.lower[k][i] = c ? c->box.lower[k] : INFINITY;
            node.boxes.upper[k][i] = c ? c->box.upper[k] : -INFINITY;
        }
        node.child[i] = !c ? LEAF : c->count ? LEAF | (*block)++ : collapse(binary, plans, child[i], t, block);
        node.end[i] = *block;
    }
    t->nodes[id] = node;
    return id;
}

static KellerStatus build(const TreeInput *in, void **tree, Leaves *leaves, KellerError *error)
{
    SahTree binary;
    KellerStatus status = binary_tree(in, &binary, error);
    if (status != KELLER_OK) return status;
    Tree *t = *tree = calloc(1, sizeof *t);
    /* a node has at least two children unless it is the root */
    size_t most = binary.node_count / 2 + 1;
    if (t) t->nodes = aligned_alloc(64, most * sizeof(Node));
    WidePlan *plans = malloc((binary.node_count + 1) * sizeof *plans);
    if (!t || !t->nodes || !plans) status = keller_error_memory(error, most * sizeof(Node) + binary.node_count * sizeof *plans);
    if (status == KELLER_OK) status = leaves_of(&binary, leaves, error);
    if (status == KELLER_OK && binary.node_count > 0) {
        uint32_t block = 0;
        wide_plan(&binary, 8, NULL, plans);
        collapse(&binary, plans, 0, t, &block);
        t->leaf_count = block;
        Node *fit = aligned_alloc(64, t->node_count * sizeof(Node));
        if (fit) {
            memcpy(fit, t->nodes, t->node_count * sizeof(Node));
            free(t->nodes);
            t->nodes = fit;
        }
    }
    free(plans);
    sah_free(&binary);
    if (status == KELLER_OK) return status;
    tree_free(t);
    *tree = NULL;
    return status;
}

static bool child_of(const void *tree, uint32_t number, int i, TreeChild *child, AccelBox *box)
{
    const Node *node = &((const Tree *)tree)->nodes[number];
    *child = (TreeChild){0, node->child[i]};
    for (int k = 0; k < 3; k++) {
        box->lower[k] = node->boxes.lower[k][i];
        box->upper[k] = node->boxes.upper[k][i];
    }
    return box->lower[0] <= box->upper[0];
}

static KellerStatus build_masked(const TreeInput *in, void **tree, Leaves *leaves, KellerError *error)
{
    KellerStatus status = build(in, tree, leaves, error);
    if (status != KELLER_OK) return status;
    Tree *t = *tree;
    const MaskTree of = {t, t->node_count, 8, child_of};
    status = masks_make(&of, leaves, in, &t->masks, error);
    if (status == KELLER_OK) return status;
    tree_free(t);
    *tree = NULL;
    return status;
}

/* ---- walking ----------------------------------------------------------------------------------------------------- */

typedef struct {
    uint32_t child;
    uint32_t first, end;            /* its leaves */
    float z, key;                   /* nothing of it is before z; orders it among its siblings */
    bool inside;
} Waiting;

/* Contained leaves not worth telling the nearer from the farther. */
enum { FEW = 8 };

static void lane_of(const KellerBox8 *boxes, uint32_t i, float lower[3], float upper[3])
{
    for (int k = 0; k < 3; k++) {
        lower[k] = boxes->lower[k][i];
        upper[k] = boxes->upper[k][i];
    }
}

static inline __attribute__((always_inline)) void walk_as(const Tree *t, const KellerConeLanes *lanes, const WalkHow *how,
                                                          LeafVisit visit, void *context, uint64_t *nodes, bool masked)
{
    if (!t || t->node_count == 0) return;
    Waiting stack[BVH8_STACK], next = {0, 0, t->leaf_count, -INFINITY, 0, false};
    int top = 0;
    float far = lanes->far; /* lanes stay as they are: a copy would wait for their stores */
    uint64_t tested = 0;
    MaskWalk masks;
    if (masked) masks = mask_walk(lanes);
    for (;;) {
        if (next.child & LEAF || (next.inside && next.end - next.first <= FEW)) {
            for (uint32_t i = next.first; i < next.end && next.z <= far; i++) far = visit(context, i, next.inside, far);
            if (far == -INFINITY) break;
        } else {
            const Node *node = &t->nodes[next.child];
            _Alignas(32) float z[8];
            tested++;
            uint32_t hit = keller_cone_meets_box8(lanes, &node->boxes, z), in = 0;
            if (masked && !next.inside && hit) hit = bvh8_cull(t, &masks, next.child, hit, far);
            if (next.inside) in = hit;
            else if (how->contained && hit) in = keller_cone_contains_box8(lanes, &node->boxes) & hit;
            /* nearest on top: insertion sort, farthest first */
            int first = top;
            for (; hit; hit &= hit - 1) {
                uint32_t i = (uint32_t)__builtin_ctz(hit);
                if (z[i] > far) continue;
                Waiting child = {node->child[i], i ? node->end[i - 1] : next.first, node->end[i], z[i], z[i], in >> i & 1};
                float lower[3], upper[3];
                lane_of(&node->boxes, i, lower, upper);
                if (how->leaf_boxes && child.child & LEAF && !child.inside && !box_meets_exactly(how, lower, upper)) continue;
                child.key = box_key(lanes, how, lower, upper, z[i]);
                int j = top++;
                for (; j > first && stack[j - 1].key < child.key; j--) stack[j] = stack[j - 1];
                stack[j] = child;
            }
        }
        do {
            if (top == 0) goto done;
            next = stack[--top];
        } while (next.z > far);
    }
done:
    *nodes += tested;
}

static void walk(const void *tree, const KellerConeLanes *lanes, const WalkHow *how, LeafVisit visit, void *context,
                 uint64_t *nodes)
{
    walk_as(tree, lanes, how, visit, context, nodes, false);
}

static void walk_masked(const void *tree, const KellerConeLanes *lanes, const WalkHow *how, LeafVisit visit, void *context,
                        uint64_t *nodes)
{
    walk_as(tree, lanes, how, visit, context, nodes, true);
}

static uint32_t root(const void *tree) { return !tree || ((const Tree *)tree)->node_count == 0 ? KELLER_NONE : 0; }

static inline __attribute__((always_inline)) uint32_t open_as(const Tree *t, uint32_t number, const KellerConeLanes *lanes,
                                                              TreeChild child[8], bool masked)
{
    const Node *node = &t->nodes[number];
    _Alignas(32) float z[8];
    uint32_t n = 0, hit = keller_cone_meets_box8(lanes, &node->boxes, z);
    if (masked && hit) {
        const MaskWalk masks = mask_walk(lanes);
        hit = bvh8_cull(t, &masks, number, hit, lanes->far);
    }
    for (; hit; hit &= hit - 1) {
        int i = __builtin_ctz(hit);
        child[n++] = (TreeChild){z[i], node->child[i]};
    }
    return n;
}

static uint32_t open_node(const void *tree, uint32_t number, const KellerConeLanes *lanes, TreeChild child[8])
{
    return open_as(tree, number, lanes, child, false);
}

static uint32_t open_thin(const void *tree, uint32_t number, const KellerConeLanes *lanes, TreeChild child[8])
{
    return bvh8_open_thin(tree, number, lanes, child, false);
}

static uint32_t open_masked(const void *tree, uint32_t number, const KellerConeLanes *lanes, TreeChild child[8])
{
    return open_as(tree, number, lanes, child, true);
}

static uint32_t open_thin_masked(const void *tree, uint32_t number, const KellerConeLanes *lanes, TreeChild child[8])
{
    return bvh8_open_thin(tree, number, lanes, child, true);
}

const TreeKind tree_bvh8 = {"bvh8", 1, build, tree_free, tree_bytes, walk, root, open_node, open_thin};
const TreeKind tree_bvh8_mask = {"bvh8+mask", 1, build_masked, tree_free, tree_bytes, walk_masked, root, open_masked, open_thin_masked};
