#include "keller/resolve.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "io/config_read.h"
#include "io/names.h"

/* Materials are told apart by their place: the configuration's first, then the scene's. */
#define NOTHING UINT32_MAX

typedef struct {
    const KellerConfig *config;
    const KellerSoup *soup;
    KellerError *error;
    KellerNameIndex configured, scene, objects;
    uint32_t fallback;     /* the default material, or NOTHING */
    uint32_t *of_object;   /* by object: what an <assign> says, or NOTHING */
    uint32_t *of_material; /* by the soup's material: 2 to 4 of the order in resolve.h, or NOTHING */
    uint32_t *of_triangle;
    uint32_t *place; /* by material: its place in the new list, or NOTHING while unused */
    size_t count;    /* materials, configured and the scene's */
} Resolver;

static const KellerMaterial *material_at(const Resolver *r, uint32_t i)
{
    return i < r->config->material_count ? &r->config->materials[i]
                                         : &r->soup->materials[i - r->config->material_count];
}

/* Says what it is made of. */
static bool defined(const KellerMaterial *material)
{
    return material->kind == KELLER_MATERIAL_ITU ? keller_itu_known(material->itu)
                                                 : material->kind != KELLER_MATERIAL_NAMED;
}

static uint32_t find_material(const Resolver *r, const char *name)
{
    size_t i = keller_names_find(&r->configured, name);
    if (i != KELLER_NO_NAME) return (uint32_t)i;
    i = keller_names_find(&r->scene, name);
    if (i != KELLER_NO_NAME && defined(&r->soup->materials[i])) return (uint32_t)(r->config->material_count + i);
    return NOTHING;
}

static const char *material_hint(const Resolver *r, const char *name, char hint[KELLER_HINT_BYTES])
{
    KellerNearest nearest = keller_nearest(name);
    for (uint32_t i = 0; i < r->count; i++)
        if (defined(material_at(r, i))) keller_nearest_offer(&nearest, material_at(r, i)->name);
    return keller_nearest_hint(&nearest, hint);
}

static KellerStatus unknown_material(const Resolver *r, int line, const char *what, const char *name)
{
    char hint[KELLER_HINT_BYTES];
    return keller_error(
        r->error, KELLER_BAD_INPUT,
        "%s:%d: %s names material \"%s\", which neither the configuration nor the scene defines; expected "
        "<material name=\"%s\" .../>%s",
        r->config->file, line, what, keller_quote(name).text, keller_quote(name).text, material_hint(r, name, hint));
}

static KellerStatus read_default(Resolver *r)
{
    r->fallback = NOTHING;
    if (!r->config->default_material) return KELLER_OK;
    r->fallback = find_material(r, r->config->default_material);
    if (r->fallback != NOTHING) return KELLER_OK;
    return unknown_material(r, r->config->default_material_line, "<default-material>", r->config->default_material);
}

/* The first names, for a message: ` (wall, roof, ...)`. */
enum { LISTED_OBJECTS = 6, OBJECT_LIST_BYTES = LISTED_OBJECTS * (sizeof(KellerQuote) + 2) + 16 };

static const char *object_list(const KellerSoup *soup, char list[OBJECT_LIST_BYTES])
{
    size_t at = 0;
    list[0] = '\0';
    for (size_t o = 0; o < soup->object_count && o < LISTED_OBJECTS; o++)
        at += (size_t)snprintf(list + at, OBJECT_LIST_BYTES - at, "%s%s", o ? ", " : " (",
                               keller_quote(soup->objects[o]).text);
    if (soup->object_count > 0)
        snprintf(list + at, OBJECT_LIST_BYTES - at, "%s", soup->object_count > LISTED_OBJECTS ? ", ...)" : ")");
    return list;
}

static KellerStatus read_assignments(Resolver *r)
{
    for (size_t o = 0; o < r->soup->object_count; o++) r->of_object[o] = NOTHING;
    for (size_t i = 0; i < r->config->assignment_count; i++) {
        const KellerAssignment *a = &r->config->assignments[i];
        int line = r->config->assignment_lines[i];
        size_t object = keller_names_find(&r->objects, a->object);
        if (object == KELLER_NO_NAME) {
            char hint[KELLER_HINT_BYTES];
            KellerNearest nearest = keller_nearest(a->object);
            for (size_t o = 0; o < r->soup->object_count; o++) keller_nearest_offer(&nearest, r->soup->objects[o]);
            char list[OBJECT_LIST_BYTES];
            return keller_error(
                r->error, KELLER_BAD_INPUT,
                "%s:%d: <assign> names object \"%s\", which is not in the scene; expected one of its %zu "
                "objects%s%s",
                r->config->file, line, keller_quote(a->object).text, r->soup->object_count,
                object_list(r->soup, list), keller_nearest_hint(&nearest, hint));
        }
        r->of_object[object] = find_material(r, a->material);
        if (r->of_object[object] == NOTHING) return unknown_material(r, line, "<assign>", a->material);
    }
    return KELLER_OK;
}

static void read_scene_materials(Resolver *r)
{
    for (size_t m = 0; m < r->soup->material_count; m++) {
        uint32_t found = find_material(r, r->soup->materials[m].name);
        r->of_material[m] = found != NOTHING ? found : r->fallback;
    }
}

