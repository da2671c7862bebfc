/* Wavefront OBJ: v, f, o, g, usemtl. What only serves rendering is skipped; a statement that no OBJ file knows is an
 * error, so that a file of another kind is not read as an empty scene. */
#include <stdlib.h>
#include <string.h>

#include "io/soup_build.h"
#include "io/text.h"

typedef struct {
    KellerBuild *build;
    const KellerMeshFile *mesh;
    KellerText text;
    size_t base;                /* of this file's vertices in the soup */
    uint64_t vertices, total;   /* seen so far, in the whole file */
    uint32_t *corners;
    size_t corner_capacity;
    /* Names take effect with the next face, so that a name without faces makes no object. */
    KellerToken object_name, material_name;
    bool object_pending, material_pending;
    unsigned long material_line;
    uint32_t object, material;
    bool noted_library, noted_left_out;
} Obj;

static KellerPlace here(const Obj *obj) { return (KellerPlace){.file = obj->text.file, .at = obj->text.line}; }

/* v x y z, then nothing, w, or a colour (which some programs write), or both. The weight w is for curves only. */
static KellerStatus vertex(Obj *obj, KellerError *error)
{
    static const char *const names[] = {"x", "y", "z", "the value behind z", "the value behind z", "the value behind z",
                                        "the value behind z"};
    double value[7];
    int count = 0;
    for (;; count++) {
        KellerText ahead = obj->text;
        KellerToken token;
        if (count >= 3 && !keller_text_token(&ahead, &token)) break;
        if (count == 7) return keller_bad(here(obj), error, "a vertex with more than 7 values; expected x y z");
        KellerStatus status = keller_text_coordinate(&obj->text, names[count], &value[count], error);
        if (status != KELLER_OK) return status;
    }
    if (count == 5) return keller_bad(here(obj), error, "a vertex with 5 values; expected x y z, perhaps with w or a colour");
    obj->vertices++;
    return keller_build_vertex(obj->build, v3(value[0], value[1], value[2]), error);
}

/* Reads v, v/vt, v//vn or v/vt/vn and gives v as an index into the soup's vertices. */
static KellerStatus corner(Obj *obj, KellerToken token, uint32_t *index, KellerError *error)
{
    const char *p = token.begin;
    int64_t v;
    if (!keller_text_integer(&p, token.end, &v))
        return keller_bad(here(obj), error, "a face's corner is `%s`; expected v, v/vt, v//vn or v/vt/vn",
                          keller_token_quote(token).text);
    for (int part = 0; part < 2 && p < token.end && *p == '/'; part++) {
        int64_t unused;
        p++;
        keller_text_integer(&p, token.end, &unused);
    }
    if (p != token.end)
        return keller_bad(here(obj), error, "a face's corner is `%s`; expected v, v/vt, v//vn or v/vt/vn",
                          keller_token_quote(token).text);
    if (v == 0) return keller_bad(here(obj), error, "vertex 0 in a face; expected numbers from 1, or from -1 downwards");
    if (v < 0 && (uint64_t)-v > obj->vertices)
        return keller_bad(here(obj), error, "vertex %lld in a face; expected -1 to -%llu, the vertices before this line",
                          (long long)v, (unsigned long long)obj->vertices);
    if (v > 0 && (uint64_t)v > obj->total)
        return keller_bad(here(obj), error, "vertex %lld in a face; expected 1 to %llu, the vertices of the file",
                          (long long)v, (unsigned long long)obj->total);
    uint64_t at = obj->base + (v < 0 ? obj->vertices - (uint64_t)-v : (uint64_t)v - 1);
    if (at >= UINT32_MAX) return keller_error(error, KELLER_FAILED, "the scene has more than %u vertices", UINT32_MAX - 1);
    *index = (uint32_t)at;
    return KELLER_OK;
}

/* Puts the names into effect that o, g and usemtl have left. */
static KellerStatus owner(Obj *obj, KellerError *error)
{
    KellerStatus status = KELLER_OK;
    if (obj->object_pending) {
        obj->object_pending = false;
        KellerToken name = obj->object_name;
        if (name.begin == name.end) name = (KellerToken){obj->mesh->name, obj->mesh->name + strlen(obj->mesh->name)};
        status = keller_build_object(obj->build, name.begin, (size_t)(name.end - name.begin), false, &obj->object, error);
    }
    if (status == KELLER_OK && obj->material_pending) {
        obj->material_pending = false;
        obj->material = KELLER_NO_MATERIAL;
        KellerToken token = obj->material_name;
        if (token.begin == token.end) return KELLER_OK;
        char *name = strndup(token.begin, (size_t)(token.end - token.begin));
        if (!name) return keller_error_memory(error, (size_t)(token.end - token.begin) + 1);
        KellerMaterial material;
        KellerPlace place = {.file = obj->mesh->file, .at = obj->material_line};
        status = keller_material_of_name(place, name, &material, error);
        if (status == KELLER_OK) status = keller_build_material(obj->build, &material, &obj->material, error);
        free(name);
    }
    return status;
}

