/* The elliptic conic frustum: definition, constructors, and "never misses" by sampling points of the primitives. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>

#include "keller/cone.h"
#include "random.h"

static const KellerRange ALL = {0, INFINITY};

/* equation 2, straight from the paper, in long double; margin > 0: inside by that much */
static long double depth_inside(const KellerCone *c, KellerVec3 p)
{
    long double q[3] = {(long double)p.x - c->origin.x, (long double)p.y - c->origin.y, (long double)p.z - c->origin.z};
    long double x = q[0] * c->major.x + q[1] * c->major.y + q[2] * c->major.z;
    long double y = q[0] * c->minor.x + q[1] * c->minor.y + q[2] * c->minor.z;
    long double z = q[0] * c->directrix.x + q[1] * c->directrix.y + q[2] * c->directrix.z;
    long double R = z * c->tan_alpha + c->x0, radial = R - sqrtl(x * x + c->e * c->e * y * y);
    long double near = z - c->z_near, far = c->z_far - z;
    return fminl(radial, fminl(near, far));
}

static double z_of(const KellerCone *c, KellerVec3 p) { return v3_dot(v3_sub(p, c->origin), c->directrix); }

static KellerCone random_cone(Random *r)
{
    KellerCone c = keller_cone_round(random_point(r, 10), random_unit(r), 0);
    switch (random_u32(r) % 4) {
    case 0: break;
    case 1: c.tan_alpha = tan(pow(10, random_in(r, -8, -0.1))); break;
    default: c.tan_alpha = tan(random_in(r, 0, 0.8)); break;
    }
    if (random_u32(r) % 2) c.x0 = pow(10, random_in(r, -3, 1));
    if (random_u32(r) % 2) c.e = pow(10, random_in(r, 0, 3));
    if (random_u32(r) % 3 == 0) c.z_near = random_in(r, 0, 5);
    if (random_u32(r) % 3 == 0) c.z_far = c.z_near + random_in(r, 0, 20);
    return c;
}

static void contains_by_definition(void **state)
{
    (void)state;
    KellerCone c = keller_cone_round(v3(0, 0, 0), v3(0, 0, 1), atan(0.5));
    c.x0 = 1;
    c.major = v3(1, 0, 0);
    c.minor = v3(0, 1, 0);
    c.e = 2;
    c.z_far = 10;
    /* at z = 2: R = 2 0.5 + 1 = 2, semi-axes 2 and 1 */
    assert_true(keller_cone_contains(&c, v3(1.999, 0, 2)));
    assert_false(keller_cone_contains(&c, v3(2.001, 0, 2)));
    assert_true(keller_cone_contains(&c, v3(0, 0.999, 2)));
    assert_false(keller_cone_contains(&c, v3(0, 1.001, 2)));
    assert_false(keller_cone_contains(&c, v3(0, 0, -0.001)));
    assert_false(keller_cone_contains(&c, v3(0, 0, 10.001)));
}

static void plane_range(void **state)
{
    (void)state;
    /* 45 degree cone along z against the plane x = 3: nearest point at z = 3 */
    KellerCone c = keller_cone_round(v3(0, 0, 0), v3(0, 0, 1), M_PI / 4);
    KellerVec3 nearest;
    KellerRange r = keller_cone_plane(&c, v3(1, 0, 0), 3, ALL, &nearest, NULL);
    assert_true(fabs(r.near - 3) < 1e-12 && r.far == INFINITY);
    assert_true(v3_distance(nearest, v3(3, 0, 3)) < 1e-12);
    /* z + x = 4: x = -z tan gives no end upwards: z = 4 - x, x in [-z, z]: z from 2 to infinity */
    r = keller_cone_plane(&c, v3(M_SQRT1_2, 0, M_SQRT1_2), 4 * M_SQRT1_2, ALL, NULL, NULL);
    assert_true(fabs(r.near - 2) < 1e-12 && r.far > 1e12);
    /* a ray: the plane z = 7 exactly there; behind: nothing */
    c.tan_alpha = 0;
    r = keller_cone_plane(&c, v3(0, 0, 1), 7, ALL, NULL, NULL);
    assert_true(fabs(r.near - 7) < 1e-12 && fabs(r.far - 7) < 1e-12);
    r = keller_cone_plane(&c, v3(0, 0, 1), -7, ALL, NULL, NULL);
    assert_true(r.near > r.far);
}

