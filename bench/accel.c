/* keller-bench-accel -- how long the accelerators' queries take, and what they do meanwhile.
 *
 * usage: keller-bench-accel [--csv] [--scene FILE]... [--random N]... [--hair STRANDS]... [--structure NAME]... [--query NAME] [--kind NAME]
 *                           [--half-angle DEG] [--queries N] [--seed N] [--spatial SHARE] [--cost RATIO] [--peer embree]
 *                           [--order slabs|exact|directrix|midpoint] [--contained yes|no] [--leaf-boxes]
 *
 * One thread; times are processor times, medians of five passes over the same queries after one not counted. Columns:
 *   structure           kdtree, bvh, bvh8, and when asked for bvh+mask, bvh8+mask, ubvh, dacrt; with --peer also embree (its fast
 *                       mode) and embree-robust. To compare with ubvh: ubvh-skewed (no box along the axes), ubvh-ploc
 *                       and ubvh-greedy (pairs of triangles), ubvh-4 (skewed, four children a node), sobb, sobb-4, obb and dop14
 *                       (skewed and oriented boxes, and 14-DOPs, around blocks of up to eight triangles)
 *   query               rays: nearest, any, all (hits). Cones: nearest (the nearest triangle, and the edges whose range begins
 *                       no farther: keller_accel_cone_window of depth 0), all (triangles and edges, with their ranges), any;
 *                       walk (only when asked for): what of `all` is spent on the way to the leaves, which are not looked into
 *   kind                primary (directions of a pinhole camera of 90 degrees in the middle of the box, row by row), random
 *                       (origins in the box, directions on the sphere)
 *   half_angle_deg      -1 for rays
 *   eccentricity        0, or random: uniform in [0, 0.99], the half-angle being that of the major axis
 *   nodes, triangles, edges   tested, per query; hits: primitives reported, per query
 *   build_ms            of the structure over triangles and edges; the peer's is of its triangles alone
 *   bytes_per_triangle  all that is kept, edges included
 *   ratio, ratio_robust time over that of the peer's nearest hit for rays of the same kind, fast and robust mode
 * Status 1 if a scene cannot be had, 2 on wrong usage. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "accel/leaf.h"
#include "accel_set.h"
#include "embree_peer.h"
#include "geom/cone_lanes.h"

static const char *const all_structures[] = {"kdtree", "bvh", "bvh8", "bvh+mask", "bvh8+mask", "ubvh", "dacrt"};
enum { STRUCTURES = sizeof all_structures / sizeof *all_structures, PLAIN = 3 }; /* the first ones by default */
static const char *const variants[] = {"ubvh-skewed", "ubvh-ploc", "ubvh-greedy", "ubvh-4", "sobb", "sobb-4", "obb", "dop14"};
static const KellerSkewedOptions variant_options[] = {{.everywhere = true},
                                                      {.pairs = KELLER_PAIRS_PLOC},
                                                      {.pairs = KELLER_PAIRS_GREEDY},
                                                      {.everywhere = true, .width = 4},
                                                      {.everywhere = true, .blocks = true},
                                                      {.everywhere = true, .blocks = true, .width = 4},
                                                      {.everywhere = true, .blocks = true, .boxes = KELLER_BOXES_ORIENTED},
                                                      {.boxes = KELLER_BOXES_DOP14}};
enum { VARIANTS = sizeof variants / sizeof *variants };
static const char *const queries[] = {"nearest", "any", "all", "walk"};
static const char *const orders[] = {"slabs", "exact", "directrix", "midpoint"};
static const char *const kinds[] = {"primary", "random"};
static const double half_angles[] = {-1, 1e-5, 0.1, 0.5, 5, 15};
enum { NEAREST, ANY, EVERY, WALK, QUERIES, KINDS = 2, ANGLES = 6, RAW = 300000, MOST = 16 };

typedef struct {
    bool csv, peer;
    AccelScenes scenes;
    const char *structures[MOST], *query, *kind;
    int structure_count;
    double half_angle;
    KellerAccelOptions how;
} Options;

typedef struct {
    double seconds[2], build;    /* of a ray of each kind; of the build */
} PeerTimes;

/* Which of the names; -1: none. */
static int which(const char *const *names, int count, const char *name)
{
    for (int i = 0; i < count; i++)
        if (strcmp(names[i], name) == 0) return i;
    return -1;
}

/* ---- queries ----------------------------------------------------------------------------------------------------- */

static Set make_set(const Options *o, const AccelBench *b, int kind, double half_angle, bool eccentric)
{
    return accel_set_make(b, o->scenes.queries, o->scenes.seed, kind, half_angle, eccentric);
}

