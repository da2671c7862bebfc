/* against_oracle.h -- the program's path sets on random scenes against the oracle's. */
#ifndef TEST_AGAINST_ORACLE_H
#define TEST_AGAINST_ORACLE_H
#include "harness.h"
#include "oracle.h"
#include "scenes.h"

typedef struct {
    size_t scenes, paths, through /* with transmissions */, candidates, undecidable, differences, scenes_different;
} Tally;

/* Searches the scenes of the seeds 1 to `last`, or a part of them (cases.h) but of all orders, and of these flags (scenes.h), each
 * for points and for a grid, with the orders (reflections, diffractions, transmissions, interactions) in turn; adds up what
 * differs, prints each difference, and fails if there is any. KELLER_SEEDS=first-last runs other seeds, for a search through the
 * night. */
void check_seeds(unsigned long last, uint32_t flags, size_t order_count, const uint32_t (*orders)[4], Tally *tally);

/* KELLER_SEEDS, where it is set; else leaves both as they are. */
void seeds_asked_for(unsigned long *first, unsigned long *last);

/* How the paths found for one receiver differ from the oracle's, each of which must be there once and no other; prints each
 * difference, `search` saying how they were found. */
size_t compare_with_oracle(const KellerScene *scene, KellerVec3 tx, KellerVec3 at, uint64_t seed, uint32_t rx,
                           uint32_t transmissions, const OracleResult *oracle, const FoundPaths *found, const char *search);
#endif
