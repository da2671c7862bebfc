/* Beams from edges. */
#include <math.h>

#include "base/number.h"
#include "path/arrival.h"
#include "path/search.h"

static const double FAN_CELL = M_PI / 5;    /* widest cone of a fan, around the edge and along beta */
static const double FLAT = 1e-3;            /* sine: where a flatter ray meets a plane is not asked */

/* Keller's law: rays leave the edge at the angle beta at which they came, whose cotangent is bounded by where the source lies, an
 * image of the end or of a piece of edge that the beam fans out from, and by the piece of this edge inside the cone. The fan is
 * covered by cells in phi, and by pieces of the edge so short that beta varies little along each. */
void search_fan(Search *s, uint32_t node, uint32_t wedge, double from, double to, uint32_t count, const KellerVec3 *source,
                uint32_t passed)
{
    const KellerWedge *w = &s->limits->scene->wedges[wedge];
    double near, far, z_low, z_high;
    path_line_distances(w, source[0], source[count - 1], &z_low, &z_high, &near, &far);
    double rounding = path_rounding(s->limits->scene, w->origin);
    if (!(far > rounding)) return; /* on the edge's own line: it does not diffract for it */
    double z = 0.5 * (z_low + z_high), rho = greater(rounding, 0.5 * (near + far));
    int pieces = (int)ceil(fabs(atan2(rho, from - z) - atan2(rho, to - z)) / (0.5 * FAN_CELL));
    pieces = pieces < 1 ? 1 : pieces > 16 ? 16 : pieces;
    int cells = (int)ceil(w->n * M_PI / FAN_CELL);
    for (int p = 0; p < pieces; p++) {
        double za = from + (to - from) * p / pieces, zb = from + (to - from) * (p + 1) / pieces;
        double low, high;
        path_cotangents(za - z_high, zb - z_low, near, far, &low, &high);
        double beta[2] = {atan2(1, high), atan2(1, low)};                 /* 0 .. pi */
        int slices = (int)ceil((beta[1] - beta[0]) / FAN_CELL);
        if (slices < 1) slices = 1;
        for (int c = 0; c < cells * slices; c++) {
            double phi_a = w->n * M_PI * (c % cells) / cells, phi_b = w->n * M_PI * (c % cells + 1) / cells;
            double beta_a = beta[0] + (beta[1] - beta[0]) * (c / cells) / slices;
            double beta_b = beta[0] + (beta[1] - beta[0]) * (c / cells + 1) / slices;
            double phi_c = 0.5 * (phi_a + phi_b), beta_c = 0.5 * (beta_a + beta_b);
            KellerVec3 radial = v3_add(v3_scale(w->tangent0, cos(phi_c)), v3_scale(w->normal0, sin(phi_c)));
            KellerVec3 axis[3] = {v3_cross(w->direction, radial)}; /* towards growing phi */
            axis[2] = v3_add(v3_scale(w->direction, cos(beta_c)), v3_scale(radial, sin(beta_c)));
            axis[1] = v3_cross(axis[2], axis[0]);
            Slopes bounds = SLOPES_NONE;
            for (int i = 0; i < 6; i++) { /* slopes are extreme at the corners, or in the middle of phi */
                double phi = i % 3 == 0 ? phi_a : i % 3 == 1 ? phi_c : phi_b, be = i < 3 ? beta_a : beta_b;
                KellerVec3 d = v3_add(v3_scale(w->direction, cos(be)),
                                      v3_scale(v3_add(v3_scale(w->tangent0, cos(phi)), v3_scale(w->normal0, sin(phi))),
                                               sin(be)));
                for (int k = 0; k < 2; k++) {
                    double slope = v3_dot(d, axis[k]) / v3_dot(d, axis[2]);
                    bounds.low[k] = lesser(bounds.low[k], slope - BEAM_PAD);
                    bounds.high[k] = greater(bounds.high[k], slope + BEAM_PAD);
                }
            }
            Beam b = {.node = node, .mirror = KELLER_NONE, .wedge = wedge,
                      .passed = passed, .piece = {za, zb}, .z = {z_low, z_high}, .rho = {near, far}};
            b.bundle = (Bundle){2, {v3_madd(w->origin, w->direction, za), v3_madd(w->origin, w->direction, zb)},
                                window_of(axis, &bounds)};
            search_beam(s, &b);
        }
    }
}

