#include "oracle.h"
#include "oracle_sequence.h"
#include <assert.h>
#include <math.h>

/* ---- verdicts --------------------------------------------------------------------------------------------------- */

bool oracle_decide(Verdict *v, bool holds, Real margin)
{
    if (holds) {
        v->least = fminl(v->least, margin);
        return true;
    }
    v->valid = false;
    v->failed = fmaxl(v->failed, margin);
    return margin < ORACLE_TOLERANCE;
}

/* ---- distances -------------------------------------------------------------------------------------------------- */

static Real distance_to_segment(Point p, Point a, Point b)
{
    Point d = minus(b, a);
    Real t = dot(minus(p, a), d) / dot(d, d);
    t = t < 0 ? 0 : t > 1 ? 1 : t;
    return apart(p, plus(a, d, t));
}

static Real between_segments(Point a, Point b, Point c, Point d)
{
    /* Both distances to the other segment's ends, and the inner minimum of the lines where it is inside of both. */
    Real least = fminl(fminl(distance_to_segment(a, c, d), distance_to_segment(b, c, d)),
                       fminl(distance_to_segment(c, a, b), distance_to_segment(d, a, b)));
    Point u = minus(b, a), v = minus(d, c), w = minus(a, c);
    Real uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), uw = dot(u, w), vw = dot(v, w), det = uu * vv - uv * uv;
    if (det > 1e-30L * uu * vv) {
        Real s = (uv * vw - vv * uw) / det, t = (uu * vw - uv * uw) / det;
        if (s >= 0 && s <= 1 && t >= 0 && t <= 1) least = fminl(least, apart(plus(a, u, s), plus(c, v, t)));
    }
    return least;
}

typedef struct {
    Point corner[3], normal;
    bool flat; /* of no area: meets nothing */
} Triangle;

static Triangle triangle_of(const KellerScene *scene, uint32_t index)
{
    Triangle t;
    for (int i = 0; i < 3; i++) t.corner[i] = wide(scene->vertices[scene->triangles[index][i]]);
    Point n = cross(minus(t.corner[1], t.corner[0]), minus(t.corner[2], t.corner[0]));
    Real area = norm(n);
    t.flat = !(area > 0);
    t.normal = t.flat ? n : plus((Point){0, 0, 0}, n, 1 / area);
    return t;
}

/* The smallest signed distance of p (in the plane) to the lines of the three sides: positive inside. */
static Real inside_by(const Triangle *t, Point p)
{
    Real least = INFINITY;
    for (int i = 0; i < 3; i++) {
        Point side = minus(t->corner[(i + 1) % 3], t->corner[i]);
        Real d = dot(cross(t->normal, side), minus(p, t->corner[i])) / norm(side);
        least = fminl(least, d);
    }
    return least;
}

/* In-plane distances are good to about 1e-16; a point this far out of a triangle is still inside, so that a point on a
 * side that two triangles of a face share is in the face whatever the rounding. */
#define ON_SIDE 1e-12L

/* Is p, in the plane of the face, inside of it? And how far from the face's border? */
static bool inside_face(const KellerScene *scene, uint32_t face, Point p, Real *margin)
{
    const KellerFace *f = &scene->faces[face];
    bool inside = false;
    *margin = INFINITY;
    for (uint32_t i = f->triangle_begin; i < f->triangle_end; i++) {
        uint32_t index = scene->face_triangles[i];
        Triangle t = triangle_of(scene, index);
        if (t.flat) continue;
        inside = inside || inside_by(&t, p) >= -ON_SIDE;
        for (int k = 0; k < 3; k++)
            if (scene->triangle_border[index] >> k & 1)
                *margin = fminl(*margin, distance_to_segment(p, t.corner[k], t.corner[(k + 1) % 3]));
    }
    return inside;
}

/* ---- visibility ------------------------------------------------------------------------------------------------- */

