/* io/known_paths.h -- the paths of a result as the source of a simulation that need not search them. */
#ifndef KELLER_IO_KNOWN_PATHS_H
#define KELLER_IO_KNOWN_PATHS_H
#include "io/path_rows.h"
#include "keller/scene.h"

typedef struct KellerKnownPaths KellerKnownPaths;

/* Of a result that keller_geometry_check and keller_geometry_check_scene have passed; reader, file and scene must outlive it. Memory does
 * not grow with the number of paths. */
KellerStatus keller_known_open(KellerReader *reader, const char *file, const KellerScene *scene, KellerKnownPaths **known,
                               KellerError *error);
/* KELLER_BAD_INPUT from its pair(): a path that is out of order, names a triangle or wedge that is not there, or whose numbers are none. */
KellerPathSource keller_known_source(KellerKnownPaths *known);
/* How many paths were handed out. KELLER_BAD_INPUT: not all of them. */
KellerStatus keller_known_count(const KellerKnownPaths *known, uint64_t *count, KellerError *error);
void keller_known_close(KellerKnownPaths *known); /* NULL is allowed */
#endif
