/* Exact paths: mirror images for the faces, Fermat's point on the wedge in closed form, then validity. */
#include <math.h>

#include "path/internal.h"
#include "base/number.h"

/* How far the receiver's or source's image may be on the wrong side of a plane: rounding only. */
#define SIDE_SLACK 1e-12

bool path_in_sector(const KellerWedge *w, KellerVec3 v, double slack)
{
    double angle = atan2(v3_dot(v, w->normal0), v3_dot(v, w->tangent0)), open = w->n * M_PI;
    if (angle < 0) angle += 2 * M_PI;
    return angle <= open + slack || 2 * M_PI - angle <= slack;
}

bool path_wedge_in_plane(const KellerScene *scene, const KellerWedge *wedge, uint32_t plane)
{
    for (uint32_t i = wedge->plane_begin; i < wedge->plane_end; i++)
        if (scene->wedge_planes[i] == plane) return true;
    return false;
}

/* ---- is a point inside a face? --------------------------------------------------------------------------------- */

typedef struct {
    double u, v;
} Flat;

static Flat flatten(KellerVec3 p, int axis)
{
    return axis == 0 ? (Flat){p.y, p.z} : axis == 1 ? (Flat){p.z, p.x} : (Flat){p.x, p.y};
}

static double area2(Flat a, Flat b, Flat c) { return (b.u - a.u) * (c.v - a.v) - (b.v - a.v) * (c.u - a.u); }

static double segment_distance(KellerVec3 p, KellerVec3 a, KellerVec3 b)
{
    KellerVec3 l = v3_sub(b, a);
    double t = v3_dot(v3_sub(p, a), l) / v3_dot(l, l);
    return v3_distance(p, v3_madd(a, l, greater(0, lesser(1, t))));
}

/* 1 inside, 0 outside, 1/2 within h of the face's border (h < 0: never); *triangle is the one that holds p (the one nearest to p's
 * border otherwise). On an edge between two triangles of the face exactly one claims p: the edge's function is evaluated
 * with its ends in the order of ids, and zero belongs to the forward side. */
static double face_weight(const KellerScene *scene, uint32_t face, KellerVec3 p, double h, uint32_t *triangle)
{
    const KellerFace *f = &scene->faces[face];
    double nx = fabs(f->normal.x), ny = fabs(f->normal.y), nz = fabs(f->normal.z);
    int axis = nx >= ny && nx >= nz ? 0 : ny >= nz ? 1 : 2;
    Flat q = flatten(p, axis);
    uint32_t holder = KELLER_NONE, border = KELLER_NONE;
    for (uint32_t i = f->triangle_begin; i < f->triangle_end; i++) {
        uint32_t id = scene->face_triangles[i];
        const uint32_t *t = scene->triangles[id];
        KellerVec3 v[3] = {scene->vertices[t[0]], scene->vertices[t[1]], scene->vertices[t[2]]};
        Flat w[3] = {flatten(v[0], axis), flatten(v[1], axis), flatten(v[2], axis)};
        bool left = area2(w[0], w[1], w[2]) > 0, in = true;
        for (int j = 0; j < 3; j++) {
            int k = (j + 1) % 3;
            bool forward = t[j] < t[k];
            double s = forward ? area2(w[j], w[k], q) : area2(w[k], w[j], q);
            if ((s >= 0) != (forward == left)) in = false;
            if (scene->triangle_border[id] >> j & 1 && segment_distance(p, v[j], v[k]) <= h) border = id;
        }
        if (in && holder == KELLER_NONE) holder = id;
    }
    *triangle = holder != KELLER_NONE ? holder : border;
    return border != KELLER_NONE ? 0.5 : holder != KELLER_NONE ? 1 : 0;
}

typedef struct {
    const KellerScene *scene;
    uint32_t face, plane;
    KellerVec3 p;
} Owner;