/* The leg from a to b comes nearer to the triangle's plane than the tolerance at one of its ends, or crosses it. */
static bool blocks(const KellerScene *scene, uint32_t index, Point a, Point b, Real *margin)
{
    Triangle t = triangle_of(scene, index);
    *margin = INFINITY;
    if (t.flat) return false;
    Real da = dot(t.normal, minus(a, t.corner[0])), db = dot(t.normal, minus(b, t.corner[0]));
    Real side = fminl(fabsl(da), fabsl(db));
    bool crosses = (da > 0 && db < 0) || (da < 0 && db > 0);
    if (!crosses && side >= ORACLE_TOLERANCE) return false;
    if (crosses && side >= ORACLE_TOLERANCE) {
        Point p = plus(a, minus(b, a), da / (da - db));
        Real in = inside_by(&t, p);
        if (in <= -ORACLE_TOLERANCE) {
            *margin = -in;
            return false;
        }
        Real border;
        bool face = inside_face(scene, scene->triangle_face[index], p, &border);
        *margin = border;
        return face;
    }
    /* An end is almost in the plane: what counts is how far the leg is from the triangle. */
    Real nearest = INFINITY;
    for (int k = 0; k < 3; k++) nearest = fminl(nearest, between_segments(a, b, t.corner[k], t.corner[(k + 1) % 3]));
    Point feet[2] = {plus(a, t.normal, -da), plus(b, t.normal, -db)};
    if (inside_by(&t, feet[0]) >= 0) nearest = fminl(nearest, fabsl(da));
    if (inside_by(&t, feet[1]) >= 0) nearest = fminl(nearest, fabsl(db));
    *margin = nearest;
    return crosses && nearest < ORACLE_TOLERANCE && inside_by(&t, plus(a, minus(b, a), da / (da - db))) > 0;
}

/* The decision that the leg a-b is free, over all triangles outside of the planes. */
static bool decide_free(const KellerScene *scene, Point a, Point b, size_t plane_count, const uint32_t *planes,
                        Verdict *v)
{
    for (uint32_t i = 0; i < scene->triangle_count; i++) {
        uint32_t plane = scene->faces[scene->triangle_face[i]].plane;
        bool skip = false;
        for (size_t k = 0; k < plane_count; k++) skip = skip || planes[k] == plane;
        Real margin;
        if (!skip) {
            bool blocked = blocks(scene, i, a, b, &margin);
            if (!oracle_decide(v, !blocked, margin)) return false;
        }
    }
    return true;
}

/* ---- slabs ------------------------------------------------------------------------------------------------------ */

#define MOST_CROSSINGS 256

/* A sheet of a slab that a leg passes through. */
typedef struct {
    uint32_t leg, face, plane;
    Real distance; /* from the leg's start */
    Point point;
    Real margin;
} Slab;

typedef struct {
    size_t count;
    Slab slab[MOST_CROSSINGS];
} Slabs;

static bool is_slab(const KellerScene *scene, uint32_t face)
{
    const KellerMaterial *m = &scene->materials[scene->faces[face].material];
    return m->kind != KELLER_MATERIAL_CONDUCTOR && m->thickness > 0;
}

/* Does the leg cross this one triangle, whatever its face does beside it? */
static bool crosses(const KellerScene *scene, uint32_t index, Point a, Point b, Real *margin)
{
    Triangle t = triangle_of(scene, index);
    if (t.flat) return *margin = INFINITY, false;
    Real da = dot(t.normal, minus(a, t.corner[0])), db = dot(t.normal, minus(b, t.corner[0]));
    if (fminl(fabsl(da), fabsl(db)) < ORACLE_TOLERANCE) return blocks(scene, index, a, b, margin);
    *margin = INFINITY;
    if ((da > 0) == (db > 0)) return false;
    Real in = inside_by(&t, plus(a, minus(b, a), da / (da - db)));
    *margin = fabsl(in);
    return in > 0;
}

