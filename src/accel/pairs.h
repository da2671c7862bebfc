/* Pairs of triangles that share an edge and have a box of their own (accel/sobb.h), in which rays tell one from the other. */
#ifndef KELLER_ACCEL_PAIRS_H
#define KELLER_ACCEL_PAIRS_H
#include "accel/internal.h"
#include "accel/sobb.h"

/* A leaf: a triangle (or edge) alone, second = KELLER_NONE, or a pair. */
typedef struct {
    uint32_t first, second;
} Pair;

/* Makes pairs[0 .. *count): every primitive of the input is in one. `margin` in m: of the boxes. Free *pairs with free().
 * Errors: KELLER_FAILED (memory). */
KellerStatus pairs_find(const TreeInput *input, KellerPairs how, double margin, Pair **pairs, uint32_t *count, KellerError *error);
/* The box of a leaf, and how the triangles lie in it. */
Sobb pair_box(const TreeInput *input, Pair pair, double margin, SobbPlace *place);
#endif
