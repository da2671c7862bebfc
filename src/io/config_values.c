#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "io/config_read.h"
#include "io/names.h"
#include "io/units.h"
#include "io/xml.h"

KellerStatus keller_config_fail(const KellerConfigReader *reader, const xmlNode *node, const char *format, ...)
{
    char text[sizeof((KellerError *)0)->message];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return keller_error(reader->error, KELLER_BAD_INPUT, "%s:%d: %s", reader->file, keller_xml_line(node), text);
}

bool keller_config_is(const xmlNode *node, const char *name)
{
    return node->type == XML_ELEMENT_NODE && strcmp((const char *)node->name, name) == 0;
}

const xmlNode *keller_config_child(const xmlNode *node, const char *name)
{
    for (const xmlNode *child = node->children; child; child = child->next)
        if (keller_config_is(child, name)) return child;
    return NULL;
}

const char *keller_config_attribute(const xmlNode *node, const char *name)
{
    const xmlAttr *a = xmlHasProp(node, (const xmlChar *)name);
    if (!a) return NULL;
    /* keller_config_substitute left at most one text node */
    return a->children && a->children->content ? (const char *)a->children->content : "";
}

/* How messages call the place of a value: `x of <position>`, `<step>`. */
typedef struct {
    char text[64];
} Place;

static Place place_of(const xmlNode *node, const char *attribute)
{
    Place place;
    snprintf(place.text, sizeof place.text, "%s%s<%s>", attribute ? attribute : "", attribute ? " of " : "",
             (const char *)node->name);
    return place;
}

/* An element's text without comments in it. */
static KellerStatus text_of(const KellerConfigReader *reader, const xmlNode *node, char **text)
{
    xmlChar *content = xmlNodeGetContent(node);
    *text = content ? strdup((const char *)content) : NULL;
    xmlFree(content);
    return *text ? KELLER_OK : keller_error_memory(reader->error, 1);
}

static KellerStatus parse_quantity(const KellerConfigReader *reader, const xmlNode *node, const char *attribute,
                                   const char *kind, const KellerConfigRange *range, const char *text, double *value)
{
    double number = 0;
    const char *expected = kind                                 ? keller_parse_quantity(text, kind, &number)
                           : keller_parse_number(text, &number) ? NULL
                                                                : "a finite number without a unit";
    if (expected)
        return keller_config_fail(reader, node, "%s is \"%s\"; expected %s", place_of(node, attribute).text,
                                  keller_quote(text).text, expected);
    if (range && !(number >= range->low && number <= range->high))
        return keller_config_fail(reader, node, "%s is \"%s\"; expected %s", place_of(node, attribute).text,
                                  keller_quote(text).text, range->text);
    *value = number;
    return KELLER_OK;
}

KellerStatus keller_config_quantity(const KellerConfigReader *reader, const xmlNode *node, const char *attribute,
                                    const char *kind, const KellerConfigRange *range, double *value)
{
    if (attribute) {
        const char *text = keller_config_attribute(node, attribute);
        return text ? parse_quantity(reader, node, attribute, kind, range, text, value) : KELLER_OK;
    }
    char *text = NULL;
    KellerStatus status = text_of(reader, node, &text);
    if (status == KELLER_OK) status = parse_quantity(reader, node, NULL, kind, range, text, value);
    free(text);
    return status;
}

KellerStatus keller_config_count(const KellerConfigReader *reader, const xmlNode *node, const char *attribute,
                                 uint32_t limit, uint32_t *value)
{
    const char *text = keller_config_attribute(node, attribute);
    if (!text || keller_parse_count(text, limit, value)) return KELLER_OK;
    return keller_config_fail(reader, node, "%s is \"%s\"; expected a whole number from 0 to %u",
                              place_of(node, attribute).text, keller_quote(text).text, limit);
}

KellerStatus keller_config_word(const KellerConfigReader *reader, const xmlNode *node, const char *attribute,
                                const char *const *words, unsigned *value)
{
    const char *text = keller_config_attribute(node, attribute);
    if (!text) return KELLER_OK;
    KellerNearest nearest = keller_nearest(text);
    char list[256] = "", hint[KELLER_HINT_BYTES];
    size_t used = 0;
    for (unsigned i = 0; words[i]; i++) {
        if (strcmp(words[i], text) == 0) {
            *value = i;
            return KELLER_OK;
        }
        keller_nearest_offer(&nearest, words[i]);
        const char *separator = i == 0 ? "" : words[i + 1] ? ", " : " or ";
        int n = snprintf(list + used, sizeof list - used, "%s\"%s\"", separator, words[i]);
        used += n > 0 && (size_t)n < sizeof list - used ? (size_t)n : 0;
    }
    return keller_config_fail(reader, node, "%s is \"%s\"; expected %s%s", place_of(node, attribute).text,
                              keller_quote(text).text, list, keller_nearest_hint(&nearest, hint));
}

