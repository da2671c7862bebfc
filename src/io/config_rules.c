#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include <libxml/relaxng.h>

#include "base/embedded.h"
#include "io/config_read.h"
#include "io/names.h"
#include "io/xml.h"

/* What an element may hold. Words end in ! (exactly one), ? (at most one), + (at least one) or * (any number). The same
 * grammar as data/keller.rng, for the sake of the messages; tests hold the two against each other. */
typedef struct {
    const char *element, *attributes, *children;
    bool text;
} Rule;

#define STATION "antenna? orientation? velocity?"

static const Rule rules[] = {
    {"simulation", "version! domain!",
     "scene! origin? frequency+ medium? material* default-material? assign* transmitter+ receiver* receivers* grid* paths? "
     "solver? "
     "output?",
     false},
    {"scene", "file! scale?", "", false},
    {"origin", "lat! lon! height!", "", false},
    {"frequency", "", "", true},
    {"medium", "temperature? pressure? humidity? absorption? rain?", "", false},
    {"material", "name! itu? permittivity? conductivity? conductor? thickness? roughness?", "layer*", false},
    {"layer", "itu? permittivity? conductivity? thickness!", "", false},
    {"default-material", "name!", "", false},
    {"assign", "object! material!", "", false},
    {"transmitter", "id!", "position? geodetic? " STATION " power?", false},
    {"receiver", "id!", "position? geodetic? " STATION, false},
    {"receivers", "id! file!", STATION, false},
    {"grid", "id! z!", "from! to! step! " STATION, false},
    {"position", "x! y! z!", "", false},
    {"geodetic", "lat! lon! height!", "", false},
    {"antenna", "pattern? polarization? file?", "element*", false},
    {"element", "x? y? z? phase?", "", false},
    {"orientation", "yaw? pitch? roll?", "", false},
    {"velocity", "x? y? z?", "", false},
    {"power", "", "", true},
    {"from", "x! y!", "", false},
    {"to", "x! y!", "", false},
    {"step", "", "", true},
    {"paths", "reflections? diffractions? transmissions? interactions? dynamic-range? wedge?", "", false},
    {"solver", "accelerator? cone? threads?", "", false},
    {"output", "paths? coverage? scene?", "", false},
};

#define LONGEST_WORD 24

/* The next word of a list and its mark; false at the end. */
static bool next_word(const char **list, char word[LONGEST_WORD], char *mark)
{
    const char *p = *list;
    while (*p == ' ') p++;
    if (!*p) return false;
    size_t n = strcspn(p, "!?+*");
    memcpy(word, p, n);
    word[n] = '\0';
    *mark = p[n];
    *list = p + n + 1;
    return true;
}

/* The place of `name` in the list and its mark, or -1. */
static int find_word(const char *list, const char *name, char *mark)
{
    char word[LONGEST_WORD];
    for (int i = 0; next_word(&list, word, mark); i++)
        if (strcmp(word, name) == 0) return i;
    return -1;
}

static const char *hint_for(const char *list, const char *name, char hint[KELLER_HINT_BYTES])
{
    char word[LONGEST_WORD], best[LONGEST_WORD] = "", mark;
    KellerNearest nearest = keller_nearest(name);
    while (next_word(&list, word, &mark)) {
        size_t before = nearest.distance;
        keller_nearest_offer(&nearest, word);
        if (nearest.distance < before) memcpy(best, word, sizeof best);
    }
    nearest.best = best;
    return keller_nearest_hint(&nearest, hint);
}

/* "a, b or c", for messages. */
static const char *listed(const char *list, char text[256])
{
    char word[LONGEST_WORD], mark;
    size_t used = 0;
    bool first = true;
    text[0] = '\0';
    for (bool more = next_word(&list, word, &mark); more;) {
        char following[LONGEST_WORD];
        char ignored;
        const char *separator = first ? "" : ", ";
        more = next_word(&list, following, &ignored);
        if (!more && !first) separator = " or ";
        size_t n = strlen(separator), m = strlen(word);
        if (used + n + m < 256) {
            memcpy(text + used, separator, n);
            memcpy(text + used + n, word, m + 1);
            used += n + m;
        }
        memcpy(word, following, sizeof word);
        first = false;
    }
    return first ? "none" : text;
}

