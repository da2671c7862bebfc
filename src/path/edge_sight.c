/* The rays from a point to an edge fill a flat triangle. Each triangle of the scene that cuts it casts an interval of shadow on the edge,
 * each triangle of a mirror lets an interval through; what is left is seen. Behind mirrors the same on every leg, with the edge
 * unfolded into the space of that leg. */
#include "path/edge_sight.h"

#include <math.h>
#include <stdlib.h>

#include "base/number.h"
#include "path/solve.h"

/* ---- intervals -------------------------------------------------------------------------------------------------------- */

static bool add(EdgeParts *p, double from, double to, double weight)
{
    if (p->count == p->capacity) {
        uint32_t more = p->capacity ? 2 * p->capacity : 8;
        EdgePart *grown = realloc(p->part, more * sizeof *grown);
        if (!grown) return false;
        p->part = grown;
        p->capacity = more;
    }
    p->part[p->count++] = (EdgePart){from, to, weight};
    return true;
}

static int by_place(const void *pa, const void *pb)
{
    const EdgePart *a = pa, *b = pb;
    return a->from != b->from ? (a->from > b->from) - (a->from < b->from) : (a->to > b->to) - (a->to < b->to);
}

/* Sorted, and joined where they touch within `gap`. */
static void join(EdgeParts *p, double gap)
{
    uint32_t kept = 0;
    if (p->count > 1) qsort(p->part, p->count, sizeof *p->part, by_place);
    for (uint32_t i = 0; i < p->count; i++) {
        if (kept > 0 && p->part[i].from <= p->part[kept - 1].to + gap)
            p->part[kept - 1].to = greater(p->part[kept - 1].to, p->part[i].to);
        else
            p->part[kept++] = p->part[i];
    }
    p->count = kept;
}

/* What of a is not in b, both joined; parts shorter than `least` are dropped. */
static bool without(const EdgeParts *a, const EdgeParts *b, double least, EdgeParts *left)
{
    for (uint32_t i = 0; i < a->count; i++) {
        double at = a->part[i].from;
        for (uint32_t j = 0; j <= b->count; j++) {
            bool last = j == b->count;
            if (!last && b->part[j].to <= at) continue;
            double end = last ? a->part[i].to : lesser(b->part[j].from, a->part[i].to);
            if (end - at > least && !add(left, at, end, a->part[i].weight)) return false;
            if (last || b->part[j].from >= a->part[i].to) break;
            at = b->part[j].to;
        }
    }
    return true;
}

bool edge_parts_common(const EdgeParts *a, const EdgeParts *b, EdgeParts *common)
{
    for (uint32_t i = 0; i < a->count; i++)
        for (uint32_t j = 0; j < b->count; j++) {
            double from = greater(a->part[i].from, b->part[j].from), to = lesser(a->part[i].to, b->part[j].to);
            if (to > from && !add(common, from, to, a->part[i].weight * b->part[j].weight)) return false;
        }
    return true;
}

/* Half of each of two lists: weight 1 where they agree. */
static bool mean(const EdgeParts *a, const EdgeParts *b, double least, EdgeParts *both)
{
    EdgeParts only = {0};
    bool ok = edge_parts_common(a, b, both) && without(a, b, least, &only) && without(b, a, least, &only);
    for (uint32_t i = 0; i < only.count && ok; i++) ok = add(both, only.part[i].from, only.part[i].to, 0.5 * only.part[i].weight);
    free(only.part);
    if (ok && both->count > 1) qsort(both->part, both->count, sizeof *both->part, by_place);
    return ok;
}

/* ---- a leg ---------------------------------------------------------------------------------------------------------------- */

/* The rays from `source` to the (unfolded) edge on their way from one mirror's plane to the next. */
static const double shortest_part = 1e-9;   /* of an edge: shorter ones are what rounding leaves beside a shadow's border */

typedef struct {
    const KellerScene *scene;
    KellerVec3 source, origin, direction, across, normal; /* across: from the source to the edge's line; normal to both */
    double length, distance, z, floor;  /* m: of the edge; of its line; of the source along it; rounding */
    uint32_t begin, end;        /* faces whose planes the leg begins and ends in, or KELLER_NONE */
    const KellerWedge *wedge;   /* at the end of the last leg; else NULL */
    double zero;                /* vertices in the flat triangle's plane, within rounding, count as above (1) or below (-1) it */
    bool grazes, failed;
    EdgeParts *parts;
} Leg;

