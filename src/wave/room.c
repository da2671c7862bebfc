/* Room acoustical parameters from an impulse response. */
#include "keller/response.h"

#include <kissfft/kiss_fftr.h>
#include <math.h>
#include <stdlib.h>
#include "keller/sound.h"

size_t keller_room_bands(double rate, double middle[KELLER_ROOM_BANDS])
{
    size_t count = 0;
    for (int i = -4; i <= 3; i++) {
        double f = keller_band_middle(1, 1000 * pow(10, 0.3 * i));
        if (f * pow(10, 0.15) < 0.5 * rate) middle[count++] = f;
    }
    return count;
}

/* Seconds for 60 dB, by regression over the decay (dB, falling from 0) between two levels; NaN where it does not reach the lower. */
static double decay_time(size_t count, const double *decay, double rate, double from, double to)
{
    /* what the record lacks after its end, were it to go on as its last tenth does, must be 10 dB below the lower level */
    size_t tenth = count / 10;
    double n = 0, x = 0, y = 0, xx = 0, xy = 0;
    size_t i = 0;
    while (i < count && decay[i] > from) i++;
    for (; i < count && decay[i] >= to; i++) {
        double t = (double)i / rate;
        n++;
        x += t;
        y += decay[i];
        xx += t * t;
        xy += t * decay[i];
    }
    if (i >= count || n < 2 || !isfinite(decay[i])) return NAN;
    double slope = (n * xy - x * y) / (n * xx - x * x);
    if (!(slope < 0)) return NAN;
    double last = tenth > 0 ? pow(10, decay[count - tenth] / 10) * rate / (double)tenth : INFINITY; /* energy a second there */
    return last * 10 / (-slope * log(10)) <= pow(10, (to - 10) / 10) ? -60 / slope : NAN;
}

KellerRoom keller_room_of_energy(size_t count, const double *energy, double rate, double free_field)
{
    KellerRoom room = {NAN, NAN, NAN, NAN, NAN, NAN, NAN};
    double *decay = malloc((count + 1) * sizeof *decay), total = 0, early[2] = {0, 0};
    if (!decay) return room;
    for (size_t i = count; i-- > 0;) decay[i] = total += energy[i];
    if (total > 0) {
        static const double limit[2] = {0.05, 0.08}; /* s */
        for (int j = 0; j < 2; j++) {
            size_t at = (size_t)ceil(limit[j] * rate);
            early[j] = at < count ? total - decay[at] : NAN; /* the record ends before */
        }
        for (size_t i = 0; i < count; i++) decay[i] = 10 * log10(decay[i] / total);
        room.edt = decay_time(count, decay, rate, 0, -10);
        room.t20 = decay_time(count, decay, rate, -5, -25);
        room.t30 = decay_time(count, decay, rate, -5, -35);
        room.c50 = 10 * log10(early[0] / (total - early[0]));
        room.c80 = 10 * log10(early[1] / (total - early[1]));
        room.d50 = early[0] / total;
        room.g = 10 * log10(total / free_field);
    }
    free(decay);
    return room;
}

/* The filter's magnitude at f: a Butterworth band-pass of the third order between the band's edges. */
static double band_magnitude(double f, double middle)
{
    double width = pow(10, 0.15) - pow(10, -0.15), x = f > 0 ? (f / middle - middle / f) / width : INFINITY;
    return 1 / sqrt(1 + pow(x, 6));
}

bool keller_room(const KellerResponse *response, size_t bands, const double *middle, KellerRoom *rooms)
{
    size_t first = (size_t)(response->arrival * response->rate), room_left = 2 * response->count;
    int n = kiss_fftr_next_fast_size_real((int)room_left);
    size_t half = (size_t)n / 2, size = (size_t)n;
    kiss_fftr_cfg forward = kiss_fftr_alloc(n, 0, NULL, NULL), inverse = kiss_fftr_alloc(n, 1, NULL, NULL);
    float *signal = calloc(size, sizeof *signal);
    kiss_fft_cpx *spectrum = malloc((half + 1) * sizeof *spectrum), *filtered = malloc((half + 1) * sizeof *filtered);
    double *energy = malloc((response->count + 1) * sizeof *energy);
    bool ready = forward && inverse && signal && spectrum && filtered && energy;
    if (ready) {
        for (size_t i = 0; i < response->count; i++) signal[i] = response->pressure[i];
        kiss_fftr(forward, signal, spectrum);
    }
    for (size_t b = 0; b < bands && ready; b++) {
        double impulse = 0; /* energy of a filtered unit impulse, by Parseval */
        for (size_t i = 0; i <= half; i++) {
            double w = band_magnitude((double)i * response->rate / n, middle[b]), scale = w / n;
            filtered[i].r = (float)(spectrum[i].r * scale);
            filtered[i].i = (float)(spectrum[i].i * scale);
            impulse += (i == 0 || i == half ? 1 : 2) * w * w / n;
        }
        kiss_fftri(inverse, filtered, signal);
        /* the filter spreads what arrives first to both sides; what lies before it counts with it */
        double before = 0;
        for (size_t i = 0; i < size; i++) {
            double e = (double)signal[i] * signal[i];
            if (i < first || i >= response->count + (size - response->count) / 2) before += e;
            else if (i < response->count) energy[i - first] = e;
        }
        if (first < response->count) energy[0] += before;
        rooms[b] = keller_room_of_energy(first < response->count ? response->count - first : 0, energy, response->rate,
                                         0.01 * impulse);
    }
    free(forward);
    free(inverse);
    free(signal);
    free(spectrum);
    free(filtered);
    free(energy);
    return ready;
}
