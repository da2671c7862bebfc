/* Where the two ends of a path meet: for every kind of path both are asked for what they have to bring, step by step. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "path/plan.h"

enum { BENDS = 9 };

/* Is the pattern asked for, and every step that leads to it? */
static void assert_reached(const TreePlan *plan, Pattern pattern)
{
    const uint32_t length = pattern_length(pattern);
    assert_true(plan->of[pattern] & PLAN_WANT);
    for (uint32_t i = 0; i < length; i++) {
        const bool wedge = pattern >> (length - 1 - i) & 1;
        const uint8_t use = plan->of[pattern_first(pattern, i)];
        assert_true(use & (wedge ? PLAN_WEDGE : PLAN_FACE));
        assert_true(i + 1 == length || use & PLAN_BEYOND);
    }
}

static void every_kind_of_path_is_met(void **state)
{
    (void)state;
    size_t on_leg = 0, at_face = 0, at_wedge = 0;
    for (uint32_t bends = 1; bends <= BENDS; bends++)
        for (uint32_t diffractions = 0; diffractions <= bends; diffractions++)
            for (uint32_t reflections = bends - diffractions; reflections <= bends; reflections++) {
                TreePlan forward, backward;
                assert_true(plan_init(&forward, bends) && plan_init(&backward, bends));
                plan_ends(reflections, diffractions, &forward, &backward);
                for (Pattern p = 2; p < 2u << bends; p++) {
                    if (!plan_asks(reflections, diffractions, p)) continue;
                    const uint32_t k = pattern_length(p);
                    const Meeting m = plan_meeting(p, bends, false);
                    const Pattern there = pattern_first(p, m.forward), back = pattern_last(p, m.backward);
                    assert_true(m.forward >= 1 && m.backward >= 1);
                    assert_reached(&forward, there);
                    assert_reached(&backward, back);
                    if (meets_on_leg(m, p)) {
                        assert_true(there & 1 && back & 1);
                        on_leg++;
                        continue;
                    }
                    assert_int_equal(m.forward + m.backward, k + 1);
                    assert_int_equal(there & 1, back & 1);
                    /* no end fans out from more edges than it must */
                    const int unlike = (int)pattern_wedges(there) - (int)pattern_wedges(back);
                    assert_true(unlike >= -1 && unlike <= 1);
                    if (pattern_wedges(p) > 0 && !(there & 1)) assert_true(pattern_wedges(there) == pattern_wedges(back));
                    *(there & 1 ? &at_wedge : &at_face) += 1;
                }
                plan_free(&forward);
                plan_free(&backward);
            }
    printf("# %zu kinds meet on a leg, %zu at a face, %zu at a wedge\n", on_leg, at_face, at_wedge);
    assert_true(on_leg > 1000 && at_face > 100 && at_wedge > 100);
}

/* One end has all: it is asked for every kind, and there is nothing to meet. */
static void one_end_alone(void **state)
{
    (void)state;
    TreePlan plan;
    assert_true(plan_init(&plan, 4));
    plan_alone(3, 1, &plan);
    for (Pattern p = 2; p < 2u << 4; p++) {
        const Meeting m = plan_meeting(p, 4, true);
        assert_true(m.forward == pattern_length(p) && m.backward == 0);
        if (plan_asks(3, 1, p)) assert_reached(&plan, p);
        else assert_false(plan.of[p] & PLAN_WANT);
    }
    plan_free(&plan);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_kind_of_path_is_met), cmocka_unit_test(one_end_alone)};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
