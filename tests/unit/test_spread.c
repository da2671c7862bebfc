/* The circular spread of angles: values that follow from its definition, sqrt(-2 ln |sum of p e^{j angle} / sum of p|). */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <complex.h>
#include <math.h>
#include "keller/path.h"
#include "random.h"

static void nearly(double found, double expected, double tolerance)
{
    if (!(fabs(found - expected) <= tolerance)) fail_msg("%.17g, not %.17g", found, expected);
}

static void one_angle_has_no_spread(void **state)
{
    (void)state;
    for (double a = -3; a <= 3.1; a += 0.1) {
        const double angle[3] = {a, a, a}, power[3] = {1e-12, 3e-9, 0};
        nearly(keller_angle_spread(1, angle, power), 0, 1e-15);
        nearly(keller_angle_spread(3, angle, power), 0, 1e-15);
    }
}

/* Two of equal power, 2 a apart: |sum| = cos a. Half way round it is 0; across pi it is the same as elsewhere. */
static void two_angles(void **state)
{
    (void)state;
    const double power[2] = {2e-9, 2e-9};
    for (double middle = -3.1; middle <= 3.1; middle += 0.31)
        for (double a = 0.01; a < 1.57; a += 0.05) {
            const double angle[2] = {remainder(middle + a, 2 * M_PI), remainder(middle - a, 2 * M_PI)};
            nearly(keller_angle_spread(2, angle, power), sqrt(-2 * log(cos(a))), 1e-12);
        }
}

/* A narrow spread is the rms deviation: -2 ln cos a = a^2 + a^4/6 + ... */
static void narrow_spreads_are_not_lost(void **state)
{
    (void)state;
    const double power[2] = {1, 1};
    for (double a = 1e-12; a < 1e-3; a *= 10) {
        const double angle[2] = {0.5 + a, 0.5 - a};
        nearly(keller_angle_spread(2, angle, power), a, 1e-3 * a + a * a);
    }
}

static void what_cancels_is_infinite_and_nothing_is_none(void **state)
{
    (void)state;
    const double opposite[2] = {0, M_PI}, cross[4] = {0, M_PI / 2, M_PI, -M_PI / 2}, power[4] = {1, 1, 1, 1}, dark[4] = {0};
    assert_true(keller_angle_spread(2, opposite, power) > 8); /* |sum| is rounding, 1e-16: sqrt(-2 ln) is 8.6 */
    assert_true(keller_angle_spread(4, cross, power) > 8);
    assert_true(isnan(keller_angle_spread(4, cross, dark)));
    assert_true(isnan(keller_angle_spread(0, NULL, NULL)));
}

/* As the definition has it, where that is well conditioned. */
static void it_is_the_definition(void **state)
{
    (void)state;
    enum { MOST = 40 };
    Random random = {5};
    for (int round = 0; round < 2000; ++round) {
        double angle[MOST], power[MOST], total = 0;
        double complex sum = 0;
        size_t n = 2 + (size_t)random_in(&random, 0, MOST - 2);
        for (size_t i = 0; i < n; ++i) {
            angle[i] = random_in(&random, -M_PI, M_PI);
            power[i] = pow(10, random_in(&random, -8, 0));
            total += power[i];
            sum += power[i] * cexp(I * angle[i]);
        }
        double length = cabs(sum) / total;
        if (length < 1e-3 || length > 1 - 1e-3) continue;
        nearly(keller_angle_spread(n, angle, power), sqrt(-2 * log(length)), 1e-9);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_angle_has_no_spread), cmocka_unit_test(two_angles), cmocka_unit_test(narrow_spreads_are_not_lost),
        cmocka_unit_test(what_cancels_is_infinite_and_nothing_is_none), cmocka_unit_test(it_is_the_definition)};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
