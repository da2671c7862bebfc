/* The nearest hits of many rays at once. Rays from one point that follow each other go in packets, by the cone around them, until
 * packets or primitives are few (algorithm 2); then, and the others from the beginning, each for itself. */
#include "accel/box.h"
#include "accel/dac.h"
#include "accel/ray8.h"
#include "base/number.h"
#include "keller/ray.h"

enum {
    TOGETHER = 64,                  /* rays made ready for the triangles of a leaf at a time */
    PACKET = 64,                    /* rays in a packet, at most */
    PACKET_LEAST = 16,              /* and at least; fewer go alone */
    PACKETS_FEW = 4,                /* packets that are not kept together any more */
    PACKETS_SMALL = 128             /* primitives for which none are */
};
#define PACKET_TAN 0.05             /* of the widest packet's half-angle: wider ones meet more boxes than they spare tests */

/* As its boxes see a ray: two times four lanes. */
typedef struct {
    _Alignas(32) float from[3];     /* relative to the middle */
    uint32_t id;
    float rate[3], far;             /* 1 / direction, as ray8_make has it; the nearest hit so far */
} Asker;

typedef struct {
    KellerConeLanes lanes;
    uint32_t first, count;          /* of its rays */
} Packet;

typedef struct {
    const KellerAccel *accel;
    const KellerVec3 *origins, *directions;
    KellerRange clip;
    KellerRayHit *hits;
    float near, width;              /* of all rays; what boxes are grown by */
    Asker *rays, *at_work;          /* as they came; those that are asking */
    Packet *packets;
    KellerAccelWork *work;
} Rays;

size_t dac_rays_bytes(const KellerAccel *accel, size_t count)
{
    return accel->input.triangle_count * sizeof(SahRef) + 2 * count * sizeof(Asker) + (count / PACKET_LEAST + 1) * sizeof(Packet);
}

/* What reaches ray8.c's BOX_ERROR of slack, 8 u of the greatest coordinate, with 4 u more for growing the boxes themselves. */
#define BOX_ERROR (12 * 0x1p-24)

static Asker asker_of(const Rays *r, size_t i, double *most)
{
    Ray8 ray;
    KellerConeLanes lanes;
    Asker a = {.id = (uint32_t)i, .far = float_up(r->clip.far)};
    KellerVec3 from = v3_sub(r->origins[i], r->accel->middle);
    const double o[3] = {from.x, from.y, from.z};
    ray8_make(r->accel, r->origins[i], r->directions[i], r->clip, &ray, &lanes);
    for (int k = 0; k < 3; k++) {
        a.from[k] = (float)o[k];
        a.rate[k] = lanes.enter_rate[k];
        *most = greater(*most, fabs(o[k]));
    }
    return a;
}

/* Brings the rays that meet the set's box to the front; returns how many. */
static size_t filter(const Rays *r, const DacSet *set, Asker *askers, size_t count)
{
    AccelBox box = dac_box(set);
    /* lane 3 is of no use, but not to be subnormal, as the number there is */
    const f4 low = f4_sub(f4_set(box.lower[0], box.lower[1], box.lower[2], 1), f4_set1(r->width));
    const f4 high = f4_add(f4_set(box.upper[0], box.upper[1], box.upper[2], 1), f4_set1(r->width));
    const f4 last = i4_as_f4(simde_mm_set_epi32(-1, 0, 0, 0)), near = f4_set1(r->near);
    size_t kept = 0;
    r->work->nodes += count;
    for (size_t i = 0; i < count; i++) {
        f8 here = f8_load((const float *)&askers[i]), other = f8_load((const float *)&askers[kept]);
        f4 from = f4_low(here), rate = f4_high(here);
        f4 a = f4_mul(f4_sub(low, from), rate), b = f4_mul(f4_sub(high, from), rate);
        f4 in = f4_blend(last, near, f4_min(a, b)), out = f4_blend(last, rate, f4_max(a, b)); /* lane 3 of rate is far */
        in = f4_max(in, simde_mm_movehl_ps(in, in));
        out = f4_min(out, simde_mm_movehl_ps(out, out));
        in = f4_max(in, simde_mm_shuffle_ps(in, in, 1));
        out = f4_min(out, simde_mm_shuffle_ps(out, out, 1));
        f8_store((float *)&askers[i], other);
        f8_store((float *)&askers[kept], here);
        kept += (size_t)(f4_mask(f4_lt(out, in)) & 1) ^ 1;
    }
    return kept;
}

