/* io/mitsuba.h -- Mitsuba's scene description: documents, variables and identifiers, transforms, materials. */
#ifndef KELLER_IO_MITSUBA_H
#define KELLER_IO_MITSUBA_H
#include <stdbool.h>
#include <stddef.h>
#include "io/soup_build.h"
#include "io/xml.h"

typedef struct {
    xmlDocPtr doc;          /* doc->_private points back here */
    char *file;
} KellerMitsubaDocument;

typedef struct {
    char *name;
    char *value;            /* of a variable; NULL for an identifier */
    xmlNodePtr node;        /* with that identifier */
} KellerMitsubaEntry;

typedef struct {
    KellerBuild *build;
    KellerMitsubaDocument **documents; /* the scene's own first, then included ones */
    size_t document_count, document_capacity;
    KellerMitsubaEntry **entries;
    size_t entry_count, entry_capacity;
    KellerLookup variables, ids;        /* index into entries */
} KellerMitsuba;

/* Parses a document and what it includes, and registers their variables (<default>) and identifiers. */
KellerStatus keller_mitsuba_load(KellerMitsuba *scene, const char *file, KellerError *error);
void keller_mitsuba_free(KellerMitsuba *scene);

KellerPlace keller_mitsuba_place(const xmlNode *node);
bool keller_mitsuba_is(const xmlNode *node, const char *element);
/* The first of node and its next siblings that is an element; NULL if none is. */
xmlNodePtr keller_mitsuba_element(xmlNodePtr node);
/* An attribute with variables substituted, owned by the caller (free); NULL where it is absent. */
KellerStatus keller_mitsuba_attribute(const KellerMitsuba *scene, xmlNodePtr node, const char *name, char **value,
                                      KellerError *error);
/* The value of the child <... name="NAME" value="..."/>, likewise. */
KellerStatus keller_mitsuba_property(const KellerMitsuba *scene, xmlNodePtr node, const char *name, char **value,
                                     KellerError *error);
/* The path of a file that a document names: relative to the document's folder. Owned by the caller; NULL: no memory. */
char *keller_mitsuba_path(const xmlNode *node, const char *name);
/* The element with that identifier; NULL if there is none. */
xmlNodePtr keller_mitsuba_find(const KellerMitsuba *scene, const char *id);

/* p' = rows p + the last column. */
typedef struct {
    double m[3][4];
} KellerTransform;
/* What <transform> says: its children one after another, each applied to what those before it give. */
KellerStatus keller_mitsuba_transform(const KellerMitsuba *scene, xmlNodePtr node, KellerTransform *transform,
                                      KellerError *error);
KellerVec3 keller_transform_point(const KellerTransform *transform, KellerVec3 p);

/* The material of a <shape>: of its <bsdf>, or of the <bsdf> that its <ref> names. *found is false where it has none (or
 * one without a name and without radio properties). */
KellerStatus keller_mitsuba_material(KellerMitsuba *scene, xmlNodePtr shape, bool *found, uint32_t *material,
                                     KellerError *error);
#endif
