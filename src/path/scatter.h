/* Diffuse scattering: faces cut into patches, each on paths of its own by way of its middle: straight from end to end, or with
 * reflections and diffractions before and behind it. */
#ifndef KELLER_PATH_SCATTER_H
#define KELLER_PATH_SCATTER_H
#include "path/join.h"

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

/* What is asked for, and the scene's patches. */
typedef struct {
    const KellerScene *scene;
    const KellerAccel *accel;
    const FaceBox *boxes;       /* of the scene's faces */
    uint32_t reflections, diffractions, transmissions, interactions;   /* of a path; interactions: all together, the scattering too */
    uint32_t bends;             /* reflections and diffractions together on a path that is scattered */
    Patches patches;
    uint32_t *first;            /* [face_count + 1]: where the patches of each face begin */
    TreeLimits search;          /* for what leads to the patches; used with bends > 0 */
    TreePlan plan;
    /* of the transmitter that scattering_from was last called for: */
    KellerVec3 tx;
    uint8_t *fewest;            /* [patches.count] bends of a way to the patch; PATCH_DARK: there is none */
    uint32_t *lit;              /* patches that there is a way to, in order, */
    size_t lit_count;           /* their number */
    PathList ways;              /* to patches, with bends, */
    uint32_t *way;              /* places in this list, by patch, then by bends, */
    uint8_t *way_bends;         /* how many each has, in the same order, */
    uint32_t *way_begin;        /* [patches.count + 1] and where each patch's begin; NULL: there are none */
} Scattering;
#define PATCH_DARK UINT8_MAX

/* Cuts the faces; where nothing scatters, or nothing is asked for, there are no patches. Errors as patches_of. Free with
 * scattering_free. */
KellerStatus scattering_init(Scattering *s, const KellerConfig *config, const KellerScene *scene, const KellerAccel *accel,
                             const FaceBox *boxes, KellerError *error);
void scattering_free(Scattering *s);
/* Finds what the transmitter lights. KELLER_FAILED: memory. */
KellerStatus scattering_from(Scattering *s, KellerVec3 tx, uint32_t threads, TreeWork *tree, KellerError *error);
/* Appends all paths from the transmitter to rx that are scattered; their order may depend on the number of threads.
 * KELLER_FAILED: memory. */
KellerStatus scattering_add(const Scattering *s, KellerVec3 rx, uint32_t threads, PathList *list, TreeWork *tree, JoinWork *work,
                            KellerError *error);

/* The phases of keller_scatter_field of the patch with this middle: spread over the circle without order from patch to patch, the same
 * in every run, at every frequency and for both directions. */
void patch_phase(KellerVec3 middle, double phase[2]);
#endif
