/* The field that one edge diffracts. */
#include "wave/dyad.h"
#include "wave/utd.h"

/* Below this the field has reached its limit: D sqrt(s_in/(s (s_in + s))) depends on neither distance any more, while the
 * factors alone would go to 0 and infinity. */
static const double smallest_distance = 1e-100; /* m */

/* Of the four terms with the matrices of the faces, with the spreading of a wave that comes from one edge. */
static KellerCVec3 diffracted(const EdgeRays *rays, const double complex d[4], const Matrix matrix[4], double s_in, double s, KellerCVec3 e)
{
    Matrix sum = {{{0, 0}, {0, 0}}};
    /* sqrt(s_in/(s (s_in + s))), also for a plane wave, s_in infinite */
    double spreading = sqrt(1 / (s * (1 + s / s_in)));
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++) sum.m[j / 2][j % 2] += spreading * d[i] * matrix[i].m[j / 2][j % 2];
    return dyad_apply(rays, &sum, e);
}

KellerCVec3 keller_diffract_field(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, double s_in, double s,
                                  double k, KellerCVec3 e)
{
    EdgeRays rays = dyad_rays(wedge, in, out);
    if (s_in < smallest_distance) s_in = smallest_distance;
    if (s < smallest_distance) s = smallest_distance;

    double L = rays.sin_beta0 * rays.sin_beta0 / (1 / s_in + 1 / s);
    double complex d[4];
    Matrix matrix[4];
    keller_utd_terms(wedge->n, rays.diffracted.phi, rays.incident.phi, rays.sin_beta0, k, L, d);
    dyad_matrices(wedge, &rays, 0, k, matrix);
    return diffracted(&rays, d, matrix, s_in, s, e);
}

/* ---- slopes -------------------------------------------------------------------------------------------------------- */

double complex keller_slope_factor(double k, double distance, double sin_beta0)
{
    /* 1/(jks sin^2 beta0); within a wavelength of the edge's line there is no slope to speak of, and it stays finite */
    return -I / hypot(k * distance * sin_beta0 * sin_beta0, 1);
}

/* The derivatives of the faces' matrices by the azimuth of one of the rays, within the sector. */
static void matrix_slopes(const KellerWedgeWave *wedge, const EdgeRays *rays, bool of_receiver, double k, Matrix slope[4])
{
    const double step = 1e-5; /* rad: reflection coefficients change over some 0.01 rad at the least, at grazing incidence */
    EdgeRays beside[2] = {*rays, *rays};
    Matrix matrix[2][4];
    double azimuth[2];
    for (int i = 0; i < 2; i++) {
        double *phi = of_receiver ? &beside[i].diffracted.phi : &beside[i].incident.phi;
        *phi = azimuth[i] = fmax(0, fmin(wedge->n * M_PI, *phi + (i ? step : -step)));
        dyad_matrices(wedge, &beside[i], 0, k, matrix[i]);
    }
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++)
            slope[i].m[j / 2][j % 2] = (matrix[1][i].m[j / 2][j % 2] - matrix[0][i].m[j / 2][j % 2]) / (azimuth[1] - azimuth[0]);
}

KellerCVec3 keller_diffract_slope(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, double s_in, double s, double k,
                                  bool of_receiver, KellerCVec3 e)
{
    static const int by_azimuth[2][4] = {{-1, 1, 1, -1}, {1, -1, 1, -1}};
    EdgeRays rays = dyad_rays(wedge, in, out);
    if (s_in < smallest_distance) s_in = smallest_distance;
    if (s < smallest_distance) s = smallest_distance;

    double L = rays.sin_beta0 * rays.sin_beta0 / (1 / s_in + 1 / s);
    double complex d[4], factor = keller_slope_factor(k, of_receiver ? s : s_in, rays.sin_beta0);
    Matrix matrix[4];
    UtdTerm term[4];
    utd_terms(wedge->n, rays.diffracted.phi, rays.incident.phi, rays.sin_beta0, k, L, term);
    dyad_matrices(wedge, &rays, 0, k, matrix);
    for (int i = 0; i < 4; i++) d[i] = by_azimuth[of_receiver][i] * factor * term[i].slope;
    KellerCVec3 field = diffracted(&rays, d, matrix, s_in, s, e);
    if (wedge->medium[0].conductor && wedge->medium[1].conductor) return field;
    /* a term's own step at its boundary belongs to a geometrical wave, whose coefficients have no slope in this theory: it is left out
     * there, and the term is whole again outside of the transition zone */
    for (int i = 0; i < 4; i++) {
        double x2 = term[i].x * term[i].x;
        d[i] = term[i].on_boundary ? 0 : factor * term[i].value * (x2 / (1 + x2));
    }
    matrix_slopes(wedge, &rays, of_receiver, k, matrix);
    KellerCVec3 more = diffracted(&rays, d, matrix, s_in, s, e);
    return (KellerCVec3){field.x + more.x, field.y + more.y, field.z + more.z};
}
