/* mesh/adjacency.h -- which triangles meet at which edge, by OpenMesh's half-edge mesh. */
#ifndef KELLER_MESH_ADJACENCY_H
#define KELLER_MESH_ADJACENCY_H
#include <stddef.h>
#include <stdint.h>
#include "keller/error.h"
#include "keller/vec.h"
#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    size_t edge_count;
    uint32_t (*vertices)[2];      /* [edge_count] smaller first; edges in ascending order */
    uint32_t *begin;              /* [edge_count + 1] ranges in triangles */
    uint32_t *triangles;          /* [3 triangle_count] the triangles at each edge, ascending */
    uint32_t (*edge)[3];          /* [triangle_count] edge[t][i] joins corner i of t to corner (i + 1) % 3 */
    size_t cuts;                  /* corners that got a vertex of their own in the half-edge mesh */
} KellerAdjacency;

/* Builds the half-edge mesh of any set of triangles (three different vertices each, any orientation, any number at an
 * edge) and reads the adjacency off it. The half-edge structure holds manifolds only, so triangles are first turned
 * to agree with their neighbours, and the mesh is cut -- vertices doubled -- along edges with more than two triangles,
 * where turning fails (Moebius bands) and at vertices where several fans meet; each copy knows its original, and the
 * triangle lists join what was cut. No triangle is lost and nothing is printed.
 * Errors: KELLER_FAILED (memory, more than 2^31 - 1 half-edges). On failure *adjacency is empty. */
KellerStatus keller_adjacency_build(size_t vertex_count, const KellerVec3 *vertices, size_t triangle_count,
                                    const uint32_t (*triangles)[3], KellerAdjacency *adjacency, KellerError *error);
void keller_adjacency_free(KellerAdjacency *adjacency);

#ifdef __cplusplus
}
#endif
#endif
