/* The shortest way over straight lines, against the oracle's: stationary to the last bits where there is a ray, refused where
 * there is none, whatever the lines. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "oracle_shortest.h"
#include "path/edge_runs.h"
#include "path/shortest.h"
#include "scenes.h"

enum { MOST = 6 };
#define ROUNDING 1e-13
#define SIZE 20

typedef struct {
    size_t n;
    KellerVec3 source, target;
    EdgeLine line[MOST];
} Case;

static double draw(Random *r, double low, double high) { return random_range(r, low, high); }
static KellerVec3 draw_point(Random *r, double size)
{
    return v3(draw(r, -size, size), draw(r, -size, size), draw(r, -size, size));
}

/* Lines at random, or parallel to the one before, nearly so, through a point of it, near such a point, at right angles to it. */
static Case draw_case(Random *r)
{
    Case c = {.n = 2 + random_below(r, MOST - 1), .source = draw_point(r, 10), .target = draw_point(r, 10)};
    for (size_t i = 0; i < c.n; i++) {
        EdgeLine *l = &c.line[i];
        *l = (EdgeLine){draw_point(r, 5), v3_unit(draw_point(r, 1)), draw(r, 0.5, 8)};
        if (i == 0) continue;
        const EdgeLine *before = &c.line[i - 1];
        KellerVec3 on = v3_madd(before->origin, before->direction, draw(r, 0, before->length));
        switch (random_below(r, 8)) {
        case 0: l->direction = before->direction; break;
        case 1: l->direction = v3_unit(v3_madd(before->direction, draw_point(r, 1), 1e-6)); break;
        case 2:
        case 3: l->origin = on; break;
        case 4: l->origin = v3_madd(on, draw_point(r, 1), 1e-4); break;
        case 5: l->direction = v3_unit(v3_cross(before->direction, l->direction)); break;
        }
    }
    return c;
}

static Lines lines_of(const Case *c)
{
    Lines l = {.n = c->n, .source = wide(c->source), .target = wide(c->target)};
    for (size_t i = 0; i < c->n; i++) {
        l.origin[i] = wide(c->line[i].origin);
        l.direction[i] = wide(c->line[i].direction);
    }
    return l;
}

/* A stationary point of a convex function is where it is least, so the gradient proves a solution, and the oracle need only say
 * where there is none. Positions in double are good to one unit in the last place of the case's size, which turns a leg of length
 * r by so much over r. */
static void random_lines(void **state)
{
    (void)state;
    Random r = random_seeded(1);
    size_t rays = 0, none = 0, wrong = 0;
    for (int i = 0; i < 20000; i++) {
        Case c = draw_case(&r);
        Lines l = lines_of(&c);
        double t[MOST];
        Real exact[MOST], wide_t[MOST];
        for (size_t k = 0; k < c.n; k++) exact[k] = 0.5 * c.line[k].length;
        bool ray = path_shortest(c.source, c.target, c.n, c.line, ROUNDING, t);
        if (ray) {
            for (size_t k = 0; k < c.n; k++) wide_t[k] = t[k];
            Real unlike = lines_gradient(&l, wide_t);
            Real least = INFINITY;
            for (size_t k = 0; k <= c.n; k++)
                least = fminl(least, apart(lines_point(&l, k, wide_t), lines_point(&l, k + 1, wide_t)));
            if (!(unlike <= 4 * SIZE * 0x1p-52L / least + 64 * 0x1p-52L)) {
                printf("# case %d, %zu lines: gradient %.3Lg\n", i, c.n, unlike);
                wrong++;
            }
            rays++;
        } else if (lines_shortest(&l, exact)) {
            printf("# case %d, %zu lines: refused, but there is a ray\n", i, c.n);
            wrong++;
        }
        none += !ray;
    }
    printf("# %zu rays, %zu refused\n", rays, none);
    assert_int_equal(wrong, 0);
    assert_true(rays > 6000 && none > 3000);
}

/* ---- what bounds of two edges leave of them (path/arrival.h) ----------------------------------------------------------- */

static Arrival arrival_around(Random *r, const EdgeLine *line, KellerVec3 source, double t)
{
    KellerVec3 v = v3_sub(source, line->origin);
    const double z = v3_dot(v, line->direction), rho = v3_norm(v3_madd(v, line->direction, -z)), value[3] = {t, z, rho};
    float bound[3][2];
    for (int k = 0; k < 3; k++) { /* none, some or much room on either side, as if for rounding at the least */
        bound[k][0] = (float)(value[k] - 1e-5 - (random_below(r, 3) ? draw(r, 0, 3) : 0));
        bound[k][1] = (float)(value[k] + 1e-5 + (random_below(r, 3) ? draw(r, 0, 3) : 0));
    }
    return (Arrival){{bound[0][0], bound[0][1]}, {bound[1][0], bound[1][1]}, {fmaxf(0, bound[2][0]), bound[2][1]}};
}

/* How much room is left on the first edge of those places from which rays go on to where the second is lit (path/edge_runs.h), which is one of
 * some: several are asked at a time. */
static double room_towards(Random *r, const EdgeImage *first, const Arrival *one, const EdgeImage *second, const Arrival *other)
{
    enum { MANY = 9 };
    double place[6][MANY], room[MANY];
    const uint32_t count = 1 + random_below(r, MANY), begin = random_below(r, count), index = begin + random_below(r, count - begin);
    EdgeRuns runs = {.count = count, .rounding = second->rounding, .end = {place[0], place[1], place[2], place[3], place[4], place[5]}};
    for (uint32_t i = 0; i < count; i++)
        for (int side = 0; side < 2; side++) {
            const KellerVec3 p = i == index ? v3_madd(second->origin, second->direction, other->lit[side]) : draw_point(r, SIZE);
            place[3 * side][i] = p.x;
            place[3 * side + 1][i] = p.y;
            place[3 * side + 2][i] = p.z;
        }
    const EdgeRun from = {.line = *first, .all = *one};
    edge_runs_led_to(&from, &runs, begin, count - begin, room);
    return room[index - begin];
}

