#include <math.h>
#include <stdlib.h>
#include "io/path_rows.h"
#include "io/plot.h"

/* Paths weaker than the strongest by more than this are not drawn, and no more than so many. */
static const double shown_range = 60;    /* dB */
enum { MOST_PATHS = 20000 };

typedef struct {
    const KellerPlot *plot;
    const KellerResultInfo *info;
    FILE *script;               /* NULL while the extent is measured */
    double strongest;           /* dB */
    uint64_t drawn;
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

static KellerStatus take(void *context, const KellerPathRow *row, KellerError *error)
{
    (void)error;
    Drawing *d = context;
    if (row->tx != d->plot->tx) return KELLER_OK;
    if (d->plot->set != SIZE_MAX && d->info->receiver_sets[row->rx] != d->plot->set) return KELLER_OK;
    if (d->plot->index >= 0 && d->info->receiver_indices[row->rx] != d->plot->index) return KELLER_OK;
    double gain = strength(d, row);
    KellerVec3 rx = d->receivers[row->rx];
    if (!d->script) {
        if (gain > d->strongest) d->strongest = gain;
        grow(&d->box, rx);
        if (rx.z < d->height) d->height = rx.z;
        for (uint32_t i = 0; i < row->count; ++i) grow(&d->box, row->position[i]);
        return KELLER_OK;
    }
    if (!(gain >= d->strongest - shown_range) || d->drawn == MOST_PATHS) return KELLER_OK;
    ++d->drawn;
    fprintf(d->script, "%.10g %.10g %.6g\n", d->tx.x, d->tx.y, gain);
    for (uint32_t i = 0; i < row->count; ++i)
        fprintf(d->script, "%.10g %.10g %.6g\n", row->position[i].x, row->position[i].y, gain);
    fprintf(d->script, "%.10g %.10g %.6g\n\n", rx.x, rx.y, gain);
    return KELLER_OK;
}

static void draw(const Drawing *d, bool outline)
{
    const KellerPlot *plot = d->plot;
    const KellerResultInfo *info = d->info;
    FILE *script = d->script;
    bool any = d->drawn > 0;
    char title[300];
    const char *tx = info->transmitter_ids[plot->tx];
    snprintf(title, sizeof title, "%llu paths from %.80s, %.6g GHz", (unsigned long long)d->drawn, tx,
             info->frequencies[plot->frequency] / 1e9);
    double highest = any ? 5 * ceil(d->strongest / 5) : 0;
    keller_plot_frame(plot, d->box, title, "path gain / dB", highest - shown_range, highest, script);
    keller_plot_mark(d->tx, d->box, tx, script);
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
    if (status == KELLER_OK) status = keller_each_path(reader, plot->file, take, &d, error);
    double margin = fmax(1, 0.05 * fmax(d.box.x1 - d.box.x0, d.box.y1 - d.box.y0));
    d.box = (KellerPlotBox){d.box.x0 - margin, d.box.x1 + margin, d.box.y0 - margin, d.box.y1 + margin};
    if (status == KELLER_OK && !(isfinite(d.box.x1 - d.box.x0) && isfinite(d.box.y1 - d.box.y0)))
        status = keller_error(error, KELLER_BAD_INPUT, "%s: holds positions that are not finite", plot->file);
    d.script = script;
    bool outline = false;
    if (status == KELLER_OK) {
        fputs("$paths << EOD\n", script);
        status = keller_each_path(reader, plot->file, take, &d, error);
        fputs("EOD\n", script);
    }
    if (status == KELLER_OK && isfinite(d.height))
        status = keller_plot_outline(reader, plot->file, d.box, d.height, script, &outline, error);
    if (status == KELLER_OK) draw(&d, outline);
    free(d.receivers);
    return status;
}
