/* io/result_sound.h -- what a result of domain "acoustic" has in place of radio's constants (docs/format.md). */
#ifndef KELLER_IO_RESULT_SOUND_H
#define KELLER_IO_RESULT_SOUND_H
#include "io/hdf.h"
#include "keller/config.h"
#include "keller/error.h"
#include "keller/response.h"
#include "keller/scene.h"

/* /medium, /transmitters/level and /bands. Failures of HDF5 are kept in hdf. */
KellerStatus keller_result_sound(KellerHdf *hdf, const KellerConfig *config, KellerError *error);
/* /materials. */
KellerStatus keller_result_surfaces(KellerHdf *hdf, const KellerConfig *config, const KellerScene *scene, KellerError *error);

/* /responses: a row a pair. */
typedef struct {
    bool open, tails;
    size_t bands;
    double middle[KELLER_ROOM_BANDS];
    KellerColumn tx, rx, arrival, pressure, tail, room[7];
} KellerResponseColumns;

void keller_responses_open(KellerHdf *hdf, KellerResponseColumns *columns, const KellerConfig *config);
/* Adds a response and what ISO 3382-1 reads from it. KELLER_FAILED: memory. */
KellerStatus keller_responses_append(KellerHdf *hdf, KellerResponseColumns *columns, const KellerResponse *response,
                                     KellerError *error);
void keller_responses_close(KellerHdf *hdf, KellerResponseColumns *columns);
#endif
