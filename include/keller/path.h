/* keller/path.h -- from a scene and a configuration to propagation paths. */
#ifndef KELLER_PATH_H
#define KELLER_PATH_H
#include <complex.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "keller/accel.h"
#include "keller/config.h"
#include "keller/error.h"
#include "keller/response.h"
#include "keller/scene.h"

/* Interactions of one path, all kinds together, and those of them that are searched for, reflections and diffractions: a
 * configuration that asks for more is refused. */
#define KELLER_MAX_INTERACTIONS 64
#define KELLER_MAX_BENDS 16

typedef enum {
    KELLER_REFLECTION = 0,
    KELLER_DIFFRACTION = 1,
    KELLER_TRANSMISSION = 2,
    KELLER_SCATTERING = 3
} KellerInteractionKind;

/* One element of a sequence: a face to reflect in, to pass through or to be scattered by, or a wedge to diffract at. */
typedef struct {
    KellerInteractionKind kind;
    uint32_t id;                /* face or wedge */
} KellerStep;

/* An exact path. Directions are unit vectors: the departure points away from the transmitter, the arrival points from the
 * receiver back towards where the wave comes from. `leg` are unit directions of travel of the count + 1 legs; they
 * are well defined even where a leg has length zero. */
typedef struct {
    uint32_t count;
    KellerStep step[KELLER_MAX_INTERACTIONS];
    KellerVec3 position[KELLER_MAX_INTERACTIONS];
    uint32_t triangle[KELLER_MAX_INTERACTIONS];   /* reflected in, passed through or scattered by; KELLER_NONE for a diffraction */
    uint8_t free_end[KELLER_MAX_INTERACTIONS];    /* of a diffraction: bit 0, 1 set where the edge's first, second end is free, that
                                                     is nothing stands in the way along the edge to beyond it; else 0 */
    KellerVec3 leg[KELLER_MAX_INTERACTIONS + 1];
    double part[2];             /* m from the edge's first end, where the path stands for a part of an edge (Biot, Tolstoy and Medwin's
                                   diffraction), the part's ends; else 0, 0 */
    double length;              /* m, geometrical: slabs take up no length of their own */
    double weight;              /* 1; less exactly on a boundary of the path: the share of the surroundings in which it
                                   exists, 1/2 on a shadow or reflection boundary (SPEC 6) */
    double patch;               /* m^2: area of the patch that scatters, in the path's one step of that kind; else 0 */
} KellerPath;

/* false ends the solution. */
typedef bool (*KellerPathFound)(void *context, const KellerPath *path);
/* Solves one candidate sequence of `count` <= KELLER_MAX_BENDS reflections and diffractions exactly between two
 * points and tests its validity in the scene: mirror images for faces, the shortest path for the wedges, each point inside
 * its face or edge, each leg free but for at most `transmissions` slabs on all legs together (and no more than makes
 * KELLER_MAX_INTERACTIONS with the others), which become steps of their own. Calls found(context, path) for each path: one
 * at most, but on a boundary of the path, such as the edge of a wall that it may pass through or go by, one for each set of
 * slabs that the surroundings pass through, with their share as its weight. Returns false if found did. */
bool keller_path_solve(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, KellerVec3 rx, size_t count,
                       const KellerStep *steps, uint32_t transmissions, KellerPathFound found, void *context,
                       KellerAccelWork *work);

/* The media of all materials at all frequencies: media[f * material_count + m]. Caller frees with free().
 * Errors: a frequency outside a material's range; only materials that a triangle uses are looked up. */
KellerStatus keller_media_table(const KellerScene *scene, size_t frequency_count, const double *frequencies,
                                KellerMedium **media, KellerError *error);

/* The 2x2 transfer matrix (SPEC 1; indices received, transmitted; row major) of a path at one frequency, weight, spreading
 * and phase included, antennas excluded. `media` is that frequency's row of the media table. */
void keller_path_transfer(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, double frequency,
                          const KellerMedium *media, double complex transfer[4]);

/* ---- a whole simulation ----------------------------------------------------------------------------------------- */

/* Paths of one transmitter-receiver pair after another, as columns (SPEC 4). F = frequency_count. */
typedef struct {
    size_t count, capacity;
    size_t interaction_count, interaction_capacity;
    size_t frequency_count;
    uint32_t *tx, *rx;
    uint64_t *offset;             /* [count + 1], into the interaction columns of this batch */
    double *length, *delay;
    double (*departure)[2], (*arrival)[2];
    double *doppler;              /* [count][F] */
    double complex *gain;         /* [count][F] */
    double complex *transfer;     /* [count][F][2][2]; NULL for sound */
    double *weight, *patch;       /* as in KellerPath: with part and free_end, what no interaction tells of a path */
    double (*part)[2];
    uint8_t *interaction_kind;    /* [interaction_count] */
    KellerVec3 *interaction_position;
    uint32_t *interaction_triangle, *interaction_wedge;  /* KELLER_NONE where it does not apply */
    uint8_t *interaction_free_end;
} KellerPathBatch;

/* Angles of which there is a spread. */
typedef enum {
    KELLER_DEPARTURE_AZIMUTH,
    KELLER_DEPARTURE_ZENITH,
    KELLER_ARRIVAL_AZIMUTH,
    KELLER_ARRIVAL_ZENITH,
    KELLER_ANGLES               /* how many */
} KellerAngle;

