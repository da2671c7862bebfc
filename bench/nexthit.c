/* keller-bench-nexthit -- what the next hit of a ray or a cone costs, by method.
 *
 * usage: keller-bench-nexthit [--csv] [--scene FILE]... [--layers N]... [--rays N] [--seed N] [--half-angle DEG] [--peer embree]
 *
 * One thread; times are processor times, medians of five passes over the same queries; the passes of all rows take turns, so that
 * a slow moment of the machine spoils none of them alone, each after some queries not counted that fill the caches. Columns:
 *   scene         the file's name; layers-N: N sheets behind one another (keller scene generate layers)
 *   query         random: rays from the box in directions on the sphere. through: rays through the box, from a point of one of its
 *                 two smallest sides to a point of the other. cone: of the half-angle given, along rays `through`
 *   method        queue, restart, filter, filter-n (keller/nexthit.h). The peer's filter: an intersection filter that collects all
 *                 hits, then sorted; its restart: the nearest hit again and again, each time from nextafter of the last t on
 *   structure     bvh, bvh8; embree (its fast mode), embree-robust
 *   max_hits      after so many hits a query stops; 0: it goes on to the last. No method but filter-n is told
 *   us_per_ray    everything: making ready, finding, stepping
 *   hits_per_ray  handed out
 *   lost, doubled in all queries together: hits that were passed over, or came twice, beside the method filter over a k-d tree
 *   nodes, triangles   tested a query (nodes of bvh8 eight boxes at a time); not known of the peer
 * Status 1 if a scene cannot be had, 2 on wrong usage. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "../tests/unit/random.h"
#include "accel_input.h"
#include "embree_peer.h"
#include "keller/nexthit.h"

static const char *const structures[] = {"bvh", "bvh8"};
static const char *const methods[] = {"queue", "restart", "filter", "filter-n"};
static const char *const kinds[] = {"random", "through", "cone"};
static const uint32_t limits[] = {1, 5, 15, UINT32_MAX};
enum { RANDOM, THROUGH, CONE, STRUCTURES = 2, METHODS = 4, LIMITS = 4, MODES = 2, PASSES = 5, WARM = 2000, MOST = 16, RAW = 300000, ROOM = 1 << 20 };

typedef struct {
    bool csv, peer;
    const char *scenes[MOST];
    uint32_t layers[MOST];
    int scene_count, layer_count;
    double rays, half_angle;
    uint64_t seed;
} Options;

typedef struct {
    int kind;
    size_t count;
    KellerVec3 *origins, *directions;
    KellerCone *cones;
} Set;

/* A row of the table: a method over one of our structures, or one of the peer's. */
typedef struct {
    const KellerAccel *accel;
    Peer *peer;
    const char *structure;
    KellerNexthitMethod method;
    uint32_t limit;
    double seconds[PASSES];
    uint64_t hits, lost, doubled;
    KellerAccelWork work;
} Row;

typedef struct {
    KellerNexthit *it;
    PeerHit *hits, *exact;       /* [ROOM] */
    uint8_t *seen;               /* by triangle */
} Room;

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(const double v[PASSES])
{
    double sorted[PASSES];
    memcpy(sorted, v, sizeof sorted);
    qsort(sorted, PASSES, sizeof *sorted, by_value);
    return sorted[PASSES / 2];
}

static void stop(const KellerError *error)
{
    fprintf(stderr, "keller-bench-nexthit: %s\n", error->message);
    exit(1);
}

/* ---- queries ----------------------------------------------------------------------------------------------------- */

