#define _GNU_SOURCE /* asprintf */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "io/config_read.h"
#include "io/names.h"
#include "io/xml.h"
#include "keller/antenna.h"

static const KellerConfigRange coordinate = {-KELLER_MAX_COORDINATE, KELLER_MAX_COORDINATE,
                                             "a coordinate within 1e6 km"};

/* Reads three attributes of one kind. */
static KellerStatus read_three(const KellerConfigReader *reader, const xmlNode *node, const char *const names[3],
                               const char *kind, const KellerConfigRange *range, double value[3])
{
    KellerStatus status = KELLER_OK;
    for (int i = 0; i < 3 && status == KELLER_OK; i++)
        status = keller_config_quantity(reader, node, names[i], kind, range, &value[i]);
    return status;
}

/* The cuts of a file, read when it is named first. */
static KellerStatus read_antenna_file(KellerConfigReader *reader, const xmlNode *node, const KellerAntennaCuts **cuts)
{
    KellerConfig *config = reader->config;
    if (!keller_config_grow((void **)&config->antennas, &reader->antenna_capacity, config->antenna_count, 1,
                            sizeof *config->antennas))
        return keller_error_memory(reader->error, sizeof *config->antennas);
    KellerAntennaFile *new = &config->antennas[config->antenna_count];
    *new = (KellerAntennaFile){NULL, NULL};
    KellerStatus status = keller_config_path(reader, node, "file", &new->file);
    if (status != KELLER_OK) return status;
    for (size_t i = 0; i < config->antenna_count; i++)
        if (strcmp(config->antennas[i].file, new->file) == 0) {
            free(new->file);
            *cuts = config->antennas[i].cuts;
            return KELLER_OK;
        }
    config->antenna_count++; /* from here on the configuration owns it */
    new->cuts = malloc(sizeof *new->cuts);
    char *where = NULL;
    if (!new->cuts || asprintf(&where, "%s:%d", reader->file, keller_xml_line(node)) < 0)
        return keller_error_memory(reader->error, sizeof *new->cuts);
    status = keller_antenna_read(new->file, where, new->cuts, reader->error);
    free(where);
    *cuts = new->cuts;
    return status;
}

/* The elements of an array, if there are any. */
static KellerStatus read_elements(KellerConfigReader *reader, const xmlNode *node, KellerAntenna *antenna)
{
    static const char *const axes[3] = {"x", "y", "z"};
    static const KellerConfigRange turn = {-1e3, 1e3, "an angle within 1000 rad"};
    static const KellerConfigRange offset = {-1e3, 1e3, "a length within 1000 m"};
    KellerConfig *config = reader->config;
    uint32_t count = 0;
    for (const xmlNode *child = node->children; child; child = child->next) count += keller_config_is(child, "element");
    if (count == 0) return KELLER_OK;
    if (count > KELLER_MAX_ELEMENTS_OF_ARRAY)
        return keller_config_fail(reader, node, "an antenna of %u elements; expected at most %d", count,
                                  KELLER_MAX_ELEMENTS_OF_ARRAY);
    if (!keller_config_grow((void **)&config->arrays, &reader->array_capacity, config->array_count, 1, sizeof *config->arrays))
        return keller_error_memory(reader->error, sizeof *config->arrays);
    KellerArrayElement *elements = calloc(count, sizeof *elements);
    if (!elements) return keller_error_memory(reader->error, count * sizeof *elements);
    config->arrays[config->array_count++] = elements;
    antenna->elements = elements;
    KellerStatus status = KELLER_OK;
    for (const xmlNode *child = node->children; child && status == KELLER_OK; child = child->next) {
        if (!keller_config_is(child, "element")) continue;
        double p[3] = {0, 0, 0};
        KellerArrayElement *e = &elements[antenna->element_count++];
        status = read_three(reader, child, axes, "length", &offset, p);
        e->position = v3(p[0], p[1], p[2]);
        if (status == KELLER_OK) status = keller_config_quantity(reader, child, "phase", "angle", &turn, &e->phase);
    }
    return status;
}

