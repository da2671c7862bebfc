/* The test of masks of 4 x 4 x 4 cells, to be inlined into walks. */
#ifndef KELLER_ACCEL_MASKED_H
#define KELLER_ACCEL_MASKED_H
#include "accel/mask.h"
#include "base/simd.h"

/* What mask_frustum made, an axis a row: the order of the cells along it, 0 to 3 or 3 to 0, and what follows them. */
typedef struct {
    MaskFrustum f;
    f4 in_cell[3], out_cell[3];
} MaskWalk;

static inline MaskWalk mask_walk(const KellerConeLanes *lanes)
{
    MaskWalk w = {.f = mask_frustum(lanes)};
    for (int k = 0; k < 3; k++) {
        f4 low = f4_set(0, 1, 2, 3), high = f4_set(1, 2, 3, 4);
        w.in_cell[k] = w.f.down[k] ? high : low;
        w.out_cell[k] = w.f.down[k] ? low : high;
    }
    return w;
}

/* Four times four pairs: where interval x of u has a point in common with interval y of v, bit x + 4 y. */
static inline uint32_t mask_pairs(f4 u_from, f4 u_to, f4 v_from, f4 v_to)
{
    f8 from = f8_twice(u_from), to = f8_twice(u_to), in, out;
    in = f8_max(from, f8_four_each(v_from, 0));
    out = f8_min(to, f8_four_each(v_to, 0));
    uint32_t pairs = (uint32_t)f8_mask(f8_le(in, out));
    in = f8_max(from, f8_four_each(v_from, 2));
    out = f8_min(to, f8_four_each(v_to, 2));
    return pairs | (uint32_t)f8_mask(f8_le(in, out)) << 8;
}

/* The passage of mask_passage, packed. */
static inline uint64_t mask_passage4(const MaskWalk *w, const float lower[3], const float upper[3], float far, uint64_t object)
{
    const MaskFrustum *f = &w->f;
    f4 from[3], to[3];
    for (int k = 0; k < 3; k++) {
        float step = (upper[k] - lower[k]) * 0.25f;
        f4 base = f4_set1(lower[k]), steps = f4_set1(step);
        f4 first = f4_add(base, f4_mul(w->in_cell[k], steps)), last = f4_add(base, f4_mul(w->out_cell[k], steps));
        f4 in = f4_sub(f4_mul(f4_sub(first, f4_set1(f->enter[k])), f4_set1(f->enter_rate[k])), f4_set1(f->in_pad[k]));
        f4 out = f4_mul(f4_sub(last, f4_set1(f->leave[k])), f4_set1(f->leave_rate[k])), pad = f4_set1(f->out_pad[k]);
        if (f->opens[k]) {
            from[k] = f4_max(in, f4_max(f4_sub(out, pad), f4_set1(f->near)));
            to[k] = f4_set1(far);
        } else {
            from[k] = f4_max(in, f4_set1(f->near));
            to[k] = f4_min(f4_add(out, pad), f4_set1(far));
        }
    }
    const uint64_t every_z = 0x0001000100010001, every_y = 0x1111, every_x = 0xf;
    uint64_t left = object & mask_pairs(from[0], to[0], from[1], to[1]) * every_z;
    if (left == 0) return 0;
    uint64_t xz = mask_pairs(from[0], to[0], from[2], to[2]), yz = mask_pairs(from[1], to[1], from[2], to[2]);
    xz = (xz & 0xf) | (xz & 0xf0) << 12 | (xz & 0xf00) << 24 | (xz & 0xf000) << 36;
    yz = (yz | yz << 24) & 0x000000ff000000ff;
    yz = (yz | yz << 12) & 0x000f000f000f000f;
    yz = (yz | yz << 6) & 0x0303030303030303;
    yz = (yz | yz << 3) & 0x1111111111111111;
    return left & xz * every_y & yz * every_x;
}

/* The bits of `hit` whose child may hold something that the frustum meets before `far`; `leaves` are blocks; the box as for
 * masks_cull_any. */
static inline __attribute__((always_inline)) uint32_t masks_cull(const MaskSet *set, const MaskWalk *w, const float *box, int stride,
                                                                 int above, uint32_t node, uint32_t hit, uint32_t leaves,
                                                                 float far)
{
    uint32_t left = hit;
    if (set->leaves_only) hit &= leaves;
    if (hit == 0) return left;
    if (!set->simple) return (left & ~hit) | masks_cull_any(set, &w->f, box, stride, above, node, hit, far);
    const uint64_t *words = &set->words[(size_t)node * (size_t)set->children];
    for (; hit; hit &= hit - 1) {
        int i = __builtin_ctz(hit);
        float lower[3], upper[3];
        for (int k = 0; k < 3; k++) {
            lower[k] = box[stride * k + i];
            upper[k] = box[stride * k + above + i];
        }
        if (mask_passage4(w, lower, upper, far, words[i]) == 0) left &= ~(1u << i);
    }
    return left;
}
#endif
