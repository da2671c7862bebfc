/* The watertight ray: no leak in closed meshes, the right triangle and place by 113-bit arithmetic, and the paper's
 * figure 4: the cone around a ray is never later than the ray (Emre et al. 2025). KELLER_CASES sets the number of
 * cases. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <cmocka.h>
#include "../cases.h"
#include "keller/accel.h"
#include "keller/ray.h"
#include "random.h"
#include "real_scene.h"

static const KellerRange FORWARD = {0, INFINITY};

static double spread(Random *r, double low, double high) { return pow(10, random_in(r, log10(low), log10(high))); }

static void by_hand(void **state)
{
    (void)state;
    /* the triangle (0,0,2) (1,0,2) (0,1,2) from the origin along (0.2, 0.1, 1): at t = 2, the point (0.4, 0.2, 2) */
    KellerVec3 a = v3(0, 0, 2), b = v3(1, 0, 2), c = v3(0, 1, 2), o = v3(0, 0, 0);
    KellerRay ray = keller_ray(o, v3(0.2, 0.1, 1));
    double t, w[3];
    assert_true(keller_ray_triangle(&ray, a, b, c, FORWARD, &t, w));
    assert_true(fabs(t - 2) < 1e-15);
    assert_true(fabs(w[0] - 0.4) < 1e-15 && fabs(w[1] - 0.4) < 1e-15 && fabs(w[2] - 0.2) < 1e-15);
    assert_true(keller_ray_triangle(&ray, a, c, b, FORWARD, &t, w)); /* its back */
    assert_true(fabs(t - 2) < 1e-15 && fabs(w[1] - 0.2) < 1e-15);
    assert_false(keller_ray_triangle(&ray, a, b, c, (KellerRange){0, 1.9}, NULL, NULL));
    assert_true(keller_ray_triangle(&ray, a, b, c, (KellerRange){2, 2}, NULL, NULL));
    ray = keller_ray(o, v3(-0.4, -0.2, -2)); /* backwards, twice as long */
    assert_false(keller_ray_triangle(&ray, a, b, c, FORWARD, NULL, NULL));
    assert_true(keller_ray_triangle(&ray, a, b, c, (KellerRange){-INFINITY, INFINITY}, &t, NULL));
    assert_true(fabs(t + 1) < 1e-15);
    ray = keller_ray(o, v3(0.6, 0.6, 1)); /* passes (1.2, 1.2, 2) */
    assert_false(keller_ray_triangle(&ray, a, b, c, FORWARD, NULL, NULL));
    ray = keller_ray(o, v3(0, 0, 1)); /* a vertex, then a point of an edge */
    assert_true(keller_ray_triangle(&ray, a, b, c, FORWARD, &t, NULL) && t == 2);
    ray = keller_ray(o, v3(0.25, 0.25, 1));
    assert_true(keller_ray_triangle(&ray, a, b, c, FORWARD, &t, NULL) && t == 2);
    /* in the triangle's plane; a segment; a point */
    ray = keller_ray(v3(-1, 0.25, 2), v3(1, 0, 0));
    assert_false(keller_ray_triangle(&ray, a, b, c, FORWARD, NULL, NULL));
    ray = keller_ray(o, v3(0.25, 0, 1));
    assert_false(keller_ray_triangle(&ray, a, b, b, FORWARD, NULL, NULL));
    ray = keller_ray(o, v3(0, 0, 1));
    assert_false(keller_ray_triangle(&ray, a, a, a, FORWARD, NULL, NULL));
}

/* ---- closed meshes ----------------------------------------------------------------------------------------------- */

enum { VERTICES = 128, TRIANGLES = 256 };
typedef struct {
    KellerVec3 vertex[VERTICES], middle;
    int triangle[TRIANGLES][3], vertices, triangles;
} Mesh;

static void add(Mesh *m, int a, int b, int c)
{
    int *t = m->triangle[m->triangles++];
    t[0] = a;
    t[1] = b;
    t[2] = c;
}

/* A sphere of `around` x `rings` with poles. */
static Mesh sphere(int around, int rings)
{
    Mesh m = {.vertices = 2};
    m.vertex[0] = v3(0, 0, 1);
    m.vertex[1] = v3(0, 0, -1);
    for (int j = 1; j < rings; j++)
        for (int i = 0; i < around; i++) {
            double p = M_PI * j / rings, f = 2 * M_PI * i / around;
            m.vertex[m.vertices++] = v3(sin(p) * cos(f), sin(p) * sin(f), cos(p));
        }
    for (int i = 0; i < around; i++) {
        int next = (i + 1) % around, last = 2 + (rings - 2) * around;
        add(&m, 0, 2 + i, 2 + next);
        add(&m, 1, last + next, last + i);
        for (int j = 0; j < rings - 2; j++) {
            int a = 2 + j * around;
            add(&m, a + i, a + around + i, a + next);
            add(&m, a + next, a + around + i, a + around + next);
        }
    }
    return m;
}

