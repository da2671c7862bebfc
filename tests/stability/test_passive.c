/* Passive and reciprocal: nothing amplifies, and exchanging the ends changes nothing. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "../cases.h"
#include "harness.h"
#include "keller/wave.h"
#include "scenes.h"

static const double wave = KELLER_LIGHT_SPEED / 3.5e9;

/* ---- exchanging the ends ------------------------------------------------------------------------------------------- */

/* With a dipole and a sector antenna, both turned, where the seed is odd. */
static void exchanged(uint64_t seed, uint32_t flags, uint32_t reflections, uint32_t diffractions, uint32_t transmissions)
{
    RandomScene world = scene_random(seed, flags);
    KellerScene scene = scene_of(&world.soup);
    scene.transmissions = transmissions;
    const KellerAntenna antenna[2] = {{.pattern = KELLER_ANTENNA_DIPOLE}, {.pattern = KELLER_ANTENNA_TR38901, .polarization = KELLER_POLARIZATION_H}};
    const double orientation[2][3] = {{0.3, 1.2, -0.7}, {-2.1, 0.4, 1.9}};
    for (int i = 0; i < SCENE_RECEIVERS; i++) {
        double complex h[2];
        double sum = 0;
        for (int way = 0; way < 2; way++) {
            KellerVec3 from = way ? world.rx[i] : world.tx, to = way ? world.tx : world.rx[i];
            Run run = run_new(&from, 1, &to, reflections, diffractions, reflections + diffractions + transmissions);
            run.transmissions = transmissions;
            for (int end = 0; end < 2 && seed % 2; end++) memcpy(run.orientation[end], orientation[end ^ way], sizeof *orientation);
            if (seed % 2) {
                run.antenna = antenna[way];
                run.rx_antenna = &antenna[!way];
            }
            FoundPaths found = run_simulation(&scene, &run);
            h[way] = found_total(&found, 0, 0);
            for (size_t j = 0; j < found.count && way == 0; j++) sum += cabs(found.path[j].gain[0]);
            found_free(&found);
        }
        double off = fabs(cabs(h[0]) - cabs(h[1])) / sum;
        if (sum > 0 && !(off <= 1e-12))
            fail_msg("seed %llu, receiver %d: |H| off by %g of the sum of paths", (unsigned long long)seed, i, off);
    }
    keller_scene_free(&scene);
    soup_release(&world.soup);
}

static void reciprocal(void **state)
{
    (void)state;
    for (uint64_t seed = 5001; seed <= 5010; seed++) exchanged(seed, 0, 2, 1, 0);
    for (uint64_t seed = 5011; seed <= 5020; seed++) exchanged(seed, SCENE_THIN, 1, 1, 2);
    for (uint64_t seed = 5021; seed <= 5026; seed++) exchanged(seed, SCENE_SMALL | SCENE_THIN, 1, 2, 1);
    for (uint64_t seed = 5031; seed <= 5033; seed++) exchanged(seed, SCENE_SMALL, 0, 3, 0);
}

/* ---- power --------------------------------------------------------------------------------------------------------- */

/* A closed room of perfect conductors, which loses nothing, around things of all materials. */
static void closed_room(void **state)
{
    (void)state;
    size_t paths = 0;
    for (uint64_t seed = 5101; seed <= 5112; seed++) {
        RandomScene world = scene_random(seed, SCENE_SMALL | (seed % 2 ? SCENE_THIN : 0));
        soup_object(&world.soup, "room");
        soup_box(&world.soup, v3(-61, -63, -1), v3(67, 59, 43), CONDUCTOR, 0);
        KellerScene scene = scene_of(&world.soup);
        scene.transmissions = seed % 2 ? 2 : 0;
        Run run = run_new(&world.tx, SCENE_RECEIVERS, world.rx, 2, 1, 3 + scene.transmissions);
        run.transmissions = scene.transmissions;
        FoundPaths found = run_simulation(&scene, &run);
        double power[SCENE_RECEIVERS] = {0};
        for (size_t i = 0; i < found.count; i++) {
            const Found *p = &found.path[i];
            const double complex *t = p->transfer[0];
            double free_field = wave / (4 * M_PI * p->length), trace = 0;
            power[p->rx] += creal(p->gain[0] * conj(p->gain[0]));
            for (int k = 0; k < 4; k++) trace += creal(t[k] * conj(t[k]));
            double complex det = t[0] * t[3] - t[1] * t[2];
                    /* the larger singular value: s1^2 + s2^2 = trace, s1 s2 = |det|; the root takes half of the digits */
            double largest = sqrt(0.5 * (trace + sqrt(fmax(0, trace * trace - 4 * creal(det * conj(det))))));
            bool bends = false;
            for (uint32_t k = 0; k < p->count; k++) bends = bends || p->step[k].kind == KELLER_DIFFRACTION;
            if (!bends && !(largest <= free_field * (1 + 1e-7)))
                fail_msg("seed %llu: a path of %g of the free field", (unsigned long long)seed, largest / free_field);
            paths += !bends;
        }
        for (uint32_t rx = 0; rx < SCENE_RECEIVERS; rx++) {
            assert_true(power[rx] <= 1);
            assert_true(cabs(found_total(&found, rx, 0)) <= 1);
        }
        found_free(&found);
        keller_scene_free(&scene);
        soup_release(&world.soup);
    }
    assert_true(paths > 300);
}

