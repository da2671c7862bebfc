#include "io/soup_build.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAX_NOTES 50

struct KellerLookupSlot {
    const char *key; /* NULL: free */
    uint32_t value;
};

KellerStatus keller_bad(KellerPlace place, KellerError *error, const char *format, ...)
{
    char message[700];
    va_list args;
    va_start(args, format);
    vsnprintf(message, sizeof message, format, args);
    va_end(args);
    return keller_error(error, KELLER_BAD_INPUT, place.binary ? "%s: byte %llu: %s" : "%s:%llu: %s", place.file,
                        (unsigned long long)place.at, message);
}

/* ---- names ---- */

static struct KellerLookupSlot *find_slot(struct KellerLookupSlot *slots, size_t capacity, const char *key)
{
    uint64_t hash = 14695981039346656037u; /* FNV-1a */
    for (const char *p = key; *p; p++) hash = (hash ^ (unsigned char)*p) * 1099511628211u;
    size_t i = (size_t)(hash ^ hash >> 32) & (capacity - 1);
    while (slots[i].key && strcmp(slots[i].key, key) != 0) i = (i + 1) & (capacity - 1);
    return &slots[i];
}

uint32_t keller_lookup_find(const KellerLookup *names, const char *name)
{
    if (!names->used) return UINT32_MAX;
    const struct KellerLookupSlot *slot = find_slot(names->slots, names->capacity, name);
    return slot->key ? slot->value : UINT32_MAX;
}

KellerStatus keller_lookup_add(KellerLookup *names, const char *name, uint32_t value, KellerError *error)
{
    if (2 * (names->used + 1) > names->capacity) {
        size_t capacity = names->capacity ? 2 * names->capacity : 64;
        struct KellerLookupSlot *slots = calloc(capacity, sizeof *slots);
        if (!slots) return keller_error_memory(error, capacity * sizeof *slots);
        for (size_t i = 0; i < names->capacity; i++)
            if (names->slots[i].key) *find_slot(slots, capacity, names->slots[i].key) = names->slots[i];
        free(names->slots);
        names->slots = slots;
        names->capacity = capacity;
    }
    struct KellerLookupSlot *slot = find_slot(names->slots, names->capacity, name);
    names->used += !slot->key;
    *slot = (struct KellerLookupSlot){name, value};
    return KELLER_OK;
}

void keller_lookup_free(KellerLookup *names)
{
    free(names->slots);
    *names = (KellerLookup){0};
}

/* ---- arrays ---- */

KellerStatus keller_grow(void *array, size_t *capacity, size_t needed, size_t item, KellerError *error)
{
    if (needed <= *capacity) return KELLER_OK;
    size_t grown = *capacity < 32 ? 64 : 2 * *capacity;
    if (grown < needed) grown = needed;
    void *old, *block = NULL;
    memcpy(&old, array, sizeof old);
    if (grown <= SIZE_MAX / item) block = realloc(old, grown * item);
    if (!block) return keller_error_memory(error, (unsigned long long)grown * item);
    memcpy(array, &block, sizeof block);
    *capacity = grown;
    return KELLER_OK;
}

void keller_build_free(KellerBuild *build)
{
    keller_soup_free(&build->soup);
    keller_lookup_free(&build->objects);
    keller_lookup_free(&build->materials);
    keller_polygon_free(&build->scratch);
    free(build->cut);
    *build = (KellerBuild){0};
}

KellerStatus keller_build_vertex(KellerBuild *build, KellerVec3 p, KellerError *error)
{
    KellerSoup *soup = &build->soup;
    assert(isfinite(p.x) && isfinite(p.y) && isfinite(p.z));
    if (soup->vertex_count >= UINT32_MAX - 1)
        return keller_error(error, KELLER_FAILED, "the scene has more than %u vertices", UINT32_MAX - 1);
    KellerStatus status = keller_grow(&soup->vertices, &build->vertex_capacity, soup->vertex_count + 1,
                                      sizeof *soup->vertices, error);
    if (status == KELLER_OK) soup->vertices[soup->vertex_count++] = p;
    return status;
}

