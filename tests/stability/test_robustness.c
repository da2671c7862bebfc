/* Places where a decision hangs on the last bit, and scenes that are hardly any. No crash, no NaN, no doubled path,
 * no path through a wall; and on a boundary the value between those on either side. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "harness.h"
#include "oracle.h"
#include "scenes.h"

#define LIGHT_SPEED 299792458.0

/* ---- what holds for every path ---------------------------------------------------------------------------------- */

static bool finite3(KellerVec3 p) { return isfinite(p.x) && isfinite(p.y) && isfinite(p.z); }

/* `size`: of the scene, m. A leg is taken to cross a wall when it does so by more than a millionth of that. */
static size_t insane(const KellerScene *scene, const FoundPaths *found, const KellerVec3 *tx, const KellerVec3 *rx,
                     size_t rx_count, double size)
{
    size_t bad = 0;
    char text[256];
    for (size_t i = 0; i < found->count; i++) {
        const Found *p = &found->path[i];
        bool good = isfinite(p->length) && p->length >= 0 && isfinite(p->delay) && isfinite(p->departure[0]) &&
                    isfinite(p->departure[1]) && isfinite(p->arrival[0]) && isfinite(p->arrival[1]) &&
                    isfinite(creal(p->gain[0])) && isfinite(cimag(p->gain[0]));
        for (int k = 0; k < 4; k++)
            good = good && isfinite(creal(p->transfer[0][k])) && isfinite(cimag(p->transfer[0][k]));
        for (uint32_t k = 0; k < p->count; k++) good = good && finite3(p->position[k]);
        if (!good) {
            printf("# receiver %u, %s: not finite, gain %g %g\n", p->rx,
                   path_text(p->count, p->step, text, sizeof text), creal(p->gain[0]), cimag(p->gain[0]));
            bad++;
            continue;
        }
        for (uint32_t k = 0; k <= p->count; k++) {
            KellerVec3 a = k ? p->position[k - 1] : tx[p->tx], b = k < p->count ? p->position[k] : rx[p->rx];
            uint32_t planes[64];
            size_t plane_count = 0;
            for (uint32_t s = k ? k - 1 : 0; s <= k && s < p->count; s++) {
                if (p->step[s].kind == KELLER_REFLECTION) {
                    planes[plane_count++] = scene->faces[p->step[s].id].plane;
                    continue;
                }
                const KellerWedge *w = &scene->wedges[p->step[s].id];
                for (uint32_t j = w->plane_begin; j < w->plane_end && plane_count < 64; j++)
                    planes[plane_count++] = scene->wedge_planes[j];
            }
            double margin;
            if (oracle_blocked(scene, a, b, plane_count, planes, &margin) && margin > 1e-6 * size) {
                printf("# receiver %u, %s: leg %u goes through a wall, by %g m\n", p->rx,
                       path_text(p->count, p->step, text, sizeof text), k, margin);
                bad++;
            }
        }
    }
    for (uint32_t r = 0; r < rx_count; r++) {
        size_t doubled = paths_doubled(found, r, 1e-9 * size);
        if (doubled) printf("# receiver %u: %zu paths are there twice\n", r, doubled);
        bad += doubled;
    }
    return bad;
}

/* ---- on the boundaries ------------------------------------------------------------------------------------------ */

typedef struct {
    const char *what;
    bool box;          /* else a screen */
    KellerVec3 tx, rx; /* rx on the boundary */
    KellerVec3 across; /* unit, across the boundary */
    uint32_t half;     /* number of reflections of the path that counts one half */
} Boundary;

/* The screen: x = 0, y from -40 to 40, z from 0 to 10. The box: 0 < x < 50, the same y, z from -30 to 10. The
 * boundary runs through a point E of the edge x = 0, z = 10, twice as far from the receiver as from the transmitter
 * or its image, and all coordinates are whole, so that it is met exactly. (At equal distances the side rims' paths
 * would end at corners on the boundary, and those end there.) */
