/* Exact paths: mirror images for the faces, Fermat's point on the wedge in closed form, then validity. */
#include <math.h>
#include <stdlib.h>

#include "path/internal.h"
#include "base/number.h"

/* How far the receiver's or source's image may be on the wrong side of a plane: rounding only. */
#define SIDE_SLACK 1e-12

bool path_in_sector(const KellerWedge *w, KellerVec3 v, double slack, double *phi)
{
    double angle = atan2(v3_dot(v, w->normal0), v3_dot(v, w->tangent0)), open = w->n * M_PI;
    if (angle < 0) angle += 2 * M_PI;
    if (angle > open) {
        if (angle - open <= slack) angle = open;
        else if (2 * M_PI - angle <= slack) angle = 0;
        else return false;
    }
    if (phi) *phi = angle;
    return true;
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

/* 1 inside, 0 outside, 1/2 within h of the face's border; *triangle is the one that holds p (the one nearest to p's
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
           face_weight(o->scene, face, o->p, 0, &triangle) > 0;
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

/* A reflection on the border of a face counts only if the face just inside the border is reached: otherwise what stands
 * on the border hides it (an inner side of a solid, seen at its corner). The point is moved in by a millionth of the
 * path, far more than an end of a leg is allowed to touch. */
static bool reaches_face(const KellerScene *scene, const KellerAccel *accel, const KellerPath *path, size_t i,
                         KellerVec3 from, KellerVec3 to, KellerAccelWork *work)
{
    const uint32_t *t = scene->triangles[path->triangle[i]];
    KellerVec3 middle = v3_scale(v3_add(v3_add(scene->vertices[t[0]], scene->vertices[t[1]]), scene->vertices[t[2]]), 1. / 3);
    KellerVec3 inwards = v3_sub(middle, path->position[i]);
    double step = lesser(1e-6 * path->length / v3_norm(inwards), 0.5);
    KellerVec3 p = v3_madd(path->position[i], inwards, step);
    const uint32_t *plane = &scene->faces[path->step[i].id].plane;
    if (v3_distance(from, path->position[i]) <= path_rounding(scene, from) ||
        v3_distance(to, path->position[i]) <= path_rounding(scene, to))
        return false; /* an end, on an edge: neither of its faces can be told to reflect */
    return keller_visibility(scene, accel, from, p, NULL, 0, plane, 1, work) > 0 &&
           keller_visibility(scene, accel, p, to, plane, 1, NULL, 0, work) > 0;
}

bool keller_path_solve(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, KellerVec3 rx, size_t count,
                       const KellerStep *steps, KellerPath *path, KellerAccelWork *work)
{
    KellerVec3 image[KELLER_MAX_INTERACTIONS + 1], back[KELLER_MAX_INTERACTIONS], forth[KELLER_MAX_INTERACTIONS];
    uint32_t faces[KELLER_MAX_INTERACTIONS];
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
        KellerVec3 rx_image[KELLER_MAX_INTERACTIONS];
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
    KellerVec3 reversed[KELLER_MAX_INTERACTIONS];
    for (size_t i = 0; i < before; i++) {
        faces[i] = steps[before - 1 - i].id;
        reversed[i] = image[before - i];
    }
    if (!unfold(scene, before, faces, reversed, node, back)) return false;
    for (size_t i = 0; i < before; i++) path->position[before - 1 - i] = back[i];
    if (edge < count) {
        const KellerWedge *w = &scene->wedges[steps[edge].id];
        if (!path_in_sector(w, v3_scale(along_in, -1), KELLER_BOUNDARY_ANGLE, NULL) ||
            !path_in_sector(w, along_out, KELLER_BOUNDARY_ANGLE, NULL))
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
    bool border[KELLER_MAX_INTERACTIONS] = {false};
    double walked = 0;
    KellerVec3 last = tx, before_last = tx;
    for (size_t i = 0; i < count; i++) {
        path->step[i] = steps[i];
        path->triangle[i] = KELLER_NONE;
        walked += v3_distance(last, path->position[i]);
        last = path->position[i];
        if (i == edge) continue;
        double h = greater(rounding, KELLER_BOUNDARY_ANGLE * walked * (path->length - walked) / path->length);
        double weight = face_weight(scene, steps[i].id, path->position[i], h, &path->triangle[i]);
        if (!(weight > 0)) return false;
        border[i] = weight < 1;
        path->weight *= weight;
    }
    for (size_t i = 0; i + 1 < count; i++) { /* in the corner of two faces exactly: one of the two orders */
        if (v3_distance(path->position[i], path->position[i + 1]) > rounding) continue;
        if (i == edge || i + 1 == edge) return false;
        if (scene->faces[steps[i].id].plane > scene->faces[steps[i + 1].id].plane) return false;
        path->weight = 1;
    }
    for (size_t i = 0; i < count; i++)
        if (i != edge && !owns(scene, accel, steps[i].id, path->position[i], work)) return false;
    const uint32_t *skip = NULL;
    size_t skip_count = 0;
    last = tx;
    for (size_t i = 0; i <= count; i++) {
        const uint32_t *next = NULL;
        size_t next_count = 0;
        if (i < count && i == edge) {
            const KellerWedge *w = &scene->wedges[steps[i].id];
            next = scene->wedge_planes + w->plane_begin;
            next_count = w->plane_end - w->plane_begin;
        } else if (i < count) {
            next = &scene->faces[steps[i].id].plane;
            next_count = 1;
        }
        KellerVec3 to = i < count ? path->position[i] : rx;
        double weight = keller_visibility(scene, accel, last, to, skip, skip_count, next, next_count, work);
        if (!(weight > 0)) return false;
        path->weight *= weight;
        if (i > 0 && i - 1 != edge && border[i - 1] &&
            !reaches_face(scene, accel, path, i - 1, before_last, to, work))
            return false;
        before_last = last;
        last = to;
        skip = next;
        skip_count = next_count;
    }
    return true;
}

bool path_list_push(PathList *list, const KellerPath *path)
{
    if (list->count == list->capacity) {
        size_t more = list->capacity ? 2 * list->capacity : 16;
        KellerPath *items = realloc(list->items, more * sizeof *items);
        if (!items) return false;
        list->items = items;
        list->capacity = more;
    }
    list->items[list->count++] = *path;
    return true;
}
