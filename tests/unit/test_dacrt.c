/* Batches without a structure: the answers of bvh8 and of the naive loop, in the memory that was said. The linker has the library's
 * allocations pass through here. KELLER_CASES sets the number of rays from inside closed models. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "../cases.h"
#include "accel_model.h"
#include "base/number.h"

static size_t allocated;
static uint64_t allocations;
static bool refused;

void *__real_malloc(size_t bytes);
void *__real_calloc(size_t count, size_t bytes);
void *__real_realloc(void *p, size_t bytes);
void *__real_aligned_alloc(size_t alignment, size_t bytes);
void *__wrap_malloc(size_t bytes);
void *__wrap_calloc(size_t count, size_t bytes);
void *__wrap_realloc(void *p, size_t bytes);
void *__wrap_aligned_alloc(size_t alignment, size_t bytes);

static bool grant(size_t bytes)
{
    allocated += bytes;
    allocations++;
    return !refused;
}

void *__wrap_malloc(size_t bytes) { return grant(bytes) ? __real_malloc(bytes) : NULL; }
void *__wrap_calloc(size_t count, size_t bytes) { return grant(count * bytes) ? __real_calloc(count, bytes) : NULL; }
void *__wrap_realloc(void *p, size_t bytes) { return grant(bytes) ? __real_realloc(p, bytes) : NULL; }
void *__wrap_aligned_alloc(size_t alignment, size_t bytes) { return grant(bytes) ? __real_aligned_alloc(alignment, bytes) : NULL; }

enum { BATCH = 700 };

typedef struct {
    Model model;
    KellerAccel *dacrt, *bvh8;
    KellerVec3 origins[BATCH], directions[BATCH];
    KellerCone cones[BATCH];
} World;

static KellerAccel *accel_of(const Model *m, const char *name)
{
    KellerAccel *accel;
    assert_int_equal(keller_accel_new(&m->in, &(KellerAccelOptions){.name = name}, &accel, NULL), KELLER_OK);
    return accel;
}

static World *world_of(ModelKind kind, uint32_t count, Random *r)
{
    World *w = malloc(sizeof *w);
    w->model = model_make(kind, count, r);
    w->dacrt = accel_of(&w->model, "dacrt");
    w->bvh8 = accel_of(&w->model, "bvh8");
    assert_string_equal(keller_accel_name(w->dacrt), "dacrt");
    for (uint32_t i = 0; i < BATCH; i++) {
        w->cones[i] = model_cone(&w->model, i, r);
        w->origins[i] = w->cones[i].origin;
        w->directions[i] = v3_scale(w->cones[i].directrix, i % 5 ? 1 : 0.3);
        if (i % 200 < 100) continue;
        /* packets: of one origin, narrow and wide ones, of 34 to 100 rays */
        w->origins[i] = w->origins[i - i % (i % 400 < 200 ? 100 : 34)];
        w->directions[i] = v3_madd(w->directions[i - i % 100], random_unit(r), i % 600 < 200 ? 0.03 : 0.4);
        if (v3_norm(w->directions[i]) == 0) w->directions[i] = v3(1, 0, 0);
    }
    return w;
}

static void world_free(World *w)
{
    keller_accel_free(w->dacrt);
    keller_accel_free(w->bvh8);
    model_free(&w->model);
    free(w);
}

/* Nearest hits, bit for bit; returns how many. */
static uint64_t check_nearest(const World *w, size_t count, KellerRange clip, int threads)
{
    KellerAccelWork work = {0}, other = {0};
    KellerRayHit rays[BATCH];
    KellerConeHit cones[BATCH];
    uint64_t hits = 0;
    allocated = allocations = 0;
    keller_accel_rays_nearest(w->dacrt, count, w->origins, w->directions, clip, rays, threads, &work);
    if (threads == 1) { /* what was said, and no more */
        assert_int_equal(allocations, count > 0);
        assert_int_equal(allocated, keller_accel_rays_bytes(w->dacrt, count, 1));
    }
    allocated = allocations = 0;
    keller_accel_cones_nearest(w->dacrt, count, w->cones, clip, cones, threads, &work);
    if (threads == 1) {
        assert_int_equal(allocations, count > 0);
        assert_int_equal(allocated, keller_accel_cones_bytes(w->dacrt, count, 1));
    }
    for (size_t i = 0; i < count; i++) {
        KellerRayHit ray = {INFINITY, KELLER_NONE};
        KellerConeHit cone = {{INFINITY, -INFINITY}, KELLER_NONE};
        keller_accel_ray_nearest(w->bvh8, w->origins[i], w->directions[i], clip, &ray, &other);
        keller_accel_cone_nearest(w->bvh8, &w->cones[i], clip, &cone, &other);
        assert_int_equal(rays[i].triangle, ray.triangle);
        assert_true(rays[i].t == ray.t);
        assert_int_equal(cones[i].primitive, cone.primitive);
        assert_true(cones[i].range.near == cone.range.near && cones[i].range.far == cone.range.far);
        hits += ray.triangle != KELLER_NONE;
        hits += cone.primitive != KELLER_NONE;
    }
    return hits;
}

