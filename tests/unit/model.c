#include "model.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

static uint64_t next(Model *model)
{
    model->random ^= model->random << 13;
    model->random ^= model->random >> 7;
    model->random ^= model->random << 17;
    return model->random;
}

double model_random(Model *model, double low, double high)
{
    return low + (high - low) * (double)(next(model) >> 11) * 0x1p-53;
}

static size_t pick(Model *model, size_t count)
{
    return (size_t)(next(model) >> 20) % count;
}

void model_open(Model *model, uint64_t seed)
{
    memset(model, 0, sizeof *model);
    model->random = seed * 0x9e3779b97f4a7c15u + 1;
    KellerSoup *soup = &model->soup;
    soup->material_count = soup->object_count = 2;
    soup->materials = calloc(2, sizeof *soup->materials);
    soup->objects = calloc(2, sizeof *soup->objects);
    assert_true(soup->materials && soup->objects);
    for (int i = 0; i < 2; i++) {
        soup->materials[i].name = strdup(i ? "concrete" : "brick");
        soup->materials[i].kind = KELLER_MATERIAL_CONDUCTOR;
        soup->objects[i] = strdup(i ? "b" : "a");
    }
}

void model_close(Model *model)
{
    KellerSoup *soup = &model->soup;
    for (int i = 0; i < 2; i++) {
        free(soup->materials[i].name);
        free(soup->objects[i]);
    }
    free(soup->materials);
    free(soup->objects);
    free(soup->vertices);
    free(soup->triangles);
    free(soup->material);
    free(soup->object);
    memset(model, 0, sizeof *model);
}

static uint32_t vertex(Model *model, KellerVec3 p)
{
    KellerSoup *soup = &model->soup;
    if (soup->vertex_count == model->vertex_capacity) {
        model->vertex_capacity = 2 * model->vertex_capacity + 16;
        soup->vertices = realloc(soup->vertices, model->vertex_capacity * sizeof *soup->vertices);
        assert_non_null(soup->vertices);
    }
    soup->vertices[soup->vertex_count] = p;
    return (uint32_t)soup->vertex_count++;
}

void model_triangle(Model *model, KellerVec3 a, KellerVec3 b, KellerVec3 c, uint32_t material)
{
    KellerSoup *soup = &model->soup;
    if (soup->triangle_count == model->triangle_capacity) {
        size_t capacity = model->triangle_capacity = 2 * model->triangle_capacity + 16;
        soup->triangles = realloc(soup->triangles, capacity * sizeof *soup->triangles);
        soup->material = realloc(soup->material, capacity * sizeof *soup->material);
        soup->object = realloc(soup->object, capacity * sizeof *soup->object);
        assert_true(soup->triangles && soup->material && soup->object);
    }
    size_t t = soup->triangle_count++;
    soup->triangles[t][0] = vertex(model, a);
    soup->triangles[t][1] = vertex(model, b);
    soup->triangles[t][2] = vertex(model, c);
    soup->material[t] = material;
    soup->object[t] = material;
}

void model_quad(Model *model, KellerVec3 a, KellerVec3 b, KellerVec3 c, KellerVec3 d, bool other_diagonal,
                uint32_t material)
{
    if (other_diagonal) {
        model_triangle(model, a, b, d, material);
        model_triangle(model, b, c, d, material);
    } else {
        model_triangle(model, a, b, c, material);
        model_triangle(model, a, c, d, material);
    }
}

void model_prism(Model *model, size_t corners, const double (*xy)[2], double z0, double z1, bool bottom, bool top,
                 uint32_t material)
{
    for (size_t i = 0; i < corners; i++) {
        const double *p = xy[i], *q = xy[(i + 1) % corners];
        model_quad(model, v3(p[0], p[1], z0), v3(q[0], q[1], z0), v3(q[0], q[1], z1), v3(p[0], p[1], z1), i & 1,
                   material);
        if (i < 1 || i + 1 >= corners) continue;
        const double *o = xy[0];
        if (bottom) model_triangle(model, v3(o[0], o[1], z0), v3(q[0], q[1], z0), v3(p[0], p[1], z0), material);
        if (top) model_triangle(model, v3(o[0], o[1], z1), v3(p[0], p[1], z1), v3(q[0], q[1], z1), material);
    }
}

void model_box(Model *model, KellerVec3 lower, KellerVec3 upper, bool bottom, uint32_t material)
{
    const double xy[4][2] = {{lower.x, lower.y}, {upper.x, lower.y}, {upper.x, upper.y}, {lower.x, upper.y}};
    model_prism(model, 4, xy, lower.z, upper.z, bottom, true, material);
}

void model_turn(Model *model)
{
    KellerVec3 x = v3_unit(v3(model_random(model, -1, 1), model_random(model, -1, 1), model_random(model, -1, 1)));
    KellerVec3 y =
        v3_unit(v3_cross(x, v3(model_random(model, -1, 1), model_random(model, -1, 1), model_random(model, -1, 1))));
    KellerVec3 z = v3_cross(x, y);
    for (size_t i = 0; i < model->soup.vertex_count; i++) {
        KellerVec3 p = model->soup.vertices[i];
        model->soup.vertices[i] = v3(v3_dot(p, x), v3_dot(p, y), v3_dot(p, z));
    }
}

