/* Three edges in a row, the first and the last of which know of each other by way of the middle one alone:
 *     I(x1, x2, x3) = integral of e^{-(s^2 + t^2 + u^2)/2 + r12 s t + r23 t u - z1 s - z2 t - z3 u} over s, t, u > 0,
 * z = e^{j pi/4} x (wave/pair.c). The integrals over s and u are error functions of t; the one over t is left. */
#include "wave/triple.h"

#include <assert.h>
#include <cerf.h>
#include <math.h>

#include "wave/descent.h"

/* w(j y/sqrt 2) e^{-r^2 t^2/2} at y = z - r t, continued to Re y < 0, where w itself grows: the integral over s, but for its factor
 * sqrt(pi/2), with its share of the Gaussian in t. */
static double complex shoulder(double x, double r, double t)
{
    double complex y = M_SQRT1_2 * (1 + I) * x - r * t, share = -0.5 * r * r * t * t;
    if (creal(y) >= 0) return cexp(share) * w_of_z(I * M_SQRT1_2 * y);
    return 2 * cexp(share + 0.5 * y * y) - cexp(share) * w_of_z(-I * M_SQRT1_2 * y);
}

typedef struct {
    const double *x1, *x3, *r12, *r23;
    double x2, rest;            /* rest: what the two shares leave of the Gaussian in t */
    double complex sum[4][4];
} Triple;

static void add_node(void *context, double t, double weight)
{
    Triple *e = context;
    double complex first[4], last[4];
    double complex middle = weight * cexp(-0.5 * e->rest * t * t - M_SQRT1_2 * (1 + I) * e->x2 * t);
    for (int a = 0; a < 4; a++) {
        first[a] = middle * shoulder(e->x1[a], e->r12[a], t);
        last[a] = shoulder(e->x3[a], e->r23[a], t);
    }
    for (int a = 0; a < 4; a++)
        for (int c = 0; c < 4; c++) e->sum[a][c] += first[a] * last[c];
}

void triple_values(const double x1[4], double x2, const double x3[4], const double r12[4], const double r23[4],
                   double complex value[4][4])
{
    double r1 = r12[0] * r12[0], r3 = r23[0] * r23[0];
    Triple e = {.x1 = x1, .x3 = x3, .r12 = r12, .r23 = r23, .x2 = x2, .rest = 1 - r1 - r3};
    assert(e.rest > 0);
    /* what falls fastest has gone at `near`, what falls slowest at `far`; panels that double from one to the other */
    double near = descent_reach(M_SQRT1_2 * x2, 1), far = descent_reach(M_SQRT1_2 * x2, e.rest);
    double from = 0, to = near / 8;
    while (from < far) {
        if (to > far) to = far;
        descent_nodes(from, to, add_node, &e);
        from = to;
        to = 2 * from;
    }
    double complex turn = M_SQRT1_2 * (1 + I), one[4], three[4], two = sqrt(0.5 * M_PI) * w_of_z(I * M_SQRT1_2 * turn * x2);
    for (int a = 0; a < 4; a++) {
        one[a] = w_of_z(I * M_SQRT1_2 * turn * x1[a]);
        three[a] = w_of_z(I * M_SQRT1_2 * turn * x3[a]);
    }
    for (int a = 0; a < 4; a++)
        for (int c = 0; c < 4; c++) value[a][c] = e.sum[a][c] / (one[a] * two * three[c]);
}

double complex keller_edge_triple(double x1, double x2, double x3, double r12, double r23)
{
    assert(x1 >= 0 && x2 >= 0 && x3 >= 0 && r12 * r12 + r23 * r23 < 1);
    const double first[4] = {x1, x1, x1, x1}, last[4] = {x3, x3, x3, x3};
    const double r1[4] = {r12, r12, r12, r12}, r3[4] = {r23, r23, r23, r23};
    double complex value[4][4];
    triple_values(first, x2, last, r1, r3, value);
    return value[0][0];
}
