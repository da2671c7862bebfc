#include "io/result_heights.h"

#include <stdio.h>
#include <stdlib.h>

KellerStatus keller_result_heights(KellerHdf *hdf, const KellerConfig *config, const KellerReceiverSet *set, KellerError *error)
{
    char path[400];
    double *row = malloc((set->nx + 1) * sizeof *row);
    if (!row) return keller_error_memory(error, set->nx * sizeof *row);
    KellerColumn column;
    snprintf(path, sizeof path, "/coverage/%s/z", set->id);
    keller_hdf_column(hdf, &column, path, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 1, (hsize_t[]){set->nx}, "m");
    for (uint32_t y = 0; y < set->ny; ++y) {
        for (uint32_t x = 0; x < set->nx; ++x) row[x] = config->receivers[set->first + y * set->nx + x].station.position.z;
        keller_column_append(hdf, &column, row, 1);
    }
    keller_column_close(hdf, &column);
    free(row);
    return KELLER_OK;
}
