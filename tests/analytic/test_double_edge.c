/* Two edges in a row: the uniform form against the exact table, and what the uniform theory's product and its slope terms
 * make of the same geometries. */
#include <gsl/gsl_errno.h>
#include <gsl/gsl_integration.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cerf.h>
#include <cmocka.h>
#include "../truth/table.h"
#include "double_edge_forms.h"
#include "keller/wave.h"

static double loss(double complex e) { return -20 * log10(cabs(e)); }

/* The table is paraxial, so the angles are made small: k grows as they shrink. */
static const double shrink = 1e-3;

/* ---- the uniform form --------------------------------------------------------------------------------------------- */

/* At grazing: 1/4 + asin(rho)/2 pi, rho^2 = d1 d3/((d1 + d2)(d2 + d3)), a real number at every frequency. */
static void grazing(void **state)
{
    (void)state;
    static const double d[][3] = {{1000, 1000, 1000}, {5000, 200, 5000}, {1, 1000, 1}, {3000, 1e-3, 2000}, {10, 70, 0.4}};
    for (size_t i = 0; i < sizeof d / sizeof *d; i++) {
        double rho = sqrt(d[i][0] * d[i][2] / ((d[i][0] + d[i][1]) * (d[i][1] + d[i][2])));
        double expected = 0.25 + asin(rho) / (2 * M_PI);
        assert_true(cabs(keller_double_edge(73, d[i][0], d[i][1], d[i][2], 0, 0) - expected) < 1e-12);
    }
    /* equal spacing: one third */
    assert_true(cabs(keller_double_edge(1, 20, 20, 20, 0, 0) - 1.0 / 3) < 1e-13);
}

static double complex one_edge(double k, double d1, double d2, double h)
{
    double r = 0.5 * h * sqrt(k * (1 / d1 + 1 / d2));
    return 0.5 * cerfc(r + I * r);
}

/* An edge far below the line does nothing: at a Fresnel number of nu the rest is 1/(sqrt(2) pi nu), 3e-4 here. */
static void one_edge_is_left(void **state)
{
    (void)state;
    for (int i = -12; i <= 12; i++) {
        double h = 3.0 * i;
        assert_true(cabs(keller_double_edge(70, 900, 400, 1300, h, -4000) - one_edge(70, 900, 1700, h)) < 5e-4);
        assert_true(cabs(keller_double_edge(70, 900, 400, 1300, -4000, h) - one_edge(70, 1300, 1300, h)) < 5e-4);
    }
    assert_true(cabs(keller_double_edge(70, 900, 400, 1300, -1e4, -1e4) - 1) < 5e-4);
}

/* The bivariate normal form (Plackett) as the README of the truth tables has it, by adaptive quadrature in t, r = sin t. */
typedef struct {
    double a, b;
    bool imaginary;
} Plackett;

static double plackett_integrand(double t, void *context)
{
    const Plackett *p = context;
    double phase = (p->a * p->a - 2 * p->a * p->b * sin(t) + p->b * p->b) / (2 * cos(t) * cos(t));
    return p->imaginary ? -sin(phase) : cos(phase);
}

static double complex plackett(double k, double d1, double d2, double d3, double h1, double h2)
{
    static gsl_integration_workspace *work;
    if (!work) work = gsl_integration_workspace_alloc(2000);
    double a = 1 / d1 + 1 / d2, b = 1 / d2 + 1 / d3, det = (d1 + d2 + d3) / (d1 * d2 * d3), part[2], error;
    Plackett p = {h1 * sqrt(k * det / b), h2 * sqrt(k * det / a), false};
    for (int i = 0; i < 2; i++) {
        p.imaginary = i;
        gsl_function f = {plackett_integrand, &p};
        assert_int_equal(gsl_integration_qag(&f, 0, asin(1 / (d2 * sqrt(a * b))), 1e-12, 0, 2000, GSL_INTEG_GAUSS61, work,
                                             &part[i], &error), GSL_SUCCESS);
    }
    double complex turn = M_SQRT1_2 * (1 + I);
    return 0.25 * cerfc(turn * p.a * M_SQRT1_2) * cerfc(turn * p.b * M_SQRT1_2) + (part[0] + I * part[1]) / (2 * M_PI);
}

