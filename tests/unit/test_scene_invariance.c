/* Faces and wedges do not depend on how the file puts them. */
#include "scene_check.h"

/* Some of everything: turned boxes, a prism, a screen, of two materials, some touching. */
static void city(Model *model, uint64_t seed)
{
    const double xy[3][2] = {{12, 0}, {18, 1}, {14, 6}};
    model_open(model, seed);
    model_quad(model, v3(-20, -20, 0), v3(30, -20, 0), v3(30, 25, 0), v3(-20, 25, 0), false, 1);
    model_box(model, v3(0, 0, 0), v3(5, 6, 8), false, 0);
    model_box(model, v3(5, 2, 0), v3(9, 8, 5), true, 1);
    model_prism(model, 3, xy, 0, 7, false, true, 0);
    model_quad(model, v3(-8, -5, 1), v3(-2, -6, 1), v3(-2, -6, 4), v3(-8, -5, 4), true, 0);
}

static void assert_equal_bits(const void *a, const void *b, size_t count, size_t size)
{
    if (count) assert_memory_equal(a, b, count * size);
}

/* Order of triangles, vertices, corners, materials and objects, and orientation: the same bits. */
static void shuffled(void **state)
{
    (void)state;
    Model model;
    city(&model, 3);
    model_cut(&model, 60, true);
    model_turn(&model);
    /* vertices a little apart, so that the welding must choose; the copies of one corner are all different */
    for (size_t i = 0; i < model.soup.vertex_count; i++)
        model.soup.vertices[i].x += model_random(&model, -1e-7, 1e-7);
    KellerScene a = model_scene(&model);
    for (int round = 0; round < 10; round++) {
        model_shuffle(&model);
        model_flip(&model, false);
        KellerScene b = model_scene(&model);
        assert_int_equal(a.vertex_count, b.vertex_count);
        assert_int_equal(a.triangle_count, b.triangle_count);
        assert_int_equal(a.face_count, b.face_count);
        assert_int_equal(a.wedge_count, b.wedge_count);
        assert_equal_bits(a.vertices, b.vertices, a.vertex_count, sizeof *a.vertices);
        assert_equal_bits(a.triangles, b.triangles, a.triangle_count, sizeof *a.triangles);
        assert_equal_bits(a.triangle_face, b.triangle_face, a.triangle_count, sizeof *a.triangle_face);
        assert_equal_bits(a.triangle_object, b.triangle_object, a.triangle_count, sizeof *a.triangle_object);
        assert_equal_bits(a.triangle_border, b.triangle_border, a.triangle_count, sizeof *a.triangle_border);
        assert_equal_bits(a.face_triangles, b.face_triangles, a.triangle_count, sizeof *a.face_triangles);
        assert_equal_bits(a.faces, b.faces, a.face_count, sizeof *a.faces);
        assert_equal_bits(a.wedges, b.wedges, a.wedge_count, sizeof *a.wedges);
        assert_int_equal(a.wedge_plane_count, b.wedge_plane_count);
        assert_equal_bits(a.wedge_planes, b.wedge_planes, a.wedge_plane_count, sizeof *a.wedge_planes);
        for (size_t i = 0; i < 2; i++) {
            assert_string_equal(a.materials[i].name, b.materials[i].name);
            assert_string_equal(a.objects[i], b.objects[i]);
        }
        assert_string_equal(a.report.notes, b.report.notes);
        for (size_t t = 0; t < b.triangle_count; t++) /* the source is the soup's triangle of the same material */
            assert_string_equal(b.materials[b.faces[b.triangle_face[t]].material].name,
                                model.soup.materials[model.soup.material[b.triangle_source[t]]].name);
        keller_scene_free(&b);
    }
    keller_scene_free(&a);
    model_close(&model);
}

