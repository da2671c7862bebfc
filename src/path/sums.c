#include "path/sums.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "keller/wave.h"

/* Deviations are taken from the mean direction, where the sum is real: a narrow spread is then not lost in 1 - |sum|. */
double keller_angle_spread(size_t count, const double *angle, const double *power)
{
    double total = 0, across = 0, missing = 0;
    double complex sum = 0;
    for (size_t i = 0; i < count; i++) {
        total += power[i];
        sum += power[i] * (cos(angle[i]) + I * sin(angle[i]));
    }
    if (!(total > 0)) return NAN;
    double mean = carg(sum);
    for (size_t i = 0; i < count; i++) {
        double half = sin((angle[i] - mean) / 2);
        missing += power[i] * 2 * half * half; /* 1 - cos */
        across += power[i] * sin(angle[i] - mean);
    }
    missing /= total;
    across /= total;
    double lost = missing * (2 - missing) - across * across; /* 1 - |sum|^2 */
    return lost < 1 ? sqrt(-log1p(-greater(lost, 0))) : INFINITY;
}

static void sum_gains(const PathList *paths, const double complex *gain, KellerPairSums *s)
{
    size_t n = paths->count, F = s->frequency_count;
    for (size_t f = 0; f < F; f++) {
        double complex sum = 0;
        double scattered = 0, all = 0;
        for (size_t i = 0; i < n; i++) {
            double complex g = gain[i * F + f];
            if (paths->items[i].patch > 0) scattered += gain_power(g);
            else sum += g;
            all += gain_power(g);
        }
        s->path_gain[f] = gain_power(sum) + scattered;
        s->path_gain_incoherent[f] = all;
    }
}

static void spread_delays(const PathList *paths, const double *power, double speed, KellerPairSums *s)
{
    double total = 0, mean = 0, spread = 0, most = -1, at = 0;
    for (size_t i = 0; i < paths->count; i++) {
        double delay = paths->items[i].length / speed;
        total += power[i];
        mean += power[i] * delay;
        if (power[i] > most) most = power[i], at = delay;
    }
    if (!(total > 0)) return;
    mean /= total;
    for (size_t i = 0; i < paths->count; i++) {
        double d = paths->items[i].length / speed - mean;
        spread += power[i] * d * d;
    }
    s->strongest_delay = at;
    s->delay_spread = sqrt(spread / total);
}

bool sums_of(const PathList *paths, const double complex *gain, size_t F, double speed, KellerPairSums *s)
{
    size_t n = paths->count;
    double *power = malloc((n * (1 + KELLER_ANGLES) + 1) * sizeof *power), *angle = power ? power + n : NULL;
    s->paths = n;
    s->frequency_count = F;
    s->path_gain = calloc(2 * F + 1, sizeof *s->path_gain);
    s->path_gain_incoherent = s->path_gain ? s->path_gain + F : NULL;
    s->delay_spread = s->strongest_delay = NAN;
    for (int a = 0; a < KELLER_ANGLES; a++) s->angle_spread[a] = NAN;
    if (!power || !s->path_gain) {
        free(power);
        return false;
    }
    if (n > 0) sum_gains(paths, gain, s);
    for (size_t i = 0; i < n; i++) {
        const PathItem *item = &paths->items[i];
        power[i] = gain_power(gain[i * F]);
        keller_angles(paths->nodes[item->begin].leg, &angle[KELLER_DEPARTURE_ZENITH * n + i], &angle[KELLER_DEPARTURE_AZIMUTH * n + i]);
        keller_angles(v3_scale(paths->nodes[item->begin + item->count].leg, -1), &angle[KELLER_ARRIVAL_ZENITH * n + i],
                      &angle[KELLER_ARRIVAL_AZIMUTH * n + i]);
    }
    spread_delays(paths, power, speed, s);
    for (int a = 0; a < KELLER_ANGLES; a++) s->angle_spread[a] = keller_angle_spread(n, angle + (size_t)a * n, power);
    free(power);
    return true;
}

void sums_free(KellerPairSums *sums)
{
    free(sums->path_gain);
    memset(sums, 0, sizeof *sums);
}

/* ---- maps -------------------------------------------------------------------------------------------------------------- */

static double *cells_of_nan(size_t count)
{
    double *cells = malloc((count + 1) * sizeof *cells);
    for (size_t i = 0; cells && i < count; i++) cells[i] = NAN;
    return cells;
}

bool coverage_init(KellerCoverage *c, uint32_t tx, uint32_t set, uint32_t ny, uint32_t nx, size_t F)
{
    size_t cells = (size_t)ny * nx;
    *c = (KellerCoverage){.tx = tx, .set = set, .ny = ny, .nx = nx, .frequency_count = F};
    c->path_gain = calloc(F * cells, sizeof(double));
    c->path_gain_incoherent = calloc(F * cells, sizeof(double));
    c->delay_spread = cells_of_nan(cells);
    c->strongest_delay = cells_of_nan(cells);
    bool room = c->path_gain && c->path_gain_incoherent && c->delay_spread && c->strongest_delay;
    for (int a = 0; a < KELLER_ANGLES; a++) {
        c->angle_spread[a] = cells_of_nan(cells);
        room = room && c->angle_spread[a];
    }
    if (!room) coverage_free(c);
    return room;
}

void coverage_free(KellerCoverage *c)
{
    free(c->path_gain);
    free(c->path_gain_incoherent);
    free(c->delay_spread);
    free(c->strongest_delay);
    for (int a = 0; a < KELLER_ANGLES; a++) free(c->angle_spread[a]);
    free(c->level);
    free(c->level_a);
    memset(c, 0, sizeof *c);
}

void coverage_cell(KellerCoverage *c, size_t cell, const KellerPairSums *sums)
{
    if (!sums->path_gain) return; /* there is no cell: nothing was summed */
    size_t cells = (size_t)c->ny * c->nx;
    for (size_t f = 0; f < c->frequency_count; f++) {
        c->path_gain[f * cells + cell] = sums->path_gain[f];
        c->path_gain_incoherent[f * cells + cell] = sums->path_gain_incoherent[f];
    }
    c->delay_spread[cell] = sums->delay_spread;
    c->strongest_delay[cell] = sums->strongest_delay;
    for (int a = 0; a < KELLER_ANGLES; a++) c->angle_spread[a][cell] = sums->angle_spread[a];
}

void coverage_nowhere(KellerCoverage *c, const KellerReceiver *receivers)
{
    size_t cells = (size_t)c->ny * c->nx;
    for (size_t i = 0; i < cells; i++) {
        if (!isnan(receivers[i].station.position.z)) continue;
        for (size_t f = 0; f < c->frequency_count; f++) {
            c->path_gain[f * cells + i] = c->path_gain_incoherent[f * cells + i] = NAN;
            if (c->level) c->level[f * cells + i] = NAN;
        }
        if (c->level_a) c->level_a[i] = NAN;
    }
}
