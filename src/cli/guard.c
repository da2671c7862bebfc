#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include "cli/cli.h"

/* Data of this process so far, in bytes, as RLIMIT_DATA counts it; 0 where /proc does not say. */
static uint64_t data_now(void)
{
    unsigned long long data = 0;
    FILE *stream = fopen("/proc/self/statm", "r");
    if (!stream) return 0;
    if (fscanf(stream, "%*u %*u %*u %*u %*u %llu", &data) != 1) data = 0;
    fclose(stream);
    return data * (uint64_t)sysconf(_SC_PAGESIZE);
}

void keller_limit_memory(const char *file, struct rlimit *before)
{
    /* Receivers are bounded by KELLER_MAX_RECEIVERS and take the constant part at most; texts are stored unpacked, and
     * take less than the other. */
    enum { CONSTANT = 1 << 30, TIMES_FILE = 16 };
    struct stat status;
    if (getrlimit(RLIMIT_DATA, before) != 0) *before = (struct rlimit){RLIM_INFINITY, RLIM_INFINITY};
    struct rlimit limit = *before;
    rlim_t most = (rlim_t)data_now() + CONSTANT;
    if (stat(file, &status) == 0 && status.st_size > 0) most += TIMES_FILE * (rlim_t)status.st_size;
    if (limit.rlim_cur == RLIM_INFINITY || limit.rlim_cur > most) limit.rlim_cur = most;
    (void)setrlimit(RLIMIT_DATA, &limit);   /* without it a damaged file costs time, no more */
}

void keller_lift_memory_limit(const struct rlimit *before) { (void)setrlimit(RLIMIT_DATA, before); }

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
