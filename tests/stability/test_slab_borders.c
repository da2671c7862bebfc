/* Walls that let something through, met where it is delicate: on an inner edge, on a rim, at a corner, along the wall, with an
 * end on it. What is found must be the share of what is found around. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>
#include "harness.h"
#include "scenes.h"

static KellerScene finish(KellerSoup *soup)
{
    KellerScene scene = scene_of(soup);
    soup_release(soup);
    return scene;
}

static FoundPaths look(const KellerScene *scene, KellerVec3 tx, KellerVec3 rx, uint32_t transmissions)
{
    Run run = run_new(&tx, 1, &rx, 0, 0, transmissions);
    run.transmissions = transmissions;
    return run_simulation(scene, &run);
}

/* The only path with so many transmissions. */
static const Found *with(const FoundPaths *found, uint32_t count)
{
    const Found *only = NULL;
    for (size_t i = 0; i < found->count; i++)
        if (found->path[i].count == count) {
            assert_null(only);
            only = &found->path[i];
        }
    assert_non_null(only);
    return only;
}

/* Its amplitude over that of the same path a hair beside, where nothing is close to call. */
static double share(const KellerScene *scene, const Found *path, KellerVec3 tx, KellerVec3 rx, KellerVec3 beside)
{
    FoundPaths found = look(scene, v3_add(tx, beside), v3_add(rx, beside), 8);
    assert_int_equal(found.count, 1);
    assert_int_equal(found.path[0].count, path->count);
    double ratio = cabs(path->gain[0]) / cabs(found.path[0].gain[0]);
    found_free(&found);
    return ratio;
}

static bool near(double a, double b) { return fabs(a - b) < 1e-4; }

/* Through the diagonal of a wall, through the vertex in its middle, and through that of a wall cut at random: one
 * transmission, whole. */
static void inner_edges(void **state)
{
    (void)state;
    for (int cut = 0; cut < 3; cut++) {
        KellerSoup soup = soup_new();
        soup_object(&soup, "wall");
        Random random = random_seeded(7);
        if (cut == 1) {
            KellerVec3 ring[4] = {v3(0, -4, -4), v3(0, 4, -4), v3(0, 4, 4), v3(0, -4, 4)};
            uint32_t middle = soup_vertex(&soup, v3(0, 0, 0)), first = middle + 1;
            for (int i = 0; i < 4; i++) soup_vertex(&soup, ring[i]);
            for (uint32_t i = 0; i < 4; i++) soup_triangle(&soup, middle, first + i, first + (i + 1) % 4, PARTITION);
        } else {
            soup_quad(&soup, v3(0, -4, -4), v3(0, 4, -4), v3(0, 4, 4), v3(0, -4, 4), PARTITION);
        }
        if (cut == 2) soup_refine(&soup, &random);
        KellerVec3 at = cut < 2 ? v3(0, 0, 0) : soup.vertices[4]; /* behind the corners: inside the first triangle */
        KellerScene scene = finish(&soup);
        const KellerVec3 ways[] = {{3, 0, 0}, {3, 1, 2}, {3, -2, 0.5}, {0.01, 1, -1}};
        for (size_t i = 0; i < sizeof ways / sizeof *ways; i++)
            for (int there = 1; there >= -1; there -= 2) {
                KellerVec3 tx = v3_madd(at, ways[i], -there), rx = v3_madd(at, ways[i], 0.75 * there);
                FoundPaths found = look(&scene, tx, rx, 8);
                assert_int_equal(found.count, 1);
                const Found *p = with(&found, 1);
                assert_true(v3_distance(p->position[0], at) < 1e-12);
                assert_true(near(share(&scene, p, tx, rx, v3(0, 1e-4, 2.3e-4)), 1));
                found_free(&found);
            }
        keller_scene_free(&scene);
    }
}

/* Over the rim of a screen: one half goes by, one half goes through. */
static void rim(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "screen");
    soup_quad(&soup, v3(0, -4, -4), v3(0, 4, -4), v3(0, 4, 2), v3(0, -4, 2), GLASS);
    KellerScene scene = finish(&soup);
    KellerVec3 tx = v3(-3, 0.3, 1), rx = v3(6, 1.1, 4);
    FoundPaths found = look(&scene, tx, rx, 8), none = look(&scene, tx, rx, 0);
    assert_int_equal(found.count, 2);
    assert_true(near(share(&scene, with(&found, 0), tx, rx, v3(0, 0, 1e-5)), 0.5));
    assert_true(near(share(&scene, with(&found, 1), tx, rx, v3(0, 0, -1e-5)), 0.5));
    assert_int_equal(none.count, 1); /* and without transmissions that half alone, as ever */
    assert_memory_equal(none.path[0].gain, with(&found, 0)->gain, sizeof none.path[0].gain);
    found_free(&found);
    found_free(&none);
    keller_scene_free(&scene);
}