static const Boundary boundaries[] = {
    {"shadow of a screen", false, {-10, 0, 5}, {20, 0, 20}, {0, 0, 1}, 0},                  /* E = (0, 0, 10) */
    {"shadow of a screen, obliquely", false, {-10, 3, 5}, {20, 15, 20}, {0, 0, 1}, 0},      /* (0, 7, 10) */
    {"reflection in a screen", false, {-10, 0, 5}, {-20, 0, 20}, {0, 0, 1}, 1},             /* (0, 0, 10) */
    {"reflection in a screen, obliquely", false, {-10, 3, 5}, {-20, 15, 20}, {0, 0, 1}, 1}, /* (0, 7, 10) */
    {"shadow of a box", true, {-10, 0, 5}, {20, 0, 20}, {0, 0, 1}, 0},
    {"shadow of a box, obliquely", true, {-10, 3, 5}, {20, 15, 20}, {1, 0, 0}, 0},
    {"reflection in the front", true, {-10, 0, 5}, {-20, 0, 20}, {0, 0, 1}, 1},
    {"reflection in the front, both faces lit", true, {-10, 0, 16}, {-20, 0, -2}, {0, 0, 1}, 1},
    {"reflection in the roof", true, {-10, 0, 20}, {20, 0, 30}, {1, 0, 0}, 1},
    {"reflection in the roof, obliquely", true, {-10, 2, 20}, {20, -8.5, 30}, {0, 0, 1}, 1}, /* (0, -1.5, 10) */
};

static void on_boundaries(void **state)
{
    (void)state;
    /* Off the boundary by 1 um: at 10 m it is 1e-7 rad, a hundred times KELLER_BOUNDARY_ANGLE. The field is smooth on
     * either side and of one slope: the mean of both differs from the value between by (k step)^2 ~ 5e-9. */
    const double step = 1e-6;
    size_t bad = 0;
    for (size_t i = 0; i < sizeof boundaries / sizeof *boundaries; i++)
        for (int variant = 0; variant < 4; variant++) {
            const Boundary *b = &boundaries[i];
            KellerSoup soup = soup_new();
            uint32_t material = variant & 1 ? CONDUCTOR : CONCRETE;
            soup_object(&soup, "wall");
            if (b->box)
                soup_box(&soup, v3(0, -40, -30), v3(50, 40, 10), material, 0);
            else
                soup_quad(&soup, v3(0, -40, 0), v3(0, 40, 0), v3(0, 40, 10), v3(0, -40, 10), material);
            KellerScene scene = scene_of(&soup);
            KellerVec3 rx[3] = {b->rx, v3_madd(b->rx, b->across, step), v3_madd(b->rx, b->across, -step)};
            Run run = run_new(&b->tx, 3, rx, 1, 1, 1);
            run.antenna.polarization = variant & 2 ? KELLER_POLARIZATION_H : KELLER_POLARIZATION_V;
            FoundPaths found = run_simulation(&scene, &run);
            bad += insane(&scene, &found, &b->tx, rx, 3, 100);
            double complex on = found_total(&found, 0, 0), above = found_total(&found, 1, 0);
            double complex below = found_total(&found, 2, 0), mean = (above + below) / 2;
            double jump = 20 * log10(cabs(above) / cabs(below)), off = cabs(on - mean) / cabs(mean);
            /* One of the neighbours has the path, the other has it not. */
            size_t with[3] = {0};
            double half = 0, whole = 0;
            for (size_t k = 0; k < found.count; k++) {
                const Found *p = &found.path[k];
                bool geometric = p->count == b->half && (!p->count || p->step[0].kind == KELLER_REFLECTION);
                if (!geometric || (p->count && !(fabs(p->position[0].x) < 1e-3 && fabs(p->position[0].z - 10) < 1e-3)))
                    continue;
                with[p->rx]++;
                double norm = 0;
                for (int t = 0; t < 4; t++) norm += pow(cabs(p->transfer[0][t]), 2);
                *(p->rx == 0 ? &half : &whole) = sqrt(norm);
            }
            bool good = with[0] == 1 && with[1] + with[2] == 1 && fabs(half / whole - 0.5) < 1e-6 && off < 1e-6 &&
                        fabs(jump) < 0.01;
            if (!good)
                printf("# %s, %s, %s: off the mean by %.3g, jump %.3g dB, paths %zu (%.9f) between %zu and %zu\n",
                       b->what, variant & 1 ? "conductor" : "concrete", variant & 2 ? "H" : "V", off, jump, with[0],
                       half / whole, with[1], with[2]);
            bad += !good;
            found_free(&found);
            keller_scene_free(&scene);
            soup_release(&soup);
        }
    assert_int_equal(bad, 0);
}

/* From (-10, 0, 5) by the corner (0, -40, 10) of the same kind of box to (10, 0, 15): the corner is also where the
 * end face y = -40 would mirror, from within. Beside the corner every such path runs through the box, so there is
 * none at it. */
