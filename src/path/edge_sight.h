/* What of an edge an end sees, straight or by way of mirrors: exact, where the search's cones only bound it. */
#ifndef KELLER_PATH_EDGE_SIGHT_H
#define KELLER_PATH_EDGE_SIGHT_H
#include "path/internal.h"

/* A part of an edge, m from its first end. weight 1, or 1/2 where all of the part is seen along a border: of a mirror, or of what
 * hides it. */
typedef struct {
    double from, to, weight;
} EdgePart;

/* In order along the edge, apart from each other. Start with {0}; the owner frees `part`. */
typedef struct {
    EdgePart *part;
    uint32_t count, capacity;
} EdgeParts;

/* The way from an end over mirrors, in order, to the edge of a wedge. */
typedef struct {
    const KellerScene *scene;
    KellerVec3 end;
    uint32_t count;             /* of mirrors, < KELLER_MAX_BENDS */
    StepCode face[KELLER_MAX_BENDS];
    uint32_t wedge;
    KellerVec3 image;           /* out: the end mirrored in all of them, as the edge sees it */
} EdgeWay;

/* Appends to *seen the parts of the edge that the way leads to: every reflection in its face, nothing between. None where the image is
 * outside of the wedge's sector or on the edge's own line. False: out of memory. */
bool edge_sight(EdgeWay *way, const KellerAccel *accel, EdgeParts *seen, KellerAccelWork *work);

/* Appends what is in both lists, with the product of the weights. False: out of memory. */
bool edge_parts_common(const EdgeParts *a, const EdgeParts *b, EdgeParts *common);

/* Fills positions, triangles and unit legs of the way to the edge's point z (m), which is seen: position[i] and triangle[i] of mirror
 * i, leg[0] .. leg[count]. Returns the way's length, m. */
double edge_way_points(const EdgeWay *way, double z, KellerVec3 *position, uint32_t *triangle, KellerVec3 *leg);
#endif
