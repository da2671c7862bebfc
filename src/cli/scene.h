/* cli/scene.h -- what the parts of `keller scene` share. Each gets the arguments after its own name. */
#ifndef KELLER_CLI_SCENE_H
#define KELLER_CLI_SCENE_H
#include <stdbool.h>
#include "keller/error.h"
#include "keller/soup.h"

KellerStatus keller_cli_scene_generate(int argc, char **argv, KellerError *error);
KellerStatus keller_cli_scene_convert(int argc, char **argv, KellerError *error);
KellerStatus keller_cli_scene_stats(int argc, char **argv, KellerError *error);

/* A usage error unless `output` (NULL: -o is missing) has the name of a format that is written; then KELLER_IO if the
 * file cannot be made. */
KellerStatus keller_cli_scene_check_output(const char *output, bool force, KellerError *error);
/* Writes the soup, by the name's extension, so that the file appears when it is complete; prints what it holds, and
 * what it does not. `comment` goes into its header. */
KellerStatus keller_cli_scene_write_file(const KellerSoup *soup, const char *output, bool force, const char *comment,
                                         KellerError *error);
/* A row for each of these lines. */
void keller_cli_scene_notes(const char *notes);
#endif
