#include "keller/config.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <libxml/parser.h>

#include "io/config_read.h"
#include "io/names.h"
#include "io/sha256.h"
#include "io/xml.h"
#include "keller/path.h"

void keller_config_free(KellerConfig *config)
{
    free(config->file);
    free(config->text);
    free(config->scene_file);
    free(config->frequencies);
    free(config->frequency_lines);
    for (size_t i = 0; i < config->material_count; i++) free(config->materials[i].name);
    free(config->materials);
    free(config->material_lines);
    free(config->default_material);
    for (size_t i = 0; i < config->assignment_count; i++) {
        free(config->assignments[i].object);
        free(config->assignments[i].material);
    }
    free(config->assignments);
    free(config->assignment_lines);
    for (size_t i = 0; i < config->antenna_count; i++) {
        free(config->antennas[i].file);
        free(config->antennas[i].cuts);
    }
    free(config->antennas);
    for (size_t i = 0; i < config->array_count; i++) free(config->arrays[i]);
    free(config->arrays);
    for (size_t i = 0; i < config->transmitter_count; i++) {
        free(config->transmitters[i].id);
        free(config->transmitters[i].level);
    }
    free(config->transmitters);
    for (size_t i = 0; i < config->set_count; i++) {
        free(config->sets[i].id);
        free(config->sets[i].file);
        for (size_t k = 0; k < config->sets[i].surface_count; k++) free(config->sets[i].surfaces[k].name);
        free(config->sets[i].surfaces);
    }
    free(config->sets);
    free(config->receivers);
    *config = (KellerConfig){0};
}

static KellerStatus read_scene(KellerConfigReader *reader, const xmlNode *root)
{
    KellerConfig *config = reader->config;
    const xmlNode *scene = keller_config_child(root, "scene"), *origin = keller_config_child(root, "origin");
    static const KellerConfigRange scale = {1e-9, 1e9, "a factor from 1e-9 to 1e9"};
    config->line = keller_xml_line(root);
    config->scene_line = keller_xml_line(scene);
    KellerStatus status = keller_config_path(reader, scene, "file", &config->scene_file);
    if (status == KELLER_OK)
        status = keller_config_quantity(reader, scene, "scale", NULL, &scale, &config->scene_scale);
    if (status == KELLER_OK && origin) {
        config->has_origin = true;
        status = keller_config_geodetic(reader, origin, &config->origin);
    }
    return status;
}

static KellerStatus read_frequencies(KellerConfigReader *reader, const xmlNode *root, bool is_sound)
{
    KellerConfig *config = reader->config;
    static const KellerConfigRange radio = {KELLER_MIN_FREQUENCY, KELLER_MAX_FREQUENCY, "a frequency from 1 Hz to 1000 THz"};
    static const KellerConfigRange sound = {KELLER_MIN_FREQUENCY, 1e6, "a frequency from 1 Hz to 1 MHz"};
    const KellerConfigRange range = is_sound ? sound : radio;
    size_t capacity = 0, line_capacity = 0;
    for (const xmlNode *child = root->children; child; child = child->next) {
        if (!keller_config_is(child, "frequency")) continue;
        if (config->frequency_count == KELLER_MAX_FREQUENCIES)
            return keller_config_fail(reader, child, "more than %u frequencies; expected fewer",
                                      KELLER_MAX_FREQUENCIES);
        size_t at = config->frequency_count;
        if (!keller_config_grow((void **)&config->frequencies, &capacity, at, 1, sizeof(double)) ||
            !keller_config_grow((void **)&config->frequency_lines, &line_capacity, at, 1, sizeof(int)))
            return keller_error_memory(reader->error, sizeof(double));
        config->frequency_lines[at] = keller_xml_line(child);
        double *value = &config->frequencies[config->frequency_count++];
        KellerStatus status = keller_config_quantity(reader, child, NULL, "frequency", &range, value);
        if (status != KELLER_OK) return status;
    }
    return KELLER_OK;
}

/* The line of the item-th child of root that makes an item of its kind: a transmitter, or a set of receivers. */
static const xmlNode *nth_child(const xmlNode *root, bool transmitters, size_t item)
{
    for (const xmlNode *child = root->children; child; child = child->next) {
        bool counts = transmitters ? keller_config_is(child, "transmitter")
                                   : keller_config_is(child, "receiver") || keller_config_is(child, "receivers") ||
                                         keller_config_is(child, "grid");
        if (counts && item-- == 0) return child;
    }
    return root;
}