static bool visit_owner(void *context, uint32_t id)
{
    Owner *o = context;
    uint32_t face = o->scene->triangle_face[id], triangle;
    return face < o->face && o->scene->faces[face].plane == o->plane &&
           face_weight(o->scene, face, o->p, -1, &triangle) > 0;
}

/* Where faces of one plane coincide, the wave meets one of them: the one with the lowest id (SPEC 6). */
static bool owns(const KellerScene *scene, const KellerAccel *accel, uint32_t face, KellerVec3 p, KellerAccelWork *work)
{
    Owner o = {scene, face, scene->faces[face].plane, p};
    KellerVec3 n = v3_scale(scene->faces[face].normal, 2 * scene->contact);
    return !keller_accel_segment(accel, v3_sub(p, n), v3_add(p, n), scene->contact, visit_owner, &o, work);
}

/* Is the point at z along the wedge's edge on it? At an end exactly, no, unless the edge goes on beyond it as another wedge:
 * then the one that begins there claims it (both point the same way, in canonical order). */
static bool on_edge(const KellerScene *scene, uint32_t id, double z, double h)
{
    const KellerWedge *w = &scene->wedges[id];
    if (z > h && z < w->length - h) return true;
    if (!(fabs(z) <= h)) return false; /* outside, or at the far end */
    for (size_t i = 0; i < scene->wedge_count; i++) {
        const KellerWedge *o = &scene->wedges[i];
        if (i != id && o->vertex[1] == w->vertex[0] && v3_dot(o->direction, w->direction) > 1 - 1e-12) return true;
    }
    return false;
}

/* ---- the solution ------------------------------------------------------------------------------------------------ */

/* Where the line from `image` (behind the plane) to `target` (in front of it) meets the face's plane; false if both are on
 * one side or the line runs along it. */
static bool cross_plane(const KellerFace *f, KellerVec3 image, KellerVec3 target, KellerVec3 *p)
{
    double hi = v3_dot(f->normal, image) - f->offset, ht = v3_dot(f->normal, target) - f->offset;
    double span = hi - ht;
    if (!(fabs(span) > SIDE_SLACK * v3_distance(image, target))) return false;
    double t = hi / span;
    if (!(t >= -SIDE_SLACK && t <= 1 + SIDE_SLACK)) return false;
    *p = v3_madd(image, v3_sub(target, image), greater(0, lesser(1, t)));
    return true;
}

/* A chain of reflections between a node and an image of the far node: fills positions from the node's side. faces[0] is the
 * one next to the node. images[i] is the far end mirrored in faces i, i+1, ... */
static bool unfold(const KellerScene *scene, size_t count, const uint32_t *faces, const KellerVec3 *images, KellerVec3 node,
                   KellerVec3 *positions)
{
    for (size_t i = 0; i < count; i++) {
        if (!cross_plane(&scene->faces[faces[i]], images[i], node, &positions[i])) return false;
        node = positions[i];
    }
    return true;
}

typedef struct {
    const KellerScene *scene;
    KellerVec3 p;
    double rounding;
    uint32_t plane;             /* of the face reflected in */
    KellerVec3 leg[2];          /* from p backwards and forwards, as long as the boundary test looks around */
} Rim;

static bool visit_rim(void *context, uint32_t id)
{
    const Rim *r = context;
    uint32_t face = r->scene->triangle_face[id], triangle;
    const KellerFace *f = &r->scene->faces[face];
    if (f->plane == r->plane || fabs(v3_dot(f->normal, r->p) - f->offset) > 4 * r->rounding) return false;
    for (int i = 0; i < 2; i++)
        if (fabs(v3_dot(f->normal, r->leg[i])) <= KELLER_BOUNDARY_ANGLE * v3_norm(r->leg[i]) &&
            face_weight(r->scene, face, v3_add(r->p, r->leg[i]), -1, &triangle) > 0)
            return true;
    return false;
}

