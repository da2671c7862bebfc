#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <libxml/relaxng.h>

#include "base/embedded.h"
#include "io/config_read.h"
#include "io/names.h"
#include "io/xml.h"

typedef enum { ANY, RADIO, SOUND } Domain;
static const char *const domain_names[] = {[RADIO] = "rf", [SOUND] = "acoustic"};

/* What an element may hold. Words end in ! (exactly one), ? (at most one), + (at least one) or * (any number). The same
 * grammar as data/keller.rng, for the sake of the messages; tests hold the two against each other. */
typedef struct {
    const char *element, *attributes, *children;
    bool text;
    Domain domain;                /* an element that differs between the domains has two rules */
} Rule;

#define STATION "antenna? orientation? velocity?"
#define SOUND_STATION "directivity? orientation? velocity?"

static const Rule rules[] = {
    {"simulation", "version! domain!",
     "scene! origin? frequency+ medium? material* default-material? assign* transmitter+ receiver* receivers* grid* paths? "
     "solver? "
     "output?",
     false, RADIO},
    {"simulation", "version! domain!",
     "scene! origin? frequency* bands? medium? material* default-material? assign* transmitter+ receiver* receivers* grid* paths? "
     "solver? response? "
     "output?",
     false, SOUND},
    {"scene", "file! scale?", "", false, ANY},
    {"origin", "lat! lon! height!", "", false, ANY},
    {"frequency", "", "", true, ANY},
    {"bands", "from! to! per-octave?", "", false, SOUND},
    {"medium", "temperature? pressure? humidity? absorption? rain?", "", false, RADIO},
    {"medium", "temperature? pressure? humidity? absorption? speed?", "", false, SOUND},
    {"material", "name! itu? permittivity? conductivity? conductor? thickness? roughness? scattering? lobe? back-lobe? lobe-share? "
     "cross-polarization?", "layer*", false, RADIO},
    {"material", "name! absorption? impedance? rigid? scattering?", "", false, SOUND},
    {"layer", "itu? permittivity? conductivity? thickness!", "", false, RADIO},
    {"default-material", "name!", "", false, ANY},
    {"assign", "object! material!", "", false, ANY},
    {"transmitter", "id!", "position? geodetic? " STATION " power?", false, RADIO},
    {"transmitter", "id!", "position? geodetic? " SOUND_STATION " level?", false, SOUND},
    {"receiver", "id!", "position? geodetic? " STATION, false, RADIO},
    {"receiver", "id!", "position? geodetic? " SOUND_STATION, false, SOUND},
    {"receivers", "id! file!", STATION, false, RADIO},
    {"receivers", "id! file!", SOUND_STATION, false, SOUND},
    {"grid", "id! z? height?", "over* from! to! step! " STATION, false, RADIO},
    {"grid", "id! z? height?", "over* from! to! step! " SOUND_STATION, false, SOUND},
    {"over", "object? material?", "", false, ANY},
    {"position", "x! y! z!", "", false, ANY},
    {"geodetic", "lat! lon! height!", "", false, ANY},
    {"antenna", "pattern? polarization? file?", "element*", false, RADIO},
    {"element", "x? y? z? phase?", "", false, RADIO},
    {"directivity", "pattern? order?", "", false, SOUND},
    {"level", "power? pressure?", "", false, SOUND},
    {"orientation", "yaw? pitch? roll?", "", false, ANY},
    {"velocity", "x? y? z?", "", false, ANY},
    {"power", "", "", true, RADIO},
    {"from", "x! y!", "", false, ANY},
    {"to", "x! y!", "", false, ANY},
    {"step", "", "", true, ANY},
    {"paths", "reflections? diffractions? transmissions? scattering? patch? with-scattering? interactions? dynamic-range? wedge?", "", false, RADIO},
    {"paths", "reflections? diffractions? interactions? dynamic-range? wedge?", "", false, SOUND},
    {"solver", "accelerator? cone? threads?", "", false, RADIO},
    {"solver", "accelerator? cone? threads? diffraction?", "", false, SOUND},
    {"response", "rate! duration! tail? volume?", "", false, SOUND},
    {"output", "paths? coverage? scene?", "", false, ANY},
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

static const Rule *find_rule(const char *element, Domain domain)
{
    for (size_t i = 0; i < sizeof rules / sizeof *rules; i++)
        if (strcmp(rules[i].element, element) == 0 && (rules[i].domain == ANY || rules[i].domain == domain)) return &rules[i];
    return NULL;
}

enum { OTHER_BYTES = 64 };

/* Words for a message where the other domain's rule for the element has what this one lacks; else nothing. */
static const char *other_domain(const Rule *rule, bool attribute, const char *name, char text[OTHER_BYTES])
{
    Domain other = rule->domain == RADIO ? SOUND : RADIO;
    const Rule *there = rule->domain == ANY ? NULL : find_rule(rule->element, other);
    char mark;
    text[0] = '\0';
    if (there && find_word(attribute ? there->attributes : there->children, name, &mark) >= 0)
        snprintf(text, OTHER_BYTES, "; it belongs to domain \"%s\"", domain_names[other]);
    return text;
}

typedef struct {
    const char *file;
    Domain domain;
    KellerError *error;
} Check;

static KellerStatus check_attributes(const Check *check, const xmlNode *node, const Rule *rule)
{
    char names[256], hint[KELLER_HINT_BYTES], other[OTHER_BYTES], word[LONGEST_WORD], mark;
    int line = keller_xml_line(node);
    for (const xmlAttr *a = node->properties; a; a = a->next) {
        const char *name = (const char *)a->name;
        if (!a->ns && find_word(rule->attributes, name, &mark) >= 0) continue;
        return keller_error(check->error, KELLER_BAD_INPUT,
                            "%s:%d: <%s> has an unknown attribute \"%s%s%s\"; expected %s%s%s", check->file, line,
                            rule->element, a->ns && a->ns->prefix ? (const char *)a->ns->prefix : "", a->ns ? ":" : "",
                            keller_quote(name).text, listed(rule->attributes, names),
                            hint_for(rule->attributes, name, hint), other_domain(rule, true, name, other));
    }
    for (const char *list = rule->attributes; next_word(&list, word, &mark);)
        if (mark == '!' && !xmlHasProp(node, (const xmlChar *)word))
            return keller_error(check->error, KELLER_BAD_INPUT,
                                "%s:%d: <%s> has no attribute \"%s\"; expected %s=\"...\"", check->file, line,
                                rule->element, word, word);
    return KELLER_OK;
}

static bool only_blanks(const xmlChar *text) { return !text || text[strspn((const char *)text, " \t\r\n")] == '\0'; }

#define MOST_CHILDREN 20

/* One child of an element that follows `rule`; counts it. */
static KellerStatus check_child(const Check *check, const Rule *rule, const xmlNode *child,
                                unsigned seen[MOST_CHILDREN])
{
    char names[256], hint[KELLER_HINT_BYTES], other[OTHER_BYTES], mark = 0;
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
        return keller_error(check->error, KELLER_BAD_INPUT, "%s:%d: unknown element <%s> in <%s>; expected %s%s%s",
                            check->file, line, keller_quote(name).text, rule->element, listed(rule->children, names),
                            hint_for(rule->children, name, hint), other_domain(rule, false, name, other));
    if (++seen[place] > 1 && (mark == '!' || mark == '?'))
        return keller_error(check->error, KELLER_BAD_INPUT, "%s:%d: a second <%s> in <%s>; expected at most one",
                            check->file, line, name, rule->element);
    return KELLER_OK;
}

/* Attributes of which an element has exactly one. */
static KellerStatus check_choice(const Check *check, const xmlNode *node, const char *first, const char *second)
{
    bool has = keller_config_attribute(node, first);
    if (has != !!keller_config_attribute(node, second)) return KELLER_OK;
    return keller_error(check->error, KELLER_BAD_INPUT, "%s:%d: <%s> has %s %s=\"...\" %s %s=\"...\"; expected exactly one of them",
                        check->file, keller_xml_line(node), (const char *)node->name, has ? "both" : "neither", first,
                        has ? "and" : "nor", second);
}

static KellerStatus check_element(const Check *check, const xmlNode *node, const Rule *rule)
{
    KellerStatus status = check_attributes(check, node, rule);
    if (status != KELLER_OK) return status;
    unsigned seen[MOST_CHILDREN] = {0};
    for (const xmlNode *child = node->children; child; child = child->next) {
        status = check_child(check, rule, child, seen);
        if (status == KELLER_OK && child->type == XML_ELEMENT_NODE)
            status = check_element(check, child, find_rule((const char *)child->name, check->domain));
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
    if (strcmp(rule->element, "grid") == 0) return check_choice(check, node, "z", "height");
    if (strcmp(rule->element, "over") == 0) return check_choice(check, node, "object", "material");
    return KELLER_OK;
}

KellerStatus keller_config_check_structure(const char *file, xmlDocPtr doc, KellerError *error)
{
    Check check = {file, RADIO, error};
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
    if (domain && strcmp(domain, domain_names[SOUND]) == 0) check.domain = SOUND;
    else if (domain && strcmp(domain, domain_names[RADIO]) != 0)
        return keller_error(error, KELLER_BAD_INPUT,
                            "%s:%d: domain \"%s\" of <simulation> is unknown; expected \"rf\" or \"acoustic\"", file, line,
                            keller_quote(domain).text);
    unsigned long children = xmlChildElementCount(root);
    if (children > KELLER_MAX_ELEMENTS)
        return keller_error(
            error, KELLER_BAD_INPUT,
            "%s:%d: <simulation> holds %lu elements; expected at most %u (many receivers fit in a route file "
            "or a grid)",
            file, line, children, KELLER_MAX_ELEMENTS);
    KellerStatus status = check_element(&check, root, find_rule("simulation", check.domain));
    if (status != KELLER_OK) return status;
    if (!keller_config_child(root, "receiver") && !keller_config_child(root, "receivers") &&
        !keller_config_child(root, "grid"))
        return keller_error(
            error, KELLER_BAD_INPUT,
            "%s:%d: <simulation> has no receivers; expected at least one <receiver>, <receivers> or <grid>", file,
            line);
    bool bands = keller_config_child(root, "bands");
    if (check.domain == SOUND && bands == !!keller_config_child(root, "frequency"))
        return keller_error(error, KELLER_BAD_INPUT,
                            "%s:%d: <simulation> has %s; expected exactly one of <bands> and <frequency>, "
                                                     "of which there may be more", file, line,
                            bands ? "both <bands> and <frequency>" : "neither <bands> nor <frequency>");
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
