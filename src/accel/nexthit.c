/* The iterator's interface. */
#include "accel/nexthit.h"

#include <stdlib.h>

#include "base/number.h"

bool keller_nexthit_leaves(KellerVec3 direction, KellerVec3 a, KellerVec3 b, KellerVec3 c)
{
    return v3_dot(direction, v3_cross(v3_sub(b, a), v3_sub(c, a))) > 0;
}

bool keller_nexthit_resumes(const KellerAccel *accel) { return accel->kind->open != NULL; }

void nexthit_open(KellerNexthit *it)
{
    /* one by one: the queue's front is large, and need not be cleared */
    it->queue.heap = it->batch = (FoundArray){0};
    it->far = NULL;
    it->far_capacity = it->far_count = 0;
    it->queue.count = 0;
    it->method = KELLER_NEXTHIT_RESTART;
    it->ended = true;
    it->failed = it->cones = false;
    it->batch_size = it->taken = 0;
    it->unused = (KellerAccelWork){0};
}

void nexthit_close(KellerNexthit *it)
{
    free(it->queue.heap.at);
    free(it->batch.at);
    free(it->far);
}

KellerStatus keller_nexthit_new(KellerNexthit **it, KellerError *error)
{
    *it = malloc(sizeof **it);
    if (!*it) return keller_error_memory(error, sizeof **it);
    nexthit_open(*it);
    return KELLER_OK;
}

void keller_nexthit_free(KellerNexthit *it)
{
    if (!it) return;
    nexthit_close(it);
    free(it);
}

size_t keller_nexthit_bytes(const KellerNexthit *it)
{
    return sizeof *it + (it->queue.heap.capacity + it->batch.capacity) * sizeof(Found) + it->far_capacity * sizeof *it->far;
}

bool nexthit_keep_far(KellerNexthit *it, Found *hit, double far)
{
    if (it->far_count == it->far_capacity) {
        size_t capacity = it->far_capacity ? 2 * it->far_capacity : 64;
        double *more = it->far_count > FOUND_SLOT ? NULL : realloc(it->far, capacity * sizeof *more);
        if (!more) return false;
        it->far = more;
        it->far_capacity = capacity;
    }
    it->far[it->far_count] = far;
    hit->tie |= it->far_count++;
    return true;
}

/* ---- beginning --------------------------------------------------------------------------------------------------- */

/* A key's place, behind all slots of its triangle where `behind`. */
static Found place_of(const KellerNexthit *it, const KellerNexthitKey *key, bool behind)
{
    if (key->triangle == KELLER_NONE) return (Found){key->distance, UINT64_MAX};
    Found f = found_of(it, key->distance, key->triangle);
    if (behind) f.tie |= FOUND_SLOT;
    return f;
}

static KellerStatus begin(KellerNexthit *it, const KellerAccel *accel, KellerVec3 direction, KellerRange clip,
                          const KellerNexthitOptions *options, KellerError *error)
{
    static const KellerNexthitOptions defaults;
    const KellerNexthitOptions *o = options ? options : &defaults;
    it->accel = accel;
    it->tree = accel->kind;
    it->direction = direction;
    it->clip = clip;
    it->work = o->work ? o->work : &it->unused;
    it->method = o->method;
    it->order = o->order;
    it->failed = false;
    it->last = (Found){-INFINITY, 0};
    it->end = (Found){INFINITY, UINT64_MAX};
    it->batch.count = it->taken = it->far_count = 0;
    it->batch_size = o->method == KELLER_NEXTHIT_FILTER ? SIZE_MAX : o->method == KELLER_NEXTHIT_RESTART || !o->batch ? 1 : o->batch;
    it->ended = o->method == KELLER_NEXTHIT_QUEUE && !it->tree->open;
    if (it->ended) {
        it->method = KELLER_NEXTHIT_RESTART;
        return keller_error(error, KELLER_BAD_INPUT, "nexthit: the method queue does not run over \"%s\"; expected bvh, bvh8 or ubvh",
                            it->tree->name);
    }
    if (o->after) it->last = place_of(it, o->after, true);
    if (o->before) it->end = place_of(it, o->before, false);
    return KELLER_OK;
}

/* A cone's ranges may begin before the bounds of single precision, by no more than its slack. */
static double slack_of(const KellerNexthit *it) { return it->cones ? (double)it->lanes.slack : 0; }

void nexthit_narrow(KellerNexthit *it)
{
    float near = float_down(it->last.distance - slack_of(it));
    it->lanes.near = near > it->near ? near : it->near;
}

/* The lanes are ready. */
static void start(KellerNexthit *it, const KellerNexthitOptions *o)
{
    it->near = it->lanes.near;
    if (o && o->after) nexthit_narrow(it);
    if (o && o->before) {
        float far = float_up(it->end.distance + slack_of(it));
        if (far < it->lanes.far) it->lanes.far = far;
    }
    if (it->method == KELLER_NEXTHIT_QUEUE) nexthit_queue_start(it);
}

KellerStatus keller_nexthit_ray(KellerNexthit *it, const KellerAccel *accel, KellerVec3 origin, KellerVec3 direction,
                                KellerRange clip, const KellerNexthitOptions *options, KellerError *error)
{
    it->cones = false;
    KellerStatus status = begin(it, accel, direction, clip, options, error);
    if (status != KELLER_OK) return status;
    it->thin = true;
    it->ray.made = false;
    ray8_make(accel, origin, direction, clip, &it->ray.ray, &it->lanes);
    if (it->tree == &tree_ubvh) ray8_origin(accel, &it->ray.ray, &it->lanes);
    start(it, options);
    return KELLER_OK;
}

KellerStatus keller_nexthit_cone(KellerNexthit *it, const KellerAccel *accel, const KellerCone *cone, KellerRange clip,
                                 const KellerNexthitOptions *options, KellerError *error)
{
    it->cones = true;
    KellerStatus status = begin(it, accel, cone->directrix, clip, options, error);
    if (status != KELLER_OK) return status;
    nexthit_prepare_cone(it, cone);
    start(it, options);
    return KELLER_OK;
}

/* ---- stepping ---------------------------------------------------------------------------------------------------- */

static inline KellerStatus step(KellerNexthit *it, Found *hit, bool *found, KellerError *error)
{
    int n = it->failed ? -1 : it->method == KELLER_NEXTHIT_QUEUE ? nexthit_queue_next(it, hit) : nexthit_batch_next(it, hit);
    *found = n > 0;
    if (*found) it->last = (Found){hit->distance, hit->tie | FOUND_SLOT};
    if (n >= 0) return KELLER_OK;
    it->failed = true;
    return keller_error_memory(error, 2 * keller_nexthit_bytes(it));
}

KellerStatus keller_nexthit_next_ray(KellerNexthit *it, KellerRayHit *hit, KellerError *error)
{
    Found f;
    bool found;
    KellerStatus status = step(it, &f, &found, error);
    *hit = found ? (KellerRayHit){f.distance, found_triangle(f)} : (KellerRayHit){INFINITY, KELLER_NONE};
    return status;
}

KellerStatus keller_nexthit_next_cone(KellerNexthit *it, KellerConeHit *hit, KellerError *error)
{
    Found f;
    bool found;
    KellerStatus status = step(it, &f, &found, error);
    *hit = found ? (KellerConeHit){{f.distance, it->far[f.tie & FOUND_SLOT]}, found_triangle(f)}
                 : (KellerConeHit){{INFINITY, -INFINITY}, KELLER_NONE};
    return status;
}