/* One ray and a block. */
static void test_block(const Rays *r, const Ray8 *ray, const TriangleBlock *block, Asker *asker)
{
    _Alignas(32) float low[8], high[8];
    Ray8Block tested;
    KellerRayHit *best = &r->hits[asker->id];
    uint32_t mask = ray8_meets(ray, block, r->near, asker->far, &tested);
    r->work->triangles += lanes_used(block->id);
    if (!mask) return;
    uint32_t sure = mask & ray8_sure(ray, &tested, float_up(r->clip.near), float_down(r->clip.far), low, high);
    for (; sure; sure &= sure - 1) {
        float end = high[__builtin_ctz(sure)];
        asker->far = end < asker->far ? end : asker->far;
    }
    KellerRay exact = keller_ray(ray->origin, ray->direction);
    for (; mask; mask &= mask - 1) {
        int i = __builtin_ctz(mask);
        KellerRayHit hit = {.triangle = block->id[i]};
        KellerVec3 v[3];
        if (hit.triangle == KELLER_NONE || low[i] > asker->far) continue;
        triangle_in(r->accel, block, i, v);
        KellerRange clip = {r->clip.near, lesser(r->clip.far, best->t)};
        if (!keller_ray_triangle(&exact, v[0], v[1], v[2], clip, &hit.t, NULL)) continue;
        if (hit.t < best->t || hit.triangle < best->triangle) *best = hit;
        float nearer = float_up(best->t);
        asker->far = nearer < asker->far ? nearer : asker->far;
    }
}

static void test_all(const Rays *r, const DacSet *set, Asker *askers, size_t count)
{
    for (size_t first = 0; first < count; first += TOGETHER) {
        Ray8 rays[TOGETHER];
        size_t n = count - first < TOGETHER ? count - first : TOGETHER;
        for (size_t i = 0; i < n; i++) {
            KellerConeLanes lanes;
            uint32_t id = askers[first + i].id;
            ray8_make(r->accel, r->origins[id], r->directions[id], r->clip, &rays[i], &lanes);
        }
        for (uint32_t at = 0; at < set->count; at += 8) {
            TriangleBlock block;
            dac_triangle_block(r->accel, set, at, &block);
            for (size_t i = 0; i < n; i++) test_block(r, &rays[i], &block, &askers[first + i]);
        }
    }
}

/* The rays are those that meet the set's box. */
static void divide(const Rays *r, const DacSet *set, Asker *askers, size_t count)
{
    if (count == 0) return;
    if (set->count <= DAC_FEW || count <= DAC_ASKERS) {
        test_all(r, set, askers, count);
        return;
    }
    DacSet side[2];
    int axis = dac_part(set, count, &side[0], &side[1]);
    size_t down = 0, asked = count < 64 ? count : 64; /* which way most run: of a sample */
    for (size_t i = 0; i < asked; i++) down += askers[i * count / asked].rate[axis] < 0;
    int first = 2 * down > asked;
    for (int i = 0; i < 2; i++) {
        const DacSet *s = &side[i ^ first];
        divide(r, s, askers, filter(r, s, askers, count));
    }
}

/* ---- packets ----------------------------------------------------------------------------------------------------- */

/* The cone around `count` rays from one point; false: too wide. */
static bool make_packet(const Rays *r, size_t first, size_t count, Packet *packet)
{
    KellerVec3 axis = v3(0, 0, 0), origin = r->origins[first];
    double sine = 0;
    for (size_t i = first; i < first + count; i++) axis = v3_add(axis, v3_unit(r->directions[i]));
    if (!(v3_norm(axis) > 0.5 * (double)count)) return false;
    axis = v3_unit(axis);
    for (size_t i = first; i < first + count; i++) {
        KellerVec3 d = v3_unit(r->directions[i]);
        sine = greater(sine, v3_norm(v3_cross(axis, d)));
        if (v3_dot(axis, d) < 0.5) return false;
    }
    if (sine > PACKET_TAN) return false;
    KellerCone cone = keller_cone_round(origin, axis, asin(sine * (1 + 1e-9) + 1e-12)); /* beyond the rounding of unit vectors */
    cone_lanes_make(&cone, v3_sub(origin, r->accel->middle), (KellerRange){0, INFINITY}, r->accel->size, &packet->lanes);
    packet->first = (uint32_t)first;
    packet->count = (uint32_t)count;
    return true;
}

