/* continuity.h -- the largest jump of the field at each kind of boundary, for the test and the bench. */
#ifndef CONTINUITY_H
#define CONTINUITY_H

typedef struct {
    const char *kind;
    double jump;   /* of the 2x2 transfer matrix, its largest entry, over the free field at the receiver */
    double bound;  /* that the test holds it to; INFINITY: a known limit, only measured (docs/theory.md) */
} Jump;

enum { CONTINUITY_KINDS = 15 };
/* Fills `jumps` in a fixed order. Each boundary is found by halving a line of receivers across it until the set of paths changes within
 * a hair; there the fields on both sides are compared. */
void continuity_measure(Jump jumps[CONTINUITY_KINDS]);
#endif
