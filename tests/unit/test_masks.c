/* Masks: no cell that holds something, or that is passed, is without its bit; and no hit is lost with them. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "accel/masked.h"
#include "accel_model.h"
#include "accel/ray8.h"
#include "base/number.h"
#include "../cases.h"

/* Boxes of all shapes: flat ones, thin ones, far away from the middle. */
static AccelBox random_box(Random *r, uint32_t q)
{
    AccelBox b;
    for (int k = 0; k < 3; k++) {
        double at = random_in(r, -10, 10) * (q % 5 == 3 ? 1e4 : 1), side = pow(10, random_in(r, -3, 1));
        if ((q >> k) % 7 == 5) side = 0;
        b.lower[k] = (float)at;
        b.upper[k] = (float)(at + side);
    }
    return b;
}

static int cell(const AccelBox *b, int k, double at, int R)
{
    double side = (double)b->upper[k] - (double)b->lower[k];
    int i = side > 0 ? (int)((at - (double)b->lower[k]) / side * R) : 0;
    return i < 0 ? 0 : i >= R ? R - 1 : i;
}

static bool holds(int R, const Mask *m, const AccelBox *b, KellerVec3 p)
{
    return m->slice[cell(b, 2, p.z, R)] >> (cell(b, 0, p.x, R) + R * cell(b, 1, p.y, R)) & 1;
}

static bool inside(const AccelBox *b, KellerVec3 p)
{
    const double at[3] = {p.x, p.y, p.z};
    bool in = true;
    for (int k = 0; k < 3; k++) in = in && at[k] >= (double)b->lower[k] && at[k] <= (double)b->upper[k];
    return in;
}

static KellerVec3 point_in(const AccelBox *b, Random *r)
{
    double p[3];
    for (int k = 0; k < 3; k++) p[k] = (double)b->lower[k] + random_in(r, 0, 1) * ((double)b->upper[k] - (double)b->lower[k]);
    return v3(p[0], p[1], p[2]);
}

/* A triangle through the box: some within it, some far larger, some degenerate. */
static void random_triangle(const AccelBox *b, Random *r, uint32_t q, KellerVec3 v[3])
{
    for (int j = 0; j < 3; j++) v[j] = point_in(b, r);
    if (q % 3 == 1) {
        KellerVec3 c = v[0];
        for (int j = 0; j < 3; j++) v[j] = v3_add(c, random_point(r, pow(10, random_in(r, -2, 4))));
    }
    if (q % 11 == 7) v[2] = v[1];
    if (q % 22 == 7) v[1] = v[0];
}

static void hold_primitives(void **state)
{
    (void)state;
    Random r = {5};
    uint64_t held = 0, empty = 0;
    for (uint32_t q = 0; q < 20000; q++) {
        int R = q % 2 ? 4 : 6;
        AccelBox b = random_box(&r, q), outer = b;
        KellerVec3 v[3];
        Mask m = {{0}}, parent = {{0}}, segment = {{0}};
        random_triangle(&b, &r, q, v);
        mask_add(R, &b, v, 3, &m);
        mask_add(R, &b, v, 2, &segment);
        for (int k = 0; k < 3; k++) { /* the box above: its child somewhere in it */
            outer.lower[k] -= (float)random_in(&r, 0, 3);
            outer.upper[k] += (float)random_in(&r, 0, 3);
        }
        mask_add_child(R, &outer, &b, &m, &parent);
        for (int i = 0; i < 60; i++) {
            double s = random_in(&r, 0, 1), t = i % 3 ? random_in(&r, 0, 1 - s) : 0;
            KellerVec3 p = v3_madd(v3_madd(v[0], v3_sub(v[1], v[0]), s), v3_sub(v[2], v[0]), t);
            if (!inside(&b, p)) continue;
            held++;
            assert_true(holds(R, &m, &b, p));
            assert_true(holds(R, &parent, &outer, p));
            if (t == 0) assert_true(holds(R, &segment, &b, p));
        }
        empty += (uint64_t)(R * R * R - mask_bits(R, &m));
    }
    assert_true(held > 100000 && empty > 500000);
}

/* A cone or ray (as queries make them ready) that aims at the box, more or less. */
static KellerConeLanes aimed(const AccelBox *b, Random *r, uint32_t q, KellerCone *cone)
{
    Model m = {.size = 10};
    *cone = model_cone(&m, q, r);
    if (q % 3) {
        KellerVec3 d = v3_sub(point_in(b, r), cone->origin), major = v3_perpendicular(v3_unit(d));
        double e = cone->e, x0 = cone->x0, T = cone->tan_alpha;
        *cone = keller_cone_elliptic(cone->origin, v3_unit(d), v3_add(major, v3_scale(v3_cross(v3_unit(d), major), 0.7)), atan(T),
                                     sqrt(1 - 1 / (e * e)), x0);
    }
    double size = 0;
    for (int k = 0; k < 3; k++) size = greater(size, greater(fabs((double)b->lower[k]), fabs((double)b->upper[k])));
    return keller_cone_lanes(cone, (KellerRange){0, INFINITY}, size);
}

