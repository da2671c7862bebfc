/* Paths that graze several edges at once. */
#include "path/solve.h"

#include <math.h>
#include <stdlib.h>

#include "base/number.h"

typedef struct {
    const KellerScene *scene;
    const KellerAccel *accel;
    KellerAccelWork *work;
    double step;                /* m: how far the positions are that decide */
} Look;

/* Of the positions around both ends of a piece of a leg, the share from which the one sees the other. Those that an end on a surface has
 * behind it do not count. An end on an interaction stays, unless both do. NaN: there are no positions. */
static double share_of(const Look *l, const PathLeg *piece)
{
    int all = 0, free_ones = 0;
    KellerVec3 ahead = v3_unit(v3_sub(piece->b, piece->a));
    bool held[2] = {piece->skip_count[0] > 0, piece->skip_count[1] > 0};
    for (int i = 0; i < PATH_AROUND; i++) {
        PathLeg leg = *piece, out, in;
        Crossings none = {.most = 0};
        bool grazes;
        path_around(i, l->step, piece->a, piece->b, &leg.a, &leg.b);
        if (held[0] && !held[1]) leg.a = piece->a;
        if (held[1] && !held[0]) leg.b = piece->b;
        leg.strict = true;
        leg.grazes = NULL;
        out = (PathLeg){.a = leg.a, .b = v3_madd(piece->a, ahead, 10 * l->step), .strict = true};
        in = (PathLeg){.a = leg.b, .b = v3_madd(piece->b, ahead, -10 * l->step), .strict = true};
        if (!held[0] && !path_leg_passes(l->scene, l->accel, &out, &none, &grazes, l->work)) continue;
        if (!held[1] && !path_leg_passes(l->scene, l->accel, &in, &none, &grazes, l->work)) continue;
        all++;
        free_ones += path_leg_passes(l->scene, l->accel, &leg, &none, &grazes, l->work);
    }
    return all > 0 ? (double)free_ones / all : NAN;
}

typedef struct {
    const KellerScene *scene;
    KellerVec3 p, along;
    double rounding;
} Plane;

static bool visit_along(void *context, uint32_t triangle)
{
    const Plane *q = context;
    const KellerFace *f = &q->scene->faces[q->scene->triangle_face[triangle]];
    return fabs(v3_dot(f->normal, q->along)) <= KELLER_BOUNDARY_ANGLE && fabs(v3_dot(f->normal, q->p) - f->offset) <= q->rounding;
}

/* Does the leg run along a face at p? Looked for by a short piece across it, which meets a face wherever it points. */
static bool runs_along_face(const Look *l, KellerVec3 p, KellerVec3 along)
{
    Plane q = {l->scene, p, along, 4 * path_rounding(l->scene, p)};
    KellerVec3 across = v3_scale(v3_perpendicular(along), 4 * q.rounding);
    return keller_accel_segment(l->accel, v3_sub(p, across), v3_add(p, across), 4 * q.rounding, visit_along, &q, l->work);
}

static int compare(const void *a, const void *b)
{
    const double *x = a, *y = b;
    return (*x > *y) - (*x < *y);
}

/* Of the places where a leg grazes edges, one for each boundary. */
static void merge(const Look *l, const PathLeg *leg, Grazes *g)
{
    const double apart = 100; /* steps: nearer to each other than this they are not told apart */
    double length = v3_distance(leg->a, leg->b);
    KellerVec3 along = v3_scale(v3_sub(leg->b, leg->a), 1 / length);
    uint32_t kept = 0;
    qsort(g->at, g->count, sizeof *g->at, compare);
    for (uint32_t i = 0; i < g->count; i++) {
        bool same = kept > 0 && (g->at[i] - g->at[kept - 1]) * length < apart * l->step;
        if (kept > 0 && !same)
            same = runs_along_face(l, v3_madd(leg->a, along, 0.5 * length * (g->at[i] + g->at[kept - 1])), along);
        if (!same) g->at[kept++] = g->at[i];
    }
    g->count = kept;
}

/* Multiplies *weight with the shares of what the leg grazes, each seen from half-way to its neighbours, and counts them. */
static bool weigh(const Look *l, const PathLeg *leg, const Grazes *g, uint32_t *count, double *weight)
{
    KellerVec3 d = v3_sub(leg->b, leg->a);
    for (uint32_t i = 0; i < g->count; i++) {
        PathLeg piece = *leg;
        if (i > 0) {
            piece.a = v3_madd(leg->a, d, 0.5 * (g->at[i - 1] + g->at[i]));
            piece.skip_count[0] = 0;
        }
        if (i + 1 < g->count) {
            piece.b = v3_madd(leg->a, d, 0.5 * (g->at[i] + g->at[i + 1]));
            piece.skip_count[1] = 0;
        }
        *weight *= share_of(l, &piece);
        ++*count;
    }
    return !isnan(*weight);
}

/* A reflection at the border of its face, or where the next interaction is too, is a boundary of another kind. */
static bool only_grazes(const KellerScene *scene, KellerVec3 tx, const KellerPath *path, double rounding)
{
    KellerVec3 last = tx;
    double walked = 0;
    for (uint32_t i = 0; i < path->count; i++) {
        double leg = v3_distance(last, path->position[i]);
        uint32_t triangle;
        if (i > 0 && leg <= rounding) return false;
        walked += leg;
        last = path->position[i];
        double h = greater(rounding, KELLER_BOUNDARY_ANGLE * walked * (path->length - walked) / path->length);
        if (path->step[i].kind == KELLER_REFLECTION && path_face_weight(scene, path->step[i].id, last, h, &triangle) < 1) return false;
        if (path->step[i].kind == KELLER_DIFFRACTION)
            for (int side = 0; side < 2; side++) {
                const KellerWedge *w = &scene->wedges[path->step[i].id];
                if (path_along_face(w, side ? path->leg[i + 1] : v3_scale(path->leg[i], -1)) >= 0) return false;
            }
    }
    return true;
}

bool path_several_grazed(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, KellerVec3 rx, const KellerPath *path,
                         double *weight, KellerAccelWork *work)
{
    double rounding = greater(path_rounding(scene, tx), path_rounding(scene, rx)), product = 1;
    Look look = {scene, accel, work, path_around_step(scene, path, rounding)};
    uint32_t count = 0, edges = 0, edges_before = 0;
    bool between_edges = false;
    if (!only_grazes(scene, tx, path, rounding)) return false;
    for (uint32_t i = 0; i < path->count; i++) edges += path->step[i].kind == KELLER_DIFFRACTION;
    for (uint32_t i = 0; i <= path->count; i++) {
        edges_before += i > 0 && path->step[i - 1].kind == KELLER_DIFFRACTION;
        Grazes grazes = {.count = 0};
        PathLeg leg = {.number = i, .a = i > 0 ? path->position[i - 1] : tx, .b = i < path->count ? path->position[i] : rx,
                       .grazes = &grazes};
        Crossings none = {.most = 0};
        bool ignored;
        if (i > 0) leg.skip[0] = path_planes_of(scene, &path->step[i - 1], &leg.skip_count[0]);
        if (i < path->count) leg.skip[1] = path_planes_of(scene, &path->step[i], &leg.skip_count[1]);
        if (!path_leg_passes(scene, accel, &leg, &none, &ignored, work)) return false;
        merge(&look, &leg, &grazes);
        if (!weigh(&look, &leg, &grazes, &count, &product)) return false;
        between_edges = between_edges || (grazes.count > 0 && edges_before > 0 && edges_before < edges);
    }
    if (count < 2 && !between_edges) return false;
    *weight = product;
    return true;
}
