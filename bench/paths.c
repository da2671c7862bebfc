/* keller-bench-paths -- what whole runs cost: each combination of the options is a run of `keller run` in a process of its own.
 *
 * usage: keller-bench-paths [--csv] [--scene FILE | --city TRIANGLES]... [--orders R,D,I]... [--receivers N | --cells N]...
 *                           [--threads N]... [--transmitter X,Y,Z] [--step M] [--seed N] [--limit S] [--keep FOLDER]
 *
 * Receivers are points at 1.5 m over a street, at random places of the scene; cells are a square map at that height, with its middle at
 * the transmitter. Over a street: what a vertical ray meets first from above lies no more than STREET over the scene's lowest point. The
 * transmitter is at 25 m over the street nearest to the scene's middle, where it is not given. Columns:
 *   reflections, diffractions, interactions    asked for, at most
 *   receivers, kind    how many, and points or cells
 *   wall_s, cpu_s      of the whole process: reading, building and writing too; search_s and solve_s are those of the result, added
 *                      up over threads where they share receivers
 *   cones, candidates, paths    counts: the same on every machine; of cones and candidates a few depend on the number of threads
 *   peak_mb            of the process
 * A run that takes longer than --limit (s; default 600) is ended, and its row says so; so is the making of a city, and that is a failure.
 * Its files are in a temporary folder, or in --keep, which is made and not deleted. Status 1 if a run fails, 2 on wrong usage. */
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "../tests/unit/random.h"
#include "accel_set.h"
#include "io/result_read.h"
#include "paths_run.h"

enum { MOST = 16, TRIES = 1000 };
static const double STREET = 0.5, RECEIVER = 1.5, TRANSMITTER = 25; /* m */

typedef struct {
    uint32_t reflections, diffractions, interactions;
} Orders;

typedef struct {
    uint32_t count;
    bool cells;
} Receivers;

typedef struct {
    bool csv, placed;
    const char *scene[MOST], *keep;
    double city[MOST];
    int scene_count, orders_count, receivers_count, threads_count;
    Orders orders[MOST];
    Receivers receivers[MOST];
    int threads[MOST];
    KellerVec3 transmitter;
    double step, limit;
    uint64_t seed;
    RunFolder *run;
    char program[PATH_MAX];
} Options;

static const char usage[] = "keller-bench-paths [--csv] [--scene FILE | --city TRIANGLES]... [--orders R,D,I]... "
                            "[--receivers N | --cells N]... [--threads N]... [--transmitter X,Y,Z] [--step M] [--seed N] [--limit S] "
                            "[--keep FOLDER]";

/* ---- options ---------------------------------------------------------------------------------------------------------- */

static bool three(const char *text, double v[3])
{
    int used = 0;
    return sscanf(text, "%lf,%lf,%lf%n", &v[0], &v[1], &v[2], &used) == 3 && text[used] == '\0' && isfinite(v[0] + v[1] + v[2]);
}

static bool whole(double v, double most) { return v >= 0 && v <= most && v == floor(v); }

static const char *take(Options *o, const char *name, const char *value)
{
    double v, t[3];
    bool scene = strcmp(name, "--scene") == 0, city = strcmp(name, "--city") == 0;
    bool receivers = strcmp(name, "--receivers") == 0, cells = strcmp(name, "--cells") == 0;
    if (o->scene_count == MOST || o->orders_count == MOST || o->receivers_count == MOST || o->threads_count == MOST)
        return "more than can be taken, 16 of each:";
    if (scene || city) {
        v = 0;
        if (city && !accel_number(value, 1, 1e8, true, &v)) return "not a number of triangles:";
        o->scene[o->scene_count] = scene ? value : NULL;
        o->city[o->scene_count++] = v;
    } else if (receivers || cells) {
        if (!accel_number(value, 1, 1e7, true, &v)) return "not a number of receivers:";
        o->receivers[o->receivers_count++] = (Receivers){(uint32_t)v, cells};
    } else if (strcmp(name, "--orders") == 0) {
        if (!three(value, t) || !whole(t[0], 16) || !whole(t[1], 16) || !whole(t[2], 16)) return "not R,D,I:";
        o->orders[o->orders_count++] = (Orders){(uint32_t)t[0], (uint32_t)t[1], (uint32_t)t[2]};
    } else if (strcmp(name, "--threads") == 0) {
        if (!accel_number(value, 1, 1024, true, &v)) return "not a number of threads:";
        o->threads[o->threads_count++] = (int)v;
    } else if (strcmp(name, "--transmitter") == 0) {
        if (!three(value, t)) return "not X,Y,Z:";
        o->transmitter = v3(t[0], t[1], t[2]);
        o->placed = true;
    } else if (strcmp(name, "--step") == 0) {
        if (!accel_number(value, 1e-3, 1e6, false, &o->step)) return "not a step:";
    } else if (strcmp(name, "--limit") == 0) {
        if (!accel_number(value, 1, 1e6, false, &o->limit)) return "not a time:";
    } else if (strcmp(name, "--seed") == 0) {
        if (!accel_number(value, 0, 1e15, true, &v)) return "not a seed:";
        o->seed = (uint64_t)v;
    } else if (strcmp(name, "--keep") == 0) {
        o->keep = value;
    } else {
        return "unknown option, or one without a value:";
    }
    return NULL;
}

