/* From the paths of a pair to an impulse response. */
#ifndef KELLER_PATH_RESPONSE_H
#define KELLER_PATH_RESPONSE_H
#include "keller/response.h"
#include "path/internal.h"

typedef struct ResponsePlan ResponsePlan;

/* What all responses of a simulation share: `count` samples, the frequencies at which fields are computed, the media there, and
 * where each bin lies among them. NULL: see error. */
ResponsePlan *response_plan(const KellerConfig *config, const KellerScene *scene, KellerError *error);
void response_plan_free(ResponsePlan *plan); /* NULL is allowed */

/* The response of one pair. What arrives after the last sample is left out. The caller frees response->pressure and ->tail. */
KellerStatus response_of(const ResponsePlan *plan, const KellerConfig *config, const KellerScene *scene, uint32_t tx,
                         uint32_t rx,
                         const PathList *paths, KellerResponse *response, KellerError *error);
#endif
