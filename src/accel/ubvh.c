/* Building the hierarchy of skewed boxes, by transforming the binary one (UBVH, section 4.1), and TreeKind's functions. */
#include "accel/ubvh.h"

#include <stdlib.h>
#include <string.h>

#include "accel/dop14.h"
#include "accel/pairs.h"
#include "accel/wide.h"
#include "base/number.h"

/* No margin is less: as in accel/ray8.c, and for the same reason. */
#define FLOOR 1e-9

static void tree_free(void *tree)
{
    Ubvh *t = tree;
    if (!t) return;
    free(t->nodes8);
    free(t->nodes4);
    dop14_free(t->dop14);
    free(t);
}

static size_t tree_bytes(const void *tree)
{
    const Ubvh *t = tree;
    if (!t) return 0;
    size_t node = t->dop14 ? 0 : t->width == 4 ? sizeof(UbvhNode4) : sizeof(UbvhNode8);
    return sizeof *t + t->node_count * node + dop14_bytes(t->dop14);
}

/* ---- building ---------------------------------------------------------------------------------------------------- */

typedef struct {
    const TreeInput *in;
    const Pair *pairs;              /* the binary tree's primitives; NULL: those of the input */
    const SahTree *binary;
    const Dops *dops;
    SobbFit *fits;                  /* [node_count] of the binary tree */
    WidePlan *plans;
    Ubvh *tree;
    Leaves *leaves;
    uint32_t ref_count;
    bool too_many;
} Build;

/* The k-DOP of a leaf's primitives. */
static void around_leaf(const Build *b, const SahNode *node, float *dop, float *part)
{
    for (uint32_t i = node->first; i < node->first + node->count; i++) {
        uint32_t ref = b->binary->refs[i];
        const uint32_t ids[2] = {b->pairs ? b->pairs[ref].first : ref, b->pairs ? b->pairs[ref].second : KELLER_NONE};
        for (int j = 0; j < 2 && ids[j] != KELLER_NONE; j++) {
            KellerVec3 v[3];
            int count = b->in->corners(b->in->clip_context, ids[j], v);
            bool begun = i > node->first || j > 0;
            dop_around(b->dops, count, v, begun ? part : dop);
            if (begun) dop_add(b->dops, dop, part);
        }
    }
}

/* Boxes of all nodes from the leaves up: numbers run depth first, so that what is on the stack are the k-DOPs of the subtrees behind. */
static KellerStatus fit_all(Build *b, float *area, KellerError *error)
{
    const SahTree *binary = b->binary;
    size_t each = 2 * (size_t)b->dops->count, bytes = ((size_t)binary->depth + 3) * each * sizeof(float);
    float *stack = aligned_alloc(64, (bytes + 63) / 64 * 64), *part = stack;
    if (!stack) return keller_error_memory(error, bytes);
    float *top = stack; /* stack[0 .. each) is `part` */
    for (uint32_t n = binary->node_count; n-- > 0;) {
        const SahNode *node = &binary->nodes[n];
        if (node->count) {
            top += each;
            around_leaf(b, node, top, part);
        } else {
            dop_add(b->dops, top - each, top);
            top -= each;
        }
        if (node->count && b->tree->unified) continue; /* has boxes of its own, and plans do not ask */
        b->fits[n] = sobb_fit(b->dops, top, b->tree->margin);
        area[n] = b->fits[n].area;
    }
    free(stack);
    return KELLER_OK;
}

static void put_box(Ubvh *t, uint32_t node, uint32_t i, const Sobb *box, uint32_t child)
{
    bool four = t->width == 4;
    float *rows = four ? t->nodes4[node].slab : t->nodes8[node].slab;
    for (int k = 0; k < 3; k++) {
        for (int j = 0; j < 3; j++) rows[(4 * k + j) * t->width + (int)i] = box->slab[k].n[j];
        rows[(4 * k + 3) * t->width + (int)i] = box->slab[k].c;
    }
    (four ? t->nodes4[node].band : t->nodes8[node].band)[i] = box->band;
    (four ? t->nodes4[node].child : t->nodes8[node].child)[i] = child;
}