static void at_a_corner_from_within(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "box");
    soup_box(&soup, v3(0, -40, -30), v3(50, 40, 10), CONDUCTOR, 0);
    KellerScene scene = scene_of(&soup);
    KellerVec3 tx = v3(-10, 0, 5), rx = v3(10, 0, 15);
    Run run = run_new(&tx, 1, &rx, 1, 0, 1);
    FoundPaths found = run_simulation(&scene, &run);
    for (size_t i = 0; i < found.count; i++) assert_int_equal(found.path[i].count, 0);
    found_free(&found);
    keller_scene_free(&scene);
    soup_release(&soup);
}

/* ---- odd places ------------------------------------------------------------------------------------------------- */

static KellerSoup yard(void)
{
    KellerSoup soup = soup_new();
    soup_object(&soup, "ground");
    soup_quad(&soup, v3(-20, -20, 0), v3(20, -20, 0), v3(20, 20, 0), v3(-20, 20, 0), CONCRETE);
    soup_object(&soup, "box");
    soup_box(&soup, v3(-3, -2, 0), v3(1, 2, 4), CONCRETE, 0);
    soup_object(&soup, "screen");
    soup_quad(&soup, v3(5, -4, 0), v3(6, 5, 0), v3(6, 5, 3), v3(5, -4, 3), CONDUCTOR);
    soup_object(&soup, "prism");
    soup_prism(&soup, 3, (KellerVec3[]){v3(-8, 5, 1), v3(-5, 6, 1.5), v3(-6.5, 8, 2)}, v3(0.3, 0.2, 3), CONCRETE, 0);
    return soup;
}

static const KellerVec3 yard_tx = {-9, -7, 2.5};

static void odd_places(void **state)
{
    (void)state;
    const KellerVec3 places[] = {
        {-3, 0.5, 1.5},      /* on a wall */
        {-1, -2, 2},         /* on a wall that sees the transmitter */
        {0, 0, 4},           /* on the roof */
        {5, 0, 0},           /* on the ground */
        {5.5, 0.5, 1},       /* on a screen */
        {1, 0, 4},           /* on an edge of the roof */
        {-3, -2, 2},         /* on an upright edge */
        {-3, 0, 0},          /* on the foot of a wall */
        {5, -4, 1.5},        /* on a screen's rim */
        {1, 2, 4},           /* at a corner */
        {-3, -2, 0},         /* at a corner of the foot */
        {6, 5, 3},           /* at a screen's corner */
        {20, 0, 0},          /* on the ground's rim */
        {-1, 0, 2},          /* in the box */
        {-6.4, 6.4, 3},      /* in the prism */
        {2, -2, 1},          /* in the plane of a wall, beside it */
        {9, 9, 4},           /* in the plane of the roof */
        {-3, -2, 9},         /* on the line of an upright edge */
        {8, 0, 0},           /* in the ground's plane */
        {30, 0, 0},          /* in the ground's plane, outside of it */
        {0, 0, -5},          /* below the ground */
        {-9, -7, 2.5},       /* at the transmitter */
        {-9, -7, 2.5000001}, /* 0.1 um above it */
        {-9, -7, 0},         /* below the transmitter, on the ground */
    };
    enum { COUNT = sizeof places / sizeof *places };
    KellerSoup soup = yard();
    KellerScene scene = scene_of(&soup);
    size_t bad = 0;
    Run run = run_new(&yard_tx, COUNT, places, 2, 1, 3);
    FoundPaths found = run_simulation(&scene, &run);
    bad += insane(&scene, &found, &yard_tx, places, COUNT, 40);
    assert_int_equal(found_count(&found, 13), 0); /* in the box */
    assert_int_equal(found_count(&found, 14), 0); /* in the prism */
    assert_true(found_count(&found, 1) > 0);
    assert_true(found_count(&found, 22) > 0);
    found_free(&found);
    /* The same places as transmitters, and along each other. */
    for (size_t i = 0; i < COUNT; i++) {
        run = run_new(&places[i], COUNT, places, 1, 1, 2);
        found = run_simulation(&scene, &run);
        size_t here = insane(&scene, &found, &places[i], places, COUNT, 40);
        found_free(&found);
        run = run_new(&places[i], 1, &yard_tx, 2, 1, 3);
        found = run_simulation(&scene, &run);
        here += insane(&scene, &found, &places[i], &yard_tx, 1, 40);
        found_free(&found);
        if (here) printf("# transmitter at place %zu\n", i);
        bad += here;
    }
    keller_scene_free(&scene);
    soup_release(&soup);
    assert_int_equal(bad, 0);
}

