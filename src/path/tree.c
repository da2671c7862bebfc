#include "path/tree.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "path/slabs.h"

enum {
    MUCH = 24,              /* a cone that meets more than this many faces and wedges is split, where each costs cones */
    MUCH_FIRST = 8,         /* from the end itself, where everything else multiplies on what is found, */
    MUCH_LAST = 400,        /* and where each is only a candidate */
    FINER = 8,              /* the first cones are split this much finer than the aperture, */
    FEW = 2000,             /* unless the scene has fewer faces and wedges than this: nothing is worth splitting then */
    BLOCKER_TRIANGLES = 64, /* faces of more triangles are not tried as a cone's wall: the trial would cost too much */
    START = 4               /* parallel searches begin with 6 x START x START cones */
};
static const double FAN_CELL = M_PI / 5;    /* widest cone of a fan, around the edge and along beta */
static const double PAD = 1e-9;             /* relative widening of windows, far above their rounding */

/* A bundle of rays: they start in the hull of the sources (images of the end, or of the piece of edge they fan out from),
 * with slopes in the window, in a frame that is mirrored along with them. */
typedef struct {
    uint32_t node;              /* the sequence so far */
    uint32_t source_count;
    KellerVec3 source[SOURCES];
    KellerVec3 axis[3];         /* X, Y across, Z along */
    double window[2][2];        /* [X or Y][low, high] of d.X/d.Z and d.Y/d.Z */
    uint32_t mirror;            /* face it was last reflected in, or KELLER_NONE */
    uint32_t wedge;             /* wedge it fans out from, or KELLER_NONE */
    uint32_t passed;            /* slabs that each of its rays has surely passed through on the way */
} Beam;

typedef struct {
    uint32_t face;
    double near;
    double bounds[2][2];        /* slopes of the part that was hit */
} HitFace;

typedef struct {
    const TreeLimits *limits;
    Trie trie;
    TreeWork work;
    bool failed;
    uint32_t *stamp, *slot;     /* [face_count]: query that last met the face, and its place among the hits */
    uint32_t query;
} Search;

