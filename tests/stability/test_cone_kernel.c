/* The cone kernel against the oracle: over random and adversarial cases of every test, no false negative, no range
 * that leaves out a part of the true one, Boolean forms that agree -- and a judge that would notice. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>

#include "../cases.h"
#include "../unit/random.h"
#include "cone_check.h"

#define SEED 3
#define QUAD_EVERY 8192

static const KellerRange ALL = {0, INFINITY};

static uint64_t cases(void) { return cases_of(1000000); } /* for each test */

/* ---- the oracle -------------------------------------------------------------------------------------------------- */

static void expect_truth(ConeTruth t, double near, double far)
{
    assert_true(t.met);
    assert_true(fabsl(t.near - near) < 1e-15L && (t.far == far || fabsl(t.far - far) < 1e-15L));
}

/* A cone of 45 degrees, e = 2, along +z from the origin: x^2 + 4 y^2 <= z^2. All answers by hand. */
static void oracle_by_hand(void **state)
{
    (void)state;
    KellerCone c = {
        .directrix = {0, 0, 1}, .major = {1, 0, 0}, .minor = {0, 1, 0}, .tan_alpha = 1, .e = 2, .z_far = INFINITY};
    for (int i = 0; i < 2; i++) {
        const ConeOracle *o = i ? &cone_oracle_quad : &cone_oracle_long;
        expect_truth(o->plane(&c, v3(1, 0, 0), 3, ALL, 0), 3, INFINITY);
        expect_truth(o->plane(&c, v3(0, 1, 0), 3, ALL, 0), 6, INFINITY);
        expect_truth(o->plane(&c, v3(0, 0, 1), 3, ALL, 0), 3, 3);
        assert_false(o->plane(&c, v3(0, 0, 1), -3, ALL, 0).met);
        /* z + 2 y = 4: on the envelope at y = -z/2 never, at y = z/2 where z = 2 */
        expect_truth(o->plane(&c, v3(0, 2, 1), 4, ALL, 0), 2, INFINITY);
        /* y = 1: |x| <= sqrt(z^2 - 4); along x = 0 from z = 2 */
        expect_truth(o->line(&c, v3(0, 1, 7), v3(0, 0, -3), ALL, 0), 2, INFINITY);
        expect_truth(o->line(&c, v3(-9, 1, 2.5), v3(4, 0, 0), ALL, 0), 2.5, 2.5);
        /* a generator */
        expect_truth(o->line(&c, v3(5, 0, 5), v3(1, 0, 1), ALL, 0), 0, INFINITY);
        assert_false(o->line(&c, v3(5, 1e-9, 5), v3(1, 0, 1), ALL, 0).met);
        expect_truth(o->edge(&c, v3(0, 1, 0), v3(0, 1, 6), ALL, 0), 2, 6);
        expect_truth(o->edge(&c, v3(0, 1, 0), v3(0, 1, 6), (KellerRange){3, 4}, 0), 3, 4);
        assert_false(o->edge(&c, v3(0, 1, -6), v3(0, 1, 1.75), ALL, 0).met);
        assert_false(o->edge(&c, v3(0, 0, -6), v3(0, 1, -7), (KellerRange){-INFINITY, INFINITY}, 0).met);
        /* the plane z = 4 + x/2 meets the envelope at x = -8/3, z = 8/3 and x = 8, z = 8, here well inside the
         * triangle */
        expect_truth(o->triangle(&c, v3(-64, -64, -28), v3(64, -64, 36), v3(0, 128, 4), ALL, 0), 8 / 3.0, 8);
        /* the corner of a box just on the envelope, and a box around the apex */
        expect_truth(o->box(&c, v3(4, -1, 0), v3(9, 1, 4), ALL, 0), 4, 4);
        assert_false(o->box(&c, v3(4.0000001, -1, 0), v3(9, 1, 4), ALL, 0).met);
        expect_truth(o->box(&c, v3(-1, -1, -1), v3(1, 1, 0.5), ALL, 0), 0, 0.5);
        assert_true(o->contains(&c, v3(3, 0, 3), 0) && o->contains(&c, v3(0, -1.5, 3), 0));
        assert_false(o->contains(&c, v3(3.0000000001, 0, 3), 0) || o->contains(&c, v3(0, 0, -1e-20), 0));
        assert_true(fabsl(o->outside(&c, v3(0, 4, 2)) - 3) < 1e-17L);
    }
    c.tan_alpha = 0; /* a ray */
    expect_truth(cone_oracle_quad.triangle(&c, v3(-1, -1, 2), v3(1, -1, 2), v3(0, 1, 4), ALL, 0), 3, 3);
    c.x0 = 1; /* an elliptic cylinder, half as wide in y: y from -1/2 to 1/2 */
    expect_truth(cone_oracle_quad.triangle(&c, v3(-9, -9, -6), v3(9, -9, -6), v3(0, 9, 12), ALL, 0), 2.5, 3.5);
}

