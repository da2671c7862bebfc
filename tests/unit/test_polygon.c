/* Cutting polygons into triangles. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "io/polygon.h"

static KellerPolygonScratch scratch;
static uint32_t identity[20000], triangles[20000][3];

static double area2(KellerVec3 a, KellerVec3 b, KellerVec3 c) { return v3_norm(v3_cross(v3_sub(b, a), v3_sub(c, a))); }

/* Cuts and checks: triangles turn as the polygon does and are not degenerate; each edge of the polygon belongs to one
 * triangle, each other edge to two; the areas sum up to the polygon's. Such a set of triangles covers a simple polygon once. */
static void check(const KellerVec3 *points, size_t count, double area, bool expect_simple)
{
    bool simple;
    for (uint32_t i = 0; i < count; i++) identity[i] = i;
    assert_int_equal(keller_polygon_cut(points, identity, count, triangles, &simple, &scratch, NULL), KELLER_OK);
    assert_int_equal(simple, expect_simple);
    KellerVec3 normal = v3(0, 0, 0);
    for (size_t i = 0; i < count; i++) normal = v3_add(normal, v3_cross(points[i], points[(i + 1) % count]));
    double sum = 0;
    signed char *balance = calloc(count * count, 1);
    for (size_t t = 0; t < count - 2; t++) {
        KellerVec3 p[3];
        for (int k = 0; k < 3; k++) {
            uint32_t a = triangles[t][k], b = triangles[t][(k + 1) % 3];
            assert_true(a < count);
            p[k] = points[a];
            balance[a * count + b]++;
            balance[b * count + a]--;
        }
        KellerVec3 n = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
        if (expect_simple) assert_true(v3_dot(n, normal) > 0);
        sum += area2(p[0], p[1], p[2]) / 2;
    }
    for (size_t i = 0; i < count; i++)
        for (size_t j = 0; j < count; j++)
            assert_int_equal(balance[i * count + j], j == (i + 1) % count ? 1 : i == (j + 1) % count ? -1 : 0);
    free(balance);
    if (expect_simple) assert_true(fabs(sum - area) <= 1e-12 * area);
}

/* A polygon of the plane, laid into space in several ways, from each corner on and in both senses. */
static void check_all_ways(const double (*xy)[2], size_t count, double area)
{
    KellerVec3 points[64];
    assert_true(count <= 64);
    for (size_t start = 0; start < count; start++)
        for (int way = 0; way < 8; way++) {
            for (size_t i = 0; i < count; i++) {
                const double *p = xy[(start + (way & 1 ? count - i : i)) % count];
                switch (way / 2) {
                case 0: points[i] = v3(p[0], p[1], 3); break;
                case 1: points[i] = v3(p[1], 3, p[0]); break;
                case 2: points[i] = v3(-3, p[0], p[1]); break;
                /* In a slanted plane with the exact unit vectors (2, 2, -1)/3 and (-1, 2, 2)/3: times 3, so areas times 9. */
                default: points[i] = v3(2 * p[0] - p[1], 2 * p[0] + 2 * p[1], -p[0] + 2 * p[1]); break;
                }
            }
            check(points, count, way / 2 == 3 ? 9 * area : area, true);
        }
}

