/* Every query of every accelerator against the naive loop over all triangles and edges, on ordinary and hostile models; rays
 * that must not leak; cones that are called blocked. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "../cases.h"
#include "accel_model.h"
#include "base/number.h"
#include "io/generate.h"
#include "keller/ray.h"
#include "real_scene.h"

static const char *const names[] = {"kdtree", "bvh", "bvh8", "bvh+mask", "bvh8+mask", "ubvh", "dacrt"};
enum { NAMES = sizeof names / sizeof *names, TREES = NAMES - 1, RAYS = 24 }; /* dacrt alone is a loop: test_dacrt.c has its batches */

static KellerAccel *accel_with(const Model *m, const KellerAccelOptions *options)
{
    KellerAccel *accel;
    assert_int_equal(keller_accel_new(&m->in, options, &accel, NULL), KELLER_OK);
    assert_string_equal(keller_accel_name(accel), options->name);
    return accel;
}

static KellerAccel *accel_of(const Model *m, const char *name, double spatial, int threads)
{
    return accel_with(m, &(KellerAccelOptions){.name = name, .spatial = spatial, .threads = threads});
}

/* ---- the naive loops --------------------------------------------------------------------------------------------- */

static KellerRange naive_triangle(const Model *m, const KellerCone *cone, uint32_t i, KellerRange clip)
{
    return keller_cone_triangle(cone, model_corner(m, i, 0), model_corner(m, i, 1), model_corner(m, i, 2), clip, NULL, NULL);
}

static KellerRange naive_edge(const Model *m, const KellerCone *cone, uint32_t i, KellerRange clip)
{
    return keller_cone_edge(cone, m->vertices[m->edges[i][0]], m->vertices[m->edges[i][1]], clip, NULL, NULL);
}

static bool naive_ray(const Model *m, const KellerRay *ray, uint32_t i, KellerRange clip, double *t)
{
    return keller_ray_triangle(ray, model_corner(m, i, 0), model_corner(m, i, 1), model_corner(m, i, 2), clip, t, NULL);
}

/* ---- what visitors collect --------------------------------------------------------------------------------------- */

typedef struct {
    uint8_t *seen[2];       /* triangles, edges */
    KellerRange *range[2];
    KellerRange *naive[2];  /* what they should be */
    double *t, *naive_t;    /* NAN: not hit */
    uint8_t *within;        /* triangles that a segment surely comes as near to */
    KellerRayHit nearest_ray;
    KellerConeHit nearest_cone;
    uint32_t ray_hits;
    uint32_t stop, visits;  /* rays and segments: the visit that ends the query, 0 for none */
} Seen;

static Seen seen_new(const Model *m)
{
    Seen s = {.t = calloc(m->in.triangle_count + 1, sizeof(double)), .naive_t = calloc(m->in.triangle_count + 1, sizeof(double)),
              .within = calloc(m->in.triangle_count + 1, 1)};
    for (int e = 0; e < 2; e++) {
        s.seen[e] = calloc(m->in.edge_count + 1, 1);
        s.range[e] = calloc(m->in.edge_count + 1, sizeof(KellerRange));
        s.naive[e] = calloc(m->in.edge_count + 1, sizeof(KellerRange));
    }
    return s;
}

static void seen_clear(Seen *s, const Model *m, uint32_t stop)
{
    for (int e = 0; e < 2; e++) memset(s->seen[e], 0, m->in.edge_count + 1);
    s->stop = stop;
    s->visits = 0;
}

static void seen_free(Seen *s)
{
    free(s->t);
    free(s->naive_t);
    free(s->within);
    for (int e = 0; e < 2; e++) {
        free(s->seen[e]);
        free(s->range[e]);
        free(s->naive[e]);
    }
}

static double see_triangle(void *context, uint32_t i, KellerRange range)
{
    Seen *s = context;
    s->seen[0][i]++;
    s->range[0][i] = range;
    return INFINITY;
}

static double see_edge(void *context, uint32_t i, KellerRange range)
{
    Seen *s = context;
    s->seen[1][i]++;
    s->range[1][i] = range;
    return INFINITY;
}

