/* A path's pressure without its delay changes slowly with frequency: it is computed at GRID frequencies an octave, interpolated
 * (Catmull and Rom, in the logarithm), turned by the exact delay at each bin, and summed; one inverse transform makes the response,
 * band-limited at half the rate, so delays need not be whole samples. An edge of finite length (BTM) does change quickly, because its
 * ends have delays of their own: it is computed in the time domain, OVER times finer, and transformed. */
#include "path/response.h"

#include <kissfft/kiss_fftr.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "keller/sound.h"
#include "path/field.h"
#include "path/tail.h"

enum { GRID = 24, OVER = 8 };
static const double lowest = 0.02; /* Hz: below it fields are as there. The uniform theory turns to a real limit only where kL is small */

/* Where a bin lies: the four frequencies from `first` on, and their weights. */
typedef struct {
    uint32_t first;
    float weight[4];
} Bin;

struct ResponsePlan {
    size_t count, size, bins;   /* samples of a response; of the transform, twice as many or more; size/2 + 1 */
    size_t grid_count;
    double *grid;               /* Hz */
    KellerMedium *media;        /* [grid_count][material_count] */
    KellerMedium *octaves;      /* [TAIL_BANDS][material_count]; NULL: no tail */
    Bin *bin;
    double rate;
};

static void place_bin(const ResponsePlan *p, double frequency, Bin *bin)
{
    double x = frequency > p->grid[0] ? GRID * log2(frequency / p->grid[0]) : 0;
    size_t i = (size_t)x, last = p->grid_count - 4;
    double t = x - (double)i;
    size_t first = i > 0 ? i - 1 : 0;
    if (first > last) first = last;
    t += (double)i - (double)first - 1; /* 0 at the second of the four */
    bin->first = (uint32_t)first;
    bin->weight[0] = (float)(0.5 * t * (-1 + t * (2 - t)));
    bin->weight[1] = (float)(1 + t * t * (1.5 * t - 2.5));
    bin->weight[2] = (float)(0.5 * t * (1 + t * (4 - 3 * t)));
    bin->weight[3] = (float)(0.5 * t * t * (t - 1));
}

ResponsePlan *response_plan(const KellerConfig *config, const KellerScene *scene, KellerError *error)
{
    ResponsePlan *p = calloc(1, sizeof *p);
    double samples = ceil(config->response_rate * config->response_duration);
    if (!p) {
        keller_error_memory(error, sizeof *p);
        return NULL;
    }
    p->rate = config->response_rate;
    p->count = (size_t)samples;
    p->size = (size_t)kiss_fftr_next_fast_size_real((int)(2 * p->count));
    p->bins = p->size / 2 + 1;
    p->grid_count = (size_t)ceil(GRID * log2(0.5 * p->rate / lowest)) + 4;
    p->grid = malloc(p->grid_count * sizeof *p->grid);
    p->bin = malloc(p->bins * sizeof *p->bin);
    if (!p->grid || !p->bin) {
        keller_error_memory(error, p->bins * sizeof *p->bin);
        response_plan_free(p);
        return NULL;
    }
    for (size_t i = 0; i < p->grid_count; i++) p->grid[i] = lowest * exp2((double)i / GRID);
    for (size_t i = 0; i < p->bins; i++) place_bin(p, (double)i * p->rate / (double)p->size, &p->bin[i]);
    double octaves[TAIL_BANDS];
    for (int b = 0; b < TAIL_BANDS; b++) octaves[b] = tail_band(b);
    KellerStatus status = keller_media_table(scene, p->grid_count, p->grid, &p->media, error);
    if (status == KELLER_OK && config->response_volume > 0)
        status = keller_media_table(scene, TAIL_BANDS, octaves, &p->octaves, error);
    if (status == KELLER_OK) return p;
    response_plan_free(p);
    return NULL;
}

void response_plan_free(ResponsePlan *p)
{
    if (!p) return;
    free(p->grid);
    free(p->bin);
    free(p->media);
    free(p->octaves);
    free(p);
}

typedef struct {
    double complex *spectrum;   /* [bins] */
    double complex *slow;       /* [grid_count] */
    kiss_fftr_cfg fine;         /* OVER * size, for edges in the time domain; NULL: none so far */
    double *fine_response;      /* [OVER * size] */
    float *fine_signal;
    kiss_fft_cpx *fine_spectrum; /* [OVER * size/2 + 1] */
    kiss_fftr_cfg inverse;
    kiss_fft_cpx *bins;
    float *signal;
} Work;

static bool fine_ready(Work *w, const ResponsePlan *p)
{
    size_t n = OVER * p->size;
    if (w->fine) return true;
    w->fine = kiss_fftr_alloc((int)n, 0, NULL, NULL);
    w->fine_response = malloc(n * sizeof *w->fine_response);
    w->fine_signal = malloc(n * sizeof *w->fine_signal);
    w->fine_spectrum = malloc((n / 2 + 1) * sizeof *w->fine_spectrum);
    return w->fine && w->fine_response && w->fine_signal && w->fine_spectrum;
}

static void work_free(Work *w)
{
    free(w->spectrum);
    free(w->slow);
    free(w->fine);
    free(w->fine_response);
    free(w->fine_signal);
    free(w->fine_spectrum);
    free(w->inverse);
    free(w->bins);
    free(w->signal);
}

