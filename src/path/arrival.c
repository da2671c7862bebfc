#include "path/arrival.h"

#include <math.h>

static const double GRAZING = 1e-3; /* sine: where a flatter leg crosses a plane is not known well enough */
static const double square_slack = 16 * 0x1p-52; /* of a + t^2 c: rounding of a + t (b + t c), at most 12 units of 2^-53 of it */

static float widened(double x, int side) { return (float)(x + side * arrival_pad * (1 + fabs(x))); }

static KellerVec3 mirrored(const KellerScene *scene, const StepCode *codes, uint32_t begin, uint32_t end, KellerVec3 p)
{
    for (uint32_t i = begin; i < end; i++) {
        const KellerFace *f = &scene->faces[code_id(codes[i])];
        p = v3_mirror_point(p, f->normal, f->offset);
    }
    return p;
}

Arrival arrival_of(const KellerScene *scene, const Trie *trie, uint32_t node, KellerVec3 end)
{
    StepCode codes[KELLER_MAX_BENDS];
    const TrieNode *at = &trie->nodes[node];
    uint32_t length = trie_steps(trie, node, codes), begin = length - 1;
    const KellerWedge *w = &scene->wedges[code_id(codes[length - 1])];
    for (; begin > 0 && !code_is_wedge(codes[begin - 1]);) {
        at = &trie->nodes[at->parent];
        begin--;
    }
    KellerVec3 a, b;
    if (begin > 0) { /* they are the part of the edge before that is lit */
        const KellerWedge *v = &scene->wedges[code_id(codes[begin - 1])];
        const uint16_t *lit = trie->nodes[at->parent].lit;
        a = v3_madd(v->origin, v->direction, v->length * lit[0] / LIT_WHOLE);
        b = v3_madd(v->origin, v->direction, v->length * lit[1] / LIT_WHOLE);
    } else {
        a = b = end;
    }
    a = mirrored(scene, codes, begin, length - 1, a);
    b = mirrored(scene, codes, begin, length - 1, b);
    double z_low, z_high, near, far;
    path_line_distances(w, a, b, &z_low, &z_high, &near, &far);
    double from = w->length * trie->nodes[node].lit[0] / LIT_WHOLE, to = w->length * trie->nodes[node].lit[1] / LIT_WHOLE;
    return (Arrival){{widened(from, -1), widened(to, 1)}, {widened(z_low, -1), widened(z_high, 1)}, {widened(near, -1), widened(far, 1)}};
}

Arrival arrival_of_all(const Arrival *arrival, uint32_t count)
{
    Arrival all = arrival[0];
    for (uint32_t i = 1; i < count; i++) {
        const float *from[3] = {arrival[i].lit, arrival[i].z, arrival[i].rho};
        float *to[3] = {all.lit, all.z, all.rho};
        for (int k = 0; k < 3; k++) {
            if (from[k][0] < to[k][0]) to[k][0] = from[k][0];
            if (from[k][1] > to[k][1]) to[k][1] = from[k][1];
        }
    }
    return all;
}

/* Is the edge surely below the face with this normal of another? */
static bool below(const EdgeImage *me, KellerVec3 normal, const KellerVec3 ends[2])
{
    for (int i = 0; i < 2; i++) {
        KellerVec3 v = v3_sub(ends[i], me->origin);
        double h = v3_dot(v, normal);
        if (h >= 0 || h * h <= 1e-12 * (1 + v3_dot(v, v))) return false;
    }
    return true;
}

/* The sector is the common part, n <= 1, or the union, of the half-spaces above its faces. */
static bool outside_sector(const EdgeImage *me, const EdgeImage *other)
{
    const KellerVec3 ends[2] = {other->origin, v3_madd(other->origin, other->direction, other->length)};
    bool first = below(me, me->normal[0], ends);
    return first != me->convex ? first : below(me, me->normal[1], ends);
}

/* The point mirrored in `count` faces, the last one first. */
static KellerVec3 mirrored_in(const KellerScene *scene, uint32_t count, const uint32_t *face, KellerVec3 p)
{
    for (uint32_t i = 0; i < count; i++) {
        const KellerFace *f = &scene->faces[face[count - 1 - i]];
        p = v3_mirror_point(p, f->normal, f->offset);
    }
    return p;
}

