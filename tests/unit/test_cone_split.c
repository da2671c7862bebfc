/* Splitting a frustum: the children cover it and are as small as the smallest ellipse around a half disk allows. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>

#include "cone_long.h"
#include "random.h"

/* A point of the frustum with local section coordinates (x, y) in the unit disk. */
static Long3 point_of(const KellerCone *c, double x, double y, double z)
{
    long double R = z * (long double)c->tan_alpha + c->x0;
    Long3 p = long_madd(longer(c->origin), longer(c->major), R * x);
    return long_madd(long_madd(p, longer(c->minor), R * y / c->e), longer(c->directrix), z);
}

/* Is the point in one of the children, or in a child of one, `levels` deep? */
static bool covered(const KellerCone *c, Long3 p, int levels)
{
    if (levels == 0) return inside(c, p);
    KellerCone child[2];
    keller_cone_split(c, child);
    return covered(&child[0], p, levels - 1) || covered(&child[1], p, levels - 1);
}

static double leaves_area(const KellerCone *c, int levels)
{
    if (levels == 0) return area_of(c);
    KellerCone child[2];
    keller_cone_split(c, child);
    return leaves_area(&child[0], levels - 1) + leaves_area(&child[1], levels - 1);
}

static void children_cover(void **state)
{
    (void)state;
    Random r = {8};
    for (int i = 0; i < 30000; i++) {
        KellerCone c = keller_cone_round(random_point(&r, i % 4 ? 10 : 1e5), random_unit(&r), 0);
        int kind = i % 5;
        if (kind) c.tan_alpha = tan(kind < 3 ? pow(10, random_in(&r, -9, 0)) : random_in(&r, 0, 80) * DEGREE);
        if (kind == 4 && i % 3 == 0) c.tan_alpha = pow(10, random_in(&r, 0.5, 5)); /* to 89.9994 degrees */
        if (random_u32(&r) % 2) c.x0 = pow(10, random_in(&r, -6, 3));
        if (random_u32(&r) % 3) c.e = pow(10, random_in(&r, 0, 3));
        if (random_u32(&r) % 2) c.z_near = pow(10, random_in(&r, -3, 3));
        if (random_u32(&r) % 2) c.z_far = c.z_near + pow(10, random_in(&r, -3, 3));
        KellerCone child[2];
        keller_cone_split(&c, child);
        for (int k = 0; k < 2; k++) {
            assert_frame(&child[k]);
            assert_true((child[k].z_far == INFINITY) == (c.z_far == INFINITY));
        }
        for (int k = 0; k < 30; k++) { /* rim, middle line, and within; near and far ends, and between */
            double phi = random_in(&r, 0, 2 * M_PI), rho = k % 3 ? sqrt(random_in(&r, 0, 1)) : 1;
            double length = isfinite(c.z_far) ? c.z_far - c.z_near : 1e4;
            double t = k % 5 ? pow(random_in(&r, 0, 1), k % 4) : k % 2;
            double x = k % 7 ? rho * cos(phi) : 0, y = rho * sin(phi), z = c.z_near + t * length;
            if (k < 4) {
                x = k == 0 ? 1 : k == 1 ? -1 : 0;
                y = k == 2 ? 1 : k == 3 ? -1 : 0;
            }
            Long3 p = point_of(&c, x, y, z);
            if (!inside(&c, p)) continue; /* rounded out of it */
            /* far from the world's origin a narrow cone's point may have been rounded to the other side */
            Long3 q = local(&c, p);
            long double side = q.x / (q.z * c.tan_alpha + c.x0);
            assert_true(side > 1e-9L ? inside(&child[0], p) : side < -1e-9L ? inside(&child[1], p) : covered(&c, p, 1));
            assert_true(covered(&c, p, 3));
        }
    }
}

static void children_are_small(void **state)
{
    (void)state;
    double share = 4 / (3 * sqrt(3)); /* 0.7698: the smallest ellipse around a half disk, over the disk */
    KellerCone c = keller_cone_round(v3(0, 0, 0), v3(0, 0, 1), 1e-4);
    for (c.e = 1; c.e < 200; c.e *= 3) {
        KellerCone child[2];
        keller_cone_split(&c, child);
        for (int i = 0; i < 2; i++) {
            assert_true(fabs(area_of(&child[i]) / area_of(&c) / share - 1) < 1e-5);
            assert_true(fabs(v3_dot(child[i].directrix, c.major) - (i ? -1 : 1) * 1e-4 / 3) < 1e-10);
        }
    }
    /* at any angle the child's section by the parent's plane is that ellipse: it touches in the corners */
    for (int degrees = 1; degrees < 80; degrees += 6) {
        KellerCone child[2];
        c = keller_cone_round(v3(0, 0, 0), v3(0, 0, 1), degrees * DEGREE);
        c.e = degrees % 4;
        keller_cone_split(&c, child);
        for (int i = 0; i < 3; i++) {
            Long3 q = local(&child[0], point_of(&c, i == 0, i == 0 ? 0 : i == 1 ? 1 : -1, 1));
            assert_true(fabsl(sqrtl(q.x * q.x + q.y * q.y) / (q.z * child[0].tan_alpha) - 1) < 1e-11L);
        }
    }
    /* a cylinder: of radius 3; the child is centred at 1, semi-axes 2 and 2 sqrt(3), the longer across the split */
    c = (KellerCone){.directrix = v3(0, 0, 1), .major = v3(1, 0, 0), .minor = v3(0, 1, 0), .x0 = 3, .e = 1, .z_far = 5};
    KellerCone half[2];
    keller_cone_split(&c, half);
    assert_true(v3_distance(half[0].origin, v3(1, 0, 0)) < 1e-14 && v3_distance(half[1].origin, v3(-1, 0, 0)) < 1e-14);
    assert_true(fabs(half[0].x0 - 2 * sqrt(3)) < 1e-11 && fabs(half[0].e - sqrt(3)) < 1e-12);
    assert_true(fabs(half[0].major.y) == 1);
    assert_true(half[0].tan_alpha == 0 && half[0].directrix.z == 1 && fabs(half[0].z_far - 5) < 1e-11);
    /* a ray's halves are the ray */
    c.x0 = 0;
    keller_cone_split(&c, half);
    assert_true(half[1].x0 == 0 && half[1].tan_alpha == 0 && v3_norm(half[1].origin) == 0);
    print_message("# split: sum of the children's areas over the parent's, after 1, 2, 3, 6 levels\n");
    for (int degrees = 10; degrees <= 70; degrees += 20) {
        c = keller_cone_round(v3(0, 0, 0), v3(0, 0, 1), degrees * DEGREE);
        double sum[4];
        for (int k = 0; k < 4; k++) sum[k] = leaves_area(&c, k < 3 ? k + 1 : 6) / area_of(&c);
        print_message("# half-angle %d degrees: %.3f %.3f %.3f %.3f\n", degrees, sum[0], sum[1], sum[2], sum[3]);
        for (int k = 0; k < 3; k++) assert_true(sum[k] < pow(2 * share, k + 1) * 1.001);
    }
}

int main(void)
{
    cmocka_set_message_output(CM_OUTPUT_TAP);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(children_cover),
        cmocka_unit_test(children_are_small),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