/* The power through a sphere around everything over that of the source alone: the mean over points that cover it evenly, of the paths'
 * sum with its interference. Where nothing is lost it is 1 but for the share of the orders left out, the theory's error, and some
 * 1/sqrt(points) for the interference that does not average out. */
static double power_out(const KellerSoup *soup, KellerVec3 tx, uint32_t reflections, uint32_t diffractions, uint32_t transmissions)
{
    const double radius = 60;
    const int points = (int)cases_scenes(1500, 500);
    KellerVec3 *rx = malloc((size_t)points * sizeof *rx);
    assert_non_null(rx);
    for (int i = 0; i < points; i++) { /* Fibonacci's lattice */
        double z = 1 - (2 * i + 1.0) / points, azimuth = 2.399963229728653 * i, r = sqrt(1 - z * z);
        rx[i] = v3(tx.x + radius * r * cos(azimuth), tx.y + radius * r * sin(azimuth), tx.z + radius * z);
    }
    KellerScene scene = scene_of(soup);
    scene.transmissions = transmissions;
    Run run = run_new(&tx, (size_t)points, rx, reflections, diffractions, reflections + diffractions + transmissions);
    run.transmissions = transmissions;
    FoundPaths found = run_simulation(&scene, &run);
    double complex *field = calloc(2 * (size_t)points, sizeof *field); /* transmitted theta; in received theta, phi of one basis */
    assert_non_null(field);
    double power = 0;
    for (size_t i = 0; i < found.count; i++) {
        const Found *p = &found.path[i];
        /* all paths arrive within a few degrees of each other: so far off the components of one may be added to those of another */
        field[2 * p->rx] += p->transfer[0][0];
        field[2 * p->rx + 1] += p->transfer[0][2];
    }
    for (int i = 0; i < 2 * points; i++) power += creal(field[i] * conj(field[i]));
    double free_field = wave / (4 * M_PI * radius);
    found_free(&found);
    free(field);
    free(rx);
    keller_scene_free(&scene);
    return power / (points * free_field * free_field);
}

static void through_a_sphere(void **state)
{
    (void)state;
    static const struct {
        const char *what;
        uint32_t material, transmissions;
        double thickness, least, most;
    } cases[] = {{"conductor", CONDUCTOR, 0, 0, 0.9, 1.1},
                 {"concrete", CONCRETE, 0, 0, 0.6, 1.02},
                 {"slabs of glass", GLASS, 4, 0.006, 0.8, 1.1},
                 {"slabs of concrete", CONCRETE, 4, 0.1, 0.5, 1.02}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        KellerSoup soup = soup_new();
        soup.materials[cases[i].material].thickness = cases[i].thickness;
        soup_object(&soup, "box");
        soup_box(&soup, v3(2, -1.7, -1.9), v3(4.3, 1.4, 2.2), cases[i].material, 0);
        double power = power_out(&soup, v3(0, 0.2, 0.1), 1, 2, cases[i].transmissions);
        print_message("# %s: %.3f of the power\n", cases[i].what, power);
        if (!(power >= cases[i].least && power <= cases[i].most)) fail_msg("%s: %g", cases[i].what, power);
        soup_release(&soup);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reciprocal),
        cmocka_unit_test(closed_room),
        cmocka_unit_test(through_a_sphere),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
