/* Two parallel screens, one behind the other: the double diffraction of the program against the plain cascade of UTD (truth:
 * e_double_knife.csv, column loss_UTD_KP_dB). The table's screens absorb: of each coefficient it has the term of the incident
 * shadow boundary alone, D = (D_s + D_h)/2 but for what is not paraxial. With a = D_1 + D_2, b = D_3 + D_4 of the one and c, d of
 * the other edge, the mean of the soft and the hard wave's product is
 *     ((a - b)(c - d) + (a + b)(c + d))/2 = ac + bd,
 * and bd/ac is about alpha_1 alpha_2/4, as a is about 4/alpha and b about 2 in the same unit; cot(alpha/4) for 4/alpha, and the sine
 * in the transition function's argument, are off by less than alpha^2/12 each. So the loss agrees to about 8.7 dB times the squares
 * of the bending angles. The table's distances are taken as those along the ray. */
#include <complex.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "../stability/harness.h"
#include "../stability/scenes.h"
#include "../truth/table.h"

#define LIGHT 299792458.0
#define WIDE 20000.0 /* m */

static void screen(KellerSoup *soup, KellerVec3 top)
{
    soup_object(soup, "screen");
    soup_quad(soup, v3_add(top, v3(0, -WIDE, 0)), v3_add(top, v3(0, WIDE, 0)), v3_add(top, v3(0, WIDE, -WIDE)),
              v3_add(top, v3(0, -WIDE, -WIDE)), CONDUCTOR);
}

static KellerVec3 ahead(KellerVec3 p, double down, double d) { return v3_add(p, v3(d * cos(down), 0, -d * sin(down))); }

/* The loss in dB over free space of the path over both upper edges. */
static double loss(double f, const double d[3], const double bend[2])
{
    KellerVec3 first = v3(0, 0, 0), tx = v3(-d[0], 0, 0), second = ahead(first, bend[0], d[1]);
    KellerVec3 rx = ahead(second, bend[0] + bend[1], d[2]);
    KellerSoup soup = soup_new();
    screen(&soup, first);
    screen(&soup, second);
    KellerScene scene = scene_of(&soup);
    Run run = run_new(&tx, 1, &rx, 0, 2, 2);
    run.frequency[0] = f;
    FoundPaths found = run_simulation(&scene, &run);
    double result = NAN;
    for (size_t i = 0; i < found.count; i++) {
        const Found *p = &found.path[i];
        if (p->count != 2 || v3_distance(p->position[0], first) > 1e-6 || v3_distance(p->position[1], second) > 1e-6) continue;
        assert_true(isnan(result));
        double complex mean = 0.5 * (p->transfer[0][0] - p->transfer[0][3]);
        result = -20 * log10(cabs(mean) / (LIGHT / f / (4 * M_PI * (d[0] + d[1] + d[2]))));
    }
    found_free(&found);
    keller_scene_free(&scene);
    soup_release(&soup);
    return result;
}

static void table(void **state)
{
    (void)state;
    Table t;
    assert_true(table_open(&t, "e_double_knife.csv", false));
    size_t rows = 0;
    while (table_next(&t)) {
        double d[3] = {table_number(&t, "d1"), table_number(&t, "d2"), table_number(&t, "d3")};
        double bend[2] = {table_number(&t, "alpha1_rad"), table_number(&t, "alpha2_rad")};
        if (table_number(&t, "c") != LIGHT) continue; /* sound */
        if (!(bend[0] > 0 && bend[1] > 0)) continue; /* on a shadow boundary, the path is half there */
        double squares = bend[0] * bend[0] + bend[1] * bend[1];
        double expected = table_number(&t, "loss_UTD_KP_dB"), found = loss(table_number(&t, "f_Hz"), d, bend);
        if (!(fabs(found - expected) <= 8.7 * squares + 1e-4))
            printf("# %g Hz, %g %g %g m, %g %g rad: %.6f dB, expected %.6f\n", table_number(&t, "f_Hz"), d[0], d[1], d[2], bend[0],
                   bend[1], found, expected);
        assert_true(fabs(found - expected) <= 8.7 * squares + 1e-4);
        rows++;
    }
    assert_true(rows > 40);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(table)};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
