/* The program's path sets against the oracle's: on cases solved by hand, then on random scenes. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "against_oracle.h"
#include "harness.h"
#include "oracle.h"
#include "scenes.h"

/* ---- the oracle itself ------------------------------------------------------------------------------------------ */

static const OraclePath *path_with(const OracleResult *result, uint32_t count, KellerInteractionKind first)
{
    for (size_t i = 0; i < result->count; i++)
        if (result->path[i].valid && result->path[i].count == count &&
            (!count || result->path[i].step[0].kind == first))
            return &result->path[i];
    return NULL;
}

/* A wall in the plane x = 0, 20 m wide and high; both stations at height 10. From (3, 0) to (5, 6): direct 2 and 6
 * apart, sqrt(40); mirrored in x = 0, 8 and 6 apart: 10, at y = 6 * 3/8 = 2.25. */
static void oracle_wall(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "wall");
    soup_quad(&soup, v3(0, -10, 0), v3(0, 10, 0), v3(0, 10, 20), v3(0, -10, 20), CONCRETE);
    KellerScene scene = scene_of(&soup);
    OracleResult r = oracle_enumerate(&scene, v3(3, 0, 10), v3(5, 6, 10), 3, 0, 3);
    assert_int_equal(r.count, 2);
    assert_true(fabs(path_with(&r, 0, KELLER_REFLECTION)->length - sqrt(40)) < 1e-14);
    const OraclePath *p = path_with(&r, 1, KELLER_REFLECTION);
    assert_true(fabs(p->length - 10) < 1e-14);
    assert_true(v3_distance(p->position[0], v3(0, 2.25, 10)) < 1e-14);
    /* The nearest decision to flip: the end of the direct path is 3 m from the wall's plane, but 1 - 2.25/10 of the
     * wall is left and right of the reflection: 7.75 m; the stations are 3 and 5 m from the plane. */
    assert_true(fabs(p->margin - 3) < 1e-12);
    oracle_free(&r);
    /* Each of the four rims gives a path over the shortest way: by symmetry at z = 10 for the upright rims. The
     * sides of the receiver make no difference to a rim (n = 2). */
    r = oracle_enumerate(&scene, v3(3, 0, 10), v3(5, 6, 10), 0, 1, 1);
    assert_int_equal(r.count, 5);
    size_t upright = 0;
    for (size_t i = 0; i < r.count; i++) {
        const OraclePath *d = &r.path[i];
        if (d->count == 0 || fabs(fabs(d->position[0].y) - 10) > 1e-12) continue;
        upright++;
        double y = d->position[0].y;
        assert_true(fabs(d->position[0].z - 10) < 1e-12);
        assert_true(fabs(d->length - hypot(3, y) - hypot(5, y - 6)) < 1e-12);
    }
    assert_int_equal(upright, 2);
    oracle_free(&r);
    /* Behind the wall nothing arrives but by the rims. */
    r = oracle_enumerate(&scene, v3(3, 0, 10), v3(-5, 6, 10), 3, 1, 1);
    assert_int_equal(r.count, 4);
    assert_null(path_with(&r, 0, KELLER_REFLECTION));
    assert_null(path_with(&r, 1, KELLER_REFLECTION));
    oracle_free(&r);
    keller_scene_free(&scene);
    soup_release(&soup);
}

/* An inside corner of two walls, x = 0 and y = 0, from 0 to 20. From (2, 3) to (6, 4): the images are (-2, 3), (2,
 * -3) and, once, (-2, -3): lengths sqrt(64+1), sqrt(16+49), sqrt(64+49). The double bounce: the line from (-2, -3)
 * to (6, 4) meets x = 0 at y = -3 + 7*2/8 = -1.25 < 0, so the wall y = 0 comes last and x = 0 first. */
