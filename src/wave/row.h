/* The transition function of any number of edges in a row, summed over the terms of all of them. */
#ifndef KELLER_WAVE_ROW_H
#define KELLER_WAVE_ROW_H
#include "wave/dyad.h"
#include "wave/utd.h"

enum { ROW_EDGES = 16 };

/* One edge: its terms and the matrices of its faces; how the components behind the edge before (beta0-hat, phi-hat of its diffracted ray,
 * or the pressure and 0) become those that come to this one; and its coupling with the edge before (wave/chain.h). */
typedef struct {
    UtdTerm term[4];
    Matrix matrix[4], from;
    double coupling;
} RowEdge;

/* How much the function of all edges is to count against those of two and three of them, which say it all where of each four edges in a row one
 * is far from the boundaries of its terms: 1 where four are near to them (x below 8), 0 where nowhere four are (from 16 on: what the others
 * lack there is some 1e-5 of the free field), and in between by and by. It is what takes long. */
double row_share(const RowEdge edge[], uint32_t count);

/* Of two waves (j) that come to the first edge with components field[j], what leaves the last one: over all choices of one term an
 * edge, the products of the terms with their matrices, times the ratio of the edges' transition function to the product of each one's own. Edges
 * that are not neighbours know of each other through those between alone. False where the couplings are too strong for that, and the
 * field is as it was. Relative error below 1e-10, of the sum of the products' sizes. */
bool row_field(const RowEdge edge[], uint32_t count, double complex field[2][2]);
#endif
