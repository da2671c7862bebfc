/* Spatial splits (Stich, Friedrich and Dietrich 2009): a plane cuts the primitives that cross it in two, each child gets
 * the box of its part. And the clip functions for triangles and segments. */
#include "accel/sah.h"

#include <float.h>
#include <math.h>

#include "accel/sah_split.h"

enum { BINS = 8 };

/* ---- parts of primitives ----------------------------------------------------------------------------------------- */

/* A point on a segment a + t (b - a), with t from a quotient of differences, is wrong by at most 11 u M in double
 * precision, where u = 2^-53 and M is the greater of |a| and |b| along that axis (3 u for t, 1 each for b - a and the
 * product, all times |b - a| <= 2 M; u M for the sum). This is 16 u. */
static const double SLACK = 0x1p-49;

/* A box being collected, in double: lanes x, y, z. */
typedef struct {
    d4 lower, upper;
} Part;

/* Takes in the part of a segment between the planes. */
static inline void clip_edge(d4 a, d4 b, double from, double to, double lower, double upper, Part *part)
{
    if ((from < lower && to < lower) || (from > upper && to > upper)) return;
    d4 slack = d4_mul(d4_max(d4_abs(a), d4_abs(b)), d4_set1(SLACK));
    for (int end = 0; end < 2; end++) {
        double x = end ? to : from, y = end ? from : to;
        d4 p = end ? b : a, q = end ? a : b, low = p, high = p;
        if (x < lower || x > upper) { /* where the segment comes in */
            double t = ((x < lower ? lower : upper) - x) / (y - x);
            d4 at = d4_add(p, d4_mul(d4_sub(q, p), d4_set1(t)));
            low = d4_sub(at, slack);
            high = d4_add(at, slack);
        }
        part->lower = d4_min(low, part->lower);
        part->upper = d4_max(high, part->upper);
    }
}

/* To single precision, outwards by one to two units in the last place, but not beyond the planes. */
static void round_part(const Part *p, int axis, float lower, float upper, AccelBox *part)
{
    double lo[4], hi[4];
    d4 least = d4_set1(0x1p-149), most = d4_set1(FLT_MAX), unit = d4_set1(0x1p-23);
    d4_store(lo, d4_min(d4_sub(p->lower, d4_add(d4_mul(d4_abs(p->lower), unit), least)), most));
    d4_store(hi, d4_max(d4_add(p->upper, d4_add(d4_mul(d4_abs(p->upper), unit), least)), d4_neg(most)));
    bool empty = d4_first(p->lower) > d4_first(p->upper);
    for (int k = 0; k < 3; k++) {
        part->lower[k] = empty ? INFINITY : (float)lo[k];
        part->upper[k] = empty ? -INFINITY : (float)hi[k];
    }
    if (part->lower[axis] < lower) part->lower[axis] = lower;
    if (part->upper[axis] > upper) part->upper[axis] = upper;
}

static inline double along(KellerVec3 a, int axis) { return axis == 0 ? a.x : axis == 1 ? a.y : a.z; }

void sah_clip_triangle(KellerVec3 a, KellerVec3 b, KellerVec3 c, int axis, float lower, float upper, AccelBox *part)
{
    d4 p = d4_set(a.x, a.y, a.z, 0), q = d4_set(b.x, b.y, b.z, 0), r = d4_set(c.x, c.y, c.z, 0);
    double i = along(a, axis), j = along(b, axis), k = along(c, axis), lo = lower, hi = upper;
    Part box = {d4_set1(INFINITY), d4_set1(-INFINITY)};
    clip_edge(p, q, i, j, lo, hi, &box); /* the polygon's corners lie on the edges */
    clip_edge(q, r, j, k, lo, hi, &box);
    clip_edge(r, p, k, i, lo, hi, &box);
    round_part(&box, axis, lower, upper, part);
}

void sah_clip_segment(KellerVec3 a, KellerVec3 b, int axis, float lower, float upper, AccelBox *part)
{
    Part box = {d4_set1(INFINITY), d4_set1(-INFINITY)};
    clip_edge(d4_set(a.x, a.y, a.z, 0), d4_set(b.x, b.y, b.z, 0), along(a, axis), along(b, axis), lower, upper, &box);
    round_part(&box, axis, lower, upper, part);
}

static inline bool is_empty(f8 box)
{
    f4 side = f4_add(f4_low(box), f4_high(box));
    return (f4_mask(f4_lt(side, f4_set1(0))) & 7) != 0;
}

/* What of the reference lies between two planes: the part of the primitive, and inside what earlier splits left of it. */
static f8 clip_ref(const SahSpatial *node, const SahRef *ref, int axis, float lower, float upper)
{
    AccelBox p;
    node->clip(node->context, ref->id, axis, lower, upper, &p);
    f8 part = f8_set(0 - p.lower[0], 0 - p.lower[1], 0 - p.lower[2], 0, 0 + p.upper[0], 0 + p.upper[1], 0 + p.upper[2], 0);
    part = f8_min(part, sah_bounds(ref));
    return is_empty(part) ? f8_set1(-INFINITY) : part;
}

/* ---- choosing ---------------------------------------------------------------------------------------------------- */

typedef struct {
    SahGrid grid;
    float plane[BINS + 1][4];      /* plane[j][k] is between the bins j - 1 and j along axis k */
} Planes;

static Planes make_planes(f8 box)
{
    Planes p;
    float low[4], high[4];
    f4_store(low, f4_neg(f4_low(box)));
    f4_store(high, f4_high(box));
    p.grid = sah_grid(f4_load(low), f4_load(high), BINS);
    for (int k = 0; k < 3; k++) {
        for (int j = 1; j < BINS; j++) p.plane[j][k] = low[k] + (high[k] - low[k]) * ((float)j / BINS);
        p.plane[0][k] = -INFINITY;
        p.plane[BINS][k] = INFINITY;
    }
    return p;
}

