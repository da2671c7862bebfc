#include "path/tree.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "path/slabs.h"
#include "path/solve.h"

enum {
    MUCH = 24,              /* a cone that meets more than this many faces and wedges is split, where each costs cones */
    MUCH_FIRST = 8,         /* from the end itself, where everything else multiplies on what is found, */
    MUCH_LAST = 400,        /* and where each is only a candidate */
    FINER = 8,              /* the first cones, and those behind which others follow, are split this much finer than the aperture, */
    FEW = 2000,             /* unless the scene has fewer faces and wedges than this: nothing is worth splitting then */
    PENDING_MOST = 1 << 17,
    BLOCKER_TRIANGLES = 64, /* faces of more triangles are not tried as a cone's wall: the trial would cost too much */
    START = 4               /* parallel searches begin with 6 x START x START cones */
};
static const double FAN_CELL = M_PI / 5;    /* widest cone of a fan, around the edge and along beta */
static const double NEARBY = 0.025;         /* where most of what is seen is, in diagonals of the scene */
static const double PAD = 1e-9;             /* relative widening of slopes, far above their rounding */

typedef struct {
    uint32_t node;              /* the sequence so far */
    Bundle bundle;              /* its rays: from images of the end, or of the piece of edge that they fan out from */
    uint32_t mirror;            /* face it was last reflected in, or KELLER_NONE */
    uint32_t wedge;             /* wedge it fans out from, or KELLER_NONE */
    uint32_t passed;            /* slabs that each of its rays has surely passed through on the way */
} Beam;

typedef struct {
    uint32_t face;
    double near;
} HitFace;

/* The beams of one sequence from one source, together: the smallest window in a frame of its own that holds theirs. */
typedef struct {
    uint32_t node, mirror, passed, source_count;
    KellerVec3 source[SOURCES], along;
    Slopes slopes;
} Pending;

typedef struct {
    const TreeLimits *limits;
    Trie trie;
    TreeWork work;
    bool failed;
    uint32_t *stamp, *slot;     /* [face_count]: query that last met the face, and its place among the hits */
    uint32_t query;
    Pending *pending;           /* [pending_room] sequences of which only what they meet next is asked for: the many small */
    uint32_t pending_count, pending_room;   /* beams that are found of each at different times are followed as one */
    uint32_t *place, place_capacity;    /* [nodes of the trie]: where among the pending ones a node may be */
} Search;

typedef struct {
    Search *search;
    const Beam *beam;
    BundleTest test;
    KellerCone cone;
    double start_near, start_far;   /* z where rays of the beam start */
    double front;                   /* sign of the mirror's side the rays are on; 0: no mirror, or not to be told */
    double far;                     /* nothing beyond this can be seen */
    Slabs slabs;
    bool may_split, too_much;
    uint32_t much;
    uint32_t faces, wedges, face_capacity, wedge_capacity;
    HitFace *face;
    uint32_t *wedge;
} Query;

static void process(Search *search, const Beam *beam);

/* Does the face cross all rays of the beam, so that nothing behind it is reached? If so *far is its farthest z. Rays cross its
 * plane in a connected region; if none of them meets a border of the face, and one is inside, all are.
 * The face must lie beyond the start of every ray; touching it (within the contact tolerance) is not enough, since a leg
 * may start on it. */
