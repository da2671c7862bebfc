/* keller_accel_cone_blocked: never yes where a ray of the cone passes, and yes where a wall stands across it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "accel_model.h"
#include "base/number.h"
#include "keller/ray.h"

static const char *const names[] = {"kdtree", "bvh", "bvh8", "bvh+mask", "bvh8+mask", "ubvh", "dacrt"};
enum { NAMES = sizeof names / sizeof *names, MOST = 2000 };

static KellerAccel *accel_of(const Model *m, const char *name)
{
    KellerAccel *accel;
    assert_int_equal(keller_accel_new(&m->in, &(KellerAccelOptions){.name = name}, &accel, NULL), KELLER_OK);
    return accel;
}

/* A point of the frustum's section at z, at (u, v) of the unit disc. */
static KellerVec3 in_section(const KellerCone *c, double z, double u, double v)
{
    double R = z * c->tan_alpha + c->x0;
    KellerVec3 p = v3_madd(c->origin, c->directrix, z);
    return v3_madd(v3_madd(p, c->major, u * R), c->minor, v * R / c->e);
}

/* A ray of the frustum from its section at `near` to that at `far` that meets none of the triangles? The frustum is convex:
 * any two points of the sections will do; half are drawn on its envelope, and half of the rays are its generators. */
static bool passes(const Model *m, const KellerCone *c, double near, double far, size_t count, const uint32_t *triangles,
                   Random *r)
{
    double p[4];
    for (int i = 0; i < 4; i += 2) {
        double azimuth = random_in(r, 0, 2 * M_PI), radius = random_u32(r) % 2 ? 1 - 1e-9 : sqrt(random_in(r, 0, 1));
        p[i] = radius * cos(azimuth);
        p[i + 1] = radius * sin(azimuth);
    }
    if (random_u32(r) % 2) p[2] = p[0], p[3] = p[1];
    KellerVec3 a = in_section(c, near, p[0], p[1]), b = in_section(c, far, p[2], p[3]);
    KellerRay ray = keller_ray(a, v3_sub(b, a));
    for (size_t i = 0; i < count; i++) {
        uint32_t t = triangles ? triangles[i] : (uint32_t)i;
        if (keller_ray_triangle(&ray, model_corner(m, t, 0), model_corner(m, t, 1), model_corner(m, t, 2), (KellerRange){0, 1},
                                NULL, NULL))
            return false;
    }
    return true;
}

/* Asks, and tries a yes with random rays against all triangles and against those named; says whether it was yes. */
static bool ask(const Model *m, const KellerAccel *accel, const KellerCone *c, KellerRange clip, int rays, Random *r)
{
    KellerAccelWork work = {0};
    uint32_t triangles[MOST];
    size_t count = 0;
    if (!keller_accel_cone_blocked(accel, c, clip, MOST, triangles, &count, &work)) return false;
    assert_true(count > 0 && count <= MOST);
    double last = -INFINITY;
    for (size_t i = 0; i < count; i++) {
        KellerRange range = keller_cone_triangle(c, model_corner(m, triangles[i], 0), model_corner(m, triangles[i], 1),
                                                 model_corner(m, triangles[i], 2), (KellerRange){0, INFINITY}, NULL, NULL);
        assert_true(range.near <= range.far && range.near >= last - 1e-4);
        last = range.near;
    }
    double far = lesser(lesser(clip.far, c->z_far), 1000);
    for (int i = 0; i < rays; i++)
        if (passes(m, c, greater(clip.near, c->z_near), far, count, triangles, r))
            fail_msg("a ray passes the %zu triangles", count);
    if (passes(m, c, greater(clip.near, c->z_near), far, m->in.triangle_count, NULL, r)) fail_msg("a ray passes");
    uint32_t few[MOST];
    size_t fewer;
    if (count > 1) assert_false(keller_accel_cone_blocked(accel, c, clip, count - 1, few, &fewer, &work) && fewer > count - 1);
    return true;
}

/* A square wall of 2 (side - 1)^2 triangles at z = 5, 10 m to either side; `hole`: without one. */
static Model wall(uint32_t side, int hole)
{
    Model m = {.size = 10};
    m.vertices = malloc(side * side * sizeof *m.vertices);
    m.triangles = malloc(2 * side * side * sizeof *m.triangles);
    uint32_t n = 0;
    for (uint32_t i = 0; i < side; i++)
        for (uint32_t j = 0; j < side; j++)
            model_vertex(&m, &n, v3(20.0 * i / (side - 1) - 10, 20.0 * j / (side - 1) - 10, 5));
    model_sheet(&m, 0, side, side, false);
    if (hole >= 0) memcpy(m.triangles[hole], m.triangles[--m.in.triangle_count], sizeof *m.triangles);
    m.in.vertices = m.vertices;
    m.in.triangles = (const uint32_t (*)[3])m.triangles;
    return m;
}