static void oracle_corner(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "corner");
    soup_quad(&soup, v3(0, 0, 0), v3(0, 20, 0), v3(0, 20, 20), v3(0, 0, 20), CONCRETE);
    soup_quad(&soup, v3(0, 0, 0), v3(20, 0, 0), v3(20, 0, 20), v3(0, 0, 20), CONCRETE);
    KellerScene scene = scene_of(&soup);
    OracleResult r = oracle_enumerate(&scene, v3(2, 3, 10), v3(6, 4, 10), 4, 0, 4);
    assert_int_equal(r.count, 4);
    const OraclePath *p = path_with(&r, 2, KELLER_REFLECTION);
    assert_non_null(p);
    assert_true(fabs(p->length - sqrt(113)) < 1e-13);
    assert_true(fabs(p->position[0].x) < 1e-13 && fabs(p->position[0].y - 1.25) < 1e-13);
    double sum = 0;
    for (size_t i = 0; i < r.count; i++) sum += r.path[i].length;
    assert_true(fabs(sum - (sqrt(17) + 2 * sqrt(65) + sqrt(113))) < 1e-12);
    oracle_free(&r);
    keller_scene_free(&scene);
    soup_release(&soup);
}

/* A wall in x = 0 from y = 0 to 40 on a ground z = 0. Its free rim is upright at x = y = 0. From (3, 4, 2) to (-8,
 * -6, 6) the two distances to the edge are 5 and 10, so the edge is met at z = 2 + 4/3; by way of the ground before
 * it (image at z = -2) at z = -2 + 8/3 = 2/3 with length hypot(15, 8) = 17, reflected where the leg from (-2) to 2/3
 * is at 0: 3/4 of the way to the edge. After it: image of the receiver at -6, met at 2 - 8/3 < 0: not on the edge.
 * The direct way passes x = 0 at y = 4 - 10 * 3/11 = 1.27: blocked. */
static void oracle_edge(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "wall");
    soup_quad(&soup, v3(0, 0, 0), v3(0, 40, 0), v3(0, 40, 30), v3(0, 0, 30), CONCRETE);
    soup_object(&soup, "ground");
    soup_quad(&soup, v3(-50, -50, 0), v3(50, -50, 0), v3(50, 50, 0), v3(-50, 50, 0), CONCRETE);
    KellerScene scene = scene_of(&soup);
    OracleResult r = oracle_enumerate(&scene, v3(3, 4, 2), v3(-8, -6, 6), 1, 1, 2);
    size_t direct = 0, before = 0, after = 0;
    for (size_t i = 0; i < r.count; i++) {
        const OraclePath *p = &r.path[i];
        assert_true(p->valid);
        for (uint32_t k = 0; k < p->count; k++) {
            if (p->step[k].kind != KELLER_DIFFRACTION || hypot(p->position[k].x, p->position[k].y) > 1e-9) continue;
            if (p->count == 1) {
                direct++;
                assert_true(fabs(p->position[0].z - (2 + 4.0 / 3)) < 1e-13);
                assert_true(fabs(p->length - hypot(15, 4)) < 1e-12);
            } else if (k == 1) {
                before++;
                assert_true(fabs(p->position[1].z - 2.0 / 3) < 1e-13);
                assert_true(fabs(p->length - 17) < 1e-12);
                assert_true(v3_distance(p->position[0], v3(0.75, 1, 0)) < 1e-12);
            } else {
                after++;
            }
        }
    }
    assert_int_equal(direct, 1);
    assert_int_equal(before, 1);
    assert_int_equal(after, 0);
    oracle_free(&r);
    keller_scene_free(&scene);
    soup_release(&soup);
}

/* The roof edges of a box: n = 1.5 and the sector; a station above the roof does not see an edge past the other
 * side. */
