#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "io/plot.h"
#include "io/result_sums.h"

/* What is more than this below the highest path gain has the darkest colour. */
static const double shown_range = 100;   /* dB */

typedef struct {
    uint32_t ny, nx;
    double *x, *y, *cells, *heights;    /* owned */
    KellerPlotSurface surface;
} Map;

static void map_free(Map *map)
{
    free(map->x);
    free(map->y);
    free(map->cells);
    free(map->heights);
}

/* What is drawn. */
typedef struct {
    const char *dataset;        /* in /coverage/ID */
    bool by_frequency;          /* one of its maps, else of the first frequency only */
    bool decibels;              /* 10 log10 of the cells, over their top 100 dB */
    double unit;                /* else: cells are divided by it */
    const char *label;
} Quantity;

static Quantity quantity_of(const KellerPlot *plot, bool sound)
{
    static const char *const angles[KELLER_ANGLES] = {
        [KELLER_DEPARTURE_AZIMUTH] = "azimuth spread of departure / deg", [KELLER_DEPARTURE_ZENITH] = "zenith spread of departure / deg",
        [KELLER_ARRIVAL_AZIMUTH] = "azimuth spread of arrival / deg", [KELLER_ARRIVAL_ZENITH] = "zenith spread of arrival / deg"};
    const double second = sound ? 1e-3 : 1e-9;
    switch (plot->kind) {
    case KELLER_PLOT_COVERAGE:
        if (plot->incoherent) return (Quantity){"path_gain_incoherent", true, true, 1, "path gain, sum of powers / dB"};
        return (Quantity){"path_gain", true, true, 1, "path gain / dB"};
    case KELLER_PLOT_LEVEL: return (Quantity){NULL, false, true, 1, "level / dB re 20 uPa"};
    case KELLER_PLOT_DELAY_SPREAD:
        return (Quantity){"delay_spread", false, false, second, sound ? "delay spread / ms" : "delay spread / ns"};
    case KELLER_PLOT_ANGLE_SPREAD:
        return (Quantity){keller_spread_names[plot->angle], false, false, M_PI / 180, angles[plot->angle]};
    case KELLER_PLOT_DELAY:
    case KELLER_PLOT_PATHS: break;
    }
    return (Quantity){"strongest_delay", false, false, second, sound ? "delay of the strongest path / ms" : "delay of the strongest path / ns"};
}

static KellerStatus read_heights(KellerReader *reader, const char *id, Map *map, KellerError *error)
{
    char path[400];
    snprintf(path, sizeof path, "/coverage/%s/z", id);
    size_t count = (size_t)map->ny * map->nx;
    map->heights = calloc(count + 1, sizeof *map->heights);
    if (!map->heights) return keller_error_memory(error, count * sizeof *map->heights);
    KellerStatus status = keller_reader_rows(reader, path, KELLER_CELL_F8, map->nx, 0, map->ny, map->heights, error);
    map->surface = (KellerPlotSurface){INFINITY, -INFINITY, map->ny, map->nx, map->x, map->y, map->heights};
    for (size_t i = 0; i < count; ++i) {
        map->surface.z = fmin(map->surface.z, map->heights[i]);
        map->surface.highest = fmax(map->surface.highest, map->heights[i]);
    }
    if (!(map->surface.z <= map->surface.highest)) map->surface.z = map->surface.highest = 0; /* no cell at all */
    return status;
}

/* Adds up the energies of the transmitters asked for; in dB. */
static KellerStatus read_levels(KellerReader *reader, const KellerPlot *plot, Map *map, KellerError *error)
{
    const KellerResultInfo *info = keller_reader_info(reader);
    size_t count = (size_t)map->ny * map->nx;
    bool weighted = plot->frequency == SIZE_MAX;
    char path[400];
    snprintf(path, sizeof path, "/coverage/%s/%s", info->set_ids[plot->set], weighted ? "level_a" : "level");
    if (!keller_reader_has(reader, path))
        return keller_error(error, KELLER_BAD_INPUT, "%s: holds no sound levels; expected a run of domain acoustic",
                            plot->file);
    double *one = calloc(count + 1, sizeof *one);
    if (!one) return keller_error_memory(error, count * sizeof *one);
    KellerStatus status = KELLER_OK;
    for (size_t tx = plot->all ? 0 : plot->tx; tx < (plot->all ? info->transmitter_count : plot->tx + 1) &&
         status == KELLER_OK; ++tx) {
        const uint64_t at[] = {tx, weighted ? 0 : plot->frequency, 0, 0}, box[] = {1, 1, map->ny, map->nx};
        const uint64_t flat[] = {1, map->ny, map->nx};
        status = weighted ? keller_reader_box(reader, path, KELLER_CELL_F8, 3, (uint64_t[]){tx, 0, 0}, flat, one, error)
                          : keller_reader_box(reader, path, KELLER_CELL_F8, 4, at, box, one, error);
        for (size_t i = 0; i < count && status == KELLER_OK; ++i) map->cells[i] += pow(10, one[i] / 10);
    }
    free(one);
    return status;
}