/* What visitors are told, a row a query: triangles, then edges. */
typedef struct {
    uint32_t triangles, row;
    KellerRange *range;             /* empty until told */
    double depth;                   /* behind where a range begins, what is still of interest */
} Told;

static double tell(Told *t, size_t query, uint32_t i, KellerRange range)
{
    KellerRange *r = &t->range[query * t->row + i];
    assert_true(r->near > r->far); /* once */
    *r = range;
    return range.near + t->depth;
}

static double told_triangle(void *context, size_t query, uint32_t i, KellerRange range) { return tell(context, query, i, range); }
static double told_edge(void *context, size_t query, uint32_t i, KellerRange range)
{
    Told *t = context;
    return tell(t, query, t->triangles + i, range);
}

/* All of a batch of cones against the naive loop: all ranges or, cut at `depth`, at least those before the cut, and none but true ones. */
static uint64_t check_all(const World *w, const KellerAccel *accel, size_t count, KellerRange clip, double depth)
{
    const KellerAccelInput *in = &w->model.in;
    Told t = {.triangles = in->triangle_count, .row = in->triangle_count + in->edge_count, .depth = depth};
    KellerAccelWork work = {0};
    uint64_t hits = 0;
    t.range = malloc((count * t.row + 1) * sizeof *t.range);
    for (size_t i = 0; i < count * t.row; i++) t.range[i] = (KellerRange){INFINITY, -INFINITY};
    allocated = allocations = 0;
    keller_accel_cones(accel, count, w->cones, clip, told_triangle, told_edge, &t, &work);
    if (accel == w->dacrt) assert_int_equal(allocated, keller_accel_cones_bytes(accel, count, 1));
    for (size_t q = 0; q < count; q++) {
        double end[2] = {INFINITY, INFINITY}, loose = 1e-3;
        for (uint32_t i = 0; i < t.row; i++) {
            KellerRange told = t.range[q * t.row + i];
            int edge = i >= t.triangles;
            if (told.near <= told.far) end[edge] = lesser(end[edge], told.near + depth);
        }
        end[0] = end[1] = lesser(end[0], end[1]); /* one shortens the other, in whichever order */
        for (uint32_t i = 0; i < t.row; i++) {
            const uint32_t *v = i < t.triangles ? in->triangles[i] : in->edges[i - t.triangles];
            KellerRange told = t.range[q * t.row + i];
            KellerRange naive = i < t.triangles ? keller_cone_triangle(&w->cones[q], in->vertices[v[0]], in->vertices[v[1]],
                                                                       in->vertices[v[2]], clip, NULL, NULL)
                                                : keller_cone_edge(&w->cones[q], in->vertices[v[0]], in->vertices[v[1]], clip, NULL, NULL);
            bool met = naive.near <= naive.far;
            if (told.near <= told.far) {
                assert_true(met);
                if (accel == w->dacrt) assert_true(told.near == naive.near && told.far == naive.far);
                hits++;
            } else {
                assert_false(met && naive.near < end[0] - loose);
            }
        }
    }
    free(t.range);
    return hits;
}

static void same_as_others(void **state)
{
    (void)state;
    Random r = {2011};
    uint64_t hits = 0, all = 0;
    for (uint32_t s = 0; s < 4 * MODEL_KINDS; s++) {
        World *w = world_of((ModelKind)(s % MODEL_KINDS), s < MODEL_KINDS ? 1 + random_u32(&r) % 40 : 30 + random_u32(&r) % 1500, &r);
        for (int clipped = 0; clipped < 2; clipped++) {
            KellerRange clip = {clipped ? random_in(&r, 0, 3) : 0, clipped ? random_in(&r, 3, 20) : INFINITY};
            for (int threads = 1; threads <= 3; threads++) hits += check_nearest(w, s % 3 ? BATCH : 1 + s, clip, threads);
            all += check_all(w, w->dacrt, 40, clip, INFINITY);
            all += check_all(w, s % 2 ? w->dacrt : w->bvh8, 40, clip, 1);
        }
        check_nearest(w, 0, (KellerRange){0, INFINITY}, 1);
        world_free(w);
    }
    assert_true(hits > 20000 && all > 100000);
}

