/* The hierarchy of skewed boxes, in which triangles are boxes too (Kacerik and Bittner, "UBVH: Unified Bounding Volume and Scene
 * Geometry Representation for Ray Tracing", 2026). Nodes have eight or four children; their tests, and the walks, are
 * accel/ubvh_wide.h, written once for both.
 *
 * A leaf's entry in a node is the box around a triangle or around a pair of them (accel/sobb.h). The triangles of a node's entries
 * are a block, or two, as the leaves of all structures are, so that cones, edges and the next hit find them where they look; a
 * ray is told from the box alone which it may hit, and which it surely hits, and looks into the block only to decide what is not sure. */
#ifndef KELLER_ACCEL_UBVH_H
#define KELLER_ACCEL_UBVH_H
#include "accel/bvh8.h"
#include "accel/leaf.h"
#include "accel/sobb.h"

/* A child: 0 where there is none, the number of a node (skewed ones count from 1), or UBVH_LEAF, how its primitives lie in the box, and
 * the place of the first: 8 times its block, and its lane. Leaves come first. */
enum {
    UBVH_ALONG = 1u << 30,          /* of a node: its boxes are along the axes */
    UBVH_WINGS = 1u << 30,
    UBVH_FLAT = 1u << 29,
    UBVH_PLACE = UBVH_FLAT - 1
};
#define UBVH_LEAF TREE_LEAF

/* Three slabs n.p - c, and the band (Sobb), of every child. */
typedef struct {
    _Alignas(64) float slab[12 * 8]; /* x, y, z of n, and c, slab after slab */
    float band[8];
    uint32_t child[8];
} UbvhNode8;
typedef struct {
    _Alignas(32) float slab[12 * 4];
    float band[4];
    uint32_t child[4];
} UbvhNode4;
/* Up to eight boxes along the axes, unused ones as in accel/bvh8.h: where skew would gain too little for its price. */
typedef struct {
    _Alignas(64) KellerBox8 boxes;
    uint32_t child[8];
} UbvhAlong;
_Static_assert(sizeof(UbvhNode8) == 448 && sizeof(UbvhNode4) == 224, "a slab is four numbers");

typedef struct {
    int width;                      /* 8 or 4: children of a node */
    bool unified;                   /* leaves are boxes around triangles; else boxes around blocks of up to eight */
    double margin;                  /* m: of all slabs, SOBB_WIDTH of the greatest coordinate */
    UbvhNode8 *nodes8;              /* [node_count], the first of no use; or NULL */
    UbvhNode4 *nodes4;
    UbvhAlong *along;               /* [along_count] */
    uint32_t node_count, along_count;
    uint32_t root;                  /* as a child; 0: nothing in it */
    struct Dop14 *dop14;            /* in their place */
} Ubvh;

/* TreeKind's build and free. */
KellerStatus ubvh_build(const TreeInput *input, void **tree, Leaves *leaves, KellerError *error);
void ubvh_free(void *tree);

/* What a ray or a frustum is to these tests. */
typedef struct {
    float origin[3], axis[3][3];    /* of a ray axis[2] alone, its direction */
    float tan_alpha, x0, near, far;
    float loose;                    /* m: what slabs must hold beyond what they do; 0 for who starts within the scene */
    float looser;                   /* the factor of bands that goes with it */
    bool ray;
    bool thin;                      /* its slabs are all that boxes along the axes ask */
    const KellerConeLanes *lanes;
} UbvhFrustum;
UbvhFrustum ubvh_frustum(const Ubvh *tree, const KellerConeLanes *lanes);

/* Entries of a node that a ray meets; bit i is child i. */
typedef struct {
    const uint32_t *child;
    uint32_t first, second;         /* whose first, whose second triangle it may hit, not before low[0 or 1][i] */
    uint32_t sure;                  /* of which it surely hits one, at high[i] or before */
    uint32_t tested;                /* triangles that were looked at */
    _Alignas(32) float low[2][8], high[8];
} UbvhMet;
/* Called for them; returns as LeafVisit does. `before`: sure hits are to be within the query's range. */
typedef float (*UbvhVisit)(void *context, const UbvhMet *met, float far);

/* A level leaves at most seven waiting, as in accel/bvh8.h. */
enum { UBVH_STACK = 7 * (SAH_DEPTH + 32 + 8) + 8 };

#define WIDE 8
#include "accel/ubvh_wide.h"
#undef WIDE
#define WIDE 4
#include "accel/ubvh_wide.h"
#undef WIDE

/* The walk of a ray: visit_met where leaves are boxes around triangles, else visit_block. Sure hits lie in [near, far]. */
static inline __attribute__((always_inline)) void ubvh_walk_ray(const Ubvh *tree, const KellerConeLanes *lanes, float near, float far,
                                                                UbvhVisit visit_met, LeafVisit visit_block, void *context,
                                                                uint64_t *nodes)
{
    if (!tree || !tree->root) return; /* and where it is of 14-DOPs */
    const UbvhFrustum f = ubvh_frustum(tree, lanes);
    if (tree->width == 4) ubvh_walk_ray_4(tree, tree->nodes4, &f, near, far, visit_met, visit_block, context, nodes);
    else ubvh_walk_ray_8(tree, tree->nodes8, &f, near, far, visit_met, visit_block, context, nodes);
}
#endif
