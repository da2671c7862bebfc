/* The pressure that a path carries: a product of numbers, where keller_path_transfer has matrices. */
#include <math.h>

#include "keller/sound.h"
#include "path/cascade.h"
#include "path/field.h"

bool path_rigid_edge(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, const KellerMedium *media,
                     KellerRigidEdge *edge)
{
    if (scene->sound.edges != KELLER_EDGES_BTM) return false;
    for (uint32_t i = 0; i < path->count; i++) {
        if (path->step[i].kind != KELLER_DIFFRACTION) continue;
        PathEdge only = {i, i, KELLER_NONE, 0};
        KellerWedgeWave wave = path_edge_wave(scene, path, &only, media);
        const KellerWedge *w = &scene->wedges[path->step[i].id];
        double at = v3_dot(v3_sub(path->position[i], w->origin), w->direction), before = 0;
        KellerVec3 last = tx;
        for (uint32_t j = 0; j <= i; j++) {
            before += v3_distance(last, path->position[j]);
            last = path->position[j];
        }
        *edge = keller_rigid_edge(&wave, path->leg[i], path->leg[i + 1], before, path->length - before, at, w->length);
        edge->z1 = path->part[0];
        edge->z2 = path->part[1];
        return true;
    }
    return false;
}

/* The product of what the path meets at faces. */
static double complex reflected(const KellerScene *scene, const KellerPath *path, const KellerMedium *media)
{
    double complex p = 1;
    for (uint32_t i = 0; i < path->count; i++) {
        if (path->step[i].kind != KELLER_REFLECTION) continue;
        const KellerFace *f = &scene->faces[path->step[i].id];
        p *= keller_sound_reflection(&media[f->material], fabs(v3_dot(path->leg[i], f->normal)));
    }
    return p;
}

/* Edges by the uniform theory, with all spreading (1/m): as carry() in field.c does it for waves with two components. Reflections
 * commute with what edges do to a number, so they are left out. */
static double complex diffracted(const KellerScene *scene, const KellerPath *path, const PathEdges *edges, KellerVec3 tx, double k,
                                 const KellerMedium *media)
{
    if (!(edges->weight > 0)) return 0;
    Cascade cascade;
    SoundChain chain;
    SoundRow row;
    double spreading = edges->weight * path_cascade(scene, path, edges, tx, &cascade);
    for (uint32_t number = 0; number < cascade.count; number++) {
        const PathEdge *e = &edges->edge[number];
        KellerWedgeWave wedge = path_edge_wave(scene, path, e, media);
        KellerVec3 in = path->leg[e->begin], out = path->leg[e->end + 1];
        /* of two as one the strip's first edge, whichever comes first on the path */
        uint32_t at = path->step[e->begin].id == e->first ? e->begin : e->end;
        spreading *= path_end_fade(scene, path, at, k * cascade.along[number]);
        if (cascade.count == 1) return spreading * keller_sound_diffraction(&wedge, in, out, cascade.before, cascade.behind, k);
        if (number > 0) in = v3_scale(path_beside_screen(scene, path->step[e->begin].id, v3_scale(in, -1)), -1);
        if (number + 1 < cascade.count) out = path_beside_screen(scene, path->step[e->end].id, out);
        if (number > 0) sound_chain_next(&wedge, in, out, cascade.place[number], &chain);
        else sound_chain_begin(&wedge, in, out, cascade.place[number], k, cascade.count < CHAIN_ROW ? NULL : &row, &chain);
    }
    return cascade.count > 0 ? spreading * sound_chain_pressure(&chain) : spreading;
}

double complex path_pressure_slow(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, double frequency,
                                  const KellerMedium *media, bool edges)
{
    double lambda = scene->sound.speed / frequency, k = 2 * M_PI / lambda, one = path_one_edge * lambda, two = path_two_edges * lambda;
    double complex p = path->weight * pow(10, -keller_sound_loss(&scene->sound, frequency) * path->length / 20);
    PathEdges as_one;
    if (!edges) return p * reflected(scene, path, media);
    path_edges(scene, path, two, &as_one);
    double part = as_one.widest > one ? (two - as_one.widest) / (two - one) : 1;
    double complex field = part * diffracted(scene, path, &as_one, tx, k, media);
    if (part < 1) {
        path_edges(scene, path, one, &as_one);
        field += (1 - part) * diffracted(scene, path, &as_one, tx, k, media);
    }
    return p * reflected(scene, path, media) * field;
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