static int parse(int argc, char **argv, Options *o)
{
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--csv") == 0) {
            o->csv = true;
            continue;
        }
        const char *wrong = i + 1 < argc ? take(o, argv[i], argv[i + 1]) : "unknown option, or one without a value:";
        if (wrong) {
            fprintf(stderr, "keller-bench-paths: %s %s%s%s\nusage: %s\n", wrong, argv[i], i + 1 < argc ? " " : "",
                    i + 1 < argc ? argv[i + 1] : "", usage);
            return 2;
        }
        i++;
    }
    if (o->scene_count == 0) o->city[o->scene_count++] = 1e4;
    if (o->orders_count == 0) o->orders[o->orders_count++] = (Orders){2, 1, 2};
    if (o->receivers_count == 0) o->receivers[o->receivers_count++] = (Receivers){10, false};
    if (o->threads_count == 0) o->threads[o->threads_count++] = 1;
    return 0;
}

/* ---- places ----------------------------------------------------------------------------------------------------------- */

/* A point over the street at (x, y); false: there is a roof, or nothing. */
static bool over_street(const AccelBench *b, const KellerAccel *accel, double x, double y, double height, KellerVec3 *p)
{
    KellerAccelWork work = {0};
    KellerRayHit hit;
    double top = b->upper.z + 1;
    const KellerRange all = {0, INFINITY};
    if (!keller_accel_ray_nearest(accel, v3(x, y, top), v3(0, 0, -1), all, &hit, &work)) return false;
    *p = v3(x, y, top - hit.t + height);
    return top - hit.t <= b->lower.z + STREET;
}

/* Of many places the one nearest to the scene's middle. */
static bool place_transmitter(const AccelBench *b, const KellerAccel *accel, KellerVec3 *best)
{
    KellerVec3 middle = v3_scale(v3_add(b->lower, b->upper), 0.5);
    double nearest = INFINITY;
    Random random = {1};
    for (int i = 0; i < TRIES; i++) {
        KellerVec3 p;
        double x = random_in(&random, b->lower.x, b->upper.x), y = random_in(&random, b->lower.y, b->upper.y);
        if (!over_street(b, accel, x, y, TRANSMITTER, &p) || hypot(x - middle.x, y - middle.y) >= nearest) continue;
        nearest = hypot(x - middle.x, y - middle.y);
        *best = p;
    }
    return nearest < INFINITY;
}

static KellerStatus write_places(const Options *o, const AccelBench *b, const KellerAccel *accel, const char *name, uint32_t count,
                                 KellerError *error)
{
    FILE *file = fopen(name, "w");
    if (!file) return keller_error(error, KELLER_IO, "%s: %s", name, strerror(errno));
    KellerVec3 p;
    Random random = {o->seed};
    fprintf(file, "x,y,z\n");
    uint32_t found = 0;
    for (uint64_t tries = 0; found < count && tries < (uint64_t)TRIES * count; tries++) {
        double x = random_in(&random, b->lower.x, b->upper.x), y = random_in(&random, b->lower.y, b->upper.y);
        if (!over_street(b, accel, x, y, RECEIVER, &p)) continue;
        fprintf(file, "%.17g,%.17g,%.17g\n", p.x, p.y, p.z);
        found++;
    }
    if (fclose(file) != 0) return keller_error(error, KELLER_IO, "%s: %s", name, strerror(errno));
    if (found == count) return KELLER_OK;
    return keller_error(error, KELLER_BAD_INPUT, "%s: %u places over streets were found; expected %u", b->name, found, count);
}

/* ---- a run ------------------------------------------------------------------------------------------------------------ */

typedef struct {
    RunCost cost;
    double search, solve, cones, candidates, paths;
} Row;

