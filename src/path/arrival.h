/* Can the wave that arrives at one edge go on to another? Conservative, and cheap enough for millions of pairs. */
#ifndef KELLER_PATH_ARRIVAL_H
#define KELLER_PATH_ARRIVAL_H
#include "path/join.h"

/* How the wave from the end comes to the last wedge of a sequence of the trie. */
Arrival arrival_of(const KellerScene *scene, const Trie *trie, uint32_t node, KellerVec3 end);

/* Two edges, each in the frame of the other. */
typedef struct {
    double turn;                /* cosine of the angle between them */
    struct {                    /* the other edge's point at t: z = z0 + turn t, rho^2 = a + t (b + c t) */
        double z0, a, b, c;
    } seen[2];                  /* by the first and by the second */
} EdgePair;

/* False where no diffracted wave goes from the one to the other: they are one edge or lie in one line, or one is outside the
 * other's sector. */
bool edge_pair(const KellerScene *scene, uint32_t first, uint32_t second, EdgePair *pair);

/* Keller's law at both: can a ray that arrives at the first edge as `one` says go on to where the second is lit, and back? */
bool edges_agree(const EdgePair *pair, const Arrival *one, const Arrival *other);
#endif
