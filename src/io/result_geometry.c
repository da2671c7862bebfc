#include "io/result_geometry.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "io/result_data.h"
#include "io/result_tables.h"
#include "io/sha256.h"
#include "path/internal.h"

enum { LETS_THROUGH = 1, SCATTERS = 2, BLOCK = 4096, DIGEST = 65, PARTS = 7 };

/* ---- the scene as a digest ------------------------------------------------------------------------------------------ */

/* Of the parts' digests: whatever the path solution knows of the model follows from these. NULL: memory. */
static char *scene_digest(const KellerScene *scene)
{
    size_t W = scene->wedge_count;
    uint32_t (*edges)[4] = malloc((W + 1) * sizeof *edges);
    double *openings = malloc((W + 1) * sizeof *openings);
    char *digest = malloc(DIGEST), parts[PARTS][DIGEST];
    if (edges && openings && digest) {
        for (size_t w = 0; w < W; ++w) {
            const KellerWedge *wedge = &scene->wedges[w];
            const uint32_t edge[4] = {wedge->vertex[0], wedge->vertex[1], wedge->face[0], wedge->face[1]};
            memcpy(edges[w], edge, sizeof edge);
            openings[w] = wedge->n;
        }
        const struct { const void *data; size_t size; } list[PARTS] = {
            {scene->vertices, scene->vertex_count * sizeof *scene->vertices},
            {scene->triangles, scene->triangle_count * sizeof *scene->triangles},
            {scene->triangle_face, scene->triangle_count * sizeof *scene->triangle_face},
            {scene->triangle_sheets, scene->triangle_count * sizeof *scene->triangle_sheets},
            {edges, W * sizeof *edges}, {openings, W * sizeof *openings}, {&scene->contact, sizeof scene->contact}};
        for (int i = 0; i < PARTS; ++i) keller_sha256(list[i].data, list[i].size, parts[i]);
        keller_sha256(parts, sizeof parts, digest);
    } else {
        free(digest);
        digest = NULL;
    }
    free(edges);
    free(openings);
    return digest;
}

static uint8_t traits_of(const KellerScene *scene, uint32_t face)
{
    bool scatters = scene->materials[scene->faces[face].material].diffuse.coefficient > 0;
    return (uint8_t)((path_lets_through(scene, face) ? LETS_THROUGH : 0) | (scatters ? SCATTERS : 0));
}

/* ---- orders ------------------------------------------------------------------------------------------------------------ */

/* True where all of an edge diffracts, by Biot, Tolstoy and Medwin. */
static uint32_t whole_edges(const KellerConfig *c) { return c->sound.speed > 0 && c->sound.edges == KELLER_EDGES_BTM; }

enum { ORDERS = 7 };

/* The numbers that must be equal, under the names of the configuration's attributes. */
static void orders_of(const KellerConfig *c, uint32_t order[ORDERS], const char *name[ORDERS])
{
    const uint32_t values[ORDERS] = {c->reflections, c->diffractions, c->transmissions, c->interactions, c->scattering, c->with_scattering,
                                     whole_edges(c)};
    static const char *const names[ORDERS] = {"reflections", "diffractions", "transmissions", "interactions", "scattering",
                                              "with-scattering", "whole_edges"};
    memcpy(order, values, sizeof values);
    memcpy(name, names, sizeof names);
}