/* Splitting walls into more triangles, with and without T-junctions, changes no face and no wedge. */
static void retriangulated(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 40; seed++) {
        Model model;
        city(&model, seed);
        if (seed % 2) model_turn(&model);
        KellerScene a = build(&model);
        model_cut(&model, 10 * (int)seed, seed % 4 < 2);
        KellerScene b = build(&model);
        assert_same(&a, &b, 1e-12);
        keller_scene_free(&a);
        keller_scene_free(&b);
        model_close(&model);
    }
}

/* Boxes at whole coordinates, so that walls, edges and corners fall together in all ways, of two materials. */
static void pile(Model *model, uint64_t seed, int boxes)
{
    model_open(model, seed);
    for (int i = 0; i < boxes; i++) {
        KellerVec3 a =
            v3(floor(model_random(model, 0, 5)), floor(model_random(model, 0, 5)), floor(model_random(model, 0, 3)));
        KellerVec3 size = v3(1 + floor(model_random(model, 0, 4)), 1 + floor(model_random(model, 0, 4)),
                             1 + floor(model_random(model, 0, 4)));
        uint32_t material = model_random(model, 0, 1) < 0.5;
        model_box(model, a, v3_add(a, size), model_random(model, 0, 1) < 0.7, material);
    }
}

/* The pile again with other triangles: the same faces, where sheets of one material overlap too, and the same
 * wedges. */
static void retriangulated_pile(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 150; seed++) {
        Model model;
        pile(&model, seed, 2 + (int)(seed % 4));
        if (seed % 2) model_turn(&model);
        KellerScene a = build(&model);
        model_cut(&model, 40, seed % 4 < 2);
        model_flip(&model, false);
        KellerScene b = build(&model);
        assert_same(&a, &b, 1e-12);
        keller_scene_free(&a);
        keller_scene_free(&b);
        model_close(&model);
    }
}

/* Ten kilometres away: coordinates there are rounded to 1.8e-12 m, angles of the smallest faces (2 m) to 1e-12. */
static void far_away(void **state)
{
    (void)state;
    Model model;
    city(&model, 5);
    model_cut(&model, 40, true);
    KellerScene a = build(&model);
    model_move(&model, v3(10000, -10000, 100));
    KellerScene b = build(&model);
    assert_int_equal(a.face_count, b.face_count);
    assert_int_equal(a.plane_count, b.plane_count);
    assert_int_equal(a.wedge_count, b.wedge_count);
    for (size_t i = 0; i < a.wedge_count; i++) {
        size_t found = 0;
        for (size_t k = 0; k < b.wedge_count; k++)
            found += fabs(a.wedges[i].n - b.wedges[k].n) < 1e-10 &&
                     v3_distance(v3_add(a.wedges[i].origin, v3(10000, -10000, 100)), b.wedges[k].origin) < 1e-9 &&
                     v3_distance(a.wedges[i].tangent0, b.wedges[k].tangent0) < 1e-10 &&
                     v3_distance(a.wedges[i].direction, b.wedges[k].direction) < 1e-10;
        assert_int_equal(found, 1);
    }
    keller_scene_free(&a);
    keller_scene_free(&b);
    model_close(&model);
}

