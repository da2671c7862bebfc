#include "keller/wave.h"

/* ITU-R P.2040-4, section 2.2. Everything is written with q = sqrt(eta - sin^2) = sqrt(eta - 1 + cos^2), whose
 * principal branch has Im q <= 0: waves decay into the medium under e^{+jwt}. TM is TE with q/eta in place of q (and so
 * with R_TM = -R_TE at normal incidence). */
static double complex normal_wavenumber(double complex eta, double cosine)
{
    return eta == 1 ? cosine : csqrt((eta - 1) + cosine * cosine);
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

static Phasor slab_phasor(double thickness, double complex q, double k)
{
    double complex x = k * thickness * q, p = cexp(-I * x);
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

/* One polarisation of several layers in air: the product of the layers' characteristic matrices (Born and Wolf, Principles of
 * Optics, section 1.6.2), each [cos x, j sin x/y; j y sin x, cos x] with x = k d q and the admittance y = q (TE) or q/eta
 * (TM), times its p = e^{-jx}, so that nothing overflows. With [A, B; C, D] the product and c = cos the air's admittance,
 * R = (Ac + Bc^2 - C - Dc)/(Ac + Bc^2 + C + Dc) and T = 2c (product of p)/(the same). */
static void layers(const KellerMedium *medium, double cosine, double k, bool tm, double complex *reflected,
                   double complex *transmitted)
{
    double complex a = 1, b = 0, c = 0, d = 1, through = 1;
    bool air = true;
    for (uint32_t i = 0; i < medium->layer_count; i++) {
        double complex eta = medium->layers[i].eta, q = normal_wavenumber(eta, cosine);
        double thickness = medium->layers[i].thickness;
        air &= eta == 1;
        Phasor phasor = slab_phasor(thickness, q, k);
        double complex even = 1 - 0.5 * phasor.one_minus_p2; /* p cos x */
        /* j p sin x over and times q; a wave along the layer has q = 0 */
        double complex over = q == 0 ? I * k * thickness : 0.5 * phasor.one_minus_p2 / q;
        double complex times = 0.5 * phasor.one_minus_p2 * q;
        if (tm) {
            over *= eta;
            times /= eta;
        }
        double complex e = a * even + b * times, f = a * over + b * even;
        double complex g = c * even + d * times, h = c * over + d * even;
        a = e, b = f, c = g, d = h;
        through *= phasor.p;
    }
    double complex sum = a * cosine + b * cosine * cosine + c + d * cosine;
    if (air || sum == 0) { /* no slab; or a grazing wave, and a slab that resonates at it */
        *reflected = air ? 0 : -1;
        *transmitted = air ? through : 0;
        return;
    }
    *reflected = (a * cosine + b * cosine * cosine - c - d * cosine) / sum;
    *transmitted = 2 * cosine * through / sum;
}

/* Both coefficients of a slab of one or several layers. */
static void slab_coefficients(const KellerMedium *medium, double c, double k, double complex r[2], double complex t[2])
{
    if (medium->layer_count > 0) {
        layers(medium, c, k, false, &r[0], &t[0]);
        layers(medium, c, k, true, &r[1], &t[1]);
        return;
    }
    double complex q = normal_wavenumber(medium->eta, c);
    Phasor phasor = slab_phasor(medium->thickness, q, k);
    slab(c, q, phasor, &r[0], &t[0]);
    slab(c, q / medium->eta, phasor, &r[1], &t[1]);
}

void keller_reflection(const KellerMedium *medium, double cos_incidence, double k, double complex *te,
                       double complex *tm)
{
    double c = clamp_cosine(cos_incidence);
    double complex r[2] = {-1, 1}, ignored[2];
    if (!medium->conductor && medium->thickness > 0) {
        slab_coefficients(medium, c, k, r, ignored);
    } else if (!medium->conductor) {
        double complex q = normal_wavenumber(medium->eta, c);
        r[0] = interface(c, q);
        r[1] = interface(c, q / medium->eta);
    }
    if (medium->roughness > 0) {
        double phase = k * medium->roughness * c, coherent = exp(-2 * phase * phase);
        r[0] *= coherent;
        r[1] *= coherent;
    }
    if (medium->diffuse.coefficient > 0) {
        double left = sqrt(1 - medium->diffuse.coefficient * medium->diffuse.coefficient);
        r[0] *= left;
        r[1] *= left;
    }
    *te = r[0];
    *tm = r[1];
}

void keller_transmission(const KellerMedium *medium, double cos_incidence, double k, double complex *te,
                         double complex *tm)
{
    double complex ignored[2], t[2] = {0, 0};
    if (!medium->conductor && medium->thickness > 0)
        slab_coefficients(medium, clamp_cosine(cos_incidence), k, ignored, t);
    *te = t[0];
    *tm = t[1];
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

void keller_reflect_fields(const KellerMedium *medium, KellerVec3 normal, KellerVec3 in, double k, size_t count, KellerCVec3 e[])
{
    double complex te, tm;
    keller_reflection(medium, fabs(v3_dot(in, normal)), k, &te, &tm);

    KellerVec3 perpendicular, parallel;
    incidence_basis(normal, in, &perpendicular, &parallel);
    /* A conductor takes e to -e_tangential + e_normal, which is minus the mirror image; with R_TM = +1 for it, the
     * parallel unit vector of the reflected wave is minus the mirrored one of the incident wave. */
    KellerVec3 mirrored = v3_mirror_direction(parallel, normal);
    for (size_t i = 0; i < count; i++) {
        double complex a = te * dot(e[i], perpendicular), b = -tm * dot(e[i], parallel);
        e[i] = (KellerCVec3){a * perpendicular.x + b * mirrored.x, a * perpendicular.y + b * mirrored.y,
                             a * perpendicular.z + b * mirrored.z};
    }
}

KellerCVec3 keller_reflect_field(const KellerMedium *medium, KellerVec3 normal, KellerVec3 in, double k, KellerCVec3 e)
{
    keller_reflect_fields(medium, normal, in, k, 1, &e);
    return e;
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
