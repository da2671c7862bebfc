/* io/result_data.h -- one dataset or attribute of a result file at a time, trusting nothing in it: what result_read.c
 * is built on. Callers have made HDF5 quiet. */
#ifndef KELLER_IO_RESULT_DATA_H
#define KELLER_IO_RESULT_DATA_H
#include <hdf5.h>
#include "io/result_read.h"

struct KellerReader {
    char *name;
    hid_t file, complex_type;
    KellerResultInfo info;
};

/* An open dataset of at most four dimensions; -1, -1 when closed. */
typedef struct {
    hid_t dataset, type;
    int rank;
    hsize_t dims[4];
} KellerTable;

/* KELLER_BAD_INPUT: "FILE: PATH WHAT; expected ...". */
KellerStatus keller_reader_bad(const KellerReader *reader, KellerError *error, const char *path, const char *what);

/* True if every link on the way to `path` is a hard link of this file. */
bool keller_reader_hard_path(hid_t file, const char *path);

/* Opens a dataset that is stored in the file itself, plainly, and holds about as much as it claims. */
KellerStatus keller_table_open(const KellerReader *reader, const char *path, KellerTable *table, KellerError *error);
void keller_table_close(KellerTable *table);
/* Reads the box start[rank], count[rank]; `path` is for messages. */
KellerStatus keller_table_box(KellerReader *reader, KellerTable *table, const char *path, KellerCell cell, int rank,
                              const uint64_t *start, const uint64_t *count, void *data, KellerError *error);

/* A text[] dataset, or a scalar text (count NULL). *texts is an array of owned strings. */
KellerStatus keller_reader_texts(KellerReader *reader, const char *path, char ***texts, uint64_t *count,
                                 KellerError *error);
/* A text attribute, owned by the caller; NULL if it is not there or not a text. */
char *keller_reader_attribute_text(hid_t object, const char *name);
bool keller_reader_attribute_u4(hid_t object, const char *name, uint32_t *value);
#endif
