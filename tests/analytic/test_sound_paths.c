/* Sound through the whole program: a street canyon path by path, a rigid wedge and an impedance wedge, reciprocity, level means. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "../stability/harness.h"
#include "../stability/scenes.h"
#include "../truth/table.h"
#include "keller/sound.h"
#include "path/level.h"

static KellerMaterial rigid(void) { return (KellerMaterial){.kind = KELLER_MATERIAL_RIGID}; }

static KellerMaterial impedance(double re, double im)
{
    return (KellerMaterial){.kind = KELLER_MATERIAL_IMPEDANCE, .band_count = 1, .band = {1000}, .surface = {{re, im}}};
}

static KellerMaterial absorbing(double alpha)
{
    return (KellerMaterial){.kind = KELLER_MATERIAL_ABSORPTION, .band_count = 1, .band = {1000}, .surface = {{alpha}}};
}

/* The soup's concrete becomes `one`, all its other materials `other`; sound of 343 m/s without loss. */
static KellerScene sound_scene(KellerSoup *soup, KellerMaterial one, KellerMaterial other)
{
    for (uint32_t i = 0; i < MATERIAL_COUNT; i++) {
        char *name = soup->materials[i].name;
        soup->materials[i] = i == CONCRETE ? one : other;
        soup->materials[i].name = name;
    }
    KellerScene scene = scene_of(soup);
    soup_release(soup);
    scene.sound.speed = 343;
    return scene;
}

/* ---- canyon: walls y = 0 and y = 20, ground z = 0; images as in test_canyon.c, in 30 digits ---------------------------- */

enum { CANYON_ORDER = 4 };
static const KellerVec3 canyon_source = {0, 6, 10};
static const KellerVec3 canyon_receivers[] = {{5, 13, 1.5}, {30, 13, 1.5}, {80, 13, 1.5}, {200, 13, 1.5}, {50, 8.5, 10}};

static KellerScene canyon(KellerMaterial wall, KellerMaterial ground)
{
    KellerSoup soup = soup_new();
    soup_object(&soup, "canyon");
    for (int w = 0; w < 2; w++)
        soup_quad(&soup, v3(-60, 20 * w, 0), v3(260, 20 * w, 0), v3(260, 20 * w, 60), v3(-60, 20 * w, 60), CONCRETE);
    soup_quad(&soup, v3(-60, 0, 0), v3(260, 0, 0), v3(260, 20, 0), v3(-60, 20, 0), DRY_GROUND);
    return sound_scene(&soup, wall, ground);
}

static void canyon_path_by_path(void **state)
{
    (void)state;
    static const char *const names[] = {"1kHz_rigid", "250Hz_Zw30-10j_Zg12-8j", "1kHz_alpha0.1_0.2"};
    KellerMaterial wall[] = {rigid(), impedance(30, -10), absorbing(0.1)};
    KellerMaterial ground[] = {rigid(), impedance(12, -8), absorbing(0.2)};
    FoundPaths found[3];
    for (int c = 0; c < 3; c++) {
        KellerScene scene = canyon(wall[c], ground[c]);
        Run run = run_new(&canyon_source, 5, canyon_receivers, CANYON_ORDER, 0, CANYON_ORDER);
        run.frequency[0] = c == 1 ? 250 : 1000;
        found[c] = run_simulation(&scene, &run);
        assert_int_equal(found[c].count, 5 * 4 * CANYON_ORDER);
        keller_scene_free(&scene);
    }
    Table t;
    assert_true(table_open(&t, "d_canyon_acoustic_paths.csv", false));
    size_t rows = 0;
    while (table_next(&t)) {
        char text[128];
        table_text(&t, "case", text, sizeof text);
        int c = 0;
        while (strcmp(names[c], text) != 0) c++;
        double length = table_number(&t, "length_m"), walls = table_number(&t, "n_wall"), order = table_number(&t, "order");
        double complex expected = 4 * M_PI * (table_number(&t, "a_re") + I * table_number(&t, "a_im"));
        size_t matches = 0;
        for (size_t i = 0; i < found[c].count; i++) {
            const Found *p = &found[c].path[i];
            double on_walls = 0;
            for (uint32_t k = 0; k < p->count; k++) on_walls += p->position[k].z > 1e-9;
            if (p->rx != table_number(&t, "rx") || p->count != order || on_walls != walls ||
                fabs(p->length - length) > 1e-9) continue;
            matches++;
            assert_true(cabs(p->gain[0] - expected) < 1e-11 * cabs(expected));
        }
        assert_int_equal(matches, 1);
        rows++;
    }
    assert_int_equal(rows, 3 * 5 * 4 * CANYON_ORDER);
    for (int c = 0; c < 3; c++) found_free(&found[c]);
}

