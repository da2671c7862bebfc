/* Exact paths: mirror images for the faces, the shortest way over the edges, then validity. */
#include "path/solve.h"

#include <math.h>

#include "base/number.h"
#include "path/shortest.h"

/* A sequence cut at its edges: an end, reflections, an edge, reflections, ..., an end. */
typedef struct {
    const KellerScene *scene;
    size_t count;
    const KellerStep *steps;
    size_t edges, edge[KELLER_MAX_BENDS];   /* places of the diffractions */
} Sequence;

/* No path: two reflections in one plane, an edge and its own face, or an edge met twice in a row. */
static bool cut(const KellerScene *scene, size_t count, const KellerStep *steps, Sequence *s)
{
    *s = (Sequence){.scene = scene, .count = count, .steps = steps};
    for (size_t i = 0; i < count; i++) {
        bool wedge = steps[i].kind == KELLER_DIFFRACTION;
        if (wedge) s->edge[s->edges++] = i;
        if (i == 0) continue;
        bool before = steps[i - 1].kind == KELLER_DIFFRACTION;
        uint32_t a = steps[i - 1].id, b = steps[i].id;
        if (wedge && before) {
            const uint32_t *u = scene->wedges[a].vertex, *v = scene->wedges[b].vertex;
            if (u[0] == v[0] && u[1] == v[1]) return false;
        } else if (wedge || before) {
            if (path_wedge_in_plane(scene, &scene->wedges[wedge ? b : a], scene->faces[wedge ? a : b].plane)) return false;
        } else if (scene->faces[a].plane == scene->faces[b].plane) {
            return false;
        }
    }
    return true;
}

static KellerVec3 mirrored(const Sequence *s, size_t step, KellerVec3 p)
{
    const KellerFace *f = &s->scene->faces[s->steps[step].id];
    return v3_mirror_point(p, f->normal, f->offset);
}

/* A stretch of reflections in the steps first, first + way, ... (way is 1 or -1; `count` of them) between a node and the far
 * end of it: fills the path's positions, from the node's side. *image is the far end mirrored in all of them, as the node
 * sees it. */
static bool connect(const Sequence *s, KellerVec3 node, KellerVec3 far, size_t first, int way, size_t count, KellerPath *path,
                    KellerVec3 *image)
{
    KellerVec3 images[KELLER_MAX_BENDS]; /* images[i]: mirrored in the i-th face from the node and those beyond */
    for (size_t i = count; i-- > 0;) images[i] = far = mirrored(s, way > 0 ? first + i : first - i, far);
    *image = far;
    for (size_t i = 0; i < count; i++) {
        size_t step = way > 0 ? first + i : first - i;
        if (!path_cross_plane(&s->scene->faces[s->steps[step].id], images[i], node, &path->position[step])) return false;
        node = path->position[step];
    }
    return true;
}

/* Mirrors in the faces between step `begin` and step `end`, the last first: into the frame in front of the first. */
static KellerVec3 unfolded(const Sequence *s, size_t begin, size_t end, KellerVec3 p)
{
    for (size_t i = end; i-- > begin;)
        if (s->steps[i].kind == KELLER_REFLECTION) p = mirrored(s, i, p);
    return p;
}

/* The points on the edges: the shortest way in the space that is unfolded into the frame of the first edge. */
static bool find_nodes(const Sequence *s, KellerVec3 tx, KellerVec3 rx, double rounding, KellerPath *path)
{
    EdgeLine line[KELLER_MAX_BENDS];
    double t[KELLER_MAX_BENDS];
    size_t first = s->edge[0];
    KellerVec3 source = tx;
    for (size_t i = 0; i < first; i++) source = mirrored(s, i, source);
    for (size_t e = 0; e < s->edges; e++) {
        const KellerWedge *w = &s->scene->wedges[s->steps[s->edge[e]].id];
        line[e] = (EdgeLine){unfolded(s, first + 1, s->edge[e], w->origin), w->direction, w->length};
        for (size_t i = s->edge[e]; i-- > first + 1;)
            if (s->steps[i].kind == KELLER_REFLECTION)
                line[e].direction = v3_mirror_direction(line[e].direction, s->scene->faces[s->steps[i].id].normal);
    }
    if (!path_shortest(source, unfolded(s, first + 1, s->count, rx), s->edges, line, rounding, t)) return false;
    for (size_t e = 0; e < s->edges; e++) {
        const KellerWedge *w = &s->scene->wedges[s->steps[s->edge[e]].id];
        if (!path_on_edge(s->scene, s->steps[s->edge[e]].id, t[e], rounding)) return false;
        path->position[s->edge[e]] = v3_madd(w->origin, w->direction, t[e]);
    }
    return true;
}

