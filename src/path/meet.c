/* What a beam meets. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "path/search.h"
#include "path/shortest.h"
#include "path/solve.h"

enum { BLOCKER_TRIANGLES = 64 };    /* faces of more triangles are not tried as a cone's wall: the trial would cost too much */

/* Rays cross the face's plane in a connected region; if none of them meets a border of the face, and one is inside, all are.
 * The face must lie beyond the start of every ray; touching it (within the contact tolerance) is not enough, since a leg
 * may start on it. */
bool query_blocked(const Query *q, uint32_t face, double *far)
{
    const KellerScene *scene = q->search->limits->scene;
    const KellerFace *f = &scene->faces[face];
    const Bundle *b = &q->beam->bundle;
    KellerRange at;
    double steep;
    if (f->triangle_end - f->triangle_begin > BLOCKER_TRIANGLES) return false;
    if (!bundle_crossing(b, f, q->cone.origin, q->cone.directrix, &at, &steep)) return false;
    double touch = 4 * scene->contact / steep; /* what touches the face from behind counts as being at it */
    if (!(at.near > q->start_far + touch)) return false;
    for (uint32_t i = f->triangle_begin; i < f->triangle_end; i++) {
        uint32_t id = scene->face_triangles[i];
        const uint32_t *t = scene->triangles[id];
        for (int j = 0; j < 3; j++) {
            const KellerVec3 edge[2] = {scene->vertices[t[j]], scene->vertices[t[(j + 1) % 3]]};
            if (scene->triangle_border[id] >> j & 1 && !bundle_misses(&q->test, 2, edge)) return false;
        }
    }
    KellerVec3 d = window_middle(&b->window);
    double t = (f->offset - v3_dot(f->normal, b->source[0])) / v3_dot(f->normal, d);
    uint32_t triangle;
    if (!(path_face_weight(scene, face, v3_madd(b->source[0], d, t), -1, &triangle) > 0)) return false;
    *far = at.far + touch;
    return true;
}

static bool behind_mirror(const Query *q, const KellerScene *scene, size_t n, const KellerVec3 *v)
{
    if (!(q->front != 0)) return false;
    const KellerFace *m = &scene->faces[q->beam->mirror];
    for (size_t i = 0; i < n; i++)
        if ((v3_dot(m->normal, v[i]) - m->offset) * q->front > path_rounding(scene, v[i])) return false;
    return true;
}

static double stop_if_much(Query *q)
{
    if (q->may_split && q->faces + q->wedges > q->much) {
        q->too_much = true;
        return -INFINITY;
    }
    return q->far;
}

bool query_starts_in(const Query *q, uint32_t plane)
{
    const Beam *b = q->beam;
    const KellerScene *scene = q->search->limits->scene;
    return (b->mirror != KELLER_NONE && scene->faces[b->mirror].plane == plane) ||
           (b->wedge != KELLER_NONE && path_wedge_in_plane(scene, &scene->wedges[b->wedge], plane));
}

static double visit_triangle(void *context, uint32_t id, KellerRange range)
{
    Query *q = context;
    Search *s = q->search;
    const KellerScene *scene = s->limits->scene;
    uint32_t face = scene->triangle_face[id], plane = scene->faces[face].plane;
    if (q->too_much) return -INFINITY;
    HitFace *known = s->stamp[face] == s->query ? &q->face[s->slot[face]] : NULL;
    if (known ? range.near >= known->near : query_starts_in(q, plane)) return q->far;
    const uint32_t *t = scene->triangles[id];
    KellerVec3 v[3] = {scene->vertices[t[0]], scene->vertices[t[1]], scene->vertices[t[2]]};
    if (!known && (behind_mirror(q, scene, 3, v) || bundle_misses(&q->test, 3, v))) return q->far;
    const KellerRange met = keller_cone_triangle(&q->cone, v[0], v[1], v[2], (KellerRange){q->start_near, q->far}, NULL, NULL);
    if (met.near > met.far) return q->far;
    if (known) {
        known->near = lesser(known->near, met.near);
        return q->far;
    }
    q->face = search_room(q->search, q->face, q->faces, &q->face_capacity, sizeof *q->face);
    if (s->failed) return -INFINITY;
    s->stamp[face] = s->query;
    s->slot[face] = q->faces;
    q->face[q->faces++] = (HitFace){face, met.near};
    double far;
    if (query_blocked(q, face, &far))
        q->far = lesser(q->far, path_lets_through(scene, face) ? slabs_add(&q->slabs, far) : far);
    return stop_if_much(q);
}

