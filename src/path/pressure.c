/* The pressure that a path carries: a product of numbers, where keller_path_transfer has matrices. */
#include <math.h>

#include "keller/sound.h"
#include "path/cascade.h"
#include "path/field.h"

static KellerWedgeWave wedge_at(const KellerScene *scene, uint32_t wedge, const KellerMedium *media)
{
    const KellerWedge *w = &scene->wedges[wedge];
    return (KellerWedgeWave){.n = w->n, .direction = w->direction, .tangent0 = w->tangent0, .normal0 = w->normal0,
                             .medium = {media[scene->faces[w->face[0]].material], media[scene->faces[w->face[1]].material]},
                             .model = scene->wedge_model};
}

/* The distances (m) before and behind each edge for its coefficient; returns the spreading (1/m) that the coefficients do not give. */
static double tube_of(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, double before[], double behind[],
                      uint32_t *count)
{
    PathEdges edges;
    Cascade cascade;
    path_edges(scene, path, 0, &edges);
    double spreading = path_cascade(scene, path, &edges, tx, &cascade);
    *count = cascade.count;
    if (cascade.count == 1) {
        before[0] = cascade.before;
        behind[0] = cascade.behind;
        return spreading;
    }
    for (uint32_t i = 0; i < cascade.count; i++) { /* each coefficient makes good for the wave that ends at its boundary */
        before[i] = behind[i] = 2 * cascade.place[i].distance;
        spreading *= 2 * sqrt(cascade.place[i].distance);
    }
    return spreading;
}

bool path_rigid_edge(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, const KellerMedium *media,
                     KellerRigidEdge *edge)
{
    if (scene->sound.edges != KELLER_EDGES_BTM) return false;
    double before[KELLER_MAX_BENDS] = {0}, behind[KELLER_MAX_BENDS] = {0};
    uint32_t count;
    for (uint32_t i = 0; i < path->count; i++) {
        if (path->step[i].kind != KELLER_DIFFRACTION) continue;
        tube_of(scene, path, tx, before, behind, &count);
        const KellerWedge *w = &scene->wedges[path->step[i].id];
        KellerWedgeWave wave = wedge_at(scene, path->step[i].id, media);
        double at = v3_dot(v3_sub(path->position[i], w->origin), w->direction);
        *edge = keller_rigid_edge(&wave, path->leg[i], path->leg[i + 1], before[0], behind[0], at, w->length);
        return true;
    }
    return false;
}

/* Along a screen from one rim to another a ray is on either side by rounding: both rims put it on that of the face's normal. */
static KellerVec3 beside_screen(const KellerScene *scene, uint32_t wedge, KellerVec3 outwards)
{
    const double angle = 1e-13; /* rad: far below what changes a field, far above rounding */
    const KellerWedge *w = &scene->wedges[wedge];
    bool along = w->n == 2 && path_along_face(w, outwards) >= 0;
    return along ? v3_madd(outwards, scene->faces[w->face[0]].normal, angle) : outwards;
}

double complex path_pressure_slow(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, double frequency,
                                  const KellerMedium *media, bool edges)
{
    double k = 2 * M_PI * frequency / scene->sound.speed, before[KELLER_MAX_BENDS] = {0}, behind[KELLER_MAX_BENDS] = {0};
    uint32_t count, edge = 0;
    double spreading = tube_of(scene, path, tx, before, behind, &count);
    double complex p = path->weight * (edges ? spreading : 1);
    for (uint32_t i = 0; i < path->count; i++) {
        uint32_t id = path->step[i].id;
        KellerVec3 in = path->leg[i], out = path->leg[i + 1];
        if (path->step[i].kind == KELLER_REFLECTION) {
            const KellerFace *f = &scene->faces[id];
            p *= keller_sound_reflection(&media[f->material], fabs(v3_dot(in, f->normal)));
        } else if (edges) {
            KellerWedgeWave wave = wedge_at(scene, id, media);
            if (edge > 0) in = v3_scale(beside_screen(scene, id, v3_scale(in, -1)), -1);
            if (edge + 1 < count) out = beside_screen(scene, id, out);
            p *= keller_sound_diffraction(&wave, in, out, before[edge], behind[edge], k);
            edge++;
        }
    }
    return p * pow(10, -keller_sound_loss(&scene->sound, frequency) * path->length / 20);
}

double complex path_pressure(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, double frequency,
                             const KellerMedium *media)
{
    double k = 2 * M_PI * frequency / scene->sound.speed;
    KellerRigidEdge edge;
    bool finite = path_rigid_edge(scene, path, tx, media, &edge);
    double complex p = path_pressure_slow(scene, path, tx, frequency, media, !finite) * (finite ? keller_btm(&edge, k) : 1);
    double way = finite ? keller_btm_shortest(&edge) : path->length; /* they differ where the path goes by an edge's end */
    return p * cexp(-I * fmod(k * way, 2 * M_PI));
}

KellerStatus path_other_domain(const KellerMaterial *material, bool sound, KellerError *error)
{
    return keller_error(error, KELLER_BAD_INPUT,
                        "material \"%s\" says what it does to %s; expected a <material name=\"%s\"> with %s",
                        material->name, sound ? "radio waves, and the domain is acoustic" : "sound, and the domain is rf",
                        material->name, sound ? "absorption=\"...\", impedance=\"...\" or rigid=\"yes\""
                                              : "itu=\"...\", permittivity=\"...\" or conductor=\"perfect\"");
}

KellerStatus path_sound_check(const KellerConfig *config, const KellerScene *scene, KellerError *error)
{
    const char *file = config->file ? config->file : "";
    if (config->transmissions > 0)
        return keller_error(error, KELLER_BAD_INPUT,
                            "%s:%d: transmissions=\"%u\": sound that passes through walls is not computed; "
                                                     "expected no transmissions", file, config->paths_line, config->transmissions);
    if (scene->sound.edges != KELLER_EDGES_BTM || config->diffractions == 0) return KELLER_OK;
    if (config->diffractions > 1)
        return keller_error(error, KELLER_BAD_INPUT,
                            "%s:%d: diffraction=\"btm\" knows one edge on a path, and diffractions=\"%u\"; "
                                                     "expected at most 1, or diffraction=\"utd\"",
                            file, config->paths_line, config->diffractions);
    for (size_t w = 0; w < scene->wedge_count; w++)
        for (int j = 0; j < 2; j++) {
            const KellerMaterial *m = &scene->materials[scene->faces[scene->wedges[w].face[j]].material];
            if (m->kind != KELLER_MATERIAL_RIGID || m->scattering > 0)
                return keller_error(error, KELLER_BAD_INPUT,
                                    "%s:%d: diffraction=\"btm\" is for rigid wedges, and an edge has a face of "
                                                             "\"%s\"; expected rigid=\"yes\" without scattering, or "
                                                             "diffraction=\"utd\"", file, config->paths_line, m->name);
        }
    return KELLER_OK;
}
