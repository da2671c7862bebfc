/* A small deterministic generator for tests: PCG-XSH-RR 64/32 (O'Neill 2014). */
#ifndef KELLER_TESTS_RANDOM_H
#define KELLER_TESTS_RANDOM_H
#include <stdint.h>
#include "keller/vec.h"

typedef struct {
    uint64_t state;
} Random;

static inline uint32_t random_u32(Random *r)
{
    uint64_t old = r->state;
    r->state = old * 6364136223846793005u + 1442695040888963407u;
    uint32_t x = (uint32_t)(((old >> 18) ^ old) >> 27), turn = (uint32_t)(old >> 59);
    return x >> turn | x << ((32 - turn) & 31);
}
/* uniform in [lo, hi) */
static inline double random_in(Random *r, double lo, double hi)
{
    return lo + (hi - lo) * (random_u32(r) * 0x1p-32 + random_u32(r) * 0x1p-64);
}
static inline KellerVec3 random_point(Random *r, double size)
{
    return v3(random_in(r, -size, size), random_in(r, -size, size), random_in(r, -size, size));
}
static inline KellerVec3 random_unit(Random *r)
{
    for (;;) {
        KellerVec3 v = random_point(r, 1);
        double n = v3_norm(v);
        if (n > 0.1 && n <= 1) return v3_scale(v, 1 / n);
    }
}
#endif
