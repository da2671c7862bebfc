/* Energy of a diffuse field: an impulse that would have int p^2 dt = 1 at 1 m on the source's axis puts 4 pi/(Q V rho c) J into each
 * cubic metre, so that p^2 = 4 pi c/(Q V) e^{-delta t}, delta = c (-S ln(1 - alpha)/(4 V) + m). By the time t a ray has met n surfaces
 * with the probability of a Poisson distribution of mean c t S/(4 V) (Kuttruff, Room Acoustics, section 5.2); the computed paths hold
 * those of n <= N and what scattering left of them. docs/acoustics.md. */
#include "path/tail.h"

#include <kissfft/kiss_fftr.h>
#include <math.h>
#include <stdlib.h>

#include "keller/sound.h"

double tail_band(int band) { return 1000 * pow(10, 0.3 * (band - 6)); }

typedef struct {
    double surface;             /* m^2, both sides of sheets */
    double absorption[TAIL_BANDS], scattering; /* means over it */
} Room;

static double triangle_area(const KellerScene *scene, size_t t)
{
    const uint32_t *v = scene->triangles[t];
    const KellerVec3 *p = scene->vertices;
    KellerVec3 a = v3_sub(p[v[1]], p[v[0]]), b = v3_sub(p[v[2]], p[v[0]]);
    return 0.5 * v3_norm(v3_cross(a, b));
}

/* Share of the energy that a diffuse field loses at the surface: Paris' integral of 2 cos (1 - |R|^2) over the cosine, scattering not
 * counted as lost. */
static double random_incidence(const KellerMedium *medium, double scattering)
{
    if (scattering >= 1) return 0;
    enum { STEPS = 64 };
    double sum = 0;
    for (int i = 0; i < STEPS; i++) {
        double cosine = (i + 0.5) / STEPS;
        double complex r = keller_sound_reflection(medium, cosine);
        sum += 2 * cosine * (1 - creal(r * conj(r)) / (1 - scattering)) / STEPS;
    }
    return sum;
}

static bool measure(const KellerScene *scene, const KellerMedium *media, Room *room)
{
    bool *sheet = calloc(scene->face_count + 1, sizeof *sheet);
    if (!sheet) return false;
    *room = (Room){0};
    for (size_t w = 0; w < scene->wedge_count; w++)
        if (scene->wedges[w].face[0] == scene->wedges[w].face[1]) sheet[scene->wedges[w].face[0]] = true;
    for (size_t t = 0; t < scene->triangle_count; t++) {
        uint32_t face = scene->triangle_face[t], m = scene->faces[face].material;
        double area = triangle_area(scene, t) * (sheet[face] ? 2 : 1), scattering = scene->materials[m].scattering;
        room->surface += area;
        room->scattering += area * scattering;
        for (int b = 0; b < TAIL_BANDS; b++)
            room->absorption[b] += area * random_incidence(&media[(size_t)b * scene->material_count + m], scattering);
    }
    for (int b = 0; b < TAIL_BANDS && room->surface > 0; b++) room->absorption[b] /= room->surface;
    if (room->surface > 0) room->scattering /= room->surface;
    free(sheet);
    return true;
}

/* Share of the energy at a mean number of reflections that paths of up to `order` specular ones lack. */
static double lacking(double mean, uint32_t order, double scattering)
{
    double probability = exp(-mean), held = 0;
    for (uint32_t n = 0; n <= order; n++) {
        held += probability * pow(1 - scattering, n);
        probability *= mean / (n + 1);
    }
    return held < 1 ? 1 - held : 0;
}

/* PCG's output over a linear congruential step; two make a normal variable by Box and Muller. */
static double uniform(uint64_t *state)
{
    uint64_t old = *state;
    *state = old * 6364136223846793005u + 1442695040888963407u;
    uint32_t shifted = (uint32_t)(((old >> 18) ^ old) >> 27), turn = (uint32_t)(old >> 59);
    return ((shifted >> turn | shifted << ((32 - turn) & 31)) + 0.5) * 0x1p-32;
}

static double normal(uint64_t *state)
{
    double r = sqrt(-2 * log(uniform(state)));
    return r * cos(2 * M_PI * uniform(state));
}

/* The bands' shares add up in power to 1 at every frequency: a quarter of a cosine on each side. */
static double band_share(int band, double frequency)
{
    double x = frequency > 0 ? log10(frequency / tail_band(band)) / 0.3 : -INFINITY;
    if ((band == 0 && x < 0) || (band == TAIL_BANDS - 1 && x > 0)) return 1;
    return fabs(x) < 1 ? cos(0.5 * M_PI * x) : 0;
}

/* The noise of one band under its envelope, added to the tail. */
static void add_band(const KellerConfig *config, const KellerScene *scene, const Room *room, int band, double factor,
                     const float *noise, KellerResponse *r)
{
    double c = scene->sound.speed, hits = c * room->surface / (4 * config->response_volume);
    double alpha = fmin(room->absorption[band], 0.999999);
    double air = keller_sound_loss(&scene->sound, tail_band(band)) * log(10) / 10;
    double delta = -hits * log(1 - alpha) + c * air;
    uint32_t order = config->reflections < config->interactions ? config->reflections : config->interactions;
    double start = 4 * M_PI * c * factor / config->response_volume / r->rate;
    for (size_t i = (size_t)ceil(r->arrival * r->rate); i < r->count; i++) {
        double t = (double)i / r->rate;
        double square = start * exp(-delta * t) * lacking(hits * t, order, room->scattering);
        r->tail[i] += (float)(noise[i] * sqrt(square));
    }
}

bool tail_add(const KellerConfig *config, const KellerScene *scene, const KellerMedium *media, KellerResponse *r)
{
    Room room;
    int n = kiss_fftr_next_fast_size_real((int)(2 * r->count));
    size_t half = (size_t)n / 2;
    kiss_fftr_cfg forward = kiss_fftr_alloc(n, 0, NULL, NULL), inverse = kiss_fftr_alloc(n, 1, NULL, NULL);
    float *noise = malloc((size_t)n * sizeof *noise);
    kiss_fft_cpx *spectrum = malloc((half + 1) * sizeof *spectrum), *filtered = malloc((half + 1) * sizeof *filtered);
    r->tail = calloc(r->count, sizeof *r->tail);
    bool ready = forward && inverse && noise && spectrum && filtered && r->tail && measure(scene, media, &room);
    const KellerStation *t = &config->transmitters[r->tx].station, *e = &config->receivers[r->rx].station;
    double factor = 1 / (keller_directivity_factor(&t->directivity) * keller_directivity_factor(&e->directivity));
    uint64_t state = ((uint64_t)r->tx << 32 | r->rx) * 0x9e3779b97f4a7c15u + 0x853c49e6748fea9bu;
    for (int i = 0; i < n && ready; i++) noise[i] = (float)normal(&state);
    if (ready) kiss_fftr(forward, noise, spectrum);
    for (int b = 0; b < TAIL_BANDS && ready; b++) {
        for (size_t i = 0; i <= half; i++) {
            float share = (float)(band_share(b, (double)i * r->rate / n) / n);
            filtered[i] = (kiss_fft_cpx){spectrum[i].r * share, spectrum[i].i * share};
        }
        kiss_fftri(inverse, filtered, noise);
        add_band(config, scene, &room, b, factor, noise, r);
    }
    for (size_t i = 0; i < r->count && ready; i++) r->pressure[i] += r->tail[i];
    free(forward);
    free(inverse);
    free(noise);
    free(spectrum);
    free(filtered);
    return ready;
}
