/* A path's pressure without its delay changes slowly with frequency: it is computed at GRID frequencies an octave, interpolated
 * (Catmull and Rom, in the logarithm), turned by the exact delay at each bin, and summed; one inverse transform makes the response,
 * band-limited at half the rate, so delays need not be whole samples. Every bin sums the paths in their order, and an edge's response
 * is added in its turn, so threads change nothing. */
#include "path/response.h"

#include <kissfft/kiss_fftr.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "keller/sound.h"
#include "path/field.h"
#include "path/response_edge.h"
#include "path/tail.h"

enum {
    GRID = 24,
    BLOCK = 64,                 /* paths taken together */
    CHUNK = 4096                /* bins that a thread takes: their phases start anew, whichever thread it is */
};
static const double lowest = 0.02; /* Hz: below it fields are as there. The uniform theory turns to a real limit only where kL is small */

struct ResponsePlan {
    size_t count, size, bins;   /* samples of a response; of the transform, twice as many or more; size/2 + 1 */
    size_t grid_count;
    double *grid;               /* Hz */
    KellerMedium *media;        /* [grid_count][material_count] */
    KellerMedium *octaves;      /* [TAIL_BANDS][material_count]; NULL: no tail */
    double rate;
};

ResponseWeights response_weights(double frequency, size_t grid_count)
{
    double x = frequency > lowest ? GRID * log2(frequency / lowest) : 0;
    size_t i = (size_t)x, last = grid_count - 4;
    double t = x - (double)i;
    size_t first = i > 0 ? i - 1 : 0;
    if (first > last) first = last;
    t += (double)i - (double)first - 1; /* 0 at the second of the four */
    return (ResponseWeights){(uint32_t)first,
                             {(float)(0.5 * t * (-1 + t * (2 - t))), (float)(1 + t * t * (1.5 * t - 2.5)),
                              (float)(0.5 * t * (1 + t * (4 - 3 * t))), (float)(0.5 * t * t * (t - 1))}};
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
    if (!p->grid) {
        keller_error_memory(error, p->grid_count * sizeof *p->grid);
        response_plan_free(p);
        return NULL;
    }
    for (size_t i = 0; i < p->grid_count; i++) p->grid[i] = lowest * exp2((double)i / GRID);
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
    free(p->media);
    free(p->octaves);
    free(p);
}

/* One pair's sum on its way. */
typedef struct {
    const ResponsePlan *plan;
    const KellerScene *scene;
    const KellerStation *tx, *rx;
    const PathList *paths;
    int threads;
    double complex *spectrum;   /* [bins] */
    double complex *slow;       /* [BLOCK][grid_count] */
    double delay[BLOCK];        /* samples; < 0: not for the spectrum */
    float *edges;               /* [count] sum of the edges' responses */
    bool failed;
} Sum;

/* The slow part of one path of a block; an edge of finite length is added at once, in its turn. */
static void take_path(Sum *s, size_t first, size_t i, Piece *piece)
{
    const ResponsePlan *p = s->plan;
    KellerPath path;
    KellerRigidEdge edge;
    path_list_get(s->paths, first + i, &path);
    double complex *slow = s->slow + i * p->grid_count;
    double speed = s->scene->sound.speed, arrives = path.length / speed * p->rate;
    *piece = (Piece){0, 0, NULL};
    s->delay[i] = -1;
    if (arrives >= (double)p->count) return;
    double directed = keller_directivity(&s->tx->directivity, s->tx->orientation, path.leg[0]) *
                      keller_directivity(&s->rx->directivity, s->rx->orientation, v3_scale(path.leg[path.count], -1));
    bool finite = path_rigid_edge(s->scene, &path, s->tx->position, p->media, &edge);
    for (size_t g = 0; g < p->grid_count; g++)
        slow[g] = directed * path_pressure_slow(s->scene, &path, s->tx->position, p->grid[g], p->media + g * s->scene->material_count,
                                                !finite);
    if (!finite) s->delay[i] = arrives;
    else if (!response_edge(&edge, speed, p->rate, p->count, slow, p->grid_count, piece)) {
#pragma omp atomic write
        s->failed = true;
    }
}

