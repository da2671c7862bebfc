/* From the paths of one receiver to the columns of the result file. */
#ifndef KELLER_PATH_BATCH_H
#define KELLER_PATH_BATCH_H
#include "path/internal.h"

/* The paths of one transmitter-receiver pair, sorted by delay and steps, with their fields. */
typedef struct {
    PathList paths;
    double complex *gain;       /* [count][F] */
    double complex *transfer;   /* [count][F][4]; NULL for sound */
} PairResult;

typedef struct {
    const KellerConfig *config;
    const KellerScene *scene;
    const KellerMedium *media;  /* [F][material_count] */
} FieldContext;

/* Sorts the paths, computes their fields and drops those under the dynamic range; what was dropped, and how many of those left
 * are on boundaries, is added to *work. false: memory. */
bool pair_fields(const FieldContext *context, uint32_t tx, uint32_t rx, PairResult *pair, KellerSimulationWork *work);
void pair_free(PairResult *pair);

bool batch_append(KellerPathBatch *batch, const FieldContext *context, uint32_t tx, uint32_t rx, const PairResult *pair);
void batch_clear(KellerPathBatch *batch);
void batch_free(KellerPathBatch *batch);

/* Writes one cell of the maps; speed of the waves in m/s. */
void coverage_cell(KellerCoverage *coverage, size_t cell, double speed, const PairResult *pair);
bool coverage_init(KellerCoverage *coverage, uint32_t tx, uint32_t set, uint32_t ny, uint32_t nx, size_t frequency_count);
/* Makes NaN of what the maps have where there is no cell: of the receivers, in order, those whose z is NaN. */
void coverage_nowhere(KellerCoverage *coverage, const KellerReceiver *receivers);
void coverage_free(KellerCoverage *coverage);
#endif
