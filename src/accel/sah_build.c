/* The SAH builder: top-down over one array of references that is partitioned in place. Subtrees are OpenMP tasks; the
 * passes over large nodes are cut into parts. Nodes are numbered and references gathered at the end, depth first. */
#include "accel/sah.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

#include "accel/sah_split.h"

enum { SMALL = 16384 }; /* below, threads cost more to wake than they save */
enum {
    FINE = 256,            /* nodes of fewer references get half the bins */
    TASK = 2048,           /* subtrees of fewer references are not worth a task */
    PART = 1 << 14,        /* least references in a part of a pass */
    REF_MOST = 1 << 30
};
/* Spatial splits are tried where the object split's children share more than these parts of the root's chance (Stich et al.,
 * section 4.5, have 1e-5; less finds little) and of the node's. */
static const float ROOT_SHARE = 1e-4f, NODE_SHARE = 0.1f;

typedef struct {
    f8 box, centers;       /* centers: of doubled centres, as a box of points */
} Bounds;

/* A node to be built: refs[first .. first + count), with `room` free places behind them that its subtree may use. */
typedef struct {
    Bounds bounds;
    uint32_t first, count, room, node;
    int depth;
} Range;

typedef struct {
    SahRef *refs;
    SahNode *nodes;
    uint32_t used;         /* nodes; atomic */
    SahOptions options;
    SahClip clip;
    void *context;
    SahMeasure root_measure;
    float overlap_least;   /* in that measure */
} Builder;

static inline Bounds nothing(void) { return (Bounds){f8_set1(-INFINITY), f8_set1(-INFINITY)}; }

static inline void take(Bounds *b, f8 box)
{
    f4 c = sah_center(box);
    b->box = f8_max(box, b->box);
    b->centers = f8_max(f8_join(f4_neg(c), c), b->centers);
}

static inline void join(Bounds *a, const Bounds *b)
{
    a->box = f8_max(a->box, b->box);
    a->centers = f8_max(a->centers, b->centers);
}

/* How many parts a pass over n references is cut into. It changes no result. */
static uint32_t parts_of(const Builder *b, uint32_t n)
{
    if (b->options.threads == 1 || n < 2 * PART) return 1;
    return n / PART < SAH_PARTS ? n / PART : SAH_PARTS;
}

/* ---- object splits ----------------------------------------------------------------------------------------------- */

static void bin_part(const SahRef *refs, uint32_t n, const SahGrid *grid, SahBins *bins, int number)
{
    sah_bins_clear(bins, number);
    for (uint32_t i = 0; i < n; i++) {
        f8 box = sah_bounds(&refs[i]);
        int32_t at[4];
        i4_store(at, f4_to_i4(sah_place(grid, sah_center(box))));
        for (int k = 0; k < 3; k++) {
            f8 *bin = &bins->box[at[k]][k];
            *bin = f8_max(box, *bin);
            bins->enter[at[k]][k]++;
        }
    }
}

/* Bins the centres of a large node's references by parts. Apart, so that its stack is not that of the recursion. */
static __attribute__((noinline)) void bin_parts(const SahRef *refs, uint32_t n, uint32_t parts, const SahGrid *grid,
                                                SahBins *bins, int number)
{
    SahBins part_bins[SAH_PARTS];
#pragma omp taskgroup
    for (uint32_t p = 0; p < parts; p++) {
        uint32_t begin = sah_part(n, p, parts), end = sah_part(n, p + 1, parts);
#pragma omp task shared(part_bins) firstprivate(refs, grid, number, p, begin, end)
        bin_part(refs + begin, end - begin, grid, &part_bins[p], number);
    }
    sah_bins_clear(bins, number);
    for (uint32_t p = 0; p < parts; p++) sah_bins_add(bins, &part_bins[p], number);
}

static __attribute__((noinline)) void object_split(const Builder *b, const Range *r, const SahMeasure *measure, float chance,
                                                   SahSplit *best)
{
    const SahRef *refs = b->refs + r->first;
    int number = r->count < FINE ? SAH_BINS / 2 : SAH_BINS;
    SahBins bins;
    SahGrid grid = sah_grid(f4_neg(f4_low(r->bounds.centers)), f4_high(r->bounds.centers), number);
    uint32_t parts = parts_of(b, r->count);
    if (parts == 1) bin_part(refs, r->count, &grid, &bins, number);
    else bin_parts(refs, r->count, parts, &grid, &bins, number);
    sah_choose(&bins, (const int32_t (*)[4])bins.enter, number, measure, chance, b->options.block, (int32_t)r->count,
               (int32_t)r->count, best);
    best->grid = grid;
    best->spatial = false;
}

