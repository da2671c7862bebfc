#include "wave/chain.h"

#include <string.h>

#include "wave/dyad.h"
#include "wave/triple.h"

/* Derivatives of the angles to the poles by the azimuth of the diffracted ray and of the incident one. */
static const int by_phi[4] = {1, -1, 1, -1}, by_phi_incident[4] = {-1, 1, 1, -1};

static const double smallest_distance = 1e-100; /* m */

static KellerCVec3 plus(KellerCVec3 a, double complex factor, KellerCVec3 b)
{
    return (KellerCVec3){a.x + factor * b.x, a.y + factor * b.y, a.z + factor * b.z};
}

void chain_edge(double n, double phi, double phi_incident, double sin_beta0, double distance, double k, ChainEdge *e)
{
    memset(e, 0, sizeof *e);
    e->k = k;
    e->edges = 1;
    e->L = fmax(distance, smallest_distance) * sin_beta0 * sin_beta0;
    utd_terms(n, phi, phi_incident, sin_beta0, k, e->L, e->term);
    for (int a = 0; a < 4; a++) pair_side(e->term[a].x, &e->side[a]);
}

static void describe(const KellerWedgeWave *wedge, const EdgeRays *rays, double distance, double k, ChainEdge *e)
{
    chain_edge(wedge->n, rays->diffracted.phi, rays->incident.phi, rays->sin_beta0, distance, k, e);
}

static double complex component(KellerCVec3 e, KellerVec3 along) { return e.x * along.x + e.y * along.y + e.z * along.z; }

/* The edge joins the row; its matrices in term[], its coupling in `place`. */
static void join_row(ChainRow *row, const EdgeRays *rays, const UtdTerm term[4], const Matrix matrix[4], ChainPlace place)
{
    RowEdge *e = &row->edge[row->count];
    const KellerVec3 in[2] = {rays->incident.beta_hat, rays->incident.phi_hat};
    memcpy(e->term, term, sizeof e->term);
    memcpy(e->matrix, matrix, sizeof e->matrix);
    e->coupling = place.coupling;
    for (int c = 0; c < 2 && row->count > 0; c++)
        for (int d = 0; d < 2; d++) e->from.m[c][d] = component(row->carried[d], in[c]);
    KellerVec3 b = rays->diffracted.beta_hat, p = rays->diffracted.phi_hat;
    row->carried[0] = (KellerCVec3){b.x, b.y, b.z};
    row->carried[1] = (KellerCVec3){p.x, p.y, p.z};
    row->count++;
}

void chain_begin(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, ChainPlace place, double k, const KellerCVec3 e[2],
                 ChainRow *row, Chain *c)
{
    Matrix matrix[4];
    c->rays = dyad_rays(wedge, in, out);
    c->row = row;
    describe(wedge, &c->rays, place.distance, k, &c->edge);
    dyad_matrices(wedge, &c->rays, CHAIN_BLEND, k, matrix);
    memset(c->whole, 0, sizeof c->whole);
    memset(c->rest, 0, sizeof c->rest);
    for (int j = 0; j < 2; j++)
        for (int b = 0; b < 4; b++) c->whole[j][b][0] = dyad_apply(&c->rays, &matrix[b], e[j]);
    if (!row) return;
    row->count = 0;
    join_row(row, &c->rays, c->edge.term, matrix, place);
    for (int j = 0; j < 2; j++) {
        row->start[j][0] = component(e[j], c->rays.incident.beta_hat);
        row->start[j][1] = component(e[j], c->rays.incident.phi_hat);
    }
    memcpy(row->product, c->whole, sizeof row->product);
}

/* A term of the edge before with one of this edge. */
typedef struct {
    double complex ratio;       /* of the pair's transition function to both edges' own */
    double complex more;        /* what the product of the two values times the ratio lacks */
    double r;                   /* the coupling, positive where both angles have the signs that it has for */
} Pair;

static Pair pair_of(const ChainEdge *before, int a, const ChainEdge *here, int b, double coupling)
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

/* What the two pairs of three edges in a row do not know of each other: the transition function of all three over the product of
 * those of the pairs, by the terms a and c of the outer ones and b of the middle one. 1 next to exact boundaries, where the means of
 * both sides stand for the pairs, and where edges that are askew are coupled other than by way of the middle one. */
