/* The field that one edge diffracts. */
#include "wave/dyad.h"

/* Below this the field has reached its limit: D sqrt(s_in/(s (s_in + s))) depends on neither distance any more, while the
 * factors alone would go to 0 and infinity. */
static const double smallest_distance = 1e-100; /* m */

KellerCVec3 keller_diffract_field(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, double s_in, double s,
                                  double k, KellerCVec3 e)
{
    EdgeRays rays = dyad_rays(wedge, in, out);
    if (s_in < smallest_distance) s_in = smallest_distance;
    if (s < smallest_distance) s = smallest_distance;

    double L = rays.sin_beta0 * rays.sin_beta0 / (1 / s_in + 1 / s);
    double complex d[4];
    keller_utd_terms(wedge->n, rays.diffracted.phi, rays.incident.phi, rays.sin_beta0, k, L, d);
    Matrix matrix[4], sum = {{{0, 0}, {0, 0}}};
    dyad_matrices(wedge, &rays, 0, k, matrix);
    /* sqrt(s_in/(s (s_in + s))), also for a plane wave, s_in infinite */
    double spreading = sqrt(1 / (s * (1 + s / s_in)));
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++) sum.m[j / 2][j % 2] += spreading * d[i] * matrix[i].m[j / 2][j % 2];
    return dyad_apply(&rays, &sum, e);
}
