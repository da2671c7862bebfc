/* The iterator's memory: grown without a limit, kept from ray to ray, and refused without harm. The linker has the library's
 * allocations pass through here. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <cmocka.h>

#include "nexthit_check.h"

static uint64_t allocations;
static int64_t granted = INT64_MAX; /* so many more */

void *__real_realloc(void *p, size_t bytes);
void *__real_malloc(size_t bytes);
void *__real_calloc(size_t count, size_t bytes);
void *__wrap_realloc(void *p, size_t bytes);
void *__wrap_malloc(size_t bytes);
void *__wrap_calloc(size_t count, size_t bytes);

void *__wrap_realloc(void *p, size_t bytes)
{
    allocations++;
    return granted-- > 0 ? __real_realloc(p, bytes) : NULL;
}

void *__wrap_malloc(size_t bytes)
{
    allocations++;
    return granted-- > 0 ? __real_malloc(bytes) : NULL;
}

void *__wrap_calloc(size_t count, size_t bytes)
{
    allocations++;
    return granted-- > 0 ? __real_calloc(count, bytes) : NULL;
}

/* A wall of `count` equal triangles at z = 2. */
static Model wall(uint32_t count)
{
    Random r = {1};
    Model m = model_make(MODEL_ONE_POINT, count, &r);
    for (uint32_t i = 0; i < 3 * count; i++) m.vertices[i] = v3(i % 3 == 1 ? 3 : -1, i % 3 == 2 ? 3 : -1, 2);
    return m;
}

static const KellerRange all = {0, INFINITY};

static void grows(void **state)
{
    (void)state;
    enum { MANY = 50000 };
    Model m = wall(MANY);
    KellerAccel *accel = nexthit_accel(&m.in, "bvh8", 0);
    KellerNexthit *it;
    KellerCone cone = keller_cone_round(v3(0, 0, 0), v3(0, 0, 1), 1e-3);
    assert_int_equal(keller_nexthit_new(&it, NULL), KELLER_OK);
    assert_true(keller_nexthit_bytes(it) < 2000);
    for (int k = 0; k < 4; k++) {
        Query q = {v3(0, 0, 0), v3(0, 0, 1), k % 2 ? &cone : NULL, all};
        KellerNexthitOptions o = {.method = k < 2 ? KELLER_NEXTHIT_QUEUE : KELLER_NEXTHIT_FILTER};
        nexthit_begin(it, accel, &q, &o);
        for (uint32_t i = 0; i < MANY; i++) assert_int_equal(nexthit_step(it, &q).triangle, i);
        assert_int_equal(nexthit_step(it, &q).triangle, KELLER_NONE);
    }
    /* hits and boxes in powers of two, in the queue and in the list, and the far ends */
    assert_in_range(keller_nexthit_bytes(it), MANY * 16, 65536 * (16 + 2 * 16 + 8) + 2000);
    keller_nexthit_free(it);
    keller_accel_free(accel);
    model_free(&m);
}

/* All methods over a model, rays and cones; returns the hits. */
static uint64_t go_over(KellerNexthit *it, KellerAccel *const *accel, const Model *m)
{
    Random r = {8};
    uint64_t hits = 0;
    for (uint32_t i = 0; i < 400; i++) {
        KellerCone cone = model_cone(m, i, &r);
        Query q = {cone.origin, cone.directrix, i % 2 ? &cone : NULL, all};
        KellerNexthitOptions o = {.method = (KellerNexthitMethod)(i / 2 % METHODS), .batch = 40};
        nexthit_begin(it, accel[i / 8 % STRUCTURES], &q, &o);
        while (nexthit_step(it, &q).triangle != KELLER_NONE) hits++;
    }
    return hits;
}

