#include "path/carry.h"

#include <math.h>
#include <string.h>

#include "base/number.h"
#include "wave/dyad.h"

static const double widest_zone = 0.2; /* rad */
_Static_assert(KELLER_MAX_BENDS <= ROW_EDGES, "a row holds every path");

static KellerCVec3 complex_vector(KellerVec3 v) { return (KellerCVec3){v.x, v.y, v.z}; }
static double complex component(KellerCVec3 e, KellerVec3 along) { return e.x * along.x + e.y * along.y + e.z * along.z; }

static KellerCVec3 weighted_sum(double complex p, KellerCVec3 a, double complex q, KellerCVec3 b)
{
    return (KellerCVec3){p * a.x + q * b.x, p * a.y + q * b.y, p * a.z + q * b.z};
}

/* ---- turning ------------------------------------------------------------------------------------------------------- */

typedef struct {
    KellerVec3 axis;            /* unit */
    double angle;               /* rad; 0: nothing turns, to the last bit */
} Turn;

static KellerVec3 turn(Turn t, KellerVec3 v)
{
    if (t.angle == 0) return v;
    double c = cos(t.angle), along = v3_dot(t.axis, v);
    KellerVec3 across = v3_madd(v, t.axis, -along);
    return v3_madd(v3_madd(v3_scale(t.axis, along), across, c), v3_cross(t.axis, across), sin(t.angle));
}

static KellerCVec3 turn_field(Turn t, KellerCVec3 e)
{
    if (t.angle == 0) return e;
    KellerVec3 re = turn(t, v3(creal(e.x), creal(e.y), creal(e.z))), im = turn(t, v3(cimag(e.x), cimag(e.y), cimag(e.z)));
    return (KellerCVec3){re.x + I * im.x, re.y + I * im.y, re.z + I * im.z};
}

static Turn back(Turn t) { return (Turn){t.axis, -t.angle}; }

KellerVec3 path_turned(const PathWave *w, int end, double angle, KellerVec3 v)
{
    /* about the edge, a ray that turns towards growing azimuth at its other end turns the other way round */
    return turn((Turn){w->end[end].axis, -angle * w->end[end].sense}, v);
}

/* ---- faces ----------------------------------------------------------------------------------------------------------- */

/* Two waves through the steps from `from` on before `to`, the rays turned: reflection coefficients are those of the turned ray,
 * transmissions those of the path's own, as a slab does not shift the path either. *t is mirrored on the way. */
static void pass_faces(const PathWave *w, uint32_t from, uint32_t to, Turn *t, KellerCVec3 e[2])
{
    for (uint32_t i = from; i < to; i++) {
        const KellerStep *step = &w->path->step[i];
        const KellerFace *f = &w->scene->faces[step->id];
        const KellerMedium *medium = &w->media[f->material];
        if (step->kind == KELLER_TRANSMISSION) {
            for (int j = 0; j < 2; j++)
                e[j] = turn_field(*t, keller_transmit_field(medium, f->normal, w->path->leg[i], w->k, turn_field(back(*t), e[j])));
            continue;
        }
        KellerVec3 in = turn(*t, w->path->leg[i]);
        keller_reflect_fields(medium, f->normal, in, w->k, 2, e);
        *t = (Turn){v3_mirror_direction(t->axis, f->normal), -t->angle};
    }
}

/* From the transmitter to the first edge, with the ray turned towards growing azimuth there. */
static void arrive(const PathWave *w, double angle, KellerCVec3 e[2])
{
    Turn t = {w->end[0].axis, -angle * w->end[0].sense};
    for (int j = 0; j < 2; j++) e[j] = turn_field(t, e[j]);
    pass_faces(w, 0, w->first, &t, e);
    for (int j = 0; j < 2; j++) e[j] = turn_field(back(t), e[j]);
}

