/* What of an edge is seen, from the ends and over mirrors: against brute force on random scenes, against shadows worked out by hand, and
 * against mirrored scenes. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "../stability/harness.h"
#include "../stability/oracle.h"
#include "../stability/scenes.h"
#include "keller/sound.h"
#include "path/edge_sight.h"

static KellerScene rigid_scene(KellerSoup *soup)
{
    for (uint32_t i = 0; i < MATERIAL_COUNT; i++) {
        char *name = soup->materials[i].name;
        soup->materials[i] = (KellerMaterial){.name = name, .kind = KELLER_MATERIAL_RIGID};
    }
    KellerScene scene = scene_of(soup);
    soup_release(soup);
    scene.sound = (KellerSound){.speed = 343, .edges = KELLER_EDGES_BTM};
    return scene;
}

/* ---- brute force ------------------------------------------------------------------------------------------------------ */

/* Is p inside a triangle of the face, and of no face in its plane with a lower number? *margin: m to the nearest border. */
static bool in_face(const KellerScene *scene, uint32_t face, KellerVec3 p, double *margin)
{
    for (uint32_t f = 0; f <= face; f++) {
        if (scene->faces[f].plane != scene->faces[face].plane) continue;
        bool in = false;
        for (uint32_t i = scene->faces[f].triangle_begin; i < scene->faces[f].triangle_end; i++) {
            const uint32_t *t = scene->triangles[scene->face_triangles[i]];
            double least = INFINITY, most = -INFINITY;
            for (int j = 0; j < 3; j++) {
                KellerVec3 a = scene->vertices[t[j]], b = scene->vertices[t[(j + 1) % 3]];
                double side = v3_dot(scene->faces[f].normal, v3_cross(v3_unit(v3_sub(b, a)), v3_sub(p, a)));
                least = fmin(least, side);
                most = fmax(most, side);
                *margin = fmin(*margin, fabs(side));
            }
            in = in || least >= 0 || most <= 0;
        }
        if (in) return f == face;
    }
    return false;
}

/* Does the edge's point z see the way's end? `margin` as in oracle.h. */
static bool brute(const EdgeWay *way, double z, double *margin)
{
    const KellerScene *scene = way->scene;
    const KellerWedge *w = &scene->wedges[way->wedge];
    KellerVec3 image[KELLER_MAX_BENDS + 1] = {way->end}, at = v3_madd(w->origin, w->direction, z);
    for (uint32_t j = 0; j < way->count; j++) {
        const KellerFace *f = &scene->faces[code_id(way->face[j])];
        image[j + 1] = v3_mirror_point(image[j], f->normal, f->offset);
    }
    uint32_t planes[64], count = w->plane_end - w->plane_begin;
    for (uint32_t i = 0; i < count; i++) planes[i] = scene->wedge_planes[w->plane_begin + i];
    for (uint32_t j = way->count + 1; j-- > 0;) {
        KellerVec3 from = way->end;
        double own;
        if (j > 0) {
            const KellerFace *f = &scene->faces[code_id(way->face[j - 1])];
            double h0 = v3_dot(f->normal, image[j]) - f->offset, h1 = v3_dot(f->normal, at) - f->offset;
            *margin = fmin(*margin, fmin(fabs(h0), fabs(h1)));
            if (h0 * h1 >= 0) return false;
            from = v3_madd(image[j], v3_sub(at, image[j]), h0 / (h0 - h1));
            if (!in_face(scene, code_id(way->face[j - 1]), from, margin)) return false;
            planes[count++] = f->plane;
        }
        bool blocked = oracle_blocked(scene, from, at, count, planes, &own);
        *margin = fmin(*margin, own);
        if (blocked) return false;
        at = from;
        count = 0;
        if (j > 0) planes[count++] = scene->faces[code_id(way->face[j - 1])].plane;
    }
    return true;
}

