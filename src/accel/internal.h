/* What the structures and the queries of an accelerator share.
 *
 * A structure is a tree over boxes whose leaves are blocks of up to eight primitives. It knows nothing of triangles: its one
 * way to be walked hands out the blocks that a frustum may meet, rays being frusta of no width. The queries (query_*.c) do the
 * rest, the same for all structures. All of it in single precision, relative to the middle of the scene. */
#ifndef KELLER_ACCEL_INTERNAL_H
#define KELLER_ACCEL_INTERNAL_H
#include "accel/sah.h"
#include "keller/accel.h"

/* Up to eight triangles or edges, corner j of lane i at corner[j].p[.][i]; unused lanes repeat the last used one, or hold
 * NaN where none is. 32-byte aligned. */
typedef struct {
    KellerVertex8 corner[3];
    uint32_t id[8];                 /* KELLER_NONE in unused lanes */
} TriangleBlock;
typedef struct {
    KellerVertex8 corner[2];
    uint32_t id[8];
} EdgeBlock;

/* A block is some cache lines, wanted soon. */
static inline void fetch_block(const TriangleBlock *block)
{
    for (size_t i = 0; i < sizeof *block; i += 64) __builtin_prefetch((const char *)block + i);
}

/* Which primitives make up the blocks, block after block, as the structure wants its leaves. */
typedef struct {
    uint32_t block_count;
    uint32_t *begin;                /* [block_count + 1] into refs; 1 to 8 a block */
    uint32_t *refs;                 /* a primitive may be in several blocks (kdtree, spatial splits) */
} Leaves;

/* Called for a block. `inside`: the frustum surely contains the block's box, and so its primitives unless they are split. `far` is the far end of z still of interest;
 * returns the new one, -INFINITY to end the walk. */
typedef float (*LeafVisit)(void *context, uint32_t block, bool inside, float far);

/* What a tree is built from. */
typedef struct {
    uint32_t count;
    const AccelBox *boxes;          /* relative to the middle */
    SahClip clip;                   /* of a primitive, for spatial splits and the kdtree */
    void *clip_context;
    double cost_ratio, spatial;
    int threads;
    /* A primitive's corners, relative to the middle; returns how many, 2 or 3. For masks. Context: clip_context. */
    int (*corners)(void *context, uint32_t primitive, KellerVec3 corners[3]);
    KellerMaskOptions masks;
    KellerSkewedOptions skewed;
} TreeInput;

/* How to walk; all zero but for `contained` is best. */
typedef struct {
    bool contained;                 /* look for boxes that the frustum surely contains, and pass by all tests below them (paper,
                                       section 4.2) */
    bool leaf_boxes;                /* keller_cone_meets_box before a leaf */
    KellerAccelOrder order;
    const KellerCone *cone;         /* relative to the middle; for leaf_boxes and KELLER_ORDER_EXACT */
} WalkHow;

/* A child of a node that a frustum meets: where from, and its number, of a node or, with TREE_LEAF, of a block. */
#define TREE_LEAF 0x80000000u
typedef struct {
    float distance;                 /* a z that nothing in the child's box comes before inside the frustum */
    uint32_t child;
} TreeChild;

typedef struct {
    const char *name;
    double cost_ratio;              /* measured default */
    /* Builds a tree and the list of its leaves (both the caller's then: leaves by leaves_free). */
    KellerStatus (*build)(const TreeInput *input, void **tree, Leaves *leaves, KellerError *error);
    void (*free)(void *tree);
    size_t (*bytes)(const void *tree);
    /* Calls visit for every block whose box the frustum may meet before `far`, nearer ones first but in no exact order.
     * Adds the nodes tested to *nodes. A block is visited once; a primitive as often as it has blocks. */
    void (*walk)(const void *tree, const KellerConeLanes *lanes, const WalkHow *how, LeafVisit visit, void *context,
                 uint64_t *nodes);
    /* The same step by step, for who keeps the order himself: the child that is the whole tree (KELLER_NONE: empty), and the
     * children of a node that the frustum meets, at most eight. open_thin: of rays and of thin, plain frusta, whose slabs, near
     * and far are all that it reads ("ubvh": what ray8_origin fills in). NULL: not to be had. */
    uint32_t (*root)(const void *tree);
    uint32_t (*open)(const void *tree, uint32_t node, const KellerConeLanes *lanes, TreeChild child[8]);
    uint32_t (*open_thin)(const void *tree, uint32_t node, const KellerConeLanes *lanes, TreeChild child[8]);
} TreeKind;

/* Along no axis does the frustum open wider than it leans: each side of a box bounds z from one side only. */
static inline bool lanes_plain(const KellerConeLanes *c)
{
    bool plain = true;
    for (int k = 0; k < 3; k++) plain &= (c->enter_rate[k] < 0) == (c->leave_rate[k] < 0);
    return plain;
}

extern const TreeKind tree_kdtree, tree_bvh, tree_bvh8, tree_bvh_mask, tree_bvh8_mask, tree_ubvh, tree_dacrt;

/* The binary tree that the hierarchies are made from, leaves no larger than a block. Free with sah_free. */
KellerStatus binary_tree(const TreeInput *input, SahTree *tree, KellerError *error);
void leaves_free(Leaves *leaves);
/* The leaves of a binary tree whose leaves are no larger than eight. */
KellerStatus leaves_of(const SahTree *tree, Leaves *leaves, KellerError *error);
#endif
