/* io/result_write.h -- what the program needs of an unfinished result beyond keller/result.h. */
#ifndef KELLER_IO_RESULT_WRITE_H
#define KELLER_IO_RESULT_WRITE_H
#include "keller/result.h"

/* keller_result_create in two steps: the empty temporary file, which is quick, and what is known before the simulation,
 * which takes a while for millions of receivers. When the second step fails the result is still to be abandoned. */
KellerStatus keller_result_begin(const char *file, bool force, const KellerConfig *config, KellerResult **result,
                                 KellerError *error);
KellerStatus keller_result_fill(KellerResult *result, const KellerScene *scene, const char *command_line,
                                KellerError *error);
/* The name of the temporary file, to be deleted by whoever ends the program; valid until finish or abandon. */
const char *keller_result_temporary(const KellerResult *result);
#endif