static bool see_ray(void *context, KellerRayHit hit)
{
    Seen *s = context;
    s->seen[0][hit.triangle]++;
    s->t[hit.triangle] = hit.t;
    return ++s->visits == s->stop;
}

static bool see_segment(void *context, uint32_t i)
{
    Seen *s = context;
    s->seen[0][i]++;
    return ++s->visits == s->stop;
}

/* Contains the naive range, which contains the true one, but for the slack of double precision; and is no wider than that of
 * single precision. */
static bool same_range(KellerRange a, KellerRange naive, const KellerCone *c, double size)
{
    double reach = size + v3_norm(c->origin), loose = 4 * (double)KELLER_CONE_SLACK_FLOAT * reach, tight = 1e-12 * reach;
    return a.near <= naive.near + tight && a.far >= naive.far - tight && a.near >= naive.near - loose &&
           a.far <= naive.far + loose;
}

/* ---- rays and segments ------------------------------------------------------------------------------------------- */

/* The distance of a segment from a triangle is zero where they meet; else sampled from above. */
static bool surely_within(const Model *m, uint32_t i, KellerVec3 a, KellerVec3 b, double margin)
{
    KellerVec3 p = model_corner(m, i, 0), q = model_corner(m, i, 1), r = model_corner(m, i, 2), d = v3_sub(b, a);
    for (int k = 0; k <= 12; k++) {
        KellerVec3 from = k < 8 ? p : q, to = k < 4 ? q : r, on = v3_madd(from, v3_sub(to, from), k % 4 / 3.0);
        if (k == 12) on = v3_scale(v3_add(p, v3_add(q, r)), 1 / 3.0);
        double t = v3_dot(d, d) > 0 ? v3_dot(v3_sub(on, a), d) / v3_dot(d, d) : 0;
        if (v3_distance(on, v3_madd(a, d, lesser(greater(t, 0), 1))) <= margin * (1 - 1e-9)) return true;
    }
    KellerRay ray = keller_ray(a, v3_norm(d) > 0 ? d : v3(0, 0, 1));
    double t;
    return v3_norm(d) > 0 && naive_ray(m, &ray, i, (KellerRange){0, 1}, &t);
}

static void ask_segment_naively(const Model *m, KellerVec3 a, KellerVec3 b, double margin, Seen *seen)
{
    for (uint32_t i = 0; i < m->in.triangle_count; i++) seen->within[i] = surely_within(m, i, a, b, margin);
}

static void check_segment(const Model *m, const KellerAccel *accel, KellerVec3 a, KellerVec3 b, double margin, Seen *seen)
{
    KellerAccelWork work = {0};
    seen_clear(seen, m, 0);
    assert_false(keller_accel_segment(accel, a, b, margin, see_segment, seen, &work));
    for (uint32_t i = 0; i < m->in.triangle_count; i++)
        if (seen->seen[0][i] > 1 || seen->seen[0][i] < seen->within[i]) fail_msg("%s: triangle %u", keller_accel_name(accel), i);
    uint32_t all = seen->visits;
    if (all == 0) return;
    seen_clear(seen, m, (all + 1) / 2);
    assert_true(keller_accel_segment(accel, a, b, margin, see_segment, seen, &work));
    assert_int_equal(seen->visits, seen->stop);
}

/* The loop over all, once for all accelerators that are asked the same. */
static void ask_naively(const Model *m, const KellerCone *c, KellerRange clip, KellerVec3 direction, Seen *seen)
{
    KellerRay ray = keller_ray(c->origin, direction);
    seen->nearest_ray = (KellerRayHit){INFINITY, KELLER_NONE};
    seen->ray_hits = 0;
    for (uint32_t i = 0; i < m->in.triangle_count; i++) {
        double *t = &seen->naive_t[i];
        if (naive_ray(m, &ray, i, clip, t)) {
            if (*t < seen->nearest_ray.t) seen->nearest_ray = (KellerRayHit){*t, i};
            seen->ray_hits++;
        } else {
            *t = NAN;
        }
    }
}