/* The legs of the stretch behind an edge (or behind the transmitter) up to step `end`: straight in the unfolded space, so
 * defined even where a leg has no length. */
static void set_legs(const Sequence *s, size_t begin, size_t end, KellerVec3 dir, KellerPath *path)
{
    path->leg[begin] = dir;
    for (size_t i = begin; i < end; i++)
        path->leg[i + 1] = dir = v3_mirror_direction(dir, s->scene->faces[s->steps[i].id].normal);
}

/* All points, legs and the length; the wave arrives and leaves through each wedge's sector. */
static bool find_points(const Sequence *s, KellerVec3 tx, KellerVec3 rx, double rounding, KellerPath *path)
{
    if (s->edges > 0 && !find_nodes(s, tx, rx, rounding, path)) return false;
    size_t before = s->edges > 0 ? s->edge[0] : s->count;
    KellerVec3 node = s->edges > 0 ? path->position[before] : rx, image;
    if (!connect(s, node, tx, before - 1, -1, before, path, &image)) return false;
    KellerVec3 along = v3_sub(node, image);
    double length = v3_norm(along);
    if (!(length > rounding)) return false; /* receiver and (image of the) transmitter coincide */
    KellerVec3 dir = v3_scale(along, 1 / length);
    path->leg[before] = dir;
    for (size_t i = before; i-- > 0;)
        path->leg[i] = dir = v3_mirror_direction(dir, s->scene->faces[s->steps[i].id].normal);
    path->length = length;
    for (size_t e = 0; e < s->edges; e++) {
        size_t at = s->edge[e], end = e + 1 < s->edges ? s->edge[e + 1] : s->count;
        const KellerWedge *w = &s->scene->wedges[s->steps[at].id];
        node = path->position[at];
        KellerVec3 far = e + 1 < s->edges ? path->position[end] : rx;
        if (!path_in_sector(w, v3_scale(e > 0 ? path->leg[at] : along, -1), KELLER_BOUNDARY_ANGLE)) return false;
        if (!connect(s, node, far, at + 1, 1, end - at - 1, path, &image)) return false;
        KellerVec3 out = v3_sub(image, node);
        if (!path_in_sector(w, out, KELLER_BOUNDARY_ANGLE)) return false;
        length = v3_norm(out);
        set_legs(s, at + 1, end, v3_scale(out, 1 / length), path);
        path->length += length;
    }
    return true;
}

/* A stretch of legs between two edges that begins or ends along a face of one of them. */
typedef struct {
    KellerVec3 lift;            /* of one of its legs, to the side of the face on which the wave is; zero: no such stretch */
    bool both_sides;            /* along a screen: the wave may be on either */
    bool none;                  /* along one face, but on opposite sides of it: no path */
} Along;

static Along along_of(const Sequence *s, const KellerPath *path, size_t leg, double rounding)
{
    Along a = {.lift = {0, 0, 0}};
    size_t end[2] = {s->count, s->count};
    for (size_t e = 0; e + 1 < s->edges; e++)
        if (leg > s->edge[e] && leg <= s->edge[e + 1]) end[0] = s->edge[e], end[1] = s->edge[e + 1];
    if (end[0] == s->count) return a;
    KellerVec3 lift[2], out[2] = {path->leg[end[0] + 1], v3_scale(path->leg[end[1]], -1)};
    bool known[2], screen[2];
    for (int k = 0; k < 2; k++) {
        const KellerWedge *w = &s->scene->wedges[s->steps[end[k]].id];
        lift[k] = path_lift(w, v3_scale(out[k], path->length), rounding);
        known[k] = v3_dot(lift[k], lift[k]) > 0;
        screen[k] = known[k] && w->n == 2;
        if (screen[k]) lift[k] = v3_scale(s->scene->faces[w->face[0]].normal, v3_norm(lift[k]));
    }
    for (size_t i = end[0] + 1; i < leg; i++)
        lift[0] = v3_mirror_direction(lift[0], s->scene->faces[s->steps[i].id].normal);
    for (size_t i = end[1]; i-- > leg;) lift[1] = v3_mirror_direction(lift[1], s->scene->faces[s->steps[i].id].normal);
    int k = known[0] && (!screen[0] || !known[1] || screen[1]) ? 0 : 1; /* a solid's side counts before a screen's */
    a.lift = known[k] ? lift[k] : a.lift;
    a.both_sides = screen[k];
    a.none = known[0] && known[1] && !screen[0] && !screen[1] && v3_dot(lift[0], lift[1]) < 0;
    return a;
}

