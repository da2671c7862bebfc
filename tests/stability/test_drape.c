/* The heights of draped grids: against planes, and against every triangle tried in long double; borders, cracks, holes, names. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "harness.h"
#include "keller/drape.h"
#include "scenes.h"

enum { COLUMNS = 41, ROWS = 33, CELLS = COLUMNS * ROWS };

static const double height = 1.5; /* m */

typedef struct {
    KellerConfig config;
    KellerReceiverSet set;
    KellerSurfaceName surface;
    KellerReceiver cells[CELLS];
} Draped;

/* Cells from the corner on, over all, or over what has this name. */
static Draped *draped_new(double x, double y, double step, const char *name, bool object)
{
    Draped *d = calloc(1, sizeof *d);
    assert_non_null(d);
    d->config = (KellerConfig){.file = "d.xml", .set_count = 1, .sets = &d->set, .receiver_count = CELLS, .receivers = d->cells};
    d->set = (KellerReceiverSet){.kind = KELLER_SET_GRID, .ny = ROWS, .nx = COLUMNS, .count = CELLS, .x0 = x, .y0 = y, .step = step,
                                 .draped = true, .height = height};
    d->surface = (KellerSurfaceName){.name = (char *)(uintptr_t)name, .is_object = object, .line = 7};
    if (name) d->set.surfaces = &d->surface;
    d->set.surface_count = name != NULL;
    for (uint32_t i = 0; i < CELLS; i++)
        d->cells[i].station.position = v3(x + (i % COLUMNS) * step, y + (i / COLUMNS) * step, NAN);
    return d;
}

static void drape(Draped *d, const KellerScene *scene)
{
    KellerError error = {0};
    if (keller_config_drape(&d->config, scene, &error) != KELLER_OK) fail_msg("%s", error.message);
}

static double z_of(const Draped *d, uint32_t cell) { return d->cells[cell].station.position.z; }

/* z = 7 + 0.25 x - 0.5 y: all of it exact in double precision where x and y are eighths. */
static void plane(void **state)
{
    (void)state;
    Random random = random_seeded(1);
    for (int pass = 0; pass < 3; pass++) {
        KellerSoup soup = soup_new();
        soup_object(&soup, "ground");
        soup_quad(&soup, v3(-64, -64, 23), v3(64, -64, 55), v3(64, 64, -9), v3(-64, 64, -41), CONCRETE);
        for (int i = 0; i < pass; i++) soup_refine(&soup, &random);
        KellerScene scene = scene_of(&soup);
        Draped *d = draped_new(-5, -4, 0.125, NULL, true);
        drape(d, &scene);
        assert_int_equal(d->set.nowhere, 0);
        for (uint32_t i = 0; i < CELLS; i++) {
            KellerVec3 p = d->cells[i].station.position;
            /* cut triangles have corners that are rounded to 2^-47 */
            assert_true(fabs(p.z - (7 + 0.25 * p.x - 0.5 * p.y + height)) <= (pass ? 1e-12 : 0));
        }
        free(d);
        keller_scene_free(&scene);
        soup_release(&soup);
    }
}

/* Quads of 1 m over the square from (0, 0) to (side, side), as triangles that share vertices; heights up to `relief`. */
static KellerSoup terrain(Random *random, uint32_t side, double relief)
{
    KellerSoup soup = soup_new();
    uint32_t first = 0;
    soup_object(&soup, "terrain");
    for (uint32_t j = 0; j <= side; j++)
        for (uint32_t i = 0; i <= side; i++) {
            uint32_t v = soup_vertex(&soup, v3(i, j, random_range(random, 0, relief)));
            if (i == 0 && j == 0) first = v;
        }
    for (uint32_t j = 0; j < side; j++)
        for (uint32_t i = 0; i < side; i++) {
            uint32_t a = first + j * (side + 1) + i, b = a + 1, c = a + side + 1, d = c + 1;
            bool turned = random_below(random, 2);
            soup_triangle(&soup, a, b, turned ? c : d, DRY_GROUND);
            soup_triangle(&soup, turned ? d : a, turned ? c : d, turned ? b : c, DRY_GROUND);
        }
    return soup;
}