typedef struct {
    Search *search;
    const Beam *beam;
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

/* Slopes under which points of the hull of v[0..n) are seen from the hull of the sources. A slope of a mean is a mean
 * (mediant) of slopes, so the corners bound them; where a corner is not in front of a source nothing is known. */
static void slope_bounds(const Beam *beam, size_t n, const KellerVec3 *v, double bounds[2][2])
{
    double b[2][2] = {{INFINITY, -INFINITY}, {INFINITY, -INFINITY}};
    for (uint32_t i = 0; i < beam->source_count; i++)
        for (size_t j = 0; j < n; j++) {
            KellerVec3 d = v3_sub(v[j], beam->source[i]);
            double z = v3_dot(d, beam->axis[2]);
            if (!(z > 1e-6 * v3_norm(d))) {
                for (int k = 0; k < 2; k++) bounds[k][0] = -INFINITY, bounds[k][1] = INFINITY;
                return;
            }
            for (int k = 0; k < 2; k++) {
                double s = v3_dot(d, beam->axis[k]) / z;
                b[k][0] = lesser(b[k][0], s);
                b[k][1] = greater(b[k][1], s);
            }
        }
    for (int k = 0; k < 2; k++) {
        bounds[k][0] = b[k][0] - PAD * (1 + fabs(b[k][0]));
        bounds[k][1] = b[k][1] + PAD * (1 + fabs(b[k][1]));
    }
}

static bool overlap(const Beam *beam, double bounds[2][2])
{
    for (int k = 0; k < 2; k++)
        if (bounds[k][0] > beam->window[k][1] || bounds[k][1] < beam->window[k][0]) return false;
    return true;
}

/* Does the face cross the whole cone, so that nothing behind it is reached? If so *far is its farthest z. The cone's
 * section with the face's plane is connected; if it meets the face but no border of the face, it lies inside the face.
 * The face must lie beyond the start of every ray; touching it (within the contact tolerance) is not enough, since a leg
 * may start on it. */
static bool face_blocks(const Query *q, const KellerScene *scene, uint32_t face, double *far)
{
    const KellerFace *f = &scene->faces[face];
    if (f->triangle_end - f->triangle_begin > BLOCKER_TRIANGLES) return false;
    KellerRange clip = {q->start_near, INFINITY}, all = {INFINITY, -INFINITY};
    for (uint32_t i = f->triangle_begin; i < f->triangle_end; i++) {
        uint32_t id = scene->face_triangles[i];
        const uint32_t *t = scene->triangles[id];
        const KellerVec3 *v = scene->vertices;
        for (int j = 0; j < 3; j++) {
            if (!(scene->triangle_border[id] >> j & 1)) continue;
            KellerRange e = keller_cone_edge(&q->cone, v[t[j]], v[t[(j + 1) % 3]], clip, NULL, NULL);
            if (e.near <= e.far) return false;
        }
        KellerRange r = keller_cone_triangle(&q->cone, v[t[0]], v[t[1]], v[t[2]], clip, NULL, NULL);
        if (r.near <= r.far) all = (KellerRange){lesser(all.near, r.near), greater(all.far, r.far)};
    }
    /* What touches the face from behind counts as being at it: shift the plane by the contact tolerance. */
    double nz = fabs(v3_dot(f->normal, q->cone.directrix));
    double g = length2(v3_dot(f->normal, q->cone.major), v3_dot(f->normal, q->cone.minor) / q->cone.e);
    double steep = nz - q->cone.tan_alpha * g;
    if (!(steep > 1e-6) || !(all.near > q->start_far + 4 * scene->contact / steep)) return false;
    *far = all.far + 4 * scene->contact / steep;
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
    double bounds[2][2];
    slope_bounds(q->beam, 3, v, bounds);
    if (!overlap(q->beam, bounds)) return q->far;
    if (s->stamp[face] == s->query) {
        HitFace *h = &q->face[s->slot[face]];
        h->near = lesser(h->near, range.near);
        for (int k = 0; k < 2; k++) {
            h->bounds[k][0] = lesser(h->bounds[k][0], bounds[k][0]);
            h->bounds[k][1] = greater(h->bounds[k][1], bounds[k][1]);
        }
        return q->far;
    }
    q->face = with_room(q, q->face, q->faces, &q->face_capacity, sizeof *q->face);
    if (s->failed) return -INFINITY;
    s->stamp[face] = s->query;
    s->slot[face] = q->faces;
    HitFace *h = &q->face[q->faces++];
    h->face = face;
    h->near = range.near;
    memcpy(h->bounds, bounds, sizeof bounds);
    double far;
    if (face_blocks(q, scene, face, &far))
        q->far = lesser(q->far, path_lets_through(scene, face) ? slabs_add(&q->slabs, far) : far);
    return stop_if_much(q);
}

/* Can a wave from the sources arrive through the wedge's sector? The sources see the edge under one angle all along. */
static bool arrives(const Beam *beam, const KellerWedge *w)
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
    double bounds[2][2];
    slope_bounds(q->beam, 2, ends, bounds);
    if (!overlap(q->beam, bounds) || !arrives(q->beam, w)) return q->far;
    q->wedge = with_room(q, q->wedge, q->wedges, &q->wedge_capacity, sizeof *q->wedge);
    if (q->search->failed) return -INFINITY;
    q->wedge[q->wedges++] = id;
    return stop_if_much(q);
}

/* ---- what a beam becomes ------------------------------------------------------------------------------------------- */

static void reflect(Search *s, const Query *q, const HitFace *hit, uint32_t node)
{
    const KellerFace *f = &s->limits->scene->faces[hit->face];
    Beam b = *q->beam;
    b.node = node;
    b.passed += slabs_before(&q->slabs, hit->near);
    b.mirror = hit->face;
    b.wedge = KELLER_NONE;
    for (uint32_t i = 0; i < b.source_count; i++) b.source[i] = v3_mirror_point(b.source[i], f->normal, f->offset);
    for (int k = 0; k < 3; k++) b.axis[k] = v3_mirror_direction(b.axis[k], f->normal);
    for (int k = 0; k < 2; k++) {
        b.window[k][0] = greater(b.window[k][0], hit->bounds[k][0]);
        b.window[k][1] = lesser(b.window[k][1], hit->bounds[k][1]);
        if (b.window[k][0] > b.window[k][1]) return;
    }
    process(s, &b);
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
    return true;
}

