/* Faces and wedges of single bodies, and where the tolerances end. */
#include "scene_check.h"

/* A box has six faces and twelve edges of 270 degrees outside; the 90 degrees inside do not diffract (1/n = 2). */
static void box(void **state)
{
    (void)state;
    Model model;
    model_open(&model, 1);
    model_box(&model, v3(-5, -3, 0), v3(5, 3, 8), true, 0);
    KellerScene scene = build(&model);
    assert_int_equal(scene.vertex_count, 8);
    assert_int_equal(scene.triangle_count, 12);
    assert_int_equal(scene.face_count, 6);
    assert_int_equal(scene.plane_count, 6);
    assert_int_equal(scene.wedge_count, 12);
    assert_int_equal(scene.report.edges, 18);
    assert_int_equal(scene.report.flat_edges, 6);
    assert_int_equal(scene.report.boundary_edges + scene.report.complex_edges + scene.report.contact_edges, 0);
    assert_int_equal(scene.report.welded_vertices, 36 - 8);
    for (size_t i = 0; i < 12; i++) {
        const KellerWedge *w = &scene.wedges[i];
        assert_true(w->n == 1.5);
        assert_int_equal(w->plane_end - w->plane_begin, 2);
        KellerVec3 p = v3_madd(v3_madd(w->origin, w->direction, w->length / 2), tangent_at(w, 0.75 * PI), 0.1);
        assert_true(fabs(p.x) > 5 || fabs(p.y) > 3 || p.z < 0 || p.z > 8); /* the sector is outside */
    }
    assert_true(scene.lower.x == -5 && scene.upper.z == 8);
    keller_scene_free(&scene);
    assert_true(scene.vertices == NULL && scene.wedge_count == 0);
    model_close(&model);
}

/* Turned any way: n to 1e-15, so 4 roundings of an angle. */
static void turned_box(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 100; seed++) {
        Model model;
        model_open(&model, seed);
        model_box(&model, v3(-5, -3, -4), v3(5, 3, 4), true, 0);
        model_turn(&model);
        KellerScene scene = build(&model);
        assert_int_equal(scene.face_count, 6);
        assert_int_equal(scene.wedge_count, 12);
        assert_int_equal(count_n(&scene, 1.5, 1e-15), 12);
        keller_scene_free(&scene);
        model_close(&model);
    }
}

/* A prism over a triangle of 50, 60 and 70 degrees: outside 2 - angle/pi at the three uprights and 1.5 around both
 * lids; inside, 50 and 70 degrees diffract, 60 (a third of pi) and the lids' 90 do not. */
static void prism(void **state)
{
    (void)state;
    const double deg = PI / 180;
    /* Law of sines, diameter 10: the side opposite 70 degrees from (0, 0) to (c, 0). */
    double c = 10 * sin(70 * deg), b = 10 * sin(60 * deg);
    const double xy[3][2] = {{0, 0}, {c, 0}, {b * cos(50 * deg), b * sin(50 * deg)}};
    for (uint64_t seed = 0; seed < 20; seed++) {
        Model model;
        model_open(&model, seed + 1);
        model_prism(&model, 3, xy, 0, 7, true, true, 0);
        if (seed) model_turn(&model);
        KellerScene scene = build(&model);
        assert_int_equal(scene.face_count, 5);
        assert_int_equal(scene.wedge_count, 11);
        assert_int_equal(count_n(&scene, 1.5, 1e-14), 6);
        assert_int_equal(count_n(&scene, 2 - 50.0 / 180, 1e-14), 1);
        assert_int_equal(count_n(&scene, 2 - 60.0 / 180, 1e-14), 1);
        assert_int_equal(count_n(&scene, 2 - 70.0 / 180, 1e-14), 1);
        assert_int_equal(count_n(&scene, 50.0 / 180, 1e-14), 1);
        assert_int_equal(count_n(&scene, 70.0 / 180, 1e-14), 1);
        keller_scene_free(&scene);
        model_close(&model);
    }
}

