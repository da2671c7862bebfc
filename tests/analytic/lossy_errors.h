/* lossy_errors.h -- the models of finitely conducting wedges against the exact impedance wedge, for the test and the bench. */
#ifndef LOSSY_ERRORS_H
#define LOSSY_ERRORS_H
#include "keller/wave.h"

enum { LOSSY_MODELS = 3 }; /* by KellerWedgeModel */

/* rms over sources and receivers: of the level in the shadow, dB; of the field away from boundaries, in units of the
 * incident field over sqrt(k r). */
typedef struct {
    double shadow, worst_shadow, everywhere;
    int shadow_points, points;
} LossyErrors;

/* Both faces of a half-space of permittivity eta; E (across 0) or H (1) along the edge. Angles from 3 % to 97 % of the sector,
 * at least 10 degrees from every boundary, with kL so large that the transition functions are 1. */
void lossy_errors(double n, double complex eta, int across, LossyErrors errors[LOSSY_MODELS]);

/* The model's and the exact coefficient times sqrt(k), in the same limit. */
double complex lossy_coefficient(KellerWedgeModel model, double n, double complex eta, int across, double phi_in, double phi);
double complex lossy_exact(double n, double complex eta, int across, double phi_in, double phi);
#endif
