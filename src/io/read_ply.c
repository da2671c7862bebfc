/* PLY, as text and binary in both byte orders. */
#include <stdlib.h>
#include <string.h>

#include "io/ply_header.h"

typedef struct {
    KellerBuild *build;
    const char *begin;
    KellerText text;              /* of a binary file, only p and end move */
    KellerPlyHeader header;
    bool binary;
    size_t base;
    uint32_t object, material;
    uint32_t *corners;
    size_t corner_capacity;
} Ply;

static KellerPlace here(const Ply *ply)
{
    return (KellerPlace){.file = ply->text.file, .binary = ply->binary,
                         .at = ply->binary ? (uint64_t)(ply->text.p - ply->begin) : ply->text.line};
}

/* Every type's values are doubles exactly. */
static double decode(const char *bytes, KellerPlyType type, bool big)
{
    size_t size = keller_ply_size(type);
    uint64_t u = 0;
    for (size_t i = 0; i < size; i++) u = u << 8 | (unsigned char)bytes[big ? i : size - 1 - i];
    switch (type) {
    case KELLER_PLY_INT8: return (double)(int8_t)u;
    case KELLER_PLY_INT16: return (double)(int16_t)u;
    case KELLER_PLY_INT32: return (double)(int32_t)u;
    case KELLER_PLY_UINT8:
    case KELLER_PLY_UINT16:
    case KELLER_PLY_UINT32: return (double)u;
    case KELLER_PLY_FLOAT32: {
        uint32_t bits = (uint32_t)u;
        float value;
        memcpy(&value, &bits, sizeof value);
        return (double)value;
    }
    default: {
        double value;
        memcpy(&value, &u, sizeof value);
        return value;
    }
    }
}

static KellerStatus truncated(const Ply *ply, const KellerPlyElement *element, uint64_t index, KellerError *error)
{
    return keller_bad(here(ply), error, "the %s ends within entry %llu of element `%s`; expected %llu entries",
                      ply->binary ? "file" : "line", (unsigned long long)index + 1,
                      keller_token_quote(element->name).text, (unsigned long long)element->count);
}

/* Passes over `count` values; *value, if not NULL, gets the last one. What is passed over only need be there. */
static KellerStatus values(Ply *ply, const KellerPlyElement *element, uint64_t index, KellerPlyType type, uint64_t count,
                           double *value, KellerError *error)
{
    if (ply->binary) {
        size_t size = keller_ply_size(type);
        if (count > (uint64_t)(ply->text.end - ply->text.p) / size) return truncated(ply, element, index, error);
        if (value) *value = decode(ply->text.p, type, ply->header.format == KELLER_PLY_BIG);
        ply->text.p += count * size;
        return KELLER_OK;
    }
    KellerToken token;
    for (uint64_t i = 0; i < count; i++)
        if (!keller_text_token(&ply->text, &token)) return truncated(ply, element, index, error);
    if (value && !keller_token_double(token, value))
        return keller_bad(here(ply), error, "found `%s`; expected a finite number", keller_token_quote(token).text);
    return KELLER_OK;
}

static KellerStatus list_length(Ply *ply, const KellerPlyElement *element, uint64_t index, KellerPlyType type,
                                uint64_t *length, KellerError *error)
{
    KellerPlace place = here(ply);
    double value;
    KellerStatus status = values(ply, element, index, type, 1, &value, error);
    if (status != KELLER_OK) return status;
    if (!(value >= 0 && value < 9e15 && value == floor(value)))
        return keller_bad(place, error, "a list of %g values; expected a whole number, 0 or more", value);
    *length = (uint64_t)value;
    return KELLER_OK;
}

static KellerStatus read_corners(Ply *ply, const KellerPlyElement *element, uint64_t index,
                                 const KellerPlyProperty *property, KellerError *error)
{
    KellerPlace place = here(ply);
    uint64_t length, left;
    KellerStatus status = list_length(ply, element, index, property->count_type, &length, error);
    if (status != KELLER_OK) return status;
    left = (uint64_t)(ply->text.end - ply->text.p) / (ply->binary ? keller_ply_size(property->type) : 2);
    if (length < 3)
        return keller_bad(place, error, "a face with %llu corners; expected at least 3", (unsigned long long)length);
    if (length > left)
        return keller_bad(place, error, "a face with %llu corners; expected at most %llu, as many as the file could hold",
                          (unsigned long long)length, (unsigned long long)left);
    status = keller_grow(&ply->corners, &ply->corner_capacity, (size_t)length, sizeof *ply->corners, error);
    for (uint64_t i = 0; i < length && status == KELLER_OK; i++) {
        KellerPlace at = here(ply);
        double v = -1;
        status = values(ply, element, index, property->type, 1, &v, error);
        if (status != KELLER_OK) return status;
        if (!(v >= 0 && v < (double)ply->header.vertices && v == floor(v)))
            return keller_bad(at, error, "vertex %.17g in a face; expected a whole number from 0 and below %llu, the number "
                              "of vertices", v, (unsigned long long)ply->header.vertices);
        ply->corners[i] = (uint32_t)(ply->base + (size_t)v);
    }
    if (status != KELLER_OK) return status;
    return keller_build_polygon(ply->build, place, ply->corners, (size_t)length, ply->object, ply->material, error);
}

