#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "../cases.h"
#include "against_oracle.h"

/* The reflections and diffractions of a path, without the slabs between them. */
static uint32_t bends(uint32_t count, const KellerStep *steps, KellerStep bare[ORACLE_MAX_STEPS])
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < count && n < ORACLE_MAX_STEPS; i++)
        if (steps[i].kind != KELLER_TRANSMISSION) bare[n++] = steps[i];
    return n;
}

static bool same(uint32_t count_a, const KellerStep *a, uint32_t count_b, const KellerStep *b)
{
    if (count_a != count_b) return false;
    for (uint32_t i = 0; i < count_a; i++)
        if (a[i].kind != b[i].kind || a[i].id != b[i].id) return false;
    return true;
}

/* Coincident slabs come in the order of their ids or the other way round, with the ray's direction: sorted here. */
static void sort_coincident(const KellerScene *scene, uint32_t count, KellerStep *steps)
{
    for (uint32_t i = 1; i < count; i++)
        for (uint32_t j = i; j > 0; j--) {
            KellerStep a = steps[j - 1], b = steps[j];
            if (a.kind != KELLER_TRANSMISSION || b.kind != KELLER_TRANSMISSION || a.id <= b.id ||
                scene->faces[a.id].plane != scene->faces[b.id].plane)
                break;
            steps[j - 1] = b;
            steps[j] = a;
        }
}

/* Of a path that cannot be decided, only the bends. */
static bool same_steps(const KellerScene *scene, const OraclePath *a, const Found *b)
{
    KellerStep bare_a[ORACLE_MAX_STEPS], bare_b[ORACLE_MAX_STEPS];
    if (a->margin >= ORACLE_TOLERANCE) {
        KellerStep sorted[KELLER_MAX_INTERACTIONS];
        memcpy(sorted, b->step, sizeof sorted);
        sort_coincident(scene, b->count, sorted);
        return same(a->count, a->step, b->count, sorted);
    }
    uint32_t n = bends(a->count, a->step, bare_a), m = bends(b->count, b->step, bare_b);
    return same(n, bare_a, m, bare_b);
}

static void report(const char *what, uint64_t seed, const char *search, uint32_t rx, uint32_t count,
                   const KellerStep *steps, double length, double margin)
{
    char text[256];
    printf("# seed %llu, %s search, receiver %u: %s: %s, length %.12g, margin %.3g\n", (unsigned long long)seed, search,
           rx, what, path_text(count, steps, text, sizeof text), length, margin);
}

size_t compare_with_oracle(const KellerScene *scene, KellerVec3 tx, KellerVec3 at, uint64_t seed, uint32_t rx,
                           uint32_t transmissions, const OracleResult *oracle, const FoundPaths *found, const char *search)
{
    size_t differences = 0;
    bool *used = calloc(found->count + 1, sizeof *used);
    assert_non_null(used);
    for (size_t i = 0; i < oracle->count; i++) {
        const OraclePath *p = &oracle->path[i];
        size_t times = 0;
        for (size_t j = 0; j < found->count; j++) {
            const Found *f = &found->path[j];
            if (f->rx != rx || !same_steps(scene, p, f)) continue;
            used[j] = true;
            times++;
            if (p->valid && !(fabs(f->length - p->length) <= 1e-9 * p->length)) {
                report("wrong length", seed, search, rx, p->count, p->step, f->length, p->margin);
                differences++;
            }
            if (p->valid && !(fabs(f->delay * 299792458.0 - p->length) <= 1e-9 * p->length)) {
                report("wrong delay", seed, search, rx, p->count, p->step, f->delay, p->margin);
                differences++;
            }
            for (uint32_t k = 0; p->valid && p->count == f->count && k < p->count; k++)
                if (!(v3_distance(p->position[k], f->position[k]) <= 1e-7 * p->length)) {
                    report("wrong position", seed, search, rx, p->count, p->step, f->length, p->margin);
                    differences++;
                }
        }
        bool decided = p->margin >= ORACLE_TOLERANCE;
        if (times > 1 || (decided && times == 0)) {
            report(times ? "doubled" : "missing", seed, search, rx, p->count, p->step, p->length, p->margin);
            differences++;
        }
    }
    for (size_t j = 0; j < found->count; j++) {
        const Found *f = &found->path[j];
        if (f->rx != rx || used[j]) continue;
        OraclePath p;
        KellerStep bare[ORACLE_MAX_STEPS];
        uint32_t n = bends(f->count, f->step, bare);
        bool sequence = oracle_solve(scene, tx, at, n, bare, transmissions, &p);
        report(sequence ? "not in the oracle" : "against the rules", seed, search, rx, f->count, f->step, f->length,
               p.margin);
        differences++;
    }
    free(used);
    return differences;
}

static void check_seed(uint64_t seed, uint32_t flags, const uint32_t orders[4], Tally *tally)
{
    uint32_t reflections = orders[0], diffractions = orders[1], transmissions = orders[2], interactions = orders[3];
    RandomScene world = scene_random(seed, flags);
    KellerScene scene = scene_of(&world.soup);
    Run run = run_new(&world.tx, SCENE_RECEIVERS, world.rx, reflections, diffractions, interactions);
    run.transmissions = transmissions;
    if (seed % 3 == 0) { /* left alone, the search splits no cones in scenes as small as these */
        run.split_over = 4;
        run.cone = 8 * M_PI / 180;
    }
    FoundPaths points = run_simulation(&scene, &run);
    run.grid_step = world.step;
    FoundPaths grid = run_simulation(&scene, &run);
    size_t differences = 0;
    for (uint32_t rx = 0; rx < SCENE_RECEIVERS; rx++) {
        OracleResult oracle = oracle_enumerate_through(&scene, world.tx, world.rx[rx], reflections, diffractions,
                                                       transmissions, interactions);
        differences += compare_with_oracle(&scene, world.tx, world.rx[rx], seed, rx, transmissions, &oracle, &points, "point");
        differences += compare_with_oracle(&scene, world.tx, world.rx[rx], seed, rx, transmissions, &oracle, &grid, "grid");
        tally->paths += oracle.count;
        for (size_t i = 0; i < oracle.count; i++) tally->through += oracle.path[i].count > oracle.path[i].bends;
        tally->candidates += oracle.candidates;
        tally->undecidable += oracle.undecidable;
        oracle_free(&oracle);
    }
    tally->scenes++;
    tally->differences += differences;
    tally->scenes_different += differences > 0;
    found_free(&points);
    found_free(&grid);
    keller_scene_free(&scene);
    soup_release(&world.soup);
}

void seeds_asked_for(unsigned long *first, unsigned long *last)
{
    const char *seeds = getenv("KELLER_SEEDS");
    if (seeds) sscanf(seeds, "%lu-%lu", first, last);
}

void check_seeds(unsigned long last, uint32_t flags, size_t order_count, const uint32_t (*orders)[4], Tally *tally)
{
    unsigned long first = 1;
    last = cases_scenes(last, order_count < last ? order_count : last);
    seeds_asked_for(&first, &last);
    for (unsigned long seed = first; seed <= last; seed++) check_seed(seed, flags, orders[seed % order_count], tally);
    printf("# %zu paths, %zu of them through walls, of %zu candidates, %zu undecidable, %zu scenes differ\n", tally->paths,
           tally->through, tally->candidates, tally->undecidable, tally->scenes_different);
    assert_int_equal(tally->differences, 0);
}
