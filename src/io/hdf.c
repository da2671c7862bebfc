#include "io/hdf.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "keller/path.h"

/* Compression: level 1 after the byte shuffle; higher levels gain a few per cent on mantissas and cost several times as
 * much. */
enum { DEFLATE_LEVEL = 1, CHUNK_BYTES = 1 << 18, CHUNK_ROWS = 1 << 14, COMPRESS_FROM = 1 << 14 };

KellerHdfQuiet keller_hdf_quiet(void)
{
    KellerHdfQuiet quiet = {NULL, NULL};
    H5Eget_auto2(H5E_DEFAULT, &quiet.function, &quiet.data);
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    return quiet;
}

void keller_hdf_loud(KellerHdfQuiet quiet) { H5Eset_auto2(H5E_DEFAULT, quiet.function, quiet.data); }

typedef struct {
    char *text;
    size_t size;
    int number;
} Reason;

static herr_t collect_reason(unsigned n, const H5E_error2_t *entry, void *data)
{
    Reason *reason = data;
    if (!entry->desc) return 0;
    if (n == 0) snprintf(reason->text, reason->size, "%s", entry->desc);
    const char *at = strstr(entry->desc, "errno = ");
    if (at && reason->number == 0) reason->number = atoi(at + 8);
    return 0;
}

int keller_hdf_reason(char *text, size_t size)
{
    Reason reason = {text, size, 0};
    snprintf(text, size, "unknown HDF5 error");
    H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, collect_reason, &reason);
    return reason.number;
}

/* Keeps the first failure: HDF5's stack holds it only until the next call. */
static bool good(KellerHdf *hdf, int64_t result)
{
    if (result >= 0) return !hdf->failed;
    if (!hdf->failed) {
        hdf->failed = true;
        hdf->system_error = keller_hdf_reason(hdf->reason, sizeof hdf->reason);
    }
    return false;
}

static void fail_memory(KellerHdf *hdf)
{
    if (hdf->failed) return;
    hdf->failed = true;
    hdf->system_error = ENOMEM;
    snprintf(hdf->reason, sizeof hdf->reason, "out of memory");
}

static hid_t enumeration(KellerHdf *hdf, size_t count, const char *const *names)
{
    hid_t type = H5Tenum_create(H5T_STD_U8LE);
    for (uint8_t value = 0; value < count; ++value)
        good(hdf, H5Tenum_insert(type, names[value], &value));
    return type;
}

void keller_hdf_create(KellerHdf *hdf, const char *file)
{
    *hdf = (KellerHdf){.file = -1};
    hdf->complex_type = H5Tcreate(H5T_COMPOUND, 2 * sizeof(double));
    good(hdf, H5Tinsert(hdf->complex_type, "r", 0, H5T_IEEE_F64LE));
    good(hdf, H5Tinsert(hdf->complex_type, "i", sizeof(double), H5T_IEEE_F64LE));
    hdf->text_type = H5Tcopy(H5T_C_S1);
    good(hdf, H5Tset_size(hdf->text_type, H5T_VARIABLE));
    good(hdf, H5Tset_cset(hdf->text_type, H5T_CSET_UTF8));
    hdf->interaction_type = enumeration(hdf, 4, (const char *const[]){"reflection", "diffraction", "transmission",
                                                                      "scattering"});
    hdf->set_type = enumeration(hdf, 3, (const char *const[]){"point", "route", "grid"});
    hdf->flag_type = H5Tenum_create(H5T_STD_I8LE);   /* h5py's convention for a boolean */
    for (int8_t value = 0; value < 2; ++value)
        good(hdf, H5Tenum_insert(hdf->flag_type, value ? "TRUE" : "FALSE", &value));
    hdf->links = H5Pcreate(H5P_LINK_CREATE);
    good(hdf, H5Pset_create_intermediate_group(hdf->links, 1));
    good(hdf, H5Pset_char_encoding(hdf->links, H5T_CSET_UTF8));
    /* No times of change inside: two runs of one configuration give one file (with SOURCE_DATE_EPOCH). */
    hid_t creation = H5Pcreate(H5P_FILE_CREATE);
    good(hdf, H5Pset_obj_track_times(creation, 0));
    if (!hdf->failed) good(hdf, hdf->file = H5Fcreate(file, H5F_ACC_TRUNC, creation, H5P_DEFAULT));
    H5Pclose(creation);
}

