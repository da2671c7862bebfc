#include "keller/result.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "io/atomic.h"
#include "io/hdf.h"
#include "io/result_geometry.h"
#include "io/result_sound.h"
#include "io/result_sums.h"
#include "io/result_tables.h"
#include "io/result_write.h"

enum { PATH_COLUMNS = 18 };

struct KellerResult {
    KellerAtomic file;
    KellerHdf hdf;
    const KellerConfig *config;
    uint64_t interactions;      /* written so far */
    KellerMaps *maps;                /* [set_count] */
    KellerPairColumns pairs;
    KellerResponseColumns responses;
    union {
        struct {
            KellerColumn tx, rx, offset, length, delay, departure, arrival, doppler, gain, transfer;
            KellerColumn weight, patch, part, kind, position, triangle, wedge, free_end;
        };
        KellerColumn all[PATH_COLUMNS];
    };
};

KellerStatus keller_result_check_target(const char *file, bool force, KellerError *error)
{
    return keller_atomic_check(file, force, error);
}

static bool is_sound(const KellerResult *r) { return r->config->sound.speed > 0; }

const char *keller_result_temporary(const KellerResult *result) { return result->file.temporary; }

/* The message for what went wrong first. */
static KellerStatus write_error(const KellerResult *result, KellerError *error)
{
    const KellerHdf *hdf = &result->hdf;
    return keller_error(error, KELLER_IO, "%s: the result cannot be written: %s", result->file.target,
                        hdf->system_error ? strerror(hdf->system_error) : hdf->reason);
}

static void create_path_columns(KellerResult *r, hsize_t frequencies)
{
    KellerHdf *hdf = &r->hdf;
    const hsize_t two[] = {2}, three[] = {3}, per_frequency[] = {frequencies}, matrices[] = {frequencies, 2, 2};
    const hid_t f8 = H5T_IEEE_F64LE, f8_memory = H5T_NATIVE_DOUBLE, u4 = H5T_STD_U32LE, u4_memory = H5T_NATIVE_UINT32;
    keller_hdf_column(hdf, &r->tx, "/paths/tx", u4, u4_memory, 0, NULL, NULL);
    keller_hdf_column(hdf, &r->rx, "/paths/rx", u4, u4_memory, 0, NULL, NULL);
    keller_hdf_column(hdf, &r->offset, "/paths/offset", H5T_STD_U64LE, H5T_NATIVE_UINT64, 0, NULL, NULL);
    keller_hdf_column(hdf, &r->length, "/paths/length", f8, f8_memory, 0, NULL, "m");
    keller_hdf_column(hdf, &r->delay, "/paths/delay", f8, f8_memory, 0, NULL, "s");
    keller_hdf_column(hdf, &r->departure, "/paths/departure", f8, f8_memory, 1, two, "rad");
    keller_hdf_column(hdf, &r->arrival, "/paths/arrival", f8, f8_memory, 1, two, "rad");
    keller_hdf_column(hdf, &r->doppler, "/paths/doppler", f8, f8_memory, 1, per_frequency, "Hz");
    keller_hdf_column(hdf, &r->gain, "/paths/gain", hdf->complex_type, hdf->complex_type, 1, per_frequency, "1");
    if (!is_sound(r)) keller_hdf_column(hdf, &r->transfer, "/paths/transfer", hdf->complex_type, hdf->complex_type, 3,
                                        matrices, "1");
    keller_hdf_column(hdf, &r->weight, "/paths/weight", f8, f8_memory, 0, NULL, "1");
    keller_hdf_column(hdf, &r->patch, "/paths/patch", f8, f8_memory, 0, NULL, "m2");
    keller_hdf_column(hdf, &r->part, "/paths/part", f8, f8_memory, 1, two, "m");
    keller_hdf_column(hdf, &r->kind, "/interactions/kind", hdf->interaction_type, hdf->interaction_type, 0, NULL, NULL);
    keller_hdf_column(hdf, &r->position, "/interactions/position", f8, f8_memory, 1, three, "m");
    keller_hdf_column(hdf, &r->triangle, "/interactions/triangle", u4, u4_memory, 0, NULL, NULL);
    keller_hdf_column(hdf, &r->wedge, "/interactions/wedge", u4, u4_memory, 0, NULL, NULL);
    keller_hdf_column(hdf, &r->free_end, "/interactions/free_end", H5T_STD_U8LE, H5T_NATIVE_UINT8, 0, NULL, NULL);
    keller_column_append(hdf, &r->offset, &r->interactions, 1);
}

