#include "path/level.h"

#include <math.h>
#include <stdlib.h>

#include "keller/sound.h"

bool level_init(KellerCoverage *c)
{
    size_t cells = (size_t)c->ny * c->nx, levels = c->frequency_count * cells;
    c->level = malloc(levels * sizeof *c->level);
    c->level_a = malloc(cells * sizeof *c->level_a);
    if (!c->level || !c->level_a) return false;
    for (size_t i = 0; i < levels; i++) c->level[i] = -INFINITY;
    for (size_t i = 0; i < cells; i++) c->level_a[i] = -INFINITY;
    return true;
}

static double sinc(double x) { return fabs(x) < 1e-8 ? 1 : sin(M_PI * x) / (M_PI * x); }

double level_mean_square(size_t count, const double complex *gain, size_t stride, const double *delay, double width)
{
    double sum = 0;
    for (size_t i = 0; i < count; i++) {
        double complex mine = gain[i * stride], others = 0;
        for (size_t j = 0; j < i; j++) others += gain[j * stride] * sinc(width * (delay[i] - delay[j]));
        sum += creal(mine * conj(mine + 2 * others));
    }
    return sum > 0 ? sum : 0; /* a null of interference may be rounded to below it */
}

KellerStatus level_cell(KellerCoverage *c, size_t cell, const FieldContext *context, const PairResult *pair, KellerError *error)
{
    size_t n = pair->paths.count, F = c->frequency_count, cells = (size_t)c->ny * c->nx;
    const KellerConfig *config = context->config;
    const double *level = config->transmitters[c->tx].level;
    if (n == 0) return KELLER_OK;
    double *delay = malloc(n * sizeof *delay), total = 0;
    if (!delay) return keller_error_memory(error, n * sizeof *delay);
    for (size_t i = 0; i < n; i++) delay[i] = pair->paths.items[i].length / context->scene->sound.speed;
    for (size_t f = 0; f < F; f++) {
        double middle = config->frequencies[f];
        double width = config->bands_per_octave ? keller_band_width(config->bands_per_octave, middle) : 0;
        double here = (level ? level[f] : 0) + 10 * log10(level_mean_square(n, &pair->gain[f], F, delay, width));
        c->level[f * cells + cell] = here;
        total += pow(10, (here + keller_a_weighting(middle)) / 10);
    }
    c->level_a[cell] = 10 * log10(total);
    free(delay);
    return KELLER_OK;
}
