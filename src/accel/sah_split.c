/* Bins, the chance to meet a box, and the choice among the planes between bins. */
#include "accel/sah_split.h"

#include <math.h>

/* A box is met at least as often as if it were grown by this share of the node's longest side: in a node without area,
 * such as segments on one line, lengths still count, and no chance is zero. */
static const float LEAST_BREADTH = 0x1p-12f;
/* A split's cost grows by up to this share where it is uneven: among equals (n boxes that all fill the node) the tree is
 * balanced and not a comb. */
static const float UNEVEN = 0x1p-12f;

SahGrid sah_grid(f4 low, f4 high, int bins)
{
    float range[4], scale[4] = {0};
    f4_store(range, f4_sub(high, low));
    for (int k = 0; k < 3; k++)
        if (range[k] > 0) scale[k] = (float)bins / range[k];
    return (SahGrid){sah_xyz(low), f4_load(scale), f4_set1((float)(bins - 1))};
}

void sah_bins_clear(SahBins *bins, int number)
{
    for (int i = 0; i < number; i++) {
        for (int k = 0; k < 3; k++) bins->box[i][k] = f8_set1(-INFINITY);
        i4_store(bins->enter[i], i4_set1(0));
        i4_store(bins->leave[i], i4_set1(0));
    }
}

void sah_bins_add(SahBins *to, const SahBins *from, int number)
{
    for (int i = 0; i < number; i++) {
        for (int k = 0; k < 3; k++) to->box[i][k] = f8_max(to->box[i][k], from->box[i][k]);
        i4_store(to->enter[i], i4_add(i4_load(to->enter[i]), i4_load(from->enter[i])));
        i4_store(to->leave[i], i4_add(i4_load(to->leave[i]), i4_load(from->leave[i])));
    }
}

SahMeasure sah_measure(f8 node, float breadth)
{
    float side[4], most = 0;
    f4_store(side, f4_min(f4_add(f4_low(node), f4_high(node)), f4_set1(0x1p126f)));
    for (int k = 0; k < 3; k++) most = side[k] > most ? side[k] : most;
    float unit = most > 0x1p-126f ? 1 / most : 0, r = breadth * unit;
    r = r > LEAST_BREADTH ? r : LEAST_BREADTH;
    r = r < 0x1p20f ? r : 0x1p20f;
    const float pi = 3.14159265f;
    return (SahMeasure){f4_set1(unit), f4_set1(pi * r), f4_set1(2 * pi * r * r)};
}

float sah_chance1(const SahMeasure *m, f8 box)
{
    float chance[4];
    f4_store(chance, sah_chance(m, (f8[]){box, box, box}));
    return chance[0];
}

/* ceil(n / block), and 0 of 0. Exact below 2^22, where it matters. */
static inline f4 blocks(i4 n, f4 per_block)
{
    return f4_add(f4_floor(f4_mul(f4_sub(i4_to_f4(n), f4_set1(0.5f)), per_block)), f4_set1(1));
}

static void join_sides(const SahBins *bins, const int32_t (*leave)[4], int number, SahSplit *s)
{
    s->left = s->right = f8_set1(-INFINITY);
    s->left_count = s->right_count = 0;
    for (int j = 0; j < number; j++) {
        f8 *side = j < s->bin ? &s->left : &s->right;
        *side = f8_max(bins->box[j][s->axis], *side);
        if (j < s->bin) s->left_count += bins->enter[j][s->axis];
        else s->right_count += leave[j][s->axis];
    }
}

void sah_choose(const SahBins *bins, const int32_t (*leave)[4], int number, const SahMeasure *measure, float node_chance,
                uint32_t block, int32_t count, int32_t room, SahSplit *best)
{
    f4 right_cost[SAH_BINS], per_block = f4_set1(1 / (float)block);
    i4 right_count[SAH_BINS], sum = i4_set1(0), zero = i4_set1(0), most = i4_set1(room + 1), all = i4_set1(count);
    f8 side[3] = {f8_set1(-INFINITY), f8_set1(-INFINITY), f8_set1(-INFINITY)};
    for (int j = number - 1; j > 0; j--) {
        for (int k = 0; k < 3; k++) side[k] = f8_max(bins->box[j][k], side[k]);
        sum = i4_add(sum, i4_load(leave[j]));
        right_count[j] = sum;
        right_cost[j] = f4_mul(sah_chance(measure, side), blocks(sum, per_block));
    }
    f4 least = f4_set1(INFINITY), where = f4_set1(0), share = f4_set1(1 / (float)count);
    for (int k = 0; k < 3; k++) side[k] = f8_set1(-INFINITY);
    sum = zero;
    for (int j = 1; j < number; j++) {
        for (int k = 0; k < 3; k++) side[k] = f8_max(bins->box[j - 1][k], side[k]);
        sum = i4_add(sum, i4_load(bins->enter[j - 1]));
        f4 cost = f4_add(f4_mul(sah_chance(measure, side), blocks(sum, per_block)), right_cost[j]);
        f4 uneven = f4_mul(i4_to_f4(i4_sub(sum, right_count[j])), share);
        cost = f4_mul(cost, f4_add(f4_set1(1), f4_mul(f4_mul(uneven, uneven), f4_set1(UNEVEN))));
        i4 both = i4_sub(i4_add(sum, right_count[j]), all);
        i4 valid = i4_and(i4_and(i4_gt(sum, zero), i4_gt(right_count[j], zero)), i4_gt(most, both));
        f4 better = f4_and(i4_as_f4(valid), f4_lt(cost, least));
        least = f4_blend(better, cost, least);
        where = f4_blend(better, f4_set1((float)j), where);
    }
    float cost[4], bin[4];
    f4_store(cost, least);
    f4_store(bin, where);
    best->cost = INFINITY;
    for (int k = 0; k < 3; k++) {
        if (!(cost[k] < best->cost)) continue;
        best->cost = cost[k];
        best->axis = k;
        best->bin = (int)bin[k];
    }
    if (!(best->cost < INFINITY)) return;
    best->cost /= node_chance;
    join_sides(bins, leave, number, best);
}
