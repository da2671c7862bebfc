#include <errno.h>
#include <hdf5.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include "cli/cli.h"
#include "cli/help.h"

typedef struct {
    const char *name;
    KellerStatus (*run)(int argc, char **argv, KellerError *error);
} Verb;

static const Verb verbs[] = {{"run", keller_cli_run},     {"check", keller_cli_check},   {"info", keller_cli_info},
                             {"paths", keller_cli_paths}, {"plot", keller_cli_plot},     {"export", keller_cli_export},
                             {"bench", keller_cli_bench}, {"scene", keller_cli_scene},   {"help", keller_cli_help},
                             {"version", keller_cli_version}};

static KellerStatus dispatch(int argc, char **argv, KellerError *error)
{
    if (argc < 2) return keller_error(error, KELLER_USAGE, "a verb is expected; see `keller help`");
    const char *name = argv[1];
    if (strcmp(name, "--version") == 0) name = "version";
    if (strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0) name = "help";
    for (int i = 2; i < argc && strcmp(argv[i], "--") != 0; ++i)
        if (strcmp(argv[i], "--help") == 0) return keller_print_help(name, error);
    for (size_t i = 0; i < sizeof verbs / sizeof *verbs; ++i)
        if (strcmp(verbs[i].name, name) == 0) return verbs[i].run(argc - 2, argv + 2, error);
    return keller_error(error, KELLER_USAGE, "unknown %s \"%.60s\"; see `keller help`",
                        name[0] == '-' ? "option" : "verb", name);
}

int main(int argc, char **argv)
{
    /* A file that cannot grow is an error to report, not a reason to die. */
    signal(SIGXFSZ, SIG_IGN);
    /* Every file is closed by hand; what a full disk kept HDF5 from closing it would try again at exit, loudly. */
    H5dont_atexit();
    KellerError error = {0};
    KellerStatus status = dispatch(argc, argv, &error);
    if (status == KELLER_OK && (fflush(stdout) != 0 || ferror(stdout)))
        status = keller_error(&error, KELLER_IO, "standard output cannot be written: %s", strerror(errno));
    if (status != KELLER_OK) fprintf(stderr, "keller: %s\n", error.message);
    return (int)status;
}
