/* Skewed boxes: what they hold, which pairs of triangles share one, and that every kind of them answers as bvh8 does, from within the
 * scene and from far away. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "accel/ubvh.h"
#include "accel_model.h"
#include "base/number.h"
#include "io/generate.h"

static double coordinate(const Sobb *box, int k, KellerVec3 p)
{
    const SobbSlab *s = &box->slab[k];
    return (double)s->n[0] * p.x + (double)s->n[1] * p.y + (double)s->n[2] * p.z - (double)s->c;
}

static void assert_holds(const Sobb *box, int count, const KellerVec3 *corners)
{
    for (int k = 0; k < 3; k++)
        for (int j = 0; j < count; j++) assert_true(fabs(coordinate(box, k, corners[j])) < 1);
}

/* The unit triangle: corners at (-1, -1), (1, -1), (-1, 1) of u and v but for the width, w = 0. */
static void around_one(void **state)
{
    (void)state;
    const KellerVec3 corners[3] = {v3(1, 0, 0), v3(0, 0, 0), v3(0, 1, 0)};
    Sobb box = sobb_around(3, corners, 1e-6);
    assert_holds(&box, 3, corners);
    assert_true(box.band > 0 && box.band < 3e-5f); /* 3 widths over each of two half heights of 1/2 */
    for (int k = 0; k < 2; k++) assert_true(fabs(coordinate(&box, k, corners[1]) + 1) < 1e-5); /* opposite to the longest side */
    for (int j = 0; j < 3; j++) assert_true(fabs(coordinate(&box, 2, corners[j])) < 0.5);
    KellerVec3 beyond = v3(0.6, 0.6, 0);
    assert_true(coordinate(&box, 0, beyond) + coordinate(&box, 1, beyond) > 0);
    Random r = {5};
    for (int i = 0; i < 2000; i++) { /* slivers, segments and points too */
        KellerVec3 v[3];
        double thin = pow(10, random_in(&r, -12, 0));
        v[0] = random_point(&r, 10);
        v[1] = i % 7 == 6 ? v[0] : random_point(&r, 10);
        v[2] = i % 3 == 2 ? v[i % 2] : v3_add(v[0], random_point(&r, thin));
        Sobb any = sobb_around(i % 5 ? 3 : 2, v, 1e-5);
        assert_holds(&any, i % 5 ? 3 : 2, v);
        assert_true(any.band > 0);
    }
}

/* A square cut in two is a parallelogram; folded it is wings; with a corner moved within its plane, or folded by less than can be
 * told, it is no pair. */
static void around_two(void **state)
{
    (void)state;
    const KellerVec3 a = v3(1, 0, 0), b = v3(0, 1, 0), c = v3(0, 0, 0), d = v3(1, 1, 0);
    const KellerVec3 first[3] = {a, b, c}, folded = v3(1, 1, 0.3), skew = v3(1.4, 1, 0), hardly = v3(1, 1, 3e-6);
    Sobb box;
    SobbPlace place;
    assert_true(sobb_around_pair(first, (KellerVec3[]){b, a, d}, 1e-6, &box, &place));
    assert_int_equal(place, SOBB_FLAT);
    assert_holds(&box, 4, (KellerVec3[]){a, b, c, d});
    assert_true(coordinate(&box, 0, c) + coordinate(&box, 1, c) < -1.9 && coordinate(&box, 0, d) + coordinate(&box, 1, d) > 1.9);
    assert_true(sobb_around_pair(first, (KellerVec3[]){b, a, folded}, 1e-6, &box, &place));
    assert_int_equal(place, SOBB_WINGS);
    assert_holds(&box, 4, (KellerVec3[]){a, b, c, folded});
    KellerVec3 in_first = v3_scale(v3_add(a, v3_add(b, c)), 1 / 3.0), in_second = v3_scale(v3_add(a, v3_add(b, folded)), 1 / 3.0);
    assert_true(fabs(coordinate(&box, 2, in_first) + 1) < 1e-4 && coordinate(&box, 0, in_first) + coordinate(&box, 1, in_first) < 0);
    assert_true(fabs(coordinate(&box, 0, in_second) + 1) < 1e-4 && coordinate(&box, 1, in_second) + coordinate(&box, 2, in_second) < 0);
    assert_false(sobb_around_pair(first, (KellerVec3[]){b, a, skew}, 1e-6, &box, &place));
    assert_false(sobb_around_pair(first, (KellerVec3[]){b, a, hardly}, 1e-6, &box, &place));
}

