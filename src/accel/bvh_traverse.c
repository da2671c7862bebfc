/* Traversal: one SIMD test of four boxes a node, for segments (slabs) and for cones (conservative, in the frame of the
 * cone; see keller_cone_box for the derivation of both separating tests). */
#include "accel/bvh.h"

#include <assert.h>

#include "base/simd.h"
#include "base/number.h"

/* Depth of the tree is at most 64 levels of SAH and 32 of halving; each level leaves at most three siblings waiting. */
enum { STACK = 3 * (64 + 33) + 1 };

bool bvh_segment(const Bvh *bvh, KellerVec3 a, KellerVec3 b, double margin, KellerVisitTriangle visit, void *context,
                 KellerAccelWork *work)
{
    if (bvh->primitive_count == 0) return false;
    const double from[3] = {a.x, a.y, a.z}, along[3] = {b.x - a.x, b.y - a.y, b.z - a.z};
    d4 origin[3], inverse[3], m = d4_set1(margin), zero = d4_set1(0), one = d4_set1(1);
    for (int k = 0; k < 3; k++) {
        origin[k] = d4_set1(from[k]);
        /* never infinite: 0 times infinity would be NaN for a segment in the plane of a box's side */
        double d = fabs(along[k]) > 1e-300 ? along[k] : copysign(1e-300, along[k]);
        inverse[k] = d4_set1(1 / d);
    }
    uint32_t stack[STACK];
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const BvhNode *node = &bvh->nodes[stack[--top]];
        d4 t_near = zero, t_far = one;
        for (int k = 0; k < 3; k++) {
            d4 lo = d4_sub(d4_sub(d4_load_floats(node->lower[k]), m), origin[k]);
            d4 hi = d4_sub(d4_add(d4_load_floats(node->upper[k]), m), origin[k]);
            d4 t1 = d4_mul(lo, inverse[k]), t2 = d4_mul(hi, inverse[k]);
            t_near = d4_max(t_near, d4_min(t1, t2));
            t_far = d4_min(t_far, d4_max(t1, t2));
        }
        work->nodes++;
        /* two roundings in each t: 4 units cover both sides */
        int hit = d4_mask(d4_le(t_near, d4_mul(t_far, d4_set1(1 + 0x1p-50))));
        for (uint32_t i = 0; i < 4; i++) {
            if (!(hit >> i & 1) || node->lower[0][i] > node->upper[0][i]) continue;
            if (node->count[i] == 0) {
                assert(top < STACK);
                stack[top++] = node->child[i];
                continue;
            }
            for (uint32_t j = 0; j < node->count[i]; j++) {
                work->triangles++;
                if (visit(context, bvh->primitives[node->child[i] + j])) return true;
            }
        }
    }
    return false;
}

typedef struct {
    d4 origin[3], axis[3][3], axis_abs[3][3]; /* axis 1 stretched by e */
    d4 tan_alpha, x0;
    double slack;
} WideCone;

static WideCone widen(const KellerCone *c, const Bvh *bvh)
{
    WideCone w;
    const KellerVec3 axis[3] = {c->major, v3_scale(c->minor, c->e), c->directrix};
    const double o[3] = {c->origin.x, c->origin.y, c->origin.z};
    double size = c->x0;
    for (int k = 0; k < 3; k++) {
        const double a[3] = {axis[k].x, axis[k].y, axis[k].z};
        for (int j = 0; j < 3; j++) {
            w.axis[k][j] = d4_set1(a[j]);
            w.axis_abs[k][j] = d4_set1(fabs(a[j]));
        }
        w.origin[k] = d4_set1(o[k]);
        double extent = 0;
        for (int i = 0; i < 4; i++) {
            float lo = bvh->nodes[0].lower[k][i], hi = bvh->nodes[0].upper[k][i];
            if (lo <= hi) extent = greater(extent, greater(fabs((double)lo), fabs((double)hi)));
        }
        size += 4 * c->e * (extent + fabs(o[k]));
    }
    w.slack = KELLER_CONE_SLACK * size;
    w.tan_alpha = d4_set1(c->tan_alpha);
    w.x0 = d4_set1(c->x0 + w.slack);
    return w;
}

