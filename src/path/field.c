/* The field of an exact path, and what antennas make of it. */
#include <math.h>
#include <stdlib.h>

#include "path/carry.h"
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

static double complex component(KellerCVec3 e, KellerVec3 along) { return e.x * along.x + e.y * along.y + e.z * along.z; }

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

/* ---- two edges as one, or by and by as two ---------------------------------------------------------------------------- */

/* The path's wave with edges of strips as one, and as two; part[i] is the share of each. */
typedef struct {
    PathWave wave[2];
    double part[2];
    double complex common;      /* weight, air, phase, lambda/4 pi */
} Waves;

static void find_waves(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, double frequency, const KellerMedium *media,
                       Waves *w)
{
    double lambda = KELLER_LIGHT_SPEED / frequency, k = 2 * M_PI / lambda;
    const double one = path_one_edge * lambda, two = path_two_edges * lambda;
    double absorbed = pow(10, -keller_air_loss(&scene->air, frequency) * path->length / 20);
    w->common = path->weight * absorbed * lambda / (4 * M_PI) * cexp(-I * fmod(k * path->length, 2 * M_PI));
    w->part[0] = 1;
    w->part[1] = 0;
    w->wave[0] = path_wave(scene, path, two, tx, k, media);
    if (!(w->wave[0].edges.widest > one)) return;
    w->part[0] = (two - w->wave[0].edges.widest) / (two - one);
    w->part[1] = 1 - w->part[0];
    w->wave[1] = path_wave(scene, path, one, tx, k, media);
}

static void transfer_of(const Waves *w, double complex transfer[4])
{
    double complex t[2][4] = {{0}};
    path_carry(&w->wave[0], t[0]);
    if (w->part[1] > 0) path_carry(&w->wave[1], t[1]);
    for (int i = 0; i < 4; i++)
        transfer[i] = w->common * (w->part[1] > 0 ? w->part[0] * t[0][i] + w->part[1] * t[1][i] : t[0][i]);
}

void keller_path_transfer(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, double frequency,
                          const KellerMedium *media, double complex transfer[4])
{
    double lambda = KELLER_LIGHT_SPEED / frequency;
    KellerPath half[2];
    uint32_t at;
    Waves waves;
    if (path_halves(path, tx, half, &at)) {
        double complex there[4], on[4];
        keller_path_transfer(scene, &half[0], tx, frequency, media, there);
        keller_path_transfer(scene, &half[1], path->position[at], frequency, media, on);
        scatter(scene, path, at, 2 * M_PI / lambda, media, there, on, transfer);
        for (int i = 0; i < 4; i++) transfer[i] *= path->weight * 4 * M_PI / lambda; /* each half has lambda/4 pi */
    } else {
        find_waves(scene, path, tx, frequency, media, &waves);
        transfer_of(&waves, transfer);
    }
}

/* ---- antennas ------------------------------------------------------------------------------------------------------------ */

/* The pattern as a vector, array included. */
static KellerCVec3 pattern_towards(const KellerStation *s, KellerVec3 d, double k)
{
    KellerVec3 theta, phi;
    double complex f[2], array = keller_array_factor(&s->antenna, s->orientation, d, k);
    keller_antenna_field(&s->antenna, s->orientation, d, &f[0], &f[1]);
    keller_spherical_basis(d, &theta, &phi);
    f[0] *= array;
    f[1] *= array;
    return (KellerCVec3){f[0] * theta.x + f[1] * phi.x, f[0] * theta.y + f[1] * phi.y, f[0] * theta.z + f[1] * phi.z};
}

/* The components along theta-hat and phi-hat of d of the pattern at a ray turned by `angle`, turned back to d. */
static void pattern_beside(const PathWave *w, int end, const KellerStation *s, KellerVec3 d, double angle, double complex f[2])
{
    KellerVec3 basis[2], there = path_turned(w, end, angle, d);
    keller_spherical_basis(d, &basis[0], &basis[1]);
    if (s->antenna.pattern == KELLER_ANTENNA_ISOTROPIC) {
        /* the same in all directions, whatever its direction of the field: the array alone changes */
        double complex array = keller_array_factor(&s->antenna, s->orientation, there, w->k);
        keller_antenna_field(&s->antenna, s->orientation, d, &f[0], &f[1]);
        for (int i = 0; i < 2; i++) f[i] *= array;
        return;
    }
    KellerCVec3 e = pattern_towards(s, there, w->k);
    for (int i = 0; i < 2; i++) f[i] = component(e, path_turned(w, end, angle, basis[i]));
}

/* What the antenna's change from ray to ray adds at one end: g is the pattern at the other. */
static double complex slope_gain(const Waves *waves, int end, const KellerStation *s, const double complex g[2])
{
    if (s->antenna.pattern == KELLER_ANTENNA_ISOTROPIC && s->antenna.element_count == 0) return 0;
    double complex sum = 0;
    for (int one = 0; one < 2 && waves->part[one] > 0; one++) {
        const PathWave *w = &waves->wave[one];
        if (!(w->spreading > 0) || w->edges.count == 0) continue;
        KellerVec3 d = end == 0 ? w->path->leg[0] : v3_scale(w->path->leg[w->path->count], -1);
        double h = w->end[end].zone;
        double complex more[2], less[2], f[2], slope[4];
        pattern_beside(w, end, s, d, h, more);
        pattern_beside(w, end, s, d, -h, less);
        for (int i = 0; i < 2; i++) f[i] = (more[i] - less[i]) / (2 * sin(h));
        double all = hypot(cabs(more[0]), cabs(more[1])) + hypot(cabs(less[0]), cabs(less[1]));
        if (!(all > 0)) continue;
        path_carry_slope(w, end, 2 * h * hypot(cabs(f[0]), cabs(f[1])) / all, slope);
        for (int i = 0; i < 2; i++)
            for (int j = 0; j < 2; j++)
                sum += waves->part[one] * slope[2 * i + j] * (end == 0 ? g[i] * f[j] : f[i] * g[j]);
    }
    return waves->common * sum;
}

double complex path_gain(const KellerScene *scene, const KellerPath *path, const KellerStation *tx, const KellerStation *rx,
                         double frequency, const KellerMedium *media, double complex transfer[4])
{
    double k = 2 * M_PI * frequency / KELLER_LIGHT_SPEED;
    KellerVec3 out = path->leg[0], in = v3_scale(path->leg[path->count], -1);
    double complex t[2], r[2], at_tx = keller_array_factor(&tx->antenna, tx->orientation, out, k);
    double complex at_rx = keller_array_factor(&rx->antenna, rx->orientation, in, k);
    keller_antenna_field(&tx->antenna, tx->orientation, out, &t[0], &t[1]);
    keller_antenna_field(&rx->antenna, rx->orientation, in, &r[0], &r[1]);
    Waves waves;
    if (path->patch > 0) {
        keller_path_transfer(scene, path, tx->position, frequency, media, transfer);
    } else {
        find_waves(scene, path, tx->position, frequency, media, &waves);
        transfer_of(&waves, transfer);
    }
    double complex gain = r[0] * (transfer[0] * t[0] + transfer[1] * t[1]) + r[1] * (transfer[2] * t[0] + transfer[3] * t[1]);
    gain *= at_tx * at_rx;
    if (path->patch > 0 || waves.wave[0].edges.count == 0) return gain;
    for (int i = 0; i < 2; i++) {
        t[i] *= at_tx;
        r[i] *= at_rx;
    }
    return gain + slope_gain(&waves, 0, tx, r) + slope_gain(&waves, 1, rx, t);
}
