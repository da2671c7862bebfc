/* The two dialects in which Mitsuba files name radio materials: Sionna RT's own kinds of BSDF, and an ITU name as the
 * identifier of an ordinary BSDF. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "io/mitsuba.h"
#include "io/text.h"

/* BSDFs can hold or name other BSDFs; more steps than this within one are a circle. */
enum { MAX_STEPS = 1000 };

typedef struct {
    xmlNodePtr radio;   /* the first (itu-)radio-material */
    char *itu_name;     /* the first identifier or name that is an ITU name */
    unsigned steps;
} Findings;

static KellerStatus type_is(const KellerMitsuba *scene, xmlNodePtr node, const char *type, bool *is, KellerError *error)
{
    char *value;
    KellerStatus status = keller_mitsuba_attribute(scene, node, "type", &value, error);
    *is = value && strcmp(value, type) == 0;
    free(value);
    return status;
}

/* Looks through a BSDF and those within it. */
static KellerStatus look(const KellerMitsuba *scene, xmlNodePtr node, Findings *found, KellerError *error)
{
    if (found->steps++ > MAX_STEPS)
        return keller_bad(keller_mitsuba_place(node), error, "BSDFs refer to each other in a circle, or %d deep; expected an end",
                          MAX_STEPS);
    bool itu = false, constant = false;
    KellerStatus status = type_is(scene, node, "itu-radio-material", &itu, error);
    if (status == KELLER_OK) status = type_is(scene, node, "radio-material", &constant, error);
    if (status == KELLER_OK && !found->radio && (itu || constant)) found->radio = node;
    static const char *const attributes[] = {"id", "name"};
    for (int i = 0; i < 2 && status == KELLER_OK && !found->itu_name; i++) {
        char *value;
        status = keller_mitsuba_attribute(scene, node, attributes[i], &value, error);
        if (value && keller_material_is_itu_name(value)) found->itu_name = value;
        else free(value);
    }
    for (xmlNodePtr child = keller_mitsuba_element(node->children); child && status == KELLER_OK;
         child = keller_mitsuba_element(child->next)) {
        if (keller_mitsuba_is(child, "bsdf")) {
            status = look(scene, child, found, error);
        } else if (keller_mitsuba_is(child, "ref")) {
            char *id;
            status = keller_mitsuba_attribute(scene, child, "id", &id, error);
            xmlNodePtr target = id ? keller_mitsuba_find(scene, id) : NULL;
            free(id);
            if (status == KELLER_OK && target && keller_mitsuba_is(target, "bsdf")) status = look(scene, target, found, error);
        }
    }
    return status;
}

/* A number that a radio material gives; *given is false where it does not. */
static KellerStatus constant_of(const KellerMitsuba *scene, xmlNodePtr node, const char *name, double least, double *value,
                                bool *given, KellerError *error)
{
    char *text;
    KellerStatus status = keller_mitsuba_property(scene, node, name, &text, error);
    *given = text != NULL;
    if (status != KELLER_OK || !text) return status;
    const char *begin = text + strspn(text, " \t\r\n"), *end = text + strlen(text);
    while (end > begin && strchr(" \t\r\n", end[-1])) end--;
    if (!keller_token_double((KellerToken){begin, end}, value) || *value < least)
        status = keller_bad(keller_mitsuba_place(node), error, "%s is `%s`; expected a number, %g or more", name,
                            keller_token_quote((KellerToken){begin, end}).text, least);
    free(text);
    return status;
}

static KellerStatus read_radio(KellerMitsuba *scene, xmlNodePtr node, KellerMaterial *material, KellerError *error)
{
    KellerPlace place = keller_mitsuba_place(node);
    bool itu, given, conductivity_given, scattering_given;
    double scattering = 0;
    KellerStatus status = type_is(scene, node, "itu-radio-material", &itu, error);
    if (status == KELLER_OK) status = constant_of(scene, node, "thickness", 0, &material->thickness, &given, error);
    if (status == KELLER_OK && !given)
        status = keller_build_note(scene->build, error, "%s:%llu: the material has no thickness: taken as a half-space",
                                   place.file, (unsigned long long)place.at);
    if (status == KELLER_OK)
        status = constant_of(scene, node, "scattering_coefficient", 0, &scattering, &scattering_given, error);
    if (status == KELLER_OK && scattering > 0)
        status = keller_build_note(scene->build, error, "%s:%llu: scattering_coefficient is left out", place.file,
                                   (unsigned long long)place.at);
    if (status != KELLER_OK) return status;
    if (itu) {
        char *type;
        status = keller_mitsuba_property(scene, node, "type", &type, error);
        if (status != KELLER_OK) return status;
        if (!type)
            return keller_bad(place, error, "the itu-radio-material has no type; expected such as "
                              "<string name=\"type\" value=\"concrete\"/>");
        material->kind = KELLER_MATERIAL_ITU;
        status = keller_material_itu(place, type, material->itu, error);
        free(type);
        return status;
    }
    status = constant_of(scene, node, "relative_permittivity", 1, &material->permittivity, &given, error);
    if (status == KELLER_OK)
        status = constant_of(scene, node, "conductivity", 0, &material->conductivity, &conductivity_given, error);
    if (status != KELLER_OK) return status;
    if (given) material->kind = KELLER_MATERIAL_CONSTANT;
    else if (conductivity_given)
        return keller_bad(place, error, "the radio-material has a conductivity but no relative_permittivity; expected both");
    return KELLER_OK;
}