/* Coincident triangles cannot be parted by place, nor can a thousand in one plane by depth: the stack stays within bounds. */
static void hostile(void **state)
{
    (void)state;
    Random r = {3};
    for (uint32_t s = 0; s < 3; s++) {
        World *w = world_of(s ? MODEL_DUPLICATES : MODEL_ONE_POINT, 30000, &r);
        if (s == 2) { /* each twice as far as the one before: means part off one at a time */
            keller_accel_free(w->dacrt);
            keller_accel_free(w->bvh8);
            for (uint32_t i = 0; i < w->model.vertex_count; i++)
                w->model.vertices[i] = v3_add(v3(exp2(-(double)(i / 3 % 60)) * 8, 0, 0), random_point(&r, 1e-3));
            w->dacrt = accel_of(&w->model, "dacrt");
            w->bvh8 = accel_of(&w->model, "bvh8");
        }
        check_nearest(w, BATCH, (KellerRange){0, INFINITY}, 1);
        world_free(w);
    }
}

/* "auto" takes dacrt where little is asked, and said to be. */
static void chosen(void **state)
{
    (void)state;
    static const struct {
        size_t rays, cones;
        const char *name;
    } jobs[] = {{0, 0, "bvh8"}, {10, 0, "dacrt"}, {0, 10, "dacrt"}, {100, 0, "dacrt"}, {101, 0, "bvh8"}, {0, 33, "dacrt"},
              {0, 34, "bvh8"}};
    Random r = {4};
    Model m = model_make(MODEL_SPREAD, 100, &r);
    for (size_t i = 0; i < sizeof jobs / sizeof *jobs; i++) {
        KellerAccel *accel;
        KellerAccelOptions o = {.name = i % 2 ? "auto" : NULL, .rays = jobs[i].rays, .cones = jobs[i].cones};
        assert_int_equal(keller_accel_new(&m.in, &o, &accel, NULL), KELLER_OK);
        assert_string_equal(keller_accel_name(accel), jobs[i].name);
        keller_accel_free(accel);
    }
    model_free(&m);
}

/* Without memory the queries are asked one by one. */
static void without_memory(void **state)
{
    (void)state;
    Random r = {4};
    World *w = world_of(MODEL_SPREAD, 300, &r);
    KellerRayHit with[BATCH], without[BATCH];
    KellerConeHit cones[2][BATCH];
    KellerAccelWork work = {0};
    const KellerRange clip = {0, INFINITY};
    keller_accel_rays_nearest(w->dacrt, BATCH, w->origins, w->directions, clip, with, 1, &work);
    keller_accel_cones_nearest(w->dacrt, BATCH, w->cones, clip, cones[0], 1, &work);
    refused = true;
    keller_accel_rays_nearest(w->dacrt, BATCH, w->origins, w->directions, clip, without, 1, &work);
    keller_accel_cones_nearest(w->dacrt, BATCH, w->cones, clip, cones[1], 1, &work);
    refused = false;
    for (uint32_t i = 0; i < BATCH; i++) {
        assert_int_equal(with[i].triangle, without[i].triangle);
        assert_true(with[i].t == without[i].t);
        assert_int_equal(cones[0][i].primitive, cones[1][i].primitive);
    }
    world_free(w);
}

/* Rays from inside closed models never leak. */
static void watertight(void **state)
{
    (void)state;
    const size_t each = cases_of(400000) / 4 + 1;
    Random r = {78};
    KellerVec3 *origins = malloc(each * sizeof *origins), *directions = malloc(each * sizeof *directions);
    KellerRayHit *hits = malloc(each * sizeof *hits);
    for (uint32_t s = 0; s < 4; s++) {
        Model m = model_make(s % 2 ? MODEL_ROOM : MODEL_SPHERE, s < 2 ? 600 : 20000, &r);
        KellerAccel *accel = accel_of(&m, "dacrt");
        KellerAccelWork work = {0};
        for (size_t q = 0; q < each; q++) {
            KellerVec3 a = model_corner(&m, random_u32(&r) % m.in.triangle_count, 0);
            origins[q] = random_point(&r, q % 7 ? 2 : 0);
            directions[q] = q % 4 == 1 ? v3_sub(a, origins[q]) : random_unit(&r);
            if (q % 32 == 3) directions[q] = (KellerVec3[]){v3(1, 0, 0), v3(0, -2, 0), v3(0, 0, 0.5)}[q / 32 % 3];
        }
        keller_accel_rays_nearest(accel, each, origins, directions, (KellerRange){0, INFINITY}, hits, 1, &work);
        for (size_t q = 0; q < each; q++) assert_int_not_equal(hits[q].triangle, KELLER_NONE);
        keller_accel_free(accel);
        model_free(&m);
    }
    free(origins);
    free(directions);
    free(hits);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_as_others), cmocka_unit_test(hostile),    cmocka_unit_test(chosen),
        cmocka_unit_test(without_memory), cmocka_unit_test(watertight),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
