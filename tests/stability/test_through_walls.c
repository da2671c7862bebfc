/* Transmissions: the program's path sets against the oracle's, on random scenes of thin walls. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "against_oracle.h"

/* Orders (reflections, diffractions, transmissions, interactions) in turn. */
static const uint32_t orders[][4] = {{2, 1, 2, 4}, {2, 0, 3, 5}, {1, 1, 2, 3}, {2, 1, 2, 5}, {0, 1, 4, 5}, {1, 1, 3, 4}};

static void random_scenes(void **state)
{
    check_seeds(300, SCENE_THIN, sizeof orders / sizeof *orders, orders, *state);
}

static void random_scenes_say_something(void **state)
{
    const Tally *tally = *state;
    assert_true(tally->undecidable * 100 < tally->paths);
    assert_true(tally->through * 3 > tally->scenes * 20 || getenv("KELLER_SEEDS"));
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