/* Past the upright edge of a room with thin walls: by it, or in through one wall and out through the next. */
static void corner(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "room");
    soup_box(&soup, v3(0, 0, 0), v3(4, 3, 3), PARTITION, 0);
    KellerScene scene = finish(&soup);
    KellerVec3 tx = v3(-2, 2, 1), rx = v3(1, -1, 1.5); /* through (0, 0, 4/3) */
    FoundPaths found = look(&scene, tx, rx, 8);
    assert_int_equal(found.count, 2);
    assert_true(near(share(&scene, with(&found, 0), tx, rx, v3(-1e-5, -1e-5, 0)), 0.5));
    assert_true(near(share(&scene, with(&found, 2), tx, rx, v3(1e-5, 1e-5, 0)), 0.5));
    found_free(&found);
    /* From inside, out through the edge: through one wall or the other. */
    rx = v3(2, 1, 1);
    tx = v3(-2, -1, 2);
    found = look(&scene, tx, rx, 8);
    assert_int_equal(found.count, 2);
    for (size_t i = 0; i < 2; i++) {
        assert_int_equal(found.path[i].count, 1);
        assert_true(v3_distance(found.path[i].position[0], v3(0, 0, 1.5)) < 1e-12);
    }
    assert_true(found.path[0].step[0].id != found.path[1].step[0].id);
    found_free(&found);
    keller_scene_free(&scene);
}

/* Where a pane and a wall meet in one plane, half of each; where a pane lies on the wall, both. */
static void panes(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "wall");
    soup_quad(&soup, v3(0, -4, -4), v3(0, 0, -4), v3(0, 0, 4), v3(0, -4, 4), PARTITION);
    soup_quad(&soup, v3(0, 0, -4), v3(0, 4, -4), v3(0, 4, 4), v3(0, 0, 4), GLASS);
    soup_quad(&soup, v3(0, 1, -1), v3(0, 3, -1), v3(0, 3, 1), v3(0, 1, 1), PARTITION);
    KellerScene scene = finish(&soup);
    KellerVec3 tx = v3(-3, -1, 0.3), rx = v3(3, 1, 0.5);
    FoundPaths found = look(&scene, tx, rx, 8);
    assert_int_equal(found.count, 2);
    for (size_t i = 0; i < 2; i++) {
        bool glass = strcmp(scene.materials[scene.faces[found.path[i].step[0].id].material].name, "pane") == 0;
        assert_true(near(share(&scene, &found.path[i], tx, rx, v3(0, glass ? 1e-5 : -1e-5, 0)), 0.5));
    }
    found_free(&found);
    KellerVec3 aside = v3(0, 2, 0);
    for (int there = 0; there < 2; there++) {
        KellerVec3 a = v3_add(there ? tx : rx, aside), b = v3_add(there ? rx : tx, aside);
        found = look(&scene, a, b, 8);
        assert_int_equal(found.count, 1);
        assert_int_equal(found.path[0].count, 2);
        assert_memory_equal(&found.path[0].position[0], &found.path[0].position[1], sizeof(KellerVec3));
        /* exchanged, in exchanged order */
        assert_true((found.path[0].step[0].id < found.path[0].step[1].id) == (there != 0));
        found_free(&found);
        found = look(&scene, a, b, 1);
        assert_int_equal(found.count, 0);
        found_free(&found);
    }
    keller_scene_free(&scene);
}

/* In the plane of a wall the wave is not in it; with an end on a wall, that wall is at its back. */
static void along_and_on(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "walls");
    soup_quad(&soup, v3(0, -4, -4), v3(0, 4, -4), v3(0, 4, 4), v3(0, -4, 4), PARTITION);
    soup_quad(&soup, v3(2, -4, -4), v3(2, 4, -4), v3(2, 4, 4), v3(2, -4, 4), GLASS);
    KellerScene scene = finish(&soup);
    const struct {
        KellerVec3 a, b;
        uint32_t walls;
    } cases[] = {
        {{0, -6, 0.1}, {0, 6, 0.3}, 0},   {{0, -1, 0.1}, {0, 3, 0.3}, 0},   {{0, 0.5, 0.1}, {-1, 0.2, 0}, 0},
        {{0, 0.5, 0.1}, {1, 0.2, 0}, 0},  {{0, 0.5, 0.1}, {2, 0.2, 0}, 0},  {{0, 0.5, 0.1}, {3, 0.2, 0}, 1},
        {{-1, 0.5, 0.1}, {2, 0.2, 0}, 1}, {{-1, 0.5, 0.1}, {3, 0.2, 0}, 2}, {{0, 0.5, 0.1}, {1e-3, 3, 0}, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        for (int back = 0; back < 2; back++) {
            FoundPaths found = look(&scene, back ? cases[i].b : cases[i].a, back ? cases[i].a : cases[i].b, 8);
            assert_int_equal(found.count, 1);
            assert_int_equal(found.path[0].count, cases[i].walls);
            found_free(&found);
        }
    keller_scene_free(&scene);
}

/* An end on a wall, seen through the inner edge of another: what is close to call there says nothing of the reflection in the
 * wall that the station is on. */
static void on_a_wall_through_an_edge(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "walls");
    soup_quad(&soup, v3(0, -4, -4), v3(0, 4, -4), v3(0, 4, 4), v3(0, -4, 4), PARTITION);
    soup_quad(&soup, v3(2, -5, -4), v3(2, 4, -4), v3(2, 4, 4), v3(2, -5, 4), GLASS);
    KellerScene scene = finish(&soup);
    KellerVec3 tx = v3(-4, 0, 0), rx = v3(2, 0, 0); /* through the middle of the first, where its diagonal is */
    for (int back = 0; back < 2; back++) {
        double complex total[2];
        for (int i = 0; i < 2; i++) {
            KellerVec3 b = i ? v3_add(rx, v3(-1e-6, 3e-4, 0)) : rx;
            Run run = run_new(back ? &b : &tx, 1, back ? &tx : &b, 1, 0, 2);
            run.transmissions = 1;
            FoundPaths found = run_simulation(&scene, &run);
            assert_int_equal(found.count, 2);
            for (size_t k = 0; k < 2; k++) assert_true(found.path[k].count == k + 1 && fabs(found.path[k].length - 6) < 1e-5);
            total[i] = found_total(&found, 0, 0);
            found_free(&found);
        }
        assert_true(cabs(total[0] - total[1]) < 1e-3 * cabs(total[1]));
    }
    keller_scene_free(&scene);
}

