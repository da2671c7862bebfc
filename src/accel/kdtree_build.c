/* The k-d tree's builder: the surface-area heuristic (Wald and Havran 2006) with primitives clipped to their cells. Large
 * nodes try the planes between bins, small ones every plane that a primitive's box begins or ends at, from sorted arrays.
 *
 * The order of references is that of partitions in place, and what a subtree does depends on nothing outside it: the tree is
 * the same for any number of threads. Bounded are the depth, by 8 + 1.3 log2 n, and the references, by BUDGET n: a node shares
 * its free places among its children by their references, and one without does not split what crosses the plane. */
#include <omp.h>
#include <stdlib.h>
#include <string.h>

#include "accel/kdtree.h"
#include "base/number.h"

enum { SMALL = 16384 }; /* below, threads cost more to wake than they save */
enum {
    BINS = 64,
    EXACT = 64,             /* nodes of no more references try all planes */
    TASK = 4096,             /* subtrees of fewer references are not worth a task */
    BLOCK = 8,
    BUDGET = 4,              /* references a primitive, all together */
    REF_MOST = 1 << 29
};
static const double EMPTY_BONUS = 0.8;  /* of the cost of a split that cuts off empty space (section 3.3) */
static const double LEAST_SIDE = 0x1p-12; /* of a cell's longest side: lengths count in a cell without area */

typedef struct {
    AccelBox box;            /* of the primitive's part in the cell */
    uint32_t id, side;       /* side: bit 0, below the plane; bit 1, above */
} Ref;

typedef struct {
    double cost;             /* INFINITY: none */
    int axis;
    float plane;
    bool planar_above;       /* where primitives in the plane go */
} Split;

/* What a subtree's builder hands back: nodes depth first, and the references of its leaves in their order. */
typedef struct {
    KdNode *nodes;
    uint32_t *refs;
    size_t node_count, node_room, ref_count, ref_room;
} Out;

typedef struct {
    const TreeInput *input;
    Ref *refs;
    int depth_most, threads;
    int failed;              /* out of memory; atomic */
} Builder;

typedef struct {
    AccelBox cell;
    size_t first, count, room; /* refs[first .. first + count), and as many free places behind */
    int depth;
} Range;

/* ---- the best plane ---------------------------------------------------------------------------------------------- */

static double side(float lower, float upper) { return lesser((double)upper - (double)lower, 1e38); }

/* The chance to meet a box of these sides, times a constant. */
static double chance(const double s[3]) { return s[0] * s[1] + s[1] * s[2] + s[2] * s[0]; }

static size_t blocks(size_t n) { return (n + BLOCK - 1) / BLOCK; }

typedef struct {
    double side[3], whole, ratio;
    const AccelBox *cell;
} Measure;

static Measure measure_of(const AccelBox *cell, double ratio)
{
    Measure m = {.cell = cell, .ratio = ratio};
    double most = 1e-37;
    for (int k = 0; k < 3; k++) most = greater(most, m.side[k] = side(cell->lower[k], cell->upper[k]));
    for (int k = 0; k < 3; k++) m.side[k] += LEAST_SIDE * most;
    m.whole = chance(m.side);
    return m;
}

static void try_plane(const Measure *m, int axis, float plane, size_t below, size_t above, bool planar_above, Split *best)
{
    double s[3] = {m->side[0], m->side[1], m->side[2]};
    s[axis] = lesser((double)plane - (double)m->cell->lower[axis], 1e38);
    double cost = chance(s) * (double)blocks(below);
    s[axis] = lesser((double)m->cell->upper[axis] - (double)plane, 1e38);
    cost = 1 + m->ratio * (cost + chance(s) * (double)blocks(above)) / m->whole;
    if (below == 0 || above == 0) cost *= EMPTY_BONUS;
    if (cost < best->cost) *best = (Split){cost, axis, plane, planar_above};
}

static void try_bins(const Measure *m, const Ref *refs, size_t n, Split *best)
{
    uint32_t enter[3][BINS] = {{0}}, leave[3][BINS] = {{0}};
    float scale[3];
    for (int k = 0; k < 3; k++) {
        double s = side(m->cell->lower[k], m->cell->upper[k]);
        scale[k] = s > 1e-35 ? (float)(BINS / s) : 0;
    }
    for (size_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) {
            float low = m->cell->lower[k], last = BINS - 1;
            float from = (refs[i].box.lower[k] - low) * scale[k], to = (refs[i].box.upper[k] - low) * scale[k];
            enter[k][(int)(from > 0 ? from < last ? from : last : 0)]++;
            leave[k][(int)(to > 0 ? to < last ? to : last : 0)]++;
        }
    for (int k = 0; k < 3; k++) {
        size_t below = 0, above = n;
        for (int j = 1; j < BINS && scale[k] > 0; j++) {
            float low = m->cell->lower[k], plane = low + (float)j / scale[k];
            below += enter[k][j - 1];
            above -= leave[k][j - 1];
            if (plane > low && plane < m->cell->upper[k]) try_plane(m, k, plane, below, above, true, best);
        }
    }
}

