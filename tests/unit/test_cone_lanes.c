/* Eight boxes or vertices at a time: never a miss, by sampled points of the boxes in long double; distances; empty
 * lanes and slack; how tight the boxes' test is; and the same bits from the scalar build. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "../cases.h"
#include "cone_scalar.h"
#include "keller/cone.h"
#include "random.h"

static const KellerRange ALL = {0, INFINITY};

static double spread(Random *r, double low, double high) { return pow(10, random_in(r, log10(low), log10(high))); }

static KellerCone random_cone(Random *r, double offset)
{
    static const double degrees[] = {0, 1e-7, 1e-5, 0.1, 0.5, 5, 15, 30, 45, 75};
    KellerVec3 d = random_unit(r);
    if (random_u32(r) % 4 == 0) d = v3(random_u32(r) % 2 ? 1 : -1, 0, 0); /* an axis of the world */
    KellerCone c = keller_cone_round(random_point(r, offset), d, degrees[random_u32(r) % 10] * M_PI / 180);
    double turn = random_in(r, 0, 7);
    KellerVec3 major = v3_madd(v3_scale(c.major, cos(turn)), c.minor, sin(turn));
    c.minor = v3_cross(d, major);
    c.major = major;
    if (random_u32(r) % 2) c.e = spread(r, 1, 2300);
    if (random_u32(r) % 2) c.x0 = spread(r, 1e-3, 1e3);
    if (random_u32(r) % 3 == 0) c.z_near = spread(r, 1e-2, 1e2);
    if (random_u32(r) % 3 == 0) c.z_far = c.z_near + spread(r, 1e-2, 1e3);
    return c;
}

/* z and the depth inside (eq. 2; negative: outside) relative to the cone; also of z from the clip planes */
typedef struct {
    long double z, depth;
} Place;

static Place place_of(const KellerCone *c, KellerVec3 p)
{
    long double q[3] = {(long double)p.x - c->origin.x, (long double)p.y - c->origin.y, (long double)p.z - c->origin.z};
    long double x = q[0] * c->major.x + q[1] * c->major.y + q[2] * c->major.z;
    long double y = q[0] * c->minor.x + q[1] * c->minor.y + q[2] * c->minor.z;
    long double z = q[0] * c->directrix.x + q[1] * c->directrix.y + q[2] * c->directrix.z;
    long double radial = z * c->tan_alpha + c->x0 - sqrtl(x * x + c->e * c->e * y * y);
    return (Place){z, fminl(radial, fminl(z - c->z_near, c->z_far - z))};
}

/* A point inside the frustum or on its envelope, up to rounding. */
static KellerVec3 point_inside(Random *r, const KellerCone *c)
{
    double far = c->z_far < INFINITY ? c->z_far : c->z_near + 1e3, z = random_in(r, c->z_near, far);
    if (random_u32(r) % 4 == 0) z = c->z_near;
    double R = z * c->tan_alpha + c->x0, a = random_in(r, 0, 7), s = random_u32(r) % 2 ? 1 : random_in(r, 0, 1);
    KellerVec3 p = v3_madd(c->origin, c->directrix, z);
    return v3_madd(v3_madd(p, c->major, s * R * cos(a)), c->minor, s * R * sin(a) / c->e);
}

static void set_lane(KellerBox8 *b, int i, KellerVec3 lower, KellerVec3 upper)
{
    const double l[3] = {lower.x, lower.y, lower.z}, u[3] = {upper.x, upper.y, upper.z};
    for (int k = 0; k < 3; k++) {
        b->lower[k][i] = (float)l[k];
        b->upper[k][i] = (float)u[k];
    }
}

static KellerVec3 lane_of(float p[3][8], int i) { return v3((double)p[0][i], (double)p[1][i], (double)p[2][i]); }

/* A box beside or around p, often with p on its surface, sometimes flat. */
static void random_box(Random *r, KellerBox8 *b, int i, KellerVec3 p)
{
    double size = spread(r, 1e-3, 1e2), low[3], high[3];
    for (int k = 0; k < 3; k++) {
        low[k] = -random_in(r, 0, size);
        high[k] = random_in(r, 0, size);
        if (random_u32(r) % 2) *(random_u32(r) % 2 ? &low[k] : &high[k]) = 0;
        if (random_u32(r) % 16 == 0) low[k] = high[k] = 0;
    }
    set_lane(b, i, v3_add(p, v3(low[0], low[1], low[2])), v3_add(p, v3(high[0], high[1], high[2])));
}

