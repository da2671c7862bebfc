/* keller/nexthit.h -- all that a ray or a cone meets, one after another, none lost and none twice.
 *
 * Wald, Amstutz, Benthin, "Robust Iterative Find-Next-Hit Ray Traversal", EGPGV 2018. Hits have one total order: by distance,
 * then by the triangle's number (section 3). The distance of a ray's hit is its t, bit for bit that of keller_ray_triangle;
 * of a cone's hit it is range.near, bit for bit that of keller_cone_triangle. Stepping from a hit to the next in this order
 * needs no epsilon: any number of coplanar triangles come one by one.
 *
 *     KellerNexthit *it;
 *     if (keller_nexthit_new(&it, &error) != KELLER_OK) ...
 *     for (...) {                                               // ray after ray, in the same memory
 *         KellerRayHit hit;
 *         KellerStatus status = keller_nexthit_ray(it, accel, origin, direction, (KellerRange){0, INFINITY}, NULL, &error);
 *         while (status == KELLER_OK && (status = keller_nexthit_next_ray(it, &hit, &error)) == KELLER_OK &&
 *                hit.triangle != KELLER_NONE) ...               // stop at any hit
 *         if (status != KELLER_OK) ...
 *     }
 *     keller_nexthit_free(it);
 *
 * An iterator belongs to one thread at a time; any number of them may run over one accelerator, interleaved or in parallel. */
#ifndef KELLER_NEXTHIT_H
#define KELLER_NEXTHIT_H
#include "keller/accel.h"

/* All give the same hits in the same order; they differ in what a hit costs (docs/performance.md). */
typedef enum {
    KELLER_NEXTHIT_QUEUE,           /* section 4: resumes where it stopped. All structures but "kdtree" and "dacrt" */
    KELLER_NEXTHIT_RESTART,         /* section 3: looks for the nearest hit behind the last one, each time from the root */
    KELLER_NEXTHIT_FILTER,          /* finds all hits when the first is asked for, and sorts them */
    KELLER_NEXTHIT_FILTER_N         /* finds `batch` hits at a time, leaving out what lies behind the last of them */
} KellerNexthitMethod;

/* What comes first among hits at exactly the same distance. */
typedef enum {
    KELLER_NEXTHIT_BY_TRIANGLE,     /* the lesser number */
    /* What leaves a solid before what enters one, then the lesser number: where media touch, the one is left before the next is
     * entered. A hit leaves if keller_nexthit_leaves says so of the ray's direction or the cone's directrix: this order trusts
     * the sense in which the accelerator's triangles run around their solid (counter-clockwise seen from outside). Scenes do
     * not promise one (docs/architecture.md, "Orientation is not trusted"): whoever knows the sense turns them first.
     *
     * Distances are compared as they are, without a tolerance, which would be no order. So it acts where t are equal bit for
     * bit: for faces whose triangles touch with the same corners, however they run, and for planes across the axis along
     * which the ray runs most. */
    KELLER_NEXTHIT_LEAVE_FIRST
} KellerNexthitOrder;

/* Does a ray along `direction` go through the triangle abc from its back to its front: direction . ((b - a) x (c - a)) > 0,
 * in double precision? A degenerate triangle is entered. */
bool keller_nexthit_leaves(KellerVec3 direction, KellerVec3 a, KellerVec3 b, KellerVec3 c);

/* A place in the order: that of a hit, of which it has t or range.near, and the triangle. */
typedef struct {
    double distance;
    uint32_t triangle;
} KellerNexthitKey;

/* How. All zero, or NULL, is a good default. */
typedef struct {
    KellerNexthitMethod method;
    KellerNexthitOrder order;
    uint32_t batch;                 /* for FILTER_N: hits expected to be asked for; 0 is 1. If more are, it looks for as many again */
    /* The hits strictly between these two alone; NULL: no bound. The key of a hit seen before resumes behind it. */
    const KellerNexthitKey *after, *before;
    KellerAccelWork *work;          /* NULL, or where the work is added; must outlive the iteration */
} KellerNexthitOptions;

typedef struct KellerNexthit KellerNexthit;

/* Does the method QUEUE run over it? */
bool keller_nexthit_resumes(const KellerAccel *accel);

/* An iterator, to be used for any number of rays and cones; some 2 kB, and what the longest queue so far asked for: 16 bytes a
 * hit or node, 8 more a cone's hit, in powers of two. Once grown, no ray that needs no more allocates. Errors: KELLER_FAILED (memory). */
KellerStatus keller_nexthit_new(KellerNexthit **it, KellerError *error);
/* Frees an iterator; NULL is allowed. */
void keller_nexthit_free(KellerNexthit *it);
/* Bytes held. */
size_t keller_nexthit_bytes(const KellerNexthit *it);

/* Begins with a ray (direction as in keller/accel.h; t in units of its length) or a cone (clipped to its own z range too), hits
 * within the closed range `clip`; what went on before is forgotten. Nothing is searched yet. The accelerator must outlive the
 * iteration; `options`, and the keys it points to, need not. Errors: KELLER_BAD_INPUT (QUEUE over "kdtree" or "dacrt"). */
KellerStatus keller_nexthit_ray(KellerNexthit *it, const KellerAccel *accel, KellerVec3 origin, KellerVec3 direction,
                                KellerRange clip, const KellerNexthitOptions *options, KellerError *error);
KellerStatus keller_nexthit_cone(KellerNexthit *it, const KellerAccel *accel, const KellerCone *cone, KellerRange clip,
                                 const KellerNexthitOptions *options, KellerError *error);

/* The next hit; its triangle or primitive is KELLER_NONE after the last one, and then again. To be called after the function above
 * of the same kind. Errors: KELLER_FAILED (memory); then every further call fails, until a ray or cone is begun. */
KellerStatus keller_nexthit_next_ray(KellerNexthit *it, KellerRayHit *hit, KellerError *error);
KellerStatus keller_nexthit_next_cone(KellerNexthit *it, KellerConeHit *hit, KellerError *error);
#endif
