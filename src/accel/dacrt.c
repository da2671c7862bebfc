/* The accelerator without a structure: blocks of triangles as they come. One query alone asks them all; a batch divides and conquers
 * (dac.h). */
#include <stdlib.h>
#include <string.h>

#include "accel/dac.h"

typedef struct {
    uint32_t block_count;
} Blocks;

static KellerStatus build(const TreeInput *in, void **tree, Leaves *leaves, KellerError *error)
{
    uint32_t blocks = (uint32_t)(((uint64_t)in->count + 7) / 8);
    Blocks *b = malloc(sizeof *b);
    *leaves = (Leaves){blocks, malloc(((size_t)blocks + 1) * sizeof *leaves->begin),
                       malloc(((size_t)in->count + 1) * sizeof *leaves->refs)};
    *tree = b;
    if (!b || !leaves->begin || !leaves->refs) {
        free(b);
        *tree = NULL;
        leaves_free(leaves);
        return keller_error_memory(error, ((size_t)blocks + in->count) * sizeof *leaves->refs);
    }
    b->block_count = blocks;
    for (uint32_t i = 0; i <= blocks; i++) leaves->begin[i] = 8 * i < in->count ? 8 * i : in->count;
    for (uint32_t i = 0; i < in->count; i++) leaves->refs[i] = i;
    return KELLER_OK;
}

static size_t bytes(const void *tree) { return tree ? sizeof(Blocks) : 0; }

static void walk(const void *tree, const KellerConeLanes *lanes, const WalkHow *how, LeafVisit visit, void *context, uint64_t *nodes)
{
    (void)how, (void)nodes;
    const Blocks *b = tree;
    float far = lanes->far;
    for (uint32_t i = 0; b && i < b->block_count && far != -INFINITY; i++) far = visit(context, i, false, far);
}

const TreeKind tree_dacrt = {"dacrt", 1, build, free, bytes, walk, NULL, NULL, NULL};

/* ---- sets of primitives ------------------------------------------------------------------------------------------- */

static f4 middle_of(f8 box) { return f4_sub(f4_high(box), f4_low(box)); }

/* Adds a primitive whose corners are rounded to nearest. */
static void put(DacSet *set, const KellerVertex8 *corner, int corners, int lane, uint32_t id)
{
    SahRef *ref = &set->refs[set->count++];
    *ref = (SahRef){.id = 0, .side = 0};
    for (int k = 0; k < 3; k++) {
        float low = corner[0].p[k][lane], high = low;
        for (int j = 1; j < corners; j++) {
            float p = corner[j].p[k][lane];
            low = p < low ? p : low;
            high = p > high ? p : high;
        }
        ref->negative[k] = fabsf(low) * 0x1p-23f - low + 0x1p-149f; /* outwards by an ulp or two */
        ref->upper[k] = fabsf(high) * 0x1p-23f + high + 0x1p-149f;
    }
    set->box = f8_max(sah_bounds(ref), set->box);
    set->middle = f4_add(set->middle, middle_of(sah_bounds(ref)));
    ref->id = id;
}

static void average(DacSet *set) { set->middle = f4_mul(set->middle, f4_set1(set->count ? 1 / (float)set->count : 0)); }

DacSet dac_triangles(const KellerAccel *a, SahRef *refs)
{
    DacSet set = {.refs = refs, .box = f8_set1(-INFINITY), .middle = f4_set1(0)};
    for (uint32_t i = 0; i < a->input.triangle_count; i++) put(&set, a->triangles[i / 8].corner, 3, (int)(i % 8), i);
    average(&set);
    return set;
}

DacSet dac_edges(const KellerAccel *a, SahRef *refs)
{
    DacSet set = {.refs = refs, .box = f8_set1(-INFINITY), .middle = f4_set1(0)};
    for (uint32_t b = 0; b < a->edge_begin[a->leaf_count]; b++)
        for (int lane = 0; lane < 8; lane++)
            if (a->edges[b].id[lane] != KELLER_NONE) put(&set, a->edges[b].corner, 2, lane, 8 * b + (uint32_t)lane);
    average(&set);
    return set;
}

AccelBox dac_box(const DacSet *set)
{
    _Alignas(32) float s[8];
    f8_store(s, set->box);
    return (AccelBox){{-s[0], -s[1], -s[2]}, {s[4], s[5], s[6]}};
}

/* The sides of a set, found as its elements go where they belong. */
typedef struct {
    f8 box[2];
    f4 sum[2];
} Sides;

static inline void take(Sides *s, int side, f8 bounds)
{
    s->box[side] = f8_max(bounds, s->box[side]);
    s->sum[side] = f4_add(s->sum[side], middle_of(bounds));
}