/* From the last edge to the receiver. */
static void leave(const PathWave *w, double angle, KellerCVec3 e[2])
{
    Turn t = {w->end[1].edge, -angle};
    for (int j = 0; j < 2; j++) e[j] = turn_field(t, e[j]);
    pass_faces(w, w->behind, w->path->count, &t, e);
    for (int j = 0; j < 2; j++) e[j] = turn_field(back(t), e[j]);
}

/* True if a reflection there depends on the angle. */
static bool varies(const PathWave *w, uint32_t from, uint32_t to)
{
    for (uint32_t i = from; i < to; i++) {
        const KellerMedium *m = &w->media[w->scene->faces[w->path->step[i].id].material];
        if (w->path->step[i].kind == KELLER_REFLECTION && !(m->conductor && !(m->roughness > 0))) return true;
    }
    return false;
}

static double size_of(const KellerCVec3 e[2])
{
    double sum = 0;
    for (int j = 0; j < 2; j++)
        sum += creal(e[j].x * conj(e[j].x)) + creal(e[j].y * conj(e[j].y)) + creal(e[j].z * conj(e[j].z));
    return sqrt(sum);
}

/* The derivative by the angle of what the faces between an end and its edge make of e; *change over the zone. */
static void face_slopes(const PathWave *w, int end, const KellerCVec3 e[2], KellerCVec3 slope[2], double *change)
{
    void (*stage)(const PathWave *, double, KellerCVec3[2]) = end == 0 ? arrive : leave;
    double h = w->end[end].zone;
    KellerCVec3 more[2] = {e[0], e[1]}, less[2] = {e[0], e[1]};
    stage(w, h, more);
    stage(w, -h, less);
    for (int j = 0; j < 2; j++) slope[j] = weighted_sum(0.5 / sin(h), more[j], -0.5 / sin(h), less[j]);
    double all = size_of(more) + size_of(less);
    *change = all > 0 ? 2 * h * size_of(slope) / all : 0;
}

/* ---- edges ------------------------------------------------------------------------------------------------------------- */

/* What of the edges' field is wanted: itself, of a ray turned at either end by an angle towards growing azimuth, or, of one edge,
 * the slope term of an end. */
typedef struct {
    bool slope;
    int end;
    double turn[2];             /* rad */
} Variation;

static double fade_of(const PathWave *w, uint32_t number)
{
    const PathEdge *e = &w->edges.edge[number];
    /* of two as one the strip's first edge, whichever comes first on the path */
    uint32_t at = w->path->step[e->begin].id == e->first ? e->begin : e->end;
    return path_end_fade(w->scene, w->path, at, w->k * w->cascade.along[number]);
}

static void over_one(const PathWave *w, const Variation *v, KellerCVec3 e[2])
{
    const PathEdge *edge = &w->edges.edge[0];
    KellerWedgeWave wedge = path_edge_wave(w->scene, w->path, edge, w->media);
    KellerVec3 in = w->path->leg[edge->begin], out = w->path->leg[edge->end + 1];
    double before = w->cascade.before, behind = w->cascade.behind;
    for (int j = 0; j < 2; j++)
        e[j] = v->slope ? keller_diffract_slope(&wedge, in, out, before, behind, w->k, v->end == 1, e[j])
                        : keller_diffract_field(&wedge, in, out, before, behind, w->k, e[j]);
}

static void face_between(const PathWave *w, uint32_t i, Chain *chain)
{
    const KellerStep *step = &w->path->step[i];
    const KellerFace *f = &w->scene->faces[step->id];
    const KellerMedium *medium = &w->media[f->material];
    KellerCVec3 (*through)(const KellerMedium *, KellerVec3, KellerVec3, double, KellerCVec3) =
        step->kind == KELLER_REFLECTION ? keller_reflect_field : keller_transmit_field;
    KellerVec3 in = w->path->leg[i];
    for (int j = 0; j < 2; j++)
        for (int a = 0; a < 4; a++) {
            for (int b = 0; b < (chain->edge.edges > 1 ? 4 : 1); b++)
                chain->whole[j][a][b] = through(medium, f->normal, in, w->k, chain->whole[j][a][b]);
            chain->rest[j][a] = through(medium, f->normal, in, w->k, chain->rest[j][a]);
        }
    if (!chain->row) return;
    for (int j = 0; j < 2; j++) {
        chain->row->carried[j] = through(medium, f->normal, in, w->k, chain->row->carried[j]);
        for (int a = 0; a < 16; a++)
            chain->row->product[j][a / 4][a % 4] = through(medium, f->normal, in, w->k, chain->row->product[j][a / 4][a % 4]);
    }
}

