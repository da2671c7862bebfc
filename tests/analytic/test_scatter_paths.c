/* Paths that patches of walls scatter, against the surface integral that they stand for. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>
#include <gsl/gsl_integration.h>

#include "../stability/harness.h"
#include "../stability/scenes.h"
#include "keller/wave.h"

static double power(double complex g) { return creal(g) * creal(g) + cimag(g) * cimag(g); }

static bool scattered(const Found *p)
{
    for (uint32_t i = 0; i < p->count; i++)
        if (p->step[i].kind == KELLER_SCATTERING) return true;
    return false;
}

static size_t scattered_count(const FoundPaths *found, uint32_t rx, double *sum)
{
    size_t n = 0;
    *sum = 0;
    for (size_t i = 0; i < found->count; i++) {
        if (found->path[i].rx != rx || !scattered(&found->path[i])) continue;
        n++;
        *sum += power(found->path[i].gain[0]);
    }
    return n;
}

static const KellerScattering lambert = {.coefficient = 0.6};
static const KellerScattering lobes = {.coefficient = 0.5, .lobe = 6, .back_lobe = 4, .share = 0.7, .cross = 0.1};

/* A wall in the plane y = 0. */
static KellerSoup wall_of(const KellerScattering *scattering, uint32_t material)
{
    KellerSoup soup = soup_new();
    soup.materials[material].diffuse = *scattering;
    soup_object(&soup, "wall");
    soup_quad(&soup, v3(-3, 0, 0), v3(3, 0, 0), v3(3, 0, 4), v3(-3, 0, 4), material);
    return soup;
}

static const KellerVec3 tx = {-4, 5, 3};
static const KellerVec3 receivers[2] = {{2, 7, 1.5}, {-5, 6, 2}};

/* The field of unit sources over the wall, power by power: |gain|^2 = (lambda/4 pi)^2 integral of |e|^2/(r1 r2)^2 dA, e that of a patch
 * of 1 m^2, seen by vertical antennas. Gauss and Legendre, 48 nodes each way. */
static double integral(const KellerSoup *soup, uint32_t material, KellerVec3 rx, const double phase[2])
{
    KellerMedium medium;
    KellerError error;
    const double frequency = 3.5e9, lambda = KELLER_LIGHT_SPEED / frequency;
    assert_int_equal(keller_medium(&soup->materials[material], frequency, &medium, &error), KELLER_OK);
    gsl_integration_glfixed_table *table = gsl_integration_glfixed_table_alloc(48);
    double sum = 0;
    for (size_t i = 0; i < 48; i++)
        for (size_t j = 0; j < 48; j++) {
            double x, z, wx, wz;
            gsl_integration_glfixed_point(-3, 3, i, &x, &wx, table);
            gsl_integration_glfixed_point(0, 4, j, &z, &wz, table);
            KellerVec3 p = v3(x, 0, z), in = v3_unit(v3_sub(p, tx)), out = v3_unit(v3_sub(rx, p)), e0, e1;
            keller_spherical_basis(in, &e0, NULL);
            keller_spherical_basis(v3_scale(out, -1), &e1, NULL);
            KellerCVec3 e = keller_scatter_field(&medium, v3(0, 1, 0), in, out, 1, phase, 2 * M_PI / lambda,
                                                 (KellerCVec3){e0.x, e0.y, e0.z});
            double r = v3_distance(tx, p) * v3_distance(p, rx) * 4 * M_PI / lambda;
            sum += wx * wz * power(e.x * e1.x + e.y * e1.y + e.z * e1.z) / (r * r);
        }
    gsl_integration_glfixed_table_free(table);
    return sum;
}

static FoundPaths found_with(const KellerSoup *soup, double patch, uint32_t transmissions)
{
    KellerScene scene = scene_of(soup);
    Run run = run_new(&tx, 2, receivers, 1, 1, 3);
    run.patch = patch;
    run.transmissions = transmissions;
    FoundPaths found = run_simulation(&scene, &run);
    keller_scene_free(&scene);
    return found;
}

