/* Slabs of several layers against the boundary conditions written out and solved, energy, and rough surfaces. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>
#include "keller/wave.h"

static uint64_t seed = 1;

static double between(double a, double b)
{
    seed ^= seed >> 12;
    seed ^= seed << 25;
    seed ^= seed >> 27;
    return a + (b - a) * (double)((seed * 2685821657736338717u) >> 11) * 0x1p-53;
}

/* Passive media, some of them air, some thin, some thick and lossy; lossless ones of 1 mm to 20 cm. */
static KellerMedium random_slab(uint32_t count, bool lossless)
{
    KellerMedium m = {.layer_count = count};
    for (uint32_t i = 0; i < count; i++) {
        double kind = between(0, 1);
        m.layers[i].eta = kind < 0.2 ? 1 : between(1.1, 40) - (lossless ? 0 : I * pow(10, between(-4, 3)));
        m.layers[i].thickness = lossless ? between(0.001, 0.2) : pow(10, between(-6, 1));
        m.thickness += m.layers[i].thickness;
    }
    return m;
}

/* ---- brute force -------------------------------------------------------------------------------------------------- */

typedef long double complex Number;
enum { MOST = 2 * KELLER_MAX_LAYERS + 2 };

static void solve(int n, Number a[MOST][MOST + 1], Number x[MOST])
{
    for (int c = 0; c < n; c++) {
        int pivot = c;
        for (int r = c + 1; r < n; r++)
            if (cabsl(a[r][c]) > cabsl(a[pivot][c])) pivot = r;
        for (int j = 0; j <= n; j++) {
            Number t = a[c][j];
            a[c][j] = a[pivot][j];
            a[pivot][j] = t;
        }
        for (int r = c + 1; r < n; r++) {
            Number f = a[r][c] / a[c][c];
            for (int j = c; j <= n; j++) a[r][j] -= f * a[c][j];
        }
    }
    for (int c = n - 1; c >= 0; c--) {
        x[c] = a[c][n];
        for (int j = c + 1; j < n; j++) x[c] -= a[c][j] * x[j];
        x[c] /= a[c][c];
    }
}

/* Unknowns: the reflected wave, in each layer the wave onwards at its front and the wave back at its rear, the transmitted
 * wave. At each surface the tangential field and its partner (admittance times onwards less back) are continuous. */
static void brute_force(const KellerMedium *m, double cosine, double k, bool tm, double complex *r, double complex *t)
{
    int layers = (int)m->layer_count, n = 2 * layers + 2;
    Number a[MOST][MOST + 1], x[MOST], y[KELLER_MAX_LAYERS], p[KELLER_MAX_LAYERS];
    memset(a, 0, sizeof a);
    for (int i = 0; i < layers; i++) {
        Number eta = m->layers[i].eta, q = csqrtl((eta - 1) + (long double)cosine * cosine);
        y[i] = tm ? q / eta : q;
        p[i] = cexpl(-I * (Number)(k * m->layers[i].thickness) * q);
    }
    for (int s = 0; s <= layers; s++) { /* the surface in front of layer s; the last one is behind all */
        int row = 2 * s;
        if (s == 0) { /* 1 + r and c (1 - r) */
            a[row][0] = -1;
            a[row + 1][0] = cosine;
            a[row][n] = 1;
            a[row + 1][n] = cosine;
        } else {
            a[row][2 * s - 1] = -p[s - 1];
            a[row][2 * s] = -1;
            a[row + 1][2 * s - 1] = -y[s - 1] * p[s - 1];
            a[row + 1][2 * s] = y[s - 1];
        }
        if (s == layers) {
            a[row][n - 1] += 1;
            a[row + 1][n - 1] += cosine;
        } else {
            a[row][2 * s + 1] += 1;
            a[row][2 * s + 2] += p[s];
            a[row + 1][2 * s + 1] += y[s];
            a[row + 1][2 * s + 2] -= y[s] * p[s];
        }
    }
    solve(n, a, x);
    *r = (double complex)x[0];
    *t = (double complex)x[n - 1];
}