/* ---- a wedge along z with the 0-face y = 0, x > 0 and the n-face x = 0, y < 0 -------------------------------------------- */

static KellerScene wedge_scene(KellerMaterial zero, KellerMaterial other)
{
    KellerSoup soup = soup_new();
    soup_object(&soup, "wedge");
    uint32_t a = soup_vertex(&soup, v3(0, 0, -1000)), b = soup_vertex(&soup, v3(0, 0, 1000));
    uint32_t c = soup_vertex(&soup, v3(400, 0, 1000)), d = soup_vertex(&soup, v3(400, 0, -1000));
    uint32_t e = soup_vertex(&soup, v3(0, -400, 1000)), f = soup_vertex(&soup, v3(0, -400, -1000));
    soup_triangle(&soup, a, b, c, CONCRETE);
    soup_triangle(&soup, a, c, d, CONCRETE);
    soup_triangle(&soup, a, b, e, DRY_GROUND);
    soup_triangle(&soup, a, e, f, DRY_GROUND);
    return sound_scene(&soup, zero, other);
}

static KellerVec3 around(double rho, double phi, double z) { return v3(rho * cos(phi), rho * sin(phi), z); }

/* The field of all paths but those over the rims far away. */
static double complex field_at(KellerScene *scene, KellerVec3 tx, KellerVec3 rx, double frequency, KellerEdgeMethod edges)
{
    scene->sound.edges = edges;
    Run run = run_new(&tx, 1, &rx, 1, 1, 1);
    run.frequency[0] = frequency;
    FoundPaths found = run_simulation(scene, &run);
    double complex sum = 0;
    for (size_t i = 0; i < found.count; i++) {
        bool near = true;
        for (uint32_t k = 0; k < found.path[i].count; k++) {
            KellerVec3 p = found.path[i].position[k];
            near = near && (found.path[i].step[k].kind == KELLER_REFLECTION || (hypot(p.x, p.y) < 1 && fabs(p.z) < 100));
        }
        if (near) sum += found.path[i].gain[0];
    }
    found_free(&found);
    return sum;
}

/* In dB of the free field over the edge: BTM is exact but for the ends of the edge, 1 km away; the
 * uniform theory has the error that the table gives it. */
static void rigid_wedge(void **state)
{
    (void)state;
    KellerScene scene = wedge_scene(rigid(), rigid());
    Table t;
    if (!table_open(&t, "b_point3d.csv", true)) assert_true(table_open(&t, "b_point3d.csv", false));
    size_t rows = 0, count = 0;
    double worst = 0;
    while (table_next(&t)) {
        double k = table_number(&t, "k"), z = table_number(&t, "z"), phi = table_number(&t, "phi_deg");
        if (table_number(&t, "n") != 1.5 || k > 10 || phi <= 0 || phi >= 270 || rows++ % 9) continue;
        KellerVec3 tx = around(3, M_PI / 180 * table_number(&t, "phip_deg"), 0), rx = around(2, M_PI / 180 * phi, z);
        double complex exact = 4 * M_PI * (table_number(&t, "hard_re") + I * table_number(&t, "hard_im"));
        double complex uniform = 4 * M_PI * (table_number(&t, "utd_hard_re") + I * table_number(&t, "utd_hard_im"));
        double scale = hypot(5, z), frequency = k * 343 / (2 * M_PI);
        double off = cabs(field_at(&scene, tx, rx, frequency, KELLER_EDGES_BTM) - exact) * scale;
        worst = fmax(worst, off);
        double off_uniform = cabs(field_at(&scene, tx, rx, frequency, KELLER_EDGES_UTD) - uniform) * scale;
        if (off_uniform > 1e-9) printf("# phi' %g, phi %g, z %g, k %g: the uniform theory is off by %.2g\n",
                                       table_number(&t, "phip_deg"), phi, z, k, off_uniform);
        assert_true(off_uniform < 1e-9);
        count++;
    }
    printf("# %zu points: BTM is off by %.2g of the free field\n", count, worst);
    assert_true(count > 20);
    assert_true(worst < 1e-6);
    keller_scene_free(&scene);
}

