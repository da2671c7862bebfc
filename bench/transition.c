/* The transition function as the program has it beside that by the Faddeeva function. */
#include <math.h>
#include <stdio.h>
#include <time.h>

#include "../tests/truth/transition.h"
#include "accuracy.h"
#include "keller/wave.h"

enum { CALLS = 100000, TIMES = 5 };

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

/* ns a call, over one decade from `low`; the calls do not wait for each other. */
static double time_of(double complex (*f)(double), double low)
{
    double least = INFINITY;
    volatile double sink = 0; /* so that none is left out */
    for (int i = 0; i < TIMES; i++) {
        double complex sum = 0;
        double start = now();
        for (int j = 0; j < CALLS; j++) sum += f(low * (1 + 9.0 * j / CALLS));
        least = fmin(least, (now() - start) / CALLS);
        sink = sink + creal(sum);
    }
    return least;
}

void accuracy_transition(bool csv)
{
    puts(csv ? "x_from,x_to,faddeeva_ns,keller_ns,ratio,difference" : "         x  faddeeva/ns    keller/ns  ratio  difference");
    for (int decade = -6; decade <= 8; decade++) {
        double low = pow(10, decade), slow = time_of(transition_by_faddeeva, low), fast = time_of(keller_transition, low), off = 0;
        for (int j = 0; j < CALLS; j++) {
            double x = low * (1 + 9.0 * j / CALLS);
            off = fmax(off, cabs(keller_transition(x) / transition_by_faddeeva(x) - 1));
        }
        if (csv) printf("%g,%g,%.1f,%.1f,%.2f,%.1e\n", low, 10 * low, slow, fast, slow / fast, off);
        else printf("%4.0e..%4.0e %11.1f %12.1f %6.1f %11.1e\n", low, 10 * low, slow, fast, slow / fast, off);
    }
}