static KellerStatus check_ids(const KellerConfigReader *reader, const xmlNode *root, bool transmitters)
{
    const KellerConfig *config = reader->config;
    KellerNameIndex index;
    bool built = transmitters ? keller_names_build(&index, config->transmitter_count, &config->transmitters->id,
                                                   sizeof *config->transmitters)
                              : keller_names_build(&index, config->set_count, &config->sets->id, sizeof *config->sets);
    if (!built) return keller_error_memory(reader->error, sizeof *index.entries);
    size_t second = keller_names_duplicate(&index);
    KellerStatus status = KELLER_OK;
    if (second != KELLER_NO_NAME) {
        const char *id = transmitters ? config->transmitters[second].id : config->sets[second].id;
        status = keller_config_fail(reader, nth_child(root, transmitters, second),
                                    "id \"%s\" is taken already by line %d; expected an id of its own for each %s",
                                    keller_quote(id).text,
                                    keller_xml_line(nth_child(root, transmitters, keller_names_find(&index, id))),
                                    transmitters ? "transmitter" : "receiver, route and grid");
    }
    keller_names_free(&index);
    return status;
}

static KellerStatus read_stations(KellerConfigReader *reader, const xmlNode *root)
{
    KellerStatus status = KELLER_OK;
    for (const xmlNode *child = root->children; child && status == KELLER_OK; child = child->next) {
        if (keller_config_is(child, "transmitter")) status = keller_config_read_transmitter(reader, child);
        if (keller_config_is(child, "receiver")) status = keller_config_read_receiver(reader, child);
        if (keller_config_is(child, "receivers")) status = keller_config_read_route(reader, child);
        if (keller_config_is(child, "grid")) status = keller_config_read_grid(reader, child);
    }
    if (status == KELLER_OK) status = check_ids(reader, root, true);
    if (status == KELLER_OK) status = check_ids(reader, root, false);
    return status;
}

static KellerStatus read_paths(KellerConfigReader *reader, const xmlNode *root)
{
    KellerConfig *config = reader->config;
    config->dynamic_range = 150;
    config->patch = 1;
    const xmlNode *node = keller_config_child(root, "paths");
    if (!node) return KELLER_OK;
    config->paths_line = keller_xml_line(node);
    static const KellerConfigRange positive = {DBL_MIN, DBL_MAX, "more than 0 dB"};
    KellerStatus status =
        keller_config_count(reader, node, "reflections", KELLER_MAX_BENDS, &config->reflections);
    if (status == KELLER_OK)
        status = keller_config_count(reader, node, "diffractions", KELLER_MAX_BENDS, &config->diffractions);
    if (status == KELLER_OK)
        status = keller_config_count(reader, node, "transmissions", KELLER_MAX_INTERACTIONS, &config->transmissions);
    if (status == KELLER_OK) status = keller_config_count(reader, node, "scattering", 1, &config->scattering);
    config->interactions = config->reflections + config->diffractions + config->transmissions + config->scattering;
    if (status == KELLER_OK)
        status = keller_config_count(reader, node, "interactions", KELLER_MAX_INTERACTIONS, &config->interactions);
    if (status == KELLER_OK && config->interactions > KELLER_MAX_INTERACTIONS)
        status = keller_config_fail(reader, node,
                                    "reflections, diffractions, transmissions and scattering of <paths> add up to %u "
                                    "interactions; expected at most %d, or interactions=\"...\" to bound them",
                                    config->interactions, KELLER_MAX_INTERACTIONS);
    uint32_t bends = config->reflections + config->diffractions;
    if (status == KELLER_OK && bends > KELLER_MAX_BENDS && config->interactions > KELLER_MAX_BENDS)
        status = keller_config_fail(reader, node,
                                    "reflections and diffractions of <paths> add up to %u; expected at most %d, or "
                                    "interactions=\"...\" to bound them",
                                    bends, KELLER_MAX_BENDS);
    if (status == KELLER_OK)
        status = keller_config_quantity(reader, node, "dynamic-range", "ratio", &positive, &config->dynamic_range);
    static const KellerConfigRange patch = {1e-3, 1e6, "1 mm to 1000 km"};
    if (status == KELLER_OK) status = keller_config_quantity(reader, node, "patch", "length", &patch, &config->patch);
    if (status == KELLER_OK)
        status = keller_config_count(reader, node, "with-scattering", KELLER_MAX_BENDS - 1, &config->with_scattering);
    for (int i = 0; i < 2 && status == KELLER_OK && config->scattering == 0; i++) {
        static const char *const used[] = {"patch", "with-scattering"};
        if (keller_config_attribute(node, used[i]))
            status = keller_config_fail(reader, node, "<paths> has a %s that nothing uses; expected scattering=\"1\" with it", used[i]);
    }
    static const char *const models[] = {"reciprocal", "luebbers", "holm", NULL};
    static const KellerWedgeModel meaning[] = {KELLER_WEDGE_RECIPROCAL, KELLER_WEDGE_LUEBBERS, KELLER_WEDGE_HOLM};
    unsigned place = 0;
    if (status == KELLER_OK) status = keller_config_word(reader, node, "wedge", models, &place);
    config->wedge_model = meaning[place];
    return status;
}

