/* The transition function by the Faddeeva function of libcerf: one smooth function for all x, where 1 minus Fresnel integrals would
 * cancel. Slow, and good to 1.1e-14 |F| (libcerf's own error, largest near x = 65). */
#ifndef TEST_TRUTH_TRANSITION_H
#define TEST_TRUTH_TRANSITION_H
#include <cerf.h>
#include <complex.h>
#include <math.h>

static inline double complex transition_by_faddeeva(double x)
{
    /* F(x) = sqrt(pi x) e^{j pi/4} w(e^{j 3 pi/4} sqrt x); beyond 1e15 the asymptotic series has one term left */
    if (x <= 0) return 0;
    if (x > 1e15) return 1 + I * (0.5 / x);
    double r = sqrt(0.5 * x);
    return sqrt(M_PI) * (r + I * r) * w_of_z(-r + I * r);
}
#endif
