/* Masks by number: 256 of them stand for all. */
#include <stdlib.h>
#include <string.h>

#include "accel/mask.h"

typedef struct {
    Mask mask;
    double importance;
} Weighed;

static int by_mask(const void *a, const void *b) { return memcmp(&((const Weighed *)a)->mask, &((const Weighed *)b)->mask, sizeof(Mask)); }

static int by_importance(const void *a, const void *b)
{
    const Weighed *p = a, *q = b;
    if (p->importance != q->importance) return p->importance > q->importance ? -1 : 1;
    return by_mask(a, b);
}

/* Bits 8 i to 8 i + 7, all slices in a row. */
static unsigned byte_of(int R, const Mask *m, int i)
{
    unsigned byte = 0;
    for (int j = 0; j < 8 && 8 * i + j < R * R * R; j++) {
        int bit = 8 * i + j;
        byte |= (unsigned)(m->slice[bit / (R * R)] >> (bit % (R * R)) & 1) << j;
    }
    return byte;
}

static int byte_count(int R) { return (R * R * R + 7) / 8; }

static void fill_requirements(MaskPalette *p)
{
    for (int i = 0; i < byte_count(p->R); i++)
        for (unsigned value = 0; value < 256; value++) {
            memset(p->holds[i][value], 0, sizeof p->holds[i][value]);
            for (int k = 0; k < p->count; k++)
                if ((byte_of(p->R, &p->mask[k], i) & value) == value) p->holds[i][value][k / 64] |= 1ull << (k % 64);
        }
}

KellerStatus mask_palette(int R, size_t count, const Mask *masks, const float *areas, MaskPalette *p, KellerError *error)
{
    size_t bytes = (size_t)byte_count(R) * sizeof *p->holds, different = 0;
    Weighed *all = malloc((count + 1) * sizeof *all);
    *p = (MaskPalette){.R = R, .holds = malloc(bytes)};
    if (!all || !p->holds) {
        free(all);
        mask_palette_free(p);
        return keller_error_memory(error, bytes + count * sizeof *all);
    }
    for (size_t i = 0; i < count; i++)
        all[i] = (Weighed){masks[i], (double)areas[i] * mask_bits(R, &masks[i]) / (R * R * R)};
    qsort(all, count, sizeof *all, by_mask);
    for (size_t i = 0; i < count; i++) {
        if (different > 0 && by_mask(&all[i], &all[different - 1]) == 0) all[different - 1].importance += all[i].importance;
        else all[different++] = all[i];
    }
    qsort(all, different, sizeof *all, by_importance);
    Mask full = mask_full(R);
    for (size_t i = 0; i < different && p->count < MASK_PALETTE - 1; i++)
        if (mask_bits(R, &all[i].mask) < R * R * R) p->mask[p->count++] = all[i].mask;
    p->mask[p->count++] = full; /* holds any other */
    for (int i = 1; i < p->count; i++) {
        Mask m = p->mask[i];
        int j = i, bits = mask_bits(R, &m);
        for (; j > 0 && mask_bits(R, &p->mask[j - 1]) > bits; j--) p->mask[j] = p->mask[j - 1];
        p->mask[j] = m;
    }
    fill_requirements(p);
    free(all);
    return KELLER_OK;
}

void mask_palette_free(MaskPalette *p)
{
    free(p->holds);
    p->holds = NULL;
}

uint8_t mask_find(const MaskPalette *p, const Mask *mask)
{
    uint64_t left[MASK_PALETTE / 64];
    memset(left, 0xff, sizeof left);
    for (int i = 0; i < byte_count(p->R); i++) {
        const uint64_t *holds = p->holds[i][byte_of(p->R, mask, i)];
        for (int k = 0; k < MASK_PALETTE / 64; k++) left[k] &= holds[k];
    }
    int k = 0;
    while (left[k] == 0) k++; /* the full one is always left */
    return (uint8_t)(64 * k + __builtin_ctzll(left[k]));
}
