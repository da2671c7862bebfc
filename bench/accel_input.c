#include "accel_input.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../tests/unit/random.h"
#include "io/generate.h"

static int by_ends(const void *x, const void *y)
{
    const uint32_t *a = x, *b = y;
    if (a[0] != b[0]) return a[0] < b[0] ? -1 : 1;
    return (a[1] > b[1]) - (a[1] < b[1]);
}

/* Each edge once, whichever way it runs. */
static void make_unique(AccelBench *b, size_t count)
{
    size_t kept = 0;
    for (size_t i = 0; i < count; i++) {
        uint32_t p = b->edges[i][0], q = b->edges[i][1];
        b->edges[i][0] = p < q ? p : q;
        b->edges[i][1] = p < q ? q : p;
    }
    qsort(b->edges, count, sizeof *b->edges, by_ends);
    for (size_t i = 0; i < count; i++)
        if (kept == 0 || by_ends(b->edges[i], b->edges[kept - 1]) != 0)
            memmove(b->edges[kept++], b->edges[i], sizeof *b->edges);
    b->in.edge_count = (uint32_t)kept;
    b->in.edges = (const uint32_t (*)[2])b->edges;
}

/* The triangles' sides. */
static KellerStatus sides(AccelBench *b, KellerError *error)
{
    size_t count = 3 * (size_t)b->in.triangle_count;
    b->edges = malloc((count + 1) * sizeof *b->edges);
    if (!b->edges) return keller_error_memory(error, count * sizeof *b->edges);
    for (size_t i = 0; i < count; i++) {
        b->edges[i][0] = b->in.triangles[i / 3][i % 3];
        b->edges[i][1] = b->in.triangles[i / 3][(i + 1) % 3];
    }
    make_unique(b, count);
    return KELLER_OK;
}

static void find_box(AccelBench *b)
{
    b->lower = v3(INFINITY, INFINITY, INFINITY);
    b->upper = v3(-INFINITY, -INFINITY, -INFINITY);
    for (uint32_t i = 0; i < b->in.triangle_count; i++)
        for (int k = 0; k < 3; k++) {
            KellerVec3 p = b->in.vertices[b->in.triangles[i][k]];
            b->lower = v3(fmin(b->lower.x, p.x), fmin(b->lower.y, p.y), fmin(b->lower.z, p.z));
            b->upper = v3(fmax(b->upper.x, p.x), fmax(b->upper.y, p.y), fmax(b->upper.z, p.z));
        }
}

/* Materials are of no interest here, but the model asks for some. */
static KellerStatus any_material(KellerSoup *soup, KellerError *error)
{
    size_t bytes = (soup->material_count + 1) * sizeof *soup->materials;
    KellerMaterial *materials = realloc(soup->materials, bytes);
    if (!materials) return keller_error_memory(error, bytes);
    soup->materials = materials;
    for (size_t i = 0; i < soup->material_count; i++) materials[i].kind = KELLER_MATERIAL_CONDUCTOR;
    uint32_t none = (uint32_t)soup->material_count++;
    materials[none] = (KellerMaterial){.name = strdup("none"), .kind = KELLER_MATERIAL_CONDUCTOR};
    for (size_t i = 0; i < soup->triangle_count; i++)
        if (soup->material[i] == KELLER_NO_MATERIAL) soup->material[i] = none;
    return KELLER_OK;
}

static KellerStatus from_scene(AccelBench *b, KellerError *error)
{
    KellerStatus status = any_material(&b->soup, error);
    if (status == KELLER_OK) status = keller_scene_build(&b->soup, &b->scene, error);
    if (status != KELLER_OK) return status;
    const KellerScene *s = &b->scene;
    b->edges = malloc((s->wedge_count + 1) * sizeof *b->edges);
    if (!b->edges) return keller_error_memory(error, s->wedge_count * sizeof *b->edges);
    for (size_t i = 0; i < s->wedge_count; i++) memcpy(b->edges[i], s->wedges[i].vertex, sizeof *b->edges);
    b->in = (KellerAccelInput){.triangle_count = (uint32_t)s->triangle_count, .vertices = s->vertices,
                               .triangles = (const uint32_t (*)[3])s->triangles};
    make_unique(b, s->wedge_count); /* as keller_accel_build has wedges on one edge */
    return KELLER_OK;
}