/* A needle that leans: a skewed box is far smaller than one along the axes, and never larger. */
static void fitted(void **state)
{
    (void)state;
    Random r = {6};
    Dops d, frames;
    _Alignas(32) float dop[2 * DOP_MOST];
    assert_int_equal(dops_make(&d, false, NULL), KELLER_OK);
    assert_int_equal(dops_make(&frames, true, NULL), KELLER_OK);
    for (int i = 0; i < 500; i++) {
        KellerVec3 lean = random_unit(&r), v[4] = {random_point(&r, 1)};
        double lo[3] = {v[0].x, v[0].y, v[0].z}, hi[3] = {v[0].x, v[0].y, v[0].z};
        for (int j = 1; j < 4; j++) v[j] = v3_add(v3_madd(v[0], lean, 5.0 * j), random_point(&r, i % 2 ? 0.01 : 3));
        for (int j = 1; j < 4; j++) {
            const double p[3] = {v[j].x, v[j].y, v[j].z};
            for (int k = 0; k < 3; k++) lo[k] = lesser(lo[k], p[k]), hi[k] = greater(hi[k], p[k]);
        }
        double x = hi[0] - lo[0], y = hi[1] - lo[1], z = hi[2] - lo[2], along = x * y + y * z + z * x;
        for (int oriented = 0; oriented < 2; oriented++) {
            const Dops *of = oriented ? &frames : &d;
            dop_around(of, 4, v, dop);
            SobbFit fit = sobb_fit(of, dop, 1e-4);
            Sobb box = sobb_of_fit(of, &fit);
            assert_holds(&box, 4, v);
            assert_true((double)fit.area < 1.001 * along + 0.02);
            if (!oriented && i % 2 && lesser(x, lesser(y, z)) > 3) assert_true((double)fit.area < 0.5 * along);
        }
    }
    dops_free(&d);
    dops_free(&frames);
}

/* ---- all kinds of trees ------------------------------------------------------------------------------------------ */

static double stop_never(void *context, uint32_t primitive, KellerRange range)
{
    uint64_t *sum = context;
    sum[0]++;
    sum[1] += primitive;
    (void)range;
    return INFINITY;
}

static bool hit_never(void *context, KellerRayHit hit)
{
    uint64_t *sum = context;
    sum[0]++;
    sum[1] += hit.triangle;
    return false;
}

/* From within, and from so many times the model's size away. */
static uint64_t same_answers(const Model *m, const KellerAccel *plain, const KellerAccel *skewed, double away, Random *r)
{
    uint64_t hits = 0;
    for (uint32_t q = 0; q < 60; q++) {
        KellerCone c = model_cone(m, q, r);
        KellerAccelWork work = {0};
        const KellerRange clip = {q % 4 == 3 ? 3 : 0, q % 5 == 4 ? away * 20 : INFINITY};
        uint64_t sum[4][2] = {{0}};
        if (away > 1) {
            c.origin = v3_madd(v3_add(m->middle, random_point(r, m->size)), c.directrix, -away * m->size);
            c.tan_alpha /= away;
        }
        KellerRayHit ray[2];
        KellerConeHit cone[2];
        bool met = keller_accel_ray_nearest(plain, c.origin, c.directrix, clip, &ray[0], &work);
        assert_int_equal(keller_accel_ray_nearest(skewed, c.origin, c.directrix, clip, &ray[1], &work), met);
        assert_int_equal(keller_accel_ray_any(skewed, c.origin, c.directrix, clip, &work), met);
        if (met) assert_true(ray[0].triangle == ray[1].triangle && ray[0].t == ray[1].t);
        keller_accel_ray_all(plain, c.origin, c.directrix, clip, hit_never, sum[0], &work);
        keller_accel_ray_all(skewed, c.origin, c.directrix, clip, hit_never, sum[1], &work);
        hits += met;
        met = keller_accel_cone_nearest(plain, &c, clip, &cone[0], &work);
        assert_int_equal(keller_accel_cone_nearest(skewed, &c, clip, &cone[1], &work), met);
        assert_int_equal(keller_accel_cone_any(skewed, &c, clip, &work), met);
        if (met) assert_true(cone[0].primitive == cone[1].primitive && cone[0].range.near == cone[1].range.near);
        keller_accel_cone(plain, &c, clip, stop_never, stop_never, sum[2], &work);
        keller_accel_cone(skewed, &c, clip, stop_never, stop_never, sum[3], &work);
        assert_memory_equal(sum[0], sum[1], sizeof sum[0]);
        if (c.tan_alpha < 0.01) assert_memory_equal(sum[2], sum[3], sizeof sum[2]); /* what is contained is reported by its corners */
        hits += met;
    }
    return hits;
}