KellerStatus keller_result_geometry(KellerHdf *hdf, const KellerConfig *config, const KellerScene *scene, KellerError *error)
{
    char *digest = scene_digest(scene), path[64];
    if (!digest) return keller_error_memory(error, scene->wedge_count * 24);
    keller_hdf_table(hdf, "/geometry/scene_sha256", hdf->text_type, hdf->text_type, 0, NULL, NULL, &digest);
    free(digest);
    KellerColumn traits;
    keller_hdf_column(hdf, &traits, "/geometry/face_traits", H5T_STD_U8LE, H5T_NATIVE_UINT8, 0, NULL, NULL);
    for (uint32_t f = 0; f < scene->face_count; ++f) keller_column_append(hdf, &traits, (uint8_t[]){traits_of(scene, f)}, 1);
    keller_column_close(hdf, &traits);
    uint32_t order[ORDERS], holds_paths = config->output_paths;
    const char *name[ORDERS];
    orders_of(config, order, name);
    for (int i = 0; i < ORDERS; ++i) {
        snprintf(path, sizeof path, "/geometry/%s", name[i]);
        keller_hdf_table(hdf, path, H5T_STD_U32LE, H5T_NATIVE_UINT32, 0, NULL, NULL, &order[i]);
    }
    keller_hdf_table(hdf, "/geometry/holds_paths", H5T_STD_U32LE, H5T_NATIVE_UINT32, 0, NULL, NULL, &holds_paths);
    keller_hdf_table(hdf, "/geometry/patch", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 0, NULL, "m", &config->patch);
    keller_hdf_table(hdf, "/geometry/dynamic_range", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 0, NULL, "dB", &config->dynamic_range);
    return KELLER_OK;
}

/* ---- the same again? ------------------------------------------------------------------------------------------------ */

static KellerStatus read_one(KellerReader *reader, const char *path, KellerCell cell, void *value, KellerError *error)
{
    return keller_reader_box(reader, path, cell, 0, NULL, NULL, value, error);
}

static KellerStatus differs(KellerError *error, const KellerConfig *c, int line, const char *file, const char *what)
{
    return keller_error(error, KELLER_BAD_INPUT, "%s:%d: %s in %s; expected what that result was computed for", c->file, line, what, file);
}

static KellerStatus check_orders(KellerReader *reader, const char *file, const KellerConfig *c, KellerError *error)
{
    uint32_t order[ORDERS], there;
    const char *name[ORDERS];
    char path[64], what[120];
    double patch = 0;
    orders_of(c, order, name);
    for (int i = 0; i < ORDERS; ++i) {
        snprintf(path, sizeof path, "/geometry/%s", name[i]);
        KellerStatus status = read_one(reader, path, KELLER_CELL_U4, &there, error);
        if (status != KELLER_OK) return status;
        if (there == order[i]) continue;
        if (i == ORDERS - 1) snprintf(what, sizeof what, "diffraction is \"%s\" here and \"%s\"", order[i] ? "btm" : "utd", there ? "btm" : "utd");
        else snprintf(what, sizeof what, "%s is %u here and %u", name[i], order[i], there);
        return differs(error, c, c->paths_line, file, what);
    }
    KellerStatus status = read_one(reader, "/geometry/patch", KELLER_CELL_F8, &patch, error);
    if (status != KELLER_OK || c->scattering == 0 || patch == c->patch) return status;
    snprintf(what, sizeof what, "patch is %.15g m here and %.15g m", c->patch, patch);
    return differs(error, c, c->paths_line, file, what);
}

/* A difference of rounding is one: paths are to be those of a run of this configuration to the last bit. */
/* Cells that have no ground to lie over have no z. */
static bool same_place(KellerVec3 a, KellerVec3 b) { return a.x == b.x && a.y == b.y && (a.z == b.z || (isnan(a.z) && isnan(b.z))); }

static KellerStatus moved(KellerError *error, const KellerConfig *c, int line, const char *file, const char *name, KellerVec3 here,
                          KellerVec3 there)
{
    char what[500];
    snprintf(what, sizeof what, "%.200s is at (%.15g, %.15g, %.15g) m here and at (%.15g, %.15g, %.15g) m", name, here.x, here.y, here.z,
             there.x, there.y, there.z);
    return differs(error, c, line, file, what);
}

static KellerStatus check_transmitters(KellerReader *reader, const char *file, const KellerConfig *c, KellerError *error)
{
    const KellerResultInfo *info = keller_reader_info(reader);
    char what[120];
    if (info->transmitter_count != c->transmitter_count) {
        snprintf(what, sizeof what, "there are %zu transmitters here and %llu", c->transmitter_count,
                 (unsigned long long)info->transmitter_count);
        return differs(error, c, c->transmitter_count > 0 ? c->transmitters[0].line : c->scene_line, file, what);
    }
    for (size_t t = 0; t < c->transmitter_count; ++t)
        if (!same_place(c->transmitters[t].station.position, info->transmitter_positions[t]))
            return moved(error, c, c->transmitters[t].line, file, c->transmitters[t].id, c->transmitters[t].station.position,
                         info->transmitter_positions[t]);
    return KELLER_OK;
}