void keller_hdf_close(KellerHdf *hdf)
{
    hid_t types[] = {hdf->complex_type, hdf->text_type, hdf->interaction_type, hdf->set_type, hdf->flag_type};
    for (size_t i = 0; i < sizeof types / sizeof *types; ++i)
        if (types[i] > 0) H5Tclose(types[i]);
    if (hdf->links > 0) H5Pclose(hdf->links);
    if (hdf->file >= 0) good(hdf, H5Fclose(hdf->file));
    hdf->file = -1;
}

void keller_hdf_group(KellerHdf *hdf, const char *path)
{
    if (hdf->failed) return;
    hid_t group = H5Gcreate2(hdf->file, path, hdf->links, H5P_DEFAULT, H5P_DEFAULT);
    if (good(hdf, group)) good(hdf, H5Gclose(group));
}

static void attribute(KellerHdf *hdf, hid_t object, const char *name, hid_t type, hid_t memory, const void *value)
{
    if (hdf->failed) return;
    hid_t space = H5Screate(H5S_SCALAR);
    hid_t id = H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    if (good(hdf, id)) {
        good(hdf, H5Awrite(id, memory, value));
        H5Aclose(id);
    }
    H5Sclose(space);
}

void keller_hdf_attribute_text(KellerHdf *hdf, hid_t object, const char *name, const char *text)
{
    attribute(hdf, object, name, hdf->text_type, hdf->text_type, &text);
}

void keller_hdf_attribute_u4(KellerHdf *hdf, hid_t object, const char *name, uint32_t value)
{
    attribute(hdf, object, name, H5T_STD_U32LE, H5T_NATIVE_UINT32, &value);
}

/* Creation properties: no times, and where `chunk` says so chunks with shuffle and deflate. */
static hid_t properties(KellerHdf *hdf, int rank, const hsize_t *chunk, bool nan)
{
    hid_t list = H5Pcreate(H5P_DATASET_CREATE);
    good(hdf, H5Pset_obj_track_times(list, 0));
    if (nan) {
        double fill = NAN;
        good(hdf, H5Pset_fill_value(list, H5T_NATIVE_DOUBLE, &fill));
    }
    if (chunk) {
        good(hdf, H5Pset_chunk(list, rank, chunk));
        good(hdf, H5Pset_shuffle(list));
        good(hdf, H5Pset_deflate(list, DEFLATE_LEVEL));
    }
    return list;
}

static hid_t create(KellerHdf *hdf, const char *path, hid_t type, hid_t space, hid_t list, const char *units)
{
    hid_t dataset = -1;
    if (!hdf->failed) {
        good(hdf, dataset = H5Dcreate2(hdf->file, path, type, space, hdf->links, list, H5P_DEFAULT));
        if (units) keller_hdf_attribute_text(hdf, dataset, "units", units);
    }
    H5Pclose(list);
    H5Sclose(space);
    return dataset;
}

hid_t keller_hdf_dataset(KellerHdf *hdf, const char *path, hid_t type, int rank, const hsize_t *dims, const char *units,
                         const hsize_t *chunk, bool nan)
{
    if (hdf->failed) return -1;
    hid_t space = rank > 0 ? H5Screate_simple(rank, dims, NULL) : H5Screate(H5S_SCALAR);
    return create(hdf, path, type, space, properties(hdf, rank, chunk, nan), units);
}

void keller_hdf_table(KellerHdf *hdf, const char *path, hid_t type, hid_t memory, int rank, const hsize_t *dims,
                      const char *units, const void *data)
{
    if (hdf->failed) return;
    hsize_t chunk[4], values = 1, tail = 1;
    for (int i = 0; i < rank; ++i) values *= dims[i];
    for (int i = 1; i < rank; ++i) tail *= chunk[i] = dims[i];
    size_t size = H5Tget_size(type);
    bool compress = rank > 0 && values * size >= COMPRESS_FROM && H5Tis_variable_str(type) <= 0;
    if (compress) {
        hsize_t rows = CHUNK_BYTES / (tail * size);
        chunk[0] = rows < 1 ? 1 : rows > dims[0] ? dims[0] : rows;
    }
    hid_t dataset = keller_hdf_dataset(hdf, path, type, rank, dims, units, compress ? chunk : NULL, false);
    if (dataset < 0) return;
    if (values > 0 && !hdf->failed) good(hdf, H5Dwrite(dataset, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, data));
    good(hdf, H5Dclose(dataset));
}