static KellerVec3 on_edge(const KellerWedge *w, double t) { return v3_madd(w->origin, w->direction, t); }

EdgeImage edge_image(const KellerScene *scene, uint32_t wedge, uint32_t count, const uint32_t *face)
{
    const KellerWedge *w = &scene->wedges[wedge];
    const double open = w->n * M_PI;
    EdgeImage l = {w->origin, w->direction, {w->normal0, v3_sub(v3_scale(w->tangent0, sin(open)), v3_scale(w->normal0, cos(open)))},
                  w->length, path_rounding(scene, w->origin), w->n > 1};
    for (uint32_t i = 0; i < count; i++) {
        const KellerFace *f = &scene->faces[face[i]];
        l.origin = v3_mirror_point(l.origin, f->normal, f->offset);
        KellerVec3 *vector[3] = {&l.direction, &l.normal[0], &l.normal[1]};
        for (int k = 0; k < 3; k++) *vector[k] = v3_madd(*vector[k], f->normal, -2 * v3_dot(*vector[k], f->normal));
    }
    return l;
}

bool edge_pair(const EdgeImage *first, const EdgeImage *second, EdgePair *pair)
{
    const EdgeImage *line[2] = {first, second};
    pair->turn = v3_dot(first->direction, second->direction);
    pair->rounding = greater(first->rounding, second->rounding);
    for (int i = 0; i < 2; i++) {
        const EdgeImage *me = line[i], *other = line[1 - i];
        if (outside_sector(me, other)) return false;
        KellerVec3 from = v3_sub(other->origin, me->origin);
        double z0 = v3_dot(from, me->direction);
        KellerVec3 p = v3_madd(from, me->direction, -z0), l = v3_madd(other->direction, me->direction, -pair->turn);
        pair->seen[i].z0 = z0;
        pair->seen[i].a = v3_dot(p, p);
        pair->seen[i].b = 2 * v3_dot(p, l);
        pair->seen[i].c = v3_dot(l, l);
        double rounding = me->rounding, far = pair->seen[i].a + other->length * (pair->seen[i].b + other->length * pair->seen[i].c);
        if (pair->seen[i].a <= rounding * rounding && far <= rounding * rounding) return false; /* in one line */
    }
    return true;
}

bool edges_agree(const EdgePair *pair, const Arrival *one, const Arrival *other, double lit[2][2])
{
    enum { ROUNDS = 2 };        /* more narrow little: the places hardly depend on one another */
    const Arrival *side[2] = {one, other};
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 2; k++) lit[i][k] = side[i]->lit[k];
    for (int round = 0; round < ROUNDS; round++)
        for (int i = 0; i < 2; i++) {
            const Arrival *me = side[i];
            double t0 = lit[1 - i][0], t1 = lit[1 - i][1], a = pair->seen[i].a, b = pair->seen[i].b, c = pair->seen[i].c;
            double r0 = a + t0 * (b + t0 * c), r1 = a + t1 * (b + t1 * c), least = lesser(r0, r1);
            double t = -0.5 * b; /* over c: where rho is least */
            if (t > t0 * c && t < t1 * c) least = a + 0.5 * b * t / c;
            double z0 = pair->seen[i].z0 + pair->turn * t0, z1 = pair->seen[i].z0 + pair->turn * t1;
            const double z[2] = {lesser(z0, z1), greater(z0, z1)};
            const double slack = square_slack * (a + c * greater(t0 * t0, t1 * t1)); /* much where edges nearly touch: the rest cancels */
            const double rho[2] = {greater(0, sqrt(greater(0, least - slack)) - pair->rounding),
                                   sqrt(greater(0, greater(r0, r1)) + slack) + pair->rounding};
            const double from[2] = {me->z[0], me->z[1]}, away[2] = {greater(0, me->rho[0]), me->rho[1]};
            narrow_between(from, away, z, rho, lit[i]);
            if (!(lit[i][0] <= lit[i][1])) return false;
        }
    return true;
}

