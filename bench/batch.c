/* keller-bench-batch -- jobs of so many rays or cones from nothing to the last answer: divide and conquer against building and asking.
 *
 * usage: keller-bench-batch [--csv] [--scene FILE]... [--random N]... [--hair STRANDS]... [--queries MOST] [--half-angle DEG] [--seed N]
 *
 * One thread, processor time, the least of three; for 10, 100, ... queries up to MOST. Columns:
 *   kind, half_angle_deg   as in keller bench accel; rays (-1) or cones, the nearest triangle of each
 *   queries           in the batch
 *   bvh8_build_ms, bvh8_ms, dacrt_build_ms, dacrt_ms    keller_accel_new, and keller_accel_rays_nearest or _cones_nearest
 *   ratio             of dacrt's time, both together, over that of bvh8
 *   dacrt_bytes       that the batch allocates a query and triangle, together
 * Status 1 if a scene cannot be had, 2 on wrong usage. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "accel_set.h"

enum { MOST = 16, RAW = 300000, TIMES = 3, STRUCTURES = 2 };
static const char *const structures[STRUCTURES] = {"bvh8", "dacrt"};
static const char *const kinds[] = {"primary", "random"};

typedef struct {
    bool csv;
    const char *scenes[MOST];
    uint32_t randoms[MOST], hairs[MOST];
    int scene_count, random_count, hair_count;
    double queries, half_angle;
    uint64_t seed;
} Options;

typedef struct {
    double build, ask;
} Times;

static KellerStatus job(const AccelBench *b, const char *name, const Set *s, bool rays, void *hits, Times *least, size_t *bytes,
                        KellerError *error)
{
    const KellerRange clip = {0, INFINITY};
    *least = (Times){INFINITY, INFINITY};
    for (int i = 0; i < TIMES; i++) {
        KellerAccel *accel;
        KellerAccelWork work = {0};
        double start = accel_now();
        KellerStatus status = keller_accel_new(&b->in, &(KellerAccelOptions){.name = name, .threads = 1}, &accel, error);
        if (status != KELLER_OK) return status;
        double built = accel_now();
        if (rays) keller_accel_rays_nearest(accel, s->count, s->origins, s->directions, clip, hits, 1, &work);
        else keller_accel_cones_nearest(accel, s->count, s->cones, clip, hits, 1, &work);
        double done = accel_now();
        least->build = fmin(least->build, built - start);
        least->ask = fmin(least->ask, done - built);
        *bytes = rays ? keller_accel_rays_bytes(accel, s->count, 1) : keller_accel_cones_bytes(accel, s->count, 1);
        keller_accel_free(accel);
    }
    return KELLER_OK;
}

static KellerStatus measure_kind(const Options *o, const AccelBench *b, int kind, KellerError *error)
{
    bool rays = o->half_angle < 0;
    for (double n = 10; n <= o->queries; n *= 10) {
        Set s = accel_set_make(b, n, o->seed, kind, -1, false);
        void *hits = malloc((s.count + 1) * sizeof(KellerConeHit));
        Times t[STRUCTURES];
        size_t bytes = 0;
        KellerStatus status = hits ? KELLER_OK : KELLER_FAILED;
        for (size_t i = 0; i < s.count && !rays; i++)
            s.cones[i] = keller_cone_round(s.origins[i], s.directions[i], o->half_angle * M_PI / 180);
        for (int k = 0; k < STRUCTURES && status == KELLER_OK; k++)
            status = job(b, structures[k], &s, rays, hits, &t[k], &bytes, error);
        free(hits);
        if (status == KELLER_OK) {
            printf(o->csv ? "%s,%u,%s,%g,%zu,%.4g,%.4g,%.4g,%.4g,%.3f,%zu\n" : "%-14s %8u %-8s %6g %9zu %9.4g %9.4g %9.4g %9.4g %8.3f %10zu\n",
                   b->name, b->in.triangle_count, kinds[kind], o->half_angle, s.count, t[0].build * 1e3, t[0].ask * 1e3,
                   t[1].build * 1e3, t[1].ask * 1e3, (t[1].build + t[1].ask) / (t[0].build + t[0].ask), bytes);
            fflush(stdout);
        }
        accel_set_free(&s);
        if (status != KELLER_OK) return status;
    }
    return KELLER_OK;
}

static KellerStatus measure(const Options *o, AccelBench *b, KellerStatus status, KellerError *error)
{
    for (int kind = 0; kind < 2 && status == KELLER_OK; kind++) status = measure_kind(o, b, kind, error);
    accel_bench_free(b);
    return status;
}

static int wrong_usage(const char *what, const char *text)
{
    fprintf(stderr,
            "keller-bench-batch: %s \"%s\"; usage: keller-bench-batch [--csv] [--scene FILE]... [--random N]... "
            "[--hair STRANDS]... [--queries MOST] [--half-angle DEG] [--seed N]\n",
            what, text);
    return 2;
}

static bool number(const char *text, double least, double most, double *value)
{
    char *end;
    *value = strtod(text, &end);
    return end != text && !*end && *value >= least && *value <= most;
}

static int parse(int argc, char **argv, Options *o)
{
    for (int i = 1; i < argc; i++) {
        const char *name = argv[i], *value = argv[i + 1] ? argv[i + 1] : "";
        double v;
        if (strcmp(name, "--csv") == 0) {
            o->csv = true;
            continue;
        }
        i++;
        if (strcmp(name, "--scene") == 0) {
            if (o->scene_count == MOST) return wrong_usage("too many scenes:", value);
            o->scenes[o->scene_count++] = value;
        } else if (strcmp(name, "--random") == 0) {
            if (o->random_count == MOST || !number(value, 1, 1e8, &v)) return wrong_usage("not a number of triangles:", value);
            o->randoms[o->random_count++] = (uint32_t)v;
        } else if (strcmp(name, "--hair") == 0) {
            if (o->hair_count == MOST || !number(value, 1, 1e6, &v)) return wrong_usage("not a number of strands:", value);
            o->hairs[o->hair_count++] = (uint32_t)v;
        } else if (strcmp(name, "--queries") == 0) {
            if (!number(value, 10, 1e8, &o->queries)) return wrong_usage("not a number of queries:", value);
        } else if (strcmp(name, "--half-angle") == 0) {
            if (!number(value, -1, 80, &o->half_angle)) return wrong_usage("not a half-angle:", value);
        } else if (strcmp(name, "--seed") == 0) {
            if (!number(value, 0, 1e15, &v)) return wrong_usage("not a number:", value);
            o->seed = (uint64_t)v;
        } else {
            return wrong_usage("unknown option", name);
        }
    }
    if (o->scene_count + o->random_count + o->hair_count > 0) return 0;
    return wrong_usage("nothing to measure:", "expected --scene, --random or --hair");
}

int main(int argc, char **argv)
{
    Options o = {.queries = 1e6, .seed = 1, .half_angle = -1};
    int wrong = parse(argc, argv, &o);
    if (wrong) return wrong;
    printf(o.csv ? "scene,triangles,kind,half_angle_deg,queries,bvh8_build_ms,bvh8_ms,dacrt_build_ms,dacrt_ms,ratio,dacrt_bytes\n"
                 : "scene         triangles kind      angle   queries  bvh8 new       ask dacrt new       ask    ratio      bytes\n");
    KellerStatus status = KELLER_OK;
    KellerError error;
    AccelBench b;
    for (int i = 0; i < o.scene_count && status == KELLER_OK; i++)
        status = measure(&o, &b, accel_bench_read(o.scenes[i], RAW, &b, &error), &error);
    for (int i = 0; i < o.random_count && status == KELLER_OK; i++)
        status = measure(&o, &b, accel_bench_random(o.randoms[i], &b, &error), &error);
    for (int i = 0; i < o.hair_count && status == KELLER_OK; i++)
        status = measure(&o, &b, accel_bench_hair(o.hairs[i], &b, &error), &error);
    if (status != KELLER_OK) fprintf(stderr, "keller-bench-batch: %s\n", error.message);
    return status == KELLER_OK ? 0 : 1;
}
