/* harness.h -- runs the program's own way from a scene to paths, without files: a configuration built in memory, a sink
 * that keeps every path. Failures abort the test with the library's message. */
#ifndef TEST_HARNESS_H
#define TEST_HARNESS_H
#include "keller/path.h"
#include "keller/scene.h"
#include <complex.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define HARNESS_FREQUENCIES 2

/* What to simulate; a Run is filled by run_new and then changed. */
typedef struct {
    size_t tx_count, rx_count;
    const KellerVec3 *tx, *rx; /* borrowed */
    double grid_step;          /* > 0: the receivers are one grid, rx[j * nx + i] = rx[0] + (i step, j step, any) */
    uint32_t grid_rows;        /* of that grid; 0 counts as 1 */
    size_t frequency_count;
    double frequency[HARNESS_FREQUENCIES]; /* Hz */
    KellerAntenna antenna;                 /* at both ends */
    const KellerAntenna *rx_antenna;       /* of the receivers; NULL: the same */
    double orientation[2][3];              /* of the transmitters and of the receivers, rad; run_new: not turned */
    uint32_t reflections, diffractions, transmissions, interactions; /* run_new: no transmissions */
    double patch; /* m: > 0: paths may be scattered once, by patches of that size, */
    uint32_t with_scattering; /* beside so many reflections and diffractions; run_new: none */
    double cone; /* rad */
    const char *accelerator; /* NULL: auto */
    uint32_t split_over; /* as in KellerConfig: small makes even the smallest scenes split their cones */
    uint32_t threads;
} Run;

typedef struct {
    uint32_t tx, rx, count;
    KellerStep step[KELLER_MAX_INTERACTIONS];
    KellerVec3 position[KELLER_MAX_INTERACTIONS];
    uint32_t triangle[KELLER_MAX_INTERACTIONS];
    double length, delay, departure[2], arrival[2];
    double complex gain[HARNESS_FREQUENCIES], transfer[HARNESS_FREQUENCIES][4];
} Found;

typedef struct {
    size_t count, capacity;
    Found *path; /* in the order they came */
    size_t coverage_count;
    double coverage[8]; /* path gain of the first grid points at the first frequency */
    size_t reports;     /* of how far it is, the last being `progress` */
    double progress;
    bool went_back;     /* a report said less than one before, or more than all */
    KellerSimulationWork work;
} FoundPaths;

/* One transmitter, receivers as points, 3.5 GHz, isotropic V, cone 2 degrees, one thread; nothing is dropped. */
Run run_new(const KellerVec3 *tx, size_t rx_count, const KellerVec3 *rx, uint32_t reflections, uint32_t diffractions,
            uint32_t interactions);
FoundPaths run_simulation(const KellerScene *scene, const Run *run);
void found_free(FoundPaths *found);

/* The scene of a soup. */
KellerScene scene_of(const KellerSoup *soup);

/* The sum of the gains at a receiver. */
double complex found_total(const FoundPaths *found, uint32_t rx, size_t frequency);
size_t found_count(const FoundPaths *found, uint32_t rx);

/* One path on one line of text, for messages. */
const char *path_text(uint32_t count, const KellerStep *steps, char *text, size_t size);

/* Are they the same paths, step by step and bit for bit? Says which is the first that differs. */
bool found_same(const FoundPaths *a, const FoundPaths *b, size_t frequencies);

/* Where and how two path sets of one receiver (paths matched by kinds and positions, nearer than `tolerance`)
 * differ. */
typedef struct {
    size_t matched, only_a, only_b;
    double gain_error; /* largest |gain difference| over the larger Frobenius norm of the transfers */
} PathDifference;

typedef KellerVec3 (*PointMap)(KellerVec3 p); /* takes positions of a to those of b; NULL: the same */

PathDifference paths_compare(const FoundPaths *a, uint32_t rx_a, const FoundPaths *b, uint32_t rx_b, double tolerance,
                             bool reversed, PointMap map, bool verbose);

/* Paths of a receiver that are there twice: same kinds and, nearer than `tolerance`, same positions. */
size_t paths_doubled(const FoundPaths *found, uint32_t rx, double tolerance);
#endif
