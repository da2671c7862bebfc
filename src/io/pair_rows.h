/* io/pair_rows.h -- the pairs of a result one after another, in blocks. */
#ifndef KELLER_IO_PAIR_ROWS_H
#define KELLER_IO_PAIR_ROWS_H
#include "io/result_read.h"
#include "keller/path.h"

/* Rows of /pairs; KELLER_BAD_INPUT where the result has none, as those of earlier programs. */
KellerStatus keller_pair_count(KellerReader *reader, const char *file, uint64_t *count, KellerError *error);

/* Calls visit for the first `most` pairs, in the file's order, until it returns a status other than KELLER_OK, which is then returned.
 * The sums are valid during the call. */
typedef KellerStatus (*KellerVisitPair)(void *context, const KellerPairSums *sums, KellerError *error);
KellerStatus keller_each_pair(KellerReader *reader, const char *file, uint64_t most, KellerVisitPair visit, void *context,
                              KellerError *error);
#endif
