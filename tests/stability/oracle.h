/* oracle.h -- every path between two points by brute force: slow, obvious, and independent of src/path, src/geom and
 * src/accel. It takes from the library only the scene model (triangles, faces, planes, wedges).
 *
 * Each decision of the oracle carries a margin: how far, in metres, something would have to move for the decision to be
 * the other one. Below ORACLE_TOLERANCE a candidate is undecidable, and a solver may have the path or not. */
#ifndef TEST_ORACLE_H
#define TEST_ORACLE_H
#include "keller/path.h"
#include "keller/scene.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define ORACLE_TOLERANCE 1e-7
#define ORACLE_MAX_STEPS 8

typedef struct {
    uint32_t count;
    KellerStep step[ORACLE_MAX_STEPS];
    KellerVec3 position[ORACLE_MAX_STEPS];
    double length; /* m */
    uint32_t bends; /* steps that are not transmissions */
    bool valid;    /* as far as can be told */
    double margin; /* of the verdict: of a valid path the smallest, of an invalid one the largest that failed */
} OraclePath;

typedef struct {
    size_t count, capacity;
    OraclePath *path;   /* the valid paths, and the invalid ones whose margin is below ORACLE_TOLERANCE */
    size_t candidates;  /* sequences solved */
    size_t undecidable; /* paths in `path` whose margin is below ORACLE_TOLERANCE */
} OracleResult;

/* All paths from tx to rx. */
OracleResult oracle_enumerate(const KellerScene *scene, KellerVec3 tx, KellerVec3 rx, uint32_t reflections,
                              uint32_t diffractions, uint32_t interactions);
/* The same with up to so many transmissions: a leg passes through slabs, each a step of its own. An invalid path has no
 * transmissions among its steps. */
OracleResult oracle_enumerate_through(const KellerScene *scene, KellerVec3 tx, KellerVec3 rx, uint32_t reflections,
                                      uint32_t diffractions, uint32_t transmissions, uint32_t interactions);
void oracle_free(OracleResult *result);

/* Solves one sequence of reflections and diffractions, with up to so many transmissions on its legs. False where the
 * sequence is none by the rules (two successive reflections in one plane; a reflection next to a diffraction in a plane
 * that holds the edge). */
bool oracle_solve(const KellerScene *scene, KellerVec3 tx, KellerVec3 rx, uint32_t count, const KellerStep *steps,
                  uint32_t transmissions, OraclePath *path);

/* Is the leg from a to b crossed by a triangle whose plane is none of the given ones? With the margin of the
 * verdict. */
bool oracle_blocked(const KellerScene *scene, KellerVec3 a, KellerVec3 b, size_t plane_count, const uint32_t *planes,
                    double *margin);
#endif