static DacSet side_of(const DacSet *set, const Sides *s, int side, uint32_t first, uint32_t count)
{
    return (DacSet){set->refs + first, count, s->box[side], f4_mul(s->sum[side], f4_set1(1 / (float)count)), set->depth + 1};
}

/* Brings to the front what has its middle, twice, before `plane`; returns how many. */
static uint32_t bring(const DacSet *set, int axis, float plane)
{
    SahRef *refs = set->refs;
    uint32_t k = 0;
    for (uint32_t i = 0; i < set->count; i++) { /* without a branch: it would be guessed wrong every other time */
        f8 here = sah_bounds(&refs[i]), other = sah_bounds(&refs[k]);
        bool in = refs[i].upper[axis] - refs[i].negative[axis] < plane;
        f8_store((float *)&refs[i], other);
        f8_store((float *)&refs[k], here);
        k += in;
    }
    return k;
}

/* The plane of least cost by the surface-area heuristic, in the doubled coordinates of the middles; INFINITY: none. */
static float least_cost(const DacSet *set, int *axis)
{
    enum { BINS = 16 };
    SahBins bins;
    SahSplit best = {.cost = INFINITY};
    f4 low = f4_mul(f4_low(set->box), f4_set1(-2)), high = f4_mul(f4_high(set->box), f4_set1(2));
    SahGrid grid = sah_grid(low, high, BINS);
    SahMeasure measure = sah_measure(set->box, 0);
    sah_bins_clear(&bins, BINS);
    for (uint32_t i = 0; i < set->count; i++) {
        f8 bounds = sah_bounds(&set->refs[i]);
        int32_t place[4];
        i4_store(place, f4_to_i4(sah_place(&grid, sah_center(bounds))));
        for (int k = 0; k < 3; k++) {
            bins.enter[place[k]][k]++;
            bins.box[place[k]][k] = f8_max(bounds, bins.box[place[k]][k]);
        }
    }
    sah_choose(&bins, (const int32_t (*)[4])bins.enter, BINS, &measure, sah_chance1(&measure, set->box), 8, (int32_t)set->count, 0,
               &best);
    if (!(best.cost < INFINITY)) return INFINITY;
    float from[4], to[4];
    f4_store(from, low);
    f4_store(to, high);
    *axis = best.axis;
    return from[best.axis] + (to[best.axis] - from[best.axis]) * ((float)best.bin / BINS);
}

int dac_part(const DacSet *set, size_t askers, DacSet *low, DacSet *high)
{
    float extent[4], middle[4];
    f4_store(extent, f4_add(f4_low(set->box), f4_high(set->box)));
    f4_store(middle, set->middle);
    int axis = extent[0] >= extent[1] && extent[0] >= extent[2] ? 0 : extent[1] >= extent[2] ? 1 : 2;
    Sides s = {{f8_set1(-INFINITY), f8_set1(-INFINITY)}, {f4_set1(0), f4_set1(0)}};
    uint32_t k = 0, n = set->count;
    float plane = middle[axis];
    if (askers > DAC_CARE * (size_t)n) {
        float best = least_cost(set, &axis);
        plane = best < INFINITY ? best : plane;
    }
    if (set->depth < DAC_HALVE) k = bring(set, axis, plane);
    if (k == 0 || k == n) k = n / 2;
    for (uint32_t i = 0; i < n; i++) take(&s, i >= k, sah_bounds(&set->refs[i]));
    *low = side_of(set, &s, 0, 0, k);
    *high = side_of(set, &s, 1, k, n - k);
    return axis;
}

void dac_triangle_block(const KellerAccel *a, const DacSet *set, uint32_t first, TriangleBlock *block)
{
    for (uint32_t lane = 0; lane < 8; lane++) {
        uint32_t i = first + lane < set->count ? first + lane : set->count - 1, id = set->refs[i].id;
        const TriangleBlock *from = &a->triangles[id / 8];
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++) block->corner[j].p[k][lane] = from->corner[j].p[k][id % 8];
        block->id[lane] = first + lane < set->count ? id : KELLER_NONE;
    }
}

void dac_edge_block(const KellerAccel *a, const DacSet *set, uint32_t first, EdgeBlock *block)
{
    for (uint32_t lane = 0; lane < 8; lane++) {
        uint32_t i = first + lane < set->count ? first + lane : set->count - 1, at = set->refs[i].id;
        const EdgeBlock *from = &a->edges[at / 8];
        for (int j = 0; j < 2; j++)
            for (int k = 0; k < 3; k++) block->corner[j].p[k][lane] = from->corner[j].p[k][at % 8];
        block->id[lane] = first + lane < set->count ? from->id[at % 8] : KELLER_NONE;
    }
}
