/* Which part of an edge may be lit? */
#ifndef KELLER_PATH_LIT_H
#define KELLER_PATH_LIT_H
#include "path/tree.h"

/* Narrows *from .. *to (m along the wedge's edge) to what lies between the first and the last place that rays from `source` may reach; the
 * source is an image behind the face `mirror`, in which its rays are reflected on the way, or KELLER_NONE. Conservative: shadows end where
 * rounding, and what counts as a boundary, cannot light them any more. False: none of it is lit. */
bool lit_part(const TreeLimits *limits, KellerVec3 source, uint32_t mirror, uint32_t wedge, double *from, double *to, KellerAccelWork *work);
#endif
