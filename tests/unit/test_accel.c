/* The accelerator against the naive loop over all triangles and wedges. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

#include "keller/accel.h"
#include "keller/ray.h"
#include "random.h"

enum { MOST = 3000 };

typedef struct {
    KellerScene scene;
    KellerVec3 vertices[3 * MOST];
    uint32_t triangles[MOST][3];
    KellerWedge wedges[MOST];
} Fixture;

typedef enum { SPREAD, COPLANAR, ONE_POINT, HUGE_AND_TINY, FAR_AWAY, DEGENERATE, EMPTY, KINDS } Kind;

static void fill(Fixture *f, Kind kind, Random *r)
{
    memset(&f->scene, 0, sizeof f->scene);
    uint32_t n = kind == EMPTY ? 0 : 1 + random_u32(r) % (MOST - 1);
    for (uint32_t i = 0; i < n; i++) {
        KellerVec3 middle = random_point(r, 10);
        double size = pow(10, random_in(r, -3, 0.5));
        if (kind == ONE_POINT) middle = v3(1, 2, 3), size = 0;
        if (kind == HUGE_AND_TINY) size = i == 0 ? 1e4 : 1e-4;
        if (kind == FAR_AWAY) middle = v3_add(middle, v3(1e5, -1e5, 0));
        for (int k = 0; k < 3; k++) {
            KellerVec3 p = v3_add(middle, random_point(r, size));
            if (kind == COPLANAR) p.z = 0;
            if (kind == DEGENERATE && k == 2) p = f->vertices[3 * i];
            f->vertices[3 * i + (uint32_t)k] = p;
            f->triangles[i][k] = 3 * i + (uint32_t)k;
        }
        KellerVec3 along = v3_sub(f->vertices[3 * i + 1], f->vertices[3 * i]);
        f->wedges[i] = (KellerWedge){.vertex = {3 * i, 3 * i + 1}, .origin = f->vertices[3 * i],
                                     .direction = v3_unit(along), .length = v3_norm(along)};
    }
    f->scene.vertex_count = 3 * n;
    f->scene.vertices = f->vertices;
    f->scene.triangle_count = f->scene.wedge_count = n;
    f->scene.triangles = f->triangles;
    f->scene.wedges = f->wedges;
}

typedef struct {
    uint8_t seen[MOST];
    KellerRange range[MOST];
} Seen;

static double see(void *context, uint32_t id, KellerRange range)
{
    Seen *s = context;
    s->seen[id]++;
    s->range[id] = range;
    return INFINITY;
}

static bool see_segment(void *context, uint32_t id)
{
    ((Seen *)context)->seen[id]++;
    return false;
}

/* The distance of the segments p-q and a-b, by alternating projections with a dense start: slow and obvious enough. */
static double segment_distance(KellerVec3 p, KellerVec3 q, KellerVec3 a, KellerVec3 b)
{
    double best = INFINITY;
    for (int k = 0; k <= 8; k++) {
        double s = k / 8.0, t = 0;
        for (int step = 0; step < 40; step++) {
            KellerVec3 x = v3_madd(p, v3_sub(q, p), s), ab = v3_sub(b, a), pq = v3_sub(q, p);
            t = v3_dot(ab, ab) > 0 ? fmax(0, fmin(1, v3_dot(v3_sub(x, a), ab) / v3_dot(ab, ab))) : 0;
            KellerVec3 y = v3_madd(a, ab, t);
            s = v3_dot(pq, pq) > 0 ? fmax(0, fmin(1, v3_dot(v3_sub(y, p), pq) / v3_dot(pq, pq))) : 0;
        }
        best = fmin(best, v3_distance(v3_madd(p, v3_sub(q, p), s), v3_madd(a, v3_sub(b, a), t)));
    }
    return best;
}

/* Does the segment come within `margin` of triangle i: of an edge, or through it? */
static bool comes_near(KellerVec3 a, KellerVec3 b, double margin, const Fixture *f, uint32_t i)
{
    const KellerVec3 v[3] = {f->vertices[f->triangles[i][0]], f->vertices[f->triangles[i][1]],
                             f->vertices[f->triangles[i][2]]};
    /* most lie beside: the segment's line passes the triangle's sphere */
    KellerVec3 c = v3_scale(v3_add(v[0], v3_add(v[1], v[2])), 1.0 / 3), ab = v3_sub(b, a);
    double radius = fmax(v3_distance(c, v[0]), fmax(v3_distance(c, v[1]), v3_distance(c, v[2])));
    if (v3_norm(v3_cross(v3_sub(c, a), ab)) > (radius + margin + 1e-6) * v3_norm(ab)) return false;
    for (int k = 0; k < 3; k++)
        if (segment_distance(v[k], v[(k + 1) % 3], a, b) <= margin) return true;
    if (v3_distance(a, b) == 0) return false;
    KellerRay ray = keller_ray(a, v3_sub(b, a));
    return keller_ray_triangle(&ray, v[0], v[1], v[2], (KellerRange){0, 1}, NULL, NULL);
}