/* Random scenes, wedges, ways of up to two mirrors: 24 points of each edge, those nearer than 1e-5 m to a change left out. */
static void against_brute_force(void **state)
{
    (void)state;
    const double hair = 1e-5;
    size_t asked = 0, lit = 0, cut = 0;
    for (uint64_t seed = 1; seed <= 60; seed++) {
        RandomScene random_scene = scene_random(seed, seed % 3 == 0 ? SCENE_UPRIGHT : seed % 3 == 1 ? SCENE_THIN : 0);
        KellerScene scene = rigid_scene(&random_scene.soup);
        KellerAccel *accel = NULL;
        KellerError error;
        KellerAccelWork work = {0};
        Random random = random_seeded(seed);
        assert_int_equal(keller_accel_build("auto", &scene, &accel, &error), KELLER_OK);
        for (int i = 0; i < 400 && scene.wedge_count > 0; i++) {
            EdgeWay way = {.scene = &scene, .end = i % 2 ? random_scene.tx : random_scene.rx[0], .count = random_below(&random, 3),
                           .wedge = random_below(&random, (uint32_t)scene.wedge_count)};
            const KellerWedge *w = &scene.wedges[way.wedge];
            bool sensible = true;
            for (uint32_t j = 0; j < way.count; j++) {
                way.face[j] = code_face(random_below(&random, (uint32_t)scene.face_count));
                uint32_t plane = scene.faces[way.face[j]].plane;
                sensible = sensible && (j == 0 || scene.faces[way.face[j - 1]].plane != plane);
                if (j + 1 == way.count) sensible = sensible && !path_wedge_in_plane(&scene, w, plane);
            }
            if (!sensible) continue;
            EdgeParts seen = {0};
            assert_true(edge_sight(&way, accel, &seen, &work));
            for (uint32_t p = 1; p < seen.count; p++) assert_true(seen.part[p].from >= seen.part[p - 1].to);
            bool inside = path_in_sector(w, v3_sub(way.image, w->origin), 0);
            cut += seen.count > 1 || (seen.count == 1 && seen.part[0].to - seen.part[0].from < 0.99 * w->length);
            for (int k = 0; k < 24; k++) {
                double z = random_range(&random, 0, w->length), margin = INFINITY;
                bool near_end = false, is_lit = false;
                for (uint32_t p = 0; p < seen.count; p++) {
                    near_end = near_end || fabs(z - seen.part[p].from) < hair || fabs(z - seen.part[p].to) < hair;
                    is_lit = is_lit || (z > seen.part[p].from && z < seen.part[p].to);
                }
                bool expected = brute(&way, z, &margin) && inside;
                if (near_end || margin < hair) continue;
                if (is_lit != expected)
                    printf("# seed %d, wedge %u at %.9g of %g, %u mirrors: %d, by brute force %d, margin %.2g\n", (int)seed, way.wedge, z,
                           w->length, way.count, is_lit, expected, margin);
                assert_int_equal(is_lit, expected);
                asked++;
                lit += expected;
            }
            free(seen.part);
        }
        keller_accel_free(accel);
        keller_scene_free(&scene);
    }
    printf("# %zu points of edges, %zu seen; %zu edges seen in part\n", asked, lit, cut);
    assert_true(asked > 100000 && lit > 10000 && cut > 200);
}

/* ---- by hand ------------------------------------------------------------------------------------------------------------ */

static FoundPaths paths_between(const KellerScene *scene, KellerVec3 tx, KellerVec3 rx, uint32_t reflections)
{
    Run run = run_new(&tx, 1, &rx, reflections, 1, reflections + 1);
    run.frequency[0] = 250;
    return run_simulation(scene, &run);
}

/* A screen in x = 0, its upper rim from y = -4 to 4 at z = 3, and before it a plate in x = -3 from y = 0.5 to 1.5, high above. From
 * the source at x = -6, half-way, it hides y = 1 to 3 of the rim: what is left are two parts, each with its own path and the integral
 * along it; the receiver sees all. */
