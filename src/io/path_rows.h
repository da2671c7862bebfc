/* io/path_rows.h -- the paths of a result one after another, in blocks, so that memory does not grow with their
 * number. */
#ifndef KELLER_IO_PATH_ROWS_H
#define KELLER_IO_PATH_ROWS_H
#include <complex.h>
#include "io/result_read.h"
#include "keller/path.h"

typedef struct {
    uint64_t number;            /* row of /paths */
    uint32_t tx, rx;            /* checked: they exist */
    double length, delay, departure[2], arrival[2];
    uint32_t count;             /* interactions, <= KELLER_MAX_INTERACTIONS */
    uint8_t kind[KELLER_MAX_INTERACTIONS];
    uint32_t id[KELLER_MAX_INTERACTIONS];    /* triangle; wedge of a diffraction */
    KellerVec3 position[KELLER_MAX_INTERACTIONS];
    const double *doppler;      /* [F] */
    const double complex *gain; /* [F] */
} KellerPathRow;

/* Calls visit for every path, in the file's order, until it returns a status other than KELLER_OK, which is then
 * returned. The row is valid during the call. */
typedef KellerStatus (*KellerVisitPath)(void *context, const KellerPathRow *row, KellerError *error);
KellerStatus keller_each_path(KellerReader *reader, const char *file, KellerVisitPath visit, void *context,
                              KellerError *error);

/* A sequence as text: "R12 D7", numbers of triangles and wedges; "LOS" without any. */
enum { KELLER_SEQUENCE_SIZE = KELLER_MAX_INTERACTIONS * 12 + 4 };
void keller_path_sequence(const KellerPathRow *row, char text[KELLER_SEQUENCE_SIZE]);
#endif
