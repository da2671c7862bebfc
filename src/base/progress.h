/* base/progress.h -- how far a long piece of work is, for the person who waits.
 *
 * On a terminal a bar with the time left, from two seconds on; otherwise a plain line every ten seconds; nothing when
 * the stream is NULL. The caller owns the stream. */
#ifndef KELLER_BASE_PROGRESS_H
#define KELLER_BASE_PROGRESS_H
#include <stdbool.h>
#include <stdio.h>

typedef struct {
    FILE *stream;
    const char *label;
    bool terminal, shown;
    double start, last;     /* s, monotonic clock */
} KellerProgress;

/* Seconds on a clock that never goes back. */
double keller_seconds(void);

/* Starts one piece of work; `label` must outlive it. */
void keller_progress_start(KellerProgress *progress, FILE *stream, const char *label);
/* Says that the share `fraction` in [0, 1] is done; cheap enough to be called often. */
void keller_progress_update(KellerProgress *progress, double fraction);
/* Takes the bar off the terminal. */
void keller_progress_stop(KellerProgress *progress);
#endif
