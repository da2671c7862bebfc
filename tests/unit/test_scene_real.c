/* Real scenes: counts that were measured another way (by sampling), and the same scene with its triangles shuffled. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "keller/scene.h"
#include "keller/soup.h"
#include "real_scene.h"

static KellerSoup read_scene(const char *name)
{
    KellerSoup soup = real_scene(name);
    for (size_t t = 0; t < soup.triangle_count; t++) assert_true(soup.material[t] < soup.material_count);
    return soup;
}

static KellerScene build(const KellerSoup *soup)
{
    KellerScene scene;
    KellerError error;
    if (keller_scene_build(soup, &scene, &error) != KELLER_OK) fail_msg("%s", error.message);
    return scene;
}

/* 38,938 triangles, 22,968 vertices once welded, 62,002 edges, of which 7,217 have one triangle and 14 more than
 * two; 6,409 of the 7,217 stand on the ground, some of the others on roofs, so that at most 808 rims can be left. */
static void munich(void **state)
{
    (void)state;
    KellerSoup soup = read_scene("sionna/munich/munich.xml");
    KellerScene scene = build(&soup);
    assert_int_equal(scene.triangle_count, 38938);
    assert_int_equal(scene.report.edges, 62002);
    assert_int_equal(scene.report.boundary_edges, 7217);
    assert_int_equal(scene.report.complex_edges, 14);
    uint32_t highest = 0;
    for (size_t t = 0; t < scene.triangle_count; t++)
        for (int i = 0; i < 3; i++)
            if (scene.triangles[t][i] > highest) highest = scene.triangles[t][i];
    assert_int_equal(highest + 1, 22968);
    assert_true(scene.report.contact_edges >= 6409 && scene.report.contact_edges < 6600);
    size_t feet = 0, ground = 0, on_ground = 0;
    for (uint32_t v = 0; v < highest + 1; v++) ground += scene.vertices[v].z == scene.lower.z;
    for (size_t w = 0; w < scene.wedge_count; w++) {
        const KellerWedge *wedge = &scene.wedges[w];
        if (wedge->n < 2) continue;
        feet++;
        double z0 = scene.vertices[wedge->vertex[0]].z, z1 = scene.vertices[wedge->vertex[1]].z;
        on_ground += fabs(z0 - scene.lower.z) < scene.contact && fabs(z1 - scene.lower.z) < scene.contact;
    }
    assert_true(feet <= 808);
    assert_int_equal(on_ground, 4); /* the rims of the ground itself */
    assert_true(ground > 4);
    keller_scene_free(&scene);
    keller_soup_free(&soup);
}

/* Six boxes on a ground: 8 edges of each diffract outside, and the ground has 4 rims. */
static void street_canyon(void **state)
{
    (void)state;
    KellerSoup soup = read_scene("sionna/simple_street_canyon/simple_street_canyon.xml");
    KellerScene scene = build(&soup);
    size_t rims = 0;
    for (size_t w = 0; w < scene.wedge_count; w++) {
        rims += scene.wedges[w].n == 2;
        /* The files carry single precision: 1e-6 of an angle on walls of 15 m and more. */
        assert_true(scene.wedges[w].n == 2 || fabs(scene.wedges[w].n - 1.5) < 1e-6);
    }
    assert_int_equal(scene.wedge_count, 6 * 8 + 4);
    assert_int_equal(rims, 4);
    keller_scene_free(&scene);
    keller_soup_free(&soup);
}

static void reversed(void **state)
{
    (void)state;
    KellerSoup soup = read_scene("sionna/munich/munich.xml");
    KellerScene a = build(&soup);
    for (size_t i = 0, j = soup.triangle_count - 1; i < j; i++, j--) {
        uint32_t one[3], other[3], material = soup.material[i], object = soup.object[i];
        memcpy(one, soup.triangles[i], sizeof one);
        memcpy(other, soup.triangles[j], sizeof other);
        for (int k = 0; k < 3; k++) {
            soup.triangles[i][k] = other[2 - k];
            soup.triangles[j][k] = one[(k + 1) % 3];
        }
        soup.material[i] = soup.material[j];
        soup.object[i] = soup.object[j];
        soup.material[j] = material;
        soup.object[j] = object;
    }
    KellerScene b = build(&soup);
    assert_int_equal(a.vertex_count, b.vertex_count);
    assert_int_equal(a.face_count, b.face_count);
    assert_int_equal(a.wedge_count, b.wedge_count);
    assert_memory_equal(a.vertices, b.vertices, a.vertex_count * sizeof *a.vertices);
    assert_memory_equal(a.triangles, b.triangles, a.triangle_count * sizeof *a.triangles);
    assert_memory_equal(a.faces, b.faces, a.face_count * sizeof *a.faces);
    assert_memory_equal(a.wedges, b.wedges, a.wedge_count * sizeof *a.wedges);
    keller_scene_free(&a);
    keller_scene_free(&b);
    keller_soup_free(&soup);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(munich), cmocka_unit_test(street_canyon), cmocka_unit_test(reversed),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests_name("scene_real", tests, NULL, NULL);
}