/* The shortest way over two lines is never lost, wherever within their bounds edges and sources are; and where an edge is lit elsewhere,
 * most pairs are seen to have none. */
static void narrowed_edges(void **state)
{
    (void)state;
    Random r = random_seeded(5);
    size_t rays = 0, narrowed = 0, elsewhere = 0, refused = 0, led_nowhere = 0;
    for (int i = 0; i < 20000; i++) {
        Case c = draw_case(&r);
        double t[MOST], lit[2][2];
        if (!path_shortest(c.source, c.target, 2, c.line, ROUNDING * SIZE, t)) continue;
        EdgeImage image[2];
        for (int k = 0; k < 2; k++) /* no faces: everything is in its sector */
            image[k] = (EdgeImage){.origin = c.line[k].origin, .direction = c.line[k].direction, .length = c.line[k].length, .rounding = ROUNDING * SIZE};
        EdgePair pair;
        if (!edge_pair(&image[0], &image[1], &pair)) continue; /* in one line: path_shortest may see it as nearly so */
        Arrival there = arrival_around(&r, &c.line[0], c.source, t[0]), back = arrival_around(&r, &c.line[1], c.target, t[1]);
        rays++;
        assert_true(edges_agree(&pair, &there, &back, lit));
        assert_true(room_towards(&r, &image[0], &there, &image[1], &back) >= 0 && room_towards(&r, &image[1], &back, &image[0], &there) >= 0);
        for (int k = 0; k < 2; k++) {
            assert_true(lit[k][0] <= t[k] && t[k] <= lit[k][1]);
            const Arrival *a = k ? &back : &there;
            narrowed += lit[k][0] > a->lit[0] || lit[k][1] < a->lit[1];
        }
        const float shift = (float)draw(&r, 0.5, 3) + there.lit[1] - there.lit[0];
        there.lit[0] += shift;
        there.lit[1] += shift;
        elsewhere++;
        refused += !edges_agree(&pair, &there, &back, lit);
        led_nowhere += room_towards(&r, &image[0], &there, &image[1], &back) < 0;
    }
    assert_true(rays > 10000 && narrowed > rays / 2 && refused > elsewhere / 4 && led_nowhere > elsewhere / 8 && led_nowhere <= refused);
}

/* Likewise where two long edges nearly touch, met close to there: what is left of their distance has lost most of its digits. */
static void edges_that_nearly_touch(void **state)
{
    (void)state;
    Random r = random_seeded(6);
    size_t rays = 0;
    for (int i = 0; i < 20000; i++) {
        const double size = pow(10, draw(&r, 0, 4)), rounding = 64 * 0x1p-52 * 2 * size;
        EdgeLine line[2];
        KellerVec3 place[2], end[2];
        double at[2], t[2], lit[2][2];
        for (int k = 0; k < 2; k++) {
            const KellerVec3 d = v3_unit(draw_point(&r, 1));
            at[k] = size * draw(&r, 0.3, 1);
            place[k] = v3_madd(draw_point(&r, pow(10, draw(&r, -9, -4))), d, pow(10, draw(&r, -9, -1)));
            line[k] = (EdgeLine){v3_madd(place[k], d, -at[k]), d, at[k] + size * draw(&r, 0, 0.5)};
        }
        const KellerVec3 leg = v3_unit(v3_sub(place[1], place[0]));
        for (int k = 0; k < 2; k++) { /* an end in a direction that Keller's law allows */
            const KellerVec3 d = line[k].direction, x = v3_perpendicular(d), y = v3_cross(d, x);
            const double cosine = v3_dot(leg, d), sine = v3_norm(v3_cross(leg, d)), phi = draw(&r, 0, 2 * M_PI), far = pow(10, draw(&r, -2, 1)) / sine;
            const KellerVec3 across = v3_madd(v3_scale(x, cos(phi)), y, sin(phi));
            end[k] = v3_madd(place[k], v3_madd(v3_scale(d, cosine), across, sine), k ? far : -far);
        }
        if (!path_shortest(end[0], end[1], 2, line, rounding, t) || fabs(t[0] - at[0]) > 1e-6 || fabs(t[1] - at[1]) > 1e-6) continue;
        EdgeImage image[2];
        Arrival arrival[2];
        for (int k = 0; k < 2; k++) {
            image[k] = (EdgeImage){.origin = line[k].origin, .direction = line[k].direction, .length = line[k].length, .rounding = rounding};
            arrival[k] = arrival_around(&r, &line[k], end[k], t[k]);
            for (int side = 0; side < 2; side++) arrival[k].lit[side] = (float)(t[k] + (side ? 1 : -1) * (1e-5 * (1 + t[k]) + draw(&r, 0, 1)));
        }
        EdgePair pair;
        if (!edge_pair(&image[0], &image[1], &pair)) continue;
        rays++;
        assert_true(edges_agree(&pair, &arrival[0], &arrival[1], lit));
        for (int k = 0; k < 2; k++) assert_true(room_towards(&r, &image[k], &arrival[k], &image[1 - k], &arrival[1 - k]) >= 0);
        for (int k = 0; k < 2; k++) assert_true(lit[k][0] <= t[k] && t[k] <= lit[k][1]);
    }
    assert_true(rays > 5000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_lines), cmocka_unit_test(narrowed_edges), cmocka_unit_test(edges_that_nearly_touch),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