static void shapes(void **state)
{
    (void)state;
    static const double square[][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    check_all_ways(square, 4, 1);
    static const double arrow[][2] = {{0, 0}, {4, -4}, {1, 0}, {4, 4}}; /* two triangles with base 1 and height 4 */
    check_all_ways(arrow, 4, 4);
    static const double ell[][2] = {{0, 0}, {3, 0}, {3, 1}, {1, 1}, {1, 2}, {0, 2}}; /* 3 + 1 */
    check_all_ways(ell, 6, 4);
    static const double comb[][2] = {{0, 0}, {7, 0}, {7, 5}, {6, 5}, {6, 1}, {5, 1}, {5, 5}, {4, 5}, {4, 1}, {3, 1}, {3, 5}, {2, 5},
                                     {2, 1}, {1, 1}, {1, 5}, {0, 5}}; /* a bar of 7 and 4 teeth of 4 */
    check_all_ways(comb, 16, 23);
    static const double spiral[][2] = {{0, 0}, {6, 0}, {6, 6}, {1, 6}, {1, 2}, {4, 2}, {4, 4}, {3, 4}, {3, 3}, {2, 3}, {2, 5}, {5, 5},
                                       {5, 1}, {0, 1}};
    /* Shoelace: along x in y = 0..6 the pieces are 6*1 (y 0..1), right column (5..6)x(1..6): 5, top (1..5)x(5..6): 4,
     * left (1..2)x(2..5): 3, bottom (2..4)x(2..3): 2, right (3..4)x(3..4): 1. */
    check_all_ways(spiral, 14, 21);
}

/* Collinear corners, as where a neighbour's corner lies on an edge: they stay corners of triangles with an area. */
static void collinear(void **state)
{
    (void)state;
    static const double one[][2] = {{0, 0}, {1, 0}, {2, 0}, {0, 2}};
    check_all_ways(one, 4, 2);
    static const double many[][2] = {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {3, 1}, {3, 2}, {3, 3}, {2, 3}, {1, 3}, {0, 3}, {0, 2}, {0, 1}};
    check_all_ways(many, 12, 9);
    static const double triangle[][2] = {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {2, 1}, {1, 2}, {0, 3}, {0, 2}, {0, 1}};
    check_all_ways(triangle, 9, 4.5);
}

/* A square ring: the outer square and the hole, joined by a bridge that is passed twice. 16 - 4 = 12. */
static void hole(void **state)
{
    (void)state;
    static const double ring[][2] = {{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}, {1, 1}, {1, 3}, {3, 3}, {3, 1}, {1, 1}};
    KellerVec3 points[10];
    bool simple;
    double sum = 0;
    for (uint32_t i = 0; i < 10; i++) points[i] = v3(ring[i][0], ring[i][1], 0), identity[i] = i;
    assert_int_equal(keller_polygon_cut(points, identity, 10, triangles, &simple, &scratch, NULL), KELLER_OK);
    assert_true(simple);
    for (int t = 0; t < 8; t++) {
        KellerVec3 a = points[triangles[t][0]], b = points[triangles[t][1]], c = points[triangles[t][2]];
        double area = v3_cross(v3_sub(b, a), v3_sub(c, a)).z / 2;
        assert_true(area > 0);
        sum += area;
        /* None covers the hole: the centre of each lies outside of it. */
        KellerVec3 m = v3_scale(v3_add(a, v3_add(b, c)), 1.0 / 3);
        assert_false(m.x > 1 && m.x < 3 && m.y > 1 && m.y < 3);
    }
    assert_true(sum == 12);
}

/* Corners that are collinear but for rounding: no triangle may consist of them alone, since its normal would be noise. So
 * each of the 8 triangles has the one corner that is elsewhere. A fan from corner 0 would begin with 0, 1, 2. */
static void no_slivers(void **state)
{
    (void)state;
    KellerVec3 points[10];
    for (int i = 0; i <= 8; i++) points[i] = v3(i, i & 1 ? 1e-8 : 0, 0);
    points[9] = v3(4, 4, 0);
    check(points, 10, 16 - 4e-8, true); /* the triangle 8 * 4 / 2 less four notches of base 2 and height 1e-8 */
    for (int t = 0; t < 8; t++) {
        const uint32_t *c = triangles[t];
        assert_true(c[0] == 9 || c[1] == 9 || c[2] == 9);
    }
}

/* What is not simple is cut all the same, and said. */
static void not_simple(void **state)
{
    (void)state;
    KellerVec3 bow[] = {{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}};
    check(bow, 4, 0, false);
    KellerVec3 point[] = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
    check(point, 5, 0, false);
    KellerVec3 line[] = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
    check(line, 4, 0, false);
    KellerVec3 uneven[] = {{0, 0, 0}, {3, 3, 0}, {3, 0, 0}, {0, 1, 0}};
    check(uneven, 4, 0, false);
    KellerVec3 star[5]; /* a pentagram turns twice */
    for (int i = 0; i < 5; i++) star[i] = v3(cos(4 * M_PI * i / 5), sin(4 * M_PI * i / 5), 0);
    bool simple;
    for (uint32_t i = 0; i < 5; i++) identity[i] = i;
    assert_int_equal(keller_polygon_cut(star, identity, 5, triangles, &simple, &scratch, NULL), KELLER_OK);
    assert_false(simple);
}

/* Random star-shaped polygons far from the origin, and the largest one allowed. */
static void random_stars(void **state)
{
    (void)state;
    uint64_t seed = 7;
    static KellerVec3 points[KELLER_POLYGON_MAX_CORNERS];
    for (int round = 0; round < 200; round++) {
        size_t count = 4 + (size_t)(round % 60);
        double area = 0;
        for (size_t i = 0; i < count; i++) {
            seed = seed * 6364136223846793005u + 1442695040888963407u;
            double r = 1 + 9 * (double)(seed >> 40) / 16777216, a = 2 * M_PI * (double)i / (double)count;
            points[i] = v3(floor(r * cos(a) * 4096) / 4096 + 691000, floor(r * sin(a) * 4096) / 4096 + 5335000, 519);
        }
        for (size_t i = 0; i < count; i++) { /* exact: multiples of 2^-12 relative to the first corner */
            KellerVec3 p = v3_sub(points[i], points[0]), q = v3_sub(points[(i + 1) % count], points[0]);
            area += (p.x * q.y - p.y * q.x) / 2;
        }
        check(points, count, area, true);
    }
    for (size_t i = 0; i < KELLER_POLYGON_MAX_CORNERS; i++) {
        double a = 2 * M_PI * (double)i / KELLER_POLYGON_MAX_CORNERS, r = i & 1 ? 1 : 2;
        points[i] = v3(r * cos(a), r * sin(a), 0);
        identity[i] = (uint32_t)i;
    }
    bool simple;
    assert_int_equal(keller_polygon_cut(points, identity, KELLER_POLYGON_MAX_CORNERS, triangles, &simple, &scratch, NULL), KELLER_OK);
    assert_true(simple);
}

static int release(void **state)
{
    (void)state;
    keller_polygon_free(&scratch);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(shapes),     cmocka_unit_test(collinear),  cmocka_unit_test(hole),
                                       cmocka_unit_test(no_slivers), cmocka_unit_test(not_simple), cmocka_unit_test(random_stars)};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, release);
}
