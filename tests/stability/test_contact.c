/* Solids that touch: how a file says it must make no difference. Each way of drawing the same thing gives the same
 * paths and the same fields. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "harness.h"
#include "scenes.h"

static const KellerVec3 stations_tx = {-9.3, -4.1, 3.7};
static const KellerVec3 stations_rx[] = {
    {7.9, 6.3, 1.5}, {-3.1, 8.8, 5.2}, {0.7, 0.4, 9.6}, {-7.7, -2.9, 0.8}, {9.1, -8.2, 1.1}};
#define RECEIVERS (sizeof stations_rx / sizeof *stations_rx)

static FoundPaths simulate(KellerSoup *soup)
{
    KellerScene scene = scene_of(soup);
    Run run = run_new(&stations_tx, RECEIVERS, stations_rx, 2, 1, 3);
    FoundPaths found = run_simulation(&scene, &run);
    keller_scene_free(&scene);
    soup_release(soup);
    return found;
}

/* Consumes the soup. The same paths as the model's, and gains to 1e-9. */
static size_t differs(const FoundPaths *model, KellerSoup soup, const char *what)
{
    FoundPaths found = simulate(&soup);
    size_t differences = 0;
    for (uint32_t rx = 0; rx < RECEIVERS; rx++) {
        PathDifference d = paths_compare(model, rx, &found, rx, 1e-6, false, NULL, true);
        bool gains = d.gain_error <= 1e-9;
        if (d.only_a || d.only_b || !gains)
            printf("# %s, receiver %u: %zu the same, %zu missing, %zu too many, gains differ by %.3g\n", what, rx,
                   d.matched, d.only_a, d.only_b, d.gain_error);
        differences += d.only_a + d.only_b + !gains;
    }
    found_free(&found);
    return differences;
}

static size_t count_kind(const FoundPaths *found, KellerInteractionKind kind)
{
    size_t count = 0;
    for (size_t i = 0; i < found->count; i++)
        for (uint32_t k = 0; k < found->path[i].count; k++) count += found->path[i].step[k].kind == kind;
    return count;
}

/* Diffractions within 0.1 m of the ground, but for those at its own rims, 30 m away: a wall's foot is a corner. */
static size_t count_at_foot(const FoundPaths *found)
{
    size_t count = 0;
    for (size_t i = 0; i < found->count; i++)
        for (uint32_t k = 0; k < found->path[i].count; k++) {
            KellerVec3 p = found->path[i].position[k];
            count += found->path[i].step[k].kind == KELLER_DIFFRACTION && fabs(p.z) < 0.1 && fabs(p.x) < 29 &&
                     fabs(p.y) < 29;
        }
    return count;
}

static void turn_inside_out(KellerSoup *soup)
{
    for (size_t i = 0; i < soup->triangle_count; i++)
        if (i % 3 != 1) {
            uint32_t corner = soup->triangles[i][0];
            soup->triangles[i][0] = soup->triangles[i][1];
            soup->triangles[i][1] = corner;
        }
}

/* ---- a box on a ground ------------------------------------------------------------------------------------------ */

#define BOTTOM (1u << 4)
#define TOP (1u << 5)

static const KellerVec3 box_lower = {-2, -3, 0}, box_upper = {3, 2, 4};

static void add_ground(KellerSoup *soup)
{
    soup_object(soup, "ground");
    soup_quad(soup, v3(-30, -30, 0), v3(30, -30, 0), v3(30, 30, 0), v3(-30, 30, 0), CONCRETE);
}

static void add_ground_at(KellerSoup *soup, double z)
{
    soup_object(soup, "ground");
    soup_quad(soup, v3(-30, -30, z), v3(30, -30, z), v3(30, 30, z), v3(-30, 30, z), CONCRETE);
}

