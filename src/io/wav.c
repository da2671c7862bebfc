#include "io/wav.h"

#include <math.h>
#include <sndfile.h>
#include <stdbool.h>
#include <stdlib.h>

KellerStatus keller_wav_write(const char *file, const char *shown, size_t count, const float *samples, double rate,
                              double *scale,
                              KellerError *error)
{
    float largest = 0, *scaled = NULL;
    for (size_t i = 0; i < count; i++) {
        if (!isfinite(samples[i]))
            return keller_error(error, KELLER_BAD_INPUT,
                                "%s: sample %zu of the response is not finite; expected a complete response",
                                shown, i);
        largest = fmaxf(largest, fabsf(samples[i]));
    }
    *scale = largest > 1 ? (1 - 0x1p-24) / (double)largest : 1;
    if (largest > 1) {
        scaled = malloc(count * sizeof *scaled);
        if (!scaled) return keller_error_memory(error, count * sizeof *scaled);
        for (size_t i = 0; i < count; i++) scaled[i] = (float)(samples[i] * *scale);
    }
    SF_INFO info = {.samplerate = (int)rate, .channels = 1, .format = SF_FORMAT_WAV | SF_FORMAT_FLOAT};
    SNDFILE *wav = sf_open(file, SFM_WRITE, &info);
    bool written = false;
    if (wav) {
        /* the chunk of peaks holds the time of day, and files of one response should be the same */
        sf_command(wav, SFC_SET_ADD_PEAK_CHUNK, NULL, SF_FALSE);
        written = sf_write_float(wav, scaled ? scaled : samples, (sf_count_t)count) == (sf_count_t)count;
        written = sf_close(wav) == 0 && written;
    }
    free(scaled);
    return written ? KELLER_OK : keller_error(error, KELLER_IO, "%s: the sound file cannot be written: %s", shown,
                                              sf_strerror(NULL));
}