/* ITU-R P.676 and P.838. */
static const double air_band[2] = {1e9, 1e12}; /* Hz */

static KellerStatus read_medium(KellerConfigReader *reader, const xmlNode *root)
{
    KellerConfig *config = reader->config;
    const xmlNode *node = keller_config_child(root, "medium");
    if (!node) return KELLER_OK;
    static const KellerConfigRange temperature = {150, 400, "150 K to 400 K"}, pressure = {0, 2e5, "0 Pa to 200 kPa"};
    static const KellerConfigRange humidity = {0, 1, "0 % to 100 %"}, rain = {0, 1e3 / 3.6e6, "0 mm/h to 1000 mm/h"};
    static const char *const absorptions[] = {"none", "p676", NULL};
    unsigned place = 0;
    double share = 0.5;
    KellerAir *air = &config->air;
    *air = (KellerAir){.temperature = 288.15, .pressure = 101325};
    KellerStatus status = keller_config_word(reader, node, "absorption", absorptions, &place);
    if (status == KELLER_OK)
        status = keller_config_quantity(reader, node, "temperature", "temperature", &temperature, &air->temperature);
    if (status == KELLER_OK) status = keller_config_quantity(reader, node, "pressure", "pressure", &pressure, &air->pressure);
    if (status == KELLER_OK) status = keller_config_quantity(reader, node, "humidity", "share", &humidity, &share);
    if (status == KELLER_OK) status = keller_config_quantity(reader, node, "rain", "rain", &rain, &air->rain);
    if (status != KELLER_OK) return status;
    air->gases = place == 1;
    for (int i = 0; i < 3 && !air->gases; i++) {
        static const char *const used[] = {"temperature", "pressure", "humidity"};
        if (keller_config_attribute(node, used[i]))
            return keller_config_fail(reader, node, "<medium> has a %s that nothing uses; expected absorption=\"p676\" with it",
                                      used[i]);
    }
    air->vapour = keller_vapour_pressure(air->temperature, air->pressure, share);
    if (air->gases && air->vapour > air->pressure)
        return keller_config_fail(reader, node, "the water vapour of <medium> has %g Pa, more than the air's %g Pa; expected a "
                                                "lower humidity or temperature", air->vapour, air->pressure);
    for (size_t f = 0; f < config->frequency_count && (air->gases || air->rain > 0); f++)
        if (config->frequencies[f] < air_band[0] || config->frequencies[f] > air_band[1])
            return keller_config_fail(reader, node, "<medium> is defined from 1 GHz to 1000 GHz, and the frequency on line %d is "
                                                    "%g Hz; expected one between, or no <medium>",
                                      config->frequency_lines[f], config->frequencies[f]);
    return KELLER_OK;
}