static bool count_ray(void *context, KellerRayHit hit)
{
    (void)hit;
    ++*(uint64_t *)context;
    return false;
}

static double count_cone(void *context, uint32_t primitive, KellerRange range)
{
    (void)primitive, (void)range;
    ++*(uint64_t *)context;
    return INFINITY;
}

static float pass_by(void *context, uint32_t leaf, bool inside, float far)
{
    (void)leaf, (void)inside;
    ++*(uint64_t *)context;
    return far;
}

/* The walk of an `all` query; leaves count as hits. */
static void walk_only(const KellerAccel *a, const KellerCone *c, uint64_t *leaves, KellerAccelWork *work)
{
    KellerConeLanes lanes;
    WalkHow how = {.contained = c->tan_alpha > 0.01};
    cone_lanes_make(c, v3_sub(c->origin, a->middle), (KellerRange){0, INFINITY}, a->size, &lanes);
    a->kind->walk(a->tree, &lanes, &how, pass_by, leaves, &work->nodes);
}

/* One pass over the set; returns what was reported. */
static uint64_t pass(const KellerAccel *accel, const Set *s, int query, bool rays, KellerAccelWork *work)
{
    const KellerRange clip = {0, INFINITY};
    uint64_t hits = 0;
    for (size_t i = 0; i < s->count; i++) {
        KellerVec3 o = s->origins[i], d = s->directions[i];
        const KellerCone *c = &s->cones[i];
        KellerRayHit ray;
        KellerConeHit nearest;
        switch (query * 2 + rays) {
        case NEAREST * 2 + 1: hits += keller_accel_ray_nearest(accel, o, d, clip, &ray, work); break;
        case ANY * 2 + 1: hits += keller_accel_ray_any(accel, o, d, clip, work); break;
        case EVERY * 2 + 1: keller_accel_ray_all(accel, o, d, clip, count_ray, &hits, work); break;
        case NEAREST * 2:
            hits += keller_accel_cone_window(accel, c, clip, 0, &nearest, NULL, count_cone, &hits, work);
            break;
        case WALK * 2:
        case WALK * 2 + 1: walk_only(accel, c, &hits, work); break;
        case ANY * 2: hits += keller_accel_cone_any(accel, c, clip, work); break;
        case EVERY * 2:
            keller_accel_cone(accel, c, clip, count_cone, count_cone, &hits, work);
            break;
        }
    }
    return hits;
}

/* ---- the table --------------------------------------------------------------------------------------------------- */

static void print_row(const Options *o, const AccelBench *b, const char *structure, const char *query, const char *kind,
                      double half_angle, const char *eccentricity, double us, const double work[4], double build_ms,
                      double bytes, const double ratio[2])
{
    char cell[7][24] = {""};
    for (int i = 0; i < 4 && work; i++) snprintf(cell[i], sizeof cell[i], "%.4g", work[i]);
    if (bytes > 0) snprintf(cell[4], sizeof cell[4], "%.1f", bytes);
    for (int i = 0; i < 2; i++)
        if (ratio[i] > 0) snprintf(cell[5 + i], sizeof cell[5], "%.3g", ratio[i]);
    printf(o->csv ? "%s,%s,%s,%s,%g,%s,%.4g,%s,%s,%s,%s,%.4g,%s,%s,%s\n"
                  : "%-16s %-13s %-8s %-8s %8g %-7s %10.4g %8s %9s %9s %9s %9.4g %7s %7s %7s\n",
           b->name, structure, query, kind, half_angle, eccentricity, us, cell[0], cell[1], cell[2], cell[3], build_ms, cell[4],
           cell[5], cell[6]);
    fflush(stdout);
}

static void print_head(const Options *o)
{
    printf(o->csv ? "%s,%s,%s,%s,%s,%s,%s,%s,%s,%s,%s,%s,%s,%s,%s\n"
                  : "%-16s %-13s %-8s %-8s %8s %-7s %10s %8s %9s %9s %9s %9s %7s %7s %7s\n",
           "scene", "structure", "query", "kind", o->csv ? "half_angle_deg" : "angle", o->csv ? "eccentricity" : "ecc.",
           o->csv ? "us_per_query" : "us", "nodes", "triangles", "edges", "hits", "build_ms",
           o->csv ? "bytes_per_triangle" : "B/tri", "ratio", o->csv ? "ratio_robust" : "robust");
}

static KellerVec3 middle_of(const AccelBench *b) { return v3_scale(v3_add(b->lower, b->upper), 0.5); }