static uint64_t check_ray(const Model *m, const KellerAccel *accel, const KellerCone *c, KellerRange clip, KellerVec3 direction,
                          Seen *seen)
{
    KellerAccelWork work = {0};
    KellerRayHit best = seen->nearest_ray, hit;
    uint32_t hits = seen->ray_hits;
    seen_clear(seen, m, 0);
    assert_false(keller_accel_ray_all(accel, c->origin, direction, clip, see_ray, seen, &work));
    for (uint32_t i = 0; i < m->in.triangle_count; i++) {
        if (seen->seen[0][i] != !isnan(seen->naive_t[i])) fail_msg("%s: triangle %u", keller_accel_name(accel), i);
        if (seen->seen[0][i] && seen->t[i] != seen->naive_t[i]) fail_msg("%s: t of %u", keller_accel_name(accel), i);
    }
    assert_int_equal(keller_accel_ray_any(accel, c->origin, direction, clip, &work), hits > 0);
    assert_int_equal(keller_accel_ray_nearest(accel, c->origin, direction, clip, &hit, &work), hits > 0);
    KellerRayHit batch[2];
    KellerVec3 origins[2] = {c->origin, c->origin}, directions[2] = {direction, v3_scale(direction, -2)};
    keller_accel_rays_nearest(accel, 2, origins, directions, clip, batch, 1, &work);
    assert_int_equal(batch[0].triangle, best.triangle);
    if (hits) assert_true(batch[0].t == best.t);
    if (hits == 0) return 0;
    assert_true(hit.t == best.t && hit.triangle == best.triangle);
    seen_clear(seen, m, (hits + 1) / 2);
    assert_true(keller_accel_ray_all(accel, c->origin, direction, clip, see_ray, seen, &work));
    assert_int_equal(seen->visits, seen->stop);
    return hits;
}

/* ---- cones ------------------------------------------------------------------------------------------------------- */

/* The triangles or edges that begin before `end`, and they alone, each once with its range. */
static uint32_t check_seen(const Model *m, const KellerCone *c, double end, bool edges, const Seen *seen)
{
    uint32_t hits = 0;
    for (uint32_t i = 0; i < (edges ? m->in.edge_count : m->in.triangle_count); i++) {
        KellerRange r = seen->naive[edges][i], got = seen->range[edges][i];
        bool met = r.near <= r.far && r.near <= end;
        if (seen->seen[edges][i] != met) { /* begins where the window ends, but for the slack */
            assert_true(seen->seen[edges][i] <= 1);
            assert_true(fabs(r.near - end) < 4 * (double)KELLER_CONE_SLACK_FLOAT * (2e4 + v3_norm(c->origin)));
        } else if (met && !same_range(got, r, c, 2e4)) {
            fail_msg("[%.17g, %.17g] for [%.17g, %.17g]", got.near, got.far, r.near, r.far);
        }
        hits += met;
    }
    return hits;
}

static void ask_cone_naively(const Model *m, const KellerCone *c, KellerRange clip, Seen *seen)
{
    seen->nearest_cone = (KellerConeHit){{INFINITY, -INFINITY}, KELLER_NONE};
    for (uint32_t i = 0; i < m->in.edge_count; i++) seen->naive[1][i] = naive_edge(m, c, i, clip);
    for (uint32_t i = 0; i < m->in.triangle_count; i++) {
        KellerRange r = seen->naive[0][i] = naive_triangle(m, c, i, clip);
        if (r.near <= r.far && r.near < seen->nearest_cone.range.near) seen->nearest_cone = (KellerConeHit){r, i};
    }
}

/* All that is met is seen once, within the range told; what else is, is no matter. */
static void check_seen_loosely(const Model *m, bool edges, const Seen *seen)
{
    for (uint32_t i = 0; i < (edges ? m->in.edge_count : m->in.triangle_count); i++) {
        const KellerRange r = seen->naive[edges][i], got = seen->range[edges][i];
        assert_true(seen->seen[edges][i] <= 1);
        if (r.near <= r.far && !(seen->seen[edges][i] == 1 && got.near <= r.near && got.far >= r.far))
            fail_msg("[%.17g, %.17g] for [%.17g, %.17g]", got.near, got.far, r.near, r.far);
    }
}

