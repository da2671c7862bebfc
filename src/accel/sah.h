/* One builder for all hierarchies: a binary tree over boxes by the surface-area heuristic (SAH), top-down with bins (Wald
 * 2007), with spatial splits on request (Stich, Friedrich and Dietrich 2009). Wider trees are collapsed from it.
 *
 * The tree is a function of the set of boxes: of any two splits the choice rests on minima, maxima and counts alone, so it
 * is the same, byte for byte, for any number of threads. Whatever the boxes are, the depth is at most SAH_DEPTH + 32 and
 * the time grows as n log n. */
#ifndef KELLER_ACCEL_SAH_H
#define KELLER_ACCEL_SAH_H
#include <stdbool.h>
#include <stdint.h>
#include "keller/error.h"
#include "keller/vec.h"

enum { SAH_DEPTH = 64 }; /* below this depth nodes are halved by count */

/* Single precision, rounded outwards by whoever made it. Empty where lower > upper on any axis; may be infinite; no NaN. */
typedef struct {
    float lower[3], upper[3];
} AccelBox;

/* The box of a node holds the boxes of all below it, which are refs[first .. end). An inner node: count is 0, left and
 * right are its children. A leaf: count = end - first >= 1, its references in increasing order. */
typedef struct {
    AccelBox box;
    uint32_t first, count, end;
    uint32_t left, right;
} SahNode;

typedef struct {
    SahNode *nodes;      /* [node_count], depth first, left before right: left is the node's own number + 1 */
    uint32_t node_count; /* 0 without primitives */
    uint32_t *refs;      /* [ref_count] primitives, in the order of the leaves */
    uint32_t ref_count;
    int depth;           /* nodes on the longest way down; 0 without primitives */
} SahTree;

/* What is worth its cost is measured in steps through an inner node. A query enters a box inside another with the chance
 * that a line of random direction, `breadth` thick on either side, meets it: by Steiner's formula for the mean shadow of a
 * box with sides a, b, c grown by r on all sides, ab + bc + ca + pi r (a + b + c) + 2 pi r^2 (times 1/2). */
typedef struct {
    double cost_ratio;   /* > 0; a leaf of n costs cost_ratio * ceil(n / block) */
    uint32_t leaf_most;  /* >= 1; most primitives in a leaf */
    uint32_t block;      /* >= 1; primitives tested at once: leaves come out well filled */
    float breadth;       /* >= 0, in the boxes' unit; 0 for rays, a typical radius at the hit for cones */
    bool spatial;        /* split primitives by planes where the children of the best other split overlap much */
    double budget;       /* >= 0; with spatial: at most this share of further references; 0.3 is plenty */
    int threads;         /* 0: as many as OpenMP gives */
} SahOptions;

/* cost_ratio 1, leaves of 8 tested 8 at a time, breadth 0, no spatial splits (budget 0.3), one thread. */
SahOptions sah_defaults(void);

/* Gives the box of the part of a primitive between two planes, lower <= p[axis] <= upper (either may be infinite), rounded
 * outwards; empty (inverted) if there is none. Called from several threads. */
typedef void (*SahClip)(void *context, uint32_t primitive, int axis, float lower, float upper, AccelBox *part);

/* For a clip function: the parts of a triangle and of a segment with finite corners. */
void sah_clip_triangle(KellerVec3 a, KellerVec3 b, KellerVec3 c, int axis, float lower, float upper, AccelBox *part);
void sah_clip_segment(KellerVec3 a, KellerVec3 b, int axis, float lower, float upper, AccelBox *part);

/* Builds over `count` boxes (0 gives an empty tree). Every primitive is in exactly one leaf; with spatial splits in at least
 * one, in a leaf at most once, and the boxes of its leaves cover it together. Without spatial splits clip may be NULL.
 * Memory: with m = count, or (1 + budget) count with spatial splits, 120 m bytes of address space while building, of which
 * 32 m and 44 a node are touched; the tree has 4 bytes a reference and 44 a node, at most 2 m - 1 nodes, in blocks of that
 * size. Errors: KELLER_FAILED (memory, or more than 2^30 references). Free with sah_free. */
KellerStatus sah_build(uint32_t count, const AccelBox *boxes, SahClip clip, void *context, const SahOptions *options,
                       SahTree *tree, KellerError *error);
void sah_free(SahTree *tree);
#endif