static void over_several(const PathWave *w, const Variation *v, KellerCVec3 e[2])
{
    Chain chain;
    ChainRow row;
    uint32_t number = 0, last = w->cascade.count - 1;
    Turn first = {w->end[0].edge, v->turn[0]}, second = {w->end[1].edge, v->turn[1]};
    for (uint32_t i = w->first; i < w->behind; i++) {
        if (w->path->step[i].kind != KELLER_DIFFRACTION) {
            face_between(w, i, &chain);
            continue;
        }
        const PathEdge *edge = &w->edges.edge[number];
        KellerWedgeWave wedge = path_edge_wave(w->scene, w->path, edge, w->media);
        KellerVec3 in = w->path->leg[edge->begin], out = w->path->leg[edge->end + 1];
        if (number > 0) in = v3_scale(path_beside_screen(w->scene, w->path->step[edge->begin].id, v3_scale(in, -1)), -1);
        if (number < last) out = path_beside_screen(w->scene, w->path->step[edge->end].id, out);
        else out = turn(second, out);
        if (number == 0) {
            const KellerCVec3 turned[2] = {turn_field(first, e[0]), turn_field(first, e[1])};
            chain_begin(&wedge, turn(first, in), out, w->cascade.place[0], w->k, turned, last + 1 < CHAIN_ROW ? NULL : &row, &chain);
        } else {
            chain_next(&wedge, in, out, w->cascade.place[number], &chain);
        }
        i = edge->end;
        number++;
    }
    chain_fields(&chain, e);
    for (int j = 0; j < 2; j++) e[j] = turn_field(back(second), e[j]);
}

/* How to differentiate: values at so many steps to growing azimuths, or, turned round, to falling ones. */
typedef struct {
    int count, at[6];
    double weight[6];
} Stencil;

/* Of a smooth function; of one that is smooth to one side; of one that jumps here, the mean of both sides' derivatives. */
static const Stencil central = {2, {-1, 1}, {-0.5, 0.5}}, to_one_side = {3, {0, 1, 2}, {-1.5, 2, -0.5}},
                     beside = {6, {1, 2, 3, -1, -2, -3}, {-1.25, 2, -0.75, 1.25, -2, 0.75}};

typedef struct {
    const Stencil *stencil;
    double step;                /* rad; negative: turned round */
} Steps;

/* A chain jumps on the boundaries of its edges, and ends at their faces: none of them is to lie within the stencil. */
static Steps steps_beside_poles(const PathWave *w, int end)
{
    enum { REACH = 3 };
    static const int by_azimuth[2][4] = {{-1, 1, 1, -1}, {1, -1, 1, -1}};
    const double fine = 0.02; /* of the zone: an error of some 1e-4 of the slope, and rounding of 1e-12 of it */
    const PathEdge *e = &w->edges.edge[end == 0 ? 0 : w->cascade.count - 1];
    KellerWedgeWave wedge = path_edge_wave(w->scene, w->path, e, w->media);
    EdgeRays rays = dyad_rays(&wedge, w->path->leg[e->begin], w->path->leg[e->end + 1]);
    UtdTerm term[4];
    utd_terms(wedge.n, rays.diffracted.phi, rays.incident.phi, rays.sin_beta0, 1, 1, term);
    double phi = end == 0 ? rays.incident.phi : rays.diffracted.phi, open = wedge.n * M_PI;
    for (double step = fine * w->end[end].zone; step > KELLER_BOUNDARY_ANGLE; step /= 8) {
        bool at_boundary = false, up = open - phi < REACH * step, down = phi < REACH * step; /* in the way to either side */
        for (int i = 0; i < 4; i++) {
            if (2 * asin(lesser(1, 0.5 * term[i].x)) > REACH * step) continue;
            at_boundary = at_boundary || term[i].on_boundary;
            if (term[i].on_boundary) continue;
            if (term[i].side * by_azimuth[end][i] < 0) up = true;
            else down = true;
        }
        if (!up && !down) return (Steps){at_boundary ? &beside : &central, step};
        if (!at_boundary && up != down) return (Steps){&to_one_side, up ? -step : step};
    }
    return (Steps){&to_one_side, phi < 0.5 * open ? KELLER_BOUNDARY_ANGLE : -KELLER_BOUNDARY_ANGLE};
}

