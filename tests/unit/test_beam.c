/* Bundles of rays against single rays drawn from them: nothing that a ray meets may be called missed or cut off. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <string.h>

#include "keller/ray.h"
#include "path/beam.h"
#include "random.h"

enum { FACES = 3 };

/* A scene of one quadrilateral face and two triangles, as much of one as bundles look at. */
typedef struct {
    KellerScene scene;
    KellerVec3 vertices[10];
    uint32_t triangles[4][3], face_triangles[4];
    uint8_t border[4];
    KellerFace faces[FACES];
} Fixture;

static void fill(Fixture *f, Random *r, double offset, double scale)
{
    memset(f, 0, sizeof *f);
    KellerVec3 middle = v3(offset, -offset, 0);
    for (uint32_t k = 0; k < FACES; k++) {
        KellerVec3 at = v3_add(middle, random_point(r, 10 * scale)), x = random_unit(r), y = v3_cross(x, random_unit(r));
        double size = scale * pow(10, random_in(r, -1, 1));
        uint32_t v = k == 0 ? 0 : 4 + 3 * (k - 1), t = k == 0 ? 0 : k + 1;
        for (uint32_t i = 0; i < (k == 0 ? 4 : 3); i++) {
            double angle = 2 * M_PI * (i + random_in(r, 0, 0.5)) / (k == 0 ? 4 : 3);
            f->vertices[v + i] = v3_madd(v3_madd(at, x, size * cos(angle)), v3_unit(y), size * sin(angle));
            if (k == 0 && i == 3) /* into the plane of the others, between them: the quadrilateral is convex */
                f->vertices[3] = v3_sub(v3_add(f->vertices[0], f->vertices[2]), f->vertices[1]);
        }
        f->triangles[t][0] = v, f->triangles[t][1] = v + 1, f->triangles[t][2] = v + 2;
        f->border[t] = 7;
        f->faces[k].triangle_begin = t;
        f->faces[k].triangle_end = t + 1;
        if (k == 0) {
            f->triangles[1][0] = 0, f->triangles[1][1] = 2, f->triangles[1][2] = 3;
            f->border[0] = 3, f->border[1] = 6;
            f->faces[0].triangle_end = 2;
        }
        f->faces[k].normal = v3_unit(v3_cross(v3_sub(f->vertices[v + 1], f->vertices[v]), v3_sub(f->vertices[v + 2], f->vertices[v])));
        f->faces[k].offset = v3_dot(f->faces[k].normal, f->vertices[v]);
        f->faces[k].plane = k;
    }
    for (uint32_t t = 0; t < 4; t++) f->face_triangles[t] = t;
    f->scene = (KellerScene){.vertex_count = 10, .vertices = f->vertices, .triangle_count = 4, .triangles = f->triangles,
                             .triangle_border = f->border, .face_count = FACES, .faces = f->faces,
                             .face_triangles = f->face_triangles};
    f->scene.lower = v3_sub(middle, v3(30 * scale, 30 * scale, 30 * scale));
    f->scene.upper = v3_add(middle, v3(30 * scale, 30 * scale, 30 * scale));
    f->scene.contact = keller_scene_contact(100 * scale);
}

/* Of one source or two; aimed at a face every other time, or from its very plane, or at its corner. */
static Bundle draw(const Fixture *f, Random *r, double scale)
{
    Bundle b = {.source_count = (uint32_t[]){1, 2}[random_u32(r) % 2]};
    KellerVec3 middle = v3_scale(v3_add(f->scene.lower, f->scene.upper), 0.5), at = v3_add(middle, random_point(r, 15 * scale));
    if (random_u32(r) % 8 == 0) at = v3_scale(v3_add(f->vertices[0], f->vertices[2]), 0.5);
    KellerVec3 x = v3_scale(random_unit(r), scale * random_in(r, 0, 3));
    for (uint32_t i = 0; i < b.source_count; i++)
        b.source[i] = v3_madd(at, x, i);
    KellerVec3 axis[3] = {{0, 0, 0}};
    axis[2] = random_u32(r) % 2 ? random_unit(r) : v3_sub(f->vertices[random_u32(r) % 4], at);
    axis[2] = v3_norm(axis[2]) > 0 ? v3_unit(axis[2]) : v3(0, 0, 1);
    axis[0] = v3_perpendicular(axis[2]);
    axis[1] = v3_cross(axis[2], axis[0]);
    Slopes s;
    for (int k = 0; k < 2; k++) {
        double width = pow(10, random_in(r, -9, 0)), low = random_u32(r) % 3 ? -width * random_in(r, 0, 1) : 0;
        s.low[k] = low;
        s.high[k] = low + width;
    }
    b.window = window_of(axis, &s);
    uint32_t cuts = random_u32(r) % 4;
    for (uint32_t i = 0; i < cuts; i++) { /* through a random inner direction */
        KellerVec3 d = v3(0, 0, 0);
        for (uint32_t k = 0; k < b.window.count; k++) d = v3_madd(d, b.window.corner[k], random_in(r, 0, 1));
        window_cut(&b.window, v3_unit(v3_cross(d, random_unit(r))));
    }
    return b;
}

