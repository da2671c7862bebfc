/* The 8-wide hierarchy's nodes, and its walk as a pattern: a query that cares includes it with its own visitor, so that the
 * compiler makes one loop of both. */
#ifndef KELLER_ACCEL_BVH8_H
#define KELLER_ACCEL_BVH8_H
#include "accel/masked.h"

typedef struct {
    _Alignas(64) KellerBox8 boxes;
    uint32_t child[8];              /* node, or TREE_LEAF | leaf; unused lanes have boxes from +infinity to -infinity */
    uint32_t end[8];                /* the leaves below child i are those from end[i - 1] (the node's own first) to end[i] */
} Bvh8Node;
_Static_assert(sizeof(Bvh8Node) == 256, "a node is four cache lines");

typedef struct {
    Bvh8Node *nodes;
    uint32_t node_count, leaf_count;
    MaskSet *masks;                 /* NULL: none */
} Bvh8;

/* A level leaves at most seven siblings waiting, and there are no more levels than in the binary tree. */
enum { BVH8_STACK = 7 * (SAH_DEPTH + 32 + 8) + 8 };

/* A thin, plain frustum or a ray in registers: which side of a box it enters by, and the slabs of both sides. */
typedef struct {
    int first[3];                   /* in floats from the boxes' beginning: lower sides are rows 0 to 2, upper ones 3 to 5 */
    f8 enter[3], leave[3], enter_rate[3], leave_rate[3], near;
} Bvh8Slabs;

static inline __attribute__((always_inline)) Bvh8Slabs bvh8_slabs(const KellerConeLanes *lanes)
{
    Bvh8Slabs s;
    s.near = f8_set1(lanes->near);
    for (int k = 0; k < 3; k++) {
        s.first[k] = 8 * k + 24 * (lanes->enter_rate[k] < 0);
        s.enter[k] = f8_set1(lanes->enter[k]);
        s.leave[k] = f8_set1(lanes->leave[k]);
        s.enter_rate[k] = f8_set1(lanes->enter_rate[k]);
        s.leave_rate[k] = f8_set1(lanes->leave_rate[k]);
    }
    return s;
}

/* The boxes that are met before `far`, and from where on. */
static inline __attribute__((always_inline)) uint32_t bvh8_meets(const Bvh8Slabs *s, const KellerBox8 *boxes, float far, f8 *begin)
{
    const float *side = boxes->lower[0];
    f8 in = s->near, out = f8_set1(far);
    for (int k = 0; k < 3; k++) {
        f8 first = f8_load(side + s->first[k]), last = f8_load(side + (8 * (2 * k + 3) - s->first[k]));
        in = f8_max(in, f8_mul(f8_sub(first, s->enter[k]), s->enter_rate[k]));
        out = f8_min(out, f8_mul(f8_sub(last, s->leave[k]), s->leave_rate[k]));
    }
    *begin = in;
    return (uint32_t)f8_mask(f8_le(in, out));
}

/* The children in `hit` that something in them may be met of. */
static inline __attribute__((always_inline)) uint32_t bvh8_cull(const Bvh8 *tree, const MaskWalk *walk, uint32_t number, uint32_t hit,
                                                                float far)
{
    const Bvh8Node *node = &tree->nodes[number];
    uint32_t leaves = (uint32_t)f8_mask(f8_load((const float *)(const void *)node->child)); /* the sign is TREE_LEAF */
    return masks_cull(tree->masks, walk, node->boxes.lower[0], 8, 24, number, hit, leaves, far);
}

/* TreeKind's open_thin. Masked: the tree has masks. */
static inline __attribute__((always_inline)) uint32_t bvh8_open_thin(const Bvh8 *tree, uint32_t number, const KellerConeLanes *lanes,
                                                                     TreeChild child[8], bool masked)
{
    const Bvh8Node *node = &tree->nodes[number];
    const Bvh8Slabs slabs = bvh8_slabs(lanes);
    _Alignas(32) float z[8];
    f8 in;
    uint32_t n = 0, hit = bvh8_meets(&slabs, &node->boxes, lanes->far, &in);
    if (masked && hit) {
        const MaskWalk walk = mask_walk(lanes);
        hit = bvh8_cull(tree, &walk, number, hit, lanes->far);
    }
    if (hit) f8_store(z, in);
    for (; hit; hit &= hit - 1) {
        int i = __builtin_ctz(hit);
        child[n++] = (TreeChild){z[i], node->child[i]};
    }
    return n;
}

/* TreeKind's walk of thin, plain frusta and rays: reads the slabs, near and far of `lanes` alone. Calls
 * visit(context, leaf, false, far), nearer leaves first where they are told apart at no cost. */
static inline __attribute__((always_inline)) void bvh8_walk_thin(const Bvh8 *tree, const KellerConeLanes *lanes,
                                                                 LeafVisit visit, void *context, const TriangleBlock *blocks,
                                                                 uint64_t *nodes, bool masked)
{
    if (!tree || tree->node_count == 0) return;
    struct {
        uint32_t child;
        float z;
    } stack[BVH8_STACK];
    const Bvh8Slabs slabs = bvh8_slabs(lanes);
    MaskWalk walk;
    if (masked) walk = mask_walk(lanes);
    int top = 0;
    float far = lanes->far;
    uint64_t tested = 0;
    uint32_t next = 0;
    for (;;) {
        while (!(next & TREE_LEAF)) {
            const Bvh8Node *node = &tree->nodes[next];
            f8 in;
            uint32_t hit = bvh8_meets(&slabs, &node->boxes, far, &in);
            tested++;
            if (masked && hit) hit = bvh8_cull(tree, &walk, next, hit, far);
            if (hit == 0) goto pop;
            uint32_t i = (uint32_t)__builtin_ctz(hit);
            next = node->child[i];
            hit &= hit - 1;
            if (hit == 0) continue;
            /* the nearest goes on; the others wait, sorted by insertion, the farthest below */
            _Alignas(32) float z[8];
            f8_store(z, in);
            float next_z = z[i];
            int bottom = top;
            do {
                i = (uint32_t)__builtin_ctz(hit);
                uint32_t child = node->child[i];
                float at = z[i];
                if (at < next_z) {
                    uint32_t c = next;
                    float t = next_z;
                    next = child, next_z = at;
                    child = c, at = t;
                }
                if (blocks && child & TREE_LEAF) fetch_block(&blocks[child & ~TREE_LEAF]);
                int j = top++;
                for (; j > bottom && stack[j - 1].z < at; j--) stack[j] = stack[j - 1];
                stack[j].child = child;
                stack[j].z = at;
                hit &= hit - 1;
            } while (hit);
        }
        far = visit(context, next & ~TREE_LEAF, false, far);
        if (far == -INFINITY) break;
    pop:
        do {
            if (top == 0) goto done;
            top--;
        } while (stack[top].z > far);
        next = stack[top].child;
    }
done:
    *nodes += tested;
}
#endif
