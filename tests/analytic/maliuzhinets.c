#include "maliuzhinets.h"
#include <math.h>

double complex maliuzhinets_function(double complex z, double half)
{
    double complex factor = 1;
    if (creal(z) < 0) z = -z;
    /* The integral converges for |Re z| < pi/2 + 2 half; well inside, its integrand falls like e^{-1.3 t}. */
    while (creal(z) > 2 * half + 0.2) {
        z -= 2 * half;
        factor /= ctan(z / 2 + M_PI / 4);
        z -= 2 * half;
        if (creal(z) < 0) z = -z;
    }
    /* exp(-1/2 of the integral over t from 0 of (cosh z t - 1)/(t cosh(pi t/2) sinh(2 half t))), an even function of t with
     * its nearest pole at j pi/(2 half), at least j/2: the trapezoidal rule is off by e^{-pi/step}, 4e-17. */
    const double step = 1.0 / 12;
    double complex sum = 0.5 * z * z / (4 * half);
    for (int i = 1; i < 340; i++) {
        double t = i * step;
        double complex s = csinh(z * t / 2) * exp(-(M_PI / 4 + half) * t);
        sum += 2 * s * s / (t * 0.25 * (1 + exp(-M_PI * t)) * (1 - exp(-4 * half * t)));
    }
    return factor * cexp(-0.5 * step * sum);
}

typedef struct {
    double half;
    double complex brewster0, brewster_n;
} Faces;

static double complex product(const Faces *f, double complex z)
{
    double complex up = z + f->half, down = z - f->half;
    return maliuzhinets_function(up + M_PI / 2 - f->brewster_n, f->half) *
           maliuzhinets_function(up - M_PI / 2 + f->brewster_n, f->half) *
           maliuzhinets_function(down - M_PI / 2 + f->brewster0, f->half) *
           maliuzhinets_function(down + M_PI / 2 - f->brewster0, f->half);
}

double complex maliuzhinets_coefficient(double n, double phi, double phi_in, double complex sine0, double complex sine_n)
{
    Faces f = {n * M_PI / 2, casin(sine0), casin(sine_n)};
    double source = phi_in - f.half, receiver = phi - f.half;
    double complex s = 0;
    for (int side = 1; side >= -1; side -= 2) {
        double u = receiver + side * M_PI;
        s += side * cos(source / n) / (n * (sin(u / n) - sin(source / n))) * product(&f, u);
    }
    return -cexp(-I * M_PI / 4) / sqrt(2 * M_PI) * s / product(&f, source);
}