static KellerStatus check_sets(const KellerReader *reader, const char *file, const KellerConfig *c, KellerError *error)
{
    const KellerResultInfo *info = keller_reader_info(reader);
    char what[300];
    int line = c->set_count > 0 ? c->sets[0].line : c->scene_line;
    if (info->set_count != c->set_count || info->receiver_count != c->receiver_count) {
        snprintf(what, sizeof what, "there are %zu receivers in %zu sets here and %llu in %llu", c->receiver_count, c->set_count,
                 (unsigned long long)info->receiver_count, (unsigned long long)info->set_count);
        return differs(error, c, line, file, what);
    }
    for (size_t s = 0; s < c->set_count; ++s) {
        const KellerReceiverSet *set = &c->sets[s];
        if (info->set_kinds[s] == set->kind && info->set_shapes[s][0] == set->ny && info->set_shapes[s][1] == set->nx) continue;
        snprintf(what, sizeof what, "set \"%.100s\" is of another kind or shape than set number %zu", set->id, s + 1);
        return differs(error, c, set->line, file, what);
    }
    return KELLER_OK;
}

/* Cells over a surface have no z before the scene is there: they are looked at once more then. */
static KellerStatus check_receivers(KellerReader *reader, const char *file, const KellerConfig *c, bool draped, KellerError *error)
{
    KellerVec3 *there = malloc(BLOCK * sizeof *there);
    if (!there) return keller_error_memory(error, BLOCK * sizeof *there);
    KellerStatus status = check_sets(reader, file, c, error);
    for (size_t first = 0; first < c->receiver_count && status == KELLER_OK; first += BLOCK) {
        size_t n = c->receiver_count - first < BLOCK ? c->receiver_count - first : BLOCK;
        status = keller_reader_rows(reader, "/receivers/position", KELLER_CELL_F8, 3, first, n, there, error);
        for (size_t i = 0; i < n && status == KELLER_OK; ++i) {
            const KellerReceiver *r = &c->receivers[first + i];
            const KellerReceiverSet *set = &c->sets[r->set];
            char name[300];
            if (!draped && set->draped) there[i].z = r->station.position.z;
            if (same_place(r->station.position, there[i])) continue;
            keller_receiver_name(set->id, set->kind, r->index, name, sizeof name);
            status = moved(error, c, set->line, file, name, r->station.position, there[i]);
        }
    }
    free(there);
    return status;
}

/* Dropped paths are lost: what they would be here nobody knows, but at least none is missing that is asked for by name. */
static KellerStatus check_dropped(KellerReader *reader, const char *file, const KellerConfig *c, KellerDropped *dropped, KellerError *error)
{
    const char *const columns[4] = {"/statistics/dropped_paths", "/statistics/dropped_bound", "/statistics/reused_dropped_paths",
                                    "/statistics/reused_dropped_bound"};
    double value[4], range = 0;
    KellerStatus status = read_one(reader, "/geometry/dynamic_range", KELLER_CELL_F8, &range, error);
    for (int i = 0; i < 4 && status == KELLER_OK; ++i) status = read_one(reader, columns[i], KELLER_CELL_F8, &value[i], error);
    if (status != KELLER_OK) return status;
    dropped->paths = value[0] + value[2];
    dropped->ratio = pow(10, value[1] / 20) + pow(10, value[3] / 20);
    if (!(dropped->paths > 0) || c->dynamic_range <= range) return KELLER_OK;
    return keller_error(error, KELLER_BAD_INPUT,
                        "%s:%d: dynamic-range=\"%.15g dB\" asks for paths that %s dropped, %.0f at %.15g dB; expected at most that, or a "
                        "result that dropped none", c->file, c->paths_line, c->dynamic_range, file, dropped->paths, range);
}