static void boundary_conditions(void **state)
{
    (void)state;
    for (int i = 0; i < 4000; i++) {
        KellerMedium m = random_slab(1 + (uint32_t)i % KELLER_MAX_LAYERS, i % 3 == 0);
        double cosine = i % 7 == 0 ? 1 : between(0.01, 1), k = pow(10, between(0, 3));
        double complex r[2], t[2];
        keller_reflection(&m, cosine, k, &r[0], &r[1]);
        keller_transmission(&m, cosine, k, &t[0], &t[1]);
        for (int tm = 0; tm < 2; tm++) {
            double complex er, et;
            brute_force(&m, cosine, k, tm, &er, &et);
            if (!(cabs(r[tm] - er) < 1e-10 && cabs(t[tm] - et) < 1e-10))
                fail_msg("case %d, %s: R off by %g, T by %g", i, tm ? "TM" : "TE", cabs(r[tm] - er), cabs(t[tm] - et));
        }
    }
}

/* ---- relations ---------------------------------------------------------------------------------------------------- */

static void both(const KellerMedium *m, double cosine, double k, double complex r[2], double complex t[2])
{
    keller_reflection(m, cosine, k, &r[0], &r[1]);
    keller_transmission(m, cosine, k, &t[0], &t[1]);
}

/* One layer is the slab, also cut into pieces; grazing and air too. */
static void single_layer(void **state)
{
    (void)state;
    for (int i = 0; i < 3000; i++) {
        KellerMedium one = random_slab(1, i % 2), slab = {.eta = one.layers[0].eta, .thickness = one.thickness}, cut = one;
        double cosine = i % 5 == 0 ? 0 : i % 5 == 1 ? 1 : between(0, 1), k = between(1, 600);
        cut.layer_count = 4;
        for (int j = 0; j < 4; j++) {
            cut.layers[j].eta = one.layers[0].eta;
            cut.layers[j].thickness = one.thickness * (j + 1) / 10;
        }
        double complex r[3][2], t[3][2];
        both(&slab, cosine, k, r[0], t[0]);
        both(&one, cosine, k, r[1], t[1]);
        both(&cut, cosine, k, r[2], t[2]);
        /* the pieces' phases are rounded one by one */
        double rounding[3] = {0, 1e-12, 1e-12 + 1e-15 * k * one.thickness * cabs(csqrt(slab.eta))};
        for (int c = 1; c < 3; c++)
            for (int tm = 0; tm < 2; tm++)
                if (!(cabs(r[c][tm] - r[0][tm]) < rounding[c] && cabs(t[c][tm] - t[0][tm]) < rounding[c]))
                    fail_msg("case %d: %g %g", i, cabs(r[c][tm] - r[0][tm]), cabs(t[c][tm] - t[0][tm]));
    }
}

/* Turned over: the same T; without loss |R| too and |R|^2 + |T|^2 = 1, with loss less. */
static void energy(void **state)
{
    (void)state;
    for (int i = 0; i < 6000; i++) {
        bool lossless = i % 2;
        KellerMedium m = random_slab(1 + (uint32_t)i % KELLER_MAX_LAYERS, lossless), back = m;
        double cosine = i % 11 == 0 ? 1e-9 : between(0, 1), k = pow(10, between(0, 3));
        for (uint32_t j = 0; j < m.layer_count; j++) back.layers[j] = m.layers[m.layer_count - 1 - j];
        double complex r[2][2], t[2][2];
        both(&m, cosine, k, r[0], t[0]);
        both(&back, cosine, k, r[1], t[1]);
        for (int tm = 0; tm < 2; tm++) {
            assert_true(cabs(t[0][tm] - t[1][tm]) < 1e-12);
            double e = pow(cabs(r[0][tm]), 2) + pow(cabs(t[0][tm]), 2);
            assert_true(e < 1 + 1e-12);
            if (lossless && !(e > 1 - 1e-12)) fail_msg("case %d: %g", i, e - 1);
        }
    }
}

/* Double glazing at normal incidence where each pane is half a wavelength in the glass: the panes vanish and T is a phase.
 * And panes and gap of a quarter of a wavelength each. */
