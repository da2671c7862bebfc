/* The iterator over hits where others lose or repeat some: thousands of coplanar copies, media that touch, nested shells, rays in
 * the planes and along the edges of triangles, hits at 0 and far away. Always beside the naive loop. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <cmocka.h>

#include "../cases.h"
#include "nexthit_check.h"

enum { MOST = 1 << 15 };

/* A model to add triangles to. */
typedef struct {
    KellerVec3 vertices[3 * MOST];
    uint32_t triangles[MOST][3];
    KellerAccelInput in;
} Pile;

static Pile *pile_new(void)
{
    Pile *p = calloc(1, sizeof *p);
    assert_non_null(p);
    p->in.vertices = p->vertices;
    p->in.triangles = (const uint32_t (*)[3])p->triangles;
    return p;
}

static void add(Pile *p, KellerVec3 a, KellerVec3 b, KellerVec3 c)
{
    uint32_t n = p->in.triangle_count++;
    assert_true(n < MOST);
    p->vertices[3 * n] = a, p->vertices[3 * n + 1] = b, p->vertices[3 * n + 2] = c;
    for (uint32_t k = 0; k < 3; k++) p->triangles[n][k] = 3 * n + k;
}

static void add_quad(Pile *p, KellerVec3 a, KellerVec3 b, KellerVec3 c, KellerVec3 d)
{
    add(p, a, b, c);
    add(p, a, c, d);
}

/* A cuboid whose triangles run counter-clockwise seen from outside. */
static void add_box(Pile *p, KellerVec3 l, KellerVec3 u)
{
    add_quad(p, v3(l.x, l.y, l.z), v3(l.x, u.y, l.z), v3(u.x, u.y, l.z), v3(u.x, l.y, l.z));
    add_quad(p, v3(l.x, l.y, u.z), v3(u.x, l.y, u.z), v3(u.x, u.y, u.z), v3(l.x, u.y, u.z));
    add_quad(p, v3(l.x, l.y, l.z), v3(u.x, l.y, l.z), v3(u.x, l.y, u.z), v3(l.x, l.y, u.z));
    add_quad(p, v3(l.x, u.y, l.z), v3(l.x, u.y, u.z), v3(u.x, u.y, u.z), v3(u.x, u.y, l.z));
    add_quad(p, v3(l.x, l.y, l.z), v3(l.x, l.y, u.z), v3(l.x, u.y, u.z), v3(l.x, u.y, l.z));
    add_quad(p, v3(u.x, l.y, l.z), v3(u.x, u.y, l.z), v3(u.x, u.y, u.z), v3(u.x, l.y, u.z));
}

typedef struct {
    Pile *pile;
    KellerAccel *accel[2 * STRUCTURES];
    int count;
    KellerNexthit *it;
    Hit *room;
    Random r;
} Bench;

/* Over the first `count` of the structures, and of them with spatial splits. */
static Bench bench(Pile *pile, int count)
{
    Bench b = {.pile = pile, .count = count, .room = malloc((pile->in.triangle_count + 1) * sizeof *b.room), .r = {42}};
    for (int a = 0; a < count; a++) b.accel[a] = nexthit_accel(&pile->in, structures[a % STRUCTURES], a < STRUCTURES ? 0 : 0.5);
    assert_int_equal(keller_nexthit_new(&b.it, NULL), KELLER_OK);
    return b;
}

static uint32_t check(Bench *b, KellerVec3 origin, KellerVec3 direction, KellerRange clip)
{
    Query q = {origin, direction, NULL, clip};
    return nexthit_check(b->it, b->accel, b->count, &b->pile->in, &q, b->room, &b->r);
}

/* The same ray as a cone of that half-angle (rad). */
static uint32_t check_cone(Bench *b, KellerVec3 origin, KellerVec3 direction, double half_angle)
{
    KellerCone cone = keller_cone_round(origin, v3_unit(direction), half_angle);
    Query q = {origin, cone.directrix, &cone, {0, INFINITY}};
    return nexthit_check(b->it, b->accel, b->count, &b->pile->in, &q, b->room, &b->r);
}

