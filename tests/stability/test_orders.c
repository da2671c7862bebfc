/* Paths of up to three reflections, two diffractions and two transmissions, seven interactions: the program's path sets against
 * the oracle's, on random scenes of a few plates, each triangulated in three ways and searched with cones of three apertures. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "against_oracle.h"
#include "harness.h"
#include "oracle.h"
#include "plates.h"

enum { APERTURES = 3 };
static const double half_apertures[APERTURES] = {8, 2, 0.5}; /* degrees: apertures of 16, 4 and 1 */
enum { REFLECTIONS = 3, DIFFRACTIONS = 2, TRANSMISSIONS = 2, INTERACTIONS = REFLECTIONS + DIFFRACTIONS + TRANSMISSIONS };

#define DEGREE 0.017453292519943295

/* Places of two triangulations of one scene agree up to rounding; nothing random is this near. */
#define SAME_PLACE 1e-6

typedef struct {
    size_t scenes, searches, scenes_different, differences, candidates, undecidable;
    uint64_t cones[APERTURES];
    size_t paths[REFLECTIONS + 1][DIFFRACTIONS + 1][TRANSMISSIONS + 1]; /* the oracle's, decided ones */
} OrdersTally;

/* ---- one scene's names for another's faces and wedges ----------------------------------------------------------- */

static uint32_t plate_of(const KellerScene *scene, uint32_t face)
{
    return scene->triangle_object[scene->face_triangles[scene->faces[face].triangle_begin]];
}

/* Names of objects are the same, their numbers need not be. */
static uint32_t face_like(const KellerScene *scene, const KellerScene *other, uint32_t face)
{
    const char *plate = other->objects[plate_of(other, face)];
    for (uint32_t i = 0; i < scene->face_count; i++)
        if (strcmp(scene->objects[plate_of(scene, i)], plate) == 0) return i;
    return KELLER_NONE;
}

/* The direction into the middle of the sector. */
static KellerVec3 middle_of(const KellerWedge *w)
{
    double half = w->n * M_PI / 2;
    return v3_madd(v3_scale(w->tangent0, cos(half)), w->normal0, sin(half));
}

static uint32_t wedge_like(const KellerScene *scene, const KellerWedge *other)
{
    for (uint32_t i = 0; i < scene->wedge_count; i++) {
        const KellerWedge *w = &scene->wedges[i];
        if (v3_distance(w->origin, other->origin) < SAME_PLACE && fabs(w->length - other->length) < SAME_PLACE &&
            v3_distance(w->direction, other->direction) < SAME_PLACE && fabs(w->n - other->n) < SAME_PLACE &&
            v3_distance(middle_of(w), middle_of(other)) < SAME_PLACE)
            return i;
    }
    return KELLER_NONE;
}

static void rename_steps(const KellerScene *scene, const KellerScene *other, FoundPaths *found)
{
    for (size_t i = 0; i < found->count; i++)
        for (uint32_t k = 0; k < found->path[i].count; k++) {
            KellerStep *s = &found->path[i].step[k];
            bool edge = s->kind == KELLER_DIFFRACTION;
            s->id = edge ? wedge_like(scene, &other->wedges[s->id]) : face_like(scene, other, s->id);
        }
}

/* ---- the comparison --------------------------------------------------------------------------------------------- */

static void count_paths(const OracleResult *oracle, OrdersTally *tally)
{
    for (size_t i = 0; i < oracle->count; i++) {
        const OraclePath *p = &oracle->path[i];
        if (!p->valid || p->margin < ORACLE_TOLERANCE) continue;
        uint32_t of[3] = {0};
        for (uint32_t k = 0; k < p->count; k++)
            of[p->step[k].kind == KELLER_REFLECTION ? 0 : p->step[k].kind == KELLER_DIFFRACTION ? 1 : 2]++;
        tally->paths[of[0]][of[1]][of[2]]++;
    }
    tally->candidates += oracle->candidates;
    tally->undecidable += oracle->undecidable;
}

