/* Boxes for the tests of the builder of hierarchies. */
#ifndef KELLER_TESTS_SAH_BOXES_H
#define KELLER_TESTS_SAH_BOXES_H
#include <math.h>
#include "accel/sah.h"

static inline double coordinate(KellerVec3 p, int k) { return k == 0 ? p.x : k == 1 ? p.y : p.z; }

static inline AccelBox box_of(const KellerVec3 p[3])
{
    AccelBox box;
    for (int k = 0; k < 3; k++) {
        double a = coordinate(p[0], k), b = coordinate(p[1], k), c = coordinate(p[2], k);
        box.lower[k] = nextafterf((float)fmin(a, fmin(b, c)), -INFINITY);
        box.upper[k] = nextafterf((float)fmax(a, fmax(b, c)), INFINITY);
    }
    return box;
}

static inline bool is_empty(const AccelBox *b)
{
    return b->lower[0] > b->upper[0] || b->lower[1] > b->upper[1] || b->lower[2] > b->upper[2];
}

static inline bool holds(const AccelBox *outer, const AccelBox *inner)
{
    for (int k = 0; k < 3; k++)
        if (!(outer->lower[k] <= inner->lower[k] && inner->upper[k] <= outer->upper[k])) return is_empty(inner);
    return true;
}
#endif
