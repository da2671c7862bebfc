#include "accel/dop14.h"

#include <stdlib.h>
#include <string.h>

#include "accel/sobb.h"
#include "accel/wide.h"
#include "base/number.h"
#include "base/simd.h"

#define DIAGONAL ((double)0.57735026f) /* as dops_fourteen has it */
enum { SLABS = 7, DIRECTIONS = 8, STACK = 7 * (SAH_DEPTH + 32 + 8) + 8 };

typedef struct {
    _Alignas(64) float side[2 * SLABS * 8];  /* rows of 8: lower sides, then upper ones */
    uint32_t child[8];              /* as in accel/bvh8.h; unused lanes are empty along the first slab */
} Node;

struct Dop14 {
    Node *nodes;
    uint32_t node_count;
};

void dop14_free(Dop14 *t)
{
    if (!t) return;
    free(t->nodes);
    free(t);
}

size_t dop14_bytes(const Dop14 *t) { return t ? sizeof *t + t->node_count * sizeof *t->nodes : 0; }
bool dop14_empty(const Dop14 *t) { return t->node_count == 0; }

/* ---- building ---------------------------------------------------------------------------------------------------- */

typedef struct {
    const SahTree *binary;
    const WidePlan *plans;
    const float *dops;              /* 2 DIRECTIONS a node of the binary tree */
    Dop14 *tree;
    uint32_t block;
} Build;

static uint32_t collapse(Build *b, uint32_t root)
{
    uint32_t id = b->tree->node_count++, child[8], n = wide_children(b->binary, b->plans, 8, root, child);
    Node node;
    memset(&node, 0, sizeof node);
    for (uint32_t i = 0; i < 8; i++) {
        const float *dop = i < n ? &b->dops[2 * DIRECTIONS * child[i]] : NULL;
        for (int k = 0; k < SLABS; k++) {
            node.side[8 * k + (int)i] = dop ? -dop[DIRECTIONS + k] : INFINITY;
            node.side[8 * (SLABS + k) + (int)i] = dop ? dop[k] : -INFINITY;
        }
        node.child[i] = i >= n ? TREE_LEAF : b->binary->nodes[child[i]].count ? TREE_LEAF | b->block++ : collapse(b, child[i]);
    }
    b->tree->nodes[id] = node;
    return id;
}

static void around_all(const TreeInput *in, const SahTree *binary, const Dops *d, float *dops)
{
    _Alignas(32) float part[2 * DIRECTIONS];
    for (uint32_t n = binary->node_count; n-- > 0;) { /* children have greater numbers */
        const SahNode *node = &binary->nodes[n];
        float *dop = &dops[2 * DIRECTIONS * (size_t)n];
        if (!node->count) memcpy(dop, &dops[2 * DIRECTIONS * (size_t)node->left], sizeof part);
        if (!node->count) dop_add(d, dop, &dops[2 * DIRECTIONS * (size_t)node->right]);
        for (uint32_t i = 0; i < node->count; i++) {
            KellerVec3 v[3];
            int count = in->corners(in->clip_context, binary->refs[node->first + i], v);
            dop_around(d, count, v, i ? part : dop);
            if (i) dop_add(d, dop, part);
        }
    }
}

KellerStatus dop14_make(const TreeInput *in, const SahTree *binary, Dop14 **tree, KellerError *error)
{
    size_t count = (size_t)binary->node_count + 1, nodes = count / 2 + 1;
    Dop14 *t = *tree = calloc(1, sizeof *t);
    float *dops = aligned_alloc(64, (count * 2 * DIRECTIONS * sizeof *dops + 63) / 64 * 64);
    WidePlan *plans = malloc(count * sizeof *plans);
    if (t) t->nodes = aligned_alloc(64, nodes * sizeof *t->nodes);
    KellerStatus status = KELLER_OK;
    if (!t || !t->nodes || !dops || !plans) {
        status = keller_error_memory(error, nodes * sizeof *t->nodes + count * (2 * DIRECTIONS * sizeof *dops + sizeof *plans));
    } else if (binary->node_count) {
        Dops d;
        dops_fourteen(&d);
        around_all(in, binary, &d, dops);
        wide_plan(binary, 8, NULL, plans);
        Build b = {binary, plans, dops, t, 0};
        collapse(&b, 0);
        Node *fit = aligned_alloc(64, t->node_count * sizeof *fit);
        if (fit) {
            memcpy(fit, t->nodes, t->node_count * sizeof *fit);
            free(t->nodes);
            t->nodes = fit;
        }
    }
    free(dops);
    free(plans);
    return status;
}

/* ---- walking ----------------------------------------------------------------------------------------------------- */

/* The slabs of a frustum that widen with z, as in geom/cone_lanes.c: along seven directions in place of three. Errors are those of
 * accel/ubvh_wide.h, and bounds hold the slack, which is twice as much, for the k-DOPs' own. */
