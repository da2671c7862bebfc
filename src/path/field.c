/* The field of an exact path: the two transmitted components are carried through every interaction as vectors. */
#include <math.h>
#include <stdlib.h>

#include "path/cascade.h"
#include "path/field.h"
#include "path/scatter.h"

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

/* Two waves on their way, the transmitted components: behind the first of several edges each is the sum of a chain's parts. */
typedef struct {
    double k, fade;             /* rad/m; of edges that end near by */
    bool chained;               /* behind the first of several edges */
    KellerCVec3 e[2];
    Chain chain;
} Wave;

static void meet_face(const KellerFace *f, KellerInteractionKind kind, KellerVec3 in, const KellerMedium *media, Wave *wave)
{
    KellerCVec3 (*through)(const KellerMedium *, KellerVec3, KellerVec3, double, KellerCVec3) =
        kind == KELLER_REFLECTION ? keller_reflect_field : keller_transmit_field;
    const KellerMedium *medium = &media[f->material];
    if (!wave->chained) {
        for (int j = 0; j < 2; j++) wave->e[j] = through(medium, f->normal, in, wave->k, wave->e[j]);
        return;
    }
    for (int j = 0; j < 2; j++)
        for (int a = 0; a < 4; a++) {
            for (int b = 0; b < (wave->chain.edge.edges > 1 ? 4 : 1); b++)
                wave->chain.whole[j][a][b] = through(medium, f->normal, in, wave->k, wave->chain.whole[j][a][b]);
            wave->chain.rest[j][a] = through(medium, f->normal, in, wave->k, wave->chain.rest[j][a]);
        }
}

static void diffract(const KellerScene *scene, const KellerPath *path, const PathEdge *e, uint32_t number, const Cascade *cascade,
                     const KellerMedium *media, Wave *wave)
{
    KellerWedgeWave wedge = path_edge_wave(scene, path, e, media);
    KellerVec3 in = path->leg[e->begin], out = path->leg[e->end + 1];
    /* of two as one the strip's first edge, whichever comes first on the path */
    uint32_t at = path->step[e->begin].id == e->first ? e->begin : e->end;
    wave->fade *= path_end_fade(scene, path, at, wave->k * cascade->along[number]);
    if (cascade->count == 1) {
        for (int j = 0; j < 2; j++)
            wave->e[j] = keller_diffract_field(&wedge, in, out, cascade->before, cascade->behind, wave->k, wave->e[j]);
        return;
    }
    if (number > 0) in = v3_scale(path_beside_screen(scene, path->step[e->begin].id, v3_scale(in, -1)), -1);
    if (number + 1 < cascade->count) out = path_beside_screen(scene, path->step[e->end].id, out);
    if (number > 0) chain_next(&wedge, in, out, cascade->place[number], &wave->chain);
    else chain_begin(&wedge, in, out, cascade->place[number], wave->k, wave->e, &wave->chain);
    wave->chained = true;
}

/* The transfer matrix but for weight, air and phase; false where it is zero. */
static bool carry(const KellerScene *scene, const KellerPath *path, const PathEdges *edges, KellerVec3 tx, double k,
                  const KellerMedium *media, double complex transfer[4])
{
    if (!(edges->weight > 0)) return false;
    KellerVec3 theta_tx, phi_tx, theta_rx, phi_rx;
    keller_spherical_basis(path->leg[0], &theta_tx, &phi_tx);
    keller_spherical_basis(v3_scale(path->leg[path->count], -1), &theta_rx, &phi_rx);
    Cascade cascade;
    Wave wave = {.k = k, .fade = 1, .e = {complex_vector(theta_tx), complex_vector(phi_tx)}};
    double spreading = edges->weight * path_cascade(scene, path, edges, tx, &cascade);
    uint32_t number = 0;
    for (uint32_t i = 0; i < path->count; i++) {
        const KellerStep *step = &path->step[i];
        if (step->kind == KELLER_DIFFRACTION) {
            diffract(scene, path, &edges->edge[number], number, &cascade, media, &wave);
            i = edges->edge[number++].end;
        } else {
            meet_face(&scene->faces[step->id], step->kind, path->leg[i], media, &wave);
        }
    }
    for (int j = 0; j < 2; j++) {
        KellerCVec3 e = wave.chained ? chain_field(&wave.chain, j) : wave.e[j];
        transfer[0 + j] = spreading * wave.fade * component(e, theta_rx);
        transfer[2 + j] = spreading * wave.fade * component(e, phi_rx);
    }
    return true;
}