static void done(Bench *b)
{
    for (int a = 0; a < b->count; a++) keller_accel_free(b->accel[a]);
    keller_nexthit_free(b->it);
    free(b->room);
    free(b->pile);
}

static const KellerRange all = {0, INFINITY};

/* One triangle again and again, turned over at random, in a random order: every copy at one and the same t. Restarting takes the
 * square of their number, so with cones there are fewer of them, and with thousands the other methods alone. */
static void coplanar_copies(void **state)
{
    (void)state;
    const KellerVec3 v[3] = {v3(-3, -2, 5.1), v3(4, -1, 4.9), v3(0, 5, 5.3)};
    static const uint32_t numbers[] = {200, 500, 5000};
    for (int n = 0; n < 3; n++) {
        const uint32_t copies = numbers[n];
        Pile *p = pile_new();
        Random r = {1};
        for (uint32_t i = 0; i < copies; i++) {
            uint32_t k = random_u32(&r) % 3, back = random_u32(&r) % 2;
            add(p, v[k], v[(k + 1 + back) % 3], v[(k + 2 - back) % 3]);
        }
        Bench b = bench(p, STRUCTURES);
        Query q = {v3(0.1, 0.2, 0), v3(0, 0, 1), NULL, all};
        for (int order = 0; order < ORDERS && copies > 1000; order++) {
            assert_int_equal(naive_hits(&p->in, &q, (KellerNexthitOrder)order, b.room), copies);
            for (int k = 0; k < 4; k++) nexthit_same(b.it, b.accel[k % 2], &q, k / 2 * 2, order, b.room, copies, &b.r);
        }
        if (copies <= 1000) assert_int_equal(check(&b, q.origin, q.direction, all), copies);
        if (copies == 200) assert_int_equal(check_cone(&b, v3(0.1, 0.2, 0), v3(0, 0.1, 1), 0.01), copies);
        done(&b);
    }
}

/* Many sheets of overlapping triangles in one plane, of all sizes: boxes of no thickness, all at one distance. */
static void coplanar_crowd(void **state)
{
    (void)state;
    Pile *p = pile_new();
    Random r = {2};
    for (int i = 0; i < 4000; i++) {
        KellerVec3 at = random_point(&r, 5);
        double size = pow(10, random_in(&r, -1, 1));
        KellerVec3 v[3];
        for (int k = 0; k < 3; k++) {
            v[k] = v3_add(at, random_point(&r, size));
            v[k].z = i % 2 ? 2 : 3;
        }
        add(p, v[0], v[1], v[2]);
    }
    Bench b = bench(p, 2 * STRUCTURES);
    uint32_t hits = 0;
    for (int i = 0; i < 6; i++) hits += check(&b, random_point(&r, 2), v3(random_in(&r, -1, 1), random_in(&r, -1, 1), 1), all);
    hits += check(&b, v3(0.3, 0.1, 7), v3(0, 0, -2), all);
    hits += check_cone(&b, v3(0.3, 0.1, -1), v3(0, 0, 1), 0.001);
    assert_true(hits > 800);
    /* in the plane itself nothing is hit, and the boxes are all met */
    assert_int_equal(check(&b, v3(-20, 0.1, 2), v3(1, 0, 0), all), 0);
    done(&b);
}

