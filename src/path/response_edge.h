/* The response of one finite edge. */
#ifndef KELLER_PATH_RESPONSE_EDGE_H
#define KELLER_PATH_RESPONSE_EDGE_H
#include <complex.h>
#include "keller/sound.h"

/* Samples of a response from number `first` on. */
typedef struct {
    size_t first, count;
    float *sample;              /* [count], owned */
} Piece;

/* What the edge brings to a response of `count` samples at `rate` (Hz), band-limited to half of it, times `slow`, a path's other factors:
 * grid[i] = lowest 2^(i/per_octave) Hz, at least 4 of them, below and above which the first and last hold; between them it is
 * interpolated as response_weights says. Memory grows with how long the edge is heard, not with `count`. False: memory. */
bool response_edge(const KellerRigidEdge *edge, double speed, double rate, size_t count, const double complex *slow, size_t grid_count,
                   Piece *piece);
#endif