static KellerStatus read_solver(KellerConfigReader *reader, const xmlNode *root)
{
    KellerConfig *config = reader->config;
    strcpy(config->accelerator, "auto");
    config->cone = M_PI / 180;
    const xmlNode *node = keller_config_child(root, "solver");
    if (!node) return KELLER_OK;
    static const char *const accelerators[] = {"auto",     "bvh",       "bvh8", "kdtree", "auto+mask",
                                               "bvh+mask", "bvh8+mask", "ubvh", "dacrt",  NULL};
    static const KellerConfigRange aperture = {DBL_MIN, M_PI / 4, "more than 0 deg and at most 45 deg"};
    unsigned place = 0;
    KellerStatus status = keller_config_word(reader, node, "accelerator", accelerators, &place);
    strcpy(config->accelerator, accelerators[place]);
    if (status == KELLER_OK) status = keller_config_quantity(reader, node, "cone", "angle", &aperture, &config->cone);
    if (status == KELLER_OK)
        status = keller_config_count(reader, node, "threads", KELLER_MAX_THREADS, &config->threads);
    static const char *const edges[] = {"utd", "btm", NULL};
    place = 0;
    if (status == KELLER_OK) status = keller_config_word(reader, node, "diffraction", edges, &place);
    config->sound.edges = place ? KELLER_EDGES_BTM : KELLER_EDGES_UTD;
    return status;
}

static KellerStatus read_output(KellerConfigReader *reader, const xmlNode *root)
{
    KellerConfig *config = reader->config;
    config->output_paths = config->output_coverage = config->output_scene = true;
    const xmlNode *node = keller_config_child(root, "output");
    if (!node) return KELLER_OK;
    KellerStatus status = keller_config_flag(reader, node, "paths", &config->output_paths);
    if (status == KELLER_OK) status = keller_config_flag(reader, node, "coverage", &config->output_coverage);
    if (status == KELLER_OK) status = keller_config_flag(reader, node, "scene", &config->output_scene);
    return status;
}

/* The document as run, variables substituted, and its digest. */
static KellerStatus keep_text(KellerConfigReader *reader, xmlDocPtr doc)
{
    KellerXmlCapture capture;
    keller_xml_capture_begin(&capture);
    xmlChar *text = NULL;
    int size = 0;
    xmlDocDumpMemoryEnc(doc, &text, &size, "UTF-8");
    keller_xml_capture_end(&capture);
    if (!text || size <= 0 || capture.errors) {
        xmlFree(text);
        return keller_error_memory(reader->error, KELLER_XML_MAX_BYTES);
    }
    reader->config->text = strdup((const char *)text);
    xmlFree(text);
    if (!reader->config->text) return keller_error_memory(reader->error, (unsigned long long)size);
    keller_sha256(reader->config->text, strlen(reader->config->text), reader->config->sha256);
    return KELLER_OK;
}

static KellerStatus read_document(KellerConfigReader *reader, xmlDocPtr doc, size_t variable_count,
                                  const KellerVariable *variables)
{
    KellerConfig *config = reader->config;
    KellerStatus status = keller_config_substitute(reader->file, doc, variable_count, variables, reader->error);
    if (status == KELLER_OK) status = keller_config_check_structure(reader->file, doc, reader->error);
    if (status != KELLER_OK) return status;
    const xmlNode *root = xmlDocGetRootElement(doc);
    config->scene_scale = 1;
    config->file = strdup(reader->file);
    if (!config->file) return keller_error_memory(reader->error, strlen(reader->file) + 1);
    status = read_scene(reader, root);
    const char *domain = keller_config_attribute(root, "domain");
    bool sound = domain && strcmp(domain, "acoustic") == 0;
    if (status == KELLER_OK) status = read_frequencies(reader, root, sound);
    if (status == KELLER_OK) status = sound ? keller_config_read_sound(reader, root) : read_medium(reader, root);
    if (status == KELLER_OK) status = keller_config_read_materials(reader, root);
    if (status == KELLER_OK) status = read_paths(reader, root);
    if (status == KELLER_OK) status = read_solver(reader, root);
    if (status == KELLER_OK) status = read_output(reader, root);
    if (status == KELLER_OK) status = read_stations(reader, root);
    if (status == KELLER_OK) status = keller_config_check_schema(reader->file, doc, reader->error);
    if (status == KELLER_OK) status = keep_text(reader, doc);
    return status;
}

KellerStatus keller_config_read(const char *file, size_t variable_count, const KellerVariable *variables,
                                KellerConfig *config, KellerError *error)
{
    *config = (KellerConfig){0};
    xmlDocPtr doc = NULL;
    KellerStatus status = keller_xml_read(file, &doc, error);
    if (status != KELLER_OK) return status;
    KellerConfigReader reader = {.file = file, .config = config, .error = error};
    status = read_document(&reader, doc, variable_count, variables);
    xmlFreeDoc(doc);
    if (status != KELLER_OK) keller_config_free(config);
    return status;
}