static void a_plate_before_the_rim(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "screen");
    soup_quad(&soup, v3(0, -4, 0), v3(0, 4, 0), v3(0, 4, 3), v3(0, -4, 3), CONCRETE);
    soup_quad(&soup, v3(-3, 0.5, -9), v3(-3, 1.5, -9), v3(-3, 1.5, 9), v3(-3, 0.5, 9), CONCRETE);
    KellerScene scene = rigid_scene(&soup);
    KellerVec3 tx = v3(-6, 0, 1), rx = v3(5, 2.5, 2);
    FoundPaths found = paths_between(&scene, tx, rx, 0);
    static const double part[2][2] = {{-4, 1}, {3, 4}};
    double k = 2 * M_PI * 250 / 343;
    /* from the 0-face, the side of the source, the rim along y: azimuths from straight down */
    double r_in = hypot(6, 2), r = hypot(5, 1), phi_in = atan2(6, 2), phi = 2 * M_PI - atan2(5, 1);
    for (int i = 0; i < 2; i++) {
        KellerRigidEdge e = {.n = 2, .phi_in = phi_in, .phi = phi, .r_in = r_in, .z_in = 0, .r = r, .z = 2.5, .z1 = part[i][0],
                             .z2 = part[i][1]};
        double complex expected = keller_btm(&e, k) * cexp(-I * k * keller_btm_shortest(&e));
        double apex = 2.5 * r_in / (r_in + r), y = fmax(part[i][0], fmin(part[i][1], apex));
        size_t matches = 0;
        for (size_t p = 0; p < found.count; p++) {
            if (found.path[p].count != 1 || v3_distance(found.path[p].position[0], v3(0, y, 3)) > 1e-9) continue;
            assert_true(cabs(found.path[p].gain[0] - expected) < 1e-9 * cabs(expected));
            assert_true(fabs(found.path[p].length - v3_distance(tx, v3(0, y, 3)) - v3_distance(v3(0, y, 3), rx)) < 1e-12);
            matches++;
        }
        assert_int_equal(matches, 1);
    }
    found_free(&found);
    keller_scene_free(&scene);
}

/* The sum of all paths but those over what is far away. */
static double complex sum_near(const FoundPaths *found, size_t *diffracted)
{
    double complex sum = 0;
    for (size_t i = 0; i < found->count; i++) {
        const Found *p = &found->path[i];
        bool near = true, edge = false;
        for (uint32_t j = 0; j < p->count; j++) {
            edge = edge || p->step[j].kind == KELLER_DIFFRACTION;
            near = near && (p->step[j].kind == KELLER_REFLECTION || hypot(p->position[j].x, p->position[j].y) < 100);
        }
        *diffracted += near && edge;
        if (near) sum += p->gain[0];
    }
    return sum;
}

/* A rigid floor is a mirror: a screen on it, with all of its three rims, over the floor before and behind, is a screen of twice the
 * height without a floor and with the source's image. At the screen's foot nothing of the rims may be missing. */
static void floor_is_a_mirror(void **state)
{
    (void)state;
    KellerSoup soup = soup_new(), doubled = soup_new();
    soup_object(&soup, "floor");
    soup_quad(&soup, v3(-900, -900, 0), v3(900, -900, 0), v3(900, 900, 0), v3(-900, 900, 0), DRY_GROUND);
    soup_quad(&soup, v3(0, -1, 0), v3(0, 2, 0), v3(0, 2, 1.5), v3(0, -1, 1.5), CONCRETE);
    soup_object(&doubled, "screen");
    soup_quad(&doubled, v3(0, -1, -1.5), v3(0, 2, -1.5), v3(0, 2, 1.5), v3(0, -1, 1.5), CONCRETE);
    KellerScene on_floor = rigid_scene(&soup), free_screen = rigid_scene(&doubled);
    Random random = random_seeded(3);
    double worst = 0;
    for (int i = 0; i < 40; i++) {
        KellerVec3 tx = v3(-random_range(&random, 0.5, 6), random_range(&random, -4, 5), random_range(&random, 0.1, 3));
        KellerVec3 rx = v3(random_range(&random, 0.5, 6), random_range(&random, -4, 5), random_range(&random, 0.1, 3));
        size_t diffracted[3] = {0};
        FoundPaths found = paths_between(&on_floor, tx, rx, 2);
        double complex sum = sum_near(&found, &diffracted[0]), mirrored = 0;
        found_free(&found);
        for (int image = 0; image < 2; image++) {
            found = paths_between(&free_screen, v3(tx.x, tx.y, image ? -tx.z : tx.z), rx, 0);
            mirrored += sum_near(&found, &diffracted[1 + image]);
            found_free(&found);
        }
        assert_int_equal(diffracted[1] + diffracted[2], 8); /* four rims each */
        assert_true(diffracted[0] >= 8);
        worst = fmax(worst, cabs(sum - mirrored) / cabs(mirrored));
    }
    printf("# off by %.2g\n", worst);
    assert_true(worst < 1e-9);
    keller_scene_free(&on_floor);
    keller_scene_free(&free_screen);
}

/* Exchanging the ends changes nothing, and no path comes or goes with a jump: as the source moves past a plate that hides ever more of
 * the rim, the field changes by as much as steps of a micrometre can. */