void keller_hdf_write(KellerHdf *hdf, hid_t dataset, hid_t memory, int rank, const hsize_t *start,
                      const hsize_t *count, const void *data)
{
    if (hdf->failed) return;
    hid_t space = H5Dget_space(dataset);
    hid_t block = H5Screate_simple(rank, count, NULL);
    if (good(hdf, H5Sselect_hyperslab(space, H5S_SELECT_SET, start, NULL, count, NULL)))
        good(hdf, H5Dwrite(dataset, memory, block, space, H5P_DEFAULT, data));
    H5Sclose(block);
    H5Sclose(space);
}

void keller_hdf_texts(KellerHdf *hdf, const char *path, size_t count, char *const *texts)
{
    keller_hdf_table(hdf, path, hdf->text_type, hdf->text_type, 1, (hsize_t[]){count}, NULL, texts);
}

void keller_hdf_column(KellerHdf *hdf, KellerColumn *column, const char *path, hid_t type, hid_t memory,
                       int tail_rank, const hsize_t *tail, const char *units)
{
    *column = (KellerColumn){.dataset = -1, .memory = memory, .rank = 1 + tail_rank};
    if (hdf->failed) return;
    hsize_t dims[4] = {0}, most[4] = {H5S_UNLIMITED}, chunk[4] = {0};
    column->row_bytes = H5Tget_size(memory);
    for (int i = 0; i < tail_rank; ++i) {
        dims[i + 1] = most[i + 1] = chunk[i + 1] = column->tail[i] = tail[i];
        column->row_bytes *= (size_t)tail[i];
    }
    size_t rows = CHUNK_BYTES / column->row_bytes;
    column->chunk_rows = rows < 1 ? 1 : rows > CHUNK_ROWS ? CHUNK_ROWS : rows;
    chunk[0] = column->chunk_rows;
    column->buffer = malloc(column->chunk_rows * column->row_bytes);
    if (!column->buffer) {
        fail_memory(hdf);
        return;
    }
    hid_t list = properties(hdf, column->rank, chunk, false);
    column->dataset = create(hdf, path, type, H5Screate_simple(column->rank, dims, most), list, units);
}

void keller_column_flush(KellerHdf *hdf, KellerColumn *column)
{
    if (hdf->failed || column->buffered == 0) return;
    hsize_t dims[4], start[4] = {column->written}, count[4] = {column->buffered};
    for (int i = 1; i < column->rank; ++i) dims[i] = count[i] = column->tail[i - 1];
    dims[0] = column->written + column->buffered;
    if (good(hdf, H5Dset_extent(column->dataset, dims)))
        keller_hdf_write(hdf, column->dataset, column->memory, column->rank, start, count, column->buffer);
    column->written += column->buffered;
    column->buffered = 0;
}

void keller_column_append(KellerHdf *hdf, KellerColumn *column, const void *rows, size_t count)
{
    const unsigned char *from = rows;
    while (count > 0 && !hdf->failed) {
        size_t room = column->chunk_rows - column->buffered, part = count < room ? count : room;
        memcpy(column->buffer + column->buffered * column->row_bytes, from, part * column->row_bytes);
        column->buffered += part;
        from += part * column->row_bytes;
        count -= part;
        if (column->buffered == column->chunk_rows) keller_column_flush(hdf, column);
    }
}

void keller_column_close(KellerHdf *hdf, KellerColumn *column)
{
    keller_column_flush(hdf, column);
    if (column->dataset >= 0) good(hdf, H5Dclose(column->dataset));
    free(column->buffer);
    *column = (KellerColumn){.dataset = -1};
}