static KellerStatus read_antenna(KellerConfigReader *reader, const xmlNode *node, KellerAntenna *antenna)
{
    static const char *const patterns[] = {"isotropic", "dipole", "half-wave-dipole", "tr38901", NULL};
    static const KellerAntennaPattern meaning[] = {KELLER_ANTENNA_ISOTROPIC, KELLER_ANTENNA_DIPOLE,
                                                   KELLER_ANTENNA_HALF_WAVE_DIPOLE, KELLER_ANTENNA_TR38901};
    static const char *const polarizations[] = {"V", "H", NULL};
    const char *pattern = keller_config_attribute(node, "pattern");
    bool file = keller_config_attribute(node, "file");
    if (pattern && (file || strncmp(pattern, "file=", 5) == 0))
        return keller_config_fail(reader, node, "an antenna from a file has no pattern=\"...\"; expected file=\"...\" alone, "
                                                "or pattern=\"...\" alone");
    unsigned place = 0, polarization = 0;
    KellerStatus status = keller_config_word(reader, node, "pattern", patterns, &place);
    if (status == KELLER_OK) status = keller_config_word(reader, node, "polarization", polarizations, &polarization);
    antenna->pattern = file ? KELLER_ANTENNA_CUTS : meaning[place];
    antenna->polarization = polarization ? KELLER_POLARIZATION_H : KELLER_POLARIZATION_V;
    if (status == KELLER_OK && file) status = read_antenna_file(reader, node, &antenna->cuts);
    if (status == KELLER_OK) status = read_elements(reader, node, antenna);
    return status;
}

/* Everything but the position; zero and isotropic V where left out. */
static KellerStatus read_station(KellerConfigReader *reader, const xmlNode *node, KellerStation *station)
{
    static const char *const angles[3] = {"yaw", "pitch", "roll"}, *const axes[3] = {"x", "y", "z"};
    static const KellerConfigRange turn = {-1e3, 1e3, "an angle within 1000 rad"};
    static const KellerConfigRange speed = {-KELLER_LIGHT_SPEED, KELLER_LIGHT_SPEED, "at most the speed of light"};
    *station = (KellerStation){.antenna = {.pattern = KELLER_ANTENNA_ISOTROPIC, .polarization = KELLER_POLARIZATION_V}};
    KellerStatus status = KELLER_OK;
    const xmlNode *child = keller_config_child(node, "antenna");
    if (child) status = read_antenna(reader, child, &station->antenna);
    if (status == KELLER_OK) status = keller_config_read_directivity(reader, node, &station->directivity);
    child = keller_config_child(node, "orientation");
    if (child && status == KELLER_OK) status = read_three(reader, child, angles, "angle", &turn, station->orientation);
    child = keller_config_child(node, "velocity");
    if (child && status == KELLER_OK) {
        double v[3] = {0, 0, 0};
        status = read_three(reader, child, axes, "speed", &speed, v);
        station->velocity = v3(v[0], v[1], v[2]);
    }
    return status;
}

/* <position> or <geodetic>; the structure check saw exactly one. */
static KellerStatus read_position(const KellerConfigReader *reader, const xmlNode *node, KellerVec3 *position)
{
    static const char *const axes[3] = {"x", "y", "z"};
    const xmlNode *child = keller_config_child(node, "position");
    if (child) {
        double p[3] = {0, 0, 0};
        KellerStatus status = read_three(reader, child, axes, "length", &coordinate, p);
        *position = v3(p[0], p[1], p[2]);
        return status;
    }
    child = keller_config_child(node, "geodetic");
    if (!reader->config->has_origin)
        return keller_config_fail(reader, child,
                                  "<geodetic> needs an origin; expected <origin lat=\"...\" lon=\"...\" "
                                  "height=\"...\"/> in <simulation>");
    KellerGeodetic point = {0, 0, 0};
    KellerStatus status = keller_config_geodetic(reader, child, &point);
    if (status == KELLER_OK) *position = keller_geo_to_local(reader->config->origin, point);
    return status;
}