static void edge_range(void **state)
{
    (void)state;
    KellerCone c = keller_cone_round(v3(0, 0, 0), v3(0, 0, 1), M_PI / 4);
    /* the line y = 0, z = 2 + x from x = -10 to 10: in the cone where |x| <= 2 + x, i.e. x >= -1: z from 1 to 12 */
    KellerVec3 nearest, farthest;
    KellerRange r = keller_cone_edge(&c, v3(-10, 0, -8), v3(10, 0, 12), ALL, &nearest, &farthest);
    assert_true(fabs(r.near - 1) < 1e-9 && fabs(r.far - 12) < 1e-9);
    assert_true(v3_distance(nearest, v3(-1, 0, 1)) < 1e-9 && v3_distance(farthest, v3(10, 0, 12)) < 1e-9);
    r = keller_cone_edge(&c, v3(-10, 0, -8), v3(10, 0, 12), (KellerRange){3, 5}, &nearest, &farthest);
    assert_true(fabs(r.near - 3) < 1e-9 && fabs(r.far - 5) < 1e-9);
    /* the same edge behind the apex */
    r = keller_cone_edge(&c, v3(-1, 0, -5), v3(1, 0, -5), ALL, NULL, NULL);
    assert_true(r.near > r.far);
    /* passing beside */
    r = keller_cone_edge(&c, v3(-10, 2.001, 2), v3(10, 2.001, 2), ALL, NULL, NULL);
    assert_true(r.near > r.far);
}

/* Points of random edges and triangles that lie inside the frustum must lie in the reported range, and boxes that hold
 * such points must be reported. */
static void never_misses(void **state)
{
    (void)state;
    Random r = {20261};
    uint64_t hits = 0, wasted = 0;
    for (int i = 0; i < 200000; i++) {
        KellerCone c = random_cone(&r);
        double size = pow(10, random_in(&r, -3, 2));
        /* aim half of them at the axis so that thin cones hit something */
        KellerVec3 middle = random_u32(&r) % 2 ? random_point(&r, 20) : v3_madd(c.origin, c.directrix, random_in(&r, -1, 15));
        KellerVec3 v[3];
        for (int k = 0; k < 3; k++) v[k] = v3_add(middle, random_point(&r, size));
        if (random_u32(&r) % 8 == 0) v[2] = v3_madd(v[0], v3_sub(v[1], v[0]), random_in(&r, -1, 2)); /* degenerate */
        if (random_u32(&r) % 8 == 0) v[0] = c.origin;
        KellerRange edge = keller_cone_edge(&c, v[0], v[1], ALL, NULL, NULL);
        KellerRange triangle = keller_cone_triangle(&c, v[0], v[1], v[2], ALL, NULL, NULL);
        KellerVec3 lo = v3(fmin(v[0].x, fmin(v[1].x, v[2].x)), fmin(v[0].y, fmin(v[1].y, v[2].y)),
                           fmin(v[0].z, fmin(v[1].z, v[2].z)));
        KellerVec3 hi = v3(fmax(v[0].x, fmax(v[1].x, v[2].x)), fmax(v[0].y, fmax(v[1].y, v[2].y)),
                           fmax(v[0].z, fmax(v[1].z, v[2].z)));
        bool box = keller_cone_meets_box(&c, lo, hi, ALL), any = false;
        assert_true(triangle.near > triangle.far || box);
        assert_true(edge.near > edge.far || (triangle.near <= edge.near + 1e-9 && triangle.far >= edge.far - 1e-9));
        for (int k = 0; k < 40; k++) {
            double a = random_in(&r, 0, 1), b = random_in(&r, 0, 1);
            if (k == 0) { /* the axis through the triangle's plane: the one point of it a ray can meet */
                KellerVec3 e1 = v3_sub(v[1], v[0]), e2 = v3_sub(v[2], v[0]), n = v3_cross(e1, e2);
                double t = v3_dot(n, v3_sub(v[0], c.origin)) / v3_dot(n, c.directrix);
                KellerVec3 d = v3_sub(v3_madd(c.origin, c.directrix, t), v[0]);
                a = v3_dot(v3_cross(d, e2), n) / v3_dot(n, n);
                b = v3_dot(v3_cross(e1, d), n) / v3_dot(n, n);
                if (!(a >= 0 && b >= 0 && a + b <= 1)) continue;
            } else if (a + b > 1) {
                a = 1 - a;
                b = 1 - b;
            }
            KellerVec3 p = v3_madd(v3_madd(v[0], v3_sub(v[1], v[0]), a), v3_sub(v[2], v[0]), b);
            if (depth_inside(&c, p) > 0) {
                double z = z_of(&c, p);
                any = true;
                assert_true(z >= triangle.near - 1e-12 && z <= triangle.far + 1e-12);
            }
            p = v3_madd(v[0], v3_sub(v[1], v[0]), a);
            if (depth_inside(&c, p) > 0) {
                double z = z_of(&c, p);
                assert_true(z >= edge.near - 1e-12 && z <= edge.far + 1e-12);
            }
        }
        hits += any;
        wasted += !any && triangle.near <= triangle.far;
    }
    print_message("# %llu triangles hit, %llu more reported\n", (unsigned long long)hits, (unsigned long long)wasted);
    assert_true(hits > 20000); /* the test does test something */
}