/* The derivative of a chain by the azimuth of an end. */
static void chain_slope(const PathWave *w, int end, KellerCVec3 e[2])
{
    Steps steps = steps_beside_poles(w, end);
    KellerCVec3 sum[2] = {{0, 0, 0}, {0, 0, 0}};
    for (int n = 0; n < steps.stencil->count; n++) {
        Variation v = {.turn = {0, 0}};
        KellerCVec3 at[2] = {e[0], e[1]};
        v.turn[end] = steps.stencil->at[n] * steps.step;
        over_several(w, &v, at);
        for (int j = 0; j < 2; j++) sum[j] = weighted_sum(1, sum[j], steps.stencil->weight[n] / steps.step, at[j]);
    }
    for (int j = 0; j < 2; j++) e[j] = weighted_sum(w->end[end].slope, sum[j], 0, sum[j]);
}

/* ---- all --------------------------------------------------------------------------------------------------------------- */

static const Variation as_it_is = {.slope = false};

static void over_edges(const PathWave *w, KellerCVec3 e[2])
{
    if (w->cascade.count == 1) over_one(w, &as_it_is, e);
    if (w->cascade.count > 1) over_several(w, &as_it_is, e);
}

/* The slope term of an end; false where the field at the edge hardly changes. */
static bool slope_over_edges(const PathWave *w, int end, double change, KellerCVec3 e[2])
{
    double part = (change - path_even) / (path_uneven - path_even);
    if (!(part > 0)) return false;
    if (w->cascade.count == 1) over_one(w, &(Variation){.slope = true, .end = end}, e);
    else chain_slope(w, end, e);
    for (int j = 0; j < 2 && part < 1; j++) e[j] = weighted_sum(part, e[j], 0, e[j]);
    return true;
}

static void bases(const PathWave *w, KellerVec3 at_tx[2], KellerVec3 at_rx[2])
{
    keller_spherical_basis(w->path->leg[0], &at_tx[0], &at_tx[1]);
    keller_spherical_basis(v3_scale(w->path->leg[w->path->count], -1), &at_rx[0], &at_rx[1]);
}

static void receive(const PathWave *w, const KellerVec3 at_rx[2], const KellerCVec3 e[2], double complex transfer[4])
{
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++) transfer[2 * i + j] += w->spreading * component(e[j], at_rx[i]);
}

/* What a wave loses if the way from the last edge to the receiver changes with the angle: the edges' field is the sum of two
 * transverse ones, each with its own slope behind. */
static void add_slope_behind(const PathWave *w, const KellerVec3 at_rx[2], const KellerCVec3 start[2], double complex transfer[4])
{
    KellerVec3 across[2];
    keller_spherical_basis(w->path->leg[w->behind], &across[0], &across[1]);
    const KellerCVec3 unit[2] = {complex_vector(across[0]), complex_vector(across[1])};
    KellerCVec3 behind[2], e[2] = {start[0], start[1]}, sum[2];
    double change;
    face_slopes(w, 1, unit, behind, &change);
    if (!slope_over_edges(w, 1, change, e)) return;
    for (int j = 0; j < 2; j++) sum[j] = weighted_sum(component(e[j], across[0]), behind[0], component(e[j], across[1]), behind[1]);
    receive(w, at_rx, sum, transfer);
}

