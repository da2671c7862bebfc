/* The masks of a tree: made from its primitives and children, and asked where the test is not the inlined one (masked.h). */
#include <stdlib.h>
#include <string.h>

#include "accel/mask.h"

typedef struct {
    const MaskTree *tree;
    const Leaves *leaves;
    const TreeInput *in;
    int R, levels;
    Mask *masks;                    /* [node_count * children] */
} Maker;

static Mask *mask_at(const Maker *m, uint32_t node, int i) { return &m->masks[(size_t)node * (size_t)m->tree->children + (size_t)i]; }

static void add_leaf(const Maker *m, const AccelBox *box, uint32_t leaf, Mask *mask)
{
    for (uint32_t i = m->leaves->begin[leaf]; i < m->leaves->begin[leaf + 1]; i++) {
        KellerVec3 corners[3];
        int count = m->in->corners(m->in->clip_context, m->leaves->refs[i], corners);
        mask_add(m->R, box, corners, count, mask);
    }
}

/* What is in a node's children: by their own masks where they are `levels` below, by primitives where these are less far. */
static void add_below(const Maker *m, const AccelBox *box, uint32_t node, int levels, Mask *mask)
{
    for (int i = 0; i < m->tree->children; i++) {
        TreeChild child;
        AccelBox of;
        if (!m->tree->child(m->tree->tree, node, i, &child, &of)) continue;
        if (levels == 1) mask_add_child(m->R, box, &of, mask_at(m, node, i), mask);
        else if (child.child & TREE_LEAF) add_leaf(m, box, child.child & ~TREE_LEAF, mask);
        else add_below(m, box, child.child, levels - 1, mask);
    }
}

static void make_all(Maker *m)
{
    for (uint32_t node = m->tree->node_count; node-- > 0;) /* children first */
        for (int i = 0; i < m->tree->children; i++) {
            TreeChild child;
            AccelBox box;
            *mask_at(m, node, i) = (Mask){{0}};
            if (!m->tree->child(m->tree->tree, node, i, &child, &box)) continue;
            if (child.child & TREE_LEAF) add_leaf(m, &box, child.child & ~TREE_LEAF, mask_at(m, node, i));
            else if (m->levels > 0) add_below(m, &box, child.child, m->levels, mask_at(m, node, i));
        }
}

/* Words as masked.h reads them. */
static void pack(int R, const Mask *mask, uint64_t *words)
{
    if (R == 4) *words = mask->slice[0] | mask->slice[1] << 16 | mask->slice[2] << 32 | mask->slice[3] << 48;
    else memcpy(words, mask->slice, sizeof mask->slice);
}

static Mask unpack(int R, const uint64_t *words)
{
    Mask m = {{0}};
    if (R != 4) memcpy(m.slice, words, sizeof m.slice);
    for (int z = 0; z < 4 && R == 4; z++) m.slice[z] = *words >> (16 * z) & 0xffff;
    return m;
}

static size_t words_of(int R) { return R == 4 ? 1 : MASK_MOST; }

static KellerStatus compress(const Maker *m, MaskSet *set, KellerError *error)
{
    float *areas = malloc((set->count + 1) * sizeof *areas);
    set->index = malloc(set->count + 1);
    if (!areas || !set->index) {
        free(areas);
        return keller_error_memory(error, set->count * (sizeof *areas + 1));
    }
    for (size_t k = 0; k < set->count; k++) {
        TreeChild child;
        AccelBox b = {{0}, {0}};
        m->tree->child(m->tree->tree, (uint32_t)(k / (size_t)set->children), (int)(k % (size_t)set->children), &child, &b);
        float x = b.upper[0] - b.lower[0], y = b.upper[1] - b.lower[1], z = b.upper[2] - b.lower[2];
        areas[k] = x * y + y * z + z * x;
    }
    KellerStatus status = mask_palette(set->R, set->count, m->masks, areas, &set->palette, error);
    for (size_t k = 0; k < set->count && status == KELLER_OK; k++) set->index[k] = mask_find(&set->palette, &m->masks[k]);
    free(areas);
    return status;
}

static KellerStatus keep(const Maker *m, MaskSet *set, KellerError *error)
{
    size_t bytes = set->count * words_of(set->R) * sizeof *set->words;
    set->words = malloc(bytes + sizeof *set->words);
    if (!set->words) return keller_error_memory(error, bytes);
    for (size_t k = 0; k < set->count; k++) pack(set->R, &m->masks[k], &set->words[k * words_of(set->R)]);
    return KELLER_OK;
}

KellerStatus masks_make(const MaskTree *tree, const Leaves *leaves, const TreeInput *in, MaskSet **made, KellerError *error)
{
    const KellerMaskOptions *o = &in->masks;
    int R = o->resolution ? o->resolution : 4;
    *made = NULL;
    if (R != 4 && R != MASK_MOST)
        return keller_error(error, KELLER_BAD_INPUT, "masks of %d cells along an axis are not known; expected 4 or 6", R);
    size_t count = (size_t)tree->node_count * (size_t)tree->children;
    Maker m = {tree, leaves, in, R, o->levels < 0 ? SAH_DEPTH + 33 : o->levels,
               malloc((count + 1) * sizeof *m.masks)};
    MaskSet *set = calloc(1, sizeof *set);
    if (!m.masks || !set) {
        free(m.masks);
        free(set);
        return keller_error_memory(error, count * sizeof *m.masks);
    }
    *set = (MaskSet){.R = R, .children = tree->children, .count = count, .simple = R == 4 && !o->compressed && !o->table,
                     .leaves_only = o->levels == 0};
    make_all(&m);
    KellerStatus status = o->table ? mask_table(R, &set->table, error) : KELLER_OK;
    if (status == KELLER_OK) status = o->compressed ? compress(&m, set, error) : keep(&m, set, error);
    free(m.masks);
    if (status == KELLER_OK) *made = set;
    else masks_free(set);
    return status;
}

void masks_free(MaskSet *set)
{
    if (!set) return;
    mask_table_free(&set->table);
    mask_palette_free(&set->palette);
    free(set->words);
    free(set->index);
    free(set);
}

size_t masks_bytes(const MaskSet *set)
{
    if (!set) return 0;
    size_t R = (size_t)set->R, ends = (2 * R + 3) * (2 * R + 3), bytes = sizeof *set;
    bytes += set->index ? set->count + (R * R * R + 7) / 8 * sizeof *set->palette.holds : set->count * words_of(set->R) * 8;
    return bytes + (set->table.R ? ends * ends * sizeof *set->table.plane : 0);
}

uint32_t masks_cull_any(const MaskSet *set, const MaskFrustum *f, const float *box, int stride, int above, uint32_t node,
                        uint32_t hit, float far)
{
    uint32_t left = hit;
    for (; hit; hit &= hit - 1) {
        int i = __builtin_ctz(hit);
        AccelBox b;
        for (int k = 0; k < 3; k++) {
            b.lower[k] = box[stride * k + i];
            b.upper[k] = box[stride * k + above + i];
        }
        size_t at = (size_t)node * (size_t)set->children + (size_t)i;
        Mask passage = set->table.R && f->ray ? mask_lookup(&set->table, &b, f, far) : mask_passage(set->R, &b, f, far);
        Mask object = set->index ? set->palette.mask[set->index[at]] : unpack(set->R, &set->words[at * words_of(set->R)]);
        if (!mask_meets(set->R, &passage, &object)) left &= ~(1u << i);
    }
    return left;
}