/* The decision that nothing but slabs is in the way of the leg, lifted by so much, and which. Their points are on the leg. */
static bool decide_through(const KellerScene *scene, uint32_t leg, Point a, Point b, Point lift, size_t plane_count,
                           const uint32_t *planes, Slabs *slabs, Verdict *v)
{
    for (uint32_t i = 0; i < scene->triangle_count; i++) {
        uint32_t face = scene->triangle_face[i], plane = scene->faces[face].plane;
        bool skip = false;
        for (size_t k = 0; k < plane_count; k++) skip = skip || planes[k] == plane;
        if (skip) continue;
        Real margin;
        Point from = plus(a, lift, 1), to = plus(b, lift, 1);
        bool crossed = is_slab(scene, face) ? crosses(scene, i, from, to, &margin) : blocks(scene, i, from, to, &margin);
        if (!crossed || !is_slab(scene, face)) {
            if (!oracle_decide(v, !crossed, margin)) return false;
            continue;
        }
        const KellerFace *f = &scene->faces[face];
        Point n = wide(f->normal), d = minus(b, a);
        Real t = (f->offset - dot(n, a)) / dot(n, d);
        for (uint32_t sheet = 0; sheet < scene->triangle_sheets[i]; sheet++) {
            assert(slabs->count < MOST_CROSSINGS);
            slabs->slab[slabs->count++] = (Slab){leg, face, plane, t * norm(d), plus(a, d, t), margin};
        }
    }
    return true;
}

/* Faces of one plane are met where the first of them is. */
static void join_planes(Slabs *slabs)
{
    for (size_t i = 0; i < slabs->count; i++)
        for (size_t j = 0; j < slabs->count; j++) {
            Slab *s = &slabs->slab[i];
            const Slab *o = &slabs->slab[j];
            if (s->leg != o->leg || s->plane != o->plane || o->face > s->face) continue;
            bool first = true;
            for (size_t k = 0; k < slabs->count; k++)
                first = first && (slabs->slab[k].leg != o->leg || slabs->slab[k].plane != o->plane ||
                                  slabs->slab[k].face >= o->face);
            if (!first) continue;
            s->distance = o->distance;
            s->point = o->point;
        }
}

static bool slab_before(const Slab *a, const Slab *b)
{
    if (a->leg != b->leg) return a->leg < b->leg;
    if (a->plane == b->plane) return a->face < b->face;
    return a->distance < b->distance;
}

/* Makes steps of the slabs. Of too many, so many would have to give way. */
static void decide_slabs(Slabs *slabs, uint32_t most, OraclePath *path, Verdict *v)
{
    size_t n = slabs->count;
    if (n > most) {
        for (size_t i = 1; i < n; i++) /* by margin */
            for (size_t j = i; j > 0 && slabs->slab[j].margin < slabs->slab[j - 1].margin; j--) {
                Slab swap = slabs->slab[j];
                slabs->slab[j] = slabs->slab[j - 1];
                slabs->slab[j - 1] = swap;
            }
        oracle_decide(v, false, slabs->slab[n - most - 1].margin);
        return;
    }
    join_planes(slabs);
    for (size_t i = 0; i < n; i++) oracle_decide(v, true, slabs->slab[i].margin);
    for (size_t i = 1; i < n; i++)
        for (size_t j = i; j > 0 && slab_before(&slabs->slab[j], &slabs->slab[j - 1]); j--) {
            Slab swap = slabs->slab[j];
            slabs->slab[j] = slabs->slab[j - 1];
            slabs->slab[j - 1] = swap;
        }
    for (size_t i = 1; i < n; i++) {
        const Slab *a = &slabs->slab[i - 1], *b = &slabs->slab[i];
        if (a->leg == b->leg && a->plane != b->plane) oracle_decide(v, true, b->distance - a->distance);
    }
    if (!v->valid) return;
    OraclePath whole = {.bends = path->count, .length = path->length};
    for (uint32_t i = 0, k = 0; i <= path->count; i++) {
        for (; k < n && slabs->slab[k].leg == i; k++) {
            assert(whole.count < ORACLE_MAX_STEPS);
            whole.position[whole.count] = narrow(slabs->slab[k].point);
            whole.step[whole.count++] = (KellerStep){KELLER_TRANSMISSION, slabs->slab[k].face};
        }
        if (i == path->count) break;
        whole.position[whole.count] = path->position[i];
        whole.step[whole.count++] = path->step[i];
    }
    *path = whole;
}

