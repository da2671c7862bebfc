/* The pressure that a path carries: a product of numbers, where keller_path_transfer has matrices. */
#include <math.h>

#include "keller/sound.h"
#include "path/cascade.h"
#include "path/field.h"

bool path_rigid_edge(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, const KellerMedium *media, KellerRigidEdge *edge)
{
    if (scene->sound.edges != KELLER_EDGES_BTM) return false;
    for (uint32_t i = 0; i < path->count; i++) {
        if (path->step[i].kind != KELLER_DIFFRACTION) continue;
        Cascade cascade;
        path_cascade(scene, path, tx, &cascade);
        const KellerWedge *w = &scene->wedges[path->step[i].id];
        KellerWedgeWave wave = path_wave_at(scene, path->step[i].id, media);
        double at = v3_dot(v3_sub(path->position[i], w->origin), w->direction);
        *edge = keller_rigid_edge(&wave, path->leg[i], path->leg[i + 1], cascade.before[0], cascade.behind[0], at, w->length);
        return true;
    }
    return false;
}

/* The edge-th diffraction of the path, its step i. */
static double complex diffracted(const KellerScene *scene, const KellerPath *path, uint32_t i, const Cascade *cascade, uint32_t edge,
                                 const KellerMedium *media, double k)
{
    KellerWedgeWave wave = path_wave_at(scene, path->step[i].id, media);
    KellerVec3 in = path->leg[i], out = path->leg[i + 1];
    if (edge > 0) in = v3_scale(path_on_one_side(scene, path->step[i].id, v3_scale(in, -1)), -1);
    if (edge + 1 < cascade->count) out = path_on_one_side(scene, path->step[i].id, out);
    return keller_sound_diffraction(&wave, in, out, cascade->before[edge], cascade->behind[edge], k);
}

double complex path_pressure_slow(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, double frequency,
                                  const KellerMedium *media, bool edges)
{
    double k = 2 * M_PI * frequency / scene->sound.speed;
    Cascade cascade;
    double spreading = path_cascade(scene, path, tx, &cascade);
    double complex p = path->weight * (edges ? spreading : 1);
    uint32_t edge = 0;
    for (uint32_t i = 0; i < path->count; i++) {
        if (path->step[i].kind == KELLER_REFLECTION) {
            const KellerFace *f = &scene->faces[path->step[i].id];
            p *= keller_sound_reflection(&media[f->material], fabs(v3_dot(path->leg[i], f->normal)));
        } else if (edges) {
            p *= diffracted(scene, path, i, &cascade, edge, media, k);
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

KellerStatus path_sound_check(const KellerConfig *config, const KellerScene *scene, KellerError *error)
{
    const char *file = config->file ? config->file : "";
    if (config->transmissions > 0)
        return keller_error(error, KELLER_BAD_INPUT, "%s:%d: transmissions=\"%u\": sound that passes through walls is not computed; "
                                                     "expected no transmissions", file, config->paths_line, config->transmissions);
    if (scene->sound.edges != KELLER_EDGES_BTM || config->diffractions == 0) return KELLER_OK;
    if (config->diffractions > 1)
        return keller_error(error, KELLER_BAD_INPUT, "%s:%d: diffraction=\"btm\" knows one edge on a path, and diffractions=\"%u\"; "
                                                     "expected at most 1, or diffraction=\"utd\"",
                            file, config->paths_line, config->diffractions);
    for (size_t w = 0; w < scene->wedge_count; w++)
        for (int j = 0; j < 2; j++) {
            const KellerMaterial *m = &scene->materials[scene->faces[scene->wedges[w].face[j]].material];
            if (m->kind != KELLER_MATERIAL_RIGID || m->scattering > 0)
                return keller_error(error, KELLER_BAD_INPUT, "%s:%d: diffraction=\"btm\" is for rigid wedges, and an edge has a face of "
                                                             "\"%s\"; expected rigid=\"yes\" without scattering, or "
                                                             "diffraction=\"utd\"", file, config->paths_line, m->name);
        }
    return KELLER_OK;
}