/* The sum of powers tends to the integral as the patches get smaller, with the square of their size. */
static void finer_patches(void **state)
{
    (void)state;
    const KellerScattering no_cross = {.coefficient = 0.5, .lobe = 6, .back_lobe = 4, .share = 0.7}, *all[2] = {&lambert, &no_cross};
    for (int shape = 0; shape < 2; shape++) {
        KellerSoup soup = wall_of(all[shape], shape ? CONCRETE : CONDUCTOR);
        for (uint32_t rx = 0; rx < 2; rx++) {
            const double none[2] = {0, 0}, sizes[4] = {1, 0.5, 0.25, 0.125};
            double exact = integral(&soup, shape ? CONCRETE : CONDUCTOR, receivers[rx], none), error[4];
            for (int i = 0; i < 4; i++) {
                FoundPaths found = found_with(&soup, sizes[i], 0);
                double sum;
                size_t n = scattered_count(&found, rx, &sum);
                assert_int_equal(n, (size_t)lround(24 / (sizes[i] * sizes[i])));
                error[i] = sum / exact - 1;
                found_free(&found);
            }
            print_message("# shape %d, receiver %u: patches of 1 to 1/8 m are off by %+.1e %+.1e %+.1e %+.1e\n", shape, rx, error[0],
                          error[1], error[2], error[3]);
            assert_true(fabs(error[0]) < 0.03 && fabs(error[3]) < 3e-4);
            for (int i = 1; i < 4; i++) assert_true(fabs(error[i]) < fmax(0.3 * fabs(error[i - 1]), 1e-4));
        }
        soup_release(&soup);
    }
}

/* All that one small plate of metal scatters through a large sphere: S^2 of what falls on it. Both received components count; the
 * transmitted one is either. */
static void power_through_a_sphere(void **state)
{
    (void)state;
    enum { ZENITHS = 12, AZIMUTHS = 24 };
    KellerVec3 rx[ZENITHS * AZIMUTHS];
    double weight[ZENITHS * AZIMUTHS];
    const double radius = 1e4, side = 0.5;
    gsl_integration_glfixed_table *table = gsl_integration_glfixed_table_alloc(ZENITHS);
    for (size_t i = 0; i < ZENITHS; i++)
        for (size_t j = 0; j < AZIMUTHS; j++) {
            double cosine, w, azimuth = 2 * M_PI * ((double)j + 0.5) / AZIMUTHS;
            gsl_integration_glfixed_point(0, 1, i, &cosine, &w, table);
            double sine = sqrt(1 - cosine * cosine);
            rx[i * AZIMUTHS + j] = v3_scale(v3(sine * cos(azimuth), sine * sin(azimuth), cosine), radius);
            weight[i * AZIMUTHS + j] = w * 2 * M_PI / AZIMUTHS * radius * radius;
        }
    gsl_integration_glfixed_table_free(table);
    KellerSoup soup = soup_new();
    soup.materials[CONDUCTOR].diffuse = lobes;
    soup_object(&soup, "plate");
    double h = 0.5 * side;
    soup_quad(&soup, v3(-h, -h, 0), v3(h, -h, 0), v3(h, h, 0), v3(-h, h, 0), CONDUCTOR);
    KellerScene scene = scene_of(&soup);
    KellerVec3 source = v3(30, 10, 40);
    Run run = run_new(&source, ZENITHS * AZIMUTHS, rx, 0, 0, 1);
    run.patch = 1;
    FoundPaths found = run_simulation(&scene, &run);
    double sum[2] = {0, 0}, lambda = KELLER_LIGHT_SPEED / 3.5e9;
    for (size_t i = 0; i < found.count; i++) {
        const Found *p = &found.path[i];
        if (!scattered(p)) continue;
        for (int t = 0; t < 2; t++)
            sum[t] += weight[p->rx] * (power(p->transfer[0][t]) + power(p->transfer[0][2 + t])) * pow(4 * M_PI / lambda, 2);
    }
    double r = v3_norm(source), incident = side * side * source.z / r / (r * r);
    print_message("# scattered by a plate: %.9f and %.9f of what it should be\n", sum[0] / (0.25 * incident), sum[1] / (0.25 * incident));
    for (int t = 0; t < 2; t++) assert_true(fabs(sum[t] / (0.25 * incident) - 1) < 1e-6);
    found_free(&found);
    keller_scene_free(&scene);
    soup_release(&soup);
}

