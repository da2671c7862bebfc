/* io/polygon.h -- cutting a polygon into triangles. */
#ifndef KELLER_IO_POLYGON_H
#define KELLER_IO_POLYGON_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "keller/error.h"
#include "keller/vec.h"

/* Cutting takes time quadratic in the corners, so a file must not name more than this in one polygon. */
#define KELLER_POLYGON_MAX_CORNERS 16384u

/* Memory that calls share; start from {0}, end with keller_polygon_free. */
typedef struct {
    size_t capacity;
    struct KellerPolygonCorner *corners;
} KellerPolygonScratch;

/* Cuts the polygon points[index[0]], ..., points[index[count - 1]] (3 <= count <= KELLER_POLYGON_MAX_CORNERS; either
 * sense of rotation, convex or not, collinear corners and bridges to holes allowed) into count - 2 triangles by clipping
 * ears in the polygon's Newell plane, the best-shaped ear first, so that no triangle is degenerate where none has to be.
 * The triangles turn as the polygon does. Equal input gives equal output.
 * *simple (may be NULL) is false where the polygon has no area or is seen to cross itself (its border turns other than
 * once, or the ears run out): it is cut all the same, somehow.
 * Fails only for want of memory. */
KellerStatus keller_polygon_cut(const KellerVec3 *points, const uint32_t *index, size_t count,
                                uint32_t (*triangles)[3], bool *simple, KellerPolygonScratch *scratch,
                                KellerError *error);
void keller_polygon_free(KellerPolygonScratch *scratch);
#endif
