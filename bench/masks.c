/* keller-bench-masks -- what masks spare (Yoshimura and Harada 2023, tables 1 and 2, figure 8), and what they cost.
 *
 * usage: keller-bench-masks [--csv] [--scene FILE]... [--random N]... [--hair STRANDS]... [--structure bvh|bvh8] [--queries N] [--seed N]
 *
 * One thread; times are processor times, medians of five passes over the same queries after one not counted, the structure without
 * masks measured again beside each row. Columns:
 *   masks             none; leaves (what is built by default: no masks but those of leaves, exact passages), ideal (exact
 *                     passages, masks of all primitives), table (passages of rays by table), L1 to L5 (exact passages, masks
 *                     from so many levels below), compressed (of L3)
 *   R                 cells along an axis
 *   kind, half_angle_deg   as in keller bench accel; rays (-1): nearest; for none and leaves also cones: all
 *   nodes, triangles  tested, per query; ratio: of their sum, over that without masks
 *   ratio_time        of a query's time, over that without masks
 *   build_ms, bytes_per_triangle
 * Status 1 if a scene cannot be had, 2 on wrong usage. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "accel_set.h"

enum { KINDS = 2, ANGLES = 6 };

static const double half_angles[ANGLES] = {-1, 1e-5, 0.1, 0.5, 5, 15};
static const char *const kinds[KINDS] = {"primary", "random"};

typedef struct {
    const char *name;
    KellerMaskOptions how;
} Variant;

static const Variant variants[] = {{"leaves", {.levels = 0}},
                                   {"ideal", {.levels = -1}},
                                   {"table", {.levels = -1, .table = true}},
                                   {"L1", {.levels = 1}},
                                   {"L2", {.levels = 2}},
                                   {"L3", {.levels = 3}},
                                   {"L4", {.levels = 4}},
                                   {"L5", {.levels = 5}},
                                   {"compressed", {.levels = 3, .compressed = true}}};
enum { VARIANTS = sizeof variants / sizeof *variants };

typedef struct {
    bool csv;
    AccelScenes scenes;
    const char *structure;
} Options;

static double ignore(void *context, uint32_t primitive, KellerRange range)
{
    (void)context, (void)primitive, (void)range;
    return INFINITY;
}

static void pass(const KellerAccel *accel, const Set *s, bool rays, KellerAccelWork *work)
{
    const KellerRange clip = {0, INFINITY};
    KellerRayHit hit;
    for (size_t i = 0; i < s->count; i++) {
        if (rays) keller_accel_ray_nearest(accel, s->origins[i], s->directions[i], clip, &hit, work);
        else keller_accel_cone(accel, &s->cones[i], clip, ignore, ignore, NULL, work);
    }
}

/* The same queries over both, by turns; times are of a pass. */
static void both(const KellerAccel *const accel[2], const Set *s, bool rays, KellerAccelWork work[2], double seconds[2])
{
    double all[2][PASSES];
    for (int k = 0; k < 2; k++) pass(accel[k], s, rays, &work[k]);
    for (int i = 0; i < PASSES; i++)
        for (int k = 0; k < 2; k++) {
            KellerAccelWork again = {0};
            double start = accel_now();
            pass(accel[k], s, rays, &again);
            all[k][i] = accel_now() - start;
        }
    for (int k = 0; k < 2; k++) seconds[k] = accel_median(all[k]);
}

static void print_row(const Options *o, const AccelBench *b, const char *name, int R, const char *kind, double half_angle,
                      const double n[2], double ratio, double ratio_time, double build, double bytes)
{
    printf(o->csv ? "%s,%s,%s,%d,%s,%g,%.4g,%.4g,%.3f,%.3f,%.4g,%.1f\n"
                  : "%-14s %-5s %-11s %2d %-8s %6g %9.4g %9.4g %7.3f %7.3f %9.4g %7.1f\n",
           b->name, o->structure, name, R, kind, half_angle, n[0], n[1], ratio, ratio_time, build * 1e3, bytes);
    fflush(stdout);
}

static void measure_variant(const Options *o, const AccelBench *b, const KellerAccel *bare, const KellerAccel *masked, const char *name,
                            int R, double build)
{
    const KellerAccel *const accel[2] = {bare, masked};
    for (int kind = 0; kind < KINDS; kind++)
        for (int angle = 0; angle < (R == 0 || strcmp(name, "leaves") == 0 ? ANGLES : 1); angle++) {
            KellerAccelWork work[2] = {{0}, {0}};
            double seconds[2];
            Set s = accel_set_make(b, o->scenes.queries, o->scenes.seed, kind, half_angles[angle], false);
            both(accel, &s, half_angles[angle] < 0, work, seconds);
            const double n[2] = {(double)work[1].nodes / (double)s.count, (double)work[1].triangles / (double)s.count};
            double ratio = (double)(work[1].nodes + work[1].triangles) / (double)(work[0].nodes + work[0].triangles);
            print_row(o, b, name, R, kinds[kind], half_angles[angle], n, ratio, seconds[1] / seconds[0], build,
                      (double)keller_accel_bytes(masked) / b->in.triangle_count);
            accel_set_free(&s);
        }
}

static KellerStatus measure(void *context, const AccelBench *b, KellerError *error)
{
    const Options *o = context;
    char masked_name[16];
    KellerAccel *bare = NULL;
    double start = accel_now();
    snprintf(masked_name, sizeof masked_name, "%s+mask", o->structure);
    KellerStatus status = keller_accel_new(&b->in, &(KellerAccelOptions){.name = o->structure, .threads = 1}, &bare, error);
    if (status == KELLER_OK) measure_variant(o, b, bare, bare, "none", 0, accel_now() - start);
    for (int R = 4; R <= 6; R += 2)
        for (int i = 0; i < VARIANTS && status == KELLER_OK; i++) {
            KellerAccelOptions options = {.name = masked_name, .threads = 1, .masks = variants[i].how};
            KellerAccel *masked = NULL;
            options.masks.resolution = R;
            start = accel_now();
            status = keller_accel_new(&b->in, &options, &masked, error);
            if (status == KELLER_OK) measure_variant(o, b, bare, masked, variants[i].name, R, accel_now() - start);
            keller_accel_free(masked);
        }
    keller_accel_free(bare);
    return status;
}

static const char usage[] = "keller-bench-masks [--csv] [--scene FILE]... [--random N]... [--hair STRANDS]... "
                            "[--structure bvh|bvh8] [--queries N] [--seed N]";

static const char *own_option(void *context, const char *name, const char *value)
{
    Options *o = context;
    if (strcmp(name, "--structure") != 0) return accel_unknown;
    o->structure = value;
    return strcmp(value, "bvh") == 0 || strcmp(value, "bvh8") == 0 ? NULL : "neither bvh nor bvh8:";
}

int main(int argc, char **argv)
{
    Options o = {.scenes = {.queries = 100000, .seed = 1}, .structure = "bvh8"};
    int wrong = accel_parse(argc, argv, &o.scenes, &o.csv, own_option, &o, usage);
    if (wrong) return wrong;
    printf(o.csv ? "scene,structure,masks,R,kind,half_angle_deg,nodes,triangles,ratio,ratio_time,build_ms,bytes_per_triangle\n"
                 : "scene          tree  masks        R kind      angle     nodes triangles   ratio    time  build_ms   B/tri\n");
    KellerError error;
    KellerStatus status = accel_scenes_measure(&o.scenes, measure, &o, &error);
    if (status != KELLER_OK) fprintf(stderr, "keller-bench-masks: %s\n", error.message);
    return status == KELLER_OK ? 0 : 1;
}
