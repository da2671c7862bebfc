/* The iterator over hits in their total order: what its methods (nexthit_queue.c, nexthit_batch.c) and its two kinds of query
 * (nexthit_ray.c, nexthit_cone.c) share. */
#ifndef KELLER_ACCEL_NEXTHIT_H
#define KELLER_ACCEL_NEXTHIT_H
#include "accel/ray8.h"
#include "keller/nexthit.h"
#include "keller/ray.h"

/* A hit or, in the queue, a node or block not yet opened. `tie` decides between equal distances: nodes before hits, since they
 * may hold an equal hit that comes first; then hits by the order's rank and the triangle's number. */
typedef struct {
    double distance;
    uint64_t tie;                   /* of a node its TreeChild; of a hit FOUND_HIT, FOUND_LAST (rank), triangle, slot */
} Found;
#define FOUND_HIT (1ull << 63)
#define FOUND_LAST (1ull << 62)
#define FOUND_SLOT ((1ull << 30) - 1) /* where a cone's hit keeps the far end of its range */

static inline bool found_before(Found a, Found b)
{
    return a.distance < b.distance || (a.distance == b.distance && a.tie < b.tie);
}
static inline uint32_t found_triangle(Found f) { return (uint32_t)(f.tie >> 30); }

typedef struct {
    Found *at;
    size_t count, capacity;
} FoundArray;

/* The least entries in order, the very least on top: pushing near the top, the rule where trees are opened from front to back, moves few.
 * The rest, none less than any of those, is a heap, so that no scene makes a push cost more than the logarithm. */
enum { FRONT = 64 };
typedef struct {
    Found front[FRONT];
    uint32_t count;
    FoundArray heap;
} FoundQueue;

typedef struct {
    Ray8 ray;
    KellerRay exact;                /* made when the first triangle asks for it */
    bool made;
} NexthitRay;

struct KellerNexthit {
    const KellerAccel *accel;
    const TreeKind *tree;
    KellerAccelWork *work, unused;
    KellerNexthitMethod method;
    KellerNexthitOrder order;
    bool cones, thin, ended, failed; /* thin: rays, and cones that only their slabs are asked of */
    Found last, end;                /* hits strictly between them are to come */
    KellerRange clip;               /* of the query, and of the cone */
    KellerVec3 direction;           /* the cone's directrix */
    KellerConeLanes lanes;          /* of rays, z being t, only what thin frusta need */
    float near;                     /* the lanes' near at the start */
    NexthitRay ray;
    KellerCone cone;
    FoundQueue queue;
    FoundArray batch;               /* hits found, in order, of which `taken` have been handed out */
    size_t batch_size, taken;
    double *far;                    /* by slot */
    size_t far_count, far_capacity;
};

/* An iterator in the caller's own memory, for a query or a few: ready to begin, and what it has come to hold given back. */
void nexthit_open(KellerNexthit *it);
void nexthit_close(KellerNexthit *it);

/* ---- queries: nexthit_ray.c, nexthit_cone.c; nexthit.c ---------------------------------------------------------------------- */

void nexthit_prepare_cone(KellerNexthit *it, const KellerCone *cone);
/* Leaves out of the lanes what ends before the last hit. */
void nexthit_narrow(KellerNexthit *it);
/* The hits in a block at a distance of at most `far`, slots 0; returns how many. For cones also the far ends of their ranges. */
uint32_t nexthit_ray_block(KellerNexthit *it, uint32_t block, double far, Found hit[8]);
uint32_t nexthit_cone_block(KellerNexthit *it, uint32_t block, double far, Found hit[8], double last[8]);

/* Its place in the order, slot 0. */
static inline Found found_of(const KellerNexthit *it, double distance, uint32_t triangle)
{
    uint64_t rank = 0;
    if (it->order == KELLER_NEXTHIT_LEAVE_FIRST) {
        KellerVec3 v[3];
        triangle_of(it->accel, triangle, v);
        if (!keller_nexthit_leaves(it->direction, v[0], v[1], v[2])) rank = FOUND_LAST;
    }
    return (Found){distance, FOUND_HIT | rank | (uint64_t)triangle << 30};
}

/* ---- methods ----------------------------------------------------------------------------------------------------- */

/* The next hit: 1, or 0 after the last, or -1 for want of memory. */
int nexthit_queue_next(KellerNexthit *it, Found *hit);
int nexthit_batch_next(KellerNexthit *it, Found *hit);
/* Starts the queue with the root. */
void nexthit_queue_start(KellerNexthit *it);

/* Keeps the far end of a cone's hit: sets its slot. False: no memory. */
bool nexthit_keep_far(KellerNexthit *it, Found *hit, double far);

/* ---- arrays and heaps: nexthit_heap.c ---------------------------------------------------------------------------- */

/* Room for one more; false: no memory. */
bool found_grow(FoundArray *a);
/* A binary heap with the least, or the greatest, at[0]. */
void found_sift_up(Found *at, size_t i, Found f, bool greatest);
void found_sift_down(Found *at, size_t count, size_t i, Found f, bool greatest);
/* From at[0] the least to the greatest; in the time of a few passes where that is nearly so already, never above n log n. */
void found_sort(Found *at, size_t count);
#endif