/* Keller's law: rays leave the edge at the angle beta at which they came, whose cotangent is bounded by where the source lies, an
 * image of the end or of a piece of edge that the beam fans out from, and by the piece of this edge inside the cone. The fan is
 * covered by cells in phi, and by pieces of the edge so short that beta varies little along each. Patches do not fan out:
 * they meet the other end before (plan.c). */
static void fan_out(Search *s, const Query *q, uint32_t wedge, const Piece *piece, uint32_t node)
{
    const KellerWedge *w = &s->limits->scene->wedges[wedge];
    assert(q->beam->source_count <= 2);
    const KellerVec3 *source = q->beam->source;
    double near, far, z_low, z_high;
    path_line_distances(w, source[0], source[q->beam->source_count - 1], &z_low, &z_high, &near, &far);
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
            Beam b = {.node = node, .source_count = 2, .mirror = KELLER_NONE, .wedge = wedge,
                      .passed = q->beam->passed + slabs_before(&q->slabs, piece->near)};
            b.source[0] = v3_madd(w->origin, w->direction, za);
            b.source[1] = v3_madd(w->origin, w->direction, zb);
            b.axis[0] = v3_cross(w->direction, radial); /* towards growing phi */
            b.axis[2] = v3_add(v3_scale(w->direction, cos(beta_c)), v3_scale(radial, sin(beta_c)));
            b.axis[1] = v3_cross(b.axis[2], b.axis[0]);
            for (int k = 0; k < 2; k++) b.window[k][0] = INFINITY, b.window[k][1] = -INFINITY;
            for (int i = 0; i < 6; i++) { /* slopes are extreme at the corners, or in the middle of phi */
                double phi = i % 3 == 0 ? phi_a : i % 3 == 1 ? phi_c : phi_b, be = i < 3 ? beta_a : beta_b;
                KellerVec3 d = v3_add(v3_scale(w->direction, cos(be)),
                                      v3_scale(v3_add(v3_scale(w->tangent0, cos(phi)), v3_scale(w->normal0, sin(phi))),
                                               sin(be)));
                for (int k = 0; k < 2; k++) {
                    double slope = v3_dot(d, b.axis[k]) / v3_dot(d, b.axis[2]);
                    b.window[k][0] = lesser(b.window[k][0], slope - PAD);
                    b.window[k][1] = greater(b.window[k][1], slope + PAD);
                }
            }
            process(s, &b);
        }
    }
}

static void split(Search *s, const Beam *beam)
{
    int k = beam->window[1][1] - beam->window[1][0] > beam->window[0][1] - beam->window[0][0];
    double middle = 0.5 * (beam->window[k][0] + beam->window[k][1]);
    Beam half = *beam;
    half.window[k][1] = middle;
    process(s, &half);
    half = *beam;
    half.window[k][0] = middle;
    process(s, &half);
}

/* Where the rays of a reflected beam start: at the mirror. False if the cone misses it. */
static bool start_at_mirror(Query *q, const KellerScene *scene)
{
    const KellerFace *m = &scene->faces[q->beam->mirror];
    KellerRange all = {INFINITY, -INFINITY}, any = {0, INFINITY};
    for (uint32_t i = m->triangle_begin; i < m->triangle_end; i++) {
        const uint32_t *t = scene->triangles[scene->face_triangles[i]];
        const KellerVec3 *v = scene->vertices;
        KellerRange r = keller_cone_triangle(&q->cone, v[t[0]], v[t[1]], v[t[2]], any, NULL, NULL);
        if (r.near <= r.far) all = (KellerRange){lesser(all.near, r.near), greater(all.far, r.far)};
    }
    q->start_near = all.near;
    q->start_far = all.far;
    if (all.near > all.far) return false;
    double front = 0; /* the images are behind the mirror, the rays in front */
    for (uint32_t i = 0; i < q->beam->source_count; i++) {
        double h = v3_dot(m->normal, q->beam->source[i]) - m->offset;
        double side = h > 0 ? -1 : 1;
        /* an end on the mirror itself sees both of its sides */
        if (fabs(h) <= path_rounding(scene, q->beam->source[i]) || (i > 0 && side != front)) {
            front = 0;
            break;
        }
        front = side;
    }
    q->front = front;
    return true;
}