/* 300 slabs face to face along an axis: between two, the one is left before the other is entered, whatever the numbers. */
static void media_that_touch(void **state)
{
    (void)state;
    enum { SLABS = 300 };
    for (int axis = 0; axis < 3; axis++) {
        Pile *p = pile_new();
        Random r = {3};
        uint32_t slab[SLABS];
        for (uint32_t i = 0; i < SLABS; i++) slab[i] = i;
        for (uint32_t i = SLABS; i-- > 1;) {
            uint32_t k = random_u32(&r) % (i + 1), s = slab[i];
            slab[i] = slab[k], slab[k] = s;
        }
        for (uint32_t i = 0; i < SLABS; i++) {
            double l[3] = {-1, -1, -1}, u[3] = {1, 1, 1};
            l[axis] = 1 + 0.1 * slab[i], u[axis] = 1 + 0.1 * (slab[i] + 1);
            add_box(p, v3(l[0], l[1], l[2]), v3(u[0], u[1], u[2]));
        }
        Bench b = bench(p, 2 * STRUCTURES);
        KellerVec3 d = v3(axis == 0, axis == 1, axis == 2), aside = v3_scale(v3(axis != 0, axis != 1, axis != 2), 0.01);
        for (int i = 0; i < 8; i++) {
            KellerVec3 origin = v3(axis == 0 ? 0 : random_in(&r, -0.8, 0.8), axis == 1 ? 0 : random_in(&r, -0.8, 0.8),
                                   axis == 2 ? 0 : random_in(&r, -0.8, 0.8));
            assert_true(check(&b, origin, v3_madd(d, aside, random_in(&r, -0.5, 0.5)), all) >= 2 * SLABS);
            /* inside 0 or 1 slab, never 2: a face's diagonal is missed */
            KellerNexthitOptions o = {.method = (KellerNexthitMethod)(i % METHODS), .order = KELLER_NEXTHIT_LEAVE_FIRST, .batch = 7};
            KellerRayHit hit;
            int within = 0, count = 0;
            assert_int_equal(keller_nexthit_ray(b.it, b.accel[i % 4], origin, d, all, &o, NULL), KELLER_OK);
            while (keller_nexthit_next_ray(b.it, &hit, NULL) == KELLER_OK && hit.triangle != KELLER_NONE) {
                const uint32_t *t = p->triangles[hit.triangle];
                bool leaves = keller_nexthit_leaves(d, p->vertices[t[0]], p->vertices[t[1]], p->vertices[t[2]]);
                within += leaves ? -1 : 1;
                assert_true(within == 0 || within == 1);
                count++;
            }
            assert_int_equal(count, 2 * SLABS);
            assert_int_equal(within, 0);
        }
        done(&b);
    }
}

/* Spheres within spheres, welded; some twice, as two media have their border each. */
static void nested_shells(void **state)
{
    (void)state;
    enum { ROWS = 8, COLUMNS = 12, SHELLS = 40 };
    Pile *p = pile_new();
    Random r = {4};
    for (int s = 0; s < SHELLS; s++) {
        double radius = 1 + s / 2 * 0.1;
        for (int i = 0; i < ROWS; i++)
            for (int j = 0; j < COLUMNS; j++) {
                KellerVec3 v[4];
                for (int k = 0; k < 4; k++) {
                    double polar = M_PI * (i + (k == 1 || k == 2)) / ROWS, azimuth = 2 * M_PI * ((j + (k > 1)) % COLUMNS) / COLUMNS;
                    v[k] = v3_scale(v3(sin(polar) * cos(azimuth), sin(polar) * sin(azimuth), cos(polar)), radius);
                }
                add_quad(p, v[0], v[1], v[2], v[3]);
            }
    }
    Bench b = bench(p, 2 * STRUCTURES);
    const int rays = (int)cases_scenes(120, 24);
    uint32_t hits = 0;
    for (int i = 0; i < rays; i++) {
        KellerVec3 origin = i % 3 ? random_point(&r, 4) : v3(0, 0, 0), to = random_point(&r, 1);
        if (i % 4 == 1) to = p->vertices[random_u32(&r) % (3 * p->in.triangle_count)];
        if (i % 8 == 2) to = v3_add(origin, v3(0, 0, 1));
        hits += check(&b, origin, v3_sub(to, origin), i % 5 ? all : (KellerRange){-3, 3});
        if (i % 20 == 0) hits += check_cone(&b, origin, v3_sub(to, origin), pow(10, random_in(&r, -8, -1)));
    }
    assert_true(hits > (uint32_t)rays * 25);
    done(&b);
}

