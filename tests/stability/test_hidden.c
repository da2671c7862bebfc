/* What a search cuts off a beam from an edge, and what it calls hidden from it, against single rays that obey Keller's law; and what it calls dark
 * of an edge. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "path/lit.h"
#include "path/search.h"
#include "path/solve.h"
#include "plates.h"

enum { SCENES = 600, BEAMS = 400, RAYS = 40 };

typedef struct {
    KellerScene scene;
    KellerAccel *accel;
    TreeLimits limits;
    Search search;
} Fixture;

static void set_up(Fixture *f, uint64_t seed)
{
    KellerError error;
    PlatesScene plates = plates_random(seed, seed % 2 ? PLATES_AS_BUILT : PLATES_REFINED);
    assert_int_equal(keller_scene_build(&plates.soup, &f->scene, &error), KELLER_OK);
    assert_int_equal(keller_accel_build("bvh8", &f->scene, &f->accel, &error), KELLER_OK);
    soup_release(&plates.soup);
    f->limits = (TreeLimits){.scene = &f->scene, .accel = f->accel};
    f->search = (Search){.limits = &f->limits, .end = plates.tx, .stamp = calloc(f->scene.face_count + 1, sizeof(uint32_t))};
}

static void tear_down(Fixture *f)
{
    free(f->search.stamp);
    keller_accel_free(f->accel);
    keller_scene_free(&f->scene);
}

static KellerVec3 on_edge(const KellerWedge *w, double t) { return v3_madd(w->origin, w->direction, t); }

static KellerVec3 point_of(Random *r, double size)
{
    double x[3];                /* one after the other: arguments' order is the compiler's */
    for (int i = 0; i < 3; i++) x[i] = random_range(r, -size, size);
    return v3(x[0], x[1], x[2]);
}

/* A point of the face, or near a border of it. */
static KellerVec3 on_face(const KellerScene *scene, uint32_t face, Random *r)
{
    const KellerFace *f = &scene->faces[face];
    const uint32_t *t = scene->triangles[scene->face_triangles[f->triangle_begin + random_below(r, f->triangle_end - f->triangle_begin)]];
    double u = random_range(r, 0, 1), v = random_below(r, 3) ? random_range(r, 0, 1) : 1e-6;
    if (u + v > 1) u = 1 - u, v = 1 - v;
    return v3_madd(v3_madd(v3_scale(scene->vertices[t[0]], 1 - u - v), scene->vertices[t[1]], u), scene->vertices[t[2]], v);
}

/* Where the shortest way from s to p meets the wedge's line. */
static double keller_place(const KellerWedge *w, KellerVec3 s, KellerVec3 p)
{
    double z[2], rho[2];
    const KellerVec3 end[2] = {s, p};
    for (int i = 0; i < 2; i++) {
        KellerVec3 v = v3_sub(end[i], w->origin);
        z[i] = v3_dot(v, w->direction);
        rho[i] = v3_norm(v3_madd(v, w->direction, -z[i]));
    }
    return z[0] + (z[1] - z[0]) * rho[0] / (rho[0] + rho[1]);
}

/* A point to which Keller's law sends the ray from s over the place t of the edge. */
static KellerVec3 sent_to(const KellerWedge *w, KellerVec3 s, double t, Random *r)
{
    const KellerVec3 x = v3_perpendicular(w->direction), y = v3_cross(w->direction, x), at = on_edge(w, t), d = v3_unit(v3_sub(at, s));
    const double along = v3_dot(d, w->direction), out = v3_norm(v3_cross(d, w->direction));
    const double turn = random_range(r, -M_PI, M_PI), far = random_range(r, 0.1, 8);
    return v3_madd(v3_madd(v3_madd(at, w->direction, far * along), x, far * out * cos(turn)), y, far * out * sin(turn));
}