static void stacks_by_hand(void **state)
{
    (void)state;
    double n = 2.5, k = 70, wave = 2 * M_PI / k;
    KellerMedium m = {.layer_count = 3, .layers = {{n * n, wave / (2 * n)}, {1, 0.013}, {n * n, wave / (2 * n)}}};
    m.thickness = wave / n + 0.013;
    double complex r[2], t[2];
    both(&m, 1, k, r, t);
    for (int tm = 0; tm < 2; tm++) {
        assert_true(cabs(r[tm]) < 1e-13);
        assert_true(cabs(t[tm] - cexp(-I * (k * 0.013 + 2 * M_PI))) < 1e-12);
    }
    /* quarter waves turn an admittance y into y_layer^2/y: behind the last air 1, then n^2, then 1/n^2, then n^4 */
    m.layers[0].thickness = m.layers[2].thickness = wave / (4 * n);
    m.layers[1].thickness = wave / 4;
    m.thickness = wave / (2 * n) + wave / 4;
    both(&m, 1, k, r, t);
    double expected = (1 - pow(n, 4)) / (1 + pow(n, 4));
    assert_true(cabs(r[0] - expected) < 1e-13 && cabs(r[1] + expected) < 1e-13);
}

static void medium_of_layers(void **state)
{
    (void)state;
    KellerMaterial wall = {.name = (char[]){"cavity"}, .kind = KELLER_MATERIAL_LAYERS, .thickness = 0.16, .layer_count = 2,
                           .layers = {{.kind = KELLER_MATERIAL_ITU, .itu = "brick", .thickness = 0.11},
                                      {.kind = KELLER_MATERIAL_CONSTANT, .permittivity = 2, .conductivity = 0.01, .thickness = 0.05}}};
    KellerMedium m;
    KellerError error;
    assert_int_equal(keller_medium(&wall, 3.5e9, &m, &error), KELLER_OK);
    assert_int_equal(m.layer_count, 2);
    assert_true(m.thickness == 0.16 && m.layers[0].thickness == 0.11 && m.layers[1].thickness == 0.05);
    assert_true(fabs(creal(m.layers[0].eta) - 3.91) < 1e-12); /* P.2040-4: brick 3.91 */
    assert_true(cabs(m.layers[1].eta - (2 - I * 0.01 / (2 * M_PI * 3.5e9 * KELLER_VACUUM_PERMITTIVITY))) < 1e-12);
    assert_int_equal(keller_medium(&wall, 60e9, &m, &error), KELLER_BAD_INPUT);
    assert_non_null(strstr(error.message, "does not define brick at 60 GHz"));
}

/* ---- roughness ---------------------------------------------------------------------------------------------------- */

/* e^{-2 (k h cos)^2} of the smooth surface's reflection, for half-spaces, slabs and conductors; transmission is left. */
static void rough_surfaces(void **state)
{
    (void)state;
    KellerMedium media[3] = {{.eta = 5.24 - 0.6 * I}, {.eta = 5.24 - 0.6 * I, .thickness = 0.1}, {.conductor = true}};
    for (int i = 0; i < 3; i++)
        for (double c = 0; c <= 1; c += 0.125) {
            KellerMedium rough = media[i];
            rough.roughness = 0.004;
            double complex r[2][2], t[2][2];
            both(&media[i], c, 73, r[0], t[0]);
            both(&rough, c, 73, r[1], t[1]);
            double factor = exp(-2 * pow(73 * 0.004 * c, 2));
            for (int tm = 0; tm < 2; tm++) {
                assert_true(cabs(r[1][tm] - factor * r[0][tm]) < 1e-14);
                assert_true(t[1][tm] == t[0][tm]);
            }
        }
    /* Rayleigh's criterion, height differences of lambda/(8 cos), is an rms of lambda/32 cos or so: e^{-pi^2/128} of it is
     * left where k h cos = 2 pi/32 */
    KellerMedium metal = {.conductor = true, .roughness = 1.0 / 32};
    double complex te, tm;
    keller_reflection(&metal, 1, 2 * M_PI, &te, &tm);
    assert_true(cabs(te + exp(-M_PI * M_PI / 128)) < 1e-14 && cabs(tm - exp(-M_PI * M_PI / 128)) < 1e-14);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(boundary_conditions), cmocka_unit_test(single_layer),     cmocka_unit_test(energy),
        cmocka_unit_test(stacks_by_hand),      cmocka_unit_test(medium_of_layers), cmocka_unit_test(rough_surfaces),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