/* Can a wave from the sources arrive through the wedge's sector? The sources see the edge under one angle all along. */
static bool arrives(const Bundle *beam, const KellerWedge *w)
{
    if (beam->source_count > 1 && w->n < 1) return true; /* the outside is not convex: corners prove nothing */
    if (beam->source_count == 1) {
        KellerVec3 d = v3_sub(beam->source[0], w->origin);
        d = v3_madd(d, w->direction, -v3_dot(d, w->direction));
        return v3_norm(d) <= 1e-9 * (1 + v3_norm(beam->source[0])) || path_in_sector(w, d, 1e-6);
    }
    bool all_behind_first = true, all_behind_second = true;
    double open = w->n * M_PI;
    KellerVec3 tn = v3_add(v3_scale(w->tangent0, cos(open)), v3_scale(w->normal0, sin(open)));
    KellerVec3 nn = v3_cross(tn, w->direction); /* normal of the n-face, into the sector */
    for (uint32_t i = 0; i < beam->source_count; i++) {
        KellerVec3 d = v3_sub(beam->source[i], w->origin);
        double slack = 1e-6 * v3_norm(d);
        if (v3_dot(d, w->normal0) > -slack) all_behind_first = false;
        if (v3_dot(d, nn) > -slack) all_behind_second = false;
    }
    /* n >= 1: outside the sector means behind both faces' planes */
    return !(all_behind_first && all_behind_second);
}

/* Keller's law: between two points the ray over an edge meets it in one place, the solver's to the last bit. Is that on the
 * edge, and may it be on a ray of the beam? */
static bool leads_to_end(const Query *q, const KellerWedge *w)
{
    const TreeLimits *l = q->search->limits;
    const EdgeLine line = {w->origin, w->direction, w->length};
    /* wider than what path_on_edge lets an edge's ends have */
    const double pad = 4 * greater(q->test.rounding, path_rounding(l->scene, *l->target_end));
    double t;
    if (!path_shortest(*l->target_end, q->beam->bundle.source[0], 1, &line, 0, &t)) return false;
    if (t < -pad || t > w->length + pad) return false;
    const KellerVec3 place[2] = {v3_madd(w->origin, w->direction, t - pad), v3_madd(w->origin, w->direction, t + pad)};
    return !bundle_misses(&q->test, 2, place);
}

static double visit_wedge(void *context, uint32_t id, KellerRange range)
{
    Query *q = context;
    (void)range;
    const KellerScene *scene = q->search->limits->scene;
    const KellerWedge *w = &scene->wedges[id];
    if (q->too_much) return -INFINITY;
    if (q->to_end && !leads_to_end(q, w)) return q->far;
    const KellerVec3 ends[2] = {w->origin, v3_madd(w->origin, w->direction, w->length)};
    if (behind_mirror(q, scene, 2, ends)) return q->far;
    if (q->beam->wedge != KELLER_NONE) { /* the edge it fans out from, in whatever sector */
        const uint32_t *other = scene->wedges[q->beam->wedge].vertex;
        if (w->vertex[0] == other[0] && w->vertex[1] == other[1]) return q->far;
    }
    if (bundle_misses(&q->test, 2, ends) || !arrives(&q->beam->bundle, w)) return q->far;
    if (q->beam->mirror != KELLER_NONE && path_wedge_in_plane(scene, w, scene->faces[q->beam->mirror].plane)) return q->far;
    const KellerRange met = keller_cone_edge(&q->cone, ends[0], ends[1], (KellerRange){q->start_near, q->far}, NULL, NULL);
    if (met.near > met.far) return q->far;
    q->wedge = search_room(q->search, q->wedge, q->wedges, &q->wedge_capacity, sizeof *q->wedge);
    if (q->search->failed) return -INFINITY;
    q->wedge[q->wedges++] = id;
    return stop_if_much(q);
}

double beam_front(const Beam *beam, const KellerScene *scene)
{
    double front = 0;
    if (beam->mirror == KELLER_NONE) return 0;
    const KellerFace *m = &scene->faces[beam->mirror];
    const Bundle *b = &beam->bundle;
    for (uint32_t i = 0; i < b->source_count; i++) { /* the images are behind the mirror, the rays in front */
        double h = v3_dot(m->normal, b->source[i]) - m->offset, side = h > 0 ? -1 : 1;
        /* an end on the mirror itself sees both of its sides */
        if (fabs(h) <= path_rounding(scene, b->source[i]) || (i > 0 && side != front)) return 0;
        front = side;
    }
    return front;
}

