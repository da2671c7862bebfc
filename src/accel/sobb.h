/* Skewed oriented boxes (SOBB; Kacerik and Bittner, "SOBB: Skewed Oriented Bounding Boxes for Ray Tracing", CGF 44(2), 2025): the
 * points between three pairs of parallel planes, fitted to a k-DOP, or laid around a triangle or two as in "UBVH: Unified Bounding
 * Volume and Scene Geometry Representation for Ray Tracing", 2026, section 3.
 *
 * A slab is |n.p - c| <= 1 with n, c in single precision. It holds what it is laid around and SOBB_WIDTH of the scene's size beyond,
 * of which some is spent on its own rounding, and the rest is what tests may spend on theirs (accel/ubvh_wide.h). */
#ifndef KELLER_ACCEL_SOBB_H
#define KELLER_ACCEL_SOBB_H
#include <stdbool.h>
#include <stdint.h>
#include "keller/error.h"
#include "keller/vec.h"

/* Of the greatest coordinate, on either side. The paper's epsilon, relative: no slab is thinner than twice this. */
#define SOBB_WIDTH (96 * 0x1p-24)

typedef struct {
    float n[3], c;
} SobbSlab;

typedef struct {
    SobbSlab slab[3];
    /* Around a triangle or a pair: within so much of a border, in the slabs' own coordinates n.p - c, tests cannot tell. INFINITY:
     * the box alone is known. */
    float band;
} Sobb;

/* How primitives lie in their box, u, v, w being the slabs' coordinates from -1 to 1:
 *   one:   a triangle in w = 0 with corners (-1, -1), (1, -1), (-1, 1): where u + v <= 0 (eq. 4)
 *   flat:  and a second one, where u + v >= 0 (section 3.3.1)
 *   wings: one in w = -1, where u + v <= 0, and one in u = -1, where v + w <= 0 (eq. 6) */
typedef enum { SOBB_ONE, SOBB_FLAT, SOBB_WINGS } SobbPlace;

/* Around a triangle, or an edge (count 2); `width` in m, > 0. Degenerate ones have a box and an infinite band. */
Sobb sobb_around(int count, const KellerVec3 *corners, double width);
/* Around two triangles with two corners in common, the first two of each: first[0] = second[1], first[1] = second[0] or, as well,
 * first[0] = second[0]. False: they have no such box, or one in which tests could tell little. */
bool sobb_around_pair(const KellerVec3 first[3], const KellerVec3 second[3], double width, Sobb *box, SobbPlace *place);

/* ---- k-DOPs ------------------------------------------------------------------------------------------------------ */

enum { DOP_MOST = 96, DOP_AXES = 32 };

/* Which slabs a box may be made of: any three of 32 (a 64-DOP), or any of 32 orthogonal frames (oriented boxes; Sabino et al.,
 * "Building Oriented Bounding Boxes by the intermediate use of ODOPs", 2023). */
typedef struct {
    bool frames;
    int count;                      /* directions: 32, or 96, three after three */
    _Alignas(32) float direction[3][DOP_MOST];
    float (*inverse)[DOP_AXES][DOP_AXES]; /* of the determinant of three; frames: NULL */
    _Alignas(32) float pair[DOP_AXES][DOP_AXES]; /* 1 / |a x b| */
} Dops;

/* Free with dops_free. Errors: KELLER_FAILED (memory). */
KellerStatus dops_make(Dops *d, bool frames, KellerError *error);
void dops_free(Dops *d);
/* The seven directions of a 14-DOP, the axes and the diagonals of a cube, and one of them again. Holds no memory. */
void dops_fourteen(Dops *d);

/* A k-DOP is 2 count floats, 32-byte aligned: how far it reaches along each direction, then against it. */
void dop_around(const Dops *d, int count, const KellerVec3 *corners, float *dop);
/* Makes `dop` hold `other` too. */
void dop_add(const Dops *d, float *dop, const float *other);

/* The box of least surface, and half of that. */
typedef struct {
    uint8_t direction[3];
    float middle[3], half[3];       /* along the directions */
    float area;
} SobbFit;
SobbFit sobb_fit(const Dops *d, const float *dop, double width);
Sobb sobb_of_fit(const Dops *d, const SobbFit *fit);
#endif