/* The ground as a frame around the box's foot, whose corners it has; the foot itself where `under`. */
static void add_connected_ground(KellerSoup *soup, bool under)
{
    KellerVec3 l = box_lower, u = box_upper;
    KellerVec3 inner[4] = {l, v3(u.x, l.y, 0), v3(u.x, u.y, 0), v3(l.x, u.y, 0)};
    KellerVec3 outer[4] = {v3(-30, -30, 0), v3(30, -30, 0), v3(30, 30, 0), v3(-30, 30, 0)};
    soup_object(soup, "ground");
    for (int i = 0; i < 4; i++) soup_quad(soup, outer[i], outer[(i + 1) % 4], inner[(i + 1) % 4], inner[i], CONCRETE);
    if (under) soup_quad(soup, inner[0], inner[1], inner[2], inner[3], CONCRETE);
}

static void add_box(KellerSoup *soup, KellerVec3 lower, KellerVec3 upper, uint32_t leave_out)
{
    soup_object(soup, "box");
    soup_box(soup, lower, upper, CONCRETE, leave_out);
}

static void box_on_ground(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    add_connected_ground(&soup, false);
    add_box(&soup, box_lower, box_upper, BOTTOM);
    FoundPaths model = simulate(&soup);
    assert_true(count_kind(&model, KELLER_REFLECTION) > 5);
    assert_true(count_kind(&model, KELLER_DIFFRACTION) > 5);
    assert_int_equal(count_at_foot(&model), 0);
    size_t differences = 0;

    soup = soup_new();
    add_connected_ground(&soup, true);
    add_box(&soup, box_lower, box_upper, 0);
    differences += differs(&model, soup, "connected, with a bottom and the ground below it");

    soup = soup_new();
    add_connected_ground(&soup, true);
    add_box(&soup, box_lower, box_upper, BOTTOM);
    differences += differs(&model, soup, "connected, no bottom, the ground below it");

    soup = soup_new();
    add_ground(&soup);
    add_box(&soup, box_lower, box_upper, 0);
    differences += differs(&model, soup, "touching, with a bottom");

    soup = soup_new();
    add_ground(&soup);
    add_box(&soup, box_lower, box_upper, BOTTOM);
    differences += differs(&model, soup, "touching, without a bottom");

    soup = soup_new();
    add_ground(&soup);
    add_box(&soup, v3(box_lower.x, box_lower.y, -0.01), box_upper, 0);
    differences += differs(&model, soup, "sunk by 1 cm");

    soup = soup_new();
    add_ground(&soup);
    add_box(&soup, v3(box_lower.x, box_lower.y, -0.01), box_upper, BOTTOM);
    differences += differs(&model, soup, "sunk by 1 cm, without a bottom");

    for (int variant = 0; variant < 4; variant++) {
        soup = soup_new();
        if (variant & 1)
            add_ground(&soup);
        else
            add_connected_ground(&soup, false);
        add_box(&soup, box_lower, box_upper, variant & 2 ? BOTTOM : 0);
        turn_inside_out(&soup);
        differences += differs(&model, soup, "inside out");
    }

    /* Files carry single-precision coordinates: the foot is off the ground by a rounding of 30 m. */
    for (int sign = -1; sign <= 1; sign += 2) {
        soup = soup_new();
        add_ground_at(&soup, sign * 1.9e-6);
        add_box(&soup, box_lower, box_upper, 0);
        KellerScene scene = scene_of(&soup);
        for (size_t i = 0; i < scene.wedge_count; i++) {
            KellerVec3 end = v3_madd(scene.wedges[i].origin, scene.wedges[i].direction, scene.wedges[i].length);
            bool foot =
                fabs(scene.wedges[i].origin.z) < 0.1 && fabs(end.z) < 0.1 && fabs(end.x) < 10 && fabs(end.y) < 10;
            assert_false(foot);
        }
        keller_scene_free(&scene);
        soup_release(&soup);
    }
    assert_int_equal(differences, 0);
    found_free(&model);
}