void path_carry(const PathWave *w, double complex transfer[4])
{
    KellerVec3 at_tx[2], at_rx[2];
    bases(w, at_tx, at_rx);
    memset(transfer, 0, 4 * sizeof *transfer);
    if (!(w->spreading > 0)) return;
    const KellerCVec3 start[2] = {complex_vector(at_tx[0]), complex_vector(at_tx[1])};
    KellerCVec3 at_edge[2] = {start[0], start[1]}, e[2];
    arrive(w, 0, at_edge);
    memcpy(e, at_edge, sizeof e);
    over_edges(w, e);
    leave(w, 0, e);
    receive(w, at_rx, e, transfer);
    if (w->cascade.count == 0) return;
    if (varies(w, 0, w->first)) {
        double change;
        face_slopes(w, 0, start, e, &change);
        if (slope_over_edges(w, 0, change, e)) {
            leave(w, 0, e);
            receive(w, at_rx, e, transfer);
        }
    }
    if (varies(w, w->behind, w->path->count)) add_slope_behind(w, at_rx, at_edge, transfer);
}

void path_carry_slope(const PathWave *w, int end, double change, double complex slope[4])
{
    KellerVec3 at_tx[2], at_rx[2];
    bases(w, at_tx, at_rx);
    memset(slope, 0, 4 * sizeof *slope);
    if (!(w->spreading > 0) || w->cascade.count == 0) return;
    KellerCVec3 e[2] = {complex_vector(at_tx[0]), complex_vector(at_tx[1])};
    arrive(w, 0, e);
    if (!slope_over_edges(w, end, change, e)) return;
    leave(w, 0, e);
    receive(w, at_rx, e, slope);
}

/* The edge at an end, and how it looks from there. */
static void see_edge(PathWave *w, int end)
{
    const KellerPath *p = w->path;
    const PathEdge *e = &w->edges.edge[end == 0 ? 0 : w->edges.count - 1];
    KellerWedgeWave wedge = path_edge_wave(w->scene, p, e, w->media);
    KellerVec3 ray = end == 0 ? p->leg[e->begin] : p->leg[e->end + 1];
    double distance = end == 0 ? w->cascade.before : w->cascade.behind, sine = v3_norm(v3_cross(ray, wedge.direction));
    w->end[end].edge = w->end[end].axis = wedge.direction;
    w->end[end].sense = 1;
    w->end[end].slope = keller_slope_factor(w->k, distance, sine);
    w->end[end].zone = lesser(widest_zone, 1 / (sqrt(2 * w->k * distance) * sine));
    uint32_t faces = end == 0 ? w->first : p->count - w->behind;
    for (uint32_t i = 0; i < faces; i++) {
        const KellerStep *step = &p->step[end == 0 ? w->first - 1 - i : w->behind + i];
        if (step->kind != KELLER_REFLECTION) continue;
        w->end[end].axis = v3_mirror_direction(w->end[end].axis, w->scene->faces[step->id].normal);
        w->end[end].sense = -w->end[end].sense;
    }
}

PathWave path_wave(const KellerScene *scene, const KellerPath *path, double width, KellerVec3 tx, double k, const KellerMedium *media)
{
    PathWave w = {.scene = scene, .path = path, .media = media, .tx = tx, .k = k, .first = path->count, .behind = path->count};
    path_edges(scene, path, width, &w.edges);
    if (!(w.edges.weight > 0)) return w;
    w.spreading = w.edges.weight * path_cascade(scene, path, &w.edges, tx, &w.cascade);
    for (uint32_t i = 0; i < w.edges.count; i++) w.spreading *= fade_of(&w, i);
    if (w.edges.count == 0) return w;
    w.first = w.edges.edge[0].begin;
    w.behind = w.edges.edge[w.edges.count - 1].end + 1;
    for (int end = 0; end < 2; end++) see_edge(&w, end);
    return w;
}