/* Points of a primitive that are inside lie in its range, and the answers in 64 and in 113 bits are alike. */
static void oracle_against_samples(void **state)
{
    (void)state;
    Random r = {77};
    uint64_t points = 0, count = 200 + cases() / 500;
    for (uint64_t i = 0; i < count; i++) {
        ConeKind kind = CONE_EDGE + i % 3;
        ConeCase c = cone_case(kind, SEED, i, -1, -1, -1);
        const KellerVec3 *v = c.v;
        ConeTruth t[3];
        for (int k = 0; k < 3; k++) { /* exact, in long double, grown */
            const ConeOracle *o = k ? &cone_oracle_long : &cone_oracle_quad;
            double grow = k == 2 ? CONE_ORACLE_GROW : 0;
            t[k] = kind == CONE_EDGE       ? o->edge(&c.cone, v[0], v[1], c.clip, grow)
                   : kind == CONE_TRIANGLE ? o->triangle(&c.cone, v[0], v[1], v[2], c.clip, grow)
                                           : o->box(&c.cone, v[0], v[1], c.clip, grow);
        }
        double size = c.cone.x0 + v3_norm(c.cone.origin) + v3_distance(v[0], c.cone.origin) +
                      v3_distance(v[1], c.cone.origin) + v3_distance(v[2], c.cone.origin);
        assert_true(!t[0].met ||
                    (t[2].met && t[2].near <= t[0].near + size * 0x1p-56L && t[2].far >= t[0].far - size * 0x1p-56L));
        for (int k = 0; k < 30; k++) {
            double a[3] = {random_in(&r, 0, 1), random_in(&r, 0, 1), random_in(&r, 0, 1)};
            if (k % 5 == 0) a[k % 3] = k % 2;
            if (k % 7 == 0) a[0] *= a[0] * a[0];
            if (a[0] + a[1] > 1 && kind == CONE_TRIANGLE) a[0] = 1 - a[0], a[1] = 1 - a[1];
            KellerVec3 p = v3_madd(v[0], v3_sub(v[1], v[0]), a[0]);
            if (kind == CONE_TRIANGLE) p = v3_madd(p, v3_sub(v[2], v[0]), a[1]);
            if (kind == CONE_BOX)
                p = v3(v[0].x + a[0] * (v[1].x - v[0].x), v[0].y + a[1] * (v[1].y - v[0].y),
                       v[0].z + a[2] * (v[1].z - v[0].z));
            /* inside by more than the rounding of p, and of the stretching */
            double margin = size * 0x1p-48;
            KellerCone narrow = c.cone;
            narrow.x0 -= margin * narrow.e;
            narrow.z_near = fmax(narrow.z_near, c.clip.near) + margin;
            narrow.z_far = fmin(narrow.z_far, c.clip.far) - margin;
            if (!cone_oracle_long.contains(&narrow, p, 0)) continue;
            long double z = cone_oracle_long.z(&c.cone, p);
            points++;
            assert_true(t[0].met && z >= t[0].near - margin && z <= t[0].far + margin);
            assert_true(t[1].met && z >= t[1].near - margin && z <= t[1].far + margin);
        }
    }
    assert_true(points > count);
}

/* ---- the judge --------------------------------------------------------------------------------------------------- */

