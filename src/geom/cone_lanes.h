/* What the vectorised tests share. */
#ifndef KELLER_GEOM_CONE_LANES_H
#define KELLER_GEOM_CONE_LANES_H
#include "base/simd.h"
#include "geom/cone_frame.h"

#define TINY_FLOAT 1e-30f /* TINY for single precision: nothing is taken to be shorter than 1e-15 m */

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