/* How far the positions are that decide what is exactly on a boundary: beyond rounding, too near for anything else. */
static double around_step(const KellerScene *scene, const KellerPath *path, double rounding)
{
    return greater(1e-6 * lesser(path->length, v3_distance(scene->lower, scene->upper)), 1e3 * rounding);
}

/* A wave that runs along one face up to its border with another: no share of it can be said to reflect there. */
static bool runs_along_border(const KellerScene *scene, const KellerAccel *accel, const KellerPath *path, size_t i,
                              double rounding, KellerAccelWork *work)
{
    const KellerFace *f = &scene->faces[path->step[i].id];
    double step = around_step(scene, path, rounding);
    Rim r = {scene, path->position[i], rounding, f->plane,
             {v3_scale(path->leg[i], -step), v3_scale(path->leg[i + 1], step)}};
    KellerVec3 n = v3_scale(f->normal, 4 * rounding);
    return keller_accel_segment(accel, v3_sub(r.p, n), v3_add(r.p, n), 4 * rounding, visit_rim, &r, work);
}

/* Solves a sequence; the slabs on its legs are appended to the crossings and not yet steps of the path. strict: every decision
 * by sign alone. Else what is too close to call counts as a path and *boundary is set: a reflection at a face's border or in
 * the corner of two faces, a leg that grazes an edge. */