const uint32_t *path_planes_of(const KellerScene *scene, const KellerStep *step, size_t *count)
{
    *count = 1;
    if (step->kind == KELLER_REFLECTION) return &scene->faces[step->id].plane;
    const KellerWedge *w = &scene->wedges[step->id];
    *count = w->plane_end - w->plane_begin;
    return scene->wedge_planes + w->plane_begin;
}

bool path_solve_sequence(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, KellerVec3 rx, const uint32_t ground[2],
                         size_t count, const KellerStep *steps, bool strict, KellerPath *path, Crossings *crossings, bool *boundary,
                         KellerAccelWork *work)
{
    Sequence s;
    double rounding = greater(path_rounding(scene, tx), path_rounding(scene, rx));
    if (!cut(scene, count, steps, &s) || !find_points(&s, tx, rx, rounding, path)) return false;
    path->count = (uint32_t)count;

    /* validity, cheap things first */
    path->weight = 1;
    path->part[0] = path->part[1] = 0;
    path->patch = 0;
    bool border[KELLER_MAX_BENDS] = {false};
    KellerVec3 at[KELLER_MAX_BENDS]; /* where a reflection is to be looked up in its face */
    double walked = 0;
    KellerVec3 last = tx;
    for (size_t i = 0; i < count; i++) {
        path->step[i] = steps[i];
        path->triangle[i] = KELLER_NONE;
        walked += v3_distance(last, path->position[i]);
        last = path->position[i];
        if (steps[i].kind == KELLER_DIFFRACTION) continue;
        double h = greater(rounding, KELLER_BOUNDARY_ANGLE * walked * (path->length - walked) / path->length);
        Along along = along_of(&s, path, i, rounding);
        at[i] = v3_add(path->position[i], along.lift);
        double weight = path_face_weight(scene, steps[i].id, at[i], strict ? -1 : h, &path->triangle[i]);
        if (!(weight > 0) && along.both_sides) {
            at[i] = v3_sub(path->position[i], along.lift);
            weight = path_face_weight(scene, steps[i].id, at[i], strict ? -1 : h, &path->triangle[i]);
        }
        if (!(weight > 0)) return false;
        border[i] = weight < 1;
        *boundary = *boundary || border[i];
    }
    for (size_t i = 0; i + 1 < count; i++)
        if (v3_distance(path->position[i], path->position[i + 1]) <= rounding) {
            if (steps[i].kind == KELLER_DIFFRACTION || steps[i + 1].kind == KELLER_DIFFRACTION) return false;
            *boundary = true;
        }
    /* slabs are met in order along the path; where there can be none, the last leg, of which a search knows least, comes first */
    for (size_t k = 0; k <= count; k++) {
        size_t i = crossings->most > 0 ? k : count - k;
        PathLeg leg = {.number = (uint32_t)i, .strict = strict};
        leg.a = i > 0 ? path->position[i - 1] : tx;
        leg.b = i < count ? path->position[i] : rx;
        for (int end = 0; end < 2; end++) leg.skip[end] = &ground[end], leg.skip_count[end] = ground[end] != KELLER_NONE;
        if (i > 0) leg.skip[0] = path_planes_of(scene, &steps[i - 1], &leg.skip_count[0]);
        if (i < count) leg.skip[1] = path_planes_of(scene, &steps[i], &leg.skip_count[1]);
        Along along = along_of(&s, path, i, rounding);
        uint32_t passed = crossings->count;
        leg.lift = along.lift;
        bool passes = !along.none && path_leg_passes(scene, accel, &leg, crossings, boundary, work);
        if (!passes && along.both_sides) { /* along a screen there is a wave on either side of it */
            crossings->count = passed;
            leg.lift = v3_scale(leg.lift, -1);
            passes = path_leg_passes(scene, accel, &leg, crossings, boundary, work);
        }
        if (!passes) return false;
    }
    for (size_t i = 0; i < count; i++) {
        if (steps[i].kind == KELLER_DIFFRACTION) continue;
        if (!border[i] && !path_owns(scene, accel, steps[i].id, at[i], work)) return false;
        if (!border[i] || strict) continue;
        /* a station on a border: neither of the faces there can be told to reflect */
        if (v3_distance(tx, path->position[i]) <= rounding || v3_distance(rx, path->position[i]) <= rounding) return false;
        if (path_runs_along_border(scene, accel, path, i, rounding, work)) return false;
    }
    return true;
}
