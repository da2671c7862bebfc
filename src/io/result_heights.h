/* io/result_heights.h -- where the cells of a map lie. */
#ifndef KELLER_IO_RESULT_HEIGHTS_H
#define KELLER_IO_RESULT_HEIGHTS_H
#include "io/hdf.h"
#include "keller/config.h"

/* /coverage/ID/z of a grid: of each cell, row by row. Failures of HDF5 are kept in hdf. KELLER_FAILED: memory. */
KellerStatus keller_result_heights(KellerHdf *hdf, const KellerConfig *config, const KellerReceiverSet *set, KellerError *error);
#endif
