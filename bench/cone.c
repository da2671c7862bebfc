/* keller-bench-cone -- what the tests of keller/cone.h get wrong and how long they take, by half-angle and
 * eccentricity.
 *
 * usage: keller-bench-cone [--csv] [--cases N] [--seed N] [--threads N] [--test NAME] [--time-only]
 *
 * The cases and the oracle are those of tests/stability (cone_cases.h, cone_oracle.h): half of the cases are random and
 * aimed, half of adversarial families. Columns:
 *   cases                of both kinds; lanes for the eight-wide tests
 *   false_negative       the oracle says that they meet, or the true range is not in the reported one; must be 0
 *   false_positive       the oracle says that they do not; among cases made to touch, many
 *   max_range_error_eps  by how much the range exceeds the true one of the cone widened by the documented slack, in
 *                        units of 2^-23 times the primitive's reach from the cone's origin, over all cases; of
 *                        meets_box8, by how much its distance, a bound, is before the true nearest z
 *   ns_per_call          one thread, random cases of the row, half of them hits where such are found, in an order that
 *                        no branch predictor knows, out of the second-level cache; the loop's 1 ns is included. One
 *                        call is eight boxes, vertices or triangles in the eight-wide tests.
 *   ns_per_call_scalar   the same sources compiled without SIMD
 * and in the table (without --csv) also
 *   plain_eps, point_eps the excess over the true range of the cone as it is, over random cases; the error of points
 * Status 1 if anything is wrong that must not be, 2 on wrong usage. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "../tests/scalar/cone_scalar.h"
#include "../tests/stability/cone_check.h"

typedef struct {
    const char *name;
    ConeKind kind;
    bool boolean; /* the Boolean form of a range test: its counts come with the range's */
} Test;

static const Test tests[] = {
    {"plane", CONE_PLANE, false},
    {"meets_plane", CONE_PLANE, true},
    {"line", CONE_LINE, false},
    {"meets_line", CONE_LINE, true},
    {"edge", CONE_EDGE, false},
    {"meets_edge", CONE_EDGE, true},
    {"triangle", CONE_TRIANGLE, false},
    {"meets_triangle", CONE_TRIANGLE, true},
    {"box", CONE_BOX, false},
    {"meets_box", CONE_BOX, true},
    {"contains", CONE_CONTAINS, false},
    {"contains_triangle", CONE_CONTAINS_TRIANGLE, false},
    {"contains_box", CONE_CONTAINS_BOX, false},
    {"meets_box8", CONE_BOX8, false},
    {"contains_vertex8", CONE_VERTEX8, false},
    {"contains_corners", CONE_CORNERS, false},
    {"contained_triangle8", CONE_TRIANGLE8, false},
    {"meets_triangle8", CONE_LEAF_TRIANGLE8, false},
    {"pierces_triangle8", CONE_PIERCED_TRIANGLE8, false},
    {"meets_edge8", CONE_LEAF_EDGE8, false},
    {"contains_box8", CONE_INSIDE_BOX8, false},
};
enum { TESTS = sizeof tests / sizeof *tests };

/* ---- time -------------------------------------------------------------------------------------------------------- */

enum { SET = 1024, SET8 = 512, PASSES = 15, DRAWS = 20000 };

typedef struct {
    KellerConeLanes cone;
    KellerBox8 boxes;
    KellerVertex8 vertices[3];
    float lower[3], upper[3];
} Case8;

typedef struct {
    int count;
    uint16_t order[SET];
    ConeCase one[SET];
    Case8 eight[SET8];
} Set;

static volatile double sink;

/* One pass over the set, in seconds. PREFIX is the kernel or its scalar build. */
#define EACH(array, expression)                                                                                        \
    for (int i = 0; i < s->count; i++) {                                                                               \
        const __typeof__(*s->array) *c = &s->array[s->order[i]];                                                       \
        sum += (double)(expression);                                                                                   \
    }                                                                                                                  \
    break