/* One of its rays; on a side or along a corner of the window every other time. */
static void draw_ray(const Bundle *b, Random *r, KellerVec3 *origin, KellerVec3 *direction)
{
    double sum = 0, weight[SOURCES];
    *origin = *direction = v3(0, 0, 0);
    for (uint32_t i = 0; i < b->source_count; i++) sum += weight[i] = random_u32(r) % 3 ? random_in(r, 0, 1) : i == 0;
    if (!(sum > 0)) sum = weight[0] = 1;
    for (uint32_t i = 0; i < b->source_count; i++) *origin = v3_madd(*origin, b->source[i], weight[i] / sum);
    uint32_t corner = random_u32(r) % b->window.count;
    bool border = random_u32(r) % 2;
    for (uint32_t k = 0; k < b->window.count; k++)
        *direction = v3_madd(*direction, b->window.corner[k], border && k != corner ? 0 : random_in(r, 0.01, 1));
    if (border && random_u32(r) % 2)
        *direction = v3_madd(*direction, b->window.corner[(corner + 1) % b->window.count], random_in(r, 0, 1));
    *direction = v3_unit(*direction);
}

/* Is the direction in the window, to within the angle that windows are trusted to? */
static bool holds(const Window *w, KellerVec3 d)
{
    for (uint32_t k = 0; k < w->count; k++)
        if (v3_dot(w->side[k], d) > 1.5 * WINDOW_PAD) return false;
    return true;
}

static void nothing_met_is_missed(void **state)
{
    (void)state;
    Random r = {20};
    uint64_t hits = 0, misses = 0, narrowed = 0, crossings = 0;
    for (int round = 0; round < 40000; round++) {
        Fixture f;
        double scale = round % 5 == 0 ? pow(10, random_in(&r, -2, 3)) : 1, offset = round % 7 == 0 ? 1e5 : 0;
        fill(&f, &r, offset, scale);
        Bundle b = draw(&f, &r, scale);
        BundleTest test = bundle_test(&b, &f.scene);
        bool missed[4], narrow[FACES], crosses[FACES];
        double steep[FACES];
        Bundle narrower[FACES];
        KellerRange range[FACES];
        KellerVec3 along = window_middle(&b.window);
        for (uint32_t t = 0; t < 4; t++) {
            KellerVec3 v[3] = {f.vertices[f.triangles[t][0]], f.vertices[f.triangles[t][1]], f.vertices[f.triangles[t][2]]};
            missed[t] = bundle_misses(&test, 3, v);
            misses += missed[t];
        }
        for (uint32_t k = 0; k < FACES; k++) {
            narrower[k] = b;
            narrow[k] = bundle_narrow(&narrower[k], &f.scene, k);
            crosses[k] = bundle_crossing(&b, &f.faces[k], f.scene.lower, along, &range[k], &steep[k]);
            narrowed += !narrow[k];
            crossings += crosses[k];
        }
        for (int i = 0; i < 40; i++) {
            KellerVec3 o, d;
            draw_ray(&b, &r, &o, &d);
            KellerRay ray = keller_ray(o, d);
            for (uint32_t t = 0; t < 4; t++) {
                const uint32_t *c = f.triangles[t];
                double at;
                uint32_t face = t < 2 ? 0 : t - 1;
                if (!keller_ray_triangle(&ray, f.vertices[c[0]], f.vertices[c[1]], f.vertices[c[2]], (KellerRange){0, INFINITY}, &at, NULL))
                    continue;
                hits++;
                assert_false(missed[t]);
                if (!(at > 100 * f.scene.contact)) continue; /* from the face itself it is not narrowed, but rounding may say it is */
                assert_true(narrow[face]);
                assert_true(holds(&narrower[face].window, d));
            }
            for (uint32_t k = 0; k < FACES; k++) {
                double down = v3_dot(f.faces[k].normal, d), at = (f.faces[k].offset - v3_dot(f.faces[k].normal, o)) / down;
                if (!crosses[k]) continue;
                double z = v3_dot(along, v3_sub(v3_madd(o, d, at), f.scene.lower)), loose = 1e-9 * (at + 100 * scale + offset) / steep[k];
                assert_true(at > 0 && fabs(down) >= steep[k] * (1 - 1e-9));
                assert_true(z >= range[k].near - loose && z <= range[k].far + loose);
            }
        }
    }
    assert_true(hits > 50000 && misses > 20000 && narrowed > 5000 && crossings > 5000);
}

