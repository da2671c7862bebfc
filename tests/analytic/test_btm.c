/* Diffraction at rigid edges: Svensson's line integral against tables computed with other formulas in 20 digits, in the frequency and
 * in the time domain; the uniform theory beside it; the insertion loss of a screen. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "../truth/table.h"
#include "keller/sound.h"

static const double degree = M_PI / 180;

/* The tables' free field is e^{-jkR}/(4 pi R); their geometry r' = 3, r = 2. */
static double complex with_phase(const KellerRigidEdge *e, double k)
{
    return keller_btm(e, k) * cexp(-I * k * keller_btm_shortest(e)) / (4 * M_PI);
}

/* Largest error relative to the free field over the way by the edge. */
static void finite_edges(void **state)
{
    (void)state;
    Table t;
    assert_true(table_open(&t, "b_btm_finite_edge.csv", false));
    double worst = 0;
    size_t rows = 0;
    while (table_next(&t)) {
        double z1 = table_number(&t, "z1"), z2 = table_number(&t, "z2"), k = table_number(&t, "k");
        if (!isfinite(z1)) continue;
        KellerRigidEdge e = {.n = table_number(&t, "n"), .phi_in = degree * table_number(&t, "phip_deg"),
                             .phi = degree * table_number(&t, "phi_deg"), .r_in = 3, .r = 2, .z = 2.5, .z1 = z1, .z2 = z2};
        double complex exact = table_number(&t, "diff_hard_re") + I * table_number(&t, "diff_hard_im");
        worst = fmax(worst, cabs(with_phase(&e, k) - exact) * 4 * M_PI * keller_btm_shortest(&e));
        KellerRigidEdge exchanged = {.n = e.n, .phi_in = e.phi, .phi = e.phi_in, .r_in = e.r, .z_in = e.z, .r = e.r_in,
                                     .z = e.z_in,
                                     .z1 = z1, .z2 = z2};
        assert_true(cabs(keller_btm(&exchanged, k) - keller_btm(&e, k)) < 1e-12);
        rows++;
    }
    printf("# %zu finite edges: off by %.2g of the free field\n", rows, worst);
    assert_int_equal(rows, 192);
    assert_true(worst < 1e-10);
}

/* An edge of 4 km for the infinite one of the exact solution, boundaries included. What the ends of an edge bring falls off as
 * beta/(kR): below 1e-6 there. */
static void infinite_edges(void **state)
{
    (void)state;
    Table t;
    assert_true(table_open(&t, "b_point3d_diffracted.csv", false));
    double worst = 0;
    size_t rows = 0;
    while (table_next(&t)) {
        double k = table_number(&t, "k");
        KellerRigidEdge e = {.n = table_number(&t, "n"), .phi_in = degree * table_number(&t, "phip_deg"),
                             .phi = degree * table_number(&t, "phi_deg"), .r_in = table_number(&t, "rhop"), .r = table_number(&t, "rho"),
                             .z = table_number(&t, "z"), .z1 = -2000, .z2 = 2000};
        double complex exact = table_number(&t, "diff_hard_re") + I * table_number(&t, "diff_hard_im");
        worst = fmax(worst, cabs(with_phase(&e, k) - exact) * 4 * M_PI * keller_btm_shortest(&e));
        rows++;
    }
    printf("# %zu long edges: off by %.2g of the free field\n", rows, worst);
    assert_int_equal(rows, 76);
    assert_true(worst < 1e-6);
}

/* The response's transform, its triangles undone, is what the frequency domain says. */
static void time_and_frequency(void **state)
{
    (void)state;
    static const double phis[] = {40, 130, 219.99999, 220.00001, 260}, frequencies[] = {31.5, 250, 1000, 4000};
    enum { RATE = 16 * 48000, COUNT = 30000 };
    static double h[COUNT];
    for (int p = 0; p < 5; p++)
        for (int edge = 0; edge < 2; edge++) {
            KellerRigidEdge e = {.n = 1.5, .phi_in = 40 * degree, .phi = phis[p] * degree, .r_in = 3, .r = 2, .z = 2.5,
                                 .z1 = edge ? 2 : -4, .z2 = 5};
            double speed = 343, start = keller_btm_shortest(&e) / speed - 20.3 / RATE;
            for (int i = 0; i < COUNT; i++) h[i] = 0;
            keller_btm_response(&e, speed, RATE, start, COUNT, h);
            assert_true(h[COUNT - 1] == 0); /* the edge is over */
            for (int f = 0; f < 4; f++) {
                double w = 2 * M_PI * frequencies[f], half = 0.5 * w / RATE;
                double complex sum = 0;
                for (int i = 0; i < COUNT; i++) sum += h[i] / RATE * cexp(-I * w * i / RATE);
                double complex there = keller_btm(&e, w / speed) * cexp(-I * w * 20.3 / RATE);
                double off = cabs(sum * pow(half / sin(half), 2) - there) * keller_btm_shortest(&e);
                if (!(off < 2e-5)) printf("# phi %g, edge %d, %g Hz: off by %.2g\n", phis[p], edge, frequencies[f], off);
                assert_true(off < 2e-5);
            }
        }
}