/* Merges sorted runs, first of RUN by insertion; qsort's calls would be half of the time of all building. */
static void sort(float *v, size_t n)
{
    enum { RUN = 12 };
    float other[EXACT], *from = v, *to = other;
    for (size_t begin = 0; begin < n; begin += RUN)
        for (size_t i = begin + 1; i < n && i < begin + RUN; i++) {
            float x = v[i];
            size_t j = i;
            for (; j > begin && v[j - 1] > x; j--) v[j] = v[j - 1];
            v[j] = x;
        }
    for (size_t run = RUN; run < n; run *= 2) {
        for (size_t begin = 0; begin < n; begin += 2 * run) {
            size_t i = begin, middle = begin + run < n ? begin + run : n, j = middle;
            size_t end = begin + 2 * run < n ? begin + 2 * run : n, out = begin;
            while (i < middle && j < end) {
                bool second = from[j] < from[i];
                to[out++] = second ? from[j] : from[i];
                i += !second;
                j += second;
            }
            while (i < middle) to[out++] = from[i++];
            while (j < end) to[out++] = from[j++];
        }
        float *t = from;
        from = to;
        to = t;
    }
    if (from != v) memcpy(v, from, n * sizeof *v);
}

static __attribute__((noinline)) void try_all(const Measure *m, const Ref *refs, size_t n, Split *best)
{
    float lower[EXACT], upper[EXACT], planar[EXACT];
    for (int k = 0; k < 3; k++) {
        size_t flat = 0, begun = 0, ended = 0, flats = 0;
        for (size_t i = 0; i < n; i++) {
            lower[i] = refs[i].box.lower[k];
            upper[i] = refs[i].box.upper[k];
            if (lower[i] == upper[i]) planar[flat++] = lower[i];
        }
        sort(lower, n);
        sort(upper, n);
        sort(planar, flat);
        while (begun < n || ended < n) {
            float plane = begun < n && lower[begun] <= upper[ended] ? lower[begun] : upper[ended];
            size_t in_plane = 0, below = begun; /* begun: boxes that begin before the plane */
            while (begun < n && lower[begun] == plane) begun++;
            while (ended < n && upper[ended] == plane) ended++;
            while (flats < flat && planar[flats] < plane) flats++;
            while (flats < flat && planar[flats] == plane) flats++, in_plane++;
            if (!(plane > m->cell->lower[k] && plane < m->cell->upper[k])) continue;
            size_t above = n - ended; /* boxes that end behind it */
            try_plane(m, k, plane, below + in_plane, above, false, best);
            if (in_plane) try_plane(m, k, plane, below, above + in_plane, true, best);
        }
    }
}

/* ---- carrying it out --------------------------------------------------------------------------------------------- */

static bool is_empty(const AccelBox *b)
{
    return b->lower[0] > b->upper[0] || b->lower[1] > b->upper[1] || b->lower[2] > b->upper[2];
}

static AccelBox clipped(const TreeInput *in, const Ref *ref, int axis, float lower, float upper)
{
    AccelBox p = ref->box;
    if (in->clip) in->clip(in->clip_context, ref->id, axis, lower, upper, &p);
    for (int k = 0; k < 3; k++) {
        float from = k == axis && lower > ref->box.lower[k] ? lower : ref->box.lower[k];
        float to = k == axis && upper < ref->box.upper[k] ? upper : ref->box.upper[k];
        p.lower[k] = p.lower[k] > from ? p.lower[k] : from;
        p.upper[k] = p.upper[k] < to ? p.upper[k] : to;
    }
    return p;
}

