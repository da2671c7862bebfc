#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include <libxml/xmlstring.h>

#include "io/config_read.h"
#include "io/names.h"
#include "io/xml.h"

typedef struct {
    const char *file;
    size_t count;
    const KellerVariable *variables;
    bool *used;
    size_t produced; /* bytes of substituted text so far, against values that repeat a long variable */
    KellerError *error;
} Substitution;

static bool name_start(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_'; }
static bool name_char(char c) { return name_start(c) || (c >= '0' && c <= '9'); }

static size_t name_length(const char *p)
{
    size_t n = 0;
    if (name_start(*p))
        while (name_char(p[n])) n++;
    return n;
}

static KellerStatus check_variables(Substitution *s)
{
    for (size_t i = 0; i < s->count; i++) {
        const char *name = s->variables[i].name, *value = s->variables[i].value;
        size_t length = name_length(name);
        if (!length || name[length])
            return keller_error(
                s->error, KELLER_BAD_INPUT,
                "%s: -D %s is no name of a variable; expected letters, digits and _, not starting with a "
                "digit",
                s->file, keller_quote(name).text);
        bool printable = xmlCheckUTF8((const xmlChar *)value);
        for (const char *p = value; *p; p++) printable = printable && (unsigned char)*p >= ' ' && *p != 0x7f;
        if (!printable)
            return keller_error(s->error, KELLER_BAD_INPUT,
                                "%s: the value of -D %s is not plain text; expected UTF-8 without control characters",
                                s->file, keller_quote(name).text);
        for (size_t k = 0; k < i; k++)
            if (strcmp(s->variables[k].name, name) == 0)
                return keller_error(s->error, KELLER_BAD_INPUT, "%s: -D %s is given twice; expected one value", s->file,
                                    keller_quote(name).text);
    }
    return KELLER_OK;
}

/* The variable that the `$` at *p names, with *p moved behind it; NULL and an error if there is none. */
static const char *value_at(Substitution *s, int line, const char **p)
{
    const char *start = *p + 1;
    bool braces = *start == '{';
    if (braces) start++;
    size_t length = name_length(start);
    if (!length || (braces && start[length] != '}')) {
        keller_error(s->error, KELLER_BAD_INPUT,
                     "%s:%d: a $ without the name of a variable; expected $NAME or ${NAME}, or $$ for a dollar sign",
                     s->file, line);
        return NULL;
    }
    *p = start + length + (braces ? 1 : 0);
    for (size_t i = 0; i < s->count; i++) {
        if (strncmp(s->variables[i].name, start, length) != 0 || s->variables[i].name[length] != '\0') continue;
        s->used[i] = true;
        return s->variables[i].value;
    }
    char hint[KELLER_HINT_BYTES] = "", name[48] = "";
    memcpy(name, start, length < sizeof name - 1 ? length : sizeof name - 1);
    KellerNearest nearest = keller_nearest(name);
    for (size_t i = 0; i < s->count; i++) keller_nearest_offer(&nearest, s->variables[i].name);
    keller_error(s->error, KELLER_BAD_INPUT, "%s:%d: $%s is not set; expected -D %s=VALUE on the command line%s",
                 s->file, line, name, name, keller_nearest_hint(&nearest, hint));
    return NULL;
}

/* *result is NULL where the text has no `$`. */
static KellerStatus substituted(Substitution *s, int line, const char *text, char **result)
{
    *result = NULL;
    if (!strchr(text, '$')) return KELLER_OK;
    /* twice over the text: measure, then copy */
    char *out = NULL;
    for (int pass = 0; pass < 2; pass++) {
        size_t length = 0;
        for (const char *p = text; *p;) {
            const char *piece = p;
            size_t bytes = 1;
            if (*p != '$') {
                p++;
            } else if (p[1] == '$') {
                p += 2;
            } else {
                piece = value_at(s, line, &p);
                if (!piece) {
                    free(out);
                    return KELLER_BAD_INPUT;
                }
                bytes = strlen(piece);
            }
            if (out) memcpy(out + length, piece, bytes);
            length += bytes;
        }
        if (out) {
            out[length] = '\0';
            break;
        }
        s->produced += length;
        if (s->produced > KELLER_XML_MAX_BYTES)
            return keller_error(s->error, KELLER_BAD_INPUT,
                                "%s:%d: variables expand to more than %u MiB; expected shorter values", s->file, line,
                                KELLER_XML_MAX_BYTES >> 20);
        out = malloc(length + 1);
        if (!out) return keller_error_memory(s->error, length + 1);
    }
    *result = out;
    return KELLER_OK;
}

/* Leaves the attribute with one text node, which keller_config_attribute relies on. */
static KellerStatus visit_attribute(Substitution *s, xmlNodePtr node, xmlAttrPtr attribute)
{
    xmlChar *text = xmlNodeListGetString(node->doc, attribute->children, 1);
    if (!text) return KELLER_OK; /* an empty value */
    char *result = NULL;
    KellerStatus status = substituted(s, keller_xml_line(node), (const char *)text, &result);
    bool plain = attribute->children && attribute->children->type == XML_TEXT_NODE && !attribute->children->next;
    if (status == KELLER_OK && (result || !plain)) {
        const xmlChar *value = result ? (const xmlChar *)result : text;
        if (!xmlSetNsProp(node, attribute->ns, attribute->name, value))
            status = keller_error_memory(s->error, strlen((const char *)value));
    }
    free(result);
    xmlFree(text);
    return status;
}

/* Depth is bounded by libxml2's limit on nested elements. */
static KellerStatus visit_element(Substitution *s, xmlNodePtr node)
{
    for (xmlAttrPtr a = node->properties; a; a = a->next) {
        KellerStatus status = visit_attribute(s, node, a);
        if (status != KELLER_OK) return status;
    }
    for (xmlNodePtr child = node->children; child; child = child->next) {
        KellerStatus status = KELLER_OK;
        if (child->type == XML_ELEMENT_NODE) {
            status = visit_element(s, child);
        } else if (child->type == XML_TEXT_NODE && child->content) {
            char *result = NULL;
            status = substituted(s, keller_xml_line(node), (const char *)child->content, &result);
            if (result) xmlNodeSetContent(child, (const xmlChar *)result);
            free(result);
        }
        if (status != KELLER_OK) return status;
    }
    return KELLER_OK;
}

KellerStatus keller_config_substitute(const char *file, xmlDocPtr doc, size_t count, const KellerVariable *variables,
                                      KellerError *error)
{
    Substitution s = {file, count, variables, NULL, 0, error};
    KellerStatus status = check_variables(&s);
    if (status != KELLER_OK) return status;
    s.used = calloc(count + 1, sizeof *s.used);
    if (!s.used) return keller_error_memory(error, count + 1);
    status = visit_element(&s, xmlDocGetRootElement(doc));
    for (size_t i = 0; i < count && status == KELLER_OK; i++) {
        if (!s.used[i])
            status =
                keller_error(error, KELLER_BAD_INPUT,
                             "%s: -D %s is given, but the configuration has no $%s; expected only variables that it "
                             "uses",
                             file, variables[i].name, variables[i].name);
    }
    free(s.used);
    return status;
}
