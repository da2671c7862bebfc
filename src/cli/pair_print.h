/* cli/pair_print.h -- sums of pairs as a table, as CSV and as JSON. */
#ifndef KELLER_CLI_PAIR_PRINT_H
#define KELLER_CLI_PAIR_PRINT_H
#include "cli/path_print.h"

/* With the printer of paths, for which start is done here. */
void keller_pair_print_start(KellerPathPrinter *printer, const KellerResultInfo *info, KellerPathFormat format);
void keller_pair_print(KellerPathPrinter *printer, const KellerPairSums *sums);
void keller_pair_print_end(KellerPathPrinter *printer);
#endif
