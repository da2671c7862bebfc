/* The dyad of Kouyoumjian and Pathak (1974) in the edge-fixed basis, with the faces' reflection matrices put to its terms.
 * docs/theory.md derives what is here, docs/accuracy.md compares the models. */
#include "wave/dyad.h"

/* Below this the field has reached its limit: D sqrt(s_in/(s (s_in + s))) does not depend on sin beta0 any more, while the
 * factors alone would go to 0 and infinity. */
static const double smallest_sine = 1e-12;

static Matrix multiply(Matrix a, Matrix b)
{
    Matrix c;
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++) c.m[i][j] = a.m[i][0] * b.m[0][j] + a.m[i][1] * b.m[1][j];
    return c;
}

/* `side` is the unit vector from the edge to the source or to the receiver, `travel` the direction of travel (-side or
 * side): phi_hat points to growing phi on both, beta_hat = phi_hat x travel (Kouyoumjian and Pathak). */
static EdgeFixed edge_fixed(const KellerWedgeWave *wedge, KellerVec3 side, KellerVec3 travel)
{
    EdgeFixed f;
    double x = v3_dot(side, wedge->tangent0), y = v3_dot(side, wedge->normal0), r = hypot(x, y);
    double opening = wedge->n * M_PI;
    f.phi = atan2(y, x);
    if (f.phi < 0) f.phi += 2 * M_PI;
    /* A point on a face may have been rounded to behind it. */
    if (f.phi > opening) f.phi = f.phi - opening < 2 * M_PI - f.phi ? opening : 0;
    f.sin_beta0 = r;
    f.cos_beta0 = v3_dot(travel, wedge->direction);
    f.phi_hat = r > 0 ? v3_add(v3_scale(wedge->tangent0, -y / r), v3_scale(wedge->normal0, x / r)) : wedge->normal0;
    f.beta_hat = v3_cross(f.phi_hat, travel);
    return f;
}

/* The matrix M of a face for a wave from the azimuth `angle`: the reflected field is -M times the incident one, both in
 * their edge-fixed bases, as the diffracted field is -(D_s, D_h) times it. With c = cos psi, g = cos beta0 sin psi
 * (psi: azimuth from the face), the unit vector perpendicular to the plane of incidence is (-c, g)/sin theta before and
 * (c, g)/sin theta behind the reflection, sin^2 theta = c^2 + g^2. The n-face is the 0-face's mirror image, which turns
 * phi-hat and so the signs off the diagonal. The coefficients are those of a wave from `coefficient_angle`, which a model
 * may take from the other ray. */
static Matrix face_matrix(const KellerWedgeWave *wedge, int face, double angle, double coefficient_angle,
                          double sin_beta0, double cos_beta0, double k)
{
    const KellerMedium *medium = &wedge->medium[face];
    if (medium->conductor && !(medium->roughness > 0 || medium->diffuse.coefficient > 0)) return (Matrix){{{-1, 0}, {0, 1}}};
    double psi = face == 0 ? angle : wedge->n * M_PI - angle;
    double coefficient_psi = face == 0 ? coefficient_angle : wedge->n * M_PI - coefficient_angle;
    double c = cos(psi), g = cos_beta0 * sin(psi), sine2 = c * c + g * g;
    double complex te, tm;
    keller_reflection(medium, sin_beta0 * fabs(sin(coefficient_psi)), k, &te, &tm);
    double complex half_sum = 0.5 * (tm + te), half_difference = 0.5 * (tm - te);
    /* cos and sin of twice the angle between the plane of incidence and the basis; any at normal incidence, where
     * the half sum is 0. */
    double cos2 = sine2 > 1e-30 ? (c * c - g * g) / sine2 : 1;
    double sin2 = sine2 > 1e-30 ? 2 * c * g / sine2 : 0;
    double complex off = half_sum * (face == 0 ? sin2 : -sin2);
    return (Matrix){{{half_sum * cos2 - half_difference, -off}, {off, half_sum * cos2 + half_difference}}};
}

/* What is the matrix of the exchanged path, for the path itself: exchanging turns both beta-hats over and transposes. */
static Matrix exchanged(Matrix a) { return (Matrix){{{a.m[0][0], -a.m[1][0]}, {-a.m[0][1], a.m[1][1]}}}; }

static Matrix weighted(double weight, Matrix a, Matrix b)
{
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++) a.m[i][j] = weight * a.m[i][j] + (1 - weight) * b.m[i][j];
    return a;
}

static Matrix mean(Matrix a, Matrix b) { return weighted(0.5, a, b); }

