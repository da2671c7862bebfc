/* keller/accel.h -- finding the triangles and edges that a ray, a segment or a cone meets.
 *
 * Three structures behind one interface: "kdtree" (SAH k-d tree, Wald and Havran 2006), "bvh" (binary hierarchy by binned SAH)
 * and "bvh8" (eight children a node, tested at once; Emre et al. 2025, section 4.3); "+mask" after the last two gives every box
 * a mask of the cells in it that are not empty (Yoshimura and Harada 2023). A fourth, "ubvh", has skewed boxes, of which the smallest are
 * the triangles themselves (Kacerik and Bittner 2026). A fifth, "dacrt", is none: it answers batches by divide and conquer (Mora 2011), and
 * a query alone by a loop over all, for jobs too small to build for. They answer alike: a
 * query never misses what the exact test of keller/ray.h or keller/cone.h on every primitive would report, and reports
 * nothing else. Ties are broken by the primitive's number, so that answers do not depend on the structure. Boxes and leaves are in single precision
 * relative to the scene's middle, rounded outwards; what they leave is decided in double precision on the caller's vertices.
 *
 * Read-only once built: any number of threads may query. */
#ifndef KELLER_ACCEL_H
#define KELLER_ACCEL_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "keller/cone.h"
#include "keller/error.h"
#include "keller/scene.h"

typedef struct KellerAccel KellerAccel;

/* Work done by queries, added up by the caller's thread. Start with {0}. */
typedef struct {
    uint64_t nodes;                 /* boxes tested, eight at a time count as one */
    uint64_t triangles, edges;      /* that leaves offered to a test */
} KellerAccelWork;

/* ---- building --------------------------------------------------------------------------------------------------- */

/* What to build over; the arrays are the caller's and must outlive the accelerator. Coordinates are finite. */
typedef struct {
    uint32_t triangle_count, edge_count;
    const KellerVec3 *vertices;
    const uint32_t (*triangles)[3]; /* indices into vertices; degenerate triangles are allowed and met by cones only */
    const uint32_t (*edges)[2];     /* the edges of interest (a scene's wedges), indices into vertices; a primitive each */
} KellerAccelInput;

/* By what the children of a node are put in order, nearest first (Emre et al. 2025, section 4.1). It changes the time of a nearest
 * hit, never an answer. */
typedef enum {
    KELLER_ORDER_SLABS,             /* where the frustum's bounds on the box begin: known from the test, and conservative */
    KELLER_ORDER_EXACT,             /* the nearest point of box and cone (keller_cone_box) */
    KELLER_ORDER_DIRECTRIX,         /* where the directrix enters the box, or comes nearest to do so */
    KELLER_ORDER_MIDPOINT           /* the box's middle, projected on the directrix */
} KellerAccelOrder;

/* Masks of "bvh+mask" and "bvh8+mask" (Yoshimura and Harada 2023). All zero is a good default; it changes no answer. */
typedef struct {
    int resolution;                 /* cells along each axis of a box: 4 (0) or 6 */
    int levels;                     /* 0: only leaves have masks; n > 0: nodes too, made from the masks n levels below; -1: made
                                       from all that is below */
    bool compressed;                /* 256 masks stand for all: a byte a box in place of 8, or of 48 */
    bool table;                     /* passages of rays by table, not exactly */
} KellerMaskOptions;

/* Boxes of "ubvh" (Kacerik and Bittner 2026). All zero is a good default; it changes no answer. */
typedef enum {
    KELLER_BOXES_SKEWED,            /* the best three slabs of a 64-DOP */
    KELLER_BOXES_ORIENTED,          /* the best of 32 orthogonal frames */
    KELLER_BOXES_DOP14              /* seven slabs, the same for all; leaves are blocks, nodes have eight children */
} KellerBoxes;
typedef enum {
    KELLER_PAIRS_NONE,
    KELLER_PAIRS_PLOC,              /* by choice among neighbours: less memory, more time */
    KELLER_PAIRS_GREEDY             /* each with the next, as they come */
} KellerPairs;
typedef struct {
    KellerBoxes boxes;
    KellerPairs pairs;              /* of triangles that share a box */
    int width;                      /* children of a node: 8 (0) or 4 */
    bool blocks;                    /* leaves are up to eight triangles as they are; else boxes, each around one triangle or a pair */
    bool everywhere;                /* all boxes are skewed; else those of nodes where it makes them enough smaller. Not for DOP14 */
} KellerSkewedOptions;

