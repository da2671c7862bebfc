/* keller/accel.h -- finding the triangles that a segment or a cone meets.
 *
 * Boxes are in single precision, rounded outwards; the tests on triangles are in double precision. Read-only once built:
 * any number of threads may query. */
#ifndef KELLER_ACCEL_H
#define KELLER_ACCEL_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "keller/cone.h"
#include "keller/error.h"
#include "keller/scene.h"

typedef struct KellerAccel KellerAccel;

/* Work done by queries, added up by the caller's thread. */
typedef struct {
    uint64_t nodes, triangles;
} KellerAccelWork;

/* Builds the accelerator `name` ("auto" or "bvh": a binary hierarchy by binned SAH, four children to a node) over the
 * scene's triangles and wedges. The scene must outlive it. Errors: KELLER_FAILED (memory), KELLER_BAD_INPUT (unknown name). */
KellerStatus keller_accel_build(const char *name, const KellerScene *scene, KellerAccel **accel, KellerError *error);
/* An accelerator over some of the scene's wedges only and no triangles, for keller_accel_cone_wedges. `wedges` is copied. */
KellerStatus keller_accel_build_wedges(const KellerScene *scene, uint32_t count, const uint32_t *wedges,
                                       KellerAccel **accel, KellerError *error);
/* Frees an accelerator; NULL is allowed. */
void keller_accel_free(KellerAccel *accel);
/* The name of what was built ("bvh"), also where "auto" was asked for; static storage. */
const char *keller_accel_name(const KellerAccel *accel);

typedef bool (*KellerVisitTriangle)(void *context, uint32_t triangle);
/* Calls visit(context, triangle) for every triangle whose box, grown by `margin` (m), the segment a-b meets: a superset
 * of the triangles within `margin` of the segment. Stops when visit returns true, and then returns true. */
bool keller_accel_segment(const KellerAccel *accel, KellerVec3 a, KellerVec3 b, double margin,
                          KellerVisitTriangle visit, void *context, KellerAccelWork *work);

typedef double (*KellerVisitCone)(void *context, uint32_t primitive, KellerRange range);
/* Calls visit(context, triangle, range) for every triangle that the cone meets within `clip`, with the range of
 * keller_cone_triangle, nearer boxes first but in no exact order. visit returns the far end of the range still of
 * interest (INFINITY: all), so that a caller who found a wall can shorten the rest of the query. */
void keller_accel_cone(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, KellerVisitCone visit,
                       void *context, KellerAccelWork *work);
/* The same for the scene's wedges, with the range of keller_cone_edge. */
void keller_accel_cone_wedges(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, KellerVisitCone visit,
                              void *context, KellerAccelWork *work);
#endif
