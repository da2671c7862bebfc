#include "path/batch.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "keller/sound.h"
#include "path/field.h"

static bool is_sound(const FieldContext *c) { return c->scene->sound.speed > 0; }

/* On two boundaries at once a weight of 1/4 and so on is that of two that have nothing to do with each other, and right. */
static bool is_estimate(double weight)
{
    int exponent;
    return weight < 0.5 && frexp(weight, &exponent) != 0.5;
}

bool pair_fields(const FieldContext *c, uint32_t tx, uint32_t rx, PairResult *pair, KellerSimulationWork *work)
{
    size_t n = pair->paths.count, F = c->config->frequency_count;
    const KellerStation *t = &c->config->transmitters[tx].station, *r = &c->config->receivers[rx].station;
    pair->sums.tx = tx;
    pair->sums.rx = rx;
    if (n == 0) return sums_of(&pair->paths, NULL, F, path_wave_speed(c->scene), &pair->sums);
    path_list_sort(&pair->paths);
    pair->gain = malloc(n * F * sizeof *pair->gain);
    if (!is_sound(c)) pair->transfer = malloc(n * F * 4 * sizeof *pair->transfer);
    double *strongest = calloc(2 * F, sizeof *strongest), *lost = strongest ? strongest + F : NULL;
    if (!pair->gain || (!is_sound(c) && !pair->transfer) || !strongest) {
        free(strongest);
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        KellerPath p;
        path_list_get(&pair->paths, i, &p);
        if (is_sound(c)) {
            double directed = keller_directivity(&t->directivity, t->orientation, p.leg[0]) *
                              keller_directivity(&r->directivity, r->orientation, v3_scale(p.leg[p.count], -1));
            for (size_t f = 0; f < F; f++) {
                double complex g = directed * path_pressure(c->scene, &p, t->position, c->config->frequencies[f],
                                                            c->media + f * c->scene->material_count);
                pair->gain[i * F + f] = g;
                strongest[f] = greater(strongest[f], gain_power(g));
            }
            continue;
        }
        for (size_t f = 0; f < F; f++) {
            double complex g = path_gain(c->scene, &p, t, r, c->config->frequencies[f], c->media + f * c->scene->material_count,
                                         &pair->transfer[(i * F + f) * 4]);
            pair->gain[i * F + f] = g;
            strongest[f] = greater(strongest[f], gain_power(g));
        }
    }
    double range = pow(10, -c->config->dynamic_range / 10), lowest = INFINITY;
    for (size_t f = 0; f < F; f++) lowest = lesser(lowest, 2 * M_PI * c->config->frequencies[f] / path_wave_speed(c->scene));
    size_t kept = 0;
    for (size_t i = 0; i < n; i++) {
        bool keep = false;
        for (size_t f = 0; f < F; f++) keep = keep || gain_power(pair->gain[i * F + f]) >= range * strongest[f];
        for (size_t f = 0; f < F && !keep; f++) lost[f] += sqrt(gain_power(pair->gain[i * F + f]));
        if (!keep) continue;
        work->boundary_paths += pair->paths.items[i].weight < 1;
        work->cornered_paths += is_estimate(pair->paths.items[i].weight);
        if (c->config->diffractions > 2) {
            KellerPath p;
            path_list_get(&pair->paths, i, &p);
            work->crowded_paths += path_crowded(c->scene, &p, t->position, lowest);
        }
        if (kept != i) {
            pair->paths.items[kept] = pair->paths.items[i];
            memcpy(&pair->gain[kept * F], &pair->gain[i * F], F * sizeof *pair->gain);
            if (pair->transfer) memcpy(&pair->transfer[kept * F * 4], &pair->transfer[i * F * 4],
                                       F * 4 * sizeof *pair->transfer);
        }
        kept++;
    }
    work->dropped_paths += n - kept;
    for (size_t f = 0; f < F; f++)
        if (lost[f] > 0) work->dropped_ratio = greater(work->dropped_ratio, lost[f] / sqrt(strongest[f]));
    pair->paths.count = kept;
    free(strongest);
    return sums_of(&pair->paths, pair->gain, F, path_wave_speed(c->scene), &pair->sums);
}

void pair_free(PairResult *pair)
{
    path_list_free(&pair->paths);
    free(pair->gain);
    free(pair->transfer);
    sums_free(&pair->sums);
    memset(pair, 0, sizeof *pair);
}

/* ---- columns --------------------------------------------------------------------------------------------------------- */

static bool grow(void *column, size_t count, size_t size)
{
    void **p = column, *grown = realloc(*p, count * size);
    if (!grown) return false;
    *p = grown;
    return true;
}

