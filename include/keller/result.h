/* keller/result.h -- the HDF5 result file (SPEC 4, docs/format.md). */
#ifndef KELLER_RESULT_H
#define KELLER_RESULT_H
#include <stdbool.h>
#include <stdint.h>
#include "keller/config.h"
#include "keller/error.h"
#include "keller/path.h"
#include "keller/scene.h"

typedef struct KellerResult KellerResult;

/* Fails early, before any work is done, if `file` could not be created: it exists and !force, its folder is missing or not
 * writable. KELLER_IO. */
KellerStatus keller_result_check_target(const char *file, bool force, KellerError *error);

/* Starts a result under a temporary name beside `file` and writes everything that is known before the simulation
 * (attributes, config, frequencies, stations, sets, materials with their constants, scene if config->output_scene, what
 * decides which paths there are).
 * config and scene must outlive the result. */
KellerStatus keller_result_create(const char *file, bool force, const KellerConfig *config, const KellerScene *scene,
                                  const char *command_line, KellerResult **result, KellerError *error);
/* Appends paths; memory use does not grow with their number. */
KellerStatus keller_result_append(KellerResult *result, const KellerPathBatch *batch, KellerError *error);
/* Writes the maps of one transmitter on one grid. */
KellerStatus keller_result_coverage(KellerResult *result, const KellerCoverage *coverage, KellerError *error);
/* Appends the sums of one pair whose receiver is not of a grid. */
KellerStatus keller_result_pair(KellerResult *result, const KellerPairSums *sums, KellerError *error);
/* Appends an impulse response of config->response_duration, and its room acoustical parameters. */
KellerStatus keller_result_response(KellerResult *result, const KellerResponse *response, KellerError *error);
/* Writes one value under /statistics. `unit` may be "1". */
KellerStatus keller_result_statistic(KellerResult *result, const char *name, double value, const char *unit,
                                     KellerError *error);
KellerStatus keller_result_statistic_text(KellerResult *result, const char *name, const char *value, KellerError *error);
/* Completes the file and moves it to its final name; frees the result also on failure (nothing is then left behind). */
KellerStatus keller_result_finish(KellerResult *result, KellerError *error);
/* Deletes the unfinished file and frees the result; NULL is allowed. */
void keller_result_abandon(KellerResult *result);
#endif