static void add_chunk(const Sum *s, size_t count, size_t begin)
{
    const ResponsePlan *p = s->plan;
    ResponseWeights weights[CHUNK];
    size_t n = p->bins - begin < CHUNK ? p->bins - begin : CHUNK;
    for (size_t i = 0; i < n; i++) weights[i] = response_weights((double)(begin + i) * p->rate / (double)p->size, p->grid_count);
    for (size_t k = 0; k < count; k++) {
        if (s->delay[k] < 0) continue;
        double turns = s->delay[k] / (double)p->size; /* a bin */
        double complex turn = cexp(-2 * I * M_PI * fmod(turns * (double)begin, 1)), step = cexp(-2 * I * M_PI * fmod(turns, 1));
        const double complex *slow = s->slow + k * p->grid_count;
        for (size_t i = 0; i < n; i++) {
            s->spectrum[begin + i] += response_value(&weights[i], slow) * turn;
            turn *= step;
        }
    }
}

static void add_block(Sum *s, size_t first, size_t count)
{
#pragma omp parallel for ordered schedule(dynamic, 1) num_threads(s->threads)
    for (size_t i = 0; i < count; i++) {
        Piece piece;
        take_path(s, first, i, &piece);
#pragma omp ordered
        for (size_t j = 0; j < piece.count; j++) s->edges[piece.first + j] += piece.sample[j];
        free(piece.sample);
    }
#pragma omp parallel for schedule(dynamic, 1) num_threads(s->threads)
    for (size_t begin = 0; begin < s->plan->bins; begin += CHUNK) add_chunk(s, count, begin);
}

/* The sum's inverse transform; false: memory. */
static bool to_time(const Sum *s, float *pressure)
{
    const ResponsePlan *p = s->plan;
    kiss_fftr_cfg inverse = kiss_fftr_alloc((int)p->size, 1, NULL, NULL);
    kiss_fft_cpx *bins = malloc(p->bins * sizeof *bins);
    float *signal = malloc(p->size * sizeof *signal);
    bool ready = inverse && bins && signal;
    if (ready) {
        for (size_t i = 0; i < p->bins; i++)
            bins[i] = (kiss_fft_cpx){(float)(creal(s->spectrum[i]) / (double)p->size), (float)(cimag(s->spectrum[i]) / (double)p->size)};
        bins[0].i = bins[p->bins - 1].i = 0; /* a real signal has none; halves of the spectrum meet there */
        kiss_fftri(inverse, bins, signal);
        for (size_t i = 0; i < p->count; i++) pressure[i] = signal[i] + s->edges[i];
    }
    free(inverse);
    free(bins);
    free(signal);
    return ready;
}

KellerStatus response_of(const ResponsePlan *p, const KellerConfig *config, const KellerScene *scene, uint32_t tx, uint32_t rx,
                         const PathList *paths, uint32_t threads, KellerResponse *response, KellerError *error)
{
    Sum s = {.plan = p, .scene = scene, .tx = &config->transmitters[tx].station, .rx = &config->receivers[rx].station, .paths = paths,
             .threads = threads > 0 ? (int)threads : 1, .spectrum = calloc(p->bins, sizeof *s.spectrum),
             .slow = malloc(BLOCK * p->grid_count * sizeof *s.slow), .edges = calloc(p->count, sizeof *s.edges)};
    *response = (KellerResponse){.tx = tx, .rx = rx, .rate = p->rate, .count = p->count, .arrival = INFINITY,
                                 .pressure = malloc(p->count * sizeof *response->pressure)};
    bool ready = s.spectrum && s.slow && s.edges && response->pressure;
    for (size_t i = 0; i < paths->count; i++) response->arrival = fmin(response->arrival, paths->items[i].length / scene->sound.speed);
    if (!isfinite(response->arrival)) response->arrival = 0;
    for (size_t i = 0; i < paths->count && ready && !s.failed; i += BLOCK)
        add_block(&s, i, paths->count - i < BLOCK ? paths->count - i : BLOCK);
    ready = ready && !s.failed && to_time(&s, response->pressure);
    free(s.spectrum);
    free(s.slow);
    free(s.edges);
    if (ready && p->octaves) ready = tail_add(config, scene, p->octaves, response);
    if (ready) return KELLER_OK;
    free(response->pressure);
    free(response->tail);
    response->pressure = response->tail = NULL;
    return keller_error(error, KELLER_FAILED, "out of memory for an impulse response of %zu samples", p->count);
}
