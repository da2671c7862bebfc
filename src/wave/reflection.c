#include "keller/wave.h"

/* ITU-R P.2040-4, section 2.2. Everything is written with q = sqrt(eta - sin^2) = sqrt(eta - 1 + cos^2), whose
 * principal branch has Im q <= 0: waves decay into the medium under e^{+jwt}. TM is TE with q/eta in place of q (and so
 * with R_TM = -R_TE at normal incidence). */
static double complex normal_wavenumber(const KellerMedium *medium, double cosine)
{
    return medium->eta == 1 ? cosine : csqrt((medium->eta - 1) + cosine * cosine);
}

static double clamp_cosine(double cosine) { return cosine < 0 ? 0 : cosine > 1 ? 1 : cosine; }

/* One polarisation of the single interface, R'. */
static double complex interface(double cosine, double complex q)
{
    double complex sum = cosine + q;
    return sum == 0 ? 0 : (cosine - q) / sum;
}

/* The one-way phasor p = e^{-jx}, x = k d q, of a slab and 1 - p^2. |p| <= 1: nothing overflows however thick and
 * lossy the slab is, and for thin ones 1 - e^{-2jx} = 2j sin(x) e^{-jx} keeps its digits. */
typedef struct {
    double complex p, one_minus_p2;
} Phasor;

static Phasor slab_phasor(const KellerMedium *medium, double complex q, double k)
{
    double complex x = k * medium->thickness * q, p = cexp(-I * x);
    return (Phasor){p, cabs(x) < 1 ? 2 * I * csin(x) * p : 1 - p * p};
}

/* One polarisation of the slab in air. P.2040-4's R' (1 - p^2)/(1 - R'^2 p^2) and (1 - R'^2) p/(1 - R'^2 p^2) with
 * R' = u - v, u = cos/(cos + q), v = q/(cos + q), written so that nothing cancels for metals, thin slabs and grazing
 * waves: 1 - R'^2 = 4uv and 1 - R'^2 p^2 = (u^2 + v^2)(1 - p^2) + 2uv (1 + p^2). */
static void slab(double cosine, double complex q, Phasor phasor, double complex *reflected, double complex *transmitted)
{
    double complex sum = cosine + q;
    double complex u = sum == 0 ? 0.5 : cosine / sum, v = sum == 0 ? 0.5 : q / sum;
    double complex denominator = (u * u + v * v) * phasor.one_minus_p2 + 2 * u * v * (2 - phasor.one_minus_p2);
    if (denominator == 0) { /* a grazing wave, and a slab that resonates at it or is infinitely thin */
        *reflected = -1;
        *transmitted = 0;
        return;
    }
    *reflected = (u - v) * phasor.one_minus_p2 / denominator;
    *transmitted = 4 * u * v * phasor.p / denominator;
}

void keller_reflection(const KellerMedium *medium, double cos_incidence, double k, double complex *te,
                       double complex *tm)
{
    if (medium->conductor) {
        *te = -1;
        *tm = 1;
        return;
    }
    double c = clamp_cosine(cos_incidence);
    double complex q = normal_wavenumber(medium, c);
    if (medium->thickness > 0) {
        Phasor phasor = slab_phasor(medium, q, k);
        double complex ignored;
        slab(c, q, phasor, te, &ignored);
        slab(c, q / medium->eta, phasor, tm, &ignored);
    } else {
        *te = interface(c, q);
        *tm = interface(c, q / medium->eta);
    }
}

void keller_transmission(const KellerMedium *medium, double cos_incidence, double k, double complex *te,
                         double complex *tm)
{
    *te = *tm = 0;
    if (medium->conductor || !(medium->thickness > 0)) return;
    double c = clamp_cosine(cos_incidence);
    double complex q = normal_wavenumber(medium, c);
    Phasor phasor = slab_phasor(medium, q, k);
    double complex ignored;
    slab(c, q, phasor, &ignored, te);
    slab(c, q / medium->eta, phasor, &ignored, tm);
}

static double complex dot(KellerCVec3 e, KellerVec3 v) { return e.x * v.x + e.y * v.y + e.z * v.z; }

/* Unit vectors across `in`: perpendicular to the plane of incidence, and parallel to it. */
static void incidence_basis(KellerVec3 normal, KellerVec3 in, KellerVec3 *perpendicular, KellerVec3 *parallel)
{
    *perpendicular = v3_cross(in, normal);
    double sine = v3_norm(*perpendicular);
    /* At normal incidence any direction in the surface will do, because R_TM = -R_TE and T_TM = T_TE. */
    *perpendicular = sine > 1e-12 ? v3_scale(*perpendicular, 1 / sine) : v3_perpendicular(in);
    *parallel = v3_cross(*perpendicular, in);
}

KellerCVec3 keller_reflect_field(const KellerMedium *medium, KellerVec3 normal, KellerVec3 in, double k, KellerCVec3 e)
{
    double complex te, tm;
    keller_reflection(medium, fabs(v3_dot(in, normal)), k, &te, &tm);

    KellerVec3 perpendicular, parallel;
    incidence_basis(normal, in, &perpendicular, &parallel);
    /* A conductor takes e to -e_tangential + e_normal, which is minus the mirror image; with R_TM = +1 for it, the
     * parallel unit vector of the reflected wave is minus the mirrored one of the incident wave. */
    KellerVec3 mirrored = v3_mirror_direction(parallel, normal);
    double complex a = te * dot(e, perpendicular), b = -tm * dot(e, parallel);
    return (KellerCVec3){a * perpendicular.x + b * mirrored.x, a * perpendicular.y + b * mirrored.y,
                         a * perpendicular.z + b * mirrored.z};
}

KellerCVec3 keller_transmit_field(const KellerMedium *medium, KellerVec3 normal, KellerVec3 in, double k, KellerCVec3 e)
{
    double complex te, tm;
    double cosine = fabs(v3_dot(in, normal));
    keller_transmission(medium, cosine, k, &te, &tm);

    KellerVec3 perpendicular, parallel;
    incidence_basis(normal, in, &perpendicular, &parallel);
    double complex instead = cexp(I * (k * medium->thickness * cosine));
    double complex a = te * instead * dot(e, perpendicular), b = tm * instead * dot(e, parallel);
    return (KellerCVec3){a * perpendicular.x + b * parallel.x, a * perpendicular.y + b * parallel.y,
                         a * perpendicular.z + b * parallel.z};
}