/* The cube [-1, 1]^3, each side a fan of four around its centre. */
static Mesh box(void)
{
    Mesh m = {.vertices = 8};
    for (int i = 0; i < 8; i++) m.vertex[i] = v3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    static const int side[6][4] = {{0, 2, 6, 4}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 5, 7, 6}};
    for (int s = 0; s < 6; s++) {
        int centre = m.vertices++;
        m.vertex[centre] = v3(0, 0, 0);
        for (int i = 0; i < 4; i++) {
            m.vertex[centre] = v3_madd(m.vertex[centre], m.vertex[side[s][i]], 0.25);
            add(&m, centre, side[s][i], side[s][(i + 1) % 4]);
        }
    }
    return m;
}

/* Stretched, turned (or not: many coordinates stay equal), moved. */
static void place(Random *r, Mesh *m)
{
    double s[3] = {spread(r, 1e-3, 1e3), spread(r, 1e-3, 1e3), spread(r, 1e-3, 1e3)};
    KellerVec3 x = random_unit(r), y = v3_perpendicular(x), z = v3_cross(x, y);
    if (random_u32(r) % 2) x = v3(1, 0, 0), y = v3(0, 1, 0), z = v3(0, 0, 1);
    m->middle = random_u32(r) % 2 ? v3(0, 0, 0) : random_point(r, random_u32(r) % 2 ? 10 : 1e5);
    for (int i = 0; i < m->vertices; i++) {
        KellerVec3 v = m->vertex[i];
        KellerVec3 p = v3_add(v3_add(v3_scale(x, s[0] * v.x), v3_scale(y, s[1] * v.y)), v3_scale(z, s[2] * v.z));
        m->vertex[i] = v3_add(m->middle, p);
    }
}

static KellerVec3 direction_at(Random *r, const Mesh *m, KellerVec3 o)
{
    const int *t = m->triangle[random_u32(r) % (uint32_t)m->triangles];
    KellerVec3 a = m->vertex[t[0]], b = m->vertex[t[1]];
    switch (random_u32(r) % 5) {
    case 0: return v3_sub(a, o);
    case 1: return v3_sub(v3_scale(v3_add(a, b), 0.5), o);
    case 2: return v3_sub(v3_madd(a, v3_sub(b, a), random_in(r, 0, 1)), o);
    case 3: {
        const double sign = random_u32(r) % 2 ? 1 : -1;
        const int k = (int)(random_u32(r) % 3);
        return v3(k == 0 ? sign : 0, k == 1 ? sign : 0, k == 2 ? sign : 0);
    }
    default: return random_unit(r);
    }
}

static void no_leak(void **state)
{
    (void)state;
    Random r = {21};
    const int count = (int)cases_of(1000000);
    Mesh shapes[] = {sphere(3, 2), sphere(40, 3), sphere(3, 30), box()};
    long several = 0;
    for (int n = 0; n < count;) {
        Mesh m = shapes[random_u32(&r) % 4];
        place(&r, &m);
        for (int i = 0; i < 100; i++, n++) {
            /* the middle, or a point on the way to a vertex */
            KellerVec3 o = m.middle, to = v3_sub(m.vertex[random_u32(&r) % (uint32_t)m.vertices], o);
            if (random_u32(&r) % 2) o = v3_madd(o, to, random_in(&r, 0, 0.2));
            KellerVec3 d = direction_at(&r, &m, o);
            if (!(v3_norm(d) > 0)) continue;
            KellerRay ray = keller_ray(o, d);
            int hits = 0;
            for (int k = 0; k < m.triangles; k++) {
                const int *t = m.triangle[k];
                hits += keller_ray_triangle(&ray, m.vertex[t[0]], m.vertex[t[1]], m.vertex[t[2]], FORWARD, NULL, NULL);
            }
            if (hits == 0) fail_msg("ray %d leaks", n);
            several += hits > 1;
        }
    }
    assert_true(several > count / 10); /* shared vertices and edges were met indeed */
}

/* ---- the truth --------------------------------------------------------------------------------------------------- */

typedef struct {
    __float128 x, y, z;
} Quad;

static Quad quad(KellerVec3 a, KellerVec3 o)
{
    return (Quad){(__float128)a.x - o.x, (__float128)a.y - o.y, (__float128)a.z - o.z};
}

