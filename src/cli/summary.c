#include "cli/summary.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include "cli/cli.h"
#include "io/result_tables.h"

static const char letters[4] = {'R', 'D', 'T', 'S'};

static KellerInteractionKind most_particular(const uint8_t *kinds, uint64_t count)
{
    bool has[4] = {false};
    for (uint64_t i = 0; i < count; ++i) has[kinds[i] & 3] = true;
    return has[KELLER_SCATTERING]     ? KELLER_SCATTERING
           : has[KELLER_DIFFRACTION]  ? KELLER_DIFFRACTION
           : has[KELLER_TRANSMISSION] ? KELLER_TRANSMISSION
                                      : KELLER_REFLECTION;
}

void keller_summary_paths(KellerSummary *s, const KellerPathBatch *batch)
{
    for (size_t p = 0; p < batch->count; ++p) {
        uint64_t first = batch->offset[p], count = batch->offset[p + 1] - first;
        /* A batch of lines of sight alone has no array to point into. */
        const uint8_t *kinds = count > 0 ? batch->interaction_kind + first : NULL;
        if (count == 0) ++s->line_of_sight;
        else ++s->by_kind[most_particular(kinds, count)];

        size_t at = 0;
        while (at < s->receiver_count && s->receivers[at].rx != batch->rx[p]) ++at;
        if (at == KELLER_SUMMARY_RECEIVERS) continue;
        KellerStrongest *best = &s->receivers[at];
        if (at == s->receiver_count) {
            ++s->receiver_count;
            *best = (KellerStrongest){.rx = batch->rx[p], .gain = -1};
        }
        ++best->paths;
        double gain = cabs(batch->gain[p * batch->frequency_count]);
        if (!(gain > best->gain)) continue;
        best->tx = batch->tx[p];
        best->gain = gain;
        best->delay = batch->delay[p];
        size_t length = 0;
        for (uint64_t i = 0; i < count && i < KELLER_MAX_INTERACTIONS; ++i)
            best->sequence[length++] = letters[kinds[i] & 3];
        best->sequence[length] = '\0';
        if (count == 0) memcpy(best->sequence, "LOS", 4);
    }
}

void keller_summary_map(KellerSummary *s, const KellerCoverage *map)
{
    if (s->map_count == KELLER_SUMMARY_MAPS) return;
    KellerMapSummary *m = &s->maps[s->map_count++];
    *m = (KellerMapSummary){.tx = map->tx, .set = map->set, .lowest = INFINITY, .highest = 0};
    m->cells = (uint64_t)map->ny * map->nx;
    for (uint64_t i = 0; i < m->cells; ++i) {
        double gain = map->path_gain[i];
        if (!(gain > 0)) continue;
        ++m->covered;
        if (gain < m->lowest) m->lowest = gain;
        if (gain > m->highest) m->highest = gain;
    }
}

void keller_summary_print(const KellerSummary *s, const KellerConfig *config)
{
    bool sound = config->sound.speed > 0;
    uint64_t total = s->line_of_sight;
    for (int i = 0; i < 4; ++i) total += s->by_kind[i];
    printf("paths\n");
    keller_row("all", "%llu", (unsigned long long)total);
    static const char *const names[] = {"reflections only", "with diffraction", "with transmission", "with scattering"};
    keller_row("line of sight", "%llu", (unsigned long long)s->line_of_sight);
    for (int i = 0; i < 4; ++i)
        if (i < 2 || s->by_kind[i] > 0) keller_row(names[i], "%llu", (unsigned long long)s->by_kind[i]);
    if (s->receiver_count > 0)
        printf("strongest path of the first receivers\n  %-18s %-14s %7s %10s %12s  %s\n", "receiver", "transmitter",
               "paths", "gain/dB", sound ? "delay/ms" : "delay/ns", "sequence");
    for (size_t i = 0; i < s->receiver_count; ++i) {
        const KellerStrongest *best = &s->receivers[i];
        const KellerReceiver *receiver = &config->receivers[best->rx];
        const KellerReceiverSet *set = &config->sets[receiver->set];
        char name[300];
        keller_receiver_name(set->id, set->kind, receiver->index, name, sizeof name);
        printf("  %-18s %-14s %7llu %10.2f %12.3f  %s\n", name, config->transmitters[best->tx].id,
               (unsigned long long)best->paths, keller_decibel(best->gain), best->delay * (sound ? 1e3 : 1e9), best->sequence);
    }
    if (s->map_count > 0)
        printf("coverage at the first frequency\n  %-18s %-14s %9s %9s %10s %10s\n", "grid", "transmitter", "cells",
               "reached", "least/dB", "most/dB");
    for (size_t i = 0; i < s->map_count; ++i) {
        const KellerMapSummary *m = &s->maps[i];
        printf("  %-18s %-14s %9llu %9llu", config->sets[m->set].id, config->transmitters[m->tx].id,
               (unsigned long long)m->cells, (unsigned long long)m->covered);
        if (m->covered > 0) printf(" %10.1f %10.1f", 10 * log10(m->lowest), 10 * log10(m->highest));
        putchar('\n');
    }
}
