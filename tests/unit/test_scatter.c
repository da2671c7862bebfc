/* Diffuse scattering by one patch: what is scattered adds up to what the reflection loses, whatever the shape of the lobes. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <gsl/gsl_integration.h>

#include "keller/wave.h"

static const KellerVec3 up = {0, 0, 1};

static KellerVec3 direction(double zenith, double azimuth)
{
    return v3(sin(zenith) * cos(azimuth), sin(zenith) * sin(azimuth), cos(zenith));
}

typedef double (*Density)(const void *context, KellerVec3 out);

/* The integral over the upper half-space: Gauss and Legendre in the cosine of the zenith, equal steps in azimuth. */
static double over_half_space(Density density, const void *context)
{
    enum { ZENITHS = 96, AZIMUTHS = 192 };
    gsl_integration_glfixed_table *table = gsl_integration_glfixed_table_alloc(ZENITHS);
    double sum = 0;
    for (size_t i = 0; i < ZENITHS; i++) {
        double cosine, weight;
        gsl_integration_glfixed_point(0, 1, i, &cosine, &weight, table);
        for (int j = 0; j < AZIMUTHS; j++)
            sum += weight * 2 * M_PI / AZIMUTHS * density(context, direction(acos(cosine), 2 * M_PI * (j + 0.5) / AZIMUTHS));
    }
    gsl_integration_glfixed_table_free(table);
    return sum;
}

typedef struct {
    KellerScattering scattering;
    KellerMedium medium;
    KellerVec3 in;
    KellerCVec3 e;
    double phase[2];
} Patch;

static double density_of(const void *context, KellerVec3 out)
{
    const Patch *p = context;
    return keller_scatter_density(&p->scattering, up, p->in, out);
}

static const KellerScattering shapes[] = {
    {.coefficient = 0.4},
    {.coefficient = 0.4, .lobe = 1, .share = 1},
    {.coefficient = 0.7, .lobe = 4, .share = 1, .cross = 0.2},
    {.coefficient = 1, .lobe = 7, .back_lobe = 3, .share = 0.6, .cross = 0.5},
    {.coefficient = 0.3, .lobe = 40, .back_lobe = 1, .share = 0.9, .cross = 1},
    {.coefficient = 0.5, .lobe = 2, .back_lobe = 30, .share = 0.1},
    {.coefficient = 0.5, .lobe = 5, .back_lobe = 6, .share = 0},
};
enum { SHAPES = sizeof shapes / sizeof *shapes };

static void density_integrates_to_one(void **state)
{
    (void)state;
    for (int i = 0; i < SHAPES; i++)
        for (int deg = 0; deg <= 90; deg += 15) {
            Patch p = {.scattering = shapes[i], .in = v3_scale(direction(deg * M_PI / 180, 0.3), -1)};
            double sum = over_half_space(density_of, &p);
            if (fabs(sum - 1) > 1e-9) fail_msg("shape %d at %d deg: %.12f", i, deg, sum);
        }
}

/* By hand: Lambert's law has cos/pi; at normal incidence the integral of (1 + cos)/2 over the half-space is pi + pi/2, that of ((1 +
 * cos)/2)^2 is 2 pi (1 + 1 + 1/3)/4 = 7 pi/6; a lobe back from 60 degrees is greatest there. */
static void densities_by_hand(void **state)
{
    (void)state;
    KellerVec3 down = v3(0, 0, -1), aside = direction(M_PI / 3, 2);
    KellerScattering lambert = {.coefficient = 1}, one = {.lobe = 1, .share = 1}, two = {.lobe = 2, .share = 1};
    assert_true(fabs(keller_scatter_density(&lambert, up, down, aside) - 0.5 / M_PI) < 1e-15);
    assert_true(fabs(keller_scatter_density(&one, up, down, up) - 2 / (3 * M_PI)) < 1e-15);
    assert_true(fabs(keller_scatter_density(&one, up, down, aside) - 0.75 * 2 / (3 * M_PI)) < 1e-15);
    assert_true(fabs(keller_scatter_density(&two, up, down, aside) - 0.5625 * 6 / (7 * M_PI)) < 1e-15);
    KellerScattering both = {.lobe = 9, .back_lobe = 9, .share = 0.5};
    KellerVec3 in = v3_scale(direction(M_PI / 3, 0), -1);
    double back = keller_scatter_density(&both, up, in, direction(M_PI / 3, 0));
    double mirrored = keller_scatter_density(&both, up, in, direction(M_PI / 3, M_PI));
    assert_true(fabs(back - mirrored) < 1e-15 && back > 3 * keller_scatter_density(&both, up, in, up));
    both.share = 0.8;
    assert_true(keller_scatter_density(&both, up, in, direction(M_PI / 3, M_PI)) >
                3 * keller_scatter_density(&both, up, in, direction(M_PI / 3, 0)));
}

static double norm2(KellerCVec3 e)
{
    return creal(e.x * conj(e.x) + e.y * conj(e.y) + e.z * conj(e.z));
}

static double complex dot(KellerCVec3 e, KellerVec3 v) { return e.x * v.x + e.y * v.y + e.z * v.z; }

static const double area = 0.37, wavenumber = 73;