/* A beam from a piece of an edge, wide or narrow, towards the point q; the wave comes from s. */
static Beam draw_beam(const KellerWedge *w, uint32_t wedge, KellerVec3 s, KellerVec3 q, Random *r)
{
    KellerVec3 v = v3_sub(s, w->origin);
    const double z = v3_dot(v, w->direction), rho = v3_norm(v3_madd(v, w->direction, -z)), t = keller_place(w, s, q), size = w->length * pow(10, random_range(r, -3, 0));
    Beam b = {.mirror = KELLER_NONE, .wedge = wedge, .piece = {fmax(0, t - random_range(r, 0, size)), fmin(w->length, t + random_range(r, 0, size))},
              .z = {z, z}, .rho = {rho, rho}};
    b.bundle.source_count = 2;
    for (int k = 0; k < 2; k++) b.bundle.source[k] = on_edge(w, b.piece[k]);
    KellerVec3 axis[3];
    const KellerVec3 along = v3_unit(v3_sub(q, on_edge(w, t)));
    window_axes(along, v3_perpendicular(along), axis);
    Slopes slopes;
    for (int k = 0; k < 2; k++) {
        slopes.low[k] = -pow(10, random_range(r, -4, 0));
        slopes.high[k] = pow(10, random_range(r, -4, 0));
    }
    b.bundle.window = window_of(axis, &slopes);
    return b;
}

static bool in_window(const Window *w, KellerVec3 d, double slack)
{
    for (uint32_t i = 0; i < w->count; i++)
        if (v3_dot(w->side[i], d) > slack) return false;
    return true;
}

/* Is nothing between a and b but what is in the planes that they are in? */
static bool free_way(const Fixture *f, KellerVec3 a, KellerVec3 b, const uint32_t *planes, size_t count)
{
    Crossings none = {.most = 0};
    KellerAccelWork work = {0};
    bool grazes = false;
    const PathLeg leg = {.a = a, .b = b, .skip = {planes}, .skip_count = {count}, .strict = true};
    return path_leg_passes(&f->scene, f->accel, &leg, &none, &grazes, &work);
}

static uint32_t planes_at(const KellerScene *scene, const KellerWedge *w, uint32_t count, uint32_t *planes)
{
    for (uint32_t p = 0; p < scene->face_count && count < 32; p++)
        if (path_wedge_in_plane(scene, w, scene->faces[p].plane)) planes[count++] = scene->faces[p].plane;
    return count;
}

/* The wave may be mirrored between the edge and the face. */
static void rays_are_kept(void **state)
{
    (void)state;
    size_t rays = 0, free_rays = 0, narrowed = 0, gone = 0, hidden = 0;
    for (uint64_t seed = 1; seed <= SCENES; seed++) {
        Fixture f;
        Random r = random_seeded(seed);
        set_up(&f, seed);
        for (int i = 0; i < BEAMS; i++) {
            const uint32_t wedge = random_below(&r, (uint32_t)f.scene.wedge_count), face = random_below(&r, (uint32_t)f.scene.face_count),
                           mirror = random_below(&r, 2) ? random_below(&r, (uint32_t)f.scene.face_count) : KELLER_NONE;
            const KellerFace *m = mirror == KELLER_NONE ? NULL : &f.scene.faces[mirror];
            const uint32_t plane = f.scene.faces[face].plane;
            KellerWedge w = f.scene.wedges[wedge];
            KellerVec3 s = point_of(&r, 8);
            if (m ? m->plane == plane || path_wedge_in_plane(&f.scene, &w, m->plane) : path_wedge_in_plane(&f.scene, &w, plane)) continue;
            uint32_t planes[34] = {plane, m ? m->plane : plane}, count = m ? 2 : planes_at(&f.scene, &w, 1, planes);
            if (m) {
                s = v3_mirror_point(s, m->normal, m->offset);
                w.origin = v3_mirror_point(w.origin, m->normal, m->offset);
                w.direction = v3_mirror_direction(w.direction, m->normal);
            }
            Beam whole = draw_beam(&w, m ? KELLER_NONE : wedge, s, random_below(&r, 4) ? on_face(&f.scene, face, &r) : point_of(&r, 8), &r);
            whole.mirror = mirror;
            if (!(whole.piece[0] < whole.piece[1])) continue;
            Beam beam = whole;
            const bool some = beam_narrow(&beam, &f.scene, face), hides = some && way_to_face(&f.search, &beam, face).hidden;
            gone += !some;
            hidden += hides;
            narrowed += some && beam.piece[1] - beam.piece[0] < 0.9 * (whole.piece[1] - whole.piece[0]);
            for (int k = 0; k < RAYS; k++) {
                const KellerVec3 p = on_face(&f.scene, face, &r), middle = window_middle(&whole.bundle.window);
                const double t = keller_place(&w, s, p);
                const KellerVec3 from = on_edge(&w, t), d = v3_unit(v3_sub(p, from));
                KellerVec3 start = from;
                if (!(t >= whole.piece[0] && t <= whole.piece[1]) || !in_window(&whole.bundle.window, d, 0) || !(v3_dot(d, middle) > 0)) continue;
                if (m && !path_cross_plane(m, from, p, &start)) continue;
                rays++;
                assert_true(some);
                assert_true(t >= beam.piece[0] - 1e-12 && t <= beam.piece[1] + 1e-12);
                assert_true(in_window(&beam.bundle.window, d, 2 * WINDOW_PAD));
                const bool seen = free_way(&f, start, p, planes, count);
                free_rays += seen;
                assert_false(hides && seen);
            }
        }
        tear_down(&f);
    }
    assert_true(rays > 20000 && free_rays > 5000 && narrowed > 3000 && gone > 3000 && hidden > 1000);
}