static void process(Search *s, const Beam *beam)
{
    const TreeLimits *l = s->limits;
    const KellerScene *scene = l->scene;
    if (s->failed) return;
    KellerVec3 corner[4];
    for (int i = 0; i < 4; i++)
        corner[i] = v3_add(v3_add(beam->axis[2], v3_scale(beam->axis[0], beam->window[0][i & 1])),
                           v3_scale(beam->axis[1], beam->window[1][i >> 1]));
    Query q = {.search = s, .beam = beam, .far = INFINITY};
    if (!keller_cone_fan(beam->source_count, beam->source, 4, corner, &q.cone, &q.start_far)) {
        split(s, beam);
        return;
    }
    s->work.cones++;
    if (beam->mirror != KELLER_NONE && !start_at_mirror(&q, scene)) return;
    double wide = 0;
    for (int k = 0; k < 2; k++) wide = greater(wide, beam->window[k][1] - beam->window[k][0]);
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
    bool few = scene->face_count + scene->wedge_count < FEW, first = length == 0 && beam->source_count == 1;
    q.much = l->split_over ? l->split_over : few ? MUCH_LAST : first ? MUCH_FIRST : use & PLAN_BEYOND ? MUCH : MUCH_LAST;
    /* A window narrower than the sources look wide across the scene parts nothing from anything. */
    double least = 2 * l->tan_aperture / (first ? FINER : 1);
    q.may_split = wide > greater(least, 2 * q.cone.x0 / v3_distance(scene->lower, scene->upper));
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
        const uint8_t after_wedge = l->plan->of[pattern_and(at.pattern, true)];
        for (uint32_t i = 0; i < q.faces && use & PLAN_FACE && !s->failed; i++) {
            if (q.face[i].near > q.far) continue;
            uint32_t node = trie_child(&s->trie, beam->node, code_face(q.face[i].face));
            if (node == KELLER_NONE) s->failed = true;
            else if (after_face & (PLAN_FACE | PLAN_WEDGE)) reflect(s, &q, &q.face[i], node);
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
    Beam b = {.node = 0, .source_count = count, .mirror = KELLER_NONE, .wedge = KELLER_NONE};
    memcpy(b.source, end, count * sizeof *end);
    b.axis[2] = v3_scale(unit[k], sign);
    b.axis[0] = unit[(k + 1) % 3];
    b.axis[1] = v3_cross(b.axis[2], b.axis[0]);
    b.window[0][0] = -1 + 2.0 * i / n - PAD;
    b.window[0][1] = -1 + 2.0 * (i + 1) / n + PAD;
    b.window[1][0] = -1 + 2.0 * j / n - PAD;
    b.window[1][1] = -1 + 2.0 * (j + 1) / n + PAD;
    process(s, &b);
}

bool plan_init(TreePlan *plan, uint32_t bends)
{
    *plan = (TreePlan){bends, calloc((size_t)4 << bends, 1)};
    return plan->of != NULL;
}

void plan_free(TreePlan *plan)
{
    free(plan->of);
    *plan = (TreePlan){0};
}

void plan_uses(TreePlan *plan)
{
    enum { ON = PLAN_FACE | PLAN_WEDGE };
    for (Pattern p = (1u << plan->bends) - 1; p >= PATTERN_EMPTY; p--) { /* the longer ones first */
        uint8_t face = plan->of[pattern_and(p, false)], wedge = plan->of[pattern_and(p, true)];
        if (face & (PLAN_WANT | ON)) plan->of[p] |= PLAN_FACE;
        if (wedge & (PLAN_WANT | ON)) plan->of[p] |= PLAN_WEDGE;
        if ((face | wedge) & ON) plan->of[p] |= PLAN_BEYOND;
    }
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
#pragma omp critical(keller_tree)
        {
            failed = failed || s.failed || !trie_merge(trie, &s.trie);
            work->cones += s.work.cones;
            work->accel.nodes += s.work.accel.nodes;
            work->accel.triangles += s.work.accel.triangles;
        }
        trie_free(&s.trie);
        free(s.stamp);
        free(s.slot);
    }
    if (failed) {
        trie_free(trie);
        return keller_error(error, KELLER_FAILED, TRIE_FULL);
    }
    return KELLER_OK;
}