static long double cross_in_plan(KellerVec3 a, KellerVec3 b, long double x, long double y)
{
    return (b.x - (long double)a.x) * (y - a.y) - (b.y - (long double)a.y) * (x - a.x);
}

/* The highest of all triangles over (x, y); NaN: none. */
static double highest(const KellerScene *scene, double x, double y)
{
    long double best = -INFINITY;
    for (size_t t = 0; t < scene->triangle_count; t++) {
        KellerVec3 v[3];
        long double side[3], sum = 0;
        for (int i = 0; i < 3; i++) v[i] = scene->vertices[scene->triangles[t][i]];
        for (int i = 0; i < 3; i++) sum += side[i] = cross_in_plan(v[(i + 1) % 3], v[(i + 2) % 3], x, y);
        bool up = side[0] >= 0 && side[1] >= 0 && side[2] >= 0, down = side[0] <= 0 && side[1] <= 0 && side[2] <= 0;
        if (sum == 0 || (!up && !down)) continue;
        long double z = (side[0] * v[0].z + side[1] * v[1].z + side[2] * v[2].z) / sum;
        if (z > best) best = z;
    }
    return isinf(best) ? NAN : (double)best;
}

/* Cells on the lines of the mesh, on its corners and beside them; one mesh over another, so that the highest counts; and cells beyond. */
static void against_all_triangles(void **state)
{
    (void)state;
    size_t compared = 0, outside = 0;
    for (uint64_t seed = 1; seed <= 40; seed++) {
        Random random = random_seeded(seed);
        KellerSoup soup = terrain(&random, 8, 3);
        if (seed % 3 == 0) soup_box(&soup, v3(2, 2.5, -1), v3(4.25, 5, 6), CONCRETE, 0);
        if (seed % 2) soup_refine(&soup, &random);
        KellerScene scene = scene_of(&soup);
        double step = seed % 4 == 0 ? 0.25 : random_range(&random, 0.05, 0.4), from = seed % 4 == 0 ? -0.5 : random_range(&random, -1, 1);
        Draped *d = draped_new(from, from, step, NULL, true);
        drape(d, &scene);
        uint32_t nowhere = 0;
        for (uint32_t i = 0; i < CELLS; i++) {
            KellerVec3 p = d->cells[i].station.position;
            double expected = highest(&scene, p.x, p.y) + height;
            nowhere += isnan(p.z) ? 1 : 0;
            outside += isnan(expected) ? 1 : 0;
            compared++;
            if (isnan(expected)) assert_true(isnan(p.z));
            /* Triangles of slope s over coordinates below 8: some units of 2^-50, times s; s is below 1e3 in slivers. */
            else assert_true(fabs(p.z - expected) <= 1e-11);
        }
        assert_int_equal(nowhere, d->set.nowhere);
        free(d);
        keller_scene_free(&scene);
        soup_release(&soup);
    }
    print_message("# %zu cells, %zu of them without a surface\n", compared, outside);
    assert_true(outside > 1000 && compared - outside > 10000);
}

/* Whatever the order of triangles, bit for bit. */
static void shuffled(void **state)
{
    (void)state;
    Random random = random_seeded(5);
    KellerSoup soup = terrain(&random, 8, 3), other = soup_copy(&soup);
    soup_shuffle(&other, &random);
    KellerScene scene = scene_of(&soup), again = scene_of(&other);
    Draped *a = draped_new(0, 0, 0.125, NULL, true), *b = draped_new(0, 0, 0.125, NULL, true);
    drape(a, &scene);
    drape(b, &again);
    for (uint32_t i = 0; i < CELLS; i++) assert_true(z_of(a, i) == z_of(b, i));
    free(a);
    free(b);
    keller_scene_free(&scene);
    keller_scene_free(&again);
    soup_release(&soup);
    soup_release(&other);
}

