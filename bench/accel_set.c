#include "accel_set.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "../tests/unit/random.h"
#include "base/number.h"

double accel_now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

double accel_median(double v[PASSES])
{
    for (int i = 1; i < PASSES; i++)
        for (int j = i; j > 0 && v[j - 1] > v[j]; j--) {
            double t = v[j];
            v[j] = v[j - 1];
            v[j - 1] = t;
        }
    return v[PASSES / 2];
}

/* Fewer of those that take longer. */
static size_t how_many(double queries, double half_angle)
{
    double share = half_angle < 0 ? 1 : half_angle < 0.3 ? 0.1 : half_angle < 1 ? 0.05 : half_angle < 10 ? 0.005 : 0.001;
    double side = floor(sqrt(greater(16, queries * share)));
    return (size_t)(side * side);
}

Set accel_set_make(const AccelBench *b, double queries, uint64_t seed, int kind, double half_angle, bool eccentric)
{
    Set s = {.count = how_many(queries, half_angle)};
    s.origins = malloc(s.count * sizeof *s.origins);
    s.directions = malloc(s.count * sizeof *s.directions);
    s.cones = malloc(s.count * sizeof *s.cones);
    if (!s.origins || !s.directions || !s.cones) abort();
    Random r = {seed};
    size_t side = (size_t)(sqrt((double)s.count) + 0.5);
    for (size_t i = 0; i < s.count; i++) {
        double u[3];
        for (int k = 0; k < 3; k++) u[k] = kind ? random_in(&r, 0, 1) : 0.5;
        s.origins[i] = v3(b->lower.x + u[0] * (b->upper.x - b->lower.x), b->lower.y + u[1] * (b->upper.y - b->lower.y),
                          b->lower.z + u[2] * (b->upper.z - b->lower.z));
        double x = 2 * ((double)(i % side) + random_in(&r, 0, 1)) / (double)side - 1;
        double y = 2 * ((double)(i / side) + random_in(&r, 0, 1)) / (double)side - 1;
        KellerVec3 d = s.directions[i] = kind ? random_unit(&r) : v3_unit(v3(1, x, y));
        double eccentricity = eccentric ? random_in(&r, 0, 0.99) : 0, turn = random_in(&r, 0, M_PI);
        KellerVec3 major = v3_perpendicular(d);
        major = v3_add(v3_scale(major, cos(turn)), v3_scale(v3_cross(d, major), sin(turn)));
        s.cones[i] = keller_cone_elliptic(s.origins[i], d, major, greater(half_angle, 0) * M_PI / 180, eccentricity, 0);
    }
    return s;
}

void accel_set_free(Set *s)
{
    free(s->origins);
    free(s->directions);
    free(s->cones);
}

/* ---- scenes ------------------------------------------------------------------------------------------------------ */

enum { RAW = 300000 }; /* triangles; of larger files no model is made */

bool accel_number(const char *text, double least, double most, bool whole, double *value)
{
    char *end;
    *value = strtod(text, &end); /* 1e6 is fine */
    return end != text && !*end && *value >= least && *value <= most && (!whole || *value == floor(*value));
}

int accel_scenes_option(AccelScenes *s, bool *csv, const char *name, const char *value, const char **wrong)
{
    double v;
    if (strcmp(name, "--csv") == 0) {
        *csv = true;
        return 1;
    }
    if (strcmp(name, "--scene") == 0) {
        *wrong = "too many scenes:";
        if (s->scene_count == ACCEL_MOST) return -1;
        s->scenes[s->scene_count++] = value;
        return 2;
    }
    if (strcmp(name, "--queries") == 0 || strcmp(name, "--seed") == 0) {
        bool queries = name[2] == 'q';
        *wrong = "not a whole number:";
        if (!accel_number(value, queries ? 1 : 0, queries ? 1e9 : 1e15, true, &v)) return -1;
        if (queries) s->queries = v;
        else s->seed = (uint64_t)v;
        return 2;
    }
    bool random = strcmp(name, "--random") == 0;
    if (!random && strcmp(name, "--hair") != 0) return 0;
    int *count = random ? &s->random_count : &s->hair_count;
    *wrong = random ? "not a number of triangles:" : "not a number of strands:";
    if (*count == ACCEL_MOST || !accel_number(value, 1, random ? 1e8 : 1e6, true, &v)) return -1;
    (random ? s->randoms : s->hairs)[(*count)++] = (uint32_t)v;
    return 2;
}

bool accel_scenes_none(const AccelScenes *s) { return s->scene_count + s->random_count + s->hair_count == 0; }

const char accel_unknown[] = "unknown option";

static int wrong_usage(const char *what, const char *text, const char *usage)
{
    fprintf(stderr, "%.*s: %s \"%s\"; usage: %s\n", (int)strcspn(usage, " "), usage, what, text, usage); /* it begins with the program */
    return 2;
}

int accel_parse(int argc, char **argv, AccelScenes *scenes, bool *csv, AccelOwnOption own, void *context, const char *usage)
{
    for (int i = 1, words; i < argc; i += words) {
        const char *name = argv[i], *value = argv[i + 1] ? argv[i + 1] : "", *wrong;
        words = accel_scenes_option(scenes, csv, name, value, &wrong);
        if (words < 0) return wrong_usage(wrong, value, usage);
        if (words > 0) continue;
        words = 2;
        wrong = own(context, name, value);
        if (wrong) return wrong_usage(wrong, wrong == accel_unknown ? name : value, usage);
    }
    return accel_scenes_none(scenes) ? wrong_usage("nothing to measure:", "expected --scene, --random or --hair", usage) : 0;
}

KellerStatus accel_scenes_measure(const AccelScenes *s, AccelMeasure measure, void *context, KellerError *error)
{
    KellerStatus status = KELLER_OK;
    int all = s->scene_count + s->random_count + s->hair_count;
    for (int i = 0; i < all && status == KELLER_OK; i++) {
        AccelBench b;
        int random = i - s->scene_count, hair = random - s->random_count;
        if (random < 0) status = accel_bench_read(s->scenes[i], RAW, &b, error);
        else if (hair < 0) status = accel_bench_random(s->randoms[random], &b, error);
        else status = accel_bench_hair(s->hairs[hair], &b, error);
        if (status == KELLER_OK && b.in.triangle_count > 0) status = measure(context, &b, error);
        accel_bench_free(&b);
    }
    return status;
}
