/* Subspace culling (Yoshimura and Harada 2023): what lies in a box, and where a frustum passes through it, as R x R x R cells,
 * a bit each; where no bit is common the frustum meets nothing in the box. All of it errs on the side of more bits.
 *
 * Cell (x, y, z) is bit x + R y of slice z. A box is cut into R equal parts along each axis; along an axis without extent all is
 * in every cell. */
#ifndef KELLER_ACCEL_MASK_H
#define KELLER_ACCEL_MASK_H
#include "accel/internal.h"

enum { MASK_MOST = 6, MASK_PALETTE = 256 };

typedef struct {
    uint64_t slice[MASK_MOST];      /* R of them in use */
} Mask;

bool mask_meets(int R, const Mask *a, const Mask *b);
int mask_bits(int R, const Mask *m);
Mask mask_full(int R);

/* Adds the cells that a triangle (3 corners) or segment (2) meets, degenerate or not: those that it comes as near to as 1e-5 of
 * a cell, and as the rounding of coordinates relative to the cells' size. */
void mask_add(int R, const AccelBox *box, const KellerVec3 *corners, int count, Mask *mask);
/* Adds to a box's mask what one of a box inside it holds (algorithm 2). */
void mask_add_child(int R, const AccelBox *box, const AccelBox *child, const Mask *of, Mask *mask);

/* ---- passages ---------------------------------------------------------------------------------------------------- */

/* A frustum ready to be followed through boxes: along axis k the cells are entered in the order in which it passes them. */
typedef struct {
    float enter[3], leave[3], enter_rate[3], leave_rate[3];
    float in_pad[3], out_pad[3];    /* of z: what the planes between cells are off by at most */
    float near, pad;                /* pad: of a coordinate */
    bool down[3], opens[3];         /* runs down the axis; opens wider than it leans, so leaving bounds from below too */
    bool ray;
} MaskFrustum;

MaskFrustum mask_frustum(const KellerConeLanes *lanes);

/* The cells that the frustum passes before `far`: those whose slabs it meets, exactly but for rounding ("grid walk"). The test of
 * a cell is that of a box: an interval of z an axis, and three intervals have a point in common if each two have. */
Mask mask_passage(int R, const AccelBox *box, const MaskFrustum *f, float far);

/* Passages of rays by table (algorithm 1): the cells around the ends of a ray's way through a box determine those that it may
 * pass. A table of the plane's cells serves all three pairs of axes, as a sweep of boxes is the intersection of its three
 * shadows. An end is known to a cell or, near a border, two; there is one cell more at either side, for ends that rounding puts
 * outside. */
enum { MASK_ENDS = 2 * MASK_MOST + 3 };
typedef struct {
    int R;
    uint64_t *plane;                /* [from][to], each x + (2 R + 3) y, x the sum of the first and last cell's numbers, from 0 */
} MaskTable;

KellerStatus mask_table(int R, MaskTable *table, KellerError *error);
void mask_table_free(MaskTable *table);
/* As mask_passage, of a ray, a superset of it; full where the box is too small to tell its cells apart. */
Mask mask_lookup(const MaskTable *table, const AccelBox *box, const MaskFrustum *ray, float far);

/* ---- compression: mask_palette.c ---------------------------------------------------------------------------------- */

/* Up to 256 masks, the fewest bits first and the full one last, and for every byte of a mask and each of its values which of them have
 * all its bits ("requirement tables"). */
typedef struct {
    int R, count;
    Mask mask[MASK_PALETTE];
    uint64_t (*holds)[256][MASK_PALETTE / 64]; /* [ceil(R^3 / 8)] */
} MaskPalette;

/* Chooses the masks of the greatest importance, that is area times the share of bits set (equation 2), all equal ones together. */
KellerStatus mask_palette(int R, size_t count, const Mask *masks, const float *areas, MaskPalette *palette, KellerError *error);
void mask_palette_free(MaskPalette *palette);
/* The number of the one with fewest bits that has all of the mask's (algorithm 3). */
uint8_t mask_find(const MaskPalette *palette, const Mask *mask);

/* ---- masks of a tree: masks.c ------------------------------------------------------------------------------------- */

/* A mask for each child of each node. In `words`: R = 4, a word each, slice z in bits 16 z and up; R = 6, six words. Or, compressed,
 * numbers of the palette's. */
typedef struct {
    int R, children;
    bool simple;                    /* R = 4, not compressed, and passages exact */
    bool leaves_only;               /* children that are nodes have no mask, and are not asked */
    uint64_t *words;
    uint8_t *index;
    MaskPalette palette;
    MaskTable table;                /* R = 0: passages are exact */
    size_t count;
} MaskSet;

/* What masks are made from: any tree of boxes whose children have greater numbers than their parents. */
typedef struct {
    const void *tree;
    uint32_t node_count;
    int children;
    /* False: no such child. */
    bool (*child)(const void *tree, uint32_t node, int i, TreeChild *child, AccelBox *box);
} MaskTree;

KellerStatus masks_make(const MaskTree *tree, const Leaves *leaves, const TreeInput *in, MaskSet **set, KellerError *error);
void masks_free(MaskSet *set);
size_t masks_bytes(const MaskSet *set);
/* The bits of `hit` whose child the frustum may meet something in; lane i's box has sides box[stride k + i] and, `above` further,
 * its upper ones. For sets that are not simple. */
uint32_t masks_cull_any(const MaskSet *set, const MaskFrustum *f, const float *box, int stride, int above, uint32_t node,
                        uint32_t hit, float far);
#endif
