/* Bodies that touch: an edge that lies on another face is no rim, whether or not the file connects the two (SPEC 1). */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <cmocka.h>
#include "keller/scene.h"
#include "model.h"

#define PI 3.14159265358979323846

/* A wedge in space, by the ends of its edge (first one smaller by x, y, z). */
typedef struct {
    KellerVec3 a, b;
    double n;
} Expected;

static size_t count_wedge(const KellerScene *scene, Expected e, double tolerance)
{
    size_t found = 0;
    for (size_t i = 0; i < scene->wedge_count; i++) {
        const KellerWedge *w = &scene->wedges[i];
        found += v3_distance(scene->vertices[w->vertex[0]], e.a) <= tolerance &&
                 v3_distance(scene->vertices[w->vertex[1]], e.b) <= tolerance && fabs(w->n - e.n) <= 1e-14;
    }
    return found;
}

static void assert_wedges(const KellerScene *scene, size_t count, const Expected *expected, size_t others)
{
    for (size_t i = 0; i < count; i++) assert_int_equal(count_wedge(scene, expected[i], 1e-12), 1);
    assert_int_equal(scene->wedge_count, count + others);
}

/* Ground of 40 m, cut so that the box's footprint is connected to it, under the box too. */
static void connected_ground(Model *model)
{
    const double c[4] = {-20, -5, 5, 20};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            model_quad(model, v3(c[i], c[k], 0), v3(c[i + 1], c[k], 0), v3(c[i + 1], c[k + 1], 0),
                       v3(c[i], c[k + 1], 0), (i + k) & 1, 1);
}

static void plain_ground(Model *model)
{
    model_quad(model, v3(-20, -20, 0), v3(20, -20, 0), v3(20, 20, 0), v3(-20, 20, 0), false, 1);
}

/* A box of 10 x 10 x 8 m on the ground, as the issue lists the ways: the four uprights and the four roof edges diffract
 * outside, the ground has its own four rims, and there is nothing else above the ground. */
static void box_on_ground(void **state)
{
    (void)state;
    for (int connected = 0; connected < 2; connected++)
        for (int bottom = 0; bottom < 2; bottom++)
            for (int sunk = 0; sunk < 2; sunk++)
                for (int material = 0; material < 2; material++)
                    for (int flip = 0; flip < 3; flip++) {
                        Model model;
                        model_open(&model, 11);
                        if (connected) connected_ground(&model);
                        else plain_ground(&model);
                        double z = sunk ? -0.01 : 0;
                        model_box(&model, v3(-5, -5, z), v3(5, 5, 8), bottom, (uint32_t)material);
                        if (flip) model_flip(&model, flip == 1);
                        KellerScene scene = model_scene(&model);
                        Expected expected[12];
                        size_t count = 0;
                        const double xy[4][2] = {{-5, -5}, {-5, 5}, {5, -5}, {5, 5}};
                        const int roof[4][2] = {{0, 1}, {0, 2}, {1, 3}, {2, 3}};
                        for (int i = 0; i < 4; i++) {
                            const double *p = xy[i], *q = xy[roof[i][0]], *r = xy[roof[i][1]];
                            expected[count++] = (Expected){v3(p[0], p[1], z), v3(p[0], p[1], 8), 1.5};
                            expected[count++] = (Expected){v3(q[0], q[1], 8), v3(r[0], r[1], 8), 1.5};
                            expected[count++] = (Expected){v3(4 * q[0], 4 * q[1], 0), v3(4 * r[0], 4 * r[1], 0), 2};
                        }
                        /* Sunk, the foot is 1 cm below: a rim or the bottom's corner, where no wave comes. */
                        assert_wedges(&scene, 12, expected, sunk ? 4 : 0);
                        if (sunk)
                            for (int i = 0; i < 4; i++) {
                                const double *q = xy[roof[i][0]], *r = xy[roof[i][1]];
                                Expected foot = {v3(q[0], q[1], z), v3(r[0], r[1], z), bottom ? 1.5 : 2};
                                assert_int_equal(count_wedge(&scene, foot, 1e-12), 1);
                            }
                        if (!sunk && !connected && !bottom) assert_int_equal(scene.report.contact_edges, 4);
                        keller_scene_free(&scene);
                        model_close(&model);
                    }
}

