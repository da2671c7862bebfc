/* The scalar coefficient of the uniform theory of diffraction: Kouyoumjian and Pathak, Proc. IEEE 62 (1974) 1448-1461.
 * docs/theory.md has the formulas in the order of the code. */
#include <cerf.h>
#include "keller/wave.h"

double complex keller_transition(double x)
{
    /* F(x) = sqrt(pi x) e^{j pi/4} w(e^{j 3 pi/4} sqrt x), w the Faddeeva function: one smooth function for all x,
     * where 1 minus Fresnel integrals would cancel. Beyond 1e15 the asymptotic series has one term left. */
    if (x <= 0) return 0;
    if (x > 1e15) return 1 + I * (0.5 / x);
    double r = sqrt(0.5 * x);
    return sqrt(M_PI) * (r + I * r) * w_of_z(-r + I * r);
}

void keller_utd_terms(double n, double phi, double phi_incident, double sin_beta0, double k, double L,
                      double complex d[4])
{
    double period = 2 * M_PI * n, difference = phi - phi_incident, sum = phi + phi_incident;
    double angle[4] = {M_PI + difference, M_PI - difference, M_PI + sum, M_PI - sum};
    /* -e^{-j pi/4} / (2 n sqrt(2 pi k) sin beta0) */
    double scale = 1 / (4 * n * sqrt(M_PI * k) * sin_beta0);
    double complex factor = -scale + I * scale;
    for (int i = 0; i < 4; i++) {
        /* To the nearest pole; the whole number is N+ for the 1st and 3rd term, -N- for the others. */
        double distance = angle[i] - period * nearbyint(angle[i] / period);
        if (fabs(distance) < KELLER_BOUNDARY_ANGLE) {
            d[i] = 0;
            continue;
        }
        /* a = 2 cos^2((2 pi n N - beta)/2) = 2 sin^2(distance/2): with the distance reduced first there is nothing
         * left to cancel next to the pole. */
        double sine = sin(0.5 * distance);
        d[i] = factor * (keller_transition(2 * k * L * sine * sine) / tan(distance / (2 * n)));
    }
}