/* Splits what crosses the plane, and tells all sides; false if the free places do not suffice: nothing has happened then. */
static bool divide(const Builder *b, const Range *r, const Split *s, Range child[2])
{
    Ref *refs = b->refs + r->first;
    size_t n = r->count, crossing = 0, below = 0;
    for (size_t i = 0; i < n; i++) {
        const AccelBox *box = &refs[i].box;
        bool low = box->lower[s->axis] < s->plane, high = box->upper[s->axis] > s->plane;
        refs[i].side = low || high ? (uint32_t)low | (uint32_t)high << 1 : s->planar_above ? 2 : 1;
        crossing += low && high;
    }
    if (crossing > r->room) return false;
    for (size_t i = 0, count = n; i < count; i++) {
        if (refs[i].side != 3) continue;
        AccelBox one = clipped(b->input, &refs[i], s->axis, -INFINITY, s->plane);
        AccelBox two = clipped(b->input, &refs[i], s->axis, s->plane, INFINITY);
        bool no_one = is_empty(&one), no_two = is_empty(&two);
        if (no_one && no_two) { /* the clip lost it: we do not */
            one = two = refs[i].box;
            one.upper[s->axis] = two.lower[s->axis] = s->plane;
            no_one = no_two = false;
        }
        refs[i].box = no_one ? two : one;
        refs[i].side = no_one ? 2 : 1;
        if (!no_one && !no_two) refs[n++] = (Ref){two, refs[i].id, 2};
    }
    for (size_t i = 0; i < n; i++) {
        if (refs[i].side != 1) continue;
        Ref t = refs[below];
        refs[below++] = refs[i];
        refs[i] = t;
    }
    size_t above = n - below, room = r->room - (n - r->count);
    size_t below_room = n ? (size_t)((double)room * (double)below / (double)n) : 0;
    memmove(refs + below + below_room, refs + below, above * sizeof *refs);
    child[0] = (Range){r->cell, r->first, below, below_room, r->depth + 1};
    child[1] = (Range){r->cell, r->first + below + below_room, above, room - below_room, r->depth + 1};
    child[0].cell.upper[s->axis] = child[1].cell.lower[s->axis] = s->plane;
    return true;
}

/* Makes room for `more` elements; false: out of memory. */
static bool reserve(void *array, size_t size, size_t count, size_t more, size_t *room)
{
    if (count + more <= *room) return true;
    size_t most = 2 * (count + more) + 64;
    void *now;
    memcpy(&now, array, sizeof now);
    now = realloc(now, most * size);
    if (!now) return false;
    memcpy(array, &now, sizeof now);
    *room = most;
    return true;
}

static void fail(Builder *b)
{
#pragma omp atomic write
    b->failed = 1;
}

static bool put_node(Builder *b, Out *out, KdNode node)
{
    bool ok = reserve(&out->nodes, sizeof *out->nodes, out->node_count, 1, &out->node_room);
    if (ok) out->nodes[out->node_count++] = node;
    else fail(b);
    return ok;
}

static void put_leaf(Builder *b, const Range *r, Out *out)
{
    if (!reserve(&out->refs, sizeof *out->refs, out->ref_count, r->count, &out->ref_room)) {
        fail(b);
        return;
    }
    for (size_t i = 0; i < r->count; i++) out->refs[out->ref_count++] = b->refs[r->first + i].id;
    put_node(b, out, (KdNode){.blocks = (uint32_t)r->count, .link = KD_LEAF}); /* blocks are numbered at the end */
}

static void append(Builder *b, Out *to, Out *from)
{
    if (reserve(&to->nodes, sizeof *to->nodes, to->node_count, from->node_count, &to->node_room) &&
        reserve(&to->refs, sizeof *to->refs, to->ref_count, from->ref_count, &to->ref_room)) {
        if (from->node_count) memcpy(to->nodes + to->node_count, from->nodes, from->node_count * sizeof *to->nodes);
        if (from->ref_count) memcpy(to->refs + to->ref_count, from->refs, from->ref_count * sizeof *to->refs);
        to->node_count += from->node_count;
        to->ref_count += from->ref_count;
    } else {
        fail(b);
    }
    free(from->nodes);
    free(from->refs);
}

static void build(Builder *b, Range r, Out *out)
{
    Split split = {.cost = INFINITY};
    Range child[2];
    int failed;
#pragma omp atomic read
    failed = b->failed;
    if (failed) return;
    if (r.count > 0 && r.depth < b->depth_most) {
        const Ref *refs = b->refs + r.first;
        Measure m = measure_of(&r.cell, b->input->cost_ratio);
        if (r.count > EXACT) try_bins(&m, refs, r.count, &split);
        else try_all(&m, refs, r.count, &split);
    }
    if (!(split.cost < b->input->cost_ratio * (double)blocks(r.count)) || !divide(b, &r, &split, child)) {
        put_leaf(b, &r, out);
        return;
    }
    size_t at = out->node_count;
    if (!put_node(b, out, (KdNode){.plane = split.plane, .link = 0})) return;
    if (b->threads > 1 && child[0].count >= TASK && child[1].count >= TASK) {
        Out other = {0};
        Range right = child[1];
#pragma omp task shared(other) firstprivate(b, right)
        build(b, right, &other);
        build(b, child[0], out);
#pragma omp taskwait
        out->nodes[at].link = (uint32_t)(out->node_count - at) << 2 | (uint32_t)split.axis;
        append(b, out, &other);
    } else {
        build(b, child[0], out);
        out->nodes[at].link = (uint32_t)(out->node_count - at) << 2 | (uint32_t)split.axis;
        build(b, child[1], out);
    }
}