static KellerConeLanes ray_to(const AccelBox *b, Random *r, KellerVec3 *origin, KellerVec3 *d, uint32_t q)
{
    KellerAccel a = {.size = 0};
    Ray8 ray;
    KellerConeLanes lanes = {.tan_alpha = 0};
    for (int k = 0; k < 3; k++) a.size = greater(a.size, greater(fabs((double)b->lower[k]), fabs((double)b->upper[k])));
    *origin = q % 4 ? random_point(r, 20) : point_in(b, r);
    *d = v3_sub(point_in(b, r), *origin);
    if (q % 5 == 1) d->x = 0;
    if (q % 10 == 1) d->y = 0;
    if (v3_norm(*d) == 0) *d = v3(0, 0, 1);
    ray8_make(&a, *origin, *d, (KellerRange){0, INFINITY}, &ray, &lanes);
    return lanes;
}

static uint64_t packed(const Mask *m) { return m->slice[0] | m->slice[1] << 16 | m->slice[2] << 32 | m->slice[3] << 48; }

/* Points of the frustum in the box are in cells of its passage; the vectorised passage is the same, bit for bit; those of the table
 * hold the exact ones' points. */
static void hold_passages(void **state)
{
    (void)state;
    Random r = {6};
    MaskTable table[2];
    uint64_t held = 0, rays = 0, bits[2] = {0};
    for (int i = 0; i < 2; i++) assert_int_equal(mask_table(i ? 6 : 4, &table[i], NULL), KELLER_OK);
    for (uint32_t q = 0; q < 40000; q++) {
        int R = q % 2 ? 4 : 6;
        AccelBox b = random_box(&r, q);
        KellerVec3 origin, d;
        KellerCone cone;
        bool ray = q / 2 % 2;
        KellerConeLanes lanes = ray ? ray_to(&b, &r, &origin, &d, q) : aimed(&b, &r, q, &cone);
        const MaskWalk walk = mask_walk(&lanes);
        float far = q % 9 == 2 ? 5 : INFINITY;
        Mask m = mask_passage(R, &b, &walk.f, far), looked = ray ? mask_lookup(&table[R == 6], &b, &walk.f, far) : m;
        if (R == 4) {
            uint64_t fast = mask_passage4(&walk, b.lower, b.upper, far, UINT64_MAX);
            assert_true(fast == packed(&m));
            assert_true(mask_passage4(&walk, b.lower, b.upper, far, 0xf0f0) == (packed(&m) & 0xf0f0));
        }
        for (int i = 0; i < 40; i++) {
            KellerVec3 p = point_in(&b, &r);
            if (ray) { /* where it enters, leaves, and between */
                double t[2] = {0, (double)far};
                const double o[3] = {origin.x, origin.y, origin.z}, D[3] = {d.x, d.y, d.z};
                for (int k = 0; k < 3; k++) {
                    double u = ((double)b.lower[k] - o[k]) / D[k], v = ((double)b.upper[k] - o[k]) / D[k];
                    t[0] = greater(t[0], lesser(u, v));
                    t[1] = lesser(t[1], greater(u, v));
                }
                if (!(t[0] <= t[1])) break;
                p = v3_madd(origin, d, i < 2 ? t[i] : random_in(&r, t[0], t[1]));
            } else if (!keller_cone_contains(&cone, p) || v3_dot(v3_sub(p, cone.origin), cone.directrix) > (double)far) {
                continue;
            }
            if (!inside(&b, p)) continue;
            held++;
            assert_true(holds(R, &m, &b, p));
            assert_true(holds(R, &looked, &b, p));
        }
        if (!ray) continue;
        rays++;
        bits[0] += (uint64_t)mask_bits(R, &m);
        bits[1] += (uint64_t)mask_bits(R, &looked);
    }
    assert_true(held > 200000);
    assert_true(bits[0] < 30 * rays && bits[1] < 110 * rays); /* of 64 and 216, as often: not simply full */
    for (int i = 0; i < 2; i++) mask_table_free(&table[i]);
}

/* The mask that is found is the brute force's. */
static void compress(void **state)
{
    (void)state;
    enum { MASKS = 2000 };
    Random r = {8};
    for (int R = 4; R <= 6; R += 2) {
        Mask *masks = calloc(MASKS, sizeof *masks);
        float areas[MASKS];
        MaskPalette p;
        for (int i = 0; i < MASKS; i++) {
            AccelBox unit = {{0, 0, 0}, {1, 1, 1}};
            KellerVec3 v[3];
            random_triangle(&unit, &r, 0, v);
            mask_add(R, &unit, v, 3, &masks[i]);
            areas[i] = (float)random_in(&r, 0, 1);
        }
        assert_int_equal(mask_palette(R, MASKS, masks, areas, &p, NULL), KELLER_OK);
        assert_int_equal(p.count, MASK_PALETTE);
        for (int i = 0; i < MASKS; i++) {
            int best = -1, found = mask_find(&p, &masks[i]);
            for (int k = 0; k < p.count && best < 0; k++) {
                bool all = true;
                for (int z = 0; z < R; z++) all = all && !(masks[i].slice[z] & ~p.mask[k].slice[z]);
                if (all) best = k;
            }
            assert_int_equal(found, best);
            if (found > 0) assert_true(mask_bits(R, &p.mask[found]) >= mask_bits(R, &p.mask[found - 1]));
        }
        mask_palette_free(&p);
        free(masks);
    }
}

