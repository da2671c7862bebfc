/* The slabs that fill a whole cone: behind one more of them than a path may pass through, nothing is seen. */
#ifndef KELLER_PATH_SLABS_H
#define KELLER_PATH_SLABS_H
#include <math.h>
#include "keller/path.h"

typedef struct {
    uint32_t most;              /* that may be passed through, < KELLER_MAX_INTERACTIONS */
    uint32_t count;             /* at most most + 1 are kept, the nearest */
    double far[KELLER_MAX_INTERACTIONS + 1];    /* their farthest z, sorted */
} Slabs;

/* Adds one; returns the z beyond which nothing is seen, INFINITY if there is none. */
static inline double slabs_add(Slabs *s, double far)
{
    if (s->count <= s->most || far < s->far[s->most]) {
        uint32_t i = s->count <= s->most ? s->count++ : s->most;
        for (; i > 0 && s->far[i - 1] > far; i--) s->far[i] = s->far[i - 1];
        s->far[i] = far;
    }
    return s->count > s->most ? s->far[s->most] : INFINITY;
}

/* How many each ray of the cone has passed through before it comes to z. */
static inline uint32_t slabs_before(const Slabs *s, double z)
{
    uint32_t n = 0;
    while (n < s->count && s->far[n] < z) n++;
    return n;
}
#endif