/* A wall of L shape with a hole, in many triangles or few: the same patches, with the same fields. */
static void triangles_do_not_matter(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup.materials[CONCRETE].diffuse = lobes;
    soup_object(&soup, "wall");
    const double x[5] = {-3, -1.3, 0.2, 1.1, 3}, z[4] = {0, 1.4, 2.3, 4};
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 3; j++)
            if (!(i == 1 && j == 1) && !(i == 3 && j == 2))
                soup_quad(&soup, v3(x[i], 0, z[j]), v3(x[i + 1], 0, z[j]), v3(x[i + 1], 0, z[j + 1]), v3(x[i], 0, z[j + 1]), CONCRETE);
    FoundPaths a = found_with(&soup, 0.7, 0);
    double whole;
    size_t n = scattered_count(&a, 0, &whole);
    assert_true(n > 40);
    Random random = random_seeded(5);
    for (int round = 0; round < 4; round++) {
        soup_refine(&soup, &random);
        soup_shuffle(&soup, &random);
        soup.materials[CONCRETE].diffuse = lobes;
        FoundPaths b = found_with(&soup, 0.7, 0);
        for (uint32_t rx = 0; rx < 2; rx++) {
            PathDifference d = paths_compare(&a, rx, &b, rx, 1e-9, false, NULL, true);
            assert_true(d.only_a == 0 && d.only_b == 0);
            assert_true(d.gain_error < 1e-9);
        }
        found_free(&b);
    }
    /* the face is all there, and no middle of a patch is in the hole or beside the face */
    size_t total = 0;
    for (size_t i = 0; i < a.count; i++) {
        if (a.path[i].rx != 0 || !scattered(&a.path[i])) continue;
        KellerVec3 p = a.path[i].position[0];
        total++;
        assert_true(p.x > -3 && p.x < 3 && p.z > 0 && p.z < 4 && p.y == 0);
        assert_false(p.x > -1.3 && p.x < 0.2 && p.z > 1.4 && p.z < 2.3);
        assert_false(p.x > 1.1 && p.z > 2.3);
    }
    assert_int_equal(total, n);
    found_free(&a);
    soup_release(&soup);
}

/* Does the segment cross the rectangle x0 .. x1, z0 .. z1 of the plane y = at? */
static bool crosses(KellerVec3 a, KellerVec3 b, double at, const double x[2], const double z[2])
{
    if ((a.y - at) * (b.y - at) >= 0) return false;
    KellerVec3 p = v3_madd(a, v3_sub(b, a), (at - a.y) / (b.y - a.y));
    return p.x > x[0] && p.x < x[1] && p.z > z[0] && p.z < z[1];
}

/* A screen in front of the wall: exactly those patches are left that both ends see, by elementary geometry; and a receiver behind the
 * wall has none. */