static const Rule *find_rule(const char *element)
{
    for (size_t i = 0; i < sizeof rules / sizeof *rules; i++)
        if (strcmp(rules[i].element, element) == 0) return &rules[i];
    return NULL;
}

typedef struct {
    const char *file;
    KellerError *error;
} Check;

static KellerStatus check_attributes(const Check *check, const xmlNode *node, const Rule *rule)
{
    char names[256], hint[KELLER_HINT_BYTES], word[LONGEST_WORD], mark;
    int line = keller_xml_line(node);
    for (const xmlAttr *a = node->properties; a; a = a->next) {
        const char *name = (const char *)a->name;
        if (!a->ns && find_word(rule->attributes, name, &mark) >= 0) continue;
        return keller_error(check->error, KELLER_BAD_INPUT,
                            "%s:%d: <%s> has an unknown attribute \"%s%s%s\"; expected %s%s", check->file, line,
                            rule->element, a->ns && a->ns->prefix ? (const char *)a->ns->prefix : "", a->ns ? ":" : "",
                            keller_quote(name).text, listed(rule->attributes, names),
                            hint_for(rule->attributes, name, hint));
    }
    for (const char *list = rule->attributes; next_word(&list, word, &mark);)
        if (mark == '!' && !xmlHasProp(node, (const xmlChar *)word))
            return keller_error(check->error, KELLER_BAD_INPUT,
                                "%s:%d: <%s> has no attribute \"%s\"; expected %s=\"...\"", check->file, line,
                                rule->element, word, word);
    return KELLER_OK;
}

static bool only_blanks(const xmlChar *text) { return !text || text[strspn((const char *)text, " \t\r\n")] == '\0'; }

#define MOST_CHILDREN 16

/* One child of an element that follows `rule`; counts it. */
static KellerStatus check_child(const Check *check, const Rule *rule, const xmlNode *child,
                                unsigned seen[MOST_CHILDREN])
{
    char names[256], hint[KELLER_HINT_BYTES], mark = 0;
    const char *name = (const char *)child->name;
    if (child->type == XML_TEXT_NODE || child->type == XML_CDATA_SECTION_NODE) {
        if (rule->text || only_blanks(child->content)) return KELLER_OK;
        return keller_error(check->error, KELLER_BAD_INPUT, "%s:%d: <%s> holds the text \"%s\"; expected %s",
                            check->file, keller_xml_line(child), rule->element,
                            keller_quote((const char *)child->content).text,
                            *rule->children ? "only elements in it" : "an element without content");
    }
    if (child->type == XML_COMMENT_NODE || child->type == XML_PI_NODE) return KELLER_OK;
    int line = keller_xml_line(child);
    int place = child->ns ? -1 : find_word(rule->children, name, &mark);
    if (place < 0 && child->ns)
        return keller_error(check->error, KELLER_BAD_INPUT,
                            "%s:%d: <%s> is in the XML namespace \"%s\"; expected elements without a namespace",
                            check->file, line, keller_quote(name).text,
                            keller_quote((const char *)child->ns->href).text);
    if (place < 0)
        return keller_error(check->error, KELLER_BAD_INPUT, "%s:%d: unknown element <%s> in <%s>; expected %s%s",
                            check->file, line, keller_quote(name).text, rule->element, listed(rule->children, names),
                            hint_for(rule->children, name, hint));
    if (++seen[place] > 1 && (mark == '!' || mark == '?'))
        return keller_error(check->error, KELLER_BAD_INPUT, "%s:%d: a second <%s> in <%s>; expected at most one",
                            check->file, line, name, rule->element);
    return KELLER_OK;
}

static KellerStatus check_element(const Check *check, const xmlNode *node, const Rule *rule)
{
    KellerStatus status = check_attributes(check, node, rule);
    if (status != KELLER_OK) return status;
    unsigned seen[MOST_CHILDREN] = {0};
    for (const xmlNode *child = node->children; child; child = child->next) {
        status = check_child(check, rule, child, seen);
        if (status == KELLER_OK && child->type == XML_ELEMENT_NODE)
            status = check_element(check, child, find_rule((const char *)child->name));
        if (status != KELLER_OK) return status;
    }
    char word[LONGEST_WORD], mark;
    const char *list = rule->children;
    for (int i = 0; next_word(&list, word, &mark); i++)
        if (!seen[i] && (mark == '!' || mark == '+'))
            return keller_error(check->error, KELLER_BAD_INPUT, "%s:%d: <%s> has no <%s>; expected %s", check->file,
                                keller_xml_line(node), rule->element, word, mark == '!' ? "one" : "at least one");
    if (strcmp(rule->element, "transmitter") == 0 || strcmp(rule->element, "receiver") == 0) {
        const xmlNode *position = keller_config_child(node, "position");
        const xmlNode *geodetic = keller_config_child(node, "geodetic");
        if (!position == !geodetic)
            return keller_error(check->error, KELLER_BAD_INPUT, "%s:%d: <%s> has %s; expected exactly one of them",
                                check->file, keller_xml_line(node), rule->element,
                                position ? "both <position> and <geodetic>" : "neither <position> nor <geodetic>");
    }
    return KELLER_OK;
}

