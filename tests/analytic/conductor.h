/* conductor.h -- the total field around a perfectly conducting wedge in two scalars: geometrical optics by images, and what
 * the library diffracts. For tests and for the bench of accuracy.
 *
 * Soft: E along the edge. Hard: H along the edge, u = H_z; with the incident wave's -E_phi' = u (H = d x E) the
 * diffracted E_phi is u. At oblique incidence E along beta0' and phi' go with the soft and the hard scalar field
 * (Kouyoumjian and Pathak 1974): beta0' = phi' x in, beta0 = phi x out, and E_d = -(D_s, D_h) E_i. */
#ifndef CONDUCTOR_H
#define CONDUCTOR_H
#include "keller/wave.h"

typedef struct {
    double complex soft, hard;
    double stray; /* of a diffracted field: the largest component that ought to be 0 */
} Scalars;

/* Where the waves come from, and the normalisation: e^{jkr cos(phi - phi')}, H0^(2)(kR)/4j, e^{-jkR}/(4 pi R). */
typedef enum { SOURCE_PLANE, SOURCE_LINE, SOURCE_POINT } SourceKind;

/* Source at rho_in (not used for plane waves), receiver at rho, z further along the edge (points only). */
typedef struct {
    SourceKind kind;
    double n, k, phi_in, rho_in, rho, z;
} WedgeSetting;

static inline KellerCVec3 scaled(KellerVec3 v, double complex a) { return (KellerCVec3){a * v.x, a * v.y, a * v.z}; }
static inline double complex scalar_product(KellerCVec3 e, KellerVec3 v) { return e.x * v.x + e.y * v.y + e.z * v.z; }

/* u_d of a unit scalar field at the edge, without e^{-jks}, from the vector function; spreading as of a point source. */
static inline Scalars wedge_diffracted(double n, double phi_in, double phi, double beta0, double s_in, double s, double k)
{
    KellerMedium metal = {.conductor = true};
    KellerWedgeWave wedge = {
        .n = n, .direction = {0, 0, 1}, .tangent0 = {1, 0, 0}, .normal0 = {0, 1, 0}, .medium = {metal, metal}};
    double sine = sin(beta0), cosine = cos(beta0);
    KellerVec3 in = v3(-sine * cos(phi_in), -sine * sin(phi_in), cosine), out = v3(sine * cos(phi), sine * sin(phi), cosine);
    KellerVec3 phi_in_hat = v3(-sin(phi_in), cos(phi_in), 0), phi_hat = v3(-sin(phi), cos(phi), 0);
    KellerVec3 beta_in_hat = v3_cross(phi_in_hat, in), beta_hat = v3_cross(phi_hat, out);
    KellerCVec3 soft = keller_diffract_field(&wedge, in, out, s_in, s, k, scaled(beta_in_hat, 1));
    KellerCVec3 hard = keller_diffract_field(&wedge, in, out, s_in, s, k, scaled(phi_in_hat, -1));
    double stray = fmax(cabs(scalar_product(soft, phi_hat)) + cabs(scalar_product(hard, beta_hat)),
                        cabs(scalar_product(soft, out)) + cabs(scalar_product(hard, out)));
    return (Scalars){-scalar_product(soft, beta_hat), scalar_product(hard, phi_hat), stray};
}

static inline double complex source_field(const WedgeSetting *w, double R)
{
    if (w->kind == SOURCE_LINE) return (j0(w->k * R) - I * y0(w->k * R)) / (4 * I);
    return cexp(-I * w->k * R) / (4 * M_PI * R);
}

/* Geometrical optics: images at psi + 2 pi n N with |.| <= pi, one half on the boundary. */
static inline Scalars wedge_optics(const WedgeSetting *w, double phi)
{
    double complex u[2] = {0, 0};
    for (int sign = 0; sign < 2; sign++) {
        double psi = sign == 0 ? phi - w->phi_in : phi + w->phi_in;
        for (int image = -4; image <= 4; image++) {
            double a = psi + 2 * M_PI * w->n * image, off = fabs(a) - M_PI;
            double weight = fabs(off) < KELLER_BOUNDARY_ANGLE ? 0.5 : off < 0 ? 1 : 0;
            if (weight == 0) continue;
            if (w->kind == SOURCE_PLANE)
                u[sign] += weight * cexp(I * w->k * w->rho * cos(a));
            else
                u[sign] += weight * source_field(w, sqrt(w->rho * w->rho + w->rho_in * w->rho_in -
                                                         2 * w->rho * w->rho_in * cos(a) + w->z * w->z));
        }
    }
    return (Scalars){u[0] - u[1], u[0] + u[1], 0};
}

static inline Scalars wedge_total(const WedgeSetting *w, double phi)
{
    double beta0 = w->kind == SOURCE_POINT ? atan2(w->rho + w->rho_in, w->z) : M_PI / 2;
    double s_in = w->kind == SOURCE_PLANE ? INFINITY : w->rho_in / sin(beta0), s = w->rho / sin(beta0);
    double complex at_edge = w->kind == SOURCE_PLANE ? 1 : source_field(w, s_in);
    /* a line's waves do not spread along the edge */
    if (w->kind == SOURCE_LINE) at_edge *= sqrt(1 + s / s_in);
    at_edge *= cexp(-I * w->k * s);
    Scalars u = wedge_optics(w, phi), d = wedge_diffracted(w->n, w->phi_in, phi, beta0, s_in, s, w->k);
    return (Scalars){u.soft + d.soft * at_edge, u.hard + d.hard * at_edge, d.stray};
}

/* |u_i| that errors are relative to: at the length of the straightened path. */
static inline double wedge_incident(const WedgeSetting *w)
{
    return w->kind == SOURCE_PLANE ? 1 : cabs(source_field(w, hypot(w->rho + w->rho_in, w->z)));
}
#endif
