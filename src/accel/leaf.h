/* The accelerator itself, for the queries: a tree, and what its leaves hold. */
#ifndef KELLER_ACCEL_LEAF_H
#define KELLER_ACCEL_LEAF_H
#include "accel/attach.h"
#include "accel/internal.h"
#include "base/simd.h"

struct KellerAccel {
    const TreeKind *kind;
    KellerAccelInput input;
    KellerVec3 middle;              /* floats are relative to it */
    double size;                    /* bounds the magnitude of every coordinate relative to it */
    void *tree;                     /* over the triangles, and the edges that are no triangle's side */
    uint32_t leaf_count;
    TriangleBlock *triangles;       /* [leaf_count]: leaf i has the block triangles[i]; NULL without triangles */
    EdgeBlock *edges;               /* leaf i has the blocks edges[edge_begin[i] .. edge_begin[i + 1]) */
    uint32_t *edge_begin;           /* [leaf_count + 1] */
    bool repeats;                   /* primitives may be in several leaves */
    bool exact_triangles, exact_edges; /* the corners in the blocks are the vertices themselves: middle is 0 */
    WalkHow how;                    /* what the options chose */
    int contained;
    /* Over a scene, wedges on one edge are one primitive: edge i stands for the wedges wedge[wedge_begin[i] .. [i + 1]). */
    const KellerScene *scene;       /* NULL: edges are input.edges */
    uint32_t *wedge, *wedge_begin;
};

/* Vertices of primitives, in double precision. */
static inline void triangle_of(const KellerAccel *a, uint32_t id, KellerVec3 v[3])
{
    for (int j = 0; j < 3; j++) v[j] = a->input.vertices[a->input.triangles[id][j]];
}
static inline void edge_of(const KellerAccel *a, uint32_t id, KellerVec3 v[2])
{
    const uint32_t *ends = a->scene ? a->scene->wedges[a->wedge[a->wedge_begin[id]]].vertex : a->input.edges[id];
    for (int j = 0; j < 2; j++) v[j] = a->input.vertices[ends[j]];
}

static inline void corners_in(const KellerVertex8 *corner, int count, int i, KellerVec3 *v)
{
    for (int j = 0; j < count; j++) v[j] = v3((double)corner[j].p[0][i], (double)corner[j].p[1][i], (double)corner[j].p[2][i]);
}

/* The same of lane i of a block: where files hold single precision, as most do, nothing else need be fetched. */
static inline void triangle_in(const KellerAccel *a, const TriangleBlock *block, int i, KellerVec3 v[3])
{
    if (a->exact_triangles) corners_in(block->corner, 3, i, v);
    else triangle_of(a, block->id[i], v);
}
static inline void edge_in(const KellerAccel *a, const EdgeBlock *block, int i, KellerVec3 v[2])
{
    if (a->exact_edges) corners_in(block->corner, 2, i, v);
    else edge_of(a, block->id[i], v);
}

/* Lanes in use. */
static inline uint32_t lanes_used(const uint32_t id[8]) { return (uint32_t)(8 - __builtin_popcount((unsigned)i8_equal(id, KELLER_NONE))); }

/* Makes the blocks of the leaves, with the primitives' corners rounded to nearest. Primitive i of a leaf is triangle i with
 * its attached edges or, from the number of triangles on, one of the edges alone. */
KellerStatus leaf_blocks(KellerAccel *a, const Leaves *leaves, const Attached *attached, KellerError *error);

/* Primitives that a query has reported already: a hash set that starts on the stack. Where it cannot grow for want of memory,
 * a primitive may be reported twice. */
typedef struct {
    uint32_t small[128], *slot;     /* id + 1; 0: free */
    uint32_t mask, count;
} Seen;
void seen_start(Seen *s);
bool seen_before(Seen *s, uint32_t id);
void seen_end(Seen *s);
#endif
