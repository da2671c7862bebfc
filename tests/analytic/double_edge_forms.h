/* double_edge_forms.h -- two absorbing screens in the forms that are not uniform, for the test and the bench. */
#ifndef DOUBLE_EDGE_FORMS_H
#define DOUBLE_EDGE_FORMS_H
#include "keller/wave.h"

/* Behind an edge that only casts a shadow: the term of the shadow boundary (n = 2, phi - phi' = pi + alpha), and its
 * derivative by alpha; on the boundary from the shadow's side, half the incident field. */
static inline void behind_edge(double alpha, double k, double L, double complex *d, double complex *slope)
{
    double complex terms[4], slopes[4];
    keller_utd_terms(2, 1 + M_PI + alpha, 1, 1, k, L, terms);
    keller_utd_slopes(2, 1 + M_PI + alpha, 1, 1, k, L, slopes);
    *d = fabs(alpha) < KELLER_BOUNDARY_ANGLE ? 0.5 * sqrt(L) : terms[1];
    *slope = -slopes[1];
}

/* The field relative to the free one: the product of the coefficients, and with the slope term. alpha: angles into the
 * shadow, rad; L2: the second edge's distance parameter; L1 is d1 d2/(d1 + d2). */
static inline void two_edges(double k, double d1, double d2, double d3, double alpha1, double alpha2, double L2,
                             double complex *plain, double complex *with_slope)
{
    double complex d[2], slope[2];
    double spreading = sqrt((d1 + d2 + d3) / (d1 * d2 * d3));
    behind_edge(alpha1, k, 1 / (1 / d1 + 1 / d2), &d[0], &slope[0]);
    behind_edge(alpha2, k, L2, &d[1], &slope[1]);
    *plain = spreading * d[0] * d[1];
    *with_slope = *plain + spreading * slope[0] * slope[1] / (I * k * d2);
}
#endif