static KellerStatus add_triangles(KellerBuild *build, uint32_t (*triangles)[3], size_t count, uint32_t object,
                                  uint32_t material, KellerError *error)
{
    KellerSoup *soup = &build->soup;
    size_t total = soup->triangle_count + count;
    if (total >= UINT32_MAX)
        return keller_error(error, KELLER_FAILED, "the scene has more than %u triangles", UINT32_MAX - 1);
    KellerStatus status = keller_grow(&soup->triangles, &build->triangle_capacity, total, sizeof *soup->triangles, error);
    if (status == KELLER_OK)
        status = keller_grow(&soup->object, &build->index_capacity[0], total, sizeof *soup->object, error);
    if (status == KELLER_OK)
        status = keller_grow(&soup->material, &build->index_capacity[1], total, sizeof *soup->material, error);
    if (status != KELLER_OK) return status;
    memcpy(soup->triangles + soup->triangle_count, triangles, count * sizeof *triangles);
    for (; soup->triangle_count < total; soup->triangle_count++) {
        soup->object[soup->triangle_count] = object;
        soup->material[soup->triangle_count] = material;
    }
    return KELLER_OK;
}

KellerStatus keller_build_polygon(KellerBuild *build, KellerPlace place, const uint32_t *corners, size_t count,
                                  uint32_t object, uint32_t material, KellerError *error)
{
    assert(count >= 3);
    if (count == 3) {
        uint32_t triangle[1][3] = {{corners[0], corners[1], corners[2]}};
        return add_triangles(build, triangle, 1, object, material, error);
    }
    if (count > KELLER_POLYGON_MAX_CORNERS)
        return keller_bad(place, error, "a polygon with %zu corners; expected at most %u", count,
                          KELLER_POLYGON_MAX_CORNERS);
    KellerStatus status = keller_grow(&build->cut, &build->cut_capacity, count - 2, sizeof *build->cut, error);
    if (status != KELLER_OK) return status;
    bool simple;
    status = keller_polygon_cut(build->soup.vertices, corners, count, build->cut, &simple, &build->scratch, error);
    if (status != KELLER_OK) return status;
    build->soup.polygons_split++;
    build->not_simple += !simple;
    return add_triangles(build, build->cut, count - 2, object, material, error);
}

/* ---- objects and materials ---- */

static bool valid_utf8(const unsigned char *p, size_t n)
{
    for (size_t i = 0; i < n;) {
        size_t more = p[i] < 0x80 ? 0 : p[i] >= 0xc2 && p[i] < 0xe0 ? 1 : p[i] >= 0xe0 && p[i] < 0xf0 ? 2
                      : p[i] >= 0xf0 && p[i] < 0xf5 ? 3 : n;
        if (more >= n - i) return false;
        /* Over-long forms, surrogates and what is above U+10FFFF show in the second byte. */
        if (more >= 2 && ((p[i] == 0xe0 && p[i + 1] < 0xa0) || (p[i] == 0xed && p[i + 1] >= 0xa0) ||
                          (p[i] == 0xf0 && p[i + 1] < 0x90) || (p[i] == 0xf4 && p[i + 1] >= 0x90)))
            return false;
        for (size_t k = 1; k <= more; k++)
            if ((p[i + k] & 0xc0) != 0x80) return false;
        i += more + 1;
    }
    return true;
}

/* A clean copy with room for a suffix of 16 bytes. */
static char *clean_name(const char *name, size_t length)
{
    char *copy = malloc(2 * length + 32), *out = copy;
    if (!copy) return NULL;
    bool utf8 = valid_utf8((const unsigned char *)name, length);
    for (size_t i = 0; i < length; i++) {
        unsigned char c = (unsigned char)name[i];
        if (c < 32 || c == 127) {
            *out++ = '_';
        } else if (c < 0x80 || utf8) {
            *out++ = (char)c;
        } else {
            *out++ = (char)(0xc0 | c >> 6);
            *out++ = (char)(0x80 | (c & 0x3f));
        }
    }
    if (out == copy) *out++ = '_';
    *out = '\0';
    return copy;
}

/* Appends _2, _3, ... until the name is free. */
static void make_unique(const KellerLookup *names, char *name)
{
    char *suffix = name + strlen(name);
    for (unsigned k = 2; keller_lookup_find(names, name) != UINT32_MAX; k++) snprintf(suffix, 16, "_%u", k);
}

KellerStatus keller_build_object(KellerBuild *build, const char *name, size_t length, bool unique, uint32_t *index,
                                 KellerError *error)
{
    KellerSoup *soup = &build->soup;
    char *copy = clean_name(name, length);
    if (!copy) return keller_error_memory(error, 2 * length + 32);
    uint32_t found = keller_lookup_find(&build->objects, copy);
    if (found != UINT32_MAX && !unique) {
        free(copy);
        *index = found;
        return KELLER_OK;
    }
    make_unique(&build->objects, copy);
    KellerStatus status = keller_grow(&soup->objects, &build->object_capacity, soup->object_count + 1,
                                      sizeof *soup->objects, error);
    if (status == KELLER_OK) status = keller_lookup_add(&build->objects, copy, (uint32_t)soup->object_count, error);
    if (status != KELLER_OK) {
        free(copy);
        return status;
    }
    *index = (uint32_t)soup->object_count;
    soup->objects[soup->object_count++] = copy;
    return KELLER_OK;
}

