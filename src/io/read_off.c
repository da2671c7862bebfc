/* Geomview OFF with its optional prefixes: [ST][C][N]OFF. A reader of our own for the reason that read_stl.c gives. */
#include <stdlib.h>
#include <string.h>

#include "io/soup_build.h"
#include "io/text.h"

typedef struct {
    KellerBuild *build;
    const KellerMeshFile *mesh;
    KellerText text;
    bool texture, colour, normal; /* prefixes */
    int64_t vertices, faces;
    size_t base;
    uint32_t object, material;
} Off;

static KellerPlace here(const Off *off) { return (KellerPlace){.file = off->text.file, .at = off->text.line}; }

static KellerStatus header(Off *off, KellerError *error)
{
    KellerToken token;
    bool any = keller_text_content(&off->text);
    if (any) keller_text_token(&off->text, &token);
    else token = (KellerToken){off->text.p, off->text.p};
    const char *p = token.begin;
    if (token.end - p > 2 && p[0] == 'S' && p[1] == 'T') off->texture = true, p += 2;
    if (token.end - p > 1 && p[0] == 'C') off->colour = true, p++;
    if (token.end - p > 1 && p[0] == 'N') off->normal = true, p++;
    if (!keller_token_is((KellerToken){p, token.end}, "OFF"))
        return keller_bad(here(off), error, "the file begins with `%s`; expected OFF, perhaps as COFF, NOFF, CNOFF, STOFF",
                          keller_token_quote(token).text);
    /* The counts may stand in the first line or in the next. */
    KellerText ahead = off->text;
    if (keller_text_token(&ahead, &token) && keller_token_is(token, "BINARY"))
        return keller_bad(here(off), error, "this is a binary OFF file; expected a text");
    if (!keller_text_content(&off->text))
        return keller_bad(here(off), error, "the file ends; expected the numbers of vertices, faces and edges");
    int64_t count[3] = {0, 0, 0};
    for (int i = 0; keller_text_token(&off->text, &token); i++)
        if (i == 3 || !keller_token_integer(token, &count[i]) || count[i] < 0)
            return keller_bad(here(off), error, "found `%s`; expected the numbers of vertices, faces and edges",
                              keller_token_quote(token).text);
        else if (i == 1) off->faces = count[1];
        else if (i == 0) off->vertices = count[0], off->faces = -1;
    if (off->faces < 0)
        return keller_bad(here(off), error, "one number; expected the numbers of vertices, faces and edges");
    /* A vertex takes at least 6 bytes ("0 0 0" and a line end), a face 8: the last line may lack its end. */
    uint64_t left = (uint64_t)(off->text.end - off->text.p) + 1;
    if ((uint64_t)off->vertices > left / 6)
        return keller_bad(here(off), error, "%lld vertices; expected at most %llu, as many as the file could hold",
                          (long long)off->vertices, (unsigned long long)(left / 6));
    if ((uint64_t)off->faces > left / 8)
        return keller_bad(here(off), error, "%lld faces; expected at most %llu, as many as the file could hold",
                          (long long)off->faces, (unsigned long long)(left / 8));
    return KELLER_OK;
}

/* Goes to the next line that holds something. */
static KellerStatus next(Off *off, const char *what, int64_t index, int64_t count, KellerError *error)
{
    keller_text_next_line(&off->text);
    if (keller_text_content(&off->text)) return KELLER_OK;
    return keller_bad(here(off), error, "the file ends before %s %lld; expected %lld of them", what, (long long)index + 1,
                      (long long)count);
}

/* The numbers left in the line, which are not used but must be numbers. */
static KellerStatus skip_numbers(Off *off, const char *what, int least, int most, KellerError *error)
{
    KellerToken token;
    int count = 0;
    for (; keller_text_token(&off->text, &token); count++) {
        double unused;
        if (!keller_token_double(token, &unused) && !keller_token_is_nocase(token, "nan"))
            return keller_bad(here(off), error, "found `%s` behind %s; expected a number", keller_token_quote(token).text, what);
        if (count == most)
            return keller_bad(here(off), error, "more than %d numbers behind %s; expected the end of the line", most, what);
    }
    if (count < least)
        return keller_bad(here(off), error, "%d numbers behind %s; expected at least %d, as the file's header says", count,
                          what, least);
    return KELLER_OK;
}