/* The two rays at the edge; exchanging the ends of the path exchanges the azimuths and turns cos beta0 over. */
typedef struct {
    double phi_in, phi, sin_beta0, cos_beta0, k;
    double outwards;            /* 1 where phi > phi', 0 where phi < phi' */
} Rays;

static Matrix there(const KellerWedgeWave *wedge, int face, const Rays *r, double coefficient_angle)
{
    return face_matrix(wedge, face, r->phi_in, coefficient_angle, r->sin_beta0, r->cos_beta0, r->k);
}

static Matrix back(const KellerWedgeWave *wedge, int face, const Rays *r, double coefficient_angle)
{
    return exchanged(face_matrix(wedge, face, r->phi, coefficient_angle, r->sin_beta0, -r->cos_beta0, r->k));
}

static const Matrix identity = {{{1, 0}, {0, 1}}};

/* ---- sectors below pi --------------------------------------------------------------------------------------------- */

/* `count` reflections, in turn in the one face and the other, of a wave from the azimuth `angle`. Behind each, the wave
 * comes from the azimuth of the image; both unit vectors of the basis turn over in between, and the signs cancel. */
static Matrix reflections(const KellerWedgeWave *wedge, int first, int count, double angle, double cos_beta0,
                          const Rays *r)
{
    Matrix product = identity;
    for (int i = 0, face = first; i < count; i++, face = 1 - face) {
        product = multiply(face_matrix(wedge, face, angle, angle, r->sin_beta0, cos_beta0, r->k), product);
        angle = face == 0 ? -angle : 2 * wedge->n * M_PI - angle;
    }
    return product;
}

/* Term i goes with the geometrical wave whose boundary is its pole, and so with that wave's reflections. Of the poles
 * 2 pi n N = pi +- beta, 2 pi n apart, each term has exactly one in the sector (beta in [-n pi, n pi] for phi - phi',
 * [0, 2 n pi] for phi + phi'). Each matrix is the mean of that at the incident ray and the exchanged path's: on the
 * boundary both are the geometrical reflection's. */
static void concave_matrices(const KellerWedgeWave *wedge, const Rays *r, Matrix term[4])
{
    double n = wedge->n;
    for (int i = 0; i < 4; i++) {
        int count = i < 2 ? 2 * (int)ceil((1 - n) / (2 * n)) : 2 * (int)ceil(1 / (2 * n)) - 1;
        int last = i % 2 == 0 ? 1 : 0, first = count % 2 == 1 ? last : 1 - last;
        term[i] = mean(reflections(wedge, first, count, r->phi_in, r->cos_beta0, r),
                       exchanged(reflections(wedge, last, count, r->phi, -r->cos_beta0, r)));
    }
}

/* ---- sectors above pi --------------------------------------------------------------------------------------------- */

/* Luebbers (1984): R_0 at the incident ray, R_n at the diffracted one. */
static void luebbers_matrices(const KellerWedgeWave *wedge, const Rays *r, Matrix term[4])
{
    term[0] = term[1] = identity;
    term[2] = back(wedge, 1, r, r->phi);
    term[3] = there(wedge, 0, r, r->phi_in);
}

/* Holm (2000): both coefficients at the smaller of the two angles to the face, and their product to the term of phi -
 * phi' that is not the shadow boundary's; his 0-face is the one nearer to the source. */
static void holm_matrices(const KellerWedgeWave *wedge, const Rays *r, Matrix term[4])
{
    double nearer0 = fmin(r->phi_in, r->phi), nearer_n = fmax(r->phi_in, r->phi);
    term[2] = there(wedge, 1, r, nearer_n);
    term[3] = there(wedge, 0, r, nearer0);
    bool on_0_side = r->phi_in <= 0.5 * wedge->n * M_PI;
    term[0] = on_0_side ? multiply(term[2], term[3]) : identity;
    term[1] = on_0_side ? identity : multiply(term[3], term[2]);
}

/* The same with a choice that exchanging the ends does not change: the product goes to the first term where phi > phi',
 * to the second where phi < phi'. Both terms are equal at phi = phi', so there is no jump. */
static void reciprocal_matrices(const KellerWedgeWave *wedge, const Rays *r, Matrix term[4])
{
    double nearer0 = fmin(r->phi_in, r->phi), nearer_n = fmax(r->phi_in, r->phi);
    term[2] = mean(there(wedge, 1, r, nearer_n), back(wedge, 1, r, nearer_n));
    term[3] = mean(there(wedge, 0, r, nearer0), back(wedge, 0, r, nearer0));
    term[0] = weighted(r->outwards, multiply(term[2], term[3]), identity);
    term[1] = weighted(r->outwards, identity, multiply(term[3], term[2]));
}

/* ---- faces that let waves through --------------------------------------------------------------------------------- */