/* Exchanging source and receiver changes nothing, and the field does not jump at shadow and reflection boundaries. */
static void impedance_wedge(void **state)
{
    (void)state;
    KellerScene scene = wedge_scene(impedance(7, -3), absorbing(0.4));
    double phi_in = 0.7, boundaries[] = {M_PI - phi_in, M_PI + phi_in};
    for (int i = 1; i < 20; i++) {
        KellerVec3 a = around(3, phi_in, 0), b = around(2, 0.23 * i, 1.5);
        double complex there = field_at(&scene, a, b, 300, KELLER_EDGES_UTD), back = field_at(&scene, b, a, 300,
                                                                                              KELLER_EDGES_UTD);
        assert_true(cabs(there - back) < 1e-12);
    }
    for (int i = 0; i < 2; i++) {
        double complex on = field_at(&scene, around(3, phi_in, 0), around(2, boundaries[i], 1.5), 300, KELLER_EDGES_UTD);
        for (int side = -1; side <= 1; side += 2) {
            double complex beside = field_at(&scene, around(3, phi_in, 0), around(2, boundaries[i] + 1e-6 * side, 1.5),
                                             300, KELLER_EDGES_UTD);
            assert_true(cabs(beside - on) < 1e-4 * cabs(on)); /* it changes by about k rho 1e-6 = 1e-5 */
        }
    }
    keller_scene_free(&scene);
}

/* Over and around a box on the ground, two edges on a path: exchanging the ends changes nothing. */
static void two_edges_either_way(void **state)
{
    (void)state;
    KellerMaterial materials[2] = {rigid(), impedance(12, -8)};
    for (int i = 0; i < 2; i++) {
        KellerSoup soup = soup_new();
        soup_object(&soup, "box");
        soup_quad(&soup, v3(-30, -30, 0), v3(30, -30, 0), v3(30, 30, 0), v3(-30, 30, 0), DRY_GROUND);
        soup_box(&soup, v3(-2, -4, 0), v3(1, 5, 3), CONCRETE, 1u << 4);
        KellerScene scene = sound_scene(&soup, materials[i], materials[1]);
        KellerVec3 ends[2] = {v3(-7, 0.3, 1.2), v3(6, -0.8, 1.7)};
        double complex p[2];
        size_t count[2];
        for (int way = 0; way < 2; way++) {
            Run run = run_new(&ends[way], 1, &ends[1 - way], 2, 2, 3);
            run.frequency[0] = 250;
            FoundPaths found = run_simulation(&scene, &run);
            p[way] = found_total(&found, 0, 0);
            count[way] = found.count;
            found_free(&found);
        }
        assert_true(count[0] > 10);
        assert_int_equal(count[0], count[1]);
        assert_true(cabs(p[0] - p[1]) < 1e-9 * cabs(p[0]));
        keller_scene_free(&scene);
    }
}

/* A screen that floats, its upper rim cut into `pieces`. */
static KellerScene floating_screen(int pieces)
{
    KellerSoup soup = soup_new();
    soup_object(&soup, "screen");
    uint32_t below = soup_vertex(&soup, v3(0, -4, 1)), last = soup_vertex(&soup, v3(0, -4, 2.5));
    uint32_t far_end = soup_vertex(&soup, v3(0, 5, 1));
    for (int i = 1; i <= pieces; i++) {
        uint32_t next = soup_vertex(&soup, v3(0, -4 + 9 * pow((double)i / pieces, 1.3), 2.5));
        soup_triangle(&soup, below, last, next, CONCRETE);
        last = next;
    }
    soup_triangle(&soup, below, last, far_end, CONCRETE);
    KellerScene scene = sound_scene(&soup, rigid(), rigid());
    scene.sound.edges = KELLER_EDGES_BTM;
    return scene;
}