typedef struct {
    float enter[SLABS], leave[SLABS], enter_rate[SLABS], leave_rate[SLABS], near, far;
    int first[SLABS];               /* in floats from the node's beginning: the side that it enters by */
} Slabs;

static Slabs slabs_of(const KellerConeLanes *c)
{
    Slabs s = {.near = c->near, .far = c->far};
    bool ray = c->tan_alpha == 0 && c->x0 == 0;
    const float *D = c->axis[2], *X = c->axis[0], *Y = c->axis[1];
    double T = (double)c->tan_alpha, square = 0, length = 0;
    for (int k = 0; k < 3; k++) {
        length = greater(length, fabs((double)D[k]));
        if (!ray) square += (double)Y[k] * (double)Y[k];
    }
    double slack = (double)c->slack * (1 + 2 * T), least = 0x1p-26 * length;
    for (int i = 0; i < SLABS; i++) {
        double at = 0, rate = 0, x = 0, y = 0;
        for (int k = 0; k < 3; k++) {
            double n = i < 3 ? i == k : k == 2 || i & (k + 1) ? DIAGONAL : -DIAGONAL;
            at += n * (double)c->origin[k];
            rate += n * (double)D[k];
            if (ray) continue;
            x += n * (double)X[k];
            y += n * (double)Y[k] / square;
        }
        double spread = length2(x, y), sign = rate < 0 ? -1 : 1, width = sign * (spread * (double)c->x0 + slack);
        double in = fabs(rate) + spread * T, out = fabs(rate) - spread * T;
        if (fabs(out) < least) out = out < 0 ? -least : least;
        s.first[i] = 8 * i + (sign < 0 ? 8 * SLABS : 0);
        s.enter[i] = (float)(at + width);
        s.leave[i] = (float)(at - width);
        s.enter_rate[i] = (float)(sign / greater(in, least));
        s.leave_rate[i] = (float)(sign / out);
    }
    return s;
}

static inline __attribute__((always_inline)) uint32_t meets(const Slabs *s, const Node *node, float far, f8 *begin)
{
    const float *side = node->side;
    f8 in = f8_set1(s->near), out = f8_set1(far);
    for (int k = 0; k < SLABS; k++) {
        f8 first = f8_load(side + s->first[k]), last = f8_load(side + (8 * (2 * k + SLABS) - s->first[k]));
        f8 enter = f8_mul(f8_sub(first, f8_set1(s->enter[k])), f8_set1(s->enter_rate[k]));
        f8 leave = f8_mul(f8_sub(last, f8_set1(s->leave[k])), f8_set1(s->leave_rate[k]));
        in = f8_max(enter, in);
        if ((s->enter_rate[k] < 0) == (s->leave_rate[k] < 0)) out = f8_min(leave, out);
        else in = f8_max(leave, in); /* opens wider than it leans */
    }
    *begin = in;
    return (uint32_t)f8_mask(f8_and(f8_le(in, out), f8_le(f8_load(side), f8_load(side + 8 * SLABS))));
}

void dop14_walk(const Dop14 *t, const KellerConeLanes *lanes, LeafVisit visit, void *context, uint64_t *nodes)
{
    if (t->node_count == 0) return;
    const Slabs slabs = slabs_of(lanes);
    TreeChild stack[STACK], next = {-INFINITY, 0};
    int top = 0;
    float far = lanes->far;
    for (;;) {
        if (next.child & TREE_LEAF) {
            far = visit(context, next.child & ~TREE_LEAF, false, far);
            if (far == -INFINITY) return;
        } else {
            const Node *node = &t->nodes[next.child];
            _Alignas(32) float z[8];
            f8 begin;
            int bottom = top;
            uint32_t hit = meets(&slabs, node, far, &begin);
            ++*nodes;
            f8_store(z, begin);
            for (; hit; hit &= hit - 1) { /* nearest on top */
                int i = __builtin_ctz(hit), j = top++;
                for (; j > bottom && stack[j - 1].distance < z[i]; j--) stack[j] = stack[j - 1];
                stack[j] = (TreeChild){z[i], node->child[i]};
            }
        }
        do {
            if (top == 0) return;
            next = stack[--top];
        } while (next.distance > far);
    }
}

uint32_t dop14_open(const Dop14 *t, uint32_t number, const KellerConeLanes *lanes, TreeChild child[8])
{
    const Slabs slabs = slabs_of(lanes);
    const Node *node = &t->nodes[number];
    _Alignas(32) float z[8];
    f8 begin;
    uint32_t n = 0, hit = meets(&slabs, node, lanes->far, &begin);
    f8_store(z, begin);
    for (; hit; hit &= hit - 1) {
        int i = __builtin_ctz(hit);
        child[n++] = (TreeChild){z[i], node->child[i]};
    }
    return n;
}
