#include "io/result_tables.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "io/result_sound.h"
#include "keller/wave.h"

enum { BLOCK = 4096, NAME_SIZE = 300 };

void keller_receiver_name(const char *set_id, KellerSetKind kind, uint32_t index, char *name, size_t size)
{
    if (kind == KELLER_SET_POINT) snprintf(name, size, "%s", set_id);
    else snprintf(name, size, "%s[%u]", set_id, index);
}

/* ---- root ------------------------------------------------------------------------------------------------------ */

static KellerStatus write_root(KellerHdf *hdf, const KellerConfig *config, const char *command_line, KellerError *error)
{
    time_t now = time(NULL);
    const char *epoch = getenv("SOURCE_DATE_EPOCH");   /* reproducible-builds.org: the date to claim */
    if (epoch && *epoch) {
        char *end;
        errno = 0;
        long long seconds = strtoll(epoch, &end, 10);
        if (errno || *end || seconds < 0 || seconds > 253402300799)   /* the end of the year 9999 */
            return keller_error(error, KELLER_BAD_INPUT,
                                "SOURCE_DATE_EPOCH is \"%.40s\"; expected seconds since 1970", epoch);
        now = (time_t)seconds;
    }
    struct tm utc;
    char created[40] = "";
    if (gmtime_r(&now, &utc)) strftime(created, sizeof created, "%Y-%m-%dT%H:%M:%SZ", &utc);

    keller_hdf_attribute_text(hdf, hdf->file, "format", "keller");
    keller_hdf_attribute_u4(hdf, hdf->file, "format_version", KELLER_FORMAT_VERSION);
    keller_hdf_attribute_text(hdf, hdf->file, "program_version", KELLER_VERSION);
    keller_hdf_attribute_text(hdf, hdf->file, "created", created);
    keller_hdf_attribute_text(hdf, hdf->file, "domain", config->sound.speed > 0 ? "acoustic" : "rf");
    keller_hdf_attribute_text(hdf, hdf->file, "config_sha256", config->sha256);
    keller_hdf_attribute_text(hdf, hdf->file, "command_line", command_line);
    const char *text = config->text;
    keller_hdf_table(hdf, "/config", hdf->text_type, hdf->text_type, 0, NULL, NULL, &text);
    keller_hdf_table(hdf, "/frequencies", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 1,
                     (hsize_t[]){config->frequency_count}, "Hz", config->frequencies);
    return KELLER_OK;
}

/* ---- stations -------------------------------------------------------------------------------------------------- */

/* Rows of every station column, so that ten million receivers need no copy. */
typedef struct {
    KellerColumn id, position, orientation, velocity;
} StationColumns;

static void open_stations(KellerHdf *hdf, StationColumns *c, const char *folder)
{
    char path[64];
    const hsize_t three[] = {3};
    snprintf(path, sizeof path, "%s/id", folder);
    keller_hdf_column(hdf, &c->id, path, hdf->text_type, hdf->text_type, 0, NULL, NULL);
    snprintf(path, sizeof path, "%s/position", folder);
    keller_hdf_column(hdf, &c->position, path, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 1, three, "m");
    snprintf(path, sizeof path, "%s/orientation", folder);
    keller_hdf_column(hdf, &c->orientation, path, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 1, three, "rad");
    snprintf(path, sizeof path, "%s/velocity", folder);
    keller_hdf_column(hdf, &c->velocity, path, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 1, three, "m/s");
}

static void append_station(KellerHdf *hdf, StationColumns *c, const KellerStation *station)
{
    keller_column_append(hdf, &c->position, &station->position, 1);
    keller_column_append(hdf, &c->orientation, station->orientation, 1);
    keller_column_append(hdf, &c->velocity, &station->velocity, 1);
}

static void close_stations(KellerHdf *hdf, StationColumns *c)
{
    keller_column_close(hdf, &c->id);
    keller_column_close(hdf, &c->position);
    keller_column_close(hdf, &c->orientation);
    keller_column_close(hdf, &c->velocity);
}

static void write_transmitters(KellerHdf *hdf, const KellerConfig *config)
{
    StationColumns columns;
    KellerColumn power;
    open_stations(hdf, &columns, "/transmitters");
    keller_hdf_column(hdf, &power, "/transmitters/power", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 0, NULL, "W");
    for (size_t t = 0; t < config->transmitter_count; ++t) {
        const KellerTransmitter *transmitter = &config->transmitters[t];
        keller_column_append(hdf, &columns.id, &transmitter->id, 1);
        append_station(hdf, &columns, &transmitter->station);
        keller_column_append(hdf, &power, &transmitter->power, 1);
    }
    close_stations(hdf, &columns);
    keller_column_close(hdf, &power);
}

