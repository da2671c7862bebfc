/* io/soup_build.h -- a soup while the readers of the formats fill it. */
#ifndef KELLER_IO_SOUP_BUILD_H
#define KELLER_IO_SOUP_BUILD_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "io/polygon.h"
#include "keller/soup.h"

/* A place in a file, for messages: `FILE:LINE`, or `FILE: byte N` where `binary`. */
typedef struct {
    const char *file;
    bool binary;
    uint64_t at;
} KellerPlace;

/* KELLER_BAD_INPUT with the place before the printf-style message. */
KellerStatus keller_bad(KellerPlace place, KellerError *error, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Names and what they stand for; the keys belong to someone else. Starts from {0}. */
typedef struct {
    struct KellerLookupSlot *slots;
    size_t capacity, used;
} KellerLookup;
uint32_t keller_lookup_find(const KellerLookup *names, const char *name); /* UINT32_MAX: not there */
KellerStatus keller_lookup_add(KellerLookup *names, const char *name, uint32_t value, KellerError *error);
void keller_lookup_free(KellerLookup *names);

/* Makes room for `needed` items of `item` bytes in *array, at least doubling *capacity where it grows. */
KellerStatus keller_grow(void *array, size_t *capacity, size_t needed, size_t item, KellerError *error);

/* Starts from {0}; ends with keller_build_finish or keller_build_free. */
typedef struct {
    KellerSoup soup;
    size_t vertex_capacity, triangle_capacity, index_capacity[2], material_capacity, object_capacity;
    KellerLookup objects, materials;
    size_t notes_length, notes_capacity, note_count;
    size_t not_simple;             /* polygons that cross themselves or have no area */
    KellerPolygonScratch scratch;
    uint32_t (*cut)[3];
    size_t cut_capacity;
} KellerBuild;

void keller_build_free(KellerBuild *build);
/* Scales, hands the soup over and frees the rest. */
KellerStatus keller_build_finish(KellerBuild *build, const char *file, double scale, KellerSoup *soup,
                                 KellerError *error);

/* Indices of vertices count from the soup's first. Coordinates must be finite. */
KellerStatus keller_build_vertex(KellerBuild *build, KellerVec3 p, KellerError *error);
/* A polygon of at least 3 corners, which are valid indices. */
KellerStatus keller_build_polygon(KellerBuild *build, KellerPlace place, const uint32_t *corners, size_t count,
                                  uint32_t object, uint32_t material, KellerError *error);
/* The object of that name, made where there is none; with `unique` always a new one, renamed NAME_2, NAME_3, ... where
 * the name is taken. Text that is not UTF-8 is taken for Latin-1, control characters become `_`. */
KellerStatus keller_build_object(KellerBuild *build, const char *name, size_t length, bool unique, uint32_t *index,
                                 KellerError *error);
/* The material of that name (its `name` is copied), made where there is none. One that has the name but other constants
 * is not the same: the new one is renamed NAME_2, ... */
KellerStatus keller_build_material(KellerBuild *build, const KellerMaterial *material, uint32_t *index,
                                   KellerError *error);
/* Adds a line to the report. Only the first 50 are kept; the rest are counted. */
KellerStatus keller_build_note(KellerBuild *build, KellerError *error, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* What a material's name says: kind ITU with thickness 0 for itu_X, itu-X, mat-itu_X, mat-itu-X (a suffix such as .001
 * by which Blender tells copies apart is not part of X), else kind NAMED. material->name = name (borrowed).
 * Errors: X is not in the ITU table. */
KellerStatus keller_material_of_name(KellerPlace place, const char *name, KellerMaterial *material, KellerError *error);
bool keller_material_is_itu_name(const char *name);
/* The table's name for X (as above, prefixes allowed) into itu. */
KellerStatus keller_material_itu(KellerPlace place, const char *x, char itu[32], KellerError *error);

/* What a reader of one mesh file gets: the text or bytes, and whose triangles they are. */
typedef struct {
    const char *file;              /* for messages */
    const char *data;
    size_t size;
    const char *name;              /* of the object made of what the file does not name */
    bool has_object, has_material; /* given by the scene: what the file says about it is not used */
    uint32_t object, material;
} KellerMeshFile;

/* The object and material that faces belong to where the format has no names. */
KellerStatus keller_mesh_owner(KellerBuild *build, const KellerMeshFile *mesh, uint32_t *object, uint32_t *material,
                               KellerError *error);

KellerStatus keller_read_ply(KellerBuild *build, const KellerMeshFile *mesh, KellerError *error);
KellerStatus keller_read_obj(KellerBuild *build, const KellerMeshFile *mesh, KellerError *error);
KellerStatus keller_read_stl(KellerBuild *build, const KellerMeshFile *mesh, KellerError *error);
KellerStatus keller_read_off(KellerBuild *build, const KellerMeshFile *mesh, KellerError *error);
/* Reads the XML file itself and all it refers to. */
KellerStatus keller_read_mitsuba(KellerBuild *build, const char *file, KellerError *error);
#endif