/* The uniform theory's error falls with kL as its asymptotics say, -20 dB a decade and more; docs/acoustics.md has the table. */
static void uniform_theory_beside(void **state)
{
    (void)state;
    KellerWedgeWave wedge = {.n = 1.5, .direction = v3(0, 0, 1), .tangent0 = v3(1, 0, 0), .normal0 = v3(0, 1, 0),
                             .medium = {{.sound = true, .factor = 1}, {.sound = true, .factor = 1}}};
    static const double phis[] = {100, 150, 200, 230, 260};
    double before = 1;
    for (int octave = -1; octave <= 6; octave++) {
        double k = 2 * M_PI * 1000 * pow(10, 0.3 * (octave - 3)) / 343, worst = 0;
        for (int p = 0; p < 5; p++) {
            double in = 40 * degree, out = phis[p] * degree;
            KellerVec3 towards = v3(-cos(in), -sin(in), 0), away = v3(cos(out), sin(out), 0);
            KellerRigidEdge e = keller_rigid_edge(&wedge, towards, away, 3, 2, 100, 200);
            double complex uniform = keller_sound_diffraction(&wedge, towards, away, 3, 2, k) / 3;
            worst = fmax(worst, cabs(uniform - keller_btm(&e, k)) * 5);
        }
        printf("# %6.0f Hz, kL %6.1f: the uniform theory is off by %6.1f dB re free field\n", k * 343 / (2 * M_PI), k * 1.2,
               20 * log10(worst));
        assert_true(worst < before);
        before = worst;
    }
    assert_true(20 * log10(before) < -55);
}

/* A thin rigid screen: what both methods say of the insertion loss, dB, beside Maekawa's chart and ISO 9613-2. */
static void screen(void **state)
{
    (void)state;
    Table t;
    assert_true(table_open(&t, "e_barrier_halfplane.csv", false));
    KellerWedgeWave rim = {.n = 2, .direction = v3(0, 0, 1), .tangent0 = v3(1, 0, 0), .normal0 = v3(0, 1, 0),
                           .medium = {{.sound = true, .factor = 1}, {.sound = true, .factor = 1}}};
    double utd = 0, btm = 0, maekawa = 0, iso = 0;
    while (table_next(&t)) {
        double in = degree * table_number(&t, "phip_deg"), out = degree * table_number(&t, "phi_deg");
        double s_in = table_number(&t, "rhop"), s = table_number(&t, "rho"), k = 2 * M_PI * table_number(&t, "f_Hz") / 343;
        KellerVec3 source = v3(s_in * cos(in), s_in * sin(in), 0), receiver = v3(s * cos(out), s * sin(out), 0);
        KellerVec3 towards = v3_unit(v3_scale(source, -1)), away = v3_unit(receiver);
        double direct = v3_distance(source, receiver), exact = table_number(&t, "IL_exact_hard_dB");
        KellerRigidEdge e = keller_rigid_edge(&rim, towards, away, s_in, s, 500, 1000);
        double loss_utd = -20 * log10(cabs(keller_sound_diffraction(&rim, towards, away, s_in, s, k)) / s_in * direct);
        assert_true(fabs(loss_utd - table_number(&t, "IL_UTD_hard_dB")) < 1e-9);
        utd = fmax(utd, fabs(loss_utd - exact));
        btm = fmax(btm, fabs(-20 * log10(cabs(keller_btm(&e, k)) * direct) - exact));
        maekawa = fmax(maekawa, fabs(table_number(&t, "IL_Maekawa_10lg(3+20N)") - exact));
        iso = fmax(iso, fabs(table_number(&t, "IL_ISO9613-2_10lg(3+10N)_(C2=20)") - exact));
    }
    printf("# insertion loss off by at most: BTM %.2g dB, UTD %.2g dB, Maekawa %.2g dB, ISO 9613-2 %.2g dB\n", btm, utd,
           maekawa, iso);
    assert_true(btm < 1e-3);
    assert_true(utd < 0.05);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(finite_edges),          cmocka_unit_test(infinite_edges), cmocka_unit_test(time_and_frequency),
        cmocka_unit_test(uniform_theory_beside), cmocka_unit_test(screen),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