/* Fast and robust mode, rays of both kinds; times[mode]. */
static bool measure_peer(const Options *o, const AccelBench *b, PeerTimes times[2])
{
    for (int robust = 0; robust < 2; robust++) {
        double build[PASSES], seconds[PASSES];
        Peer *peer = NULL;
        for (int i = 0; i < PASSES; i++) {
            peer_free(peer);
            peer = peer_new(b->in.triangle_count, b->in.vertices, b->in.triangles, middle_of(b), robust, &build[i]);
            if (!peer) return false;
        }
        times[robust].build = accel_median(build);
        for (int kind = 0; kind < KINDS; kind++) {
            Set s = make_set(o, b, kind, -1, false);
            size_t hits = peer_nearest(peer, s.count, s.origins, s.directions);
            for (int i = 0; i < PASSES; i++) {
                double start = accel_now();
                peer_nearest(peer, s.count, s.origins, s.directions);
                seconds[i] = accel_now() - start;
            }
            double each = times[robust].seconds[kind] = accel_median(seconds) / (double)s.count;
            double ratio[2] = {each / times[0].seconds[kind], robust ? 1 : 0};
            double work[4] = {0, 0, 0, (double)hits / (double)s.count};
            print_row(o, b, robust ? "embree-robust" : "embree", "nearest", kinds[kind], -1, "0", each * 1e6, work,
                      times[robust].build * 1e3, 0, ratio);
            accel_set_free(&s);
        }
        peer_free(peer);
    }
    return true;
}

static void measure_set(const Options *o, const AccelBench *b, const char *name, const KellerAccel *accel, const Set *s, int kind,
                        int angle, bool eccentric, double build, const PeerTimes peer[2])
{
    for (int query = 0; query < QUERIES; query++) {
        if (o->query ? strcmp(o->query, queries[query]) != 0 : query == WALK) continue;
        KellerAccelWork work = {0};
        double seconds[PASSES], n = (double)s->count;
        uint64_t hits = pass(accel, s, query, half_angles[angle] < 0, &work);
        for (int i = 0; i < PASSES; i++) {
            KellerAccelWork again = {0};
            double start = accel_now();
            pass(accel, s, query, half_angles[angle] < 0, &again);
            seconds[i] = accel_now() - start;
        }
        double each = accel_median(seconds) / n, ratio[2] = {0, 0};
        for (int i = 0; i < 2 && peer; i++) ratio[i] = each / peer[i].seconds[kind];
        const double done[4] = {(double)work.nodes / n, (double)work.triangles / n, (double)work.edges / n, (double)hits / n};
        print_row(o, b, name, queries[query], kinds[kind], half_angles[angle], eccentric ? "random" : "0",
                  each * 1e6, done, build * 1e3, (double)keller_accel_bytes(accel) / b->in.triangle_count, ratio);
    }
}

static KellerStatus measure(const Options *o, const AccelBench *b, const char *name, const PeerTimes *peer, KellerError *error)
{
    KellerAccelOptions options = o->how;
    int variant = which(variants, VARIANTS, name);
    options.name = variant < 0 ? name : "ubvh";
    if (variant >= 0) options.skewed = variant_options[variant];
    options.threads = 1;
    KellerAccel *accel = NULL;
    double build[PASSES];
    int builds = b->in.triangle_count > RAW ? 1 : PASSES;
    for (int i = 0; i < PASSES; i++) {
        if (i >= builds) {
            build[i] = build[0];
            continue;
        }
        keller_accel_free(accel);
        double start = accel_now();
        KellerStatus status = keller_accel_new(&b->in, &options, &accel, error);
        build[i] = accel_now() - start;
        if (status != KELLER_OK) return status;
    }
    double each = accel_median(build);
    for (int kind = 0; kind < KINDS; kind++)
        for (int angle = 0; angle < ANGLES && !(o->kind && kind != which(kinds, KINDS, o->kind)); angle++)
            for (int eccentric = 0; eccentric < (half_angles[angle] < 0 ? 1 : 2); eccentric++) {
                if (!isnan(o->half_angle) && half_angles[angle] != o->half_angle) continue;
                Set s = make_set(o, b, kind, half_angles[angle], eccentric);
                measure_set(o, b, variant < 0 ? keller_accel_name(accel) : name, accel, &s, kind, angle, eccentric, each, peer);
                accel_set_free(&s);
            }
    keller_accel_free(accel);
    return KELLER_OK;
}

