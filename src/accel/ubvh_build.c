/* Building the hierarchy of skewed boxes, by transforming the binary one (UBVH, section 4.1). */
#include "accel/ubvh.h"

#include <omp.h>
#include <stdlib.h>
#include <string.h>

#include "accel/dop14.h"
#include "accel/pairs.h"
#include "accel/wide.h"
#include "base/number.h"

/* No margin is less: as in accel/ray8.c, and for the same reason. */
#define FLOOR 1e-9
/* A node's boxes are skewed where that leaves no more of their area than this: tried on hair, munich and a city with 0, 0.5, 0.7, 0.85
 * and always, which were within a tenth of each other but for the last, slower in streets by a fifth (docs/performance.md). */
#define SHARE 0.85
enum {
    PARTS = 64,                     /* of the tree, for threads */
    SMALL = 4096                    /* primitives for which threads cost more to wake than they save */
};

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

/* A subtree for one thread: its nodes, which are numbered depth first. */
typedef struct {
    uint32_t from, end;
} Part;

/* Boxes of the nodes from..end, the last ones first, so that what is on the stack are the k-DOPs of the subtrees behind;
 * those of `parts` are known. Returns the top. */
static float *fit_nodes(const Build *b, uint32_t from, uint32_t end, const Part *parts, uint32_t part_count,
                        const float *known, float *area, float *stack)
{
    size_t each = 2 * (size_t)b->dops->count;
    float *top = stack; /* stack[0 .. each) is for a leaf's primitives */
    for (uint32_t n = end; n-- > from;) {
        const SahNode *node = &b->binary->nodes[n];
        if (part_count && parts[part_count - 1].end == n + 1) {
            n = parts[--part_count].from;
            memcpy(top += each, known + each * part_count, each * sizeof *top);
            continue;
        }
        if (node->count) {
            top += each;
            around_leaf(b, node, top, stack);
        } else {
            dop_add(b->dops, top - each, top);
            top -= each;
        }
        if (node->count == 1 && b->tree->unified) continue; /* has a box of its own, and plans do not ask */
        b->fits[n] = sobb_fit(b->dops, top, b->tree->margin);
        area[n] = b->fits[n].area;
    }
    return top;
}

/* Cuts the tree into subtrees of at most `most` primitives, in the order of their numbers; returns how many. */
static uint32_t cut_tree(const SahTree *binary, uint32_t most, Part *parts)
{
    uint32_t count = 0, n = 0, waiting[SAH_DEPTH + 33], ends[SAH_DEPTH + 33], depth = 0, end = binary->node_count;
    for (;;) {
        const SahNode *node = &binary->nodes[n];
        if (node->end - node->first > most && !node->count) {
            waiting[depth] = node->right;
            ends[depth++] = end;
            end = node->right;
            n = node->left;
            continue;
        }
        parts[count++] = (Part){n, end};
        if (depth == 0) return count;
        n = waiting[--depth];
        end = ends[depth];
    }
}

/* Boxes of all nodes, from the leaves up: those of subtrees in parallel, then those above. A box is its k-DOP's, and that is
 * the same whoever makes it. */
