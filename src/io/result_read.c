#include "io/result_read.h"

#include <complex.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "io/hdf.h"
#include "io/result_data.h"
#include "io/result_tables.h"

/* ---- datasets ---------------------------------------------------------------------------------------------------- */

KellerStatus keller_reader_box(KellerReader *reader, const char *path, KellerCell cell, int rank, const uint64_t *start,
                               const uint64_t *count, void *data, KellerError *error)
{
    KellerHdfQuiet quiet = keller_hdf_quiet();
    KellerTable table;
    KellerStatus status = keller_table_open(reader, path, &table, error);
    if (status == KELLER_OK) {
        status = keller_table_box(reader, &table, path, cell, rank, start, count, data, error);
        keller_table_close(&table);
    }
    keller_hdf_loud(quiet);
    return status;
}

KellerStatus keller_reader_rows(KellerReader *reader, const char *path, KellerCell cell, uint64_t width, uint64_t first,
                                uint64_t count, void *data, KellerError *error)
{
    KellerHdfQuiet quiet = keller_hdf_quiet();
    KellerTable table;
    KellerStatus status = keller_table_open(reader, path, &table, error);
    if (status == KELLER_OK) {
        uint64_t start[4] = {first}, size[4] = {count}, cells = 1;
        for (int i = 1; i < table.rank; ++i) cells *= size[i] = table.dims[i];
        status = table.rank < 1 || cells != width
                     ? keller_reader_bad(reader, error, path, "has another shape")
                     : keller_table_box(reader, &table, path, cell, table.rank, start, size, data, error);
        keller_table_close(&table);
    }
    keller_hdf_loud(quiet);
    return status;
}

bool keller_reader_has(KellerReader *reader, const char *path)
{
    KellerHdfQuiet quiet = keller_hdf_quiet();
    bool has = keller_reader_hard_path(reader->file, path);
    keller_hdf_loud(quiet);
    return has;
}

KellerStatus keller_reader_text(KellerReader *reader, const char *path, char **text, KellerError *error)
{
    KellerHdfQuiet quiet = keller_hdf_quiet();
    char **texts = NULL;
    KellerStatus status = keller_reader_texts(reader, path, &texts, NULL, error);
    if (status == KELLER_OK) {
        *text = texts[0];
        free(texts);
    }
    keller_hdf_loud(quiet);
    return status;
}

KellerStatus keller_reader_statistics(KellerReader *reader, KellerVisitStatistic visit, void *context,
                                      KellerError *error)
{
    KellerHdfQuiet quiet = keller_hdf_quiet();
    KellerStatus status = KELLER_OK;
    H5G_info_t group = {0};
    if (!keller_reader_hard_path(reader->file, "/statistics") ||
        H5Gget_info_by_name(reader->file, "/statistics", &group, H5P_DEFAULT) < 0)
        status = keller_reader_bad(reader, error, "/statistics", "is missing");
    for (hsize_t i = 0; i < group.nlinks && i < 1000 && status == KELLER_OK; ++i) {
        char name[100], path[120];
        if (H5Lget_name_by_idx(reader->file, "/statistics", H5_INDEX_NAME, H5_ITER_INC, i, name, sizeof name,
                               H5P_DEFAULT) < 0) {
            status = keller_reader_bad(reader, error, "/statistics", "cannot be read (damaged or cut short)");
            break;
        }
        snprintf(path, sizeof path, "/statistics/%s", name);
        KellerTable table;
        status = keller_table_open(reader, path, &table, error);
        if (status != KELLER_OK) break;
        double value = 0;
        char **texts = NULL, *unit = keller_reader_attribute_text(table.dataset, "units");
        if (H5Tget_class(table.type) == H5T_STRING) {
            status = keller_reader_texts(reader, path, &texts, NULL, error);
            if (status == KELLER_OK) visit(context, name, 0, NULL, texts[0]);
        } else {
            status = keller_table_box(reader, &table, path, KELLER_CELL_F8, 0, NULL, NULL, &value, error);
            if (status == KELLER_OK) visit(context, name, value, unit ? unit : "1", NULL);
        }
        if (texts) free(texts[0]);
        free(texts);
        free(unit);
        keller_table_close(&table);
    }
    keller_hdf_loud(quiet);
    return status;
}

