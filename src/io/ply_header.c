#include "io/ply_header.h"

#include <stdlib.h>

static const struct {
    const char *names[2];
    unsigned char size;
} types[] = {{{"char", "int8"}, 1},  {{"uchar", "uint8"}, 1}, {{"short", "int16"}, 2},    {{"ushort", "uint16"}, 2},
             {{"int", "int32"}, 4},  {{"uint", "uint32"}, 4}, {{"float", "float32"}, 4}, {{"double", "float64"}, 8}};

size_t keller_ply_size(KellerPlyType type) { return types[type].size; }

static KellerPlace here(const KellerText *text) { return (KellerPlace){.file = text->file, .at = text->line}; }

/* The line's next word; empty at its end, and then messages show ``. */
static KellerToken word(KellerText *text)
{
    KellerToken token;
    keller_text_token(text, &token);
    return token;
}

static KellerStatus type_of(KellerText *text, KellerPlyType *type, KellerError *error)
{
    KellerToken token = word(text);
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 2; k++)
            if (keller_token_is(token, types[i].names[k])) {
                *type = (KellerPlyType)i;
                return KELLER_OK;
            }
    return keller_bad(here(text), error, "`%s` is no type of a property; expected char, uchar, short, ushort, int, uint, "
                      "float, double, int8, ..., float64", keller_token_quote(token).text);
}

