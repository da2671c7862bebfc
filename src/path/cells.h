/* The cells of a map, or of a part of it, and which of them lie in a beam. */
#ifndef KELLER_PATH_CELLS_H
#define KELLER_PATH_CELLS_H
#include <math.h>
#include "path/beam.h"

/* Rows of receivers over a rectangle, x fastest. Where their z differ, they are looked at in blocks, each of which knows its heights. A
 * cell whose z is NaN is nowhere. */
typedef struct {
    uint32_t nx, ny;            /* of this part, >= 1 */
    KellerVec3 *position;       /* m: of the cells, row by row */
    double x0, y0, step;        /* m: the first cell's centre, spacing */
    double low, high;           /* m: of the cells' z; both 0 where all are nowhere */
    uint32_t blocks_x;          /* blocks from band to band */
    KellerRange *heights;       /* m: of each block's cells, band by band; near > far where it has none. NULL: one height for all */
} CellGrid;

/* A part of a set, which is a grid: columns x .. x + nx - 1 of rows y .. y + ny - 1; to be freed in any case. False: no memory. */
bool cells_of(const KellerConfig *config, const KellerReceiverSet *set, uint32_t x, uint32_t y, uint32_t nx, uint32_t ny,
              CellGrid *grid);
void cells_free(CellGrid *grid);

static inline KellerVec3 cell_position(const CellGrid *g, uint32_t x, uint32_t y)
{
    return g->position[(size_t)y * g->nx + x];
}

enum { FOOTPRINT_MOST = WINDOW_MOST + 2 };  /* sides: the window's, the mirror, and how far is seen */

/* Where a beam is among the cells: the points p with side[i].p <= offset[i] for all i. Conservative. */
typedef struct {
    uint32_t count;
    KellerVec3 side[FOOTPRINT_MOST];
    double offset[FOOTPRINT_MOST];
    double at[FOOTPRINT_MOST], rise[FOOTPRINT_MOST];    /* m: where the cells are all at one height, x <= at + rise y if side.x > 0, or >= */
    uint32_t row, end;          /* rows that it may touch: [row, end) */
    double corner[2 * (FOOTPRINT_MOST + 4)];    /* x, y of what it has of the grid's rectangle, at any of the cells' heights */
    uint32_t corners;
} Footprint;

/* The footprint of a bundle; false: it is empty. front: the sign of the side of the mirror (NULL: none) on which the rays are. */
bool footprint_of(const CellGrid *grid, const BundleTest *test, const KellerFace *mirror, double front, Footprint *footprint);

/* Cells that may lie in it: columns [from, to) of a row, whose z are within the range. Begin with all zero. */
typedef struct {
    uint32_t row, from, to;
    KellerRange z;              /* m */
    bool begun;
    uint32_t next;              /* row to look at */
    uint32_t band, band_end;    /* of a surface: rows of the blocks at hand, [band, band_end) */
    uint32_t block, block_end;  /* the block at hand, and the end of those of the band */
} CellRun;
/* The next run, each cell once; false: there are no more. */
bool footprint_next(const CellGrid *grid, const Footprint *footprint, CellRun *run);
/* Is the cell of a run really in it? Not where it is nowhere. On a map at one height the others all are. */
static inline bool footprint_has(const CellGrid *g, const Footprint *f, KellerVec3 cell)
{
    for (uint32_t i = 0; i < f->count && g->heights; i++)
        if (!(v3_dot(f->side[i], cell) <= f->offset[i])) return false;
    return !isnan(cell.z);
}
/* The number of cells, counted up to `most`. */
uint32_t footprint_cells(const CellGrid *grid, const Footprint *footprint, uint32_t most);
/* A point about in the middle of it, on a cell there or at the cells' mean height. */
KellerVec3 footprint_middle(const CellGrid *grid, const Footprint *footprint);
/* Bounds of direction . (p - origin) over its cells. */
KellerRange footprint_extent(const CellGrid *grid, const Footprint *footprint, KellerVec3 origin, KellerVec3 direction);
#endif