/* How. All zero is a good default. Order, contained and leaf_boxes concern cones on bvh and bvh8: what was measured best is the
 * default, the others are there to be measured against (docs/performance.md). */
typedef struct {
    const char *name;               /* "auto" (NULL), "kdtree", "bvh", "bvh8", "bvh+mask", "bvh8+mask", "auto+mask", "ubvh",
                                       "dacrt" */
    double cost_ratio;              /* cost of eight primitives' tests over that of a node's; 0: measured for the structure */
    double spatial;                 /* share of additional references that spatial splits may make; 0: none. Not for kdtree, ubvh */
    int threads;                    /* 0: as many as OpenMP likes. The result does not depend on it */
    KellerAccelOrder order;
    int contained;                  /* look for boxes that a cone contains, to pass by all tests below them (section 4.2): 0: for
                                       cones wide enough, 1: always, -1: never */
    bool leaf_boxes;                /* before a leaf, the accurate test of its box (section 4.3) */
    KellerMaskOptions masks;
    KellerSkewedOptions skewed;
    /* What will be asked, all in batches; 0, 0: not known, or much. With "auto", "dacrt" is taken for what is less than building. */
    size_t rays, cones;
} KellerAccelOptions;

/* Errors: KELLER_FAILED (memory), KELLER_BAD_INPUT (unknown name, or number of cells). Free with keller_accel_free. */
KellerStatus keller_accel_new(const KellerAccelInput *input, const KellerAccelOptions *options, KellerAccel **accel,
                              KellerError *error);
/* The same over a scene's triangles and wedges (edge i is wedge i). The scene must outlive it. */
KellerStatus keller_accel_build(const char *name, const KellerScene *scene, KellerAccel **accel, KellerError *error);
/* An accelerator over some of the scene's wedges only and no triangles; keller_accel_cone reports them by
 * their numbers in the scene. `wedges` is copied. */
KellerStatus keller_accel_build_wedges(const KellerScene *scene, uint32_t count, const uint32_t *wedges,
                                       KellerAccel **accel, KellerError *error);
/* Frees an accelerator; NULL is allowed. */
void keller_accel_free(KellerAccel *accel);
/* The name of what was built, also where "auto" was asked for; static storage. */
const char *keller_accel_name(const KellerAccel *accel);
/* Bytes held by the structure, without the caller's arrays. */
size_t keller_accel_bytes(const KellerAccel *accel);

/* ---- rays ------------------------------------------------------------------------------------------------------- */

/* Directions are of any length from 1e-15 to 1e15 m, coordinates below 1e15 m: leaves are in single precision. */
typedef struct {
    double t;                       /* in units of the direction's length */
    uint32_t triangle;
} KellerRayHit;

/* The hit with the least (t, triangle) in the closed range `clip`; false: none. */
bool keller_accel_ray_nearest(const KellerAccel *accel, KellerVec3 origin, KellerVec3 direction, KellerRange clip,
                              KellerRayHit *hit, KellerAccelWork *work);
/* Is there any hit in the range? Stops at the first found. */
bool keller_accel_ray_any(const KellerAccel *accel, KellerVec3 origin, KellerVec3 direction, KellerRange clip,
                          KellerAccelWork *work);
/* Calls visit(context, hit) for every hit in the range, in no order, each triangle once, until visit returns true. */
typedef bool (*KellerVisitRay)(void *context, KellerRayHit hit);
/* True if visit stopped it. */
bool keller_accel_ray_all(const KellerAccel *accel, KellerVec3 origin, KellerVec3 direction, KellerRange clip,
                          KellerVisitRay visit, void *context, KellerAccelWork *work);
/* keller_accel_ray_nearest for `count` rays by `threads` threads (0: as OpenMP likes); hits[i].triangle is KELLER_NONE where
 * there is none. */
void keller_accel_rays_nearest(const KellerAccel *accel, size_t count, const KellerVec3 *origins,
                               const KellerVec3 *directions, KellerRange clip, KellerRayHit *hits, int threads,
                               KellerAccelWork *work);

/* Bytes that such a batch allocates while it runs, at once: 0 but for "dacrt", which takes 32 a triangle and thread and some 74 a ray;
 * the same for keller_accel_cones_nearest and, with one thread, keller_accel_cones: 32 a triangle or eighth of a block of edges,
 * and some 180 a cone. Where they are not to be had, the queries are asked one by one. */
