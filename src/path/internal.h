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

/* Rounding of the position p, in m: 64 units in the last place of its largest coordinate. */
static inline double path_rounding_at(KellerVec3 p)
{
    return 64 * 0x1p-52 * greater(fabs(p.x), greater(fabs(p.y), fabs(p.z)));
}

/* Rounding of positions in this scene near p, in m: of the largest coordinate of all. Things nearer than this cannot be told apart. */
static inline double path_rounding(const KellerScene *scene, KellerVec3 p)
{
    return greater(path_rounding_at(p), greater(path_rounding_at(scene->lower), path_rounding_at(scene->upper)));
}

/* Does the wedge's sector hold the direction v (from the edge outwards)? Angles within `slack` (radians) of a face count
 * as in it. */
bool path_in_sector(const KellerWedge *wedge, KellerVec3 v, double slack);

/* The face of the wedge's sector along which v runs, from the edge outwards: 0, 1, or -1 if along neither. */
int path_along_face(const KellerWedge *wedge, KellerVec3 v);

/* Bounds of what the points of the segment from a to b have along the wedge's line, z (m from its origin), and away from it,
 * near .. far (m). The segment may be a point. */
void path_line_distances(const KellerWedge *wedge, KellerVec3 a, KellerVec3 b, double *z_low, double *z_high, double *near,
                         double *far);

/* Bounds of z/rho for z in [z_low, z_high] and rho in [near, far], 0 <= near <= far: infinite where rho may be 0. With z from one
 * point to another along an edge and rho between them across it, that is the cotangent of the angle to the edge. */
static inline void path_cotangents(double z_low, double z_high, double near, double far, double *low, double *high)
{
    *low = z_low < 0 ? (near > 0 ? z_low / near : -INFINITY) : z_low > 0 ? z_low / far : 0;
    *high = z_high > 0 ? (near > 0 ? z_high / near : INFINITY) : z_high < 0 ? z_high / far : 0;
}

/* What is left of the wave diffracted in step i of the path where the edge ends near by: from 1 far from the ends to 0 at them,
 * so that nothing jumps as the point leaves the edge. stiffness is k times Cascade.along (rad/m^2). Ends that are not free, or where
 * the edge goes on as another wedge, do not count. docs/theory.md, "Ends of edges". */
double path_end_fade(const KellerScene *scene, const KellerPath *path, uint32_t i, double stiffness);

/* True if the wedge's edge lies in a plane of that id. */
bool path_wedge_in_plane(const KellerScene *scene, const KellerWedge *wedge, uint32_t plane);

/* True if the face is a slab, which a ray may pass through; a half-space and a conductor let nothing through. */
bool path_lets_through(const KellerScene *scene, uint32_t face);

/* Reflections and diffractions that one path may have together. */
uint32_t path_longest_sequence(const KellerConfig *config);

/* A slab that a leg passes through. */
typedef struct {
    uint32_t leg;               /* number of the leg */
    uint32_t face, triangle;
    uint32_t at;                /* face whose plane says where: the first one in the plane that the leg passes through */
} Crossing;

typedef struct {
    uint32_t most;              /* allowed, <= KELLER_MAX_INTERACTIONS */
    uint32_t *blocker;          /* NULL, or by number of leg the triangle that was last in such a leg's way, or KELLER_NONE: tried first
                                   where no slab may be passed through, as it mostly is in the way of the next one too */
    uint32_t count;
    Crossing at[KELLER_MAX_INTERACTIONS];   /* in order along the path */
} Crossings;

/* Where the line from a to b, at *t of the way, crosses the face's plane: the end or start where that is beyond it. */
KellerVec3 path_crossing(const KellerScene *scene, uint32_t face, KellerVec3 a, KellerVec3 b, double *t);

enum { PATH_MAX_GRAZES = 16 };

/* Where a leg grazes edges, in parts of its length; more than there is room for are not counted. */
typedef struct {
    uint32_t count;
    double at[PATH_MAX_GRAZES];
} Grazes;

/* A straight leg from a to b. Planes listed in skip[0], skip[1] (ids as in KellerFace) hold a or b: what is in them is not in
 * the way. strict: hits on edges are decided by sign alone, each for exactly one side. Else a leg that only grazes edges
 * (within KELLER_BOUNDARY_ANGLE, or rounding) counts as free of their triangles. */
typedef struct {
    uint32_t number;
    KellerVec3 a, b;
    const uint32_t *skip[2];
    size_t skip_count[2];
    bool strict;
    KellerVec3 lift;            /* m: obstacles are met as if the leg were shifted by so much. A leg along a face, between two of
                                   its edges, lies just above it: what stands on the face is in the way, what is below is not */
    Grazes *grazes;             /* not strict: every edge that is grazed is written here, may be NULL */
} PathLeg;

/* Appends every slab that the leg passes through, in order along it: a face once, where the leg crosses one of its inner
 * edges too, but each of coincident faces, and of coincident sheets of one face. False if the leg is blocked: by what
 * lets nothing through, or by more slabs than are allowed; then what was appended means nothing. *grazes is set where an
 * edge was grazed. */
bool path_leg_passes(const KellerScene *scene, const KellerAccel *accel, const PathLeg *leg, Crossings *crossings, bool *grazes,
                     KellerAccelWork *work);

/* ---- lists of paths ----------------------------------------------------------------------------------------------------- */

typedef struct {
    KellerVec3 leg, position;   /* the leg before the interaction; behind the last one a node with only its leg */
    KellerStep step;
    uint32_t triangle;
    uint8_t free_end;
} PathNode;

typedef struct {
    double length, weight, patch, part[2];
    size_t begin;               /* into the nodes: count + 1 of them */
    uint32_t count;
} PathItem;

/* Paths found for one receiver, packed: KellerPath has room for more interactions than nearly any path has. */
typedef struct {
    PathItem *items;
    size_t count, capacity;
    PathNode *nodes;
    size_t node_count, node_capacity;
} PathList;

/* false: out of memory */
bool path_list_push(PathList *list, const KellerPath *path);
bool path_list_append(PathList *to, const PathList *from);
void path_list_get(const PathList *list, size_t index, KellerPath *path);
/* By length, then by the steps, then by where they are. */
void path_list_sort(PathList *list);
void path_list_free(PathList *list);

/* In a corner of faces whose reflections commute, a wave exactly on the diagonal meets them in either order: two sequences,
 * one image, each with its share of the weight. They become one path (SPEC 1). */
void path_list_merge_corners(const KellerScene *scene, PathList *list);

#endif
