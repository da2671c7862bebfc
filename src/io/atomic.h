/* io/atomic.h -- an output file that appears under its final name only when it is complete.
 *
 * The work goes to a temporary file in the same folder. Without `force` an existing file is never replaced, not even
 * one that appeared since the start. */
#ifndef KELLER_IO_ATOMIC_H
#define KELLER_IO_ATOMIC_H
#include <stdbool.h>
#include "keller/error.h"

typedef struct {
    char *target, *temporary;   /* owned */
    bool force;
} KellerAtomic;

/* KELLER_IO if `file` could not be made: it exists and !force, is not a regular file, its folder is missing or not
 * writable. Makes nothing. */
KellerStatus keller_atomic_check(const char *file, bool force, KellerError *error);

/* Makes the empty temporary file; *atomic is then to be finished or abandoned. KELLER_IO, KELLER_FAILED. */
KellerStatus keller_atomic_begin(const char *file, bool force, KellerAtomic *atomic, KellerError *error);

/* Flushes the temporary file to the disk and moves it to its final name. Frees *atomic in any case; on failure
 * (KELLER_IO) the temporary file is deleted. */
KellerStatus keller_atomic_finish(KellerAtomic *atomic, KellerError *error);

/* Deletes the temporary file and frees *atomic. An empty (zeroed) *atomic is allowed. */
void keller_atomic_abandon(KellerAtomic *atomic);
#endif