/* Along edges, through vertices, in planes of walls, from points on them; directions of no or the least components. */
static void in_planes_and_along_edges(void **state)
{
    (void)state;
    Pile *p = pile_new();
    Random r = {5};
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++)
            for (int k = 0; k < 4; k++) add_box(p, v3(i, j, k), v3(i + 1, j + 1, k + 1));
    for (int i = 0; i < 30; i++) { /* and triangles that are none */
        KellerVec3 a = random_point(&r, 4), c = random_point(&r, 4);
        add(p, a, c, i % 3 ? v3_scale(v3_add(a, c), 0.5) : a);
        add(p, a, a, a);
    }
    Bench b = bench(p, 2 * STRUCTURES);
    uint32_t hits = 0;
    const int rays = (int)cases_scenes(700, 140);
    const double places[] = {-1, 0, 0.5, 1, 2, 3.25, 4, 4.5}, slopes[] = {0, -0.0, 1e-300, -1e-18, 1e-9, 1, -1, 0.5};
    for (int i = 0; i < rays; i++) {
        double o[3], d[3];
        for (int k = 0; k < 3; k++) {
            o[k] = places[random_u32(&r) % 8];
            d[k] = slopes[random_u32(&r) % 8];
        }
        if (fmax(fabs(d[0]), fmax(fabs(d[1]), fabs(d[2]))) < 1e-6) d[i % 3] = i % 2 ? 3 : -1;
        hits += check(&b, v3(o[0], o[1], o[2]), v3(d[0], d[1], d[2]), i % 3 ? all : (KellerRange){-INFINITY, INFINITY});
        if (i % 50 == 0) check_cone(&b, v3(o[0], o[1], o[2]), v3(d[0], d[1], d[2]), i % 100 ? 0 : 1e-6);
    }
    assert_true(hits > (uint32_t)rays * 11 / 2);
    done(&b);
}

/* From 1e-9 m to 1e9 m, in one ray; ranges that begin or end exactly at a hit. */
static void near_and_far(void **state)
{
    (void)state;
    Pile *p = pile_new();
    for (int i = -9; i <= 9; i++) {
        double z = pow(10, i), s = 3 * z;
        add(p, v3(-s, -s, z), v3(s, -s, z), v3(0, s, z));
        add(p, v3(-s, -s, -z), v3(s, -s, -z), v3(0, s, -z));
    }
    add(p, v3(-1, -1, 0), v3(1, -1, 0), v3(0, 1, 0));
    Bench b = bench(p, 2 * STRUCTURES);
    assert_int_equal(check(&b, v3(0, 0, 0), v3(0, 0, 1), all), 20);
    assert_int_equal(check(&b, v3(0, 0, 0), v3(0, 0, 1e-3), (KellerRange){-INFINITY, INFINITY}), 39);
    assert_int_equal(check(&b, v3(0, 0, 0), v3(0, 0, 1), (KellerRange){0, 0}), 1);
    assert_int_equal(check(&b, v3(0, 0, 0), v3(0, 0, 1), (KellerRange){1, 1000}), 4);
    assert_int_equal(check(&b, v3(0, 0, 0), v3(0, 0, -1), (KellerRange){1, 1}), 1);
    assert_int_equal(check(&b, v3(0, 0, 0), v3(0, 0, 1), (KellerRange){2, 1}), 0);
    assert_int_equal(check(&b, v3(0, 0, -1e12), v3(0, 0, 1), all), 39);
    assert_int_equal(check_cone(&b, v3(0, 0, 0), v3(0, 0, 1), 0.1), 20);
    done(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(coplanar_copies),  cmocka_unit_test(coplanar_crowd),
        cmocka_unit_test(media_that_touch), cmocka_unit_test(nested_shells),
        cmocka_unit_test(in_planes_and_along_edges), cmocka_unit_test(near_and_far),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
