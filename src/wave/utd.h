/* The terms of the uniform theory with what a second edge behind the first needs to know of them. */
#ifndef KELLER_WAVE_UTD_H
#define KELLER_WAVE_UTD_H
#include "keller/wave.h"

/* One of the four terms c cot(eps/2n) F(x^2/2), eps the angle to its pole. */
typedef struct {
    double x;                       /* 2 sqrt(kL) |sin(eps/2)| */
    int side;                       /* sign of eps; 1 on the boundary */
    bool on_boundary;               /* |eps| < KELLER_BOUNDARY_ANGLE */
    double complex value;           /* as keller_utd_terms; on the boundary its limit from eps > 0 */
    double complex slope;           /* as keller_utd_slopes */
    double complex pole_slope;      /* c cot(eps/2n) sin(eps/2) dF/d sin(eps/2) and so on: what of the slope comes from the pole
                                       alone, -2j c kL sin(eps/2) cot(eps/2n) (1 - F) */
} UtdTerm;

/* Arguments as keller_utd_terms. */
void utd_terms(double n, double phi, double phi_incident, double sin_beta0, double k, double L, UtdTerm term[4]);
#endif