static uint64_t check_cone(const Model *m, const KellerAccel *accel, const KellerCone *c, KellerRange clip, double depth,
                           Seen *seen)
{
    KellerAccelWork work = {0};
    KellerConeHit best = seen->nearest_cone, hit;
    seen_clear(seen, m, 0);
    if (depth > 0) { /* in one walk, or two */
        keller_accel_cone(accel, c, clip, see_triangle, see_edge, seen, &work);
    } else {
        keller_accel_cone(accel, c, clip, see_triangle, NULL, seen, &work);
        keller_accel_cone(accel, c, clip, NULL, see_edge, seen, &work);
    }
    uint64_t hits = check_seen(m, c, INFINITY, false, seen);
    hits += check_seen(m, c, INFINITY, true, seen);
    seen_clear(seen, m, 0);
    keller_accel_cone_loosely(accel, c, clip, see_triangle, see_edge, seen, &work);
    for (int edges = 0; edges < 2; edges++) check_seen_loosely(m, edges, seen);
    bool met = best.primitive != KELLER_NONE;
    assert_int_equal(keller_accel_cone_any(accel, c, clip, &work), met);
    assert_int_equal(keller_accel_cone_nearest(accel, c, clip, &hit, &work), met);
    KellerConeHit batch[2];
    KellerCone cones[2] = {*c, *c};
    keller_accel_cones_nearest(accel, 2, cones, clip, batch, 1, &work);
    assert_int_equal(batch[1].primitive, best.primitive);
    if (met) {
        assert_int_equal(hit.primitive, best.primitive);
        assert_true(hit.range.near == best.range.near && hit.range.far == best.range.far);
    }
    for (int what = 0; what < 4; what++) { /* the window, with one visitor, the other, both, none */
        KellerConeHit nearest;
        seen_clear(seen, m, 0);
        assert_int_equal(keller_accel_cone_window(accel, c, clip, depth, &nearest, what & 1 ? see_triangle : NULL,
                                                  what & 2 ? see_edge : NULL, seen, &work),
                         met);
        if (met) assert_int_equal(nearest.primitive, best.primitive);
        double end = met ? best.range.near + depth : INFINITY;
        if (what & 1) check_seen(m, c, end, false, seen);
        if (what & 2) check_seen(m, c, end, true, seen);
    }
    return hits;
}