static void steady(void **state)
{
    (void)state;
    Random r = {7};
    Model m = model_make(MODEL_SPREAD, 8000, &r);
    KellerAccel *accel[STRUCTURES];
    KellerNexthit *it;
    for (int a = 0; a < STRUCTURES; a++) accel[a] = nexthit_accel(&m.in, structures[a], 0);
    assert_int_equal(keller_nexthit_new(&it, NULL), KELLER_OK);
    uint64_t before = allocations, hits = go_over(it, accel, &m);
    assert_in_range(hits, 5000, UINT64_MAX);
    assert_in_range(allocations - before, 2, 100); /* grown in doublings: few, but some */
    size_t bytes = keller_nexthit_bytes(it);
    before = allocations;
    assert_int_equal(go_over(it, accel, &m), hits);
    assert_int_equal(allocations, before);
    assert_int_equal(keller_nexthit_bytes(it), bytes);
    keller_nexthit_free(it);
    for (int a = 0; a < STRUCTURES; a++) keller_accel_free(accel[a]);
    model_free(&m);
}

/* Steps until refused or at the end; the hits until then are the first ones. */
static KellerStatus until_refused(KellerNexthit *it, bool cones, uint32_t *count, KellerError *error)
{
    for (*count = 0;; ++*count) {
        KellerRayHit ray = {0, 0};
        KellerConeHit cone = {{0, 0}, 0};
        KellerStatus s = cones ? keller_nexthit_next_cone(it, &cone, error) : keller_nexthit_next_ray(it, &ray, error);
        uint32_t triangle = cones ? cone.primitive : ray.triangle;
        if (s != KELLER_OK || triangle == KELLER_NONE) return s;
        assert_int_equal(triangle, *count);
    }
}

static void refused(void **state)
{
    (void)state;
    enum { MANY = 3000 };
    Model m = wall(MANY);
    KellerAccel *accel = nexthit_accel(&m.in, "bvh8", 0);
    KellerCone cone = keller_cone_round(v3(0, 0, 0), v3(0, 0, 1), 1e-3);
    uint32_t count, refusals = 0;
    KellerError error;
    for (int cones = 0; cones < 2; cones++)
        for (int method = 0; method < METHODS; method++)
            for (int after = 0; after < 20; after++) {
                KellerNexthit *it;
                /* restarting takes the square of the hits: twenty will do */
                const KellerNexthitKey twenty = {2, 20};
                KellerNexthitOptions o = {.method = (KellerNexthitMethod)method, .batch = 1000};
                Query q = {v3(0, 0, 0), v3(0, 0, 1), cones ? &cone : NULL, all};
                if (method == KELLER_NEXTHIT_RESTART && cones) continue;
                if (method == KELLER_NEXTHIT_RESTART) o.before = &twenty;
                assert_int_equal(keller_nexthit_new(&it, &error), KELLER_OK);
                nexthit_begin(it, accel, &q, &o);
                granted = after;
                KellerStatus s = until_refused(it, cones, &count, &error);
                if (s != KELLER_OK) {
                    refusals++;
                    assert_int_equal(s, KELLER_FAILED);
                    assert_non_null(strstr(error.message, "memory"));
                    KellerError again;
                    KellerRayHit ray;
                    KellerConeHit hit;
                    s = cones ? keller_nexthit_next_cone(it, &hit, &again) : keller_nexthit_next_ray(it, &ray, &again);
                    assert_int_equal(s, KELLER_FAILED);
                    if (cones) assert_int_equal(hit.primitive, KELLER_NONE);
                    else assert_int_equal(ray.triangle, KELLER_NONE);
                } else {
                    assert_int_equal(count, o.before ? 20 : MANY);
                }
                granted = INT64_MAX;
                nexthit_begin(it, accel, &q, &o); /* there is memory again */
                assert_int_equal(until_refused(it, cones, &count, &error), KELLER_OK);
                assert_int_equal(count, o.before ? 20 : MANY);
                keller_nexthit_free(it);
            }
    assert_true(refusals > 20);
    granted = 0;
    KellerNexthit *it;
    assert_int_equal(keller_nexthit_new(&it, &error), KELLER_FAILED);
    assert_null(it);
    granted = INT64_MAX;
    keller_accel_free(accel);
    model_free(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(grows),
        cmocka_unit_test(steady),
        cmocka_unit_test(refused),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
