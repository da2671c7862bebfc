/* keller bench maps: a map, which is searched from the transmitter alone, against points, which are searched from both ends, at random
 * cells of it.
 *
 * usage: keller-bench-maps [--csv] [--scene FILE] [--tx X,Y,Z] [--z Z | --height H] [--cells N] [--points N] [--seed N]
 *                          [--radius R] [--reflections N] [--diffractions N] [--interactions N] [--threads N]
 *
 * The map is of about N cells (4000) over the scene's box, or what of it is in a square of 2 R around the transmitter, at z = 1.5 m, or at a height over whatever is highest there; points (1000) are
 * taken by chance from its cells in the open, those with nothing straight above. A row each for the map and the points: time, paths at those
 * cells; then how many of the cells have the same paths, bit for bit in steps, lengths and gains, and the largest difference of the path gain,
 * relative to the greater one. Exit status 1 if a cell differs. */
#include <complex.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../tests/stability/scenes.h"
#include "base/number.h"
#include "base/progress.h"
#include "keller/drape.h"
#include "keller/path.h"
#include "keller/soup.h"

typedef struct {
    const char *scene;
    KellerVec3 tx;
    double z, height, radius;   /* m; height 0: at z */
    uint32_t cells, points, reflections, diffractions, interactions, threads;
    uint64_t seed;
    bool csv;
} Options;

/* What arrives at one receiver. */
typedef struct {
    uint32_t paths;
    uint64_t hash;              /* of all of them, in order */
    double gain;                /* |sum|^2 */
    double complex sum;
} Arrival;

typedef struct {
    Arrival *arrivals;
    KellerProgress progress;
} Taker;

static void stop(const char *what, const char *message)
{
    fprintf(stderr, "keller-bench-maps: %s: %s\n", what, message);
    exit(1);
}

static void *room(size_t count, size_t size)
{
    void *memory = calloc(count + 1, size);
    if (!memory) stop("out of memory", "expected fewer cells");
    return memory;
}

/* FNV-1a. */
static uint64_t hashed(uint64_t hash, const void *data, size_t size)
{
    const unsigned char *bytes = data;
    for (size_t i = 0; i < size; i++) hash = (hash ^ bytes[i]) * 0x100000001b3u;
    return hash;
}

static KellerStatus take(void *context, const KellerPathBatch *b, KellerError *error)
{
    (void)error;
    for (size_t i = 0; i < b->count; i++) {
        Arrival *a = &((Taker *)context)->arrivals[b->rx[i]];
        uint64_t first = b->offset[i], count = b->offset[i + 1] - first;
        a->paths++;
        a->sum += b->gain[i];
        a->gain = creal(a->sum) * creal(a->sum) + cimag(a->sum) * cimag(a->sum);
        a->hash = hashed(a->hash, &b->length[i], sizeof b->length[i]);
        a->hash = hashed(a->hash, &b->gain[i], sizeof b->gain[i]);
        if (count == 0) continue;
        a->hash = hashed(a->hash, &b->interaction_kind[first], count);
        a->hash = hashed(a->hash, &b->interaction_wedge[first], count * sizeof(uint32_t));
        a->hash = hashed(a->hash, &b->interaction_triangle[first], count * sizeof(uint32_t));
    }
    return KELLER_OK;
}

static void show(void *context, double fraction) { keller_progress_update(&((Taker *)context)->progress, fraction); }

static KellerScene read_scene(const char *file)
{
    KellerSoup soup;
    KellerScene scene;
    KellerError error = {0};
    if (keller_soup_read(file, 1, &soup, &error) != KELLER_OK) stop(file, error.message);
    if (keller_scene_build(&soup, &scene, &error) != KELLER_OK) stop(file, error.message);
    keller_soup_free(&soup);
    return scene;
}

