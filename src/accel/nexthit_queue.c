/* The method `queue`: one front of what is known, hits and unopened nodes alike, opened until a hit is in front (Wald et al. 2018,
 * algorithm 1). One queue in place of the paper's two spares the comparison of two fronts; the order of entries is the rule: a
 * node at the distance of a hit comes first. */
#include "accel/bvh8.h"
#include "accel/nexthit.h"

/* The front is full or a heap is behind it. */
static __attribute__((noinline)) bool push_slowly(FoundQueue *q, Found f)
{
    if (q->count == FRONT) { /* the farther half goes behind */
        for (uint32_t i = FRONT / 2; i-- > 0;) {
            if (!found_grow(&q->heap)) return false;
            found_sift_up(q->heap.at, q->heap.count++, q->front[i], false);
        }
        q->count = FRONT / 2;
        for (uint32_t i = 0; i < FRONT / 2; i++) q->front[i] = q->front[FRONT / 2 + i];
    }
    if (!found_before(f, q->heap.at[0])) {
        if (!found_grow(&q->heap)) return false;
        found_sift_up(q->heap.at, q->heap.count++, f, false);
        return true;
    }
    uint32_t j = q->count++;
    for (; j > 0 && found_before(q->front[j - 1], f); j--) q->front[j] = q->front[j - 1];
    q->front[j] = f;
    return true;
}

static inline bool push_hit(FoundQueue *q, Found f)
{
    if (q->count == FRONT || q->heap.count > 0) return push_slowly(q, f);
    uint32_t j = q->count++;
    for (; j > 0 && q->front[j - 1].distance <= f.distance && found_before(q->front[j - 1], f); j--) q->front[j] = q->front[j - 1];
    q->front[j] = f;
    return true;
}

/* Nodes come before all that is no nearer: their ties need no look. */
static inline bool push_child(FoundQueue *q, TreeChild child)
{
    Found f = {(double)child.distance, child.child};
    if (q->count == FRONT || q->heap.count > 0) return push_slowly(q, f);
    uint32_t j = q->count++;
    for (; j > 0 && q->front[j - 1].distance < f.distance; j--) q->front[j] = q->front[j - 1];
    q->front[j] = f;
    return true;
}

/* The front is empty: what is least of the heap becomes it. */
static __attribute__((noinline)) void refill(FoundQueue *q)
{
    uint32_t n = q->heap.count < FRONT / 2 ? (uint32_t)q->heap.count : FRONT / 2;
    for (q->count = n; n-- > 0;) {
        q->front[n] = q->heap.at[0];
        Found f = q->heap.at[--q->heap.count];
        if (q->heap.count > 0) found_sift_down(q->heap.at, q->heap.count, 0, f, false);
    }
}

void nexthit_queue_start(KellerNexthit *it)
{
    FoundQueue *q = &it->queue;
    uint32_t root = it->accel->triangles ? it->tree->root(it->accel->tree) : KELLER_NONE;
    q->heap.count = 0;
    q->count = root != KELLER_NONE && it->clip.near <= it->clip.far;
    q->front[0] = (Found){-INFINITY, root};
}

static inline bool open_block(KellerNexthit *it, uint32_t block)
{
    Found hit[8];
    double far[8];
    uint32_t n = it->cones ? nexthit_cone_block(it, block, it->end.distance, hit, far)
                           : nexthit_ray_block(it, block, it->end.distance, hit);
    for (uint32_t i = 0; i < n; i++) {
        if (!found_before(it->last, hit[i]) || !found_before(hit[i], it->end)) continue;
        if (it->cones && !nexthit_keep_far(it, &hit[i], far[i])) return false;
        if (!push_hit(&it->queue, hit[i])) return false;
    }
    return true;
}

/* Opens a node; the nearest child, if nothing else is nearer, need not go through the queue: it is left in *node, KELLER_NONE if
 * there is none. */
static inline bool open_node(KellerNexthit *it, uint32_t *node)
{
    FoundQueue *q = &it->queue;
    TreeChild child[8];
    const void *tree = it->accel->tree;
    uint32_t n;
    if (!it->thin) n = it->tree->open(tree, *node, &it->lanes, child);
    else if (it->tree == &tree_bvh8) n = bvh8_open_thin(tree, *node, &it->lanes, child, false);
    else n = it->tree->open_thin(tree, *node, &it->lanes, child);
    it->work->nodes++;
    *node = KELLER_NONE;
    if (n == 0) return true;
    TreeChild nearest = child[0];
    for (uint32_t i = 1; i < n; i++) {
        TreeChild other = child[i];
        if (other.distance < nearest.distance) {
            other = nearest;
            nearest = child[i];
        }
        if (other.child & TREE_LEAF) fetch_block(&it->accel->triangles[other.child & ~TREE_LEAF]);
        if (!push_child(q, other)) return false;
    }
    if ((q->count == 0 && q->heap.count == 0) || (q->count > 0 && (double)nearest.distance <= q->front[q->count - 1].distance)) {
        *node = nearest.child;
        return true;
    }
    return push_child(q, nearest);
}

int nexthit_queue_next(KellerNexthit *it, Found *hit)
{
    FoundQueue *q = &it->queue;
    for (;;) {
        if (q->count == 0) {
            if (q->heap.count == 0) return 0;
            refill(q);
        }
        const Found top = q->front[--q->count];
        if (top.tie & FOUND_HIT) {
            /* a triangle's other blocks, farther away, find it once more */
            if (it->accel->repeats && !found_before(it->last, top)) continue;
            *hit = top;
            return 1;
        }
        uint32_t child = (uint32_t)top.tie;
        while (!(child & TREE_LEAF))
            if (!open_node(it, &child)) return -1;
        if (child != KELLER_NONE && !open_block(it, child & ~TREE_LEAF)) return -1;
    }
}