static void by_a_wall(void **state)
{
    (void)state;
    Random r = {8};
    int hidden = 0;
    for (int q = 0; q < 300; q++) {
        Model whole = wall(11, -1);
        KellerAccel *accel = accel_of(&whole, names[q % NAMES]);
        KellerVec3 d = v3_unit(v3(random_in(&r, -0.5, 0.5), random_in(&r, -0.5, 0.5), 1));
        double half_angle = q % 2 ? random_in(&r, 0.01, 0.35) : pow(10, random_in(&r, -6, -2));
        KellerCone c = keller_cone_elliptic(v3(random_in(&r, -1, 1), random_in(&r, -1, 1), random_in(&r, -2, 1)), d,
                                            random_unit(&r), half_angle, q % 3 ? 0 : random_in(&r, 0, 0.999),
                                            q % 4 ? 0 : random_in(&r, 0, 0.5));
        KellerRange clip = {0, q % 5 ? INFINITY : 40};
        KellerRayHit hit = {0, random_u32(&r) % 200};
        KellerAccelWork work = {0};
        if (q % 3) assert_true(keller_accel_ray_nearest(accel, c.origin, d, clip, &hit, &work));
        Model open = wall(11, (int)hit.triangle);
        KellerAccel *with_hole = accel_of(&open, names[q % NAMES]);
        const uint32_t *gone = whole.triangles[hit.triangle];
        assert_true(ask(&whole, accel, &c, clip, 100, &r)); /* it is wide enough */
        bool through = keller_cone_meets_triangle(&c, open.vertices[gone[0]], open.vertices[gone[1]], open.vertices[gone[2]],
                                                  clip);
        bool blocked = ask(&open, with_hole, &c, clip, 100, &r);
        if (through) assert_false(blocked);
        hidden += through;
        /* before the wall, behind it, and where the clip ends in it */
        assert_false(ask(&whole, accel, &c, (KellerRange){0, 1}, 0, &r));
        assert_false(ask(&whole, accel, &c, (KellerRange){20, INFINITY}, 0, &r));
        keller_accel_free(accel);
        keller_accel_free(with_hole);
        model_free(&whole);
        model_free(&open);
    }
    assert_true(hidden > 150);
}

/* From inside a closed surface nothing escapes, and from outside what passes it is not called blocked. */
static void by_a_closed_surface(void **state)
{
    (void)state;
    Random r = {9};
    int yes = 0, asked = 0;
    for (uint32_t s = 0; s < 9; s++) {
        Model m = model_make(s % 2 ? MODEL_ROOM : MODEL_SPHERE, 200, &r);
        KellerAccel *accel = accel_of(&m, names[s % NAMES]);
        for (int q = 0; q < 60; q++) {
            KellerCone c = keller_cone_round(random_point(&r, 2), random_unit(&r),
                                             q % 3 == 0 ? M_PI / 4 : random_in(&r, 0, 0.3));
            asked++;
            yes += ask(&m, accel, &c, (KellerRange){0, INFINITY}, 40, &r);
            c.origin = v3_add(c.origin, random_point(&r, 60)); /* mostly outside */
            c.x0 = q % 2 ? 0 : 5;
            ask(&m, accel, &c, (KellerRange){0, INFINITY}, 40, &r);
        }
        keller_accel_free(accel);
        model_free(&m);
    }
    assert_true(yes > asked * 0.95); /* only an axis through an edge or a vertex may be left */
}

/* What is open is never called blocked: soups, sheets, triangles twice. */
static void never_wrong(void **state)
{
    (void)state;
    Random r = {10};
    for (uint32_t s = 0; s < 6 * MODEL_KINDS; s++) {
        ModelKind kind = (ModelKind)(s % MODEL_KINDS);
        if (kind == MODEL_HUGE_AND_TINY) continue;
        Model m = model_make(kind, 30 + random_u32(&r) % 300, &r);
        if (m.in.triangle_count) m.in.triangle_count -= s / MODEL_KINDS; /* a closed one with a hole */
        KellerAccel *accel = accel_of(&m, names[s % NAMES]);
        for (uint32_t q = 0; q < 40; q++) {
            KellerCone c = model_cone(&m, q, &r);
            ask(&m, accel, &c, (KellerRange){0, q % 3 ? INFINITY : random_in(&r, 0, 40)}, 60, &r);
        }
        keller_accel_free(accel);
        model_free(&m);
    }
}

