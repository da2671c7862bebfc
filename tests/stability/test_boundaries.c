/* Stations in places where a path is just about to change into another: on the diagonal of a corner, on a wall, in the line
 * where two materials meet. What is found there must fit between what is found on both sides. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <cmocka.h>
#include "harness.h"
#include "scenes.h"

typedef struct {
    size_t paths;
    double complex total;
} Seen;

static Seen look(const KellerScene *scene, KellerVec3 tx, KellerVec3 rx, uint32_t reflections, uint32_t diffractions)
{
    Run run = run_new(&tx, 1, &rx, reflections, diffractions, reflections + diffractions);
    FoundPaths found = run_simulation(scene, &run);
    Seen seen = {found_count(&found, 0), found_total(&found, 0, 0)};
    found_free(&found);
    return seen;
}

/* The total on the boundary against the mean of both sides, in dB of the larger. */
static double jump(Seen before, Seen on, Seen behind)
{
    double complex mean = 0.5 * (before.total + behind.total);
    double size = fmax(cabs(before.total), cabs(behind.total));
    return 20 * log10(1 + cabs(on.total - mean) / size);
}

static KellerScene finish(KellerSoup *soup)
{
    KellerScene scene = scene_of(soup);
    soup_release(soup);
    return scene;
}

/* Two conducting walls that meet at the z axis under an angle; the second at that azimuth. */
static KellerScene corner(double angle)
{
    KellerSoup soup = soup_new();
    soup_object(&soup, "corner");
    double c = cos(angle), s = sin(angle);
    soup_quad(&soup, v3(0, 0, -200), v3(300, 0, -200), v3(300, 0, 200), v3(0, 0, 200), CONDUCTOR);
    soup_quad(&soup, v3(0, 0, -200), v3(300 * c, 300 * s, -200), v3(300 * c, 300 * s, 200), v3(0, 0, 200), CONDUCTOR);
    return finish(&soup);
}

/* In a corner of pi/m the m images' mirror sequences commute: on the bisector a wave passes through the corner itself, in
 * either order, as one path. 2 m paths in all: the images of a kaleidoscope. */
static void on_the_bisector(void **state)
{
    (void)state;
    for (uint32_t m = 2; m <= 5; m++) {
        double angle = M_PI / m, c = cos(angle / 2), s = sin(angle / 2), d = 1e-5;
        KellerScene scene = corner(angle);
        KellerVec3 tx = v3(5 * c, 5 * s, 0);
        Seen seen[3];
        for (int i = 0; i < 3; i++)
            seen[i] = look(&scene, tx, v3(8 * c - (i - 1) * d * s, 8 * s + (i - 1) * d * c, 1), m, 0);
        for (int i = 0; i < 3; i++) assert_int_equal(seen[i].paths, 2 * m);
        assert_true(jump(seen[0], seen[1], seen[2]) < 1e-3);
        keller_scene_free(&scene);
    }
}

/* 120 degrees: the double reflection exists on one side only, and the corner diffracts what is missing. Its boundary for a
 * source at azimuth 100 degrees, mirrored in the second wall (140) and the first (-140 = 220), is at 220 - 180 = 40. */
static void double_reflection_boundary(void **state)
{
    (void)state;
    KellerScene scene = corner(2 * M_PI / 3);
    double source = 100 * M_PI / 180, receiver = 40 * M_PI / 180;
    Seen seen[3];
    for (int i = 0; i < 3; i++) {
        double phi = receiver + (i - 1) * 1e-5;
        seen[i] = look(&scene, v3(6 * cos(source), 6 * sin(source), 0), v3(6 * cos(phi), 6 * sin(phi), 0), 2, 1);
    }
    assert_true(seen[0].paths != seen[2].paths);
    assert_true(jump(seen[0], seen[1], seen[2]) < 0.01);
    keller_scene_free(&scene);
}

