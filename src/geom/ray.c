/* The watertight ray-triangle test of Woop, Benthin and Wald (2013).
 *
 * In the plane across the ray, of the sheared vertices, the ray is the point 0, and the edge from p to q has it on its
 * left where qx py - qy px >= 0. Both products are rounded, monotonically, so that the sign of the difference is never
 * the opposite of the true one: at worst it is 0. For the neighbour the products are the same and their difference is
 * exactly the negative (which a fused multiply-add would spoil: -ffp-contract=off). Where it is 0, the paper turns from
 * floats to doubles; here the rounding errors of the products decide (Dekker 1971), and the signs are exact. With exact
 * signs for one common set of sheared vertices, the projected mesh is a mesh, and covers 0 by triangles that are not
 * flat. */
#include "keller/ray.h"

#include <assert.h>

#include "base/number.h"

KellerRay keller_ray(KellerVec3 origin, KellerVec3 direction)
{
    const double d[3] = {direction.x, direction.y, direction.z};
    int z = fabs(d[0]) > fabs(d[1]) ? 0 : 1;
    if (fabs(d[2]) > fabs(d[z])) z = 2;
    assert(fabs(d[z]) > 0);
    int x = (z + 1) % 3, y = (z + 2) % 3;
    return (KellerRay){{origin.x, origin.y, origin.z}, {d[x] / d[z], d[y] / d[z], d[z]}, {x, y, z}};
}

typedef struct {
    double x, y, z;
} Sheared;

static inline Sheared sheared(const KellerRay *ray, KellerVec3 p)
{
    const double q[3] = {p.x - ray->origin[0], p.y - ray->origin[1], p.z - ray->origin[2]};
    double z = q[ray->axis[2]];
    return (Sheared){q[ray->axis[0]] - ray->shear[0] * z, q[ray->axis[1]] - ray->shear[1] * z, z};
}

static inline double edge(Sheared p, Sheared q) { return q.x * p.y - q.y * p.x; }

/* The same with the errors of both products: never of the opposite sign, to two rounding units, and exactly the negative for the
 * edge from q to p. */
static double edge_exact(Sheared p, Sheared q)
{
    double a = q.x * p.y, b = q.y * p.x;
    return (a - b) + (product_error(q.x, p.y, a) - product_error(q.y, p.x, b));
}

bool keller_ray_triangle(const KellerRay *ray, KellerVec3 a, KellerVec3 b, KellerVec3 c, KellerRange clip, double *t,
                         double weight[3])
{
    const Sheared A = sheared(ray, a), B = sheared(ray, b), C = sheared(ray, c);
    double u = edge(B, C), v = edge(C, A), w = edge(A, B);
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return false;
    /* A hit, but for zeros. Slivers need the errors too: else the weights are off by a unit of size^2 / area, and the
     * point they give is off the ray by that part of the size. */
    u = edge_exact(B, C);
    v = edge_exact(C, A);
    w = edge_exact(A, B);
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return false;
    double sum = u + v + w;
    if (sum == 0) return false; /* in a plane with the ray, or degenerate */
    u /= sum;
    v /= sum;
    w /= sum;
    double z = u * A.z + v * B.z + w * C.z;
    z = greater(lesser(A.z, lesser(B.z, C.z)), lesser(greater(A.z, greater(B.z, C.z)), z));
    double at = z / ray->shear[2];
    if (!(at >= clip.near && at <= clip.far)) return false;
    if (t) *t = at;
    if (weight) {
        weight[0] = u;
        weight[1] = v;
        weight[2] = w;
    }
    return true;
}