KellerStatus keller_config_read_transmitter(KellerConfigReader *reader, const xmlNode *node)
{
    KellerConfig *config = reader->config;
    if (!keller_config_grow((void **)&config->transmitters, &reader->transmitter_capacity, config->transmitter_count, 1,
                            sizeof *config->transmitters))
        return keller_error_memory(reader->error, sizeof *config->transmitters);
    KellerTransmitter *tx = &config->transmitters[config->transmitter_count++];
    *tx = (KellerTransmitter){.power = 1e-3, .line = keller_xml_line(node)};
    KellerStatus status = keller_config_id(reader, node, &tx->id);
    if (status == KELLER_OK) status = read_station(reader, node, &tx->station);
    if (status == KELLER_OK) status = read_position(reader, node, &tx->station.position);
    const xmlNode *power = keller_config_child(node, "power");
    static const KellerConfigRange range = {0, 1e15, "a power from 0 W to 1e15 W"};
    if (power && status == KELLER_OK) status = keller_config_quantity(reader, power, NULL, "power", &range, &tx->power);
    if (config->sound.speed > 0 && status == KELLER_OK) status = keller_config_read_level(reader, node, tx);
    return status;
}

/* Adds a set of `count` receivers and room for them; the receivers get their set and index. */
static KellerStatus add_set(KellerConfigReader *reader, const xmlNode *node, KellerSetKind kind, size_t count,
                            KellerReceiverSet **set)
{
    KellerConfig *config = reader->config;
    if (count > KELLER_MAX_RECEIVERS - config->receiver_count)
        return keller_config_fail(reader, node, "more than %u receivers in one configuration; expected fewer points",
                                  KELLER_MAX_RECEIVERS);
    if (!keller_config_grow((void **)&config->sets, &reader->set_capacity, config->set_count, 1, sizeof *config->sets))
        return keller_error_memory(reader->error, sizeof *config->sets);
    *set = &config->sets[config->set_count];
    **set = (KellerReceiverSet){.kind = kind, .first = (uint32_t)config->receiver_count, .line = keller_xml_line(node)};
    KellerStatus status = keller_config_id(reader, node, &(*set)->id);
    if (status != KELLER_OK) return status;
    config->set_count++;
    if (!keller_config_grow((void **)&config->receivers, &reader->receiver_capacity, config->receiver_count, count,
                            sizeof *config->receivers))
        return keller_error_memory(reader->error, count * sizeof *config->receivers);
    (*set)->count = (uint32_t)count;
    for (uint32_t i = 0; i < (uint32_t)count; i++)
        config->receivers[config->receiver_count + i] =
            (KellerReceiver){.set = (uint32_t)config->set_count - 1, .index = i};
    config->receiver_count += count;
    return KELLER_OK;
}

KellerStatus keller_config_read_receiver(KellerConfigReader *reader, const xmlNode *node)
{
    KellerStation station;
    KellerStatus status = read_station(reader, node, &station);
    if (status == KELLER_OK) status = read_position(reader, node, &station.position);
    KellerReceiverSet *set = NULL;
    if (status == KELLER_OK) status = add_set(reader, node, KELLER_SET_POINT, 1, &set);
    if (status == KELLER_OK) reader->config->receivers[set->first].station = station;
    return status;
}