/* ---- opening --------------------------------------------------------------------------------------------------- */

static KellerStatus row_count(KellerReader *reader, const char *path, uint64_t *rows, KellerError *error)
{
    KellerTable table;
    KellerStatus status = keller_table_open(reader, path, &table, error);
    if (status != KELLER_OK) return status;
    *rows = table.dims[0];
    if (table.rank < 1) status = keller_reader_bad(reader, error, path, "has another number of dimensions");
    keller_table_close(&table);
    return status;
}

/* Allocates and reads whole a column of `rows` rows. */
static KellerStatus whole(KellerReader *reader, const char *path, KellerCell cell, size_t cell_bytes, uint64_t width,
                          uint64_t rows, void *pointer, KellerError *error)
{
    void *data = calloc(rows + 1, cell_bytes * width);
    if (!data) return keller_error_memory(error, (rows + 1) * cell_bytes * width);
    memcpy(pointer, &data, sizeof data);   /* owned by the reader from here on */
    uint64_t found = 0;
    KellerStatus status = row_count(reader, path, &found, error);
    if (status == KELLER_OK && found != rows)
        status = keller_reader_bad(reader, error, path, "has another length than its neighbours");
    return status == KELLER_OK ? keller_reader_rows(reader, path, cell, width, 0, rows, data, error) : status;
}

KellerStatus keller_reader_row_count(KellerReader *reader, const char *path, uint64_t *rows, KellerError *error)
{
    KellerHdfQuiet quiet = keller_hdf_quiet();
    KellerStatus status = row_count(reader, path, rows, error);
    keller_hdf_loud(quiet);
    return status;
}

static KellerStatus read_stations(KellerReader *reader, KellerError *error)
{
    KellerResultInfo *info = &reader->info;
    KellerStatus s = row_count(reader, "/frequencies", &info->frequency_count, error);
    if (s == KELLER_OK)
        s = whole(reader, "/frequencies", KELLER_CELL_F8, 8, 1, info->frequency_count, &info->frequencies, error);
    if (s == KELLER_OK)
        s = keller_reader_texts(reader, "/transmitters/id", &info->transmitter_ids, &info->transmitter_count, error);
    uint64_t transmitters = info->transmitter_count;
    if (s == KELLER_OK)
        s = whole(reader, "/transmitters/position", KELLER_CELL_F8, 8, 3, transmitters, &info->transmitter_positions,
                  error);
    if (s == KELLER_OK)
        s = whole(reader, "/transmitters/power", KELLER_CELL_F8, 8, 1, transmitters, &info->transmitter_powers, error);
    if (s == KELLER_OK) s = keller_reader_texts(reader, "/sets/id", &info->set_ids, &info->set_count, error);
    uint64_t sets = info->set_count;
    if (s == KELLER_OK) s = whole(reader, "/sets/kind", KELLER_CELL_ENUM, 1, 1, sets, &info->set_kinds, error);
    if (s == KELLER_OK) s = whole(reader, "/sets/shape", KELLER_CELL_U4, 4, 2, sets, &info->set_shapes, error);
    if (s == KELLER_OK) s = row_count(reader, "/receivers/set", &info->receiver_count, error);
    uint64_t receivers = info->receiver_count;
    if (s == KELLER_OK && receivers > KELLER_MAX_RECEIVERS)
        s = keller_reader_bad(reader, error, "/receivers/set", "is too long");
    if (s == KELLER_OK)
        s = whole(reader, "/receivers/set", KELLER_CELL_U4, 4, 1, receivers, &info->receiver_sets, error);
    if (s == KELLER_OK)
        s = whole(reader, "/receivers/index", KELLER_CELL_U4, 4, 1, receivers, &info->receiver_indices, error);
    for (uint64_t r = 0; r < receivers && s == KELLER_OK; ++r)
        if (info->receiver_sets[r] >= sets)
            s = keller_reader_bad(reader, error, "/receivers/set", "names a set that is not there");
    for (uint64_t i = 0; i < sets && s == KELLER_OK; ++i) {
        if (info->set_kinds[i] > KELLER_SET_GRID)
            s = keller_reader_bad(reader, error, "/sets/kind", "holds an unknown kind");
        if ((uint64_t)info->set_shapes[i][0] * info->set_shapes[i][1] > KELLER_MAX_RECEIVERS)
            s = keller_reader_bad(reader, error, "/sets/shape", "is too large");
    }
    return s;
}