/* A grid whose points are on walls, edges, in solids and on the transmitter: every map value is finite. */
static void odd_grid(void **state)
{
    (void)state;
    KellerSoup soup = yard();
    KellerScene scene = scene_of(&soup);
    KellerVec3 tx = v3(-5, 0, 4), rx[8];
    for (int i = 0; i < 8; i++) rx[i] = v3(-5 + 2 * i, 0, 4);
    Run run = run_new(&tx, 8, rx, 2, 1, 2);
    run.grid_step = 2;
    FoundPaths found = run_simulation(&scene, &run);
    assert_int_equal(insane(&scene, &found, &tx, rx, 8, 40), 0);
    assert_int_equal(found.coverage_count, 8);
    for (uint32_t i = 0; i < 8; i++) {
        double expected = pow(cabs(found_total(&found, i, 0)), 2);
        assert_true(isfinite(found.coverage[i]));
        assert_true(fabs(found.coverage[i] - expected) <= 1e-9 * expected);
    }
    found_free(&found);
    keller_scene_free(&scene);
    soup_release(&soup);
}

/* ---- odd scenes ------------------------------------------------------------------------------------------------- */

static const KellerVec3 yard_rx[] = {{8.3, 3.1, 1.7}, {-0.7, 6.9, 2.2}, {3.2, -1.4, 5.6}};
#define YARD_RECEIVERS 3

static FoundPaths walk_yard(KellerSoup *soup, size_t *bad)
{
    KellerScene scene = scene_of(soup);
    Run run = run_new(&yard_tx, YARD_RECEIVERS, yard_rx, 2, 1, 3);
    FoundPaths found = run_simulation(&scene, &run);
    *bad += insane(&scene, &found, &yard_tx, yard_rx, YARD_RECEIVERS, 40);
    keller_scene_free(&scene);
    soup_release(soup);
    return found;
}

/* Consumes the soup. Positions agree to `place` m, gains to `gains` of the transfer's norm. */
static size_t yard_differs(const FoundPaths *model, KellerSoup soup, double place, double gains, const char *what)
{
    size_t bad = 0;
    FoundPaths found = walk_yard(&soup, &bad);
    for (uint32_t rx = 0; rx < YARD_RECEIVERS; rx++) {
        PathDifference d = paths_compare(model, rx, &found, rx, place, false, NULL, true);
        bool same = !d.only_a && !d.only_b && d.gain_error <= gains;
        if (!same)
            printf("# %s, receiver %u: %zu the same, %zu missing, %zu too many, gains %.3g\n", what, rx, d.matched,
                   d.only_a, d.only_b, d.gain_error);
        bad += !same;
    }
    found_free(&found);
    return bad;
}

static void duplicates(void **state)
{
    (void)state;
    size_t bad = 0;
    KellerSoup soup = yard();
    FoundPaths model = walk_yard(&soup, &bad);
    assert_true(model.count > 20);
    for (int variant = 0; variant < 4; variant++) {
        soup = yard();
        size_t triangles = soup.triangle_count;
        if (variant & 2) soup_object(&soup, "again");
        for (size_t i = 0; i < triangles; i++) {
            uint32_t c[3];
            for (int k = 0; k < 3; k++)
                c[k] = variant & 1 ? soup_vertex(&soup, soup.vertices[soup.triangles[i][k]]) : soup.triangles[i][k];
            soup_triangle(&soup, c[0], variant & 1 ? c[2] : c[1], variant & 1 ? c[1] : c[2], soup.material[i]);
        }
        bad += yard_differs(&model, soup, 1e-6, 1e-9, "every triangle twice");
    }
    /* The screen twice, cut along the other diagonal: the triangles overlap, none is the same. */
    soup = yard();
    soup_object(&soup, "again");
    soup_quad(&soup, v3(6, 5, 0), v3(6, 5, 3), v3(5, -4, 3), v3(5, -4, 0), CONDUCTOR);
    bad += yard_differs(&model, soup, 1e-6, 1e-9, "a screen twice, cut in two ways");
    /* A smaller poster on the box's wall. */
    soup = yard();
    soup_object(&soup, "poster");
    soup_quad(&soup, v3(-3, -1, 1), v3(-3, 1, 1), v3(-3, 1, 3), v3(-3, -1, 3), CONCRETE);
    bad += yard_differs(&model, soup, 1e-6, 1e-9, "a poster on a wall");
    /* Of another material: the path is there once, whichever reflects. */
    soup = yard();
    soup_object(&soup, "again");
    soup_quad(&soup, v3(5, -4, 0), v3(6, 5, 0), v3(6, 5, 3), v3(5, -4, 3), CONCRETE);
    bad += yard_differs(&model, soup, 1e-6, INFINITY, "a screen of two materials");
    found_free(&model);
    assert_int_equal(bad, 0);
}