/* Rays aimed at points of an edge from the sources: each is in the part of it that the bundle may meet. */
static void parts_of_edges(void **state)
{
    (void)state;
    Random r = {21};
    uint64_t met = 0, cut = 0;
    for (int round = 0; round < 100000; round++) {
        Fixture f;
        fill(&f, &r, round % 3 ? 0 : 1e5, 1);
        Bundle b = draw(&f, &r, 1);
        BundleTest test = bundle_test(&b, &f.scene);
        KellerVec3 edge[2] = {f.vertices[0], f.vertices[1]}, o, d;
        double from = 0, to = 1;
        bool part = bundle_part(&test, edge[0], edge[1], &from, &to), misses = bundle_misses(&test, 2, edge);
        cut += !part || from > 0 || to < 1;
        for (int i = 0; i < 20; i++) {
            draw_ray(&b, &r, &o, &d);
            double t = random_in(&r, 0, 1);
            d = v3_unit(v3_sub(v3_madd(edge[0], v3_sub(edge[1], edge[0]), t), o));
            bool inside = true;
            for (uint32_t k = 0; k < b.window.count; k++) inside = inside && v3_dot(b.window.side[k], d) <= 0;
            if (!inside || !(v3_dot(d, window_middle(&b.window)) > 0)) continue;
            met++;
            assert_true(part && !misses && t >= from && t <= to);
        }
    }
    assert_true(met > 5000 && cut > 20000);
}

/* Windows of many corners, halved until they are narrow: every direction of the whole is in one of the parts, and the parts come to an
 * end. (A half that had more corners than there is room for was the whole again.) */
static void halves_hold_the_whole(void **state)
{
    (void)state;
    Random r = {9};
    size_t full = 0;
    for (int i = 0; i < 2000; i++) {
        KellerVec3 axis[3] = {[2] = random_unit(&r)};
        axis[0] = v3_perpendicular(axis[2]);
        axis[1] = v3_cross(axis[2], axis[0]);
        const double size = pow(10, random_in(&r, -6, 0));
        Window w = window_of(axis, &(Slopes){{-size, -size}, {size, size}});
        for (int k = 0; k < 12; k++) /* corners cut off */
            window_cut(&w, v3_unit(v3_madd(v3_add(v3_scale(axis[0], random_in(&r, -1, 1)), v3_scale(axis[1], random_in(&r, -1, 1))), axis[2], -size * random_in(&r, 0.6, 1))));
        full += w.count == WINDOW_MOST;
        Window parts[2];
        int n = 1;
        KellerVec3 across, d = window_middle(&w);
        for (uint32_t k = 0; k < w.count; k++) d = v3_madd(d, w.corner[k], random_in(&r, 0, 1));
        int depth = 0;
        for (; n > 0 && depth < 200; depth++) {
            n = window_halves(&w, parts);
            bool held = n == 0;
            for (int k = 0; k < n; k++) {
                bool in = true;
                for (uint32_t j = 0; j < parts[k].count; j++) in = in && v3_dot(parts[k].side[j], d) <= WINDOW_PAD * v3_norm(d);
                if (in && !held) w = parts[k];
                held = held || in;
            }
            assert_true(held);
        }
        assert_true(depth < 200);
        assert_true(window_width(&w, &across) <= WINDOW_LEAST);
    }
    assert_true(full > 100);
}

/* Seven corners close together and one far off, as the corners of a rounded tip of a face are from a source close to it: no cone holds all,
 * and there is no room for the corners of a half. */
static void lopsided_windows_are_halved(void **state)
{
    (void)state;
    Random r = {10};
    for (int i = 0; i < 1000; i++) {
        KellerVec3 axis[3] = {[2] = random_unit(&r)}, across;
        axis[0] = v3_perpendicular(axis[2]);
        axis[1] = v3_cross(axis[2], axis[0]);
        Window w = {.count = WINDOW_MOST}, half[2];
        const double size = random_in(&r, 0.01, 0.2);
        for (uint32_t k = 0; k < w.count; k++) { /* on the far side of a circle */
            const double angle = (0.75 + k / 6.0) * M_PI, x = k < 7 ? -0.8 + size * cos(angle) : 0.95, y = k < 7 ? -0.8 + size * sin(angle) : 0.95;
            w.corner[k] = v3_unit(v3_madd(v3_madd(axis[2], axis[0], x), axis[1], y));
        }
        for (uint32_t k = 0; k < w.count; k++) w.side[k] = v3_unit(v3_cross(w.corner[(k + 1) % w.count], w.corner[k]));
        assert_int_equal(window_halves(&w, half), 2);
        for (int k = 0; k < 2; k++) assert_true(window_width(&half[k], &across) < 0.8 * window_width(&w, &across));
        for (int n = 0; n < 20; n++) {
            KellerVec3 d = v3_scale(w.corner[7], random_in(&r, 0, 7));
            for (uint32_t k = 0; k < 7; k++) d = v3_madd(d, w.corner[k], random_in(&r, 0, 1));
            assert_true(holds(&half[0], v3_unit(d)) || holds(&half[1], v3_unit(d)));
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(halves_hold_the_whole), cmocka_unit_test(lopsided_windows_are_halved), cmocka_unit_test(nothing_met_is_missed), cmocka_unit_test(parts_of_edges)};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
