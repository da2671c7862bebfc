#include "cone_oracle.h"

/* In place of libquadmath, whose header clang has not: a step of Newton's doubles the 64 bits of the first guess. */
static __float128 root_quad(__float128 a)
{
    __float128 guess = sqrtl((long double)a);
    return a > 0 && a < (__float128)INFINITY ? (guess + a / guess) / 2 : guess;
}

static __float128 abs_quad(__float128 a) { return a < 0 ? -a : a; }

#define N long double
#define NAME(f) f##_long
#define ROOT sqrtl
#define ABS fabsl
#include "cone_oracle_body.h"
#undef N
#undef NAME
#undef ROOT
#undef ABS

#define N __float128
#define NAME(f) f##_quad
#define ROOT root_quad
#define ABS abs_quad
#include "cone_oracle_body.h"

const ConeOracle cone_oracle_long = {plane_long, line_long,     edge_long, triangle_long,
                                     box_long,   contains_long, z_long,    outside_long};
const ConeOracle cone_oracle_quad = {plane_quad, line_quad,     edge_quad, triangle_quad,
                                     box_quad,   contains_quad, z_quad,    outside_quad};