static KellerStatus entry(Ply *ply, const KellerPlyElement *element, uint64_t index, bool vertices, bool faces,
                          KellerError *error)
{
    double p[3] = {0, 0, 0};
    vertices &= element->kind == KELLER_PLY_VERTEX;
    for (size_t i = 0; i < element->property_count; i++) {
        const KellerPlyProperty *property = &element->properties[i];
        KellerStatus status;
        KellerPlace place = here(ply);
        if (property->role == KELLER_PLY_CORNERS && faces) {
            status = read_corners(ply, element, index, property, error);
        } else if (property->list) {
            uint64_t length = 0;
            status = list_length(ply, element, index, property->count_type, &length, error);
            if (status == KELLER_OK) status = values(ply, element, index, property->type, length, NULL, error);
        } else {
            double *value = vertices && property->role ? &p[property->role - KELLER_PLY_X] : NULL;
            status = values(ply, element, index, property->type, 1, value, error);
            if (status == KELLER_OK && value && !isfinite(*value))
                return keller_bad(place, error, "%c of vertex %llu is %g; expected a finite number",
                                  "xyz"[property->role - KELLER_PLY_X], (unsigned long long)index, *value);
        }
        if (status != KELLER_OK) return status;
    }
    return vertices ? keller_build_vertex(ply->build, v3(p[0], p[1], p[2]), error) : KELLER_OK;
}

/* In a text, every entry has a line of its own. */
static KellerStatus text_line(Ply *ply, const KellerPlyElement *element, uint64_t index, bool vertices, bool faces,
                              KellerError *error)
{
    if (!keller_text_content(&ply->text))
        return keller_bad(here(ply), error, "the file ends before entry %llu of element `%s`; expected %llu entries",
                          (unsigned long long)index + 1, keller_token_quote(element->name).text,
                          (unsigned long long)element->count);
    KellerStatus status = entry(ply, element, index, vertices, faces, error);
    KellerToken token;
    if (status == KELLER_OK && keller_text_token(&ply->text, &token))
        return keller_bad(here(ply), error, "`%s` follows the last value of element `%s`; expected the end of the line",
                          keller_token_quote(token).text, keller_token_quote(element->name).text);
    keller_text_next_line(&ply->text);
    return status;
}

static KellerStatus body(Ply *ply, bool vertices, bool faces, KellerError *error)
{
    for (size_t e = 0; e < ply->header.element_count; e++) {
        const KellerPlyElement *element = &ply->header.elements[e];
        if (!element->property_count) continue; /* takes no space, however many there are */
        for (uint64_t i = 0; i < element->count; i++) {
            KellerStatus status = ply->binary ? entry(ply, element, i, vertices, faces, error)
                                              : text_line(ply, element, i, vertices, faces, error);
            if (status != KELLER_OK) return status;
        }
    }
    return KELLER_OK;
}

/* What the file holds beyond vertices and faces is said, as it may be geometry (tristrips). */
static KellerStatus notes(Ply *ply, KellerError *error)
{
    KellerStatus status = KELLER_OK;
    for (size_t e = 0; e < ply->header.element_count && status == KELLER_OK; e++) {
        const KellerPlyElement *element = &ply->header.elements[e];
        if (element->kind == KELLER_PLY_OTHER && element->count)
            status = keller_build_note(ply->build, error, "%s:%lu: element `%s` (%llu entries) is left out", ply->text.file,
                                       element->line, keller_token_quote(element->name).text,
                                       (unsigned long long)element->count);
    }
    if (status == KELLER_OK && (ply->binary ? ply->text.p < ply->text.end : keller_text_content(&ply->text)))
        status = keller_build_note(ply->build, error, ply->binary ? "%s: byte %llu: what follows the last element is left out"
                                                                  : "%s:%llu: what follows the last element is left out",
                                   ply->text.file, (unsigned long long)here(ply).at);
    return status;
}

static KellerStatus read_body(Ply *ply, KellerError *error)
{
    bool face_seen = false, face_first = false;
    for (size_t e = 0; e < ply->header.element_count; e++) {
        face_seen |= ply->header.elements[e].kind == KELLER_PLY_FACE;
        face_first |= face_seen && ply->header.elements[e].kind == KELLER_PLY_VERTEX;
    }
    KellerStatus status = KELLER_OK;
    if (face_first) { /* a polygon cannot be cut before its vertices are known: go over the body twice */
        KellerText start = ply->text;
        status = body(ply, true, false, error);
        ply->text = start;
    }
    if (status == KELLER_OK) status = body(ply, !face_first, true, error);
    return status == KELLER_OK ? notes(ply, error) : status;
}

KellerStatus keller_read_ply(KellerBuild *build, const KellerMeshFile *mesh, KellerError *error)
{
    Ply ply = {.build = build, .begin = mesh->data, .text = keller_text(mesh->file, mesh->data, mesh->size),
               .base = build->soup.vertex_count};
    KellerStatus status = keller_ply_header_read(&ply.text, &ply.header, error);
    ply.binary = ply.header.format != KELLER_PLY_ASCII;
    if (status == KELLER_OK) status = keller_mesh_owner(build, mesh, &ply.object, &ply.material, error);
    if (status == KELLER_OK) status = read_body(&ply, error);
    keller_ply_header_free(&ply.header);
    free(ply.corners);
    return status;
}