static double power_of(const void *context, KellerVec3 out)
{
    const Patch *p = context;
    KellerCVec3 e = keller_scatter_field(&p->medium, up, p->in, out, area, p->phase, wavenumber, p->e);
    assert_true(cabs(dot(e, out)) < 1e-12);
    return norm2(e);
}

static const KellerMedium media[] = {{.eta = 5.24 - 0.6 * I}, {.eta = 6 - 0.1 * I, .thickness = 0.03}, {.conductor = true}};

/* A transverse field of any polarisation. */
static Patch patch_of(int shape, int medium, double zenith)
{
    Patch p = {.scattering = shapes[shape], .medium = media[medium], .in = v3_scale(direction(zenith, 0.3), -1),
               .phase = {0.7 * shape, 1.9 + medium}};
    p.medium.diffuse = shapes[shape];
    KellerVec3 across = v3_perpendicular(p.in), other = v3_cross(across, p.in);
    double complex a = 0.8 - 0.1 * I, b = 0.3 + 0.5 * I;
    p.e = (KellerCVec3){a * across.x + b * other.x, a * across.y + b * other.y, a * across.z + b * other.z};
    return p;
}

/* What the patch scatters is S^2 of what it would reflect if it were smooth, and what it reflects is the rest: nothing is lost. */
static void power_is_conserved(void **state)
{
    (void)state;
    double worst = 0;
    for (int shape = 0; shape < SHAPES; shape++)
        for (int medium = 0; medium < 3; medium++)
            for (double zenith = 0; zenith < 1.5; zenith += 0.35) {
                Patch p = patch_of(shape, medium, zenith);
                double incident = area * cos(zenith), s = p.scattering.coefficient;
                double smooth = incident * norm2(keller_reflect_field(&media[medium], up, p.in, wavenumber, p.e));
                double scattered = over_half_space(power_of, &p);
                double left = incident * norm2(keller_reflect_field(&p.medium, up, p.in, wavenumber, p.e));
                worst = fmax(worst, fabs(scattered - s * s * smooth) / smooth);
                worst = fmax(worst, fabs(scattered + left - smooth) / smooth);
            }
    print_message("# power scattered and reflected: within %.1e of the smooth surface's\n", worst);
    assert_true(worst < 1e-9);
}

/* In the direction of reflection, without a change of polarisation, it is the reflected field but for its size and phase. */
static void polarisation_is_the_reflections(void **state)
{
    (void)state;
    for (int medium = 0; medium < 3; medium++)
        for (double zenith = 0; zenith < 1.5; zenith += 0.35) {
            Patch p = patch_of(1, medium, zenith);
            p.phase[0] = 0;
            KellerVec3 out = v3_mirror_direction(p.in, up);
            double size = 0.4 * sqrt(area * cos(zenith) * density_of(&p, out));
            KellerCVec3 a = keller_scatter_field(&p.medium, up, p.in, out, area, p.phase, wavenumber, p.e);
            KellerCVec3 b = keller_reflect_field(&media[medium], up, p.in, wavenumber, p.e);
            assert_true(cabs(a.x - size * b.x) + cabs(a.y - size * b.y) + cabs(a.z - size * b.z) < 1e-13);
        }
}

/* All of it crossed: a wave perpendicular to the plane of incidence leaves in it. */
static void crossed_polarisation(void **state)
{
    (void)state;
    KellerMedium metal = {.conductor = true, .diffuse = {.coefficient = 1, .cross = 1}};
    KellerVec3 in = direction(2.4, 0), out = direction(0.5, 0);
    const double phase[2] = {0.2, 0.9};
    KellerCVec3 e = keller_scatter_field(&metal, up, in, out, area, phase, wavenumber, (KellerCVec3){0, 1, 0});
    assert_true(cabs(e.y) < 1e-15);
    assert_true(fabs(norm2(e) - area * -cos(2.4) * cos(0.5) / M_PI) < 1e-15);
}

/* sqrt(1 - S^2) of the coefficients, roughness or not, and the wave that comes through is left as it is. */
static void reflection_is_reduced(void **state)
{
    (void)state;
    for (int medium = 0; medium < 3; medium++) {
        KellerMedium m = media[medium];
        double complex r[2][2], t[2][2];
        m.roughness = 0.002;
        keller_reflection(&m, 0.6, wavenumber, &r[0][0], &r[0][1]);
        keller_transmission(&m, 0.6, wavenumber, &t[0][0], &t[0][1]);
        m.diffuse.coefficient = 0.6;
        keller_reflection(&m, 0.6, wavenumber, &r[1][0], &r[1][1]);
        keller_transmission(&m, 0.6, wavenumber, &t[1][0], &t[1][1]);
        for (int i = 0; i < 2; i++) {
            assert_true(cabs(r[1][i] - 0.8 * r[0][i]) < 1e-15);
            assert_true(t[1][i] == t[0][i]);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(density_integrates_to_one), cmocka_unit_test(densities_by_hand),
        cmocka_unit_test(power_is_conserved),        cmocka_unit_test(polarisation_is_the_reflections),
        cmocka_unit_test(crossed_polarisation),      cmocka_unit_test(reflection_is_reduced),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