static void check_scene(uint64_t seed, OrdersTally *tally)
{
    static const char *const names[PLATES_TRIANGULATIONS][APERTURES] = {
        {"16 degrees, as built,", "4 degrees, as built,", "1 degree, as built,"},
        {"16 degrees, other diagonals,", "4 degrees, other diagonals,", "1 degree, other diagonals,"},
        {"16 degrees, refined,", "4 degrees, refined,", "1 degree, refined,"}};
    PlatesScene world[PLATES_TRIANGULATIONS];
    KellerScene scene[PLATES_TRIANGULATIONS];
    for (int i = 0; i < PLATES_TRIANGULATIONS; i++) {
        world[i] = plates_random(seed, (PlatesTriangulation)i);
        scene[i] = scene_of(&world[i].soup);
    }
    KellerVec3 tx = world[0].tx, rx = world[0].rx;
    OracleResult oracle =
        oracle_enumerate_through(&scene[0], tx, rx, REFLECTIONS, DIFFRACTIONS, TRANSMISSIONS, INTERACTIONS);
    count_paths(&oracle, tally);
    size_t differences = 0;
    for (int i = 0; i < PLATES_TRIANGULATIONS; i++) {
        if (scene[i].face_count != scene[0].face_count || scene[i].wedge_count != scene[0].wedge_count) {
            printf("# seed %llu: triangulation %d has %zu faces and %zu wedges, the first %zu and %zu\n",
                   (unsigned long long)seed, i, scene[i].face_count, scene[i].wedge_count, scene[0].face_count,
                   scene[0].wedge_count);
            differences++;
        }
        for (int k = 0; k < APERTURES; k++) {
            Run run = run_new(&tx, 1, &rx, REFLECTIONS, DIFFRACTIONS, INTERACTIONS);
            run.transmissions = TRANSMISSIONS;
            run.cone = half_apertures[k] * DEGREE;
            run.split_over = 4; /* left alone, the search splits no cones in scenes as small as these */
            FoundPaths found = run_simulation(&scene[i], &run);
            rename_steps(&scene[0], &scene[i], &found);
            differences += compare_with_oracle(&scene[0], tx, rx, seed, 0, TRANSMISSIONS, &oracle, &found, names[i][k]);
            tally->cones[k] += found.work.cones;
            found_free(&found);
            tally->searches++;
        }
    }
    oracle_free(&oracle);
    for (int i = 0; i < PLATES_TRIANGULATIONS; i++) {
        keller_scene_free(&scene[i]);
        soup_release(&world[i].soup);
    }
    tally->scenes++;
    tally->differences += differences;
    tally->scenes_different += differences > 0;
}

static void print_tally(const OrdersTally *t)
{
    printf("# %zu scenes, %zu searches, %zu candidates, %zu undecidable, %zu scenes differ; cones of the apertures:", t->scenes,
           t->searches, t->candidates, t->undecidable, t->scenes_different);
    for (int k = 0; k < APERTURES; k++) printf(" %llu", (unsigned long long)t->cones[k]);
    printf("\n");
    for (int d = 0; d <= DIFFRACTIONS; d++)
        for (int s = 0; s <= TRANSMISSIONS; s++) {
            printf("# %d diffractions, %d transmissions, 0 to %d reflections:", d, s, REFLECTIONS);
            for (int r = 0; r <= REFLECTIONS; r++) printf(" %zu", t->paths[r][d][s]);
            printf("\n");
        }
}

static void random_plates(void **state)
{
    OrdersTally *tally = *state;
    unsigned long first = 1, last = 8;
    seeds_asked_for(&first, &last);
    for (unsigned long seed = first; seed <= last; seed++) {
        check_scene(seed, tally);
        fflush(stdout); /* of a run through the night */
    }
    print_tally(tally);
    assert_int_equal(tally->differences, 0);
}

/* The comparison would be empty if most were undecidable, if plates did not make paths of these orders, or apertures no other
 * cones. */
static void random_plates_say_something(void **state)
{
    const OrdersTally *t = *state;
    size_t paths = 0, reflected = 0, through = 0, both = 0;
    for (int d = 0; d <= DIFFRACTIONS; d++)
        for (int s = 0; s <= TRANSMISSIONS; s++)
            for (int r = 0; r <= REFLECTIONS; r++) {
                size_t n = t->paths[r][d][s];
                paths += n;
                reflected += d == 2 && r > 0 ? n : 0;
                through += d == 2 && s > 0 ? n : 0;
                both += d == 2 && s > 0 && r > 0 ? n : 0;
            }
    assert_true(t->undecidable * 20 < paths);
    assert_true(t->cones[0] < t->cones[1] && t->cones[1] < t->cones[2]);
    if (getenv("KELLER_SEEDS")) return;
    assert_true(reflected > 800 && through > 500 && both > 400);
    assert_true(t->paths[REFLECTIONS][DIFFRACTIONS][TRANSMISSIONS] > 30);
}

int main(void)
{
    OrdersTally tally = {0};
    const struct CMUnitTest tests[] = {
        {"random_plates", random_plates, NULL, NULL, &tally},
        {"random_plates_say_something", random_plates_say_something, NULL, NULL, &tally},
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
