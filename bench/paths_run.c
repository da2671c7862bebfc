#include "paths_run.h"

#include <dirent.h>
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static void signals(sigset_t *set)
{
    sigemptyset(set);
    sigaddset(set, SIGINT);
    sigaddset(set, SIGTERM);
    sigaddset(set, SIGHUP);
}

/* The folder is this program's own and has no folders in it. */
static void delete_folder(const RunFolder *f)
{
    DIR *stream = f->keep ? NULL : opendir(f->folder);
    if (!stream) return;
    for (struct dirent *e; (e = readdir(stream));) unlinkat(dirfd(stream), e->d_name, 0);
    closedir(stream);
    rmdir(f->folder);
}

/* A thread that waits for signals may lock and wait, which a handler may not. */
static void *watch(void *context)
{
    RunFolder *f = context;
    sigset_t set;
    int number;
    signals(&set);
    if (sigwait(&set, &number) != 0) return NULL;
    pthread_mutex_lock(&f->lock);
    if (f->done) {
        pthread_mutex_unlock(&f->lock);
        return NULL;
    }
    if (f->child > 0) {
        kill(f->child, SIGKILL);
        waitpid(f->child, NULL, 0);
    }
    delete_folder(f);
    static const char text[] = "keller-bench-paths: interrupted\n";
    (void)!write(STDERR_FILENO, text, sizeof text - 1);
    _exit(1);
}

KellerStatus run_folder_start(RunFolder *f, const char *keep, KellerError *error)
{
    *f = (RunFolder){.keep = keep != NULL};
    const char *temporary = getenv("TMPDIR");
    if (keep) snprintf(f->folder, sizeof f->folder, "%s", keep);
    else snprintf(f->folder, sizeof f->folder, "%s/keller-paths-XXXXXX", temporary ? temporary : "/tmp");
    sigset_t set;
    signals(&set);
    pthread_sigmask(SIG_BLOCK, &set, NULL);
    struct stat there;
    bool made = keep ? mkdir(keep, 0777) == 0 || (errno == EEXIST && stat(keep, &there) == 0 && S_ISDIR(there.st_mode))
                     : mkdtemp(f->folder) != NULL;
    if (!made) return keller_error(error, KELLER_IO, "%s: %s", f->folder, strerror(errno));
    pthread_mutex_init(&f->lock, NULL);
    int failed = pthread_create(&f->thread, NULL, watch, f);
    if (failed == 0) return KELLER_OK;
    pthread_mutex_destroy(&f->lock);
    delete_folder(f);
    return keller_error(error, KELLER_FAILED, "no thread to wait for signals: %s", strerror(failed));
}

void run_folder_end(RunFolder *f)
{
    pthread_mutex_lock(&f->lock);
    f->done = true;
    pthread_mutex_unlock(&f->lock);
    pthread_kill(f->thread, SIGTERM);
    pthread_join(f->thread, NULL);
    pthread_mutex_destroy(&f->lock);
    delete_folder(f);
    sigset_t set;
    signals(&set);
    pthread_sigmask(SIG_UNBLOCK, &set, NULL);
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double seconds(struct timeval t) { return (double)t.tv_sec + 1e-6 * (double)t.tv_usec; }

bool run_program(RunFolder *f, char *const *words, double limit, RunCost *cost)
{
    const double patience = 5; /* s to stop in when asked to: keller deletes its unfinished file */
    const struct timespec moment = {0, 2000000};
    double start = now();
    *cost = (RunCost){0};
    fflush(stdout);
    pthread_mutex_lock(&f->lock);
    pid_t child = f->child = fork();
    if (child == 0) { /* its tables are not wanted, its complaints are */
        sigset_t set;
        signals(&set);
        pthread_sigmask(SIG_UNBLOCK, &set, NULL);
        if (!freopen("/dev/null", "w", stdout)) _exit(127);
        execv(words[0], words);
        _exit(127);
    }
    pthread_mutex_unlock(&f->lock);
    if (child < 0) return false;
    for (;;) {
        int state;
        struct rusage used;
        pthread_mutex_lock(&f->lock);
        pid_t ended = wait4(child, &state, WNOHANG, &used);
        if (ended != 0) f->child = 0;
        pthread_mutex_unlock(&f->lock);
        if (ended < 0) return false;
        cost->wall = now() - start;
        if (ended == child) {
            cost->cpu = seconds(used.ru_utime) + seconds(used.ru_stime);
            cost->peak = (double)used.ru_maxrss / 1024;
            return cost->late || (WIFEXITED(state) && WEXITSTATUS(state) == 0);
        }
        if (cost->wall > limit + patience) kill(child, SIGKILL);
        else if (cost->wall > limit && !cost->late) kill(child, SIGTERM);
        cost->late = cost->late || cost->wall > limit;
        nanosleep(&moment, NULL);
    }
}