static KellerStatus write_receivers(KellerHdf *hdf, const KellerConfig *config, KellerError *error)
{
    /* The id column buffers pointers, so it is flushed before the block of names is used again. */
    char(*names)[NAME_SIZE] = malloc(BLOCK * sizeof *names);
    char **pointers = malloc(BLOCK * sizeof *pointers);
    if (!names || !pointers) {
        free(names);
        free(pointers);
        return keller_error_memory(error, BLOCK * sizeof *names);
    }
    StationColumns columns;
    KellerColumn set, index;
    open_stations(hdf, &columns, "/receivers");
    keller_hdf_column(hdf, &set, "/receivers/set", H5T_STD_U32LE, H5T_NATIVE_UINT32, 0, NULL, NULL);
    keller_hdf_column(hdf, &index, "/receivers/index", H5T_STD_U32LE, H5T_NATIVE_UINT32, 0, NULL, NULL);
    for (size_t r = 0; r < config->receiver_count; ++r) {
        const KellerReceiver *receiver = &config->receivers[r];
        const KellerReceiverSet *owner = &config->sets[receiver->set];
        append_station(hdf, &columns, &receiver->station);
        keller_column_append(hdf, &set, &receiver->set, 1);
        keller_column_append(hdf, &index, &receiver->index, 1);
        keller_receiver_name(owner->id, owner->kind, receiver->index, names[r % BLOCK], NAME_SIZE);
        pointers[r % BLOCK] = names[r % BLOCK];
        if (r % BLOCK == BLOCK - 1 || r + 1 == config->receiver_count) {
            keller_column_append(hdf, &columns.id, pointers, r % BLOCK + 1);
            keller_column_flush(hdf, &columns.id);
        }
    }
    close_stations(hdf, &columns);
    keller_column_close(hdf, &set);
    keller_column_close(hdf, &index);
    free(names);
    free(pointers);
    return KELLER_OK;
}

static KellerStatus write_sets(KellerHdf *hdf, const KellerConfig *config, KellerError *error)
{
    KellerColumn id, kind, shape;
    keller_hdf_column(hdf, &id, "/sets/id", hdf->text_type, hdf->text_type, 0, NULL, NULL);
    keller_hdf_column(hdf, &kind, "/sets/kind", hdf->set_type, hdf->set_type, 0, NULL, NULL);
    keller_hdf_column(hdf, &shape, "/sets/shape", H5T_STD_U32LE, H5T_NATIVE_UINT32, 1, (hsize_t[]){2}, NULL);
    KellerStatus status = KELLER_OK;
    for (size_t s = 0; s < config->set_count; ++s) {
        const KellerReceiverSet *set = &config->sets[s];
        uint8_t set_kind = (uint8_t)set->kind;
        keller_column_append(hdf, &id, &set->id, 1);
        keller_column_append(hdf, &kind, &set_kind, 1);
        keller_column_append(hdf, &shape, (uint32_t[]){set->ny, set->nx}, 1);
        bool nameable = set->id[0] && strcmp(set->id, ".") != 0 && !strchr(set->id, '/');
        if (set->kind == KELLER_SET_GRID && !nameable && status == KELLER_OK)
            status =
                keller_error(error, KELLER_BAD_INPUT,
                             "%s: the grid's id \"%.100s\" cannot name a group of the result file; expected a name "
                             "without \"/\"",
                             config->file, set->id);
    }
    keller_column_close(hdf, &id);
    keller_column_close(hdf, &kind);
    keller_column_close(hdf, &shape);
    return status;
}

/* ---- materials ------------------------------------------------------------------------------------------------- */

static KellerStatus write_materials(KellerHdf *hdf, const KellerConfig *config, const KellerScene *scene,
                                    KellerError *error)
{
    size_t materials = scene->material_count, frequencies = config->frequency_count, cells = materials * frequencies;
    double *constants = malloc((2 * cells + 2 * materials + 1) * sizeof *constants);
    char **names = malloc((materials + 1) * sizeof *names);
    int8_t *conductor = malloc(materials + 1);
    if (!constants || !names || !conductor) {
        free(constants);
        free(names);
        free(conductor);
        return keller_error_memory(error, (2 * cells + 2 * materials) * sizeof *constants);
    }
    double *permittivity = constants, *conductivity = constants + cells, *thickness = constants + 2 * cells;
    double *scattering = thickness + materials;
    for (size_t i = 0; i < materials; ++i) {
        const KellerMaterial *material = &scene->materials[i];
        names[i] = material->name;
        thickness[i] = material->thickness;
        scattering[i] = material->diffuse.coefficient;
        conductor[i] = material->kind == KELLER_MATERIAL_CONDUCTOR;
        for (size_t f = 0; f < frequencies; ++f) {
            KellerMedium medium;
            size_t at = i * frequencies + f;
            permittivity[at] = conductivity[at] = NAN;   /* outside the table's range: allowed where no face has it */
            if (keller_medium(material, config->frequencies[f], &medium, NULL) != KELLER_OK) continue;
            if (medium.layer_count > 0) continue; /* no one permittivity */
            if (medium.conductor) {
                conductivity[at] = INFINITY;
                continue;
            }
            permittivity[at] = creal(medium.eta);
            /* eta = eps' - j sigma/(w eps0) */
            conductivity[at] = -cimag(medium.eta) * 2 * M_PI * config->frequencies[f] * KELLER_VACUUM_PERMITTIVITY;
        }
    }
    const hsize_t table[] = {materials, frequencies};
    keller_hdf_texts(hdf, "/materials/name", materials, names);
    keller_hdf_table(hdf, "/materials/conductor", hdf->flag_type, hdf->flag_type, 1, table, NULL, conductor);
    keller_hdf_table(hdf, "/materials/permittivity", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 2, table, "1", permittivity);
    keller_hdf_table(hdf, "/materials/conductivity", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 2, table, "S/m", conductivity);
    keller_hdf_table(hdf, "/materials/thickness", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 1, table, "m", thickness);
    keller_hdf_table(hdf, "/materials/scattering", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 1, table, "1", scattering);
    free(constants);
    free(names);
    free(conductor);
    return KELLER_OK;
}

