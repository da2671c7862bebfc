#include "io/result_sums.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "io/result_heights.h"

enum { GRID_CHUNK = 256 };

const char *const keller_spread_names[KELLER_ANGLES] = {
    [KELLER_DEPARTURE_AZIMUTH] = "departure_azimuth_spread", [KELLER_DEPARTURE_ZENITH] = "departure_zenith_spread",
    [KELLER_ARRIVAL_AZIMUTH] = "arrival_azimuth_spread", [KELLER_ARRIVAL_ZENITH] = "arrival_zenith_spread"};

const KellerMapKind keller_map_kinds[KELLER_MAP_KINDS] = {
    {"path_gain", "1", true, false}, {"path_gain_incoherent", "1", true, false}, {"delay_spread", "s", false, false},
    {"strongest_delay", "s", false, false}, {"level", "dB", true, true}, {"level_a", "dB", false, true},
    {"departure_azimuth_spread", "rad", false, false}, {"departure_zenith_spread", "rad", false, false},
    {"arrival_azimuth_spread", "rad", false, false}, {"arrival_zenith_spread", "rad", false, false}};

static void write_axis(KellerHdf *hdf, const char *path, uint32_t count, double from, double step, double *axis)
{
    for (uint32_t i = 0; i < count; ++i) axis[i] = from + i * step;
    keller_hdf_table(hdf, path, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 1, (hsize_t[]){count}, "m", axis);
}

KellerStatus keller_maps_create(KellerHdf *hdf, const KellerConfig *config, const KellerReceiverSet *set, KellerMaps *maps,
                                KellerError *error)
{
    size_t longest = set->nx > set->ny ? set->nx : set->ny, size = strlen(set->id) + 64;
    double *axis = malloc((longest + 1) * sizeof *axis);
    char *path = malloc(size);
    if (!axis || !path) {
        free(axis);
        free(path);
        return keller_error_memory(error, longest * sizeof *axis + size);
    }
    snprintf(path, size, "/coverage/%s/x", set->id);
    write_axis(hdf, path, set->nx, set->x0, set->step, axis);
    snprintf(path, size, "/coverage/%s/y", set->id);
    write_axis(hdf, path, set->ny, set->y0, set->step, axis);

    hsize_t ny = set->ny < GRID_CHUNK ? set->ny : GRID_CHUNK, nx = set->nx < GRID_CHUNK ? set->nx : GRID_CHUNK;
    const hsize_t dims[] = {config->transmitter_count, config->frequency_count, set->ny, set->nx};
    const hsize_t flat[] = {dims[0], set->ny, set->nx}, chunk[] = {1, 1, ny, nx}, flat_chunk[] = {1, ny, nx};
    bool some = dims[0] * dims[1] * dims[2] * dims[3] > 0;
    for (int i = 0; i < KELLER_MAP_KINDS; ++i) {
        const KellerMapKind *kind = &keller_map_kinds[i];
        if (kind->sound && !(config->sound.speed > 0)) continue;
        snprintf(path, size, "/coverage/%s/%s", set->id, kind->name);
        maps->dataset[i] = keller_hdf_dataset(hdf, path, H5T_IEEE_F64LE, kind->by_frequency ? 4 : 3, kind->by_frequency ? dims : flat,
                                              kind->unit, !some ? NULL : kind->by_frequency ? chunk : flat_chunk, true);
    }
    free(axis);
    free(path);
    return keller_result_heights(hdf, config, set, error);
}

void keller_maps_write(KellerHdf *hdf, const KellerMaps *maps, const KellerCoverage *c)
{
    const hsize_t start[] = {c->tx, 0, 0, 0}, count[] = {1, c->frequency_count, c->ny, c->nx}, flat[] = {1, c->ny, c->nx};
    const double *const cells[KELLER_MAP_KINDS] = {
        c->path_gain, c->path_gain_incoherent, c->delay_spread, c->strongest_delay, c->level, c->level_a,
        c->angle_spread[KELLER_DEPARTURE_AZIMUTH], c->angle_spread[KELLER_DEPARTURE_ZENITH],
        c->angle_spread[KELLER_ARRIVAL_AZIMUTH], c->angle_spread[KELLER_ARRIVAL_ZENITH]};
    for (int i = 0; i < KELLER_MAP_KINDS; ++i) {
        bool by_frequency = keller_map_kinds[i].by_frequency;
        if (maps->dataset[i] < 0) continue;
        keller_hdf_write(hdf, maps->dataset[i], H5T_NATIVE_DOUBLE, by_frequency ? 4 : 3, start, by_frequency ? count : flat, cells[i]);
    }
}

