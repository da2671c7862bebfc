/* Diffuse scattering: faces cut into patches, each a path of its own by way of its middle. */
#ifndef KELLER_PATH_SCATTER_H
#define KELLER_PATH_SCATTER_H
#include "path/internal.h"

/* A part of a face. */
typedef struct {
    KellerVec3 middle;          /* centre of gravity */
    double area;                /* m^2 */
    uint32_t face, triangle;    /* the triangle that holds the middle */
} Patch;

typedef struct {
    Patch *list;
    size_t count, capacity;
} Patches;

/* More than this are refused. */
#define MOST_PATCHES 50000000u

/* Cuts all faces whose material scatters by a grid in each one's plane, with cells of at most `size` m a side: what lies of a face
 * in a cell is a patch. The grid spans the face, so the patches do not depend on how the face is cut into triangles (but for
 * rounding). Where the middle of a patch is not on the face, as around a corner or a hole, the patch is quartered.
 * Errors: KELLER_FAILED (memory), KELLER_BAD_INPUT (more than MOST_PATCHES). Free with patches_free. */
KellerStatus patches_of(const KellerScene *scene, double size, Patches *patches, KellerError *error);
void patches_free(Patches *patches);

/* Moves those that can be seen from tx, passing through up to `transmissions` slabs, to the front, in order; their number. */
size_t patches_seen(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, uint32_t transmissions, uint32_t threads,
                    const Patches *patches, uint32_t *seen, KellerAccelWork *work);

/* Appends the paths from tx to rx that are scattered by one of the patches `seen` from tx. false: memory. */
bool scatter_add(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, KellerVec3 rx, uint32_t transmissions,
                 const Patches *patches, size_t seen_count, const uint32_t *seen, PathList *list, KellerAccelWork *work);

/* The phases of keller_scatter_field of the patch with this middle: spread over the circle without order from patch to patch, the same
 * in every run, at every frequency and for both directions. */
void patch_phase(KellerVec3 middle, double phase[2]);
#endif