/* Makes packets, and puts the other rays to work; returns how many those are. */
static size_t gather(Rays *r, size_t count, size_t *packets)
{
    size_t alone = 0, n = 0;
    for (size_t i = 0, end; i < count; i = end) {
        KellerVec3 o = r->origins[i];
        for (end = i + 1; end < count && end < i + PACKET; end++)
            if (r->origins[end].x != o.x || r->origins[end].y != o.y || r->origins[end].z != o.z) break;
        if (r->clip.near >= 0 && end - i >= PACKET_LEAST && make_packet(r, i, end - i, &r->packets[n])) n++;
        else
            while (i < end) r->at_work[alone++] = r->rays[i++];
    }
    *packets = n;
    return alone;
}

static size_t filter_packets(const Rays *r, const DacSet *set, size_t count)
{
    AccelBox box = dac_box(set);
    size_t kept = 0;
    r->work->nodes += count;
    for (size_t i = 0; i < count; i++) {
        const KellerConeLanes *lanes = &r->packets[i].lanes;
        float distance;
        if (!box_meets(lanes, cone_lanes_wide(lanes), box.lower, box.upper, &distance)) continue;
        Packet other = r->packets[kept];
        r->packets[kept++] = r->packets[i];
        r->packets[i] = other;
    }
    return kept;
}

/* The packets' rays, each for itself. What all rays of a packet have found in front of is of no interest to it any more. */
static void flush(const Rays *r, const DacSet *set, size_t packets)
{
    size_t count = 0;
    for (size_t p = 0; p < packets; p++)
        for (uint32_t i = r->packets[p].first; i < r->packets[p].first + r->packets[p].count; i++) {
            Asker *a = &r->at_work[count++];
            *a = r->rays[i];
            float found = float_up(r->hits[a->id].t);
            a->far = found < a->far ? found : a->far;
        }
    divide(r, set, r->at_work, filter(r, set, r->at_work, count));
    for (size_t p = 0; p < packets; p++) {
        double far = 0;
        for (uint32_t i = r->packets[p].first; i < r->packets[p].first + r->packets[p].count; i++)
            far = greater(far, lesser(r->hits[i].t, r->clip.far) * v3_norm(r->directions[i])); /* no less than along the axis */
        r->packets[p].lanes.far = float_up(far + (double)r->packets[p].lanes.slack);
    }
}

/* Algorithm 2: the first `count` packets are those that meet the set's box. */
static void divide_packets(const Rays *r, const DacSet *set, size_t count)
{
    if (count == 0) return;
    if (set->count <= PACKETS_SMALL || count <= PACKETS_FEW) {
        flush(r, set, count);
        return;
    }
    DacSet side[2];
    int axis = dac_part(set, count * PACKET, &side[0], &side[1]), first = r->packets[count / 2].lanes.enter_rate[axis] < 0;
    for (int i = 0; i < 2; i++) {
        const DacSet *s = &side[i ^ first];
        divide_packets(r, s, filter_packets(r, s, count));
    }
}

void dac_rays_nearest(const KellerAccel *a, void *memory, size_t count, const KellerVec3 *origins, const KellerVec3 *directions,
                      KellerRange clip, KellerRayHit *hits, KellerAccelWork *work)
{
    SahRef *refs = memory;
    Asker *rays = (Asker *)(void *)(refs + a->input.triangle_count);
    Packet *room = (Packet *)(void *)(rays + 2 * count);
    Rays r = {a, origins, directions, clip, hits, float_down(clip.near), 0, rays, rays + count, room, work};
    double most = 0;
    size_t packets;
    for (size_t i = 0; i < count; i++) {
        rays[i] = asker_of(&r, i, &most);
        hits[i] = (KellerRayHit){INFINITY, KELLER_NONE};
    }
    r.width = (float)(BOX_ERROR * (a->size + most + 1e-9));
    DacSet all = dac_triangles(a, refs);
    if (all.count == 0) return;
    size_t alone = gather(&r, count, &packets);
    divide(&r, &all, r.at_work, filter(&r, &all, r.at_work, alone));
    divide_packets(&r, &all, filter_packets(&r, &all, packets));
}
