#include "io/mitsuba.h"

#include <stdlib.h>
#include <string.h>

/* Bounds against files that include or substitute themselves into the exponential. */
enum { MAX_INCLUDE_DEPTH = 16, MAX_DOCUMENTS = 1000, MAX_VALUE = 65536 };

KellerPlace keller_mitsuba_place(const xmlNode *node)
{
    const KellerMitsubaDocument *document = node->doc->_private;
    return (KellerPlace){.file = document->file, .at = (uint64_t)keller_xml_line(node)};
}

bool keller_mitsuba_is(const xmlNode *node, const char *element) { return strcmp((const char *)node->name, element) == 0; }

xmlNodePtr keller_mitsuba_element(xmlNodePtr node)
{
    while (node && node->type != XML_ELEMENT_NODE) node = node->next;
    return node;
}

char *keller_mitsuba_path(const xmlNode *node, const char *name)
{
    const char *file = keller_mitsuba_place(node).file, *slash = strrchr(file, '/');
    if (*name == '/' || !slash) return strdup(name);
    size_t folder = (size_t)(slash - file) + 1, length = strlen(name);
    char *path = malloc(folder + length + 1);
    if (!path) return NULL;
    memcpy(path, file, folder);
    memcpy(path + folder, name, length + 1);
    return path;
}

