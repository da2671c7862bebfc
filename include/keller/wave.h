/* keller/wave.h -- the physics of one interaction: pure functions, no scene. Time factor e^{+jwt}; a wave that has
 * travelled r carries e^{-jkr}. Fields are peak phasors, arbitrary common scale. */
#ifndef KELLER_WAVE_H
#define KELLER_WAVE_H
#include <complex.h>
#include <stdbool.h>
#include <stddef.h>
#include "keller/error.h"
#include "keller/material.h"
#include "keller/vec.h"

#define KELLER_LIGHT_SPEED 299792458.0          /* m/s */
#define KELLER_VACUUM_PERMITTIVITY 8.8541878128e-12 /* F/m */

typedef struct {
    double complex x, y, z;
} KellerCVec3;

/* ---- materials ---------------------------------------------------------------------------------------------- */

/* A material at one frequency. */
typedef struct {
    bool conductor;          /* perfect electric conductor: eta is not used */
    double complex eta;      /* relative permittivity eps' - j sigma/(w eps0) */
    double thickness;        /* m; 0: half-space */
    double roughness;        /* m, rms height of the surface */
    KellerScattering diffuse;
    uint32_t layer_count;    /* 0: one medium; else a slab of these layers, as thick as all together, eta not used */
    struct {
        double complex eta;
        double thickness;    /* m */
    } layers[KELLER_MAX_LAYERS];
    bool sound;              /* a surface for sound (keller/sound.h): only the next three count */
    bool reacts;             /* locally, with an impedance; else it reflects the same at every angle */
    double complex impedance; /* specific, normal, of a surface that reacts; 0: the pressure at it is 0 */
    double factor;           /* of the pressure: what scattering leaves of the reflection where it reacts, else the whole reflection */
} KellerMedium;

/* True if `name` is in the ITU-R P.2040-4 table. */
bool keller_itu_known(const char *name);
/* The table's names, NULL-terminated, for messages; static storage. */
const char *const *keller_itu_names(void);
/* The medium of a material at `frequency` (Hz, > 0). Errors: KELLER_BAD_INPUT when the frequency is outside the
 * material's range in the table (message: material, its ranges, the frequency), or the kind is NAMED. */
KellerStatus keller_medium(const KellerMaterial *material, double frequency, KellerMedium *medium, KellerError *error);

/* ---- reflection ----------------------------------------------------------------------------------------------- */

/* Reflection coefficients for E perpendicular (te) and parallel (tm) to the plane of incidence, ITU-R P.2040-4
 * conventions (R_TM = -R_TE at normal incidence; conductor: te = -1, tm = +1). `cos_incidence` in [0, 1], wavenumber k
 * of free space in rad/m (used by slabs and rough surfaces only). Half-space or slab of one or several layers, as the medium
 * says; what is left of the reflection at a rough surface is its coherent part, e^{-2 (k roughness cos)^2} (Ament 1953), and
 * what is left at one that scatters diffusely sqrt(1 - S^2) of that. */
void keller_reflection(const KellerMedium *medium, double cos_incidence, double k, double complex *te,
                       double complex *tm);
/* Transmission coefficients of a slab (thickness > 0), including the phase through it; 0 for a half-space or a
 * conductor. Roughness does not enter. */
void keller_transmission(const KellerMedium *medium, double cos_incidence, double k, double complex *te,
                         double complex *tm);
/* The field reflected at a surface with unit normal `normal` (either side): incoming unit direction `in`, incident
 * field `e` (transverse to `in`). Returns the reflected field, transverse to the mirrored direction. */
KellerCVec3 keller_reflect_field(const KellerMedium *medium, KellerVec3 normal, KellerVec3 in, double k, KellerCVec3 e);
/* The same of `count` fields of one direction, in their place. */
void keller_reflect_fields(const KellerMedium *medium, KellerVec3 normal, KellerVec3 in, double k, size_t count, KellerCVec3 e[]);
/* The field that a slab lets through, in the same direction and against free space in its place: the slab's phase takes
 * the place of the phase k d cos(theta) of the free space that it fills, so that a slab of air changes nothing, and the
 * caller's phase goes on over the whole straight ray. Arguments as above; 0 for a half-space or a conductor. */