static void continuous_and_reciprocal(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "hall");
    soup_quad(&soup, v3(-20, -20, 0), v3(20, -20, 0), v3(20, 20, 0), v3(-20, 20, 0), DRY_GROUND);
    soup_quad(&soup, v3(0, -3, 0), v3(0, 4, 0), v3(0, 4, 3), v3(0, -3, 3), CONCRETE);
    soup_quad(&soup, v3(-3, 0.5, 0), v3(-2.5, 2.5, 0), v3(-2.5, 2.5, 4), v3(-3, 0.5, 4), CONCRETE);
    soup_quad(&soup, v3(-9, 6, 0), v3(9, 6, 0), v3(9, 6, 5), v3(-9, 6, 5), CONCRETE);
    KellerScene scene = rigid_scene(&soup);
    KellerVec3 rx = v3(5, 1.2, 1.4);
    size_t counts[100] = {0}, changes = 0;
    for (int i = 0; i < 40; i++) {
        KellerVec3 tx = v3(-6, -4 + 0.21 * i, 1.3);
        double complex p[3];
        for (int j = 0; j < 3; j++) {
            KellerVec3 a = v3_add(tx, v3(0, j == 1 ? 1e-6 : 0, 0));
            FoundPaths found = j == 2 ? paths_between(&scene, rx, a, 2) : paths_between(&scene, a, rx, 2);
            p[j] = 0;
            size_t with_edge = 0;
            for (size_t q = 0; q < found.count; q++) {
                bool edge = false;
                for (uint32_t s = 0; s < found.path[q].count; s++) edge = edge || found.path[q].step[s].kind == KELLER_DIFFRACTION;
                if (edge) p[j] += found.path[q].gain[0];
                with_edge += edge;
            }
            if (j == 0) changes += i > 0 && counts[i - 1] != (counts[i] = with_edge);
            found_free(&found);
        }
        assert_true(cabs(p[1] - p[0]) < 1e-4);
        assert_true(cabs(p[2] - p[0]) < 1e-10);
    }
    assert_true(changes > 5);
    keller_scene_free(&scene);
}

/* From a closed room nothing comes out: at its corners an edge's part is exactly where a wall ends. */
static void closed_room(void **state)
{
    (void)state;
    static const double plan[6][2] = {{0, 0}, {6, 0}, {6, 6}, {4, 6}, {4, 2}, {0, 2}};
    KellerSoup soup = soup_new();
    soup_object(&soup, "L");
    for (int i = 0; i < 6; i++) {
        const double *a = plan[i], *b = plan[(i + 1) % 6];
        soup_quad(&soup, v3(a[0], a[1], 0), v3(b[0], b[1], 0), v3(b[0], b[1], 3), v3(a[0], a[1], 3), CONDUCTOR);
    }
    for (int z = 0; z <= 3; z += 3) {
        soup_quad(&soup, v3(0, 0, z), v3(6, 0, z), v3(4, 2, z), v3(0, 2, z), CONDUCTOR);
        soup_quad(&soup, v3(6, 0, z), v3(6, 6, z), v3(4, 6, z), v3(4, 2, z), CONDUCTOR);
    }
    KellerScene scene = rigid_scene(&soup);
    Random random = random_seeded(5);
    KellerVec3 out[40] = {{1, 5, 1.2}};
    for (int i = 1; i < 40; i++) out[i] = v3(random_range(&random, -2, 3.5), random_range(&random, 2.2, 8), random_range(&random, 0.2, 2.8));
    const KellerVec3 tx[3] = {{1, 1, 1.5}, {1.2, 0.87, 1.5}, {2, 0.5, 1.5}}, in = {5, 5, 1.2};
    for (int t = 0; t < 3; t++) {
        Run run = run_new(&tx[t], 40, out, 2, 1, 3);
        run.frequency[0] = 500;
        FoundPaths ghosts = run_simulation(&scene, &run);
        assert_int_equal(ghosts.count, 0);
        found_free(&ghosts);
        run = run_new(&tx[t], 1, &in, 2, 1, 3);
        run.frequency[0] = 500;
        FoundPaths inside = run_simulation(&scene, &run);
        assert_true(inside.count > 10);
        found_free(&inside);
    }
    keller_scene_free(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(against_brute_force), cmocka_unit_test(a_plate_before_the_rim),
                                       cmocka_unit_test(floor_is_a_mirror), cmocka_unit_test(closed_room), cmocka_unit_test(continuous_and_reciprocal)};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
