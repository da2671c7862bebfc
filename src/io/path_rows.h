/* io/path_rows.h -- the paths of a result one after another, in blocks, so that memory does not grow with their
 * number. */
#ifndef KELLER_IO_PATH_ROWS_H
#define KELLER_IO_PATH_ROWS_H
#include <complex.h>
#include "io/result_read.h"
#include "keller/path.h"

/* What of the paths is read, besides their pairs, lengths and interactions: what was computed of them, or what is needed to compute
 * it again. */
typedef enum { KELLER_ROWS_FIELDS, KELLER_ROWS_GEOMETRY } KellerRowsPart;

typedef struct {
    uint64_t number;            /* row of /paths */
    uint32_t tx, rx;            /* checked: they exist */
    double length;
    uint32_t count;             /* interactions, <= KELLER_MAX_INTERACTIONS */
    uint8_t kind[KELLER_MAX_INTERACTIONS];
    uint32_t id[KELLER_MAX_INTERACTIONS];    /* triangle; wedge of a diffraction */
    KellerVec3 position[KELLER_MAX_INTERACTIONS];
    /* FIELDS */
    double delay, departure[2], arrival[2];
    const double *doppler;      /* [F] */
    const double complex *gain; /* [F] */
    /* GEOMETRY, as in KellerPath */
    double weight, patch, part[2];
    uint8_t free_end[KELLER_MAX_INTERACTIONS];
} KellerPathRow;

typedef struct KellerPathCursor KellerPathCursor;

/* Before the first path; reader and file must outlive the cursor. KELLER_FAILED: memory. */
KellerStatus keller_cursor_open(KellerReader *reader, const char *file, KellerRowsPart part, KellerPathCursor **cursor,
                                KellerError *error);
/* *row is the next path, in the file's order, valid until the next call; NULL behind the last one. */
KellerStatus keller_cursor_next(KellerPathCursor *cursor, const KellerPathRow **row, KellerError *error);
void keller_cursor_close(KellerPathCursor *cursor); /* NULL is allowed */

/* Calls visit for the fields of every path, in the file's order, until it returns a status other than KELLER_OK, which is then
 * returned. The row is valid during the call. */
typedef KellerStatus (*KellerVisitPath)(void *context, const KellerPathRow *row, KellerError *error);
KellerStatus keller_each_path(KellerReader *reader, const char *file, KellerVisitPath visit, void *context,
                              KellerError *error);

/* A sequence as text: "R12 D7", numbers of triangles and wedges; "LOS" without any. */
enum { KELLER_SEQUENCE_SIZE = KELLER_MAX_INTERACTIONS * 12 + 4 };
void keller_path_sequence(const KellerPathRow *row, char text[KELLER_SEQUENCE_SIZE]);
#endif