static void add_statistic(void *context, const char *name, double value, const char *unit, const char *text)
{
    Row *r = context;
    (void)unit, (void)text;
    const struct { const char *name; double *value; } wanted[] = {{"time_search", &r->search}, {"time_solve", &r->solve},
        {"cones_traced", &r->cones}, {"candidates", &r->candidates}, {"valid_paths", &r->paths}};
    for (size_t i = 0; i < sizeof wanted / sizeof *wanted; i++)
        if (strcmp(name, wanted[i].name) == 0) *wanted[i].value = value;
}

static KellerStatus run_case(const Options *o, const char *scene, KellerVec3 tx, const Orders *order, const Receivers *r, int threads,
                             Row *row, KellerError *error)
{
    char config[PATH_MAX + 32], result[PATH_MAX + 32], count[16];
    snprintf(config, sizeof config, "%s/run.xml", o->run->folder);
    snprintf(result, sizeof result, "%s/run.h5", o->run->folder);
    snprintf(count, sizeof count, "%d", threads);
    FILE *file = fopen(config, "w");
    if (!file) return keller_error(error, KELLER_IO, "%s: %s", config, strerror(errno));
    fprintf(file, "<?xml version=\"1.0\"?>\n<simulation version=\"1\" domain=\"rf\">\n<scene file=\"%s\"/>\n<frequency>3.5 GHz</frequency>\n"
                  "<transmitter id=\"tx\"><position x=\"%.17g m\" y=\"%.17g m\" z=\"%.17g m\"/></transmitter>\n",
            scene, tx.x, tx.y, tx.z);
    uint32_t side = (uint32_t)ceil(sqrt(r->count)), rows = (r->count + side - 1) / side;
    double left = tx.x - 0.5 * (side - 1) * o->step, bottom = tx.y - 0.5 * (rows - 1) * o->step;
    if (r->cells)
        fprintf(file, "<grid id=\"map\" z=\"%g m\"><from x=\"%.17g m\" y=\"%.17g m\"/><to x=\"%.17g m\" y=\"%.17g m\"/><step>%g m</step></grid>\n",
                RECEIVER, left, bottom, left + (side - 0.5) * o->step, bottom + (rows - 0.5) * o->step, o->step);
    else
        fprintf(file, "<receivers id=\"places\" file=\"places.csv\"/>\n");
    fprintf(file, "<paths reflections=\"%u\" diffractions=\"%u\" interactions=\"%u\"/>\n<output scene=\"no\"/>\n</simulation>\n",
            order->reflections, order->diffractions, order->interactions);
    if (fclose(file) != 0) return keller_error(error, KELLER_IO, "%s: %s", config, strerror(errno));
    char *words[] = {(char *)o->program, "run", config, "-o", result, "-j", count, "-q", "--force", NULL};
    *row = (Row){0};
    if (!run_program(o->run, words, o->limit, &row->cost)) return keller_error(error, KELLER_FAILED, "%s run %s failed", o->program, config);
    if (row->cost.late) return KELLER_OK;
    KellerReader *reader;
    KellerStatus status = keller_reader_open(result, &reader, error);
    if (status != KELLER_OK) return status;
    status = keller_reader_statistics(reader, add_statistic, row, error);
    keller_reader_close(reader);
    return status;
}

static void print_row(const Options *o, const char *name, uint32_t triangles, const Orders *r, const Receivers *s, int threads, const Row *w)
{
    printf(o->csv ? "%s,%u,%u,%u,%u,%u,%s,%d," : "%-12s %9u %2u %2u %2u %8u %-6s %2d ", name, triangles, r->reflections, r->diffractions,
           r->interactions, s->count, s->cells ? "cells" : "points", threads);
    const RunCost *c = &w->cost;
    if (c->late) printf(o->csv ? ">%.0f,,,,,,,%.0f\n" : "more than %.0f s; %.0f MB so far\n", o->limit, c->peak);
    else
        printf(o->csv ? "%.3f,%.3f,%.3f,%.3f,%.0f,%.0f,%.0f,%.0f\n" : "%9.3f %9.3f %9.3f %9.3f %11.0f %12.0f %9.0f %7.0f\n", c->wall,
               c->cpu, w->search, w->solve, w->cones, w->candidates, w->paths, c->peak);
    fflush(stdout);
}

/* ---- scenes ----------------------------------------------------------------------------------------------------------- */

