/* The parts of triangles and segments between two planes, for spatial splits. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "accel/sah.h"
#include "random.h"
#include "sah_boxes.h"

/* The box of a clipped triangle against points of the triangle, and the bounds against the exact crossings. */
static void clips_are_conservative(void **state)
{
    (void)state;
    Random r = {1};
    for (int i = 0; i < 20000; i++) {
        double size = pow(10, random_in(&r, -4, 4));
        KellerVec3 at = random_point(&r, i % 2 ? 1e5 : 1), p[3];
        for (int k = 0; k < 3; k++) p[k] = v3_add(at, random_point(&r, size));
        int axis = (int)(random_u32(&r) % 3);
        double x = coordinate(at, axis);
        float lower = (float)(x + random_in(&r, -size, size)), upper = (float)(x + random_in(&r, -size, size));
        if (i % 7 == 0) lower = -INFINITY;
        if (i % 11 == 0) upper = INFINITY;
        if (i % 13 == 0) lower = (float)(p[1] = v3((float)p[1].x, (float)p[1].y, (float)p[1].z), coordinate(p[1], axis));
        if (!(lower <= upper)) continue;
        AccelBox part, edge;
        sah_clip_triangle(p[0], p[1], p[2], axis, lower, upper, &part);
        sah_clip_segment(p[0], p[1], axis, lower, upper, &edge);
        assert_true(holds(&part, &edge));
        AccelBox whole = box_of(p), points = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
        for (int j = 0; j < 60; j++) {
            double u = j < 3 ? j == 1 : random_in(&r, 0, 1), v = j < 3 ? j == 2 : j < 30 ? 0 : (1 - u) * random_in(&r, 0, 1);
            KellerVec3 q = v3_madd(v3_madd(p[0], v3_sub(p[1], p[0]), u), v3_sub(p[2], p[0]), v);
            if (j < 3) q = p[j];
            /* q is rounded: keep those inside the planes by more than that */
            double away = j < 3 ? 0 : 1e-13 * (fabs(x) + size);
            if (!(coordinate(q, axis) >= (double)lower + away && coordinate(q, axis) <= (double)upper - away)) continue;
            for (int k = 0; k < 3; k++) {
                double slack = j < 3 ? 0 : 1e-13 * (fabs(coordinate(at, k)) + size);
                assert_true((double)part.lower[k] <= coordinate(q, k) + slack);
                assert_true((double)part.upper[k] >= coordinate(q, k) - slack);
                points.lower[k] = fminf(points.lower[k], (float)coordinate(q, k));
                points.upper[k] = fmaxf(points.upper[k], (float)coordinate(q, k));
            }
        }
        if (is_empty(&part)) assert_true(is_empty(&points));
        else assert_true(part.lower[axis] >= lower && part.upper[axis] <= upper);
        for (int k = 0; k < 3 && !is_empty(&part); k++) { /* not wider than the triangle by more than rounding */
            assert_true(part.lower[k] >= whole.lower[k] - 1e-6f * fabsf(whole.lower[k]) - 1e-9f * (float)size);
            assert_true(part.upper[k] <= whole.upper[k] + 1e-6f * fabsf(whole.upper[k]) + 1e-9f * (float)size);
        }
    }
}

/* A long segment crosses the plane almost on the axis: its height there is far below the rounding of the ends. The exact
 * crossing, in long double (error 2^-62 of the ends), is in the box. */
static void clips_allow_for_cancellation(void **state)
{
    (void)state;
    Random r = {2};
    for (int i = 0; i < 100000; i++) {
        double slope = random_in(&r, -3, 3), s = random_in(&r, 1e3, 1e5), t = random_in(&r, 1e3, 1e5);
        float plane = (float)random_in(&r, -1, 1);
        KellerVec3 a = v3((double)plane - s, -slope * s, 0), b = v3((double)plane + t, slope * t, 0);
        long double along = ((long double)(double)plane - a.x) / ((long double)b.x - a.x);
        long double y = a.y + ((long double)b.y - a.y) * along, error = 0x1p-62L * (fabs(a.y) + fabs(b.y));
        AccelBox left, right;
        sah_clip_segment(a, b, 0, -INFINITY, plane, &left);
        sah_clip_segment(a, b, 0, plane, INFINITY, &right);
        if (slope < 0) {
            AccelBox other = left;
            left = right;
            right = other;
        }
        assert_true((long double)(double)left.upper[1] >= y - error);
        assert_true((long double)(double)right.lower[1] <= y + error);
        assert_true(left.upper[1] < 1e-9f && right.lower[1] > -1e-9f);
    }
}

/* By hand: the triangle (0,0,0) (4,0,0) (0,4,8) between x = 1 and x = 2 has the corners (1,0,0) (2,0,0) (2,2,4) (1,3,6). */
static void a_clip_by_hand(void **state)
{
    (void)state;
    AccelBox part;
    const float lower[3] = {1, 0, 0}, upper[3] = {2, 3, 6};
    sah_clip_triangle(v3(0, 0, 0), v3(4, 0, 0), v3(0, 4, 8), 0, 1, 2, &part);
    for (int k = 0; k < 3; k++) {
        assert_float_equal(part.lower[k], lower[k], 1e-5);
        assert_float_equal(part.upper[k], upper[k], 1e-5);
    }
    sah_clip_triangle(v3(0, 0, 0), v3(4, 0, 0), v3(0, 4, 8), 0, 5, 6, &part);
    assert_true(is_empty(&part));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(clips_are_conservative),
        cmocka_unit_test(clips_allow_for_cancellation),
        cmocka_unit_test(a_clip_by_hand),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
