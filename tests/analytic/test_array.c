/* Antenna arrays: the factor by hand, and the phases of elements against elements that are traced one by one. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "../stability/harness.h"
#include "../stability/scenes.h"
#include "keller/wave.h"

static const double still[3] = {0, 0, 0};

/* Two elements a quarter of a wavelength on either side: e^{jx} + e^{-jx} over the root of 2, x = (pi/2) cos of the angle. */
static void two_elements(void **state)
{
    (void)state;
    const double k = 70, quarter = 0.5 * M_PI / k;
    const KellerArrayElement elements[2] = {{{0, quarter, 0}, 0}, {{0, -quarter, 0}, 0}};
    KellerAntenna a = {.element_count = 2, .elements = elements};
    assert_true(cabs(keller_array_factor(&a, still, v3(1, 0, 0), k) - M_SQRT2) < 1e-14);
    assert_true(cabs(keller_array_factor(&a, still, v3(0, 1, 0), k)) < 1e-14);
    assert_true(cabs(keller_array_factor(&a, still, v3(0.8, 0.6, 0), k) - M_SQRT2 * cos(0.3 * M_PI)) < 1e-14);
    /* a quarter turn to the left takes the antenna's y to -x */
    const double turned[3] = {M_PI / 2, 0, 0};
    assert_true(cabs(keller_array_factor(&a, turned, v3(1, 0, 0), k)) < 1e-14);
    assert_true(cabs(keller_array_factor(&(KellerAntenna){.element_count = 0}, still, v3(1, 0, 0), k) - 1) == 0);
    /* fed so that the waves agree towards +y: phase + k d.r is the same for both */
    const KellerArrayElement fed[2] = {{{0, quarter, 0}, -M_PI / 2}, {{0, -quarter, 0}, M_PI / 2}};
    a.elements = fed;
    assert_true(cabs(keller_array_factor(&a, still, v3(0, 1, 0), k) - M_SQRT2) < 1e-14);
}

static const KellerArrayElement elements[3] = {{{0.01, 0.04, 0}, 0.3}, {{0, 0, 0.02}, 1.1}, {{0, -0.05, 0.01}, -0.7}};

static KellerScene street(void)
{
    KellerSoup soup = soup_new();
    soup_object(&soup, "street");
    soup_quad(&soup, v3(-900, -500, 0), v3(900, -500, 0), v3(900, 500, 0), v3(-900, 500, 0), CONCRETE);
    soup_quad(&soup, v3(-900, 90, 0), v3(900, 90, 0), v3(900, 90, 200), v3(-900, 90, 200), CONDUCTOR);
    KellerScene scene = scene_of(&soup);
    soup_release(&soup);
    return scene;
}

/* Of all paths; *sizes: the sum of their |gain|. */
static double complex sum_of_paths(const KellerScene *scene, const Run *run, double *sizes)
{
    FoundPaths found = run_simulation(scene, run);
    double complex whole = found_total(&found, 0, 0);
    *sizes = 0;
    for (size_t i = 0; i < found.count; i++) *sizes += cabs(found.path[i].gain[0]);
    assert_true(found.count >= 4);
    found_free(&found);
    return whole;
}

/* The rotation yaw, pitch, roll (intrinsic z-y-x) of a vector, one turn after the other. */
static KellerVec3 turned(const double o[3], KellerVec3 v)
{
    v = v3(v.x, cos(o[2]) * v.y - sin(o[2]) * v.z, sin(o[2]) * v.y + cos(o[2]) * v.z);
    v = v3(cos(o[1]) * v.x + sin(o[1]) * v.z, v.y, -sin(o[1]) * v.x + cos(o[1]) * v.z);
    return v3(cos(o[0]) * v.x - sin(o[0]) * v.y, sin(o[0]) * v.x + cos(o[0]) * v.y, v.z);
}

/* Of all pairs of elements, each traced as an antenna of its own at its place. */
static double complex sum_of_pairs(const KellerScene *scene, Run one, KellerVec3 tx, KellerVec3 rx)
{
    double complex sum = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            KellerVec3 from = v3_add(tx, turned(one.orientation[0], elements[i].position));
            KellerVec3 to = v3_add(rx, turned(one.orientation[1], elements[j].position));
            one.tx = &from;
            one.rx = &to;
            FoundPaths found = run_simulation(scene, &one);
            sum += found_total(&found, 0, 0) * cexp(I * (elements[i].phase + elements[j].phase)) / 3;
            found_free(&found);
        }
    return sum;
}

/* The gain of arrays at both ends is that of all pairs of elements: but for the curvature of waves, k r^2/2R, and the spreading, r/R. */
static void assert_is_sum(const KellerScene *scene, Run run, double least)
{
    double sizes;
    double complex sum = sum_of_pairs(scene, run, *run.tx, *run.rx);
    run.antenna.element_count = 3;
    run.antenna.elements = elements;
    double complex whole = sum_of_paths(scene, &run, &sizes);
    assert_true(cabs(whole - sum) < 2e-3 * sizes && sizes > 0);
    assert_true(cabs(whole) > least * sizes);
}

static void against_tracing(void **state)
{
    (void)state;
    KellerScene scene = street();
    KellerVec3 tx = v3(-350, 0, 60), rx = v3(400, 30, 40);
    assert_is_sum(&scene, run_new(&tx, 1, &rx, 2, 1, 3), 0.05);
    keller_scene_free(&scene);
}

/* The same with antennas that are turned, at either end another way, for both polarisations and a pattern with a main lobe: elements turn with
 * their array. */
static void turned_and_polarised(void **state)
{
    (void)state;
    static const KellerAntennaPattern patterns[2] = {KELLER_ANTENNA_TR38901, KELLER_ANTENNA_DIPOLE};
    const double ways[2][3] = {{0.2, -0.1, 0.6}, {2.8, 0.15, -0.4}};
    KellerScene scene = street();
    KellerVec3 tx = v3(-350, 0, 60), rx = v3(400, 30, 40);
    for (int p = 0; p < 2; p++)
        for (int h = 0; h < 2; h++) {
            Run run = run_new(&tx, 1, &rx, 2, 0, 2);
            memcpy(run.orientation, ways, sizeof ways);
            run.antenna.pattern = patterns[p];
            run.antenna.polarization = h ? KELLER_POLARIZATION_H : KELLER_POLARIZATION_V;
            assert_is_sum(&scene, run, 0.02);
        }
    keller_scene_free(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(two_elements), cmocka_unit_test(against_tracing),
                                       cmocka_unit_test(turned_and_polarised)};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