KellerStatus keller_config_flag(const KellerConfigReader *reader, const xmlNode *node, const char *attribute,
                                bool *value)
{
    static const char *const words[] = {"no", "yes", NULL};
    unsigned place = *value;
    KellerStatus status = keller_config_word(reader, node, attribute, words, &place);
    *value = place == 1;
    return status;
}

static bool blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

KellerStatus keller_config_name(const KellerConfigReader *reader, const xmlNode *node, const char *attribute,
                                char **value)
{
    const char *text = keller_config_attribute(node, attribute);
    if (!text) text = "";
    while (blank(*text)) text++;
    size_t length = strlen(text);
    while (length && blank(text[length - 1])) length--;
    if (!length)
        return keller_config_fail(reader, node, "%s is empty; expected a name", place_of(node, attribute).text);
    if (length > KELLER_MAX_NAME)
        return keller_config_fail(reader, node, "%s has %zu bytes; expected a name of at most %u",
                                  place_of(node, attribute).text, length, KELLER_MAX_NAME);
    *value = strndup(text, length);
    return *value ? KELLER_OK : keller_error_memory(reader->error, length + 1);
}

KellerStatus keller_config_id(const KellerConfigReader *reader, const xmlNode *node, char **value)
{
    KellerStatus status = keller_config_name(reader, node, "id", value);
    if (status != KELLER_OK) return status;
    bool good = **value != '.';
    for (const char *p = *value; *p; p++) {
        unsigned char c = (unsigned char)*p;
        bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c >= 0x80;
        good = good && (letter || strchr("_-.:", c));
    }
    if (good) return KELLER_OK;
    /* ids name groups in the result file, where / separates and . is the group itself */
    status = keller_config_fail(reader, node,
                                "id of <%s> is \"%s\"; expected letters, digits and _ - . :, not starting "
                                "with a dot",
                                (const char *)node->name, keller_quote(*value).text);
    free(*value);
    *value = NULL;
    return status;
}

KellerStatus keller_config_path(const KellerConfigReader *reader, const xmlNode *node, const char *attribute,
                                char **value)
{
    const char *path = keller_config_attribute(node, attribute);
    if (!path || !*path)
        return keller_config_fail(reader, node, "%s is empty; expected the name of a file",
                                  place_of(node, attribute).text);
    const char *slash = strrchr(reader->file, '/');
    size_t folder = *path != '/' && slash ? (size_t)(slash - reader->file) + 1 : 0;
    size_t length = strlen(path);
    char *full = malloc(folder + length + 1);
    if (!full) return keller_error_memory(reader->error, folder + length + 1);
    memcpy(full, reader->file, folder);
    memcpy(full + folder, path, length + 1);
    *value = full;
    return KELLER_OK;
}

KellerStatus keller_config_geodetic(const KellerConfigReader *reader, const xmlNode *node, KellerGeodetic *value)
{
    static const KellerConfigRange latitude = {-90, 90, "degrees from -90 to 90"};
    static const KellerConfigRange longitude = {-180, 180, "degrees from -180 to 180"};
    static const KellerConfigRange height = {-KELLER_MAX_COORDINATE, KELLER_MAX_COORDINATE, "at most 1e6 km"};
    KellerStatus status = keller_config_quantity(reader, node, "lat", NULL, &latitude, &value->latitude);
    if (status == KELLER_OK) status = keller_config_quantity(reader, node, "lon", NULL, &longitude, &value->longitude);
    if (status == KELLER_OK) status = keller_config_quantity(reader, node, "height", "length", &height, &value->height);
    return status;
}

bool keller_config_grow(void **items, size_t *capacity, size_t count, size_t extra, size_t size)
{
    if (extra <= *capacity - count) return true;
    size_t wanted = count + extra;
    if (wanted < count || wanted > SIZE_MAX / 2 / size) return false;
    if (wanted < 2 * *capacity) wanted = 2 * *capacity;
    if (wanted < 8) wanted = 8;
    void *grown = realloc(*items, wanted * size);
    if (!grown) return false;
    *items = grown;
    *capacity = wanted;
    return true;
}