static void same_as_naive(void **state)
{
    (void)state;
    Random r = {4711};
    uint64_t hits = 0, cone_hits = 0;
    for (uint32_t s = 0; s < 5 * MODEL_KINDS; s++) {
        Model m = model_make((ModelKind)(s % MODEL_KINDS),
                             s < MODEL_KINDS ? 1 + random_u32(&r) % 20 : 20 + random_u32(&r) % 1000, &r);
        Seen seen = seen_new(&m);
        KellerAccel *accel[2 * NAMES];
        for (uint32_t k = 0; k < 2 * NAMES; k++) {
            /* each with every order and with all that can be switched, by turns */
            KellerAccelOptions o = {.name = names[k % NAMES], .spatial = k < NAMES ? 0 : 0.5, .threads = 1,
                                    .order = (KellerAccelOrder)((s + k) % 4), .contained = (int)((s / 4 + k) % 3) - 1,
                                    .leaf_boxes = (s + k / 2) % 2,
                                    .masks = {s % 3 ? 4 : 6, (int)(s % 4) - 1, s % 10 == 1, s % 4 == 1},
                                    .skewed = {(KellerBoxes)(s / 2 % 3), (KellerPairs)((s + k) % 3), s % 2 ? 8 : 4, s % 5 == 1, s % 3 == 1}};
            accel[k] = accel_with(&m, &o);
        }
        for (uint32_t q = 0; q < RAYS; q++) {
            KellerCone c = model_cone(&m, q, &r);
            KellerRange clip = {q % 2 ? random_in(&r, 0, 4) : 0, q % 3 == 1 ? random_in(&r, 4, 20) : INFINITY};
            KellerVec3 d = v3_scale(c.directrix, q % 4 ? 1 : 0.3), b = v3_add(m.middle, random_point(&r, 12));
            if (q % 4 == 0) b.x = c.origin.x; /* in the plane of box sides */
            if (q % 8 == 0) b.y = c.origin.y;
            if (q % 8 == 7) b = c.origin;
            ask_naively(&m, &c, clip, d, &seen);
            ask_cone_naively(&m, &c, clip, &seen);
            ask_segment_naively(&m, c.origin, b, q % 2 ? 0.1 : 0, &seen);
            for (uint32_t k = 0; k < 2 * NAMES; k++) {
                hits += check_ray(&m, accel[k], &c, clip, d, &seen);
                cone_hits += check_cone(&m, accel[k], &c, clip, q % 3 ? 0 : 0.5, &seen);
                check_segment(&m, accel[k], c.origin, b, q % 2 ? 0.1 : 0, &seen);
            }
        }
        for (uint32_t k = 0; k < 2 * NAMES; k++) keller_accel_free(accel[k]);
        seen_free(&seen);
        model_free(&m);
    }
    assert_true(hits > 4000 && cone_hits > 200000);
}

/* Rays in models of a size from a hair's hundredth to a planetary orbit, with directions as long as they may be. */
static void rays_of_any_scale(void **state)
{
    (void)state;
    static const double sizes[] = {1e-14, 1e-7, 1, 1e10}, lengths[] = {1e-15, 1e-9, 1, 1e9, 1e15};
    Random r = {77};
    uint64_t hits = 0;
    for (uint32_t s = 0; s < 4; s++) {
        Model m = model_make(s % 2 ? MODEL_SPREAD : MODEL_ROOM, 400, &r);
        for (uint32_t i = 0; i < m.vertex_count; i++) m.vertices[i] = v3_scale(m.vertices[i], sizes[s]);
        m.size *= sizes[s];
        Seen seen = seen_new(&m);
        KellerAccel *accel[NAMES];
        for (uint32_t k = 0; k < NAMES; k++) accel[k] = accel_of(&m, names[k], 0, 1);
        for (uint32_t q = 0; q < 500; q++) {
            KellerCone c = model_cone(&m, q, &r);
            double length = lengths[q % 5];
            KellerVec3 d = v3_scale(c.directrix, length);
            KellerRange clip = {0, q % 3 == 1 ? random_in(&r, 0, 2) * m.size / length : INFINITY};
            ask_naively(&m, &c, clip, d, &seen);
            for (uint32_t k = 0; k < NAMES; k++) hits += check_ray(&m, accel[k], &c, clip, d, &seen);
        }
        for (uint32_t k = 0; k < NAMES; k++) keller_accel_free(accel[k]);
        seen_free(&seen);
        model_free(&m);
    }
    assert_true(hits > 4000);
}

/* One side of one large triangle, given as an edge 15,000 times, must not be copied to every leaf that the triangle is in. */
static void same_edge_very_often(void **state)
{
    (void)state;
    Random r = {6};
    Model m = model_make(MODEL_SPREAD, 15000, &r);
    for (uint32_t k = 0; k < 3; k++) m.vertices[k] = v3(40 * (k == 1) - 12, 40 * (k == 2) - 12, 0.01 * k);
    for (uint32_t i = 0; i < m.in.triangle_count; i++) m.edges[i][0] = 0, m.edges[i][1] = 1;
    for (uint32_t k = 0; k < NAMES; k++) {
        KellerAccel *accel = accel_of(&m, names[k], 0.5, 1);
        assert_true(keller_accel_bytes(accel) < 400 * (size_t)m.in.edge_count);
        keller_accel_free(accel);
    }
    model_free(&m);
}