KellerStatus accel_bench_read(const char *file, size_t raw, AccelBench *b, KellerError *error)
{
    *b = (AccelBench){0};
    const char *name = strrchr(file, '/');
    snprintf(b->name, sizeof b->name, "%s", name ? name + 1 : file);
    char *dot = strrchr(b->name, '.');
    if (dot && dot != b->name) *dot = '\0';
    if (strcmp(b->name, "scene") == 0 && name) { /* .../classroom/scene.xml */
        const char *folder = name;
        while (folder > file && folder[-1] != '/') folder--;
        snprintf(b->name, sizeof b->name, "%.*s", (int)(name - folder), folder);
    }
    KellerStatus status = keller_soup_read(file, 1, &b->soup, error);
    if (status != KELLER_OK) return status;
    if (b->soup.triangle_count > raw) {
        b->in.vertices = b->soup.vertices;
        b->in.triangle_count = (uint32_t)b->soup.triangle_count;
        b->in.triangles = (const uint32_t (*)[3])b->soup.triangles;
        status = sides(b, error);
    } else {
        status = from_scene(b, error);
    }
    find_box(b);
    return status;
}

KellerStatus accel_bench_random(uint32_t count, AccelBench *b, KellerError *error)
{
    *b = (AccelBench){0};
    snprintf(b->name, sizeof b->name, "random-%u", count);
    b->vertices = malloc(3 * (size_t)count * sizeof *b->vertices);
    b->triangles = malloc(((size_t)count + 1) * sizeof *b->triangles);
    if (!b->vertices || !b->triangles) return keller_error_memory(error, 3 * (size_t)count * sizeof *b->vertices);
    Random r = {1};
    double size = 50 / cbrt((double)count);
    for (uint32_t i = 0; i < count; i++) {
        KellerVec3 at = random_point(&r, 50);
        for (uint32_t k = 0; k < 3; k++) {
            b->vertices[3 * i + k] = v3_add(at, random_point(&r, size));
            b->triangles[i][k] = 3 * i + k;
        }
    }
    b->in.vertices = b->vertices;
    b->in.triangle_count = count;
    b->in.triangles = (const uint32_t (*)[3])b->triangles;
    KellerStatus status = sides(b, error);
    find_box(b);
    return status;
}

static KellerStatus generated(const KellerGenerate *def, AccelBench *b, KellerError *error)
{
    KellerStatus status = keller_generate(def, &b->soup, error);
    if (status != KELLER_OK) return status;
    b->in = (KellerAccelInput){.triangle_count = (uint32_t)b->soup.triangle_count, .vertices = b->soup.vertices,
                               .triangles = (const uint32_t (*)[3])b->soup.triangles};
    find_box(b);
    return KELLER_OK;
}

KellerStatus accel_bench_layers(uint32_t sheets, AccelBench *b, KellerError *error)
{
    *b = (AccelBench){0};
    snprintf(b->name, sizeof b->name, "layers-%u", sheets);
    KellerGenerate def = keller_generate_defaults(KELLER_GENERATE_LAYERS);
    def.sheets = sheets;
    return generated(&def, b, error);
}

KellerStatus accel_bench_hair(uint32_t strands, AccelBench *b, KellerError *error)
{
    *b = (AccelBench){0};
    snprintf(b->name, sizeof b->name, "hair-%u", strands);
    KellerGenerate def = keller_generate_defaults(KELLER_GENERATE_HAIR);
    def.strands = strands;
    KellerStatus status = generated(&def, b, error);
    return status == KELLER_OK ? sides(b, error) : status;
}

void accel_bench_free(AccelBench *b)
{
    keller_scene_free(&b->scene);
    keller_soup_free(&b->soup);
    free(b->vertices);
    free(b->triangles);
    free(b->edges);
    *b = (AccelBench){0};
}
