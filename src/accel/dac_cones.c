/* Many cones at once: the nearest triangle of each, or all triangles and edges. Cones are asked themselves, not as packets of rays. */
#include "accel/box.h"
#include "accel/dac.h"
#include "base/number.h"

typedef struct {
    KellerConeLanes lanes;          /* far: of what is still of interest, for boxes and leaves */
    KellerRange clip, whole;        /* as in query_cone.c */
} Asker;

typedef struct {
    const KellerAccel *accel;
    const KellerCone *cones;
    Asker *askers;
    uint32_t *order;
    bool edges;
    KellerConeHit *hits;            /* nearest; NULL: all */
    KellerVisitCones visit;
    void *context;
    KellerAccelWork *work;
} Cones;

static size_t most_refs(const KellerAccel *a)
{
    size_t edges = 8 * (size_t)a->edge_begin[a->leaf_count];
    return edges > a->input.triangle_count ? edges : a->input.triangle_count;
}

size_t dac_cones_bytes(const KellerAccel *a, size_t count)
{
    return most_refs(a) * sizeof(SahRef) + count * (sizeof(Asker) + sizeof(uint32_t)) + sizeof(Asker);
}

/* Brings the cones that meet the set's box to the front; returns how many. */
static size_t filter(const Cones *c, const DacSet *set, size_t count)
{
    AccelBox box = dac_box(set);
    size_t kept = 0;
    c->work->nodes += count;
    for (size_t i = 0; i < count; i++) {
        const KellerConeLanes *lanes = &c->askers[c->order[i]].lanes;
        float distance;
        if (!box_meets(lanes, cone_lanes_wide(lanes), box.lower, box.upper, &distance)) continue;
        uint32_t other = c->order[kept];
        c->order[kept++] = c->order[i];
        c->order[i] = other;
    }
    return kept;
}

/* Hands out an edge or, over a scene, the wedges on it; a triangle. */
static double hand_out(const Cones *c, size_t query, uint32_t id, KellerRange range)
{
    const KellerAccel *a = c->accel;
    if (!c->edges || !a->scene) return c->visit(c->context, query, id, range);
    double far = INFINITY;
    for (uint32_t i = a->wedge_begin[id]; i < a->wedge_begin[id + 1] && far != -INFINITY; i++)
        far = lesser(far, c->visit(c->context, query, a->wedge[i], range));
    return far;
}

/* What a primitive that is met leaves of interest. */
static double met(const Cones *c, uint32_t query, uint32_t id, KellerRange range)
{
    if (!c->hits) return hand_out(c, query, id, range);
    KellerConeHit *best = &c->hits[query];
    if (range.near < best->range.near || (range.near == best->range.near && id < best->primitive)) *best = (KellerConeHit){range, id};
    return best->range.near;
}

static void shorten(Asker *asker, double far)
{
    if (!(far < asker->clip.far)) return;
    asker->clip.far = far;
    asker->lanes.far = far == -INFINITY ? -INFINITY : float_up(far + (double)asker->lanes.slack);
}

/* One cone, and eight triangles or edges. */
static void test_block(const Cones *c, uint32_t query, const TriangleBlock *triangles, const EdgeBlock *edges)
{
    Asker *asker = &c->askers[query];
    _Alignas(32) float near[8], last[8];
    _Alignas(32) float at[8];
    uint32_t contained, mask, pierced = 0;
    if (edges) mask = keller_cone_meets_edge8(&asker->lanes, edges->corner, near, last, &contained);
    else if (c->hits && !cone_lanes_wide(&asker->lanes))
        mask = keller_cone_pierces_triangle8(&asker->lanes, triangles->corner, near, last, &pierced, at);
    else mask = keller_cone_meets_triangle8(&asker->lanes, triangles->corner, near, last, &contained);
    for (; pierced; pierced &= pierced - 1) shorten(asker, (double)at[__builtin_ctz(pierced)]);
    const uint32_t *ids = edges ? edges->id : triangles->id;
    *(edges ? &c->work->edges : &c->work->triangles) += lanes_used(ids);
    while (mask) {
        int i = __builtin_ctz(mask);
        for (uint32_t rest = c->hits ? mask & (mask - 1) : 0; rest; rest &= rest - 1) { /* the nearest first */
            int k = __builtin_ctz(rest);
            if (near[k] < near[i]) i = k;
        }
        mask &= ~(1u << i);
        KellerVec3 v[3];
        if (ids[i] == KELLER_NONE || (double)near[i] > asker->clip.far) continue;
        if (edges) edge_in(c->accel, edges, i, v);
        else triangle_in(c->accel, triangles, i, v);
        KellerRange range = edges ? keller_cone_edge(&c->cones[query], v[0], v[1], asker->whole, NULL, NULL)
                                  : keller_cone_triangle(&c->cones[query], v[0], v[1], v[2], asker->whole, NULL, NULL);
        if (range.near > range.far || range.near > asker->clip.far) continue;
        shorten(asker, met(c, query, ids[i], range));
    }
}

