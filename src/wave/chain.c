#include "wave/chain.h"

#include "wave/dyad.h"

/* Derivatives of the angles to the poles by the azimuth of the diffracted ray and of the incident one. */
static const int by_phi[4] = {1, -1, 1, -1}, by_phi_incident[4] = {-1, 1, 1, -1};

static const double smallest_distance = 1e-100; /* m */

static KellerCVec3 plus(KellerCVec3 a, double complex factor, KellerCVec3 b)
{
    return (KellerCVec3){a.x + factor * b.x, a.y + factor * b.y, a.z + factor * b.z};
}

void chain_edge(double n, double phi, double phi_incident, double sin_beta0, double distance, double k, ChainEdge *e)
{
    e->k = k;
    e->L = fmax(distance, smallest_distance) * sin_beta0 * sin_beta0;
    utd_terms(n, phi, phi_incident, sin_beta0, k, e->L, e->term);
    for (int a = 0; a < 4; a++) pair_side(e->term[a].x, &e->side[a]);
}

static void describe(const KellerWedgeWave *wedge, const EdgeRays *rays, double distance, double k, ChainEdge *e)
{
    chain_edge(wedge->n, rays->diffracted.phi, rays->incident.phi, rays->sin_beta0, distance, k, e);
}

void chain_begin(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, ChainPlace place, double k, const KellerCVec3 e[2],
                 Chain *c)
{
    EdgeRays rays = dyad_rays(wedge, in, out);
    Matrix matrix[4];
    describe(wedge, &rays, place.distance, k, &c->edge);
    dyad_matrices(wedge, &rays, CHAIN_BLEND, k, matrix);
    for (int j = 0; j < 2; j++)
        for (int a = 0; a < 4; a++) {
            c->whole[j][a] = dyad_apply(&rays, &matrix[a], e[j]);
            c->rest[j][a] = (KellerCVec3){0, 0, 0};
        }
}

ChainPair chain_pair(const ChainEdge *before, int a, const ChainEdge *here, int b, double coupling)
{
    const UtdTerm *s = &before->term[a], *t = &here->term[b];
    double r = by_phi[a] * by_phi_incident[b] * coupling;
    double complex same, opposite;
    pair_values(&before->side[a], &here->side[b], fabs(r), &same, &opposite);
    bool alike = r * s->side * t->side >= 0;
    ChainPair p = {alike ? same : opposite, 0};
    /* the pair's function knows of the coefficients' slopes only what comes from the poles */
    p.more = -I * r / (before->k * sqrt(before->L * here->L)) * (s->slope * t->slope - s->pole_slope * t->pole_slope);
    if (s->on_boundary || t->on_boundary) {
        /* the mean of both sides: of the product's two signs, with the ratios that belong to them */
        double complex other = alike ? opposite : same;
        p.more += 0.5 * s->value * t->value * (p.ratio - other);
        p.ratio = 0.5 * (p.ratio + other);
    }
    return p;
}

void chain_next(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, ChainPlace place, Chain *c)
{
    EdgeRays rays = dyad_rays(wedge, in, out);
    Matrix matrix[4];
    Chain before = *c;
    double k = c->edge.k;
    describe(wedge, &rays, place.distance, k, &c->edge);
    dyad_matrices(wedge, &rays, CHAIN_BLEND, k, matrix);
    for (int b = 0; b < 4; b++) {
        KellerCVec3 whole[2] = {{0, 0, 0}, {0, 0, 0}}, rest[2] = {{0, 0, 0}, {0, 0, 0}};
        for (int a = 0; a < 4; a++) {
            ChainPair p = chain_pair(&before.edge, a, &c->edge, b, place.coupling);
            for (int j = 0; j < 2; j++) {
                whole[j] = plus(whole[j], p.ratio * chain_value(&before.edge.term[a]), before.whole[j][a]);
                whole[j] = plus(whole[j], p.ratio, before.rest[j][a]);
                rest[j] = plus(rest[j], p.more, before.whole[j][a]);
            }
        }
        for (int j = 0; j < 2; j++) {
            c->whole[j][b] = dyad_apply(&rays, &matrix[b], whole[j]);
            c->rest[j][b] = dyad_apply(&rays, &matrix[b], rest[j]);
        }
    }
}

KellerCVec3 chain_field(const Chain *c, int wave)
{
    KellerCVec3 e = {0, 0, 0};
    for (int a = 0; a < 4; a++) e = plus(plus(e, chain_value(&c->edge.term[a]), c->whole[wave][a]), 1, c->rest[wave][a]);
    return e;
}
