/* Maps over terrain are searched like flat ones, from the transmitter alone, cell blocks by their heights: they must find what points at
 * the same places find, bit for bit. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <stdlib.h>
#include <cmocka.h>
#include "harness.h"
#include "keller/drape.h"
#include "scenes.h"
#include "../unit/real_scene.h"

enum { QUADS = 4, LONG = 18, SHORT = 5, CELLS = LONG * SHORT }; /* the search looks at blocks of 16 x 16 cells */

/* Rough ground over (0, 0) to (8, 8) m, with a hole where `holes`, and a box and a screen that stand in it. */
static KellerSoup random_terrain(Random *random, bool holes)
{
    const double side = 2, relief = random_range(random, 0.2, 4);
    KellerSoup soup = soup_new();
    soup_object(&soup, "terrain");
    uint32_t first = 0, hole = random_below(random, QUADS * QUADS);
    for (uint32_t j = 0; j <= QUADS; j++)
        for (uint32_t i = 0; i <= QUADS; i++) {
            uint32_t v = soup_vertex(&soup, v3(side * i, side * j, random_range(random, 0, relief)));
            if (i == 0 && j == 0) first = v;
        }
    for (uint32_t j = 0; j < QUADS; j++)
        for (uint32_t i = 0; i < QUADS; i++) {
            uint32_t a = first + j * (QUADS + 1) + i;
            if (holes && j * QUADS + i == hole) continue;
            soup_triangle(&soup, a, a + 1, a + QUADS + 2, DRY_GROUND);
            soup_triangle(&soup, a, a + QUADS + 2, a + QUADS + 1, random_below(random, 2) ? DRY_GROUND : CONCRETE);
        }
    double x = random_range(random, 1, 5), y = random_range(random, 1, 5);
    soup_object(&soup, "box");
    soup_box(&soup, v3(x, y, -1), v3(x + 1.5, y + 1, relief + random_range(random, 0.5, 3)), CONCRETE, 1 << 4);
    soup_object(&soup, "screen");
    soup_quad(&soup, v3(7, 1, -1), v3(7.2, 6, -1), v3(7.2, 6, relief + 2), v3(7, 1, relief + 1), CONDUCTOR);
    return soup;
}

/* The places of the cells, over the object of that name or, where it is NULL, over all there is. Returns how many are nowhere. */
static uint32_t places(const KellerScene *scene, uint32_t columns, double x, double y, double step, double height, const char *over,
                       KellerVec3 *rx)
{
    KellerReceiver *cells = calloc(CELLS, sizeof *cells);
    assert_non_null(cells);
    KellerSurfaceName name = {.name = (char *)(uintptr_t)over, .is_object = true};
    KellerReceiverSet set = {.kind = KELLER_SET_GRID, .ny = CELLS / columns, .nx = columns, .count = CELLS, .x0 = x, .y0 = y,
                             .step = step, .draped = true, .height = height, .surface_count = over != NULL, .surfaces = &name};
    KellerConfig config = {.file = (char[]){""}, .set_count = 1, .sets = &set, .receiver_count = CELLS, .receivers = cells};
    for (uint32_t i = 0; i < CELLS; i++) cells[i].station.position = v3(x + (i % columns) * step, y + (i / columns) * step, NAN);
    KellerError error = {0};
    if (keller_config_drape(&config, scene, &error) != KELLER_OK) fail_msg("%s", error.message);
    for (uint32_t i = 0; i < CELLS; i++) rx[i] = cells[i].station.position;
    free(cells);
    return set.nowhere;
}

/* The map as it is, and where `large` as a large one: beams are split, the map is cut. Returns the number of paths. */
static size_t map_against_points(const KellerScene *scene, KellerVec3 tx, const KellerVec3 *rx, uint32_t columns, double step,
                                 uint32_t reflections, bool large)
{
    Run run = run_new(&tx, CELLS, rx, reflections, 1, 2);
    run.threads = 2;
    FoundPaths points = run_simulation(scene, &run);
    run.grid_step = step;
    run.grid_rows = CELLS / columns;
    for (uint32_t pass = 0; pass < (large ? 2 : 1); pass++) {
        run.split_over = 4 * pass;
        FoundPaths grid = run_simulation(scene, &run);
        assert_true(found_same(&points, &grid, run.frequency_count));
        assert_true(grid.progress == 1 && !grid.went_back && grid.reports > 20);
        found_free(&grid);
    }
    size_t count = points.count;
    found_free(&points);
    return count;
}

static void random_terrains(void **state)
{
    (void)state;
    size_t paths = 0, nowhere = 0;
    for (uint64_t seed = 1; seed <= 4; seed++) {
        Random random = random_seeded(4200 + seed);
        KellerSoup soup = random_terrain(&random, seed % 2);
        KellerScene scene = scene_of(&soup);
        KellerVec3 rx[CELLS], tx;
        tx.x = random_range(&random, 0, 8);
        tx.y = random_range(&random, 0, 8);
        tx.z = random_range(&random, 1, 9);
        const bool wide = seed % 2;
        const double step = seed % 4 < 2 ? 0.5 : random_range(&random, 0.3, 0.5), aside = 2 * random_below(&random, 3);
        const char *terrain = scene.objects[2]; /* after box and screen */
        assert_true(terrain[0] == 't');
        nowhere += places(&scene, wide ? LONG : SHORT, wide ? -0.5 : aside, wide ? aside : -0.5, step, 0.3, seed % 3 ? terrain : NULL, rx);
        paths += map_against_points(&scene, tx, rx, wide ? LONG : SHORT, step, 1, !wide);
        keller_scene_free(&scene);
        soup_release(&soup);
    }
    print_message("# %zu paths; %zu cells nowhere\n", paths, nowhere);
    assert_true(paths > 7000 && nowhere > 10);
}

/* Streets and roofs, 20 m apart within a block. */
static void over_the_roofs(void **state)
{
    (void)state;
    KellerSoup soup = real_scene("sionna/simple_street_canyon/simple_street_canyon.xml");
    KellerScene scene = scene_of(&soup);
    KellerVec3 rx[CELLS];
    keller_soup_free(&soup);
    assert_int_equal(places(&scene, LONG, -70.3, -15.1, 7.7, 1.5, NULL, rx), 0);
    double low = INFINITY, high = -INFINITY;
    for (uint32_t i = 0; i < CELLS; i++) low = fmin(low, rx[i].z), high = fmax(high, rx[i].z);
    assert_true(high > low + 15);
    assert_true(map_against_points(&scene, v3(-22, 0, 40), rx, LONG, 7.7, 2, false) > 1000);
    keller_scene_free(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_terrains),
        cmocka_unit_test(over_the_roofs),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
