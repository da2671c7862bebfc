/* The transition function of three edges in a row, computed for many at a time. */
#ifndef KELLER_WAVE_TRIPLE_H
#define KELLER_WAVE_TRIPLE_H
#include "keller/wave.h"

/* keller_edge_triple(x1[a], x2, x3[c], r12[a], r23[c]) for four first and four last edges; all |r12| are one, and all |r23|. */
void triple_values(const double x1[4], double x2, const double x3[4], const double r12[4], const double r23[4],
                   double complex value[4][4]);
#endif