/* The edge (1, -1, 1) to (1, 1, 1) touches the cone of 45 degrees along z in the one point (1, 0, 1). */
static void judge_notices(void **state)
{
    (void)state;
    ConeCase c = {
        .cone =
            {.directrix = {0, 0, 1}, .major = {1, 0, 0}, .minor = {0, 1, 0}, .tan_alpha = 1, .e = 1, .z_far = INFINITY},
        .clip = {0, INFINITY},
        .v = {{1, -1, 1}, {1, 1, 1}, {1, 0, 3}}};
    const ConeAnswer good = {{1, 1}, {1, 0, 1}, {1, 0, 1}, true};
    for (int quad = 0; quad < 2; quad++) {
        ConeTally t = cone_tally_zero;
        cone_judge(CONE_EDGE, &c, &good, quad, &t);
        assert_true(t.cases == 1 && t.met == 1 && cone_tally_wrong(&t) == 0 && t.plain_error == 0 &&
                    t.point_error == 0);
        ConeAnswer bad = good;
        bad.range = (KellerRange){INFINITY, -INFINITY};
        cone_judge(CONE_EDGE, &c, &bad, quad, &t);
        assert_true(t.missed == 1 && t.disagree == 1 && t.too_short == 0);
        bad.range = (KellerRange){1 + 0x1p-52, 1 + 0x1p-52};
        cone_judge(CONE_EDGE, &c, &bad, quad, &t);
        assert_true(t.missed == 1 && t.too_short == 1);
        bad.range = (KellerRange){1 - 0x1p-53, 1 - 0x1p-53};
        cone_judge(CONE_EDGE, &c, &bad, quad, &t);
        assert_true(t.missed == 1 && t.too_short == 2 && t.disagree == 1);
        bad = good;
        bad.yes = false;
        cone_judge(CONE_EDGE, &c, &bad, quad, &t);
        assert_true(t.yes_missed == 1 && t.disagree == 2 && t.plain_error < 1e-6);
        assert_true(t.point_error == 0);
        /* too long by 2^-20, a point off by 2^-21, where the scale is |(1, 1, 1)| */
        bad = good;
        bad.range.near -= 0x1p-20;
        bad.farthest.x += 0x1p-21;
        cone_judge(CONE_EDGE, &c, &bad, quad, &t);
        assert_true(fabs(t.plain_error - 8 / sqrt(3)) < 1e-6 && fabs(t.range_error - 8 / sqrt(3)) < 1e-3);
        assert_true(fabs(t.point_error - 4 / sqrt(3)) < 1e-6);
        /* the triangle behind the edge: from z = 1 to 3 */
        ConeTally triangle = cone_tally_zero;
        cone_judge(CONE_TRIANGLE, &c, &good, quad, &triangle);
        assert_true(triangle.too_short == 1);
        c.v[0].x = c.v[1].x = c.v[2].x = 3.5;
        ConeTally off = cone_tally_zero;
        cone_judge(CONE_EDGE, &c, &good, quad, &off);
        assert_true(off.met == 0 && off.false_positive == 1 && off.yes_false == 1 && cone_tally_wrong(&off) == 0);
        c.v[0].x = c.v[1].x = c.v[2].x = 1;
    }
}

/* The same test without a slack is caught within a few cases: the cases are hard enough. */
static void no_slack_is_caught(void **state)
{
    (void)state;
    ConeTally t = cone_tally_zero;
    for (uint64_t i = 0; i < 2000; i++) {
        ConeCase c = cone_case(CONE_CONTAINS, SEED, i, -1, -1, CONE_ON_ENVELOPE);
        KellerVec3 q = v3_sub(c.v[0], c.cone.origin);
        double x = v3_dot(q, c.cone.major), y = v3_dot(q, c.cone.minor) * c.cone.e, z = v3_dot(q, c.cone.directrix);
        double R = z * c.cone.tan_alpha + c.cone.x0;
        ConeAnswer a = {.yes = R >= 0 && x * x + y * y <= R * R && z >= c.cone.z_near && z <= c.cone.z_far};
        cone_judge(CONE_CONTAINS, &c, &a, false, &t);
    }
    assert_true(t.missed > 0 && t.false_positive > 0);
}

/* ---- the kernel -------------------------------------------------------------------------------------------------- */

static void report(ConeKind kind, const ConeTally *t)
{
    printf("# %s: %llu missed, %llu ranges too short, Boolean: %llu missed, %llu disagree, %llu scalar differs; case "
           "%llu\n",
           cone_kind_names[kind], (unsigned long long)t->missed, (unsigned long long)t->too_short,
           (unsigned long long)t->yes_missed, (unsigned long long)t->disagree, (unsigned long long)t->scalar_differs,
           (unsigned long long)t->first_wrong);
    if (t->first_wrong == UINT64_MAX) return;
    ConeCase c = kind < CONE_BOX8 ? cone_case(kind, SEED, t->first_wrong, -1, -1, -1)
                                  : cone_case8(kind, SEED, t->first_wrong, -1, -1, -1).one;
    cone_case_print(kind, &c);
}

static void kernel(void **state)
{
    ConeKind kind = *(const ConeKind *)*state;
    ConeTally rows[CONE_ROWS], all = cone_tally_zero;
    cone_check_all(kind, SEED, kind < CONE_BOX8 ? cases() : cases() / 8, 2, QUAD_EVERY, rows);
    for (int i = 0; i < CONE_ROWS; i++) {
        assert_true(rows[i].cases > 0 || cases() < 10000);
        cone_tally_add(&all, &rows[i]);
    }
    if (cone_tally_wrong(&all)) report(kind, &all);
    assert_true(cone_tally_wrong(&all) == 0);
    /* cases that all miss, or all hit, would show nothing */
    assert_true(all.met * 20 > all.cases && all.met * 10 < all.cases * 9);
}

int main(void)
{
    static ConeKind kinds[CONE_KINDS];
    struct CMUnitTest tests[4 + CONE_KINDS] = {cmocka_unit_test(oracle_by_hand),
                                               cmocka_unit_test(oracle_against_samples),
                                               cmocka_unit_test(judge_notices), cmocka_unit_test(no_slack_is_caught)};
    for (int i = 0; i < CONE_KINDS; i++) {
        kinds[i] = (ConeKind)i;
        tests[4 + i] = (struct CMUnitTest){.name = cone_kind_names[i], .test_func = kernel, .initial_state = &kinds[i]};
    }
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