KellerCVec3 keller_transmit_field(const KellerMedium *medium, KellerVec3 normal, KellerVec3 in, double k, KellerCVec3 e);

/* ---- diffuse scattering --------------------------------------------------------------------------------------- */

/* How what a surface scatters is distributed, in 1/sr: its integral over the half-space above the surface is 1. Unit directions
 * of travel, `in` towards the surface and `out` away from it on the side it came from; unit normal `normal` of either sign. */
double keller_scatter_density(const KellerScattering *scattering, KellerVec3 normal, KellerVec3 in, KellerVec3 out);
/* The field that a small patch of `area` (m^2) scatters towards `out`, times the distance: |field|^2 is the density times S^2 area
 * cos(theta_in) |R e|^2, with the coefficients R of the smooth surface. `e`: incident field at the patch, transverse to `in`. Returns
 * a field transverse to `out`: the reflected field, its direction turned to `out` the shortest way, and of the parts of it that are across
 * and in the plane of incidence `cross` of the power exchanged. phase[0] is the phase of all of it, phase[1] that of what is exchanged
 * against the rest (rad). */
KellerCVec3 keller_scatter_field(const KellerMedium *medium, KellerVec3 normal, KellerVec3 in, KellerVec3 out, double area,
                                 const double phase[2], double k, KellerCVec3 e);

/* ---- diffraction ---------------------------------------------------------------------------------------------- */

/* The transition function F(x), x >= 0, of Kouyoumjian and Pathak 1974: off by at most 5e-16 |F(x)|. */
double complex keller_transition(double x);

/* The four terms of the Kouyoumjian-Pathak coefficient: D1, D2 with phi - phi' (incident boundaries), D3, D4 with
 * phi + phi' (D3: reflection in the n-face, D4: in the 0-face); each holds -e^{-j pi/4}/(2 n sqrt(2 pi k) sin beta0).
 * Angles in radians in [0, n pi]; sin_beta0 in (0, 1]; k rad/m; L m. The angle to each pole is reduced before the
 * cotangent; within KELLER_BOUNDARY_ANGLE of a pole the term is its mean value there, 0 in the singular part, so that
 * it belongs with a geometrical field counted one half. */
void keller_utd_terms(double n, double phi, double phi_incident, double sin_beta0, double k, double L,
                      double complex d[4]);

/* The derivatives of the four terms by their own angles pi + (phi - phi'), pi - (phi - phi'), pi + (phi + phi'), pi - (phi +
 * phi'), 1/rad: what a field that vanishes at the edge, but changes across it, is diffracted with (slope diffraction;
 * Hwang and Kouyoumjian 1974). By phi' their signs are -, +, +, -; by phi +, -, +, -. Arguments as keller_utd_terms. On a
 * pole the derivative is continuous, and so is what this returns. */
void keller_utd_slopes(double n, double phi, double phi_incident, double sin_beta0, double k, double L,
                       double complex slope[4]);

/* The field behind two parallel absorbing screens, relative to the free field: Fresnel-Kirchhoff, paraxial, uniform, wherever
 * the edges lie in each other's transition zones. Distances d1 (source to first edge), d2, d3 (second edge to receiver) in
 * m, > 0; heights of the edges over the straight line from source to receiver in m, negative below it; k rad/m. The error
 * is below 1e-12. Takes 128 values of the Faddeeva function. */
double complex keller_double_edge(double k, double d1, double d2, double d3, double h1, double h2);

/* The transition function of two edges in a row, over the product of both edges' own, F(x1^2/2) F(x2^2/2): what the product of two
 * coefficients is to be multiplied with where an edge lies in the other one's transition zone. x = 2 sqrt(kL) |sin(eps/2)| >= 0 of
 * each edge, eps the angle to the pole; |r| < 1 the coupling of the edges, positive where a ray from pole to pole passes both on
 * the same side, for parallel edges sqrt(d1 d3/((d1 + d2)(d2 + d3))). 1 for r = 0. Relative error below 1e-12. */