static Set make_set(const Options *o, const AccelBench *b, int kind)
{
    Set s = {.kind = kind, .count = (size_t)(kind == CONE ? ceil(o->rays / 20) : o->rays)};
    s.origins = malloc(s.count * sizeof *s.origins);
    s.directions = malloc(s.count * sizeof *s.directions);
    s.cones = malloc(s.count * sizeof *s.cones);
    if (!s.origins || !s.directions || !s.cones) abort();
    Random r = {o->seed};
    double size[3] = {b->upper.x - b->lower.x, b->upper.y - b->lower.y, b->upper.z - b->lower.z};
    int along = size[0] > size[1] ? 0 : 1;
    if (size[2] > size[along]) along = 2;
    for (size_t i = 0; i < s.count; i++) {
        double u[2][3];
        for (int e = 0; e < 2; e++)
            for (int k = 0; k < 3; k++) u[e][k] = size[k] * (kind != RANDOM && k == along ? 1.02 * e - 0.01 : random_in(&r, 0, 1));
        s.origins[i] = v3_add(b->lower, v3(u[0][0], u[0][1], u[0][2]));
        KellerVec3 to = v3_sub(v3_add(b->lower, v3(u[1][0], u[1][1], u[1][2])), s.origins[i]);
        s.directions[i] = kind == RANDOM ? random_unit(&r) : v3_unit(to);
        s.cones[i] = keller_cone_round(s.origins[i], s.directions[i], kind == CONE ? o->half_angle * M_PI / 180 : 0);
    }
    return s;
}

static void free_set(Set *s)
{
    free(s->origins);
    free(s->directions);
    free(s->cones);
}

/* Our hits of query i, at most `limit`, into `hits` where it is not NULL; returns how many. */
static size_t ours(KellerNexthit *it, const KellerAccel *accel, const Set *s, size_t i, KellerNexthitMethod method, uint32_t limit,
                   KellerAccelWork *work, PeerHit *hits)
{
    const KellerNexthitOptions o = {.method = method, .batch = limit, .work = work};
    const KellerRange clip = {0, INFINITY};
    KellerError error;
    size_t n = 0;
    if (s->kind == CONE) {
        KellerConeHit hit;
        if (keller_nexthit_cone(it, accel, &s->cones[i], clip, &o, &error) != KELLER_OK) stop(&error);
        for (; n < limit; n++) {
            if (keller_nexthit_next_cone(it, &hit, &error) != KELLER_OK) stop(&error);
            if (hit.primitive == KELLER_NONE) break;
            if (hits && n < ROOM) hits[n] = (PeerHit){(float)hit.range.near, hit.primitive};
        }
    } else {
        KellerRayHit hit;
        if (keller_nexthit_ray(it, accel, s->origins[i], s->directions[i], clip, &o, &error) != KELLER_OK) stop(&error);
        for (; n < limit; n++) {
            if (keller_nexthit_next_ray(it, &hit, &error) != KELLER_OK) stop(&error);
            if (hit.triangle == KELLER_NONE) break;
            if (hits && n < ROOM) hits[n] = (PeerHit){(float)hit.t, hit.triangle};
        }
    }
    return n;
}

/* Of any row. The peer's steps are bounded: it may make none forward. */
static size_t query(Row *row, const Room *room, const Set *s, size_t i, KellerAccelWork *work, PeerHit *hits)
{
    if (row->accel) return ours(room->it, row->accel, s, i, row->method, row->limit, work, hits);
    size_t most = row->limit < ROOM / 64 ? row->limit : ROOM / 64, n;
    if (row->method == KELLER_NEXTHIT_RESTART) return peer_restart(row->peer, s->origins[i], s->directions[i], room->hits, most);
    n = peer_filter(row->peer, s->origins[i], s->directions[i], room->hits, ROOM);
    return n < row->limit ? n : row->limit;
}

/* ---- what is lost and what comes twice ---------------------------------------------------------------------------- */

/* Passed over: hits before the last of those asked for that did not come, though farther ones did, or the end. Rounding to single
 * precision may exchange neighbours: only what is nearer than the last one that came by more than that counts. */
static void compare(Row *row, Room *room, const Set *s, size_t i, size_t exact)
{
    size_t n = query(row, room, s, i, &row->work, room->hits);
    row->hits += n;
    if (n > ROOM) n = ROOM;
    for (size_t k = 0; k < n; k++) {
        row->doubled += room->seen[room->hits[k].triangle] > 0;
        room->seen[room->hits[k].triangle] = 1;
    }
    bool ended = n < row->limit;
    double last = n ? (double)room->hits[n - 1].t : 0, before = last - 1e-5 * fabs(last);
    for (size_t k = 0; k < exact && k < row->limit; k++)
        row->lost += !room->seen[room->exact[k].triangle] && (ended || (double)room->exact[k].t < before);
    for (size_t k = 0; k < n; k++) room->seen[room->hits[k].triangle] = 0;
}