/* ---- in and out -------------------------------------------------------------------------------------------------- */

static Range read_boxes(const TreeInput *input, Ref *refs)
{
    Range r = {.cell = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}}};
    for (uint32_t i = 0; i < input->count; i++) {
        if (is_empty(&input->boxes[i])) continue; /* is met by nothing */
        refs[r.count++] = (Ref){input->boxes[i], i, 0};
        for (int k = 0; k < 3; k++) {
            r.cell.lower[k] = (float)lesser((double)input->boxes[i].lower[k], (double)r.cell.lower[k]);
            r.cell.upper[k] = (float)greater((double)input->boxes[i].upper[k], (double)r.cell.upper[k]);
        }
    }
    return r;
}

static void run(Builder *b, Range root, Out *out)
{
    if (b->threads <= 1) {
        build(b, root, out);
        return;
    }
#pragma omp parallel num_threads(b->threads)
#pragma omp single
    build(b, root, out);
}

/* Cuts the leaves' references into blocks, as even as can be, and numbers these. */
static KellerStatus number_blocks(KdTree *tree, Out *out, Leaves *leaves, KellerError *error)
{
    size_t count = 0;
    for (size_t i = 0; i < out->node_count; i++)
        if ((out->nodes[i].link & 3) == KD_LEAF) count += blocks(out->nodes[i].blocks);
    leaves->begin = malloc((count + 1) * sizeof *leaves->begin);
    if (!leaves->begin) return keller_error_memory(error, (count + 1) * sizeof *leaves->begin);
    uint32_t begin = 0;
    for (size_t i = 0; i < out->node_count; i++) {
        KdNode *node = &out->nodes[i];
        if ((node->link & 3) != KD_LEAF) continue;
        uint32_t n = node->blocks;
        node->blocks = (uint32_t)blocks(n);
        node->link = leaves->block_count << 2 | KD_LEAF;
        for (uint32_t j = 0; j < node->blocks; j++)
            leaves->begin[leaves->block_count++] = begin + (uint32_t)((uint64_t)n * j / node->blocks);
        begin += n;
    }
    leaves->begin[leaves->block_count] = begin;
    leaves->refs = out->refs;
    out->refs = NULL;
    tree->nodes = realloc(out->nodes, (out->node_count + 1) * sizeof *out->nodes);
    if (!tree->nodes) tree->nodes = out->nodes;
    out->nodes = NULL;
    tree->node_count = (uint32_t)out->node_count;
    tree->block_count = leaves->block_count;
    return KELLER_OK;
}

KellerStatus kdtree_build(const TreeInput *input, void **tree, Leaves *leaves, KellerError *error)
{
    *tree = NULL;
    *leaves = (Leaves){0};
    if (input->count > REF_MOST / BUDGET)
        return keller_error(error, KELLER_FAILED, "%u primitives are too many for a k-d tree; expected at most %d",
                            input->count, REF_MOST / BUDGET);
    size_t most = (size_t)BUDGET * input->count + 1;
    Builder b = {.input = input, .threads = input->threads ? input->threads : input->count < SMALL ? 1 : omp_get_max_threads()};
    b.depth_most = (int)(8 + 1.3 * log2((double)input->count + 1));
    b.refs = malloc(most * sizeof *b.refs);
    Out out = {0};
    KdTree *t = calloc(1, sizeof *t);
    KellerStatus status = b.refs && t ? KELLER_OK : keller_error_memory(error, most * sizeof *b.refs);
    if (status == KELLER_OK) {
        Range root = read_boxes(input, b.refs);
        t->box = root.cell;
        root.room = (BUDGET - 1) * root.count;
        run(&b, root, &out);
        if (b.failed) status = keller_error_memory(error, out.node_count * sizeof *out.nodes);
    }
    if (status == KELLER_OK) status = number_blocks(t, &out, leaves, error);
    free(b.refs);
    free(out.nodes);
    free(out.refs);
    if (status == KELLER_OK) {
        *tree = t;
    } else {
        leaves_free(leaves);
        free(t);
    }
    return status;
}
