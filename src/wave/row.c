/* The function of N edges (wave/pair.h has it for two),
 *     I = integral over s_1 ... s_N > 0 of exp(-sum s_i^2/2 + sum r_i s_(i-1) s_i - sum z_i s_i),
 * one integral after the other: what comes to edge i with the place s_i is a function of it, of which values at nodes are kept. Its growth
 * with s_i is taken out as a Gaussian: with p_1 = 1, p_i = 1 - r_i^2/p_(i-1), the pivots of the quadratic form,
 *     w_i(t) = integral of exp(-p (s - r t/p)^2/2 - z s) w_(i-1)(s) ds,   p = p_(i-1), r = r_i,
 * is bounded. Millington and others (1962) and Vogler (1982) have series for this; here terms of wedges and screens have their own signs,
 * sizes and z, and one pass sums them all. */
#include "wave/row.h"

#include <assert.h>
#include <cerf.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "wave/descent.h"

enum { NODES = 1024, PANEL = 16 };

/* What is left out at the far end, e^-30; and panels of so many widths of a Gaussian, on which 16 nodes have 1e-11. */
static const double far_end = 30, longest_panel = 5;

/* The places on one edge, and the four components (two waves) that come to it as functions of its place: by the sign with which its
 * own term is coupled to those of the edge before. */
typedef struct {
    uint32_t count;
    double at[NODES], weight[NODES];
    double complex field[2][NODES][4];
} Places;

/* The same behind the edge, times the terms: by the sign with which the term is coupled to those of the next edge. */
typedef struct {
    double complex field[2][NODES][4];
} Behind;

static void add_place(void *context, double s, double weight)
{
    Places *p = context;
    p->at[p->count] = s;
    p->weight[p->count++] = weight;
}

/* Places from 0 to what counts of a normal distribution of that variance, panels from that of the fastest term on, double as long
 * one after the other up to the longest one. False: there is not room for so many. */
static bool place(const RowEdge *e, double variance, double pivot, Places *p)
{
    double reach = sqrt(2 * far_end * variance), longest = longest_panel / sqrt(pivot), fastest = 0;
    for (int b = 0; b < 4; b++) fastest = fmax(fastest, e->term[b].x);
    double from = 0, length = descent_reach(M_SQRT1_2 * fastest, 1) / 8;
    p->count = 0;
    while (from < reach) {
        double to = fmin(reach, from + fmin(length, longest));
        if (p->count + PANEL > NODES) return false;
        descent_nodes(from, to, add_place, p);
        length = to; /* as far again */
        from = to;
    }
    return true;
}

/* One term with one sign of its angle, behind the edge. */
static void add_term(const RowEdge *e, int b, int side, double share, const Places *p, Behind *behind)
{
    static const int by_phi[4] = {1, -1, 1, -1}, by_phi_incident[4] = {-1, 1, 1, -1};
    const UtdTerm *term = &e->term[b];
    const Matrix *m = &e->matrix[b];
    double complex z = M_SQRT1_2 * (1 + I) * term->x, alone = sqrt(0.5 * M_PI) * w_of_z(I * M_SQRT1_2 * z);
    double complex value = -share * term->value / alone; /* the diffracted field is minus the matrices times the incident one */
    int in = by_phi_incident[b] * side > 0, out = by_phi[b] * side > 0;
    for (uint32_t i = 0; i < p->count; i++) {
        double complex factor = value * p->weight[i] * cexp(-z * p->at[i]);
        const double complex *u = p->field[in][i];
        double complex *v = behind->field[out][i];
        for (int j = 0; j < 4; j += 2) {
            v[j] += factor * (m->m[0][0] * u[j] + m->m[0][1] * u[j + 1]);
            v[j + 1] += factor * (m->m[1][0] * u[j] + m->m[1][1] * u[j + 1]);
        }
    }
}

static void add_terms(const RowEdge *e, const Places *p, Behind *behind)
{
    memset(behind, 0, sizeof *behind);
    for (int b = 0; b < 4; b++) {
        if (e->term[b].on_boundary) { /* the mean of both sides; the value given is that of the positive one */
            add_term(e, b, 1, 0.5, p, behind);
            add_term(e, b, -1, -0.5, p, behind);
        } else {
            add_term(e, b, e->term[b].side, 1, p, behind);
        }
    }
}

