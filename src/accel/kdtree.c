/* The k-d tree's walk. Descending, the frustum's interval of z in the cell is cut at the splitting plane, by the same
 * two bounds that tests of boxes have for a side (box.h): what a thin frustum finds is exactly what the test of the
 * cell as a box would find, at a third of its price. Wide ones have the cell tested as a box, too. */
#include "accel/kdtree.h"

#include <assert.h>
#include <stdlib.h>

#include "accel/box.h"

/* A cell that waits, and its interval of z. */
typedef struct {
    uint32_t node;
    float near, far;
} Thin;

typedef struct {
    Thin thin;
    AccelBox cell;
    bool inside;             /* the frustum contains the cell */
} Wide;

/* The interval of the part of a cell above or below a plane across axis k. */
static inline Thin part(const KellerConeLanes *c, const KdNode *node, int k, bool above, Thin t)
{
    t.node += above ? node->link >> 2 : 1;
    if (above == (c->enter_rate[k] < 0)) box_leave(c, k, node->plane, &t.near, &t.far);
    else box_enter(c, k, node->plane, &t.near);
    return t;
}

static Thin root(const KdTree *tree, const KellerConeLanes *lanes)
{
    Thin t = {0, lanes->near, lanes->far};
    for (int k = 0; k < 3; k++) {
        bool down = lanes->enter_rate[k] < 0;
        box_enter(lanes, k, down ? tree->box.upper[k] : tree->box.lower[k], &t.near);
        box_leave(lanes, k, down ? tree->box.lower[k] : tree->box.upper[k], &t.near, &t.far);
    }
    return t;
}

static inline float visit_leaf(const KdNode *leaf, float near, LeafVisit visit, void *context, float far)
{
    uint32_t block = leaf->link >> 2, end = block + leaf->blocks;
    for (; block < end && near <= far; block++) far = visit(context, block, false, far);
    return far;
}

static uint64_t walk_thin(const KdTree *tree, const KellerConeLanes *lanes, LeafVisit visit, void *context)
{
    Thin stack[KD_DEPTH], at = root(tree, lanes);
    float far = lanes->far;
    int top = 0;
    uint64_t steps = 1;
    for (;;) {
        const KdNode *node = &tree->nodes[at.node];
        int k = (int)(node->link & 3);
        if (k == KD_LEAF || !(at.near <= at.far)) {
            if (at.near <= at.far) far = visit_leaf(node, at.near, visit, context, far);
            do {
                if (top == 0) return steps;
                at = stack[--top];
                at.far = at.far < far ? at.far : far;
            } while (!(at.near <= at.far));
            continue;
        }
        steps++;
        bool down = lanes->enter_rate[k] < 0;
        Thin first = part(lanes, node, k, down, at), second = part(lanes, node, k, !down, at);
        bool in_first = first.near <= first.far, in_second = second.near <= second.far;
        bool turn = !in_first || (in_second && second.near < first.near);
        at = turn ? second : first;
        if (in_first && in_second) {
            assert(top < KD_DEPTH);
            stack[top++] = turn ? first : second;
        }
    }
}

/* The part of a cell above or below a plane; false if the frustum misses it. */
static bool wide_part(const KellerConeLanes *c, const KdNode *node, int k, bool above, bool contained, Wide *w)
{
    w->thin = part(c, node, k, above, w->thin);
    if (above) w->cell.lower[k] = node->plane;
    else w->cell.upper[k] = node->plane;
    if (w->inside) {
        float begins = box_begins(c, w->cell.lower, w->cell.upper);
        w->thin.near = begins > w->thin.near ? begins : w->thin.near;
        return true;
    }
    if (!(w->thin.near <= w->thin.far) ||
        !box_meets_wide(c, w->cell.lower, w->cell.upper, &w->thin.near, &w->thin.far) || !(w->thin.near <= w->thin.far))
        return false;
    w->inside = contained && box_contained(c, w->cell.lower, w->cell.upper);
    return true;
}

static uint64_t walk_wide(const KdTree *tree, const KellerConeLanes *lanes, bool contained, LeafVisit visit, void *context)
{
    Wide stack[KD_DEPTH], at = {root(tree, lanes), tree->box, false};
    float far = lanes->far;
    int top = 0;
    uint64_t steps = 1;
    for (;;) {
        const KdNode *node = &tree->nodes[at.thin.node];
        int k = (int)(node->link & 3);
        if (k != KD_LEAF) {
            bool down = lanes->enter_rate[k] < 0;
            Wide part_of[2] = {at, at}; /* as the directrix runs */
            bool met[2];
            steps++;
            for (int i = 0; i < 2; i++)
                met[i] = wide_part(lanes, node, k, down != (i == 1), contained, &part_of[i]) && part_of[i].thin.near <= far;
            if (met[0] || met[1]) {
                bool turn = !met[0] || (met[1] && part_of[1].thin.near < part_of[0].thin.near);
                assert(top < KD_DEPTH);
                if (met[0] && met[1]) stack[top++] = part_of[!turn];
                at = part_of[turn];
                continue;
            }
        } else {
            far = visit_leaf(node, at.thin.near, visit, context, far);
        }
        do {
            if (top == 0) return steps;
            at = stack[--top];
        } while (at.thin.near > far);
    }
}

/* What is contained in the frustum is a cell, and primitives reach out of it: `inside` is never said to the visitor. */
static void kdtree_walk(const void *tree, const KellerConeLanes *lanes, const WalkHow *how, LeafVisit visit, void *context,
                        uint64_t *nodes)
{
    const KdTree *t = tree;
    if (!t || t->block_count == 0) return;
    float begins;
    if (!box_meets(lanes, cone_lanes_wide(lanes), t->box.lower, t->box.upper, &begins)) return;
    *nodes += cone_lanes_wide(lanes) ? walk_wide(t, lanes, how->contained, visit, context) : walk_thin(t, lanes, visit, context);
}

static void kdtree_free(void *tree)
{
    KdTree *t = tree;
    if (!t) return;
    free(t->nodes);
    free(t);
}

static size_t kdtree_bytes(const void *tree)
{
    const KdTree *t = tree;
    return !t ? 0 : sizeof *t + t->node_count * sizeof *t->nodes;
}

const TreeKind tree_kdtree = {"kdtree", 1, kdtree_build, kdtree_free, kdtree_bytes, kdtree_walk, NULL, NULL, NULL};