KellerStatus keller_config_check_structure(const char *file, xmlDocPtr doc, KellerError *error)
{
    Check check = {file, error};
    xmlNode *root = xmlDocGetRootElement(doc);
    int line = keller_xml_line(root);
    if (root->ns || strcmp((const char *)root->name, "simulation") != 0)
        return keller_error(error, KELLER_BAD_INPUT,
                            "%s:%d: the document's element is <%s>; expected <simulation version=\"1\" domain=\"rf\"> "
                            "without a namespace",
                            file, line, keller_quote((const char *)root->name).text);
    const char *version = keller_config_attribute(root, "version"), *domain = keller_config_attribute(root, "domain");
    if (version && strcmp(version, "1") != 0)
        return keller_error(error, KELLER_BAD_INPUT, "%s:%d: version \"%s\" of <simulation> is unknown; expected \"1\"",
                            file, line, keller_quote(version).text);
    if (domain && strcmp(domain, "acoustic") == 0)
        return keller_error(error, KELLER_BAD_INPUT,
                            "%s:%d: domain \"acoustic\" is not computed by this version of keller; expected \"rf\"",
                            file, line);
    if (domain && strcmp(domain, "rf") != 0)
        return keller_error(error, KELLER_BAD_INPUT, "%s:%d: domain \"%s\" of <simulation> is unknown; expected \"rf\"",
                            file, line, keller_quote(domain).text);
    unsigned long children = xmlChildElementCount(root);
    if (children > KELLER_MAX_ELEMENTS)
        return keller_error(
            error, KELLER_BAD_INPUT,
            "%s:%d: <simulation> holds %lu elements; expected at most %u (many receivers fit in a route file "
            "or a grid)",
            file, line, children, KELLER_MAX_ELEMENTS);
    KellerStatus status = check_element(&check, root, &rules[0]);
    if (status != KELLER_OK) return status;
    if (!keller_config_child(root, "receiver") && !keller_config_child(root, "receivers") &&
        !keller_config_child(root, "grid"))
        return keller_error(
            error, KELLER_BAD_INPUT,
            "%s:%d: <simulation> has no receivers; expected at least one <receiver>, <receivers> or <grid>", file,
            line);
    return KELLER_OK;
}

KellerStatus keller_config_check_schema(const char *file, xmlDocPtr doc, KellerError *error)
{
    KellerXmlCapture capture;
    keller_xml_capture_begin(&capture);
    xmlRelaxNGParserCtxtPtr parser =
        xmlRelaxNGNewMemParserCtxt(keller_data_keller_rng, (int)keller_data_keller_rng_length);
    xmlRelaxNGPtr schema = parser ? xmlRelaxNGParse(parser) : NULL;
    xmlRelaxNGValidCtxtPtr validator = schema ? xmlRelaxNGNewValidCtxt(schema) : NULL;
    int verdict = validator ? xmlRelaxNGValidateDoc(validator, doc) : -1;
    if (validator) xmlRelaxNGFreeValidCtxt(validator);
    if (schema) xmlRelaxNGFree(schema);
    if (parser) xmlRelaxNGFreeParserCtxt(parser);
    keller_xml_capture_end(&capture);
    if (verdict == 0) return KELLER_OK;
    if (verdict < 0)
        return keller_error(error, KELLER_FAILED, "%s: the schema could not be applied: %s", file,
                            capture.errors ? capture.message : "out of memory");
    return keller_error(error, KELLER_BAD_INPUT, "%s:%d: the configuration does not fit the schema: %s", file,
                        capture.line ? capture.line : 1,
                        capture.errors ? capture.message : "expected a valid document");
}