/* The same on a real scene and its wedges. Skipped without the scenes. */
static void same_as_naive_in_munich(void **state)
{
    (void)state;
    Random r = {9};
    KellerSoup soup = real_scene("sionna/munich/munich.xml");
    KellerScene scene;
    for (size_t i = 0; i < soup.material_count; i++) soup.materials[i].kind = KELLER_MATERIAL_CONDUCTOR;
    assert_int_equal(keller_scene_build(&soup, &scene, NULL), KELLER_OK);
    Model m = {.size = 300, .vertices = scene.vertices, .triangles = scene.triangles, .vertex_count = (uint32_t)scene.vertex_count};
    m.edges = malloc(scene.wedge_count * sizeof *m.edges);
    for (size_t i = 0; i < scene.wedge_count; i++) memcpy(m.edges[i], scene.wedges[i].vertex, sizeof *m.edges);
    m.in = (KellerAccelInput){(uint32_t)scene.triangle_count, (uint32_t)scene.wedge_count, scene.vertices,
                              (const uint32_t (*)[3])scene.triangles, (const uint32_t (*)[2])m.edges};
    assert_true(m.in.edge_count > m.in.triangle_count);
    Seen seen = seen_new(&m);
    KellerAccel *accel[NAMES];
    for (int k = 0; k < NAMES; k++) accel[k] = accel_of(&m, names[k], 0, 1);
    for (uint32_t q = 0; q < 12; q++) {
        KellerCone c = model_cone(&m, q, &r);
        ask_naively(&m, &c, (KellerRange){0, INFINITY}, c.directrix, &seen);
        ask_cone_naively(&m, &c, (KellerRange){0, INFINITY}, &seen);
        for (int k = 0; k < NAMES; k++) {
            check_ray(&m, accel[k], &c, (KellerRange){0, INFINITY}, c.directrix, &seen);
            check_cone(&m, accel[k], &c, (KellerRange){0, INFINITY}, q % 2, &seen);
        }
    }
    for (int k = 0; k < NAMES; k++) keller_accel_free(accel[k]);
    seen_free(&seen);
    free(m.edges);
    keller_scene_free(&scene);
    keller_soup_free(&soup);
}

/* Visitors that shorten the query still see what is nearer than where they cut. */
static double shorten(void *context, uint32_t i, KellerRange range)
{
    see_triangle(context, i, range);
    return range.near + 1;
}

static void shortened(void **state)
{
    (void)state;
    Random r = {12};
    for (uint32_t s = 0; s < 12; s++) {
        Model m = model_make(s % 2 ? MODEL_SPREAD : MODEL_GRID, 1000, &r);
        Seen seen = seen_new(&m);
        KellerAccel *accel = accel_of(&m, names[s % NAMES], s % 4 ? 0 : 0.3, 1);
        for (uint32_t q = 0; q < 50; q++) {
            KellerAccelWork work = {0};
            KellerCone c = model_cone(&m, q, &r);
            double end = INFINITY;
            seen_clear(&seen, &m, 0);
            keller_accel_cone(accel, &c, (KellerRange){0, INFINITY}, shorten, NULL, &seen, &work);
            for (uint32_t i = 0; i < m.in.triangle_count; i++)
                if (seen.seen[0][i]) end = lesser(end, seen.range[0][i].near + 1);
            for (uint32_t i = 0; i < m.in.triangle_count; i++) {
                KellerRange n = naive_triangle(&m, &c, i, (KellerRange){0, INFINITY});
                if (n.near <= lesser(n.far, end - 1e-3)) assert_int_equal(seen.seen[0][i], 1);
            }
        }
        keller_accel_free(accel);
        seen_free(&seen);
        model_free(&m);
    }
}