/* Whole metres in rooms and streets put stations on such diagonals all the time. */
static void whole_metres(void **state)
{
    (void)state;
    KellerSoup room = soup_new();
    soup_object(&room, "room");
    soup_box(&room, v3(0, 0, 0), v3(8, 6, 3), CONCRETE, 0);
    KellerScene scene = finish(&room);
    /* images of a shoebox up to three reflections: (2N + 1)(2N^2 + 2N + 3)/3 = 63 */
    const KellerVec3 pairs[][2] = {
        {{4, 3, 1.5}, {2, 1.5, 1.5}}, {{1, 1, 1}, {3, 3, 2}}, {{1, 1, 1}, {2, 2, 2}}, {{4, 3, 1.5}, {6, 3, 1.5}}};
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++)
        assert_int_equal(look(&scene, pairs[i][0], pairs[i][1], 3, 0).paths, 63);
    keller_scene_free(&scene);
    KellerSoup street = soup_new();
    soup_object(&street, "ground");
    soup_quad(&street, v3(-100, -100, 0), v3(100, -100, 0), v3(100, 100, 0), v3(-100, 100, 0), CONCRETE);
    soup_object(&street, "wall");
    soup_quad(&street, v3(0, -90, 0), v3(0, 90, 0), v3(0, 90, 30), v3(0, -90, 30), CONCRETE);
    scene = finish(&street);
    /* line of sight, wall, ground, and wall and ground in the corner itself: (10, 10) and (2, 2) are in line with it */
    assert_int_equal(look(&scene, v3(10, 0, 10), v3(2, 3, 2), 2, 0).paths, 4);
    keller_scene_free(&scene);
}

/* A station on a wall sees what one just in front of it sees, on whichever side of the wall's normal the scene is. */
static void station_on_a_wall(void **state)
{
    (void)state;
    for (int side = -1; side <= 1; side += 2) {
        KellerSoup soup = soup_new();
        soup_object(&soup, "street");
        soup_quad(&soup, v3(-100, -100, 0), v3(100, -100, 0), v3(100, 100, 0), v3(-100, 100, 0), CONCRETE);
        soup_quad(&soup, v3(0, -90, 0), v3(0, 90, 0), v3(0, 90, 40), v3(0, -90, 40), CONCRETE);
        soup_quad(&soup, v3(10 * side, -90, 0), v3(10 * side, 90, 0), v3(10 * side, 90, 40), v3(10 * side, -90, 40),
                  CONCRETE);
        KellerScene scene = finish(&soup);
        KellerVec3 other = v3(3.1 * side, 20, 1.7);
        Seen before = look(&scene, v3(1e-6 * side, 0, 10), other, 3, 0), on = look(&scene, v3(0, 0, 10), other, 3, 0),
             receiving = look(&scene, other, v3(0, 0, 10), 3, 0);
        assert_int_equal(on.paths, before.paths);
        assert_int_equal(receiving.paths, before.paths);
        assert_true(fabs(20 * log10(cabs(on.total) / cabs(before.total))) < 0.01);
        assert_true(cabs(receiving.total - on.total) < 1e-9 * cabs(on.total));
        keller_scene_free(&scene);
    }
}

/* On the roof of a box: nothing from inside the box. */
static void station_on_a_roof(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "ground");
    soup_quad(&soup, v3(-50, -50, 0), v3(50, -50, 0), v3(50, 50, 0), v3(-50, 50, 0), CONCRETE);
    soup_box(&soup, v3(-5, -5, 0), v3(5, 5, 10), CONCRETE, 0);
    KellerScene scene = finish(&soup);
    Seen above = look(&scene, v3(1, 1, 10.000001), v3(12, 3, 1.5), 2, 1), on = look(&scene, v3(1, 1, 10), v3(12, 3, 1.5), 2, 1);
    assert_int_equal(on.paths, above.paths);
    keller_scene_free(&scene);
}

/* Where two materials meet in one plane, half of each reflects. */
static void between_two_materials(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "ground");
    soup_quad(&soup, v3(-100, -100, 0), v3(0, -100, 0), v3(0, 100, 0), v3(-100, 100, 0), CONCRETE);
    soup_quad(&soup, v3(0, -100, 0), v3(100, -100, 0), v3(100, 100, 0), v3(0, 100, 0), CONDUCTOR);
    KellerScene scene = finish(&soup);
    Seen seen[3];
    for (int i = 0; i < 3; i++) seen[i] = look(&scene, v3(-10, 0.3, 5), v3(10 + (i - 1) * 1e-6, 0.3, 5), 1, 0);
    assert_int_equal(seen[0].paths, 2);
    assert_int_equal(seen[1].paths, 3); /* line of sight and a half of each */
    assert_int_equal(seen[2].paths, 2);
    assert_true(jump(seen[0], seen[1], seen[2]) < 1e-3);
    keller_scene_free(&scene);
}