static void all_signs_of_heights(void **state)
{
    (void)state;
    int count = 0;
    for (int i = -8; i <= 8; i++)
        for (int j = -8; j <= 8; j++)
            for (int d = 0; d < 4; d++) {
                static const double ds[][3] = {{10, 10, 10}, {10, 1, 30}, {3, 80, 4}, {500, 0.1, 20}};
                double scale = sqrt(ds[d][0] * ds[d][2] / (ds[d][0] + ds[d][2]) / 40), h1 = 0.35 * i * scale, h2 = 0.35 * j * scale;
                double complex u = keller_double_edge(40, ds[d][0], ds[d][1], ds[d][2], h1, h2);
                double complex expected = plackett(40, ds[d][0], ds[d][1], ds[d][2], h1, h2);
                if (!(cabs(u - expected) < 1e-11))
                    fail_msg("d %g %g %g, h %g %g: %g", ds[d][0], ds[d][1], ds[d][2], h1, h2, cabs(u - expected));
                /* exchanging the ends */
                double complex back = keller_double_edge(40, ds[d][2], ds[d][1], ds[d][0], h2, h1);
                assert_true(cabs(u - back) < 1e-12);
                count++;
            }
    assert_int_equal(count, 17 * 17 * 4);
}

/* ---- the table ---------------------------------------------------------------------------------------------------- */

static void table(void **state)
{
    (void)state;
    Table t;
    if (!table_open(&t, "e_double_knife.csv", true)) skip();
    double worst = 0;
    int rows = 0, apart = 0;
    for (; table_next(&t); rows++) {
        double d1 = table_number(&t, "d1"), d2 = table_number(&t, "d2"), d3 = table_number(&t, "d3");
        double h1 = table_number(&t, "h1"), h2 = table_number(&t, "h2");
        double k = 2 * M_PI * table_number(&t, "f_Hz") / table_number(&t, "c"), kp = k / (shrink * shrink);
        double exact_dB = table_number(&t, "loss_exact_dB");
        double complex exact = table_number(&t, "A_re") + I * table_number(&t, "A_im");
        double complex u = keller_double_edge(k, d1, d2, d3, h1, h2);
        assert_true(cabs(u - exact) < 1e-11);
        worst = fmax(worst, fabs(loss(u) - exact_dB));

        double a1 = table_number(&t, "alpha1_rad") * shrink, a2 = table_number(&t, "alpha2_rad") * shrink;
        double L2[2] = {1 / (1 / d2 + 1 / d3), 1 / (1 / (d1 + d2) + 1 / d3)};
        static const char *const columns[2][2] = {{"loss_UTD_KP_dB", "loss_UTD_KP_slope_dB"},
                                                  {"loss_UTD_Luebbers_dB", "loss_UTD_Luebbers_slope_dB"}};
        for (int i = 0; i < 2; i++) {
            double complex plain, with;
            two_edges(kp, d1, d2, d3, a1, a2, L2[i], &plain, &with);
            assert_true(fabs(loss(plain) - table_number(&t, columns[i][0])) < 1e-4);
            assert_true(fabs(loss(with) - table_number(&t, columns[i][1])) < 1e-4);
            if (i == 0 && fmin(table_number(&t, "nu1_local"), table_number(&t, "nu2_local")) >= 2) {
                assert_true(fabs(loss(with) - exact_dB) < 0.1);
                apart++;
            }
        }
    }
    print_message("# %d geometries, off by at most %.2g dB\n", rows, worst);
    assert_true(worst < 1e-6); /* 0.3 dB are asked for */
    assert_int_equal(rows, 108);
    assert_true(apart >= 20);
}

/* The figures by which one knows the simpler forms, dB of loss: equal spacing at grazing (exact 9.54) plain +3.75 and with
 * slope +1.35; 5000/200/5000 m (exact 6.83) +16.4 and +12.3. */
static void known_errors(void **state)
{
    (void)state;
    static const double cases[][6] = {{1000, 1000, 1000, 9.5424, 3.748, 1.348}, {5000, 200, 5000, 6.83, 16.4, 12.3}};
    for (int i = 0; i < 2; i++) {
        const double *c = cases[i];
        double complex plain, with, exact = keller_double_edge(1e9, c[0], c[1], c[2], 0, 0);
        two_edges(1e9, c[0], c[1], c[2], 0, 0, 1 / (1 / c[1] + 1 / c[2]), &plain, &with);
        assert_true(fabs(loss(exact) - c[3]) < 0.005);
        assert_true(fabs(loss(plain) - loss(exact) - c[4]) < 0.05);
        assert_true(fabs(loss(with) - loss(exact) - c[5]) < 0.05);
    }
}

