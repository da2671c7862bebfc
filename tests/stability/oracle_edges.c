/* Sequences with two diffractions or more, by brute force: points on the edges that make the whole path shortest. */
#include "oracle.h"
#include "oracle_sequence.h"
#include "oracle_shortest.h"
#include <assert.h>
#include <math.h>

enum { MOST = ORACLE_MAX_STEPS };

bool oracle_same_edge(const KellerScene *scene, uint32_t a, uint32_t b)
{
    const KellerWedge *v = &scene->wedges[a], *w = &scene->wedges[b];
    if (v->vertex[0] == w->vertex[0] && v->vertex[1] == w->vertex[1]) return true;
    Point d = wide(v->direction), p = minus(wide(w->origin), wide(v->origin));
    return norm(cross(d, p)) < 1e-12L && norm(cross(d, plus(p, wide(w->direction), w->length))) < 1e-12L;
}

Verdict oracle_solve_edges(const KellerScene *scene, Point tx, Point rx, uint32_t count, const KellerStep *steps,
                           uint32_t transmissions, OraclePath *path)
{
    Verdict v = {true, INFINITY, 0};
    Lines l = {.source = tx, .target = rx};
    uint32_t place[MOST];
    Real edge[MOST], t[MOST];
    Point point[MOST + 2];
    for (uint32_t i = 0; i < count; i++) {
        if (steps[i].kind == KELLER_DIFFRACTION) {
            const KellerWedge *w = &scene->wedges[steps[i].id];
            place[l.n] = i;
            edge[l.n] = w->length;
            l.origin[l.n] = wide(w->origin);
            l.direction[l.n++] = wide(w->direction);
        } else if (l.n == 0) {
            l.source = image(scene, steps[i].id, l.source);
        }
    }
    assert(l.n > 1);
    for (uint32_t i = count; i-- > place[0] + 1;) { /* all that comes behind step i is seen in its mirror */
        if (steps[i].kind != KELLER_REFLECTION) continue;
        Point n = wide(scene->faces[steps[i].id].normal);
        l.target = image(scene, steps[i].id, l.target);
        for (size_t k = 0; k < l.n; k++) {
            if (place[k] < i) continue;
            l.origin[k] = image(scene, steps[i].id, l.origin[k]);
            l.direction[k] = plus(l.direction[k], n, -2 * dot(n, l.direction[k]));
        }
    }
    for (size_t k = 0; k < l.n; k++) t[k] = edge[k] / 2;
    if (!lines_shortest(&l, t)) {
        oracle_decide(&v, false, INFINITY);
        return v;
    }
    for (size_t k = 0; k < l.n; k++)
        if (!oracle_decide(&v, t[k] > 0 && t[k] < edge[k], fminl(fabsl(t[k]), fabsl(edge[k] - t[k])))) return v;
    point[0] = tx;
    point[count + 1] = rx;
    for (size_t k = 0; k < l.n; k++) {
        const KellerWedge *w = &scene->wedges[steps[place[k]].id];
        point[place[k] + 1] = plus(wide(w->origin), wide(w->direction), t[k]);
    }
    for (size_t k = 0; k <= l.n; k++) { /* the reflections between */
        uint32_t begin = k ? place[k - 1] + 1 : 0, end = k < l.n ? place[k] : count, faces[MOST];
        Point images[MOST + 1] = {point[begin]};
        for (uint32_t i = begin; i < end; i++) {
            faces[i - begin] = steps[i].id;
            images[i - begin + 1] = image(scene, steps[i].id, images[i - begin]);
        }
        if (!oracle_walk_back(scene, end - begin, faces, images, point[end + 1], point + begin + 1, &v)) return v;
    }
    oracle_judge(scene, count, steps, point, transmissions, path, &v);
    return v;
}