static KellerStatus read_vertices(Off *off, KellerError *error)
{
    static const char *const axes[] = {"x", "y", "z"};
    int least = (off->normal ? 3 : 0) + (off->colour ? 3 : 0) + (off->texture ? 2 : 0);
    for (int64_t i = 0; i < off->vertices; i++) {
        double v[3];
        KellerStatus status = next(off, "vertex", i, off->vertices, error);
        for (int k = 0; k < 3 && status == KELLER_OK; k++) status = keller_text_coordinate(&off->text, axes[k], &v[k], error);
        /* Some programs write colours without saying so in the header. */
        if (status == KELLER_OK) status = skip_numbers(off, "a vertex", least, least + 4, error);
        if (status == KELLER_OK) status = keller_build_vertex(off->build, v3(v[0], v[1], v[2]), error);
        if (status != KELLER_OK) return status;
    }
    return KELLER_OK;
}

static KellerStatus read_face(Off *off, uint32_t **corners, size_t *capacity, KellerError *error)
{
    KellerToken token;
    int64_t count;
    keller_text_token(&off->text, &token);
    KellerPlace place = here(off);
    if (!keller_token_integer(token, &count))
        return keller_bad(place, error, "found `%s`; expected a face's number of corners", keller_token_quote(token).text);
    if (count < 3) return keller_bad(place, error, "a face with %lld corners; expected at least 3", (long long)count);
    if (count > (off->text.end - off->text.p) / 2)
        return keller_bad(place, error, "a face with %lld corners; expected at most %lld, as many as the file could hold",
                          (long long)count, (long long)((off->text.end - off->text.p) / 2));
    KellerStatus status = keller_grow(corners, capacity, (size_t)count, sizeof **corners, error);
    if (status != KELLER_OK) return status;
    for (int64_t i = 0; i < count; i++) {
        int64_t v;
        if (!keller_text_token(&off->text, &token))
            return keller_bad(place, error, "the line ends after %lld corners; expected %lld", (long long)i, (long long)count);
        if (!keller_token_integer(token, &v) || v < 0 || v >= off->vertices)
            return keller_bad(place, error, "vertex `%s` in a face; expected 0 to %lld", keller_token_quote(token).text,
                              (long long)off->vertices - 1);
        (*corners)[i] = (uint32_t)(off->base + (size_t)v);
    }
    status = skip_numbers(off, "a face", 0, 4, error); /* a colour */
    if (status != KELLER_OK) return status;
    return keller_build_polygon(off->build, place, *corners, (size_t)count, off->object, off->material, error);
}

KellerStatus keller_read_off(KellerBuild *build, const KellerMeshFile *mesh, KellerError *error)
{
    Off off = {.build = build, .mesh = mesh, .text = keller_text(mesh->file, mesh->data, mesh->size),
               .base = build->soup.vertex_count};
    off.text.comment = '#';
    KellerStatus status = header(&off, error);
    if (status == KELLER_OK) status = keller_mesh_owner(build, mesh, &off.object, &off.material, error);
    if (status == KELLER_OK) status = read_vertices(&off, error);
    uint32_t *corners = NULL;
    size_t capacity = 0;
    for (int64_t i = 0; i < off.faces && status == KELLER_OK; i++) {
        status = next(&off, "face", i, off.faces, error);
        if (status == KELLER_OK) status = read_face(&off, &corners, &capacity, error);
    }
    free(corners);
    if (status != KELLER_OK) return status;
    keller_text_next_line(&off.text);
    if (keller_text_content(&off.text))
        status = keller_build_note(build, error, "%s:%lu: what follows the last face is left out", mesh->file, off.text.line);
    return status;
}
