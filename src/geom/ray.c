/* The watertight ray-triangle test of Woop, Benthin and Wald (2013).
 *
 * In the plane across the ray, of the sheared vertices, the ray is the point 0, and the edge from p to q has it on its
 * left where qx py - qy px >= 0. Both products are rounded, monotonically, so that the sign of the difference is never
 * the opposite of the true one: at worst it is 0. For the neighbour the products are the same and their difference is
 * exactly the negative (which a fused multiply-add would spoil: -ffp-contract=off). Where it is 0, the paper turns from
 * floats to doubles; here the rounding errors of the products decide (d4_product_error), and the signs are exact. With exact
 * signs for one common set of sheared vertices, the projected mesh is a mesh, and covers 0 by triangles that are not
 * flat. */
#include "keller/ray.h"

#include <assert.h>

#include "base/number.h"
#include "base/simd.h"

KellerRay keller_ray(KellerVec3 origin, KellerVec3 direction)
{
    const double d[3] = {direction.x, direction.y, direction.z};
    int z = fabs(d[0]) > fabs(d[1]) ? 0 : 1;
    if (fabs(d[2]) > fabs(d[z])) z = 2;
    assert(fabs(d[z]) > 0);
    int x = (z + 1) % 3, y = (z + 2) % 3;
    return (KellerRay){{origin.x, origin.y, origin.z}, {d[x] / d[z], d[y] / d[z], d[z]}, {x, y, z}};
}

/* Are there signs of both kinds? */
static inline bool mixed(d4 e) { return d4_mask(d4_lt(e, d4_set1(0))) && d4_mask(d4_lt(d4_set1(0), e)); }

/* Coordinate k of the three corners, relative to the origin; the first again in lane 3. */
static inline d4 corners(const KellerRay *ray, const KellerVec3 *a, const KellerVec3 *b, const KellerVec3 *c, int k)
{
    const double *p = (const double *)a, *q = (const double *)b, *r = (const double *)c;
    return d4_sub(d4_set(p[k], q[k], r[k], p[k]), d4_set1(ray->origin[k]));
}

bool keller_ray_triangle(const KellerRay *ray, KellerVec3 a, KellerVec3 b, KellerVec3 c, KellerRange clip, double *t,
                         double weight[3])
{
    /* corners in lanes, and with each the edge opposite to it */
    const int *k = ray->axis;
    d4 Z = corners(ray, &a, &b, &c, k[2]);
    d4 x = d4_sub(corners(ray, &a, &b, &c, k[0]), d4_mul(d4_set1(ray->shear[0]), Z));
    d4 y = d4_sub(corners(ray, &a, &b, &c, k[1]), d4_mul(d4_set1(ray->shear[1]), Z));
    d4 px = d4_rotate(x), py = d4_rotate(y), qx = d4_rotate2(x), qy = d4_rotate2(y);
    d4 left = d4_mul(qx, py), right = d4_mul(qy, px), e = d4_sub(left, right);
    if (mixed(e)) return false;
    /* A hit, but for zeros. Slivers need the errors too: else the weights are off by a unit of size^2 / area, and the
     * point they give is off the ray by that part of the size. With them an edge function is never of the opposite sign, to two
     * rounding units, and exactly the negative for the edge in the other direction. */
    e = d4_add(e, d4_sub(d4_product_error(qx, py, left), d4_product_error(qy, px, right)));
    if (mixed(e)) return false;
    double z3[4], w[4], shares[4];
    d4_store(w, e);
    double sum = w[0] + w[1] + w[2];
    if (sum == 0) return false; /* in a plane with the ray, or degenerate */
    e = d4_div(e, d4_set1(sum));
    d4_store(w, e);
    d4_store(z3, Z);
    d4_store(shares, d4_mul(e, Z));
    double z = shares[0] + shares[1] + shares[2];
    z = greater(lesser(z3[0], lesser(z3[1], z3[2])), lesser(greater(z3[0], greater(z3[1], z3[2])), z));
    double at = z / ray->shear[2];
    if (!(at >= clip.near && at <= clip.far)) return false;
    if (t) *t = at;
    if (weight) {
        weight[0] = w[0];
        weight[1] = w[1];
        weight[2] = w[2];
    }
    return true;
}
