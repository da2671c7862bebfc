#include "path/edge_ends.h"

#include <math.h>

/* Cylindrical place of a point about the wedge's line. */
static double along(const KellerWedge *w, KellerVec3 p, double *across)
{
    KellerVec3 from = v3_sub(p, w->origin);
    double z = v3_dot(from, w->direction);
    *across = v3_norm(v3_madd(from, w->direction, -z));
    return z;
}

/* The end of the wedge that the shortest way over its line lies beyond; false where it lies on the wedge. (Wedges are as long as the edge
 * is straight between its two faces, so nothing of it goes on behind an end.) */
static bool nearest_end(const KellerScene *scene, uint32_t wedge, KellerVec3 tx, KellerVec3 rx, double *at)
{
    const KellerWedge *w = &scene->wedges[wedge];
    double r0, r1, z0 = along(w, tx, &r0), z1 = along(w, rx, &r1), rounding = path_rounding(scene, w->origin);
    if (r0 <= rounding || r1 <= rounding) return false; /* a station on the edge's own line */
    double apex = (z0 * r1 + z1 * r0) / (r0 + r1);
    if (apex >= 0 && apex <= w->length) return false;
    *at = apex < 0 ? 0 : w->length;
    return true;
}

static bool sees(const KellerScene *scene, const KellerAccel *accel, const KellerWedge *w, uint32_t number, KellerVec3 a,
                 KellerVec3 b,
                 KellerAccelWork *work)
{
    Crossings none = {.most = 0};
    bool grazes = false;
    PathLeg leg = {.number = number, .a = a, .b = b};
    leg.skip[number == 0] = scene->wedge_planes + w->plane_begin;
    leg.skip_count[number == 0] = w->plane_end - w->plane_begin;
    return path_leg_passes(scene, accel, &leg, &none, &grazes, work);
}

bool edge_ends_add(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, KellerVec3 rx, PathList *list,
                   KellerAccelWork *work)
{
    for (size_t i = 0; i < scene->wedge_count; i++) {
        const KellerWedge *w = &scene->wedges[i];
        double at;
        if (!nearest_end(scene, (uint32_t)i, tx, rx, &at)) continue;
        KellerVec3 end = v3_madd(w->origin, w->direction, at);
        bool inside = path_in_sector(w, v3_sub(tx, end), KELLER_BOUNDARY_ANGLE) &&
                      path_in_sector(w, v3_sub(rx, end), KELLER_BOUNDARY_ANGLE);
        if (!inside) continue;
        if (!sees(scene, accel, w, 0, tx, end, work) || !sees(scene, accel, w, 1, end, rx, work)) continue;
        KellerPath path = {.count = 1, .weight = 1, .length = v3_distance(tx, end) + v3_distance(end, rx)};
        path.step[0] = (KellerStep){KELLER_DIFFRACTION, (uint32_t)i};
        path.position[0] = end;
        path.triangle[0] = KELLER_NONE;
        path.leg[0] = v3_unit(v3_sub(end, tx));
        path.leg[1] = v3_unit(v3_sub(rx, end));
        if (!path_list_push(list, &path)) return false;
    }
    return true;
}
