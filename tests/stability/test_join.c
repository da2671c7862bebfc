/* Both ends' sequences of many edges, joined, against brute force: every sequence of a pattern, one by one, on plates. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "harness.h"
#include "keller/accel.h"
#include "path/join.h"
#include "plates.h"

/* The longest are those with as many sequences as brute force can take. */
static const char *const patterns[] = {"FWFW",  "WFFW",  "WWFW",  "FWWF",   "WFFFW",   "FWFWF",  "WFWFW",
                                       "WFFWF", "WWFWW", "FWFFW", "WFWWFW", "WFWFFW", "WFWFWFW"};
enum { SCENES = 24, PATTERNS = sizeof patterns / sizeof *patterns };
static const double sequences_most = 5e4;

typedef struct {
    KellerScene scene;
    KellerAccel *accel;
    FaceBox *boxes;
    KellerVec3 tx, rx;
} Place;

static bool add_path(void *list, const KellerPath *path) { return path_list_push(list, path); }

static void solve_all(const Place *at, Pattern pattern, uint32_t transmissions, PathList *list)
{
    const uint32_t k = pattern_length(pattern);
    KellerStep step[KELLER_MAX_BENDS];
    KellerAccelWork work = {0};
    size_t all = 1;
    for (uint32_t i = 0; i < k; i++) all *= pattern >> i & 1 ? at->scene.wedge_count : at->scene.face_count;
    for (size_t number = 0; number < all; number++) {
        size_t rest = number;
        bool again = false;
        for (uint32_t i = 0; i < k; i++) {
            const bool wedge = pattern >> (k - 1 - i) & 1;
            const size_t count = wedge ? at->scene.wedge_count : at->scene.face_count;
            step[i] = (KellerStep){wedge ? KELLER_DIFFRACTION : KELLER_REFLECTION, (uint32_t)(rest % count)};
            rest /= count;
            again = again || (i > 0 && step[i].kind == step[i - 1].kind && step[i].id == step[i - 1].id);
        }
        if (!again) assert_true(keller_path_solve(&at->scene, at->accel, at->tx, at->rx, k, step, transmissions, add_path, list, &work));
    }
}

static void join_all(const Place *at, Pattern pattern, uint32_t transmissions, uint32_t threads, double aperture, PathList *list, JoinWork *work)
{
    const uint32_t k = pattern_length(pattern);
    const Meeting m = plan_meeting(pattern, k, false);
    TreePlan plan[2];
    Ends ends[2];
    TreeWork searched = {0};
    KellerError error;
    for (int i = 0; i < 2; i++) {
        assert_true(plan_init(&plan[i], k));
        plan[i].of[i ? pattern_last(pattern, m.backward) : pattern_first(pattern, m.forward)] |= PLAN_WANT;
        plan_uses(&plan[i]);
        const TreeLimits limits = {.scene = &at->scene, .accel = at->accel, .plan = &plan[i], .transmissions = transmissions,
                                   .interactions = k + transmissions, .tan_aperture = tan(aperture), .split_over = 4};
        assert_int_equal(ends_search(&ends[i], &limits, i ? at->rx : at->tx, threads, pattern_wedges(pattern) > 1, &searched, &error), KELLER_OK);
    }
    const JoinLimits limits = {.scene = &at->scene, .accel = at->accel, .boxes = at->boxes, .reflections = k, .diffractions = k,
                               .transmissions = transmissions, .interactions = k + transmissions, .bends = k, .threads = threads};
    assert_true(join_pattern(&limits, &ends[0], &ends[1], pattern, at->tx, at->rx, list, work));
    for (int i = 0; i < 2; i++) {
        ends_free(&ends[i]);
        plan_free(&plan[i]);
    }
}

static int compare_keys(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return x < y ? -1 : x > y;
}

/* A number for the steps of each path, sorted; frees the list. */
static uint64_t *keys_of(PathList *list, size_t *count)
{
    uint64_t *keys = malloc((list->count + 1) * sizeof *keys);
    *count = list->count;
    for (size_t i = 0; i < list->count; i++) {
        keys[i] = list->items[i].count;
        for (uint32_t k = 0; k < list->items[i].count; k++) {
            const KellerStep step = list->nodes[list->items[i].begin + k].step;
            keys[i] = (keys[i] ^ (2 * (uint64_t)step.id + (step.kind == KELLER_DIFFRACTION))) * 0x9e3779b97f4a7c15u;
            keys[i] ^= keys[i] >> 29;
        }
    }
    qsort(keys, *count, sizeof *keys, compare_keys);
    path_list_free(list);
    return keys;
}

static void joined_like_brute_force(void **state)
{
    (void)state;
    size_t paths = 0, of_four = 0, candidates = 0, sequences = 0, wrong = 0;
    for (uint64_t seed = 1; seed <= SCENES; seed++) {
        Random r = random_seeded(seed);
        PlatesScene w = plates_random(seed, PLATES_AS_BUILT);
        const double scale = pow(10, random_range(&r, -2, 3));
        const KellerVec3 off = random_below(&r, 3) ? v3(0, 0, 0) : v3(1e4 * scale, -2e4 * scale, 5e3 * scale);
        for (size_t i = 0; i < w.soup.vertex_count; i++) w.soup.vertices[i] = v3_madd(off, w.soup.vertices[i], scale);
        Place at = {.scene = scene_of(&w.soup), .tx = v3_madd(off, w.tx, scale), .rx = v3_madd(off, w.rx, scale)};
        KellerError error;
        assert_int_equal(keller_accel_build("auto", &at.scene, &at.accel, &error), KELLER_OK);
        assert_non_null(at.boxes = face_boxes(&at.scene));
        for (size_t i = 0; i < PATTERNS; i++) {
            Pattern pattern = PATTERN_EMPTY;
            double all = 1;
            for (const char *c = patterns[i]; *c; c++) {
                pattern = pattern_and(pattern, *c == 'W');
                all *= (double)(*c == 'W' ? at.scene.wedge_count : at.scene.face_count);
            }
            if (all > sequences_most) continue;
            const uint32_t transmissions = random_below(&r, 3);
            PathList brute = {0}, joined = {0};
            JoinWork work = {0};
            size_t count[2];
            solve_all(&at, pattern, transmissions, &brute);
            join_all(&at, pattern, transmissions, 1 + random_below(&r, 2), random_below(&r, 2) ? 0.14 : 0.02, &joined, &work);
            uint64_t *key[2] = {keys_of(&brute, &count[0]), keys_of(&joined, &count[1])};
            if (count[0] != count[1] || memcmp(key[0], key[1], count[0] * sizeof **key) != 0) {
                printf("# plates %d, %s, %u transmissions: %zu paths by brute force, %zu joined\n", (int)seed, patterns[i], transmissions, count[0], count[1]);
                wrong++;
            }
            paths += count[0];
            of_four += pattern_wedges(pattern) > 3 ? count[0] : 0;
            candidates += work.candidates;
            sequences += (size_t)all;
            for (int k = 0; k < 2; k++) free(key[k]);
        }
        free(at.boxes);
        keller_accel_free(at.accel);
        keller_scene_free(&at.scene);
        soup_release(&w.soup);
    }
    printf("# %zu paths, %zu of four edges, from %zu candidates of %zu sequences\n", paths, of_four, candidates, sequences);
    assert_int_equal(wrong, 0);
    assert_true(paths > 1000 && of_four > 100 && candidates < sequences / 10);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(joined_like_brute_force)};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
