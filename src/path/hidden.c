/* What hides all of what a beam is on its way to. One ray down its middle finds what may: it costs a hundredth of a cone's look around. */
#include <math.h>

#include "base/number.h"
#include "path/search.h"
#include "path/solve.h"

typedef struct {
    const Query *q;
    KellerVec3 a, d;            /* the segment is a + t d, t in [0, 1] */
    double near;
    uint32_t plane;             /* that it ends in: its faces are not in the way */
    bool met;
} Stop;

static bool visit_stop(void *context, uint32_t id)
{
    Stop *s = context;
    const Query *q = s->q;
    const KellerScene *scene = q->search->limits->scene;
    const uint32_t face = scene->triangle_face[id], plane = scene->faces[face].plane, *t = scene->triangles[id];
    if (plane == s->plane || query_starts_in(q, plane)) return false;
    if (q->search->limits->transmissions > 0 && path_lets_through(scene, face)) return false;
    KellerVec3 v[3];
    int positive = 0, negative = 0;
    for (int i = 0; i < 3; i++) v[i] = v3_sub(scene->vertices[t[i]], s->a);
    for (int i = 0; i < 3; i++) {
        bool up = v3_dot(s->d, v3_cross(v[i], v[(i + 1) % 3])) >= 0;
        positive += up;
        negative += !up;
    }
    if (positive && negative) return false;
    double far;
    s->met = true;
    return query_blocked(q, face, &far) && far < s->near;
}

static KellerVec3 source_middle(const Bundle *b)
{
    return b->source_count > 1 ? v3_scale(v3_add(b->source[0], b->source[1]), 0.5) : b->source[0];
}

bool query_hides(const Query *q, KellerVec3 b, double near, uint32_t plane, bool *met)
{
    const KellerScene *scene = q->search->limits->scene;
    const uint32_t mirror = q->beam->mirror;
    KellerVec3 a = source_middle(&q->beam->bundle), p;
    if (mirror != KELLER_NONE && path_cross_plane(&scene->faces[mirror], a, b, &p)) a = p; /* rays from an image start at its mirror */
    Stop s = {.q = q, .a = a, .d = v3_sub(b, a), .near = near, .plane = plane};
    bool hides = keller_accel_segment(q->search->limits->accel, a, b, 0, visit_stop, &s, &q->search->work.accel);
    *met = s.met;
    return hides;
}

WayTo way_to_face(Search *s, const Beam *beam, uint32_t face)
{
    const KellerFace *f = &s->limits->scene->faces[face];
    const KellerVec3 from = source_middle(&beam->bundle), d = window_middle(&beam->bundle.window);
    WayTo way = {false, false, 0};
    KellerRange at;
    double steep;
    Query q;
    if (!query_look(&q, s, beam)) return way;
    if (bundle_crossing(&beam->bundle, f, q.cone.origin, q.cone.directrix, &at, &steep)) {
        KellerVec3 b = v3_madd(from, d, (f->offset - v3_dot(f->normal, from)) / v3_dot(f->normal, d));
        way.hidden = query_hides(&q, b, at.near, f->plane, &way.met);
        way.length = at.far - q.start_near;
    }
    return way;
}

bool edge_hidden(Search *s, const Beam *beam, KellerVec3 a, KellerVec3 b)
{
    const Bundle *from = &beam->bundle;
    const KellerVec3 middle = v3_scale(v3_add(a, b), 0.5), along = v3_unit(v3_sub(middle, source_middle(from))), l = v3_sub(b, a);
    KellerVec3 across = v3_madd(l, along, -v3_dot(l, along)), axis[3];
    across = v3_dot(across, across) > 1e-12 * v3_dot(l, l) ? v3_unit(across) : v3_perpendicular(along);
    window_axes(along, across, axis);
    /* the directions from the sources to the edge are non-negative combinations of those from end to end */
    Window ends = {.count = 2 * from->source_count};
    for (uint32_t i = 0; i < ends.count; i++) ends.corner[i] = v3_unit(v3_sub(i % 2 ? b : a, from->source[i / 2]));
    Slopes slopes = SLOPES_NONE;
    if (!window_slopes(&ends, axis, &slopes)) return false;
    Beam narrow = *beam;
    narrow.bundle.window = window_of(axis, &slopes);
    Query q;
    bool met;
    if (!query_look(&q, s, &narrow)) return false;
    const double near = lesser(v3_dot(q.cone.directrix, v3_sub(a, q.cone.origin)), v3_dot(q.cone.directrix, v3_sub(b, q.cone.origin)));
    return query_hides(&q, middle, near, KELLER_NONE, &met);
}