/* From near the edge's line to a wall that the line meets: the rays leave at angles down to 1e-8 with the edge, and what is perpendicular to it
 * in them is mostly rounding. */
static void rays_along_the_edge_are_kept(void **state)
{
    (void)state;
    size_t rays = 0, narrowed = 0, gone = 0;
    for (uint64_t seed = 1; seed <= SCENES; seed++) {
        Fixture f;
        Random r = random_seeded(2000 + seed);
        set_up(&f, seed);
        for (int i = 0; i < BEAMS; i++) {
            const uint32_t wedge = random_below(&r, (uint32_t)f.scene.wedge_count), face = random_below(&r, (uint32_t)f.scene.face_count);
            const KellerWedge *w = &f.scene.wedges[wedge];
            const KellerFace *wall = &f.scene.faces[face];
            const double down = v3_dot(wall->normal, w->direction), met = (wall->offset - v3_dot(wall->normal, w->origin)) / down;
            uint32_t triangle;
            if (path_wedge_in_plane(&f.scene, w, wall->plane) || !(fabs(down) > 0.01) || (met >= 0 && met <= w->length) ||
                !(path_face_weight(&f.scene, face, on_edge(w, met), -1, &triangle) > 0))
                continue;
            const KellerVec3 x = v3_perpendicular(w->direction), y = v3_cross(w->direction, x);
            const double away = random_range(&r, 0.01, 3) * w->length, far = pow(10, random_range(&r, -8, 0)), near = far * pow(10, random_range(&r, -1, 1));
            const KellerVec3 s = v3_madd(on_edge(w, met < 0 ? w->length + away : -away), x, near);
            KellerVec3 p[RAYS];
            for (int k = 0; k < RAYS; k++) { /* about one point of the wall */
                const double turn = random_range(&r, -0.1, 0.1) + (double)(i % 6), out = far * random_range(&r, 0.9, 1.1);
                p[k] = v3_madd(v3_madd(on_edge(w, met), x, out * cos(turn)), y, out * sin(turn));
                p[k] = v3_madd(p[k], w->direction, (wall->offset - v3_dot(wall->normal, p[k])) / down);
            }
            Beam whole = draw_beam(w, wedge, s, p[0], &r);
            if (!(whole.piece[0] < whole.piece[1])) continue;
            KellerVec3 axis[3];
            const KellerVec3 along = v3_unit(v3_sub(p[0], on_edge(w, 0.5 * (whole.piece[0] + whole.piece[1]))));
            const double wide = 0.5 * v3_norm(v3_cross(along, w->direction));
            window_axes(along, v3_perpendicular(along), axis);
            whole.bundle.window = window_of(axis, &(Slopes){{-wide, -wide}, {wide, wide}});
            Beam beam = whole;
            const bool some = beam_narrow(&beam, &f.scene, face);
            gone += !some;
            narrowed += some && beam.piece[1] - beam.piece[0] < 0.9 * (whole.piece[1] - whole.piece[0]);
            for (int k = 0; k < RAYS; k++) {
                const double t = keller_place(w, s, p[k]);
                const KellerVec3 d = v3_unit(v3_sub(p[k], on_edge(w, t)));
                if (!(path_face_weight(&f.scene, face, p[k], -1, &triangle) > 0) || !(t >= whole.piece[0] && t <= whole.piece[1]) || !in_window(&whole.bundle.window, d, 0))
                    continue;
                rays++;
                assert_true(some);
                assert_true(t >= beam.piece[0] - 1e-12 && t <= beam.piece[1] + 1e-12);
            }
        }
        tear_down(&f);
    }
    assert_true(rays > 20000 && narrowed > 100 && gone > 100);
}