static bool leg_open(Leg *l)
{
    KellerVec3 to = v3_sub(l->origin, l->source);
    l->z = -v3_dot(to, l->direction);
    to = v3_madd(to, l->direction, l->z);
    l->distance = v3_norm(to);
    l->across = v3_unit(to);
    l->normal = v3_cross(l->across, l->direction);
    return l->distance > l->floor;
}

static double from_plane(const KellerFace *f, KellerVec3 p) { return v3_dot(f->normal, p) - f->offset; }

/* Where the triangle cuts the plane of source and edge. The point on an edge of it is computed from the ends in the order of their
 * ids, so that neighbours agree. */
static bool section(Leg *l, uint32_t triangle, KellerVec3 p[2])
{
    const uint32_t *t = l->scene->triangles[triangle];
    double h[3];
    int found = 0, in_plane = 0;
    for (int i = 0; i < 3; i++) {
        h[i] = v3_dot(l->normal, v3_sub(l->scene->vertices[t[i]], l->source));
        if (fabs(h[i]) > l->floor) continue;
        in_plane++;
        h[i] = 0;
    }
    if (in_plane == 3) return false; /* edge-on */
    l->grazes = l->grazes || in_plane > 0;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, a = t[i] < t[j] ? i : j, b = i + j - a;
        bool above = h[a] == 0 ? l->zero > 0 : h[a] > 0, other = h[b] == 0 ? l->zero > 0 : h[b] > 0;
        if (above == other) continue;
        KellerVec3 va = l->scene->vertices[t[a]], vb = l->scene->vertices[t[b]];
        p[found++] = v3_madd(va, v3_sub(vb, va), h[a] / (h[a] - h[b]));
    }
    return found == 2;
}

/* The section as the source sees it on the edge, no nearer to either than rounding. */
static void project(Leg *l, KellerVec3 p[2])
{
    double rho[2], z[2], near = 4 * l->floor;
    for (int i = 0; i < 2; i++) rho[i] = v3_dot(l->across, v3_sub(p[i], l->source));
    if (!path_cut(p, rho[0] - near, rho[1] - near)) return;
    for (int i = 0; i < 2; i++) rho[i] = v3_dot(l->across, v3_sub(p[i], l->source));
    if (!path_cut(p, l->distance - near - rho[0], l->distance - near - rho[1])) return;
    for (int i = 0; i < 2; i++) {
        KellerVec3 from = v3_sub(p[i], l->source);
        double scale = l->distance / v3_dot(l->across, from);
        z[i] = greater(0, lesser(l->length, l->z + v3_dot(l->direction, from) * scale));
    }
    if (z[0] != z[1] && !add(l->parts, lesser(z[0], z[1]), greater(z[0], z[1]), 1)) l->failed = true;
}

/* How far the triangle reaches beyond a plane, on a side of it. */
static double reach(const Leg *l, const KellerFace *f, uint32_t triangle, double side)
{
    double most = -INFINITY;
    for (int i = 0; i < 3; i++) most = greater(most, side * from_plane(f, l->scene->vertices[l->scene->triangles[triangle][i]]));
    return most;
}

/* Cuts p to where the leg is: behind the plane that it begins in, where the source is not, and before the one it ends in, where it
 * is. A triangle that only touches such a plane from the other side is not there; one that stands on it is, down to it. False if
 * nowhere. */
static bool on_leg(const Leg *l, bool behind_begin, uint32_t triangle, KellerVec3 p[2])
{
    const uint32_t bounds[2] = {behind_begin ? l->begin : KELLER_NONE, l->end};
    for (int i = 0; i < 2; i++) {
        if (bounds[i] == KELLER_NONE) continue;
        const KellerFace *f = &l->scene->faces[bounds[i]];
        double side = (from_plane(f, l->source) > 0) == (i == 1) ? 1 : -1;
        if (reach(l, f, triangle, side) <= l->floor) return false;
        if (!path_cut(p, side * from_plane(f, p[0]) + l->floor, side * from_plane(f, p[1]) + l->floor)) return false;
    }
    return true;
}