static void slivers(void **state)
{
    (void)state;
    size_t bad = 0;
    KellerSoup soup = yard();
    FoundPaths model = walk_yard(&soup, &bad);
    /* The ground as fans of many narrow triangles from a corner. */
    for (int count = 50; count <= 800; count *= 4) {
        soup = soup_new();
        soup_object(&soup, "ground");
        for (int i = 0; i < count; i++) {
            double a = -20 + 40.0 * i / count, b = -20 + 40.0 * (i + 1) / count;
            soup_polygon(&soup, 3, (KellerVec3[]){v3(-20, -20, 0), v3(20, a, 0), v3(20, b, 0)}, CONCRETE);
            soup_polygon(&soup, 3, (KellerVec3[]){v3(-20, -20, 0), v3(b, 20, 0), v3(a, 20, 0)}, CONCRETE);
        }
        soup_object(&soup, "box");
        soup_box(&soup, v3(-3, -2, 0), v3(1, 2, 4), CONCRETE, 0);
        soup_object(&soup, "screen");
        soup_quad(&soup, v3(5, -4, 0), v3(6, 5, 0), v3(6, 5, 3), v3(5, -4, 3), CONDUCTOR);
        soup_object(&soup, "prism");
        soup_prism(&soup, 3, (KellerVec3[]){v3(-8, 5, 1), v3(-5, 6, 1.5), v3(-6.5, 8, 2)}, v3(0.3, 0.2, 3), CONCRETE,
                   0);
        bad += yard_differs(&model, soup, 1e-6, 1e-9, "ground of slivers");
    }
    /* A sliver at the roof's rim, from 1 cm wide to nothing. Narrower than the contact tolerance (4 units of single
     * precision at the diagonal of 57 m: 1.5e-5 m), its corner touches the wall below and may tilt it by so much:
     * the same paths, within some of those 1.5e-5 m. */
    for (double width = 1e-2; width > 1e-13; width *= 1e-2) {
        soup = yard();
        soup_object(&soup, "sliver");
        soup_triangle(&soup, soup_vertex(&soup, v3(-3, -2, 4)), soup_vertex(&soup, v3(-3, 2, 4)),
                      soup_vertex(&soup, v3(-3 + width, 0, 4)), CONCRETE);
        bad += yard_differs(&model, soup, 1e-4, width < 1e-4 ? 1e-3 : 1e-9, "a sliver on the roof");
        soup = yard();
        soup_object(&soup, "sliver");
        soup_triangle(&soup, soup_vertex(&soup, v3(7, 0, 5)), soup_vertex(&soup, v3(9, 0.3, 5.5)),
                      soup_vertex(&soup, v3(8, 0.15 + width, 5.25)), CONCRETE);
        FoundPaths found = walk_yard(&soup, &bad);
        assert_true(found.count > 0);
        found_free(&found);
    }
    found_free(&model);
    assert_int_equal(bad, 0);
}

static void empty_scene(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    KellerScene scene = scene_of(&soup);
    assert_int_equal(scene.triangle_count, 0);
    for (int grid = 0; grid < 2; grid++) {
        KellerVec3 tx = v3(1, 2, 3), rx[2] = {v3(4, 6, 15), v3(1, 2, 3)}; /* 3, 4, 12: 13 m; and at the transmitter */
        rx[1].x = grid ? 5 : 1;
        rx[1].y = grid ? 6 : 2;
        rx[1].z = grid ? 15 : 3;
        Run run = run_new(&tx, 2, rx, 3, 1, 3);
        run.grid_step = grid;
        FoundPaths found = run_simulation(&scene, &run);
        assert_int_equal(found_count(&found, 0), 1);
        assert_int_equal(insane(&scene, &found, &tx, rx, 2, 1), 0);
        double wave = LIGHT_SPEED / 3.5e9;
        double complex expected = wave / (4 * M_PI * 13) * cexp(-I * 2 * M_PI * 13 / wave);
        assert_true(cabs(found_total(&found, 0, 0) - expected) <= 1e-12 * cabs(expected));
        assert_true(fabs(found.path[0].delay - 13 / LIGHT_SPEED) <= 1e-15 * found.path[0].delay);
        found_free(&found);
    }
    keller_scene_free(&scene);
    soup_release(&soup);
}

