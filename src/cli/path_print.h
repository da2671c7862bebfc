/* cli/path_print.h -- paths as a table, as CSV and as JSON, and the ids that select them. */
#ifndef KELLER_CLI_PATH_PRINT_H
#define KELLER_CLI_PATH_PRINT_H
#include <stdio.h>
#include "io/path_rows.h"

typedef enum { KELLER_PATHS_TABLE, KELLER_PATHS_CSV, KELLER_PATHS_JSON } KellerPathFormat;

typedef struct {
    const KellerResultInfo *info;
    KellerPathFormat format;
    uint64_t printed;
} KellerPathPrinter;

void keller_path_print_start(KellerPathPrinter *printer, const KellerResultInfo *info, KellerPathFormat format);
void keller_path_print(KellerPathPrinter *printer, const KellerPathRow *row);
void keller_path_print_end(KellerPathPrinter *printer);

/* ---- for other tables of a result ---- */

bool keller_is_sound(const KellerResultInfo *info);
/* "walk[3]" */
void keller_receiver_of(const KellerResultInfo *info, uint32_t rx, char *name, size_t size);
/* The first two columns of a table. */
void keller_put_ids(const char *tx, const char *rx);
/* The beginning of a JSON text: {"frequencies_Hz": [...] */
void keller_put_json_frequencies(const KellerResultInfo *info);

/* The transmitter with this id. KELLER_USAGE if there is none, naming those there are. */
KellerStatus keller_find_transmitter(const KellerResultInfo *info, const char *file, const char *id, size_t *tx,
                                     KellerError *error);
/* The set with this id and all its points (*index = -1), or one point of it ("walk[3]"). KELLER_USAGE if there is
 * none. */
KellerStatus keller_find_receiver(const KellerResultInfo *info, const char *file, const char *id, size_t *set,
                                  int64_t *index, KellerError *error);
#endif
