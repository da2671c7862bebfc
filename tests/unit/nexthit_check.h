/* The iterator against the naive loop: every method, structure and order must give the loop's hits, sorted, bit for bit. Included
 * after cmocka.h. */
#ifndef KELLER_TESTS_NEXTHIT_CHECK_H
#define KELLER_TESTS_NEXTHIT_CHECK_H
#include "accel_model.h"
#include "keller/nexthit.h"
#include "keller/ray.h"

enum { METHODS = 4, ORDERS = 2, STRUCTURES = 5 };
static const char *const structures[STRUCTURES] = {"bvh", "bvh8", "bvh+mask", "bvh8+mask", "ubvh"};
static const char *const methods[METHODS] = {"queue", "restart", "filter", "filter-n"};

typedef struct {
    double distance, far;  /* far: of a cone's range; of a ray's hit the distance again */
    uint32_t triangle;
    bool enters;
} Hit;

/* A ray, or the cone if there is one. */
typedef struct {
    KellerVec3 origin, direction;
    const KellerCone *cone;
    KellerRange clip;
} Query;

/* ---- the naive loop ----------------------------------------------------------------------------------------------- */

static inline bool enters(KellerVec3 d, KellerVec3 a, KellerVec3 b, KellerVec3 c)
{
    long double p[3] = {(long double)b.x - a.x, (long double)b.y - a.y, (long double)b.z - a.z};
    long double q[3] = {(long double)c.x - a.x, (long double)c.y - a.y, (long double)c.z - a.z};
    long double leaving = d.x * (p[1] * q[2] - p[2] * q[1]) + d.y * (p[2] * q[0] - p[0] * q[2]) +
                          d.z * (p[0] * q[1] - p[1] * q[0]);
    return !(leaving > 0);
}

static inline int by_triangle(const void *a, const void *b)
{
    const Hit *p = a, *q = b;
    if (p->distance != q->distance) return p->distance < q->distance ? -1 : 1;
    return p->triangle < q->triangle ? -1 : p->triangle > q->triangle;
}

static inline int by_leaving(const void *a, const void *b)
{
    const Hit *p = a, *q = b;
    if (p->distance != q->distance) return p->distance < q->distance ? -1 : 1;
    return p->enters != q->enters ? (int)p->enters - q->enters : by_triangle(a, b);
}

/* All hits in their order into hits[triangle_count]. */
static inline uint32_t naive_hits(const KellerAccelInput *in, const Query *q, KellerNexthitOrder order, Hit *hits)
{
    uint32_t n = 0;
    KellerRay ray = keller_ray(q->origin, q->direction);
    for (uint32_t i = 0; i < in->triangle_count; i++) {
        KellerVec3 v[3];
        Hit h = {.triangle = i};
        for (int k = 0; k < 3; k++) v[k] = in->vertices[in->triangles[i][k]];
        if (q->cone) {
            KellerRange r = keller_cone_triangle(q->cone, v[0], v[1], v[2], q->clip, NULL, NULL);
            if (!(r.near <= r.far)) continue;
            h.distance = r.near, h.far = r.far;
        } else {
            if (!keller_ray_triangle(&ray, v[0], v[1], v[2], q->clip, &h.distance, NULL)) continue;
            h.far = h.distance;
        }
        h.enters = enters(q->direction, v[0], v[1], v[2]);
        hits[n++] = h;
    }
    qsort(hits, n, sizeof *hits, order == KELLER_NEXTHIT_LEAVE_FIRST ? by_leaving : by_triangle);
    return n;
}

/* ---- the iterator ------------------------------------------------------------------------------------------------- */

static inline void nexthit_begin(KellerNexthit *it, const KellerAccel *accel, const Query *q, const KellerNexthitOptions *o)
{
    KellerError error = {.message = ""};
    KellerStatus s = q->cone ? keller_nexthit_cone(it, accel, q->cone, q->clip, o, &error)
                             : keller_nexthit_ray(it, accel, q->origin, q->direction, q->clip, o, &error);
    if (s != KELLER_OK) fail_msg("%s", error.message);
}