static void one_triangle(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "triangle");
    soup_polygon(&soup, 3, (KellerVec3[]){v3(0, 0, 0), v3(4, 0.5, 0.25), v3(1, 3, -0.5)}, CONCRETE);
    KellerScene scene = scene_of(&soup);
    assert_int_equal(scene.face_count, 1);
    assert_int_equal(scene.wedge_count, 3);
    KellerVec3 tx = v3(1.1, 0.7, 3.3), rx[3] = {v3(2.2, 1.9, 4.1), v3(1.9, 1.2, -3.7), v3(9, 1, 1)};
    Run run = run_new(&tx, 3, rx, 2, 1, 3);
    FoundPaths found = run_simulation(&scene, &run);
    assert_int_equal(insane(&scene, &found, &tx, rx, 3, 10), 0);
    size_t direct[3] = {0}, mirrored[3] = {0}, bent[3] = {0};
    for (size_t i = 0; i < found.count; i++) {
        const Found *p = &found.path[i];
        assert_true(p->count <= 1);
        (p->count == 0 ? direct : p->step[0].kind == KELLER_REFLECTION ? mirrored : bent)[p->rx]++;
    }
    for (uint32_t r = 0; r < 3; r++) {
        OracleResult oracle = oracle_enumerate(&scene, tx, rx[r], 2, 1, 3);
        assert_int_equal(oracle.undecidable, 0);
        assert_int_equal(oracle.count, found_count(&found, r));
        oracle_free(&oracle);
    }
    /* Above the triangle: direct, mirrored, three rims. Behind it: the rims only. */
    assert_true(direct[0] == 1 && mirrored[0] == 1 && bent[0] == 3);
    assert_true(direct[1] == 0 && mirrored[1] == 0 && bent[1] == 3);
    assert_true(direct[2] == 1 && mirrored[2] == 0);
    found_free(&found);
    keller_scene_free(&scene);
    soup_release(&soup);
}

#define LARGE 65536.0       /* 40 m become 2.6e6 m */
#define SMALL (1.0 / 32768) /* 1.2e-3 m */

static KellerVec3 larger(KellerVec3 p) { return v3_scale(p, LARGE); }
static KellerVec3 smaller(KellerVec3 p) { return v3_scale(p, SMALL); }

/* Powers of two scale without rounding: the same paths, elsewhere. */
static void sizes(void **state)
{
    (void)state;
    size_t bad = 0;
    KellerSoup soup = yard();
    FoundPaths model = walk_yard(&soup, &bad);
    const PointMap maps[] = {larger, smaller};
    for (int m = 0; m < 2; m++) {
        soup = yard();
        for (size_t i = 0; i < soup.vertex_count; i++) soup.vertices[i] = maps[m](soup.vertices[i]);
        KellerScene scene = scene_of(&soup);
        KellerVec3 tx = maps[m](yard_tx), rx[YARD_RECEIVERS];
        for (int i = 0; i < YARD_RECEIVERS; i++) rx[i] = maps[m](yard_rx[i]);
        double size = 40 * (m ? SMALL : LARGE);
        Run run = run_new(&tx, YARD_RECEIVERS, rx, 2, 1, 3);
        FoundPaths found = run_simulation(&scene, &run);
        bad += insane(&scene, &found, &tx, rx, YARD_RECEIVERS, size);
        for (uint32_t r = 0; r < YARD_RECEIVERS; r++) {
            PathDifference d = paths_compare(&model, r, &found, r, 1e-9 * size, false, maps[m], true);
            if (d.only_a || d.only_b)
                printf("# %s, receiver %u: %zu the same, %zu missing, %zu too many\n", m ? "small" : "large", r,
                       d.matched, d.only_a, d.only_b);
            bad += d.only_a + d.only_b;
        }
        found_free(&found);
        keller_scene_free(&scene);
        soup_release(&soup);
    }
    found_free(&model);
    assert_int_equal(bad, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(on_boundaries), cmocka_unit_test(at_a_corner_from_within),
        cmocka_unit_test(odd_places),    cmocka_unit_test(odd_grid),
        cmocka_unit_test(duplicates),    cmocka_unit_test(slivers),
        cmocka_unit_test(empty_scene),   cmocka_unit_test(one_triangle),
        cmocka_unit_test(sizes),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