static KellerStatus read_counts(KellerReader *reader, KellerError *error)
{
    KellerResultInfo *info = &reader->info;
    KellerStatus s = keller_reader_texts(reader, "/materials/name", &info->materials, &info->material_count, error);
    if (s == KELLER_OK) s = row_count(reader, "/scene/vertices", &info->vertices, error);
    if (s == KELLER_OK) s = row_count(reader, "/scene/triangles", &info->triangles, error);
    if (s == KELLER_OK) s = row_count(reader, "/scene/wedges/n", &info->wedges, error);
    if (s == KELLER_OK) s = row_count(reader, "/scene/objects", &info->objects, error);
    if (s == KELLER_OK) s = row_count(reader, "/paths/tx", &info->paths, error);
    if (s == KELLER_OK) s = row_count(reader, "/interactions/kind", &info->interactions, error);
    static const char *const columns[] = {"rx", "offset", "length", "delay", "departure", "arrival", "doppler", "gain",
                                          "transfer"};
    for (size_t i = 0; i < sizeof columns / sizeof *columns && s == KELLER_OK; ++i) {
        char path[40];
        uint64_t rows = 0;
        if (strcmp(columns[i], "transfer") == 0 && strcmp(info->domain, "acoustic") == 0) continue;
        snprintf(path, sizeof path, "/paths/%s", columns[i]);
        s = row_count(reader, path, &rows, error);
        if (s == KELLER_OK && rows != info->paths + (strcmp(columns[i], "offset") == 0))
            s = keller_reader_bad(reader, error, path, "has another length than its neighbours");
    }
    return s;
}

/* /responses, where the run made any: rows that agree, samples that memory holds. */
static KellerStatus read_responses(KellerReader *reader, KellerError *error)
{
    KellerResultInfo *info = &reader->info;
    if (!keller_reader_hard_path(reader->file, "/responses/pressure")) return KELLER_OK;
    KellerTable table;
    KellerStatus status = keller_table_open(reader, "/responses/pressure", &table, error);
    if (status != KELLER_OK) return status;
    info->responses = table.dims[0];
    info->response_samples = table.rank == 2 ? table.dims[1] : 0;
    keller_table_close(&table);
    uint64_t rows[2] = {0, 0};
    status = row_count(reader, "/responses/tx", &rows[0], error);
    if (status == KELLER_OK) status = row_count(reader, "/responses/rx", &rows[1], error);
    if (status == KELLER_OK && (rows[0] != info->responses || rows[1] != info->responses))
        status = keller_reader_bad(reader, error, "/responses", "has columns of different lengths");
    return status;
}

/* A regular file that begins as HDF5 does; opening a pipe could wait for ever. */
static KellerStatus check_file(const char *file, KellerError *error)
{
    struct stat status;
    if (stat(file, &status) != 0)
        return keller_error(error, KELLER_IO, "%s: cannot be opened: %s", file, strerror(errno));
    if (!S_ISREG(status.st_mode))
        return keller_error(error, KELLER_IO, "%s: is not a regular file; expected a result file", file);
    int descriptor = open(file, O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) return keller_error(error, KELLER_IO, "%s: cannot be opened: %s", file, strerror(errno));
    unsigned char head[8] = {0};
    ssize_t got = read(descriptor, head, sizeof head);
    close(descriptor);
    if (got != 8 || memcmp(head, "\x89HDF\r\n\x1a\n", 8) != 0)
        return keller_error(error, KELLER_BAD_INPUT, "%s: is not an HDF5 file; expected a result of keller run", file);
    return KELLER_OK;
}

