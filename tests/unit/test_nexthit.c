/* The iterator over hits against the naive loop over all triangles, on the models of accel_model.h; interleaved; refusals. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <cmocka.h>

#include "../cases.h"
#include "nexthit_check.h"

/* Rays and cones from anywhere, some aimed at vertices and along axes, with clips on either side of the origin. */
static Query query(const Model *m, uint32_t i, const KellerCone *cone, bool cones, Random *r)
{
    Query q = {cone->origin, v3_scale(cone->directrix, i % 4 ? 1 : 0.3), cones ? cone : NULL, {0, INFINITY}};
    if (cones) q.direction = cone->directrix;
    if (i % 3 == 1) q.clip = (KellerRange){random_in(r, 0, 10), random_in(r, 10, 40)};
    if (i % 3 == 2 && !cones) q.clip = (KellerRange){-INFINITY, i % 2 ? INFINITY : 0};
    if (i % 19 == 7 && m->in.triangle_count) { /* from a vertex: hits at 0 */
        q.origin = model_corner(m, random_u32(r) % m->in.triangle_count, 0);
        q.cone = NULL;
    }
    return q;
}

static void same_as_naive(void **state)
{
    bool cones = **(bool **)state;
    KellerNexthit *it;
    assert_int_equal(keller_nexthit_new(&it, NULL), KELLER_OK);
    Random r = {cones ? 12u : 2018u};
    const uint32_t scenes = 10 * MODEL_KINDS, all = (uint32_t)cases_of(100000), each = all / scenes / (cones ? 20 : 1) + 1;
    uint64_t hits = 0;
    for (uint32_t s = 0; s < scenes; s++) {
        uint32_t size = s < MODEL_KINDS ? 1 + random_u32(&r) % 20 : s % 4 ? 20 + random_u32(&r) % 100 : random_u32(&r) % 600;
        Model m = model_make((ModelKind)(s % MODEL_KINDS), size, &r);
        KellerAccel *accel[2 * STRUCTURES];
        for (int a = 0; a < 2 * STRUCTURES; a++) accel[a] = nexthit_accel(&m.in, structures[a % STRUCTURES], a < STRUCTURES ? 0 : 0.5);
        Hit *room = malloc((m.in.triangle_count + 1) * sizeof *room);
        for (uint32_t i = 0; i < each; i++) {
            KellerCone cone = model_cone(&m, i, &r);
            Query q = query(&m, i, &cone, cones, &r);
            /* spatial splits now and then: they take twice the time */
            hits += nexthit_check(it, accel, i % 8 ? STRUCTURES : 2 * STRUCTURES, &m.in, &q, room, &r);
        }
        free(room);
        for (int a = 0; a < 2 * STRUCTURES; a++) keller_accel_free(accel[a]);
        model_free(&m);
    }
    keller_nexthit_free(it);
    assert_true(hits > all / 5);
}

/* Many iterators over one accelerator take turns, some left early and begun again with other rays. */
static void interleaved(void **state)
{
    (void)state;
    enum { MANY = 24, TURNS = 60000 };
    Random r = {5};
    Model m = model_make(MODEL_SPREAD, 500, &r);
    KellerAccel *accel[STRUCTURES];
    KellerNexthit *it[MANY];
    Query q[MANY];
    KellerCone cone[MANY];
    Hit *hits[MANY];
    uint32_t count[MANY], at[MANY], started = 0, steps = 0;
    for (int a = 0; a < STRUCTURES; a++) accel[a] = nexthit_accel(&m.in, structures[a], 0);
    for (int k = 0; k < MANY; k++) {
        assert_int_equal(keller_nexthit_new(&it[k], NULL), KELLER_OK);
        hits[k] = malloc(m.in.triangle_count * sizeof *hits[k]);
        count[k] = at[k] = 0;
    }
    for (uint32_t turn = 0; turn < TURNS; turn++) {
        uint32_t k = random_u32(&r) % MANY;
        if (at[k] >= count[k] || random_u32(&r) % 50 == 0) {
            if (count[k] > 0 && at[k] == count[k]) nexthit_expect(it[k], &q[k], "interleaved", NULL, 0, true);
            cone[k] = model_cone(&m, turn, &r);
            q[k] = query(&m, turn, &cone[k], started % 4 == 0, &r);
            KellerNexthitOptions o = {.method = started % METHODS, .batch = 3};
            count[k] = naive_hits(&m.in, &q[k], o.order, hits[k]);
            at[k] = 0;
            nexthit_begin(it[k], accel[started++ % STRUCTURES], &q[k], &o);
        } else {
            nexthit_expect(it[k], &q[k], "interleaved", hits[k] + at[k]++, 1, false);
            steps++;
        }
    }
    assert_true(steps > 10000 && started > 1000);
    for (int k = 0; k < MANY; k++) {
        keller_nexthit_free(it[k]);
        free(hits[k]);
    }
    for (int a = 0; a < STRUCTURES; a++) keller_accel_free(accel[a]);
    model_free(&m);
}

