/* maliuzhinets.h -- the diffraction coefficient of a wedge with impedance faces, exact: G. D. Maliuzhinets, Sov. Phys.
 * Doklady 3 (1958) 752-755, in the notation of Osipov and Norris, Wave Motion 29 (1999) 313-340. The truth that the
 * models of finitely conducting wedges are measured by; normal incidence, plane wave, time factor e^{+jwt}. */
#ifndef MALIUZHINETS_H
#define MALIUZHINETS_H
#include <complex.h>

/* Maliuzhinets' special function for the half opening angle `half` (radians): even, 1 at 0, and
 * psi(z + 2 half) = cot(z/2 + pi/4) psi(z - 2 half). */
double complex maliuzhinets_function(double complex z, double half);

/* The coefficient D of u_d = u_i D e^{-jkr}/sqrt(r) times sqrt(k): angles in [0, n pi] from the 0-face, away from shadow
 * and reflection boundaries. `sine0`, `sine_n`: of the faces' Brewster angles, so that a face reflects a wave that comes
 * at the angle a above it with (sin a - sine)/(sin a + sine): a half-space has sqrt(eta) for E along the edge, 1/sqrt(eta)
 * for H, where |eta| is large. */
double complex maliuzhinets_coefficient(double n, double phi, double phi_in, double complex sine0, double complex sine_n);
#endif