/* Where points are, from the first end of a beam's edge: along it, farther out than, and nearer to its line than, m. */
typedef struct {
    KellerRange along, out;
    double away;
} Reach;

static const Reach nowhere = {{INFINITY, -INFINITY}, {INFINITY, -INFINITY}, -INFINITY};

static void reach_add(Reach *r, KellerVec3 along, KellerVec3 out, KellerVec3 v)
{
    const double z = v3_dot(v, along), x = v3_dot(v, out);
    r->along = (KellerRange){lesser(r->along.near, z), greater(r->along.far, z)};
    r->out = (KellerRange){lesser(r->out.near, x), greater(r->out.far, x)};
    r->away = greater(r->away, v3_norm(v3_madd(v, along, -z)));
}

/* Bounds of where rays of the beam meet the face, as a place along its edge's line, z (m from its first end), and a distance from it, rho: what the
 * face's corners and what its plane's crossings with the beam's own corners span. False: not known. */
static bool reach_of(const Beam *beam, const KellerScene *scene, uint32_t face, KellerVec3 along, double z[2], double rho[2])
{
    const KellerFace *f = &scene->faces[face];
    const Bundle *b = &beam->bundle;
    const KellerVec3 middle = window_middle(&b->window), aside = v3_unit(v3_madd(middle, along, -v3_dot(middle, along))),
                     out = v3_unit(v3_madd(aside, along, -v3_dot(aside, along))); /* rays nearly along the edge leave rounding at first */
    Reach corners = nowhere, rays = nowhere;
    bool met = true, small = f->triangle_end - f->triangle_begin <= NARROW_TRIANGLES;
    for (uint32_t i = f->triangle_begin; i < f->triangle_end && small; i++)
        for (int k = 0; k < 3; k++)
            reach_add(&corners, along, out, v3_sub(scene->vertices[scene->triangles[scene->face_triangles[i]][k]], b->source[0]));
    for (uint32_t i = 0; i < 2 * b->window.count && met; i++) {
        const KellerVec3 o = b->source[i % 2], d = b->window.corner[i / 2];
        const double down = v3_dot(f->normal, d), t = (f->offset - v3_dot(f->normal, o)) / down;
        met = fabs(down) > FLAT && t > 0;
        reach_add(&rays, along, out, v3_sub(v3_madd(o, d, t), b->source[0]));
    }
    if (!met && !small) return false;
    if (!met) rays = corners;
    if (!small) corners = rays;
    z[0] = greater(rays.along.near, corners.along.near);
    z[1] = lesser(rays.along.far, corners.along.far);
    rho[0] = greater(0, greater(rays.out.near, corners.out.near));
    rho[1] = lesser(rays.away, corners.away);
    return true;
}

bool beam_narrow(Beam *beam, const KellerScene *scene, uint32_t face)
{
    const double worth = 0.9;   /* where more than that is left of the piece of edge, to cut the window anew would cost more than it spares */
    Bundle *b = &beam->bundle;
    if (!bundle_narrow(b, scene, face)) return false;
    if (b->source_count < 2 || !(v3_distance(b->source[0], b->source[1]) > 0)) return true;
    const KellerVec3 edge[2] = {b->source[0], b->source[1]}, along = v3_unit(v3_sub(edge[1], edge[0]));
    const double from = beam->piece[0], length = beam->piece[1] - from, source[2] = {beam->z[0] - from, beam->z[1] - from};
    double z[2], rho[2], on[2];
    if (!reach_of(beam, scene, face, along, z, rho)) return true;
    if (!edge_part_to(scene, edge, source, beam->rho, z, rho, on)) return false;
    on[0] = greater(on[0], 0);
    on[1] = lesser(on[1], length);
    if (on[0] > on[1]) return false;
    if (!(on[1] - on[0] < worth * length)) return true;
    for (int k = 0; k < 2; k++) {
        b->source[k] = v3_madd(edge[0], along, on[k]);
        beam->piece[k] = from + on[k];
    }
    return bundle_narrow(b, scene, face);
}