static KellerStatus face(Obj *obj, KellerError *error)
{
    KellerPlace place = here(obj);
    size_t count = 0;
    KellerToken token;
    KellerStatus status;
    while (keller_text_token(&obj->text, &token)) {
        status = keller_grow(&obj->corners, &obj->corner_capacity, count + 1, sizeof *obj->corners, error);
        if (status == KELLER_OK) status = corner(obj, token, &obj->corners[count++], error);
        if (status != KELLER_OK) return status;
    }
    if (count < 3) return keller_bad(place, error, "a face with %zu corner%s; expected at least 3", count, count == 1 ? "" : "s");
    status = owner(obj, error);
    if (status != KELLER_OK) return status;
    return keller_build_polygon(obj->build, place, obj->corners, count, obj->object, obj->material, error);
}

static bool is_one_of(KellerToken token, const char *const *words)
{
    for (; *words; words++)
        if (keller_token_is(token, *words)) return true;
    return false;
}

/* The first of two passes: vertices, and whether this is an OBJ file at all. */
static KellerStatus first_pass(Obj *obj, KellerToken word, KellerError *error)
{
    static const char *const skipped[] = {"f", "fo", "o", "g", "usemtl", "vt", "vn", "vp", "s", "mg", "lod", "bevel",
                                          "c_interp", "d_interp", "usemap", "maplib", "shadow_obj", "trace_obj", NULL};
    static const char *const left_out[] = {"l", "p", "cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm",
                                           "trim", "hole", "scrv", "sp", "end", "con", "ctech", "stech", "call", "csh",
                                           NULL};
    if (keller_token_is(word, "v")) return vertex(obj, error);
    if (is_one_of(word, skipped)) return KELLER_OK;
    if (keller_token_is(word, "mtllib")) {
        if (obj->noted_library) return KELLER_OK;
        obj->noted_library = true;
        return keller_build_note(obj->build, error, "%s:%lu: mtllib is not read: it says nothing about radio materials",
                                 obj->text.file, obj->text.line);
    }
    if (is_one_of(word, left_out)) {
        if (obj->noted_left_out) return KELLER_OK;
        obj->noted_left_out = true;
        return keller_build_note(obj->build, error, "%s:%lu: `%s` and the like are left out: only faces are read",
                                 obj->text.file, obj->text.line, keller_token_quote(word).text);
    }
    return keller_bad(here(obj), error, "unknown statement `%s`; expected one of OBJ such as v, f, g or usemtl",
                      keller_token_quote(word).text);
}

/* The second: faces, which may name vertices that follow them, and whose they are. */
static KellerStatus second_pass(Obj *obj, KellerToken word, KellerError *error)
{
    if (keller_token_is(word, "v")) {
        obj->vertices++;
    } else if (keller_token_is(word, "f") || keller_token_is(word, "fo")) {
        return face(obj, error);
    } else if (!obj->mesh->has_object && (keller_token_is(word, "o") || keller_token_is(word, "g"))) {
        obj->object_name = keller_text_rest(&obj->text);
        obj->object_pending = true;
    } else if (!obj->mesh->has_material && keller_token_is(word, "usemtl")) {
        obj->material_line = obj->text.line;
        obj->material_name = keller_text_rest(&obj->text);
        obj->material_pending = true;
    }
    return KELLER_OK;
}

typedef KellerStatus Pass(Obj *, KellerToken, KellerError *);

static KellerStatus run_pass(Obj *obj, Pass *pass, KellerError *error)
{
    obj->text = keller_text(obj->mesh->file, obj->mesh->data, obj->mesh->size);
    obj->text.comment = '#';
    obj->text.continuation = true;
    obj->vertices = 0;
    KellerToken token;
    do {
        KellerStatus status = keller_text_token(&obj->text, &token) ? pass(obj, token, error) : KELLER_OK;
        if (status != KELLER_OK) return status;
        while (keller_text_token(&obj->text, &token)) {} /* to the end of a statement of several lines */
    } while (keller_text_next_line(&obj->text));
    return KELLER_OK;
}

KellerStatus keller_read_obj(KellerBuild *build, const KellerMeshFile *mesh, KellerError *error)
{
    Obj obj = {.build = build,
               .mesh = mesh,
               .base = build->soup.vertex_count,
               .object = mesh->object,
               .object_pending = !mesh->has_object,
               .material = mesh->has_material ? mesh->material : KELLER_NO_MATERIAL};
    KellerStatus status = run_pass(&obj, first_pass, error);
    obj.total = obj.vertices;
    if (status == KELLER_OK) status = run_pass(&obj, second_pass, error);
    free(obj.corners);
    return status;
}