/* The first and the last bin of a box along each axis. The same for choosing and splitting, so that the numbers agree. */
static inline void bins_of(const SahGrid *grid, f8 box, int32_t first[4], int32_t last[4])
{
    f4 lower = sah_place(grid, f4_neg(f4_low(box))), upper = sah_place(grid, f4_high(box));
    i4_store(first, f4_to_i4(f4_min(lower, upper))); /* the lesser: an empty box is inverted */
    i4_store(last, f4_to_i4(upper));
}

static void bin_part(const SahSpatial *node, uint32_t begin, uint32_t end, const Planes *planes, SahBins *bins)
{
    sah_bins_clear(bins, BINS);
    for (uint32_t i = begin; i < end; i++) {
        const SahRef *ref = &node->refs[i];
        int32_t first[4], last[4];
        bins_of(&planes->grid, sah_bounds(ref), first, last);
        for (int k = 0; k < 3; k++) {
            bins->enter[first[k]][k]++;
            bins->leave[last[k]][k]++;
            for (int j = first[k]; j <= last[k]; j++) {
                f8 part = sah_bounds(ref);
                if (first[k] < last[k])
                    part = clip_ref(node, ref, k, j == first[k] ? -INFINITY : planes->plane[j][k],
                                    j == last[k] ? INFINITY : planes->plane[j + 1][k]);
                bins->box[j][k] = f8_max(part, bins->box[j][k]);
            }
        }
    }
}

static __attribute__((noinline)) void bin_parts(const SahSpatial *node, const Planes *planes, SahBins *bins)
{
    SahBins part_bins[SAH_PARTS];
    uint32_t n = (uint32_t)node->count, parts = node->parts;
#pragma omp taskgroup
    for (uint32_t p = 0; p < parts; p++) {
        uint32_t begin = sah_part(n, p, parts), end = sah_part(n, p + 1, parts);
#pragma omp task shared(part_bins) firstprivate(node, planes, p, begin, end)
        bin_part(node, begin, end, planes, &part_bins[p]);
    }
    sah_bins_clear(bins, BINS);
    for (uint32_t p = 0; p < parts; p++) sah_bins_add(bins, &part_bins[p], BINS);
}

void sah_spatial_choose(const SahSpatial *node, SahSplit *best)
{
    best->cost = INFINITY;
    float side[4];
    f4_store(side, f4_add(f4_low(node->box), f4_high(node->box)));
    for (int k = 0; k < 3; k++)
        if (!(side[k] < FLT_MAX)) return;
    Planes planes = make_planes(node->box);
    SahBins bins;
    if (node->parts == 1) bin_part(node, 0, (uint32_t)node->count, &planes, &bins);
    else bin_parts(node, &planes, &bins);
    SahMeasure measure = sah_measure(node->box, node->breadth);
    sah_choose(&bins, (const int32_t (*)[4])bins.leave, BINS, &measure, sah_chance1(&measure, node->box), node->block,
               node->count, node->room, best);
    best->spatial = true;
    best->grid = planes.grid;
    if (best->cost < INFINITY) best->plane = planes.plane[best->bin][best->axis];
}

/* ---- splitting --------------------------------------------------------------------------------------------------- */

/* Where a reference that crosses the plane goes: both sides (0), or whole to the left (1) or to the right (2) where that
 * is cheaper ("reference unsplitting", section 4.4 of the paper). */
static int unsplit(const SahMeasure *m, const SahSplit *s, f8 whole, bool may_left, bool may_right)
{
    float left = sah_chance1(m, s->left), right = sah_chance1(m, s->right);
    float n = (float)s->left_count, k = (float)s->right_count, both = left * n + right * k;
    float to_left = may_left ? sah_chance1(m, f8_max(whole, s->left)) * n + right * (k - 1) : INFINITY;
    float to_right = may_right ? left * (n - 1) + sah_chance1(m, f8_max(whole, s->right)) * k : INFINITY;
    if (both <= to_left && both <= to_right) return 0;
    return to_left <= to_right ? 1 : 2;
}

int32_t sah_spatial_apply(const SahSpatial *node, const SahSplit *split)
{
    int32_t n = node->count, k = split->axis;
    SahMeasure measure = sah_measure(node->box, node->breadth);
    /* A side without a reference of its own keeps all that cross, so that no child is without references. */
    bool may_left = n - split->left_count > 0, may_right = n - split->right_count > 0;
    for (int32_t i = 0; i < node->count; i++) {
        SahRef *ref = &node->refs[i];
        int32_t first[4], last[4];
        f8 whole = sah_bounds(ref);
        bins_of(&split->grid, whole, first, last);
        ref->side = first[k] >= split->bin;
        if (first[k] >= split->bin || last[k] < split->bin) continue;
        int go = unsplit(&measure, split, whole, may_left, may_right);
        f8 left = whole, right = whole;
        if (go == 0) {
            left = clip_ref(node, ref, k, -INFINITY, split->plane);
            right = clip_ref(node, ref, k, split->plane, INFINITY);
            if (is_empty(left) && is_empty(right)) left = right = whole; /* the caller's clip lost it: we do not */
            if (may_left && is_empty(right)) go = 1;
            else if (may_right && is_empty(left)) go = 2;
        }
        uint32_t id = ref->id;
        f8_store((float *)ref, go == 2 ? right : left);
        ref->id = id;
        ref->side = go == 2;
        if (go != 0) continue;
        SahRef *other = &node->refs[n++];
        f8_store((float *)other, right);
        other->id = id;
        other->side = 1;
    }
    return n;
}