static bool face_blocks(const Query *q, const KellerScene *scene, uint32_t face, double *far)
{
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

/* The array with room for one more; as it was, and the search failed, without memory. */
static void *with_room(Query *q, void *array, uint32_t count, uint32_t *capacity, size_t size)
{
    if (count < *capacity) return array;
    uint32_t more = *capacity ? 2 * *capacity : 32;
    void *grown = realloc(array, more * size);
    q->search->failed = q->search->failed || !grown;
    if (!grown) return array;
    *capacity = more;
    return grown;
}

static double visit_triangle(void *context, uint32_t id, KellerRange range)
{
    Query *q = context;
    Search *s = q->search;
    const KellerScene *scene = s->limits->scene;
    uint32_t face = scene->triangle_face[id], plane = scene->faces[face].plane;
    if (q->too_much) return -INFINITY;
    if (q->beam->mirror != KELLER_NONE && scene->faces[q->beam->mirror].plane == plane) return q->far;
    if (q->beam->wedge != KELLER_NONE && path_wedge_in_plane(scene, &scene->wedges[q->beam->wedge], plane)) return q->far;
    const uint32_t *t = scene->triangles[id];
    KellerVec3 v[3] = {scene->vertices[t[0]], scene->vertices[t[1]], scene->vertices[t[2]]};
    if (behind_mirror(q, scene, 3, v)) return q->far;
    if (bundle_misses(&q->test, 3, v)) return q->far;
    if (s->stamp[face] == s->query) {
        HitFace *h = &q->face[s->slot[face]];
        h->near = lesser(h->near, range.near);
        return q->far;
    }
    q->face = with_room(q, q->face, q->faces, &q->face_capacity, sizeof *q->face);
    if (s->failed) return -INFINITY;
    s->stamp[face] = s->query;
    s->slot[face] = q->faces;
    q->face[q->faces++] = (HitFace){face, range.near};
    double far;
    if (face_blocks(q, scene, face, &far))
        q->far = lesser(q->far, path_lets_through(scene, face) ? slabs_add(&q->slabs, far) : far);
    return stop_if_much(q);
}

/* Can a wave from the sources arrive through the wedge's sector? The sources see the edge under one angle all along. */
static bool arrives(const Bundle *beam, const KellerWedge *w)
{
    if (beam->source_count > 1 && w->n < 1) return true; /* the outside is not convex: corners prove nothing */
    bool all_behind_first = true, all_behind_second = true;
    double open = w->n * M_PI;
    KellerVec3 tn = v3_add(v3_scale(w->tangent0, cos(open)), v3_scale(w->normal0, sin(open)));
    KellerVec3 nn = v3_cross(tn, w->direction); /* normal of the n-face, into the sector */
    for (uint32_t i = 0; i < beam->source_count; i++) {
        KellerVec3 d = v3_sub(beam->source[i], w->origin);
        if (beam->source_count == 1) {
            d = v3_madd(d, w->direction, -v3_dot(d, w->direction));
            return v3_norm(d) <= 1e-9 * (1 + v3_norm(beam->source[i])) || path_in_sector(w, d, 1e-6);
        }
        double slack = 1e-6 * v3_norm(d);
        if (v3_dot(d, w->normal0) > -slack) all_behind_first = false;
        if (v3_dot(d, nn) > -slack) all_behind_second = false;
    }
    /* n >= 1: outside the sector means behind both faces' planes */
    return !(all_behind_first && all_behind_second);
}

static double visit_wedge(void *context, uint32_t id, KellerRange range)
{
    Query *q = context;
    const KellerScene *scene = q->search->limits->scene;
    const KellerWedge *w = &scene->wedges[id];
    if (q->too_much) return -INFINITY;
    if (q->beam->mirror != KELLER_NONE && path_wedge_in_plane(scene, w, scene->faces[q->beam->mirror].plane)) return q->far;
    if (q->beam->wedge != KELLER_NONE) { /* the edge it fans out from, in whatever sector */
        const uint32_t *other = scene->wedges[q->beam->wedge].vertex;
        if (w->vertex[0] == other[0] && w->vertex[1] == other[1]) return q->far;
    }
    KellerVec3 ends[2] = {w->origin, v3_madd(w->origin, w->direction, w->length)};
    (void)range;
    if (behind_mirror(q, scene, 2, ends)) return q->far;
    if (bundle_misses(&q->test, 2, ends) || !arrives(&q->beam->bundle, w)) return q->far;
    q->wedge = with_room(q, q->wedge, q->wedges, &q->wedge_capacity, sizeof *q->wedge);
    if (q->search->failed) return -INFINITY;
    q->wedge[q->wedges++] = id;
    return stop_if_much(q);
}

/* ---- what a beam becomes ------------------------------------------------------------------------------------------- */

/* The beam that a face reflects; false: none. */
static bool reflected(const Query *q, const HitFace *hit, const KellerScene *scene, Beam *b)
{
    const KellerFace *f = &scene->faces[hit->face];
    *b = *q->beam;
    if (!bundle_narrow(&b->bundle, scene, hit->face)) return false;
    KellerRange at;
    double steep;
    if (bundle_crossing(&b->bundle, f, q->cone.origin, q->cone.directrix, &at, &steep) &&
        at.near > q->far + 4 * scene->contact / steep)
        return false;
    b->passed += slabs_before(&q->slabs, hit->near);
    b->mirror = hit->face;
    b->wedge = KELLER_NONE;
    bundle_mirror(&b->bundle, f);
    return true;
}

static void frame_of(KellerVec3 along, KellerVec3 axis[3])
{
    axis[2] = along;
    axis[0] = v3_perpendicular(along);
    axis[1] = v3_cross(axis[2], axis[0]);
}

/* Widens the slopes to hold those of the window; false if parts of it are not in front. */
static bool add_slopes(const Window *w, KellerVec3 along, Slopes *slopes)
{
    const double front = 0.2; /* cosine: of the widest frustum, and a little more */
    KellerVec3 axis[3];
    frame_of(along, axis);
    for (uint32_t i = 0; i < w->count; i++)
        if (!(v3_dot(w->corner[i], along) > front)) return false;
    for (uint32_t i = 0; i < w->count; i++)
        for (int k = 0; k < 2; k++) {
            double slope = v3_dot(w->corner[i], axis[k]) / v3_dot(w->corner[i], along), pad = PAD * (1 + fabs(slope));
            slopes->low[k] = lesser(slopes->low[k], slope - pad);
            slopes->high[k] = greater(slopes->high[k], slope + pad);
        }
    return true;
}

/* Follows the pending beams. */
static void follow(Search *s)
{
    uint32_t count = s->pending_count;
    s->pending_count = 0; /* nothing is added: what they meet is the last */
    for (uint32_t i = 0; i < count && !s->failed; i++) {
        const Pending *p = &s->pending[i];
        Beam b = {.node = p->node, .mirror = p->mirror, .wedge = KELLER_NONE, .passed = p->passed};
        KellerVec3 axis[3];
        frame_of(p->along, axis);
        b.bundle.source_count = p->source_count;
        memcpy(b.bundle.source, p->source, sizeof p->source);
        b.bundle.window = window_of(axis, &p->slopes);
        if (bundle_narrow(&b.bundle, s->limits->scene, p->mirror)) process(s, &b);
    }
}

/* Puts the beam off, together with others of its sequence; false if that cannot be. */
static bool put_off(Search *s, const Beam *b)
{
    if (s->place_capacity < s->trie.capacity) {
        uint32_t *grown = realloc(s->place, s->trie.capacity * sizeof *grown);
        if (!grown) return false;
        memset(grown + s->place_capacity, 0, (s->trie.capacity - s->place_capacity) * sizeof *grown);
        s->place = grown;
        s->place_capacity = s->trie.capacity;
    }
    uint32_t at = s->place[b->node];
    if (at < s->pending_count && s->pending[at].node == b->node) {
        Pending *p = &s->pending[at];
        Slopes both = p->slopes;
        if (!add_slopes(&b->bundle.window, p->along, &both)) return false;
        p->slopes = both;
        p->passed = b->passed < p->passed ? b->passed : p->passed;
        return true;
    }
    Pending fresh = {b->node, b->mirror, b->passed, b->bundle.source_count, {{0, 0, 0}}, window_middle(&b->bundle.window), SLOPES_NONE};
    memcpy(fresh.source, b->bundle.source, sizeof fresh.source);
    if (!add_slopes(&b->bundle.window, fresh.along, &fresh.slopes)) return false;
    if (s->pending_count == PENDING_MOST) follow(s);
    if (s->pending_count == s->pending_room) {
        uint32_t room = s->pending_room ? 2 * s->pending_room : 64;
        Pending *grown = realloc(s->pending, room * sizeof *grown);
        if (!grown) return false;
        s->pending = grown;
        s->pending_room = room;
    }
    s->place[b->node] = s->pending_count;
    s->pending[s->pending_count++] = fresh;
    return true;
}

/* The part of a wedge's edge inside the cone, m from its start. */
typedef struct {
    double from, to;
    double near;                /* of the cone's z */
} Piece;

static bool piece_inside(const Query *q, uint32_t wedge, Piece *piece)
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

/* Keller's law: rays leave the edge at the angle beta at which they came, whose cotangent is bounded by where the source lies, an
 * image of the end or of a piece of edge that the beam fans out from, and by the piece of this edge inside the cone. The fan is
 * covered by cells in phi, and by pieces of the edge so short that beta varies little along each. Patches do not fan out:
 * they meet the other end before (plan.c). */
static void fan_out(Search *s, const Query *q, uint32_t wedge, const Piece *piece, uint32_t node)
{
    const KellerWedge *w = &s->limits->scene->wedges[wedge];
    const Bundle *in = &q->beam->bundle;
    assert(in->source_count <= 2);
    double near, far, z_low, z_high;
    path_line_distances(w, in->source[0], in->source[in->source_count - 1], &z_low, &z_high, &near, &far);
    double rounding = path_rounding(s->limits->scene, w->origin);
    if (!(far > rounding)) return; /* on the edge's own line: it does not diffract for it */
    double from = piece->from, to = piece->to, z = 0.5 * (z_low + z_high), rho = greater(rounding, 0.5 * (near + far));
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
                    bounds.low[k] = lesser(bounds.low[k], slope - PAD);
                    bounds.high[k] = greater(bounds.high[k], slope + PAD);
                }
            }
            Beam b = {.node = node, .mirror = KELLER_NONE, .wedge = wedge,
                      .passed = q->beam->passed + slabs_before(&q->slabs, piece->near)};
            b.bundle = (Bundle){2, {v3_madd(w->origin, w->direction, za), v3_madd(w->origin, w->direction, zb)},
                                window_of(axis, &bounds)};
            process(s, &b);
        }
    }
}

