/* sweeps.h -- one number varied, many random cases at each value, the three methods beside each other: what the
 * pictures of docs/numerics.md show. */
#ifndef BENCH_SWEEPS_H
#define BENCH_SWEEPS_H
#include "listings.h"

enum { METHODS = 3 };
extern const char *const method_names[METHODS];

/* Writes FOLDER/numerics-{tangency,generator,half-angle,offset,boxes}.csv; says on stderr what cannot be written. */
bool sweeps(const char *folder);
/* Prints the examples of that document (examples.c). */
void examples(void);
#endif