static void clear(Ubvh *t, uint32_t node)
{
    if (t->width == 4) memset(&t->nodes4[node], 0, sizeof t->nodes4[node]);
    else memset(&t->nodes8[node], 0, sizeof t->nodes8[node]);
}

static uint32_t take_ref(Build *b, uint32_t primitive)
{
    b->leaves->refs[b->ref_count] = primitive;
    return b->ref_count++;
}

/* A node's leaves fill blocks of their own, triangles before edges, which have no lane. */
static uint32_t put_leaves(Build *b, uint32_t node, const uint32_t *child, uint32_t n)
{
    uint32_t first_block = b->leaves->block_count, first_ref = b->ref_count, put = 0;
    for (int edges = 0; edges < 2; edges++)
        for (uint32_t i = 0; i < n; i++) {
            const SahNode *from = &b->binary->nodes[child[i]];
            KellerVec3 v[3];
            if (!from->count) continue;
            Pair pair = b->pairs[b->binary->refs[from->first]];
            if ((b->in->corners(b->in->clip_context, pair.first, v) == 2) != (edges == 1)) continue;
            SobbPlace place;
            Sobb box = pair_box(b->in, pair, b->tree->margin, &place);
            uint32_t at = 8 * first_block + take_ref(b, pair.first) - first_ref;
            if (pair.second != KELLER_NONE) take_ref(b, pair.second);
            b->too_many |= at >= UBVH_PLACE - 1;
            uint32_t kind = place == SOBB_FLAT ? UBVH_FLAT : place == SOBB_WINGS ? UBVH_WINGS : 0;
            put_box(b->tree, node, put++, &box, UBVH_LEAF | kind | at);
        }
    for (uint32_t i = first_ref; i < b->ref_count; i += 8) b->leaves->begin[b->leaves->block_count++] = i;
    return put;
}

/* A block of up to eight as they are. */
static uint32_t put_block(Build *b, const SahNode *from)
{
    uint32_t block = b->leaves->block_count++;
    b->leaves->begin[block] = b->ref_count;
    for (uint32_t i = 0; i < from->count; i++) take_ref(b, b->binary->refs[from->first + i]);
    b->too_many |= block >= UBVH_PLACE / 8;
    return UBVH_LEAF | 8 * block;
}

static uint32_t collapse(Build *b, uint32_t root)
{
    Ubvh *t = b->tree;
    uint32_t id = t->node_count++, child[8], n = wide_children(b->binary, b->plans, t->width, root, child), put = 0;
    clear(t, id);
    if (t->unified) put = put_leaves(b, id, child, n);
    for (uint32_t i = 0; i < n; i++) {
        const SahNode *from = &b->binary->nodes[child[i]];
        if (from->count && t->unified) continue;
        Sobb box = sobb_of_fit(b->dops, &b->fits[child[i]]);
        put_box(t, id, put++, &box, from->count ? put_block(b, from) : collapse(b, child[i]));
    }
    return id;
}

static double reach_of(const TreeInput *in)
{
    double most = 0;
    for (uint32_t i = 0; i < in->count; i++)
        for (int k = 0; k < 3; k++)
            most = greater(most, greater(fabs((double)in->boxes[i].lower[k]), fabs((double)in->boxes[i].upper[k])));
    return most;
}

/* The binary tree over leaves of one primitive, or pair, each. */
static KellerStatus over_pairs(const TreeInput *in, const Pair *pairs, uint32_t count, SahTree *binary, KellerError *error)
{
    AccelBox *boxes = malloc(((size_t)count + 1) * sizeof *boxes);
    if (!boxes) return keller_error_memory(error, count * sizeof *boxes);
    for (uint32_t i = 0; i < count; i++) {
        boxes[i] = in->boxes[pairs[i].first];
        for (int k = 0; k < 3 && pairs[i].second != KELLER_NONE; k++) {
            const AccelBox *other = &in->boxes[pairs[i].second];
            if (other->lower[k] < boxes[i].lower[k]) boxes[i].lower[k] = other->lower[k];
            if (other->upper[k] > boxes[i].upper[k]) boxes[i].upper[k] = other->upper[k];
        }
    }
    SahOptions options = sah_defaults();
    options.cost_ratio = in->cost_ratio;
    options.leaf_most = options.block = 1;
    options.threads = in->threads;
    KellerStatus status = sah_build(count, boxes, NULL, NULL, &options, binary, error);
    free(boxes);
    return status;
}

