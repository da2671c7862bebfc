/* keller/response.h -- impulse responses of sound, and what ISO 3382-1 reads from them. */
#ifndef KELLER_RESPONSE_H
#define KELLER_RESPONSE_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The pressure at a receiver, over the free-field pressure at 1 m on the source's axis, for an impulse: sample i is at the time
 * i/rate after the impulse, and a path of gain g whose delay is a whole number of samples adds g to one sample. */
typedef struct {
    uint32_t tx, rx;
    double rate;                /* Hz */
    double arrival;             /* s: delay of the first path; 0 where there is none */
    size_t count;
    float *pressure;            /* [count] */
    float *tail;                /* [count] what of the pressure is statistical (config->response_volume > 0); NULL: nothing */
} KellerResponse;

/* Of one octave band. NaN where the response does not say: no energy, or a decay that does not reach the level. */
typedef struct {
    double edt, t20, t30;       /* s: from 0 to -10, -5 to -25, -5 to -35 dB of the backward-integrated decay */
    double c50, c80;            /* dB: energy before over energy after 50, 80 ms after the first path */
    double d50;                 /* share of the energy in the first 50 ms */
    double g;                   /* dB re the free field of the same source at 10 m */
} KellerRoom;

enum { KELLER_ROOM_BANDS = 8 };
/* The octave bands (exact middles, 63 Hz to 8 kHz) whose upper edge is below half the rate: writes them and returns their number. */
size_t keller_room_bands(double rate, double middle[KELLER_ROOM_BANDS]);

/* The parameters of ISO 3382-1 in octave bands: the response through a band filter without phase (magnitude of a Butterworth
 * band-pass of the third order, IEC 61260 class 1), squared and integrated backwards (Schroeder, J. Acoust. Soc. Am. 37 (1965) 409);
 * times by linear regression. What the response lacks (orders that were not asked for, time after its end) the decay lacks. False:
 * memory. */
bool keller_room(const KellerResponse *response, size_t bands, const double *middle, KellerRoom *rooms);

/* The same from a decay given as energies per sample from the first path on, not filtered; `free_field` is the energy of the free
 * field at 10 m. */
KellerRoom keller_room_of_energy(size_t count, const double *energy, double rate, double free_field);
#endif