/* The contact tolerance decides: a wall nearer to the ground than it stands on it, one above it has a rim. */
static void gap(void **state)
{
    (void)state;
    const double share[4] = {-0.7, 0.7, 1.5, -1.5};
    for (int i = 0; i < 4; i++) {
        Model model;
        model_open(&model, 1);
        plain_ground(&model);
        double contact = keller_scene_contact(40 * sqrt(2)), z = share[i] * contact;
        model_quad(&model, v3(-6, 1, z), v3(7, 2, z), v3(7, 2, 5), v3(-6, 1, 5), false, 0);
        KellerScene scene = model_scene(&model);
        assert_int_equal(scene.wedge_count, i < 2 ? 4 + 3 : 4 + 4);
        assert_int_equal(scene.report.contact_edges, i < 2 ? 1 : 0);
        keller_scene_free(&scene);
        model_close(&model);
    }
    /* 4 units of 2^-23 of the diagonal, and no less than a micrometre */
    assert_true(keller_scene_contact(1000) == 1000 * 0x1p-21);
    assert_true(keller_scene_contact(0.5) == 1e-6);
}

/* Two boxes whose walls touch all over are one long box. */
static void side_by_side(void **state)
{
    (void)state;
    for (int shared = 0; shared < 3; shared++) {
        Model model;
        model_open(&model, 3);
        model_box(&model, v3(0, 0, 0), v3(10, 10, 8), true, 0);
        model_box(&model, v3(10, 0, 0), v3(25, 10, 8), true, 0);
        if (shared == 1) model_cut(&model, 30, true);
        if (shared == 2) model_flip(&model, false);
        KellerScene scene = model_scene(&model);
        Expected expected[12];
        size_t count = 0;
        for (int i = 0; i < 2; i++)
            for (int k = 0; k < 2; k++) {
                expected[count++] = (Expected){v3(0, 10 * i, 8 * k), v3(25, 10 * i, 8 * k), 1.5};
                expected[count++] = (Expected){v3(25 * i, 0, 8 * k), v3(25 * i, 10, 8 * k), 1.5};
                expected[count++] = (Expected){v3(25 * i, 10 * k, 0), v3(25 * i, 10 * k, 8), 1.5};
            }
        assert_wedges(&scene, 12, expected, 0);
        assert_int_equal(scene.face_count, 7); /* the shared wall is one face, the long sides are one each */
        keller_scene_free(&scene);
        model_close(&model);
    }
}

/* Box A is 10 x 10 x 8 m; B, 10 x 10 x 5 m, touches its wall x = 10 from y = 4 on. Where B covers A's corner, the
 * corner is a flat wall; where A covers B's, a right-angled inner corner. Neither diffracts. */
