/* paths_run.h -- programs run one after the other with a folder for their files, which is deleted however this one ends: by itself, or
 * by SIGINT, SIGTERM or SIGHUP, which end the running program too. */
#ifndef BENCH_PATHS_RUN_H
#define BENCH_PATHS_RUN_H
#include <limits.h>
#include <pthread.h>
#include <stdbool.h>
#include <sys/types.h>

#include "keller/error.h"

typedef struct {
    char folder[PATH_MAX];
    bool keep; /* the folder is the caller's: never deleted */
    pthread_mutex_t lock; /* of what follows */
    pthread_t thread;
    pid_t child; /* 0: none runs */
    bool done;
} RunFolder;

typedef struct {
    double wall, cpu; /* s */
    double peak;      /* of memory, MB */
    bool late;        /* it was ended at the limit */
} RunCost;

/* A new folder in $TMPDIR, else /tmp; or, where not NULL, the folder `keep`, which is made if it is not there. KELLER_IO: there can be none.
 * From here on signals wait for run_folder_end. */
KellerStatus run_folder_start(RunFolder *f, const char *keep, KellerError *error);
void run_folder_end(RunFolder *f);

/* Runs a program (words[0]; NULL at the end) to its end or, asked to stop then, to the limit (s). Its standard output is thrown away.
 * False: it cannot be run, or failed. */
bool run_program(RunFolder *f, char *const *words, double limit, RunCost *cost);
#endif
