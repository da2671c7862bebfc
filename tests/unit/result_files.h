/* A small simulation made by hand, written as a result file in a folder of its own, for tests of what is written and read.
 * Failures abort the test. */
#ifndef KELLER_TESTS_RESULT_FILES_H
#define KELLER_TESTS_RESULT_FILES_H
#include "io/result_read.h"
#include "keller/result.h"

enum { FREQUENCIES = 2, TRANSMITTERS = 2, GRID_NY = 2, GRID_NX = 3, RECEIVERS = 1 + GRID_NY * GRID_NX };

/* The folder, and the only file that should ever be in it. */
extern char result_folder[], result_target[];

typedef struct {
    KellerConfig config;
    KellerScene scene;
    double frequencies[FREQUENCIES];
    KellerTransmitter transmitters[TRANSMITTERS];
    KellerReceiverSet sets[2];
    KellerReceiver receivers[RECEIVERS];
    KellerVec3 vertices[4];
    uint32_t triangles[2][3], face[2], object[2], source[2], sheets[2];
    KellerFace faces[2];
    KellerWedge wedges[1];
    KellerMaterial materials[2];
    char *objects[2];
} World;

void result_world(World *w);
/* Path number p of the whole run has values that no other path has, with all bits in use; */
double result_value(uint64_t p, unsigned what);
/* and p % 3 interactions. Appends the paths [first, first + count). */
KellerStatus result_append(KellerResult *result, uint64_t first, size_t count, KellerError *error);
/* The whole result with so many paths. */
void result_write(const World *w, bool force, uint64_t paths);
int result_entries(void); /* of the folder */

KellerReader *result_open(void);
void result_rows(KellerReader *reader, const char *path, KellerCell cell, uint64_t width, uint64_t first, uint64_t count,
                 void *data);

char *result_slurp(const char *file, size_t *size); /* to be freed; of 4 MiB at most */
void result_spill(const char *file, const char *bytes, size_t size);

/* For cmocka: makes the folder; deletes the file after each case; at the end deletes the folder, which fails if anything is
 * left. */
int result_start(void **state);
int result_clean(void **state);
int result_end(void **state);
#endif
