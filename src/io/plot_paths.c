#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "io/path_rows.h"
#include "io/plot.h"
#include "io/result_tables.h"

/* Paths weaker than the strongest by more than this are not drawn, and no more than so many. */
static const double shown_range = 60;    /* dB */
enum { MOST_PATHS = 20000, MOST_NAMES = 20 };

typedef struct {
    const KellerPlot *plot;
    const KellerResultInfo *info;
    FILE *script;               /* NULL while the strongest is looked for */
    double strongest;           /* dB */
    uint64_t paths, drawn;      /* of the chosen pairs; in the picture */
    KellerPlotBox box;
    KellerVec3 tx, *receivers;  /* [receiver_count] */
    double height;              /* of the lowest receiver that a path reaches */
} Drawing;

static double strength(const Drawing *d, const KellerPathRow *row)
{
    return 20 * log10(cabs(row->gain[d->plot->frequency]));
}

static void grow(KellerPlotBox *box, KellerVec3 p)
{
    box->x0 = fmin(box->x0, p.x);
    box->x1 = fmax(box->x1, p.x);
    box->y0 = fmin(box->y0, p.y);
    box->y1 = fmax(box->y1, p.y);
}

static bool chosen(const Drawing *d, uint64_t rx)
{
    if (d->plot->set != SIZE_MAX && d->info->receiver_sets[rx] != d->plot->set) return false;
    return d->plot->index < 0 || d->info->receiver_indices[rx] == d->plot->index;
}

static KellerStatus take(void *context, const KellerPathRow *row, KellerError *error)
{
    (void)error;
    Drawing *d = context;
    if (row->tx != d->plot->tx) return KELLER_OK;
    if (!chosen(d, row->rx)) return KELLER_OK;
    double gain = strength(d, row);
    KellerVec3 rx = d->receivers[row->rx];
    if (!d->script) {
        ++d->paths;
        if (gain > d->strongest) d->strongest = gain;
        if (rx.z < d->height) d->height = rx.z;
        return KELLER_OK;
    }
    if (!(gain >= d->strongest - shown_range) || d->drawn == MOST_PATHS) return KELLER_OK;
    ++d->drawn;
    for (uint32_t i = 0; i < row->count; ++i) grow(&d->box, row->position[i]);
    fprintf(d->script, "%.10g %.10g %.6g\n", d->tx.x, d->tx.y, gain);
    for (uint32_t i = 0; i < row->count; ++i)
        fprintf(d->script, "%.10g %.10g %.6g\n", row->position[i].x, row->position[i].y, gain);
    fprintf(d->script, "%.10g %.10g %.6g\n\n", rx.x, rx.y, gain);
    return KELLER_OK;
}

/* Every receiver by its name where they are few; otherwise each set by its id, at its first point. */
static void mark_receivers(const Drawing *d)
{
    const KellerResultInfo *info = d->info;
    uint64_t count = 0, marked = 0, last_set = UINT64_MAX;
    for (uint64_t r = 0; r < info->receiver_count; ++r) count += chosen(d, r);
    for (uint64_t r = 0; r < info->receiver_count && marked < MOST_NAMES; ++r) {
        uint32_t set = info->receiver_sets[r];
        if (!chosen(d, r) || (count > MOST_NAMES && set == last_set)) continue;
        last_set = set;
        char name[300];
        if (count > MOST_NAMES) snprintf(name, sizeof name, "%s", info->set_ids[set]);
        else
            keller_receiver_name(info->set_ids[set], (KellerSetKind)info->set_kinds[set], info->receiver_indices[r],
                                 name, sizeof name);
        keller_plot_mark(d->receivers[r], d->box, name, true, d->script);
        ++marked;
    }
}

