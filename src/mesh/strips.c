/* Narrow faces between two edges that belong together: the top of a thin wall. */
#include <math.h>
#include <stdlib.h>

#include "mesh/build.h"

/* A strip has the two edges, cut into a few pieces at most, and is at least so many times longer than wide. */
enum { MOST_EDGES = 16 };
static const double slender = 4;

/* Width of the strip between the edges of two wedges; infinite where there is none. The one sector ends at the face where the
 * other begins, both open more than half of the space, and their edges run side by side from end to end. */
static double strip_width(const KellerWedge *a, const KellerWedge *b)
{
    const double parallel = 1e-9; /* 1 - cosine */
    if (a->n <= 1 || b->n <= 1 || a->n >= 2 || b->n >= 2 || a->n + b->n - 1 > 2 + 1e-9) return INFINITY;
    if (v3_dot(a->direction, b->direction) < 1 - parallel) return INFINITY;
    KellerVec3 across = v3_sub(b->origin, a->origin);
    double along = v3_dot(across, a->direction), width = v3_norm(v3_madd(across, a->direction, -along));
    if (!(width > 0) || a->length < slender * width || b->length < slender * width) return INFINITY;
    bool side_by_side = fabs(along) <= width && fabs(along + b->length - a->length) <= width;
    return side_by_side ? width : INFINITY;
}

/* Wedges by one of their faces: those of face f are id[begin[f]] to id[begin[f + 1] - 1]. */
typedef struct {
    uint32_t *begin, *id;
} ByFace;

static bool group(KellerBuild *build, int side, ByFace *g)
{
    const KellerScene *scene = build->scene;
    g->begin = keller_mesh_allocate(build, scene->face_count + 2, sizeof *g->begin);
    g->id = keller_mesh_allocate(build, scene->wedge_count, sizeof *g->id);
    if (!g->begin || !g->id) return false;
    for (size_t i = 0; i < scene->wedge_count; i++) g->begin[scene->wedges[i].face[side] + 2]++;
    for (size_t f = 2; f < scene->face_count + 2; f++) g->begin[f] += g->begin[f - 1];
    for (size_t i = 0; i < scene->wedge_count; i++) g->id[g->begin[scene->wedges[i].face[side] + 1]++] = (uint32_t)i;
    return true;
}

static void join(KellerScene *scene, uint32_t face, uint32_t first, uint32_t second, double width)
{
    KellerWedge *a = &scene->wedges[first], *b = &scene->wedges[second];
    a->twin[1] = second;
    b->twin[0] = first;
    scene->faces[face].strip = width;
}

bool keller_mesh_goes_on(KellerBuild *build)
{
    KellerScene *scene = build->scene;
    size_t n = scene->wedge_count, vertices = scene->vertex_count;
    uint32_t *begin = calloc(vertices + 2, sizeof *begin), *id = malloc((n + 1) * sizeof *id); /* wedges that start at a vertex */
    for (size_t i = 0; begin && id && i < n; i++) begin[scene->wedges[i].vertex[0] + 2]++;
    for (size_t v = 0; begin && id && v < vertices; v++) begin[v + 2] += begin[v + 1];
    for (uint32_t i = 0; begin && id && i < n; i++) id[begin[scene->wedges[i].vertex[0] + 1]++] = i;
    for (size_t i = 0; begin && id && i < n; i++) {
        KellerWedge *w = &scene->wedges[i];
        for (uint32_t k = begin[w->vertex[1]]; k < begin[w->vertex[1] + 1]; k++) {
            KellerWedge *o = &scene->wedges[id[k]];
            if (!(v3_dot(o->direction, w->direction) > 1 - 1e-12)) continue;
            w->goes_on[1] = true;
            o->goes_on[0] = true;
        }
    }
    bool ok = begin && id;
    free(begin);
    free(id);
    return ok;
}

bool keller_mesh_strips(KellerBuild *build)
{
    KellerScene *scene = build->scene;
    ByFace ends = {0}, begins = {0}; /* sectors that end, that begin at the face */
    for (size_t i = 0; i < scene->wedge_count; i++) scene->wedges[i].twin[0] = scene->wedges[i].twin[1] = KELLER_NONE;
    bool ok = group(build, 1, &ends) && group(build, 0, &begins);
    for (uint32_t f = 0; ok && f < scene->face_count; f++) {
        uint32_t n = ends.begin[f + 1] - ends.begin[f], m = begins.begin[f + 1] - begins.begin[f];
        if (n == 0 || m == 0 || n + m > MOST_EDGES) continue;
        double least = INFINITY;
        uint32_t pair[2] = {0, 0};
        for (uint32_t i = ends.begin[f]; i < ends.begin[f + 1]; i++)
            for (uint32_t j = begins.begin[f]; j < begins.begin[f + 1]; j++) {
                double width = strip_width(&scene->wedges[ends.id[i]], &scene->wedges[begins.id[j]]);
                if (width >= least) continue;
                least = width;
                pair[0] = ends.id[i];
                pair[1] = begins.id[j];
            }
        if (isfinite(least)) join(scene, f, pair[0], pair[1], least);
    }
    free(ends.begin);
    free(ends.id);
    free(begins.begin);
    free(begins.id);
    return ok;
}
