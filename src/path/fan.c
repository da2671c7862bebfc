/* Beams from edges. */
#include <math.h>

#include "base/number.h"
#include "path/search.h"

static const double FAN_CELL = M_PI / 5;    /* widest cone of a fan, around the edge and along beta */

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
