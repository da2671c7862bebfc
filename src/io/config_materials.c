#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "io/config_read.h"
#include "io/names.h"
#include "io/xml.h"

static size_t count_children(const xmlNode *root, const char *name)
{
    size_t count = 0;
    for (const xmlNode *child = root->children; child; child = child->next) count += keller_config_is(child, name);
    return count;
}

const char *keller_config_itu_list(const char *wrong, char list[KELLER_ITU_LIST_BYTES])
{
    KellerNearest nearest = keller_nearest(wrong);
    char hint[KELLER_HINT_BYTES];
    size_t used = 0;
    list[0] = '\0';
    for (const char *const *name = keller_itu_names(); *name; name++) {
        keller_nearest_offer(&nearest, *name);
        int n = snprintf(list + used, KELLER_ITU_LIST_BYTES - used, "%s%s", used ? ", " : "", *name);
        used += n > 0 && (size_t)n < KELLER_ITU_LIST_BYTES - used ? (size_t)n : 0;
    }
    snprintf(list + used, KELLER_ITU_LIST_BYTES - used, "%s", keller_nearest_hint(&nearest, hint));
    return list;
}

static KellerStatus read_itu(const KellerConfigReader *reader, const xmlNode *node, KellerLayer *made)
{
    const char *itu = keller_config_attribute(node, "itu");
    if (keller_itu_known(itu) && strlen(itu) < sizeof made->itu) {
        made->kind = KELLER_MATERIAL_ITU;
        memcpy(made->itu, itu, strlen(itu) + 1);
        return KELLER_OK;
    }
    char list[KELLER_ITU_LIST_BYTES];
    return keller_config_fail(reader, node,
                              "itu of <%s> is \"%s\", which is not in ITU-R P.2040; expected one of %s",
                              (const char *)node->name, keller_quote(itu).text, keller_config_itu_list(itu, list));
}

static KellerStatus read_constants(const KellerConfigReader *reader, const xmlNode *node, KellerLayer *made)
{
    static const KellerConfigRange permittivity = {1, 1e9, "a relative permittivity from 1 to 1e9"};
    static const KellerConfigRange conductivity = {0, 1e12, "0 S/m to 1e12 S/m"};
    made->kind = KELLER_MATERIAL_CONSTANT;
    KellerStatus status =
        keller_config_quantity(reader, node, "permittivity", NULL, &permittivity, &made->permittivity);
    if (status == KELLER_OK)
        status = keller_config_quantity(reader, node, "conductivity", "conductivity", &conductivity,
                                        &made->conductivity);
    return status;
}

static const KellerConfigRange thickness_range = {DBL_MIN, 1e6, "a thickness of more than 0 m and at most 1000 km"};

/* What a material or a layer is made of, and how thick; `name` is the material's. */
static KellerStatus read_made(const KellerConfigReader *reader, const xmlNode *node, const char *name, KellerLayer *made)
{
    bool itu = keller_config_attribute(node, "itu"), conductor = keller_config_attribute(node, "conductor");
    bool permittivity = keller_config_attribute(node, "permittivity");
    bool conductivity = keller_config_attribute(node, "conductivity");
    KellerStatus status = KELLER_OK;
    if (itu + conductor + (permittivity || conductivity) != 1)
        return keller_config_fail(
            reader, node,
            "material \"%s\" is given %s; expected exactly one of itu=\"...\", permittivity=\"...\" (with "
            "conductivity=\"...\") and conductor=\"perfect\", or a <layer> and more",
            keller_quote(name).text, itu || conductor ? "in more than one way" : "without any property");
    if (conductivity && !permittivity)
        return keller_config_fail(reader, node,
                                  "material \"%s\" has a conductivity but no permittivity; expected both, or "
                                  "conductor=\"perfect\"",
                                  keller_quote(name).text);
    if (itu) status = read_itu(reader, node, made);
    if (permittivity) status = read_constants(reader, node, made);
    if (conductor) {
        static const char *const words[] = {"perfect", NULL};
        unsigned place = 0;
        status = keller_config_word(reader, node, "conductor", words, &place);
        made->kind = KELLER_MATERIAL_CONDUCTOR;
    }
    if (status == KELLER_OK)
        status = keller_config_quantity(reader, node, "thickness", "length", &thickness_range, &made->thickness);
    return status;
}