bool edge_part_to(const KellerScene *scene, const KellerVec3 edge[2], const double z[2], const double rho[2], const double zb[2],
                  const double rb[2], double on[2])
{
    const double length = v3_distance(edge[0], edge[1]);
    const double far = fabs(zb[0]) + fabs(zb[1]) + rb[1]; /* the ends' rounding turns a short edge */
    /* of the two ends, and half as much for the points, which are in the scene and no less exact than these */
    const double slack = 6 * (path_rounding(scene, edge[0]) + path_rounding(scene, edge[1])) * (1 + far / length);
    const double wide_z[2] = {zb[0] - slack, zb[1] + slack}, wide_r[2] = {greater(0, rb[0] - slack), rb[1] + slack};
    on[0] = -slack;
    on[1] = length + slack;
    if (!(length > arrival_pad)) return true;
    narrow_between(z, rho, wide_z, wide_r, on);
    return on[0] <= on[1];
}

bool edge_leads_to(const KellerScene *scene, const KellerVec3 edge[2], const double z[2], const double rho[2], KellerVec3 a, KellerVec3 b)
{
    const double length = v3_distance(edge[0], edge[1]);
    if (!(length > arrival_pad)) return true;
    const KellerWedge line = {.origin = edge[0], .direction = v3_scale(v3_sub(edge[1], edge[0]), 1 / length)};
    double zb[2], rb[2], on[2];
    path_line_distances(&line, a, b, &zb[0], &zb[1], &rb[0], &rb[1]);
    return edge_part_to(scene, edge, z, rho, zb, rb, on);
}

double arrival_reach(const Arrival *a) { return greater(fabs(a->z[0]), fabs(a->z[1])) + greater(fabs(a->lit[0]), fabs(a->lit[1])) + a->rho[1]; }

bool faces_between(const KellerScene *scene, const FaceBox *boxes, uint32_t first, uint32_t second, uint32_t count, const uint32_t *face,
                   const double lit[2][2], double beyond)
{
    const KellerWedge *w[2] = {&scene->wedges[first], &scene->wedges[second]};
    KellerVec3 a[2];            /* of the first edge, mirrored in what is behind */
    for (int k = 0; k < 2; k++) a[k] = on_edge(w[0], lit[0][k]);
    for (uint32_t i = 0; i < count; i++) {
        const KellerFace *f = &scene->faces[face[i]];
        KellerVec3 low = v3(INFINITY, INFINITY, INFINITY), high = v3(-INFINITY, -INFINITY, -INFINITY);
        double margin = 0;
        bool crossed = true;
        for (int k = 0; k < 4 && crossed; k++) { /* all crossings are in the hull of these four */
            KellerVec3 p = a[k & 1], q = mirrored_in(scene, count - i, &face[i], on_edge(w[1], lit[1][k >> 1]));
            double hp = v3_dot(f->normal, p) - f->offset, hq = v3_dot(f->normal, q) - f->offset;
            const double apart = v3_distance(p, q), sine = apart > 0 ? (fabs(hp) + fabs(hq)) / apart : 0;
            crossed = sine > GRAZING;
            margin = greater(margin, 8 * ((path_rounding(scene, p) + path_rounding(scene, q)) / greater(sine, GRAZING) +
                                          KELLER_BOUNDARY_ANGLE * (apart + beyond)));
            crossed = crossed && fabs(hp) > margin && fabs(hq) > margin && (hp > 0) != (hq > 0);
            p = v3_madd(p, v3_sub(q, p), hp / (hp - hq));
            low = v3(lesser(low.x, p.x), lesser(low.y, p.y), lesser(low.z, p.z));
            high = v3(greater(high.x, p.x), greater(high.y, p.y), greater(high.z, p.z));
        }
        const FaceBox *box = &boxes[face[i]];
        if (crossed && (low.x > box->upper.x + margin || high.x < box->lower.x - margin || low.y > box->upper.y + margin ||
                        high.y < box->lower.y - margin || low.z > box->upper.z + margin || high.z < box->lower.z - margin))
            return false;
        for (int k = 0; k < 2; k++) a[k] = v3_mirror_point(a[k], f->normal, f->offset);
    }
    return true;
}