void keller_maps_close(const KellerMaps *maps)
{
    for (int i = 0; i < KELLER_MAP_KINDS; ++i)
        if (maps->dataset[i] >= 0) H5Dclose(maps->dataset[i]);
}

/* ---- pairs --------------------------------------------------------------------------------------------------------- */

enum { PLAIN = 7 };

/* All columns: those without the angles first. */
static void list_columns(KellerPairColumns *c, KellerColumn *list[PLAIN + KELLER_ANGLES])
{
    KellerColumn *const plain[PLAIN] = {&c->tx, &c->rx, &c->paths, &c->path_gain, &c->path_gain_incoherent, &c->delay_spread,
                                        &c->strongest_delay};
    memcpy(list, plain, sizeof plain);
    for (int a = 0; a < KELLER_ANGLES; ++a) list[PLAIN + a] = &c->spread[a];
}

void keller_pairs_none(KellerPairColumns *c)
{
    KellerColumn *columns[PLAIN + KELLER_ANGLES];
    list_columns(c, columns);
    for (int i = 0; i < PLAIN + KELLER_ANGLES; ++i) *columns[i] = (KellerColumn){.dataset = -1};
}

void keller_pairs_open(KellerHdf *hdf, KellerPairColumns *c, size_t frequency_count)
{
    const hsize_t frequencies[] = {frequency_count};
    const hid_t u4 = H5T_STD_U32LE, u4_memory = H5T_NATIVE_UINT32, f8 = H5T_IEEE_F64LE, f8_memory = H5T_NATIVE_DOUBLE;
    keller_hdf_column(hdf, &c->tx, "/pairs/tx", u4, u4_memory, 0, NULL, NULL);
    keller_hdf_column(hdf, &c->rx, "/pairs/rx", u4, u4_memory, 0, NULL, NULL);
    keller_hdf_column(hdf, &c->paths, "/pairs/paths", u4, u4_memory, 0, NULL, NULL);
    keller_hdf_column(hdf, &c->path_gain, "/pairs/path_gain", f8, f8_memory, 1, frequencies, "1");
    keller_hdf_column(hdf, &c->path_gain_incoherent, "/pairs/path_gain_incoherent", f8, f8_memory, 1, frequencies, "1");
    keller_hdf_column(hdf, &c->delay_spread, "/pairs/delay_spread", f8, f8_memory, 0, NULL, "s");
    keller_hdf_column(hdf, &c->strongest_delay, "/pairs/strongest_delay", f8, f8_memory, 0, NULL, "s");
    for (int a = 0; a < KELLER_ANGLES; ++a) {
        char path[64];
        snprintf(path, sizeof path, "/pairs/%s", keller_spread_names[a]);
        keller_hdf_column(hdf, &c->spread[a], path, f8, f8_memory, 0, NULL, "rad");
    }
}

void keller_pairs_append(KellerHdf *hdf, KellerPairColumns *c, const KellerPairSums *sums)
{
    uint32_t paths = (uint32_t)sums->paths;
    keller_column_append(hdf, &c->tx, &sums->tx, 1);
    keller_column_append(hdf, &c->rx, &sums->rx, 1);
    keller_column_append(hdf, &c->paths, &paths, 1);
    keller_column_append(hdf, &c->path_gain, sums->path_gain, 1);
    keller_column_append(hdf, &c->path_gain_incoherent, sums->path_gain_incoherent, 1);
    keller_column_append(hdf, &c->delay_spread, &sums->delay_spread, 1);
    keller_column_append(hdf, &c->strongest_delay, &sums->strongest_delay, 1);
    for (int a = 0; a < KELLER_ANGLES; ++a) keller_column_append(hdf, &c->spread[a], &sums->angle_spread[a], 1);
}

void keller_pairs_close(KellerHdf *hdf, KellerPairColumns *c)
{
    KellerColumn *columns[PLAIN + KELLER_ANGLES];
    list_columns(c, columns);
    for (int i = 0; i < PLAIN + KELLER_ANGLES; ++i) keller_column_close(hdf, columns[i]);
}