static KellerStatus fit_all(Build *b, float *area, KellerError *error)
{
    const SahTree *binary = b->binary;
    int threads = b->in->threads > 0 ? b->in->threads : omp_get_max_threads();
    if (binary->ref_count < SMALL) threads = 1;
    uint32_t most = threads > 1 ? binary->ref_count / PARTS + 1 : UINT32_MAX, count = 0;
    size_t each = 2 * (size_t)b->dops->count, depth = ((size_t)binary->depth + 3) * each;
    size_t room = (size_t)PARTS * (size_t)binary->depth + 1; /* a level has no more than PARTS nodes that are cut */
    bool failed = false;
    Part *parts = malloc(room * sizeof *parts);
    if (parts) count = threads > 1 ? cut_tree(binary, most, parts) : 0;
    size_t floats = (count + 1) * each + depth;
    float *known = aligned_alloc(64, (floats * sizeof *known + 63) / 64 * 64);
    if (!parts || !known) {
        free(parts);
        free(known);
        return keller_error_memory(error, floats * sizeof *known + room * sizeof *parts);
    }
#pragma omp parallel for schedule(dynamic) num_threads(threads) reduction(|| : failed) if (count > 1)
    for (uint32_t i = 0; i < count; i++) {
        float *stack = aligned_alloc(64, depth * sizeof *stack);
        failed = failed || !stack;
        if (stack) {
            const float *top = fit_nodes(b, parts[i].from, parts[i].end, NULL, 0, NULL, area, stack);
            memcpy(known + each * i, top, each * sizeof *known);
        }
        free(stack);
    }
    if (!failed) fit_nodes(b, 0, binary->node_count, parts, count, known, area, known + each * (count + 1));
    free(parts);
    free(known);
    return failed ? keller_error_memory(error, depth * sizeof *known) : KELLER_OK;
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
static uint32_t put_leaves(Build *b, uint32_t node, const uint32_t *leaf, uint32_t n)
{
    uint32_t first_block = b->leaves->block_count, first_ref = b->ref_count, put = 0;
    for (int edges = 0; edges < 2; edges++)
        for (uint32_t i = 0; i < n; i++) {
            KellerVec3 v[3];
            Pair pair = b->pairs[leaf[i]];
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

/* A node of up to eight leaves. */
static uint32_t put_leaf_node(Build *b, const SahNode *from)
{
    uint32_t id = b->tree->node_count++;
    clear(b->tree, id);
    put_leaves(b, id, &b->binary->refs[from->first], from->count);
    return id;
}

/* Whether skewed boxes around these subtrees are enough smaller than those along the axes. */
static bool worth_skew(const Build *b, const uint32_t *child, uint32_t n)
{
    double skewed = 0, along = 0;
    for (uint32_t i = 0; i < n; i++) {
        const SahNode *node = &b->binary->nodes[child[i]];
        if (node->count == 1 && b->tree->unified) return true; /* a triangle's own box */
        skewed += (double)b->fits[child[i]].area;
        along += wide_area(&node->box);
    }
    return b->in->skewed.everywhere || skewed < SHARE * along;
}

static uint32_t collapse(Build *b, uint32_t root);

/* What is below a node, as its child. */
static uint32_t put_child(Build *b, uint32_t n)
{
    const SahNode *from = &b->binary->nodes[n];
    return !from->count ? collapse(b, n) : b->tree->unified ? put_leaf_node(b, from) : put_block(b, from);
}

static uint32_t put_along(Build *b, const uint32_t *child, uint32_t n)
{
    uint32_t id = b->tree->along_count++;
    UbvhAlong node;
    memset(&node, 0, sizeof node);
    for (uint32_t i = 0; i < 8; i++) {
        const AccelBox *box = &b->binary->nodes[child[i < n ? i : 0]].box;
        for (int k = 0; k < 3; k++) {
            node.boxes.lower[k][i] = i < n ? box->lower[k] : INFINITY;
            node.boxes.upper[k][i] = i < n ? box->upper[k] : -INFINITY;
        }
        if (i < n) node.child[i] = put_child(b, child[i]);
    }
    b->tree->along[id] = node;
    return UBVH_ALONG | id;
}

/* The subtree below a binary tree's node, which is no leaf but that of a root; returns what to call it by. */
static uint32_t collapse(Build *b, uint32_t root)
{
    Ubvh *t = b->tree;
    uint32_t child[8], leaf[8], n = wide_children(b->binary, b->plans, t->width, root, child), put = 0;
    if (!worth_skew(b, child, n)) return put_along(b, child, n);
    uint32_t id = t->node_count++;
    clear(t, id);
    for (uint32_t i = 0; i < n && t->unified; i++)
        if (b->binary->nodes[child[i]].count == 1) leaf[put++] = b->binary->refs[b->binary->nodes[child[i]].first];
    if (put) put_leaves(b, id, leaf, put);
    for (uint32_t i = 0; i < n; i++) {
        if (b->binary->nodes[child[i]].count == 1 && t->unified) continue;
        Sobb box = sobb_of_fit(b->dops, &b->fits[child[i]]);
        put_box(t, id, put++, &box, put_child(b, child[i]));
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

/* The binary tree over primitives or pairs, whose leaves fill nodes. */
static KellerStatus over_pairs(const TreeInput *in, const Pair *pairs, uint32_t count, uint32_t width, SahTree *binary, KellerError *error)
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
    options.leaf_most = options.block = width;
    options.threads = in->threads;
    KellerStatus status = sah_build(count, boxes, NULL, NULL, &options, binary, error);
    free(boxes);
    return status;
}

static KellerStatus allocate(Build *b, float **area, KellerError *error)
{
    Ubvh *t = b->tree;
    size_t binary = (size_t)b->binary->node_count + 1, nodes = binary + 2, refs = (size_t)b->in->count + 1;
    size_t node = t->width == 4 ? sizeof(UbvhNode4) : sizeof(UbvhNode8), bytes = (nodes * node + 63) / 64 * 64;
    if (t->width == 4) t->nodes4 = aligned_alloc(64, bytes);
    else t->nodes8 = aligned_alloc(64, bytes);
    t->along = aligned_alloc(64, nodes * sizeof *t->along);
    b->fits = malloc(binary * sizeof *b->fits);
    b->plans = malloc(binary * sizeof *b->plans);
    *area = malloc(binary * sizeof **area);
    b->leaves->begin = malloc((binary + 1) * sizeof *b->leaves->begin);
    b->leaves->refs = malloc(refs * sizeof *b->leaves->refs);
    if ((t->nodes4 || t->nodes8) && t->along && b->fits && b->plans && *area && b->leaves->begin && b->leaves->refs) return KELLER_OK;
    return keller_error_memory(error, bytes + binary * (sizeof *b->fits + sizeof *b->plans + 8) + 4 * refs);
}

/* Gives back what was taken for more nodes than came to be. */
static void fit_array(void **array, size_t bytes)
{
    void *fit = bytes ? aligned_alloc(64, (bytes + 63) / 64 * 64) : NULL;
    if (bytes && !fit) return;
    if (bytes) memcpy(fit, *array, bytes);
    free(*array);
    *array = fit;
}

static void fit_memory(Ubvh *t)
{
    if (t->width == 4) fit_array((void **)&t->nodes4, t->node_count * sizeof *t->nodes4);
    else fit_array((void **)&t->nodes8, t->node_count * sizeof *t->nodes8);
    fit_array((void **)&t->along, t->along_count * sizeof *t->along);
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
            b->tree->node_count = 1;
            clear(b->tree, 0);
            b->tree->root = collapse(b, 0);
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

KellerStatus ubvh_build(const TreeInput *input, void **tree, Leaves *leaves, KellerError *error)
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
        if (status == KELLER_OK) status = over_pairs(&in, pairs, count, (uint32_t)t->width, &binary, error);
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
    ubvh_free(t);
    *tree = NULL;
    return status;
}
