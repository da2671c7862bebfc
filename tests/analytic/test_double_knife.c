/* Two screens, one behind the other, as scenes: the sum of all paths over their upper edges against the exact loss of two
 * absorbing screens (truth: e_double_knife.csv, the Fresnel-Kirchhoff integral). Absorbing screens have of each coefficient the
 * terms of the incident boundaries alone. The screens here conduct; with a = D_1 + D_2, b = D_3 + D_4 of the one and c, d of the
 * other edge, the mean of the soft and the hard wave's product is
 *     ((a - b)(c - d) + (a + b)(c + d))/2 = ac + bd,
 * and bd/ac is about alpha_1 alpha_2/4, as a is about 4/alpha and b about 2 in the same unit (where alpha is next to 0, a is about
 * sqrt(2 pi kL), and bd/ac below 1/kL). So the loss agrees to about 8.7 dB
 * times the squares of the bending angles. */
#include <complex.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "keller/wave.h"
#include "knife_scene.h"

static void table(void **state)
{
    (void)state;
    Table t;
    assert_true(table_open(&t, "e_double_knife.csv", false));
    static const char *const forms[] = {"UTD_KP", "UTD_KP_slope", "UTD_Luebbers", "UTD_Luebbers_slope", "EpsteinPeterson",
                                        "Deygout", "Bullington"};
    double worst = 0, worst_form[7] = {0};
    int rows = 0, on_boundaries = 0, paths[4] = {0};
    for (; table_next(&t); rows++) {
        Knife g = knife_of_row(&t);
        double exact = table_number(&t, "loss_exact_dB"), found = -20 * log10(cabs(knife_total(&g, paths))), squares = 0;
        for (int i = 0; i < 2; i++) squares += g.bend[i] * g.bend[i];
        worst = fmax(worst, fabs(found - exact));
        on_boundaries += g.bend[0] == 0 && g.bend[1] == 0;
        if (!(fabs(found - exact) < 8.7 * squares + 1e-3))
            fail_msg("row %d, %g %g %g m, %g %g rad: %.6f dB, exact %.6f", rows, g.d[0], g.d[1], g.d[2], g.bend[0], g.bend[1],
                     found, exact);
        for (int i = 0; i < 7; i++) {
            char name[40];
            snprintf(name, sizeof name, "loss_%s_dB", forms[i]);
            worst_form[i] = fmax(worst_form[i], fabs(table_number(&t, name) - exact));
        }
    }
    print_message("# %d geometries, off by at most %.4f dB;", rows, worst);
    for (int i = 0; i < 7; i++) print_message(" %s %.2f", forms[i], worst_form[i]);
    print_message(" dB\n");
    assert_int_equal(rows, 108);
    assert_int_equal(paths[3], 108);
    assert_true(on_boundaries > 5);
    assert_true(worst < 0.3);
}

/* The exact field of the geometry. A way along the edges as well is sin beta times as much longer as in the plane across. */
static double complex exact_field(const Knife *g)
{
    double across = g->d[0] + g->d[1] + g->d[2], sine = across / hypot(across, g->along);
    double k = 2 * M_PI * g->frequency / KELLER_LIGHT_SPEED * sine;
    return keller_double_edge(k, g->d[0], g->d[1], g->d[2], g->h[0], g->h[1]);
}

/* Edges above and below the lines between their neighbours, in every combination: all paths together are the exact field, with
 * its phase, wherever boundaries are near. (The phases of paths are paraxial to k d bend^4.) */
static void every_side(void **state)
{
    (void)state;
    static const double d[][4] = {{50, 50, 50, 0}, {80, 4, 120, 0}, {30, 300, 40, 0}, {60, 20, 30, 90}, {30, 200, 50, -400}};
    int paths[4] = {0};
    for (size_t i = 0; i < sizeof d / sizeof *d; i++) {
        double worst = 0;
        for (int u = -6; u <= 6; u++)
            for (int v = -6; v <= 6; v++) {
                Knife g = {.d = {d[i][0], d[i][1], d[i][2]}, .bend = {7e-4 * u + 1e-8, 6e-4 * v + 1e-8}, .along = d[i][3],
                           .frequency = 60e9};
                knife_raise(&g);
                worst = fmax(worst, cabs(knife_total(&g, paths) - exact_field(&g)));
            }
        print_message("# %g %g %g m, %g m along: off by at most %.2g of the free field\n", d[i][0], d[i][1], d[i][2], d[i][3], worst);
        assert_true(worst < 1e-4);
    }
    assert_true(paths[0] > 150 && paths[1] > 300 && paths[2] > 300 && paths[3] > 800);
}

/* At grazing over N screens of equal spacing 1/(N + 1) is left. */
static void many_at_grazing(void **state)
{
    (void)state;
    uint64_t crowded;
    for (int n = 1; n <= 4; n++) {
        double loss = -20 * log10(cabs(knife_row(n, 100, 10e9, 0, &crowded))), exact = 20 * log10(n + 1);
        print_message("# %d screens at grazing: %.4f dB, exact %.4f\n", n, loss, exact);
        assert_true(fabs(loss - exact) < 1e-3);
        assert_int_equal(crowded, 0);
    }
    knife_row(3, 100, 10e9, 0.3, &crowded); /* as if they were parallel, which the report says */
    assert_true(crowded > 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(table), cmocka_unit_test(every_side),
                                       cmocka_unit_test(many_at_grazing)};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