/* The name by which a configuration finds the material; NULL in *name: it has none. */
static KellerStatus name_of(const KellerMitsuba *scene, xmlNodePtr node, const KellerMaterial *material, char **name,
                            KellerError *error)
{
    KellerStatus status = keller_mitsuba_attribute(scene, node, "id", name, error);
    if (status != KELLER_OK || *name) return status;
    status = keller_mitsuba_attribute(scene, node, "name", name, error);
    if (status != KELLER_OK || (*name && strcmp(*name, "bsdf") != 0)) return status;
    free(*name);
    *name = NULL;
    if (material->kind == KELLER_MATERIAL_NAMED) return KELLER_OK;
    char made[80] = "radio-material";
    if (material->kind == KELLER_MATERIAL_ITU)
        snprintf(made, sizeof made, material->thickness > 0 ? "itu_%s_%gm" : "itu_%s", material->itu, material->thickness);
    *name = strdup(made);
    return *name ? KELLER_OK : keller_error_memory(error, sizeof made);
}

static KellerStatus material_of(KellerMitsuba *scene, xmlNodePtr bsdf, bool *found, uint32_t *index, KellerError *error)
{
    if (bsdf->_private) { /* done before: 1 + index, or UINT32_MAX: none */
        *index = (uint32_t)(uintptr_t)bsdf->_private - 1;
        *found = *index != UINT32_MAX - 1;
        return KELLER_OK;
    }
    Findings findings = {0};
    KellerMaterial material = {.kind = KELLER_MATERIAL_NAMED};
    char *name = NULL;
    KellerStatus status = look(scene, bsdf, &findings, error);
    if (status == KELLER_OK && findings.radio) {
        status = read_radio(scene, findings.radio, &material, error);
    } else if (status == KELLER_OK && findings.itu_name) {
        status = keller_material_of_name(keller_mitsuba_place(bsdf), findings.itu_name, &material, error);
    }
    free(findings.itu_name);
    if (status == KELLER_OK) status = name_of(scene, bsdf, &material, &name, error);
    *found = name != NULL;
    *index = UINT32_MAX - 1;
    if (status == KELLER_OK && name) {
        material.name = name;
        status = keller_build_material(scene->build, &material, index, error);
    }
    free(name);
    if (status == KELLER_OK) bsdf->_private = (void *)((uintptr_t)*index + 1);
    return status;
}

KellerStatus keller_mitsuba_material(KellerMitsuba *scene, xmlNodePtr shape, bool *found, uint32_t *index,
                                     KellerError *error)
{
    bool seen = false;
    *found = false;
    for (xmlNodePtr child = keller_mitsuba_element(shape->children); child; child = keller_mitsuba_element(child->next)) {
        KellerStatus status = KELLER_OK;
        KellerPlace place = keller_mitsuba_place(child);
        xmlNodePtr bsdf = NULL;
        char *id = NULL, *name = NULL;
        if (keller_mitsuba_is(child, "bsdf")) {
            bsdf = child;
        } else if (keller_mitsuba_is(child, "ref")) {
            status = keller_mitsuba_attribute(scene, child, "id", &id, error);
            if (status == KELLER_OK) status = keller_mitsuba_attribute(scene, child, "name", &name, error);
            if (status == KELLER_OK && !id) status = keller_bad(place, error, "<ref> has no id; expected one");
            if (status == KELLER_OK) bsdf = keller_mitsuba_find(scene, id);
        }
        bool other = !id || (name && strcmp(name, "bsdf") != 0); /* a medium, an emitter */
        if (status == KELLER_OK && bsdf && !keller_mitsuba_is(bsdf, "bsdf")) {
            bsdf = NULL;
        } else if (status == KELLER_OK && !bsdf && !other) {
            /* Such a name says what the material is even where nothing defines it. */
            KellerMaterial material;
            status = keller_material_of_name(place, id, &material, error);
            if (status == KELLER_OK && material.kind == KELLER_MATERIAL_NAMED)
                status = keller_bad(place, error, "<ref> to `%.200s`, which nothing defines; expected the id of a <bsdf>", id);
            if (status == KELLER_OK) status = keller_build_material(scene->build, &material, index, error);
            if (status == KELLER_OK) *found = seen = true;
        }
        if (status == KELLER_OK && bsdf && seen)
            status = keller_bad(place, error, "a second material of one shape; expected one");
        if (status == KELLER_OK && bsdf) {
            seen = true;
            status = material_of(scene, bsdf, found, index, error);
        }
        free(id);
        free(name);
        if (status != KELLER_OK) return status;
    }
    return KELLER_OK;
}
