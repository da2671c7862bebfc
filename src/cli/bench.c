/* keller bench: each suite is a program of its own, keller-bench-SUITE, which this one becomes. */
#include "cli/cli.h"
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char *const suites[] = {"accel", "accuracy", "acoustics", "batch", "cone", "maps", "masks", "nexthit", "paths", "stability"};

/* Where the programs are, from the folder of this one: in the build's tree, or where both were installed. */
static const char *const places[] = {"../../bench", "../libexec/keller"};

KellerStatus keller_cli_bench(int argc, char **argv, KellerError *error)
{
    char known[200] = "", folder[PATH_MAX], program[PATH_MAX + 300];
    bool found = false;
    for (size_t i = 0; i < sizeof suites / sizeof *suites; ++i) {
        snprintf(known + strlen(known), sizeof known - strlen(known), "%s%s", i > 0 ? ", " : "", suites[i]);
        found |= argc > 0 && strcmp(argv[0], suites[i]) == 0;
    }
    if (argc == 0) return keller_usage(error, "bench", "a suite is expected, one of: %s", known);
    if (!found) return keller_usage(error, "bench", "unknown suite \"%.60s\"; known: %s", argv[0], known);
    ssize_t length = readlink("/proc/self/exe", folder, sizeof folder - 1);
    if (length < 0) return keller_error(error, KELLER_IO, "bench: /proc/self/exe: %s", strerror(errno));
    folder[length] = '\0';
    *strrchr(folder, '/') = '\0';
    /* the suite's name becomes the program's; its options follow */
    char **arguments = calloc((size_t)argc + 1, sizeof *arguments);
    if (!arguments) return keller_error_memory(error, ((size_t)argc + 1) * sizeof *arguments);
    memcpy(arguments, argv, (size_t)argc * sizeof *arguments);
    fflush(stdout);
    for (size_t i = 0; i < sizeof places / sizeof *places; ++i) {
        snprintf(program, sizeof program, "%s/%s/keller-bench-%s", folder, places[i], argv[0]);
        arguments[0] = program;
        execv(program, arguments);
    }
    free(arguments);
    return keller_error(error, KELLER_IO, "bench: no program keller-bench-%s beside %s, in %s or %s", argv[0], folder,
                        places[0], places[1]);
}
