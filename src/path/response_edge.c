/* An edge's spectrum changes quickly, because its ends have delays of their own: its response is computed in the time domain, OVER times
 * finer than asked for, transformed, multiplied with the rest of the path, and brought back. */
#include "path/response_edge.h"

#include <kissfft/kiss_fftr.h>
#include <math.h>
#include <stdlib.h>

#include "path/response.h"

enum {
    OVER = 8,
    ROOM = 8192                 /* samples for what a band limit spreads to both sides: 1/(pi ROOM/2) of a pulse is left there */
};

/* How long the edge is heard after its line's shortest way, s. */
static double heard(const KellerRigidEdge *e, double speed)
{
    double longest = 0;
    for (int i = 0; i < 2; i++) {
        double z = i ? e->z2 : e->z1;
        longest = fmax(longest, hypot(e->r_in, z - e->z_in) + hypot(e->r, z - e->z));
    }
    return (longest - keller_btm_shortest(e)) / speed;
}

typedef struct {
    size_t fine_count, size;    /* samples of the fine transform, of the other one */
    kiss_fftr_cfg fine, back;
    double *h;
    float *signal;              /* [fine_count] */
    kiss_fft_cpx *spectrum;     /* [fine_count/2 + 1] */
} Work;

static bool work_open(Work *w, size_t size)
{
    w->size = (size_t)kiss_fftr_next_fast_size_real((int)size);
    w->fine_count = OVER * w->size;
    w->fine = kiss_fftr_alloc((int)w->fine_count, 0, NULL, NULL);
    w->back = kiss_fftr_alloc((int)w->size, 1, NULL, NULL);
    w->h = calloc(w->fine_count, sizeof *w->h);
    w->signal = malloc(w->fine_count * sizeof *w->signal);
    w->spectrum = malloc((w->fine_count / 2 + 1) * sizeof *w->spectrum);
    return w->fine && w->back && w->h && w->signal && w->spectrum;
}

static void work_close(Work *w)
{
    free(w->fine);
    free(w->back);
    free(w->h);
    free(w->signal);
    free(w->spectrum);
}

/* From the edge's fine response, whose onset is at its sample 1, to that of the path `shift` samples later. */
static void transform(Work *w, double rate, double shift, const double complex *slow, size_t grid_count)
{
    size_t half = w->size / 2;
    double fine_rate = OVER * rate;
    for (size_t i = 0; i < w->fine_count; i++) w->signal[i] = (float)(w->h[i] / fine_rate);
    kiss_fftr(w->fine, w->signal, w->spectrum);
    for (size_t i = 0; i <= half; i++) {
        ResponseWeights weights = response_weights((double)i * rate / (double)w->size, grid_count);
        /* triangles and the onset's sample undone */
        double x = M_PI * (double)i / (double)w->fine_count, triangle = x > 0 ? pow(sin(x) / x, 2) : 1;
        double complex value = response_value(&weights, slow) * cexp(I * (2 * x - 2 * M_PI * (double)i * shift / (double)w->size));
        value *= (w->spectrum[i].r + I * w->spectrum[i].i) / (triangle * (double)w->size);
        w->spectrum[i] = (kiss_fft_cpx){(float)creal(value), (float)cimag(value)};
    }
    w->spectrum[0].i = w->spectrum[half].i = 0;
    kiss_fftri(w->back, w->spectrum, w->signal);
}

bool response_edge(const KellerRigidEdge *edge, double speed, double rate, size_t count, const double complex *slow, size_t grid_count,
                   Piece *piece)
{
    double start = keller_btm_shortest(edge) / speed * rate; /* samples */
    *piece = (Piece){0, 0, NULL};
    if (start >= (double)count) return true;
    /* ROOM before the onset, as much behind it and what is heard until the end of the response */
    double first = fmax(0, floor(start) - ROOM), lasts = fmin(heard(edge, speed) * rate, (double)count - start);
    Work w = {0};
    bool ready = work_open(&w, (size_t)(2 * ROOM + lasts) + 2);
    if (ready) {
        double fine_rate = OVER * rate;
        size_t fine = (size_t)(OVER * (lasts + 1)) + 2; /* what comes later is beyond the response */
        keller_btm_response(edge, speed, fine_rate, start / rate - 1 / fine_rate, fine < w.fine_count ? fine : w.fine_count, w.h);
        transform(&w, rate, start - first, slow, grid_count);
        piece->first = (size_t)first;
        piece->count = w.size < count - piece->first ? w.size : count - piece->first;
        piece->sample = malloc((piece->count + 1) * sizeof *piece->sample);
        ready = piece->sample != NULL;
        for (size_t i = 0; i < piece->count && ready; i++) piece->sample[i] = w.signal[i];
    }
    work_close(&w);
    return ready;
}