/* A wall (a single quad) that stands on the ground, against the same wall whose foot the ground's mesh has. */
static void screen_on_ground(void **state)
{
    (void)state;
    KellerVec3 a = v3(-2, 1, 0), b = v3(4, -1, 0), up = v3(0, 0, 5);
    KellerSoup soup = soup_new();
    soup_object(&soup, "ground");
    KellerVec3 o[4] = {v3(-30, -30, 0), v3(30, -30, 0), v3(30, 30, 0), v3(-30, 30, 0)};
    /* The ground cut along the line a-b, once and again from its ends to the corners. */
    soup_polygon(&soup, 3, (KellerVec3[]){o[0], o[1], b}, CONCRETE);
    soup_polygon(&soup, 3, (KellerVec3[]){o[0], b, a}, CONCRETE);
    soup_polygon(&soup, 3, (KellerVec3[]){o[1], o[2], b}, CONCRETE);
    soup_polygon(&soup, 3, (KellerVec3[]){o[2], o[3], a}, CONCRETE);
    soup_polygon(&soup, 3, (KellerVec3[]){o[2], a, b}, CONCRETE);
    soup_polygon(&soup, 3, (KellerVec3[]){o[3], o[0], a}, CONCRETE);
    soup_object(&soup, "wall");
    soup_quad(&soup, a, b, v3_add(b, up), v3_add(a, up), CONCRETE);
    FoundPaths model = simulate(&soup);
    assert_true(count_kind(&model, KELLER_DIFFRACTION) > 2);
    assert_int_equal(count_at_foot(&model), 0);
    size_t differences = 0;
    for (int sunk = 0; sunk < 2; sunk++) {
        soup = soup_new();
        add_ground(&soup);
        soup_object(&soup, "wall");
        KellerVec3 down = v3(0, 0, sunk ? -0.01 : 0);
        soup_quad(&soup, v3_add(a, down), v3_add(b, down), v3_add(b, up), v3_add(a, up), CONCRETE);
        differences += differs(&model, soup, sunk ? "a wall sunk by 1 cm" : "a wall that touches the ground");
    }
    assert_int_equal(differences, 0);
    found_free(&model);
}

/* ---- two boxes side by side ------------------------------------------------------------------------------------- */

/* Equal boxes that share a wall are one box. */
static void boxes_side_by_side(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    add_ground(&soup);
    add_box(&soup, v3(-3, -2, 0), v3(4, 2, 4), 0);
    FoundPaths model = simulate(&soup);
    assert_true(count_kind(&model, KELLER_DIFFRACTION) > 5);
    size_t differences = 0;

    soup = soup_new();
    add_ground(&soup);
    add_box(&soup, v3(-3, -2, 0), v3(1, 2, 4), 0);
    add_box(&soup, v3(1, -2, 0), v3(4, 2, 4), 0);
    differences += differs(&model, soup, "two boxes that share a wall");

    soup = soup_new();
    add_ground(&soup);
    add_box(&soup, v3(-3, -2, 0), v3(1, 2, 4), 1u << 1);
    add_box(&soup, v3(1, -2, 0), v3(4, 2, 4), 1u << 3);
    differences += differs(&model, soup, "two boxes without the wall between");

    soup = soup_new();
    add_ground(&soup);
    add_box(&soup, v3(-3, -2, 0), v3(1, 2, 4), 0);
    add_box(&soup, v3(0.99, -2, 0), v3(4, 2, 4), 0);
    differences += differs(&model, soup, "two boxes, one 1 cm in the other");

    soup = soup_new();
    add_ground(&soup);
    add_box(&soup, v3(-3, -2, 0), v3(1, 2, 4), 0);
    add_box(&soup, v3(1, -2, 0), v3(4, 2, 4), 0);
    turn_inside_out(&soup);
    differences += differs(&model, soup, "two boxes inside out");
    assert_int_equal(differences, 0);
    found_free(&model);
}