/* Puts what goes left before what goes right and gives their number and both sides' bounds. Every step swaps, needed or
 * not: that is quicker than a branch that is as likely as not. */
static uint32_t partition_part(SahRef *refs, uint32_t n, const SahSplit *split, Bounds side[2])
{
    uint32_t left = 0;
    f4 plane = f4_set1((float)split->bin);
    side[0] = side[1] = nothing();
    for (uint32_t i = 0; i < n; i++) {
        f8 box = sah_bounds(&refs[i]);
        unsigned goes_left = split->spatial ? 1 - refs[i].side
            : (unsigned)f4_mask(f4_lt(sah_place(&split->grid, sah_center(box)), plane)) >> split->axis & 1;
        f8_store((float *)&refs[i], sah_bounds(&refs[left]));
        f8_store((float *)&refs[left], box);
        left += goes_left;
        take(&side[1 - goes_left], box);
    }
    return left;
}

/* Exchanges the references that lie in the other side's part of the array, once each part is in order by itself. */
static void exchange(SahRef *refs, uint32_t n, uint32_t parts, const uint32_t *left_of, uint32_t left)
{
    uint32_t p = 0, q = 0, i = 0, i_end = 0, j = 0, j_end = 0;
    for (;;) {
        while (i >= i_end) { /* the next part with right ones before `left` */
            if (p == parts) return;
            i = sah_part(n, p, parts) + left_of[p];
            i_end = sah_part(n, ++p, parts);
        }
        while (j >= j_end) { /* the next with left ones behind it; there are as many, so these end the loop */
            if (q == parts) return;
            j = sah_part(n, q, parts);
            j_end = j + left_of[q++];
            j = j > left ? j : left;
        }
        f8 a = sah_bounds(&refs[i]), c = sah_bounds(&refs[j]);
        f8_store((float *)&refs[i++], c);
        f8_store((float *)&refs[j++], a);
    }
}

static __attribute__((noinline)) uint32_t partition_parts(SahRef *refs, uint32_t n, uint32_t parts, const SahSplit *split,
                                                          Bounds side[2])
{
    Bounds part_side[SAH_PARTS][2];
    uint32_t left_of[SAH_PARTS], left = 0;
#pragma omp taskgroup
    for (uint32_t p = 0; p < parts; p++) {
        uint32_t begin = sah_part(n, p, parts), end = sah_part(n, p + 1, parts);
#pragma omp task shared(part_side, left_of) firstprivate(refs, split, p, begin, end)
        left_of[p] = partition_part(refs + begin, end - begin, split, part_side[p]);
    }
    side[0] = side[1] = nothing();
    for (uint32_t p = 0; p < parts; p++) {
        left += left_of[p];
        for (int s = 0; s < 2; s++) join(&side[s], &part_side[p][s]);
    }
    exchange(refs, n, parts, left_of, left);
    return left;
}

/* ---- nodes ------------------------------------------------------------------------------------------------------- */

static void set_box(SahNode *node, f8 box)
{
    float v[8];
    memcpy(v, &box, sizeof v);
    for (int k = 0; k < 3; k++) {
        node->box.lower[k] = 0 - v[k]; /* not -v: zeros stay +0 */
        node->box.upper[k] = v[k + 4];
    }
}

static void make_leaf(Builder *b, uint32_t node, f8 box, uint32_t first, uint32_t count)
{
    SahNode *leaf = &b->nodes[node];
    set_box(leaf, box);
    leaf->first = first;
    leaf->count = count;
    leaf->left = leaf->right = 0;
}

/* Makes an inner node; returns its left child's place in the array, the right one's is the next. */
static uint32_t make_inner(Builder *b, uint32_t node, f8 box)
{
    uint32_t left;
#pragma omp atomic capture
    {
        left = b->used;
        b->used += 2;
    }
    SahNode *inner = &b->nodes[node];
    set_box(inner, box);
    inner->first = inner->count = 0;
    inner->left = left;
    inner->right = left + 1;
    return left;
}

static int by_id(const void *a, const void *b)
{
    uint32_t i = ((const SahRef *)a)->id, j = ((const SahRef *)b)->id;
    return (i > j) - (i < j);
}

/* The subtree over references sorted by id, halved by count; returns its box. */
static f8 build_halves(Builder *b, uint32_t node, uint32_t first, uint32_t count)
{
    if (count <= b->options.leaf_most) {
        f8 box = f8_set1(-INFINITY);
        for (uint32_t i = first; i < first + count; i++) box = f8_max(sah_bounds(&b->refs[i]), box);
        make_leaf(b, node, box, first, count);
        return box;
    }
    uint32_t left = make_inner(b, node, f8_set1(0));
    f8 one = build_halves(b, left, first, count / 2);
    f8 box = f8_max(one, build_halves(b, left + 1, first + count / 2, count - count / 2));
    set_box(&b->nodes[node], box);
    return box;
}