/* A batch's answers, and the work for them, are one thread's. */
static void same_batches(const Model *m, const KellerAccel *accel, Random *r)
{
    enum { BATCH = 1000 };
    KellerVec3 *origins = malloc(2 * BATCH * sizeof *origins), *directions = origins + BATCH;
    KellerCone *cones = malloc(BATCH * sizeof *cones);
    KellerRayHit *rays = malloc(2 * BATCH * sizeof *rays);
    KellerConeHit *hits = malloc(2 * BATCH * sizeof *hits);
    KellerAccelWork work[2] = {{0}, {0}};
    for (uint32_t i = 0; i < BATCH; i++) {
        cones[i] = model_cone(m, i, r);
        cones[i].tan_alpha *= 0.1;
        origins[i] = cones[i].origin;
        directions[i] = cones[i].directrix;
    }
    for (int k = 0; k < 2; k++) {
        keller_accel_rays_nearest(accel, BATCH, origins, directions, (KellerRange){0, INFINITY}, rays + BATCH * k, 1 + 2 * k, &work[k]);
        keller_accel_cones_nearest(accel, BATCH, cones, (KellerRange){0, INFINITY}, hits + BATCH * k, 1 + 2 * k, &work[k]);
    }
    for (uint32_t i = 0; i < BATCH; i++) {
        assert_true(rays[i].triangle == rays[i + BATCH].triangle && rays[i].t == rays[i + BATCH].t);
        assert_true(hits[i].primitive == hits[i + BATCH].primitive && hits[i].range.near == hits[i + BATCH].range.near);
    }
    assert_true(strcmp(keller_accel_name(accel), "dacrt") == 0 || work[0].triangles == work[1].triangles); /* which parts anew */
    free(origins);
    free(cones);
    free(rays);
    free(hits);
}

/* Equal answers, bytes and work for any number of threads. */
static void same_for_threads(void **state)
{
    (void)state;
    Random r = {31};
    Model m = model_make(MODEL_SPREAD, 20000, &r);
    for (uint32_t k = 0; k < 2 * NAMES; k++) {
        KellerAccel *one = accel_of(&m, names[k % NAMES], k < NAMES ? 0 : 0.3, 1);
        if (k < NAMES) same_batches(&m, one, &r);
        for (int threads = 2; threads <= 3; threads++) {
            KellerAccel *other = accel_of(&m, names[k % NAMES], k < NAMES ? 0 : 0.3, threads);
            KellerAccelWork a = {0}, b = {0};
            assert_int_equal(keller_accel_bytes(one), keller_accel_bytes(other));
            for (uint32_t q = 0; q < 100; q++) {
                KellerCone c = model_cone(&m, q, &r);
                KellerConeHit p = {{0, 0}, 0}, n = {{0, 0}, 0};
                keller_accel_cone_nearest(one, &c, (KellerRange){0, INFINITY}, &p, &a);
                keller_accel_cone_nearest(other, &c, (KellerRange){0, INFINITY}, &n, &b);
                assert_memory_equal(&p.range, &n.range, sizeof p.range);
                assert_int_equal(p.primitive, n.primitive);
            }
            assert_true(a.nodes == b.nodes && a.triangles == b.triangles && a.triangles > 0);
            keller_accel_free(other);
        }
        keller_accel_free(one);
    }
    model_free(&m);
}

/* ---- rays from inside closed models ------------------------------------------------------------------------------- */

enum { FROM_INSIDE = 1000000 };

/* As many rays from within the buildings of a city, which are closed solids beside each other, through a triangle of which
 * they start. */