static bool name_character(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

/* Replaces each $NAME by the variable's value. */
static KellerStatus substitute(const KellerMitsuba *scene, xmlNodePtr node, const char *text, char **value,
                               KellerError *error)
{
    char *out = NULL;
    size_t length = 0, capacity = 0;
    KellerStatus status = keller_grow(&out, &capacity, strlen(text) + 1, 1, error);
    while (*text && status == KELLER_OK) {
        const char *piece = text;
        size_t size = 1;
        if (*text == '$') {
            const char *end = text + 1;
            while (name_character(*end)) end++;
            char *name = strndup(text + 1, (size_t)(end - text - 1));
            uint32_t found = name ? keller_lookup_find(&scene->variables, name) : UINT32_MAX;
            free(name);
            if (found == UINT32_MAX) {
                status = keller_bad(keller_mitsuba_place(node), error, "`%.*s` has no value; expected a <default> before it",
                                    (int)(end - text > 100 ? 100 : end - text), text);
                break;
            }
            piece = scene->entries[found]->value;
            size = strlen(piece);
            text = end;
        } else {
            text++;
        }
        if (length + size > MAX_VALUE)
            status = keller_bad(keller_mitsuba_place(node), error, "a value of more than %d characters; expected a shorter one",
                                MAX_VALUE);
        else
            status = keller_grow(&out, &capacity, length + size + 1, 1, error);
        if (status == KELLER_OK) memcpy(out + length, piece, size), length += size;
    }
    if (status != KELLER_OK) {
        free(out);
        return status;
    }
    out[length] = '\0';
    *value = out;
    return KELLER_OK;
}

KellerStatus keller_mitsuba_attribute(const KellerMitsuba *scene, xmlNodePtr node, const char *name, char **value,
                                      KellerError *error)
{
    *value = NULL;
    xmlChar *raw = xmlGetNoNsProp(node, (const xmlChar *)name);
    if (!raw) return KELLER_OK;
    KellerStatus status = substitute(scene, node, (const char *)raw, value, error);
    xmlFree(raw);
    return status;
}

KellerStatus keller_mitsuba_property(const KellerMitsuba *scene, xmlNodePtr node, const char *name, char **value,
                                     KellerError *error)
{
    *value = NULL;
    for (xmlNodePtr child = keller_mitsuba_element(node->children); child; child = keller_mitsuba_element(child->next)) {
        xmlChar *raw = xmlGetNoNsProp(child, (const xmlChar *)"name");
        bool match = raw && strcmp((const char *)raw, name) == 0;
        xmlFree(raw);
        if (!match) continue;
        KellerStatus status = keller_mitsuba_attribute(scene, child, "value", value, error);
        if (status == KELLER_OK && !*value)
            return keller_bad(keller_mitsuba_place(child), error, "<%s name=\"%s\"> has no value; expected one", child->name,
                              name);
        return status;
    }
    return KELLER_OK;
}

xmlNodePtr keller_mitsuba_find(const KellerMitsuba *scene, const char *id)
{
    uint32_t found = keller_lookup_find(&scene->ids, id);
    return found == UINT32_MAX ? NULL : scene->entries[found]->node;
}

/* Takes name and value over. */
static KellerStatus add_entry(KellerMitsuba *scene, KellerLookup *names, char *name, char *value, xmlNodePtr node,
                              KellerError *error)
{
    KellerMitsubaEntry *entry = malloc(sizeof *entry);
    KellerStatus status = entry ? keller_grow(&scene->entries, &scene->entry_capacity, scene->entry_count + 1,
                                              sizeof *scene->entries, error)
                                : keller_error_memory(error, sizeof *entry);
    if (status == KELLER_OK) status = keller_lookup_add(names, name, (uint32_t)scene->entry_count, error);
    if (status != KELLER_OK) {
        free(entry);
        free(name);
        free(value);
        return status;
    }
    *entry = (KellerMitsubaEntry){name, value, node};
    scene->entries[scene->entry_count++] = entry;
    return KELLER_OK;
}

/* A value that is already there wins, as in Mitsuba, where the command line's come first. */
static KellerStatus add_variable(KellerMitsuba *scene, xmlNodePtr node, KellerError *error)
{
    char *name, *value = NULL;
    KellerStatus status = keller_mitsuba_attribute(scene, node, "name", &name, error);
    if (status == KELLER_OK) status = keller_mitsuba_attribute(scene, node, "value", &value, error);
    if (status == KELLER_OK && (!name || !value))
        status = keller_bad(keller_mitsuba_place(node), error, "<default> lacks name or value; expected both");
    if (status == KELLER_OK && keller_lookup_find(&scene->variables, name) == UINT32_MAX)
        return add_entry(scene, &scene->variables, name, value, NULL, error);
    free(name);
    free(value);
    return status;
}

/* Registers an element and those within it. Only materials are ever looked up; of the others we need to know that the
 * identifier belongs to something else. */
static KellerStatus add_ids(KellerMitsuba *scene, xmlNodePtr node, KellerError *error)
{
    bool bsdf = keller_mitsuba_is(node, "bsdf");
    char *id = NULL;
    KellerStatus status = KELLER_OK;
    if (bsdf) {
        status = keller_mitsuba_attribute(scene, node, "id", &id, error);
    } else {
        xmlChar *raw = xmlGetNoNsProp(node, (const xmlChar *)"id");
        if (raw && !(id = strdup((const char *)raw))) status = keller_error_memory(error, strlen((const char *)raw) + 1);
        xmlFree(raw);
    }
    if (status != KELLER_OK) return status;
    xmlNodePtr other = id ? keller_mitsuba_find(scene, id) : NULL;
    if (bsdf && other && keller_mitsuba_is(other, "bsdf")) {
        status = keller_bad(keller_mitsuba_place(node), error, "a second <bsdf> with the id `%.100s` (the first: line %d); "
                            "expected one", id, keller_xml_line(other));
        free(id);
        return status;
    }
    if (id && (!other || bsdf)) status = add_entry(scene, &scene->ids, id, NULL, node, error);
    else free(id);
    for (xmlNodePtr child = keller_mitsuba_element(node->children); child && status == KELLER_OK;
         child = keller_mitsuba_element(child->next))
        if (!keller_mitsuba_is(child, "ref")) status = add_ids(scene, child, error);
    return status;
}

static KellerStatus add_alias(KellerMitsuba *scene, xmlNodePtr node, KellerError *error)
{
    char *id, *as = NULL;
    KellerStatus status = keller_mitsuba_attribute(scene, node, "id", &id, error);
    if (status == KELLER_OK) status = keller_mitsuba_attribute(scene, node, "as", &as, error);
    xmlNodePtr target = status == KELLER_OK && id ? keller_mitsuba_find(scene, id) : NULL;
    free(id);
    if (status == KELLER_OK && target && as) return add_entry(scene, &scene->ids, as, NULL, target, error);
    if (status == KELLER_OK)
        status = keller_bad(keller_mitsuba_place(node), error, "<alias> names nothing defined before; expected id and as");
    free(as);
    return status;
}

static KellerStatus load(KellerMitsuba *scene, const char *file, unsigned depth, KellerError *error);

static KellerStatus include(KellerMitsuba *scene, xmlNodePtr node, unsigned depth, KellerError *error)
{
    char *name, *path;
    KellerPlace place = keller_mitsuba_place(node);
    KellerStatus status = keller_mitsuba_attribute(scene, node, "filename", &name, error);
    if (status != KELLER_OK) return status;
    if (!name) return keller_bad(place, error, "<include> has no filename; expected one");
    path = keller_mitsuba_path(node, name);
    free(name);
    if (!path) return keller_error_memory(error, 1);
    if (depth >= MAX_INCLUDE_DEPTH || scene->document_count >= MAX_DOCUMENTS)
        status = keller_bad(place, error, "files include files without end; expected at most %d levels and %d files",
                            MAX_INCLUDE_DEPTH, MAX_DOCUMENTS);
    node->_private = (void *)(uintptr_t)scene->document_count; /* for the walk over the shapes */
    if (status == KELLER_OK) status = load(scene, path, depth + 1, error);
    free(path);
    return status;
}

static KellerStatus load(KellerMitsuba *scene, const char *file, unsigned depth, KellerError *error)
{
    xmlDocPtr doc;
    KellerStatus status = keller_grow(&scene->documents, &scene->document_capacity, scene->document_count + 1,
                                      sizeof *scene->documents, error);
    if (status == KELLER_OK) status = keller_xml_read(file, &doc, error);
    if (status != KELLER_OK) return status;
    KellerMitsubaDocument *document = malloc(sizeof *document);
    char *copy = strdup(file);
    if (!document || !copy) {
        free(document);
        free(copy);
        xmlFreeDoc(doc);
        return keller_error_memory(error, strlen(file) + sizeof *document);
    }
    *document = (KellerMitsubaDocument){doc, copy};
    doc->_private = document;
    scene->documents[scene->document_count++] = document;
    scene->build->soup.files++;
    xmlNodePtr root = xmlDocGetRootElement(doc);
    if (!keller_mitsuba_is(root, "scene"))
        return keller_bad(keller_mitsuba_place(root), error, "the root element is <%.100s>; expected <scene>, as in Mitsuba's "
                          "files", root->name);
    for (xmlNodePtr node = keller_mitsuba_element(root->children); node && status == KELLER_OK;
         node = keller_mitsuba_element(node->next)) {
        if (keller_mitsuba_is(node, "default")) status = add_variable(scene, node, error);
        else if (keller_mitsuba_is(node, "include")) status = include(scene, node, depth, error);
        else if (keller_mitsuba_is(node, "alias")) status = add_alias(scene, node, error);
        else status = add_ids(scene, node, error);
    }
    return status;
}

KellerStatus keller_mitsuba_load(KellerMitsuba *scene, const char *file, KellerError *error)
{
    return load(scene, file, 0, error);
}

void keller_mitsuba_free(KellerMitsuba *scene)
{
    for (size_t i = 0; i < scene->document_count; i++) {
        xmlFreeDoc(scene->documents[i]->doc);
        free(scene->documents[i]->file);
        free(scene->documents[i]);
    }
    for (size_t i = 0; i < scene->entry_count; i++) {
        free(scene->entries[i]->name);
        free(scene->entries[i]->value);
        free(scene->entries[i]);
    }
    free(scene->documents);
    free(scene->entries);
    keller_lookup_free(&scene->variables);
    keller_lookup_free(&scene->ids);
}
