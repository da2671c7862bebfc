/* One obstacle in three models, perfectly conducting: a screen, a wedge of 1 degree, a box from a hundredth to a quarter of a
 * wavelength thick. All have one lit face in common; only behind it they differ, by less than what the models may. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "../cases.h"
#include "../stability/harness.h"
#include "../stability/scenes.h"
#include "keller/wave.h"

static const double degree = M_PI / 180, far = 400, wave = KELLER_LIGHT_SPEED / 3.5e9; /* m */

/* The edge is the z axis, the obstacle lies towards +x, its lit face in y = 0. thickness < 0: the wedge. */
static KellerScene obstacle(double thickness)
{
    KellerSoup soup = soup_new();
    soup_object(&soup, "obstacle");
    if (thickness == 0) {
        soup_quad(&soup, v3(0, 0, -far), v3(far, 0, -far), v3(far, 0, far), v3(0, 0, far), CONDUCTOR);
    } else if (thickness < 0) {
        KellerVec3 base[3] = {{0, 0, -far}, {far, -far * tan(degree), -far}, {far, 0, -far}};
        soup_prism(&soup, 3, base, v3(0, 0, 2 * far), CONDUCTOR, 0);
    } else {
        soup_box(&soup, v3(0, -thickness, -far), v3(far, 0, far), CONDUCTOR, 0);
    }
    KellerScene scene = scene_of(&soup);
    soup_release(&soup);
    return scene;
}

enum { RECEIVERS = 80, FEW = 27 }; /* at most */

static int receivers(void) { return (int)cases_scenes(RECEIVERS, FEW); }

/* E along the edge, H along the edge. */
typedef struct {
    double complex e[RECEIVERS], h[RECEIVERS];
} Around;

static double azimuth_of(int i) { return 20 + 320.0 * i / (receivers() - 1); } /* degrees: 20 off both faces */

static Around field_around(const KellerScene *scene, double source)
{
    KellerVec3 tx = v3(10 * cos(source * degree), 10 * sin(source * degree), 0), rx[RECEIVERS];
    for (int i = 0; i < receivers(); i++) {
        double azimuth = azimuth_of(i) * degree;
        rx[i] = v3(12 * cos(azimuth), 12 * sin(azimuth), 0);
    }
    Run run = run_new(&tx, (size_t)receivers(), rx, 1, 2, 3);
    FoundPaths found = run_simulation(scene, &run);
    Around a = {0};
    for (size_t i = 0; i < found.count; i++) {
        bool near = true; /* not round the obstacle's other end */
        for (uint32_t k = 0; k < found.path[i].count; k++) near = near && v3_norm(found.path[i].position[k]) < 100;
        if (!near) continue;
        a.e[found.path[i].rx] += found.path[i].transfer[0][0];
        a.h[found.path[i].rx] += found.path[i].transfer[0][3];
    }
    found_free(&found);
    return a;
}

/* Largest difference of the level, dB: E and H, in the shadow and in the lit zone but for its minima. */
typedef struct {
    double shadow[2], lit[2];
} Difference;

enum { SOURCES = 5 };
static const double sources[SOURCES] = {30, 60, 90, 120, 150};

static Difference against_screen(const Around screen[SOURCES], double thickness)
{
    Difference d = {{0}, {0}};
    KellerScene other = obstacle(thickness);
    for (size_t s = 0; s < SOURCES; s++) {
        Around a = screen[s], b = field_around(&other, sources[s]);
        for (int i = 0; i < receivers(); i++) {
            double free_field = wave / (4 * M_PI * 22);
            bool dark = azimuth_of(i) > 180 + sources[s];
            for (int h = 0; h < 2; h++) {
                double complex u = h ? a.h[i] : a.e[i], v = h ? b.h[i] : b.e[i];
                double off = fabs(20 * log10(cabs(v) / cabs(u)));
                if (dark) d.shadow[h] = fmax(d.shadow[h], off);
                else if (cabs(u) > 0.3 * free_field) d.lit[h] = fmax(d.lit[h], off);
            }
        }
    }
    keller_scene_free(&other);
    return d;
}

static void three_models(void **state)
{
    (void)state;
    static const double thickness[] = {-1, 0.01, 0.03, 0.1, 0.2, 0.25, 0.3, 0.4, 0.5, 1}; /* of the wavelength; -1: the wedge */
    Around screen[SOURCES];
    KellerScene thin = obstacle(0);
    for (size_t s = 0; s < SOURCES; s++) screen[s] = field_around(&thin, sources[s]);
    keller_scene_free(&thin);
    for (size_t i = 0; i < sizeof thickness / sizeof *thickness; i++) {
        double t = thickness[i];
        Difference d = against_screen(screen, t * wave);
        print_message("# %s %g: shadow E %.2f H %.2f dB, lit E %.2f H %.2f dB\n", t < 0 ? "wedge" : "box", t, d.shadow[0], d.shadow[1],
                      d.lit[0], d.lit[1]);
        double bound = t < 0 ? 0.5 : 1;
        if (t <= 0.25) assert_true(d.shadow[0] < bound && d.shadow[1] < bound && d.lit[0] < bound && d.lit[1] < bound);
    }
}

/* Nothing jumps as the thickness grows past where two edges begin to count and past where they count entirely. */
static void change_over(void **state)
{
    (void)state;
    const double at[] = {0.25, 0.5};
    for (int i = 0; i < 2; i++) {
        KellerScene below = obstacle(at[i] * wave * (1 - 1e-9)), above = obstacle(at[i] * wave * (1 + 1e-9));
        Around a = field_around(&below, 60), b = field_around(&above, 60);
        for (int k = 0; k < receivers(); k++) {
            assert_true(cabs(a.e[k] - b.e[k]) < 1e-6 * cabs(a.e[k]));
            assert_true(cabs(a.h[k] - b.h[k]) < 1e-6 * cabs(a.h[k]));
        }
        keller_scene_free(&below);
        keller_scene_free(&above);
    }
}

/* A plate has a strip on each narrow side, between the two edges that run along it; a cube, whose sides are as wide as long, and a
 * screen have none. */
static void strips(void **state)
{
    (void)state;
    for (int i = 0; i < 3; i++) {
        KellerSoup soup = soup_new();
        soup_object(&soup, "thing");
        if (i < 2) soup_box(&soup, v3(0, 0, 0), v3(3, i == 0 ? 0.2 : 3, 3), CONCRETE, 0);
        else soup_quad(&soup, v3(0, 0, 0), v3(3, 0, 0), v3(3, 0, 3), v3(0, 0, 3), CONCRETE);
        KellerScene scene = scene_of(&soup);
        soup_release(&soup);
        size_t count = 0, twins = 0;
        for (size_t f = 0; f < scene.face_count; f++) {
            count += scene.faces[f].strip > 0;
            assert_true(scene.faces[f].strip == 0 || fabs(scene.faces[f].strip - 0.2) < 1e-12);
        }
        for (uint32_t w = 0; w < scene.wedge_count; w++) {
            uint32_t second = scene.wedges[w].twin[1];
            if (second == KELLER_NONE) continue;
            assert_int_equal(scene.wedges[second].twin[0], w);
            assert_int_equal(scene.wedges[second].face[0], scene.wedges[w].face[1]);
            twins++;
        }
        assert_int_equal(count, i == 0 ? 4 : 0);
        assert_int_equal(twins, count);
        keller_scene_free(&scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(strips), cmocka_unit_test(three_models), cmocka_unit_test(change_over)};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
