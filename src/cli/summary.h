/* cli/summary.h -- what a run found, gathered while the paths go by. */
#ifndef KELLER_CLI_SUMMARY_H
#define KELLER_CLI_SUMMARY_H
#include <stdint.h>
#include "keller/path.h"

enum { KELLER_SUMMARY_RECEIVERS = 8, KELLER_SUMMARY_MAPS = 8 };

typedef struct {
    uint32_t tx, rx;
    double gain;                /* |gain| at the first frequency */
    double delay;               /* s */
    uint64_t paths;             /* of this receiver, all transmitters together */
    char sequence[4 * KELLER_MAX_INTERACTIONS + 4];
} KellerStrongest;

typedef struct {
    uint32_t tx, set;
    uint64_t cells, covered;
    double lowest, highest;     /* path gain at the first frequency over the covered cells */
} KellerMapSummary;

typedef struct {
    uint64_t line_of_sight, by_kind[4]; /* a path counts once, under its most particular kind */
    size_t receiver_count, map_count;
    KellerStrongest receivers[KELLER_SUMMARY_RECEIVERS];  /* the first ones that any path reaches */
    KellerMapSummary maps[KELLER_SUMMARY_MAPS];
} KellerSummary;

void keller_summary_paths(KellerSummary *summary, const KellerPathBatch *batch);
void keller_summary_map(KellerSummary *summary, const KellerCoverage *map);
void keller_summary_print(const KellerSummary *summary, const KellerConfig *config);
#endif