#define NEAR(call) (call).near
#define DEFINE_PASS(name, PREFIX)                                                                                      \
    static double name(const Test *test, const Set *s)                                                                 \
    {                                                                                                                  \
        _Alignas(32) float near[8], far[8], at[8];                                                                        \
        uint32_t contained;                                                                                            \
        struct timespec start, end;                                                                                    \
        double sum = 0;                                                                                                \
        clock_gettime(CLOCK_MONOTONIC, &start);                                                                        \
        switch ((int)test->kind * 2 + test->boolean) {                                                                 \
        case CONE_PLANE * 2:                                                                                           \
            EACH(one, NEAR(PREFIX##_plane(&c->cone, c->v[0], c->offset, c->clip, NULL, NULL)));                        \
        case CONE_PLANE * 2 + 1:                                                                                       \
            EACH(one, PREFIX##_meets_plane(&c->cone, c->v[0], c->offset, c->clip));                                    \
        case CONE_LINE * 2:                                                                                            \
            EACH(one, NEAR(PREFIX##_line(&c->cone, c->v[0], c->v[1], c->clip, NULL, NULL)));                           \
        case CONE_LINE * 2 + 1:                                                                                        \
            EACH(one, PREFIX##_meets_line(&c->cone, c->v[0], c->v[1], c->clip));                                       \
        case CONE_EDGE * 2:                                                                                            \
            EACH(one, NEAR(PREFIX##_edge(&c->cone, c->v[0], c->v[1], c->clip, NULL, NULL)));                           \
        case CONE_EDGE * 2 + 1:                                                                                        \
            EACH(one, PREFIX##_meets_edge(&c->cone, c->v[0], c->v[1], c->clip));                                       \
        case CONE_CONTAINS * 2:                                                                                        \
            EACH(one, PREFIX##_contains(&c->cone, c->v[0]));                                                           \
        case CONE_CONTAINS_TRIANGLE * 2:                                                                               \
            EACH(one, PREFIX##_contains_triangle(&c->cone, c->v[0], c->v[1], c->v[2]));                                \
        case CONE_CONTAINS_BOX * 2:                                                                                    \
            EACH(one, PREFIX##_contains_box(&c->cone, c->v[0], c->v[1]));                                              \
        case CONE_TRIANGLE * 2:                                                                                        \
            EACH(one, NEAR(PREFIX##_triangle(&c->cone, c->v[0], c->v[1], c->v[2], c->clip, NULL, NULL)));              \
        case CONE_TRIANGLE * 2 + 1:                                                                                    \
            EACH(one, PREFIX##_meets_triangle(&c->cone, c->v[0], c->v[1], c->v[2], c->clip));                          \
        case CONE_BOX * 2:                                                                                             \
            EACH(one, NEAR(PREFIX##_box(&c->cone, c->v[0], c->v[1], c->clip, NULL, NULL)));                            \
        case CONE_BOX * 2 + 1:                                                                                         \
            EACH(one, PREFIX##_meets_box(&c->cone, c->v[0], c->v[1], c->clip));                                        \
        case CONE_BOX8 * 2:                                                                                            \
            EACH(eight, PREFIX##_meets_box8(&c->cone, &c->boxes, near));                                               \
        case CONE_VERTEX8 * 2:                                                                                         \
            EACH(eight, PREFIX##_contains_vertex8(&c->cone, &c->vertices[0]));                                         \
        case CONE_CORNERS * 2:                                                                                         \
            EACH(eight, PREFIX##_contains_corners(&c->cone, c->lower, c->upper));                                      \
        case CONE_TRIANGLE8 * 2:                                                                                       \
            EACH(eight, (PREFIX##_contained_triangle8(&c->cone, c->vertices, near, far), near[0]));                    \
        case CONE_LEAF_TRIANGLE8 * 2:                                                                                  \
            EACH(eight, PREFIX##_meets_triangle8(&c->cone, c->vertices, near, far, &contained));                       \
        case CONE_PIERCED_TRIANGLE8 * 2:                                                                               \
            EACH(eight, PREFIX##_pierces_triangle8(&c->cone, c->vertices, near, far, &contained, at));                 \
        case CONE_INSIDE_BOX8 * 2:                                                                                     \
            EACH(eight, PREFIX##_contains_box8(&c->cone, &c->boxes));                                                  \
        case CONE_LEAF_EDGE8 * 2:                                                                                      \
            EACH(eight, PREFIX##_meets_edge8(&c->cone, c->vertices, near, far, &contained));                           \
        }                                                                                                              \
        clock_gettime(CLOCK_MONOTONIC, &end);                                                                          \
        sink = sum;                                                                                                    \
        return (double)(end.tv_sec - start.tv_sec) + 1e-9 * (double)(end.tv_nsec - start.tv_nsec);                     \
    }

DEFINE_PASS(pass, keller_cone)
DEFINE_PASS(pass_scalar, keller_scalar_cone)

static uint32_t next(uint32_t *state) { return *state = *state * 1664525u + 1013904223u; }

/* Random cases of one row (decade, roundness; -1: any), half of them hits. */
static void fill(const Test *test, uint64_t seed, int decade, int roundness, Set *s)
{
    int of[2] = {0, 0}, most = test->kind < CONE_BOX8 ? SET : SET8;
    s->count = 0;
    for (uint64_t i = 0; i < DRAWS && s->count < most; i++) {
        if (test->kind < CONE_BOX8) {
            ConeCase c = cone_case(test->kind, seed, i, decade, roundness, CONE_RANDOM);
            bool hit = cone_ask(test->kind, &c).yes;
            if (of[hit] * 2 >= most) continue;
            of[hit]++;
            s->one[s->count++] = c;
        } else {
            ConeCase8 c = cone_case8(test->kind, seed, i, decade, roundness, CONE_RANDOM);
            Case8 *to = &s->eight[s->count++];
            to->cone = keller_cone_lanes(&c.one.cone, c.one.clip, c.size);
            to->boxes = c.boxes;
            memcpy(to->vertices, c.vertices, sizeof c.vertices);
            for (int k = 0; k < 3; k++) {
                to->lower[k] = c.boxes.lower[k][0];
                to->upper[k] = c.boxes.upper[k][0];
            }
        }
    }
    for (int i = 0; i < s->count; i++) s->order[i] = (uint16_t)i;
}

/* The fastest of several passes, each in another order, in nanoseconds a call. */
static double fastest(double (*one_pass)(const Test *, const Set *), const Test *test, Set *s)
{
    double best = INFINITY;
    uint32_t state = 1;
    for (int p = 0; p < PASSES; p++) {
        for (int i = s->count - 1; i > 0; i--) {
            int j = (int)(next(&state) >> 8) % (i + 1);
            uint16_t t = s->order[i];
            s->order[i] = s->order[j];
            s->order[j] = t;
        }
        best = fmin(best, one_pass(test, s));
    }
    return best / s->count * 1e9;
}

/* ---- the table --------------------------------------------------------------------------------------------------- */

typedef struct {
    bool csv, time_only;
    double cases;
    uint64_t seed;
    int threads;
    const char *test;
} Options;

/* A number, or nothing where it says nothing. */
static const char *number(char text[32], bool there, const char *format, double value)
{
    if (there)
        snprintf(text, 32, format, value);
    else
        text[0] = '\0';
    return text;
}

static void print_row(const Options *o, const Test *test, const char *decade, const char *roundness, const ConeTally *t,
                      double ns, double ns_scalar)
{
    char cell[8][32];
    bool ranged = !test->boolean && (test->kind <= CONE_BOX || test->kind == CONE_BOX8 || (test->kind >= CONE_TRIANGLE8 && test->kind <= CONE_LEAF_EDGE8));
    uint64_t negative = test->boolean ? t->yes_missed : t->missed + t->too_short;
    uint64_t positive = test->boolean ? t->yes_false : t->false_positive;
    const char *cases = number(cell[0], !o->time_only, "%.0f", (double)t->cases);
    const char *false_negative = number(cell[1], !o->time_only, "%.0f", (double)negative);
    const char *false_positive = number(cell[2], !o->time_only, "%.0f", (double)positive);
    const char *error = number(cell[3], !o->time_only && ranged, "%.3g", t->range_error);
    const char *time = number(cell[4], true, "%.1f", ns), *scalar = number(cell[5], true, "%.1f", ns_scalar);
    if (o->csv) {
        printf("%s,%s,%s,%s,%s,%s,%s,%s,%s\n", test->name, decade, roundness, cases, false_negative, false_positive,
               error, time, scalar);
        return;
    }
    bool points = !o->time_only && ranged && test->kind <= CONE_BOX;
    printf("%-19s %-10s %-7s %11s %8s %10s %10s %10s %10s %8s %8s\n", test->name, decade, roundness, cases,
           false_negative, false_positive, error, number(cell[6], points, "%.3g", t->plain_error),
           number(cell[7], points, "%.3g", t->point_error), time, scalar);
}

static void run_test(const Options *o, const Test *test, ConeTally rows[CONE_ROWS])
{
    static Set set;
    ConeTally all = cone_tally_zero;
    for (int row = 0; row <= CONE_ROWS; row++) {
        bool last = row == CONE_ROWS;
        fill(test, o->seed + 1, last ? -1 : row / CONE_ROUNDNESSES, last ? -1 : row % CONE_ROUNDNESSES, &set);
        double ns = fastest(pass, test, &set), ns_scalar = fastest(pass_scalar, test, &set);
        if (!last) cone_tally_add(&all, &rows[row]);
        print_row(o, test, last ? "all" : cone_decade_names[row / CONE_ROUNDNESSES],
                  last ? "all" : cone_roundness_names[row % CONE_ROUNDNESSES], last ? &all : &rows[row], ns, ns_scalar);
    }
    fflush(stdout);
}

static int wrong_usage(const char *what, const char *text)
{
    fprintf(stderr,
            "keller-bench-cone: %s \"%s\"; usage: keller-bench-cone [--csv] [--cases N] [--seed N] [--threads N] "
            "[--test NAME] [--time-only]\n",
            what, text);
    return 2;
}

static int parse(int argc, char **argv, Options *o)
{
    for (int i = 1; i < argc; i++) {
        const char *name = argv[i], *value = argv[i + 1] ? argv[i + 1] : "";
        if (strcmp(name, "--csv") == 0)
            o->csv = true;
        else if (strcmp(name, "--time-only") == 0)
            o->time_only = true;
        else if (strcmp(name, "--test") == 0)
            o->test = value, i++;
        else if (strcmp(name, "--cases") == 0 || strcmp(name, "--seed") == 0 || strcmp(name, "--threads") == 0) {
            char *end;
            double v = strtod(value, &end); /* 1e8 is fine */
            if (end == value || *end || !(v >= 0 && v <= 1e15) || v != floor(v))
                return wrong_usage("not a whole number:", value);
            if (name[2] == 'c')
                o->cases = v;
            else if (name[2] == 's')
                o->seed = (uint64_t)v;
            else
                o->threads = v < 1024 ? (int)v : 1024;
            i++;
        } else {
            return wrong_usage("unknown option", name);
        }
    }
    bool known = !o->test;
    for (int i = 0; i < TESTS && !known; i++) known = strcmp(o->test, tests[i].name) == 0;
    return known ? 0 : wrong_usage("unknown test", o->test);
}

int main(int argc, char **argv)
{
    Options o = {.cases = 1e8, .seed = 1};
    int status = parse(argc, argv, &o), counted = -1;
    if (status) return status;
    if (o.csv)
        puts("test,half_angle_deg,eccentricity,cases,false_negative,false_positive,max_range_error_eps,ns_per_call,"
             "ns_per_call_scalar");
    else
        printf("%-19s %-10s %-7s %11s %8s %10s %10s %10s %10s %8s %8s\n", "test", "half_angle", "eccent.", "cases",
               "false_neg", "false_pos", "range_eps", "plain_eps", "point_eps", "ns", "scalar");
    ConeTally rows[CONE_ROWS];
    for (int i = 0; i < CONE_ROWS; i++) rows[i] = cone_tally_zero;
    for (int i = 0; i < TESTS; i++) {
        const Test *test = &tests[i];
        if (o.test && strcmp(o.test, test->name) != 0) continue;
        if (!o.time_only && counted != (int)test->kind) {
            uint64_t count = (uint64_t)o.cases / (test->kind < CONE_BOX8 ? 1 : 8);
            cone_check_all(test->kind, o.seed, count, o.threads, 8192, rows);
            counted = (int)test->kind;
            for (int r = 0; r < CONE_ROWS; r++) {
                if (cone_tally_wrong(&rows[r]) == 0) continue;
                fprintf(stderr, "keller-bench-cone: %s: case %llu of seed %llu is wrong\n", cone_kind_names[test->kind],
                        (unsigned long long)rows[r].first_wrong, (unsigned long long)o.seed);
                status = 1;
            }
        }
        run_test(&o, test, rows);
    }
    return status;
}
