/* oracle_shortest.h -- the shortest way from a point over straight lines to a point, with certainty: where a gradient vanishes a
 * convex function is least; where it cannot be made to vanish, every leg is rounded off at its corner, ever less. */
#ifndef TEST_ORACLE_SHORTEST_H
#define TEST_ORACLE_SHORTEST_H
#include "oracle_sequence.h"

typedef struct {
    size_t n; /* <= ORACLE_MAX_STEPS */
    Point source, target, origin[ORACLE_MAX_STEPS], direction[ORACLE_MAX_STEPS]; /* directions are unit vectors */
} Lines;

/* Point i of the way: 0 is the source, n + 1 the target. */
Point lines_point(const Lines *lines, size_t i, const Real *t);
Real lines_length(const Lines *lines, const Real *t);
/* The largest component of the length's gradient, all of them between -2 and 2. */
Real lines_gradient(const Lines *lines, const Real *t);

/* Shorter than this (m), a leg between two lines has no length: the shortest way leads through a point that both have. */
#define LINES_TOGETHER 1e-6L

/* t holds a first guess, and then the solution. False if a leg has no length. */
bool lines_shortest(const Lines *lines, Real *t);
#endif