/* ---- scene ----------------------------------------------------------------------------------------------------- */

static void write_wedges(KellerHdf *hdf, const KellerScene *scene, size_t count)
{
    KellerColumn vertices, faces, n;
    const hsize_t two[] = {2};
    keller_hdf_column(hdf, &vertices, "/scene/wedges/vertices", H5T_STD_U32LE, H5T_NATIVE_UINT32, 1, two, NULL);
    keller_hdf_column(hdf, &faces, "/scene/wedges/faces", H5T_STD_U32LE, H5T_NATIVE_UINT32, 1, two, NULL);
    keller_hdf_column(hdf, &n, "/scene/wedges/n", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 0, NULL, "1");
    for (size_t w = 0; w < count; ++w) {
        keller_column_append(hdf, &vertices, scene->wedges[w].vertex, 1);
        keller_column_append(hdf, &faces, scene->wedges[w].face, 1);
        keller_column_append(hdf, &n, &scene->wedges[w].n, 1);
    }
    keller_column_close(hdf, &vertices);
    keller_column_close(hdf, &faces);
    keller_column_close(hdf, &n);
}

static void write_scene(KellerHdf *hdf, const KellerConfig *config, const KellerScene *scene)
{
    bool stored = config->output_scene;
    size_t triangles = stored ? scene->triangle_count : 0;
    const hsize_t vertex_dims[] = {stored ? scene->vertex_count : 0, 3}, triangle_dims[] = {triangles, 3};
    /* SPEC 4 has u2; a scene with more names than that holds gets u4 rather than wrong numbers. */
    hid_t material_type = scene->material_count <= 65536 ? H5T_STD_U16LE : H5T_STD_U32LE;
    hid_t object_type = scene->object_count <= 65536 ? H5T_STD_U16LE : H5T_STD_U32LE;
    keller_hdf_table(hdf, "/scene/vertices", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 2, vertex_dims, "m", scene->vertices);
    keller_hdf_table(hdf, "/scene/triangles", H5T_STD_U32LE, H5T_NATIVE_UINT32, 2, triangle_dims, NULL,
                     scene->triangles);
    keller_hdf_table(hdf, "/scene/face", H5T_STD_U32LE, H5T_NATIVE_UINT32, 1, triangle_dims, NULL,
                     scene->triangle_face);
    keller_hdf_table(hdf, "/scene/object", object_type, H5T_NATIVE_UINT32, 1, triangle_dims, NULL,
                     scene->triangle_object);
    keller_hdf_table(hdf, "/scene/source", H5T_STD_U32LE, H5T_NATIVE_UINT32, 1, triangle_dims, NULL,
                     scene->triangle_source);
    KellerColumn material;
    keller_hdf_column(hdf, &material, "/scene/material", material_type, H5T_NATIVE_UINT32, 0, NULL, NULL);
    for (size_t t = 0; t < triangles; ++t)
        keller_column_append(hdf, &material, &scene->faces[scene->triangle_face[t]].material, 1);
    keller_column_close(hdf, &material);
    keller_hdf_texts(hdf, "/scene/objects", stored ? scene->object_count : 0, scene->objects);
    write_wedges(hdf, scene, stored ? scene->wedge_count : 0);
}

KellerStatus keller_result_tables(KellerHdf *hdf, const KellerConfig *config, const KellerScene *scene,
                                  const char *command_line, KellerError *error)
{
    KellerStatus status = write_root(hdf, config, command_line, error);
    if (status != KELLER_OK) return status;
    bool sound = config->sound.speed > 0;
    write_transmitters(hdf, config);
    if (sound) status = keller_result_sound(hdf, config, error);
    if (status == KELLER_OK) status = write_receivers(hdf, config, error);
    if (status == KELLER_OK) status = write_sets(hdf, config, error);
    if (status == KELLER_OK) status = (sound ? keller_result_surfaces : write_materials)(hdf, config, scene, error);
    if (status != KELLER_OK) return status;
    write_scene(hdf, config, scene);
    keller_hdf_group(hdf, "/coverage");
    keller_hdf_group(hdf, "/statistics");
    return KELLER_OK;
}
