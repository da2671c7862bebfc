#include "accel_set.h"

#include <stdlib.h>
#include <time.h>

#include "../tests/unit/random.h"
#include "base/number.h"

double accel_now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

double accel_median(double v[PASSES])
{
    for (int i = 1; i < PASSES; i++)
        for (int j = i; j > 0 && v[j - 1] > v[j]; j--) {
            double t = v[j];
            v[j] = v[j - 1];
            v[j - 1] = t;
        }
    return v[PASSES / 2];
}

/* Fewer of those that take longer. */
static size_t how_many(double queries, double half_angle)
{
    double share = half_angle < 0 ? 1 : half_angle < 0.3 ? 0.1 : half_angle < 1 ? 0.05 : half_angle < 10 ? 0.005 : 0.001;
    double side = floor(sqrt(greater(16, queries * share)));
    return (size_t)(side * side);
}

Set accel_set_make(const AccelBench *b, double queries, uint64_t seed, int kind, double half_angle, bool eccentric)
{
    Set s = {.count = how_many(queries, half_angle)};
    s.origins = malloc(s.count * sizeof *s.origins);
    s.directions = malloc(s.count * sizeof *s.directions);
    s.cones = malloc(s.count * sizeof *s.cones);
    if (!s.origins || !s.directions || !s.cones) abort();
    Random r = {seed};
    size_t side = (size_t)(sqrt((double)s.count) + 0.5);
    for (size_t i = 0; i < s.count; i++) {
        double u[3];
        for (int k = 0; k < 3; k++) u[k] = kind ? random_in(&r, 0, 1) : 0.5;
        s.origins[i] = v3(b->lower.x + u[0] * (b->upper.x - b->lower.x), b->lower.y + u[1] * (b->upper.y - b->lower.y),
                          b->lower.z + u[2] * (b->upper.z - b->lower.z));
        double x = 2 * ((double)(i % side) + random_in(&r, 0, 1)) / (double)side - 1;
        double y = 2 * ((double)(i / side) + random_in(&r, 0, 1)) / (double)side - 1;
        KellerVec3 d = s.directions[i] = kind ? random_unit(&r) : v3_unit(v3(1, x, y));
        double eccentricity = eccentric ? random_in(&r, 0, 0.99) : 0, turn = random_in(&r, 0, M_PI);
        KellerVec3 major = v3_perpendicular(d);
        major = v3_add(v3_scale(major, cos(turn)), v3_scale(v3_cross(d, major), sin(turn)));
        s.cones[i] = keller_cone_elliptic(s.origins[i], d, major, greater(half_angle, 0) * M_PI / 180, eccentricity, 0);
    }
    return s;
}

void accel_set_free(Set *s)
{
    free(s->origins);
    free(s->directions);
    free(s->cones);
}
