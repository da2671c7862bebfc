#include "wave/descent.h"

#include <math.h>

/* Gauss-Legendre, 16 nodes in [-1, 1]; the other half has negative signs (Abramowitz and Stegun, table 25.4). */
enum { HALF = 8, PANELS = 4 };
static const double node[HALF] = {0.0950125098376374402, 0.2816035507792589132, 0.4580167776572273863,
                                  0.6178762444026437484, 0.7554044083550030339, 0.8656312023878317439,
                                  0.9445750230732325761, 0.9894009349916499326};
static const double weight[HALF] = {0.1894506104550684963, 0.1826034150449235889, 0.1691565193950025382,
                                    0.1495959888165767321, 0.1246289712555338720, 0.0951585116824927848,
                                    0.0622535239386478929, 0.0271524594117540949};

#define DECAY 42.0

double descent_reach(double slope, double curve) { return 2 * DECAY / (slope + sqrt(slope * slope + 2 * DECAY * curve)); }

double complex descent_integral(double complex (*f)(const void *context, double s), const void *context, double from, double to)
{
    double complex sum = 0;
    for (int p = 0; p < PANELS; p++)
        for (int i = 0; i < HALF; i++)
            for (int side = -1; side <= 1; side += 2)
                sum += weight[i] * f(context, from + (to - from) * (p + 0.5 + 0.5 * side * node[i]) / PANELS);
    return sum * (0.5 * (to - from) / PANELS);
}

void descent_nodes(double from, double to, void (*add)(void *context, double s, double weight), void *context)
{
    double half = 0.5 * (to - from), middle = 0.5 * (to + from);
    for (int i = 0; i < HALF; i++)
        for (int side = -1; side <= 1; side += 2) add(context, middle + side * half * node[i], half * weight[i]);
}
