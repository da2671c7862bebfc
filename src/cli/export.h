/* cli/export.h -- what the kinds of export share. */
#ifndef KELLER_CLI_EXPORT_H
#define KELLER_CLI_EXPORT_H
#include "io/result_read.h"

typedef struct {
    char *file;
    const char *tx, *rx, *grid, *output;
    bool force, sum, incoherent;    /* sum: one of the sums of gains was asked for */
} KellerExport;

/* Makes a temporary file, has `write` fill it, and gives it its name; neither failures nor signals leave anything behind. */
KellerStatus keller_export_file(const KellerExport *o, KellerStatus (*write)(void *context, const char *temporary, KellerError *error),
                                void *context, KellerError *error);

/* ---- export_maps.c ---- */

/* All maps of the grids and transmitters asked for as one CSV file, a row a cell. In this process's bounded memory. */
KellerStatus keller_export_maps(const KellerExport *o, KellerError *error);
#endif