double complex keller_edge_pair(double x1, double x2, double r);

/* The same of three edges in a row over the product of the three's own, with the couplings r12 and r23 of neighbours, r12^2 + r23^2 < 1,
 * where the first and the last are coupled through the middle one alone, as parallel edges are. keller_edge_pair(x1, x2, r12) for r23
 * = 0. Relative error below 1e-9. */
double complex keller_edge_triple(double x1, double x2, double x3, double r12, double r23);

/* Radians: nearer than this to a shadow or reflection boundary counts as on it (see keller_utd_terms and the
 * visibility test, which must agree). */
#define KELLER_BOUNDARY_ANGLE 1e-9

/* A wedge as the wave sees it: frame as in KellerWedge (tangent0 x normal0 = direction). */
typedef struct {
    double n;
    KellerVec3 direction, tangent0, normal0;
    KellerMedium medium[2];  /* of the 0-face and of the n-face */
    KellerWedgeModel model;  /* of the faces' finite conductivity */
    uint32_t sheets;         /* n > 1: how many sheets a wave passes that slabs let through into the shadow: 0, none is there; 1 of
                                a screen; 2, the one face and the other */
} KellerWedgeWave;

/* The diffracted field at distance `s` behind the edge, without the phase e^{-jks}: incident unit direction `in`
 * (towards the edge), diffracted unit direction `out` (away from it), with equal angles to the edge; incident field `e`
 * at the edge (transverse to `in`); s_in and s: distances (m) along the ray from the (image) source to the edge and from
 * the edge to the (image) receiver, for spreading sqrt(s_in/(s (s_in + s))) and L = s_in s/(s_in + s) sin^2 beta0.
 * Reflection coefficients of finitely conducting faces enter as 2x2 matrices in the edge-fixed basis, put to the terms as
 * wedge->model says; in sectors below pi (n < 1) all models are one. Around a wedge that lets waves through the shadow boundary's
 * term has 1 - T, so that it goes with the field behind it. Whatever the model, the total field is continuous
 * across shadow and reflection boundaries and a conductor's field is Kouyoumjian and Pathak's; exchanging source and
 * receiver transposes the result exactly for KELLER_WEDGE_RECIPROCAL and for n < 1. */
KellerCVec3 keller_diffract_field(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, double s_in, double s,
                                  double k, KellerCVec3 e);

/* What a wave that changes from ray to ray has beside that: `e` is here the derivative of the incident field by the angle (rad) about
 * the edge by which its ray leaves the source, growing as the ray turns towards growing phi' (its components along beta0' and phi'
 * of each ray); or, of_receiver, the incident field, and the result is to be multiplied with the derivative of what the receiver makes of
 * it, by the angle in which it looks, growing towards growing phi. The derivative of the coefficient by that ray's azimuth, of its
 * terms and of the faces' matrices, times keller_slope_factor: slope diffraction. Other arguments, spreading and phase as above.
 * Continuous on boundaries. */
KellerCVec3 keller_diffract_slope(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, double s_in, double s, double k,
                                  bool of_receiver, KellerCVec3 e);
/* 1/(jks sin^2 beta0), k in rad/m, `distance` s in m from the source or receiver along the ray; at most 1. */
double complex keller_slope_factor(double k, double distance, double sin_beta0);

/* ---- air and rain --------------------------------------------------------------------------------------------- */

/* dB/m that the air takes: by gases as ITU-R P.676-13, annex 1 (line by line), has it, and by rain, ITU-R P.838-3, for a
 * polarisation half-way between horizontal and vertical. Frequency in Hz, 1 to 1000 GHz. 0 where *air is all zero. */
