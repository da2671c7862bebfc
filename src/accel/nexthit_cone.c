/* Cones: eight triangles at a time in single precision, and keller_cone_triangle on what is left, so that distances are its.
 *
 * A range may begin before the cone meets the triangle: it is that of the cone grown by two KELLER_CONE_SLACK, but for errors of
 * second order (docs/numerics.md, one step from an inexact root). The boxes' bounds are those of the cone grown by
 * KELLER_CONE_SLACK_FLOAT, 2^28 times as much, so none lies behind where a range below it begins. */
#include "accel/nexthit.h"
#include "base/number.h"
#include "geom/cone_lanes.h"

void nexthit_prepare_cone(KellerNexthit *it, const KellerCone *cone)
{
    it->cone = *cone;
    cone_lanes_make(cone, v3_sub(cone->origin, it->accel->middle), it->clip, it->accel->size, &it->lanes);
    it->thin = !cone_lanes_wide(&it->lanes) && lanes_plain(&it->lanes);
    it->clip = (KellerRange){greater(cone->z_near, it->clip.near), lesser(cone->z_far, it->clip.far)};
}

uint32_t nexthit_cone_block(KellerNexthit *it, uint32_t number, double far, Found hit[8], double last[8])
{
    const TriangleBlock *block = &it->accel->triangles[number];
    _Alignas(32) float near8[8], far8[8];
    uint32_t n = 0, contained, mask = keller_cone_meets_triangle8(&it->lanes, block->corner, near8, far8, &contained);
    it->work->triangles += lanes_used(block->id);
    for (; mask; mask &= mask - 1) {
        int i = __builtin_ctz(mask);
        uint32_t id = block->id[i];
        KellerVec3 v[3];
        if (id == KELLER_NONE || (double)near8[i] > far) continue;
        triangle_in(it->accel, block, i, v);
        KellerRange range = keller_cone_triangle(&it->cone, v[0], v[1], v[2], it->clip, NULL, NULL);
        if (!(range.near <= range.far && range.near <= far)) continue;
        hit[n] = found_of(it, range.near, id);
        last[n++] = range.far;
    }
    return n;
}
