/* The binary hierarchy. A node of 64 bytes holds its two children's boxes, so that a frustum's slabs are tested for both at
 * once. The blocks below a node are consecutive: a subtree that the frustum contains (Emre et al. 2025, section 4.2) is a
 * range of blocks. */
#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "accel/box.h"
#include "accel/masked.h"

enum {
    LEAF = 1u << 31,         /* in `child`; the rest is a block, else a node */
    STACK = 128,             /* the builder promises a depth of SAH_DEPTH + 32, and one node a level waits */
    FEW = 4                  /* contained blocks not worth telling the nearer from the farther */
};

typedef struct {
    float side[3][4];        /* along each axis: the children's lower sides, then their upper ones */
    uint32_t child[2];
    uint32_t middle;         /* first block below the right child */
    uint32_t unused;
} Node;

typedef struct {
    Node *nodes;
    AccelBox box;            /* of all */
    uint32_t node_count, block_count;
    MaskSet *masks;          /* NULL: none */
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
    for (int i = 0; i < 2; i++) {
        const AccelBox *box = &tree->nodes[i ? node->right : node->left].box;
        for (int k = 0; k < 3; k++) {
            to->side[k][i] = box->lower[k];
            to->side[k][2 + i] = box->upper[k];
        }
    }
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
    masks_free(bvh->masks);
    free(bvh->nodes);
    free(bvh);
}

static KellerStatus bvh_build(const TreeInput *input, void **tree, Leaves *leaves, KellerError *error)
{
    SahTree sah;
    *tree = NULL;
    *leaves = (Leaves){0};
    KellerStatus status = binary_tree(input, &sah, error);
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
    return !bvh ? 0 : sizeof *bvh + ((size_t)bvh->node_count + 1) * sizeof *bvh->nodes + masks_bytes(bvh->masks);
}

/* The slabs of box.h for two boxes at once: lanes 0 and 1 the bounds by which the frustum enters, 2 and 3 those by which it
 * leaves, negated, so that all are maxima. */
typedef struct {
    f4 at[3], rate[3], bounds;
    bool down[3];            /* the directrix runs down the axis: upper sides come first */
    bool usable;             /* along no axis does the frustum open wider than it leans */
} Slabs;

static Slabs slabs_of(const KellerConeLanes *c)
{
    Slabs s = {.bounds = f4_set(c->near, c->near, -c->far, -c->far), .usable = true};
    for (int k = 0; k < 3; k++) {
        s.down[k] = c->enter_rate[k] < 0;
        s.usable &= s.down[k] == (c->leave_rate[k] < 0);
        s.at[k] = f4_set(c->enter[k], c->enter[k], c->leave[k], c->leave[k]);
        s.rate[k] = f4_set(c->enter_rate[k], c->enter_rate[k], -c->leave_rate[k], -c->leave_rate[k]);
    }
    return s;
}

static inline void test_slabs(const Slabs *s, const Node *node, float bounds[4])
{
    f4 all = s->bounds;
    for (int k = 0; k < 3; k++) {
        f4 side = f4_load(node->side[k]);
        if (s->down[k]) side = simde_mm_shuffle_ps(side, side, SIMDE_MM_SHUFFLE(1, 0, 3, 2));
        all = f4_max(f4_mul(f4_sub(side, s->at[k]), s->rate[k]), all);
    }
    f4_store(bounds, all);
}

static inline AccelBox box_of(const Node *node, int i)
{
    AccelBox b;
    for (int k = 0; k < 3; k++) {
        b.lower[k] = node->side[k][i];
        b.upper[k] = node->side[k][2 + i];
    }
    return b;
}

static bool child_of(const void *tree, uint32_t number, int i, TreeChild *child, AccelBox *box)
{
    const Node *node = &((const Bvh *)tree)->nodes[number];
    *child = (TreeChild){0, node->child[i]};
    *box = box_of(node, i);
    return true;
}

static KellerStatus build_masked(const TreeInput *input, void **tree, Leaves *leaves, KellerError *error)
{
    KellerStatus status = bvh_build(input, tree, leaves, error);
    if (status != KELLER_OK) return status;
    Bvh *bvh = *tree;
    const MaskTree of = {bvh, bvh->node_count, 2, child_of};
    status = masks_make(&of, leaves, input, &bvh->masks, error);
    if (status == KELLER_OK) return status;
    leaves_free(leaves);
    bvh_free(bvh);
    *tree = NULL;
    return status;
}