/* A box of glass, 3 m high, on ground at 1 m: over all, over the ground alone, over the glass alone. */
static KellerScene box_on_ground(KellerSoup *soup)
{
    *soup = soup_new();
    soup_object(soup, "ground");
    soup_quad(soup, v3(-8, -8, 1), v3(8, -8, 1), v3(8, 8, 1), v3(-8, 8, 1), DRY_GROUND);
    soup_object(soup, "box");
    soup_box(soup, v3(-1, -1, 1), v3(1, 1, 4), GLASS, 0);
    return scene_of(soup);
}

static void what_counts(void **state)
{
    (void)state;
    KellerSoup soup;
    KellerScene scene = box_on_ground(&soup);
    const struct { const char *name; bool object; double inside, outside; } cases[] = {
        {NULL, true, 4, 1}, {scene.objects[0], true, 0, 0}, {scene.objects[1], true, 0, 0},
        {soup.materials[DRY_GROUND].name, false, 1, 1}, {soup.materials[GLASS].name, false, 4, NAN}};
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        Draped *d = draped_new(-2, -2, 0.1, cases[c].name, cases[c].object);
        drape(d, &scene);
        double inside = cases[c].inside, outside = cases[c].outside;
        if (c == 1 || c == 2) {
            bool ground = strncmp(cases[c].name, "ground", 6) == 0;
            inside = ground ? 1 : 4;
            outside = ground ? 1 : NAN;
        }
        for (uint32_t i = 0; i < CELLS; i++) {
            KellerVec3 p = d->cells[i].station.position;
            double expected = (fabs(p.x) <= 1 && fabs(p.y) <= 1 ? inside : outside) + height;
            if (fabs(fabs(p.x) - 1) < 1e-9 || fabs(fabs(p.y) - 1) < 1e-9) continue; /* cells that are meant to be on the box's border */
            assert_true(isnan(expected) ? isnan(p.z) : p.z == expected);
        }
        free(d);
    }
    Draped *d = draped_new(-2, -2, 0.1, "grund_1", true);
    KellerError error = {0};
    assert_int_equal(keller_config_drape(&d->config, &scene, &error), KELLER_BAD_INPUT);
    assert_non_null(strstr(error.message, "d.xml:7: <over> names object \"grund_1\""));
    assert_non_null(strstr(error.message, "did you mean \"ground"));
    d->surface.is_object = false;
    assert_int_equal(keller_config_drape(&d->config, &scene, &error), KELLER_BAD_INPUT);
    assert_non_null(strstr(error.message, "names material \"grund_1\""));
    free(d);
    keller_scene_free(&scene);
    soup_release(&soup);
}

/* Two halves that miss each other by less than the contact tolerance, where the cells of one column are; and a wall in place of one. */
static void cracks(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "ground");
    soup_quad(&soup, v3(-9, -9, 2), v3(-2e-7, -9, 2), v3(-2e-7, 9, 2), v3(-9, 9, 2), CONCRETE);
    soup_quad(&soup, v3(2e-7, -9, 2), v3(9, -9, 2), v3(9, 9, 2), v3(2e-7, 9, 2), CONCRETE);
    KellerScene scene = scene_of(&soup);
    assert_true(scene.contact > 2e-7 && scene.contact < 1e-4);
    Draped *d = draped_new(-1, -1, 0.125, NULL, true);
    drape(d, &scene);
    assert_int_equal(d->set.nowhere, 0);
    for (uint32_t i = 0; i < CELLS; i++) assert_true(z_of(d, i) == 3.5);
    free(d);
    keller_scene_free(&scene);
    soup_release(&soup);
    soup = soup_new();
    soup_object(&soup, "wall");
    soup_quad(&soup, v3(0, -9, 0), v3(0, 9, 0), v3(0, 9, 5), v3(0, -9, 5), CONCRETE);
    scene = scene_of(&soup);
    d = draped_new(-1, -1, 0.125, NULL, true);
    drape(d, &scene);
    assert_int_equal(d->set.nowhere, CELLS);
    free(d);
    keller_scene_free(&scene);
    soup_release(&soup);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(plane), cmocka_unit_test(against_all_triangles), cmocka_unit_test(shuffled),
        cmocka_unit_test(what_counts), cmocka_unit_test(cracks),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
