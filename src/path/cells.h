/* The cells of a map, or of a part of it, and which of them lie in a beam. */
#ifndef KELLER_PATH_CELLS_H
#define KELLER_PATH_CELLS_H
#include "path/beam.h"

/* Rows of receivers over a rectangle, x fastest. */
typedef struct {
    const KellerReceiver *receivers;    /* of the configuration */
    uint32_t first, stride;     /* receiver of the first cell; receivers from row to row */
    uint32_t nx, ny;            /* of this part, >= 1 */
    double x0, y0, step;        /* m: the first cell's centre, spacing */
    double low, high;           /* m: of the cells' z */
} CellGrid;

/* A part of a set, which is a grid: columns x .. x + nx - 1 of rows y .. y + ny - 1. */
CellGrid cells_of(const KellerConfig *config, const KellerReceiverSet *set, uint32_t x, uint32_t y, uint32_t nx, uint32_t ny);

static inline KellerVec3 cell_position(const CellGrid *g, uint32_t x, uint32_t y)
{
    return g->receivers[g->first + y * g->stride + x].station.position;
}

enum { FOOTPRINT_MOST = WINDOW_MOST + 2 };  /* sides: the window's, the mirror, and how far is seen */

/* Where a beam is at the cells' heights: the points with a[i].x x + a[i].y y <= c[i] for all i. Conservative. */
typedef struct {
    uint32_t count;
    double ax[FOOTPRINT_MOST], ay[FOOTPRINT_MOST], c[FOOTPRINT_MOST];
    uint32_t row, end;          /* rows that it may touch: [row, end) */
    double corner[2 * (FOOTPRINT_MOST + 4)];    /* x, y of what it has of the grid's rectangle */
    uint32_t corners;
} Footprint;

/* The footprint of a bundle; false: it is empty. front: the sign of the side of the mirror (NULL: none) on which the rays are. */
bool footprint_of(const CellGrid *grid, const BundleTest *test, const KellerFace *mirror, double front, Footprint *footprint);
/* Cuts it down to normal . p <= offset; false: nothing is left. */
bool footprint_cut(const CellGrid *grid, KellerVec3 normal, double offset, Footprint *footprint);
/* The cells of a row that may lie in it: columns [*from, *to). */
void footprint_row(const CellGrid *grid, const Footprint *footprint, uint32_t row, uint32_t *from, uint32_t *to);
/* The number of cells, counted up to `most`. */
uint32_t footprint_cells(const CellGrid *grid, const Footprint *footprint, uint32_t most);
/* A point about in the middle of it, at the cells' mean height. */
KellerVec3 footprint_middle(const CellGrid *grid, const Footprint *footprint);
/* Bounds of direction . (p - origin) over its points, at the cells' heights. */
KellerRange footprint_extent(const CellGrid *grid, const Footprint *footprint, KellerVec3 origin, KellerVec3 direction);
#endif
