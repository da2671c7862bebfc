/* The methods that find a batch of hits at a time, the nearest `batch_size` behind the last one handed out: `restart` one, `filter-n`
 * as many as were said to be wanted, `filter` all. Each batch walks the tree from the root and leaves out what lies behind the
 * last of as many hits as are wanted (Gribble 2016, node culling). */
#include "accel/bvh8.h"
#include "accel/nexthit.h"
#include "base/number.h"

/* How far hits are still of interest. */
static double reach_of(const KellerNexthit *it)
{
    return it->batch.count == it->batch_size ? it->batch.at[0].distance : lesser(it->clip.far, it->end.distance);
}

/* Takes a hit in: while there is room as it comes, then into a heap with the greatest on top, which it replaces. */
static bool keep(KellerNexthit *it, Found f, double far)
{
    FoundArray *b = &it->batch;
    if (!found_before(it->last, f) || !found_before(f, it->end)) return true;
    if (b->count == it->batch_size) {
        if (!found_before(f, b->at[0])) return true;
        if (it->cones) { /* the slot of what goes */
            f.tie |= b->at[0].tie & FOUND_SLOT;
            it->far[f.tie & FOUND_SLOT] = far;
        }
        found_sift_down(b->at, b->count, 0, f, true);
        return true;
    }
    if (!found_grow(b) || (it->cones && !nexthit_keep_far(it, &f, far))) return false;
    b->at[b->count++] = f;
    if (b->count == it->batch_size)
        for (size_t i = b->count / 2; i-- > 0;) found_sift_down(b->at, b->count, i, b->at[i], true);
    return true;
}

static float visit(void *context, uint32_t block, bool inside, float far)
{
    (void)inside;
    KellerNexthit *it = context;
    Found hit[8];
    double last[8] = {0}, before = reach_of(it);
    uint32_t n = it->cones ? nexthit_cone_block(it, block, before, hit, last) : nexthit_ray_block(it, block, before, hit);
    for (uint32_t i = 0; i < n; i++)
        if (!keep(it, hit[i], last[i])) {
            it->failed = true;
            return -INFINITY;
        }
    double after = reach_of(it);
    if (after == before) return far;
    /* boxes of cones are left out where all that they hold begins farther by the slack */
    float nearer = float_up(it->cones ? after + (double)it->lanes.slack : after);
    return nearer < far ? nearer : far;
}

static void walk(KellerNexthit *it)
{
    static const WalkHow plainly;
    const KellerAccel *a = it->accel;
    if (!(it->clip.near <= it->clip.far) || !a->triangles) return;
    if (it->tree == &tree_bvh8 && it->thin) bvh8_walk_thin(a->tree, &it->lanes, visit, it, a->triangles, &it->work->nodes, false);
    else it->tree->walk(a->tree, &it->lanes, &plainly, visit, it, &it->work->nodes);
}

static void gather(KellerNexthit *it)
{
    it->batch.count = it->taken = it->far_count = 0;
    nexthit_narrow(it);
    walk(it);
    it->ended = it->batch.count < it->batch_size;
    found_sort(it->batch.at, it->batch.count);
}

int nexthit_batch_next(KellerNexthit *it, Found *hit)
{
    for (;;) {
        while (it->taken < it->batch.count) {
            *hit = it->batch.at[it->taken++];
            if (!it->accel->repeats || found_before(it->last, *hit)) return 1; /* a triangle may be in several blocks */
        }
        if (it->ended) return 0;
        gather(it);
        if (it->failed) return -1;
    }
}