/* A screen has four rims; a sheet of two layers, cut alike or not, or as far apart as touching, is one screen. */
static void screen(void **state)
{
    (void)state;
    for (int variant = 0; variant < 4; variant++) {
        Model model;
        model_open(&model, 1);
        /* The diagonal of 5 m makes the contact tolerance 2.4e-6 m; up to a quarter of it is welded. */
        double y = variant == 3 ? 1.5e-6 : 0;
        model_quad(&model, v3(0, 0, 0), v3(4, 0, 0), v3(4, 0, 3), v3(0, 0, 3), false, 0);
        if (variant) model_quad(&model, v3(0, y, 0), v3(0, y, 3), v3(4, y, 3), v3(4, y, 0), variant == 2, 0);
        if (variant == 3) { /* a box thinner than the tolerance */
            model_quad(&model, v3(0, 0, 0), v3(4, 0, 0), v3(4, y, 0), v3(0, y, 0), false, 0);
            model_quad(&model, v3(0, 0, 3), v3(4, 0, 3), v3(4, y, 3), v3(0, y, 3), false, 0);
            model_quad(&model, v3(0, 0, 0), v3(0, 0, 3), v3(0, y, 3), v3(0, y, 0), false, 0);
            model_quad(&model, v3(4, 0, 0), v3(4, 0, 3), v3(4, y, 3), v3(4, y, 0), false, 0);
        }
        KellerScene scene = build(&model);
        assert_int_equal(scene.face_count, 1);
        assert_int_equal(scene.wedge_count, 4);
        assert_int_equal(count_n(&scene, 2, 0), 4);
        assert_int_equal(scene.report.duplicate, variant == 1 ? 2 : 0);
        if (variant == 0)
            for (int t = 0; t < 2; t++) /* the diagonal is inside the face, the other two sides are its border */
                assert_int_equal((scene.triangle_border[t] & 1) + (scene.triangle_border[t] >> 1 & 1) +
                                     (scene.triangle_border[t] >> 2), 2);
        keller_scene_free(&scene);
        model_close(&model);
    }
}

/* Three walls in one edge: a sector between each two neighbours. At 120 degrees 1/n = 1.5: all diffract, and there are
 * three rims to each wall. At 90, 120 and 150 the first does not. */
static void three_walls(void **state)
{
    (void)state;
    const double turns[2][3] = {{0, 120, 240}, {0, 90, 210}};
    for (int variant = 0; variant < 2; variant++) {
        Model model;
        model_open(&model, 1);
        for (int i = 0; i < 3; i++) {
            double x = 5 * cos(turns[variant][i] * PI / 180), y = 5 * sin(turns[variant][i] * PI / 180);
            model_quad(&model, v3(0, 0, 0), v3(x, y, 0), v3(x, y, 4), v3(0, 0, 4), i & 1, 0);
        }
        model_flip(&model, false);
        KellerScene scene = build(&model);
        assert_int_equal(scene.triangle_count, 6);
        assert_int_equal(scene.report.complex_edges, 1);
        assert_int_equal(scene.face_count, 3);
        assert_int_equal(count_n(&scene, 2, 0), 9);
        if (variant == 0) assert_int_equal(count_n(&scene, 2.0 / 3, 1e-15), 3);
        else assert_int_equal(count_n(&scene, 2.0 / 3, 1e-15) + count_n(&scene, 150.0 / 180, 1e-15), 2);
        assert_int_equal(scene.wedge_count, variant == 0 ? 12 : 11);
        keller_scene_free(&scene);
        model_close(&model);
    }
}

/* Two leaves joined at an angle near pi: below the flat angle the edge does not diffract, above it does on both
 * sides. */
static void flat_angle(void **state)
{
    (void)state;
    const double fold[2] = {0.5 * KELLER_FLAT_ANGLE, 3 * KELLER_FLAT_ANGLE};
    for (int i = 0; i < 2; i++) {
        Model model;
        model_open(&model, 1);
        model_quad(&model, v3(-5, 0, 0), v3(0, 0, 0), v3(0, 4, 0), v3(-5, 4, 0), false, 0);
        model_quad(&model, v3(0, 0, 0), v3(5, 0, 5 * tan(fold[i])), v3(5, 4, 5 * tan(fold[i])), v3(0, 4, 0), true, 0);
        KellerScene scene = build(&model);
        assert_int_equal(scene.wedge_count, i == 0 ? 6 : 8);
        assert_int_equal(count_n(&scene, 1 + fold[i] / PI, 1e-14), i);
        assert_int_equal(count_n(&scene, 1 - fold[i] / PI, 1e-14), i);
        keller_scene_free(&scene);
        model_close(&model);
    }
}

