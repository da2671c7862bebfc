/* The field of an exact path: the two transmitted components are carried through every interaction as vectors. */
#include <math.h>
#include <stdlib.h>

#include "path/cascade.h"
#include "path/field.h"

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
            if (used[m] && keller_material_of_sound(scene->materials[m].kind) != (scene->sound.speed > 0))
                status = path_other_domain(&scene->materials[m], scene->sound.speed > 0, error);
            else if (used[m])
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
                            .model = scene->wedge_model};
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

void keller_path_transfer(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, double frequency,
                          const KellerMedium *media, double complex transfer[4])
{
    double lambda = KELLER_LIGHT_SPEED / frequency, k = 2 * M_PI / lambda;
    KellerVec3 theta_tx, phi_tx, theta_rx, phi_rx;
    keller_spherical_basis(path->leg[0], &theta_tx, &phi_tx);
    keller_spherical_basis(v3_scale(path->leg[path->count], -1), &theta_rx, &phi_rx);
    KellerCVec3 e[2] = {complex_vector(theta_tx), complex_vector(phi_tx)};
    Cascade cascade;
    double spreading = path_cascade(scene, path, tx, &cascade);
    uint32_t edge = 0;
    for (uint32_t i = 0; i < path->count; i++) {
        if (path->step[i].kind == KELLER_REFLECTION) {
            const KellerFace *f = &scene->faces[path->step[i].id];
            for (int j = 0; j < 2; j++) e[j] = keller_reflect_field(&media[f->material], f->normal, path->leg[i], k, e[j]);
        } else if (path->step[i].kind == KELLER_TRANSMISSION) {
            const KellerFace *f = &scene->faces[path->step[i].id];
            for (int j = 0; j < 2; j++) e[j] = keller_transmit_field(&media[f->material], f->normal, path->leg[i], k, e[j]);
        } else {
            KellerWedgeWave wave = wave_at(scene, path->step[i].id, media);
            KellerVec3 in = path->leg[i], out = path->leg[i + 1];
            if (edge > 0) in = v3_scale(on_one_side(scene, path->step[i].id, v3_scale(in, -1)), -1);
            if (edge + 1 < cascade.count) out = on_one_side(scene, path->step[i].id, out);
            for (int j = 0; j < 2; j++)
                e[j] = keller_diffract_field(&wave, in, out, cascade.before[edge], cascade.behind[edge], k, e[j]);
            edge++;
        }
    }
    double absorbed = pow(10, -keller_air_loss(&scene->air, frequency) * path->length / 20);
    double complex common = path->weight * absorbed * lambda / (4 * M_PI) * spreading * cexp(-I * fmod(k * path->length, 2 * M_PI));
    for (int j = 0; j < 2; j++) {
        transfer[0 + j] = common * component(e[j], theta_rx);
        transfer[2 + j] = common * component(e[j], phi_rx);
    }
}