static double size_of(const KellerBox8 *b)
{
    double size = 0;
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 8; i++) size = fmax(size, fmax(fabs((double)b->lower[k][i]), fabs((double)b->upper[k][i])));
    return size;
}

/* A point of the box near p, in it exactly; corners often. */
static KellerVec3 point_of_box(Random *r, KellerBox8 *b, int i, KellerVec3 p)
{
    double x[3] = {p.x, p.y, p.z}, nudge = random_u32(r) % 2 ? 0 : 1e-6;
    for (int k = 0; k < 3; k++) {
        double low = (double)b->lower[k][i], high = (double)b->upper[k][i];
        x[k] = fmin(high, fmax(low, x[k] + nudge * random_in(r, -1, 1)));
        if (random_u32(r) % 8 == 0) x[k] = random_u32(r) % 2 ? low : high;
    }
    return v3(x[0], x[1], x[2]);
}

static void boxes_never_missed(void **state)
{
    (void)state;
    Random r = {11};
    const int cases = (int)cases_of(300000);
    long inside = 0, met = 0, lanes = 0;
    for (int n = 0; n < cases; n++) {
        KellerCone c = random_cone(&r, random_u32(&r) % 4 ? 10 : 1e5);
        KellerRange clip = random_u32(&r) % 2 ? ALL : (KellerRange){spread(&r, 1e-2, 1e2), spread(&r, 1, 1e3)};
        KellerBox8 b;
        KellerVec3 p[8];
        for (int i = 0; i < 8; i++) random_box(&r, &b, i, p[i] = point_inside(&r, &c));
        KellerConeLanes l = keller_cone_lanes(&c, clip, size_of(&b));
        _Alignas(32) float distance[8];
        uint32_t bits = keller_cone_meets_box8(&l, &b, distance);
        assert_int_equal(bits & ~0xffu, 0);
        for (int i = 0; i < 8; i++) {
            lanes++;
            met += (bits >> i & 1) != 0;
            for (int k = 0; k < 4; k++) {
                Place at = place_of(&c, point_of_box(&r, &b, i, p[i]));
                if (at.depth < 0 || at.z < clip.near || at.z > clip.far) continue;
                inside++;
                if (!(bits >> i & 1)) fail_msg("case %d lane %d: missed, inside by %Lg", n, i, at.depth);
                if ((long double)distance[i] > at.z)
                    fail_msg("case %d lane %d: %g after %Lg", n, i, (double)distance[i], at.z);
            }
        }
    }
    assert_true(inside > cases / 3 * 5);  /* the test is about something */
    assert_true(met < lanes);
}