KellerStatus keller_config_read_route(KellerConfigReader *reader, const xmlNode *node)
{
    KellerStation station;
    KellerStatus status = read_station(reader, node, &station);
    char *path = NULL;
    if (status == KELLER_OK) status = keller_config_path(reader, node, "file", &path);
    if (status != KELLER_OK) return status;
    KellerVec3 *points = NULL;
    size_t count = 0;
    status = keller_config_read_points(reader, node, path, KELLER_MAX_RECEIVERS - reader->config->receiver_count,
                                       &points, &count);
    KellerReceiverSet *set = NULL;
    if (status == KELLER_OK) status = add_set(reader, node, KELLER_SET_ROUTE, count, &set);
    if (status == KELLER_OK) set->file = path;
    else free(path);
    for (size_t i = 0; i < count && status == KELLER_OK; i++) {
        station.position = points[i];
        reader->config->receivers[set->first + i].station = station;
    }
    free(points);
    return status;
}

/* A cell more is counted where `to` is missed by no more than this part of a step, so that 0.1 m divides 0.3 m.
 * Rounding of (to - from) / step is below 4 units of 2^-53 of a quotient of at most 1e7, 5e-9. */
#define STEP_TOLERANCE 1e-6

/* Cells from a to b, or KELLER_MAX_RECEIVERS + 1 if there are more than that. */
static size_t cells(double a, double b, double step)
{
    double n = floor((b - a) / step + STEP_TOLERANCE);
    return n < KELLER_MAX_RECEIVERS ? (size_t)n + 1 : KELLER_MAX_RECEIVERS + 1u;
}

KellerStatus keller_config_read_grid(KellerConfigReader *reader, const xmlNode *node)
{
    KellerConfig *config = reader->config;
    static const KellerConfigRange step_range = {1e-6, KELLER_MAX_COORDINATE, "a step from 1 um to 1e6 km"};
    const xmlNode *from = keller_config_child(node, "from"), *to = keller_config_child(node, "to");
    double x[2] = {0, 0}, y[2] = {0, 0}, z = NAN, step = 0;
    KellerStation station;
    KellerStatus status = read_station(reader, node, &station);
    for (int i = 0; i < 2 && status == KELLER_OK; i++) {
        status = keller_config_quantity(reader, i ? to : from, "x", "length", &coordinate, &x[i]);
        if (status == KELLER_OK)
            status = keller_config_quantity(reader, i ? to : from, "y", "length", &coordinate, &y[i]);
    }
    if (status == KELLER_OK) status = keller_config_quantity(reader, node, "z", "length", &coordinate, &z);
    if (status == KELLER_OK)
        status = keller_config_quantity(reader, keller_config_child(node, "step"), NULL, "length", &step_range, &step);
    if (status != KELLER_OK) return status;
    if (x[1] < x[0] || y[1] < y[0])
        return keller_config_fail(reader, to,
                                  "<to> of the grid is below <from> in %s; expected the corner with the larger "
                                  "coordinates",
                                  x[1] < x[0] ? "x" : "y");
    size_t nx = cells(x[0], x[1], step), ny = cells(y[0], y[1], step);
    if (nx > KELLER_MAX_RECEIVERS || ny > KELLER_MAX_RECEIVERS ||
        nx * ny > KELLER_MAX_RECEIVERS - config->receiver_count)
        return keller_config_fail(reader, node,
                                  "the grid makes %.3g points, %zu receivers before it; expected at most %u in "
                                  "one configuration: a larger step or a smaller area",
                                  (floor((x[1] - x[0]) / step) + 1) * (floor((y[1] - y[0]) / step) + 1),
                                  config->receiver_count, KELLER_MAX_RECEIVERS);
    KellerReceiverSet *set = NULL;
    status = add_set(reader, node, KELLER_SET_GRID, nx * ny, &set);
    if (status != KELLER_OK) return status;
    set->nx = (uint32_t)nx;
    set->ny = (uint32_t)ny;
    set->x0 = x[0];
    set->y0 = y[0];
    set->z = z;
    set->step = step;
    status = keller_config_read_over(reader, node, set);
    for (size_t i = 0; i < nx * ny; i++) {
        station.position = v3(x[0] + (double)(i % nx) * step, y[0] + (double)(i / nx) * step, z);
        config->receivers[set->first + i].station = station;
    }
    return status;
}
