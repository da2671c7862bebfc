/* The transition function of two edges in a row, computed for many pairs at a time. */
#ifndef KELLER_WAVE_PAIR_H
#define KELLER_WAVE_PAIR_H
#include "keller/wave.h"

enum { PAIR_MOMENTS = 96 };

/* One edge's part of the series: moment[m] is j_m/sqrt(m!), the scaled moments of exp(-s^2/2 - e^{j pi/4} x s), s > 0. */
typedef struct {
    double x;
    double complex moment[PAIR_MOMENTS];
} PairSide;

void pair_side(double x, PairSide *side);

/* keller_edge_pair at r (>= 0) and at -r. */
void pair_values(const PairSide *a, const PairSide *b, double r, double complex *same, double complex *opposite);
#endif
