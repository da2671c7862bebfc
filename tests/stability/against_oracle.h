/* against_oracle.h -- the program's path sets on random scenes against the oracle's. */
#ifndef TEST_AGAINST_ORACLE_H
#define TEST_AGAINST_ORACLE_H
#include "harness.h"
#include "oracle.h"
#include "scenes.h"

typedef struct {
    size_t paths, through /* with transmissions */, candidates, undecidable, differences, scenes_different;
} Tally;

/* Searches the scene of this seed and these flags (scenes.h) for points and for a grid, and adds what differs. Prints each
 * difference. */
void check_seed(uint64_t seed, uint32_t flags, uint32_t reflections, uint32_t diffractions, uint32_t transmissions,
                uint32_t interactions, Tally *tally);
#endif