static KellerStatus open_checked(KellerReader *reader, KellerError *error)
{
    KellerResultInfo *info = &reader->info;
    reader->complex_type = H5Tcreate(H5T_COMPOUND, sizeof(double complex));
    H5Tinsert(reader->complex_type, "r", 0, H5T_NATIVE_DOUBLE);
    H5Tinsert(reader->complex_type, "i", sizeof(double), H5T_NATIVE_DOUBLE);
    reader->file = H5Fopen(reader->name, H5F_ACC_RDONLY, H5P_DEFAULT);
    if (reader->file < 0)
        return keller_error(error, KELLER_BAD_INPUT,
                            "%s: is an HDF5 file that is damaged or cut short; expected a result of keller run",
                            reader->name);
    char *format = keller_reader_attribute_text(reader->file, "format");
    bool ours = format && strcmp(format, "keller") == 0;
    free(format);
    if (!ours)
        return keller_error(error, KELLER_BAD_INPUT,
                            "%s: is an HDF5 file of another kind; expected a result of keller run (attribute format = "
                            "\"keller\")", reader->name);
    if (!keller_reader_attribute_u4(reader->file, "format_version", &info->format_version))
        return keller_reader_bad(reader, error, "the attribute format_version", "is missing");
    if (info->format_version != KELLER_FORMAT_VERSION)
        return keller_error(error, KELLER_BAD_INPUT, "%s: has format version %u; this program reads version %u",
                            reader->name, info->format_version, KELLER_FORMAT_VERSION);
    struct { const char *name; char **text; } const texts[] = {
        {"program_version", &info->program_version}, {"created", &info->created}, {"domain", &info->domain},
        {"config_sha256", &info->config_sha256}, {"command_line", &info->command_line}};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; ++i) {
        *texts[i].text = keller_reader_attribute_text(reader->file, texts[i].name);
        if (!*texts[i].text) return keller_reader_bad(reader, error, texts[i].name, "is missing from the attributes");
    }
    KellerStatus status = read_stations(reader, error);
    if (status == KELLER_OK) status = read_counts(reader, error);
    return status == KELLER_OK ? read_responses(reader, error) : status;
}

KellerStatus keller_reader_open(const char *file, KellerReader **reader, KellerError *error)
{
    *reader = NULL;
    KellerStatus status = check_file(file, error);
    if (status != KELLER_OK) return status;
    KellerReader *r = calloc(1, sizeof *r);
    if (r) r->name = strdup(file);
    if (!r || !r->name) {
        free(r);
        return keller_error_memory(error, sizeof *r);
    }
    KellerHdfQuiet quiet = keller_hdf_quiet();
    r->file = -1;
    status = open_checked(r, error);
    keller_hdf_loud(quiet);
    if (status == KELLER_OK) *reader = r;
    else keller_reader_close(r);
    return status;
}

static void free_texts(char **texts, uint64_t count)
{
    for (uint64_t i = 0; texts && i < count; ++i) free(texts[i]);
    free(texts);
}

void keller_reader_close(KellerReader *reader)
{
    if (!reader) return;
    KellerHdfQuiet quiet = keller_hdf_quiet();
    if (reader->complex_type > 0) H5Tclose(reader->complex_type);
    if (reader->file >= 0) H5Fclose(reader->file);
    keller_hdf_loud(quiet);
    KellerResultInfo *info = &reader->info;
    free_texts(info->transmitter_ids, info->transmitter_count);
    free_texts(info->set_ids, info->set_count);
    free_texts(info->materials, info->material_count);
    void *const owned[] = {info->program_version, info->created, info->domain, info->config_sha256, info->command_line,
                           info->frequencies, info->transmitter_positions, info->transmitter_powers,
                           info->receiver_sets, info->receiver_indices, info->set_kinds, info->set_shapes,
                           reader->name};
    for (size_t i = 0; i < sizeof owned / sizeof *owned; ++i) free(owned[i]);
    free(reader);
}

const KellerResultInfo *keller_reader_info(const KellerReader *reader) { return &reader->info; }