/* triangle KELLER_NONE: no more */
static inline Hit nexthit_step(KellerNexthit *it, const Query *q)
{
    KellerConeHit cone;
    KellerRayHit ray;
    KellerError error = {.message = ""};
    KellerStatus s = q->cone ? keller_nexthit_next_cone(it, &cone, &error) : keller_nexthit_next_ray(it, &ray, &error);
    if (s != KELLER_OK) fail_msg("%s", error.message);
    return q->cone ? (Hit){cone.range.near, cone.range.far, cone.primitive, false} : (Hit){ray.t, ray.t, ray.triangle, false};
}

/* The iterator gives hits[0 .. count), then, `whole`, no more, and says so again. */
static inline void nexthit_expect(KellerNexthit *it, const Query *q, const char *what, const Hit *hits, uint32_t count, bool whole)
{
    for (uint32_t i = 0; i < count; i++) {
        Hit h = nexthit_step(it, q);
        if (h.triangle != hits[i].triangle || h.distance != hits[i].distance || h.far != hits[i].far)
            fail_msg("%s: hit %u of %u is triangle %u at %a to %a; expected %u at %a to %a", what, i, count, h.triangle,
                     h.distance, h.far, hits[i].triangle, hits[i].distance, hits[i].far);
    }
    for (int again = 0; whole && again < 2; again++) {
        Hit h = nexthit_step(it, q);
        if (h.triangle != KELLER_NONE) fail_msg("%s: triangle %u at %a after all %u", what, h.triangle, h.distance, count);
    }
}

/* One method in one order: all hits; then up to any of them, from any of them on, and between any two. */
static inline void nexthit_same(KellerNexthit *it, const KellerAccel *accel, const Query *q, int method, int order,
                                const Hit *hits, uint32_t n, Random *r)
{
    char what[100];
    snprintf(what, sizeof what, "%s, %s, order %d, %s", keller_accel_name(accel), methods[method], order, q->cone ? "cone" : "ray");
    KellerNexthitOptions o = {.method = (KellerNexthitMethod)method, .order = (KellerNexthitOrder)order,
                              .batch = random_u32(r) % 7};
    nexthit_begin(it, accel, q, &o);
    nexthit_expect(it, q, what, hits, n, true);
    if (n == 0) return;
    uint32_t from = random_u32(r) % n, to = from + random_u32(r) % (n - from);
    nexthit_begin(it, accel, q, &o); /* left at a hit */
    nexthit_expect(it, q, what, hits, from, false);
    KellerNexthitKey after = {hits[from].distance, hits[from].triangle}, before = {hits[to].distance, hits[to].triangle};
    o.after = &after;
    nexthit_begin(it, accel, q, &o);
    nexthit_expect(it, q, what, hits + from + 1, n - from - 1, true);
    o.before = &before;
    nexthit_begin(it, accel, q, &o);
    nexthit_expect(it, q, what, hits + from + 1, to > from ? to - from - 1 : 0, true);
    o.after = NULL;
    nexthit_begin(it, accel, q, &o);
    nexthit_expect(it, q, what, hits, to, true);
}

/* All methods and orders over all accelerators; hits[triangle_count] is room. Returns the number of hits. */
static inline uint32_t nexthit_check(KellerNexthit *it, KellerAccel *const *accels, int count, const KellerAccelInput *in,
                                     const Query *q, Hit *hits, Random *r)
{
    uint32_t n = 0;
    for (int order = 0; order < ORDERS; order++) {
        n = naive_hits(in, q, (KellerNexthitOrder)order, hits);
        for (int a = 0; a < count; a++)
            for (int method = 0; method < METHODS; method++) nexthit_same(it, accels[a], q, method, order, hits, n, r);
    }
    return n;
}

static inline KellerAccel *nexthit_accel(const KellerAccelInput *in, const char *name, double spatial)
{
    KellerAccel *accel;
    KellerAccelOptions options = {.name = name, .spatial = spatial, .threads = 1};
    assert_int_equal(keller_accel_new(in, &options, &accel, NULL), KELLER_OK);
    return accel;
}
#endif