/* Takes back what masks say is not met. */
static void cull(const Bvh *bvh, const MaskWalk *walk, uint32_t number, float far, bool met[2])
{
    uint32_t hit = (uint32_t)met[0] | (uint32_t)met[1] << 1;
    if (hit == 0) return;
    const Node *node = &bvh->nodes[number];
    uint32_t leaves = node->child[0] >> 31 | node->child[1] >> 31 << 1;
    hit = masks_cull(bvh->masks, walk, node->side[0], 4, 2, number, hit, leaves, far);
    met[0] = hit & 1;
    met[1] = hit >> 1 & 1;
}

typedef struct {
    const KellerConeLanes *lanes;
    const WalkHow *how;
    Slabs slabs;
    bool wide, plain;        /* plain: nothing but the slabs is asked */
} Frustum;

/* Which children are met before `far`, from where on, and whether wholly inside. */
static inline void test_children(const Frustum *f, const Node *node, const Entry *at, float far, Entry child[2], bool met[2])
{
    float bounds[4];
    for (int i = 0; i < 2; i++)
        child[i] = (Entry){node->child[i], i ? node->middle : at->first, i ? at->end : node->middle, 0, at->inside};
    if (f->slabs.usable && !at->inside) {
        test_slabs(&f->slabs, node, bounds);
        for (int i = 0; i < 2; i++) {
            met[i] = bounds[i] <= -bounds[2 + i] && bounds[i] <= far;
            child[i].distance = bounds[i];
        }
        if (f->plain) return;
    }
    for (int i = 0; i < 2; i++) {
        AccelBox box = box_of(node, i);
        if (at->inside) { /* only to see the nearer ones first */
            child[i].distance = box_begins(f->lanes, box.lower, box.upper);
            met[i] = child[i].distance <= far;
            continue;
        }
        if (!f->slabs.usable) {
            met[i] = box_meets(f->lanes, f->wide, box.lower, box.upper, &child[i].distance);
        } else if (met[i] && f->wide) {
            float near = bounds[i], end = -bounds[2 + i];
            met[i] = box_meets_wide(f->lanes, box.lower, box.upper, &near, &end) && near <= end;
            child[i].distance = near;
        }
        met[i] = met[i] && child[i].distance <= far;
        child[i].inside = met[i] && f->how->contained && box_contained(f->lanes, box.lower, box.upper);
        if (met[i] && !child[i].inside && child[i].child & LEAF && f->how->leaf_boxes)
            met[i] = box_meets_exactly(f->how, box.lower, box.upper);
    }
}

/* Is the second of two children that are met to be visited first? */
static inline bool turned(const Frustum *f, const Node *node, const Entry child[2])
{
    if (f->how->order == KELLER_ORDER_SLABS) return child[1].distance < child[0].distance;
    float key[2];
    for (int i = 0; i < 2; i++) {
        AccelBox box = box_of(node, i);
        key[i] = box_key(f->lanes, f->how, box.lower, box.upper, child[i].distance);
    }
    return key[1] < key[0];
}

static inline __attribute__((always_inline)) void walk_as(const Bvh *bvh, const KellerConeLanes *lanes, const WalkHow *how,
                                                          LeafVisit visit, void *context, uint64_t *nodes, bool masked)
{
    if (!bvh || bvh->block_count == 0) return;
    bool wide = cone_lanes_wide(lanes);
    const Frustum f = {lanes, how, slabs_of(lanes), wide, !wide && !how->contained && !how->leaf_boxes};
    MaskWalk masks;
    if (masked) masks = mask_walk(lanes);
    float far = lanes->far;
    Entry stack[STACK];
    int top = 0;
    Entry at = {bvh->node_count ? 0 : (uint32_t)LEAF, 0, bvh->block_count, 0, false};
    uint64_t tested = 1;
    bool met = box_meets(lanes, f.wide, bvh->box.lower, bvh->box.upper, &at.distance);
    at.inside = met && how->contained && box_contained(lanes, bvh->box.lower, bvh->box.upper);
    while (met) {
        if (at.child & LEAF || (at.inside && at.end - at.first <= FEW)) {
            for (uint32_t b = at.first; b < at.end && at.distance <= far; b++) far = visit(context, b, at.inside, far);
        } else {
            Entry child[2];
            bool in[2];
            tested++;
            test_children(&f, &bvh->nodes[at.child], &at, far, child, in);
            if (masked && !at.inside) cull(bvh, &masks, at.child, far, in);
            if (in[0] || in[1]) {
                bool second = !in[0] || (in[1] && turned(&f, &bvh->nodes[at.child], child));
                assert(top < STACK);
                if (in[0] && in[1]) stack[top++] = child[!second];
                at = child[second];
                continue;
            }
        }
        do {
            met = top > 0;
            if (met) at = stack[--top];
        } while (met && !(at.distance <= far));
    }
    *nodes += tested;
}