static Model hair(void)
{
    KellerGenerate def = keller_generate_defaults(KELLER_GENERATE_HAIR);
    KellerSoup soup;
    def.strands = 40;
    assert_int_equal(keller_generate(&def, &soup, NULL), KELLER_OK);
    Model m = {.size = 5, .middle = v3(0, 0, 2), .vertex_count = (uint32_t)soup.vertex_count};
    m.vertices = malloc(soup.vertex_count * sizeof *m.vertices);
    m.triangles = malloc(soup.triangle_count * sizeof *m.triangles);
    m.edges = malloc(3 * soup.triangle_count * sizeof *m.edges);
    memcpy(m.vertices, soup.vertices, soup.vertex_count * sizeof *m.vertices);
    memcpy(m.triangles, soup.triangles, soup.triangle_count * sizeof *m.triangles);
    for (uint32_t i = 0; i < soup.triangle_count; i++) m.edges[i][0] = m.triangles[i][0], m.edges[i][1] = m.triangles[i][1];
    m.in = (KellerAccelInput){(uint32_t)soup.triangle_count, (uint32_t)soup.triangle_count, m.vertices, (const uint32_t (*)[3])m.triangles,
                              (const uint32_t (*)[2])m.edges};
    keller_soup_free(&soup);
    return m;
}

static void all_kinds(void **state)
{
    (void)state;
    static const ModelKind models[] = {MODEL_SPREAD, MODEL_GRID, MODEL_ROOM, MODEL_SPHERE, MODEL_DEGENERATE, MODEL_FAR_AWAY};
    enum { MODELS = sizeof models / sizeof *models };
    Random r = {7};
    uint64_t hits = 0;
    for (int s = 0; s <= MODELS; s++) {
        Model m = s < MODELS ? model_make(models[s], 400, &r) : hair();
        KellerAccel *plain, *skewed;
        assert_int_equal(keller_accel_new(&m.in, &(KellerAccelOptions){.name = "bvh8"}, &plain, NULL), KELLER_OK);
        for (int kind = 0; kind < 36; kind++) {
            KellerSkewedOptions how = {(KellerBoxes)(kind % 3), (KellerPairs)(kind / 3 % 3), kind & 1 ? 4 : 8, kind / 18, kind % 4 == 3};
            assert_int_equal(keller_accel_new(&m.in, &(KellerAccelOptions){.name = "ubvh", .skewed = how}, &skewed, NULL), KELLER_OK);
            assert_string_equal(keller_accel_name(skewed), "ubvh");
            for (int far = 0; far < 3; far++) hits += same_answers(&m, plain, skewed, (const double[]){1, 7, 1000}[far], &r);
            keller_accel_free(skewed);
        }
        keller_accel_free(plain);
        model_free(&m);
    }
    assert_true(hits > 20000);
}

/* Squares are found to be pairs by either way, and shrink the tree; nor is it large without. */
static void sizes(void **state)
{
    (void)state;
    Random r = {8};
    Model m = model_make(MODEL_GRID, 2000, &r);
    size_t bytes[3];
    for (int how = 0; how < 3; how++) {
        KellerAccel *accel;
        KellerAccelOptions o = {.name = "ubvh", .skewed.pairs = (KellerPairs)how};
        assert_int_equal(keller_accel_new(&m.in, &o, &accel, NULL), KELLER_OK);
        bytes[how] = accel->kind->bytes(accel->tree);
        keller_accel_free(accel);
    }
    assert_true(bytes[KELLER_PAIRS_PLOC] < 0.75 * (double)bytes[KELLER_PAIRS_NONE]);
    assert_true(bytes[KELLER_PAIRS_GREEDY] < 0.75 * (double)bytes[KELLER_PAIRS_NONE]);
    model_free(&m);
    m = hair(); /* nodes are full, or nearly: 448 bytes for eight triangles, and those above */
    KellerAccel *accel;
    assert_int_equal(keller_accel_new(&m.in, &(KellerAccelOptions){.name = "ubvh"}, &accel, NULL), KELLER_OK);
    assert_true(accel->kind->bytes(accel->tree) < 110 * (size_t)m.in.triangle_count);
    keller_accel_free(accel);
    model_free(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(around_one), cmocka_unit_test(around_two), cmocka_unit_test(fitted),
        cmocka_unit_test(all_kinds),  cmocka_unit_test(sizes),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
