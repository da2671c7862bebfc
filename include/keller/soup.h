/* keller/soup.h -- a scene as its file gives it: triangles in double precision, with material and object names.
 *
 * Formats, by the file's extension (case ignored): .obj, .ply, .stl, .off, and .xml (Mitsuba, as Sionna RT writes it).
 * Polygons are triangulated (by ear clipping, the best-shaped ear first). Coordinates are read in double precision. */
#ifndef KELLER_SOUP_H
#define KELLER_SOUP_H
#include <stddef.h>
#include <stdint.h>
#include "keller/error.h"
#include "keller/material.h"
#include "keller/vec.h"

#define KELLER_NO_MATERIAL UINT32_MAX

typedef struct {
    size_t vertex_count;
    KellerVec3 *vertices;
    size_t triangle_count;
    uint32_t (*triangles)[3];    /* indices into vertices */
    uint32_t *material;          /* [triangle_count] index into materials, or KELLER_NO_MATERIAL */
    uint32_t *object;            /* [triangle_count] index into objects */
    size_t material_count;
    KellerMaterial *materials;   /* names unique; a name that says nothing radio-wise has kind NAMED */
    size_t object_count;
    char **objects;              /* names unique, never empty */
    /* what happened while reading, for the report */
    size_t files, polygons_split;
    char *notes;                 /* owned; lines of text (what was left out and why), or "" */
} KellerSoup;

/* Reads a scene. `file` is a path; files it refers to are relative to its own folder. `scale` (> 0) multiplies all
 * coordinates. On success *soup is filled and owned by the caller (keller_soup_free); on failure it is empty.
 * Errors: KELLER_IO (cannot open or read), KELLER_BAD_INPUT (with FILE:LINE or `FILE: byte N`): syntax, an index out of
 * range, a coordinate that is not finite, a file without triangles is NOT an error (triangle_count = 0). */
KellerStatus keller_soup_read(const char *file, double scale, KellerSoup *soup, KellerError *error);

/* Frees what *soup owns and empties it. */
void keller_soup_free(KellerSoup *soup);
#endif
