/* cli/cli.h -- what the verbs of the program share. A verb gets the arguments after its name, prints its tables on
 * standard output, and leaves errors to main. */
#ifndef KELLER_CLI_CLI_H
#define KELLER_CLI_CLI_H
#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <sys/resource.h>
#include "keller/config.h"
#include "keller/error.h"
#include "keller/scene.h"
#include "keller/soup.h"

KellerStatus keller_cli_run(int argc, char **argv, KellerError *error);
KellerStatus keller_cli_check(int argc, char **argv, KellerError *error);
KellerStatus keller_cli_info(int argc, char **argv, KellerError *error);
KellerStatus keller_cli_paths(int argc, char **argv, KellerError *error);
KellerStatus keller_cli_plot(int argc, char **argv, KellerError *error);
KellerStatus keller_cli_export(int argc, char **argv, KellerError *error);
KellerStatus keller_cli_scene(int argc, char **argv, KellerError *error);
KellerStatus keller_cli_bench(int argc, char **argv, KellerError *error);
KellerStatus keller_cli_help(int argc, char **argv, KellerError *error);
KellerStatus keller_cli_version(int argc, char **argv, KellerError *error);

/* ---- options.c: arguments -------------------------------------------------------------------------------------- */

/* One option of a verb: `--name` and `-letter` (either may be missing); a table ends with an empty row. */
typedef struct {
    const char *name;
    char letter;
    bool has_value;
} KellerOption;

typedef struct {
    const char *verb;
    int argc;
    char **argv;
    int next;
    bool operands_only;         /* after `--` */
    const char *cluster;        /* the letters left of `-qv` */
} KellerArguments;

enum { KELLER_ARGUMENT_END = -1, KELLER_ARGUMENT_OPERAND = -2, KELLER_ARGUMENT_WRONG = -3 };

/* The next argument: the option's row in the table, or one of the values above. *value is the option's value or the
 * operand. Wrong: an unknown option, a value missing or not wanted (KELLER_USAGE in *error). */
int keller_next_argument(KellerArguments *arguments, const KellerOption *options, const char **value,
                         KellerError *error);

/* KELLER_USAGE: "VERB: message; see `keller help VERB`". */
KellerStatus keller_usage(KellerError *error, const char *verb, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* KELLER_IO if `output` is the very file `input` (the same device and inode), whatever they are called; `role` is what
 * the input is to the verb ("the scene file"). Files that are not there are not the same. */
KellerStatus keller_refuse_input(const char *output, const char *input, const char *role, KellerError *error);

/* A whole decimal number in [least, most], or a usage error that names the option. */
KellerStatus keller_whole_number(const char *verb, const char *option, const char *text, uint32_t least, uint32_t most,
                                 uint32_t *value, KellerError *error);

/* The variables of -D NAME=VALUE. */
typedef struct {
    size_t count;
    KellerVariable *list;
} KellerVariables;
KellerStatus keller_variables_add(KellerVariables *variables, const char *verb, const char *text, KellerError *error);
void keller_variables_free(KellerVariables *variables);

/* ---- prepare.c: everything up to the simulation ----------------------------------------------------------------- */

typedef struct {
    KellerConfig config;
    KellerSoup soup;
    KellerScene scene;
    double seconds_configuration, seconds_read, seconds_scene;
} KellerPrepared;

/* The configuration alone, then scene, materials, model, and whether this program can do what is asked. *prepared is to
 * be freed in any case. */
KellerStatus keller_prepare_config(const char *file, const KellerVariables *variables, KellerPrepared *prepared,
                                   KellerError *error);
KellerStatus keller_prepare_scene(KellerPrepared *prepared, KellerError *error);
void keller_prepared_free(KellerPrepared *prepared);
/* The table of what was read and what will be computed, on standard output. */
void keller_print_configuration(const KellerConfig *config);
void keller_print_scene(const KellerSoup *soup, const KellerScene *scene, bool notes);
/* Where the cells of draped grids came to lie. */
void keller_print_surfaces(const KellerConfig *config);
/* A note where transmissions are asked for and no face of the scene lets anything through. */
void keller_print_opaque(const KellerConfig *config, const KellerScene *scene);
typedef struct {
    size_t partly, entirely;    /* pairs of edges that count as one: up to half of the longest wavelength apart, up to a quarter */
    double wavelength;          /* m */
} KellerStripCount;
KellerStripCount keller_count_strips(const KellerConfig *config, const KellerScene *scene);
/* A note where edges are so near to each other that their diffraction is that of one edge (docs/theory.md). */
void keller_print_strips(const KellerConfig *config, const KellerScene *scene);
/* keller_scene_build, whose message names no file: `file` is put before it. */
KellerStatus keller_build_scene_of(const char *file, const KellerSoup *soup, KellerScene *scene, KellerError *error);

/* ---- text.c: pieces of tables ---------------------------------------------------------------------------------- */

/* A row `  name      value`. */
void keller_row(const char *name, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* A row `  name      2: this, that`, of the first `most` texts, in lines of bounded width. */
void keller_row_of_texts(const char *name, char *const *texts, uint64_t count, uint64_t most);
/* With an SI prefix: "3.5 GHz". `text` has room for 32 bytes. */
const char *keller_si(double value, const char *unit, char text[32]);
/* Prints text with control characters replaced, so that a file cannot steer the terminal. */
void keller_put_text(const char *text);
/* Prints text as a string of JSON, what is not UTF-8 replaced, and as a field of CSV. */
void keller_put_json(FILE *out, const char *text);
void keller_put_csv(FILE *out, const char *text);
/* JSON knows no infinities: null. */
void keller_put_json_number(FILE *out, double value);
/* 20 log10 |amplitude|; -inf for 0. */
double keller_decibel(double amplitude);

/* ---- interrupt.c ------------------------------------------------------------------------------------------------ */

/* From start to stop, SIGINT, SIGTERM and SIGHUP end the program at once with status 1 after deleting the file that was
 * given last (NULL: none; copied). Between hold and release a signal waits: a temporary file is made there,
 * so that none is ever left behind. Start before any other thread. */
typedef struct {
    pthread_t thread;
    pthread_mutex_t lock;
    bool done;
    char *file;
} KellerInterrupt;
bool keller_interrupt_start(KellerInterrupt *interrupt);
void keller_interrupt_hold(KellerInterrupt *interrupt);
void keller_interrupt_release(KellerInterrupt *interrupt, const char *file);
void keller_interrupt_stop(KellerInterrupt *interrupt);

/* ---- guard.c ----------------------------------------------------------------------------------------------------- */

/* Runs `work` in a child process and waits for it: the HDF5 library can crash on a damaged file, and then the answer is
 * KELLER_BAD_INPUT with the file's name. No other thread may run. */
KellerStatus keller_guarded(const char *file, KellerStatus (*work)(void *context, KellerError *error), void *context,
                            KellerError *error);

/* For `work`, around its reading: the HDF5 library would touch up to 4 GiB for one text whose length is damaged. Bounds
 * what this process may allocate from here on to more than a good file of this size takes; *before is what
 * keller_lift_memory_limit then takes back. */
void keller_limit_memory(const char *file, struct rlimit *before);
void keller_lift_memory_limit(const struct rlimit *before);
#endif