static void watertight_city(void **state)
{
    (void)state;
    Random r = {78};
    KellerGenerate city = keller_generate_defaults(KELLER_GENERATE_CITY);
    KellerSoup soup;
    city.blocks = 40;
    assert_int_equal(keller_generate(&city, &soup, NULL), KELLER_OK);
    KellerAccelInput in = {.triangle_count = (uint32_t)soup.triangle_count, .vertices = soup.vertices,
                           .triangles = (const uint32_t (*)[3])soup.triangles};
    for (int k = 0; k < TREES; k++) {
        KellerAccel *accel;
        KellerAccelWork work = {0};
        assert_int_equal(keller_accel_new(&in, &(KellerAccelOptions){.name = names[k]}, &accel, NULL), KELLER_OK);
        for (uint64_t q = 0; q < cases_of(FROM_INSIDE) / TREES + 1;) {
            const uint32_t *t = in.triangles[random_u32(&r) % in.triangle_count];
            KellerVec3 a = in.vertices[t[0]], b = in.vertices[t[1]], c = in.vertices[t[2]];
            KellerVec3 normal = v3_unit(v3_cross(v3_sub(b, a), v3_sub(c, a)));
            if (normal.z > 0.999 && a.z == 0) continue; /* the ground */
            q++;
            KellerVec3 inside = v3_madd(v3_scale(v3_add(a, v3_add(b, c)), 1 / 3.0), normal, -0.01), d = random_unit(&r);
            if (q % 4 == 1) d = v3_sub(a, inside);
            if (q % 4 == 2) d = v3_sub(v3_madd(a, v3_sub(b, a), random_in(&r, 0, 1)), inside);
            if (q % 32 == 3) d = v3(0, q & 64 ? 1 : 0, q & 64 ? 0 : 1);
            KellerRayHit hit;
            if (!keller_accel_ray_nearest(accel, inside, d, (KellerRange){0, INFINITY}, &hit, &work) ||
                !keller_accel_ray_any(accel, inside, d, (KellerRange){0, INFINITY}, &work))
                fail_msg("%s: (%a, %a, %a) towards (%a, %a, %a) leaks", names[k], inside.x, inside.y, inside.z, d.x, d.y, d.z);
        }
        keller_accel_free(accel);
    }
    keller_soup_free(&soup);
}

static void watertight(void **state)
{
    (void)state;
    Random r = {77};
    const uint64_t all = cases_of(FROM_INSIDE), models = 8, each = all / (models * TREES) + 1;
    for (uint32_t s = 0; s < models; s++) {
        Model m = model_make(s % 2 ? MODEL_ROOM : MODEL_SPHERE, (uint32_t[]){100, 600, 3000, 8000}[s / 2], &r);
        KellerVec3 middle = s == 3 || s == 4 ? v3(1e5, 2e5, -3e4) : v3(0, 0, 0);
        for (uint32_t i = 0; i < m.vertex_count; i++) m.vertices[i] = v3_add(m.vertices[i], middle);
        for (int k = 0; k < TREES; k++) {
            KellerAccel *accel = accel_of(&m, names[k], s % 4 == 2 ? 0.3 : 0, 1);
            KellerAccelWork work = {0};
            for (uint64_t q = 0; q < each; q++) {
                KellerVec3 origin = v3_add(middle, random_point(&r, q % 7 ? 2 : 0)), d = random_unit(&r);
                uint32_t t = random_u32(&r) % m.in.triangle_count;
                KellerVec3 a = model_corner(&m, t, 0), b = model_corner(&m, t, 1);
                if (q % 4 == 1) d = v3_sub(a, origin); /* at a vertex, at an edge, along an axis */
                if (q % 4 == 2) d = v3_sub(v3_madd(a, v3_sub(b, a), random_in(&r, 0, 1)), origin);
                if (q % 32 == 3) d = (KellerVec3[]){v3(1, 0, 0), v3(0, -2, 0), v3(0, 0, 0.5)}[q / 32 % 3];
                KellerRayHit hit;
                KellerRange clip = {0, INFINITY};
                if (!keller_accel_ray_nearest(accel, origin, d, clip, &hit, &work) ||
                    !keller_accel_ray_any(accel, origin, d, clip, &work))
                    fail_msg("%s, model %u: (%a, %a, %a) towards (%a, %a, %a) leaks", names[k], s, origin.x, origin.y,
                             origin.z, d.x, d.y, d.z);
            }
            keller_accel_free(accel);
        }
        model_free(&m);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_as_naive),
        cmocka_unit_test(rays_of_any_scale),
        cmocka_unit_test(same_edge_very_often),
        cmocka_unit_test(same_as_naive_in_munich),
        cmocka_unit_test(shortened),
        cmocka_unit_test(same_for_threads),
        cmocka_unit_test(watertight),
        cmocka_unit_test(watertight_city),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
