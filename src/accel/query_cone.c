/* Cones: the walk, then eight triangles or edges at a time in single precision; those surely contained have their range from
 * their vertices, the others go through keller_cone_triangle or keller_cone_edge. */
#include "accel/bvh8.h"
#include "accel/leaf.h"
#include "base/number.h"
#include "geom/cone_lanes.h"

/* From this half-angle on, boxes wholly inside the cone are common enough to look for (tangent). */
#define CONTAINED_TAN 0.01

typedef enum { ALL, LOOSE, NEAREST, ANY, WINDOW } Wanted; /* LOOSE: all, and some that no exact test was asked about */
static bool every(Wanted wanted) { return wanted == ALL || wanted == LOOSE; }

/* What a window query has met so far; which of it lies in the window is known at the end. */
enum { PENDING = 128 };
typedef struct {
    KellerConeHit hit[PENDING];
    bool edge[PENDING];
    uint32_t count;
    bool overflow;
} Pending;

typedef struct {
    const KellerAccel *accel;
    const KellerCone *cone;
    KellerConeLanes lanes;
    bool thin;
    KellerRange clip, whole;        /* still of interest; of the cone and the query both, which ranges are cut to */
    Wanted wanted;
    bool exact;                     /* ranges of contained primitives, too, are those of the double-precision tests */
    double depth;                   /* WINDOW: of the window behind the nearest triangle */
    Seen *seen;
    KellerVisitCone visit, visit_edge; /* ALL, WINDOW: NULL where not wanted */
    void *context;
    Pending *pending;
    bool found;                     /* a triangle */
    KellerConeHit hit;              /* the nearest triangle */
    KellerAccelWork *work;
} Query;

static inline void query(Query *q, const KellerAccel *a, const KellerCone *cone, KellerRange clip, Wanted wanted,
                         KellerAccelWork *work)
{
    q->accel = a;
    q->cone = cone;
    q->clip = q->whole = (KellerRange){greater(cone->z_near, clip.near), lesser(cone->z_far, clip.far)};
    cone_lanes_make(cone, v3_sub(cone->origin, a->middle), clip, a->size, &q->lanes);
    q->thin = !cone_lanes_wide(&q->lanes);
    q->wanted = wanted;
    q->depth = 0;
    q->exact = !every(wanted);
    q->seen = NULL;
    q->visit = q->visit_edge = NULL;
    q->context = NULL;
    q->pending = NULL;
    q->found = false;
    q->hit = (KellerConeHit){{INFINITY, INFINITY}, KELLER_NONE};
    q->work = work;
}

/* Hands out an edge, or the wedges on it; returns the far end still of interest. */
static double visit_all_on(const KellerAccel *a, KellerVisitCone visit, void *context, uint32_t edge, KellerRange range)
{
    if (!a->scene) return visit(context, edge, range);
    double far = INFINITY;
    for (uint32_t i = a->wedge_begin[edge]; i < a->wedge_begin[edge + 1] && far != -INFINITY; i++)
        far = lesser(far, visit(context, a->wedge[i], range));
    return far;
}

/* A primitive that is met; returns the new far end of interest. */
static double met(Query *q, uint32_t id, bool edge, KellerRange range)
{
    if (every(q->wanted)) {
        double far = edge ? visit_all_on(q->accel, q->visit_edge, q->context, id, range) : q->visit(q->context, id, range);
        q->found |= !edge;
        return lesser(q->clip.far, far);
    }
    if (q->wanted == WINDOW && (edge || q->visit)) {
        Pending *p = q->pending;
        if (p->count < PENDING) {
            p->hit[p->count] = (KellerConeHit){range, id};
            p->edge[p->count++] = edge;
        } else {
            p->overflow = true;
        }
    }
    if (edge) return q->clip.far;
    q->found = true;
    if (range.near < q->hit.range.near || (range.near == q->hit.range.near && id < q->hit.primitive))
        q->hit = (KellerConeHit){range, id};
    return lesser(q->clip.far, range.near + q->depth);
}

/* The walk's far end: boxes are left out only where all that they hold lies behind clip.far. */
static float walk_far(const Query *q)
{
    float far = (float)(q->clip.far + (double)q->lanes.slack);
    return (double)far < q->clip.far ? nextafterf(far, INFINITY) : far;
}

/* The next lane; where a nearest one is wanted, nearer ones first, as they may leave the others behind. */
static inline int take(uint32_t *mask, const float *near, bool nearest)
{
    int best = __builtin_ctz(*mask);
    for (uint32_t rest = nearest ? *mask & (*mask - 1) : 0; rest; rest &= rest - 1) {
        int i = __builtin_ctz(rest);
        if (near[i] < near[best]) best = i;
    }
    *mask &= ~(1u << best);
    return best;
}