/* ---- scattered paths --------------------------------------------------------------------------------------------------- */

/* A part of a path, steps begin .. end - 1. */
static void part_of(const KellerPath *path, uint32_t begin, uint32_t end, double length, KellerPath *part)
{
    part->count = end - begin;
    part->length = length;
    part->weight = 1;
    part->patch = part->part[0] = part->part[1] = 0;
    for (uint32_t i = begin; i < end; i++) {
        part->step[i - begin] = path->step[i];
        part->position[i - begin] = path->position[i];
        part->triangle[i - begin] = path->triangle[i];
        part->free_end[i - begin] = path->free_end[i];
        part->leg[i - begin] = path->leg[i];
    }
    part->leg[end - begin] = path->leg[end];
}

bool path_halves(const KellerPath *path, KellerVec3 tx, KellerPath half[2], uint32_t *at)
{
    if (!(path->patch > 0)) return false;
    uint32_t n = 0;
    double before = v3_distance(tx, path->position[0]);
    for (; path->step[n].kind != KELLER_SCATTERING; n++) before += v3_distance(path->position[n], path->position[n + 1]);
    part_of(path, 0, n, before, &half[0]);
    part_of(path, n + 1, path->count, path->length - before, &half[1]);
    *at = n;
    return true;
}

/* The patch, in step `at`, between the transfer matrices of the two halves. */
static void scatter(const KellerScene *scene, const KellerPath *path, uint32_t at, double k, const KellerMedium *media,
                    const double complex before[4], const double complex behind[4], double complex transfer[4])
{
    const KellerFace *f = &scene->faces[path->step[at].id];
    KellerVec3 in = path->leg[at], out = path->leg[at + 1], theta_in, phi_in, theta_out, phi_out;
    double phase[2];
    patch_phase(path->position[at], phase);
    keller_spherical_basis(v3_scale(in, -1), &theta_in, &phi_in);
    keller_spherical_basis(out, &theta_out, &phi_out);
    for (int j = 0; j < 2; j++) {
        double complex a = before[j], b = before[2 + j];
        KellerCVec3 e = {a * theta_in.x + b * phi_in.x, a * theta_in.y + b * phi_in.y, a * theta_in.z + b * phi_in.z};
        e = keller_scatter_field(&media[f->material], f->normal, in, out, path->patch, phase, k, e);
        double complex p = component(e, theta_out), q = component(e, phi_out);
        transfer[j] = behind[0] * p + behind[1] * q;
        transfer[2 + j] = behind[2] * p + behind[3] * q;
    }
}

void keller_path_transfer(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, double frequency,
                          const KellerMedium *media, double complex transfer[4])
{
    double lambda = KELLER_LIGHT_SPEED / frequency, k = 2 * M_PI / lambda;
    KellerPath half[2];
    uint32_t at;
    if (path_halves(path, tx, half, &at)) {
        double complex there[4], on[4];
        keller_path_transfer(scene, &half[0], tx, frequency, media, there);
        keller_path_transfer(scene, &half[1], path->position[at], frequency, media, on);
        scatter(scene, path, at, k, media, there, on, transfer);
        for (int i = 0; i < 4; i++) transfer[i] *= path->weight * 4 * M_PI / lambda; /* each half has lambda/4 pi */
        return;
    }
    const double one = path_one_edge * lambda, two = path_two_edges * lambda;
    PathEdges edges;
    double complex t[2][4] = {{0}};
    path_edges(scene, path, two, &edges);
    double part = edges.widest > one ? (two - edges.widest) / (two - one) : 1;
    carry(scene, path, &edges, tx, k, media, t[0]);
    if (part < 1) {
        path_edges(scene, path, one, &edges);
        carry(scene, path, &edges, tx, k, media, t[1]);
    }
    double absorbed = pow(10, -keller_air_loss(&scene->air, frequency) * path->length / 20);
    double complex common = path->weight * absorbed * lambda / (4 * M_PI) * cexp(-I * fmod(k * path->length, 2 * M_PI));
    for (int i = 0; i < 4; i++) transfer[i] = common * (part < 1 ? part * t[0][i] + (1 - part) * t[1][i] : t[0][i]);
}