static KellerStatus measure_all(void *context, const AccelBench *b, KellerError *error)
{
    const Options *o = context;
    PeerTimes peer[2];
    KellerStatus status = KELLER_OK;
    bool compared = o->peer && measure_peer(o, b, peer);
    for (int i = 0; status == KELLER_OK && i < o->structure_count; i++)
        status = measure(o, b, o->structures[i], compared ? peer : NULL, error);
    return status;
}

/* ---- the command line -------------------------------------------------------------------------------------------- */

static int wrong_usage(const char *what, const char *text)
{
    fprintf(stderr,
            "keller-bench-accel: %s \"%s\"; usage: keller-bench-accel [--csv] [--scene FILE]... [--random N]... "
            "[--hair STRANDS]... [--structure NAME]... [--query NAME] [--kind NAME] [--half-angle DEG] [--queries N] "
            "[--seed N] [--spatial SHARE] [--cost RATIO] [--peer embree] [--order NAME] [--contained yes|no] [--leaf-boxes]\n",
            what, text);
    return 2;
}

static int parse(int argc, char **argv, Options *o)
{
    for (int i = 1; i < argc; i++) {
        const char *name = argv[i], *value = argv[i + 1] ? argv[i + 1] : "", *wrong;
        int words = accel_scenes_option(&o->scenes, &o->csv, name, value, &wrong);
        if (words < 0) return wrong_usage(wrong, value);
        i += words > 1;
        if (words > 0) continue;
        if (strcmp(name, "--leaf-boxes") == 0) {
            o->how.leaf_boxes = true;
            continue;
        }
        i++;
        if (strcmp(name, "--structure") == 0) {
            bool known = strcmp(value, "auto") == 0 || which(all_structures, STRUCTURES, value) >= 0 || which(variants, VARIANTS, value) >= 0;
            if (!known || o->structure_count == MOST) return wrong_usage("unknown structure", value);
            o->structures[o->structure_count++] = value;
        } else if (strcmp(name, "--query") == 0) {
            o->query = value;
            if (which(queries, QUERIES, value) < 0) return wrong_usage("unknown query", value);
        } else if (strcmp(name, "--kind") == 0) {
            o->kind = value;
            if (which(kinds, KINDS, value) < 0) return wrong_usage("unknown kind", value);
        } else if (strcmp(name, "--order") == 0) {
            int order = which(orders, 4, value);
            if (order < 0) return wrong_usage("unknown order", value);
            o->how.order = (KellerAccelOrder)order;
        } else if (strcmp(name, "--contained") == 0) {
            o->how.contained = strcmp(value, "yes") == 0 ? 1 : -1;
            if (o->how.contained < 0 && strcmp(value, "no") != 0) return wrong_usage("neither yes nor no:", value);
        } else if (strcmp(name, "--half-angle") == 0) {
            bool known = false;
            if (!accel_number(value, -1, 90, false, &o->half_angle)) return wrong_usage("not a half-angle:", value);
            for (int k = 0; k < ANGLES; k++) known |= half_angles[k] == o->half_angle;
            if (!known) return wrong_usage("not a half-angle of the table:", value);
        } else if (strcmp(name, "--spatial") == 0) {
            if (!accel_number(value, 0, 10, false, &o->how.spatial)) return wrong_usage("not a share:", value);
        } else if (strcmp(name, "--cost") == 0) {
            if (!accel_number(value, 0, 1e6, false, &o->how.cost_ratio)) return wrong_usage("not a ratio:", value);
        } else if (strcmp(name, "--peer") == 0) {
            if (strcmp(value, "embree") != 0) return wrong_usage("unknown peer", value);
            if (!peer_there()) {
                fputs("keller-bench-accel: no Embree was there when this program was built: install libembree-dev, run meson "
                      "setup again\n", stderr);
                return 1;
            }
            o->peer = true;
        } else {
            return wrong_usage("unknown option", name);
        }
    }
    if (accel_scenes_none(&o->scenes))
        return wrong_usage("nothing to measure:", "expected --scene, --random or --hair");
    for (int k = 0, none = o->structure_count == 0; none && k < PLAIN; k++) o->structures[o->structure_count++] = all_structures[k];
    return 0;
}

int main(int argc, char **argv)
{
    Options o = {.scenes = {.queries = 100000, .seed = 1}, .half_angle = NAN};
    int wrong = parse(argc, argv, &o);
    if (wrong) return wrong;
    print_head(&o);
    KellerError error;
    KellerStatus status = accel_scenes_measure(&o.scenes, measure_all, &o, &error);
    if (status != KELLER_OK) fprintf(stderr, "keller-bench-accel: %s\n", error.message);
    return status == KELLER_OK ? 0 : 1;
}