/* Triangles (count 3) or edges (2) of a block that the single-precision tests left; near and last: the range of their vertices. */
static inline __attribute__((always_inline)) float finish(Query *q, uint32_t mask, uint32_t contained, const float *near,
                                                          const float *last, const void *block, int count, float far)
{
    const KellerAccel *a = q->accel;
    const TriangleBlock *triangles = block;
    const EdgeBlock *edges = block;
    const uint32_t *ids = count == 3 ? triangles->id : edges->id;
    while (mask) {
        int i = take(&mask, near, !every(q->wanted));
        uint32_t id = ids[i];
        if (id == KELLER_NONE || (double)near[i] > q->clip.far) continue;
        bool inside = contained >> i & 1;
        KellerRange range = {greater((double)near[i], q->whole.near), lesser((double)last[i], q->whole.far)};
        if (inside && q->wanted == ANY) {
            q->found = true;
            return -INFINITY;
        }
        /* the nearest, and what begins no farther, are told by their exact ranges */
        if ((!inside && q->wanted != LOOSE) || q->exact) {
            KellerVec3 v[3];
            if (count == 3) triangle_in(a, triangles, i, v);
            else edge_in(a, edges, i, v);
            if (q->wanted == ANY) {
                if (!keller_cone_meets_triangle(q->cone, v[0], v[1], v[2], q->clip)) continue;
                q->found = true;
                return -INFINITY;
            }
            range = count == 3 ? keller_cone_triangle(q->cone, v[0], v[1], v[2], q->whole, NULL, NULL)
                               : keller_cone_edge(q->cone, v[0], v[1], q->whole, NULL, NULL);
            if (range.near > range.far || range.near > q->clip.far) continue;
        }
        if (q->seen && seen_before(q->seen, count == 3 ? id : id + a->input.triangle_count)) continue;
        double old = q->clip.far;
        q->clip.far = met(q, id, count == 2, range);
        if (q->clip.far == old) continue;
        if (q->clip.far == -INFINITY) return -INFINITY;
        far = walk_far(q);
    }
    return far;
}

static inline float visit_triangles(Query *q, const TriangleBlock *block, bool inside, float far)
{
    _Alignas(32) float near[8], last[8], at[8];
    uint32_t contained = 0xff, pierced, mask = 0xff;
    q->work->triangles += lanes_used(block->id);
    if (q->thin) {
        mask = keller_cone_pierces_triangle8(&q->lanes, block->corner, near, last, &pierced, at);
        contained = 0;
        if (pierced && q->wanted == ANY) {
            q->found = true;
            return -INFINITY;
        }
        if (!every(q->wanted) && pierced) {
            double old = q->clip.far;
            for (; pierced; pierced &= pierced - 1) q->clip.far = lesser(q->clip.far, (double)at[__builtin_ctz(pierced)] + q->depth);
            if (q->clip.far < old) far = walk_far(q);
        }
    } else if (inside && !q->accel->repeats) { /* split primitives reach out of their part's box */
        keller_cone_contained_triangle8(&q->lanes, block->corner, near, last);
    } else {
        mask = keller_cone_meets_triangle8(&q->lanes, block->corner, near, last, &contained);
    }
    return mask ? finish(q, mask, contained, near, last, block, 3, far) : far;
}

static inline float visit_edges(Query *q, const EdgeBlock *block, float far)
{
    _Alignas(32) float near[8], last[8];
    uint32_t contained, mask = keller_cone_meets_edge8(&q->lanes, block->corner, near, last, &contained);
    q->work->edges += lanes_used(block->id);
    return mask ? finish(q, mask, contained, near, last, block, 2, far) : far;
}

static float visit_leaf(void *context, uint32_t leaf, bool inside, float far)
{
    Query *q = context;
    const KellerAccel *a = q->accel;
    if (q->visit_edge && a->edge_begin[leaf] < a->edge_begin[leaf + 1]) /* on their way while the triangles are tested */
        for (size_t i = 0; i < sizeof(EdgeBlock); i += 64) __builtin_prefetch((const char *)&a->edges[a->edge_begin[leaf]] + i);
    if (a->triangles && (q->visit || !every(q->wanted))) far = visit_triangles(q, &a->triangles[leaf], inside, far);
    if (!q->visit_edge) return far;
    for (uint32_t b = a->edge_begin[leaf]; b < a->edge_begin[leaf + 1] && far != -INFINITY; b++)
        far = visit_edges(q, &a->edges[b], far);
    return far;
}

