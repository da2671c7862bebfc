/* cli/export_maps.h -- maps of a result for other programs. */
#ifndef KELLER_CLI_EXPORT_MAPS_H
#define KELLER_CLI_EXPORT_MAPS_H
#include <stdio.h>
#include "io/result_read.h"

typedef enum { KELLER_EXPORT_CSV, KELLER_EXPORT_JSON, KELLER_EXPORT_XDMF } KellerExportFormat;

/* Writes the map of one grid; XDMF: those of all grids, and the scene, as a description of where they are in the result.
 *   CSV: a row a transmitter, frequency and cell: tx, frequency/Hz, x/m, y/m, z/m, path_gain, delay_spread/s, strongest_delay/s, with sound
 *     level/dB. What there is not is nan.
 *   JSON: an object with grid, frequencies_Hz, x_m, y_m, z_m[ny][nx] and maps, one a transmitter: tx, path_gain[frequency][ny][nx],
 *     delay_spread_s[ny][nx], strongest_delay_s[ny][nx], with sound level_dB[frequency][ny][nx]. What there is not is null.
 *   XDMF 3 (ParaView): the scene's triangles, and each grid as a surface through its cells' places with its path gains, and levels, as
 *     scalars of the points. `link` is the result's name as seen from the description's folder.
 * `file` is the result, for messages. Failures of writing are left to the stream. */
KellerStatus keller_export_maps(KellerReader *reader, const char *file, size_t set, KellerExportFormat format, const char *link, FILE *out,
                                KellerError *error);
#endif