/* Boxes on either side of the place where they stop to meet the cone, within little more than the slack. */
static void boxes_rejected(void **state)
{
    (void)state;
    /* a ray along +x beside the box [10, 11] x [y, y + 1] x [-1, 1]: met for y <= 0 */
    KellerCone ray = keller_cone_round(v3(0, 0, 0), v3(1, 0, 0), 0);
    /* a cylinder of radius 2 meets it up to y = 2; a 45 degree cone at x = 11 up to y = 11; with far = 10.5 up to 10.5
     * */
    KellerCone cylinder = ray, cone = keller_cone_round(v3(0, 0, 0), v3(1, 0, 0), M_PI / 4), cut = cone;
    cylinder.x0 = 2;
    cut.z_far = 10.5;
    const KellerCone *all[] = {&ray, &cylinder, &cone, &cut};
    const double edge[] = {0, 2, 11, 10.5};
    for (int j = 0; j < 4; j++) {
        KellerConeLanes l = keller_cone_lanes(all[j], ALL, 12);
        double slack = 2.5 * (double)KELLER_CONE_SLACK_FLOAT * (2 * 12 + 2);
        KellerBox8 b;
        for (int i = 0; i < 8; i++) {
            double y = edge[j] + (i < 4 ? -1 : 1) * slack * (1 + i % 4);
            set_lane(&b, i, v3(10, y, -1), v3(11, y + 1, 1));
        }
        _Alignas(32) float distance[8];
        assert_int_equal(keller_cone_meets_box8(&l, &b, distance), 0x0f);
        for (int i = 0; i < 4; i++) assert_true((double)distance[i] > 9.99 && (double)distance[i] < 11.01);
    }
    /* behind the apex, before near, beyond far */
    cone.z_near = 1;
    cone.z_far = 5;
    KellerConeLanes l = keller_cone_lanes(&cone, (KellerRange){2, 4}, 12);
    KellerBox8 b;
    static const double x[8][2] = {{-3, -2}, {0.5, 0.9}, {1.2, 1.9}, {1.2, 2.1}, {3, 3}, {3.9, 6}, {4.1, 6}, {6, 7}};
    for (int i = 0; i < 8; i++) set_lane(&b, i, v3(x[i][0], -0.1, -0.1), v3(x[i][1], 0.1, 0.1));
    _Alignas(32) float distance[8];
    assert_int_equal(keller_cone_meets_box8(&l, &b, distance), 0x38);
    assert_true((double)distance[3] > 1.99 && (double)distance[5] > 3.89);
    for (int i = 0; i < 8; i += 2) /* empty, with and without infinities */
        set_lane(&b, i, v3(INFINITY, INFINITY, INFINITY), v3(-INFINITY, -INFINITY, -INFINITY));
    set_lane(&b, 3, v3(3, -0.1, -0.1), v3(2, 0.1, 0.1));
    assert_int_equal(keller_cone_meets_box8(&l, &b, distance), 0x20);
}

/* The paper's listing 5 in double precision: each box enlarged by the cone's radius at its farthest corner. */
static bool listing_5(const KellerCone *c, KellerVec3 lower, KellerVec3 upper)
{
    const double o[3] = {c->origin.x, c->origin.y, c->origin.z};
    const double d[3] = {c->directrix.x, c->directrix.y, c->directrix.z};
    const double l[3] = {lower.x, lower.y, lower.z}, u[3] = {upper.x, upper.y, upper.z};
    double z = 0, near = 0, far = INFINITY;
    for (int k = 0; k < 3; k++) z += d[k] * ((d[k] < 0 ? l : u)[k] - o[k]);
    double s = z * c->tan_alpha + c->x0;
    for (int k = 0; k < 3; k++) {
        double a = (l[k] - s - o[k]) / d[k], b = (u[k] + s - o[k]) / d[k];
        near = fmax(near, fmin(a, b));
        far = fmin(far, fmax(a, b));
    }
    return near <= far;
}

/* Boxes close to the cone's envelope, of 1 cm to 2 m along 10 m of it, some within the slack. The test must be tighter
 * than listing 5, all the more the wider the cone. Truth is the exact test. */
static void boxes_tight(void **state)
{
    (void)state;
    static const double degrees[] = {1e-5, 0.1, 0.5, 5, 15, 30};
    Random r = {12};
    print_message("# false positives among 32000 boxes: half-angle, here, listing 5, double precision\n");
    for (int d = 0; d < 6; d++) {
        int false_positive[3] = {0};
        for (int n = 0; n < 4000; n++) {
            KellerCone c = keller_cone_round(random_point(&r, 10), random_unit(&r), degrees[d] * M_PI / 180);
            KellerBox8 b;
            for (int i = 0; i < 8; i++) {
                double z = random_in(&r, 0, 10), size = spread(&r, 0.01, 2);
                KellerVec3 p = v3_madd(v3_madd(c.origin, c.directrix, z), random_unit(&r), z * c.tan_alpha + size);
                KellerVec3 h = random_point(&r, size);
                h = v3(fabs(h.x), fabs(h.y), fabs(h.z));
                set_lane(&b, i, v3_sub(p, h), v3_add(p, h));
            }
            KellerConeLanes l = keller_cone_lanes(&c, ALL, size_of(&b));
            _Alignas(32) float distance[8];
            uint32_t bits = keller_cone_meets_box8(&l, &b, distance);
            for (int i = 0; i < 8; i++) {
                KellerVec3 lower = lane_of(b.lower, i), upper = lane_of(b.upper, i);
                KellerRange truth = keller_cone_box(&c, lower, upper, ALL, NULL, NULL);
                if (truth.near <= truth.far) continue;
                false_positive[0] += (bits >> i & 1) != 0;
                false_positive[1] += listing_5(&c, lower, upper);
                false_positive[2] += keller_cone_meets_box(&c, lower, upper, ALL);
            }
        }
        print_message("# %5g deg %6d %6d %6d\n", degrees[d], false_positive[0], false_positive[1], false_positive[2]);
        assert_true(false_positive[0] <= 32000 / 16);
        assert_true(false_positive[0] <= false_positive[1] / (d < 1 ? 1 : d < 3 ? 2 : 10) + 200);
    }
}

