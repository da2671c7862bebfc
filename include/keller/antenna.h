/* keller/antenna.h -- antenna patterns from files. */
#ifndef KELLER_ANTENNA_H
#define KELLER_ANTENNA_H
#include "keller/error.h"
#include "keller/wave.h"

/* Reads an MSI Planet file: lines of a keyword and a value, of which GAIN (a number and dBd or dBi; dBd if left out) is
 * needed, then HORIZONTAL 360 and VERTICAL 360, each with 360 lines `angle loss`, angles 0 to 359 in order, losses in dB from
 * 0 to 200. Other keywords say nothing that is used; electrical tilt is in the vertical cut already. At most 1 MiB.
 * `where` (may be NULL) stands before the message where the file cannot be read: the place that named it.
 * Errors: KELLER_IO, KELLER_FAILED (memory), KELLER_BAD_INPUT with FILE:LINE. */
KellerStatus keller_antenna_read(const char *file, const char *where, KellerAntennaCuts *cuts, KellerError *error);
#endif
