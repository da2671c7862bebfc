/* The scalar coefficient of the uniform theory of diffraction: Kouyoumjian and Pathak, Proc. IEEE 62 (1974) 1448-1461.
 * docs/theory.md has the formulas in the order of the code. */
#include "wave/utd.h"

/* The four angles to the nearest pole each, and the factor -e^{-j pi/4}/(2 n sqrt(2 pi k) sin beta0) in front. The whole
 * number taken off is N+ for the 1st and 3rd term, -N- for the others. */
static double complex reduce(double n, double phi, double phi_incident, double sin_beta0, double k, double distance[4])
{
    double period = 2 * M_PI * n, difference = phi - phi_incident, sum = phi + phi_incident;
    double angle[4] = {M_PI + difference, M_PI - difference, M_PI + sum, M_PI - sum};
    for (int i = 0; i < 4; i++) distance[i] = angle[i] - period * nearbyint(angle[i] / period);
    double scale = 1 / (4 * n * sqrt(M_PI * k) * sin_beta0);
    return -scale + I * scale;
}

void keller_utd_terms(double n, double phi, double phi_incident, double sin_beta0, double k, double L,
                      double complex d[4])
{
    double distance[4];
    double complex factor = reduce(n, phi, phi_incident, sin_beta0, k, distance);
    for (int i = 0; i < 4; i++) {
        if (fabs(distance[i]) < KELLER_BOUNDARY_ANGLE) {
            d[i] = 0;
            continue;
        }
        /* a = 2 cos^2((2 pi n N - beta)/2) = 2 sin^2(distance/2): with the distance reduced first there is nothing
         * left to cancel next to the pole. */
        double sine = sin(0.5 * distance[i]);
        d[i] = factor * (keller_transition(2 * k * L * sine * sine) / tan(distance[i] / (2 * n)));
    }
}

/* 1 - F(x), of which 1 - F has only the digits that 1 leaves over. */
static double complex transition_rest(double x)
{
    /* F ~ sum of (2m - 1)!! (j/2x)^m; at x = 40 its smallest term is e^-40 */
    if (x < 40) return 1 - keller_transition(x);
    double complex term = 1, sum = 0;
    for (int m = 1; m <= 20; m++) {
        term *= I * ((2 * m - 1) / (2 * x));
        sum -= term;
    }
    return sum;
}

/* With x = 2kL sin^2(eps/2) and F' = F/2x - j(1 - F): cot(eps/2n)' F + cot(eps/2n) F' kL sin eps. */
static double complex slope_of(double eps, double n, double kL)
{
    if (fabs(eps) < KELLER_BOUNDARY_ANGLE) return -2 * I * n * kL;
    double half = 0.5 * eps, sine = sin(eps / (2 * n)), cotangent = 1 / tan(eps / (2 * n));
    double complex rest = transition_rest(2 * kL * sin(half) * sin(half));
    /* two poles that cancel: below 1e-4 rad their rounding, 1e-16/eps^2, is more than the next term, eps^2 */
    double steepness = fabs(eps) < 1e-4 ? -n / 6 - 1 / (3 * n) : 0.5 * cotangent / tan(half) - 0.5 / (n * sine * sine);
    return (1 - rest) * steepness - I * rest * cotangent * kL * sin(eps);
}

void keller_utd_slopes(double n, double phi, double phi_incident, double sin_beta0, double k, double L,
                       double complex slope[4])
{
    double distance[4];
    double complex factor = reduce(n, phi, phi_incident, sin_beta0, k, distance);
    for (int i = 0; i < 4; i++) slope[i] = factor * slope_of(distance[i], n, k * L);
}

void utd_terms(double n, double phi, double phi_incident, double sin_beta0, double k, double L, UtdTerm term[4])
{
    double distance[4];
    double complex factor = reduce(n, phi, phi_incident, sin_beta0, k, distance), d[4];
    keller_utd_terms(n, phi, phi_incident, sin_beta0, k, L, d);
    for (int i = 0; i < 4; i++) {
        double eps = distance[i], sine = sin(0.5 * eps);
        bool on_boundary = fabs(eps) < KELLER_BOUNDARY_ANGLE;
        double complex beside = n * sqrt(2 * M_PI * k * L) * (M_SQRT1_2 + I * M_SQRT1_2);
        double steep = on_boundary ? n : sine / tan(eps / (2 * n));
        term[i] = (UtdTerm){.x = 2 * fabs(sine) * sqrt(k * L),
                            .side = eps < 0 && !on_boundary ? -1 : 1,
                            .on_boundary = on_boundary,
                            .value = on_boundary ? factor * beside : d[i],
                            .slope = factor * slope_of(eps, n, k * L),
                            .pole_slope = factor * (-2 * I * k * L * steep * transition_rest(2 * k * L * sine * sine))};
    }
}