/* Where the rays of a reflected beam start: at the mirror. */
static void start_at_mirror(Query *q, const KellerScene *scene)
{
    const KellerFace *m = &scene->faces[q->beam->mirror];
    const Bundle *b = &q->beam->bundle;
    KellerRange at;
    double steep;
    if (bundle_crossing(b, m, q->cone.origin, q->cone.directrix, &at, &steep)) {
        q->start_near = greater(q->start_near, at.near - scene->contact);
        q->start_far = at.far;
    } else { /* some rays run along it */
        q->start_far = 0;
        for (int i = 0; i < 8; i++) {
            KellerVec3 corner = v3(i & 1 ? scene->lower.x : scene->upper.x, i & 2 ? scene->lower.y : scene->upper.y,
                                   i & 4 ? scene->lower.z : scene->upper.z);
            q->start_far = greater(q->start_far, v3_dot(q->cone.directrix, v3_sub(corner, q->cone.origin)));
        }
    }
    q->front = beam_front(q->beam, scene);
}

static void start(Query *q)
{
    q->test = bundle_test(&q->beam->bundle, q->search->limits->scene);
    if (q->beam->mirror != KELLER_NONE) start_at_mirror(q, q->search->limits->scene);
}

bool query_of(Query *q, Search *s, const Beam *beam, uint32_t slabs)
{
    const Bundle *b = &beam->bundle;
    *q = (Query){.search = s, .beam = beam, .far = INFINITY};
    if (!keller_cone_fan(b->source_count, b->source, b->window.count, b->window.corner, &q->cone, &q->start_far)) return false;
    q->slabs.most = slabs;
    start(q);
    if (++s->query == 0) { /* all stamps used: begin anew */
        memset(s->stamp, 0, (s->limits->scene->face_count + 1) * sizeof *s->stamp);
        s->query = 1;
    }
    return true;
}

bool query_look(Query *q, Search *s, const Beam *beam)
{
    const double front = 0.1;   /* cosine */
    const Bundle *b = &beam->bundle;
    *q = (Query){.search = s, .beam = beam, .cone = {.origin = b->source[0], .directrix = window_middle(&b->window)}, .far = INFINITY};
    for (uint32_t i = 0; i < b->window.count; i++)
        if (!(v3_dot(q->cone.directrix, b->window.corner[i]) > front)) return false;
    for (uint32_t j = 1; j < b->source_count; j++) {
        const double z = v3_dot(q->cone.directrix, v3_sub(b->source[j], b->source[0]));
        q->start_near = lesser(q->start_near, z);
        q->start_far = greater(q->start_far, z);
    }
    start(q);
    return true;
}

void query_free(Query *q)
{
    free(q->face);
    free(q->wedge);
}

void query_scene(Query *q, bool faces, bool wedges)
{
    const TreeLimits *l = q->search->limits;
    const bool targets = wedges && !faces && l->targets;
    KellerRange clip = {q->start_near, q->far};
    q->to_end = targets && l->target_end && q->beam->bundle.source_count == 1;
    keller_accel_cone_loosely(targets ? l->targets : l->accel, &q->cone, clip, faces ? visit_triangle : NULL, wedges ? visit_wedge : NULL, q,
                              &q->search->work.accel);
}

bool query_piece(const Query *q, uint32_t wedge, Piece *piece)
{
    const KellerWedge *w = &q->search->limits->scene->wedges[wedge];
    KellerVec3 from_point, to_point;
    KellerRange clip = {q->start_near, q->far};
    KellerRange met = keller_cone_edge(&q->cone, w->origin, v3_madd(w->origin, w->direction, w->length), clip, &from_point,
                                       &to_point);
    if (met.near > met.far) return false;
    double a = v3_dot(v3_sub(from_point, w->origin), w->direction), b = v3_dot(v3_sub(to_point, w->origin), w->direction);
    *piece = (Piece){lesser(a, b), greater(a, b), met.near};
    double from = 0, to = 1;
    if (!bundle_part(&q->test, w->origin, v3_madd(w->origin, w->direction, w->length), &from, &to)) return false;
    piece->from = greater(piece->from, from * w->length);
    piece->to = lesser(piece->to, to * w->length);
    return piece->from <= piece->to;
}
