/* What a solved sequence gives: a path, with its transmissions among its steps; exactly on a boundary, the share of the
 * surroundings (docs/architecture.md). */
#include "path/solve.h"

#include <math.h>

#include "base/number.h"

void path_insert(const KellerScene *scene, KellerVec3 tx, KellerVec3 rx, const KellerPath *path, const Crossings *crossings,
                 KellerPath *whole)
{
    uint32_t n = 0, next = 0;
    whole->length = path->length;
    whole->weight = path->weight;
    whole->part[0] = whole->part[1] = 0;
    whole->patch = path->patch;
    for (uint32_t i = 0; i <= path->count; i++) {
        KellerVec3 a = i > 0 ? path->position[i - 1] : tx, b = i < path->count ? path->position[i] : rx;
        for (; next < crossings->count && crossings->at[next].leg == i; next++) {
            const Crossing *c = &crossings->at[next];
            double t;
            whole->leg[n] = path->leg[i];
            whole->step[n] = (KellerStep){KELLER_TRANSMISSION, c->face};
            whole->triangle[n] = c->triangle;
            whole->free_end[n] = 0;
            whole->position[n++] = path_crossing(scene, c->at, a, b, &t);
        }
        whole->leg[n] = path->leg[i];
        if (i == path->count) break;
        whole->step[n] = path->step[i];
        whole->triangle[n] = path->triangle[i];
        whole->free_end[n] = path->free_end[i];
        whole->position[n++] = path->position[i];
    }
    whole->count = n;
}

/* Which ends of the path's edges are free. An edge that ends at the ground, or goes on in it, is not: there is no place from which the
 * point could be seen to leave it. Looked at from just beside the edge, in the middle of the sector. */
static void find_free_ends(const KellerScene *scene, const KellerAccel *accel, KellerPath *path, KellerAccelWork *work)
{
    double beside = 100 * scene->contact;
    for (uint32_t i = 0; i < path->count; i++) {
        path->free_end[i] = 0;
        if (path->step[i].kind != KELLER_DIFFRACTION) continue;
        const KellerWedge *w = &scene->wedges[path->step[i].id];
        double half = 0.5 * w->n * M_PI;
        KellerVec3 off = v3_scale(v3_add(v3_scale(w->tangent0, cos(half)), v3_scale(w->normal0, sin(half))), beside);
        for (int end = 0; end < 2; end++) {
            KellerVec3 beyond = v3_madd(w->origin, w->direction, end == 0 ? -beside : w->length + beside);
            PathLeg leg = {.a = v3_add(path->position[i], off), .b = v3_add(beyond, off), .strict = true};
            Crossings none = {.most = 0};
            bool grazes;
            if (path_leg_passes(scene, accel, &leg, &none, &grazes, work)) path->free_end[i] |= (uint8_t)(1 << end);
        }
    }
}

/* ---- on a boundary ----------------------------------------------------------------------------------------------- */

enum { DIRECTIONS = PATH_DIRECTIONS, AROUND = PATH_AROUND };

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

void path_around(int i, double step, KellerVec3 a, KellerVec3 b, KellerVec3 *beside_a, KellerVec3 *beside_b)
{
    static const KellerVec3 around[DIRECTIONS] = {
        {0.4118, 0.6903, 0.5949}, {-0.7442, 0.2887, 0.6024}, {0.1621, -0.5353, 0.8290}, {0.8863, -0.3617, 0.2893}};
    int j = i / 8, k = (j + 1) % DIRECTIONS;
    if (i & 4) { /* exchanged */
        int swap = j;
        j = k;
        k = swap;
    }
    *beside_a = v3_madd(a, around[j], i & 1 ? step : -step);
    *beside_b = v3_madd(b, around[k], i & 2 ? step : -step);
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
static void look_around(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, KellerVec3 rx, const uint32_t ground[2],
                        size_t count, const KellerStep *steps, uint32_t transmissions, const KellerPath *path, Surroundings *s,
                        KellerAccelWork *work)
{
    double rounding = greater(path_rounding(scene, tx), path_rounding(scene, rx)), step = path_around_step(scene, path, rounding);
    KellerVec3 ahead = path->leg[0], last = path->leg[path->count];
    ways_at_ends(tx, rx, path, rounding, &ahead, &last);
    s->all = s->count = 0;
    for (int i = 0; i < AROUND; i++) {
        KellerVec3 t, r;
        path_around(i, step, tx, rx, &t, &r);
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
        s->way[s->count].blocker = NULL;
        if (path_solve_sequence(scene, accel, t, r, ground, count, steps, true, &other, &s->way[s->count], &boundary, work)) see(s);
    }
}

static bool solve_around(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, KellerVec3 rx, const uint32_t ground[2],
                         size_t count, const KellerStep *steps, uint32_t transmissions, KellerPath *path, KellerPathFound found,
                         void *context, KellerAccelWork *work)
{
    Surroundings s;
    const bool free_ends = ground[0] == KELLER_NONE && ground[1] == KELLER_NONE;
    if (free_ends && transmissions == 0 && path_several_grazed(scene, accel, tx, rx, path, &path->weight, work))
        return path->weight > 0 ? found(context, path) : true;
    look_around(scene, accel, tx, rx, ground, count, steps, transmissions, path, &s, work);
    for (uint32_t i = 0; i < s.count; i++) {
        KellerPath whole;
        path->weight = (double)s.seen[i] / s.all;
        path_insert(scene, tx, rx, path, &s.way[i], &whole);
        if (!found(context, &whole)) return false;
    }
    return true;
}

bool path_solve_on(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, KellerVec3 rx, const uint32_t ground[2],
                   size_t count, const KellerStep *steps, uint32_t transmissions, KellerPathFound found, void *context,
                   KellerAccelWork *work)
{
    bool boundary = false;
    KellerPath path, whole;
    Crossings crossings;
    if (transmissions > KELLER_MAX_INTERACTIONS - count) transmissions = (uint32_t)(KELLER_MAX_INTERACTIONS - count); /* room in a path */
    crossings.most = transmissions;
    crossings.count = 0;
    crossings.blocker = NULL;
    if (!path_solve_sequence(scene, accel, tx, rx, ground, count, steps, false, &path, &crossings, &boundary, work)) return true;
    find_free_ends(scene, accel, &path, work);
    if (boundary) return solve_around(scene, accel, tx, rx, ground, count, steps, transmissions, &path, found, context, work);
    if (crossings.count == 0) return found(context, &path);
    path_insert(scene, tx, rx, &path, &crossings, &whole);
    return found(context, &whole);
}

bool keller_path_solve(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, KellerVec3 rx, size_t count,
                       const KellerStep *steps, uint32_t transmissions, KellerPathFound found, void *context,
                       KellerAccelWork *work)
{
    const uint32_t none[2] = {KELLER_NONE, KELLER_NONE};
    return path_solve_on(scene, accel, tx, rx, none, count, steps, transmissions, found, context, work);
}