static void same_as_naive(void **state)
{
    (void)state;
    Fixture *f = malloc(sizeof *f);
    Seen *seen = malloc(sizeof *seen), *wedges = malloc(sizeof *wedges);
    Random r = {4711};
    uint64_t hits = 0, work_total = 0, naive_total = 0;
    for (int scene = 0; scene < 70; scene++) {
        fill(f, (Kind)(scene % KINDS), &r);
        KellerAccel *accel;
        assert_int_equal(keller_accel_build("auto", &f->scene, &accel, NULL), KELLER_OK);
        KellerVec3 offset = scene % KINDS == FAR_AWAY ? v3(1e5, -1e5, 0) : v3(0, 0, 0);
        double extent = 24;
        for (uint32_t i = 0; i < 3 * f->scene.triangle_count; i++)
            extent = fmax(extent, v3_distance(f->vertices[i], offset));
        for (int q = 0; q < 30; q++) {
            KellerAccelWork work = {0};
            KellerCone cone = keller_cone_round(v3_add(offset, random_point(&r, 12)), random_unit(&r),
                                                q % 3 ? random_in(&r, 0, 0.6) : pow(10, random_in(&r, -9, -2)));
            if (q % 7 == 0) cone.tan_alpha = 0;
            if (q % 4 == 1) cone.x0 = random_in(&r, 0, 1), cone.e = random_in(&r, 1, 50);
            if (q % 5 == 2 && f->scene.triangle_count) { /* aimed exactly at a vertex */
                cone.directrix = v3_unit(v3_sub(f->vertices[0], cone.origin));
                cone.major = v3_perpendicular(cone.directrix);
                cone.minor = v3_cross(cone.directrix, cone.major);
            }
            KellerRange clip = {q % 2 ? random_in(&r, 0, 4) : 0, q % 3 == 1 ? random_in(&r, 4, 20) : INFINITY};
            memset(seen->seen, 0, sizeof seen->seen);
            memset(wedges->seen, 0, sizeof wedges->seen);
            keller_accel_cone(accel, &cone, clip, see, NULL, seen, &work);
            work_total += work.triangles;
            naive_total += f->scene.triangle_count;
            keller_accel_cone(accel, &cone, clip, NULL, see, wedges, &work);
            for (uint32_t i = 0; i < f->scene.triangle_count; i++) {
                const uint32_t *t = f->triangles[i];
                KellerRange a = keller_cone_triangle(&cone, f->vertices[t[0]], f->vertices[t[1]], f->vertices[t[2]], clip,
                                                     NULL, NULL);
                bool hit = a.near <= a.far;
                assert_int_equal(seen->seen[i], hit);
                /* what the cone contains has its range in single precision, widened */
                double slack = 8 * (double)KELLER_CONE_SLACK_FLOAT * (extent + cone.x0);
                KellerRange got = seen->range[i];
                if (hit) assert_true(got.near <= a.near && got.far >= a.far);
                if (hit) assert_true(got.near >= a.near - slack && got.far <= a.far + slack);
                hits += hit;
                const KellerWedge *w = &f->wedges[i];
                a = keller_cone_edge(&cone, f->vertices[w->vertex[0]], f->vertices[w->vertex[1]], clip, NULL, NULL);
                assert_int_equal(wedges->seen[i], a.near <= a.far);
            }
            /* segments: whatever lies within the margin must be visited, nothing twice */
            KellerVec3 a = v3_add(offset, random_point(&r, 12)), b = v3_add(offset, random_point(&r, 12));
            if (q % 4 == 0) b.x = a.x; /* in the plane of box sides */
            if (q % 8 == 0) b.y = a.y;
            double margin = q % 2 ? 0.01 : 0;
            memset(seen->seen, 0, sizeof seen->seen);
            assert_false(keller_accel_segment(accel, a, b, margin, see_segment, seen, &work));
            for (uint32_t i = 0; i < f->scene.triangle_count; i++) {
                assert_true(seen->seen[i] <= 1);
                if (!seen->seen[i]) assert_false(comes_near(a, b, margin, f, i));
            }
        }
        keller_accel_free(accel);
    }
    assert_true(hits > 50000);
    assert_true(work_total < naive_total / 2); /* it does save work */
    free(f);
    free(seen);
    free(wedges);
}

static double far_limit(void *context, uint32_t id, KellerRange range)
{
    (void)id;
    double *nearest = context;
    if (range.near < *nearest) *nearest = range.near;
    return range.near;
}

/* Shortening the query to the nearest hit so far must still find the nearest. */
static void nearest_by_shortening(void **state)
{
    (void)state;
    Fixture *f = malloc(sizeof *f);
    Random r = {12};
    for (int scene = 0; scene < 30; scene++) {
        fill(f, SPREAD, &r);
        KellerAccel *accel;
        assert_int_equal(keller_accel_build("bvh", &f->scene, &accel, NULL), KELLER_OK);
        for (int q = 0; q < 50; q++) {
            KellerAccelWork work = {0};
            KellerCone cone = keller_cone_round(random_point(&r, 12), random_unit(&r), random_in(&r, 0, 0.5));
            double nearest = INFINITY, expected = INFINITY;
            keller_accel_cone(accel, &cone, (KellerRange){0, INFINITY}, far_limit, NULL, &nearest, &work);
            for (uint32_t i = 0; i < f->scene.triangle_count; i++) {
                const uint32_t *t = f->triangles[i];
                KellerRange a = keller_cone_triangle(&cone, f->vertices[t[0]], f->vertices[t[1]], f->vertices[t[2]],
                                                     (KellerRange){0, INFINITY}, NULL, NULL);
                expected = fmin(expected, a.near);
            }
            assert_true((nearest <= expected && nearest >= expected - 1e-3) || nearest == expected);
        }
        keller_accel_free(accel);
    }
    free(f);
}

static void unknown_name(void **state)
{
    (void)state;
    KellerScene scene = {0};
    KellerAccel *accel;
    KellerError error;
    assert_int_equal(keller_accel_build("octree", &scene, &accel, &error), KELLER_BAD_INPUT);
    assert_non_null(strstr(error.message, "octree"));
    assert_null(accel);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_as_naive),
        cmocka_unit_test(nearest_by_shortening),
        cmocka_unit_test(unknown_name),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
