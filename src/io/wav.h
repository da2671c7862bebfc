/* io/wav.h -- impulse responses as sound files. */
#ifndef KELLER_IO_WAV_H
#define KELLER_IO_WAV_H
#include <stddef.h>
#include "keller/error.h"

/* Writes one channel of 32-bit floats at a whole sampling rate (Hz) to `file`, which may exist; `shown` is its name in messages.
 * Where a sample is beyond 1 all are divided by the same number so that the largest is 1 - 2^-24: nothing clips. *scale is what the
 * samples were multiplied with, 1 otherwise. Errors: KELLER_IO, KELLER_BAD_INPUT (a sample that is not finite). */
KellerStatus keller_wav_write(const char *file, const char *shown, size_t count, const float *samples, double rate,
                              double *scale,
                              KellerError *error);
#endif