static bool solve(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, KellerVec3 rx, size_t count,
                  const KellerStep *steps, bool strict, KellerPath *path, Crossings *crossings, bool *boundary,
                  KellerAccelWork *work)
{
    KellerVec3 image[KELLER_MAX_BENDS + 1], back[KELLER_MAX_BENDS], forth[KELLER_MAX_BENDS];
    uint32_t faces[KELLER_MAX_BENDS];
    size_t edge = count; /* position of the diffraction; count if there is none */
    for (size_t i = 0; i < count; i++) {
        if (steps[i].kind != KELLER_DIFFRACTION) continue;
        if (edge != count) return false;
        edge = i;
    }
    for (size_t i = 0; i + 1 < count; i++) { /* two reflections in one plane, or an edge and its own face, are no path */
        bool f0 = i != edge, f1 = i + 1 != edge;
        if (f0 && f1 && scene->faces[steps[i].id].plane == scene->faces[steps[i + 1].id].plane) return false;
        if (f0 != f1 && path_wedge_in_plane(scene, &scene->wedges[f0 ? steps[i + 1].id : steps[i].id],
                                            scene->faces[f0 ? steps[i].id : steps[i + 1].id].plane))
            return false;
    }
    double rounding = greater(path_rounding(scene, tx), path_rounding(scene, rx));

    /* images of the transmitter in steps 0 .. i-1 */
    size_t before = edge;
    image[0] = tx;
    for (size_t i = 0; i < before; i++) {
        const KellerFace *f = &scene->faces[steps[i].id];
        image[i + 1] = v3_mirror_point(image[i], f->normal, f->offset);
    }
    KellerVec3 node = rx, source = image[before];
    double s_in, s_out = 0;
    KellerVec3 along_in, along_out = v3(0, 0, 0);
    if (edge < count) {
        const KellerWedge *w = &scene->wedges[steps[edge].id];
        KellerVec3 target = rx;
        size_t after = count - edge - 1;
        KellerVec3 rx_image[KELLER_MAX_BENDS];
        for (size_t i = after; i-- > 0;) { /* rx_image[i]: receiver mirrored in steps edge+1+i and later */
            const KellerFace *f = &scene->faces[steps[edge + 1 + i].id];
            target = v3_mirror_point(target, f->normal, f->offset);
            rx_image[i] = target;
        }
        /* Fermat: equal angles to the edge, so the point divides the feet's distance as the distances from the edge */
        KellerVec3 qs = v3_sub(source, w->origin), qr = v3_sub(target, w->origin);
        double zs = v3_dot(qs, w->direction), zr = v3_dot(qr, w->direction);
        double ps = v3_norm(v3_madd(qs, w->direction, -zs)), pr = v3_norm(v3_madd(qr, w->direction, -zr));
        if (!(ps > rounding && pr > rounding)) return false; /* on the edge's own line: no diffraction there */
        double z = zs + (zr - zs) * (ps / (ps + pr));
        if (!on_edge(scene, steps[edge].id, z, rounding)) return false;
        node = v3_madd(w->origin, w->direction, z);
        along_in = v3_sub(node, source);
        along_out = v3_sub(target, node);
        s_in = v3_norm(along_in);
        s_out = v3_norm(along_out);
        for (size_t i = 0; i < after; i++) faces[i] = steps[edge + 1 + i].id;
        if (!unfold(scene, after, faces, rx_image, node, forth)) return false;
        path->position[edge] = node;
        for (size_t i = 0; i < after; i++) path->position[edge + 1 + i] = forth[i];
    } else {
        along_in = v3_sub(node, source);
        s_in = v3_norm(along_in);
        if (!(s_in > rounding)) return false; /* receiver and (image of the) transmitter coincide */
    }
    KellerVec3 reversed[KELLER_MAX_BENDS];
    for (size_t i = 0; i < before; i++) {
        faces[i] = steps[before - 1 - i].id;
        reversed[i] = image[before - i];
    }
    if (!unfold(scene, before, faces, reversed, node, back)) return false;
    for (size_t i = 0; i < before; i++) path->position[before - 1 - i] = back[i];
    if (edge < count) {
        const KellerWedge *w = &scene->wedges[steps[edge].id];
        if (!path_in_sector(w, v3_scale(along_in, -1), KELLER_BOUNDARY_ANGLE) ||
            !path_in_sector(w, along_out, KELLER_BOUNDARY_ANGLE))
            return false;
    }

    /* legs: straight in the unfolded space, so defined even where a leg has no length */
    path->count = (uint32_t)count;
    path->length = s_in + s_out;
    KellerVec3 dir = v3_scale(along_in, 1 / s_in);
    path->leg[before] = dir;
    for (size_t i = before; i-- > 0;) path->leg[i] = dir = v3_mirror_direction(dir, scene->faces[steps[i].id].normal);
    if (edge < count) {
        path->leg[edge + 1] = dir = v3_scale(along_out, 1 / s_out);
        for (size_t i = edge + 1; i < count; i++)
            path->leg[i + 1] = dir = v3_mirror_direction(dir, scene->faces[steps[i].id].normal);
    }

    /* validity, cheap things first */
    path->weight = 1;
    bool border[KELLER_MAX_BENDS] = {false};
    double walked = 0;
    KellerVec3 last = tx;
    for (size_t i = 0; i < count; i++) {
        path->step[i] = steps[i];
        path->triangle[i] = KELLER_NONE;
        walked += v3_distance(last, path->position[i]);
        last = path->position[i];
        if (i == edge) continue;
        double h = greater(rounding, KELLER_BOUNDARY_ANGLE * walked * (path->length - walked) / path->length);
        double weight = face_weight(scene, steps[i].id, path->position[i], strict ? -1 : h, &path->triangle[i]);
        if (!(weight > 0)) return false;
        border[i] = weight < 1;
        *boundary = *boundary || border[i];
    }
    for (size_t i = 0; i + 1 < count; i++)
        if (v3_distance(path->position[i], path->position[i + 1]) <= rounding) {
            if (i == edge || i + 1 == edge) return false;
            *boundary = true;
        }
    for (size_t i = 0; i < count; i++) {
        if (i == edge) continue;
        if (!border[i] && !owns(scene, accel, steps[i].id, path->position[i], work)) return false;
        if (!border[i] || strict) continue;
        /* a station on a border: neither of the faces there can be told to reflect */
        if (v3_distance(tx, path->position[i]) <= rounding || v3_distance(rx, path->position[i]) <= rounding) return false;
        if (runs_along_border(scene, accel, path, i, rounding, work)) return false;
    }
    PathLeg leg = {.b = tx, .strict = strict};
    for (size_t i = 0; i <= count; i++) {
        leg.number = (uint32_t)i;
        leg.a = leg.b;
        leg.b = i < count ? path->position[i] : rx;
        leg.skip[0] = leg.skip[1];
        leg.skip_count[0] = leg.skip_count[1];
        leg.skip_count[1] = 0;
        if (i < count && i == edge) {
            const KellerWedge *w = &scene->wedges[steps[i].id];
            leg.skip[1] = scene->wedge_planes + w->plane_begin;
            leg.skip_count[1] = w->plane_end - w->plane_begin;
        } else if (i < count) {
            leg.skip[1] = &scene->faces[steps[i].id].plane;
            leg.skip_count[1] = 1;
        }
        if (!path_leg_passes(scene, accel, &leg, crossings, boundary, work)) return false;
    }
    return true;
}

