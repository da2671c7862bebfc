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

enum { TIMES = 3, STRUCTURES = 2 };
static const char *const structures[STRUCTURES] = {"bvh8", "dacrt"};
static const char *const kinds[] = {"primary", "random"};

typedef struct {
    bool csv;
    AccelScenes scenes;
    double half_angle;
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
    for (double n = 10; n <= o->scenes.queries; n *= 10) {
        Set s = accel_set_make(b, n, o->scenes.seed, kind, -1, false);
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
            printf(o->csv ? "%s,%u,%s,%g,%zu,%.4g,%.4g,%.4g,%.4g,%.3f,%zu\n"
                          : "%-14s %8u %-8s %6g %9zu %9.4g %9.4g %9.4g %9.4g %8.3f %10zu\n",
                   b->name, b->in.triangle_count, kinds[kind], o->half_angle, s.count, t[0].build * 1e3, t[0].ask * 1e3,
                   t[1].build * 1e3, t[1].ask * 1e3, (t[1].build + t[1].ask) / (t[0].build + t[0].ask), bytes);
            fflush(stdout);
        }
        accel_set_free(&s);
        if (status != KELLER_OK) return status;
    }
    return KELLER_OK;
}

static KellerStatus measure(void *context, const AccelBench *b, KellerError *error)
{
    KellerStatus status = measure_kind(context, b, 0, error);
    return status == KELLER_OK ? measure_kind(context, b, 1, error) : status;
}

static const char usage[] = "keller-bench-batch [--csv] [--scene FILE]... [--random N]... [--hair STRANDS]... "
                            "[--queries MOST] [--half-angle DEG] [--seed N]";

static const char *own_option(void *context, const char *name, const char *value)
{
    Options *o = context;
    if (strcmp(name, "--half-angle") != 0) return accel_unknown;
    return accel_number(value, -1, 80, false, &o->half_angle) ? NULL : "not a half-angle:";
}

int main(int argc, char **argv)
{
    Options o = {.scenes = {.queries = 1e6, .seed = 1}, .half_angle = -1};
    int wrong = accel_parse(argc, argv, &o.scenes, &o.csv, own_option, &o, usage);
    if (wrong) return wrong;
    printf(o.csv ? "scene,triangles,kind,half_angle_deg,queries,bvh8_build_ms,bvh8_ms,dacrt_build_ms,dacrt_ms,ratio,dacrt_bytes\n"
                 : "scene         triangles kind      angle   queries  bvh8 new       ask dacrt new       ask    ratio      bytes\n");
    KellerError error;
    KellerStatus status = accel_scenes_measure(&o.scenes, measure, &o, &error);
    if (status != KELLER_OK) fprintf(stderr, "keller-bench-batch: %s\n", error.message);
    return status == KELLER_OK ? 0 : 1;
}