static void test_all(const Cones *c, const DacSet *set, size_t count)
{
    for (uint32_t at = 0; at < set->count; at += 8) {
        TriangleBlock triangles;
        EdgeBlock edges;
        if (c->edges) dac_edge_block(c->accel, set, at, &edges);
        else dac_triangle_block(c->accel, set, at, &triangles);
        for (size_t i = 0; i < count; i++) test_block(c, c->order[i], &triangles, c->edges ? &edges : NULL);
    }
}

/* The first `count` cones of the order are those that meet the set's box. */
static void divide(const Cones *c, const DacSet *set, size_t count)
{
    if (count == 0) return;
    if (set->count <= DAC_FEW || count <= DAC_ASKERS) {
        test_all(c, set, count);
        return;
    }
    DacSet side[2];
    int axis = dac_part(set, count, &side[0], &side[1]);
    size_t down = 0, asked = count < 16 ? count : 16; /* which way most run: of a sample */
    for (size_t i = 0; i < asked; i++) down += c->askers[c->order[i * count / asked]].lanes.enter_rate[axis] < 0;
    int first = 2 * down > asked;
    for (int i = 0; i < 2; i++) {
        const DacSet *s = &side[i ^ first];
        divide(c, s, filter(c, s, count));
    }
}

static void make_askers(const Cones *c, size_t count, KellerRange clip)
{
    for (size_t i = 0; i < count; i++) {
        const KellerCone *cone = &c->cones[i];
        Asker *a = &c->askers[i];
        a->clip = a->whole = (KellerRange){greater(cone->z_near, clip.near), lesser(cone->z_far, clip.far)};
        cone_lanes_make(cone, v3_sub(cone->origin, c->accel->middle), clip, c->accel->size, &a->lanes);
    }
}

static void run(Cones *c, SahRef *refs, size_t count, bool edges)
{
    size_t asking = 0;
    for (size_t i = 0; i < count; i++)
        if (c->askers[i].clip.near <= c->askers[i].clip.far) c->order[asking++] = (uint32_t)i;
    c->edges = edges;
    DacSet all = edges ? dac_edges(c->accel, refs) : dac_triangles(c->accel, refs);
    if (all.count > 0) divide(c, &all, filter(c, &all, asking));
}

static Cones start(const KellerAccel *a, void *memory, size_t count, const KellerCone *cones, KellerRange clip, KellerAccelWork *work,
                   SahRef **refs)
{
    *refs = memory;
    Asker *askers = (Asker *)(void *)(*refs + most_refs(a));
    Cones c = {.accel = a, .cones = cones, .askers = askers, .order = (uint32_t *)(void *)(askers + count), .work = work};
    make_askers(&c, count, clip);
    return c;
}

void dac_cones_nearest(const KellerAccel *a, void *memory, size_t count, const KellerCone *cones, KellerRange clip,
                       KellerConeHit *hits, KellerAccelWork *work)
{
    SahRef *refs;
    Cones c = start(a, memory, count, cones, clip, work, &refs);
    for (size_t i = 0; i < count; i++) hits[i] = (KellerConeHit){{INFINITY, -INFINITY}, KELLER_NONE};
    c.hits = hits;
    run(&c, refs, count, false);
}

void dac_cones_all(const KellerAccel *a, void *memory, size_t count, const KellerCone *cones, KellerRange clip, KellerVisitCones visit,
                   KellerVisitCones visit_edge, void *context, KellerAccelWork *work)
{
    SahRef *refs;
    Cones c = start(a, memory, count, cones, clip, work, &refs);
    c.context = context;
    for (int edges = 0; edges < 2; edges++) {
        c.visit = edges ? visit_edge : visit;
        if (c.visit) run(&c, refs, count, edges);
    }
}