static void split(Search *s, const Beam *beam)
{
    KellerVec3 across = v3(0, 0, 0);
    window_width(&beam->bundle.window, &across);
    across = v3_unit(across); /* from corner to corner, both of one length: halfway between them it is perpendicular */
    for (int side = -1; side <= 1; side += 2) {
        Beam half = *beam;
        if (window_cut(&half.bundle.window, v3_scale(across, side))) process(s, &half);
    }
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
    for (uint32_t i = 0; i < b->source_count; i++) { /* the images are behind the mirror, the rays in front */
        double h = v3_dot(m->normal, b->source[i]) - m->offset, side = h > 0 ? -1 : 1;
        /* an end on the mirror itself sees both of its sides */
        if (fabs(h) <= path_rounding(scene, b->source[i]) || (i > 0 && side != q->front)) {
            q->front = 0;
            return;
        }
        q->front = side;
    }
}

static void process(Search *s, const Beam *beam)
{
    const TreeLimits *l = s->limits;
    const KellerScene *scene = l->scene;
    if (s->failed) return;
    const Bundle *b = &beam->bundle;
    Query q = {.search = s, .beam = beam, .far = INFINITY};
    if (!keller_cone_fan(b->source_count, b->source, b->window.count, b->window.corner, &q.cone, &q.start_far)) {
        split(s, beam);
        return;
    }
    s->work.cones++;
    q.test = bundle_test(b, scene);
    if (beam->mirror != KELLER_NONE) start_at_mirror(&q, scene);
    KellerVec3 across;
    double wide = window_width(&b->window, &across);
    if (++s->query == 0) { /* all stamps used: begin anew */
        memset(s->stamp, 0, (scene->face_count + 1) * sizeof *s->stamp);
        s->query = 1;
    }
    const TrieNode at = s->trie.nodes[beam->node];
    const uint8_t use = l->plan->of[at.pattern];
    const uint32_t length = pattern_length(at.pattern);
    uint32_t together = l->interactions - (length + 1); /* the next step is none of them */
    q.slabs.most = l->transmissions < together ? l->transmissions : together;
    if (beam->passed > q.slabs.most) return;
    q.slabs.most -= beam->passed;
    bool few = scene->face_count + scene->wedge_count < FEW, first = length == 0 && b->source_count == 1;
    q.much = l->split_over ? l->split_over : few ? MUCH_LAST : first ? MUCH_FIRST : use & PLAN_BEYOND ? MUCH : MUCH_LAST;
    /* a window narrower than the sources look wide from most things parts nothing from anything */
    double least = 2 * l->tan_aperture / ((first ? FINER : 1) * (use & PLAN_BEYOND ? FINER : 1));
    q.may_split = wide > greater(least, q.cone.x0 / (NEARBY * v3_distance(scene->lower, scene->upper)));
    bool targets_only = l->targets && length + 1 == l->target_length && !(use & PLAN_FACE);
    KellerRange clip = {q.start_near, INFINITY};
    if (!targets_only) keller_accel_cone(l->accel, &q.cone, clip, visit_triangle, NULL, &q, &s->work.accel);
    clip.far = q.far;
    if (use & PLAN_WEDGE && !q.too_much && !s->failed)
        keller_accel_cone(targets_only ? l->targets : l->accel, &q.cone, clip, NULL, visit_wedge, &q, &s->work.accel);
    if (q.too_much) {
        split(s, beam);
    } else {
        const uint8_t after_face = l->plan->of[pattern_and(at.pattern, false)];
        /* pieces of an edge are different sources */
        const bool put_offs = !(after_face & PLAN_BEYOND) && pattern_wedges(at.pattern) == 0 && length > 0;
        const uint8_t after_wedge = l->plan->of[pattern_and(at.pattern, true)];
        for (uint32_t i = 0; i < q.faces && use & PLAN_FACE && !s->failed; i++) {
            Beam child;
            if (q.face[i].near > q.far || !reflected(&q, &q.face[i], scene, &child)) continue;
            child.node = trie_child(&s->trie, beam->node, code_face(q.face[i].face));
            if (child.node == KELLER_NONE) s->failed = true;
            else if (after_face & (PLAN_FACE | PLAN_WEDGE) && (!put_offs || !put_off(s, &child))) process(s, &child);
        }
        for (uint32_t i = 0; i < q.wedges && !s->failed; i++) {
            Piece piece;
            if (!piece_inside(&q, q.wedge[i], &piece)) continue;
            uint32_t node = trie_child(&s->trie, beam->node, code_wedge(q.wedge[i]));
            if (node == KELLER_NONE) {
                s->failed = true;
                break;
            }
            const double whole = scene->wedges[q.wedge[i]].length, pad = 4 * scene->contact;
            trie_light(&s->trie, node, (piece.from - pad) / whole, (piece.to + pad) / whole);
            if (after_wedge & (PLAN_FACE | PLAN_WEDGE)) fan_out(s, &q, q.wedge[i], &piece, node);
        }
    }
    free(q.face);
    free(q.wedge);
}