static bool reserve(KellerPathBatch *b, size_t paths, size_t interactions, size_t F, bool transfers)
{
    if (paths > b->capacity) {
        size_t n = paths + b->capacity;
        if (!grow(&b->tx, n, sizeof *b->tx) || !grow(&b->rx, n, sizeof *b->rx) ||
            !grow(&b->offset, n + 1, sizeof *b->offset) || !grow(&b->length, n, sizeof *b->length) ||
            !grow(&b->delay, n, sizeof *b->delay) || !grow(&b->departure, n, sizeof *b->departure) ||
            !grow(&b->arrival, n, sizeof *b->arrival) || !grow(&b->doppler, n * F, sizeof *b->doppler) ||
            !grow(&b->gain, n * F, sizeof *b->gain) || !grow(&b->weight, n, sizeof *b->weight) ||
            !grow(&b->patch, n, sizeof *b->patch) || !grow(&b->part, n, sizeof *b->part) || (transfers && !grow(&b->transfer, 4 * n * F, sizeof *b->transfer)))
            return false;
        b->capacity = n;
        b->offset[b->count] = b->interaction_count;
    }
    if (interactions > b->interaction_capacity) {
        size_t n = interactions + b->interaction_capacity;
        if (!grow(&b->interaction_kind, n, sizeof *b->interaction_kind) ||
            !grow(&b->interaction_position, n, sizeof *b->interaction_position) ||
            !grow(&b->interaction_triangle, n, sizeof *b->interaction_triangle) ||
            !grow(&b->interaction_wedge, n, sizeof *b->interaction_wedge) ||
            !grow(&b->interaction_free_end, n, sizeof *b->interaction_free_end))
            return false;
        b->interaction_capacity = n;
    }
    return true;
}

bool batch_append(KellerPathBatch *b, const FieldContext *c, uint32_t tx, uint32_t rx, const PairResult *pair)
{
    size_t F = c->config->frequency_count, interactions = b->interaction_count;
    const KellerStation *t = &c->config->transmitters[tx].station, *r = &c->config->receivers[rx].station;
    for (size_t i = 0; i < pair->paths.count; i++) interactions += pair->paths.items[i].count;
    b->frequency_count = F;
    if (pair->paths.count == 0) return true;
    if (!reserve(b, b->count + pair->paths.count, interactions, F, pair->transfer)) return false;
    double speed = path_wave_speed(c->scene);
    for (size_t i = 0; i < pair->paths.count; i++) {
        KellerPath path, *p = &path;
        path_list_get(&pair->paths, i, p);
        size_t at = b->count++;
        KellerVec3 back = v3_scale(p->leg[p->count], -1);
        b->tx[at] = tx;
        b->rx[at] = rx;
        b->length[at] = p->length;
        b->weight[at] = p->weight;
        b->patch[at] = p->patch;
        memcpy(b->part[at], p->part, sizeof p->part);
        b->delay[at] = p->length / speed;
        keller_angles(p->leg[0], &b->departure[at][0], &b->departure[at][1]);
        keller_angles(back, &b->arrival[at][0], &b->arrival[at][1]);
        /* approaching ends shorten the path: positive shift */
        double closing = (v3_dot(t->velocity, p->leg[0]) + v3_dot(r->velocity, back)) / speed;
        for (size_t f = 0; f < F; f++) b->doppler[at * F + f] = closing * c->config->frequencies[f];
        memcpy(&b->gain[at * F], &pair->gain[i * F], F * sizeof *b->gain);
        if (pair->transfer) memcpy(&b->transfer[at * F * 4], &pair->transfer[i * F * 4], F * 4 * sizeof *b->transfer);
        for (uint32_t j = 0; j < p->count; j++) {
            size_t k = b->interaction_count++;
            bool diffraction = p->step[j].kind == KELLER_DIFFRACTION;
            b->interaction_kind[k] = (uint8_t)p->step[j].kind;
            b->interaction_position[k] = p->position[j];
            b->interaction_triangle[k] = diffraction ? KELLER_NONE : p->triangle[j];
            b->interaction_wedge[k] = diffraction ? p->step[j].id : KELLER_NONE;
            b->interaction_free_end[k] = p->free_end[j];
        }
        b->offset[b->count] = b->interaction_count;
    }
    return true;
}

void batch_clear(KellerPathBatch *b)
{
    b->count = b->interaction_count = 0;
    if (b->offset) b->offset[0] = 0;
}

void batch_free(KellerPathBatch *b)
{
    free(b->tx);
    free(b->rx);
    free(b->offset);
    free(b->length);
    free(b->delay);
    free(b->departure);
    free(b->arrival);
    free(b->doppler);
    free(b->gain);
    free(b->transfer);
    free(b->weight);
    free(b->patch);
    free(b->part);
    free(b->interaction_kind);
    free(b->interaction_position);
    free(b->interaction_triangle);
    free(b->interaction_wedge);
    free(b->interaction_free_end);
    memset(b, 0, sizeof *b);
}
