/* io/gnuplot.h -- gnuplot, run as a program. */
#ifndef KELLER_IO_GNUPLOT_H
#define KELLER_IO_GNUPLOT_H
#include <stdio.h>
#include "keller/error.h"

/* Runs gnuplot on `script` (from its beginning; without the user's settings, without a shell) with its standard output
 * going to the existing file `output`. `name` is what messages call the picture. KELLER_FAILED if gnuplot is missing or
 * fails, with its first words; KELLER_IO. */
KellerStatus keller_gnuplot(FILE *script, const char *output, const char *name, KellerError *error);

/* Writes a text as gnuplot's single-quoted string; control characters become '?'. */
void keller_gnuplot_text(FILE *script, const char *text);
#endif