static void both_ends_see_each_patch(void **state)
{
    (void)state;
    KellerSoup soup = wall_of(&lambert, CONCRETE);
    const double x[2] = {-1.7, 0.9}, z[2] = {-0.5, 2.6};
    soup_object(&soup, "screen");
    soup_quad(&soup, v3(x[0], 2, z[0]), v3(x[1], 2, z[0]), v3(x[1], 2, z[1]), v3(x[0], 2, z[1]), CONDUCTOR);
    KellerScene scene = scene_of(&soup);
    const double step = 0.25;
    KellerVec3 rx[3] = {receivers[0], receivers[1], {1, -4, 2}};
    Run run = run_new(&tx, 3, rx, 1, 1, 2);
    run.patch = step;
    FoundPaths found = run_simulation(&scene, &run);
    for (uint32_t r = 0; r < 3; r++) {
        size_t expected = 0, matched = 0;
        for (int i = 0; i < 24; i++)
            for (int j = 0; j < 16; j++) {
                KellerVec3 p = v3(-3 + step * (i + 0.5), 0, step * (j + 0.5));
                if (r == 2 || crosses(tx, p, 2, x, z) || crosses(p, rx[r], 2, x, z)) continue;
                expected++;
                for (size_t k = 0; k < found.count; k++)
                    matched += found.path[k].rx == r && scattered(&found.path[k]) && v3_distance(found.path[k].position[0], p) < 1e-9;
            }
        double sum;
        assert_int_equal(matched, expected);
        assert_int_equal(scattered_count(&found, r, &sum), expected);
        if (r < 2) assert_in_range(expected, 100, 380);
    }
    found_free(&found);
    keller_scene_free(&scene);
    soup_release(&soup);
}

/* Through a pane that stands between: only where transmissions are asked for, one more interaction on either leg, and through air
 * as if nothing were there. */
static void through_a_pane(void **state)
{
    (void)state;
    KellerSoup soup = wall_of(&lambert, CONCRETE);
    FoundPaths open = found_with(&soup, 0.5, 0);
    soup_object(&soup, "pane");
    soup_quad(&soup, v3(-50, 1, -40), v3(50, 1, -40), v3(50, 1, 40), v3(-50, 1, 40), GLASS);
    soup.materials[GLASS].kind = KELLER_MATERIAL_CONSTANT;
    soup.materials[GLASS].permittivity = 1;
    soup.materials[GLASS].conductivity = 0;
    double sum, other;
    FoundPaths shut = found_with(&soup, 0.5, 0), through = found_with(&soup, 0.5, 2), once = found_with(&soup, 0.5, 1);
    assert_int_equal(scattered_count(&shut, 0, &sum), 0);
    assert_int_equal(scattered_count(&once, 0, &sum), 0);
    assert_int_equal(scattered_count(&through, 0, &sum), scattered_count(&open, 0, &other));
    assert_true(fabs(sum / other - 1) < 1e-12);
    for (size_t i = 0; i < through.count; i++) {
        const Found *p = &through.path[i];
        if (!scattered(p)) continue;
        assert_int_equal(p->count, 3);
        assert_true(p->step[0].kind == KELLER_TRANSMISSION && p->step[1].kind == KELLER_SCATTERING &&
                    p->step[2].kind == KELLER_TRANSMISSION);
        assert_true(fabs(p->position[0].y - 1) < 1e-12 && p->position[1].y == 0 && fabs(p->position[2].y - 1) < 1e-12);
    }
    soup.materials[GLASS].permittivity = 6;
    FoundPaths glass = found_with(&soup, 0.5, 2);
    assert_int_equal(scattered_count(&glass, 0, &other), scattered_count(&through, 0, &sum));
    assert_true(other < 0.9 * sum && other > 0.05 * sum);
    found_free(&open);
    found_free(&shut);
    found_free(&once);
    found_free(&through);
    found_free(&glass);
    soup_release(&soup);
}

/* Not asked for: the reflection is weaker, by sqrt(1 - S^2), and that is all; asked for where nothing scatters: nothing changes. */
static void off_unless_asked(void **state)
{
    (void)state;
    KellerSoup plain = wall_of(&(KellerScattering){.coefficient = 0}, CONCRETE), rough = wall_of(&lambert, CONCRETE);
    FoundPaths a = found_with(&plain, 0, 0), b = found_with(&plain, 0.5, 0), c = found_with(&rough, 0, 0);
    assert_int_equal(a.count, b.count);
    assert_int_equal(a.count, c.count);
    int reflections = 0;
    for (size_t i = 0; i < a.count; i++) {
        const Found *p = &a.path[i];
        assert_true(b.path[i].gain[0] == p->gain[0] && !scattered(p) && !scattered(&c.path[i]));
        if (p->count != 1 || p->step[0].kind != KELLER_REFLECTION) continue;
        reflections++;
        assert_true(cabs(c.path[i].gain[0] - 0.8 * p->gain[0]) < 1e-12 * cabs(p->gain[0]));
    }
    assert_true(reflections > 0);
    found_free(&a);
    found_free(&b);
    found_free(&c);
    soup_release(&plain);
    soup_release(&rough);
}