static __float128 volume(Quad a, Quad b, Quad c)
{
    return a.x * (b.y * c.z - b.z * c.y) + a.y * (b.z * c.x - b.x * c.z) + a.z * (b.x * c.y - b.y * c.x);
}

static void against_truth(void **state)
{
    (void)state;
    Random r = {22};
    const int count = (int)cases_of(1000000);
    long hits = 0, misses = 0;
    for (int n = 0; n < count; n++) {
        KellerVec3 o = random_point(&r, random_u32(&r) % 2 ? 10 : 1e5), v[3];
        double size = spread(&r, 1e-4, 1e4), away = spread(&r, 1e-2, 1e4);
        KellerVec3 middle = v3_madd(o, random_unit(&r), away);
        for (int i = 0; i < 3; i++) v[i] = v3_madd(middle, random_unit(&r), size);
        if (random_u32(&r) % 2) v[2] = v3_madd(v3_scale(v3_add(v[0], v[1]), 0.5), random_unit(&r), size * 1e-6);
        KellerVec3 aim = v3_madd(v3_madd(v[0], v3_sub(v[1], v[0]), random_in(&r, -0.5, 1.5)), v3_sub(v[2], v[0]),
                                 random_in(&r, -0.5, 1.5));
        KellerVec3 d = v3_scale(v3_sub(aim, o), spread(&r, 0.1, 10));
        KellerRay ray = keller_ray(o, d);
        double t = 0, w[3];
        bool hit = keller_ray_triangle(&ray, v[0], v[1], v[2], FORWARD, &t, w);
        const Quad q[3] = {quad(v[0], o), quad(v[1], o), quad(v[2], o)}, D = {d.x, d.y, d.z};
        const Quad e[2] = {quad(v[1], v[0]), quad(v[2], v[0])};
        const __float128 f[3] = {volume(D, q[1], q[2]), volume(D, q[2], q[0]), volume(D, q[0], q[1])};
        const __float128 sum = volume(D, e[0], e[1]);
        /* The sheared vertices are off by some units of their coordinates, `shift`: this moves the point in the plane
         * of the triangle by shift / sine of the angle between ray and plane, the weights by that over its least
         * height. */
        const KellerVec3 N = v3_cross(v3_sub(v[1], v[0]), v3_sub(v[2], v[0]));
        double shift = 0x1p-50 * (away + size), sine = fabs((double)sum) / (v3_norm(N) * v3_norm(d)), least = INFINITY;
        double longest = fmax(v3_distance(v[0], v[1]), fmax(v3_distance(v[1], v[2]), v3_distance(v[2], v[0])));
        double doubt = shift / (sine * v3_norm(N) / longest), true_t = (double)(volume(q[0], e[0], e[1]) / sum);
        for (int i = 0; i < 3; i++) least = fmin(least, (double)(f[i] / sum));
        double true_s = true_t * v3_norm(d), doubt_s = shift / sine;
        if (least > doubt && true_s > doubt_s) {
            hits++;
            assert_true(hit);
            assert_true(fabs(t * v3_norm(d) - true_s) <= doubt_s);
            for (int i = 0; i < 3; i++) assert_true(fabs(w[i] - (double)(f[i] / sum)) <= doubt);
        } else if (least < -doubt || true_s < -doubt_s) {
            misses++;
            assert_false(hit);
        }
    }
    assert_true(hits > count / 20 && misses > count / 20);
}

/* ---- figure 4 ---------------------------------------------------------------------------------------------------- */

static const double figure_4_degrees[] = {0, 1e-9, 1e-5};