/* What a wave from the azimuth psi from the face, or one that leaves there, is multiplied with where it goes through: the dyad
 * T_TE tt + T_TM pp, both in the incident ray's basis and in that of the ray straight on, whose unit vectors are turned over. */
static Matrix transmission(const KellerWedgeWave *wedge, int face, double psi, const Rays *r)
{
    const KellerMedium *medium = &wedge->medium[face];
    double c = cos(psi), g = r->cos_beta0 * sin(psi), sine2 = c * c + g * g, cosine = r->sin_beta0 * fabs(sin(psi));
    double complex te, tm, instead = cexp(I * (r->k * medium->thickness * cosine));
    keller_transmission(medium, cosine, r->k, &te, &tm);
    double complex half_sum = 0.5 * instead * (tm + te), half_difference = 0.5 * instead * (tm - te);
    double cos2 = sine2 > 1e-30 ? (c * c - g * g) / sine2 : 1;
    double sin2 = sine2 > 1e-30 ? 2 * c * g / sine2 : 0;
    double complex off = half_difference * (face == 0 ? sin2 : -sin2);
    return (Matrix){{{half_sum - half_difference * cos2, off}, {off, half_sum + half_difference * cos2}}};
}

/* The step at the shadow boundary is not the whole wave, but what the body does not let through: of a screen one sheet, of
 * another wedge the face on the source's side and the face on the receiver's. */
static void let_through(const KellerWedgeWave *wedge, const Rays *r, Matrix term[4])
{
    double open = wedge->n * M_PI, nearer0 = fmin(r->phi_in, r->phi), nearer_n = fmax(r->phi_in, r->phi);
    Matrix first = transmission(wedge, 0, nearer0, r), second = transmission(wedge, 1, open - nearer_n, r);
    Matrix through[2] = {multiply(first, second), multiply(second, first)}, sheet = mean(first, second);
    for (int t = 0; t < 2; t++)
        for (int i = 0; i < 4; i++)
            term[t].m[i / 2][i % 2] -= (t ? r->outwards : 1 - r->outwards) * (wedge->sheets > 1 ? through[t] : sheet).m[i / 2][i % 2];
}

/* ---- all ---------------------------------------------------------------------------------------------------------- */

EdgeRays dyad_rays(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out)
{
    EdgeRays r = {edge_fixed(wedge, v3_scale(in, -1), in), edge_fixed(wedge, out, out), 0, 0};
    /* The two angles to the edge are equal but for rounding; symmetric means keep the result reciprocal. */
    r.sin_beta0 = fmax(sqrt(r.incident.sin_beta0 * r.diffracted.sin_beta0), smallest_sine);
    r.cos_beta0 = 0.5 * (r.incident.cos_beta0 + r.diffracted.cos_beta0);
    return r;
}

void dyad_matrices(const KellerWedgeWave *wedge, const EdgeRays *rays, double blend, double k, Matrix term[4])
{
    double difference = rays->diffracted.phi - rays->incident.phi;
    double outwards = fabs(difference) < blend ? 0.5 * (1 + difference / blend) : difference > 0 ? 1 : 0;
    const Rays r = {rays->incident.phi, rays->diffracted.phi, rays->sin_beta0, rays->cos_beta0, k, outwards};
    if (wedge->n < 1) {
        concave_matrices(wedge, &r, term);
        return;
    }
    switch (wedge->model) {
    case KELLER_WEDGE_RECIPROCAL:
        reciprocal_matrices(wedge, &r, term);
        break;
    case KELLER_WEDGE_LUEBBERS:
        luebbers_matrices(wedge, &r, term);
        break;
    case KELLER_WEDGE_HOLM:
        holm_matrices(wedge, &r, term);
        break;
    }
    if (wedge->sheets > 0) let_through(wedge, &r, term);
}

static double complex dot(KellerCVec3 e, KellerVec3 v) { return e.x * v.x + e.y * v.y + e.z * v.z; }

KellerCVec3 dyad_apply(const EdgeRays *rays, const Matrix *matrix, KellerCVec3 e)
{
    double complex e_beta = dot(e, rays->incident.beta_hat), e_phi = dot(e, rays->incident.phi_hat);
    double complex f_beta = -(matrix->m[0][0] * e_beta + matrix->m[0][1] * e_phi);
    double complex f_phi = -(matrix->m[1][0] * e_beta + matrix->m[1][1] * e_phi);
    KellerVec3 b = rays->diffracted.beta_hat, p = rays->diffracted.phi_hat;
    return (KellerCVec3){f_beta * b.x + f_phi * p.x, f_beta * b.y + f_phi * p.y, f_beta * b.z + f_phi * p.z};
}
