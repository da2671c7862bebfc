/* Candidates from both ends: a sequence s1 ... sk is in the transmitter's tree as s1 ... sm and in the receiver's as
 * sk ... sm for any m; the trees are joined at the common step sm. */
#ifndef KELLER_PATH_JOIN_H
#define KELLER_PATH_JOIN_H
#include "path/tree.h"

typedef struct {
    TreeLimits limits;
    Trie trie;
    TrieList lists[KELLER_MAX_BENDS + 1][KELLER_MAX_BENDS + 1]; /* [length][place of the wedge], as wanted */
} Ends;

typedef struct {
    const KellerScene *scene;
    const KellerAccel *accel;
    uint32_t reflections, diffractions, transmissions, interactions;   /* interactions: of all kinds together */
    uint32_t bends;             /* reflections and diffractions together */
    uint32_t threads;           /* for one join */
} JoinLimits;

typedef struct {
    uint64_t candidates;
    KellerAccelWork accel;
} JoinWork;

/* Finds all paths from tx to each of `count` receivers: appends to lists[i]. The order within a list is arbitrary.
 * KELLER_FAILED: memory. */
KellerStatus join_ends(const JoinLimits *limits, const Ends *forward, const Ends *backward, KellerVec3 tx, uint32_t count,
                       const KellerVec3 *rx, PathList *lists, JoinWork *work, KellerError *error);

/* Who searches what, so that for every kind of path the two ends meet. For points they meet at the wedge, so that neither
 * has to fan out from one, or in the middle of reflections. For grids the receivers' side goes at most half the way and the
 * transmitter's, whose tree serves all patches, does the rest and fans out from wedges. */
void plan_ends(uint32_t reflections, uint32_t diffractions, uint32_t bends, bool grids, TreeLimits *forward,
               TreeLimits *backward);

KellerStatus ends_search(Ends *ends, const TreeLimits *limits, uint32_t count, const KellerVec3 *end, uint32_t threads,
                         TreeWork *work, KellerError *error);
void ends_free(Ends *ends);
#endif
