/* What must not change a result: the cones' aperture, the number of threads, the order and the cutting of triangles,
 * the direction of the path, the place of the scene. On random scenes that hold boxes, screens and prisms, some
 * touching: first of solids that let nothing through, then of thin walls and with transmissions. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "../cases.h"
#include "harness.h"
#include "scenes.h"

#define DEGREE 0.017453292519943295

/* Positions: the same up to roundings. Random paths are never this near to each other. */
#define SAME_PLACE 1e-6
/* SPEC 1: gains agree to 1e-9 relative; here relative to the norm of the path's transfer matrix. */
#define SAME_GAIN 1e-9

static void assert_same(const FoundPaths *a, const FoundPaths *b, const char *what, uint64_t seed, bool reversed,
                        PointMap map, double gain)
{
    for (uint32_t rx = 0; rx < SCENE_RECEIVERS; rx++) {
        PathDifference d = paths_compare(a, rx, b, rx, SAME_PLACE, reversed, map, true);
        if (d.only_a || d.only_b || !(d.gain_error <= gain))
            printf("# %s, seed %llu, receiver %u: %zu the same, %zu and %zu more, gains differ by %.3g\n", what,
                   (unsigned long long)seed, rx, d.matched, d.only_a, d.only_b, d.gain_error);
        assert_int_equal(d.only_a + d.only_b, 0);
        assert_true(d.gain_error <= gain);
    }
}

/* Each test runs with solids that let nothing through and one diffraction at most, with thin walls, with several
 * diffractions. */
typedef enum { SOLID, THIN, SEVERAL } Kind;

static Kind kind_of(void **state) { return *state ? *(const Kind *)*state : SOLID; }

/* The last seed, so that there are `all` scenes, or a part; several diffractions take longer: fewer. */
static uint64_t last_of(void **state, uint64_t first, uint64_t all)
{
    return first - 1 + (kind_of(state) == SEVERAL ? cases_scenes(3, 2) : cases_scenes(all, 3));
}

static RandomScene world_of(void **state, uint64_t seed, uint32_t flags)
{
    static const uint32_t more[] = {0, SCENE_THIN, SCENE_SMALL | SCENE_THIN};
    return scene_random(seed, flags | more[kind_of(state)]);
}

static Run run_of(void **state, const KellerVec3 *tx, size_t rx_count, const KellerVec3 *rx, uint32_t interactions)
{
    Kind kind = kind_of(state);
    Run run = run_new(tx, rx_count, rx, 2, kind == SEVERAL ? 3 : 1, interactions);
    if (kind != SOLID) {
        run.transmissions = 2;
        run.interactions++;
    }
    if (kind == SEVERAL && interactions > 2) run.reflections = 1;
    return run;
}

static FoundPaths simulate(const KellerSoup *soup, const Run *run)
{
    KellerScene scene = scene_of(soup);
    FoundPaths found = run_simulation(&scene, run);
    keller_scene_free(&scene);
    return found;
}

static void cone_aperture(void **state)
{
    for (uint64_t seed = 1001; seed <= last_of(state, 1001, 6); seed++) {
        RandomScene world = world_of(state, seed, 0);
        FoundPaths found[2][3];
        for (int grid = 0; grid < 2; grid++) {
            const double cones[] = {8, 2, 0.5}; /* half-angles: apertures of 16, 4 and 1 degrees */
            for (int i = 0; i < 3; i++) {
                Run run = run_of(state, &world.tx, SCENE_RECEIVERS, world.rx, 2);
                run.cone = cones[i] * DEGREE;
                run.split_over = 4; /* left alone, the search splits no cones in scenes as small as these */
                run.grid_step = grid ? world.step : 0;
                found[grid][i] = simulate(&world.soup, &run);
            }
        }
        assert_true(found[0][0].count > 2);
        for (int i = 1; i < 6; i++)
            assert_same(&found[0][0], &found[i / 3][i % 3], "cone aperture", seed, false, NULL, 1e-12);
        for (int i = 0; i < 6; i++) found_free(&found[i / 3][i % 3]);
        soup_release(&world.soup);
    }
}