/* Closes all of HDF5's side; a failure is kept in hdf. */
static void close_file(KellerResult *r)
{
    for (size_t i = 0; i < PATH_COLUMNS; ++i) keller_column_close(&r->hdf, &r->all[i]);
    keller_pairs_close(&r->hdf, &r->pairs);
    keller_responses_close(&r->hdf, &r->responses);
    for (size_t s = 0; r->maps && s < r->config->set_count; ++s) keller_maps_close(&r->maps[s]);
    keller_hdf_close(&r->hdf);
    free(r->maps);
    r->maps = NULL;
}

static KellerStatus fill(KellerResult *r, const KellerScene *scene, const char *command_line, KellerError *error)
{
    keller_hdf_create(&r->hdf, r->file.temporary);
    if (r->hdf.failed) return write_error(r, error);
    KellerStatus status = keller_result_tables(&r->hdf, r->config, scene, command_line, error);
    if (status != KELLER_OK) return status;
    status = keller_result_geometry(&r->hdf, r->config, scene, error);
    if (status != KELLER_OK) return status;
    create_path_columns(r, r->config->frequency_count);
    keller_pairs_open(&r->hdf, &r->pairs, r->config->frequency_count);
    if (r->config->response_rate > 0) keller_responses_open(&r->hdf, &r->responses, r->config);
    for (size_t s = 0; s < r->config->set_count && r->config->output_coverage && status == KELLER_OK; ++s)
        if (r->config->sets[s].kind == KELLER_SET_GRID)
            status = keller_maps_create(&r->hdf, r->config, &r->config->sets[s], &r->maps[s], error);
    if (status == KELLER_OK && r->hdf.failed) status = write_error(r, error);
    return status;
}

KellerStatus keller_result_begin(const char *file, bool force, const KellerConfig *config, KellerResult **result,
                                 KellerError *error)
{
    *result = NULL;
    KellerResult *r = calloc(1, sizeof *r);
    KellerMaps *maps = malloc((config->set_count + 1) * sizeof *maps);
    if (!r || !maps) {
        free(r);
        free(maps);
        return keller_error_memory(error, sizeof *r + config->set_count * sizeof *maps);
    }
    for (size_t s = 0; s < config->set_count; ++s)
        for (int i = 0; i < KELLER_MAP_KINDS; ++i) maps[s].dataset[i] = -1;
    for (size_t i = 0; i < PATH_COLUMNS; ++i) r->all[i].dataset = -1;
    keller_pairs_none(&r->pairs);
    r->hdf.file = -1;
    r->config = config;
    r->maps = maps;
    KellerStatus status = keller_atomic_begin(file, force, &r->file, error);
    if (status == KELLER_OK) {
        *result = r;
    } else {
        free(maps);
        free(r);
    }
    return status;
}

KellerStatus keller_result_fill(KellerResult *r, const KellerScene *scene, const char *command_line, KellerError *error)
{
    KellerHdfQuiet quiet = keller_hdf_quiet();
    KellerStatus status = fill(r, scene, command_line, error);
    keller_hdf_loud(quiet);
    return status;
}

KellerStatus keller_result_create(const char *file, bool force, const KellerConfig *config, const KellerScene *scene,
                                  const char *command_line, KellerResult **result, KellerError *error)
{
    KellerStatus status = keller_result_begin(file, force, config, result, error);
    if (status != KELLER_OK) return status;
    status = keller_result_fill(*result, scene, command_line, error);
    if (status == KELLER_OK) return KELLER_OK;
    keller_result_abandon(*result);
    *result = NULL;
    return status;
}