static void never_later(void **state)
{
    (void)state;
    Random r = {23};
    const int count = (int)cases_of(1000000);
    long hits = 0;
    for (int n = 0; n < count; n++) {
        KellerVec3 o = random_point(&r, random_u32(&r) % 2 ? 10 : 1e5), v[3];
        double size = spread(&r, 1e-4, 1e4), away = spread(&r, 1e-2, 1e4);
        KellerVec3 middle = v3_madd(o, random_unit(&r), away);
        for (int i = 0; i < 3; i++) v[i] = v3_madd(middle, random_unit(&r), size);
        if (random_u32(&r) % 2) /* a sliver */
            v[2] = v3_madd(v3_madd(v[0], v3_sub(v[1], v[0]), random_in(&r, -1, 2)), random_unit(&r),
                           size * spread(&r, 1e-6, 1e-1));
        double s = random_in(&r, 0, 1), q = random_in(&r, 0, 1 - s);
        switch (random_u32(&r) % 4) {
        case 0: s = q = 0; break; /* a vertex */
        case 1: q = 0; break;     /* an edge */
        default: break;
        }
        KellerVec3 d = v3_unit(v3_sub(v3_madd(v3_madd(v[0], v3_sub(v[1], v[0]), s), v3_sub(v[2], v[0]), q), o));
        KellerRay ray = keller_ray(o, d);
        double t;
        if (!keller_ray_triangle(&ray, v[0], v[1], v[2], FORWARD, &t, NULL)) continue;
        hits++;
        KellerCone cone = keller_cone_round(o, d, figure_4_degrees[n % 3] * M_PI / 180);
        KellerRange range = keller_cone_triangle(&cone, v[0], v[1], v[2], FORWARD, NULL, NULL);
        if (!(range.near <= range.far)) fail_msg("case %d: ray at %.17g, the cone's range is empty", n, t);
        if (range.near > t) fail_msg("case %d: cone at %.17g, ray at %.17g", n, range.near, t);
    }
    assert_true(hits > count / 2);
}

typedef struct {
    const KellerScene *scene;
    KellerRay ray;
    double nearest;
} Nearest;

static bool visit_ray(void *context, uint32_t triangle)
{
    Nearest *n = context;
    const uint32_t *t = n->scene->triangles[triangle];
    const KellerVec3 *v = n->scene->vertices;
    double at;
    KellerRange open = {0, n->nearest};
    if (keller_ray_triangle(&n->ray, v[t[0]], v[t[1]], v[t[2]], open, &at, NULL)) n->nearest = at;
    return false;
}

static double visit_cone(void *context, uint32_t triangle, KellerRange range)
{
    (void)triangle;
    double *nearest = context;
    if (range.near < *nearest) *nearest = range.near;
    return INFINITY;
}

static void never_later_in(const char *name, uint64_t seed)
{
    KellerSoup soup = real_scene(name);
    KellerScene scene;
    KellerError error;
    KellerAccel *accel;
    if (keller_scene_build(&soup, &scene, &error) != KELLER_OK) fail_msg("%s", error.message);
    if (keller_accel_build("auto", &scene, &accel, &error) != KELLER_OK) fail_msg("%s", error.message);
    Random r = {seed};
    const int count = (int)cases_of(100000);
    double length = v3_distance(scene.lower, scene.upper);
    long hits = 0;
    for (int n = 0; n < count; n++) {
        KellerVec3 l = scene.lower, u = scene.upper;
        KellerVec3 o = v3(random_in(&r, l.x, u.x), random_in(&r, l.y, u.y), random_in(&r, l.z, u.z));
        KellerVec3 d = random_unit(&r);
        if (random_u32(&r) % 2) { /* at a vertex, or a point of an edge */
            const uint32_t *t = scene.triangles[random_u32(&r) % scene.triangle_count];
            KellerVec3 a = scene.vertices[t[0]], b = scene.vertices[t[1]];
            d = v3_unit(v3_sub(random_u32(&r) % 2 ? a : v3_madd(a, v3_sub(b, a), random_in(&r, 0, 1)), o));
        }
        Nearest ray = {&scene, keller_ray(o, d), INFINITY};
        KellerAccelWork work = {0};
        keller_accel_segment(accel, o, v3_madd(o, d, length), 1e-6, visit_ray, &ray, &work);
        if (!(ray.nearest < INFINITY)) continue;
        hits++;
        KellerCone cone = keller_cone_round(o, d, figure_4_degrees[2] * M_PI / 180);
        double nearest = INFINITY;
        keller_accel_cone(accel, &cone, (KellerRange){0, length}, visit_cone, NULL, &nearest, &work);
        if (!(nearest <= ray.nearest))
            fail_msg("%s, ray %d: cone at %.17g, ray at %.17g", name, n, nearest, ray.nearest);
    }
    print_message("# %s: %ld of %d rays hit\n", name, hits, count);
    assert_true(hits > count / 4);
    keller_accel_free(accel);
    keller_scene_free(&scene);
    keller_soup_free(&soup);
}

static void never_later_munich(void **state)
{
    (void)state;
    never_later_in("sionna/munich/munich.xml", 24);
}

static void never_later_classroom(void **state)
{
    (void)state;
    never_later_in("indoor/classroom/scene.xml", 25);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(by_hand),     cmocka_unit_test(no_leak),            cmocka_unit_test(against_truth),
        cmocka_unit_test(never_later), cmocka_unit_test(never_later_munich), cmocka_unit_test(never_later_classroom),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests_name("ray", tests, NULL, NULL);
}