/* The edge's transform into fine_spectrum; its onset is at sample 1 of the fine signal. */
static void transform_edge(Work *w, const ResponsePlan *p, const KellerRigidEdge *edge, double speed)
{
    size_t n = OVER * p->size;
    double rate = OVER * p->rate, start = keller_btm_shortest(edge) / speed - 1 / rate;
    memset(w->fine_response, 0, n * sizeof *w->fine_response);
    keller_btm_response(edge, speed, rate, start, n, w->fine_response);
    for (size_t i = 0; i < n; i++) w->fine_signal[i] = (float)(w->fine_response[i] / rate);
    kiss_fftr(w->fine, w->fine_signal, w->fine_spectrum);
}

/* The transform of keller_btm's phase-free value at a bin: triangles and onset undone. */
static double complex edge_at(const Work *w, size_t bin, size_t size)
{
    double x = M_PI * (double)bin / (double)(OVER * size), triangle = x > 0 ? pow(sin(x) / x, 2) : 1;
    return (w->fine_spectrum[bin].r + I * w->fine_spectrum[bin].i) * cexp(2 * I * x) / triangle;
}

static bool add_path(const ResponsePlan *p, const KellerScene *scene, const KellerPath *path, KellerVec3 tx, double scale,
                     Work *w)
{
    double speed = scene->sound.speed;
    KellerRigidEdge edge;
    bool finite = path_rigid_edge(scene, path, tx, p->media, &edge);
    double delay = (finite ? keller_btm_shortest(&edge) : path->length) / speed;
    if (finite && !fine_ready(w, p)) return false;
    if (finite) transform_edge(w, p, &edge, speed);
    for (size_t g = 0; g < p->grid_count; g++)
        w->slow[g] = scale * path_pressure_slow(scene, path, tx, p->grid[g], p->media + g * scene->material_count, !finite);
    double complex turn = 1, step = cexp(-2 * I * M_PI * fmod(delay * p->rate / (double)p->size, 1));
    for (size_t i = 0; i < p->bins; i++) {
        const Bin *b = &p->bin[i];
        const double complex *s = &w->slow[b->first];
        double complex value = b->weight[0] * s[0] + b->weight[1] * s[1] + b->weight[2] * s[2] + b->weight[3] * s[3];
        w->spectrum[i] += value * turn * (finite ? edge_at(w, i, p->size) : 1);
        turn *= step;
    }
    return true;
}

static bool sum_paths(const ResponsePlan *p, const KellerConfig *config, const KellerScene *scene, const PathList *paths,
                      Work *w,
                      KellerResponse *response)
{
    const KellerStation *t = &config->transmitters[response->tx].station, *r = &config->receivers[response->rx].station;
    double speed = scene->sound.speed;
    response->arrival = INFINITY;
    for (size_t i = 0; i < paths->count; i++) {
        KellerPath path;
        path_list_get(paths, i, &path);
        response->arrival = fmin(response->arrival, path.length / speed);
        if (path.length / speed * p->rate >= (double)p->count) continue;
        double directed = keller_directivity(&t->directivity, t->orientation, path.leg[0]) *
                          keller_directivity(&r->directivity, r->orientation, v3_scale(path.leg[path.count], -1));
        if (!add_path(p, scene, &path, t->position, directed, w)) return false;
    }
    if (!isfinite(response->arrival)) response->arrival = 0;
    return true;
}

KellerStatus response_of(const ResponsePlan *p, const KellerConfig *config, const KellerScene *scene, uint32_t tx, uint32_t rx,
                         const PathList *paths, KellerResponse *response, KellerError *error)
{
    Work w = {.spectrum = calloc(p->bins, sizeof *w.spectrum), .slow = malloc(p->grid_count * sizeof *w.slow),
              .inverse = kiss_fftr_alloc((int)p->size, 1, NULL, NULL), .bins = malloc(p->bins * sizeof *w.bins),
              .signal = malloc(p->size * sizeof *w.signal)};
    *response = (KellerResponse){.tx = tx, .rx = rx, .rate = p->rate, .count = p->count,
                                 .pressure = malloc(p->count * sizeof *response->pressure)};
    bool ready = w.spectrum && w.slow && w.inverse && w.bins && w.signal && response->pressure &&
                 sum_paths(p, config, scene, paths, &w, response);
    if (ready) {
        for (size_t i = 0; i < p->bins; i++)
            w.bins[i] = (kiss_fft_cpx){(float)(creal(w.spectrum[i]) / (double)p->size),
                                       (float)(cimag(w.spectrum[i]) / (double)p->size)};
        w.bins[0].i = w.bins[p->bins - 1].i = 0; /* a real signal has none; halves of the spectrum meet there */
        kiss_fftri(w.inverse, w.bins, w.signal);
        memcpy(response->pressure, w.signal, p->count * sizeof *response->pressure);
        if (p->octaves) ready = tail_add(config, scene, p->octaves, response);
    }
    work_free(&w);
    if (ready) return KELLER_OK;
    free(response->pressure);
    free(response->tail);
    response->pressure = response->tail = NULL;
    return keller_error(error, KELLER_FAILED, "out of memory for an impulse response of %zu samples", p->count);
}