KellerStatus keller_geometry_check(KellerReader *reader, const char *file, const KellerConfig *c, KellerDropped *dropped,
                                   KellerError *error)
{
    const KellerResultInfo *info = keller_reader_info(reader);
    uint32_t holds_paths = 0;
    if (!keller_reader_has(reader, "/geometry/holds_paths"))
        return keller_error(error, KELLER_BAD_INPUT, "%s: is of a version of keller (%.40s) that did not store all of its paths' geometry; "
                            "expected a result of this one", file, info->program_version);
    KellerStatus status = read_one(reader, "/geometry/holds_paths", KELLER_CELL_U4, &holds_paths, error);
    if (status == KELLER_OK && !holds_paths)
        status = keller_error(error, KELLER_BAD_INPUT, "%s: holds no paths; expected a run with <output paths=\"yes\"/>", file);
    bool sound = strcmp(info->domain, "acoustic") == 0;
    if (status == KELLER_OK && sound != (c->sound.speed > 0))
        status = differs(error, c, c->line, file, sound ? "domain is \"rf\" here and \"acoustic\"" : "domain is \"acoustic\" here and \"rf\"");
    if (status == KELLER_OK) status = check_orders(reader, file, c, error);
    if (status == KELLER_OK) status = check_transmitters(reader, file, c, error);
    if (status == KELLER_OK) status = check_receivers(reader, file, c, false, error);
    return status == KELLER_OK ? check_dropped(reader, file, c, dropped, error) : status;
}

/* The line that says what a material of the scene is: of a name that the scene's own file defines, that of <scene>. */
static int line_of_material(const KellerConfig *c, const char *name)
{
    for (size_t m = 0; m < c->material_count; ++m)
        if (strcmp(c->materials[m].name, name) == 0) return c->material_lines[m];
    return c->scene_line;
}

static KellerStatus check_traits(KellerReader *reader, const char *file, const KellerConfig *c, const KellerScene *scene,
                                 KellerError *error)
{
    uint8_t there[BLOCK], counts = (uint8_t)((c->transmissions > 0 ? LETS_THROUGH : 0) | (c->scattering > 0 ? SCATTERS : 0));
    char what[300];
    KellerStatus status = KELLER_OK;
    for (size_t first = 0; first < scene->face_count && counts && status == KELLER_OK; first += BLOCK) {
        size_t n = scene->face_count - first < BLOCK ? scene->face_count - first : BLOCK;
        status = keller_reader_rows(reader, "/geometry/face_traits", KELLER_CELL_U1, 1, first, n, there, error);
        for (size_t i = 0; i < n && status == KELLER_OK; ++i) {
            uint8_t here = traits_of(scene, (uint32_t)(first + i)), other = (uint8_t)((here ^ there[i]) & counts);
            if (!other) continue;
            const char *name = scene->materials[scene->faces[first + i].material].name;
            const char *does = other & LETS_THROUGH ? "let waves through" : "scatter";
            bool now = (here & other) != 0;
            snprintf(what, sizeof what, "material \"%.100s\" %s %s here and %s", name, now ? "does" : "does not", does,
                     now ? "does not" : "does");
            status = differs(error, c, line_of_material(c, name), file, what);
        }
    }
    return status;
}

KellerStatus keller_geometry_check_scene(KellerReader *reader, const char *file, const KellerConfig *c, const KellerScene *scene,
                                         KellerError *error)
{
    char *digest = scene_digest(scene), *there = NULL;
    if (!digest) return keller_error_memory(error, scene->wedge_count * 24);
    KellerStatus status = keller_reader_text(reader, "/geometry/scene_sha256", &there, error);
    if (status == KELLER_OK && strcmp(digest, there) != 0)
        status = differs(error, c, c->scene_line, file,
                         "the scene has other triangles, faces or wedges (faces part where materials do) than the one");
    free(digest);
    free(there);
    for (size_t s = 0; s < c->set_count && status == KELLER_OK; ++s)
        if (c->sets[s].draped) {
            status = check_receivers(reader, file, c, true, error);
            break;
        }
    return status == KELLER_OK ? check_traits(reader, file, c, scene, error) : status;
}
