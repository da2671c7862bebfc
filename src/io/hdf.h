/* io/hdf.h -- the few HDF5 idioms of the result file: quiet errors, types, tables, growing columns.
 *
 * Writing calls return nothing: the first failure is kept in KellerHdf and every later call does nothing, so that a
 * writer checks once at the end. */
#ifndef KELLER_IO_HDF_H
#define KELLER_IO_HDF_H
#include <hdf5.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "keller/error.h"

/* HDF5 prints its error stack by default; this pair keeps it silent within one call of ours and puts back what the
 * program around us had chosen. */
typedef struct {
    H5E_auto2_t function;
    void *data;
} KellerHdfQuiet;
KellerHdfQuiet keller_hdf_quiet(void);
void keller_hdf_loud(KellerHdfQuiet quiet);

/* The innermost message of HDF5's current error stack; returns the system's error number found in it, else 0. */
int keller_hdf_reason(char *text, size_t size);

typedef struct {
    hid_t file;
    hid_t complex_type, text_type, interaction_type, set_type, flag_type;
    hid_t links;                /* link creation: makes the groups on the way */
    bool failed;
    int system_error;           /* errno of the first failure, 0 if unknown */
    char reason[160];
} KellerHdf;

/* Creates (truncates) `file`, and the types. */
void keller_hdf_create(KellerHdf *hdf, const char *file);
/* Closes everything, the file last; a failure of closing counts as one of writing. */
void keller_hdf_close(KellerHdf *hdf);

void keller_hdf_group(KellerHdf *hdf, const char *path);
void keller_hdf_attribute_text(KellerHdf *hdf, hid_t object, const char *name, const char *text);
void keller_hdf_attribute_u4(KellerHdf *hdf, hid_t object, const char *name, uint32_t value);

/* A dataset of `rank` (0: scalar) dimensions, with `units` (NULL: none). Large ones are chunked and compressed; those
 * with `nan` are filled with NaN. Returns its id (close with H5Dclose), negative after a failure. */
hid_t keller_hdf_dataset(KellerHdf *hdf, const char *path, hid_t type, int rank, const hsize_t *dims, const char *units,
                         const hsize_t *chunk, bool nan);
/* The same, written and closed. `memory` is the type of `data`. */
void keller_hdf_table(KellerHdf *hdf, const char *path, hid_t type, hid_t memory, int rank, const hsize_t *dims,
                      const char *units, const void *data);
/* Writes the box start, count of a dataset from contiguous `data`. */
void keller_hdf_write(KellerHdf *hdf, hid_t dataset, hid_t memory, int rank, const hsize_t *start,
                      const hsize_t *count, const void *data);
/* A text[count] dataset. */
void keller_hdf_texts(KellerHdf *hdf, const char *path, size_t count, char *const *texts);

/* A dataset that grows by rows, buffered by whole chunks. */
typedef struct {
    hid_t dataset, memory;
    int rank;
    hsize_t tail[3];            /* the dimensions after the first */
    size_t row_bytes, chunk_rows, buffered;
    uint64_t written;
    unsigned char *buffer;
} KellerColumn;

void keller_hdf_column(KellerHdf *hdf, KellerColumn *column, const char *path, hid_t type, hid_t memory,
                       int tail_rank, const hsize_t *tail, const char *units);
void keller_column_append(KellerHdf *hdf, KellerColumn *column, const void *rows, size_t count);
/* Writes what is buffered; needed where the rows hold pointers that are about to change. */
void keller_column_flush(KellerHdf *hdf, KellerColumn *column);
/* Writes what is buffered, closes the dataset and frees the buffer. */
void keller_column_close(KellerHdf *hdf, KellerColumn *column);
#endif