size_t keller_accel_rays_bytes(const KellerAccel *accel, size_t count, int threads);
/* As above, of keller_accel_cones_nearest, or of keller_accel_cones with one thread. */
size_t keller_accel_cones_bytes(const KellerAccel *accel, size_t count, int threads);

typedef bool (*KellerVisitTriangle)(void *context, uint32_t triangle);
/* Calls visit(context, triangle), once each, for every triangle within `margin` (m) of the segment a-b and for some beyond, by
 * the rounding of single precision. Stops when visit returns true, and then returns true. */
bool keller_accel_segment(const KellerAccel *accel, KellerVec3 a, KellerVec3 b, double margin,
                          KellerVisitTriangle visit, void *context, KellerAccelWork *work);

/* ---- cones ------------------------------------------------------------------------------------------------------ */

typedef struct {
    KellerRange range;              /* contains the true range of z, as keller_cone_triangle's and keller_cone_edge's do */
    uint32_t primitive;
} KellerConeHit;

typedef double (*KellerVisitCone)(void *context, uint32_t primitive, KellerRange range);
/* Calls visit(context, triangle, range) for every triangle that the cone meets within `clip`, with the range of
 * keller_cone_triangle, and visit_edge for every edge or wedge, with that of keller_cone_edge, or, for what is surely inside the
 * cone, that of its vertices widened by KELLER_CONE_SLACK_FLOAT of the coordinates: each once, nearer boxes first but
 * in no exact order. Either may be NULL. They return the far end of the range still of interest (INFINITY: all), so that a
 * caller who found a wall can shorten the rest of the query. */
void keller_accel_cone(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, KellerVisitCone visit,
                       KellerVisitCone visit_edge, void *context, KellerAccelWork *work);
/* The same for a caller with a test of its own: what the single-precision tests leave, some of which the cone may not meet,
 * and always with the range of the vertices. */
void keller_accel_cone_loosely(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, KellerVisitCone visit,
                               KellerVisitCone visit_edge, void *context, KellerAccelWork *work);
/* The triangle with the least (range.near, triangle); false: none is met. */
bool keller_accel_cone_nearest(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, KellerConeHit *hit,
                               KellerAccelWork *work);
/* Is any triangle met? Stops at the first found (a shadow cone). */
bool keller_accel_cone_any(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, KellerAccelWork *work);
/* The window behind the nearest triangle: *nearest as above, then visit for every triangle and visit_edge for every edge
 * whose range begins at nearest->range.near + depth (m) or before; either may be NULL. False: no triangle is met, and then
 * visit_edge is called for every edge in the cone. */
bool keller_accel_cone_window(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, double depth,
                              KellerConeHit *nearest, KellerVisitCone visit, KellerVisitCone visit_edge, void *context,
                              KellerAccelWork *work);
/* keller_accel_cone_nearest for `count` cones by `threads` threads; hits[i].primitive is KELLER_NONE where none is met. */
void keller_accel_cones_nearest(const KellerAccel *accel, size_t count, const KellerCone *cones, KellerRange clip,
                                KellerConeHit *hits, int threads, KellerAccelWork *work);
typedef double (*KellerVisitCones)(void *context, size_t query, uint32_t primitive, KellerRange range);
/* keller_accel_cone for `count` cones, whose numbers the visitors are told; in any order, also of the cones. */
void keller_accel_cones(const KellerAccel *accel, size_t count, const KellerCone *cones, KellerRange clip, KellerVisitCones visit,
                        KellerVisitCones visit_edge, void *context, KellerAccelWork *work);
/* Is the cone wholly blocked within `clip`, so that no ray of it passes? Never true where one does. Then triangles[0 ..
 * *count), at most `most` of them, are triangles of a surface that blocks it, nearest first by range. The surface is followed
 * from triangle to triangle over the edges that the cone meets, and blocks if it has no free edge inside the cone and the
 * axis passes it an odd number of times. Vertices must be shared (welded) for edges to be. False, too, where the connected
 * surface inside the cone has more than `most` triangles, or the cone meets more than 4 most + 64, and without memory. */
bool keller_accel_cone_blocked(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, size_t most,
                               uint32_t *triangles, size_t *count, KellerAccelWork *work);
#endif
