/* cli/help.h -- the help texts. */
#ifndef KELLER_CLI_HELP_H
#define KELLER_CLI_HELP_H
#include "keller/error.h"

/* Prints the help of a verb (NULL: of the program) on standard output; KELLER_USAGE if there is no such verb. */
KellerStatus keller_print_help(const char *verb, KellerError *error);
#endif
