/* edge_end.h -- the wave that an edge diffracts as its point comes to the edge's end, for the test and the bench. */
#ifndef EDGE_END_H
#define EDGE_END_H
#include <complex.h>

/* A screen's vertical rim of 60 m, conducting or rigid, source 9 m and receiver 12 m from it at azimuths of 80 degrees and `phi` (rad; shadow
 * from 260 degrees), E across the edge, 3.5 GHz. The point of the shortest way over the rim's line is `place` above its lower end, in the
 * zone's units, t sqrt(k L''). Both over `whole`, the waves of a rim that goes on for ever. */
typedef struct {
    double complex program, exact; /* the program's path, 0 where there is none; Biot, Tolstoy and Medwin's finite edge */
} EdgeEnd;

EdgeEnd edge_end_whole(double phi); /* to be asked for once for many places */
EdgeEnd edge_end_at(double place, double phi, const EdgeEnd *whole);
#endif
