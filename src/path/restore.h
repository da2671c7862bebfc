/* Paths from a result file: all but the directions of their legs is known. */
#ifndef KELLER_PATH_RESTORE_H
#define KELLER_PATH_RESTORE_H
#include "path/batch.h"

/* Fills in the legs of the paths of a list from tx to rx, from their steps and the places of their diffractions and patches, as
 * solve.c, scatter.c and edge_paths.c compute them: bit for bit, unlike differences of points, which say nothing of a leg without
 * length. False if a path is none in this scene: a step that is not there, a point that is not on its face or edge or not where the legs
 * lead, another length, all within the scene's contact tolerance. */
bool path_list_restore(const KellerScene *scene, KellerVec3 tx, KellerVec3 rx, PathList *list);

/* Takes the paths from the source to `count` receivers from `first` on. */
KellerStatus known_take(const KellerPathSource *source, uint32_t tx, uint32_t first, uint32_t count, PairResult *results,
                        KellerError *error);
/* The legs and fields of the paths taken for a pair. KELLER_BAD_INPUT: a path is none in this scene. */
KellerStatus known_fields(const KellerPathSource *source, const FieldContext *context, uint32_t tx, uint32_t rx, PairResult *pair,
                          KellerSimulationWork *work, KellerError *error);
#endif