static void walk(Query *q)
{
    const KellerAccel *a = q->accel;
    Seen seen;
    if (!(q->clip.near <= q->clip.far)) return;
    bool repeats = a->repeats && q->wanted != NEAREST && q->wanted != ANY, thin = q->thin;
    WalkHow how = a->how;
    KellerCone local;
    how.contained = a->contained ? a->contained > 0 : q->cone->tan_alpha > CONTAINED_TAN;
    if (how.leaf_boxes || how.order == KELLER_ORDER_EXACT) {
        local = *q->cone;
        local.origin = v3_sub(local.origin, a->middle);
        local.z_far = lesser(local.z_far, q->whole.far);
        how.cone = &local;
    }
    thin = thin && !how.contained && !how.leaf_boxes && how.order == KELLER_ORDER_SLABS && lanes_plain(&q->lanes);
    if (repeats) {
        q->seen = &seen;
        seen_start(&seen);
    }
    uint64_t *nodes = &q->work->nodes;
    if (a->kind == &tree_bvh8 && thin) bvh8_walk_thin(a->tree, &q->lanes, visit_leaf, q, a->triangles, nodes, false);
    else if (a->kind == &tree_bvh8_mask && thin) bvh8_walk_thin(a->tree, &q->lanes, visit_leaf, q, a->triangles, nodes, true);
    else a->kind->walk(a->tree, &q->lanes, &how, visit_leaf, q, nodes);
    if (repeats) seen_end(&seen);
    q->seen = NULL;
}

static void visit_all(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, Wanted wanted, KellerVisitCone visit,
                      KellerVisitCone visit_edge, void *context, KellerAccelWork *work)
{
    Query q;
    query(&q, accel, cone, clip, wanted, work);
    q.visit = visit;
    q.visit_edge = visit_edge;
    q.context = context;
    walk(&q);
}

void keller_accel_cone(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, KellerVisitCone visit,
                       KellerVisitCone visit_edge, void *context, KellerAccelWork *work)
{
    visit_all(accel, cone, clip, ALL, visit, visit_edge, context, work);
}

void keller_accel_cone_loosely(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, KellerVisitCone visit,
                               KellerVisitCone visit_edge, void *context, KellerAccelWork *work)
{
    visit_all(accel, cone, clip, LOOSE, visit, visit_edge, context, work);
}

bool keller_accel_cone_nearest(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, KellerConeHit *hit,
                               KellerAccelWork *work)
{
    Query q;
    query(&q, accel, cone, clip, NEAREST, work);
    walk(&q);
    if (q.found) *hit = q.hit;
    return q.found;
}

bool keller_accel_cone_any(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, KellerAccelWork *work)
{
    Query q;
    query(&q, accel, cone, clip, ANY, work);
    walk(&q);
    return q.found;
}

typedef struct {
    KellerVisitCone visit, visit_edge;
    void *context;
    double end, stop;               /* of the window; what the visits have left of it */
} Window;

/* Where a range begins decides, not where its box does. */
static double in_window(Window *w, KellerVisitCone visit, uint32_t primitive, KellerRange range)
{
    if (range.near <= lesser(w->end, w->stop)) w->stop = lesser(w->stop, visit(w->context, primitive, range));
    return w->stop;
}
static double triangle_in_window(void *context, uint32_t primitive, KellerRange range)
{
    Window *w = context;
    return in_window(w, w->visit, primitive, range);
}
static double edge_in_window(void *context, uint32_t primitive, KellerRange range)
{
    Window *w = context;
    return in_window(w, w->visit_edge, primitive, range);
}

bool keller_accel_cone_window(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, double depth,
                              KellerConeHit *nearest, KellerVisitCone visit, KellerVisitCone visit_edge, void *context,
                              KellerAccelWork *work)
{
    Query q;
    Pending pending;
    query(&q, accel, cone, clip, WINDOW, work);
    pending.count = 0;
    pending.overflow = false;
    q.pending = &pending;
    q.depth = depth;
    q.visit = visit;
    q.visit_edge = visit_edge;
    walk(&q);
    if (q.found) *nearest = q.hit;
    Window w = {visit, visit_edge, context, q.found ? q.hit.range.near + depth : INFINITY, INFINITY};
    if (!pending.overflow) {
        for (uint32_t i = 0; i < pending.count; i++) {
            KellerConeHit h = pending.hit[i];
            if (pending.edge[i]) visit_all_on(accel, edge_in_window, &w, h.primitive, h.range);
            else triangle_in_window(&w, h.primitive, h.range);
        }
        return q.found;
    }
    q.wanted = ALL;
    q.visit = visit && q.found ? triangle_in_window : NULL;
    q.visit_edge = visit_edge ? edge_in_window : NULL;
    q.context = &w;
    q.clip = (KellerRange){q.whole.near, lesser(q.whole.far, w.end)};
    q.lanes.far = walk_far(&q);
    bool found = q.found;
    walk(&q);
    return found;
}