/* Runs what the sets say; one arrival a receiver. Returns seconds. */
static double run(const Options *o, const KellerScene *scene, const KellerAccel *accel, KellerConfig *config, const char *label,
                  Arrival *arrivals)
{
    KellerSimulationWork work;
    KellerError error = {0};
    Taker taker = {.arrivals = arrivals};
    KellerSink sink = {.context = &taker, .paths = take, .progress = show};
    double start = keller_seconds();
    keller_progress_start(&taker.progress, stderr, label);
    if (keller_simulate(config, scene, accel, &sink, &work, &error) != KELLER_OK) stop(o->scene, error.message);
    keller_progress_stop(&taker.progress);
    return keller_seconds() - start;
}

/* The cells of a grid over the scene's box, begun at a place by chance. */
static KellerReceiverSet lay_out(const Options *o, const KellerScene *scene, Random *random, KellerConfig *config)
{
    double x[2] = {greater(scene->lower.x, o->tx.x - o->radius), lesser(scene->upper.x, o->tx.x + o->radius)};
    double y[2] = {greater(scene->lower.y, o->tx.y - o->radius), lesser(scene->upper.y, o->tx.y + o->radius)};
    double width = x[1] - x[0], depth = y[1] - y[0];
    if (!(width > 0 && depth > 0)) stop(o->scene, "is not around the transmitter");
    KellerReceiverSet set = {.id = (char[]){"map"}, .kind = KELLER_SET_GRID, .z = o->z, .draped = o->height > 0, .height = o->height};
    set.step = sqrt(width * depth / o->cells);
    set.x0 = x[0] + random_range(random, 0.05, 0.95) * set.step;
    set.y0 = y[0] + random_range(random, 0.05, 0.95) * set.step;
    set.nx = (uint32_t)greater(1, floor((x[1] - set.x0) / set.step));
    set.ny = (uint32_t)greater(1, floor((y[1] - set.y0) / set.step));
    set.count = set.nx * set.ny;
    config->receivers = room(set.count, sizeof *config->receivers);
    config->receiver_count = set.count;
    for (uint32_t i = 0; i < set.count; i++) {
        config->receivers[i].index = i;
        config->receivers[i].station.position = v3(set.x0 + (i % set.nx) * set.step, set.y0 + (i / set.nx) * set.step, o->z);
    }
    return set;
}

/* By chance so many of the cells in the open, as receivers of their own; places[i] is the cell of the i-th. */
static KellerConfig pick(const Options *o, const KellerAccel *accel, Random *random, const KellerConfig *map, uint32_t *places)
{
    KellerConfig points = *map;
    uint32_t n = 0;
    for (uint32_t i = 0; i < map->receiver_count; i++) {
        KellerVec3 p = map->receivers[i].station.position;
        KellerAccelWork work = {0};
        if (!isnan(p.z) && !keller_accel_ray_any(accel, p, v3(0, 0, 1), (KellerRange){0, INFINITY}, &work)) places[n++] = i;
    }
    points.receiver_count = n < o->points ? n : o->points;
    points.set_count = points.receiver_count;
    points.receivers = room(points.receiver_count, sizeof *points.receivers);
    points.sets = room(points.set_count, sizeof *points.sets);
    for (uint32_t i = 0; i < points.receiver_count; i++) {
        uint32_t j = i + random_below(random, n - i), cell = places[j];
        places[j] = places[i];
        places[i] = cell;
        points.receivers[i] = (KellerReceiver){.set = i, .station = map->receivers[cell].station};
        points.sets[i] = (KellerReceiverSet){.id = (char[]){"point"}, .kind = KELLER_SET_POINT, .first = i, .count = 1};
    }
    return points;
}