/* Sums over the paths of one pair. Spreads are weighted with the power at the first frequency. */
typedef struct {
    uint32_t tx, rx;
    size_t paths, frequency_count;
    double *path_gain;            /* [F] |sum of gains|^2, and the sum of |gain|^2 of scattered paths */
    double *path_gain_incoherent; /* [F] sum of |gain|^2 of all paths: its mean over the surroundings, roughly */
    double delay_spread;          /* s, rms; NaN: no power arrives */
    double strongest_delay;       /* s; NaN: no power arrives */
    double angle_spread[KELLER_ANGLES]; /* rad, circular standard deviation; NaN: no power arrives */
} KellerPairSums;

/* sqrt(-2 ln |sum of p e^{j angle} / sum of p|) of `count` angles (rad) with powers p >= 0 (3GPP TR 38.901, A.1; the circular
 * standard deviation of Mardia and Jupp, Directional Statistics, 2.3.1): 0 for one angle, nearly the rms deviation of angles that are
 * near each other, infinite where they cancel. NaN without power. */
double keller_angle_spread(size_t count, const double *angle, const double *power);

/* KellerPairSums of one transmitter at every point of one grid; NaN where there is none (KellerReceiverSet.draped). */
typedef struct {
    uint32_t tx, set;
    uint32_t ny, nx;
    size_t frequency_count;
    double *path_gain;            /* [F][ny][nx] */
    double *path_gain_incoherent; /* [F][ny][nx] */
    double *delay_spread;         /* [ny][nx] */
    double *strongest_delay;      /* [ny][nx] */
    double *angle_spread[KELLER_ANGLES]; /* [ny][nx] each */
    double *level;                /* sound: [F][ny][nx] dB re 20 uPa, of the band or tone; -infinity: no path. Radio: NULL */
    double *level_a;              /* sound: [ny][nx] dB, A-weighted, of all frequencies together */
} KellerCoverage;

typedef struct {
    uint64_t cones, nodes, triangles, valid_paths, dropped_paths;
    uint64_t candidates;          /* sequences looked at for a receiver or a cell */
    uint64_t boundary_paths;      /* of weight below 1: too close to call, so each with its share */
    uint64_t cornered_paths;      /* of them those on two boundaries at once whose shares are estimates: below 1/2, and no power of it */
    uint64_t crowded_paths;       /* over three or more edges in each other's transition zones that are askew, at the lowest frequency */
    double dropped_ratio;         /* of a pair's dropped paths the sum of |gain|, over its strongest one: the largest */
    double seconds_search, seconds_solve;
    uint32_t threads;
} KellerSimulationWork;

/* Where a simulation's output goes. Calls come from one thread, in order of transmitter, then receiver, then delay.
 * A status other than KELLER_OK ends the simulation with it. */
typedef struct {
    void *context;
    KellerStatus (*paths)(void *context, const KellerPathBatch *batch, KellerError *error);       /* may be NULL */
    KellerStatus (*coverage)(void *context, const KellerCoverage *coverage, KellerError *error);  /* may be NULL */
    void (*progress)(void *context, double fraction);   /* in [0, 1]; may be NULL; called now and then */
    /* sound with config->response_rate > 0: of each pair whose receiver is not of a grid; may be NULL */
    KellerStatus (*response)(void *context, const KellerResponse *response, KellerError *error);
    /* of each pair whose receiver is not of a grid, in order; may be NULL */
    KellerStatus (*pair)(void *context, const KellerPairSums *sums, KellerError *error);
} KellerSink;

/* Where a simulation gets the geometry of its paths from, instead of searching it. pair() is called once for each pair, in order of
 * transmitter, then receiver, from one thread, and calls found(found_context, path) for each path of the pair, with all of it but the
 * legs' directions. A status other than KELLER_OK ends the simulation with it; so does a `found` that returns false, as KELLER_FAILED. */
typedef struct {
    void *context;
    const char *name;             /* for messages */
    KellerStatus (*pair)(void *context, uint32_t tx, uint32_t rx, KellerPathFound found, void *found_context, KellerError *error);
} KellerPathSource;

/* Checks what this build can do against what the configuration asks for (domain, orders, frequencies in the materials'
 * ranges), without simulating. */
KellerStatus keller_simulation_check(const KellerConfig *config, const KellerScene *scene, KellerError *error);

/* Finds all paths and hands them to the sink. A receiver whose z is NaN has none. */
KellerStatus keller_simulate(const KellerConfig *config, const KellerScene *scene, const KellerAccel *accel,
                             const KellerSink *sink, KellerSimulationWork *work, KellerError *error);

/* The same with paths that an earlier simulation found in this scene: their legs are solved from their points and sequences, and all
 * fields, sums and what is dropped are computed afresh, bit for bit as keller_simulate does. KELLER_BAD_INPUT: a path's points do not
 * fit its sequence in this scene. */
KellerStatus keller_simulate_known(const KellerConfig *config, const KellerScene *scene, const KellerPathSource *source,
                                   const KellerSink *sink, KellerSimulationWork *work, KellerError *error);
#endif