static KellerStatus map_read(KellerReader *reader, const KellerPlot *plot, const Quantity *q, Map *map, KellerError *error)
{
    const KellerResultInfo *info = keller_reader_info(reader);
    const char *id = info->set_ids[plot->set];
    map->ny = info->set_shapes[plot->set][0];
    map->nx = info->set_shapes[plot->set][1];
    size_t ny = map->ny, nx = map->nx;
    map->x = calloc(nx + 1, sizeof *map->x);
    map->y = calloc(ny + 1, sizeof *map->y);
    map->cells = calloc(ny * nx + 1, sizeof *map->cells);
    char path[400];
    if (!map->x || !map->y || !map->cells) return keller_error_memory(error, ny * nx * sizeof *map->cells);
    snprintf(path, sizeof path, "/coverage/%s", id);
    if (!keller_reader_has(reader, path))
        return keller_error(
            error, KELLER_BAD_INPUT,
            "%s: holds no coverage of the grid \"%.60s\"; expected a run with <output coverage=\"yes\"/>", plot->file,
            id);
    snprintf(path, sizeof path, "/coverage/%s/x", id);
    KellerStatus status = keller_reader_rows(reader, path, KELLER_CELL_F8, 1, 0, nx, map->x, error);
    snprintf(path, sizeof path, "/coverage/%s/y", id);
    if (status == KELLER_OK) status = keller_reader_rows(reader, path, KELLER_CELL_F8, 1, 0, ny, map->y, error);
    if (status == KELLER_OK && !q->dataset) status = read_levels(reader, plot, map, error);
    if (status == KELLER_OK && q->dataset) {
        snprintf(path, sizeof path, "/coverage/%s/%s", id, q->dataset);
        status = q->by_frequency ? keller_reader_box(reader, path, KELLER_CELL_F8, 4, (uint64_t[]){plot->tx, plot->frequency, 0, 0},
                                                     (uint64_t[]){1, 1, ny, nx}, map->cells, error)
                                 : keller_reader_box(reader, path, KELLER_CELL_F8, 3, (uint64_t[]){plot->tx, 0, 0},
                                                     (uint64_t[]){1, ny, nx}, map->cells, error);
    }
    return status == KELLER_OK ? read_heights(reader, id, map, error) : status;
}

/* Decibels, or the quantity's unit; NaN where there is nothing to show. Returns the range in *lowest and *highest. */
static bool convert(const Quantity *q, Map *map, double *lowest, double *highest)
{
    size_t count = (size_t)map->ny * map->nx;
    *lowest = INFINITY;
    *highest = -INFINITY;
    for (size_t i = 0; i < count; ++i) {
        double value = map->cells[i];
        if (q->decibels) value = value > 0 ? 10 * log10(value) : NAN;
        else value = value >= 0 ? value / q->unit : NAN;
        if (!isfinite(value)) value = NAN;
        map->cells[i] = value;
        if (value < *lowest) *lowest = value;
        if (value > *highest) *highest = value;
    }
    bool any = *highest >= *lowest;
    if (!any) *lowest = *highest = 0;
    if (q->decibels) {
        if (*lowest < *highest - shown_range) *lowest = *highest - shown_range;
        *lowest = 5 * floor(*lowest / 5);
        *highest = 5 * ceil(*highest / 5);
    }
    if (!(*highest > *lowest))
        *highest = *lowest + (q->decibels ? 5 : fmax(1, fabs(*lowest) * 1e-3));
    return any;
}

