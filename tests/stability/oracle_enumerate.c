#include "oracle.h"
#include "oracle_sequence.h"
#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* A sequence of faces seen from one end, with the end's images. */
typedef struct {
    size_t count;
    uint32_t face[ORACLE_MAX_STEPS];
    Point image[ORACLE_MAX_STEPS + 1];
} Chain;

typedef struct {
    size_t count, capacity;
    Chain *chain;
} Chains;

static void *grown(void *array, size_t count, size_t *capacity, size_t size)
{
    if (count < *capacity) return array;
    *capacity = *capacity ? 2 * *capacity : 64;
    array = realloc(array, *capacity * size);
    if (!array) {
        fprintf(stderr, "out of memory\n");
        abort();
    }
    return array;
}

/* The wave that comes from `from`, an image of the source, and is mirrored in `face` goes on along the line from the
 * mirror image, on the side of `from`. Exact: what has no corner there is not reached. */
static bool reaches_face(const KellerScene *scene, uint32_t face, Point from, uint32_t next)
{
    Real side = height(scene, face, from);
    const KellerFace *f = &scene->faces[next];
    for (uint32_t i = f->triangle_begin; i < f->triangle_end; i++)
        for (int k = 0; k < 3; k++) {
            Point p = wide(scene->vertices[scene->triangles[scene->face_triangles[i]][k]]);
            if (side * height(scene, face, p) > -1e-6L * fabsl(side)) return true;
        }
    return false;
}

/* The same for an edge: the piece of it on that side, seen from the image through the face's plane, must meet the
 * box of the face (a superset of the face; 1e-6 m wider than it is). */
static bool reaches_edge(const KellerScene *scene, const Chain *c, const KellerWedge *w)
{
    if (c->count == 0) return true;
    uint32_t face = c->face[c->count - 1];
    Point eye = c->image[c->count], end[2] = {wide(w->origin), plus(wide(w->origin), wide(w->direction), w->length)};
    Real eye_height = height(scene, face, eye);
    Real h[2] = {height(scene, face, end[0]), height(scene, face, end[1])};
    bool far[2] = {h[0] * eye_height < 0, h[1] * eye_height < 0};
    if (!far[0] && !far[1]) return fminl(fabsl(h[0]), fabsl(h[1])) < 1e-6L;
    if (!far[0] || !far[1] || fabsl(h[0]) < 1e-6L || fabsl(h[1]) < 1e-6L || fabsl(eye_height) < 1e-6L) return true;
    Point seen[2];
    for (int i = 0; i < 2; i++) seen[i] = plus(eye, minus(end[i], eye), eye_height / (eye_height - h[i]));
    Point low = {INFINITY, INFINITY, INFINITY}, high = {-INFINITY, -INFINITY, -INFINITY};
    const KellerFace *f = &scene->faces[face];
    for (uint32_t i = f->triangle_begin; i < f->triangle_end; i++)
        for (int k = 0; k < 3; k++) {
            Point p = wide(scene->vertices[scene->triangles[scene->face_triangles[i]][k]]);
            low = (Point){fminl(low.x, p.x), fminl(low.y, p.y), fminl(low.z, p.z)};
            high = (Point){fmaxl(high.x, p.x), fmaxl(high.y, p.y), fmaxl(high.z, p.z)};
        }
    const Real wider = 1e-6L;
    return fmaxl(seen[0].x, seen[1].x) >= low.x - wider && fminl(seen[0].x, seen[1].x) <= high.x + wider &&
           fmaxl(seen[0].y, seen[1].y) >= low.y - wider && fminl(seen[0].y, seen[1].y) <= high.y + wider &&
           fmaxl(seen[0].z, seen[1].z) >= low.z - wider && fminl(seen[0].z, seen[1].z) <= high.z + wider;
}

/* All chains of up to `depth` faces from `source`. */
static Chains chains_from(const KellerScene *scene, Point source, size_t depth)
{
    Chains all = {0};
    all.chain = grown(NULL, 0, &all.capacity, sizeof *all.chain);
    all.chain[all.count++] = (Chain){.image = {source}};
    for (size_t first = 0, level = 0; level < depth; level++) {
        size_t last = all.count;
        for (; first < last; first++)
            for (uint32_t face = 0; face < scene->face_count; face++) {
                Chain c = all.chain[first];
                if (c.count > 0) {
                    uint32_t previous = c.face[c.count - 1];
                    if (scene->faces[previous].plane == scene->faces[face].plane ||
                        !reaches_face(scene, previous, c.image[c.count - 1], face))
                        continue;
                    /* Backwards the same: the previous face has a part on the side that the wave comes from. */
                    if (!reaches_face(scene, face, c.image[c.count], previous)) continue;
                }
                c.face[c.count] = face;
                c.image[c.count + 1] = image(scene, face, c.image[c.count]);
                c.count++;
                all.chain = grown(all.chain, all.count, &all.capacity, sizeof *all.chain);
                all.chain[all.count++] = c;
            }
    }
    return all;
}

