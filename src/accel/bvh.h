/* A bounding volume hierarchy over boxes: binned SAH, collapsed to four children a node so that one SIMD test serves a
 * node. Boxes in single precision, rounded outwards. What the boxes hold is the caller's business. */
#ifndef KELLER_ACCEL_BVH_H
#define KELLER_ACCEL_BVH_H
#include <stdbool.h>
#include <stdint.h>
#include "keller/accel.h"
#include "keller/error.h"

typedef struct {
    float lower[3][4], upper[3][4]; /* an unused child is an inverted box */
    uint32_t child[4];              /* node index, or first primitive */
    uint32_t count[4];              /* primitives of a leaf; 0: an inner node */
} BvhNode;

typedef struct {
    BvhNode *nodes;                 /* 16-byte aligned; nodes[0] is the root */
    uint32_t node_count;
    uint32_t *primitives;           /* a permutation of 0 .. primitive_count - 1 */
    uint32_t primitive_count;
    int depth;                      /* of the tree of four-wide nodes */
} Bvh;

typedef struct {
    float lower[3], upper[3];
} BvhBox;

/* The smallest single-precision box around count >= 1 points, each coordinate rounded outwards. */
BvhBox bvh_box(size_t count, const KellerVec3 *points);

/* Builds over `count` boxes (may be 0). Deterministic. KELLER_FAILED: memory. Free with bvh_free. */
KellerStatus bvh_build(uint32_t count, const BvhBox *boxes, Bvh *bvh, KellerError *error);
void bvh_free(Bvh *bvh);

/* Calls visit for the primitives of every leaf whose box, grown by margin, the segment meets; true if visit stopped it. */
bool bvh_segment(const Bvh *bvh, KellerVec3 a, KellerVec3 b, double margin, KellerVisitTriangle visit, void *context,
                 KellerAccelWork *work);

/* Calls visit(context, primitive, far) for the primitives of every leaf whose box the cone may meet between clip.near and
 * clip.far; visit returns the new far. Nearer children first. */
typedef double (*BvhVisitCone)(void *context, uint32_t primitive, double far);
void bvh_cone(const Bvh *bvh, const KellerCone *cone, KellerRange clip, BvhVisitCone visit, void *context,
              KellerAccelWork *work);
#endif
