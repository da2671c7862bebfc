/* From the paths of a pair to an impulse response. */
#ifndef KELLER_PATH_RESPONSE_H
#define KELLER_PATH_RESPONSE_H
#include <complex.h>
#include "keller/response.h"
#include "path/internal.h"

typedef struct ResponsePlan ResponsePlan;

/* What all responses of a simulation share: `count` samples, the frequencies at which fields are computed, the media there.
 * NULL: see error. */
ResponsePlan *response_plan(const KellerConfig *config, const KellerScene *scene, KellerError *error);
void response_plan_free(ResponsePlan *plan); /* NULL is allowed */

/* The response of one pair by `threads` threads, whose number changes nothing in it. What arrives after the last sample is left
 * out. The caller frees response->pressure and ->tail. */
KellerStatus response_of(const ResponsePlan *plan, const KellerConfig *config, const KellerScene *scene, uint32_t tx, uint32_t rx,
                         const PathList *paths, uint32_t threads, KellerResponse *response, KellerError *error);

/* Where a frequency lies in the grid at which what changes slowly is computed: value = sum of weight[i] slow[first + i]. */
typedef struct {
    uint32_t first;
    float weight[4];
} ResponseWeights;

/* `frequency` in Hz, 0 and above; of a grid of grid_count frequencies. */
ResponseWeights response_weights(double frequency, size_t grid_count);

static inline double complex response_value(const ResponseWeights *w, const double complex *slow)
{
    const double complex *s = &slow[w->first];
    return w->weight[0] * s[0] + w->weight[1] * s[1] + w->weight[2] * s[2] + w->weight[3] * s[3];
}
#endif