static void accelerators(void **state)
{
    static const char *const names[] = {"bvh8", "bvh", "kdtree", "bvh+mask", "bvh8+mask", "ubvh", "dacrt"};
    enum { NAMES = sizeof names / sizeof *names };
    for (uint64_t seed = 1041; seed <= last_of(state, 1041, 6); seed++) {
        RandomScene world = world_of(state, seed, 0);
        FoundPaths found[NAMES];
        for (int i = 0; i < NAMES; i++) {
            Run run = run_of(state, &world.tx, SCENE_RECEIVERS, world.rx, 3);
            run.accelerator = names[i];
            found[i] = simulate(&world.soup, &run);
        }
        for (int i = 1; i < NAMES; i++) assert_same(&found[0], &found[i], names[i], seed, false, NULL, 1e-12);
        for (int i = 0; i < NAMES; i++) found_free(&found[i]);
        soup_release(&world.soup);
    }
}

static void threads(void **state)
{
    for (uint64_t seed = 1011; seed <= last_of(state, 1011, 10); seed++) {
        RandomScene world = world_of(state, seed, 0);
        for (int grid = 0; grid < 2; grid++) {
            Run run = run_of(state, &world.tx, SCENE_RECEIVERS, world.rx, 3);
            run.grid_step = grid ? world.step : 0;
            FoundPaths one = simulate(&world.soup, &run);
            run.threads = 2;
            FoundPaths two = simulate(&world.soup, &run);
            assert_int_equal(one.count, two.count);
            for (size_t i = 0; i < one.count; i++) {
                const Found *a = &one.path[i], *b = &two.path[i];
                assert_true(a->tx == b->tx && a->rx == b->rx && a->count == b->count);
                for (uint32_t k = 0; k < a->count; k++)
                    assert_true(a->step[k].kind == b->step[k].kind && a->step[k].id == b->step[k].id &&
                                a->triangle[k] == b->triangle[k]);
                assert_memory_equal(a->position, b->position, sizeof a->position);
                assert_memory_equal(&a->length, &b->length, sizeof a->length);
                assert_memory_equal(a->departure, b->departure, sizeof a->departure);
                assert_memory_equal(a->arrival, b->arrival, sizeof a->arrival);
                assert_memory_equal(a->gain, b->gain, sizeof a->gain);
                assert_memory_equal(a->transfer, b->transfer, sizeof a->transfer);
            }
            assert_int_equal(one.coverage_count, two.coverage_count);
            assert_memory_equal(one.coverage, two.coverage, sizeof one.coverage);
            found_free(&one);
            found_free(&two);
        }
        soup_release(&world.soup);
    }
}

/* SPEC 4: by transmitter, receiver, delay. */
static void order_of_paths(void **state)
{
    RandomScene world = world_of(state, 1021, 0);
    KellerVec3 tx[2] = {world.tx, v3_add(world.tx, v3(0.01, 0.02, 0.03))};
    Run run = run_of(state, tx, SCENE_RECEIVERS, world.rx, 2);
    run.tx_count = 2;
    FoundPaths found = simulate(&world.soup, &run);
    assert_true(found.count > 4);
    for (size_t i = 1; i < found.count; i++) {
        const Found *a = &found.path[i - 1], *b = &found.path[i];
        bool ordered = a->tx != b->tx ? a->tx < b->tx : a->rx != b->rx ? a->rx < b->rx : a->delay <= b->delay;
        assert_true(ordered);
    }
    found_free(&found);
    soup_release(&world.soup);
}

static void shuffled(void **state)
{
    for (uint64_t seed = 1031; seed <= last_of(state, 1031, 15); seed++) {
        RandomScene world = world_of(state, seed, 0);
        Random random = random_seeded(seed);
        Run run = run_of(state, &world.tx, SCENE_RECEIVERS, world.rx, 3);
        FoundPaths before = simulate(&world.soup, &run);
        soup_shuffle(&world.soup, &random);
        FoundPaths after = simulate(&world.soup, &run);
        assert_same(&before, &after, "shuffled", seed, false, NULL, SAME_GAIN);
        found_free(&before);
        found_free(&after);
        soup_release(&world.soup);
    }
}

static void refined(void **state)
{
    for (uint64_t seed = 1051; seed <= last_of(state, 1051, 15); seed++) {
        RandomScene world = world_of(state, seed, 0);
        Random random = random_seeded(seed);
        Run run = run_of(state, &world.tx, SCENE_RECEIVERS, world.rx, 3);
        FoundPaths before = simulate(&world.soup, &run);
        soup_refine(&world.soup, &random);
        FoundPaths after = simulate(&world.soup, &run);
        assert_same(&before, &after, "refined", seed, false, NULL, SAME_GAIN);
        found_free(&after);
        soup_refine(&world.soup, &random);
        soup_shuffle(&world.soup, &random);
        run.reflections = 1;
        run.interactions = 2;
        after = simulate(&world.soup, &run);
        found_free(&before);
        soup_release(&world.soup);
        world = world_of(state, seed, 0);
        before = simulate(&world.soup, &run);
        assert_same(&before, &after, "refined twice and shuffled", seed, false, NULL, SAME_GAIN);
        found_free(&before);
        found_free(&after);
        soup_release(&world.soup);
    }
}

