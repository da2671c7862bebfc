#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "cli/cli.h"

static void signals(sigset_t *set)
{
    sigemptyset(set);
    sigaddset(set, SIGINT);
    sigaddset(set, SIGTERM);
    sigaddset(set, SIGHUP);
}

/* A thread that waits for signals may lock and unlink, which a handler may not. */
static void *watch(void *context)
{
    KellerInterrupt *interrupt = context;
    sigset_t set;
    int number;
    signals(&set);
    if (sigwait(&set, &number) != 0) return NULL;
    pthread_mutex_lock(&interrupt->lock);
    if (interrupt->done) {
        pthread_mutex_unlock(&interrupt->lock);
        return NULL;
    }
    if (interrupt->file) unlink(interrupt->file);
    static const char plain[] = "keller: interrupted; nothing was written\n";
    static const char terminal[] = "\r\033[Kkeller: interrupted; nothing was written\n";
    const char *text = isatty(STDERR_FILENO) ? terminal : plain;
    (void)!write(STDERR_FILENO, text, strlen(text));
    _exit(KELLER_FAILED);
}

bool keller_interrupt_start(KellerInterrupt *interrupt)
{
    *interrupt = (KellerInterrupt){.file = NULL};
    pthread_mutex_init(&interrupt->lock, NULL);
    sigset_t set;
    signals(&set);
    pthread_sigmask(SIG_BLOCK, &set, NULL);
    if (pthread_create(&interrupt->thread, NULL, watch, interrupt) == 0) return true;
    pthread_sigmask(SIG_UNBLOCK, &set, NULL);
    return false;
}

void keller_interrupt_hold(KellerInterrupt *interrupt) { pthread_mutex_lock(&interrupt->lock); }

void keller_interrupt_release(KellerInterrupt *interrupt, const char *file)
{
    free(interrupt->file);
    interrupt->file = file ? strdup(file) : NULL;
    pthread_mutex_unlock(&interrupt->lock);
}

void keller_interrupt_stop(KellerInterrupt *interrupt)
{
    /* The thread ends by a signal of ours, not by cancelling: that would leave its stack poisoned for AddressSanitizer. */
    pthread_mutex_lock(&interrupt->lock);
    interrupt->done = true;
    pthread_mutex_unlock(&interrupt->lock);
    pthread_kill(interrupt->thread, SIGTERM);
    pthread_join(interrupt->thread, NULL);
    pthread_mutex_destroy(&interrupt->lock);
    free(interrupt->file);
    sigset_t set;
    signals(&set);
    pthread_sigmask(SIG_UNBLOCK, &set, NULL);
}
