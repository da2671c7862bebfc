#include "path/arrival.h"

#include <math.h>

#include "base/number.h"

static const double pad = 1e-5; /* of cotangents and of lengths along an edge: far above single precision */

static float widened(double x, int side) { return (float)(x + side * pad * (1 + fabs(x))); }

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
    double z_low, z_high, near, far, low, high;
    path_line_distances(w, a, b, &z_low, &z_high, &near, &far);
    double from = w->length * trie->nodes[node].lit[0] / LIT_WHOLE, to = w->length * trie->nodes[node].lit[1] / LIT_WHOLE;
    path_cotangents(from - z_high, to - z_low, near, far, &low, &high);
    return (Arrival){{widened(low, -1), widened(high, 1)}, {widened(from, -1), widened(to, 1)}};
}

/* Is the segment from a to b surely outside of the wedge's sector? The sector is the common part, n <= 1, or the union, of the
 * half-spaces above its faces. */
static bool below(const KellerWedge *w, KellerVec3 normal, KellerVec3 a, KellerVec3 b)
{
    KellerVec3 ends[2] = {v3_sub(a, w->origin), v3_sub(b, w->origin)};
    for (int i = 0; i < 2; i++)
        if (v3_dot(ends[i], normal) >= -1e-6 * (1 + v3_norm(ends[i]))) return false;
    return true;
}

static bool outside_sector(const KellerWedge *w, KellerVec3 a, KellerVec3 b)
{
    bool first = below(w, w->normal0, a, b);
    if (first != (w->n > 1)) return first;
    double open = w->n * M_PI;
    return below(w, v3_sub(v3_scale(w->tangent0, sin(open)), v3_scale(w->normal0, cos(open))), a, b);
}

bool edge_pair(const KellerScene *scene, uint32_t first, uint32_t second, EdgePair *pair)
{
    const KellerWedge *w[2] = {&scene->wedges[first], &scene->wedges[second]};
    if (w[0]->vertex[0] == w[1]->vertex[0] && w[0]->vertex[1] == w[1]->vertex[1]) return false;
    pair->turn = v3_dot(w[0]->direction, w[1]->direction);
    for (int i = 0; i < 2; i++) {
        const KellerWedge *me = w[i], *other = w[1 - i];
        KellerVec3 end = v3_madd(other->origin, other->direction, other->length);
        if (outside_sector(me, other->origin, end)) return false;
        KellerVec3 from = v3_sub(other->origin, me->origin);
        double z0 = v3_dot(from, me->direction);
        KellerVec3 p = v3_madd(from, me->direction, -z0), l = v3_madd(other->direction, me->direction, -pair->turn);
        pair->seen[i].z0 = z0;
        pair->seen[i].a = v3_dot(p, p);
        pair->seen[i].b = 2 * v3_dot(p, l);
        pair->seen[i].c = v3_dot(l, l);
        double rounding = path_rounding(scene, me->origin), far = pair->seen[i].a + other->length * (pair->seen[i].b + other->length * pair->seen[i].c);
        if (pair->seen[i].a <= rounding * rounding && far <= rounding * rounding) return false; /* in one line */
    }
    return true;
}

bool edges_agree(const EdgePair *pair, const Arrival *one, const Arrival *other)
{
    const Arrival *side[2] = {one, other};
    for (int i = 0; i < 2; i++) {
        const Arrival *me = side[i], *far_one = side[1 - i];
        double t0 = far_one->lit[0], t1 = far_one->lit[1], a = pair->seen[i].a, b = pair->seen[i].b, c = pair->seen[i].c;
        double r0 = a + t0 * (b + t0 * c), r1 = a + t1 * (b + t1 * c), least = lesser(r0, r1);
        double t = -0.5 * b; /* over c: where rho is least */
        if (t > t0 * c && t < t1 * c) least = a + 0.5 * b * t / c;
        double z0 = pair->seen[i].z0 + pair->turn * t0, z1 = pair->seen[i].z0 + pair->turn * t1, low, high;
        path_cotangents(lesser(z0, z1) - me->lit[1], greater(z0, z1) - me->lit[0], sqrt(greater(0, least)) * (1 - 1e-6),
                        sqrt(greater(0, greater(r0, r1))) * (1 + 1e-6), &low, &high);
        if (low > me->cot[1] || high < me->cot[0]) return false;
    }
    return true;
}