static void edges_that_are_seen_are_not_hidden(void **state)
{
    (void)state;
    size_t rays = 0, hidden = 0;
    for (uint64_t seed = 1; seed <= SCENES; seed++) {
        Fixture f;
        Random r = random_seeded(1000 + seed);
        set_up(&f, seed);
        for (int i = 0; i < BEAMS; i++) {
            const uint32_t first = random_below(&r, (uint32_t)f.scene.wedge_count), second = random_below(&r, (uint32_t)f.scene.wedge_count);
            const KellerWedge *w = &f.scene.wedges[first], *v = &f.scene.wedges[second];
            if (w->vertex[0] == v->vertex[0] && w->vertex[1] == v->vertex[1]) continue;
            double at = random_range(&r, 0, v->length), size = v->length * pow(10, random_range(&r, -3, 0));
            const double piece[2] = {fmax(0, at - size), fmin(v->length, at + size)};
            const Beam beam = draw_beam(w, first, point_of(&r, 8), on_edge(v, at), &r);
            if (!(beam.piece[0] < beam.piece[1]) || !edge_hidden(&f.search, &beam, on_edge(v, piece[0]), on_edge(v, piece[1]))) continue;
            hidden++;
            uint32_t planes[33], count = planes_at(&f.scene, w, 0, planes);
            count = planes_at(&f.scene, v, count, planes);
            for (int k = 0; k < RAYS; k++) { /* any ray, as none of them is to get there */
                rays++;
                assert_false(free_way(&f, on_edge(w, random_range(&r, beam.piece[0], beam.piece[1])), on_edge(v, random_range(&r, piece[0], piece[1])), planes, count));
            }
        }
        tear_down(&f);
    }
    assert_true(hidden > 300 && rays > 3000);
}

/* Is the way from the first point over the mirrors to the last free? Each leg starts and ends in planes that are not in its way. */
static bool free_legs(const Fixture *f, const KellerWedge *w, KellerVec3 end, uint32_t count, const uint32_t *face, const KellerVec3 *image, KellerVec3 p)
{
    for (uint32_t leg = count + 1; leg-- > 0;) {
        uint32_t planes[34], n = 0;
        KellerVec3 from = end;
        if (leg > 0) {
            planes[n++] = f->scene.faces[face[leg - 1]].plane;
            if (!path_cross_plane(&f->scene.faces[face[leg - 1]], image[leg], p, &from)) return false;
        }
        if (leg < count) planes[n++] = f->scene.faces[face[leg]].plane;
        else n = planes_at(&f->scene, w, n, planes);
        if (!free_way(f, from, p, planes, n)) return false;
        p = from;
    }
    return true;
}

/* In a face's plane or hardly off it; on the face or beside it. */
static KellerVec3 near_plane(const KellerScene *scene, uint32_t face, Random *r)
{
    const KellerFace *f = &scene->faces[face];
    const KellerVec3 p = random_below(r, 2) ? on_face(scene, face, r) : point_of(r, 8);
    const double off = random_below(r, 2) ? 0 : scene->contact * random_range(r, -5, 5);
    return v3_madd(p, f->normal, f->offset + off - v3_dot(f->normal, p));
}

typedef struct {
    const KellerWedge *w;
    double from, to, whole[2];
    bool lit;
    size_t met, close;          /* paths; those where the dark begins, to CLOSE of the edge */
} Kept;

static const double CLOSE = 1e-6;

/* A path's place on its last step's edge. */
static bool is_kept(void *context, const KellerPath *path)
{
    Kept *k = context;
    const double t = v3_dot(v3_sub(path->position[path->count - 1], k->w->origin), k->w->direction);
    if (t < k->whole[0] || t > k->whole[1]) return true;
    k->met++;
    assert_true(k->lit && t >= k->from && t <= k->to);
    k->close += k->from > k->whole[0] && t - k->from < CLOSE * k->w->length;
    k->close += k->to < k->whole[1] && k->to - t < CLOSE * k->w->length;
    return true;
}