/* The path with its transmissions as steps among the others. */
static void insert(const KellerScene *scene, KellerVec3 tx, KellerVec3 rx, const KellerPath *path, const Crossings *crossings,
                   KellerPath *whole)
{
    uint32_t n = 0, next = 0;
    whole->length = path->length;
    whole->weight = path->weight;
    for (uint32_t i = 0; i <= path->count; i++) {
        KellerVec3 a = i > 0 ? path->position[i - 1] : tx, b = i < path->count ? path->position[i] : rx;
        for (; next < crossings->count && crossings->at[next].leg == i; next++) {
            const Crossing *c = &crossings->at[next];
            double t;
            whole->leg[n] = path->leg[i];
            whole->step[n] = (KellerStep){KELLER_TRANSMISSION, c->face};
            whole->triangle[n] = c->triangle;
            whole->position[n++] = path_crossing(scene, c->at, a, b, &t);
        }
        whole->leg[n] = path->leg[i];
        if (i == path->count) break;
        whole->step[n] = path->step[i];
        whole->triangle[n] = path->triangle[i];
        whole->position[n++] = path->position[i];
    }
    whole->count = n;
}

/* ---- on a boundary ----------------------------------------------------------------------------------------------- */

enum { DIRECTIONS = 4, AROUND = 8 * DIRECTIONS };

/* The ways through slabs that positions around the ends see, and how many see each. */
typedef struct {
    uint32_t all;               /* positions */
    uint32_t count;
    uint32_t seen[AROUND];
    Crossings way[AROUND];
} Surroundings;

static bool same_way(const Crossings *a, const Crossings *b)
{
    if (a->count != b->count) return false;
    for (uint32_t i = 0; i < a->count; i++)
        if (a->at[i].leg != b->at[i].leg || a->at[i].face != b->at[i].face) return false;
    return true;
}

/* The last of the ways has been written: keep it if it is new. Of the triangles of a face that meet at the boundary, the first
 * stands for all. */
static void see(Surroundings *s)
{
    const Crossings *fresh = &s->way[s->count];
    for (uint32_t i = 0; i < s->count; i++) {
        if (!same_way(&s->way[i], fresh)) continue;
        s->seen[i]++;
        for (uint32_t j = 0; j < fresh->count; j++)
            if (fresh->at[j].triangle < s->way[i].at[j].triangle) s->way[i].at[j].triangle = fresh->at[j].triangle;
        return;
    }
    s->seen[s->count++] = 1;
}

/* Directions in which a path leaves the transmitter and comes to the receiver. A station on the mirror has a leg of no length,
 * which would lead through it. */
