/* keller/sound.h -- the physics of sound: air, surfaces, edges, sources. Pressure phasors, time factor e^{+jwt}, a wave that has
 * travelled r carries e^{-jkr}; pure functions, no scene. docs/acoustics.md has the formulas. */
#ifndef KELLER_SOUND_H
#define KELLER_SOUND_H
#include <complex.h>
#include <stdbool.h>
#include <stddef.h>
#include "keller/material.h"
#include "keller/vec.h"
#include "keller/wave.h"

#define KELLER_REFERENCE_PRESSURE 20e-6 /* Pa: 0 dB */
#define KELLER_REFERENCE_POWER 1e-12    /* W: 0 dB */

/* ---- air ------------------------------------------------------------------------------------------------------ */

/* The speed of sound (m/s) in air with 314 ppm of carbon dioxide, at a temperature (K), pressure (Pa) and relative humidity
 * (0 to 1): Cramer, J. Acoust. Soc. Am. 93 (1993) 2510-2516, to 0.1 m/s from 0 to 30 degC and 75 to 102 kPa; beyond, his
 * polynomial is carried on (at -20 and 50 degC within 0.3 m/s of an ideal gas). */
double keller_sound_speed(double temperature, double pressure, double humidity);
/* dB/m that the air takes from a tone, ISO 9613-1:1993 (equations 3 to 5, B.1 to B.3). 0 where !sound->absorbs. frequency in Hz. */
double keller_sound_loss(const KellerSound *sound, double frequency);

/* ---- bands ---------------------------------------------------------------------------------------------------- */

/* The exact middle (Hz) of the octave (per_octave 1) or third-octave (3) band nearest to `frequency`: 1000 Hz * 10^(3i/10) or
 * 10^(i/10), IEC 61260-1, base ten. */
double keller_band_middle(uint32_t per_octave, double frequency);
/* The width (Hz) of the band with this middle. */
double keller_band_width(uint32_t per_octave, double middle);
/* dB that frequency weighting A adds, IEC 61672-1:2013, annex E; 0 at 1 kHz (within 0.002 dB). */
double keller_a_weighting(double frequency);

/* ---- sources and receivers ------------------------------------------------------------------------------------ */

/* A pattern of the first order about the station's +x axis: (1 - order) + order cos(angle). 0: the same in all directions, 0.5
 * a cardioid, 1 a dipole. 1 on the axis. */
typedef struct {
    double order;               /* [0, 1] */
} KellerDirectivity;

/* The pressure in the global unit direction d (away from the station), over that on the axis. `orientation` as for antennas. */
double keller_directivity(const KellerDirectivity *directivity, const double orientation[3], KellerVec3 d);
/* The directivity factor: the intensity on the axis over its mean over all directions, >= 1. */
double keller_directivity_factor(const KellerDirectivity *directivity);
/* The level at 1 m on the axis (dB re 20 uPa) of a source of `power` W and this directivity factor in a free field:
 * L_W - 10 lg 4 pi + 10 lg factor, the air's characteristic impedance taken as the 400 N s/m^3 that the two reference values belong
 * to (at 20 degC it is 0.14 dB more). */
double keller_source_level(double power, double factor);

/* ---- surfaces and edges --------------------------------------------------------------------------------------- */

/* The surface of a material at a frequency (Hz). The material is of a kind for sound. */
void keller_sound_medium(const KellerMaterial *material, double frequency, KellerMedium *medium);
/* The pressure's reflection coefficient: (zeta cos - 1)/(zeta cos + 1) for an impedance, a number for an absorption coefficient
 * (sqrt(1 - alpha)) and a rigid surface (1), times sqrt(1 - scattering). cos_incidence in [0, 1]. */
double complex keller_sound_reflection(const KellerMedium *medium, double cos_incidence);
/* The diffracted pressure at distance `s` behind the edge over the incident pressure at it, without the phase e^{-jks}: the uniform
 * theory's D sqrt(s_in/(s (s_in + s))), hard for rigid faces. Arguments as keller_diffract_field, the media being surfaces for
 * sound; the faces' reflection coefficients go to the terms as wedge->model says. Symmetric in the ends as that is. */
double complex keller_sound_diffraction(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, double s_in, double s,
                                        double k);

/* ---- rigid edges, exactly --------------------------------------------------------------------------------------- */

/* A finite edge of a rigid wedge, a point source and a receiver in its cylindrical frame (m, rad): the wedge's sector is n pi, the edge
 * goes from z1 to z2. */
typedef struct {
    double n, phi_in, phi;      /* azimuths of source and receiver in [0, n pi] */
    double r_in, z_in, r, z;
    double z1, z2;
} KellerRigidEdge;

/* The edge of a wedge of this length, from an image of the source at s_in before its point `at` (m from its start) to an image of
 * the receiver at s behind it; directions as in keller_diffract_field. */
KellerRigidEdge keller_rigid_edge(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, double s_in, double s, double at,
                                  double length);
/* The pressure that the edge diffracts once, exactly, for a source whose free field is (1 m/r) e^{-jkr}: Biot, Tolstoy and Medwin,
 * as Svensson's integral along the edge, to 1e-10 of the largest contribution. The phase e^{-jkR} of the shortest way R over the
 * edge's line is left out. Any place of the ends; where one is on a boundary (within KELLER_BOUNDARY_ANGLE) the term that
 * jumps there counts with its mean, 0. The time grows with k times the difference of ways along the edge. */
double complex keller_btm(const KellerRigidEdge *edge, double k);
/* The shortest way (m) over the edge's line. */
double keller_btm_shortest(const KellerRigidEdge *edge);
/* The same in the time domain, phase included, added to h[count]: h[i] is the impulse response (1/s) weighted with a triangle of two
 * samples' width around start + i/rate (s), whose transform is (sin(pi f/rate)/(pi f/rate))^2; what lies outside of the samples is
 * left out. `rate` in Hz, the wave's speed in m/s. */
void keller_btm_response(const KellerRigidEdge *edge, double speed, double rate, double start, size_t count, double *h);
#endif
