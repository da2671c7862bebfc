/* cone_cases.h -- random and adversarial cases for the tests of keller/cone.h. A case depends on its kind, the seed
 * and its index alone, so that threads may draw them in any order.
 *
 * Half of the cases are random and aimed: the primitive is laid so that a point of it -- a vertex, a point of an edge
 * or of its inside -- falls on a target inside the cone, on the envelope to within 1e-1 to 1e-16 of its radius, or
 * outside. The others are of the families below. Half-angles are 0 or 1e-7 to 45 degrees, eccentricities 0 to 1 -
 * 1e-7, x0 0 or 1e-6 to 1e3 m, sizes 1e-4 to 1e4 m with aspect ratios to 1e6, all of it moved by up to 1e5 m. */
#ifndef TEST_CONE_CASES_H
#define TEST_CONE_CASES_H
#include "keller/cone.h"
#include <stdint.h>

typedef enum {
    CONE_PLANE,
    CONE_LINE,
    CONE_EDGE,
    CONE_TRIANGLE,
    CONE_BOX,
    CONE_CONTAINS,
    CONE_CONTAINS_TRIANGLE,
    CONE_CONTAINS_BOX,
    CONE_BOX8, /* from here on eight at a time: ConeCase8 */
    CONE_VERTEX8,
    CONE_CORNERS,
    CONE_TRIANGLE8,
    CONE_LEAF_TRIANGLE8,
    CONE_PIERCED_TRIANGLE8,
    CONE_LEAF_EDGE8,
    CONE_INSIDE_BOX8,
    CONE_KINDS
} ConeKind;

typedef enum {
    CONE_RANDOM,
    CONE_TANGENT,        /* vertices in a tangent plane; a box that touches with a corner */
    CONE_THROUGH_APEX,   /* an edge through the apex; a box with the apex inside, on a face, edge or corner */
    CONE_ON_GENERATOR,   /* an edge along the envelope */
    CONE_AXIS_PARALLEL,  /* an edge parallel to the axis, on it, on a cylinder's envelope, or beside */
    CONE_NEAR_GENERATOR, /* the plane nearly parallel to a generator */
    CONE_ON_ENVELOPE,    /* every vertex */
    CONE_DEGENERATE,     /* points, segments, slivers; boxes without thickness */
    CONE_CLIP_VERTEX,    /* a clip plane through a vertex */
    CONE_AT_ORIGIN,      /* a vertex is the cone's origin */
    CONE_WITH_AXIS,      /* the plane contains the axis */
    CONE_BEHIND,         /* behind the apex, where R < 0 */
    CONE_FAMILIES
} ConeFamily;

enum { CONE_DECADES = 10, CONE_ROUNDNESSES = 3 };
/* 0; 1e-7 to 1e-6; ...; 10 to 45 degrees. And 0; above 0 to 0.9; above 0.9. Names as in the table. */
extern const char *const cone_decade_names[CONE_DECADES], *const cone_roundness_names[CONE_ROUNDNESSES];

typedef struct {
    KellerCone cone;
    KellerRange clip;
    KellerVec3 v[3]; /* plane: normal; line: point, direction; box: lower, upper; vertices */
    double offset;   /* of the plane */
    int decade, roundness;
    ConeFamily family;
} ConeCase;

typedef struct {
    KellerBox8 boxes;
    KellerVertex8 vertices[3];
    ConeCase one; /* cone, clip, decade, roundness */
    double size;  /* bounds the magnitude of every coordinate */
} ConeCase8;

/* decade, roundness or family < 0: any. */
ConeCase cone_case(ConeKind kind, uint64_t seed, uint64_t index, int decade, int roundness, int family);
ConeCase8 cone_case8(ConeKind kind, uint64_t seed, uint64_t index, int decade, int roundness, int family);
#endif
