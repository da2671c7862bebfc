/* io/result_sound.h -- what a result of domain "acoustic" has in place of radio's constants (docs/format.md). */
#ifndef KELLER_IO_RESULT_SOUND_H
#define KELLER_IO_RESULT_SOUND_H
#include "io/hdf.h"
#include "keller/config.h"
#include "keller/error.h"
#include "keller/scene.h"

/* /medium, /transmitters/level and /bands. Failures of HDF5 are kept in hdf. */
KellerStatus keller_result_sound(KellerHdf *hdf, const KellerConfig *config, KellerError *error);
/* /materials. */
KellerStatus keller_result_surfaces(KellerHdf *hdf, const KellerConfig *config, const KellerScene *scene, KellerError *error);
#endif