void model_move(Model *model, KellerVec3 by)
{
    for (size_t i = 0; i < model->soup.vertex_count; i++)
        model->soup.vertices[i] = v3_add(model->soup.vertices[i], by);
}

static bool equal(KellerVec3 a, KellerVec3 b)
{
    return a.x == b.x && a.y == b.y && a.z == b.z;
}

/* Cuts the triangle in two at p on the side from corner i to the next. */
static void halve(Model *model, size_t t, int i, KellerVec3 p)
{
    KellerSoup *soup = &model->soup;
    KellerVec3 c[3];
    for (int k = 0; k < 3; k++) c[k] = soup->vertices[soup->triangles[t][(i + k) % 3]];
    uint32_t material = soup->material[t];
    for (int k = 0; k < 3; k++) soup->triangles[t][k] = vertex(model, k == 1 ? p : c[k]);
    model_triangle(model, p, c[1], c[2], material);
}

void model_cut(Model *model, int times, bool junctions)
{
    KellerSoup *soup = &model->soup;
    for (int n = 0; n < times; n++) {
        size_t t = pick(model, soup->triangle_count);
        KellerVec3 c[3];
        for (int k = 0; k < 3; k++) c[k] = soup->vertices[soup->triangles[t][k]];
        if (pick(model, 2)) {
            double u = model_random(model, 0.1, 0.5), v = model_random(model, 0.1, 0.4);
            KellerVec3 p = v3_madd(v3_madd(c[0], v3_sub(c[1], c[0]), u), v3_sub(c[2], c[0]), v);
            uint32_t material = soup->material[t];
            soup->triangles[t][2] = vertex(model, p);
            model_triangle(model, c[1], c[2], p, material);
            model_triangle(model, c[2], c[0], p, material);
            continue;
        }
        int i = (int)pick(model, 3);
        KellerVec3 a = c[i], b = c[(i + 1) % 3], p = v3_madd(a, v3_sub(b, a), model_random(model, 0.2, 0.8));
        size_t count = soup->triangle_count;
        for (size_t u = 0; u < count; u++)
            for (int k = 0; k < 3; k++) {
                KellerVec3 q = soup->vertices[soup->triangles[u][k]],
                           r = soup->vertices[soup->triangles[u][(k + 1) % 3]];
                bool shared = (equal(q, a) && equal(r, b)) || (equal(q, b) && equal(r, a));
                if (!shared || (junctions && u != t)) continue;
                halve(model, u, k, p);
                break;
            }
    }
}

void model_flip(Model *model, bool all)
{
    for (size_t t = 0; t < model->soup.triangle_count; t++) {
        if (!all && pick(model, 2)) continue;
        uint32_t *v = model->soup.triangles[t], swap = v[1];
        v[1] = v[2];
        v[2] = swap;
    }
}

void model_shuffle(Model *model)
{
    KellerSoup *soup = &model->soup;
    uint32_t *place = calloc(soup->vertex_count, sizeof *place);
    assert_non_null(place);
    for (size_t i = 0; i < soup->vertex_count; i++) place[i] = (uint32_t)i;
    for (size_t i = soup->vertex_count; i-- > 1;) {
        size_t j = pick(model, i + 1);
        KellerVec3 p = soup->vertices[i];
        soup->vertices[i] = soup->vertices[j];
        soup->vertices[j] = p;
        /* place[where a vertex started] = where it is: follow it by searching, which is slow and plain. */
        for (size_t k = 0; k < soup->vertex_count; k++)
            place[k] = place[k] == i ? (uint32_t)j : place[k] == j ? (uint32_t)i : place[k];
    }
    for (size_t t = 0; t < soup->triangle_count; t++) {
        uint32_t *v = soup->triangles[t], turned[3];
        size_t first = pick(model, 3);
        for (size_t k = 0; k < 3; k++) turned[k] = place[v[(first + k) % 3]];
        memcpy(v, turned, sizeof turned);
    }
    for (size_t i = soup->triangle_count; i-- > 1;) {
        size_t j = pick(model, i + 1);
        for (int k = 0; k < 3; k++) {
            uint32_t swap = soup->triangles[i][k];
            soup->triangles[i][k] = soup->triangles[j][k];
            soup->triangles[j][k] = swap;
        }
        uint32_t swap = soup->material[i];
        soup->material[i] = soup->material[j];
        soup->material[j] = swap;
        swap = soup->object[i];
        soup->object[i] = soup->object[j];
        soup->object[j] = swap;
    }
    KellerMaterial material = soup->materials[0];
    soup->materials[0] = soup->materials[1];
    soup->materials[1] = material;
    char *object = soup->objects[0];
    soup->objects[0] = soup->objects[1];
    soup->objects[1] = object;
    for (size_t t = 0; t < soup->triangle_count; t++) {
        soup->material[t] = 1 - soup->material[t];
        soup->object[t] = 1 - soup->object[t];
    }
    free(place);
}

KellerScene model_scene(const Model *model)
{
    KellerScene scene;
    KellerError error;
    assert_int_equal(keller_scene_build(&model->soup, &scene, &error), KELLER_OK);
    return scene;
}
