/* The field along lines that cross each kind of boundary. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "continuity.h"

static void no_jumps(void **state)
{
    (void)state;
    Jump jumps[CONTINUITY_KINDS];
    continuity_measure(jumps);
    for (int i = 0; i < CONTINUITY_KINDS; i++) print_message("# %-48s %.2g\n", jumps[i].kind, jumps[i].jump);
    for (int i = 0; i < CONTINUITY_KINDS; i++)
        if (!(jumps[i].jump < jumps[i].bound)) fail_msg("%s: %g", jumps[i].kind, jumps[i].jump); /* a NaN too: nothing crossed */
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(no_jumps)};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