static KellerStatus read_layers(const KellerConfigReader *reader, const xmlNode *node, KellerMaterial *material)
{
    static const char *const whole[] = {"itu", "permittivity", "conductivity", "conductor", "thickness"};
    material->kind = KELLER_MATERIAL_LAYERS;
    for (size_t i = 0; i < sizeof whole / sizeof *whole; i++)
        if (keller_config_attribute(node, whole[i]))
            return keller_config_fail(reader, node, "material \"%s\" has layers and %s=\"...\"; expected it in each <layer>",
                                      keller_quote(material->name).text, whole[i]);
    for (const xmlNode *child = node->children; child; child = child->next) {
        if (!keller_config_is(child, "layer")) continue;
        if (material->layer_count == KELLER_MAX_LAYERS)
            return keller_config_fail(reader, child, "material \"%s\" has more than %d layers; expected fewer",
                                      keller_quote(material->name).text, KELLER_MAX_LAYERS);
        KellerLayer *layer = &material->layers[material->layer_count++];
        KellerStatus status = read_made(reader, child, material->name, layer);
        if (status != KELLER_OK) return status;
        material->thickness += layer->thickness;
    }
    return KELLER_OK;
}

/* Lambert's law without a lobe; all in one lobe without a share. */
static KellerStatus read_scattering(const KellerConfigReader *reader, const xmlNode *node, KellerMaterial *material)
{
    static const KellerConfigRange share = {0, 1, "a number from 0 to 1"};
    static const char *const shape[] = {"lobe", "back-lobe", "lobe-share", "cross-polarization"};
    KellerScattering *s = &material->diffuse;
    s->share = 1;
    KellerStatus status = keller_config_quantity(reader, node, "scattering", NULL, &share, &s->coefficient);
    if (status == KELLER_OK) status = keller_config_count(reader, node, "lobe", KELLER_MAX_LOBE, &s->lobe);
    if (status == KELLER_OK) status = keller_config_count(reader, node, "back-lobe", KELLER_MAX_LOBE, &s->back_lobe);
    if (status == KELLER_OK) status = keller_config_quantity(reader, node, "lobe-share", NULL, &share, &s->share);
    if (status == KELLER_OK) status = keller_config_quantity(reader, node, "cross-polarization", NULL, &share, &s->cross);
    if (status != KELLER_OK) return status;
    for (size_t i = 0; i < sizeof shape / sizeof *shape; i++)
        if (keller_config_attribute(node, shape[i]) && !keller_config_attribute(node, "scattering"))
            return keller_config_fail(reader, node, "material \"%s\" has %s=\"...\" but does not scatter; expected scattering=\"...\" "
                                      "with it", keller_quote(material->name).text, shape[i]);
    bool back = keller_config_attribute(node, "back-lobe"), shared = keller_config_attribute(node, "lobe-share");
    if (back != shared || (back && (s->lobe == 0 || s->back_lobe == 0)))
        return keller_config_fail(reader, node, "material \"%s\" has half a lobe back to the source; expected lobe, back-lobe (both 1 or "
                                  "more) and lobe-share together", keller_quote(material->name).text);
    return KELLER_OK;
}

