/* Edges of finite length, for Biot, Tolstoy and Medwin's diffraction. */
#ifndef KELLER_PATH_EDGE_ENDS_H
#define KELLER_PATH_EDGE_ENDS_H
#include "path/internal.h"

/* The search finds diffraction where the shortest way over an edge lies on it. Where it lies beyond an end, the edge diffracts too: adds
 * a path by that end for each edge whose end both stations see, and in whose sector they are. Without reflections. False: memory. */
bool edge_ends_add(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, KellerVec3 rx, PathList *list,
                   KellerAccelWork *work);
#endif
