/* io/result_tables.h -- the parts of a result that are known before the simulation. */
#ifndef KELLER_IO_RESULT_TABLES_H
#define KELLER_IO_RESULT_TABLES_H
#include <stddef.h>
#include "io/hdf.h"
#include "keller/config.h"
#include "keller/scene.h"

#define KELLER_FORMAT_VERSION 1u

/* The name of a receiver: the set's id for a point, "ID[INDEX]" for a point of a route or a grid. Cut at size - 1. */
void keller_receiver_name(const char *set_id, KellerSetKind kind, uint32_t index, char *name, size_t size);

/* Root attributes, /config, /frequencies, /transmitters, /receivers, /sets, /materials, /scene and empty groups.
 * KELLER_FAILED (memory), KELLER_BAD_INPUT (a grid's id that cannot name a group, SOURCE_DATE_EPOCH not a number);
 * failures of writing are kept in *hdf. */
KellerStatus keller_result_tables(KellerHdf *hdf, const KellerConfig *config, const KellerScene *scene,
                                  const char *command_line, KellerError *error);
#endif
