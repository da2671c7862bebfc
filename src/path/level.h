/* Sound levels at the points of a map. */
#ifndef KELLER_PATH_LEVEL_H
#define KELLER_PATH_LEVEL_H
#include "path/batch.h"

/* Room for the levels of a map that coverage_init has made; false: memory. */
bool level_init(KellerCoverage *coverage);
/* The levels of one cell. With bands they are means over the band: paths' fields are taken as constant in it but for their delays,
 * so that the mean of |sum g_i e^{-j 2 pi (f - f0) t_i}|^2 is the sum over pairs of g_i g_j* sinc(B (t_i - t_j)). Without paths they
 * stay as they are. KELLER_FAILED: memory. */
KellerStatus level_cell(KellerCoverage *coverage, size_t cell, const FieldContext *context, const PairResult *pair,
                        KellerError *error);
/* That mean for `count` gains, `stride` apart, with these delays (s), over a band of this width (Hz); 0: the square of the sum. */
double level_mean_square(size_t count, const double complex *gain, size_t stride, const double *delay, double width);
#endif