static KellerStatus read_format(KellerText *text, KellerPlyHeader *header, KellerError *error)
{
    static const char *const formats[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    KellerToken token = word(text), version = word(text);
    for (int i = 0; i < 3; i++) {
        if (!keller_token_is(token, formats[i])) continue;
        header->format = i == 0 ? KELLER_PLY_ASCII : i == 1 ? KELLER_PLY_LITTLE : KELLER_PLY_BIG;
        if (keller_token_is(version, "1.0")) return KELLER_OK;
        return keller_bad(here(text), error, "PLY version `%s`; expected 1.0", keller_token_quote(version).text);
    }
    return keller_bad(here(text), error, "PLY format `%s`; expected ascii, binary_little_endian or binary_big_endian",
                      keller_token_quote(token).text);
}

static KellerStatus read_element(KellerText *text, KellerPlyHeader *header, KellerError *error)
{
    KellerStatus status = keller_grow(&header->elements, &header->element_capacity, header->element_count + 1,
                                      sizeof *header->elements, error);
    if (status != KELLER_OK) return status;
    KellerPlyElement *element = &header->elements[header->element_count];
    *element = (KellerPlyElement){.name = word(text), .line = text->line};
    KellerToken count = word(text);
    int64_t value;
    if (!keller_token_integer(count, &value) || value < 0)
        return keller_bad(here(text), error, "`%s` is no number of elements; expected 0 or more",
                          keller_token_quote(count).text);
    element->count = (uint64_t)value;
    element->kind = keller_token_is(element->name, "vertex") ? KELLER_PLY_VERTEX
                    : keller_token_is(element->name, "face") ? KELLER_PLY_FACE : KELLER_PLY_OTHER;
    for (size_t i = 0; i < header->element_count && element->kind != KELLER_PLY_OTHER; i++)
        if (header->elements[i].kind == element->kind)
            return keller_bad(here(text), error, "a second element `%s`; expected one",
                              keller_token_quote(element->name).text);
    if (element->kind == KELLER_PLY_VERTEX) header->vertices = element->count;
    header->element_count++;
    return KELLER_OK;
}

static KellerPlyRole role_of(KellerPlyKind kind, KellerToken name)
{
    if (kind == KELLER_PLY_VERTEX && name.end == name.begin + 1 && *name.begin >= 'x' && *name.begin <= 'z')
        return (KellerPlyRole)(KELLER_PLY_X + (*name.begin - 'x'));
    if (kind == KELLER_PLY_FACE && (keller_token_is(name, "vertex_indices") || keller_token_is(name, "vertex_index")))
        return KELLER_PLY_CORNERS;
    return KELLER_PLY_UNUSED;
}

static KellerStatus read_property(KellerText *text, KellerPlyHeader *header, KellerError *error)
{
    if (!header->element_count) return keller_bad(here(text), error, "a property before any element; expected an element");
    KellerPlyElement *element = &header->elements[header->element_count - 1];
    KellerPlyProperty property = {0};
    KellerText ahead = *text;
    KellerStatus status = KELLER_OK;
    if (keller_token_is(word(&ahead), "list")) {
        *text = ahead;
        property.list = true;
        status = type_of(text, &property.count_type, error);
    }
    if (status == KELLER_OK) status = type_of(text, &property.type, error);
    if (status != KELLER_OK) return status;
    KellerToken name = word(text);
    if (name.begin == name.end) return keller_bad(here(text), error, "a property without a name; expected one");
    property.role = role_of(element->kind, name);
    for (size_t i = 0; i < element->property_count && property.role; i++)
        if (element->properties[i].role == property.role)
            return keller_bad(here(text), error, "a second property `%s`; expected one", keller_token_quote(name).text);
    if (property.role && property.list != (property.role == KELLER_PLY_CORNERS))
        return keller_bad(here(text), error, "property `%s` is %s; expected %s", keller_token_quote(name).text,
                          property.list ? "a list" : "no list", property.list ? "a number" : "a list");
    status = keller_grow(&element->properties, &element->property_capacity, element->property_count + 1,
                         sizeof *element->properties, error);
    if (status == KELLER_OK) element->properties[element->property_count++] = property;
    return status;
}

/* The fewest bytes that an entry takes: in a text a digit and a blank or line end for each value. */
static uint64_t least_size(const KellerPlyHeader *header, const KellerPlyElement *element)
{
    uint64_t size = 0;
    for (size_t i = 0; i < element->property_count; i++) {
        const KellerPlyProperty *p = &element->properties[i];
        size += header->format == KELLER_PLY_ASCII ? 2 : keller_ply_size(p->list ? p->count_type : p->type);
    }
    return size;
}

static KellerStatus check(const KellerText *text, const KellerPlyHeader *header, KellerPlace end, KellerError *error)
{
    uint64_t left = (uint64_t)(text->end - text->p) + (header->format == KELLER_PLY_ASCII ? 1 : 0);
    bool vertex = false;
    for (size_t i = 0; i < header->element_count; i++) {
        const KellerPlyElement *element = &header->elements[i];
        KellerPlace place = {.file = text->file, .at = element->line};
        unsigned roles = 0;
        for (size_t k = 0; k < element->property_count; k++) roles |= 1u << element->properties[k].role;
        unsigned needed = 1u << KELLER_PLY_X | 1u << KELLER_PLY_Y | 1u << KELLER_PLY_Z;
        if (element->kind == KELLER_PLY_VERTEX && (roles & needed) != needed)
            return keller_bad(place, error, "the vertex element lacks x, y or z; expected all three");
        if (element->kind == KELLER_PLY_FACE && element->count && !(roles & 1u << KELLER_PLY_CORNERS))
            return keller_bad(place, error, "the face element has no list vertex_indices; expected one");
        vertex |= element->kind == KELLER_PLY_VERTEX;
        uint64_t size = least_size(header, element);
        if (size && element->count > left / size)
            return keller_bad(place, error, "element `%s` has %llu entries; expected at most %llu, as many as the file "
                              "could hold", keller_token_quote(element->name).text, (unsigned long long)element->count,
                              (unsigned long long)(left / size));
        left -= size * element->count;
    }
    if (!vertex) return keller_bad(end, error, "the header has no vertex element; expected one");
    return KELLER_OK;
}

KellerStatus keller_ply_header_read(KellerText *text, KellerPlyHeader *header, KellerError *error)
{
    *header = (KellerPlyHeader){0};
    if (!keller_token_is(keller_text_rest(text), "ply"))
        return keller_bad(here(text), error, "the file does not begin with a line `ply`; expected a PLY file");
    bool format = false, cr = text->end - text->p > 1 && text->p[0] == '\r' && text->p[1] != '\n';
    for (;;) {
        if (!keller_text_next_line(text))
            return keller_bad(here(text), error, "the file ends within the header; expected end_header");
        KellerToken key = word(text);
        KellerStatus status = KELLER_OK;
        if (keller_token_is(key, "end_header")) break;
        if (keller_token_is(key, "format")) status = read_format(text, header, error), format = true;
        else if (keller_token_is(key, "element")) status = read_element(text, header, error);
        else if (keller_token_is(key, "property")) status = read_property(text, header, error);
        else if (key.begin != key.end && !keller_token_is(key, "comment") && !keller_token_is(key, "obj_info"))
            status = keller_bad(here(text), error, "`%s` in the header; expected format, element, property, comment or "
                                "end_header", keller_token_quote(key).text);
        if (status != KELLER_OK) return status;
    }
    if (!format) return keller_bad(here(text), error, "the header has no format; expected such as `format ascii 1.0`");
    const char *line_end = text->p;
    KellerPlace end = here(text);
    keller_text_next_line(text);
    /* Where lines end in CR alone, a LF behind the last one is the body's first byte. */
    if (cr && *line_end == '\r') text->p = line_end + 1;
    return check(text, header, end, error);
}

void keller_ply_header_free(KellerPlyHeader *header)
{
    for (size_t i = 0; i < header->element_count; i++) free(header->elements[i].properties);
    free(header->elements);
    *header = (KellerPlyHeader){0};
}