static void halve(Builder *b, const Range *r)
{
    SahRef *refs = b->refs + r->first;
    for (uint32_t i = 1; i < r->count; i++) {
        if (refs[i - 1].id < refs[i].id) continue;
        qsort(refs, r->count, sizeof *refs, by_id);
        break;
    }
    build_halves(b, r->node, r->first, r->count);
}

/* Whether the children of an object split share so much that a spatial split may be better. */
static bool overlap(const Builder *b, const SahMeasure *measure, float chance, const SahSplit *split)
{
    if (!(split->cost < INFINITY)) return true;
    f8 common = f8_min(split->left, split->right); /* what both have: the lesser -lower, the lesser upper */
    float side[4];
    f4_store(side, f4_add(f4_low(common), f4_high(common)));
    if (!(side[0] >= 0 && side[1] >= 0 && side[2] >= 0)) return false;
    return sah_chance1(&b->root_measure, common) > b->overlap_least && sah_chance1(measure, common) > NODE_SHARE * chance;
}

/* Finds the node's split; false: it is a leaf, or (cost INFINITY) can only be halved. */
static bool find_split(const Builder *b, const Range *r, SahSplit *split)
{
    const SahOptions *o = &b->options;
    double whole = o->cost_ratio * ((r->count + o->block - 1) / o->block);
    bool may_be_leaf = r->count <= o->leaf_most;
    split->cost = INFINITY;
    if (may_be_leaf && (whole <= 1 || r->count == 1)) return false;
    if (r->depth >= SAH_DEPTH) return false;
    SahMeasure measure = sah_measure(r->bounds.box, o->breadth);
    float chance = sah_chance1(&measure, r->bounds.box);
    object_split(b, r, &measure, chance, split);
    if (o->spatial && r->room > 0 && overlap(b, &measure, chance, split)) {
        SahSpatial node = {b->clip, b->context, b->refs + r->first, (int32_t)r->count, (int32_t)r->room, r->bounds.box,
                           o->block, o->breadth, parts_of(b, r->count)};
        SahSplit spatial;
        sah_spatial_choose(&node, &spatial);
        if (spatial.cost < split->cost) *split = spatial;
    }
    return split->cost < INFINITY && !(may_be_leaf && whole <= 1 + o->cost_ratio * (double)split->cost);
}

/* Carries the split out: the references in order, the children's ranges, the free places shared out by their numbers. */
static void divide(Builder *b, const Range *r, const SahSplit *split, Range child[2])
{
    SahRef *refs = b->refs + r->first;
    Bounds side[2];
    uint32_t n = r->count;
    if (split->spatial) {
        SahSpatial node = {b->clip, b->context, refs, (int32_t)n, (int32_t)r->room, r->bounds.box,
                           b->options.block, b->options.breadth, 1};
        n = (uint32_t)sah_spatial_apply(&node, split);
    }
    uint32_t parts = parts_of(b, n);
    uint32_t left = parts == 1 ? partition_part(refs, n, split, side) : partition_parts(refs, n, parts, split, side);
    uint32_t right = n - left, room = r->room - (n - r->count);
    uint32_t left_room = (uint32_t)((uint64_t)room * left / n), move = left_room < right ? left_room : right;
    /* The right side begins behind the left one's free places; the order in it is free. */
    memcpy(refs + left + left_room + right - move, refs + left, move * sizeof *refs);
    child[0] = (Range){side[0], r->first, left, left_room, 0, r->depth + 1};
    child[1] = (Range){side[1], r->first + left + left_room, right, room - left_room, 0, r->depth + 1};
}

static void build(Builder *b, Range r);

/* Apart: some compilers start the whole OpenMP run time on entering any function with a directive in it. */
static __attribute__((noinline)) void spawn(Builder *b, Range r)
{
#pragma omp task firstprivate(b, r)
    build(b, r);
}

static void build(Builder *b, Range r)
{
    for (;;) {
        SahSplit split;
        if (!find_split(b, &r, &split)) {
            if (r.count <= b->options.leaf_most) make_leaf(b, r.node, r.bounds.box, r.first, r.count);
            else halve(b, &r);
            return;
        }
        Range child[2];
        divide(b, &r, &split, child);
        child[0].node = make_inner(b, r.node, r.bounds.box);
        child[1].node = child[0].node + 1;
        Range right = child[1];
        if (b->options.threads > 1 && right.count >= TASK) spawn(b, right);
        else build(b, right);
        r = child[0];
    }
}

