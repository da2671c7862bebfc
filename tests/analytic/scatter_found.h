/* Scattered paths among those that the harness found, and materials that scatter. */
#ifndef TEST_SCATTER_FOUND_H
#define TEST_SCATTER_FOUND_H
#include <complex.h>
#include <math.h>
#include <string.h>

#include "../stability/harness.h"
#include "keller/wave.h"

static const double lambda = KELLER_LIGHT_SPEED / 3.5e9;
static const KellerScattering lambert = {.coefficient = 0.6};
static const KellerScattering lobes = {.coefficient = 0.5, .lobe = 6, .back_lobe = 4, .share = 0.7};

static inline double power(double complex g) { return creal(g) * creal(g) + cimag(g) * cimag(g); }

/* Place of the scattering among the steps, or count. */
static inline uint32_t scattered_at(const Found *p)
{
    uint32_t i = 0;
    while (i < p->count && p->step[i].kind != KELLER_SCATTERING) i++;
    return i;
}

static inline bool scattered(const Found *p) { return scattered_at(p) < p->count; }

static inline uint32_t of_kind(const Found *p, KellerInteractionKind kind)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < p->count; i++) n += p->step[i].kind == kind;
    return n;
}

/* "RS", "SD" and so on. */
static inline bool is_kind(const Found *p, const char *letters)
{
    bool same = strlen(letters) == p->count;
    for (uint32_t i = 0; i < p->count && same; i++) same = letters[i] == "RDTS"[p->step[i].kind];
    return same;
}

static inline KellerVec3 direction(const double angles[2])
{
    return v3(sin(angles[0]) * cos(angles[1]), sin(angles[0]) * sin(angles[1]), cos(angles[0]));
}
#endif
