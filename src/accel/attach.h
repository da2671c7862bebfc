/* Edges travel with triangles: an edge that is a side of a triangle lies within that triangle's box, so it needs no place of
 * its own in the tree, and a cone finds both by one walk. */
#ifndef KELLER_ACCEL_ATTACH_H
#define KELLER_ACCEL_ATTACH_H
#include <stdint.h>
#include "keller/error.h"

typedef struct {
    uint32_t *begin;                /* [triangle_count + 1] into edges */
    uint32_t *edges;                /* with triangle i: edges[begin[i] .. begin[i + 1]), in increasing order; after the last,
                                       `alone` edges that are no triangle's side */
    uint32_t alone;
} Attached;

/* Gives every edge to the first triangle of which it is a side. Linear in time and memory. Free with attached_free. */
KellerStatus attach_edges(uint32_t triangle_count, const uint32_t (*triangles)[3], uint32_t edge_count,
                          const uint32_t (*edges)[2], Attached *attached, KellerError *error);
/* Gives every triangle its share of the edges, as they come: where whatever meets a triangle is shown all edges anyway. */
KellerStatus spread_edges(uint32_t triangle_count, uint32_t edge_count, Attached *attached, KellerError *error);
void attached_free(Attached *attached);
#endif
