#include "cli/export.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "cli/cli.h"
#include "cli/path_print.h"
#include "io/result_sums.h"

typedef struct {
    const KellerExport *options;
    KellerReader *reader;
    const KellerResultInfo *info;
    bool chosen[KELLER_MAP_KINDS];
} Maps;

/* The maps of one grid and transmitter. */
typedef struct {
    uint64_t ny, nx;
    double (*position)[3];              /* m, of the cells */
    double *map[KELLER_MAP_KINDS];      /* NULL: not there, or not asked for */
} Grid;

static void grid_free(Grid *g)
{
    free(g->position);
    for (int i = 0; i < KELLER_MAP_KINDS; ++i) free(g->map[i]);
}

static uint64_t maps_of_kind(const Maps *m, int kind) { return keller_map_kinds[kind].by_frequency ? m->info->frequency_count : 1; }

static KellerStatus read_positions(const Maps *m, size_t set, Grid *g, KellerError *error)
{
    uint64_t first = 0, cells = g->ny * g->nx;
    while (first < m->info->receiver_count && m->info->receiver_sets[first] != set) ++first;
    g->position = malloc((cells + 1) * sizeof *g->position);
    if (!g->position) return keller_error_memory(error, cells * sizeof *g->position);
    return keller_reader_rows(m->reader, "/receivers/position", KELLER_CELL_F8, 3, first, cells, g->position, error);
}

static KellerStatus read_grid(const Maps *m, size_t tx, size_t set, Grid *g, KellerError *error)
{
    char path[400];
    *g = (Grid){.ny = m->info->set_shapes[set][0], .nx = m->info->set_shapes[set][1]};
    KellerStatus status = read_positions(m, set, g, error);
    for (int i = 0; i < KELLER_MAP_KINDS && status == KELLER_OK; ++i) {
        uint64_t count = maps_of_kind(m, i) * g->ny * g->nx;
        if (!m->chosen[i]) continue;
        g->map[i] = malloc((count + 1) * sizeof *g->map[i]);
        if (!g->map[i]) return keller_error_memory(error, count * sizeof *g->map[i]);
        snprintf(path, sizeof path, "/coverage/%s/%s", m->info->set_ids[set], keller_map_kinds[i].name);
        status = keller_map_kinds[i].by_frequency
                     ? keller_reader_box(m->reader, path, KELLER_CELL_F8, 4, (uint64_t[]){tx, 0, 0, 0},
                                         (uint64_t[]){1, m->info->frequency_count, g->ny, g->nx}, g->map[i], error)
                     : keller_reader_box(m->reader, path, KELLER_CELL_F8, 3, (uint64_t[]){tx, 0, 0}, (uint64_t[]){1, g->ny, g->nx},
                                         g->map[i], error);
    }
    return status;
}

/* A column's unit, and the value in it: gains in decibels, angles in degrees. */
static const char *unit_of(const KellerMapKind *kind)
{
    return strcmp(kind->unit, "1") == 0 ? "dB" : strcmp(kind->unit, "rad") == 0 ? "deg" : kind->unit;
}

static double in_unit(const KellerMapKind *kind, double value)
{
    return strcmp(kind->unit, "1") == 0 ? 10 * log10(value) : strcmp(kind->unit, "rad") == 0 ? value * 180 / M_PI : value;
}

static void write_head(const Maps *m, FILE *stream)
{
    fputs("tx,grid,x_m,y_m,z_m", stream);
    for (int i = 0; i < KELLER_MAP_KINDS; ++i)
        for (uint64_t f = 0; m->chosen[i] && f < maps_of_kind(m, i); ++f) {
            fprintf(stream, ",%s_%s", keller_map_kinds[i].name, unit_of(&keller_map_kinds[i]));
            if (keller_map_kinds[i].by_frequency) fprintf(stream, "_%.15gHz", m->info->frequencies[f]);
        }
    fputc('\n', stream);
}

static void write_cells(const Maps *m, const Grid *g, const char *tx, const char *grid, FILE *stream)
{
    uint64_t cells = g->ny * g->nx;
    for (uint64_t c = 0; c < cells; ++c) {
        keller_write_csv(tx, stream);
        fputc(',', stream);
        keller_write_csv(grid, stream);
        for (int k = 0; k < 3; ++k) fprintf(stream, ",%.15g", g->position[c][k]);
        for (int i = 0; i < KELLER_MAP_KINDS; ++i)
            for (uint64_t f = 0; g->map[i] && f < maps_of_kind(m, i); ++f)
                fprintf(stream, ",%.12g", in_unit(&keller_map_kinds[i], g->map[i][f * cells + c]));
        fputc('\n', stream);
    }
}

static KellerStatus write_maps(void *context, const char *temporary, KellerError *error)
{
    const Maps *m = context;
    const KellerExport *o = m->options;
    size_t tx = SIZE_MAX;
    bool any = false;
    KellerStatus status = o->tx ? keller_find_transmitter(m->info, o->file, o->tx, &tx, error) : KELLER_OK;
    if (status != KELLER_OK) return status;
    FILE *stream = fopen(temporary, "w");
    if (!stream) return keller_error(error, KELLER_IO, "%s: cannot be written: %s", o->output, strerror(errno));
    write_head(m, stream);
    for (size_t t = 0; t < m->info->transmitter_count && status == KELLER_OK; ++t)
        for (size_t s = 0; s < m->info->set_count && status == KELLER_OK; ++s) {
            if (m->info->set_kinds[s] != KELLER_SET_GRID || (tx != SIZE_MAX && t != tx) ||
                (o->grid && strcmp(o->grid, m->info->set_ids[s]) != 0))
                continue;
            Grid g;
            any = true;
            status = read_grid(m, t, s, &g, error);
            if (status == KELLER_OK) write_cells(m, &g, m->info->transmitter_ids[t], m->info->set_ids[s], stream);
            grid_free(&g);
        }
    bool failed = ferror(stream) != 0;
    failed = fclose(stream) != 0 || failed;
    if (status != KELLER_OK) return status;
    if (failed) return keller_error(error, KELLER_IO, "%s: cannot be written: %s", o->output, strerror(errno));
    if (any) return KELLER_OK;
    if (o->grid) return keller_error(error, KELLER_USAGE, "%s has no grid \"%.60s\"; see `keller info`", o->file, o->grid);
    return keller_error(error, KELLER_BAD_INPUT, "%s: holds no grid; expected a result with a <grid>", o->file);
}

KellerStatus keller_export_maps(const KellerExport *o, KellerError *error)
{
    Maps m = {.options = o};
    struct rlimit before;
    keller_limit_memory(o->file, &before);
    KellerStatus status = keller_reader_open(o->file, &m.reader, error);
    if (status == KELLER_OK) {
        m.info = keller_reader_info(m.reader);
        bool sound = keller_is_sound(m.info);
        for (int i = 0; i < KELLER_MAP_KINDS; ++i) m.chosen[i] = sound || !keller_map_kinds[i].sound;
        if (o->sum) m.chosen[o->incoherent ? 0 : 1] = false; /* the other one of the two sums */
        status = keller_export_file(o, write_maps, &m, error);
        keller_reader_close(m.reader);
    }
    keller_lift_memory_limit(&before);
    return status;
}