/* A wall of a box is cut by a sliver of the given height along its side or through its middle: nothing changes. */
static void slivers(void **state)
{
    (void)state;
    /* The contact tolerance is 5.3e-6 m: 2^-21 of the diagonal of 11.2 m. */
    const double heights[] = {1e-12, 1e-9, 1e-7, 1e-6, 2e-6, 3e-6, 5e-6, 1e-5, 1e-4, 1e-2};
    for (size_t i = 0; i < sizeof heights / sizeof heights[0]; i++)
        for (int where = 0; where < 4; where++) {
            Model model;
            model_open(&model, 7);
            model_box(&model, v3(0, 0, 0), v3(5, 6, 8), true, 0);
            KellerScene a = build(&model);
            double h = heights[i];
            /* take the roof (z = 8) out, and put it back in pieces */
            KellerSoup *soup = &model.soup;
            size_t kept = 0;
            for (size_t t = 0; t < soup->triangle_count; t++) {
                const uint32_t *v = soup->triangles[t];
                if (soup->vertices[v[0]].z == 8 && soup->vertices[v[1]].z == 8 && soup->vertices[v[2]].z == 8) continue;
                memmove(soup->triangles[kept++], v, sizeof soup->triangles[0]);
            }
            soup->triangle_count = kept;
            KellerVec3 p = v3(0, 0, 8), q = v3(5, 0, 8), r = v3(5, 6, 8), s = v3(0, 6, 8), m = v3(2.5, 3, 8);
            if (where == 0 || where == 1) { /* an apex over the middle of the side p-q; where 1: two of them stacked */
                KellerVec3 apex = v3(2, h, 8), second = v3(2.5, 2 * h, 8);
                model_triangle(&model, p, q, apex, 0);
                if (where == 1) {
                    model_triangle(&model, p, apex, second, 0);
                    model_triangle(&model, apex, q, second, 0);
                    apex = second;
                }
                model_triangle(&model, p, apex, s, 0);
                model_triangle(&model, apex, q, r, 0);
                model_triangle(&model, apex, r, s, 0);
            } else if (where == 2) { /* along the diagonal */
                KellerVec3 apex = v3_add(m, v3_scale(v3_unit(v3(-6, 5, 0)), h));
                model_triangle(&model, p, q, r, 0);
                model_triangle(&model, p, r, apex, 0);
                model_triangle(&model, p, apex, s, 0);
                model_triangle(&model, apex, r, s, 0);
            } else { /* the sliver missing: a T-junction */
                KellerVec3 apex = v3_add(m, v3_scale(v3_unit(v3(-6, 5, 0)), h < 5.3e-6 ? h : 0));
                model_triangle(&model, p, q, r, 0);
                model_triangle(&model, p, apex, s, 0);
                model_triangle(&model, apex, r, s, 0);
            }
            KellerScene b = build(&model);
            assert_same(&a, &b, 1e-12);
            keller_scene_free(&a);
            keller_scene_free(&b);
            model_close(&model);
        }
}

/* A wall doubled: the same triangles become one of two sheets, other triangles are one face, another material shares the plane. */
static void doubled(void **state)
{
    (void)state;
    for (int variant = 0; variant < 3; variant++) {
        Model model;
        model_open(&model, 7);
        model_box(&model, v3(0, 0, 0), v3(5, 6, 8), true, 1);
        KellerScene a = build(&model);
        /* model_box cuts the wall y = 0 along the diagonal from (0, 0, 0) */
        model_quad(&model, v3(0, 0, 0), v3(0, 0, 8), v3(5, 0, 8), v3(5, 0, 0), variant == 1, variant == 2 ? 0 : 1);
        KellerScene b = build(&model);
        assert_int_equal(b.report.duplicate, variant == 0 ? 2 : 0);
        assert_int_equal(b.triangle_count, variant == 0 ? 12 : 14);
        size_t sheets = 0, doubled = 0;
        for (size_t t = 0; t < b.triangle_count; t++) {
            sheets += b.triangle_sheets[t];
            doubled += b.triangle_sheets[t] == 2;
        }
        assert_int_equal(sheets, 14);
        assert_int_equal(doubled, variant == 0 ? 2 : 0);
        assert_int_equal(b.plane_count, 6);
        assert_int_equal(b.face_count, variant == 2 ? 7 : 6);
        assert_int_equal(b.wedge_count, 12);
        assert_int_equal(count_n(&b, 1.5, 0), 12);
        if (variant < 2) assert_same(&a, &b, 1e-15);
        keller_scene_free(&a);
        keller_scene_free(&b);
        model_close(&model);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shuffled),
        cmocka_unit_test(retriangulated),
        cmocka_unit_test(retriangulated_pile),
        cmocka_unit_test(far_away),
        cmocka_unit_test(slivers),
        cmocka_unit_test(doubled),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests_name("scene_invariance", tests, NULL, NULL);
}
