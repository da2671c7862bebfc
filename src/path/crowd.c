/* Where the field of a path is beyond what its formulas are exact for. */
#include <math.h>

#include "path/cascade.h"
#include "path/field.h"

/* An edge is in its neighbours' zone if the way past it is less than about half a wavelength shorter: x^2/2 = pi, x as in wave/pair.h. */
static const double zone = 2.5;
/* Edges that are not parallel: of three in a row the first and the last see each other past the middle one in another way than the functions
 * of three and more edges have it (wave/triple.h, wave/row.h). */
static const double parallel = 0.995; /* cosine of 0.1 rad */
enum { TOO_MANY = 3 };

bool path_crowded(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, double k)
{
    uint32_t edges_at_all = 0, patch;
    for (uint32_t i = 0; i < path->count; i++) edges_at_all += path->step[i].kind == KELLER_DIFFRACTION;
    if (edges_at_all < TOO_MANY) return false;
    KellerPath half[2];
    if (path_halves(path, tx, half, &patch))
        return path_crowded(scene, &half[0], tx, k) || path_crowded(scene, &half[1], path->position[patch], k);
    PathEdges edges;
    Cascade cascade;
    path_edges(scene, path, 0, &edges);
    path_cascade(scene, path, &edges, tx, &cascade);
    uint32_t row = 0;
    bool askew = false;
    KellerVec3 last = v3(0, 0, 0); /* direction of the last edge, by way of the reflections since */
    for (uint32_t i = 0, step = 0; i < edges.count; i++) {
        const PathEdge *e = &edges.edge[i];
        const KellerWedge *w = &scene->wedges[path->step[e->begin].id];
        for (; step < e->begin; step++)
            if (path->step[step].kind == KELLER_REFLECTION) last = v3_mirror_direction(last, scene->faces[path->step[step].id].normal);
        /* both rays have one angle to the edge: they differ by 2 sin(beta0) sin(eps/2) */
        double x = sqrt(k * cascade.place[i].distance) * v3_distance(path->leg[e->begin], path->leg[e->end + 1]);
        row = x < zone ? row + 1 : 0;
        askew = row > 1 && (askew || fabs(v3_dot(last, w->direction)) < parallel);
        if (row >= TOO_MANY && askew) return true;
        last = w->direction;
        step = e->end + 1;
    }
    return false;
}
