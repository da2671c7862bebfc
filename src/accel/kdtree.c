/* The k-d tree's walk. Descending, the frustum's interval of z in the cell is cut at the splitting plane, by the same two
 * bounds that tests of boxes have for a side (box.h): what a thin frustum finds is exactly what the test of the cell as a box
 * would find, at a third of its price. Wide ones have the cell tested as a box, too. */
#include "accel/kdtree.h"

#include <assert.h>
#include <stdlib.h>

#include "accel/box.h"

typedef struct {
    uint32_t node;
    float near, far;
    AccelBox cell;           /* kept for wide frusta only */
    bool inside;
} Cell;

/* The part of a cell on one side of a plane: `upper` above it. False if the frustum misses it. */
static inline bool part(const KellerConeLanes *c, const KdNode *node, int k, bool upper, bool wide, bool contained,
                        Cell *cell)
{
    float plane = node->plane;
    cell->node += upper ? node->link >> 2 : 1;
    if (upper == (c->enter_rate[k] < 0)) box_leave(c, k, plane, &cell->near, &cell->far);
    else box_enter(c, k, plane, &cell->near);
    if (!wide) return cell->near <= cell->far;
    if (upper) cell->cell.lower[k] = plane;
    else cell->cell.upper[k] = plane;
    if (cell->inside) {
        float begins = box_begins(c, cell->cell.lower, cell->cell.upper);
        cell->near = begins > cell->near ? begins : cell->near;
        return true;
    }
    if (!(cell->near <= cell->far) ||
        !box_meets_wide(c, cell->cell.lower, cell->cell.upper, &cell->near, &cell->far) || !(cell->near <= cell->far))
        return false;
    cell->inside = contained && box_contained(c, cell->cell.lower, cell->cell.upper);
    return true;
}

static inline void walk(const KdTree *tree, const KellerConeLanes *lanes, bool wide, bool contained, LeafVisit visit,
                        void *context, uint64_t *nodes)
{
    Cell stack[KD_DEPTH], at = {0, lanes->near, lanes->far, tree->box, false};
    float far = lanes->far, begins;
    int top = 0;
    uint64_t steps = 1;
    bool met = box_meets(lanes, wide, at.cell.lower, at.cell.upper, &begins);
    for (int k = 0; k < 3; k++) {
        bool down = lanes->enter_rate[k] < 0;
        box_enter(lanes, k, down ? at.cell.upper[k] : at.cell.lower[k], &at.near);
        box_leave(lanes, k, down ? at.cell.lower[k] : at.cell.upper[k], &at.near, &at.far);
    }
    while (met) {
        const KdNode *node = &tree->nodes[at.node];
        int k = (int)(node->link & 3);
        if (k != KD_LEAF) {
            bool down = lanes->enter_rate[k] < 0;
            Cell first = at, second = at; /* as the directrix runs */
            steps++;
            bool in_first = part(lanes, node, k, down, wide, contained, &first) && first.near <= far;
            bool in_second = part(lanes, node, k, !down, wide, contained, &second) && second.near <= far;
            if (in_first && in_second) {
                assert(top < KD_DEPTH);
                if (first.near <= second.near) {
                    stack[top++] = second;
                    at = first;
                } else {
                    stack[top++] = first;
                    at = second;
                }
                continue;
            }
            if (in_first || in_second) {
                at = in_first ? first : second;
                continue;
            }
        } else {
            uint32_t block = node->link >> 2, end = block + node->blocks;
            for (; block < end && at.near <= far; block++) far = visit(context, block, false, far);
        }
        do {
            if (top == 0) {
                *nodes += steps;
                return;
            }
            at = stack[--top];
        } while (!(at.near <= far));
    }
    *nodes += steps;
}

/* What is contained in the frustum is a cell, and primitives reach out of it: `inside` is never said to the visitor. */
static void kdtree_walk(const void *tree, const KellerConeLanes *lanes, bool contained, LeafVisit visit, void *context,
                        uint64_t *nodes)
{
    const KdTree *t = tree;
    if (!t || t->block_count == 0) return;
    if (box_wide(lanes)) walk(t, lanes, true, contained, visit, context, nodes);
    else walk(t, lanes, false, false, visit, context, nodes);
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

const TreeKind tree_kdtree = {"kdtree", 2, kdtree_build, kdtree_free, kdtree_bytes, kdtree_walk};
