/* The candidate search from one end: cones cover all directions around the end, collect the faces and wedges they meet,
 * are mirrored in the faces and fan out from the wedges. What comes out contains every sequence of steps that a valid
 * path from this end can begin with. */
#ifndef KELLER_PATH_TREE_H
#define KELLER_PATH_TREE_H
#include "path/beam.h"
#include "path/trie.h"

/* What a search is for: of[pattern], PLAN_ flags. Only a point may fan out from wedges, so for a patch no pattern with steps
 * behind a wedge is wanted. */
typedef struct {
    uint32_t bends;             /* patterns of at most so many steps, <= KELLER_MAX_BENDS */
    uint8_t *of;                /* [4 << bends]: what follows the longest can be asked for too, and is of no use */
} TreePlan;

typedef struct {
    const KellerScene *scene;
    const KellerAccel *accel;
    const TreePlan *plan;
    uint32_t transmissions;     /* slabs that a path may pass through, */
    uint32_t interactions;      /* and steps and slabs of a path together */
    /* Sequences of target_length steps that end in a wedge are only wanted for the wedges of this accelerator; NULL: for all.
     * Their last cones then look for nothing else, not even for what blocks them: a candidate costs less. */
    const KellerAccel *targets;
    uint32_t target_length;
    double tan_aperture;        /* cones that meet much are split down to this half-angle */
    uint32_t split_over;        /* what is much; 0: chosen here */
} TreeLimits;

typedef struct {
    uint64_t cones;
    KellerAccelWork accel;
} TreeWork;

/* Fills the trie. The end is the convex hull of `count` points (1 .. SOURCES). Uses up to `threads` threads. Which
 * needless sequences are found besides the needed ones may depend on their number. KELLER_FAILED: memory. */
KellerStatus tree_search(const TreeLimits *limits, uint32_t count, const KellerVec3 *end, uint32_t threads, Trie *trie,
                         TreeWork *work, KellerError *error);
#endif