void bvh_cone(const Bvh *bvh, const KellerCone *cone, KellerRange clip, BvhVisitCone visit, void *context,
              KellerAccelWork *work)
{
    if (bvh->primitive_count == 0) return;
    const WideCone w = widen(cone, bvh);
    const d4 zero = d4_set1(0), half = d4_set1(0.5), tiny = d4_set1(1e-300);
    double near = greater(cone->z_near, clip.near) - w.slack, far = lesser(cone->z_far, clip.far);
    struct {
        uint32_t node;
        double z;
    } stack[STACK];
    int top = 0;
    stack[top].node = 0;
    stack[top++].z = -INFINITY;
    while (top > 0) {
        top--;
        if (stack[top].z > far + w.slack) continue;
        const BvhNode *node = &bvh->nodes[stack[top].node];
        d4 h[3], c[3], p[3], r[3];
        for (int k = 0; k < 3; k++) {
            d4 lo = d4_load_floats(node->lower[k]), hi = d4_load_floats(node->upper[k]);
            h[k] = d4_mul(d4_sub(hi, lo), half);
            c[k] = d4_sub(d4_mul(d4_add(hi, lo), half), w.origin[k]);
        }
        for (int k = 0; k < 3; k++) { /* middle and half extent along each (stretched) axis of the cone */
            p[k] = d4_add(d4_add(d4_mul(c[0], w.axis[k][0]), d4_mul(c[1], w.axis[k][1])), d4_mul(c[2], w.axis[k][2]));
            r[k] = d4_add(d4_add(d4_mul(h[0], w.axis_abs[k][0]), d4_mul(h[1], w.axis_abs[k][1])),
                          d4_mul(h[2], w.axis_abs[k][2]));
        }
        d4 low = d4_sub(p[2], r[2]), high = d4_add(p[2], r[2]);
        d4 ok = d4_and(d4_le(d4_set1(near), high), d4_le(low, d4_set1(far + w.slack)));
        d4 R = d4_add(d4_mul(d4_min(high, d4_set1(far + w.slack)), w.tan_alpha), w.x0);
        d4 dx = d4_max(d4_sub(d4_abs(p[0]), r[0]), zero), dy = d4_max(d4_sub(d4_abs(p[1]), r[1]), zero);
        ok = d4_and(ok, d4_and(d4_le(zero, R), d4_le(d4_add(d4_mul(dx, dx), d4_mul(dy, dy)), d4_mul(R, R))));
        /* the tangent plane of the cone that faces the box's middle */
        d4 rho = d4_max(d4_sqrt(d4_add(d4_mul(p[0], p[0]), d4_mul(p[1], p[1]))), tiny);
        d4 ux = d4_div(p[0], rho), uy = d4_div(p[1], rho), reach = zero;
        for (int k = 0; k < 3; k++) {
            d4 n = d4_sub(d4_add(d4_mul(ux, w.axis[0][k]), d4_mul(uy, w.axis[1][k])), d4_mul(w.tan_alpha, w.axis[2][k]));
            reach = d4_add(reach, d4_mul(d4_abs(n), h[k]));
        }
        ok = d4_and(ok, d4_le(d4_sub(d4_sub(rho, d4_mul(w.tan_alpha, p[2])), reach), w.x0));
        int hit = d4_mask(ok);
        work->nodes++;
        if (!hit) continue;
        double z[4];
        d4_store(z, low);
        int order[4], n = 0;
        for (int i = 0; i < 4; i++) { /* nearest on top of the stack: insertion sort, farthest first */
            if (!(hit >> i & 1) || node->lower[0][i] > node->upper[0][i]) continue;
            int j = n++;
            while (j > 0 && z[order[j - 1]] < z[i]) {
                order[j] = order[j - 1];
                j--;
            }
            order[j] = i;
        }
        for (int i = n - 1; i >= 0; i--) { /* leaves at once, nearest first: they may shorten what follows */
            int k = order[i];
            for (uint32_t j = 0; j < node->count[k] && z[k] <= far + w.slack; j++) {
                work->triangles++;
                far = visit(context, bvh->primitives[node->child[k] + j], far);
            }
        }
        for (int i = 0; i < n; i++) {
            int k = order[i];
            if (node->count[k]) continue;
            assert(top < STACK);
            stack[top].node = node->child[k];
            stack[top++].z = z[k];
        }
    }
}
