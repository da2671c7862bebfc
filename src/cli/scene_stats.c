/* keller scene stats: what a mesh consists of, and what had to be repaired. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "cli/cli.h"
#include "cli/scene.h"

enum { SHOWN = 40 };

/* ---- edges of the welded mesh ---- */

typedef struct {
    uint32_t low, high, object;
} Side;

typedef struct {
    size_t all, by_triangles[5];   /* [0]: five triangles and more; [1..4]: as many */
    size_t closed;                 /* objects every edge of which has two of their triangles */
    double shortest, longest;
} Edges;

static int by_edge(const void *x, const void *y)
{
    const Side *a = x, *b = y;
    if (a->low != b->low) return a->low < b->low ? -1 : 1;
    if (a->high != b->high) return a->high < b->high ? -1 : 1;
    return (a->object > b->object) - (a->object < b->object);
}

static KellerStatus count_edges(const KellerScene *scene, Edges *edges, KellerError *error)
{
    size_t count = 3 * scene->triangle_count;
    Side *sides = malloc((count + 1) * sizeof *sides);
    enum { ABSENT, CLOSED, OPEN };
    uint8_t *object = calloc(scene->object_count + 1, 1);
    *edges = (Edges){0};
    if (!sides || !object) {
        free(sides);
        free(object);
        return keller_error_memory(error, (count + 1) * sizeof *sides);
    }
    for (size_t i = 0; i < count; ++i) {
        const uint32_t *t = scene->triangles[i / 3];
        uint32_t a = t[i % 3], b = t[(i + 1) % 3];
        sides[i] = (Side){a < b ? a : b, a < b ? b : a, scene->triangle_object[i / 3]};
    }
    qsort(sides, count, sizeof *sides, by_edge);
    for (size_t begin = 0, end; begin < count; begin = end) {
        const Side *s = &sides[begin];
        size_t own = begin;   /* where the current object's sides begin */
        for (end = begin; end < count && sides[end].low == s->low && sides[end].high == s->high; ++end) {
            uint32_t o = sides[end].object;
            if (o != sides[own].object) own = end;
            if (object[o] == ABSENT) object[o] = CLOSED;
            bool last = end + 1 == count || sides[end + 1].low != s->low || sides[end + 1].high != s->high ||
                        sides[end + 1].object != o;
            if (last && end + 1 - own != 2) object[o] = OPEN;
        }
        double length = v3_distance(scene->vertices[s->low], scene->vertices[s->high]);
        if (begin == 0 || length < edges->shortest) edges->shortest = length;
        if (begin == 0 || length > edges->longest) edges->longest = length;
        ++edges->all;
        ++edges->by_triangles[end - begin < 5 ? end - begin : 0];
    }
    for (size_t o = 0; o < scene->object_count; ++o) edges->closed += object[o] == CLOSED;
    free(sides);
    free(object);
    return KELLER_OK;
}

/* ---- the report ---- */

static double area_of(const KellerSoup *soup, size_t triangle)
{
    const uint32_t *t = soup->triangles[triangle];
    KellerVec3 a = soup->vertices[t[0]], b = soup->vertices[t[1]], c = soup->vertices[t[2]];
    return v3_norm(v3_cross(v3_sub(b, a), v3_sub(c, a))) / 2;
}

static KellerStatus print_materials(const KellerSoup *soup, KellerError *error)
{
    /* the last row is for triangles without material */
    typedef struct {
        size_t triangles;
        double area;
    } Row;
    size_t count = soup->material_count;
    Row *rows = calloc(count + 1, sizeof *rows);
    if (!rows) return keller_error_memory(error, (count + 1) * sizeof *rows);
    for (size_t t = 0; t < soup->triangle_count; ++t) {
        Row *row = &rows[soup->material[t] == KELLER_NO_MATERIAL ? count : soup->material[t]];
        ++row->triangles;
        row->area += area_of(soup, t);
    }
    printf("materials           triangles       area/m2\n");
    for (size_t i = 0; i <= count; ++i) {
        if ((i == count && rows[i].triangles == 0) || (i >= SHOWN && i < count)) continue;
        printf("  %12zu %12zu %13.6g  ", i, rows[i].triangles, rows[i].area);
        keller_put_text(i == count ? "(none)" : soup->materials[i].name);
        putchar('\n');
    }
    if (count > SHOWN) printf("  and %zu more\n", count - SHOWN);
    free(rows);
    return KELLER_OK;
}