bool oracle_blocked(const KellerScene *scene, KellerVec3 a, KellerVec3 b, size_t plane_count, const uint32_t *planes,
                    double *margin)
{
    Verdict v = {true, INFINITY, 0};
    decide_free(scene, wide(a), wide(b), plane_count, planes, &v);
    *margin = verdict_margin(&v);
    return !v.valid;
}

/* ---- one sequence ----------------------------------------------------------------------------------------------- */

/* The position along the edge that makes |a - q| + |q - b| shortest: safeguarded Newton on the derivative, which grows
 * with t; its zero lies between the feet of a and b. */
static Real shortest(const KellerWedge *w, Point a, Point b)
{
    Point origin = wide(w->origin), direction = wide(w->direction);
    Real za = dot(minus(a, origin), direction), zb = dot(minus(b, origin), direction);
    Real low = fminl(za, zb), high = fmaxl(za, zb), t = (low + high) / 2;
    for (int i = 0; i < 200; i++) {
        Point q = plus(origin, direction, t);
        Real ra = apart(a, q), rb = apart(b, q);
        if (!(ra > 0) || !(rb > 0)) break;
        Real slope = (t - za) / ra + (t - zb) / rb;
        if (slope > 0)
            high = t;
        else
            low = t;
        Real ua = (t - za) / ra, ub = (t - zb) / rb;
        Real curvature = (1 - ua * ua) / ra + (1 - ub * ub) / rb, next = t - slope / curvature;
        if (!(next > low && next < high)) next = (low + high) / 2;
        if (fabsl(next - t) <= 1e-18L * (1 + fabsl(t))) return next;
        t = next;
    }
    return t;
}

bool oracle_walk_back(const KellerScene *scene, size_t count, const uint32_t *faces, const Point *images, Point target,
                      Point *point, Verdict *v)
{
    for (size_t i = count; i-- > 0;) {
        Real hi = height(scene, faces[i], images[i + 1]), ht = height(scene, faces[i], target);
        bool opposite = (hi > 0 && ht < 0) || (hi < 0 && ht > 0);
        if (!oracle_decide(v, opposite, fminl(fabsl(hi), fabsl(ht))) || hi == ht) return false;
        point[i] = target = plus(images[i + 1], minus(target, images[i + 1]), hi / (hi - ht));
    }
    return true;
}

/* Reflection at p: in the face, and in no face of the same plane with a lower id. */
static bool decide_face(const KellerScene *scene, uint32_t face, Point p, Verdict *v)
{
    Real margin;
    bool in = inside_face(scene, face, p, &margin);
    if (!oracle_decide(v, in, margin)) return false;
    for (uint32_t other = 0; other < face; other++) {
        if (scene->faces[other].plane != scene->faces[face].plane) continue;
        in = inside_face(scene, other, p, &margin);
        if (!oracle_decide(v, !in, margin)) return false;
    }
    return true;
}

/* The neighbour x of the point q on the edge is within the wedge's sector. */
static bool decide_sector(const KellerWedge *w, Point q, Point x, Verdict *v)
{
    if (w->n >= 2) return true; /* the whole turn */
    const Real pi = 3.14159265358979323846264338327950288L;
    Point d = minus(x, q);
    Real across = dot(d, wide(w->normal0)), along = dot(d, wide(w->tangent0)), rho = hypotl(across, along);
    Real phi = atan2l(across, along), open = w->n * pi;
    if (phi < 0) phi += 2 * pi;
    bool in = phi <= open;
    Real angle = fminl(fminl(phi, 2 * pi - phi), fabsl(phi - open));
    return oracle_decide(v, in, rho * sinl(fminl(angle, pi / 2)));
}

/* A leg from one edge to another that lies in a face of the first runs along that face: in its sector, by identity and not
 * by an angle of rounding. On the far side of the edge it is well inside of the sector or outside: that can be told. */
