/* Which part of an edge may be lit? */
#ifndef KELLER_PATH_LIT_H
#define KELLER_PATH_LIT_H
#include "path/tree.h"

/* Narrows *from .. *to (m along the wedge's edge) to what lies between the first and the last place that rays from the point
 * `end` may reach when they are mirrored on the way in `count` <= KELLER_MAX_BENDS faces, face[0] first: no shadow on any leg is
 * on it. Conservative: shadows end where rounding, and what counts as a boundary, cannot light them any more, and where all
 * rays of a leg graze an edge none counts. False, and *from > *to: none of it is lit. */
bool lit_way(const TreeLimits *limits, KellerVec3 end, uint32_t count, const uint32_t *face, uint32_t wedge, double *from,
             double *to, KellerAccelWork *work);
#endif