static KellerStatus read_material(const KellerConfigReader *reader, const xmlNode *node, KellerMaterial *material)
{
    static const KellerConfigRange roughness = {0, 1e3, "0 m to 1 km"};
    KellerStatus status = keller_config_name(reader, node, "name", &material->name);
    if (status != KELLER_OK || reader->config->sound.speed > 0)
        return status == KELLER_OK ? keller_config_read_surface(reader, node, material) : status;
    if (keller_config_child(node, "layer")) {
        status = read_layers(reader, node, material);
    } else {
        KellerLayer made = {.kind = KELLER_MATERIAL_NAMED};
        status = read_made(reader, node, material->name, &made);
        material->kind = made.kind;
        memcpy(material->itu, made.itu, sizeof material->itu);
        material->permittivity = made.permittivity;
        material->conductivity = made.conductivity;
        material->thickness = made.thickness;
    }
    if (status == KELLER_OK)
        status = keller_config_quantity(reader, node, "roughness", "length", &roughness, &material->roughness);
    if (status == KELLER_OK) status = read_scattering(reader, node, material);
    return status;
}

/* The names are unique; `field` is the first item's name, `lines` are their lines. */
static KellerStatus check_unique(const KellerConfigReader *reader, size_t count, char *const *field, size_t stride,
                                 const int *lines, const char *what, const char *expected)
{
    KellerNameIndex index;
    if (!keller_names_build(&index, count, field, stride))
        return keller_error_memory(reader->error, count * sizeof *index.entries);
    size_t second = keller_names_duplicate(&index);
    KellerStatus status = KELLER_OK;
    if (second != KELLER_NO_NAME) {
        const char *name;
        memcpy(&name, (const char *)field + second * stride, sizeof name);
        status = keller_error(reader->error, KELLER_BAD_INPUT,
                              "%s:%d: %s \"%s\" appears already on line %d; expected %s", reader->file, lines[second],
                              what, keller_quote(name).text, lines[keller_names_find(&index, name)], expected);
    }
    keller_names_free(&index);
    return status;
}

static KellerStatus read_assignments(KellerConfigReader *reader, const xmlNode *root)
{
    KellerConfig *config = reader->config;
    size_t count = count_children(root, "assign");
    config->assignments = calloc(count + 1, sizeof *config->assignments);
    config->assignment_lines = calloc(count + 1, sizeof *config->assignment_lines);
    if (!config->assignments || !config->assignment_lines)
        return keller_error_memory(reader->error, (count + 1) * sizeof *config->assignments);
    for (const xmlNode *child = root->children; child; child = child->next) {
        if (!keller_config_is(child, "assign")) continue;
        size_t i = config->assignment_count++;
        config->assignment_lines[i] = keller_xml_line(child);
        KellerStatus status = keller_config_name(reader, child, "object", &config->assignments[i].object);
        if (status == KELLER_OK)
            status = keller_config_name(reader, child, "material", &config->assignments[i].material);
        if (status != KELLER_OK) return status;
    }
    return check_unique(reader, count, &config->assignments->object, sizeof *config->assignments,
                        config->assignment_lines, "an <assign> of object", "one material for an object");
}

KellerStatus keller_config_read_materials(KellerConfigReader *reader, const xmlNode *root)
{
    KellerConfig *config = reader->config;
    size_t count = count_children(root, "material");
    config->materials = calloc(count + 1, sizeof *config->materials);
    config->material_lines = calloc(count + 1, sizeof *config->material_lines);
    if (!config->materials || !config->material_lines)
        return keller_error_memory(reader->error, (count + 1) * sizeof *config->materials);
    for (const xmlNode *child = root->children; child; child = child->next) {
        if (!keller_config_is(child, "material")) continue;
        size_t i = config->material_count++;
        config->material_lines[i] = keller_xml_line(child);
        KellerStatus status = read_material(reader, child, &config->materials[i]);
        if (status != KELLER_OK) return status;
    }
    KellerStatus status = check_unique(reader, count, &config->materials->name, sizeof *config->materials,
                                       config->material_lines, "material", "a name of its own for each");
    if (status != KELLER_OK) return status;

    const xmlNode *node = keller_config_child(root, "default-material");
    if (node) {
        config->default_material_line = keller_xml_line(node);
        status = keller_config_name(reader, node, "name", &config->default_material);
        if (status != KELLER_OK) return status;
    }
    return read_assignments(reader, root);
}