static void vertices_and_corners(void **state)
{
    (void)state;
    Random r = {13};
    const int cases = (int)cases_of(200000);
    long inside = 0, outside = 0;
    for (int n = 0; n < cases; n++) {
        KellerCone c = random_cone(&r, random_u32(&r) % 4 ? 10 : 1e5);
        KellerVertex8 v[3];
        double size = 0;
        for (int j = 0; j < 3; j++)
            for (int i = 0; i < 8; i++) {
                KellerVec3 p = point_inside(&r, &c);
                if (random_u32(&r) % 2) p = v3_madd(p, random_unit(&r), spread(&r, 1e-4, 10));
                const double x[3] = {p.x, p.y, p.z};
                for (int k = 0; k < 3; k++) {
                    v[j].p[k][i] = (float)x[k];
                    size = fmax(size, fabs((double)v[j].p[k][i]));
                }
            }
        double reach = size + fmax(fabs(c.origin.x), fmax(fabs(c.origin.y), fabs(c.origin.z)));
        long double slack = (long double)KELLER_CONE_SLACK_FLOAT * ((c.e + c.tan_alpha) * reach + c.x0 + reach);
        KellerConeLanes l = keller_cone_lanes(&c, ALL, size);
        uint32_t in[3];
        for (int j = 0; j < 3; j++) {
            in[j] = keller_cone_contains_vertex8(&l, &v[j]);
            for (int i = 0; i < 8; i++) {
                Place at = place_of(&c, lane_of(v[j].p, i));
                if (at.depth >= 0) assert_true(in[j] >> i & 1);
                if (at.depth < -slack) assert_false(in[j] >> i & 1);
                inside += at.depth >= 0;
                outside += at.depth < -slack;
            }
        }
        _Alignas(32) float near[8], far[8];
        keller_cone_contained_triangle8(&l, v, near, far);
        for (int i = 0; i < 8; i++) {
            long double low = INFINITY, high = -INFINITY;
            for (int j = 0; j < 3; j++) {
                long double z = place_of(&c, lane_of(v[j].p, i)).z;
                low = fminl(low, z);
                high = fmaxl(high, z);
            }
            if (!(in[0] & in[1] & in[2] & 1u << i)) continue;
            long double most = 2 * (long double)KELLER_CONE_SLACK_FLOAT * ((1 + c.tan_alpha) * reach + c.x0);
            assert_true((long double)near[i] <= low && (long double)near[i] >= low - most);
            assert_true((long double)far[i] >= high && (long double)far[i] <= high + most);
        }
        float lower[3], upper[3];
        bool all = true, none = true;
        for (int k = 0; k < 3; k++) {
            lower[k] = fminf(v[0].p[k][0], v[1].p[k][0]);
            upper[k] = fmaxf(v[0].p[k][0], v[1].p[k][0]);
        }
        for (int i = 0; i < 8; i++) {
            KellerVec3 p = v3((double)(i & 1 ? upper : lower)[0], (double)(i & 2 ? upper : lower)[1],
                              (double)(i & 4 ? upper : lower)[2]);
            long double depth = place_of(&c, p).depth;
            all &= depth >= 0;
            none &= depth >= -slack;
        }
        bool corners = keller_cone_contains_corners(&l, lower, upper);
        if (all) assert_true(corners);
        if (!none) assert_false(corners);
    }
    assert_true(inside > cases / 2 && outside > cases / 2);
}