static KellerStatus allocate(Build *b, float **area, KellerError *error)
{
    Ubvh *t = b->tree;
    size_t binary = (size_t)b->binary->node_count + 1, nodes = binary / 2 + 1, refs = (size_t)b->in->count + 1;
    size_t node = t->width == 4 ? sizeof(UbvhNode4) : sizeof(UbvhNode8), bytes = (nodes * node + 63) / 64 * 64;
    if (t->width == 4) t->nodes4 = aligned_alloc(64, bytes);
    else t->nodes8 = aligned_alloc(64, bytes);
    b->fits = malloc(binary * sizeof *b->fits);
    b->plans = malloc(binary * sizeof *b->plans);
    *area = malloc(binary * sizeof **area);
    b->leaves->begin = malloc((binary + 1) * sizeof *b->leaves->begin);
    b->leaves->refs = malloc(refs * sizeof *b->leaves->refs);
    if ((t->nodes4 || t->nodes8) && b->fits && b->plans && *area && b->leaves->begin && b->leaves->refs) return KELLER_OK;
    return keller_error_memory(error, bytes + binary * (sizeof *b->fits + sizeof *b->plans + 8) + 4 * refs);
}

/* Gives back what was taken for more nodes than came to be. */
static void fit_memory(Ubvh *t)
{
    void **nodes = t->width == 4 ? (void **)&t->nodes4 : (void **)&t->nodes8;
    size_t bytes = (t->node_count * (t->width == 4 ? sizeof(UbvhNode4) : sizeof(UbvhNode8)) + 63) / 64 * 64;
    void *fit = bytes ? aligned_alloc(64, bytes) : NULL;
    if (!fit) return;
    memcpy(fit, *nodes, t->node_count * (t->width == 4 ? sizeof(UbvhNode4) : sizeof(UbvhNode8)));
    free(*nodes);
    *nodes = fit;
}

static KellerStatus transform(Build *b, KellerError *error)
{
    float *area = NULL;
    Dops dops = {.count = 0};
    b->dops = &dops;
    KellerStatus status = dops_make(&dops, b->in->skewed.boxes == KELLER_BOXES_ORIENTED, error);
    if (status == KELLER_OK) status = allocate(b, &area, error);
    if (status == KELLER_OK && b->binary->node_count) {
        status = fit_all(b, area, error);
        if (status == KELLER_OK) {
            wide_plan(b->binary, b->tree->width, area, b->plans);
            collapse(b, 0);
            fit_memory(b->tree);
        }
    }
    if (status == KELLER_OK) b->leaves->begin[b->leaves->block_count] = b->ref_count;
    if (b->too_many) status = keller_error(error, KELLER_FAILED, "%u primitives are too many for \"ubvh\"", b->in->count);
    free(area);
    free(b->fits);
    free(b->plans);
    dops_free(&dops);
    return status;
}