/* Ends of the range are attained: a point of the triangle within a hair of them is inside the slightly widened cone. */
static void ranges_are_tight(void **state)
{
    (void)state;
    Random r = {7};
    for (int i = 0; i < 50000; i++) {
        KellerCone c = random_cone(&r);
        if (c.e > 30) continue;
        KellerVec3 middle = v3_madd(c.origin, c.directrix, random_in(&r, 0, 15)), v[3], p[2];
        for (int k = 0; k < 3; k++) v[k] = v3_add(middle, random_point(&r, 5));
        KellerRange t = keller_cone_triangle(&c, v[0], v[1], v[2], ALL, &p[0], &p[1]);
        if (t.near > t.far) continue;
        KellerCone wide = c;
        wide.x0 += 1e-6;
        wide.z_near -= 1e-6;
        wide.z_far += 1e-6;
        for (int k = 0; k < 2; k++) {
            assert_true(depth_inside(&wide, p[k]) > 0);
            assert_true(fabs(z_of(&c, p[k]) - (k ? t.far : t.near)) < 1e-6);
        }
    }
}

static void constructors_contain(void **state)
{
    (void)state;
    Random r = {99};
    int built = 0;
    for (int i = 0; i < 20000; i++) {
        KellerVec3 source[4], direction[4], along = random_unit(&r);
        uint32_t m = 1 + random_u32(&r) % 4, n = 1 + random_u32(&r) % 4;
        double spread = pow(10, random_in(&r, -4, 0)), size = pow(10, random_in(&r, -2, 2));
        for (uint32_t k = 0; k < m; k++) source[k] = v3_add(random_point(&r, size), v3(100, 0, 0));
        for (uint32_t k = 0; k < n; k++) direction[k] = v3_add(along, random_point(&r, spread));
        KellerCone c;
        double start;
        if (!keller_cone_fan(m, source, n, direction, &c, &start)) continue;
        built++;
        assert_true(c.e >= 1 && c.x0 >= 0 && c.tan_alpha > 0);
        /* the points below are rounded at 100 m from the world's origin, the test at the cone's own */
        KellerCone wide = c;
        wide.x0 += 1e-11 * c.e;
        assert_true(fabs(v3_dot(v3_cross(c.major, c.minor), c.directrix) - 1) < 1e-12);
        for (int k = 0; k < 20; k++) {
            double w[4], sum = 0;
            KellerVec3 p = v3(0, 0, 0), d = v3(0, 0, 0);
            for (uint32_t j = 0; j < m; j++) sum += w[j] = random_in(&r, 0, 1);
            for (uint32_t j = 0; j < m; j++) p = v3_madd(p, source[j], w[j] / sum);
            for (uint32_t j = 0; j < n; j++) d = v3_madd(d, direction[j], random_in(&r, 0, 1));
            assert_true(z_of(&c, p) <= start + 1e-9);
            assert_true(keller_cone_contains(&wide, v3_madd(p, d, pow(10, random_in(&r, -3, 3)))));
        }
    }
    assert_true(built > 10000);
}

/* Several sources in one place are held as one is. */
static void fan_of_coincident_sources(void **state)
{
    (void)state;
    Random r = {5};
    for (int i = 0; i < 2000; i++) {
        KellerVec3 p = random_point(&r, 1), source[4] = {p, p, p, p}, d = v3_scale(random_unit(&r), 0.01);
        KellerCone c;
        assert_true(keller_cone_fan(2 + random_u32(&r) % 3, source, 1, &d, &c, NULL));
        assert_true(keller_cone_contains(&c, p));
        assert_true(depth_inside(&c, p) >= 0);
    }
}

static void mirror_is_a_mirror(void **state)
{
    (void)state;
    Random r = {3};
    for (int i = 0; i < 2000; i++) {
        KellerCone c = random_cone(&r);
        KellerVec3 n = random_unit(&r);
        double offset = random_in(&r, -5, 5);
        KellerCone m = keller_cone_mirror(&c, n, offset);
        assert_true(fabs(v3_dot(v3_cross(m.major, m.minor), m.directrix) - 1) < 1e-12);
        KellerVec3 p = random_point(&r, 20), q = v3_mirror_point(p, n, offset);
        if (fabsl(depth_inside(&c, p)) > 1e-9L)
            assert_int_equal(depth_inside(&c, p) > 0, depth_inside(&m, q) > 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(contains_by_definition), cmocka_unit_test(plane_range),    cmocka_unit_test(edge_range),
        cmocka_unit_test(never_misses),           cmocka_unit_test(ranges_are_tight), cmocka_unit_test(constructors_contain),
        cmocka_unit_test(fan_of_coincident_sources), cmocka_unit_test(mirror_is_a_mirror),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
