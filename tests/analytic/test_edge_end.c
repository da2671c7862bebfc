/* What the fade at the end of an edge costs, against the exact wave of an edge that ends. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "edge_end.h"

/* Right at the end one half would be right and there is none; farther than the zone the error falls as 1/place. */
static void fade(void **state)
{
    (void)state;
    static const double phis[] = {220, 270, 300, 340};
    static const double places[] = {-10, -3, -1.5, -0.75, -0.3, -1e-6, 1e-6, 0.3, 0.75, 1.5, 3, 10, 30};
    double worst[3] = {0, 0, 0}, cut = 0; /* at all, from 1.5 on, from 10 on; of no fade */
    for (int p = 0; p < 4; p++) {
        const EdgeEnd whole = edge_end_whole(phis[p] * M_PI / 180);
        for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
            EdgeEnd e = edge_end_at(places[i], phis[p] * M_PI / 180, &whole);
            double error = cabs(e.program - e.exact), size = fabs(places[i]);
            if (p == 1) print_message("# %6.2f: %.3f, exact %.3f%+.3fj, error %.3f\n", places[i], cabs(e.program), creal(e.exact),
                                      cimag(e.exact), error);
            worst[0] = fmax(worst[0], error);
            if (size >= 1.5) worst[1] = fmax(worst[1], error);
            if (size >= 10) worst[2] = fmax(worst[2], error);
            cut = fmax(cut, cabs((places[i] > 0) - e.exact));
            if (size < 0.01) assert_true(fabs(cabs(e.exact) - 0.5) < 0.02);
        }
    }
    print_message("# error over the edge's own wave: %.3f at most, %.3f from 1.5 on, %.3f from 10 on; without the fade %.3f\n", worst[0],
                  worst[1], worst[2], cut);
    assert_true(worst[0] < 0.55 && worst[1] < 0.3 && worst[2] < 0.05);
}

/* Nothing jumps as the point passes the end. */
static void no_jump(void **state)
{
    (void)state;
    const EdgeEnd whole = edge_end_whole(5);
    assert_true(cabs(edge_end_at(-1e-6, 5, &whole).program) == 0);
    assert_true(cabs(edge_end_at(1e-6, 5, &whole).program) < 2e-6);
    assert_true(fabs(cabs(edge_end_at(1.5, 5, &whole).program) - 1) < 1e-6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(fade), cmocka_unit_test(no_jump)};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