/* ---- the table --------------------------------------------------------------------------------------------------- */

static void print_head(const Options *o)
{
    printf(o->csv ? "%s,%s,%s,%s,%s,%s,%s,%s,%s,%s,%s\n" : "%-12s %-8s %-9s %-14s %8s %10s %9s %8s %8s %8s %9s\n", "scene",
           "query", "method", "structure", o->csv ? "max_hits" : "at most", o->csv ? "us_per_ray" : "us",
           o->csv ? "hits_per_ray" : "hits", "lost", "doubled", "nodes", "triangles");
}

static void print_row(const Options *o, const AccelBench *b, const Set *s, const Row *row)
{
    char nodes[24] = "", triangles[24] = "";
    double n = (double)s->count;
    if (row->accel) snprintf(nodes, sizeof nodes, "%.4g", (double)row->work.nodes / n);
    if (row->accel) snprintf(triangles, sizeof triangles, "%.4g", (double)row->work.triangles / n);
    printf(o->csv ? "%s,%s,%s,%s,%u,%.4g,%.4g,%llu,%llu,%s,%s\n" : "%-12s %-8s %-9s %-14s %8u %10.4g %9.4g %8llu %8llu %8s %9s\n",
           b->name, kinds[s->kind], methods[row->method], row->structure, row->limit == UINT32_MAX ? 0 : row->limit,
           median(row->seconds) / n * 1e6, (double)row->hits / n, (unsigned long long)row->lost, (unsigned long long)row->doubled,
           nodes, triangles);
    fflush(stdout);
}

static void measure_set(const Options *o, const AccelBench *b, const KellerAccel *reference, Row *rows, int count, const Set *s,
                        Room *room)
{
    for (int k = 0; k < count; k++) rows[k].hits = rows[k].lost = rows[k].doubled = 0, rows[k].work = (KellerAccelWork){0};
    for (size_t i = 0; i < s->count; i++) {
        KellerAccelWork work = {0};
        size_t exact = ours(room->it, reference, s, i, KELLER_NEXTHIT_FILTER, UINT32_MAX, &work, room->exact);
        if (exact > ROOM) exact = ROOM;
        for (int k = 0; k < count; k++) compare(&rows[k], room, s, i, exact);
    }
    for (int pass = 0; pass < PASSES; pass++)
        for (int k = 0; k < count; k++) {
            KellerAccelWork work = {0};
            for (size_t i = 0; i < s->count && i < WARM; i++) query(&rows[k], room, s, i, &work, NULL);
            double start = now();
            for (size_t i = 0; i < s->count; i++) query(&rows[k], room, s, i, &work, NULL);
            rows[k].seconds[pass] = now() - start;
        }
    for (int k = 0; k < count; k++) print_row(o, b, s, &rows[k]);
}

