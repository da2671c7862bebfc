/* Integrals along a path of steepest descent, where the integrand falls without oscillating against itself. */
#ifndef KELLER_WAVE_DESCENT_H
#define KELLER_WAVE_DESCENT_H
#include <complex.h>

/* Where e^{-(slope s + curve s^2/2)} has fallen to e^{-42}, 6e-19. */
double descent_reach(double slope, double curve);

/* The integral of f(context, s), by 64 nodes of Gauss and Legendre in four panels. */
double complex descent_integral(double complex (*f)(const void *context, double s), const void *context, double from, double to);

/* Calls add(context, s, weight) at 16 nodes of Gauss and Legendre between `from` and `to`. */
void descent_nodes(double from, double to, void (*add)(void *context, double s, double weight), void *context);
#endif