static void bvh_walk(const void *tree, const KellerConeLanes *lanes, const WalkHow *how, LeafVisit visit, void *context,
                     uint64_t *nodes)
{
    walk_as(tree, lanes, how, visit, context, nodes, false);
}

static void walk_masked(const void *tree, const KellerConeLanes *lanes, const WalkHow *how, LeafVisit visit, void *context,
                        uint64_t *nodes)
{
    walk_as(tree, lanes, how, visit, context, nodes, true);
}

static uint32_t bvh_root(const void *tree)
{
    const Bvh *bvh = tree;
    return !bvh || bvh->block_count == 0 ? KELLER_NONE : bvh->node_count ? 0 : (uint32_t)LEAF;
}

static uint32_t bvh_open(const void *tree, uint32_t node, const KellerConeLanes *lanes, TreeChild child[8])
{
    static const WalkHow plainly;
    bool wide = cone_lanes_wide(lanes);
    const Frustum f = {lanes, &plainly, slabs_of(lanes), wide, !wide};
    const Entry at = {node, 0, 0, 0, false};
    Entry below[2];
    bool met[2];
    test_children(&f, &((const Bvh *)tree)->nodes[node], &at, lanes->far, below, met);
    uint32_t n = 0;
    for (int i = 0; i < 2; i++)
        if (met[i]) child[n++] = (TreeChild){below[i].distance, below[i].child};
    return n;
}

static uint32_t bvh_open_thin(const void *tree, uint32_t number, const KellerConeLanes *lanes, TreeChild child[8])
{
    const Node *node = &((const Bvh *)tree)->nodes[number];
    const Slabs s = slabs_of(lanes);
    float bounds[4];
    test_slabs(&s, node, bounds);
    uint32_t n = 0;
    for (int i = 0; i < 2; i++)
        if (bounds[i] <= -bounds[2 + i]) child[n++] = (TreeChild){bounds[i], node->child[i]};
    return n;
}

/* What bvh_open or bvh_open_thin left of a node's children. */
static uint32_t cull_opened(const Bvh *bvh, uint32_t number, const KellerConeLanes *lanes, TreeChild child[8], uint32_t n)
{
    const MaskWalk masks = mask_walk(lanes);
    bool met[2] = {false, false};
    uint32_t left = 0;
    for (uint32_t i = 0; i < n; i++) met[child[i].child != bvh->nodes[number].child[0]] = true;
    cull(bvh, &masks, number, lanes->far, met);
    for (uint32_t i = 0; i < n; i++)
        if (met[child[i].child != bvh->nodes[number].child[0]]) child[left++] = child[i];
    return left;
}

static uint32_t open_masked(const void *tree, uint32_t number, const KellerConeLanes *lanes, TreeChild child[8])
{
    return cull_opened(tree, number, lanes, child, bvh_open(tree, number, lanes, child));
}

static uint32_t open_thin_masked(const void *tree, uint32_t number, const KellerConeLanes *lanes, TreeChild child[8])
{
    return cull_opened(tree, number, lanes, child, bvh_open_thin(tree, number, lanes, child));
}

const TreeKind tree_bvh_mask = {"bvh+mask", 1, build_masked, bvh_free, bvh_bytes, walk_masked, bvh_root, open_masked, open_thin_masked};
const TreeKind tree_bvh = {"bvh", 1, bvh_build, bvh_free, bvh_bytes, bvh_walk, bvh_root, bvh_open, bvh_open_thin};
