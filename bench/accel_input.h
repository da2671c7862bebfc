/* accel_input.h -- what `keller bench accel` and `keller bench nexthit` build over: scenes from files, and random triangles. */
#ifndef BENCH_ACCEL_INPUT_H
#define BENCH_ACCEL_INPUT_H
#include "keller/accel.h"

typedef struct {
    char name[64];
    KellerAccelInput in;             /* of the scene's triangles and wedges, or of raw triangles and their edges */
    KellerScene scene;
    KellerSoup soup;
    KellerVec3 *vertices;            /* owned where not the scene's or the soup's */
    uint32_t (*triangles)[3], (*edges)[2];
    KellerVec3 lower, upper;
} AccelBench;

/* Reads a scene and builds its model; a file of more than `raw` triangles is taken as it is, with its edges, each once. */
KellerStatus accel_bench_read(const char *file, size_t raw, AccelBench *b, KellerError *error);
/* That many triangles, uniform in a cube of 100 m, with sides of about their mean distance. */
KellerStatus accel_bench_random(uint32_t count, AccelBench *b, KellerError *error);
/* That many sheets behind one another (KELLER_GENERATE_LAYERS), without edges. */
KellerStatus accel_bench_layers(uint32_t sheets, AccelBench *b, KellerError *error);
/* That many hairs of 31 triangles (KELLER_GENERATE_HAIR): thin and slanted. With its edges. */
KellerStatus accel_bench_hair(uint32_t strands, AccelBench *b, KellerError *error);
void accel_bench_free(AccelBench *b);
#endif