static void measure(const Options *o, AccelBench *b)
{
    enum { OURS = STRUCTURES * METHODS * LIMITS, ALL = OURS + MODES * 2 * LIMITS };
    KellerError error;
    KellerAccel *accel[STRUCTURES], *reference;
    KellerAccelOptions options = {.name = "kdtree"};
    Row rows[ALL] = {0};
    Peer *peer[MODES][2] = {{NULL}};
    Room room = {.hits = malloc(ROOM * sizeof(PeerHit)), .exact = malloc(ROOM * sizeof(PeerHit)), .seen = calloc(b->in.triangle_count, 1)};
    if (!room.hits || !room.exact || !room.seen) abort();
    if (keller_nexthit_new(&room.it, &error) != KELLER_OK) stop(&error);
    if (keller_accel_new(&b->in, &options, &reference, &error) != KELLER_OK) stop(&error);
    int count = 0;
    for (int k = 0; k < STRUCTURES; k++) {
        options.name = structures[k];
        if (keller_accel_new(&b->in, &options, &accel[k], &error) != KELLER_OK) stop(&error);
        for (int m = 0; m < METHODS; m++)
            for (int l = 0; l < LIMITS; l++)
                rows[count++] = (Row){.accel = accel[k], .structure = structures[k], .method = (KellerNexthitMethod)m, .limit = limits[l]};
    }
    KellerVec3 middle = v3_scale(v3_add(b->lower, b->upper), 0.5);
    for (int robust = 0; o->peer && robust < MODES; robust++)
        for (int filter = 0; filter < 2; filter++) {
            double seconds;
            Peer *p = peer[robust][filter] = peer_new(b->in.triangle_count, b->in.vertices, b->in.triangles, middle, robust, &seconds);
            if (!p || (filter && !peer_set_filter(p))) abort();
            for (int l = 0; l < LIMITS; l++)
                rows[count++] = (Row){.peer = p, .structure = robust ? "embree-robust" : "embree", .limit = limits[l],
                                      .method = filter ? KELLER_NEXTHIT_FILTER : KELLER_NEXTHIT_RESTART};
        }
    for (int kind = RANDOM; kind <= CONE; kind++) {
        if (kind == CONE && isnan(o->half_angle)) continue;
        Set s = make_set(o, b, kind);
        measure_set(o, b, reference, rows, kind == CONE ? OURS : count, &s, &room);
        free_set(&s);
    }
    for (int k = 0; k < STRUCTURES; k++) keller_accel_free(accel[k]);
    keller_accel_free(reference);
    for (int k = 0; k < MODES * 2; k++) peer_free(peer[k / 2][k % 2]);
    keller_nexthit_free(room.it);
    free(room.hits);
    free(room.exact);
    free(room.seen);
}

/* ---- the command line -------------------------------------------------------------------------------------------- */

static int wrong_usage(const char *what, const char *text)
{
    fprintf(stderr,
            "keller-bench-nexthit: %s \"%s\"; usage: keller-bench-nexthit [--csv] [--scene FILE]... [--layers N]... [--rays N] "
            "[--seed N] [--half-angle DEG] [--peer embree]\n",
            what, text);
    return 2;
}

static bool number(const char *text, double least, double most, double *value)
{
    char *end;
    *value = strtod(text, &end); /* 1e6 is fine */
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
        } else if (strcmp(name, "--layers") == 0) {
            if (o->layer_count == MOST || !number(value, 1, 1e6, &v)) return wrong_usage("not a number of sheets:", value);
            o->layers[o->layer_count++] = (uint32_t)v;
        } else if (strcmp(name, "--rays") == 0) {
            if (!number(value, 1, 1e9, &o->rays)) return wrong_usage("not a number of rays:", value);
        } else if (strcmp(name, "--seed") == 0) {
            if (!number(value, 0, 1e15, &v)) return wrong_usage("not a seed:", value);
            o->seed = (uint64_t)v;
        } else if (strcmp(name, "--half-angle") == 0) {
            if (!number(value, 0, 80, &o->half_angle)) return wrong_usage("not a half-angle from 0 to 80 degrees:", value);
        } else if (strcmp(name, "--peer") == 0) {
            if (strcmp(value, "embree") != 0) return wrong_usage("unknown peer", value);
            if (!peer_there()) {
                fputs("keller-bench-nexthit: no Embree was there when this program was built: install libembree-dev, run meson "
                      "setup again\n", stderr);
                return 1;
            }
            o->peer = true;
        } else {
            return wrong_usage("unknown option", name);
        }
    }
    if (o->scene_count + o->layer_count == 0) return wrong_usage("nothing to measure:", "expected --scene or --layers");
    return 0;
}

int main(int argc, char **argv)
{
    Options o = {.rays = 20000, .seed = 1, .half_angle = NAN};
    int wrong = parse(argc, argv, &o);
    if (wrong) return wrong;
    print_head(&o);
    for (int i = 0; i < o.scene_count + o.layer_count; i++) {
        AccelBench b;
        KellerError error;
        KellerStatus status = i < o.scene_count ? accel_bench_read(o.scenes[i], RAW, &b, &error)
                                                : accel_bench_layers(o.layers[i - o.scene_count], &b, &error);
        if (status != KELLER_OK) stop(&error);
        if (b.in.triangle_count > 0) measure(&o, &b);
        accel_bench_free(&b);
    }
    return 0;
}