/* Names alone do not say what a scene is made of; for its geometry a stand-in will do. */
static KellerStatus stand_in_materials(KellerSoup *soup, KellerError *error)
{
    size_t bytes = (soup->material_count + 1) * sizeof *soup->materials;
    KellerMaterial *materials = realloc(soup->materials, bytes), none = {.kind = KELLER_MATERIAL_CONDUCTOR};
    if (!materials) return keller_error_memory(error, bytes);
    soup->materials = materials;
    for (size_t i = 0; i < soup->material_count; ++i)
        if (materials[i].kind == KELLER_MATERIAL_NAMED) materials[i].kind = KELLER_MATERIAL_CONDUCTOR;
    if (!(none.name = strdup("(none)"))) return keller_error_memory(error, 7);
    uint32_t index = (uint32_t)soup->material_count;
    materials[soup->material_count++] = none;
    for (size_t t = 0; t < soup->triangle_count; ++t)
        if (soup->material[t] == KELLER_NO_MATERIAL) soup->material[t] = index;
    return KELLER_OK;
}

static void print_model(const KellerScene *scene, const Edges *edges)
{
    const KellerSceneReport *r = &scene->report;
    printf("repairs\n");
    keller_row("welded vertices", "%zu", r->welded_vertices);
    keller_row("degenerate", "%zu triangles without area, left out", r->degenerate);
    keller_row("duplicate", "%zu triangles that repeat others, joined with them", r->duplicate);
    printf("mesh, once repaired\n");
    keller_row("triangles", "%zu", scene->triangle_count);
    keller_row("faces", "%zu in %zu planes", scene->face_count, scene->plane_count);
    keller_row("wedges", "%zu", scene->wedge_count);
    keller_row("closed objects", "%zu of %zu", edges->closed, scene->object_count);
    printf("edges\n");
    keller_row("all", "%zu", edges->all);
    for (size_t i = 1; i <= 4; ++i) {
        char name[32];
        snprintf(name, sizeof name, "of %zu triangle%s", i, i == 1 ? "" : "s");
        keller_row(name, "%zu", edges->by_triangles[i]);
    }
    keller_row("of 5 and more", "%zu", edges->by_triangles[0]);
    keller_row("flat", "%zu, inside a face", r->flat_edges);
    keller_row("in contact", "%zu of 1 triangle that lie on another face", r->contact_edges);
    if (edges->all > 0) keller_row("length", "%g to %g m", edges->shortest, edges->longest);
}

static KellerStatus report(const char *file, KellerSoup *soup, KellerError *error)
{
    double area = 0;
    for (size_t t = 0; t < soup->triangle_count; ++t) area += area_of(soup, t);
    printf("file\n");
    keller_row("name", "%s", file);
    keller_row("triangles", "%zu", soup->triangle_count);
    keller_row("vertices", "%zu", soup->vertex_count);
    keller_row("objects", "%zu", soup->object_count);
    keller_row("files read", "%zu", soup->files);
    keller_row("polygons split", "%zu", soup->polygons_split);
    keller_row("area", "%.6g m2", area);
    KellerStatus status = print_materials(soup, error);
    if (status == KELLER_OK) status = stand_in_materials(soup, error);
    KellerScene scene;
    if (status == KELLER_OK) status = keller_build_scene_of(file, soup, &scene, error);
    if (status != KELLER_OK) return status;
    Edges edges;
    status = count_edges(&scene, &edges, error);
    if (status == KELLER_OK) {
        if (scene.triangle_count > 0) {
            KellerVec3 size = v3_sub(scene.upper, scene.lower);
            printf("extent/m                       x             y             z\n");
            printf("  %-14s %13.6f %13.6f %13.6f\n", "lower", scene.lower.x, scene.lower.y, scene.lower.z);
            printf("  %-14s %13.6f %13.6f %13.6f\n", "upper", scene.upper.x, scene.upper.y, scene.upper.z);
            printf("  %-14s %13.6f %13.6f %13.6f\n", "size", size.x, size.y, size.z);
        }
        print_model(&scene, &edges);
        if (soup->notes[0] || scene.report.notes[0]) printf("notes\n");
        keller_cli_scene_notes(soup->notes);
        keller_cli_scene_notes(scene.report.notes);
    }
    keller_scene_free(&scene);
    return status;
}

KellerStatus keller_cli_scene_stats(int argc, char **argv, KellerError *error)
{
    static const KellerOption options[] = {{0}};
    KellerArguments arguments = {.verb = "scene", .argc = argc, .argv = argv};
    const char *value, *file = NULL;
    for (int what; (what = keller_next_argument(&arguments, options, &value, error)) != KELLER_ARGUMENT_END;) {
        if (what == KELLER_ARGUMENT_WRONG) return KELLER_USAGE;
        if (file) return keller_usage(error, "scene", "stats: \"%.200s\" is one scene too many", value);
        file = value;
    }
    if (!file) return keller_usage(error, "scene", "stats: a scene file is expected");
    KellerSoup soup;
    KellerStatus status = keller_soup_read(file, 1, &soup, error);
    if (status != KELLER_OK) return status;
    status = report(file, &soup, error);
    keller_soup_free(&soup);
    return status;
}