static void part_by_side(void **state)
{
    (void)state;
    for (int variant = 0; variant < 3; variant++) {
        Model model;
        model_open(&model, 3);
        model_box(&model, v3(0, 0, 0), v3(10, 10, 8), true, 0);
        model_box(&model, v3(10, 4, 0), v3(20, 14, 5), true, variant == 1 ? 1 : 0);
        if (variant == 2) model_cut(&model, 50, true);
        KellerScene scene = model_scene(&model);
        const Expected expected[] = {
            {v3(0, 0, 0), v3(0, 0, 8), 1.5},
            {v3(0, 10, 0), v3(0, 10, 8), 1.5},
            {v3(10, 0, 0), v3(10, 0, 8), 1.5},
            {v3(10, 10, 5), v3(10, 10, 8), 1.5}, /* below, B's wall goes on in A's plane */
            {v3(0, 0, 8), v3(0, 10, 8), 1.5},
            {v3(0, 0, 8), v3(10, 0, 8), 1.5},
            {v3(0, 10, 8), v3(10, 10, 8), 1.5},
            {v3(10, 0, 8), v3(10, 10, 8), 1.5},
            {v3(0, 0, 0), v3(0, 10, 0), 1.5},
            {v3(0, 0, 0), v3(10, 0, 0), 1.5},
            {v3(0, 10, 0), v3(10, 10, 0), 1.5},
            {v3(10, 0, 0), v3(10, 4, 0), 1.5}, /* then B's bottom goes on in A's */
            {v3(20, 4, 0), v3(20, 4, 5), 1.5},
            {v3(20, 14, 0), v3(20, 14, 5), 1.5},
            {v3(10, 14, 0), v3(10, 14, 5), 1.5},
            {v3(10, 4, 5), v3(20, 4, 5), 1.5},
            {v3(10, 14, 5), v3(20, 14, 5), 1.5},
            {v3(20, 4, 5), v3(20, 14, 5), 1.5},
            {v3(10, 10, 5), v3(10, 14, 5), 1.5}, /* before, B's roof meets A's wall */
            {v3(10, 4, 0), v3(20, 4, 0), 1.5},
            {v3(10, 14, 0), v3(20, 14, 0), 1.5},
            {v3(20, 4, 0), v3(20, 14, 0), 1.5},
            {v3(10, 10, 0), v3(10, 14, 0), 1.5},
        };
        assert_wedges(&scene, sizeof expected / sizeof expected[0], expected, 0);
        if (variant < 2) assert_int_equal(scene.vertex_count, 16 + 1); /* (10, 10, 5) is new, at the end */
        if (variant < 2) assert_true(v3_distance(scene.vertices[16], v3(10, 10, 5)) < 1e-12);
        keller_scene_free(&scene);
        model_close(&model);
    }
}

/* A wall half on the ground, half over its border: its foot is a corner, then a rim; the ground's border, which it
 * crosses in a point, keeps its rim whole. */
static void half_on_ground(void **state)
{
    (void)state;
    Model model;
    model_open(&model, 3);
    model_quad(&model, v3(0, 0, 0), v3(10, 0, 0), v3(10, 10, 0), v3(0, 10, 0), false, 1);
    model_quad(&model, v3(5, 5, 0), v3(15, 5, 0), v3(15, 5, 3), v3(5, 5, 3), false, 0);
    KellerScene scene = model_scene(&model);
    const Expected expected[] = {
        {v3(0, 0, 0), v3(10, 0, 0), 2},   {v3(0, 0, 0), v3(0, 10, 0), 2}, {v3(10, 0, 0), v3(10, 10, 0), 2},
        {v3(0, 10, 0), v3(10, 10, 0), 2}, {v3(5, 5, 0), v3(5, 5, 3), 2},  {v3(15, 5, 0), v3(15, 5, 3), 2},
        {v3(5, 5, 3), v3(15, 5, 3), 2},   {v3(10, 5, 0), v3(15, 5, 0), 2},
    };
    assert_wedges(&scene, 8, expected, 0);
    assert_int_equal(scene.vertex_count, 9);
    assert_int_equal(scene.report.contact_edges, 1);
    keller_scene_free(&scene);
    model_close(&model);
}

/* A wall that leans by 30 degrees and stands on the ground: sectors of 60 (a third of pi, none), 120 and, below,
 * 180. */
static void leaning(void **state)
{
    (void)state;
    for (int variant = 0; variant < 3; variant++) {
        Model model;
        model_open(&model, 5);
        plain_ground(&model);
        double lean = 3 * tan(PI / 6);
        /* unconnected inside; then along the ground's diagonal, as one edge in one place or as two */
        if (variant == 0)
            model_quad(&model, v3(-6, 1, 0), v3(7, 1, 0), v3(7, 1 + lean, 3), v3(-6, 1 + lean, 3), false, 0);
        double end = variant == 1 ? 20 : 15, across = lean / sqrt(2);
        if (variant)
            model_quad(&model, v3(-end, -end, 0), v3(end, end, 0), v3(end - across, end + across, 3),
                       v3(-end - across, -end + across, 3), false, 0);
        KellerScene scene = model_scene(&model);
        Expected foot = {variant == 0 ? v3(-6, 1, 0) : v3(-end, -end, 0), variant == 0 ? v3(7, 1, 0) : v3(end, end, 0),
                         2.0 / 3};
        assert_wedges(&scene, 1, &foot, 4 + 3);
        for (size_t i = 0; i < scene.wedge_count; i++)
            if (scene.wedges[i].n < 1) {
                assert_int_equal(scene.wedges[i].plane_end - scene.wedges[i].plane_begin, 2);
                KellerVec3 p = v3_madd(scene.wedges[i].tangent0, scene.wedges[i].normal0, tan(PI / 3));
                assert_true(p.z > 0); /* the bisector of the sector points up */
            }
        keller_scene_free(&scene);
        model_close(&model);
    }
}

