#include "path/cascade.h"

#include <math.h>

#include "base/number.h"

/* Of couplings: two edges so near each other, or their neighbours so far, that they are as good as in one place. */
static const double closest = 1 - 1e-14;

/* Edges in the unfolded space, n + 1 legs. */
typedef struct {
    uint32_t count;
    double leg[KELLER_MAX_BENDS + 1];   /* m */
    double turn[KELLER_MAX_BENDS];      /* [i]: angle about leg i from edge i - 1 to edge i, seen along the leg; i > 0 */
    double share[KELLER_MAX_BENDS];     /* 1; 1/2 where the leg to edge i runs in a face of both its edges */
    bool mirrored[KELLER_MAX_BENDS];    /* right and left are exchanged at edge i, against the first edge */
} Tube;

/* The squared spreading factor of the tube, 1/m^2: 1/(s_0^2 ... s_n^2) over the product of 1/rho_i + 1/s_i, where rho_i is the
 * wavefront's radius of curvature in the plane of ray and edge as it comes to edge i (counted from 0). Behind an edge the tube has
 * the radii s (from the edge) across and rho + s along it; Euler's formula turns them to the next edge. */
static double spread2(const Tube *c)
{
    double curvature = 1 / c->leg[0], product = curvature * curvature;
    for (uint32_t i = 0; i < c->count; i++) {
        double s = c->leg[i + 1], cosine = i + 1 < c->count ? cos(c->turn[i + 1]) : 0;
        double along = 1 / (1 / curvature + s);
        product *= along / (curvature * s); /* 1/(s^2 (1/rho + 1/s)) */
        curvature = 1 / s + cosine * cosine * (along - 1 / s);
    }
    return product;
}

/* The chain without one of its edges, the ray straight on there: its edge-fixed planes before and behind become one. */
static Tube without(const Tube *c, uint32_t edge)
{
    Tube d = {.count = c->count - 1};
    for (uint32_t i = 0; i <= d.count; i++) d.leg[i] = i < edge ? c->leg[i] : c->leg[i + 1];
    d.leg[edge] = c->leg[edge] + c->leg[edge + 1];
    for (uint32_t i = 1; i < d.count; i++)
        d.turn[i] = i < edge ? c->turn[i] : i > edge ? c->turn[i + 1] : c->turn[i] + c->turn[i + 1];
    return d;
}

/* The unit vector across the ray in the plane of ray and edge, on the edge's positive side. */
static KellerVec3 across(const KellerWedge *w, KellerVec3 ray)
{
    return v3_unit(v3_madd(w->direction, ray, -v3_dot(w->direction, ray)));
}

/* Walks along the path: lengths of legs between edges, and the direction of the last edge carried through the mirrors. */
static void find_tube(const KellerScene *scene, const KellerPath *path, const PathEdges *edges, KellerVec3 tx, Tube *c)
{
    KellerVec3 last = tx, carried = v3(0, 0, 0);
    bool mirrored = false, straight = true, grazing = false;
    *c = (Tube){.count = 0};
    for (uint32_t i = 0; i < path->count; i++) {
        c->leg[c->count] += v3_distance(last, path->position[i]);
        last = path->position[i];
        if (path->step[i].kind == KELLER_REFLECTION) {
            carried = v3_mirror_direction(carried, scene->faces[path->step[i].id].normal);
            mirrored = !mirrored;
            straight = false;
        }
        if (path->step[i].kind != KELLER_DIFFRACTION) continue;
        const PathEdge *e = &edges->edge[c->count];
        const KellerWedge *w = &scene->wedges[path->step[i].id];
        KellerVec3 here = across(w, path->leg[i]);
        c->share[c->count] = 1;
        c->mirrored[c->count] = mirrored;
        if (c->count > 0) {
            double sine = v3_dot(v3_cross(carried, here), path->leg[i]);
            c->turn[c->count] = atan2(mirrored ? -sine : sine, v3_dot(carried, here));
            if (straight && grazing && path_along_face(w, v3_scale(path->leg[i], -1)) >= 0) c->share[c->count] = 0.5;
        }
        double inside = 0;
        for (; i < e->end; i++) inside += v3_distance(path->position[i], path->position[i + 1]);
        last = path->position[i];
        w = &scene->wedges[path->step[i].id];
        c->leg[c->count] += e->share * inside;
        carried = across(w, path->leg[i + 1]);
        straight = true;
        grazing = path_along_face(w, path->leg[i + 1]) >= 0;
        c->leg[++c->count] = (1 - e->share) * inside;
    }
    double walked = 0;
    for (uint32_t i = 0; i < c->count; i++) walked += c->leg[i];
    c->leg[c->count] = path->length - walked;
}