static double complex total_at(const KellerScene *scene, KellerVec3 tx, KellerVec3 rx, double frequency, size_t *count)
{
    Run run = run_new(&tx, 1, &rx, 1, 1, 1);
    run.frequency[0] = frequency;
    FoundPaths found = run_simulation(scene, &run);
    double complex sum = found_total(&found, 0, 0);
    *count = found.count;
    found_free(&found);
    return sum;
}

/* The shortest way over the upper rim leaves it at its end y = 5 where y_r = 5 (r' + r)/r', over the lower one likewise: the rim goes on
 * diffracting by its end, and the field does not jump. All four rims bring a path, wherever the receiver is. */
static void ends_of_edges(void **state)
{
    (void)state;
    KellerScene scene = floating_screen(1);
    KellerVec3 tx = v3(-3, 0, 1.8);
    for (int rim = 0; rim < 2; rim++) {
        double z = rim ? 2.5 : 1, before = hypot(3, z - tx.z), behind = hypot(3, z - 1.9);
        double leaves = 5 * (before + behind) / before;
        size_t count[2];
        double complex p[2];
        for (int i = 0; i < 2; i++) p[i] = total_at(&scene, tx, v3(3, leaves + (i ? 1e-7 : -1e-7), 1.9), 400, &count[i]);
        assert_true(cabs(p[1] - p[0]) < 1e-5 * cabs(p[0]));
        assert_true(count[0] >= 4 && count[1] >= 4);
    }
    size_t count;
    for (double y = 0.3; y < 30; y += 2.9) {
        total_at(&scene, tx, v3(3, y, 1.9), 400, &count);
        assert_true(count >= 4 && count <= 5);
    }
    keller_scene_free(&scene);
}

/* One rim or seven in a line: one edge. */
static void cut_edges_are_one(void **state)
{
    (void)state;
    KellerScene whole = floating_screen(1), cut = floating_screen(7);
    for (double y = -6; y < 12; y += 1.7) {
        size_t count[2];
        double complex p = total_at(&whole, v3(-3, 0, 1.8), v3(3, y, 1.9), 400, &count[0]);
        double complex q = total_at(&cut, v3(-3, 0, 1.8), v3(3, y, 1.9), 400, &count[1]);
        assert_int_equal(count[0], count[1]);
        assert_true(cabs(p - q) < 1e-10 * cabs(p));
    }
    keller_scene_free(&whole);
    keller_scene_free(&cut);
}

/* The mean over a band is that of many tones. */
static void band_mean(void **state)
{
    (void)state;
    enum { PATHS = 7, TONES = 20000 };
    double delay[PATHS], middle = 1000, width = keller_band_width(1, middle), sum = 0;
    double complex gain[2 * PATHS];
    Random random = random_seeded(8);
    for (int i = 0; i < PATHS; i++) {
        delay[i] = random_range(&random, 0.01, 0.03);
        gain[2 * i] = random_range(&random, 0.1, 1) * cexp(I * random_range(&random, 0, 7));
    }
    for (int j = 0; j < TONES; j++) {
        double complex h = 0;
        for (int i = 0; i < PATHS; i++) h += gain[2 * i] * cexp(-2 * I * M_PI * width * ((j + 0.5) / TONES - 0.5) * delay[i]);
        sum += creal(h * conj(h)) / TONES;
    }
    assert_true(fabs(level_mean_square(PATHS, gain, 2, delay, width) - sum) < 1e-6 * sum);
    double complex tone = 0;
    for (int i = 0; i < PATHS; i++) tone += gain[2 * i];
    assert_true(fabs(level_mean_square(PATHS, gain, 2, delay, 0) - creal(tone * conj(tone))) < 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(canyon_path_by_path), cmocka_unit_test(rigid_wedge),
                                       cmocka_unit_test(impedance_wedge), cmocka_unit_test(two_edges_either_way),
                                       cmocka_unit_test(ends_of_edges), cmocka_unit_test(cut_edges_are_one),
                                       cmocka_unit_test(band_mean)};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
