/* One edge in the edge-fixed basis: the rays' frames, and the matrices that the faces put to the four terms. */
#ifndef KELLER_WAVE_DYAD_H
#define KELLER_WAVE_DYAD_H
#include "keller/wave.h"

/* Components along beta0-hat and phi-hat: m[received][incident]. */
typedef struct {
    double complex m[2][2];
} Matrix;

/* A ray's side of the wedge: its azimuth around the edge in [0, n pi], its edge-fixed unit vectors. */
typedef struct {
    double phi, sin_beta0, cos_beta0;
    KellerVec3 beta_hat, phi_hat;
} EdgeFixed;

/* Both rays at an edge, and the angle to it that they share. */
typedef struct {
    EdgeFixed incident, diffracted;
    double sin_beta0, cos_beta0;    /* the sine at least 1e-12, below which the field has reached its limit */
} EdgeRays;

/* Unit directions `in` towards the edge, `out` away from it. */
EdgeRays dyad_rays(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out);

/* The matrices of the terms D1 ... D4 as the wedge's model has them. The diffracted field is minus the sum of terms times matrices
 * times the incident field. Where phi = phi' the matrices of D1 and D2 change places, which goes unseen as long as both terms have
 * one factor; else they are to do so by and by, over phi - phi' from -blend to blend (rad, 0: at once). */
void dyad_matrices(const KellerWedgeWave *wedge, const EdgeRays *rays, double blend, double k, Matrix term[4]);

/* Minus a matrix times the incident field e: a vector transverse to the diffracted ray. */
KellerCVec3 dyad_apply(const EdgeRays *rays, const Matrix *matrix, KellerCVec3 e);
#endif
