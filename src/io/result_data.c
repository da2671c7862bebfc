#include "io/result_data.h"

#include <stdlib.h>
#include <string.h>

/* Deflate cannot pack tighter than 1 : 1032; a dataset that claims more than this many times what it stores was never
 * written by keller and would only make its reader count to the end of the universe. */
enum { DENSEST = 1100, SLACK_BYTES = 1 << 16 };
static const uint64_t largest_chunk = (uint64_t)1 << 30;
static const size_t longest_text = (size_t)1 << 28;

KellerStatus keller_reader_bad(const KellerReader *reader, KellerError *error, const char *path, const char *what)
{
    return keller_error(error, KELLER_BAD_INPUT, "%s: %s %s; expected a complete result of keller run", reader->name,
                        path, what);
}

/* ---- datasets, distrustfully ---------------------------------------------------------------------------------- */

bool keller_reader_hard_path(hid_t file, const char *path)
{
    char part[512];
    size_t length = strlen(path);
    if (length >= sizeof part) return false;
    for (size_t i = 1; i <= length; ++i) {
        if (path[i] != '/' && path[i] != '\0') continue;
        memcpy(part, path, i);
        part[i] = '\0';
        H5L_info_t link;
        if (H5Lget_info(file, part, &link, H5P_DEFAULT) < 0 || link.type != H5L_TYPE_HARD) return false;
    }
    return true;
}

static bool type_fits(hid_t type, KellerCell cell)
{
    size_t size = H5Tget_size(type);
    switch (cell) {
    case KELLER_CELL_U1: return H5Tget_class(type) == H5T_INTEGER && size == 1 && H5Tget_sign(type) == H5T_SGN_NONE;
    case KELLER_CELL_U4: return H5Tget_class(type) == H5T_INTEGER && size <= 4 && H5Tget_sign(type) == H5T_SGN_NONE;
    case KELLER_CELL_U8: return H5Tget_class(type) == H5T_INTEGER && size <= 8 && H5Tget_sign(type) == H5T_SGN_NONE;
    case KELLER_CELL_F8: return H5Tget_class(type) == H5T_FLOAT && size <= 8;
    case KELLER_CELL_ENUM: return H5Tget_class(type) == H5T_ENUM && size == 1;
    case KELLER_CELL_C16: break;
    }
    if (H5Tget_class(type) != H5T_COMPOUND || H5Tget_nmembers(type) != 2) return false;
    for (unsigned i = 0; i < 2; ++i) {
        char *name = H5Tget_member_name(type, i);
        bool right = name && strcmp(name, i == 0 ? "r" : "i") == 0 && H5Tget_member_class(type, i) == H5T_FLOAT;
        H5free_memory(name);
        if (!right) return false;
    }
    return true;
}

/* Stored here, plainly, with the filters that keller uses. */
static bool storage_fits(hid_t dataset, hid_t type, int rank)
{
    hid_t list = H5Dget_create_plist(dataset);
    if (list < 0) return false;
    H5D_layout_t layout = H5Pget_layout(list);
    bool fits = H5Pget_external_count(list) == 0 &&
                (layout == H5D_COMPACT || layout == H5D_CONTIGUOUS || layout == H5D_CHUNKED);
    if (fits && layout == H5D_CHUNKED) {
        hsize_t chunk[4];
        uint64_t bytes = H5Tget_size(type);
        fits = H5Pget_chunk(list, 4, chunk) == rank;
        for (int i = 0; i < rank && fits; ++i)
            fits = chunk[i] > 0 && chunk[i] <= largest_chunk / bytes && (bytes *= chunk[i]);
        int filters = H5Pget_nfilters(list);
        for (int i = 0; i < filters && fits; ++i) {
            unsigned flags, config;
            size_t values = 0;
            H5Z_filter_t filter = H5Pget_filter2(list, (unsigned)i, &flags, &values, NULL, 0, NULL, &config);
            fits = filter == H5Z_FILTER_DEFLATE || filter == H5Z_FILTER_SHUFFLE || filter == H5Z_FILTER_FLETCHER32;
        }
    }
    H5Pclose(list);
    return fits;
}

void keller_table_close(KellerTable *table)
{
    if (table->type >= 0) H5Tclose(table->type);
    if (table->dataset >= 0) H5Dclose(table->dataset);
    *table = (KellerTable){.dataset = -1, .type = -1};
}

KellerStatus keller_table_open(const KellerReader *reader, const char *path, KellerTable *table, KellerError *error)
{
    *table = (KellerTable){.dataset = -1, .type = -1};
    if (!keller_reader_hard_path(reader->file, path)) return keller_reader_bad(reader, error, path, "is missing");
    table->dataset = H5Dopen2(reader->file, path, H5P_DEFAULT);
    if (table->dataset < 0) return keller_reader_bad(reader, error, path, "is not a readable dataset");
    table->type = H5Dget_type(table->dataset);
    hid_t space = H5Dget_space(table->dataset);
    bool readable = table->type >= 0 && space >= 0 && H5Sis_simple(space) > 0;
    table->rank = readable ? H5Sget_simple_extent_ndims(space) : -1;
    readable = table->rank >= 0 && table->rank <= 4 && H5Sget_simple_extent_type(space) != H5S_NULL &&
               H5Sget_simple_extent_dims(space, table->dims, NULL) == table->rank &&
               storage_fits(table->dataset, table->type, table->rank);
    if (space >= 0) H5Sclose(space);
    KellerStatus status = KELLER_OK;
    if (!readable) {
        status = keller_reader_bad(reader, error, path, "has an unknown layout");
    } else {
        uint64_t stored = H5Dget_storage_size(table->dataset), most = stored * DENSEST + SLACK_BYTES;
        uint64_t left = most / H5Tget_size(table->type);
        if (stored > UINT64_MAX / (2 * DENSEST)) left = 0;
        for (int i = 0; i < table->rank && left > 0; ++i) left = table->dims[i] ? left / table->dims[i] : UINT64_MAX;
        if (left == 0) status = keller_reader_bad(reader, error, path, "claims more than the file holds");
    }
    if (status != KELLER_OK) keller_table_close(table);
    return status;
}

