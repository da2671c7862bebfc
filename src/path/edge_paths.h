/* Paths with one diffraction at an edge of finite length, all of which diffracts. */
#ifndef KELLER_PATH_EDGE_PATHS_H
#define KELLER_PATH_EDGE_PATHS_H
#include "path/edge_sight.h"
#include "path/tree.h"

/* The ways from an end to edges, with what of the edge each sees. */
typedef struct EdgeWays EdgeWays;

/* What to look for: paths of at most so many reflections with one diffraction. limits->plan and ->targets are not used. */
typedef struct {
    TreeLimits limits;
    uint32_t reflections;
} EdgeSearch;

/* Searches from an end for what it sees of edges. KELLER_FAILED: memory. Free with edge_ways_free. */
KellerStatus edge_ways_find(const EdgeSearch *search, KellerVec3 end, uint32_t threads, EdgeWays **ways, TreeWork *work,
                            KellerError *error);
void edge_ways_free(EdgeWays *ways);

/* Adds a path for each part of each edge that both ends see. The path goes by the part's nearest point; path->part says what of the edge
 * it stands for. False: memory. */
bool edge_paths_add(const EdgeSearch *search, const EdgeWays *tx, const EdgeWays *rx, PathList *list);
#endif