/* A wall blocks however far away the transmitter is. */
static void behind_a_wall(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "wall");
    soup_quad(&soup, v3(0, -50, -50), v3(0, 50, -50), v3(0, 50, 50), v3(0, -50, 50), CONCRETE);
    KellerScene scene = finish(&soup);
    const double distances[] = {10, 1e3, 1e5, 1e6};
    for (size_t i = 0; i < sizeof distances / sizeof *distances; i++)
        assert_int_equal(look(&scene, v3(distances[i], 1, 2), v3(-1e-3, 1, 2), 0, 0).paths, 0);
    keller_scene_free(&scene);
}

/* Over two edges: more than so many paths, and the same ones with transmitter and receiver exchanged. */
static void same_from_both_ends(const KellerScene *scene, KellerVec3 tx, KellerVec3 rx, size_t least)
{
    Run run = run_new(&tx, 1, &rx, 0, 2, 2);
    FoundPaths there = run_simulation(scene, &run);
    run.tx = &rx;
    run.rx = &tx;
    FoundPaths back = run_simulation(scene, &run);
    PathDifference d = paths_compare(&there, 0, &back, 0, 1e-9, true, NULL, true);
    assert_int_equal(d.only_a + d.only_b, 0);
    assert_true(d.matched > least && d.gain_error < 1e-9);
    found_free(&there);
    found_free(&back);
}

/* Two flat roofs 2 m high and between them a slanted ridge just as high, which the leg from roof to roof touches exactly: rounding
 * has no say, since its volume with the ridge is 0. The path is there or not, but for both directions alike. */
static void ridge_between_roofs(void **state)
{
    (void)state;
    for (int i = -4; i <= 4; i++) {
        KellerSoup soup = soup_new();
        soup_object(&soup, "roofs");
        soup_box(&soup, v3(-4, -2, 0), v3(-2, 2, 2), CONCRETE, 0);
        soup_box(&soup, v3(2, -2, 0), v3(4, 2, 2), CONCRETE, 0);
        soup_object(&soup, "ridge");
        double s = i / 4.0;
        const KellerVec3 gable[] = {v3(-s - 0.5, -2, 1), v3(0.5 - s, -2, 1), v3(-s, -2, 2)};
        soup_prism(&soup, 3, gable, v3(2 * s, 4, 0), CONCRETE, 0);
        KellerScene scene = finish(&soup);
        KellerVec3 tx = v3(-3, 0.375, 5), rx = v3(3.5, -0.25, 4);
        same_from_both_ends(&scene, tx, rx, 2);
        keller_scene_free(&scene);
    }
}

/* Three boxes in a row, turned so that nothing is a round number, with their fronts in one plane: the leg from the first one's
 * corner to the third one's lies in the plane of the second one's front, wherever the stations are. Its share is not rounding's. */
static void along_flush_fronts(void **state)
{
    (void)state;
    const double c = cos(0.3), s = sin(0.3), begin[] = {-9, -2, 5}, end[] = {-4, 1, 8};
    for (int i = 0; i < 8; i++) {
        KellerSoup soup = soup_new();
        for (int k = 0; k < 3; k++) {
            soup_object(&soup, "box");
            const double depth = 3 + k, front = 0.1 * i;
            const double x[] = {begin[k], end[k], end[k], begin[k]}, y[] = {front, front, front + depth, front + depth};
            KellerVec3 base[4];
            for (int j = 0; j < 4; j++) base[j] = v3(c * x[j] - s * y[j], s * x[j] + c * y[j], 0);
            soup_prism(&soup, 4, base, v3(0, 0, 9), CONCRETE, 0);
        }
        KellerScene scene = finish(&soup);
        KellerVec3 tx = v3(-8 * c + 4 * s, -8 * s - 4 * c, 3), rx = v3(7 * c + 5 * s, 7 * s - 5 * c, 5 + 0.1 * i);
        same_from_both_ends(&scene, tx, rx, 4);
        keller_scene_free(&scene);
    }
}

