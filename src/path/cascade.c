#include "path/cascade.h"

#include <math.h>

/* A chain of edges in the unfolded space, n + 1 legs. */
typedef struct {
    uint32_t count;
    double leg[KELLER_MAX_BENDS + 1];   /* m */
    double turn[KELLER_MAX_BENDS];      /* [i]: angle about leg i from edge i - 1 to edge i, seen along the leg; i > 0 */
    double share[KELLER_MAX_BENDS];     /* 1; 1/2 where the leg to edge i runs in a face of both its edges */
} Chain;

/* The squared spreading factor of the tube, 1/m^2: 1/(s_0^2 ... s_n^2) over the product of 1/rho_i + 1/s_i, where rho_i is the
 * wavefront's radius of curvature in the plane of ray and edge as it comes to edge i (counted from 0). Behind an edge the tube has
 * the radii s (from the edge) across and rho + s along it; Euler's formula turns them to the next edge. */
static double spread2(const Chain *c)
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
static Chain without(const Chain *c, uint32_t edge)
{
    Chain d = {.count = c->count - 1};
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
static void find_chain(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, Chain *c)
{
    KellerVec3 last = tx, carried = v3(0, 0, 0);
    bool mirrored = false, straight = true, grazing = false;
    *c = (Chain){.count = 0};
    for (uint32_t i = 0; i < path->count; i++) {
        c->leg[c->count] += v3_distance(last, path->position[i]);
        last = path->position[i];
        if (path->step[i].kind == KELLER_REFLECTION) {
            carried = v3_mirror_direction(carried, scene->faces[path->step[i].id].normal);
            mirrored = !mirrored;
            straight = false;
        }
        if (path->step[i].kind != KELLER_DIFFRACTION) continue;
        const KellerWedge *w = &scene->wedges[path->step[i].id];
        KellerVec3 here = across(w, path->leg[i]);
        c->share[c->count] = 1;
        if (c->count > 0) {
            double sine = v3_dot(v3_cross(carried, here), path->leg[i]);
            c->turn[c->count] = atan2(mirrored ? -sine : sine, v3_dot(carried, here));
            if (straight && grazing && path_along_face(w, v3_scale(path->leg[i], -1)) >= 0) c->share[c->count] = 0.5;
        }
        carried = across(w, path->leg[i + 1]);
        straight = true;
        grazing = path_along_face(w, path->leg[i + 1]) >= 0;
        c->count++;
    }
    double walked = 0;
    for (uint32_t i = 0; i < c->count; i++) walked += c->leg[i];
    c->leg[c->count] = path->length - walked;
}

double path_cascade(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, Cascade *cascade)
{
    Chain chain;
    find_chain(scene, path, tx, &chain);
    cascade->count = chain.count;
    if (chain.count == 0) return 1 / path->length;
    if (chain.count == 1) { /* a spherical wave comes to the edge */
        cascade->before[0] = chain.leg[0];
        cascade->behind[0] = chain.leg[1];
        return 1 / chain.leg[0];
    }
    double square = spread2(&chain), factor = sqrt(square);
    for (uint32_t i = 0; i < chain.count; i++) {
        Chain other = without(&chain, i);
        /* L/sin^2(beta) so that the coefficient's step makes good for the wave that ends at its boundary; two equal distances d have
         * d/2 for it, and the coefficient then holds a spreading of 1/sqrt(2 d) */
        double distance = spread2(&other) / square;
        cascade->before[i] = cascade->behind[i] = 2 * distance;
        factor *= 2 * sqrt(distance) * chain.share[i];
    }
    return factor;
}