static void write_titles(const Drawing *d, char title[400], char subtitle[100])
{
    const KellerPlot *plot = d->plot;
    const KellerResultInfo *info = d->info;
    char to[200] = "all receivers", index[32] = "";
    if (plot->index >= 0) snprintf(index, sizeof index, "[%lld]", (long long)plot->index);
    if (plot->set == SIZE_MAX && info->receiver_count == 1)
        keller_receiver_name(info->set_ids[info->receiver_sets[0]],
                             (KellerSetKind)info->set_kinds[info->receiver_sets[0]], info->receiver_indices[0], to,
                             sizeof to);
    if (plot->set != SIZE_MAX) snprintf(to, sizeof to, "%.80s%s", info->set_ids[plot->set], index);
    bool sound = strcmp(info->domain, "acoustic") == 0;
    snprintf(title, 400, "%.80s to %s, %.6g %s", info->transmitter_ids[plot->tx], to,
             info->frequencies[plot->frequency] / (sound ? 1 : 1e9), sound ? "Hz" : "GHz");
    snprintf(subtitle, 100, "%llu of %llu paths: %s within %g dB of the strongest", (unsigned long long)d->drawn,
             (unsigned long long)d->paths, d->drawn == MOST_PATHS ? "the first" : "those", shown_range);
}

static void draw(const Drawing *d, bool outline)
{
    const KellerPlot *plot = d->plot;
    const KellerResultInfo *info = d->info;
    FILE *script = d->script;
    bool any = d->drawn > 0;
    char title[400], subtitle[100];
    write_titles(d, title, subtitle);
    double highest = any ? 5 * ceil(d->strongest / 5) : 0;
    keller_plot_frame(plot, d->box, title, subtitle, "path gain / dB", highest - shown_range, highest, script);
    mark_receivers(d);
    keller_plot_mark(d->tx, d->box, info->transmitter_ids[plot->tx], false, script);
    fputs("plot ", script);
    if (outline) fputs("$outline using 1:2 with lines lw 1.2 lc rgb '#202020', ", script);
    fputs(any ? "$paths using 1:2:3 with lines lw 1 lc palette\n" : "NaN with lines\n", script);
}

KellerStatus keller_plot_paths(KellerReader *reader, const KellerPlot *plot, FILE *script, KellerError *error)
{
    const KellerResultInfo *info = keller_reader_info(reader);
    Drawing d = {.plot = plot, .info = info, .strongest = -INFINITY, .tx = info->transmitter_positions[plot->tx],
                 .height = INFINITY};
    d.box = (KellerPlotBox){d.tx.x, d.tx.x, d.tx.y, d.tx.y};
    d.receivers = malloc((size_t)(info->receiver_count + 1) * sizeof *d.receivers);
    if (!d.receivers) return keller_error_memory(error, info->receiver_count * sizeof *d.receivers);
    KellerStatus status = keller_reader_rows(reader, "/receivers/position", KELLER_CELL_F8, 3, 0, info->receiver_count,
                                             d.receivers, error);
    for (uint64_t r = 0; r < info->receiver_count && status == KELLER_OK; ++r)
        if (chosen(&d, r)) grow(&d.box, d.receivers[r]);
    if (status == KELLER_OK) status = keller_each_path(reader, plot->file, take, &d, error);
    d.script = script;
    bool outline = false;
    if (status == KELLER_OK) {
        fputs("$paths << EOD\n", script);
        status = keller_each_path(reader, plot->file, take, &d, error);
        fputs("EOD\n", script);
    }
    double margin = fmax(1, 0.05 * fmax(d.box.x1 - d.box.x0, d.box.y1 - d.box.y0));
    d.box = (KellerPlotBox){d.box.x0 - margin, d.box.x1 + margin, d.box.y0 - margin, d.box.y1 + margin};
    if (status == KELLER_OK && !(isfinite(d.box.x1 - d.box.x0) && isfinite(d.box.y1 - d.box.y0)))
        status = keller_error(error, KELLER_BAD_INPUT, "%s: holds positions that are not finite", plot->file);
    if (status == KELLER_OK && isfinite(d.height))
        status = keller_plot_outline(reader, plot->file, d.box, &(KellerPlotSurface){.z = d.height, .highest = d.height}, script, &outline,
                                     error);
    if (status == KELLER_OK) draw(&d, outline);
    free(d.receivers);
    return status;
}