static void triples_of(const ChainEdge *before, int b, const ChainEdge *here, const double r23[4], const double complex ratio[4],
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

void chain_link(const ChainEdge *before, double coupling, ChainEdge *here, ChainLink *link)
{
    here->edges = before->edges + 1;
    memcpy(here->before, before->term, sizeof here->before);
    for (int b = 0; b < 4; b++) {
        for (int n = 0; n < 4; n++) {
            Pair p = pair_of(before, b, here, n, coupling);
            here->coupling[b][n] = p.r;
            here->ratio[b][n] = link->ratio[b][n] = p.ratio;
            link->more[b][n] = p.more;
        }
        triples_of(before, b, here, here->coupling[b], here->ratio[b], link->triple[b]);
    }
}

/* The products of terms alone, as chain_next has them. */
static void next_products(const ChainEdge *before, const ChainLink *link, const EdgeRays *rays, const Matrix matrix[4], ChainRow *row)
{
    KellerCVec3 last[2][4][4];
    memcpy(last, row->product, sizeof last);
    for (int j = 0; j < 2; j++)
        for (int n = 0; n < 4; n++)
            for (int b = 0; b < 4; b++) {
                KellerCVec3 sum = {0, 0, 0};
                double complex value = link->ratio[b][n] * chain_value(&before->term[b]);
                for (int a = 0; a < 4; a++) sum = plus(sum, link->triple[b][a][n] * value, last[j][b][a]);
                row->product[j][n][b] = dyad_apply(rays, &matrix[n], sum);
            }
}

void chain_next(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, ChainPlace place, Chain *c)
{
    Matrix matrix[4];
    Chain before = *c;
    ChainLink link;
    EdgeRays rays = c->rays = dyad_rays(wedge, in, out);
    describe(wedge, &rays, place.distance, before.edge.k, &c->edge);
    chain_link(&before.edge, place.coupling, &c->edge, &link);
    dyad_matrices(wedge, &rays, CHAIN_BLEND, before.edge.k, matrix);
    KellerCVec3 rest[2][4];
    memset(rest, 0, sizeof rest);
    for (int j = 0; j < 2; j++)
        for (int n = 0; n < 4; n++) {
            for (int b = 0; b < 4; b++) {
                double complex value = chain_value(&before.edge.term[b]);
                KellerCVec3 whole = plus((KellerCVec3){0, 0, 0}, link.ratio[b][n], before.rest[j][b]);
                for (int a = 0; a < 4; a++) {
                    whole = plus(whole, link.ratio[b][n] * link.triple[b][a][n] * value, before.whole[j][b][a]);
                    rest[j][n] = plus(rest[j][n], link.more[b][n], before.whole[j][b][a]);
                }
                c->whole[j][n][b] = dyad_apply(&rays, &matrix[n], whole);
            }
            c->rest[j][n] = dyad_apply(&rays, &matrix[n], rest[j][n]);
        }
    if (!c->row) return;
    next_products(&before.edge, &link, &rays, matrix, c->row);
    join_row(c->row, &rays, c->edge.term, matrix, place);
}

/* The products of terms with the function of all edges, in place of those of two and three. */
static void take_row(const Chain *c, KellerCVec3 e[2])
{
    double complex field[2][2];
    double share = row_share(c->row->edge, c->row->count);
    memcpy(field, c->row->start, sizeof field);
    if (!(share > 0) || !row_field(c->row->edge, c->row->count, field)) return;
    for (int j = 0; j < 2; j++) {
        for (int b = 0; b < 4; b++)
            for (int a = 0; a < 4; a++) e[j] = plus(e[j], -share * chain_value(&c->edge.term[b]), c->row->product[j][b][a]);
        for (int d = 0; d < 2; d++) {
            KellerVec3 v = d ? c->rays.diffracted.phi_hat : c->rays.diffracted.beta_hat;
            e[j] = plus(e[j], share * field[j][d], (KellerCVec3){v.x, v.y, v.z});
        }
    }
}

void chain_fields(const Chain *c, KellerCVec3 e[2])
{
    for (int j = 0; j < 2; j++) {
        e[j] = (KellerCVec3){0, 0, 0};
        for (int b = 0; b < 4; b++) {
            for (int a = 0; a < 4; a++) e[j] = plus(e[j], chain_value(&c->edge.term[b]), c->whole[j][b][a]);
            e[j] = plus(e[j], 1, c->rest[j][b]);
        }
    }
    if (c->row) take_row(c, e);
}
