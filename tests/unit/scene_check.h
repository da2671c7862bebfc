/* What the tests of scenes ask of every scene. */
#ifndef KELLER_TESTS_SCENE_CHECK_H
#define KELLER_TESTS_SCENE_CHECK_H
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

static inline KellerVec3 tangent_at(const KellerWedge *w, double angle)
{
    return v3_add(v3_scale(w->tangent0, cos(angle)), v3_scale(w->normal0, sin(angle)));
}

/* What keller/scene.h promises of every wedge, whatever the scene. */
static inline void assert_sound(const KellerScene *scene)
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
    uint32_t *last = calloc(scene->plane_count + 1, sizeof *last); /* face of each plane so far, and 1 */
    assert_non_null(last);
    for (size_t f = 0; f < scene->face_count; f++) {
        const KellerFace *face = &scene->faces[f];
        assert_true(face->triangle_end > face->triangle_begin && face->plane < scene->plane_count);
        assert_int_equal(face->before, last[face->plane] - 1);
        last[face->plane] = (uint32_t)f + 1;
        for (uint32_t k = face->triangle_begin; k < face->triangle_end; k++) {
            uint32_t t = scene->face_triangles[k];
            assert_int_equal(scene->triangle_face[t], f);
            for (int i = 0; i < 3; i++)
                assert_true(fabs(v3_dot(face->normal, scene->vertices[scene->triangles[t][i]]) - face->offset) <=
                            2 * scene->contact);
        }
    }
    free(last);
}

static inline KellerScene build(const Model *model)
{
    KellerScene scene = model_scene(model);
    assert_sound(&scene);
    return scene;
}

static inline size_t count_n(const KellerScene *scene, double n, double tolerance)
{
    size_t count = 0;
    for (size_t i = 0; i < scene->wedge_count; i++) count += fabs(scene->wedges[i].n - n) <= tolerance;
    return count;
}

/* The same faces (planes, areas do not matter here) and the same wedges, in space, one to one. */
static inline void assert_same(const KellerScene *a, const KellerScene *b, double tolerance)
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
            found += v3_distance(w->origin, v->origin) <= tolerance * 100 &&
                     fabs(w->length - v->length) <= tolerance * 100 &&
                     v3_distance(w->direction, v->direction) <= tolerance && fabs(w->n - v->n) <= tolerance &&
                     v3_distance(w->tangent0, v->tangent0) <= tolerance &&
                     v3_distance(w->normal0, v->normal0) <= tolerance;
        }
        assert_int_equal(found, 1);
    }
}
#endif
