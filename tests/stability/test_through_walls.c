/* Transmissions: the program's path sets against the oracle's, on random scenes of thin walls. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "against_oracle.h"

/* Orders (reflections, diffractions, transmissions, interactions) in turn. */
static const uint32_t orders[][4] = {{2, 1, 2, 4}, {2, 0, 3, 5}, {1, 1, 2, 3}, {2, 1, 2, 5}, {0, 1, 4, 5}, {1, 1, 3, 4}};

static void random_scenes(void **state)
{
    Tally *tally = *state;
    unsigned long first = 1, last = 300;
    const char *seeds = getenv("KELLER_SEEDS");
    if (seeds) sscanf(seeds, "%lu-%lu", &first, &last);
    for (unsigned long seed = first; seed <= last; seed++) {
        const uint32_t *o = orders[seed % (sizeof orders / sizeof *orders)];
        check_seed(seed, SCENE_THIN, o[0], o[1], o[2], o[3], tally);
    }
    printf("# %zu paths, %zu of them through walls, of %zu candidates, %zu undecidable, %zu scenes differ\n", tally->paths,
           tally->through, tally->candidates, tally->undecidable, tally->scenes_different);
    assert_int_equal(tally->differences, 0);
}

static void random_scenes_say_something(void **state)
{
    const Tally *tally = *state;
    assert_true(tally->undecidable * 100 < tally->paths);
    assert_true(tally->through > 2000 || getenv("KELLER_SEEDS"));
}

int main(void)
{
    Tally tally = {0};
    const struct CMUnitTest tests[] = {
        {"random_scenes", random_scenes, NULL, NULL, &tally},
        {"random_scenes_say_something", random_scenes_say_something, NULL, NULL, &tally},
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