static bool same_constants(const KellerMaterial *a, const KellerMaterial *b)
{
    return a->kind == b->kind && strcmp(a->itu, b->itu) == 0 && a->permittivity == b->permittivity &&
           a->conductivity == b->conductivity && a->thickness == b->thickness;
}

KellerStatus keller_build_material(KellerBuild *build, const KellerMaterial *material, uint32_t *index,
                                   KellerError *error)
{
    KellerSoup *soup = &build->soup;
    size_t length = strlen(material->name);
    char *copy = clean_name(material->name, length);
    if (!copy) return keller_error_memory(error, 2 * length + 32);
    uint32_t found = keller_lookup_find(&build->materials, copy);
    if (found != UINT32_MAX && same_constants(&soup->materials[found], material)) {
        free(copy);
        *index = found;
        return KELLER_OK;
    }
    make_unique(&build->materials, copy);
    KellerStatus status = keller_grow(&soup->materials, &build->material_capacity, soup->material_count + 1,
                                      sizeof *soup->materials, error);
    if (status == KELLER_OK) status = keller_lookup_add(&build->materials, copy, (uint32_t)soup->material_count, error);
    if (status != KELLER_OK) {
        free(copy);
        return status;
    }
    *index = (uint32_t)soup->material_count;
    soup->materials[soup->material_count] = *material;
    soup->materials[soup->material_count++].name = copy;
    return KELLER_OK;
}

KellerStatus keller_mesh_owner(KellerBuild *build, const KellerMeshFile *mesh, uint32_t *object, uint32_t *material,
                               KellerError *error)
{
    *material = mesh->has_material ? mesh->material : KELLER_NO_MATERIAL;
    *object = mesh->object;
    if (mesh->has_object) return KELLER_OK;
    return keller_build_object(build, mesh->name, strlen(mesh->name), false, object, error);
}

/* ---- notes ---- */

KellerStatus keller_build_note(KellerBuild *build, KellerError *error, const char *format, ...)
{
    if (build->note_count++ >= MAX_NOTES) return KELLER_OK;
    char line[600];
    va_list args;
    va_start(args, format);
    vsnprintf(line, sizeof line, format, args);
    va_end(args);
    size_t length = strlen(line);
    KellerStatus status = keller_grow(&build->soup.notes, &build->notes_capacity, build->notes_length + length + 2, 1, error);
    if (status != KELLER_OK) return status;
    memcpy(build->soup.notes + build->notes_length, line, length);
    build->notes_length += length;
    memcpy(build->soup.notes + build->notes_length++, "\n", 2);
    return KELLER_OK;
}

KellerStatus keller_build_finish(KellerBuild *build, const char *file, double scale, KellerSoup *soup,
                                 KellerError *error)
{
    KellerSoup *built = &build->soup;
    KellerStatus status = KELLER_OK;
    for (size_t i = 0; i < built->vertex_count && scale != 1; i++) {
        KellerVec3 p = v3_scale(built->vertices[i], scale);
        if (!isfinite(p.x) || !isfinite(p.y) || !isfinite(p.z))
            return keller_error(error, KELLER_BAD_INPUT, "%s: a coordinate overflows when scaled by %g", file, scale);
        built->vertices[i] = p;
    }
    if (build->not_simple)
        status = keller_build_note(build, error, "%s: %zu polygon%s itself or has no area", file, build->not_simple,
                                   build->not_simple == 1 ? " crosses" : "s, each of which crosses");
    if (status == KELLER_OK && build->note_count > MAX_NOTES) {
        size_t more = build->note_count - MAX_NOTES;
        build->note_count = 0;
        status = keller_build_note(build, error, "%s: %zu more of such notes", file, more);
    }
    if (status == KELLER_OK && !built->notes) {
        built->notes = calloc(1, 1);
        if (!built->notes) status = keller_error_memory(error, 1);
    }
    if (status != KELLER_OK) return status;
    *soup = *built;
    *built = (KellerSoup){0};
    keller_build_free(build);
    return KELLER_OK;
}
