/* Shared by the files of src/path. */
#ifndef KELLER_PATH_INTERNAL_H
#define KELLER_PATH_INTERNAL_H
#include <stdbool.h>
#include <stdint.h>
#include "base/number.h"
#include "keller/path.h"

/* A step as one word: the id, and the top bit for a wedge. */
typedef uint32_t StepCode;
#define CODE_WEDGE 0x80000000u
static inline StepCode code_face(uint32_t face) { return face; }
static inline StepCode code_wedge(uint32_t wedge) { return wedge | CODE_WEDGE; }
static inline bool code_is_wedge(StepCode code) { return (code & CODE_WEDGE) != 0; }
static inline uint32_t code_id(StepCode code) { return code & ~CODE_WEDGE; }

/* Rounding of positions in this scene near p, in m: 64 units in the last place of the largest coordinate. Things nearer
 * than this cannot be told apart. */
static inline double path_rounding(const KellerScene *scene, KellerVec3 p)
{
    double size = greater(fabs(p.x), greater(fabs(p.y), fabs(p.z)));
    size = greater(size, greater(fabs(scene->lower.x), fabs(scene->upper.x)));
    size = greater(size, greater(fabs(scene->lower.y), fabs(scene->upper.y)));
    size = greater(size, greater(fabs(scene->lower.z), fabs(scene->upper.z)));
    return 64 * 0x1p-52 * size;
}

/* Does the wedge's sector hold the direction v (from the edge outwards)? Angles within `slack` (radians) of a face count
 * as in it. */
bool path_in_sector(const KellerWedge *wedge, KellerVec3 v, double slack);

/* True if the wedge's edge lies in a plane of that id. */
bool path_wedge_in_plane(const KellerScene *scene, const KellerWedge *wedge, uint32_t plane);

/* Is the straight leg from a to b free of the scene's triangles? Planes listed in skip_a/skip_b (ids as in KellerFace)
 * hold a or b and do not block. strict: hits on edges are decided by sign alone, each for exactly one side. Else a leg
 * that only grazes edges (within KELLER_BOUNDARY_ANGLE, or rounding) counts as free and *grazes is set. */
bool path_leg_free(const KellerScene *scene, const KellerAccel *accel, KellerVec3 a, KellerVec3 b, const uint32_t *skip_a,
                   size_t skip_a_count, const uint32_t *skip_b, size_t skip_b_count, bool strict, bool *grazes,
                   KellerAccelWork *work);

/* Paths found for one receiver. */
typedef struct {
    KellerPath *items;
    size_t count, capacity;
} PathList;

/* In a corner of faces whose reflections commute, a wave exactly on the diagonal meets them in either order: two sequences,
 * one image, each with its share of the weight. They become one path (SPEC 1). */
void path_list_merge_corners(const KellerScene *scene, PathList *list);

/* false: out of memory */
bool path_list_push(PathList *list, const KellerPath *path);

#endif