/* ---- the whole sphere ------------------------------------------------------------------------------------------------ */

static void search_cell(Search *s, uint32_t count, const KellerVec3 *end, int side, int i, int j, int n)
{
    int k = side / 2;
    double sign = side % 2 ? -1 : 1;
    KellerVec3 unit[3] = {v3(1, 0, 0), v3(0, 1, 0), v3(0, 0, 1)};
    Beam b = {.node = 0, .mirror = KELLER_NONE, .wedge = KELLER_NONE};
    KellerVec3 axis[3] = {unit[(k + 1) % 3]};
    axis[2] = v3_scale(unit[k], sign);
    axis[1] = v3_cross(axis[2], axis[0]);
    const Slopes bounds = {{-1 + 2.0 * i / n - PAD, -1 + 2.0 * j / n - PAD},
                           {-1 + 2.0 * (i + 1) / n + PAD, -1 + 2.0 * (j + 1) / n + PAD}};
    b.bundle.source_count = count;
    memcpy(b.bundle.source, end, count * sizeof *end);
    b.bundle.window = window_of(axis, &bounds);
    process(s, &b);
}

KellerStatus tree_search(const TreeLimits *limits, uint32_t count, const KellerVec3 *end, uint32_t threads, Trie *trie,
                         TreeWork *work, KellerError *error)
{
    int n = threads > 1 ? START : 1, cells = 6 * n * n;
    bool failed = !trie_init(trie);
    size_t faces = limits->scene->face_count + 1;
#pragma omp parallel num_threads((int)threads) if (threads > 1)
    {
        Search s = {.limits = limits, .stamp = calloc(faces, sizeof(uint32_t)), .slot = malloc(faces * sizeof(uint32_t))};
        s.failed = !s.stamp || !s.slot || !trie_init(&s.trie);
#pragma omp for schedule(dynamic, 1)
        for (int c = 0; c < cells; c++)
            if (!s.failed) search_cell(&s, count, end, c / (n * n), c / n % n, c % n, n);
        follow(&s);
#pragma omp critical(keller_tree)
        {
            failed = failed || s.failed || !trie_merge(trie, &s.trie);
            work->cones += s.work.cones;
            work->accel.nodes += s.work.accel.nodes;
            work->accel.triangles += s.work.accel.triangles;
        }
        trie_free(&s.trie);
        free(s.pending);
        free(s.place);
        free(s.stamp);
        free(s.slot);
    }
    if (failed) {
        trie_free(trie);
        return keller_error(error, KELLER_FAILED, TRIE_FULL);
    }
    return KELLER_OK;
}
