/* The field of an exact path: the two transmitted components are carried through every interaction as vectors. */
#include <math.h>
#include <stdlib.h>

#include "path/cascade.h"

KellerStatus keller_media_table(const KellerScene *scene, size_t frequency_count, const double *frequencies,
                                KellerMedium **media, KellerError *error)
{
    size_t count = frequency_count * scene->material_count;
    bool *used = calloc(scene->material_count + 1, sizeof *used);
    *media = calloc(count + 1, sizeof **media);
    if (!used || !*media) {
        free(used);
        free(*media);
        *media = NULL;
        return keller_error_memory(error, count * sizeof **media);
    }
    for (size_t i = 0; i < scene->face_count; i++) used[scene->faces[i].material] = true;
    KellerStatus status = KELLER_OK;
    for (size_t f = 0; f < frequency_count && status == KELLER_OK; f++)
        for (size_t m = 0; m < scene->material_count && status == KELLER_OK; m++)
            if (used[m])
                status = keller_medium(&scene->materials[m], frequencies[f], *media + f * scene->material_count + m, error);
    free(used);
    if (status != KELLER_OK) {
        free(*media);
        *media = NULL;
    }
    return status;
}

static KellerCVec3 complex_vector(KellerVec3 v) { return (KellerCVec3){v.x, v.y, v.z}; }
static double complex component(KellerCVec3 e, KellerVec3 along) { return e.x * along.x + e.y * along.y + e.z * along.z; }

static KellerWedgeWave wave_at(const KellerScene *scene, uint32_t wedge, const KellerMedium *media)
{
    const KellerWedge *w = &scene->wedges[wedge];
    KellerWedgeWave wave = {.n = w->n, .direction = w->direction, .tangent0 = w->tangent0, .normal0 = w->normal0,
                            .model = scene->wedge_model, .transparent = scene->transmissions >= (w->n < 2 ? 2 : 1)};
    for (int j = 0; j < 2; j++) wave.medium[j] = media[scene->faces[w->face[j]].material];
    return wave;
}

/* Along a screen from one of its rims to another the azimuth is 0 or 2 pi by rounding: the wave is taken to be on the side of
 * the face's normal, which both rims and both directions agree on. */
static KellerVec3 on_one_side(const KellerScene *scene, uint32_t wedge, KellerVec3 outwards)
{
    const double beside = 1e-13; /* rad: far below what changes a field, far above rounding */
    const KellerWedge *w = &scene->wedges[wedge];
    if (w->n < 2 || path_along_face(w, outwards) < 0) return outwards;
    return v3_madd(outwards, scene->faces[w->face[0]].normal, beside);
}

/* Two waves on their way, the transmitted components: behind the first of several edges each is the sum of a chain's parts. */
typedef struct {
    double k, fade;             /* rad/m; of edges that end near by */
    uint32_t edges;             /* of the chain, behind it */
    KellerCVec3 e[2];
    Chain chain;                /* where there are */
} Wave;

static void meet_face(const KellerFace *f, KellerInteractionKind kind, KellerVec3 in, const KellerMedium *media, Wave *wave)
{
    KellerCVec3 (*through)(const KellerMedium *, KellerVec3, KellerVec3, double, KellerCVec3) =
        kind == KELLER_REFLECTION ? keller_reflect_field : keller_transmit_field;
    const KellerMedium *medium = &media[f->material];
    if (wave->edges == 0) {
        for (int j = 0; j < 2; j++) wave->e[j] = through(medium, f->normal, in, wave->k, wave->e[j]);
        return;
    }
    for (int j = 0; j < 2; j++)
        for (int a = 0; a < 4; a++) {
            wave->chain.whole[j][a] = through(medium, f->normal, in, wave->k, wave->chain.whole[j][a]);
            wave->chain.rest[j][a] = through(medium, f->normal, in, wave->k, wave->chain.rest[j][a]);
        }
}

static void diffract(const KellerScene *scene, const KellerPath *path, uint32_t i, const Cascade *cascade,
                     const KellerMedium *media, Wave *wave)
{
    KellerWedgeWave wedge = wave_at(scene, path->step[i].id, media);
    KellerVec3 in = path->leg[i], out = path->leg[i + 1];
    wave->fade *= path_end_fade(scene, path, i, wave->k * cascade->along[wave->edges]);
    if (cascade->count == 1) {
        for (int j = 0; j < 2; j++)
            wave->e[j] = keller_diffract_field(&wedge, in, out, cascade->before, cascade->behind, wave->k, wave->e[j]);
        return;
    }
    ChainPlace place = cascade->place[wave->edges];
    if (wave->edges > 0) in = v3_scale(on_one_side(scene, path->step[i].id, v3_scale(in, -1)), -1);
    if (wave->edges + 1 < cascade->count) out = on_one_side(scene, path->step[i].id, out);
    if (wave->edges > 0) chain_next(&wedge, in, out, place, &wave->chain);
    else chain_begin(&wedge, in, out, place, wave->k, wave->e, &wave->chain);
    wave->edges++;
}

void keller_path_transfer(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, double frequency,
                          const KellerMedium *media, double complex transfer[4])
{
    double lambda = KELLER_LIGHT_SPEED / frequency, k = 2 * M_PI / lambda;
    KellerVec3 theta_tx, phi_tx, theta_rx, phi_rx;
    keller_spherical_basis(path->leg[0], &theta_tx, &phi_tx);
    keller_spherical_basis(v3_scale(path->leg[path->count], -1), &theta_rx, &phi_rx);
    Cascade cascade;
    Wave wave = {.k = k, .fade = 1, .e = {complex_vector(theta_tx), complex_vector(phi_tx)}};
    double spreading = path_cascade(scene, path, tx, &cascade);
    for (uint32_t i = 0; i < path->count; i++) {
        const KellerStep *step = &path->step[i];
        if (step->kind == KELLER_DIFFRACTION)
            diffract(scene, path, i, &cascade, media, &wave);
        else
            meet_face(&scene->faces[step->id], step->kind, path->leg[i], media, &wave);
    }
    if (cascade.count > 1)
        for (int j = 0; j < 2; j++) wave.e[j] = chain_field(&wave.chain, j);
    double absorbed = pow(10, -keller_air_loss(&scene->air, frequency) * path->length / 20);
    double complex common = path->weight * wave.fade * absorbed * lambda / (4 * M_PI) * spreading * cexp(-I * fmod(k * path->length, 2 * M_PI));
    for (int j = 0; j < 2; j++) {
        transfer[0 + j] = common * component(wave.e[j], theta_rx);
        transfer[2 + j] = common * component(wave.e[j], phi_rx);
    }
}
