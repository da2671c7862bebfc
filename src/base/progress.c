#include "base/progress.h"

#include <time.h>
#include <unistd.h>

enum { BAR_WIDTH = 30 };
static const double first_bar = 2, between_bars = 0.2, between_lines = 10;   /* s */

double keller_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

void keller_progress_start(KellerProgress *progress, FILE *stream, const char *label)
{
    *progress = (KellerProgress){.stream = stream, .label = label};
    progress->terminal = stream && isatty(fileno(stream));
    progress->start = progress->last = keller_seconds();
}

static void time_text(double seconds, char *text, size_t size)
{
    if (seconds < 100) snprintf(text, size, "%.0f s", seconds);
    else if (seconds < 6000) snprintf(text, size, "%.0f min", seconds / 60);
    else snprintf(text, size, "%.1f h", seconds / 3600);
}

void keller_progress_update(KellerProgress *progress, double fraction)
{
    if (!progress->stream) return;
    double now = keller_seconds(), elapsed = now - progress->start;
    if (now - progress->last < (progress->terminal ? between_bars : between_lines)) return;
    if (progress->terminal && elapsed < first_bar) return;
    progress->last = now;
    fraction = fraction >= 1 ? 1 : fraction > 0 ? fraction : 0;   /* a NaN counts as nothing done */
    char left[40] = "?";
    if (fraction > 0) time_text(elapsed * (1 - fraction) / fraction, left, sizeof left);
    if (progress->terminal) {
        int filled = (int)(fraction * BAR_WIDTH);
        char bar[BAR_WIDTH + 1];
        for (int i = 0; i < BAR_WIDTH; ++i) bar[i] = i < filled ? '#' : '.';
        bar[BAR_WIDTH] = '\0';
        fprintf(progress->stream, "\r%s [%s] %3.0f %%, %s left\033[K", progress->label, bar, 100 * fraction, left);
    } else {
        fprintf(progress->stream, "%s: %.0f %%, %s left\n", progress->label, 100 * fraction, left);
    }
    fflush(progress->stream);
    progress->shown = true;
}

void keller_progress_stop(KellerProgress *progress)
{
    if (progress->stream && progress->terminal && progress->shown) {
        fputs("\r\033[K", progress->stream);
        fflush(progress->stream);
    }
    progress->stream = NULL;
}
