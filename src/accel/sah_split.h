/* Inside the SAH builder: references, bins, and the choice among the planes between bins. See sah.h.
 *
 * A box is kept as eight floats, (-lower, id, upper, side), so that one maximum joins two boxes. Zeros are all +0: then a
 * maximum does not depend on the order of its arguments, and neither does anything here. */
#ifndef KELLER_ACCEL_SAH_SPLIT_H
#define KELLER_ACCEL_SAH_SPLIT_H
#include "accel/sah.h"
#include "base/simd.h"

enum {
    SAH_BINS = 32,
    SAH_PARTS = 16 /* tasks of one pass over a large node, at most */
};

typedef struct {
    _Alignas(32) float negative[3]; /* -lower; an empty box has -INFINITY in all six */
    uint32_t id;
    float upper[3];
    uint32_t side;                  /* of a spatial split: 1 goes right */
} SahRef;

static inline f8 sah_bounds(const SahRef *ref) { return f8_load((const float *)ref); }

/* Three grids of bins at once, one an axis: where x lies is a number from 0 to `last`, whose whole part is its bin. */
typedef struct {
    f4 low, scale, last;
} SahGrid;

SahGrid sah_grid(f4 low, f4 high, int bins);

/* NaN goes to bin 0. */
static inline f4 sah_place(const SahGrid *g, f4 x)
{
    return f4_min(f4_max(f4_mul(f4_sub(x, g->low), g->scale), f4_set1(0)), g->last);
}

/* Lanes 0 to 2, and zero. */
static inline f4 sah_xyz(f4 a) { return f4_and(a, i4_as_f4(simde_mm_set_epi32(0, -1, -1, -1))); }

/* Where a part of a pass over n references begins. */
static inline uint32_t sah_part(uint32_t n, uint32_t part, uint32_t parts)
{
    return (uint32_t)((uint64_t)n * part / parts);
}

/* Twice the centre of a box, within +-2^126. An empty box and one that is infinite both ways have 2^126: one split parts
 * them from the rest. */
static inline f4 sah_center(f8 bounds)
{
    f4 c = f4_sub(f4_high(bounds), f4_low(bounds));
    return sah_xyz(f4_max(f4_min(c, f4_set1(0x1p126f)), f4_set1(-0x1p126f)));
}

typedef struct {
    f8 box[SAH_BINS][3];          /* of what lies in bin i along axis k */
    int32_t enter[SAH_BINS][4];   /* lane k: references whose first bin along axis k this is */
    int32_t leave[SAH_BINS][4];   /* whose last bin this is; without spatial splits the same, and not kept */
} SahBins;

void sah_bins_clear(SahBins *bins, int number);
void sah_bins_add(SahBins *to, const SahBins *from, int number);

/* The chance to meet a box, for boxes in one node, in a unit in which sizes in the node are at most 1. */
typedef struct {
    f4 unit, line, point;
} SahMeasure;

SahMeasure sah_measure(f8 node, float breadth);
/* Lane k: of box[k]. */
static inline f4 sah_chance(const SahMeasure *m, const f8 box[3])
{
    f4 side[3], s[3];
    for (int k = 0; k < 3; k++) { /* the larger bound second: it stands in for NaN; an empty box has -INFINITY */
        f4 d = f4_min(f4_add(f4_low(box[k]), f4_high(box[k])), f4_set1(0x1p126f));
        side[k] = f4_mul(f4_max(d, f4_set1(0)), m->unit);
    }
    f4_columns(side[0], side[1], side[2], s);
    f4 area = f4_add(f4_mul(s[0], f4_add(s[1], s[2])), f4_mul(s[1], s[2]));
    return f4_add(area, f4_add(f4_mul(f4_add(s[0], f4_add(s[1], s[2])), m->line), m->point));
}
float sah_chance1(const SahMeasure *m, f8 box);

/* What a split is worth: the chance of each child times its blocks, as a share of the node's chance. Left is what lies in
 * the bins before `bin`. */
typedef struct {
    float cost;                   /* INFINITY: there is none */
    int axis, bin;
    SahGrid grid;
    bool spatial;
    float plane;                  /* of a spatial split */
    f8 left, right;               /* the children's boxes, as the bins know them */
    int32_t left_count, right_count;
} SahSplit;

/* The best plane: each side gets a reference, and at most `room` references are on both sides. Of splits that cost nearly
 * the same it takes the more even one. The caller sets grid, spatial, plane. */
void sah_choose(const SahBins *bins, const int32_t (*leave)[4], int number, const SahMeasure *measure, float node_chance,
                uint32_t block, int32_t count, int32_t room, SahSplit *best);

/* What the builder hands to the spatial splits. */
typedef struct {
    SahClip clip;
    void *context;
    SahRef *refs;
    int32_t count, room;          /* refs[count .. count + room) are free */
    f8 box;
    uint32_t block;
    float breadth;
    uint32_t parts;               /* tasks for one pass; changes no result */
} SahSpatial;

/* The best spatial split of the node; none if its box is infinite or there is no room. */
void sah_spatial_choose(const SahSpatial *node, SahSplit *best);
/* Splits the references, appends what is new, sets `side` of all; returns their number. */
int32_t sah_spatial_apply(const SahSpatial *node, const SahSplit *split);
#endif