/* Half-spaces and conductors let nothing through, one among slabs is enough. */
static void opaque(void **state)
{
    (void)state;
    const uint32_t materials[] = {CONCRETE, CONDUCTOR, DRY_GROUND, GLASS};
    for (int m = 0; m < 4; m++) {
        KellerSoup soup = soup_new();
        soup_object(&soup, "walls");
        for (int i = 0; i < 3; i++) {
            double x = i;
            soup_quad(&soup, v3(x, -4, -4), v3(x, 4, -4), v3(x, 4, 4), v3(x, -4, 4), i == 1 ? materials[m] : GLASS);
        }
        KellerScene scene = finish(&soup);
        FoundPaths found = look(&scene, v3(-1, 0.2, 0.5), v3(3, 0.4, -0.1), 8);
        assert_int_equal(found.count, m == 3);
        found_free(&found);
        keller_scene_free(&scene);
    }
}

/* A run with transmissions finds what a run without finds, to the last bit, and more; and exchanged, the same gains. */
static void more_of_the_same(void **state)
{
    (void)state;
    size_t more = 0;
    for (uint64_t seed = 1; seed <= 40; seed++) {
        RandomScene world = scene_random(seed, SCENE_THIN);
        KellerScene scene = scene_of(&world.soup);
        Run run = run_new(&world.tx, 1, world.rx, 1, 1, 2);
        FoundPaths without = run_simulation(&scene, &run);
        run.transmissions = 3;
        run.interactions = 5;
        FoundPaths found = run_simulation(&scene, &run);
        Run exchanged = run;
        exchanged.tx = world.rx;
        exchanged.rx = &world.tx;
        FoundPaths back = run_simulation(&scene, &exchanged);
        size_t j = 0;
        for (size_t i = 0; i < found.count; i++) {
            const Found *p = &found.path[i];
            bool walls = false;
            for (uint32_t k = 0; k < p->count; k++) walls = walls || p->step[k].kind == KELLER_TRANSMISSION;
            more += walls;
            if (!walls) {
                assert_true(j < without.count);
                assert_memory_equal(p, &without.path[j++], sizeof *p);
            }
            size_t matches = 0;
            for (size_t b = 0; b < back.count; b++) {
                const Found *q = &back.path[b];
                bool same = p->count == q->count;
                for (uint32_t k = 0; same && k < p->count; k++)
                    same = p->step[k].kind == q->step[p->count - 1 - k].kind && p->step[k].id == q->step[p->count - 1 - k].id;
                if (!same) continue;
                matches++;
                assert_true(fabs(cabs(q->gain[0]) - cabs(p->gain[0])) <= 1e-12 * cabs(p->gain[0]) + 1e-18);
            }
            assert_int_equal(matches, 1);
        }
        assert_int_equal(j, without.count);
        assert_int_equal(back.count, found.count);
        found_free(&without);
        found_free(&found);
        found_free(&back);
        keller_scene_free(&scene);
        soup_release(&world.soup);
    }
    assert_true(more > 200);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(inner_edges),
        cmocka_unit_test(rim),
        cmocka_unit_test(corner),
        cmocka_unit_test(panes),
        cmocka_unit_test(along_and_on),
        cmocka_unit_test(on_a_wall_through_an_edge),
        cmocka_unit_test(opaque),
        cmocka_unit_test(more_of_the_same),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