double keller_air_loss(const KellerAir *air, double frequency);
/* dB/m by rain of `rate` m/s at the path's elevation and the polarisation's tilt from the horizontal (rad). */
double keller_rain_loss(double frequency, double rate, double elevation, double tilt);
/* The pressure of water vapour (Pa) at a temperature (K), pressure (Pa) and relative humidity (1 is saturated, over water):
 * ITU-R P.453-14, equations 7 to 9. */
double keller_vapour_pressure(double temperature, double pressure, double humidity);

/* ---- antennas ------------------------------------------------------------------------------------------------- */

typedef enum {
    KELLER_ANTENNA_ISOTROPIC,
    KELLER_ANTENNA_DIPOLE,           /* short dipole along the antenna's z axis */
    KELLER_ANTENNA_HALF_WAVE_DIPOLE,
    KELLER_ANTENNA_TR38901,          /* 3GPP TR 38.901 table 7.3-1 element, boresight +x of the antenna's frame */
    KELLER_ANTENNA_CUTS              /* a gain and two cuts, as in a file (keller/antenna.h) */
} KellerAntennaPattern;

enum { KELLER_CUT_ANGLES = 360 };

/* A pattern by a horizontal and a vertical cut: losses in dB below the gain, one a degree. Horizontal angles run from +x of the
 * antenna's frame clockwise seen from above (towards -y), vertical ones from the horizon downwards: 90 is straight down,
 * 180 behind. The horizontal cut is taken on the cone through the maximum of the vertical one, the vertical cut in the
 * half-plane through the maximum of the horizontal one; between them the pattern is interpolated (docs/theory.md). The half of
 * the vertical cut behind the antenna is not used. */
typedef struct {
    double gain;                     /* dBi */
    double horizontal[KELLER_CUT_ANGLES], vertical[KELLER_CUT_ANGLES];
} KellerAntennaCuts;

typedef enum { KELLER_POLARIZATION_V, KELLER_POLARIZATION_H } KellerPolarization;

enum { KELLER_MAX_ELEMENTS_OF_ARRAY = 1024 };

/* One element of an array. */
typedef struct {
    KellerVec3 position;             /* m, from the station, in the antenna's frame */
    double phase;                    /* rad: it is fed with e^{j phase}, and received with it */
} KellerArrayElement;

typedef struct {
    KellerAntennaPattern pattern;
    KellerPolarization polarization;
    const KellerAntennaCuts *cuts;   /* pattern CUTS: borrowed */
    uint32_t element_count;          /* elements with this pattern; 0: one, at the station */
    const KellerArrayElement *elements; /* borrowed */
} KellerAntenna;

/* Zenith and azimuth (radians, zenith in [0, pi], azimuth in (-pi, pi]) of the unit vector d. At the poles azimuth is 0. Any
 * output pointer may be NULL. */
void keller_angles(KellerVec3 d, double *zenith, double *azimuth);
/* The unit vectors theta-hat and phi-hat at the unit vector d. Any output pointer may be NULL. */
void keller_spherical_basis(KellerVec3 d, KellerVec3 *theta_hat, KellerVec3 *phi_hat);

/* The antenna's field pattern towards the global unit direction d (away from the antenna, for transmitting and for
 * receiving), as components along the global theta-hat and phi-hat of d: |f_theta|^2 + |f_phi|^2 is the gain over
 * isotropic in that direction. `orientation`: yaw, pitch, roll in radians, intrinsic z-y-x. Polarisation V radiates
 * along theta-hat and H along phi-hat of the antenna's own frame. */
void keller_antenna_field(const KellerAntenna *antenna, const double orientation[3], KellerVec3 d,
                          double complex *f_theta, double complex *f_phi);

/* What an array multiplies its element's pattern with towards d: the sum of e^{j (phase + k d.position)} over the root of the
 * number of elements, which share the power equally; 1 without elements. Plane waves: of a path's length and directions
 * only its phase differs from element to element, as long as the array is small against all distances. */
double complex keller_array_factor(const KellerAntenna *antenna, const double orientation[3], KellerVec3 d, double k);
#endif