/* Transmitter and receiver exchanged: reversed sequences, transposed transfer matrices. The transfer is measured
 * with the arrival direction pointing back along the ray, so both ends' bases are those of the exchanged path. */
static void reciprocity(void **state)
{
    for (uint64_t seed = 1071; seed <= last_of(state, 1071, 20); seed++) {
        RandomScene world = world_of(state, seed, 0);
        soup_material(&world.soup, seed % 2 ? CONCRETE : CONDUCTOR);
        for (int h = 0; h < 2; h++)
            for (uint32_t rx = 0; rx < SCENE_RECEIVERS; rx++) {
                Run run = run_of(state, &world.tx, 1, &world.rx[rx], 3);
                run.antenna.polarization = h ? KELLER_POLARIZATION_H : KELLER_POLARIZATION_V;
                FoundPaths there = simulate(&world.soup, &run);
                run.tx = &world.rx[rx];
                run.rx = &world.tx;
                FoundPaths back = simulate(&world.soup, &run);
                assert_same(&there, &back, "exchanged", seed, true, NULL, SAME_GAIN);
                found_free(&there);
                found_free(&back);
            }
        soup_release(&world.soup);
    }
}

/* Exact in double precision for coordinates that are multiples of 2^-20 m: what is left are the roundings of the
 * solver, which grow with the coordinates (2^-53 of 10 km is 1e-12 m, and at 1.2 GHz k = 25/m). */
static KellerVec3 shifted(KellerVec3 p) { return v3(p.x + 8192, p.y - 4096, p.z + 512); }

static KellerVec3 turned(KellerVec3 p) { return v3(-p.y, p.x, p.z); }

static void moved(void **state)
{
    const PointMap maps[] = {shifted, turned};
    const char *const names[] = {"shifted by 9 km", "turned by 90 degrees"};
    for (uint64_t seed = 1101; seed <= last_of(state, 1101, 15); seed++)
        for (int m = 0; m < 2; m++) {
            RandomScene world = world_of(state, seed, SCENE_UPRIGHT);
            Run run = run_of(state, &world.tx, SCENE_RECEIVERS, world.rx, 3);
            run.frequency[0] = 1.2e9;
            FoundPaths before = simulate(&world.soup, &run);
            for (size_t i = 0; i < world.soup.vertex_count; i++)
                world.soup.vertices[i] = maps[m](world.soup.vertices[i]);
            world.tx = maps[m](world.tx);
            for (int i = 0; i < SCENE_RECEIVERS; i++) world.rx[i] = maps[m](world.rx[i]);
            FoundPaths after = simulate(&world.soup, &run);
            assert_same(&before, &after, names[m], seed, false, maps[m], SAME_GAIN);
            found_free(&before);
            found_free(&after);
            soup_release(&world.soup);
        }
}

int main(void)
{
    static Kind thin = THIN, several = SEVERAL;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cone_aperture),
        cmocka_unit_test(accelerators),
        cmocka_unit_test(threads),
        cmocka_unit_test(order_of_paths),
        cmocka_unit_test(shuffled),
        cmocka_unit_test(refined),
        cmocka_unit_test(reciprocity),
        cmocka_unit_test(moved),
        {"cone_aperture_thin", cone_aperture, NULL, NULL, &thin},
        {"accelerators_thin", accelerators, NULL, NULL, &thin},
        {"threads_thin", threads, NULL, NULL, &thin},
        {"order_of_paths_thin", order_of_paths, NULL, NULL, &thin},
        {"shuffled_thin", shuffled, NULL, NULL, &thin},
        {"refined_thin", refined, NULL, NULL, &thin},
        {"reciprocity_thin", reciprocity, NULL, NULL, &thin},
        {"moved_thin", moved, NULL, NULL, &thin},
        {"cone_aperture_several", cone_aperture, NULL, NULL, &several},
        {"accelerators_several", accelerators, NULL, NULL, &several},
        {"threads_several", threads, NULL, NULL, &several},
        {"shuffled_several", shuffled, NULL, NULL, &several},
        {"refined_several", refined, NULL, NULL, &several},
        {"reciprocity_several", reciprocity, NULL, NULL, &several},
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