static void same(const void *a, const void *b, size_t size, const char *what, int n)
{
    if (memcmp(a, b, size) != 0) fail_msg("%s, case %d: the scalar build differs", what, n);
}

/* The scalar build gives the same bits. Points of an empty range are left as they were. */
static void scalar_build(void **state)
{
    (void)state;
    Random r = {14};
    const int cases = (int)cases_of(125000); /* eight calls each */
    for (int n = 0; n < cases; n++) {
        KellerCone c = random_cone(&r, random_u32(&r) % 4 ? 10 : 1e5);
        KellerRange clip = random_u32(&r) % 2 ? ALL : (KellerRange){spread(&r, 1e-2, 1e2), spread(&r, 1, 1e3)};
        KellerBox8 b;
        KellerVec3 v[3];
        KellerVertex8 w[3];
        for (int i = 0; i < 8; i++) random_box(&r, &b, i, point_inside(&r, &c));
        for (int j = 0; j < 3; j++) {
            v[j] = v3_madd(point_inside(&r, &c), random_unit(&r), spread(&r, 1e-4, 1e2));
            memcpy(w[j].p, j == 1 ? b.upper : b.lower, sizeof w[j].p);
        }
        KellerConeLanes l = keller_cone_lanes(&c, clip, size_of(&b));
        KellerConeLanes l2 = keller_scalar_cone_lanes(&c, clip, size_of(&b));
        same(&l, &l2, sizeof l, "lanes", n);
        _Alignas(32) float out[2][2][8];
        uint32_t bits[2];
        bits[0] = keller_cone_meets_box8(&l, &b, out[0][0]);
        bits[1] = keller_scalar_cone_meets_box8(&l, &b, out[1][0]);
        same(&bits[0], &bits[1], sizeof bits[0], "meets_box8", n);
        same(out[0][0], out[1][0], sizeof out[0][0], "distance", n);
        assert_int_equal(keller_cone_contains_vertex8(&l, w), keller_scalar_cone_contains_vertex8(&l, w));
        const float lower[3] = {b.lower[0][0], b.lower[1][0], b.lower[2][0]};
        const float upper[3] = {b.upper[0][0], b.upper[1][0], b.upper[2][0]};
        assert_int_equal(keller_cone_contains_corners(&l, lower, upper),
                         keller_scalar_cone_contains_corners(&l, lower, upper));
        keller_cone_contained_triangle8(&l, w, out[0][0], out[0][1]);
        keller_scalar_cone_contained_triangle8(&l, w, out[1][0], out[1][1]);
        same(out[0], out[1], sizeof out[0], "contained_triangle8", n);
        KellerRange range[2];
        KellerVec3 at[2][2] = {{{0}}};
        range[0] = keller_cone_triangle(&c, v[0], v[1], v[2], clip, &at[0][0], &at[0][1]);
        range[1] = keller_scalar_cone_triangle(&c, v[0], v[1], v[2], clip, &at[1][0], &at[1][1]);
        same(&range[0], &range[1], sizeof range[0], "triangle", n);
        same(at[0], at[1], sizeof at[0], "triangle's points", n);
        range[0] = keller_cone_edge(&c, v[0], v[1], clip, &at[0][0], &at[0][1]);
        range[1] = keller_scalar_cone_edge(&c, v[0], v[1], clip, &at[1][0], &at[1][1]);
        same(&range[0], &range[1], sizeof range[0], "edge", n);
        same(at[0], at[1], sizeof at[0], "edge's points", n);
        KellerVec3 low = lane_of(b.lower, 1), high = lane_of(b.upper, 1);
        range[0] = keller_cone_box(&c, low, high, clip, &at[0][0], &at[0][1]);
        range[1] = keller_scalar_cone_box(&c, low, high, clip, &at[1][0], &at[1][1]);
        same(&range[0], &range[1], sizeof range[0], "box", n);
        same(at[0], at[1], sizeof at[0], "box's points", n);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(boxes_never_missed), cmocka_unit_test(boxes_rejected),       cmocka_unit_test(boxes_tight),
        cmocka_unit_test(vertices_and_corners), cmocka_unit_test(scalar_build),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests_name("cone_lanes", tests, NULL, NULL);
}
