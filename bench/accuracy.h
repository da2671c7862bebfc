/* accuracy.h -- the curves behind the pictures of docs/accuracy.md. */
#ifndef BENCH_ACCURACY_H
#define BENCH_ACCURACY_H
#include "../tests/analytic/conductor.h"
#include "../tests/truth/table.h"

typedef struct {
    const char *name, *text; /* as it is in the table, and in words */
    double n;
} AccuracyWedge;

enum { ACCURACY_WEDGES = 4 };
extern const AccuracyWedge accuracy_wedges[ACCURACY_WEDGES]; /* half-plane, 60, 90, 120 degrees */

/* What a row of b_wedge_plane, b_wedge_line, b_point3d or a_halfplane is about; lengths in m. */
WedgeSetting accuracy_setting(const Table *t, SourceKind kind, double n);

/* Writes FOLDER/accuracy-{field-DEGREES,lossy,edges,end}.csv, the first from the tables in `truth`; false, and says so, where a
 * file cannot be written. */
bool accuracy_curves(const char *folder, const char *truth);

/* Prints, for each decade of the argument, processor time (the least of five) and largest difference of the transition function and the
 * one by the Faddeeva function. */
void accuracy_transition(bool csv);
#endif