static double visit_obstacle(void *context, uint32_t triangle, KellerRange range)
{
    Leg *l = context;
    const KellerFace *faces = l->scene->faces;
    uint32_t plane = faces[l->scene->triangle_face[triangle]].plane;
    KellerVec3 p[2];
    (void)range;
    if (l->wedge && path_wedge_in_plane(l->scene, l->wedge, plane)) return INFINITY;
    if (l->begin != KELLER_NONE && faces[l->begin].plane == plane) return INFINITY;
    if (l->end != KELLER_NONE && faces[l->end].plane == plane) return INFINITY;
    if (section(l, triangle, p) && on_leg(l, true, triangle, p)) project(l, p);
    return INFINITY;
}

/* Calls visit_obstacle for what may be in the flat triangle. */
static void look(Leg *l, const KellerAccel *accel, KellerAccelWork *work)
{
    const double widest = 1; /* rad, of a cone */
    double low = atan2(-l->z, l->distance), high = atan2(l->length - l->z, l->distance);
    int pieces = (int)ceil((high - low) / widest);
    for (int i = 0; i < pieces && !l->failed; i++) {
        KellerVec3 direction[2];
        double far = 0;
        for (int k = 0; k < 2; k++) {
            double angle = low + (high - low) * (i + k) / pieces;
            direction[k] = v3_add(v3_scale(l->across, cos(angle)), v3_scale(l->direction, sin(angle)));
            far = greater(far, l->distance / cos(angle));
        }
        KellerCone cone;
        if (keller_cone_fan(1, &l->source, 2, direction, &cone, NULL))
            keller_accel_cone(accel, &cone, (KellerRange){0, 1.001 * far + l->floor}, visit_obstacle, NULL, l, work);
    }
}

/* The parts that the face, in whose plane the leg begins, lets through; of coincident faces the one with the lowest id. */
static bool window(Leg *l, double least, EdgeParts *open)
{
    const KellerScene *scene = l->scene;
    EdgeParts lower = {0}, own = {0};
    for (uint32_t f = l->begin; f != KELLER_NONE && !l->failed; f = scene->faces[f].before) {
        l->parts = f < l->begin ? &lower : &own;
        for (uint32_t i = scene->faces[f].triangle_begin; i < scene->faces[f].triangle_end; i++) {
            KellerVec3 p[2];
            if (section(l, scene->face_triangles[i], p) && on_leg(l, false, scene->face_triangles[i], p)) project(l, p);
        }
    }
    join(&lower, least);
    join(&own, least);
    bool ok = !l->failed && without(&own, &lower, least, open);
    free(lower.part);
    free(own.part);
    return ok;
}

/* ---- the way -------------------------------------------------------------------------------------------------------------- */

typedef struct {
    KellerVec3 source[KELLER_MAX_BENDS + 1];    /* [j]: the end mirrored in the first j faces */
    KellerVec3 origin[KELLER_MAX_BENDS + 1], direction[KELLER_MAX_BENDS + 1]; /* the edge unfolded into leg j */
    double floor, least;        /* m: rounding; parts shorter than this do not count */
} Unfolded;

static void unfold(const EdgeWay *way, Unfolded *u)
{
    const KellerScene *scene = way->scene;
    const KellerWedge *w = &scene->wedges[way->wedge];
    u->source[0] = way->end;
    u->origin[way->count] = w->origin;
    u->direction[way->count] = w->direction;
    for (uint32_t j = 0; j < way->count; j++) {
        const KellerFace *f = &scene->faces[code_id(way->face[j])];
        u->source[j + 1] = v3_mirror_point(u->source[j], f->normal, f->offset);
    }
    for (uint32_t j = way->count; j-- > 0;) {
        const KellerFace *f = &scene->faces[code_id(way->face[j])];
        u->origin[j] = v3_mirror_point(u->origin[j + 1], f->normal, f->offset);
        u->direction[j] = v3_mirror_direction(u->direction[j + 1], f->normal);
    }
    u->floor = greater(path_rounding(scene, way->end), path_rounding(scene, u->source[way->count]));
    u->least = greater(4 * u->floor, shortest_part * w->length);
}

static Leg leg_of(const EdgeWay *way, const Unfolded *u, uint32_t j, double zero)
{
    const KellerWedge *w = &way->scene->wedges[way->wedge];
    return (Leg){.scene = way->scene, .source = u->source[j], .origin = u->origin[j], .direction = u->direction[j],
                 .length = w->length, .floor = u->floor, .begin = j > 0 ? code_id(way->face[j - 1]) : KELLER_NONE,
                 .end = j < way->count ? code_id(way->face[j]) : KELLER_NONE, .wedge = j == way->count ? w : NULL, .zero = zero};
}