/* Two screens whose edges lie in one place without a common vertex make one corner there; it is found once. */
static void unwelded_corner(void **state)
{
    (void)state;
    Model model;
    model_open(&model, 5);
    model_quad(&model, v3(0, 0, 0), v3(4, 0, 0), v3(4, 0, 6), v3(0, 0, 6), false, 0);
    model_quad(&model, v3(0, 0, 2), v3(0, 5, 2), v3(0, 5, 9), v3(0, 0, 9), false, 0);
    KellerScene scene = model_scene(&model);
    const Expected expected[] = {
        {v3(0, 0, 0), v3(0, 0, 2), 2},   {v3(0, 0, 2), v3(0, 0, 6), 1.5}, {v3(0, 0, 6), v3(0, 0, 9), 2},
        {v3(0, 0, 0), v3(4, 0, 0), 2},   {v3(4, 0, 0), v3(4, 0, 6), 2},   {v3(0, 0, 6), v3(4, 0, 6), 2},
        {v3(0, 0, 2), v3(0, 5, 2), 2},   {v3(0, 5, 2), v3(0, 5, 9), 2},   {v3(0, 0, 9), v3(0, 5, 9), 2},
    };
    assert_wedges(&scene, 9, expected, 0);
    assert_int_equal(scene.face_count, 2);
    keller_scene_free(&scene);
    model_close(&model);
}

/* ---- an oracle: boxes on the unit lattice ---- */

enum { SIZE = 12 };

/* square[axis][i][j][k]: the unit square at (i, j, k), perpendicular to the axis, is part of some box. */
typedef struct {
    bool square[3][SIZE][SIZE][SIZE];
} Lattice;

static void add_box(Model *model, Lattice *lattice, const int low[3], const int high[3], bool bottom, uint32_t material)
{
    model_box(model, v3(low[0], low[1], low[2]), v3(high[0], high[1], high[2]), bottom, material);
    for (int axis = 0; axis < 3; axis++)
        for (int i = low[0]; i <= high[0]; i++)
            for (int j = low[1]; j <= high[1]; j++)
                for (int k = low[2]; k <= high[2]; k++) {
                    int at[3] = {i, j, k};
                    bool on = at[axis] == high[axis] || (at[axis] == low[axis] && (axis != 2 || bottom));
                    for (int other = 0; other < 3; other++) on = on && (other == axis || at[other] < high[other]);
                    if (on) lattice->square[axis][i][j][k] = true;
                }
}

static bool square(const Lattice *lattice, int axis, const int at[3])
{
    for (int i = 0; i < 3; i++)
        if (at[i] < 0 || at[i] >= SIZE) return false;
    return lattice->square[axis][at[0]][at[1]][at[2]];
}

/* Around the unit edge at `at` along `axis` up to four squares meet, 90 degrees apart: one alone makes a rim (n =
 * 2), two at a right angle a corner (n = 1.5, and inside n = 0.5, which does not diffract); all else has sectors of
 * 90 and 180 degrees only. */