static void nothing(void **state)
{
    (void)state;
    Model model;
    model_open(&model, 1);
    KellerScene scene = build(&model);
    assert_int_equal(scene.triangle_count + scene.face_count + scene.wedge_count + scene.vertex_count, 0);
    assert_true(v3_norm(scene.lower) == 0 && v3_norm(scene.upper) == 0 && scene.contact == 1e-6);
    assert_string_equal(scene.report.notes, "");
    keller_scene_free(&scene);
    /* One triangle has three rims; one without area is left out. */
    model_triangle(&model, v3(0, 0, 0), v3(3, 0, 0), v3(1, 2, 0), 0);
    model_triangle(&model, v3(0, 0, 0), v3(1, 0, 0), v3(3, 0, 0), 0);
    scene = build(&model);
    assert_int_equal(scene.triangle_count, 1);
    assert_int_equal(scene.wedge_count, 3);
    assert_int_equal(count_n(&scene, 2, 0), 3);
    assert_int_equal(scene.triangle_border[0], 7);
    assert_int_equal(scene.report.degenerate, 1);
    assert_int_equal(scene.vertex_count, 3);
    keller_scene_free(&scene);
    model.soup.vertices[0].x = 1e13;
    KellerError error;
    assert_int_equal(keller_scene_build(&model.soup, &scene, &error), KELLER_BAD_INPUT);
    assert_non_null(strstr(error.message, "vertex 0 is at (1e+13"));
    assert_int_equal(scene.triangle_count, 0);
    model_close(&model);
}

/* Welding and dropping, each just below and just above its bound: a quarter and a ten-thousandth of the tolerance. */
static void small_distances(void **state)
{
    (void)state;
    const double welded[4] = {0.2, 0.3, 0.025, 2.5}, height[4] = {0.5e-4, 2e-4, 0.5e-5, 2e-3};
    double contact = keller_scene_contact(5);
    for (int i = 0; i < 4; i++) {
        Model model;
        model_open(&model, 1);
        model_triangle(&model, v3(0, 0, 0), v3(4, 0, 0), v3(4, 0, 3), 0);
        model_triangle(&model, v3(0, 0, welded[i] * contact), v3(4, 0, 3), v3(0, 0, 3), 0);
        KellerScene scene = model_scene(&model);
        assert_int_equal(scene.report.welded_vertices, 1 + (welded[i] < 0.25));
        assert_int_equal(scene.vertex_count, 5 - (welded[i] < 0.25));
        assert_int_equal(count_n(&scene, 2, 0), welded[i] < 1 ? 4 : 6);
        keller_scene_free(&scene);
        model_close(&model);
        model_open(&model, 1);
        model_triangle(&model, v3(0, 0, 0), v3(4, 0, 0), v3(4, 0, 3), 0);
        model_triangle(&model, v3(0, 0, 0), v3(2, 0, -height[i] * contact), v3(4, 0, 0), 0);
        scene = model_scene(&model);
        assert_int_equal(scene.report.degenerate, height[i] < 1e-4);
        assert_int_equal(scene.face_count, 1);
        assert_int_equal(scene.wedge_count, 3);
        keller_scene_free(&scene);
        model_close(&model);
    }
}

/* A regular polygon with many corners keeps its corners: small bends do not add up to one straight edge. */
static void disc(void **state)
{
    (void)state;
    enum { CORNERS = 256 };
    Model model;
    model_open(&model, 1);
    for (int i = 0; i < CORNERS; i++) {
        double a = 2 * PI * i / CORNERS, b = 2 * PI * (i + 1) / CORNERS;
        model_triangle(&model, v3(0, 0, 0), v3(cos(a), sin(a), 0), v3(cos(b), sin(b), 0), 0);
    }
    KellerScene scene = build(&model);
    assert_int_equal(scene.face_count, 1);
    assert_int_equal(scene.wedge_count, CORNERS);
    keller_scene_free(&scene);
    model_close(&model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(box),
        cmocka_unit_test(turned_box),
        cmocka_unit_test(prism),
        cmocka_unit_test(screen),
        cmocka_unit_test(three_walls),
        cmocka_unit_test(flat_angle),
        cmocka_unit_test(nothing),
        cmocka_unit_test(small_distances),
        cmocka_unit_test(disc),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests_name("scene", tests, NULL, NULL);
}
