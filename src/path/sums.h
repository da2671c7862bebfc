/* Sums over the paths of a pair, and maps of them. */
#ifndef KELLER_PATH_SUMS_H
#define KELLER_PATH_SUMS_H
#include "path/internal.h"

/* |g|^2 */
static inline double gain_power(double complex g) { return creal(g) * creal(g) + cimag(g) * cimag(g); }

/* The sums over paths whose gains are gain[path][frequency]; speed of the waves in m/s. sums->tx and rx are the caller's, who frees
 * its arrays with sums_free, also after false: memory. */
bool sums_of(const PathList *paths, const double complex *gain, size_t frequency_count, double speed, KellerPairSums *sums);
void sums_free(KellerPairSums *sums);

/* Writes one cell of the maps. */
void coverage_cell(KellerCoverage *coverage, size_t cell, const KellerPairSums *sums);
bool coverage_init(KellerCoverage *coverage, uint32_t tx, uint32_t set, uint32_t ny, uint32_t nx, size_t frequency_count);
/* Makes NaN of what the maps have where there is no cell: of the receivers, in order, those whose z is NaN. */
void coverage_nowhere(KellerCoverage *coverage, const KellerReceiver *receivers);
void coverage_free(KellerCoverage *coverage);
#endif
