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
#endif
