/* io/config_read.h -- the steps of reading a configuration, shared by the config*.c files. */
#ifndef KELLER_IO_CONFIG_READ_H
#define KELLER_IO_CONFIG_READ_H
#include "keller/config.h"
#include <libxml/tree.h>

/* Bounds that keep every later product finite; docs/configuration.md lists them. */
#define KELLER_MAX_COORDINATE 1e9 /* m */
#define KELLER_MIN_FREQUENCY 1.0  /* Hz */
#define KELLER_MAX_FREQUENCY 1e15 /* Hz */
#define KELLER_MAX_FREQUENCIES 16384u
#define KELLER_MAX_THREADS 4096u
/* Elements directly in <simulation>: libxml2's RELAX NG takes more than linear time over them, seconds at this
 * number. */
#define KELLER_MAX_ELEMENTS 50000u
#define KELLER_MAX_NAME 200u /* bytes */

typedef struct {
    const char *file;     /* the configuration, for messages */
    KellerConfig *config; /* being filled */
    KellerError *error;
    size_t antenna_capacity, array_capacity, transmitter_capacity, set_capacity, receiver_capacity;
} KellerConfigReader;

/* ---- config_sound.c: what only domain "acoustic" has ---- */

/* <bands>, <medium> and <response>. */
KellerStatus keller_config_read_sound(KellerConfigReader *reader, const xmlNode *root);
/* The surface of a <material>; its name has been read. */
KellerStatus keller_config_read_surface(const KellerConfigReader *reader, const xmlNode *node, KellerMaterial *material);
/* <directivity> of a station; all around where there is none. */
KellerStatus keller_config_read_directivity(const KellerConfigReader *reader, const xmlNode *node,
                                            KellerDirectivity *directivity);
/* <level> of a transmitter whose directivity has been read: its level at each frequency, and its power. */
KellerStatus keller_config_read_level(const KellerConfigReader *reader, const xmlNode *node, KellerTransmitter *tx);

/* ---- config_vars.c ---- */

/* Replaces $NAME, ${NAME} and $$ in all attribute values and text of the document. */
KellerStatus keller_config_substitute(const char *file, xmlDocPtr doc, size_t count, const KellerVariable *variables,
                                      KellerError *error);

/* ---- config_rules.c ---- */

/* Every element and attribute is known and in its place, and what is required is there. Values are not looked at,
 * except for the root's version and domain. */
KellerStatus keller_config_check_structure(const char *file, xmlDocPtr doc, KellerError *error);
/* The document is valid against data/keller.rng: the last gate, behind checks whose messages are better. */
KellerStatus keller_config_check_schema(const char *file, xmlDocPtr doc, KellerError *error);

/* ---- config_values.c: values of one element; messages name the file, its line, element and attribute ---- */

KellerStatus keller_config_fail(const KellerConfigReader *reader, const xmlNode *node, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* The attribute's value, or NULL. Valid as long as the document. */
const char *keller_config_attribute(const xmlNode *node, const char *name);
bool keller_config_is(const xmlNode *node, const char *name);
/* The first child element of that name, or NULL. */
const xmlNode *keller_config_child(const xmlNode *node, const char *name);

/* A range and how a message says it. */
typedef struct {
    double low, high; /* both allowed */
    const char *text; /* "more than 0 m" */
} KellerConfigRange;

/* Each reads an attribute (the element's text where `attribute` is NULL), leaves *value alone where an attribute is
 * absent, and checks it. `kind` as in keller_parse_quantity; NULL: a number without a unit. */
KellerStatus keller_config_quantity(const KellerConfigReader *reader, const xmlNode *node, const char *attribute,
                                    const char *kind, const KellerConfigRange *range, double *value);
KellerStatus keller_config_count(const KellerConfigReader *reader, const xmlNode *node, const char *attribute,
                                 uint32_t limit, uint32_t *value);
KellerStatus keller_config_flag(const KellerConfigReader *reader, const xmlNode *node, const char *attribute,
                                bool *value);
/* One of `words` (NULL-terminated); its place in *value. */
KellerStatus keller_config_word(const KellerConfigReader *reader, const xmlNode *node, const char *attribute,
                                const char *const *words, unsigned *value);
/* A non-empty name of at most KELLER_MAX_NAME bytes, blanks at the ends dropped, as a new string. */
KellerStatus keller_config_name(const KellerConfigReader *reader, const xmlNode *node, const char *attribute,
                                char **value);
/* The same for an id: letters, digits, `_ - . :` and characters beyond ASCII, not starting with a dot. */
KellerStatus keller_config_id(const KellerConfigReader *reader, const xmlNode *node, char **value);
/* A file name against the configuration's folder, as a new string. */
KellerStatus keller_config_path(const KellerConfigReader *reader, const xmlNode *node, const char *attribute,
                                char **value);
/* lat, lon and height attributes. */
KellerStatus keller_config_geodetic(const KellerConfigReader *reader, const xmlNode *node, KellerGeodetic *value);
/* Makes room for `extra` more items of `size` bytes behind *count; false on lack of memory. */
bool keller_config_grow(void **items, size_t *capacity, size_t count, size_t extra, size_t size);

/* ---- config_stations.c, config_materials.c: parts of the document, in the order of keller_config_read ---- */

/* The ITU-R P.2040 names and, where one is near to `wrong`, which; for a message. Written to list and returned. */
#define KELLER_ITU_LIST_BYTES 640
const char *keller_config_itu_list(const char *wrong, char list[KELLER_ITU_LIST_BYTES]);

KellerStatus keller_config_read_materials(KellerConfigReader *reader, const xmlNode *root);
KellerStatus keller_config_read_transmitter(KellerConfigReader *reader, const xmlNode *node);
KellerStatus keller_config_read_receiver(KellerConfigReader *reader, const xmlNode *node);
KellerStatus keller_config_read_grid(KellerConfigReader *reader, const xmlNode *node);
KellerStatus keller_config_read_route(KellerConfigReader *reader, const xmlNode *node);

/* ---- config_over.c ---- */

/* The height of a <grid> over the ground, and what counts as ground: the grid becomes draped. */
KellerStatus keller_config_read_over(const KellerConfigReader *reader, const xmlNode *node, KellerReceiverSet *set);

/* ---- config_route.c ---- */

/* Reads the points of a route from a CSV file, relative to nothing (a full path), at most `limit` of them. `node` is
 * the <receivers> element. *points is a new block. */
KellerStatus keller_config_read_points(const KellerConfigReader *reader, const xmlNode *node, const char *path,
                                       size_t limit, KellerVec3 **points, size_t *count);
#endif