static KellerStatus generate(const Options *o, double triangles, char *file, size_t size, KellerError *error)
{
    char count[32], seed[32];
    snprintf(file, size, "%s/city.obj", o->run->folder);
    snprintf(count, sizeof count, "%.0f", triangles);
    snprintf(seed, sizeof seed, "%llu", (unsigned long long)o->seed);
    char *words[] = {(char *)o->program, "scene", "generate", "city", "--triangles", count, "--seed", seed, "-o", file, "--force", NULL};
    RunCost cost;
    if (!run_program(o->run, words, o->limit, &cost)) return keller_error(error, KELLER_FAILED, "%s scene generate city failed", o->program);
    if (!cost.late) return KELLER_OK;
    return keller_error(error, KELLER_FAILED, "a city of %s triangles took more than %g s; a larger --limit is expected", count, o->limit);
}

static KellerStatus measure_scene(const Options *o, const char *file, KellerError *error)
{
    char path[PATH_MAX], places[PATH_MAX + 32];
    if (strpbrk(file, "&<>\"$")) return keller_error(error, KELLER_BAD_INPUT, "%s: a name without & < > \" $ is expected", file);
    if (!realpath(file, path)) return keller_error(error, KELLER_IO, "%s: %s", file, strerror(errno));
    AccelBench b;
    KellerAccel *accel;
    KellerStatus status = accel_bench_read(path, SIZE_MAX, &b, error);
    if (status != KELLER_OK) return status;
    status = keller_accel_new(&b.in, NULL, &accel, error);
    KellerVec3 tx = o->transmitter;
    if (status == KELLER_OK) {
        if (!o->placed && !place_transmitter(&b, accel, &tx))
            status = keller_error(error, KELLER_BAD_INPUT, "%s: no street was found for the transmitter; expected --transmitter X,Y,Z", file);
        snprintf(places, sizeof places, "%s/places.csv", o->run->folder);
        for (int r = 0; r < o->receivers_count && status == KELLER_OK; r++) {
            if (!o->receivers[r].cells) status = write_places(o, &b, accel, places, o->receivers[r].count, error);
            for (int k = 0; k < o->orders_count; k++)
                for (int t = 0; t < o->threads_count && status == KELLER_OK; t++) {
                    Row row;
                    status = run_case(o, path, tx, &o->orders[k], &o->receivers[r], o->threads[t], &row, error);
                    if (status == KELLER_OK) print_row(o, b.name, b.in.triangle_count, &o->orders[k], &o->receivers[r], o->threads[t], &row);
                }
        }
        keller_accel_free(accel);
    }
    accel_bench_free(&b);
    return status;
}

/* The program beside this one: in the build's tree, or where both were installed. */
static bool find_program(char program[PATH_MAX])
{
    static const char *const places[] = {"../src/cli/keller", "../../bin/keller"};
    char folder[PATH_MAX - 32];
    ssize_t length = readlink("/proc/self/exe", folder, sizeof folder - 1);
    if (length < 0) return false;
    folder[length] = '\0';
    *strrchr(folder, '/') = '\0';
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        snprintf(program, PATH_MAX, "%s/%s", folder, places[i]);
        if (access(program, X_OK) == 0) return true;
    }
    return false;
}

int main(int argc, char **argv)
{
    Options o = {.step = 2, .limit = 600, .seed = 1};
    int wrong = parse(argc, argv, &o);
    if (wrong) return wrong;
    KellerError error = {0};
    KellerStatus status = KELLER_OK;
    RunFolder run;
    o.run = &run;
    if (!find_program(o.program)) status = keller_error(&error, KELLER_IO, "no program keller beside this one");
    else status = run_folder_start(&run, o.keep, &error);
    const bool started = status == KELLER_OK;
    if (status == KELLER_OK)
        printf(o.csv ? "scene,triangles,reflections,diffractions,interactions,receivers,kind,threads,wall_s,cpu_s,search_s,solve_s,cones,"
                       "candidates,paths,peak_mb\n"
                     : "scene        triangles  R  D  I receivers kind   threads wall       cpu    search     solve       cones   candidates     paths peak MB\n");
    for (int i = 0; i < o.scene_count && status == KELLER_OK; i++) {
        char file[PATH_MAX + 32];
        if (o.scene[i]) snprintf(file, sizeof file, "%s", o.scene[i]);
        else status = generate(&o, o.city[i], file, sizeof file, &error);
        if (status == KELLER_OK) status = measure_scene(&o, file, &error);
    }
    if (status != KELLER_OK) fprintf(stderr, "keller-bench-paths: %s\n", error.message);
    if (started) run_folder_end(&run);
    return status == KELLER_OK ? 0 : 1;
}