/* What is dark of an edge behind up to three mirrors. Ends in a face's plane, or hardly off it, graze it, which is for the solver to say. */
static void dark_parts_are_not_seen(void **state)
{
    enum { MIRRORS = 3, SOLVED = 8 };
    (void)state;
    size_t rays = 0, dark = 0, free_rays = 0, near_planes = 0, cut[MIRRORS + 1] = {0}, solved[MIRRORS + 1] = {0}, close[MIRRORS + 1] = {0};
    for (uint64_t seed = 1; seed <= SCENES / 2; seed++) {
        Fixture f;
        Random r = random_seeded(3000 + seed);
        set_up(&f, seed);
        for (int i = 0; i < BEAMS; i++) {
            const uint32_t wedge = random_below(&r, (uint32_t)f.scene.wedge_count), count = random_below(&r, MIRRORS + 1);
            const KellerWedge *w = &f.scene.wedges[wedge];
            uint32_t face[MIRRORS];
            KellerVec3 image[MIRRORS + 1] = {i % 4 ? point_of(&r, 8) : near_plane(&f.scene, random_below(&r, (uint32_t)f.scene.face_count), &r)};
            for (uint32_t k = 0; k < count; k++) {
                face[k] = random_below(&r, (uint32_t)f.scene.face_count);
                image[k + 1] = v3_mirror_point(image[k], f.scene.faces[face[k]].normal, f.scene.faces[face[k]].offset);
            }
            double from = random_range(&r, 0, 0.5) * w->length, to = random_range(&r, 0.5, 1) * w->length;
            const double whole[2] = {from, to};
            const bool lit = lit_way(&f.limits, image[0], count, face, wedge, &from, &to, &f.search.work.accel);
            assert_true(!lit || (from >= whole[0] && to <= whole[1]));
            cut[count] += !lit || to - from < 0.9 * (whole[1] - whole[0]);
            KellerStep step[MIRRORS + 1] = {[MIRRORS] = {0}};
            for (uint32_t k = 0; k <= count; k++) step[k] = k < count ? (KellerStep){KELLER_REFLECTION, face[k]} : (KellerStep){KELLER_DIFFRACTION, wedge};
            Kept kept = {w, from, to, {whole[0], whole[1]}, lit, 0, 0};
            const bool cut_from = lit && from > whole[0], cut_to = lit && to < whole[1];
            for (int k = 0; k < SOLVED; k++) { /* every other one by Keller's law, close to where the dark begins if it does */
                double t = random_range(&r, whole[0], whole[1]);
                const double off = (k & 2 ? 1 : -1) * w->length * pow(10, random_range(&r, -12, -2));
                if (cut_from || cut_to) t = off + (cut_from && (!cut_to || k & 4) ? from : to);
                const KellerVec3 rx = k % 2 ? sent_to(w, image[count], t, &r) : point_of(&r, 8);
                assert_true(keller_path_solve(&f.scene, f.accel, image[0], rx, count + 1, step, 0, is_kept, &kept, &f.search.work.accel));
            }
            near_planes += i % 4 ? 0 : kept.met;
            solved[count] += kept.met;
            close[count] += kept.close;
            for (int k = 0; k < RAYS && i % 4; k++) {
                const double t = random_range(&r, whole[0], whole[1]);
                const bool seen = free_legs(&f, w, image[0], count, face, image, on_edge(w, t));
                rays++;
                free_rays += seen && count > 0;
                if (lit && t >= from && t <= to) continue;
                dark++;
                assert_false(seen);
            }
        }
        tear_down(&f);
    }
    printf("# %zu of %zu places dark, %zu seen in mirrors; %zu paths near planes\n", dark, rays, free_rays, near_planes);
    for (int i = 0; i <= MIRRORS; i++) printf("# %d mirrors: %zu cut, %zu paths, %zu close to the dark\n", i, cut[i], solved[i], close[i]);
    assert_true(dark > 300000 && free_rays > 300000 && near_planes > 15000 && close[0] > 150 && close[1] + close[2] > 8);
    for (int i = 0; i <= MIRRORS; i++) assert_true(cut[i] > 2000);
    assert_true(solved[0] > 60000 && solved[1] > 5000 && solved[2] > 400);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(rays_are_kept), cmocka_unit_test(rays_along_the_edge_are_kept),
                                       cmocka_unit_test(edges_that_are_seen_are_not_hidden), cmocka_unit_test(dark_parts_are_not_seen)};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
