/* What the vectorised tests share. */
#ifndef KELLER_GEOM_CONE_LANES_H
#define KELLER_GEOM_CONE_LANES_H
#include "base/simd.h"
#include "geom/cone_frame.h"

#define TINY_FLOAT 1e-30f /* TINY for single precision: nothing is taken to be shorter than 1e-15 m */

/* keller_cone_lanes with the origin at `origin`, in place. */
void cone_lanes_make(const KellerCone *cone, KellerVec3 origin, KellerRange clip, double size, KellerConeLanes *lanes);

/* A cone is wide from about 4.5 degrees on, or with a base wider than 1/64 of the scene (a multiple of the slack). From
 * there on what the plane removes costs more to visit than the plane. */
static inline bool cone_lanes_wide(const KellerConeLanes *c) { return c->tan_alpha > 0.08f || c->x0 > 4096 * c->slack; }

/* |(x, y)| */
static inline d4 length_of(d4 x, d4 y)
{
    return d4_sqrt(d4_add(d4_add(d4_mul(x, x), d4_mul(y, y)), d4_set1(TINY)));
}

static inline f8 dot8(const f8 a[3], const float b[3])
{
    return f8_add(f8_add(f8_mul(a[0], f8_set1(b[0])), f8_mul(a[1], f8_set1(b[1]))), f8_mul(a[2], f8_set1(b[2])));
}
#endif