/* Two triangles of one surface, which one cannot stand for: where only one may be named the answer is no, and so it is for
 * two, since rays pass beside them. */
static void never_by(const KellerVec3 *vertices, const uint32_t (*triangles)[3], KellerVec3 through)
{
    KellerAccelInput in = {.triangle_count = 2, .vertices = vertices, .triangles = triangles};
    KellerCone c = keller_cone_round(v3(0, 0, 0), v3(0, 0, 1), 0.5);
    for (int k = 0; k < NAMES; k++) {
        KellerAccel *accel;
        KellerAccelWork work = {0};
        uint32_t named[3];
        size_t count;
        assert_int_equal(keller_accel_new(&in, &(KellerAccelOptions){.name = names[k]}, &accel, NULL), KELLER_OK);
        assert_false(keller_accel_ray_any(accel, c.origin, through, (KellerRange){0, INFINITY}, &work));
        for (size_t most = 0; most <= 3; most++)
            assert_false(keller_accel_cone_blocked(accel, &c, (KellerRange){0, INFINITY}, most, named, &count, &work));
        keller_accel_free(accel);
    }
}

static void not_by_a_part(void **state)
{
    (void)state;
    const KellerVec3 vertices[] = {{-1, -50, 5}, {-1, 50, 5}, {-1.5, 0, 4.9}, {90, 0, 5}};
    never_by(vertices, (const uint32_t[2][3]){{0, 1, 2}, {1, 0, 3}}, v3(-2.5, 0, 5));
}

/* A triangle with one corner twice has no side to share with another that has only that corner. */
static void not_by_a_degenerate_neighbour(void **state)
{
    (void)state;
    const KellerVec3 vertices[] = {{-1, -50, 5}, {-1, 50, 5}, {90, 0, 5}, {0, 0, 1}};
    never_by(vertices, (const uint32_t[2][3]){{0, 1, 2}, {0, 0, 3}}, v3(-2, 0, 5));
}

/* Thousands of triangles in one cone: n log n, and no more memory than they take. */
static void by_many(void **state)
{
    (void)state;
    enum { SIDE = 150 };
    KellerVec3 *v = malloc((SIDE + 1) * (SIDE + 1) * sizeof *v);
    uint32_t(*t)[3] = malloc(2 * SIDE * SIDE * sizeof *t), *named = malloc(2 * SIDE * SIDE * sizeof *named), n = 0;
    for (uint32_t i = 0; i <= SIDE; i++)
        for (uint32_t j = 0; j <= SIDE; j++) v[i * (SIDE + 1) + j] = v3(i - 0.5 * SIDE, j - 0.5 * SIDE, 100);
    for (uint32_t i = 0; i < SIDE; i++)
        for (uint32_t j = 0; j < SIDE; j++) {
            uint32_t a = i * (SIDE + 1) + j, b = a + SIDE + 1;
            t[n][0] = a, t[n][1] = b, t[n++][2] = b + 1;
            t[n][0] = a, t[n][1] = b + 1, t[n++][2] = a + 1;
        }
    KellerAccelInput in = {.triangle_count = n, .vertices = v, .triangles = (const uint32_t(*)[3])t};
    KellerCone c = keller_cone_round(v3(0.1, 0.2, 0), v3(0, 0, 1), 0.6);
    for (int k = 0; k < NAMES; k++) {
        KellerAccel *accel;
        KellerAccelWork work = {0};
        size_t count;
        assert_int_equal(keller_accel_new(&in, &(KellerAccelOptions){.name = names[k]}, &accel, NULL), KELLER_OK);
        assert_true(keller_accel_cone_blocked(accel, &c, (KellerRange){0, INFINITY}, n, named, &count, &work));
        assert_true(count > 20000 && count <= n);
        keller_accel_free(accel);
    }
    free(v);
    free(t);
    free(named);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(not_by_a_part),
        cmocka_unit_test(not_by_a_degenerate_neighbour),
        cmocka_unit_test(by_many),
        cmocka_unit_test(by_a_wall),
        cmocka_unit_test(by_a_closed_surface),
        cmocka_unit_test(never_wrong),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