/* Two screens of different materials hang side by side from the z axis, and a third leans on the second; in front of them a mirror. */
static KellerScene screens(void)
{
    KellerSoup soup = soup_new();
    soup_object(&soup, "screens");
    soup_quad(&soup, v3(0, 0, -5), v3(0, 0, 0), v3(0, -5, 0), v3(0, -5, -5), CONDUCTOR);
    soup_quad(&soup, v3(0, 0, 0), v3(0, 0, 5), v3(0, -5, 5), v3(0, -5, 0), CONCRETE);
    soup_object(&soup, "third");
    soup_quad(&soup, v3(0, 0, 0), v3(0, 0, 5), v3(-1.3, -4, 5), v3(-1.3, -4, 0), CONDUCTOR);
    soup_object(&soup, "mirror");
    soup_quad(&soup, v3(3, -8, -9), v3(3, -8, 9), v3(3, 8, 9), v3(3, 8, -9), CONDUCTOR);
    return finish(&soup);
}

static bool count_path(void *count, const KellerPath *path)
{
    (void)path;
    ++*(size_t *)count;
    return true;
}

/* Paths over an edge and a mirror, or, from the other end, over the mirror and an edge. */
static size_t edge_and_mirror(const KellerScene *scene, KellerVec3 from, KellerVec3 to, bool edge_first)
{
    Run run = run_new(&from, 1, &to, 1, 1, 2);
    FoundPaths found = run_simulation(scene, &run);
    size_t count = 0;
    for (size_t i = 0; i < found.count; i++)
        count += found.path[i].count == 2 && found.path[i].step[edge_first ? 0 : 1].kind == KELLER_DIFFRACTION &&
                 found.path[i].step[edge_first ? 1 : 0].kind == KELLER_REFLECTION;
    found_free(&found);
    return count;
}

/* Where an edge goes on as another wedge, one of the two has the path that meets it there, however far the transmitter is and rounding with it. */
static void over_the_joint_of_two_edges(void **state)
{
    (void)state;
    size_t all = 0;
    KellerScene scene = screens();
    KellerAccel *accel;
    KellerError error;
    assert_int_equal(keller_accel_build("auto", &scene, &accel, &error), KELLER_OK);
    for (uint64_t seed = 1; seed <= 200; seed++) {
        Random r = random_seeded(seed);
        const double far = pow(10, random_range(&r, 0, 6)), off = random_range(&r, -0.9, 0.1) * 64 * 0x1p-52 * far;
        const KellerVec3 tx = v3(-far, 0.1 * far * random_range(&r, -1, 1), off), rx = v3(1, -random_range(&r, 1, 3), off);
        size_t count = 0;
        KellerAccelWork work = {0};
        for (uint32_t w = 0; w < scene.wedge_count; w++)
            for (uint32_t f = 0; f < scene.face_count; f++) {
                const KellerStep steps[2] = {{KELLER_DIFFRACTION, w}, {KELLER_REFLECTION, f}};
                assert_true(keller_path_solve(&scene, accel, tx, rx, 2, steps, 0, count_path, &count, &work));
            }
        all += count;
        assert_int_equal(edge_and_mirror(&scene, tx, rx, true), count);
        assert_int_equal(edge_and_mirror(&scene, rx, tx, false), count);
    }
    assert_true(all > 400);
    keller_accel_free(accel);
    keller_scene_free(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(on_the_bisector),   cmocka_unit_test(double_reflection_boundary), cmocka_unit_test(whole_metres),
        cmocka_unit_test(station_on_a_wall), cmocka_unit_test(station_on_a_roof),          cmocka_unit_test(between_two_materials),
        cmocka_unit_test(behind_a_wall),     cmocka_unit_test(ridge_between_roofs),
        cmocka_unit_test(along_flush_fronts), cmocka_unit_test(over_the_joint_of_two_edges),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
