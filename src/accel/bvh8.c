/* The 8-wide hierarchy (paper, section 4.3): the binary tree collapsed so that one vector test serves a node. A node is four
 * cache lines, children are numbers, so the block of nodes can be moved or stored as it is. */
#include <stdlib.h>
#include <string.h>

#include "accel/internal.h"
#include "base/number.h"
#include "base/simd.h"

#define LEAF 0x80000000u

typedef struct {
    _Alignas(64) KellerBox8 boxes;
    uint32_t child[8];              /* node, or LEAF | block; unused lanes have empty boxes */
    uint32_t unused[8];
} Node;
_Static_assert(sizeof(Node) == 256, "a node is four cache lines");

typedef struct {
    Node *nodes;
    uint32_t node_count;
} Tree;

static void tree_free(void *tree)
{
    Tree *t = tree;
    if (!t) return;
    free(t->nodes);
    free(t);
}

static size_t tree_bytes(const void *tree) { return tree ? ((const Tree *)tree)->node_count * sizeof(Node) : 0; }

/* ---- building ---------------------------------------------------------------------------------------------------- */

static double half_area(const AccelBox *b)
{
    double x = (double)b->upper[0] - (double)b->lower[0], y = (double)b->upper[1] - (double)b->lower[1],
           z = (double)b->upper[2] - (double)b->lower[2];
    return x * y + y * z + z * x;
}

/* Opens the child with the largest surface until there are eight: the box most likely to be entered is the one to skip. */
static uint32_t collapse(const SahTree *binary, uint32_t root, Tree *t, uint32_t *block)
{
    uint32_t id = t->node_count++, child[8] = {root}, n = 1;
    while (n < 8) {
        int open = -1;
        double most = -1;
        for (uint32_t i = 0; i < n; i++) {
            const SahNode *c = &binary->nodes[child[i]];
            double area = c->count ? -1 : half_area(&c->box);
            if (area > most) {
                most = area;
                open = (int)i;
            }
        }
        if (open < 0) break;
        /* in place and in order, so that blocks are numbered from left to right */
        uint32_t opened = child[open];
        memmove(&child[open + 2], &child[open + 1], (n - (uint32_t)open - 1) * sizeof *child);
        child[open] = binary->nodes[opened].left;
        child[open + 1] = binary->nodes[opened].right;
        n++;
    }
    Node node = {.unused = {0}};
    for (uint32_t i = 0; i < 8; i++) {
        const SahNode *c = i < n ? &binary->nodes[child[i]] : NULL;
        for (int k = 0; k < 3; k++) {
            node.boxes.lower[k][i] = c ? c->box.lower[k] : 1;
            node.boxes.upper[k][i] = c ? c->box.upper[k] : -1;
        }
        node.child[i] = !c ? LEAF : c->count ? LEAF | (*block)++ : collapse(binary, child[i], t, block);
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
    if (!t || !t->nodes) status = keller_error_memory(error, most * sizeof(Node));
    if (status == KELLER_OK) status = leaves_of(&binary, leaves, error);
    if (status == KELLER_OK && binary.node_count > 0) {
        uint32_t block = 0;
        collapse(&binary, 0, t, &block);
        Node *fit = aligned_alloc(64, t->node_count * sizeof(Node));
        if (fit) {
            memcpy(fit, t->nodes, t->node_count * sizeof(Node));
            free(t->nodes);
            t->nodes = fit;
        }
    }
    sah_free(&binary);
    if (status == KELLER_OK) return status;
    tree_free(t);
    *tree = NULL;
    return status;
}

/* ---- walking ----------------------------------------------------------------------------------------------------- */

/* Each level of the binary tree leaves at most one sibling waiting, and the collapsed tree's levels are no more. */
enum { STACK = SAH_DEPTH + 32 + 8 };

typedef struct {
    uint32_t child;
    float z;
    bool inside;
} Waiting;

static void walk(const void *tree, const KellerConeLanes *lanes, bool contained, LeafVisit visit, void *context,
                 uint64_t *nodes)
{
    const Tree *t = tree;
    if (!t || t->node_count == 0) return;
    Waiting stack[7 * STACK + 8], next = {0, -INFINITY, false};
    int top = 0;
    float far = lanes->far; /* lanes stay as they are: a copy would wait for their stores */
    uint64_t tested = 0;
    for (;;) {
        if (next.child & LEAF) {
            far = visit(context, next.child & ~LEAF, next.inside, far);
            if (far == -INFINITY) break;
        } else {
            const Node *node = &t->nodes[next.child];
            _Alignas(32) float z[8];
            tested++;
            uint32_t hit = keller_cone_meets_box8(lanes, &node->boxes, z), in = 0;
            if (next.inside) in = hit;
            else if (contained && hit) in = keller_cone_contains_box8(lanes, &node->boxes) & hit;
            /* nearest on top: insertion sort, farthest first */
            int first = top;
            for (; hit; hit &= hit - 1) {
                uint32_t i = (uint32_t)__builtin_ctz(hit);
                if (z[i] > far) continue;
                int j = top++;
                for (; j > first && stack[j - 1].z < z[i]; j--) stack[j] = stack[j - 1];
                stack[j] = (Waiting){node->child[i], z[i], in >> i & 1};
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

static uint32_t root(const void *tree) { return !tree || ((const Tree *)tree)->node_count == 0 ? KELLER_NONE : 0; }

static uint32_t open_node(const void *tree, uint32_t number, const KellerConeLanes *lanes, TreeChild child[8])
{
    const Node *node = &((const Tree *)tree)->nodes[number];
    _Alignas(32) float z[8];
    uint32_t n = 0;
    for (uint32_t hit = keller_cone_meets_box8(lanes, &node->boxes, z); hit; hit &= hit - 1) {
        int i = __builtin_ctz(hit);
        child[n++] = (TreeChild){z[i], node->child[i]};
    }
    return n;
}

static uint32_t open_ray(const void *tree, uint32_t number, const RayLanes *ray, TreeChild child[8])
{
    const Node *node = &((const Tree *)tree)->nodes[number];
    const float *side = node->boxes.lower[0]; /* rows of eight: lower sides 0 to 2, upper ones 3 to 5 */
    f8 in = f8_set1(ray->near), out = f8_set1(ray->far);
    for (int k = 0; k < 3; k++) {
        int first = 8 * k + 24 * (ray->rate[k] < 0);
        f8 rate = f8_set1(ray->rate[k]);
        in = f8_max(in, f8_mul(f8_sub(f8_load(side + first), f8_set1(ray->enter[k])), rate));
        out = f8_min(out, f8_mul(f8_sub(f8_load(side + (8 * (2 * k + 3) - first)), f8_set1(ray->leave[k])), rate));
    }
    uint32_t n = 0, hit = (uint32_t)f8_mask(f8_and(f8_le(in, out), f8_le(f8_load(side), f8_load(side + 24))));
    _Alignas(32) float z[8];
    if (hit) f8_store(z, in);
    for (; hit; hit &= hit - 1) {
        int i = __builtin_ctz(hit);
        child[n++] = (TreeChild){z[i], node->child[i]};
    }
    return n;
}

const TreeKind tree_bvh8 = {"bvh8", 1, build, tree_free, tree_bytes, walk, root, open_node, open_ray};
