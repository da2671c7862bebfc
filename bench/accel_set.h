/* accel_set.h -- the rays and cones that `keller bench accel` and `keller bench masks` ask with, and how they take the time. */
#ifndef BENCH_ACCEL_SET_H
#define BENCH_ACCEL_SET_H
#include "accel_input.h"

enum { PASSES = 5 };

typedef struct {
    size_t count;
    KellerVec3 *origins, *directions;
    KellerCone *cones;
} Set;

/* About `queries` rays (half_angle < 0; degrees), or fewer cones, the wider the fewer. Kind 0: primary, directions of a pinhole camera
 * of 90 degrees in the middle of the box, row by row; 1: random, origins in the box, directions on the sphere. */
Set accel_set_make(const AccelBench *b, double queries, uint64_t seed, int kind, double half_angle, bool eccentric);
void accel_set_free(Set *s);
/* Processor time, s. */
double accel_now(void);
double accel_median(double v[PASSES]);
#endif