static void keep(OracleResult *result, const OraclePath *path)
{
    result->undecidable += path->margin < ORACLE_TOLERANCE;
    result->path = grown(result->path, result->count, &result->capacity, sizeof *result->path);
    result->path[result->count++] = *path;
}

static void add_candidate(const KellerScene *scene, const Sequence *s, uint32_t transmissions, uint32_t interactions,
                          OracleResult *result)
{
    OraclePath path = {0};
    uint32_t left = interactions - (uint32_t)(s->before + s->after + (s->wedge != KELLER_NONE));
    Verdict v = oracle_solve_sequence(scene, s, left < transmissions ? left : transmissions, &path);
    result->candidates++;
    path.valid = v.valid;
    path.margin = verdict_margin(&v);
    if (!v.valid && path.margin >= ORACLE_TOLERANCE) return;
    if (path.count == 0) { /* given up before its points were known: name the sequence at least */
        for (size_t i = 0; i < s->before; i++)
            path.step[path.count++] = (KellerStep){KELLER_REFLECTION, s->face_before[i]};
        if (s->wedge != KELLER_NONE) path.step[path.count++] = (KellerStep){KELLER_DIFFRACTION, s->wedge};
        for (size_t i = s->after; i-- > 0;) path.step[path.count++] = (KellerStep){KELLER_REFLECTION, s->face_after[i]};
        path.bends = path.count;
    }
    keep(result, &path);
}

/* ---- several diffractions --------------------------------------------------------------------------------------- */

typedef struct {
    const KellerScene *scene;
    Point tx, rx;
    uint32_t reflections, diffractions, transmissions, interactions;
    const Chains *backward;
    OracleResult *result;
    uint32_t count; /* of the sequence so far */
    KellerStep step[ORACLE_MAX_STEPS];
} Growth;

/* The sequence so far, which ends in an edge, and a chain of the receiver's. */
static void finish(Growth *g, const Chain *end)
{
    uint32_t count = g->count + (uint32_t)end->count, left = g->interactions - count;
    OraclePath path = {0};
    for (size_t i = 0; i < end->count; i++) g->step[count - 1 - i] = (KellerStep){KELLER_REFLECTION, end->face[i]};
    Verdict v = oracle_solve_edges(g->scene, g->tx, g->rx, count, g->step, left < g->transmissions ? left : g->transmissions,
                                   &path);
    g->result->candidates++;
    path.valid = v.valid;
    path.margin = verdict_margin(&v);
    if (!v.valid && path.margin >= ORACLE_TOLERANCE) return;
    if (path.count == 0) {
        for (uint32_t i = 0; i < count; i++) path.step[i] = g->step[i];
        path.count = path.bends = count;
    }
    keep(g->result, &path);
}

/* All ways to go on from a sequence that has `reflected` faces and, of edges, `edges` already. */
static void grow(Growth *g, uint32_t reflected, uint32_t edges)
{
    const KellerScene *scene = g->scene;
    if (edges > 1 && g->step[g->count - 1].kind == KELLER_DIFFRACTION) {
        uint32_t wedge = g->step[g->count - 1].id;
        for (size_t i = 0; i < g->backward->count; i++) {
            const Chain *b = &g->backward->chain[i];
            if (reflected + b->count <= g->reflections && g->count + b->count <= g->interactions &&
                (b->count == 0 || !wedge_has_plane(scene, wedge, scene->faces[b->face[b->count - 1]].plane)) &&
                reaches_edge(scene, b, &scene->wedges[wedge]))
                finish(g, b);
        }
    }
    if (edges == g->diffractions) return;
    for (int edge = 0; edge < 2; edge++) {
        /* there is another edge to come */
        if ((!edge && reflected == g->reflections) || g->count + 1 + !edge > g->interactions) continue;
        for (uint32_t id = 0; id < (edge ? scene->wedge_count : scene->face_count); id++) {
            g->step[g->count] = (KellerStep){edge ? KELLER_DIFFRACTION : KELLER_REFLECTION, id};
            uint32_t last = g->count - 1;
            if (!oracle_follows_rules(scene, 2, &g->step[last])) continue;
            g->count++;
            grow(g, reflected + !edge, edges + (uint32_t)edge);
            g->count--;
        }
    }
}

