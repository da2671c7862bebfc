/* accel_set.h -- what the measurements of accelerators share: the scenes they are asked for, the rays and cones they ask with, and how
 * they take the time. */
#ifndef BENCH_ACCEL_SET_H
#define BENCH_ACCEL_SET_H
#include "accel_input.h"

enum { PASSES = 5, ACCEL_MOST = 16 };

/* Scenes by the options --scene FILE, --random N and --hair STRANDS, each of which may be given up to 16 times; how many queries, and
 * the seed of their random numbers, by --queries N and --seed N. */
typedef struct {
    const char *scenes[ACCEL_MOST];
    uint32_t randoms[ACCEL_MOST], hairs[ACCEL_MOST];
    int scene_count, random_count, hair_count;
    double queries;
    uint64_t seed;
} AccelScenes;

/* Takes one of these options, or "--csv" (which has no value): how many words it was, 0 if it was none of them, or -1 and *wrong says
 * what is wrong with the value. */
int accel_scenes_option(AccelScenes *scenes, bool *csv, const char *name, const char *value, const char **wrong);
bool accel_scenes_none(const AccelScenes *scenes);
/* Reads a whole command line of such options, and of a program's own, all with a value: `own` takes one and returns NULL, or what is
 * wrong with the value; for a name that it does not know, accel_unknown. Returns 0, or prints what is wrong and `usage`, and returns 2. */
typedef const char *(*AccelOwnOption)(void *context, const char *name, const char *value);
extern const char accel_unknown[];
int accel_parse(int argc, char **argv, AccelScenes *scenes, bool *csv, AccelOwnOption own, void *context, const char *usage);
/* Calls measure for each, until it fails. */
typedef KellerStatus (*AccelMeasure)(void *context, const AccelBench *b, KellerError *error);
KellerStatus accel_scenes_measure(const AccelScenes *scenes, AccelMeasure measure, void *context, KellerError *error);
/* The whole text is a number in the range, and whole where it should be. */
bool accel_number(const char *text, double least, double most, bool whole, double *value);

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