static void oracle_box(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "box");
    soup_box(&soup, v3(-1, -1, 0), v3(1, 1, 2), CONCRETE, 0);
    KellerScene scene = scene_of(&soup);
    /* From x = -5 to x = 5 at y = 0, z = 1: the direct way is blocked. One diffraction would have to be at an edge that
     * both ends see: the four edges of the sides y = -1 and y = 1 and of top and bottom that are parallel to x are
     * seen from both ends, but a path at them would be at x = 0 in direction x: the ends see the edges z = 2, y = +-1
     * only through the box's end faces. Nothing arrives. */
    OracleResult r = oracle_enumerate(&scene, v3(-5, 0, 1), v3(5, 0, 1), 2, 1, 3);
    assert_int_equal(r.count, 0);
    oracle_free(&r);
    /* From (-5, 0, 1) to (0.3, 0.2, 4) over the edge x = -1, z = 2: depths 4 and 1 below and 1.3 and 2 above; the
     * direct line passes x = -1 at z = 1 + 3*4/5.3 > 2 and is free. Off the roof, image at z = 0: at z = 2 the leg
     * from (-5, 0, 1) to (0.3, 0.2, 0) is below the roof from the start: no reflection. */
    r = oracle_enumerate(&scene, v3(-5, 0, 1), v3(0.3, 0.2, 4), 2, 1, 1);
    assert_non_null(path_with(&r, 0, KELLER_REFLECTION));
    assert_null(path_with(&r, 1, KELLER_REFLECTION));
    assert_non_null(path_with(&r, 1, KELLER_DIFFRACTION));
    double rho = sqrt(17), rho2 = hypot(1.3, 2);
    size_t found = 0;
    for (size_t i = 0; i < r.count; i++)
        if (r.path[i].count && fabs(r.path[i].position[0].x + 1) < 1e-12 && fabs(r.path[i].position[0].z - 2) < 1e-12) {
            found++;
            assert_true(fabs(r.path[i].length - hypot(rho + rho2, 0.2)) < 1e-12);
        }
    assert_int_equal(found, 1);
    oracle_free(&r);
    keller_scene_free(&scene);
    soup_release(&soup);
}

/* Two triangles that touch in a vertex, and open away from it, stand where the shortest way over a screen's upper edge passes: at
 * (10, 0, 0), sqrt(100) + sqrt(100 + 9) = 20.44 m. The ray through the vertex itself is on a boundary: a share of its surroundings is free. */
static void shadows_that_touch(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "screen");
    soup_quad(&soup, v3(10, -1, -5), v3(10, 1, -5), v3(10, 1, 0), v3(10, -1, 0), CONDUCTOR);
    soup_object(&soup, "bow");
    uint32_t tie = soup_vertex(&soup, v3(5, 0, 0));
    soup_triangle(&soup, soup_vertex(&soup, v3(5, -4, -4)), soup_vertex(&soup, v3(5, -4, 4)), tie, CONDUCTOR);
    soup_triangle(&soup, soup_vertex(&soup, v3(5, 4, -4)), tie, soup_vertex(&soup, v3(5, 4, 4)), CONDUCTOR);
    KellerScene scene = scene_of(&soup);
    KellerVec3 tx = v3(0, 0, 0), rx = v3(20, 0, -3);
    Run run = run_new(&tx, 1, &rx, 0, 1, 1);
    FoundPaths found = run_simulation(&scene, &run);
    size_t over = 0;
    for (size_t i = 0; i < found.count; i++)
        over += found.path[i].count == 1 && v3_distance(found.path[i].position[0], v3(10, 0, 0)) < 1e-9 &&
                fabs(found.path[i].length - (10 + sqrt(109))) < 1e-9;
    assert_int_equal(over, 1);
    found_free(&found);
    keller_scene_free(&scene);
    soup_release(&soup);
}

/* ---- the program against the oracle ----------------------------------------------------------------------------- */

/* Orders (reflections, diffractions, transmissions, interactions) in turn. */
static const uint32_t orders[][4] = {{2, 1, 0, 2}, {2, 1, 0, 3}, {3, 0, 0, 3}, {1, 1, 0, 2}, {2, 1, 0, 2}, {3, 1, 0, 3}, {1, 1, 0, 1}, {2, 0, 0, 2}};

static void random_scenes(void **state)
{
    check_seeds(300, 0, sizeof orders / sizeof *orders, orders, *state);
}

/* The comparison would be empty if most were undecidable, or if there were no paths to speak of. */
static void random_scenes_say_something(void **state)
{
    const Tally *tally = *state;
    assert_true(tally->undecidable * 100 < tally->paths);
    assert_true(tally->paths > 10 * tally->scenes || getenv("KELLER_SEEDS"));
}

int main(void)
{
    Tally tally = {0};
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(oracle_wall),
        cmocka_unit_test(oracle_corner),
        cmocka_unit_test(oracle_edge),
        cmocka_unit_test(oracle_box),
        cmocka_unit_test(shadows_that_touch),
        {"random_scenes", random_scenes, NULL, NULL, &tally},
        {"random_scenes_say_something", random_scenes_say_something, NULL, NULL, &tally},
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