static double count(void *context, uint32_t primitive, KellerRange range)
{
    (void)range;
    *(uint64_t *)context += 1 + (uint64_t)primitive * 2654435761u;
    return INFINITY;
}

/* Rays and cones over masked and bare trees of the same model: the same nearest hits, and the same sums over all that is met. */
static void cull_no_hit(void **state)
{
    (void)state;
    static const KellerMaskOptions how[] = {{0}, {.levels = 1}, {.levels = -1, .table = true}, {.compressed = true},
                                            {.resolution = 6, .levels = 2}, {.resolution = 6, .compressed = true, .table = true}};
    enum { HOW = sizeof how / sizeof *how };
    const uint64_t each = cases_of(500000) / (MODEL_KINDS * HOW) + 1;
    Random r = {99};
    uint64_t hits = 0, spared = 0;
    for (uint32_t s = 0; s < MODEL_KINDS * HOW; s++) {
        Model m = model_make((ModelKind)(s % MODEL_KINDS), 300, &r);
        const char *bare_name = s % 2 ? "bvh" : "bvh8", *masked_name = s % 2 ? "bvh+mask" : "bvh8+mask";
        double spatial = s % 5 == 2 ? 0.5 : 0;
        KellerAccel *bare, *masked;
        assert_int_equal(keller_accel_new(&m.in, &(KellerAccelOptions){.name = bare_name, .spatial = spatial}, &bare, NULL), KELLER_OK);
        KellerAccelOptions o = {.name = masked_name, .spatial = spatial, .masks = how[s / MODEL_KINDS]};
        assert_int_equal(keller_accel_new(&m.in, &o, &masked, NULL), KELLER_OK);
        for (uint64_t q = 0; q < each; q++) {
            KellerCone c = model_cone(&m, (uint32_t)q, &r);
            KellerRange clip = {q % 2 ? random_in(&r, 0, 4) : 0, q % 3 == 1 ? random_in(&r, 4, 20) : INFINITY};
            KellerAccelWork work[2] = {{0}, {0}};
            if (q % 2) {
                KellerRayHit a, b;
                bool hit = keller_accel_ray_nearest(bare, c.origin, c.directrix, clip, &a, &work[0]);
                assert_int_equal(keller_accel_ray_nearest(masked, c.origin, c.directrix, clip, &b, &work[1]), hit);
                if (hit) assert_true(a.triangle == b.triangle && a.t == b.t);
                hits += hit;
            } else {
                KellerConeHit a, b;
                bool hit = keller_accel_cone_nearest(bare, &c, clip, &a, &work[0]);
                assert_int_equal(keller_accel_cone_nearest(masked, &c, clip, &b, &work[1]), hit);
                if (hit) assert_true(a.primitive == b.primitive && a.range.near == b.range.near && a.range.far == b.range.far);
                uint64_t all[2][2] = {{0}};
                if (q % 8 == 0) keller_accel_cone(bare, &c, clip, count, count, all[0], &work[0]);
                if (q % 8 == 0) keller_accel_cone(masked, &c, clip, count, count, all[1], &work[1]);
                assert_true(all[0][0] == all[1][0]);
                hits += hit;
            }
            assert_true(work[1].nodes <= work[0].nodes || s % MODEL_KINDS != MODEL_SPREAD || work[1].triangles <= work[0].triangles + 8);
            spared += work[0].triangles > work[1].triangles;
        }
        keller_accel_free(bare);
        keller_accel_free(masked);
        model_free(&m);
    }
    const uint64_t all = each * MODEL_KINDS * HOW;
    assert_true(hits > all / 10 && spared > all / 100);
}

static void refused(void **state)
{
    (void)state;
    Random r = {1};
    Model m = model_make(MODEL_SPREAD, 10, &r);
    KellerAccel *accel;
    KellerError error;
    KellerAccelOptions o = {.name = "bvh8+mask", .masks.resolution = 5};
    assert_int_equal(keller_accel_new(&m.in, &o, &accel, &error), KELLER_BAD_INPUT);
    assert_null(accel);
    o = (KellerAccelOptions){.name = "kdtree+mask"};
    assert_int_equal(keller_accel_new(&m.in, &o, &accel, &error), KELLER_BAD_INPUT);
    o = (KellerAccelOptions){.name = "auto+mask"};
    assert_int_equal(keller_accel_new(&m.in, &o, &accel, &error), KELLER_OK);
    assert_string_equal(keller_accel_name(accel), "bvh8+mask");
    keller_accel_free(accel);
    model_free(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hold_primitives), cmocka_unit_test(hold_passages), cmocka_unit_test(compress),
        cmocka_unit_test(cull_no_hit),     cmocka_unit_test(refused),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