/* No rule gives this triangle a material: says why and what to add. */
static KellerStatus missing(const Resolver *r, size_t triangle)
{
    const char *object = r->soup->objects[r->soup->object[triangle]];
    int line = r->config->scene_line;
    if (r->soup->material[triangle] == KELLER_NO_MATERIAL)
        return keller_error(
            r->error, KELLER_BAD_INPUT,
            "%s:%d: object \"%s\" of the scene has no material; expected <default-material name=\"...\"/> or "
            "<assign object=\"%s\" material=\"...\"/>",
            r->config->file, line, keller_quote(object).text, keller_quote(object).text);
    const KellerMaterial *material = &r->soup->materials[r->soup->material[triangle]];
    if (material->kind == KELLER_MATERIAL_ITU) {
        char list[KELLER_ITU_LIST_BYTES];
        return keller_error(
            r->error, KELLER_BAD_INPUT,
            "%s:%d: material \"%s\" of object \"%s\" is the ITU-R P.2040 material \"%s\", which is unknown; "
            "expected <material name=\"%s\" .../>, <default-material> or one of %s",
            r->config->file, line, keller_quote(material->name).text, keller_quote(object).text,
            keller_quote(material->itu).text, keller_quote(material->name).text,
            keller_config_itu_list(material->itu, list));
    }
    char hint[KELLER_HINT_BYTES];
    return keller_error(
        r->error, KELLER_BAD_INPUT,
        "%s:%d: object \"%s\" of the scene is of material \"%s\", which is not defined; expected <material "
        "name=\"%s\" .../> or <default-material name=\"...\"/>%s",
        r->config->file, line, keller_quote(object).text, keller_quote(material->name).text,
        keller_quote(material->name).text, material_hint(r, material->name, hint));
}

static KellerStatus choose(Resolver *r)
{
    const KellerSoup *soup = r->soup;
    for (size_t t = 0; t < soup->triangle_count; t++) {
        uint32_t chosen = r->of_object[soup->object[t]];
        if (chosen == NOTHING)
            chosen = soup->material[t] == KELLER_NO_MATERIAL ? r->fallback : r->of_material[soup->material[t]];
        if (chosen == NOTHING) return missing(r, t);
        r->of_triangle[t] = chosen;
    }
    return KELLER_OK;
}

static void free_materials(KellerMaterial *materials, size_t count)
{
    for (size_t i = 0; materials && i < count; i++) free(materials[i].name);
    free(materials);
}

static int compare_names(const void *a, const void *b)
{
    return strcmp(((const KellerMaterial *)a)->name, ((const KellerMaterial *)b)->name);
}

/* Copies of the materials in use, sorted by name, and each one's place among them. */
static KellerStatus collect(Resolver *r, KellerMaterial **materials, size_t *count)
{
    for (size_t i = 0; i < r->count; i++) r->place[i] = NOTHING;
    for (size_t t = 0; t < r->soup->triangle_count; t++) r->place[r->of_triangle[t]] = 0;
    size_t used = 0;
    for (size_t i = 0; i < r->count; i++) used += r->place[i] == 0;
    *materials = calloc(used + 1, sizeof **materials);
    if (!*materials) return keller_error_memory(r->error, (used + 1) * sizeof **materials);
    *count = 0;
    for (uint32_t i = 0; i < r->count; i++) {
        if (r->place[i] == NOTHING) continue;
        KellerMaterial copy = *material_at(r, i);
        copy.name = strdup(copy.name);
        if (!copy.name) return keller_error_memory(r->error, 1);
        (*materials)[(*count)++] = copy;
    }
    qsort(*materials, *count, sizeof **materials, compare_names);
    for (uint32_t i = 0; i < r->count; i++) {
        if (r->place[i] == NOTHING) continue;
        KellerMaterial key = {.name = material_at(r, i)->name};
        const KellerMaterial *found = bsearch(&key, *materials, *count, sizeof key, compare_names);
        r->place[i] = (uint32_t)(found - *materials);
    }
    return KELLER_OK;
}

static KellerStatus resolve(Resolver *r, KellerMaterial **materials, size_t *count)
{
    KellerStatus status = read_default(r);
    if (status == KELLER_OK) status = read_assignments(r);
    if (status != KELLER_OK) return status;
    read_scene_materials(r);
    status = choose(r);
    return status == KELLER_OK ? collect(r, materials, count) : status;
}

static bool index_materials(KellerNameIndex *index, size_t count, const KellerMaterial *materials)
{
    return keller_names_build(index, count, count ? &materials->name : NULL, sizeof *materials);
}

KellerStatus keller_config_resolve(const KellerConfig *config, KellerSoup *soup, KellerError *error)
{
    Resolver r = {
        .config = config, .soup = soup, .error = error, .count = config->material_count + soup->material_count};
    r.of_object = calloc(soup->object_count + 1, sizeof *r.of_object);
    r.of_material = calloc(soup->material_count + 1, sizeof *r.of_material);
    r.of_triangle = calloc(soup->triangle_count + 1, sizeof *r.of_triangle);
    r.place = calloc(r.count + 1, sizeof *r.place);
    bool ready = r.of_object && r.of_material && r.of_triangle && r.place;
    ready = index_materials(&r.configured, config->material_count, config->materials) && ready;
    ready = index_materials(&r.scene, soup->material_count, soup->materials) && ready;
    ready = keller_names_build(&r.objects, soup->object_count, soup->objects, sizeof *soup->objects) && ready;

    KellerMaterial *materials = NULL;
    size_t count = 0;
    KellerStatus status =
        ready ? resolve(&r, &materials, &count) : keller_error_memory(error, soup->triangle_count * 4ull);
    if (status == KELLER_OK) {
        for (size_t t = 0; t < soup->triangle_count; t++) soup->material[t] = r.place[r.of_triangle[t]];
        free_materials(soup->materials, soup->material_count);
        soup->materials = materials;
        soup->material_count = count;
    } else {
        free_materials(materials, count);
    }
    keller_names_free(&r.configured);
    keller_names_free(&r.scene);
    keller_names_free(&r.objects);
    free(r.of_object);
    free(r.of_material);
    free(r.of_triangle);
    free(r.place);
    return status;
}
