/* A search whose memory is refused at any point says so, by one thread or several. The linker has the library's allocations pass through here. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "harness.h"
#include "keller/accel.h"
#include "path/join.h"
#include "scenes.h"

static atomic_int_fast64_t granted = INT64_MAX; /* so many more, then one is refused; the threads of a search share them */
static size_t least;            /* bytes: smaller ones are always granted */

void *__real_malloc(size_t bytes);
void *__real_calloc(size_t count, size_t bytes);
void *__real_realloc(void *p, size_t bytes);
void *__wrap_malloc(size_t bytes);
void *__wrap_calloc(size_t count, size_t bytes);
void *__wrap_realloc(void *p, size_t bytes);

static bool grant(size_t bytes) { return bytes < least || atomic_fetch_sub(&granted, 1) != 0; }
void *__wrap_realloc(void *p, size_t bytes) { return grant(bytes) ? __real_realloc(p, bytes) : NULL; }
void *__wrap_malloc(size_t bytes) { return grant(bytes) ? __real_malloc(bytes) : NULL; }
void *__wrap_calloc(size_t count, size_t bytes) { return grant(count * bytes) ? __real_calloc(count, bytes) : NULL; }

typedef struct {
    KellerVec3 tx, rx;
    KellerScene scene;
    FaceBox *boxes;
    KellerAccel *accel;
} Place;

/* Both ends searched and joined; false: out of memory. */
static bool find_all(const Place *at, uint32_t threads, size_t *paths)
{
    enum { REFLECTIONS = 2, DIFFRACTIONS = 2, BENDS = 4 };
    TreePlan plan[2] = {0};
    Ends ends[2] = {0};
    PathList list = {0};
    JoinWork joined = {0};
    TreeWork searched = {0};
    KellerError error;
    const JoinLimits limits = {.scene = &at->scene, .accel = at->accel, .boxes = at->boxes, .reflections = REFLECTIONS, .diffractions = DIFFRACTIONS,
                               .interactions = BENDS, .bends = BENDS, .threads = threads};
    bool ok = plan_init(&plan[0], BENDS) && plan_init(&plan[1], BENDS);
    if (ok) plan_ends(REFLECTIONS, DIFFRACTIONS, &plan[0], &plan[1]);
    for (int i = 0; i < 2 && ok; i++) {
        const TreeLimits tree = {.scene = &at->scene, .accel = at->accel, .plan = &plan[i], .interactions = BENDS, .tan_aperture = 0.1, .split_over = 4};
        ok = ends_search(&ends[i], &tree, i ? at->rx : at->tx, threads, true, &searched, &error) == KELLER_OK;
    }
    ok = ok && join_ends(&limits, &ends[0], &ends[1], at->tx, at->rx, &list, &joined, &error) == KELLER_OK;
    *paths = list.count;
    for (int i = 0; i < 2; i++) {
        ends_free(&ends[i]);
        plan_free(&plan[i]);
    }
    path_list_free(&list);
    return ok;
}

static void refused_memory_is_an_error(void **state)
{
    (void)state;
    size_t refused = 0;
    for (uint64_t seed = 1; seed <= 2; seed++) {
        Place at;
        KellerError error;
        RandomScene random = scene_random(seed, 0);
        assert_int_equal(keller_scene_build(&random.soup, &at.scene, &error), KELLER_OK);
        assert_int_equal(keller_accel_build("bvh8", &at.scene, &at.accel, &error), KELLER_OK);
        at.boxes = face_boxes(&at.scene);
        at.tx = random.tx;
        at.rx = random.rx[0];
        soup_release(&random.soup);
        size_t all, some;
        assert_true(find_all(&at, 1, &all));
        for (uint32_t threads = 1; threads <= 8; threads += 7) {
            bool more = true;
            least = seed % 2 ? 2048 : 0; /* the arrays that grow with what is found, or all */
            for (int64_t n = 0; more; n += least ? 1 : 1 + n / 8) {
                atomic_store(&granted, n);
                const bool ok = find_all(&at, threads, &some);
                more = atomic_exchange(&granted, INT64_MAX) < 0;
                refused += !ok;
                if (ok) assert_int_equal(some, all); /* it could do without */
            }
        }
        free(at.boxes);
        keller_accel_free(at.accel);
        keller_scene_free(&at.scene);
    }
    printf("# %zu refused\n", refused);
    assert_true(refused > 300);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(refused_memory_is_an_error)};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