/* From the places behind one edge to those of the next. */
static void go_on(const Places *here, const Behind *behind, double pivot, const RowEdge *next, Places *there)
{
    double r = fabs(next->coupling);
    for (uint32_t i = 0; i < there->count; i++) {
        double middle = r * there->at[i] / pivot;
        double complex same[4] = {0}, opposite[4] = {0};
        for (uint32_t k = 0; k < here->count; k++) {
            double near = here->at[k] - middle, far = here->at[k] + middle;
            double plus = exp(-0.5 * pivot * near * near), minus = exp(-0.5 * pivot * far * far);
            const double complex *a = behind->field[1][k], *b = behind->field[0][k];
            if (plus + minus < 1e-16) continue;
            for (int j = 0; j < 4; j++) {
                same[j] += plus * a[j] + minus * b[j];
                opposite[j] += minus * a[j] + plus * b[j];
            }
        }
        const Matrix *m = &next->from;
        for (int sign = 0; sign < 2; sign++) {
            const double complex *u = (sign == 1) == (next->coupling > 0) ? same : opposite;
            double complex *v = there->field[sign][i];
            for (int j = 0; j < 4; j += 2) {
                v[j] = m->m[0][0] * u[j] + m->m[0][1] * u[j + 1];
                v[j + 1] = m->m[1][0] * u[j] + m->m[1][1] * u[j + 1];
            }
        }
    }
}

double row_share(const RowEdge edge[], uint32_t count)
{
    enum { TOGETHER = 4 };
    const double near = 8, far = 16; /* x */
    double nearest[ROW_EDGES], share = 0;
    for (uint32_t i = 0; i < count; i++) {
        double farthest = 0;
        nearest[i] = INFINITY;
        for (int b = 0; b < 4; b++) nearest[i] = fmin(nearest[i], edge[i].term[b].x);
        if (i + 1 < TOGETHER) continue;
        for (uint32_t k = i + 1 - TOGETHER; k <= i; k++) farthest = fmax(farthest, nearest[k]);
        share = fmax(share, fmin(1, (far - farthest) / (far - near)));
    }
    return share;
}

/* Pivots of the quadratic form from the first edge on and from the last one back. */
static bool pivots(const RowEdge edge[], uint32_t count, double ahead[], double back[])
{
    ahead[0] = back[count - 1] = 1;
    for (uint32_t i = 1; i < count; i++) {
        ahead[i] = 1 - edge[i].coupling * edge[i].coupling / ahead[i - 1];
        if (!(ahead[i] > 0)) return false;
    }
    for (uint32_t i = count - 1; i-- > 0;) back[i] = 1 - edge[i + 1].coupling * edge[i + 1].coupling / back[i + 1];
    return true;
}

bool row_field(const RowEdge edge[], uint32_t count, double complex field[2][2])
{
    assert(count > 0 && count <= ROW_EDGES);
    double ahead[ROW_EDGES], back[ROW_EDGES];
    if (!pivots(edge, count, ahead, back)) return false;
    Places *places = malloc(2 * sizeof *places), *here = places, *there = places + 1;
    Behind *behind = malloc(sizeof *behind);
    bool done = places && behind && place(&edge[0], 1 / (ahead[0] + back[0] - 1), ahead[0], here);
    for (uint32_t i = 0; done && i < here->count; i++)
        for (int j = 0; j < 4; j++) here->field[0][i][j] = here->field[1][i][j] = field[j / 2][j % 2];
    for (uint32_t n = 0; done && n < count; n++) {
        add_terms(&edge[n], here, behind);
        if (n + 1 == count) break;
        done = place(&edge[n + 1], 1 / (ahead[n + 1] + back[n + 1] - 1), ahead[n + 1], there);
        if (!done) break;
        go_on(here, behind, ahead[n], &edge[n + 1], there);
        Places *last = here;
        here = there;
        there = last;
    }
    for (int j = 0; done && j < 4; j++) {
        double complex sum = 0;
        for (uint32_t k = 0; k < here->count; k++)
            sum += exp(-0.5 * ahead[count - 1] * here->at[k] * here->at[k]) * (behind->field[0][k][j] + behind->field[1][k][j]);
        field[j / 2][j % 2] = sum;
    }
    free(places);
    free(behind);
    return done;
}