static KellerStatus build(const TreeInput *input, void **tree, Leaves *leaves, KellerError *error)
{
    TreeInput in = *input;
    in.spatial = 0; /* a part's primitive would be around its box, not in it */
    const KellerSkewedOptions *how = &in.skewed;
    Pair *pairs = NULL;
    uint32_t count = in.count;
    SahTree binary = {.nodes = NULL};
    KellerStatus status = KELLER_OK;
    *leaves = (Leaves){0};
    Ubvh *t = *tree = calloc(1, sizeof *t);
    if (!t) return keller_error_memory(error, sizeof *t);
    t->width = how->width == 4 ? 4 : 8;
    t->unified = !how->blocks && how->boxes != KELLER_BOXES_DOP14;
    t->margin = SOBB_WIDTH * (reach_of(&in) + FLOOR);
    if (t->unified) {
        status = pairs_find(&in, how->pairs, t->margin, &pairs, &count, error);
        if (status == KELLER_OK) status = over_pairs(&in, pairs, count, &binary, error);
    } else {
        status = binary_tree(&in, &binary, error);
    }
    Build b = {.in = &in, .pairs = pairs, .binary = &binary, .tree = t, .leaves = leaves};
    if (status == KELLER_OK && how->boxes == KELLER_BOXES_DOP14) {
        status = leaves_of(&binary, leaves, error);
        if (status == KELLER_OK) status = dop14_make(&in, &binary, &t->dop14, error);
    } else if (status == KELLER_OK) {
        status = transform(&b, error);
    }
    free(pairs);
    sah_free(&binary);
    if (status == KELLER_OK) return status;
    leaves_free(leaves);
    tree_free(t);
    *tree = NULL;
    return status;
}

/* ---- walking ----------------------------------------------------------------------------------------------------- */

UbvhFrustum ubvh_frustum(const Ubvh *t, const KellerConeLanes *c)
{
    UbvhFrustum f = {.near = c->near, .far = c->far, .ray = c->tan_alpha == 0 && c->x0 == 0};
    memcpy(f.origin, c->origin, sizeof f.origin);
    memcpy(f.axis[2], c->axis[2], sizeof f.axis[2]);
    double slack = (double)c->slack;
    if (!f.ray) {
        const float *minor = c->axis[1]; /* times e; wanted over e */
        double square = 0;
        for (int k = 0; k < 3; k++) square += (double)minor[k] * (double)minor[k];
        for (int k = 0; k < 3; k++) f.axis[1][k] = (float)((double)minor[k] / square);
        memcpy(f.axis[0], c->axis[0], sizeof f.axis[0]);
        f.tan_alpha = c->tan_alpha;
        f.x0 = c->x0;
        slack *= 1 + 2 * (double)c->tan_alpha;
    }
    /* the slack is 64 u (M + x0), of which tests ask for less than half; of 96 u size slabs have 84 to spare */
    double asked = 0.5 * slack - 2.0 / 3 * t->margin;
    f.loose = asked > 0 ? float_up(asked) : 0;
    f.looser = (float)(1 + (double)f.loose / t->margin);
    return f;
}

static void walk(const void *tree, const KellerConeLanes *lanes, const WalkHow *how, LeafVisit visit, void *context, uint64_t *nodes)
{
    (void)how; /* order and containment are of boxes along the axes */
    const Ubvh *t = tree;
    if (t && t->dop14) {
        dop14_walk(t->dop14, lanes, visit, context, nodes);
        return;
    }
    if (!t || t->node_count == 0) return;
    const UbvhFrustum f = ubvh_frustum(t, lanes);
    if (t->width == 4) ubvh_walk_4(t, t->nodes4, &f, visit, context, nodes);
    else ubvh_walk_8(t, t->nodes8, &f, visit, context, nodes);
}

static uint32_t root(const void *tree)
{
    const Ubvh *t = tree;
    return !t || (t->dop14 ? dop14_empty(t->dop14) : t->node_count == 0) ? KELLER_NONE : 0;
}

static uint32_t open_node(const void *tree, uint32_t node, const KellerConeLanes *lanes, TreeChild child[8])
{
    const Ubvh *t = tree;
    if (t->dop14) return dop14_open(t->dop14, node, lanes, child);
    const UbvhFrustum f = ubvh_frustum(t, lanes);
    return t->width == 4 ? ubvh_open_4(&t->nodes4[node], &f, child) : ubvh_open_8(&t->nodes8[node], &f, child);
}

const TreeKind tree_ubvh = {"ubvh", 1, build, tree_free, tree_bytes, walk, root, open_node, open_node};