static bool along_face(const KellerScene *scene, uint32_t wedge, uint32_t other, Point q, Point x, Point *up)
{
    const KellerWedge *w = &scene->wedges[wedge];
    for (int i = 0; i < 2; i++) {
        if (!wedge_has_plane(scene, other, scene->faces[w->face[i]].plane)) continue;
        const Real pi = 3.14159265358979323846264338327950288L;
        Point d = minus(x, q);
        Real phi = atan2l(dot(d, wide(w->normal0)), dot(d, wide(w->tangent0)));
        if (i == 1) phi -= w->n * pi;
        if (!(fabsl(remainderl(phi, 2 * pi)) < 1e-6L)) continue;
        *up = i == 0 ? wide(w->normal0)
                     : plus(plus((Point){0, 0, 0}, wide(w->tangent0), sinl(w->n * pi)), wide(w->normal0), -cosl(w->n * pi));
        return true;
    }
    return false;
}

void oracle_judge(const KellerScene *scene, uint32_t count, const KellerStep *steps, const Point *point,
                  uint32_t transmissions, OraclePath *path, Verdict *verdict)
{
    for (uint32_t i = 0; i < count; i++)
        if (steps[i].kind == KELLER_REFLECTION && !decide_face(scene, steps[i].id, point[i + 1], verdict)) return;
    for (uint32_t i = 0; i < count; i++) {
        if (steps[i].kind != KELLER_DIFFRACTION) continue;
        const KellerWedge *w = &scene->wedges[steps[i].id];
        Point up;
        for (int side = -1; side <= 1; side += 2) {
            uint32_t k = i + (uint32_t)side;
            bool edge = k < count && steps[k].kind == KELLER_DIFFRACTION;
            if (edge && along_face(scene, steps[i].id, steps[k].id, point[i + 1], point[k + 1], &up)) continue;
            if (!decide_sector(w, point[i + 1], point[k + 1], verdict)) return;
        }
    }
    path->count = path->bends = count;
    Slabs slabs = {.count = 0};
    Real length = 0;
    for (uint32_t i = 0; i < count; i++) {
        path->step[i] = steps[i];
        path->position[i] = narrow(point[i + 1]);
    }
    for (uint32_t i = 0; i <= count; i++) {
        uint32_t planes[64];
        size_t plane_count = 0;
        for (uint32_t k = i ? i - 1 : 0; k <= i && k < count; k++) {
            if (steps[k].kind == KELLER_REFLECTION) {
                planes[plane_count++] = scene->faces[steps[k].id].plane;
                continue;
            }
            const KellerWedge *w = &scene->wedges[steps[k].id];
            for (uint32_t p = w->plane_begin; p < w->plane_end; p++) {
                assert(plane_count < 62);
                planes[plane_count++] = scene->wedge_planes[p];
            }
        }
        Point a = point[i], b = point[i + 1], lift = {0, 0, 0}, up[2];
        if (i > 0 && i < count && steps[i - 1].kind == KELLER_DIFFRACTION && steps[i].kind == KELLER_DIFFRACTION) {
            uint32_t v = steps[i - 1].id, w = steps[i].id;
            bool along[2] = {along_face(scene, v, w, a, b, &up[0]), along_face(scene, w, v, b, a, &up[1])};
            bool screen[2] = {scene->wedges[v].n >= 2, scene->wedges[w].n >= 2};
            if (along[0] && along[1] && !screen[0] && !screen[1] && dot(up[0], up[1]) < 0) {
                oracle_decide(verdict, false, INFINITY); /* on opposite sides of the face */
                return;
            }
            /* just above the face: what stands on it blocks; of a screen either side may be free, which is left open */
            int k = along[0] && !screen[0] ? 0 : 1;
            if ((along[0] || along[1]) && along[k] && !screen[k]) lift = plus(lift, up[k], 10 * ORACLE_TOLERANCE);
        }
        bool go_on = transmissions
                         ? decide_through(scene, i, a, b, lift, plane_count, planes, &slabs, verdict)
                         : decide_free(scene, plus(a, lift, 1), plus(b, lift, 1), plane_count, planes, verdict);
        if (!go_on) return;
        length += apart(point[i], point[i + 1]);
    }
    path->length = (double)length;
    if (transmissions) decide_slabs(&slabs, transmissions, path, verdict);
}