static double expected_n(const Lattice *lattice, int axis, const int at[3])
{
    int u = (axis + 1) % 3, v = (axis + 2) % 3, back_u[3], back_v[3];
    for (int i = 0; i < 3; i++) back_u[i] = at[i] - (i == u), back_v[i] = at[i] - (i == v);
    bool plus_u = square(lattice, v, at), minus_u = square(lattice, v, back_u);
    bool plus_v = square(lattice, u, at), minus_v = square(lattice, u, back_v);
    int count = plus_u + minus_u + plus_v + minus_v;
    if (count == 1) return 2;
    return count == 2 && plus_u != minus_u ? 1.5 : 0;
}

static void lattice_oracle(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 200; seed++) {
        Model model;
        Lattice *lattice = calloc(1, sizeof *lattice);
        assert_non_null(lattice);
        model_open(&model, seed);
        for (uint64_t i = 0; i < 2 + seed % 5; i++) {
            int low[3], high[3];
            for (int axis = 0; axis < 3; axis++) {
                low[axis] = (int)model_random(&model, 0, 5);
                high[axis] = low[axis] + 1 + (int)model_random(&model, 0, 4);
            }
            bool bottom = model_random(&model, 0, 1) < 0.6;
            add_box(&model, lattice, low, high, bottom, model_random(&model, 0, 1) < 0.5);
        }
        model_cut(&model, (int)(seed % 3) * 25, true);
        model_flip(&model, false);
        KellerScene scene = model_scene(&model);
        for (int axis = 0; axis < 3; axis++)
            for (int i = 0; i < SIZE; i++)
                for (int j = 0; j < SIZE; j++)
                    for (int k = 0; k < SIZE; k++) {
                        const int at[3] = {i, j, k};
                        double n = expected_n(lattice, axis, at);
                        KellerVec3 middle = v3(i + (axis == 0) * 0.5, j + (axis == 1) * 0.5, k + (axis == 2) * 0.5);
                        size_t found = 0;
                        for (size_t w = 0; w < scene.wedge_count; w++) {
                            const KellerWedge *wedge = &scene.wedges[w];
                            KellerVec3 to = v3_sub(middle, wedge->origin);
                            double t = v3_dot(to, wedge->direction);
                            if (t < 0 || t > wedge->length || v3_norm(v3_madd(to, wedge->direction, -t)) > 1e-9)
                                continue;
                            found++;
                            assert_true(fabs(wedge->n - n) < 1e-12);
                        }
                        assert_int_equal(found, n > 0);
                    }
        keller_scene_free(&scene);
        free(lattice);
        model_close(&model);
    }
}

/* Coplanar neighbours of another material, and flush towers far apart, share a plane; a step above the tolerance does
 * not. */
static void planes(void **state)
{
    (void)state;
    Model model;
    model_open(&model, 5);
    model_box(&model, v3(0, 0, 0), v3(5, 5, 8), false, 0);
    model_box(&model, v3(5, 0, 0), v3(9, 5, 8), false, 1);
    model_box(&model, v3(200, 0, 0), v3(205, 5, 8), false, 1);
    model_box(&model, v3(300, 0.01, 0), v3(305, 5, 8), false, 1);
    KellerScene scene = model_scene(&model);
    uint32_t plane[4];
    for (size_t f = 0; f < scene.face_count; f++) {
        const KellerFace *face = &scene.faces[f];
        KellerVec3 p = scene.vertices[scene.triangles[scene.face_triangles[face->triangle_begin]][0]];
        if (fabs(face->normal.y) < 0.5 || fabs(face->offset) > 0.1) continue;
        plane[p.x < 4 ? 0 : p.x < 100 ? 1 : p.x < 250 ? 2 : 3] = face->plane;
    }
    assert_true(plane[0] == plane[1] && plane[1] == plane[2] && plane[2] != plane[3]);
    keller_scene_free(&scene);
    model_close(&model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(box_on_ground), cmocka_unit_test(gap),     cmocka_unit_test(side_by_side),
        cmocka_unit_test(part_by_side),  cmocka_unit_test(half_on_ground), cmocka_unit_test(leaning),
        cmocka_unit_test(unwelded_corner), cmocka_unit_test(lattice_oracle), cmocka_unit_test(planes),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests_name("contact", tests, NULL, NULL);
}