/* ---- in and out -------------------------------------------------------------------------------------------------- */

static Bounds read_boxes(uint32_t count, const AccelBox *boxes, SahRef *refs)
{
    Bounds all = nothing();
    for (uint32_t i = 0; i < count; i++) {
        const AccelBox *a = &boxes[i];
        bool empty = a->lower[0] > a->upper[0] || a->lower[1] > a->upper[1] || a->lower[2] > a->upper[2];
        for (int k = 0; k < 3; k++) { /* 0 - and 0 + turn -0 into +0 */
            refs[i].negative[k] = empty ? -INFINITY : 0 - a->lower[k];
            refs[i].upper[k] = empty ? -INFINITY : 0 + a->upper[k];
        }
        refs[i].id = i;
        refs[i].side = 0;
        take(&all, sah_bounds(&refs[i]));
    }
    return all;
}

/* Copies the subtree of b->nodes[from] behind what the tree has; returns its new number. */
static uint32_t copy_out(const Builder *b, uint32_t from, SahTree *tree, int depth)
{
    uint32_t id = tree->node_count++;
    SahNode node = b->nodes[from];
    if (depth > tree->depth) tree->depth = depth;
    uint32_t first = tree->ref_count;
    if (node.count) {
        for (uint32_t i = 0; i < node.count; i++) { /* insertion sort: leaves are small */
            uint32_t ref = b->refs[node.first + i].id, j = first + i;
            for (; j > first && tree->refs[j - 1] > ref; j--) tree->refs[j] = tree->refs[j - 1];
            tree->refs[j] = ref;
        }
        tree->ref_count += node.count;
    } else {
        node.left = copy_out(b, node.left, tree, depth + 1);
        node.right = copy_out(b, node.right, tree, depth + 1);
    }
    node.first = first;
    node.end = tree->ref_count;
    tree->nodes[id] = node;
    return id;
}

static __attribute__((noinline)) void run_parallel(Builder *b, Range root)
{
#pragma omp parallel num_threads(b->options.threads)
#pragma omp single
    build(b, root);
}

static void run(Builder *b, Range root)
{
    if (b->options.threads > 1) run_parallel(b, root);
    else build(b, root);
}

SahOptions sah_defaults(void)
{
    return (SahOptions){.cost_ratio = 1, .leaf_most = 8, .block = 8, .budget = 0.3, .threads = 1};
}

KellerStatus sah_build(uint32_t count, const AccelBox *boxes, SahClip clip, void *context, const SahOptions *options,
                       SahTree *tree, KellerError *error)
{
    memset(tree, 0, sizeof *tree);
    if (count == 0) return KELLER_OK;
    double extra = options->spatial && clip ? options->budget * count : 0;
    if (count > REF_MOST || extra > REF_MOST - count)
        return keller_error(error, KELLER_FAILED, "%u primitives are too many for one hierarchy; expected at most %d, with "
                            "those that spatial splits add", count, (int)REF_MOST);
    uint32_t room = (uint32_t)extra;
    size_t most = (size_t)count + room;
    Builder b = {.used = 1, .options = *options, .clip = clip, .context = context};
    b.options.spatial = room > 0;
    if (b.options.threads == 0) b.options.threads = count < SMALL ? 1 : omp_get_max_threads();
    b.refs = aligned_alloc(64, (most * sizeof *b.refs + 63) / 64 * 64);
    b.nodes = malloc(2 * most * sizeof *b.nodes);
    KellerStatus status = KELLER_OK;
    if (!b.refs || !b.nodes) {
        status = keller_error_memory(error, most * (sizeof *b.refs + 2 * sizeof *b.nodes));
    } else {
        Range root = {read_boxes(count, boxes, b.refs), 0, count, room, 0, 1};
        b.root_measure = sah_measure(root.bounds.box, 0);
        b.overlap_least = ROOT_SHARE * sah_chance1(&b.root_measure, root.bounds.box);
        run(&b, root);
        size_t used = 0; /* references: not all the room is */
        for (uint32_t i = 0; i < b.used; i++) used += b.nodes[i].count;
        tree->nodes = malloc(b.used * sizeof *tree->nodes);
        tree->refs = malloc(used * sizeof *tree->refs);
        if (tree->nodes && tree->refs) copy_out(&b, 0, tree, 1);
        else status = keller_error_memory(error, b.used * sizeof *tree->nodes + used * sizeof *tree->refs);
    }
    free(b.refs);
    free(b.nodes);
    if (status != KELLER_OK) sah_free(tree);
    return status;
}

void sah_free(SahTree *tree)
{
    free(tree->nodes);
    free(tree->refs);
    memset(tree, 0, sizeof *tree);
}
