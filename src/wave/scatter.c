/* Diffuse scattering by the effective roughness model: Degli-Esposti, Fuschini, Vitucci and Falciasecca, Measurement and modelling
 * of scattering from buildings, IEEE Trans. AP-55 (2007) 143-153. */
#include "keller/wave.h"

/* The integral of ((1 + cos psi)/2)^exponent over the half-space, psi the angle from a direction whose angle to the normal has
 * this cosine (their equation 6): a sum of the integrals of cos^j psi, which are 2 pi/(j + 1) for even j, and that times
 * cos sum_w C(2w, w) (sin/2)^2w, w to (j - 1)/2, for odd ones. */
static double lobe_integral(uint32_t exponent, double cosine)
{
    double quarter = 0.25 * (1 - cosine * cosine), binomial = pow(0.5, exponent), central = 1, odd = 0, sum = 0;
    for (uint32_t j = 0; j <= exponent; j++) {
        if (j % 2) { /* the w-th term, w = (j - 1)/2, after that the next central binomial */
            odd += central;
            central *= quarter * 2 * j / ((j + 1) / 2);
        }
        sum += binomial * 2 * M_PI / (j + 1) * (j % 2 ? cosine * odd : 1);
        binomial *= (double)(exponent - j) / (j + 1);
    }
    return sum;
}

static double lobe(uint32_t exponent, double cosine) { return pow(0.5 * (1 + fmax(-1, fmin(1, cosine))), exponent); }

double keller_scatter_density(const KellerScattering *s, KellerVec3 normal, KellerVec3 in, KellerVec3 out)
{
    double cosine = fmin(1, fabs(v3_dot(in, normal)));
    if (s->lobe == 0) return fmin(1, fabs(v3_dot(out, normal))) / M_PI;
    double forward = s->share * lobe(s->lobe, v3_dot(v3_mirror_direction(in, normal), out));
    double whole = s->share * lobe_integral(s->lobe, cosine);
    if (s->share < 1) {
        forward += (1 - s->share) * lobe(s->back_lobe, -v3_dot(in, out));
        whole += (1 - s->share) * lobe_integral(s->back_lobe, cosine);
    }
    return forward / whole;
}

static double complex dot(KellerCVec3 e, KellerVec3 v) { return e.x * v.x + e.y * v.y + e.z * v.z; }

/* A vector across `from`, carried to across `to` by the turn that takes the one direction to the other. */
static KellerVec3 carried(KellerVec3 v, KellerVec3 from, KellerVec3 to)
{
    double far = 1 + v3_dot(from, to);
    /* opposite: both along the surface, where nothing is scattered */
    return far > 1e-12 ? v3_madd(v, v3_add(from, to), -v3_dot(v, to) / far) : v;
}

KellerCVec3 keller_scatter_field(const KellerMedium *medium, KellerVec3 normal, KellerVec3 in, KellerVec3 out, double area,
                                 const double phase[2], double k, KellerCVec3 e)
{
    KellerMedium smooth = *medium;
    smooth.roughness = smooth.diffuse.coefficient = 0;
    double cosine = fabs(v3_dot(in, normal));
    double complex te, tm;
    keller_reflection(&smooth, cosine, k, &te, &tm);
    KellerVec3 across = v3_cross(in, normal), mirrored = v3_mirror_direction(in, normal);
    double sine = v3_norm(across);
    across = sine > 1e-12 ? v3_scale(across, 1 / sine) : v3_perpendicular(in); /* any, as R_TM = -R_TE */
    double complex a = te * dot(e, across), b = tm * dot(e, v3_cross(across, in));
    KellerVec3 along = carried(v3_cross(across, mirrored), mirrored, out);
    across = carried(across, mirrored, out);
    /* a unitary change of polarisation, whatever the phases: no power is made or lost */
    const KellerScattering *s = &medium->diffuse;
    double same = sqrt(1 - s->cross), other = sqrt(s->cross);
    double complex crossed = cexp(I * phase[1]);
    double complex size = s->coefficient * sqrt(area * cosine * keller_scatter_density(s, normal, in, out)) * cexp(I * phase[0]);
    double complex p = size * (same * a - other * conj(crossed) * b), q = size * (other * crossed * a + same * b);
    return (KellerCVec3){p * across.x + q * along.x, p * across.y + q * along.y, p * across.z + q * along.z};
}
