/* The candidate search from one end: cones cover all directions around the end, collect the faces and wedges they meet,
 * are mirrored in the faces and fan out from the wedges. What comes out contains every sequence of steps that a valid
 * path from this end can begin with. */
#ifndef KELLER_PATH_TREE_H
#define KELLER_PATH_TREE_H
#include "path/advance.h"
#include "path/cells.h"
#include "path/sieve.h"
#include "path/trie.h"

/* What a search is for: of[pattern], PLAN_ flags. */
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
    /* That all targets are seen from directly: rays from a beam's source over a target go straight on to it; NULL: not one point. */
    const KellerVec3 *target_end;
    uint32_t target_length;
    double tan_aperture;        /* cones that meet much are split down to this half-angle */
    uint32_t split_over;        /* what is much; 0: chosen here */
    /* Cells that wanted sequences are to reach; NULL: what is asked for is the sequences. */
    const CellGrid *cells;
    size_t cells_most;          /* candidates that may be found for them, about */
    const FaceBox *boxes;       /* of the scene's faces, for the cells */
    const Advance *advance;     /* NULL: nobody asks how far the search is */
} TreeLimits;

typedef struct {
    uint64_t cones, solved;     /* solved: sequences, for cells in the footprints of beams */
    KellerAccelWork accel;
} TreeWork;

/* A cell, as its place in its part of the grid, and a sequence of the trie that may lead there. */
typedef struct {
    uint32_t cell, node;
} CellCandidate;

typedef struct {
    CellCandidate *item;        /* in any order; some more than once */
    size_t count, room;
    bool full;                  /* they were more than cells_most, and none is returned */
} CellCandidates;

/* Fills the trie, and where there are limits->cells also the candidates (else NULL), to be freed with free(candidates->item). Uses up to
 * `threads` threads. Which needless sequences are found besides the needed ones may depend on their number. KELLER_FAILED: memory. */
KellerStatus tree_search(const TreeLimits *limits, KellerVec3 end, uint32_t threads, Trie *trie, CellCandidates *candidates,
                         TreeWork *work, KellerError *error);
#endif
