#include "geom/boxtree.h"

#include <stdbool.h>
#include <stdlib.h>

enum { LEAF = 4 };

typedef struct {
    double lower[3], upper[3];
} Box;

/* A node holds the items [begin, end). Its left child is the next node; right = 0 marks a leaf (no node has the root as
 * its right child). */
typedef struct {
    Box box;
    uint32_t begin, end, right;
} Node;

struct KellerBoxTree {
    size_t count, node_count;
    Box *boxes;      /* by item */
    uint32_t *items; /* leaf order */
    Node *nodes;
};

static double middle(const Box *box, int axis)
{
    return 0.5 * box->lower[axis] + 0.5 * box->upper[axis];
}

static bool before(const KellerBoxTree *tree, int axis, uint32_t i, uint32_t j)
{
    double a = middle(&tree->boxes[i], axis), b = middle(&tree->boxes[j], axis);
    return a < b || (a == b && i < j);
}

/* Partial sort (quickselect): afterwards items[k] is in its sorted place, with the smaller ones before it. */
static void select_item(KellerBoxTree *tree, int axis, size_t begin, size_t end, size_t k)
{
    uint32_t *items = tree->items;
    while (end - begin > 1) {
        uint32_t a = items[begin], b = items[begin + (end - begin) / 2], c = items[end - 1], pivot;
        if (before(tree, axis, a, b)) pivot = before(tree, axis, b, c) ? b : before(tree, axis, a, c) ? c : a;
        else pivot = before(tree, axis, a, c) ? a : before(tree, axis, b, c) ? c : b;
        size_t i = begin, j = end - 1;
        for (;;) {
            while (before(tree, axis, items[i], pivot)) i++;
            while (before(tree, axis, pivot, items[j])) j--;
            if (i >= j) break;
            uint32_t swap = items[i];
            items[i] = items[j];
            items[j] = swap;
        }
        /* The order is strict, so i == j is the pivot's place. */
        if (i == k) return;
        if (k < i) end = i;
        else begin = i + 1;
    }
}

static uint32_t build(KellerBoxTree *tree, size_t begin, size_t end)
{
    uint32_t index = (uint32_t)tree->node_count++;
    Node *node = &tree->nodes[index];
    Box box = tree->boxes[tree->items[begin]];
    Box centres = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (size_t i = begin; i < end; i++) {
        const Box *b = &tree->boxes[tree->items[i]];
        for (int axis = 0; axis < 3; axis++) {
            box.lower[axis] = fmin(box.lower[axis], b->lower[axis]);
            box.upper[axis] = fmax(box.upper[axis], b->upper[axis]);
            centres.lower[axis] = fmin(centres.lower[axis], middle(b, axis));
            centres.upper[axis] = fmax(centres.upper[axis], middle(b, axis));
        }
    }
    *node = (Node){box, (uint32_t)begin, (uint32_t)end, 0};
    if (end - begin <= LEAF) return index;
    int axis = 0;
    for (int other = 1; other < 3; other++)
        if (centres.upper[other] - centres.lower[other] > centres.upper[axis] - centres.lower[axis]) axis = other;
    size_t half = begin + (end - begin) / 2;
    select_item(tree, axis, begin, end, half);
    build(tree, begin, half);
    uint32_t right = build(tree, half, end);
    tree->nodes[index].right = right;
    return index;
}

KellerBoxTree *keller_boxtree_build(size_t count, const KellerVec3 *lower, const KellerVec3 *upper)
{
    KellerBoxTree *tree = calloc(1, sizeof *tree);
    if (!tree) return NULL;
    tree->count = count;
    if (!count) return tree;
    tree->boxes = malloc(count * sizeof *tree->boxes);
    tree->items = malloc(count * sizeof *tree->items);
    tree->nodes = malloc(2 * count * sizeof *tree->nodes); /* a leaf is never empty */
    if (!tree->boxes || !tree->items || !tree->nodes) {
        keller_boxtree_free(tree);
        return NULL;
    }
    for (size_t i = 0; i < count; i++) {
        tree->boxes[i] = (Box){{lower[i].x, lower[i].y, lower[i].z}, {upper[i].x, upper[i].y, upper[i].z}};
        tree->items[i] = (uint32_t)i;
    }
    build(tree, 0, count);
    return tree;
}

void keller_boxtree_free(KellerBoxTree *tree)
{
    if (!tree) return;
    free(tree->boxes);
    free(tree->items);
    free(tree->nodes);
    free(tree);
}

/* The segment is a + t d, t in [0, 1]. Plain comparisons, because fmin() is a call. */
typedef struct {
    double a[3], inverse[3], margin; /* inverse: 1/d; 0 where d is zero or so small that it would overflow */
    KellerBoxVisit visit;
    void *context;
} Query;

static bool segment_meets(const Query *query, const Box *box)
{
    double near = 0, far = 1;
    for (int axis = 0; axis < 3; axis++) {
        double low = box->lower[axis] - query->margin - query->a[axis];
        double high = box->upper[axis] + query->margin - query->a[axis], inverse = query->inverse[axis];
        if (inverse == 0) {
            if (low > 0 || high < 0) return false;
            continue;
        }
        double t0 = (inverse > 0 ? low : high) * inverse, t1 = (inverse > 0 ? high : low) * inverse;
        if (t0 > near) near = t0;
        if (t1 < far) far = t1;
        if (near > far + 1e-14) return false;
    }
    return true;
}

static void descend(const KellerBoxTree *tree, const Query *query)
{
    uint32_t stack[64], depth = 0; /* halving makes the tree at most 32 deep */
    if (tree->count) stack[depth++] = 0;
    while (depth) {
        uint32_t index = stack[--depth];
        const Node *node = &tree->nodes[index];
        if (!segment_meets(query, &node->box)) continue;
        if (node->right) {
            stack[depth++] = node->right;
            stack[depth++] = index + 1;
            continue;
        }
        for (uint32_t i = node->begin; i < node->end; i++) {
            const Box *box = &tree->boxes[tree->items[i]];
            if (segment_meets(query, box)) query->visit(query->context, tree->items[i]);
        }
    }
}

void keller_boxtree_segment(const KellerBoxTree *tree, KellerVec3 a, KellerVec3 b, double margin, KellerBoxVisit visit,
                            void *context)
{
    Query query = {.a = {a.x, a.y, a.z}, .margin = margin, .visit = visit, .context = context};
    const double d[3] = {b.x - a.x, b.y - a.y, b.z - a.z};
    for (int axis = 0; axis < 3; axis++)
        if (fabs(d[axis]) >= 1e-300) query.inverse[axis] = 1 / d[axis];
    descend(tree, &query);
}
