/* knife_scene.h -- screens one behind the other as a scene, for the test and the bench. */
#ifndef KNIFE_SCENE_H
#define KNIFE_SCENE_H
#include <complex.h>
#include <stdint.h>
#include "../truth/table.h"

/* Two edges across the way from a source to a receiver, paraxial. Lengths in m, angles in rad, Hz. */
typedef struct {
    double d[3], h[2]; /* distances along the straight line, heights of the edges over it */
    double bend[2];    /* by which each edge turns the path over both */
    double along;      /* from source to receiver along the edges */
    double frequency;
} Knife;

/* Heights for the bends. */
void knife_raise(Knife *g);
/* A row of e_double_knife.csv. Some of its angles are no small ones: those are flattened to 0.05 rad, which with a frequency that
 * grows as the square leaves the table's loss as it is. Edges in the line of sight from their neighbours stay there, exactly. */
Knife knife_of_row(const Table *t);
/* The field over the free one, of all paths that touch no other edges than the screens' upper ones: the mean of the co-polar
 * components. paths (may be NULL) counts them: direct, over the first, over the second, over both. */
double complex knife_total(const Knife *g, int paths[4]);
/* The same for the one path over all of `edges` screens `spacing` m apart, source and receiver as far from the first and the last, each
 * of which turns it by a hair: at grazing. Every other screen is turned by `askew` rad about the upright. *crowded (may be NULL): paths
 * that the run says are beyond its formulas. */
double complex knife_row(int edges, double spacing, double frequency, double askew, uint64_t *crowded);
#endif
