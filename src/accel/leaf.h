/* The accelerator itself, for the queries: two trees and their blocks. */
#ifndef KELLER_ACCEL_LEAF_H
#define KELLER_ACCEL_LEAF_H
#include "accel/internal.h"

struct KellerAccel {
    const TreeKind *kind;
    KellerAccelInput input;
    KellerVec3 middle;              /* floats are relative to it */
    double size;                    /* bounds the magnitude of every coordinate relative to it */
    void *triangle_tree, *edge_tree;
    TriangleBlock *triangles;
    EdgeBlock *edges;
    uint32_t triangle_blocks, edge_blocks;
    bool repeats;                   /* primitives may be in several blocks */
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

/* Lanes in use. */
static inline uint32_t lanes_used(const uint32_t id[8])
{
    uint32_t n = 0;
    for (int i = 0; i < 8; i++) n += id[i] != KELLER_NONE;
    return n;
}

/* Fills the blocks of the leaves with the primitives' corners, rounded to nearest. */
void leaf_triangles(const KellerAccel *a, const Leaves *leaves, TriangleBlock *blocks);
void leaf_edges(const KellerAccel *a, const Leaves *leaves, EdgeBlock *blocks);

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