/* gnuplot draws images from two by two points on: a blank row and column more than there are cells. */
static void write_cells(const Map *map, FILE *script)
{
    fputs("$map << EOD\n", script);
    for (uint32_t iy = 0; iy <= map->ny; ++iy) {
        for (uint32_t ix = 0; ix <= map->nx; ++ix) {
            double value = iy < map->ny && ix < map->nx ? map->cells[(size_t)iy * map->nx + ix] : NAN;
            if (isnan(value)) fputs(" NaN", script);
            else fprintf(script, " %.6g", value);
        }
        fputc('\n', script);
    }
    fputs("EOD\n", script);
}

KellerStatus keller_plot_map(KellerReader *reader, const KellerPlot *plot, FILE *script, KellerError *error)
{
    const KellerResultInfo *info = keller_reader_info(reader);
    const bool sound = strcmp(info->domain, "acoustic") == 0;
    const Quantity q = quantity_of(plot, sound);
    Map map = {0};
    KellerStatus status = map_read(reader, plot, &q, &map, error);
    if (status == KELLER_OK && (map.nx == 0 || map.ny == 0))
        status = keller_error(error, KELLER_BAD_INPUT, "%s: the grid \"%.60s\" has no cells", plot->file,
                              info->set_ids[plot->set]);
    if (status != KELLER_OK) {
        map_free(&map);
        return status;
    }
    double step = map.nx > 1 ? map.x[1] - map.x[0] : map.ny > 1 ? map.y[1] - map.y[0] : 1;
    if (!(step > 0) || !isfinite(step)) step = 1;
    KellerPlotBox box = {map.x[0] - step / 2, map.x[0] + (map.nx - 0.5) * step, map.y[0] - step / 2,
                         map.y[0] + (map.ny - 0.5) * step};
    double lowest, highest;
    bool any = convert(&q, &map, &lowest, &highest);

    char title[400], lines[80] = "", heights[80];
    const bool flat = map.surface.highest == map.surface.z;
    if (flat) snprintf(heights, sizeof heights, "z = %g m", map.surface.z);
    else snprintf(heights, sizeof heights, "z = %.4g to %.4g m", map.surface.z, map.surface.highest);
    const char *tx = info->transmitter_ids[plot->tx], *grid = info->set_ids[plot->set];
    if (plot->kind == KELLER_PLOT_COVERAGE) {
        snprintf(title, sizeof title, "%.80s to %.80s (%s), %.6g %s%s", tx, grid, heights,
                 info->frequencies[plot->frequency] / (sound ? 1 : 1e9), sound ? "Hz" : "GHz", any ? "" : ": no path");
    } else if (plot->kind == KELLER_PLOT_LEVEL) {
        char band[40] = "A-weighted";
        if (plot->frequency != SIZE_MAX) snprintf(band, sizeof band, "%.6g Hz", info->frequencies[plot->frequency]);
        snprintf(title, sizeof title, "%.80s to %.80s (%s), %s%s", plot->all &&
                 info->transmitter_count > 1 ? "all" : tx, grid, heights,
                 band, any ? "" : ": no path");
    } else {
        snprintf(title, sizeof title, "%.80s to %.80s (%s)%s", tx, grid, heights, any ? "" : ": no path");
    }
    write_cells(&map, script);
    bool outline = false;
    double contours = flat ? 0 : keller_plot_contours(&map.surface, script);
    if (contours > 0) snprintf(lines, sizeof lines, "lines of equal height every %g m", contours);
    status = keller_plot_outline(reader, plot->file, box, &map.surface, script, &outline, error);
    if (status == KELLER_OK) {
        keller_plot_frame(plot, box, title, contours > 0 ? lines : NULL, q.label, lowest, highest, script);
        for (size_t i = plot->all ? 0 : plot->tx; i < (plot->all ? info->transmitter_count : plot->tx + 1); ++i)
            keller_plot_mark(info->transmitter_positions[i], box, info->transmitter_ids[i], false, script);
        fputs("plot ", script);
        if (any)
            fprintf(script, "$map matrix using (%.17g + $1 * %.17g):(%.17g + $2 * %.17g):3 with image", map.x[0], step,
                    map.y[0], step);
        else fputs("NaN with lines", script);
        if (contours > 0) /* to be seen on light and on dark */
            fputs(", $contours using 1:2 with lines lw 2 lc rgb '#80ffffff', '' using 1:2 with lines lw 0.7 lc rgb '#60000000'", script);
        fputs(outline ? ", $outline using 1:2 with lines lw 1.2 lc rgb '#202020'\n" : "\n", script);
    }
    map_free(&map);
    return status;
}