static bool compare(const Options *o)
{
    KellerScene scene = read_scene(o->scene);
    KellerAccel *accel = NULL;
    KellerError error = {0};
    if (keller_accel_build("auto", &scene, &accel, &error) != KELLER_OK) stop(o->scene, error.message);
    Random random = random_seeded(o->seed);
    double frequency = 3.5e9;
    KellerTransmitter tx = {.id = (char[]){"tx"}, .station = {.position = o->tx, .antenna = {.pattern = KELLER_ANTENNA_ISOTROPIC}}};
    KellerConfig map = {.file = (char[]){"bench"}, .frequency_count = 1, .frequencies = &frequency, .transmitter_count = 1,
                        .transmitters = &tx, .set_count = 1, .reflections = o->reflections, .diffractions = o->diffractions,
                        .interactions = o->interactions, .dynamic_range = 1e4, .cone = M_PI / 180, .threads = o->threads, .output_paths = true};
    KellerReceiverSet set = lay_out(o, &scene, &random, &map);
    map.sets = &set;
    if (keller_config_drape(&map, &scene, &error) != KELLER_OK) stop(o->scene, error.message);
    uint32_t *places = room(map.receiver_count, sizeof *places);
    KellerConfig points = pick(o, accel, &random, &map, places);
    Arrival *cells = room(map.receiver_count, sizeof *cells), *alone = room(points.receiver_count, sizeof *alone);
    double seconds[2] = {run(o, &scene, accel, &map, "map", cells), run(o, &scene, accel, &points, "points", alone)};
    unsigned long long paths[2] = {0, 0};
    uint32_t same = 0;
    double worst = 0;
    for (uint32_t i = 0; i < points.receiver_count; i++) {
        const Arrival *a = &cells[places[i]], *b = &alone[i];
        double most = greater(a->gain, b->gain);
        paths[0] += a->paths;
        paths[1] += b->paths;
        same += a->paths == b->paths && a->hash == b->hash;
        if (most > 0) worst = greater(worst, fabs(a->gain - b->gain) / most);
    }
    puts(o->csv ? "what,cells,seconds,paths,same,worst" : "what      cells   seconds  paths at the points  same cells  worst gain");
    printf(o->csv ? "map,%u,%.3f,%llu,%u,%.3g\n" : "map    %8u %9.1f %20llu %11u %11.3g\n", set.count, seconds[0], paths[0], same, worst);
    printf(o->csv ? "points,%u,%.3f,%llu,%u,%.3g\n" : "points %8u %9.1f %20llu %11u %11.3g\n", (unsigned)points.receiver_count, seconds[1],
           paths[1], same, worst);
    bool all = same == points.receiver_count;
    free(map.receivers);
    free(points.receivers);
    free(points.sets);
    free(places);
    free(cells);
    free(alone);
    keller_accel_free(accel);
    keller_scene_free(&scene);
    return all;
}

int main(int argc, char **argv)
{
    Options o = {.scene = "../shared/scenes/sionna/munich/munich.xml", .tx = v3(8.5, 21, 27), .z = 1.5, .radius = INFINITY, .cells = 4000, .points = 1000,
                 .reflections = 2, .diffractions = 1, .interactions = 2, .seed = 1};
    for (int i = 1; i < argc; i++) {
        const char *name = argv[i], *value = i + 1 < argc ? argv[i + 1] : "";
        const struct { const char *name; uint32_t *number; } counts[] = {
            {"--cells", &o.cells}, {"--points", &o.points}, {"--threads", &o.threads}, {"--reflections", &o.reflections},
            {"--diffractions", &o.diffractions}, {"--interactions", &o.interactions}};
        bool known = strcmp(name, "--csv") == 0;
        o.csv = o.csv || known;
        if (known) continue;
        for (size_t k = 0; k < sizeof counts / sizeof *counts; k++)
            if (strcmp(name, counts[k].name) == 0) *counts[k].number = (uint32_t)strtoul(value, NULL, 10), known = true;
        if (strcmp(name, "--seed") == 0) o.seed = strtoull(value, NULL, 10), known = true;
        if (strcmp(name, "--z") == 0) o.z = strtod(value, NULL), known = true;
        if (strcmp(name, "--radius") == 0) o.radius = strtod(value, NULL), known = true;
        if (strcmp(name, "--height") == 0) o.height = strtod(value, NULL), known = true;
        if (strcmp(name, "--scene") == 0) o.scene = value, known = true;
        if (strcmp(name, "--tx") == 0) known = sscanf(value, "%lf,%lf,%lf", &o.tx.x, &o.tx.y, &o.tx.z) == 3;
        if (!known || !*value || o.cells == 0 || o.points == 0) {
            fprintf(stderr, "keller-bench-maps: \"%s %s\"; see `keller help bench`\n", name, value);
            return 2;
        }
        i++;
    }
    return compare(&o) ? 0 : 1;
}