static void ways_at_ends(KellerVec3 tx, KellerVec3 rx, const KellerPath *path, double rounding, KellerVec3 *ahead,
                         KellerVec3 *last)
{
    KellerVec3 a = tx;
    bool found = false;
    for (uint32_t i = 0; i <= path->count; i++) {
        KellerVec3 b = i < path->count ? path->position[i] : rx;
        if (v3_distance(a, b) > rounding) {
            if (!found) *ahead = path->leg[i];
            *last = path->leg[i];
            found = true;
        }
        a = b;
    }
}

/* On a boundary of the path exactly: the share of surrounding positions of its two ends for which it exists. The positions
 * come in opposite pairs, so that on one smooth boundary it is one half to the last bit, and the same set serves the
 * exchanged path. They lie far enough away to be beyond rounding, and too near for anything else to change; those that a
 * station on a surface has behind that surface are left out. */
static void look_around(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, KellerVec3 rx, size_t count,
                        const KellerStep *steps, uint32_t transmissions, const KellerPath *path, Surroundings *s,
                        KellerAccelWork *work)
{
    static const KellerVec3 around[DIRECTIONS] = {
        {0.4118, 0.6903, 0.5949}, {-0.7442, 0.2887, 0.6024}, {0.1621, -0.5353, 0.8290}, {0.8863, -0.3617, 0.2893}};
    double rounding = greater(path_rounding(scene, tx), path_rounding(scene, rx)), step = around_step(scene, path, rounding);
    KellerVec3 ahead = path->leg[0], last = path->leg[path->count];
    ways_at_ends(tx, rx, path, rounding, &ahead, &last);
    s->all = s->count = 0;
    for (int i = 0; i < AROUND; i++) {
        int j = i / 8, k = (j + 1) % DIRECTIONS;
        if (i & 4) { /* exchanged */
            int swap = j;
            j = k;
            k = swap;
        }
        KellerVec3 t = v3_madd(tx, around[j], i & 1 ? step : -step), r = v3_madd(rx, around[k], i & 2 ? step : -step);
        PathLeg t_ahead = {.a = t, .b = v3_madd(tx, ahead, 10 * step), .strict = true};
        PathLeg r_back = {.a = r, .b = v3_madd(rx, last, -10 * step), .strict = true};
        bool grazes;
        Crossings none = {.most = 0};
        if (!path_leg_passes(scene, accel, &t_ahead, &none, &grazes, work) ||
            !path_leg_passes(scene, accel, &r_back, &none, &grazes, work))
            continue;
        KellerPath other;
        bool boundary = false;
        s->all++;
        s->way[s->count].most = transmissions;
        s->way[s->count].count = 0;
        if (solve(scene, accel, t, r, count, steps, true, &other, &s->way[s->count], &boundary, work)) see(s);
    }
}

static bool solve_around(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, KellerVec3 rx, size_t count,
                         const KellerStep *steps, uint32_t transmissions, KellerPath *path, KellerPathFound found,
                         void *context, KellerAccelWork *work)
{
    Surroundings s;
    look_around(scene, accel, tx, rx, count, steps, transmissions, path, &s, work);
    for (uint32_t i = 0; i < s.count; i++) {
        KellerPath whole;
        path->weight = (double)s.seen[i] / s.all;
        insert(scene, tx, rx, path, &s.way[i], &whole);
        if (!found(context, &whole)) return false;
    }
    return true;
}

bool keller_path_solve(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, KellerVec3 rx, size_t count,
                       const KellerStep *steps, uint32_t transmissions, KellerPathFound found, void *context,
                       KellerAccelWork *work)
{
    bool boundary = false;
    KellerPath path, whole;
    Crossings crossings;
    crossings.most = transmissions;
    crossings.count = 0;
    if (!solve(scene, accel, tx, rx, count, steps, false, &path, &crossings, &boundary, work)) return true;
    if (boundary) return solve_around(scene, accel, tx, rx, count, steps, transmissions, &path, found, context, work);
    if (crossings.count == 0) return found(context, &path);
    insert(scene, tx, rx, &path, &crossings, &whole);
    return found(context, &whole);
}