/* Narrows *seen by one leg: its window, its shadows. */
static bool pass(Leg *l, const KellerAccel *accel, double least, EdgeParts *seen, KellerAccelWork *work)
{
    EdgeParts open = {0}, shadow = {0}, both = {0}, left = {0};
    bool ok = leg_open(l);
    uint32_t triangle;
    if (!ok) seen->count = 0;
    bool at_mirror = l->begin != KELLER_NONE && fabs(from_plane(&l->scene->faces[l->begin], l->source)) <= l->floor;
    if (ok && at_mirror) { /* the end is on the mirror, or not reflected at all */
        if (!(path_face_weight(l->scene, l->begin, l->source, -1, &triangle) > 0)) seen->count = 0;
    } else if (ok && l->begin != KELLER_NONE) {
        if (!window(l, least, &open) || !edge_parts_common(seen, &open, &both)) l->failed = true;
        EdgeParts old = *seen;
        *seen = both;
        both = old;
    }
    if (at_mirror) l->begin = KELLER_NONE;
    if (ok && seen->count > 0 && !l->failed) {
        l->parts = &shadow;
        look(l, accel, work);
        join(&shadow, least);
        if (l->failed || !without(seen, &shadow, least, &left)) l->failed = true;
        EdgeParts old = *seen;
        *seen = left;
        left = old;
    }
    free(open.part);
    free(shadow.part);
    free(both.part);
    free(left.part);
    return !l->failed;
}

static bool sight(const EdgeWay *way, const Unfolded *u, const KellerAccel *accel, double zero, EdgeParts *seen, bool *grazes,
                  KellerAccelWork *work)
{
    bool ok = add(seen, 0, way->scene->wedges[way->wedge].length, 1);
    for (uint32_t j = way->count + 1; j-- > 0 && ok && seen->count > 0;) {
        Leg leg = leg_of(way, u, j, zero);
        ok = pass(&leg, accel, u->least, seen, work);
        *grazes = *grazes || leg.grazes;
    }
    return ok;
}

bool edge_sight(EdgeWay *way, const KellerAccel *accel, EdgeParts *seen, KellerAccelWork *work)
{
    Unfolded u;
    unfold(way, &u);
    way->image = u.source[way->count];
    const KellerWedge *w = &way->scene->wedges[way->wedge];
    if (!path_in_sector(w, v3_sub(way->image, w->origin), KELLER_BOUNDARY_ANGLE)) return true;
    EdgeParts up = {0}, down = {0};
    bool grazes = false, ok = sight(way, &u, accel, 1, &up, &grazes, work);
    if (ok && grazes) ok = sight(way, &u, accel, -1, &down, &grazes, work) && mean(&up, &down, u.least, seen);
    for (uint32_t i = 0; i < up.count && ok && !grazes; i++) ok = add(seen, up.part[i].from, up.part[i].to, up.part[i].weight);
    free(up.part);
    free(down.part);
    return ok;
}

double edge_way_points(const EdgeWay *way, double z, KellerVec3 *position, uint32_t *triangle, KellerVec3 *leg)
{
    Unfolded u;
    unfold(way, &u);
    const KellerWedge *w = &way->scene->wedges[way->wedge];
    KellerVec3 at = v3_madd(w->origin, w->direction, z), ray = v3_sub(at, u.source[way->count]);
    double length = v3_norm(ray);
    KellerVec3 direction = v3_scale(ray, 1 / length);
    for (uint32_t j = way->count; j-- > 0;) {
        uint32_t face = code_id(way->face[j]);
        const KellerFace *f = &way->scene->faces[face];
        leg[j + 1] = direction;
        direction = v3_mirror_direction(direction, f->normal);
        if (!path_cross_plane(f, u.source[j + 1], at, &position[j])) position[j] = u.source[j + 1]; /* the end is on the mirror */
        at = position[j];
        path_face_weight(way->scene, face, at, way->scene->contact, &triangle[j]);
        if (triangle[j] == KELLER_NONE) triangle[j] = way->scene->face_triangles[f->triangle_begin];
    }
    leg[0] = direction;
    return length;
}
