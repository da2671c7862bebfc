/* STL, text and binary. OpenMesh could read it, but its readers round every coordinate to single precision, even into a
 * mesh of doubles: a text that says 17.3 becomes 17.299999237, and a building at a UTM northing moves by decimetres. So
 * STL and OFF have readers of their own too. The single-precision numbers of a binary file become doubles exactly. */
#include <string.h>

#include "io/soup_build.h"
#include "io/text.h"

enum { HEADER = 80, FIRST = 84, RECORD = 50 };

static uint32_t u32(const unsigned char *p)
{
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

static float f32(const unsigned char *p)
{
    uint32_t bits = u32(p);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* Binary headers may begin with `solid` as well. What decides: the size that the triangle count implies (characters read as a
 * count give more than half a thousand million, so no text has that size), else whether `solid` is followed by `facet` or
 * `endsolid` in a later line. */
static bool is_text(const KellerMeshFile *mesh)
{
    if (mesh->size >= FIRST) {
        uint64_t count = u32((const unsigned char *)mesh->data + HEADER);
        if (mesh->size == FIRST + RECORD * count) return false;
    }
    KellerText text = keller_text(mesh->file, mesh->data, mesh->size);
    KellerToken token;
    if (!keller_text_content(&text) || !keller_text_token(&text, &token) || !keller_token_is_nocase(token, "solid"))
        return false;
    if (memchr(mesh->data, '\0', mesh->size < 1024 ? mesh->size : 1024)) return false; /* no text has one */
    if (!keller_text_next_line(&text) || !keller_text_content(&text)) return true; /* only a first line: a short text */
    return keller_text_token(&text, &token) &&
           (keller_token_is_nocase(token, "facet") || keller_token_is_nocase(token, "endsolid"));
}

static KellerStatus read_binary(KellerBuild *build, const KellerMeshFile *mesh, KellerError *error)
{
    KellerPlace place = {.file = mesh->file, .binary = true, .at = mesh->size};
    if (mesh->size < FIRST)
        return keller_bad(place, error, "the file ends within the header; expected STL: a text that begins with `solid`, "
                          "or 84 bytes and 50 for each triangle");
    const unsigned char *data = (const unsigned char *)mesh->data;
    uint64_t count = u32(data + HEADER), needed = FIRST + RECORD * count;
    if (mesh->size < needed)
        return keller_bad(place, error, "the file ends here; expected %llu bytes for the %llu triangles its header counts",
                          (unsigned long long)needed, (unsigned long long)count);
    place.at = needed;
    if (mesh->size - needed >= RECORD)
        return keller_bad(place, error, "%llu more bytes follow; expected the end of the file, as the header counts %llu "
                          "triangles", (unsigned long long)(mesh->size - needed), (unsigned long long)count);
    uint32_t object, material;
    KellerStatus status = keller_mesh_owner(build, mesh, &object, &material, error);
    if (status == KELLER_OK && mesh->size > needed)
        status = keller_build_note(build, error, "%s: %llu bytes behind the last triangle are left out", mesh->file,
                                   (unsigned long long)(mesh->size - needed));
    for (uint64_t i = 0; i < count && status == KELLER_OK; i++) {
        uint32_t corners[3];
        for (unsigned c = 0; c < 3 && status == KELLER_OK; c++) {
            place.at = FIRST + RECORD * i + 12 + 12 * c;
            const unsigned char *p = data + place.at;
            KellerVec3 v = v3((double)f32(p), (double)f32(p + 4), (double)f32(p + 8));
            if (!isfinite(v.x) || !isfinite(v.y) || !isfinite(v.z))
                return keller_bad(place, error, "a vertex at (%g, %g, %g); expected finite coordinates", v.x, v.y, v.z);
            corners[c] = (uint32_t)build->soup.vertex_count;
            status = keller_build_vertex(build, v, error);
        }
        if (status == KELLER_OK) status = keller_build_polygon(build, place, corners, 3, object, material, error);
    }
    return status;
}

static KellerPlace here(const KellerText *text) { return (KellerPlace){.file = text->file, .at = text->line}; }

/* The next word, in whatever line; an empty token where the text ends. */
static KellerToken word(KellerText *text)
{
    KellerToken token = {text->p, text->p};
    if (keller_text_content(text)) keller_text_token(text, &token);
    return token;
}

static KellerStatus wrong(const KellerText *text, KellerToken found, const char *expected, KellerError *error)
{
    if (found.begin == found.end)
        return keller_bad(here(text), error, "the file ends; expected `%s`", expected);
    return keller_bad(here(text), error, "found `%s`; expected `%s`", keller_token_quote(found).text, expected);
}

static KellerStatus expect(KellerText *text, const char *expected, KellerError *error)
{
    KellerToken token = word(text);
    return keller_token_is_nocase(token, expected) ? KELLER_OK : wrong(text, token, expected, error);
}

/* Behind `facet`. The normal may be anything, nan included: the corners say it all. */
static KellerStatus facet(KellerBuild *build, KellerText *text, uint32_t object, uint32_t material, KellerError *error)
{
    static const char *const axes[] = {"x", "y", "z"};
    KellerStatus status = expect(text, "normal", error);
    for (int i = 0; i < 3 && status == KELLER_OK; i++) {
        KellerToken token = word(text);
        if (token.begin == token.end || keller_token_is_nocase(token, "outer")) status = wrong(text, token, "a normal", error);
    }
    if (status == KELLER_OK) status = expect(text, "outer", error);
    if (status == KELLER_OK) status = expect(text, "loop", error);
    uint32_t corners[3];
    for (int c = 0; c < 3 && status == KELLER_OK; c++) {
        double v[3];
        status = expect(text, "vertex", error);
        for (int i = 0; i < 3 && status == KELLER_OK; i++) status = keller_text_coordinate(text, axes[i], &v[i], error);
        corners[c] = (uint32_t)build->soup.vertex_count;
        if (status == KELLER_OK) status = keller_build_vertex(build, v3(v[0], v[1], v[2]), error);
    }
    if (status == KELLER_OK) status = expect(text, "endloop", error);
    if (status == KELLER_OK) status = expect(text, "endfacet", error);
    if (status != KELLER_OK) return status;
    return keller_build_polygon(build, here(text), corners, 3, object, material, error);
}

static KellerStatus read_text(KellerBuild *build, const KellerMeshFile *mesh, KellerError *error)
{
    KellerText text = keller_text(mesh->file, mesh->data, mesh->size);
    while (keller_text_content(&text)) {
        KellerStatus status = expect(&text, "solid", error);
        KellerToken name = keller_text_rest(&text);
        uint32_t object = mesh->object, material = mesh->has_material ? mesh->material : KELLER_NO_MATERIAL;
        if (status == KELLER_OK && !mesh->has_object) {
            if (name.begin == name.end) name = (KellerToken){mesh->name, mesh->name + strlen(mesh->name)};
            status = keller_build_object(build, name.begin, (size_t)(name.end - name.begin), false, &object, error);
        }
        while (status == KELLER_OK) {
            KellerToken token = word(&text);
            if (keller_token_is_nocase(token, "endsolid")) break;
            if (!keller_token_is_nocase(token, "facet")) return wrong(&text, token, "facet` or `endsolid", error);
            status = facet(build, &text, object, material, error);
        }
        if (status != KELLER_OK) return status;
        if (!keller_text_next_line(&text)) break; /* the name may be repeated behind endsolid */
    }
    return KELLER_OK;
}

KellerStatus keller_read_stl(KellerBuild *build, const KellerMeshFile *mesh, KellerError *error)
{
    return is_text(mesh) ? read_text(build, mesh, error) : read_binary(build, mesh, error);
}
