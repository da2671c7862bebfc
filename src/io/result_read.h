/* io/result_read.h -- reading a result file (docs/format.md), trusting nothing in it.
 *
 * Every failure is KELLER_BAD_INPUT with the file's name, or KELLER_IO where it cannot be opened at all. Only hard
 * links, datasets stored in the file itself and the filters that keller writes are followed. For one thread. */
#ifndef KELLER_IO_RESULT_READ_H
#define KELLER_IO_RESULT_READ_H
#include <stdbool.h>
#include <stdint.h>
#include "keller/config.h"
#include "keller/error.h"
#include "keller/vec.h"

typedef struct KellerReader KellerReader;

/* What fits into memory whatever the number of paths. All owned by the reader. */
typedef struct {
    char *program_version, *created, *domain, *config_sha256, *command_line;
    uint32_t format_version;
    uint64_t frequency_count, transmitter_count, receiver_count, set_count, material_count;
    double *frequencies;                        /* Hz */
    char **transmitter_ids;
    KellerVec3 *transmitter_positions;          /* m */
    double *transmitter_powers;                 /* W */
    uint32_t *receiver_sets, *receiver_indices; /* set < set_count */
    char **set_ids;
    uint8_t *set_kinds;                         /* KellerSetKind */
    uint32_t (*set_shapes)[2];                  /* ny, nx */
    char **materials;
    uint64_t paths, interactions;
    uint64_t responses, response_samples; /* rows of /responses and samples of each; zero where there are none */
    uint64_t vertices, triangles, wedges, objects; /* of /scene; zero where it was not stored */
} KellerResultInfo;

/* Opens a result: checks the format attribute and version, and that the columns agree in length. */
KellerStatus keller_reader_open(const char *file, KellerReader **reader, KellerError *error);
void keller_reader_close(KellerReader *reader);   /* NULL is allowed */
const KellerResultInfo *keller_reader_info(const KellerReader *reader);

/* What a cell is in memory: uint8_t, uint32_t, uint64_t, double, double complex, or the uint8_t of an enumeration. */
typedef enum {
    KELLER_CELL_U1,
    KELLER_CELL_U4,
    KELLER_CELL_U8,
    KELLER_CELL_F8,
    KELLER_CELL_C16,
    KELLER_CELL_ENUM
} KellerCell;

/* Reads the box start[rank], count[rank] of a dataset that must have this rank and hold cells of this kind. `data` has
 * room for the product of count. */
KellerStatus keller_reader_box(KellerReader *reader, const char *path, KellerCell cell, int rank, const uint64_t *start,
                               const uint64_t *count, void *data, KellerError *error);
/* Rows first .. first + count - 1 with all `width` cells each (1 for a column of single cells). */
KellerStatus keller_reader_rows(KellerReader *reader, const char *path, KellerCell cell, uint64_t width, uint64_t first,
                                uint64_t count, void *data, KellerError *error);
/* The first dimension of a dataset that has one. */
KellerStatus keller_reader_row_count(KellerReader *reader, const char *path, uint64_t *rows, KellerError *error);
bool keller_reader_has(KellerReader *reader, const char *path);

/* Calls visit for every entry of /statistics, in order of name: a number with its unit, or a text (unit NULL). */
typedef void (*KellerVisitStatistic)(void *context, const char *name, double value, const char *unit, const char *text);
KellerStatus keller_reader_statistics(KellerReader *reader, KellerVisitStatistic visit, void *context,
                                      KellerError *error);

/* A text that is a dataset of its own, such as /config; the caller frees it. */
KellerStatus keller_reader_text(KellerReader *reader, const char *path, char **text, KellerError *error);
#endif
