/* Several diffractions: the program's path sets against the oracle's, on random scenes. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "against_oracle.h"

/* Orders (reflections, diffractions, transmissions, interactions) in turn. */
static const uint32_t edges_alone[][4] = {{0, 2, 0, 2}, {0, 3, 0, 3}, {0, 2, 0, 2}};
static const uint32_t mixed[][4] = {{1, 2, 0, 3}, {2, 2, 0, 3}, {1, 3, 0, 3}, {2, 2, 0, 4}};
static const uint32_t through[][4] = {{0, 2, 2, 4}, {1, 2, 2, 4}, {2, 2, 1, 4}, {1, 2, 1, 4}};

#define COUNT(orders) sizeof(orders) / sizeof *(orders), orders

static void two_and_three_edges(void **state) { check_seeds(4, 0, COUNT(edges_alone), *state); }
static void with_reflections(void **state) { check_seeds(3, SCENE_SMALL, COUNT(mixed), *state); }
static void with_transmissions(void **state) { check_seeds(3, SCENE_SMALL | SCENE_THIN, COUNT(through), *state); }

/* The comparison would be empty if most were undecidable, or if there were no paths to speak of. (Legs in one plane with other
 * things' edges, as from roof to roof of one height, are more often too close to call than anything else.) */
static void say_something(void **state)
{
    const Tally *tally = *state;
    assert_true(tally->undecidable * 4 < tally->paths);
    assert_true(tally->paths > 60 * tally->scenes || getenv("KELLER_SEEDS"));
}

int main(void)
{
    Tally tally = {0};
    const struct CMUnitTest tests[] = {
        {"two_and_three_edges", two_and_three_edges, NULL, NULL, &tally},
        {"with_reflections", with_reflections, NULL, NULL, &tally},
        {"with_transmissions", with_transmissions, NULL, NULL, &tally},
        {"say_something", say_something, NULL, NULL, &tally},
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