/* What cannot be resumed says so; the other methods run over it, and each triangle still comes once. */
static void not_resumed(void **state)
{
    const char *name = *state;
    Random r = {9};
    Model m = model_make(MODEL_GRID, 400, &r);
    KellerAccel *accel = nexthit_accel(&m.in, name, 0);
    KellerNexthit *it;
    KellerError error;
    KellerRayHit ray;
    Hit *room = malloc(m.in.triangle_count * sizeof *room);
    assert_int_equal(keller_nexthit_new(&it, NULL), KELLER_OK);
    for (uint32_t i = 0; i < 300; i++) {
        KellerCone cone = model_cone(&m, i, &r);
        Query q = query(&m, i, &cone, i % 2, &r);
        uint32_t n = naive_hits(&m.in, &q, KELLER_NEXTHIT_BY_TRIANGLE, room);
        for (int method = 1; method < METHODS; method++) nexthit_same(it, accel, &q, method, 0, room, n, &r);
    }
    assert_int_equal(keller_nexthit_ray(it, accel, v3(0, 0, 0), v3(0, 0, 1), (KellerRange){0, 1}, NULL, &error), KELLER_BAD_INPUT);
    assert_non_null(strstr(error.message, name));
    assert_int_equal(keller_nexthit_next_ray(it, &ray, &error), KELLER_OK);
    assert_int_equal(ray.triangle, KELLER_NONE);
    free(room);
    keller_nexthit_free(it);
    keller_accel_free(accel);
    model_free(&m);
}

/* Keys that are no hit's: KELLER_NONE stands behind all triangles at its distance. Work is counted. */
static void keys(void **state)
{
    (void)state;
    const KellerVec3 v[] = {{-1, -1, 2}, {3, -1, 2}, {-1, 3, 2}};
    const uint32_t t[4][3] = {{0, 1, 2}, {0, 1, 2}, {0, 1, 2}, {2, 1, 0}};
    KellerAccelInput in = {.triangle_count = 4, .vertices = v, .triangles = t};
    KellerAccel *accel = nexthit_accel(&in, "bvh8", 0);
    KellerNexthit *it;
    assert_int_equal(keller_nexthit_new(&it, NULL), KELLER_OK);
    Query q = {v3(0, 0, 0), v3(0, 0, 1), NULL, {0, INFINITY}};
    const Hit all[4] = {{2, 2, 0, false}, {2, 2, 1, false}, {2, 2, 2, false}, {2, 2, 3, false}};
    /* the first three leave (their normal is +z), the last one enters */
    const KellerNexthitKey behind = {2, KELLER_NONE}, nearer = {1, KELLER_NONE}, second = {2, 1}, farther = {3, 0};
    for (int method = 0; method < METHODS; method++) {
        KellerAccelWork work = {0};
        KellerNexthitOptions o = {.method = (KellerNexthitMethod)method, .work = &work};
        o.after = &behind;
        nexthit_begin(it, accel, &q, &o);
        nexthit_expect(it, &q, "behind", all, 0, true);
        o.after = &nearer;
        o.before = &behind;
        nexthit_begin(it, accel, &q, &o);
        nexthit_expect(it, &q, "nearer, behind", all, 4, true);
        o.after = &second;
        o.before = &farther;
        nexthit_begin(it, accel, &q, &o);
        nexthit_expect(it, &q, "second, farther", all + 2, 2, true);
        assert_true(work.triangles >= 8 && work.nodes >= 1);
    }
    keller_nexthit_free(it);
    keller_nexthit_free(NULL);
    keller_accel_free(accel);
}

int main(void)
{
    static bool rays = false, cones = true;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_prestate(same_as_naive, &rays),
        cmocka_unit_test_prestate(same_as_naive, &cones),
        cmocka_unit_test(interleaved),
        cmocka_unit_test_prestate(not_resumed, "kdtree"),
        cmocka_unit_test_prestate(not_resumed, "dacrt"),
        cmocka_unit_test(keys),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