/* Sequences that begin with a chain of the transmitter's and an edge. */
static void add_several(Growth *g, const Chains *forward)
{
    for (size_t i = 0; i < forward->count; i++) {
        const Chain *a = &forward->chain[i];
        for (uint32_t wedge = 0; wedge < g->scene->wedge_count; wedge++) {
            if ((a->count > 0 && wedge_has_plane(g->scene, wedge, g->scene->faces[a->face[a->count - 1]].plane)) ||
                a->count + 2 > g->interactions || !reaches_edge(g->scene, a, &g->scene->wedges[wedge]))
                continue;
            for (size_t k = 0; k < a->count; k++) g->step[k] = (KellerStep){KELLER_REFLECTION, a->face[k]};
            g->step[a->count] = (KellerStep){KELLER_DIFFRACTION, wedge};
            g->count = (uint32_t)a->count + 1;
            grow(g, (uint32_t)a->count, 1);
        }
    }
}

OracleResult oracle_enumerate(const KellerScene *scene, KellerVec3 tx, KellerVec3 rx, uint32_t reflections,
                              uint32_t diffractions, uint32_t interactions)
{
    return oracle_enumerate_through(scene, tx, rx, reflections, diffractions, 0, interactions);
}

OracleResult oracle_enumerate_through(const KellerScene *scene, KellerVec3 tx, KellerVec3 rx, uint32_t reflections,
                                      uint32_t diffractions, uint32_t transmissions, uint32_t interactions)
{
    OracleResult result = {0};
    assert(interactions <= ORACLE_MAX_STEPS);
    uint32_t most = reflections < interactions ? reflections : interactions;
    Chains forward = chains_from(scene, wide(tx), most);
    for (size_t i = 0; i < forward.count; i++) {
        const Chain *c = &forward.chain[i];
        Sequence s = {.wedge = KELLER_NONE, .before = c->count, .image_after = {wide(rx)}};
        for (size_t k = 0; k < c->count; k++) s.face_before[k] = c->face[k];
        for (size_t k = 0; k <= c->count; k++) s.image_before[k] = c->image[k];
        add_candidate(scene, &s, transmissions, interactions, &result);
    }
    if (diffractions > 0 && interactions > 0) {
        Chains backward = chains_from(scene, wide(rx), most < interactions ? most : interactions - 1);
        bool *reached = calloc(backward.count, sizeof *reached);
        assert(reached);
        for (uint32_t wedge = 0; wedge < scene->wedge_count; wedge++) {
            const KellerWedge *w = &scene->wedges[wedge];
            for (size_t j = 0; j < backward.count; j++) {
                const Chain *b = &backward.chain[j];
                reached[j] =
                    (b->count == 0 || !wedge_has_plane(scene, wedge, scene->faces[b->face[b->count - 1]].plane)) &&
                    reaches_edge(scene, b, w);
            }
            for (size_t i = 0; i < forward.count; i++) {
                const Chain *a = &forward.chain[i];
                if ((a->count > 0 && wedge_has_plane(scene, wedge, scene->faces[a->face[a->count - 1]].plane)) ||
                    !reaches_edge(scene, a, w))
                    continue;
                for (size_t j = 0; j < backward.count; j++) {
                    const Chain *b = &backward.chain[j];
                    if (!reached[j] || a->count + b->count > most || a->count + b->count + 1 > interactions) continue;
                    Sequence s = {.wedge = wedge, .before = a->count, .after = b->count};
                    for (size_t k = 0; k < a->count; k++) s.face_before[k] = a->face[k];
                    for (size_t k = 0; k <= a->count; k++) s.image_before[k] = a->image[k];
                    for (size_t k = 0; k < b->count; k++) s.face_after[k] = b->face[k];
                    for (size_t k = 0; k <= b->count; k++) s.image_after[k] = b->image[k];
                    add_candidate(scene, &s, transmissions, interactions, &result);
                }
            }
        }
        free(reached);
        Growth growth = {scene, wide(tx), wide(rx), reflections, diffractions, transmissions, interactions, &backward, &result,
                         .count = 0};
        if (diffractions > 1) add_several(&growth, &forward);
        free(backward.chain);
    }
    free(forward.chain);
    return result;
}

void oracle_free(OracleResult *result)
{
    free(result->path);
    *result = (OracleResult){0};
}
