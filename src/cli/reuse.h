/* cli/reuse.h -- keller run --reuse: the paths of an earlier result instead of a search. */
#ifndef KELLER_CLI_REUSE_H
#define KELLER_CLI_REUSE_H
#include "io/known_paths.h"
#include "io/result_geometry.h"

typedef struct {
    const char *file;
    KellerReader *reader;
    KellerKnownPaths *known;
    KellerDropped dropped;      /* by the runs that the result comes from */
} KellerReuse;

/* Opens the result and checks what the configuration alone decides; what a damaged file may cost of memory is bounded.
 * On failure too keller_reuse_close is due. */
KellerStatus keller_reuse_open(const char *file, const KellerConfig *config, KellerReuse *reuse, KellerError *error);
/* Checks the scene and makes the source of paths. */
KellerStatus keller_reuse_start(KellerReuse *reuse, const KellerConfig *config, const KellerScene *scene, KellerPathSource *source,
                                KellerError *error);
void keller_reuse_close(KellerReuse *reuse);
#endif
