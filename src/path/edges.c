#include "path/edges.h"

#include <math.h>

#include "base/number.h"

KellerWedgeWave path_strip_wedge(const KellerScene *scene, uint32_t first)
{
    const KellerWedge *a = &scene->wedges[first], *b = &scene->wedges[a->twin[1]];
    return (KellerWedgeWave){.n = lesser(2, a->n + b->n - 1), .direction = a->direction, .tangent0 = a->tangent0,
                             .normal0 = a->normal0};
}

KellerWedgeWave path_edge_wave(const KellerScene *scene, const KellerPath *path, const PathEdge *e, const KellerMedium *media)
{
    uint32_t id = path->step[e->begin].id, face[2];
    const KellerWedge *w = &scene->wedges[e->first == KELLER_NONE ? id : e->first];
    KellerWedgeWave wave = {.n = w->n, .direction = w->direction, .tangent0 = w->tangent0, .normal0 = w->normal0};
    for (int j = 0; j < 2; j++) face[j] = w->face[j];
    if (e->first != KELLER_NONE) {
        wave = path_strip_wedge(scene, e->first);
        face[1] = scene->wedges[w->twin[1]].face[1];
    }
    wave.model = scene->wedge_model;
    wave.sheets = face[0] == face[1] ? 1 : 2;
    if (wave.sheets > scene->transmissions) wave.sheets = 0;
    for (int j = 0; j < 2; j++) wave.medium[j] = media[scene->faces[face[j]].material];
    return wave;
}

KellerVec3 path_beside_screen(const KellerScene *scene, uint32_t wedge, KellerVec3 outwards)
{
    const double beside = 1e-13; /* rad: far below what changes a field, far above rounding */
    const KellerWedge *w = &scene->wedges[wedge];
    if (w->n < 2 || path_along_face(w, outwards) < 0) return outwards;
    return v3_madd(outwards, scene->faces[w->face[0]].normal, beside);
}

/* The first twin of the wedge's narrowest strip up to `width`, or KELLER_NONE. */
static uint32_t strip_of(const KellerScene *scene, uint32_t wedge, double width)
{
    const KellerWedge *w = &scene->wedges[wedge];
    uint32_t found = KELLER_NONE;
    for (int side = 0; side < 2; side++) {
        if (w->twin[side] == KELLER_NONE) continue;
        double strip = scene->faces[w->face[side]].strip;
        if (strip > width) continue;
        width = strip;
        found = side == 1 ? wedge : w->twin[0];
    }
    return found;
}

static double strip_width(const KellerScene *scene, uint32_t first)
{
    return scene->faces[scene->wedges[first].face[1]].strip;
}

/* Azimuths of the source and the receiver around a strip, against its two half-planes: beyond[0] how far before the one from which on
 * the second edge is seen, beyond[1] how far behind the one up to which the first is. */
typedef struct {
    double between;             /* 0 .. 1 from the first to the second half-plane, where both edges are seen; else 0 or 1 */
    double beyond[2];
} Seen;

static Seen seen_from(const KellerScene *scene, uint32_t first, KellerVec3 v)
{
    const KellerWedge *a = &scene->wedges[first];
    KellerWedgeWave w = path_strip_wedge(scene, first);
    double azimuth = atan2(v3_dot(v, w.normal0), v3_dot(v, w.tangent0)), open = w.n * M_PI;
    if (azimuth < 0) azimuth += 2 * M_PI;
    if (azimuth > open) azimuth = azimuth - open < 2 * M_PI - azimuth ? open : 0;
    double from = (a->n - 1) * M_PI, to = a->n * M_PI;
    return (Seen){greater(0, lesser(1, (azimuth - from) / M_PI)), {from - azimuth, azimuth - to}};
}

/* The share of the one edge that the path over one of the strip's edges stands for: all where one end sees this edge only. */
static double single_weight(Seen in, Seen out, bool second)
{
    double both_first = (1 - in.between) * (1 - out.between), both_second = in.between * out.between;
    double sum = both_first + both_second;
    return sum > 0 ? (second ? both_second : both_first) / sum : 0;
}

/* Over both edges: where each end sees only the edge on its side. Otherwise there is a path over one of them. */
static bool stands_for_both(Seen in, Seen out, bool from_second)
{
    int i = from_second ? 1 : 0;
    return in.beyond[i] >= 0 && out.beyond[1 - i] >= 0;
}

static void take_as_one(const KellerScene *scene, const KellerPath *path, PathEdge *e, double *weight)
{
    uint32_t id = path->step[e->begin].id;
    Seen in = seen_from(scene, e->first, v3_scale(path->leg[e->begin], -1)), out = seen_from(scene, e->first, path->leg[e->end + 1]);
    bool second = id != e->first;
    if (e->begin == e->end) {
        *weight *= single_weight(in, out, second);
        return;
    }
    if (!stands_for_both(in, out, second)) {
        *weight = 0;
        return;
    }
    /* so that it goes over into the path over the one edge that an end comes to see together with the other */
    double depth_in = in.beyond[second ? 1 : 0], depth_out = out.beyond[second ? 0 : 1];
    e->share = depth_in + depth_out > 0 ? depth_out / (depth_in + depth_out) : 0.5;
}

void path_edges(const KellerScene *scene, const KellerPath *path, double width, PathEdges *edges)
{
    edges->count = 0;
    edges->weight = 1;
    edges->widest = 0;
    for (uint32_t i = 0; i < path->count; i++) {
        const KellerStep *step = &path->step[i];
        if (step->kind == KELLER_REFLECTION) {
            double strip = scene->faces[step->id].strip;
            if (!(strip > 0 && strip <= width)) continue;
            edges->weight = 0; /* part of what the one edge does */
            edges->widest = greater(edges->widest, strip);
        }
        if (step->kind != KELLER_DIFFRACTION) continue;
        PathEdge *e = &edges->edge[edges->count++];
        *e = (PathEdge){i, i, strip_of(scene, step->id, width), 0};
        if (e->first == KELLER_NONE) continue;
        edges->widest = greater(edges->widest, strip_width(scene, e->first));
        uint32_t other = step->id == e->first ? scene->wedges[e->first].twin[1] : e->first, at = step->id;
        for (; i + 1 < path->count && path->step[i + 1].kind == KELLER_DIFFRACTION; i++) {
            if (path->step[i + 1].id != other) break;
            if (e->end > e->begin) edges->weight = 0; /* to and fro */
            e->end = i + 1;
            other = at;
            at = path->step[i + 1].id;
        }
        take_as_one(scene, path, e, &edges->weight);
    }
}
