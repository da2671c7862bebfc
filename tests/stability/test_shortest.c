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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_lines),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