KellerStatus keller_result_append(KellerResult *r, const KellerPathBatch *batch, KellerError *error)
{
    assert(batch->frequency_count == r->config->frequency_count);
    KellerHdfQuiet quiet = keller_hdf_quiet();
    KellerHdf *hdf = &r->hdf;
    size_t n = batch->count, m = batch->interaction_count;
    keller_column_append(hdf, &r->tx, batch->tx, n);
    keller_column_append(hdf, &r->rx, batch->rx, n);
    for (size_t p = 0; p < n; ++p) {
        uint64_t end = r->interactions + batch->offset[p + 1];
        keller_column_append(hdf, &r->offset, &end, 1);
    }
    keller_column_append(hdf, &r->length, batch->length, n);
    keller_column_append(hdf, &r->delay, batch->delay, n);
    keller_column_append(hdf, &r->departure, batch->departure, n);
    keller_column_append(hdf, &r->arrival, batch->arrival, n);
    keller_column_append(hdf, &r->doppler, batch->doppler, n);
    keller_column_append(hdf, &r->gain, batch->gain, n);
    if (!is_sound(r)) keller_column_append(hdf, &r->transfer, batch->transfer, n);
    keller_column_append(hdf, &r->weight, batch->weight, n);
    keller_column_append(hdf, &r->patch, batch->patch, n);
    keller_column_append(hdf, &r->part, batch->part, n);
    keller_column_append(hdf, &r->kind, batch->interaction_kind, m);
    keller_column_append(hdf, &r->position, batch->interaction_position, m);
    keller_column_append(hdf, &r->triangle, batch->interaction_triangle, m);
    keller_column_append(hdf, &r->wedge, batch->interaction_wedge, m);
    keller_column_append(hdf, &r->free_end, batch->interaction_free_end, m);
    r->interactions += m;
    keller_hdf_loud(quiet);
    return hdf->failed ? write_error(r, error) : KELLER_OK;
}

KellerStatus keller_result_coverage(KellerResult *r, const KellerCoverage *c, KellerError *error)
{
    assert(c->set < r->config->set_count && c->tx < r->config->transmitter_count);
    assert(r->config->sets[c->set].ny == c->ny && r->config->sets[c->set].nx == c->nx);
    const KellerMaps *maps = &r->maps[c->set];
    KellerHdfQuiet quiet = keller_hdf_quiet();
    keller_maps_write(&r->hdf, maps, c); /* none where coverage was not asked for */
    keller_hdf_loud(quiet);
    return r->hdf.failed ? write_error(r, error) : KELLER_OK;
}

KellerStatus keller_result_pair(KellerResult *r, const KellerPairSums *sums, KellerError *error)
{
    assert(sums->frequency_count == r->config->frequency_count);
    KellerHdfQuiet quiet = keller_hdf_quiet();
    keller_pairs_append(&r->hdf, &r->pairs, sums);
    keller_hdf_loud(quiet);
    return r->hdf.failed ? write_error(r, error) : KELLER_OK;
}

KellerStatus keller_result_response(KellerResult *r, const KellerResponse *response, KellerError *error)
{
    assert(r->responses.open);
    KellerHdfQuiet quiet = keller_hdf_quiet();
    KellerStatus status = keller_responses_append(&r->hdf, &r->responses, response, error);
    keller_hdf_loud(quiet);
    return status == KELLER_OK && r->hdf.failed ? write_error(r, error) : status;
}

static KellerStatus statistic(KellerResult *r, const char *name, hid_t type, hid_t memory, const char *unit,
                              const void *value, KellerError *error)
{
    char path[128];
    snprintf(path, sizeof path, "/statistics/%s", name);
    KellerHdfQuiet quiet = keller_hdf_quiet();
    keller_hdf_table(&r->hdf, path, type, memory, 0, NULL, unit, value);
    keller_hdf_loud(quiet);
    return r->hdf.failed ? write_error(r, error) : KELLER_OK;
}

KellerStatus keller_result_statistic(KellerResult *r, const char *name, double value, const char *unit,
                                     KellerError *error)
{
    return statistic(r, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, unit, &value, error);
}

KellerStatus keller_result_statistic_text(KellerResult *r, const char *name, const char *value, KellerError *error)
{
    return statistic(r, name, r->hdf.text_type, r->hdf.text_type, NULL, &value, error);
}

KellerStatus keller_result_finish(KellerResult *r, KellerError *error)
{
    KellerHdfQuiet quiet = keller_hdf_quiet();
    close_file(r);
    keller_hdf_loud(quiet);
    KellerStatus status;
    if (r->hdf.failed) {
        status = write_error(r, error);
        keller_atomic_abandon(&r->file);
    } else {
        status = keller_atomic_finish(&r->file, error);
    }
    free(r);
    return status;
}

void keller_result_abandon(KellerResult *r)
{
    if (!r) return;
    /* Deleted first: the name is gone whatever HDF5 makes of closing a file that it could not write. */
    keller_atomic_abandon(&r->file);
    KellerHdfQuiet quiet = keller_hdf_quiet();
    close_file(r);
    keller_hdf_loud(quiet);
    free(r);
}