/* Boxes of different heights and fronts against one solid of the same outline, drawn as its outer polygons. */
static void boxes_of_two_heights(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    add_ground(&soup);
    soup_object(&soup, "solid");
    /* The outline seen from -y: an L lying on its side; swept along y. */
    KellerVec3 outline[] = {v3(-3, -2, 0), v3(4, -2, 0), v3(4, -2, 3), v3(1, -2, 3), v3(1, -2, 5), v3(-3, -2, 5)};
    KellerVec3 shift = v3(0, 4, 0);
    for (int i = 0; i < 6; i++) {
        KellerVec3 a = outline[i], b = outline[(i + 1) % 6];
        soup_quad(&soup, a, b, v3_add(b, shift), v3_add(a, shift), CONCRETE);
    }
    for (int side = 0; side < 2; side++) { /* the L of two quads that meet along a whole edge */
        KellerVec3 s = v3_scale(shift, side), foot = v3(1, -2, 0);
        soup_quad(&soup, v3_add(outline[0], s), v3_add(foot, s), v3_add(outline[3], s), v3_add(v3(-3, -2, 3), s),
                  CONCRETE);
        soup_quad(&soup, v3_add(v3(-3, -2, 3), s), v3_add(outline[3], s), v3_add(outline[4], s), v3_add(outline[5], s),
                  CONCRETE);
        soup_quad(&soup, v3_add(foot, s), v3_add(outline[1], s), v3_add(outline[2], s), v3_add(outline[3], s),
                  CONCRETE);
    }
    FoundPaths model = simulate(&soup);
    assert_true(count_kind(&model, KELLER_DIFFRACTION) > 5);
    size_t differences = 0;

    soup = soup_new();
    add_ground(&soup);
    add_box(&soup, v3(-3, -2, 0), v3(1, 2, 5), 0);
    add_box(&soup, v3(1, -2, 0), v3(4, 2, 3), 0);
    differences += differs(&model, soup, "flush towers of two heights");

    soup = soup_new();
    add_ground(&soup);
    add_box(&soup, v3(-3, -2, 0), v3(4, 2, 3), 0);
    add_box(&soup, v3(-3, -2, 3), v3(1, 2, 5), 0);
    differences += differs(&model, soup, "a box stacked on a longer one");

    soup = soup_new();
    add_ground(&soup);
    add_box(&soup, v3(-3, -2, 0), v3(4, 2, 3), TOP);
    add_box(&soup, v3(-3, -2, 3), v3(1, 2, 5), BOTTOM);
    soup_object(&soup, "roof");
    soup_quad(&soup, v3(1, -2, 3), v3(4, -2, 3), v3(4, 2, 3), v3(1, 2, 3), CONCRETE);
    differences += differs(&model, soup, "stacked, without what is between");
    assert_int_equal(differences, 0);
    found_free(&model);
}

/* A box that stands half on a low platform and half over its rim: an edge that lies on another face for a part of its
 * length only. Against the same box cut in two at the rim. */
static void box_over_a_rim(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    add_ground(&soup);
    add_box(&soup, v3(-6, -4, 0), v3(0, 4, 1), 0);
    add_box(&soup, v3(-3, -2, 1), v3(0, 2, 4), 0);
    add_box(&soup, v3(0, -2, 1), v3(4, 2, 4), 0);
    FoundPaths model = simulate(&soup);
    assert_true(count_kind(&model, KELLER_DIFFRACTION) > 5);
    size_t differences = 0;

    soup = soup_new();
    add_ground(&soup);
    add_box(&soup, v3(-6, -4, 0), v3(0, 4, 1), 0);
    add_box(&soup, v3(-3, -2, 1), v3(4, 2, 4), 0);
    differences += differs(&model, soup, "a box half over a rim");
    assert_int_equal(differences, 0);
    found_free(&model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(box_on_ground),      cmocka_unit_test(screen_on_ground),
        cmocka_unit_test(boxes_side_by_side), cmocka_unit_test(boxes_of_two_heights),
        cmocka_unit_test(box_over_a_rim),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