/* Points across the ray at the edges, a in the plane of ray and edge, b out of it: a way through them is longer by half the quadratic
 * form P of all of them, with 1/s_i + 1/s_(i+1) on the diagonal and -R(turn)/s beside it. */
typedef struct {
    uint32_t n;
    double diagonal[KELLER_MAX_BENDS], pivot[KELLER_MAX_BENDS]; /* the pivots are P_aa's */
    double along[KELLER_MAX_BENDS];     /* [i]: a_i to a_(i+1), b_i to b_(i+1) */
    double beside[KELLER_MAX_BENDS];    /* [i]: a_i to b_(i+1), and -b_i to a_(i+1) */
} Quadratic;

static Quadratic quadratic_of(const Tube *c)
{
    Quadratic p = {.n = c->count};
    for (uint32_t i = 0; i < p.n; i++) {
        p.diagonal[i] = p.pivot[i] = 1 / c->leg[i] + 1 / c->leg[i + 1];
        if (i > 0) p.pivot[i] -= p.along[i - 1] * p.along[i - 1] / p.pivot[i - 1];
        if (i + 1 == p.n) break;
        p.along[i] = -cos(c->turn[i + 1]) / c->leg[i + 1];
        p.beside[i] = sin(c->turn[i + 1]) / c->leg[i + 1];
    }
    return p;
}

/* P_aa x = what x was. */
static void solve(const Quadratic *p, double x[])
{
    for (uint32_t i = 1; i < p->n; i++) x[i] -= p->along[i - 1] / p->pivot[i - 1] * x[i - 1];
    for (uint32_t i = p->n; i-- > 0;) x[i] = (x[i] - (i + 1 < p->n ? p->along[i] * x[i + 1] : 0)) / p->pivot[i];
}

/* A ray over the edges is stationary in a; what is left for b is Q = P_bb - P_ba (P_aa)^-1 P_ab. Of it the neighbours' coupling;
 * and how stiff each a is, with the others free. */
static void couple(const Tube *c, double coupling[], double stiffness[])
{
    enum { N = KELLER_MAX_BENDS };
    double q[N][N] = {{0}};
    Quadratic p = quadratic_of(c);
    for (uint32_t j = 0; j < p.n; j++) {
        double x[N] = {0}, unit[N] = {0}; /* (P_aa)^-1 P_ab for b_j, and for a_j itself */
        if (j > 0) x[j - 1] = p.beside[j - 1];
        if (j + 1 < p.n) x[j + 1] = -p.beside[j];
        solve(&p, x);
        unit[j] = 1;
        solve(&p, unit);
        stiffness[j] = 1 / unit[j];
        q[j][j] = p.diagonal[j];
        if (j > 0) q[j - 1][j] = p.along[j - 1];
        for (uint32_t i = j > 0 ? j - 1 : 0; i <= j; i++) {
            if (i > 0) q[i][j] -= p.beside[i - 1] * x[i - 1];
            if (i + 1 < p.n) q[i][j] += p.beside[i] * x[i + 1];
        }
    }
    coupling[0] = 0;
    for (uint32_t i = 1; i < p.n; i++) {
        double r = q[i - 1][i] / sqrt(q[i - 1][i - 1] * q[i][i]);
        r = greater(-closest, lesser(closest, r));
        coupling[i] = c->mirrored[i] != c->mirrored[i - 1] ? -r : r;
    }
}

double path_cascade(const KellerScene *scene, const KellerPath *path, const PathEdges *edges, KellerVec3 tx, Cascade *cascade)
{
    Tube tube;
    find_tube(scene, path, edges, tx, &tube);
    cascade->count = tube.count;
    if (tube.count == 0) return 1 / path->length;
    double coupling[KELLER_MAX_BENDS];
    couple(&tube, coupling, cascade->along);
    cascade->before = tube.leg[0];
    cascade->behind = tube.leg[tube.count];
    if (tube.count == 1) return 1 / tube.leg[0]; /* a spherical wave comes to the edge */
    double square = spread2(&tube), factor = sqrt(square);
    for (uint32_t i = 0; i < tube.count; i++) {
        Tube other = without(&tube, i);
        /* so that the coefficient's step makes good for the wave that ends at its boundary */
        cascade->place[i] = (ChainPlace){spread2(&other) / square, coupling[i]};
        factor *= tube.share[i];
    }
    return factor;
}