/* Lambert's law and a perfect conductor do not tell the ends apart (lobes do: theory.md). */
static void ends_exchanged(void **state)
{
    (void)state;
    KellerSoup soup = wall_of(&lambert, CONDUCTOR);
    KellerScene scene = scene_of(&soup);
    Run there = run_new(&tx, 1, receivers, 0, 0, 1), back = run_new(receivers, 1, &tx, 0, 0, 1);
    there.patch = back.patch = 0.5;
    FoundPaths a = run_simulation(&scene, &there), b = run_simulation(&scene, &back);
    double sum, other;
    assert_int_equal(scattered_count(&a, 0, &sum), scattered_count(&b, 0, &other));
    assert_true(fabs(sum / other - 1) < 1e-12);
    found_free(&a);
    found_free(&b);
    keller_scene_free(&scene);
    soup_release(&soup);
}

/* Maps add up scattered paths' powers to the power of the sum of the others; the phases of the patches are without order, so that the
 * sum of gains has about as much. And nothing of it depends on threads. */
static void maps_and_phases(void **state)
{
    (void)state;
    KellerSoup soup = wall_of(&lambert, CONCRETE);
    KellerScene scene = scene_of(&soup);
    KellerVec3 rx[8];
    for (int i = 0; i < 8; i++) rx[i] = v3(-2 + 0.5 * i, 6, 1.5);
    Run run = run_new(&tx, 8, rx, 1, 1, 2);
    run.patch = 0.2;
    run.grid_step = 0.5;
    FoundPaths found = run_simulation(&scene, &run);
    run.threads = 3;
    FoundPaths again = run_simulation(&scene, &run);
    assert_int_equal(found.count, again.count);
    double speckle = 0;
    for (uint32_t r = 0; r < 8; r++) {
        double complex sum = 0, diffuse = 0;
        double incoherent;
        size_t n = scattered_count(&found, r, &incoherent);
        for (size_t i = 0; i < found.count; i++) {
            if (found.path[i].rx != r) continue;
            if (scattered(&found.path[i])) diffuse += found.path[i].gain[0];
            else sum += found.path[i].gain[0];
        }
        assert_int_equal(n, 600);
        assert_true(fabs(found.coverage[r] - power(sum) - incoherent) < 1e-12 * found.coverage[r]);
        assert_true(found.coverage[r] == again.coverage[r]);
        speckle += power(diffuse) / incoherent / 8;
    }
    print_message("# power of the sum over sum of the powers, mean of 8 places: %.2f\n", speckle);
    /* Rayleigh fading has a mean of 1 and a standard deviation of 1: that of eight is 0.35; patches in phase would have hundreds */
    assert_true(speckle > 0.2 && speckle < 2.1);
    for (size_t i = 0; i < found.count; i++) assert_true(found.path[i].gain[0] == again.path[i].gain[0]);
    found_free(&found);
    found_free(&again);
    keller_scene_free(&scene);
    soup_release(&soup);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(finer_patches),           cmocka_unit_test(power_through_a_sphere),
        cmocka_unit_test(triangles_do_not_matter), cmocka_unit_test(both_ends_see_each_patch),
        cmocka_unit_test(through_a_pane),          cmocka_unit_test(off_unless_asked),
        cmocka_unit_test(ends_exchanged),          cmocka_unit_test(maps_and_phases),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