/* ---- slopes ------------------------------------------------------------------------------------------------------- */

/* Against differences of the terms over +-h, extrapolated once: off by about (kL)^2 h^4 and 1e-16/h. */
static void slopes_are_derivatives(void **state)
{
    (void)state;
    const double h = 1e-4;
    int count = 0;
    for (int i = 0; i < 400; i++) {
        double n = 0.3 + 0.0042 * i, phi = (0.11 + 0.0019 * i) * n * M_PI, phi_in = (0.93 - 0.0021 * i) * n * M_PI;
        double kL = 0.3 * pow(1.02, i), sine = 0.4 + 0.0015 * i;
        double complex slope[4], at[4][4], size = 0;
        keller_utd_slopes(n, phi, phi_in, sine, 2, kL / 2, slope);
        bool near = false;
        for (int j = 0; j < 4; j++) {
            double angle = M_PI + (j % 2 ? -1 : 1) * (j < 2 ? phi - phi_in : phi + phi_in);
            near |= fabs(angle - 2 * M_PI * n * nearbyint(angle / (2 * M_PI * n))) < 4 * h;
            size += cabs(slope[j]);
        }
        if (near) continue;
        static const int by_phi[4] = {1, -1, 1, -1}, by_phi_in[4] = {-1, 1, 1, -1};
        for (int way = 0; way < 2; way++) {
            for (int s = 0; s < 4; s++) {
                double step = (s < 2 ? h : 2 * h) * (s % 2 ? -1 : 1);
                keller_utd_terms(n, phi + (way ? 0 : step), phi_in + (way ? step : 0), sine, 2, kL / 2, at[s]);
            }
            for (int j = 0; j < 4; j++) {
                double complex once = (at[0][j] - at[1][j]) / (2 * h), twice = (at[2][j] - at[3][j]) / (4 * h);
                double complex expected = (4 * once - twice) / 3 * (way ? by_phi_in : by_phi)[j];
                if (!(cabs(slope[j] - expected) < 1e-7 * cabs(size)))
                    fail_msg("n %g kL %g term %d: %g of %g", n, kL, j, cabs(slope[j] - expected), cabs(size));
            }
        }
        count++;
    }
    assert_true(count > 350);
}

/* The derivative is continuous at the pole, -2jnkL times the factor, and where the two ways to compute it meet. */
static void slopes_at_the_boundary(void **state)
{
    (void)state;
    static const double off[] = {0, 0.9e-9, 1.1e-9, 1e-7, 0.999e-4, 1.001e-4};
    double n = 1.6, phi_in = 0.7, k = 30, L = 5;
    double complex expected = -cexp(-I * M_PI / 4) / (2 * n * sqrt(2 * M_PI * k)) * (-2 * I * n * k * L);
    for (int i = 0; i < 6; i++)
        for (int side = -1; side <= 1; side += 2) {
            double complex slope[4];
            keller_utd_slopes(n, M_PI + phi_in + side * off[i], phi_in, 1, k, L, slope);
            /* the next term is of the relative size sqrt(kL) eps */
            assert_true(cabs(slope[1] - expected) < (1e-7 + 4 * sqrt(k * L) * off[i]) * cabs(expected));
        }
    double complex a[4], b[4];
    keller_utd_slopes(n, M_PI + phi_in + 0.9999999e-4, phi_in, 1, k, L, a);
    keller_utd_slopes(n, M_PI + phi_in + 1.0000001e-4, phi_in, 1, k, L, b);
    assert_true(cabs(a[1] - b[1]) < 1e-9 * cabs(a[1]));
    /* at kL a = 40 the series takes over: eps = 2 asin(sqrt(x/2kL)) */
    for (int side = 0; side < 2; side++)
        keller_utd_slopes(n, M_PI + phi_in + 2 * asin(sqrt(40 * (side ? 1 + 1e-12 : 1 - 1e-12) / (2 * k * L))), phi_in, 1, k, L,
                          side ? a : b);
    assert_true(cabs(a[1] - b[1]) < 1e-10 * cabs(a[1]));
}

int main(void)
{
    gsl_set_error_handler_off();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(grazing),
        cmocka_unit_test(one_edge_is_left),
        cmocka_unit_test(all_signs_of_heights),
        cmocka_unit_test(table),
        cmocka_unit_test(known_errors),
        cmocka_unit_test(slopes_are_derivatives),
        cmocka_unit_test(slopes_at_the_boundary),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
