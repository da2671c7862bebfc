/* From the paths of one receiver to the columns of the result file. */
#ifndef KELLER_PATH_BATCH_H
#define KELLER_PATH_BATCH_H
#include "path/internal.h"
#include "path/sums.h"

/* The paths of one transmitter-receiver pair, sorted by delay and steps, with their fields. */
typedef struct {
    PathList paths;
    double complex *gain;       /* [count][F] */
    double complex *transfer;   /* [count][F][4]; NULL for sound */
    KellerPairSums sums;
} PairResult;

typedef struct {
    const KellerConfig *config;
    const KellerScene *scene;
    const KellerMedium *media;  /* [F][material_count] */
} FieldContext;

/* Sorts the paths, computes their fields and sums and drops those under the dynamic range; what was dropped, and how many of those left
 * are on boundaries, is added to *work. false: memory. */
bool pair_fields(const FieldContext *context, uint32_t tx, uint32_t rx, PairResult *pair, KellerSimulationWork *work);
void pair_free(PairResult *pair);

bool batch_append(KellerPathBatch *batch, const FieldContext *context, uint32_t tx, uint32_t rx, const PairResult *pair);
void batch_clear(KellerPathBatch *batch);
void batch_free(KellerPathBatch *batch);
#endif
