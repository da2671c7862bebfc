/* Rays: eight triangles at a time in single precision (ray8.h), and keller_ray_triangle on what is left. */
#include "accel/nexthit.h"
#include "base/number.h"

uint32_t nexthit_ray_block(KellerNexthit *it, uint32_t number, double far, Found hit[8])
{
    const TriangleBlock *block = &it->accel->triangles[number];
    NexthitRay *r = &it->ray;
    Ray8Block tested;
    const KellerRange clip = {it->clip.near, lesser(far, it->clip.far)};
    if (!it->accel->exact_triangles) /* wanted in part, and two steps away: a triangle's vertices are found by its numbers */
        for (int i = 0; i < 8; i++) __builtin_prefetch(&it->accel->input.triangles[block->id[i] == KELLER_NONE ? 0 : block->id[i]]);
    uint32_t n = 0, mask = ray8_meets(&r->ray, block, it->lanes.near, float_up(clip.far), &tested);
    it->work->triangles += lanes_used(block->id);
    if (mask && !r->made) {
        r->exact = keller_ray(r->ray.origin, r->ray.direction);
        r->made = true;
    }
    for (; mask; mask &= mask - 1) {
        int lane = __builtin_ctz(mask);
        uint32_t id = block->id[lane];
        KellerVec3 v[3];
        double t;
        if (id == KELLER_NONE) continue;
        triangle_in(it->accel, block, lane, v);
        if (keller_ray_triangle(&r->exact, v[0], v[1], v[2], clip, &t, NULL)) hit[n++] = found_of(it, t, id);
    }
    return n;
}
