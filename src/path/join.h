/* Candidates from both ends: a sequence s1 ... sk is in the transmitter's tree as s1 ... sm and in the receiver's as
 * sk ... sm for any m; the trees are joined at the common step sm, or, where s1 ... sm and sk ... sm+1 both end in a wedge, on
 * the leg between the two. Where sm is a face, and both have a wedge before it, only those are tried whose edges see one another in it. */
#ifndef KELLER_PATH_JOIN_H
#define KELLER_PATH_JOIN_H
#include "path/arrival.h"
#include "path/plan.h"
#include "path/sieve.h"

typedef struct {
    TreeLimits limits;
    Trie trie;
    TrieList list;              /* as wanted */
    Arrival *arrival;           /* [list.count] at the last wedge of those that have one */
} Ends;

typedef struct {
    const KellerScene *scene;
    const KellerAccel *accel;
    const FaceBox *boxes;       /* of the scene's faces */
    uint32_t reflections, diffractions, transmissions, interactions;   /* interactions: of all kinds together */
    uint32_t bends;             /* reflections and diffractions together */
    bool alone;                 /* all sequences are the transmitter's */
    uint32_t threads;           /* for one join */
} JoinLimits;

typedef struct {
    uint64_t candidates;
    KellerAccelWork accel;
} JoinWork;

/* Finds all paths from tx to rx and appends them to the list, in arbitrary order. KELLER_FAILED: memory. */
KellerStatus join_ends(const JoinLimits *limits, const Ends *forward, const Ends *backward, KellerVec3 tx, KellerVec3 rx, PathList *list,
                       JoinWork *work, KellerError *error);
/* The same for one pattern, for which the plans have made both ends meet. False: memory. */
bool join_pattern(const JoinLimits *limits, const Ends *forward, const Ends *backward, Pattern pattern, KellerVec3 tx, KellerVec3 rx,
                  PathList *list, JoinWork *work);
/* The same where the candidates are known: the line of sight and the sequences known[begin .. end) of the trie. */
KellerStatus join_known(const JoinLimits *limits, const Trie *trie, const CellCandidate *known, size_t begin, size_t end, KellerVec3 tx,
                        KellerVec3 rx, PathList *list, JoinWork *work, KellerError *error);

/* What one end brings. shadows: each first edge is asked which part of it is lit, which costs some microseconds and pays where
 * pairs of edges are tried. Free with ends_free. KELLER_FAILED: memory. */
KellerStatus ends_search(Ends *ends, const TreeLimits *limits, KellerVec3 end, uint32_t threads, bool shadows, TreeWork *work,
                         KellerError *error);
void ends_free(Ends *ends);
#endif