Verdict oracle_solve_sequence(const KellerScene *scene, const Sequence *s, uint32_t transmissions, OraclePath *path)
{
    Verdict v = {true, INFINITY, 0};
    Point point[ORACLE_MAX_STEPS + 2], back[ORACLE_MAX_STEPS];
    size_t before = s->before, after = s->after, count = before + after + (s->wedge != KELLER_NONE);
    Point start = s->image_before[0], end = s->image_after[0];
    Real t = 0;
    if (s->wedge != KELLER_NONE) {
        const KellerWedge *w = &scene->wedges[s->wedge];
        t = shortest(w, s->image_before[before], s->image_after[after]);
        if (!oracle_decide(&v, t > 0 && t < w->length, fminl(fabsl(t), fabsl(w->length - t)))) return v;
        Point q = plus(wide(w->origin), wide(w->direction), t);
        if (!oracle_walk_back(scene, before, s->face_before, s->image_before, q, point + 1, &v) ||
            !oracle_walk_back(scene, after, s->face_after, s->image_after, q, back, &v))
            return v;
        point[before + 1] = q;
        for (size_t i = 0; i < after; i++) point[count - i] = back[i];
    } else if (!oracle_walk_back(scene, before, s->face_before, s->image_before, end, point + 1, &v)) {
        return v;
    }
    point[0] = start;
    point[count + 1] = end;
    KellerStep steps[ORACLE_MAX_STEPS];
    for (size_t i = 0; i < count; i++) {
        bool edge = s->wedge != KELLER_NONE && i == before;
        steps[i].kind = edge ? KELLER_DIFFRACTION : KELLER_REFLECTION;
        steps[i].id = edge ? s->wedge : i < before ? s->face_before[i] : s->face_after[count - 1 - i];
    }
    oracle_judge(scene, (uint32_t)count, steps, point, transmissions, path, &v);
    return v;
}

bool oracle_follows_rules(const KellerScene *scene, uint32_t count, const KellerStep *steps)
{
    for (uint32_t i = 1; i < count; i++) {
        KellerStep a = steps[i - 1], b = steps[i];
        bool fa = a.kind == KELLER_REFLECTION, fb = b.kind == KELLER_REFLECTION;
        if (fa && fb && scene->faces[a.id].plane == scene->faces[b.id].plane) return false;
        if (fa && !fb && wedge_has_plane(scene, b.id, scene->faces[a.id].plane)) return false;
        if (!fa && fb && wedge_has_plane(scene, a.id, scene->faces[b.id].plane)) return false;
        if (!fa && !fb && oracle_same_edge(scene, a.id, b.id)) return false;
    }
    return true;
}

bool oracle_solve(const KellerScene *scene, KellerVec3 tx, KellerVec3 rx, uint32_t count, const KellerStep *steps,
                  uint32_t transmissions, OraclePath *path)
{
    *path = (OraclePath){0};
    assert(count <= ORACLE_MAX_STEPS);
    if (!oracle_follows_rules(scene, count, steps)) return false;
    uint32_t edges = 0;
    for (uint32_t k = 0; k < count; k++) edges += steps[k].kind == KELLER_DIFFRACTION;
    if (edges > 1) {
        Verdict v = oracle_solve_edges(scene, wide(tx), wide(rx), count, steps, transmissions, path);
        path->valid = v.valid;
        path->margin = verdict_margin(&v);
        return true;
    }
    Sequence s = {.wedge = KELLER_NONE};
    s.image_before[0] = wide(tx);
    s.image_after[0] = wide(rx);
    uint32_t i = 0;
    for (; i < count && steps[i].kind == KELLER_REFLECTION; i++) {
        s.face_before[s.before] = steps[i].id;
        s.image_before[s.before + 1] = image(scene, steps[i].id, s.image_before[s.before]);
        s.before++;
    }
    if (i < count) {
        s.wedge = steps[i].id;
        for (uint32_t k = count; k-- > i + 1;) {
            assert(steps[k].kind == KELLER_REFLECTION);
            s.face_after[s.after] = steps[k].id;
            s.image_after[s.after + 1] = image(scene, steps[k].id, s.image_after[s.after]);
            s.after++;
        }
    }
    Verdict v = oracle_solve_sequence(scene, &s, transmissions, path);
    path->valid = v.valid;
    path->margin = verdict_margin(&v);
    return true;
}
