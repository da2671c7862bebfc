#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>
#include "cli/cli.h"

static KellerStatus read_report(int descriptor, KellerError *report)
{
    size_t got = 0;
    while (got < sizeof *report) {
        ssize_t n = read(descriptor, (char *)report + got, sizeof *report - got);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) break;
        got += (size_t)n;
    }
    return got == sizeof *report ? KELLER_OK : KELLER_FAILED;
}

KellerStatus keller_guarded(const char *file, KellerStatus (*work)(void *context, KellerError *error), void *context,
                            KellerError *error)
{
    int ends[2];
    if (pipe(ends) != 0) return keller_error(error, KELLER_FAILED, "%s: no pipe: %s", file, strerror(errno));
    fflush(NULL);
    pid_t child = fork();
    if (child < 0) {
        close(ends[0]);
        close(ends[1]);
        return keller_error(error, KELLER_FAILED, "%s: no process: %s", file, strerror(errno));
    }
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGTERM);
        close(ends[0]);
        KellerError report = {0};
        report.status = work(context, &report);
        if (report.status == KELLER_OK && (fflush(stdout) != 0 || ferror(stdout)))
            keller_error(&report, KELLER_IO, "standard output cannot be written: %s", strerror(errno));
        bool told = write(ends[1], &report, sizeof report) == (ssize_t)sizeof report;
        _exit(told ? 0 : KELLER_FAILED);
    }
    close(ends[1]);
    KellerError report = {0};
    KellerStatus reported = read_report(ends[0], &report);
    close(ends[0]);
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
    if (reported == KELLER_OK) {
        *error = report;
        return report.status;
    }
    if (!WIFSIGNALED(status)) return keller_error(error, KELLER_FAILED, "%s: the reading process ended", file);
    int number = WTERMSIG(status);
    if (number == SIGPIPE || number == SIGINT || number == SIGTERM || number == SIGHUP) {
        signal(number, SIG_DFL);
        raise(number);   /* end as the child did */
    }
    return keller_error(error, KELLER_BAD_INPUT,
                        "%s: is damaged: the HDF5 library stopped while reading it (%s); expected a complete result of "
                        "keller run", file, strsignal(number));
}
