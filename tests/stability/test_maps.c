/* Grids are searched from the transmitter alone, points from both ends: both must find the same. And the real
 * city: the aperture of the cones, and the threads, change nothing. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "../cases.h"
#include "harness.h"
#include "../unit/real_scene.h"
#include "scenes.h"

static KellerScene read_scene(const char *name)
{
    KellerSoup soup = real_scene(name);
    KellerScene scene = scene_of(&soup);
    keller_soup_free(&soup);
    return scene;
}

enum { ROWS = 10, COLUMNS = 11 };

static void grid_against_points(const KellerScene *scene, KellerVec3 tx, KellerVec3 corner, double step, uint32_t reflections,
                                uint32_t diffractions, uint32_t transmissions, uint32_t interactions, uint32_t large, size_t *paths)
{
    KellerVec3 rx[ROWS * COLUMNS];
    for (int j = 0; j < ROWS; j++)
        for (int i = 0; i < COLUMNS; i++) rx[j * COLUMNS + i] = v3_add(corner, v3(i * step, j * step, 0));
    Run run = run_new(&tx, ROWS * COLUMNS, rx, reflections, diffractions, interactions);
    run.transmissions = transmissions;
    run.threads = 2;
    FoundPaths points = run_simulation(scene, &run);
    run.grid_step = step;
    run.grid_rows = ROWS;
    for (uint32_t pass = 0; pass < (large ? 2 : 1); pass++) { /* as it is; and with all that only large maps do: beams are split, the map is cut */
        run.split_over = pass * large;
        FoundPaths grid = run_simulation(scene, &run);
        assert_true(found_same(&points, &grid, run.frequency_count));
        found_free(&grid);
    }
    *paths += points.count;
    found_free(&points);
}

/* What to split beams over, and with it how finely the map is cut: down to single cells, which takes a search for each, in some of the scenes. */
static uint32_t large_at(uint64_t seed) { return seed % 3 != 1 ? 0 : seed % 18 == 1 ? 4 : 16; }

static void random_scenes(void **state)
{
    (void)state;
    size_t paths = 0;
    const uint64_t scenes = cases_scenes(30, 18);
    for (uint64_t seed = 9000; seed < 9000 + scenes; seed++) {
        RandomScene world = scene_random(seed, 0);
        KellerScene scene = scene_of(&world.soup);
        double step = 0.05 + 0.11 * (double)(seed % 7);
        uint32_t interactions = seed % 3 == 0 ? 3 : 2;
        grid_against_points(&scene, world.tx, world.rx[0], step, 2, 1, 0, interactions, large_at(seed), &paths);
        keller_scene_free(&scene);
        soup_release(&world.soup);
    }
    print_message("# %zu paths\n", paths);
    assert_true(paths > 300 * scenes);
}

/* The cells of a map lie on both sides of walls. */
static void thin_walls(void **state)
{
    (void)state;
    size_t paths = 0;
    for (uint64_t seed = 9100; seed < 9112; seed++) {
        RandomScene world = scene_random(seed, SCENE_THIN);
        KellerScene scene = scene_of(&world.soup);
        grid_against_points(&scene, world.tx, world.rx[0], 0.05 + 0.11 * (double)(seed % 7), 1, 1, 2, 4, large_at(seed), &paths);
        keller_scene_free(&scene);
        soup_release(&world.soup);
    }
    print_message("# %zu paths\n", paths);
    assert_true(paths > 10000);
}

static void street_canyon(void **state)
{
    (void)state;
    KellerScene scene = read_scene("sionna/simple_street_canyon/simple_street_canyon.xml");
    size_t paths = 0;
    grid_against_points(&scene, v3(-22, 0, 10), v3(-5.3, -7.1, 1.5), 1.37, 3, 1, 0, 3, 0, &paths);
    grid_against_points(&scene, v3(-22, 0, 30), v3(10.3, -9.1, 1.5), 4.57, 2, 1, 0, 2, 0, &paths);
    assert_true(paths > 2000);
    keller_scene_free(&scene);
}

static void munich_apertures(void **state)
{
    (void)state;
    KellerScene scene = read_scene("sionna/munich/munich.xml");
    KellerVec3 tx = v3(8.5, 21, 27), rx = v3(45, 90, 1.5);
    const uint32_t most = (uint32_t)cases_scenes(3, 2);
    Run run = run_new(&tx, 1, &rx, most, 1, most);
    run.cone = 2 * M_PI / 180;
    run.threads = 1;
    FoundPaths wide = run_simulation(&scene, &run);
    run.cone = 0.5 * M_PI / 180;
    run.threads = 2;
    FoundPaths narrow = run_simulation(&scene, &run);
    print_message("# %zu paths\n", wide.count);
    assert_true(found_same(&wide, &narrow, run.frequency_count));
    assert_true(wide.count > (most == 3 ? 300 : 100));
    found_free(&wide);
    found_free(&narrow);
    keller_scene_free(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_scenes),
        cmocka_unit_test(thin_walls),
        cmocka_unit_test(street_canyon),
        cmocka_unit_test(munich_apertures),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