static hid_t memory_type(const KellerReader *reader, KellerCell cell, hid_t stored)
{
    switch (cell) {
    case KELLER_CELL_U1: return H5T_NATIVE_UINT8;
    case KELLER_CELL_U4: return H5T_NATIVE_UINT32;
    case KELLER_CELL_U8: return H5T_NATIVE_UINT64;
    case KELLER_CELL_F8: return H5T_NATIVE_DOUBLE;
    case KELLER_CELL_C16: return reader->complex_type;
    case KELLER_CELL_ENUM: break;
    }
    return stored;   /* one byte either way */
}

KellerStatus keller_table_box(KellerReader *reader, KellerTable *table, const char *path, KellerCell cell, int rank,
                              const uint64_t *start, const uint64_t *count, void *data, KellerError *error)
{
    if (table->rank != rank) return keller_reader_bad(reader, error, path, "has another number of dimensions");
    if (!type_fits(table->type, cell)) return keller_reader_bad(reader, error, path, "has another type");
    hsize_t first[4], size[4], values = 1;
    for (int i = 0; i < rank; ++i) {
        if (start[i] > table->dims[i] || count[i] > table->dims[i] - start[i])
            return keller_reader_bad(reader, error, path, "is shorter than it must be");
        first[i] = start[i];
        size[i] = count[i];
        values *= size[i];
    }
    if (values == 0) return KELLER_OK;
    hid_t space = H5Dget_space(table->dataset), block = H5Screate_simple(rank, size, NULL);
    herr_t done = rank > 0 ? H5Sselect_hyperslab(space, H5S_SELECT_SET, first, NULL, size, NULL) : 0;
    if (done >= 0)
        done = H5Dread(table->dataset, memory_type(reader, cell, table->type), block, space, H5P_DEFAULT, data);
    H5Sclose(block);
    H5Sclose(space);
    return done < 0 ? keller_reader_bad(reader, error, path, "cannot be read (damaged or cut short)") : KELLER_OK;
}

/* ---- texts ----------------------------------------------------------------------------------------------------- */

KellerStatus keller_reader_texts(KellerReader *reader, const char *path, char ***texts, uint64_t *count,
                                 KellerError *error)
{
    KellerTable table;
    KellerStatus status = keller_table_open(reader, path, &table, error);
    if (status != KELLER_OK) return status;
    uint64_t rows = count ? table.dims[0] : 1;
    char **raw = NULL, **own = NULL;
    if (table.rank != (count ? 1 : 0) || H5Tis_variable_str(table.type) <= 0) {
        status = keller_reader_bad(reader, error, path, "is not a text");
    } else {
        raw = calloc(rows + 1, sizeof *raw);
        own = calloc(rows + 1, sizeof *own);
        if (!raw || !own) status = keller_error_memory(error, (rows + 1) * sizeof *raw);
    }
    if (status == KELLER_OK && rows > 0) {
        hid_t memory = H5Tcopy(table.type), space = H5Dget_space(table.dataset);
        if (H5Dread(table.dataset, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, raw) < 0)
            status = keller_reader_bad(reader, error, path, "cannot be read (damaged or cut short)");
        for (uint64_t i = 0; i < rows && status == KELLER_OK; ++i) {
            own[i] = strndup(raw[i] ? raw[i] : "", longest_text);
            if (!own[i]) status = keller_error_memory(error, longest_text);
        }
        H5Dvlen_reclaim(memory, space, H5P_DEFAULT, raw);
        H5Sclose(space);
        H5Tclose(memory);
    }
    free(raw);
    keller_table_close(&table);
    if (status != KELLER_OK) {
        for (uint64_t i = 0; own && i < rows; ++i) free(own[i]);
        free(own);
        return status;
    }
    *texts = own;
    if (count) *count = rows;
    return KELLER_OK;
}

char *keller_reader_attribute_text(hid_t object, const char *name)
{
    if (H5Aexists(object, name) <= 0) return NULL;
    hid_t attribute = H5Aopen(object, name, H5P_DEFAULT);
    hid_t type = H5Aget_type(attribute), space = H5Aget_space(attribute);
    char *raw = NULL, *text = NULL;
    if (type >= 0 && space >= 0 && H5Tis_variable_str(type) > 0 && H5Sget_simple_extent_npoints(space) == 1) {
        if (H5Aread(attribute, type, &raw) >= 0 && raw) text = strndup(raw, longest_text);
        H5free_memory(raw);
    }
    if (space >= 0) H5Sclose(space);
    if (type >= 0) H5Tclose(type);
    if (attribute >= 0) H5Aclose(attribute);
    return text;
}

bool keller_reader_attribute_u4(hid_t object, const char *name, uint32_t *value)
{
    if (H5Aexists(object, name) <= 0) return false;
    hid_t attribute = H5Aopen(object, name, H5P_DEFAULT);
    hid_t type = H5Aget_type(attribute), space = H5Aget_space(attribute);
    bool read = type >= 0 && space >= 0 && type_fits(type, KELLER_CELL_U4) &&
                H5Sget_simple_extent_npoints(space) == 1 && H5Aread(attribute, H5T_NATIVE_UINT32, value) >= 0;
    if (space >= 0) H5Sclose(space);
    if (type >= 0) H5Tclose(type);
    if (attribute >= 0) H5Aclose(attribute);
    return read;
}
