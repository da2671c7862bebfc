#include "wave/chain.h"

#include <string.h>

#include "wave/dyad.h"
#include "wave/triple.h"

/* Derivatives of the angles to the poles by the azimuth of the diffracted ray and of the incident one. */
static const int by_phi[4] = {1, -1, 1, -1}, by_phi_incident[4] = {-1, 1, 1, -1};

static const double smallest_distance = 1e-100; /* m */

/* D1 and D2 are equal where phi = phi', but not their pairs' functions with the terms of another edge. */
static const double blend = 0.1; /* rad: far from the boundaries, pi off */

static KellerCVec3 plus(KellerCVec3 a, double complex factor, KellerCVec3 b)
{
    return (KellerCVec3){a.x + factor * b.x, a.y + factor * b.y, a.z + factor * b.z};
}

static void describe(const KellerWedgeWave *wedge, const EdgeRays *rays, double distance, Chain *c)
{
    c->L = fmax(distance, smallest_distance) * rays->sin_beta0 * rays->sin_beta0;
    utd_terms(wedge->n, rays->diffracted.phi, rays->incident.phi, rays->sin_beta0, c->k, c->L, c->term);
    for (int a = 0; a < 4; a++) pair_side(c->term[a].x, &c->side[a]);
}

void chain_begin(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, ChainPlace place, double k, const KellerCVec3 e[2],
                 Chain *c)
{
    EdgeRays rays = dyad_rays(wedge, in, out);
    Matrix matrix[4];
    memset(c, 0, sizeof *c);
    c->k = k;
    c->edges = 1;
    describe(wedge, &rays, place.distance, c);
    dyad_matrices(wedge, &rays, blend, k, matrix);
    for (int j = 0; j < 2; j++)
        for (int b = 0; b < 4; b++) c->whole[j][b][0] = dyad_apply(&rays, &matrix[b], e[j]);
}

/* A term of the edge before with one of this edge. */
typedef struct {
    double complex ratio;       /* of the pair's transition function to both edges' own */
    double complex more;        /* what the product of the two values times the ratio lacks */
    double r;                   /* the coupling, positive where both angles have the signs that it has for */
} Pair;

static Pair pair_of(const Chain *before, int a, const Chain *here, int b, double coupling)
{
    const UtdTerm *s = &before->term[a], *t = &here->term[b];
    double r = by_phi[a] * by_phi_incident[b] * coupling;
    double complex same, opposite;
    pair_values(&before->side[a], &here->side[b], fabs(r), &same, &opposite);
    bool alike = r * s->side * t->side >= 0;
    Pair p = {alike ? same : opposite, 0, alike ? fabs(r) : -fabs(r)};
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

static double complex own_value(const UtdTerm *t) { return t->on_boundary ? 0 : t->value; }

/* What the two pairs of three edges in a row do not know of each other: the transition function of all three over the product of
 * those of the pairs, by the terms a and c of the outer ones and b of the middle one. 1 next to exact boundaries, where the means of
 * both sides stand for the pairs, and where edges that are askew are coupled other than by way of the middle one. */
static void triples_of(const Chain *before, int b, const Chain *here, const double r23[4], const double complex ratio[4],
                       double complex more[4][4])
{
    double x1[4], x3[4], r12[4];
    bool plain = before->edges > 1 && !before->term[b].on_boundary;
    for (int a = 0; a < 4; a++) {
        x1[a] = before->before[a].x;
        r12[a] = before->coupling[a][b];
        x3[a] = here->term[a].x;
        for (int c = 0; c < 4; c++) more[a][c] = 1;
    }
    if (!plain || r12[0] == 0 || r23[0] == 0 || !(r12[0] * r12[0] + r23[0] * r23[0] < 1)) return;
    double complex value[4][4];
    triple_values(x1, before->term[b].x, x3, r12, r23, value);
    for (int a = 0; a < 4; a++)
        for (int c = 0; c < 4; c++)
            if (!before->before[a].on_boundary && !here->term[c].on_boundary)
                more[a][c] = value[a][c] / (before->ratio[a][b] * ratio[c]);
}

void chain_next(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, ChainPlace place, Chain *c)
{
    EdgeRays rays = dyad_rays(wedge, in, out);
    Matrix matrix[4];
    Chain before = *c;
    describe(wedge, &rays, place.distance, c);
    dyad_matrices(wedge, &rays, blend, c->k, matrix);
    KellerCVec3 rest[2][4];
    memset(rest, 0, sizeof rest);
    c->edges++;
    memcpy(c->before, before.term, sizeof c->before);
    for (int b = 0; b < 4; b++) {
        double complex triple[4][4], more[4];
        for (int n = 0; n < 4; n++) {
            Pair p = pair_of(&before, b, c, n, place.coupling);
            c->coupling[b][n] = p.r;
            c->ratio[b][n] = p.ratio;
            more[n] = p.more;
        }
        triples_of(&before, b, c, c->coupling[b], c->ratio[b], triple);
        for (int n = 0; n < 4; n++)
            for (int j = 0; j < 2; j++) {
                KellerCVec3 whole = plus((KellerCVec3){0, 0, 0}, c->ratio[b][n], before.rest[j][b]);
                for (int a = 0; a < 4; a++) {
                    whole = plus(whole, c->ratio[b][n] * triple[a][n] * own_value(&before.term[b]), before.whole[j][b][a]);
                    rest[j][n] = plus(rest[j][n], more[n], before.whole[j][b][a]);
                }
                c->whole[j][n][b] = dyad_apply(&rays, &matrix[n], whole);
            }
    }
    for (int j = 0; j < 2; j++)
        for (int n = 0; n < 4; n++) c->rest[j][n] = dyad_apply(&rays, &matrix[n], rest[j][n]);
}

KellerCVec3 chain_field(const Chain *c, int wave)
{
    KellerCVec3 e = {0, 0, 0};
    for (int b = 0; b < 4; b++) {
        for (int a = 0; a < 4; a++) e = plus(e, own_value(&c->term[b]), c->whole[wave][b][a]);
        e = plus(e, 1, c->rest[wave][b]);
    }
    return e;
}
