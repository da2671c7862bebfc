/* Faces and wedges of single bodies, and that they do not depend on how the file puts them. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "keller/scene.h"
#include "model.h"

#define PI 3.14159265358979323846

static KellerVec3 tangent_at(const KellerWedge *w, double angle)
{
    return v3_add(v3_scale(w->tangent0, cos(angle)), v3_scale(w->normal0, sin(angle)));
}

/* What keller/scene.h promises of every wedge, whatever the scene. */
static void assert_sound(const KellerScene *scene)
{
    for (size_t i = 0; i < scene->wedge_count; i++) {
        const KellerWedge *w = &scene->wedges[i];
        KellerVec3 a = scene->vertices[w->vertex[0]], b = scene->vertices[w->vertex[1]];
        assert_true(w->vertex[0] < scene->vertex_count && w->vertex[1] < scene->vertex_count);
        assert_true(a.x < b.x || (a.x == b.x && (a.y < b.y || (a.y == b.y && a.z < b.z))));
        assert_true(v3_distance(w->origin, a) == 0);
        assert_true(fabs(w->length - v3_distance(a, b)) <= 1e-15 * w->length);
        assert_true(v3_distance(v3_madd(a, w->direction, w->length), b) <= 1e-15 * (v3_norm(a) + w->length) * 4);
        assert_true(fabs(v3_norm(w->tangent0) - 1) < 1e-14 && fabs(v3_norm(w->normal0) - 1) < 1e-14);
        assert_true(fabs(v3_dot(w->tangent0, w->direction)) < 1e-14);
        assert_true(v3_distance(v3_cross(w->tangent0, w->normal0), w->direction) < 1e-14);
        assert_true(w->n > 0 && w->n <= 2);
        assert_true((w->face[0] == w->face[1]) == (w->n == 2));
        /* Both faces hold the edge; the 0-face is at angle 0 and the n-face at n pi. */
        for (int f = 0; f < 2; f++) {
            const KellerFace *face = &scene->faces[w->face[f]];
            assert_true(fabs(v3_dot(face->normal, a) - face->offset) <= scene->contact);
            assert_true(fabs(v3_dot(face->normal, b) - face->offset) <= scene->contact);
            assert_true(fabs(v3_dot(face->normal, tangent_at(w, f * w->n * PI))) < 1e-6);
            bool listed = false;
            for (uint32_t k = w->plane_begin; k < w->plane_end; k++) listed |= scene->wedge_planes[k] == face->plane;
            assert_true(listed);
        }
    }
    for (size_t f = 0; f < scene->face_count; f++) {
        const KellerFace *face = &scene->faces[f];
        assert_true(face->triangle_end > face->triangle_begin && face->plane < scene->plane_count);
        for (uint32_t k = face->triangle_begin; k < face->triangle_end; k++) {
            uint32_t t = scene->face_triangles[k];
            assert_int_equal(scene->triangle_face[t], f);
            for (int i = 0; i < 3; i++)
                assert_true(fabs(v3_dot(face->normal, scene->vertices[scene->triangles[t][i]]) - face->offset) <=
                            2 * scene->contact);
        }
    }
}

static KellerScene build(const Model *model)
{
    KellerScene scene = model_scene(model);
    assert_sound(&scene);
    return scene;
}

static size_t count_n(const KellerScene *scene, double n, double tolerance)
{
    size_t count = 0;
    for (size_t i = 0; i < scene->wedge_count; i++) count += fabs(scene->wedges[i].n - n) <= tolerance;
    return count;
}

/* The same faces (planes, areas do not matter here) and the same wedges, in space, one to one. */
static void assert_same(const KellerScene *a, const KellerScene *b, double tolerance)
{
    assert_int_equal(a->face_count, b->face_count);
    assert_int_equal(a->plane_count, b->plane_count);
    assert_int_equal(a->wedge_count, b->wedge_count);
    for (size_t i = 0; i < a->face_count; i++) {
        size_t found = 0;
        for (size_t k = 0; k < b->face_count; k++)
            found += v3_distance(a->faces[i].normal, b->faces[k].normal) <= tolerance &&
                     fabs(a->faces[i].offset - b->faces[k].offset) <= tolerance * 100 &&
                     a->faces[i].material == b->faces[k].material;
        assert_true(found >= 1);
    }
    for (size_t i = 0; i < a->wedge_count; i++) {
        const KellerWedge *w = &a->wedges[i];
        size_t found = 0;
        for (size_t k = 0; k < b->wedge_count; k++) {
            const KellerWedge *v = &b->wedges[k];
            found += v3_distance(w->origin, v->origin) <= tolerance * 100 && fabs(w->length - v->length) <= tolerance * 100 &&
                     v3_distance(w->direction, v->direction) <= tolerance && fabs(w->n - v->n) <= tolerance &&
                     v3_distance(w->tangent0, v->tangent0) <= tolerance && v3_distance(w->normal0, v->normal0) <= tolerance;
        }
        assert_int_equal(found, 1);
    }
}

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

/* Two leaves joined at an angle near pi: below the flat angle the edge does not diffract, above it does on both sides. */
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
        KellerVec3 a = v3(floor(model_random(model, 0, 5)), floor(model_random(model, 0, 5)), floor(model_random(model, 0, 3)));
        KellerVec3 size = v3(1 + floor(model_random(model, 0, 4)), 1 + floor(model_random(model, 0, 4)),
                             1 + floor(model_random(model, 0, 4)));
        uint32_t material = model_random(model, 0, 1) < 0.5;
        model_box(model, a, v3_add(a, size), model_random(model, 0, 1) < 0.7, material);
    }
}

/* The pile again with other triangles: the same faces, where sheets of one material overlap too, and the same wedges. */
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

/* A wall doubled: the same triangles are dropped, other triangles are one face, another material shares the plane. */
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
        cmocka_unit_test(box),         cmocka_unit_test(turned_box), cmocka_unit_test(prism),
        cmocka_unit_test(screen),      cmocka_unit_test(three_walls), cmocka_unit_test(flat_angle),
        cmocka_unit_test(shuffled),    cmocka_unit_test(retriangulated), cmocka_unit_test(retriangulated_pile), cmocka_unit_test(far_away),
        cmocka_unit_test(nothing),     cmocka_unit_test(slivers),    cmocka_unit_test(doubled),
        cmocka_unit_test(small_distances),
        cmocka_unit_test(disc),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests_name("scene", tests, NULL, NULL);
}
