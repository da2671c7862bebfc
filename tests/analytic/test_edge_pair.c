/* The transition function of two edges in a row, against a brute sum over the plane and against the double knife edge. */
#include <cerf.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "keller/wave.h"
#include "wave/row.h"

static const double complex turn = M_SQRT1_2 * (1 + I);

/* integral of e^{-s^2/2 - z s} over s > 0 */
static double complex one(double x) { return sqrt(M_PI / 2) * w_of_z(I * turn * x * M_SQRT1_2); }

/* Gauss-Legendre with 5 nodes a cell (Abramowitz and Stegun, table 25.4). */
static const double node[5] = {-0.9061798459386640, -0.5384693101056831, 0, 0.5384693101056831, 0.9061798459386640};
static const double weight[5] = {0.2369268850561891, 0.4786286704993665, 0.5688888888888889, 0.4786286704993665,
                                 0.2369268850561891};

/* The double integral, cell by cell. The exponent's real part is at least (1 - |r|)(s^2 + t^2)/2 + (x1 s + x2 t)/sqrt 2. */
static double complex brute(double x1, double x2, double r)
{
    enum { CELLS = 120 };
    double x[2] = {x1, x2}, reach[2];
    for (int i = 0; i < 2; i++) {
        double curve = 1 - fmax(r, 0), slope = M_SQRT1_2 * x[i];
        reach[i] = 2 * 34 / (slope + sqrt(slope * slope + 2 * 34 * curve));
    }
    double complex sum = 0;
    for (int i = 0; i < 5 * CELLS; i++)
        for (int j = 0; j < 5 * CELLS; j++) {
            double s = reach[0] * (i / 5 + 0.5 + 0.5 * node[i % 5]) / CELLS, t = reach[1] * (j / 5 + 0.5 + 0.5 * node[j % 5]) / CELLS;
            sum += weight[i % 5] * weight[j % 5] * cexp(-0.5 * s * s - 0.5 * t * t + r * s * t - turn * (x1 * s + x2 * t));
        }
    return sum * reach[0] * reach[1] / (4.0 * CELLS * CELLS);
}

static const double xs[] = {0, 0.3, 1.7, 2.999, 3.001, 6, 25};
#define XS (sizeof xs / sizeof *xs)

static void against_the_plane(void **state)
{
    (void)state;
    static const double rs[] = {-0.95, -0.5, 0.2, 0.9};
    for (size_t i = 0; i < XS; i++)
        for (size_t j = i; j < XS; j++)
            for (size_t k = 0; k < sizeof rs / sizeof *rs; k++) {
                double complex expected = brute(xs[i], xs[j], rs[k]) / (one(xs[i]) * one(xs[j]));
                double off = cabs(keller_edge_pair(xs[i], xs[j], rs[k]) / expected - 1);
                if (!(off < 1e-10)) fail_msg("x %g %g, r %g: off by %g", xs[i], xs[j], rs[k], off);
            }
}

/* Two screens with a = b = 1, d2 = 1/r, d1 = d3 = 1/(1 - r), k = 1: bends x1, x2 belong to heights (x1 + r x2)/(1 - r^2) and
 * the other way round, and the ray over both edges is half the bends times the heights longer than the straight line. */
static void against_the_double_edge(void **state)
{
    (void)state;
    double worst = 0;
    for (size_t i = 0; i < XS; i++)
        for (size_t j = 0; j < XS; j++)
            for (int k = 1; k < 50; k++) {
                double r = k < 40 ? 0.025 * k : 1 - pow(10, -0.5 * (k - 37)), rest = (1 - r) * (1 + r), x1 = xs[i], x2 = xs[j];
                double h1 = (x1 + r * x2) / rest, h2 = (x2 + r * x1) / rest, longer = 0.5 * (h1 * x1 + h2 * x2);
                if (longer > 1e4) continue; /* the phase of the other function has no digits left */
                double complex u = keller_double_edge(1, 1 / (1 - r), 1 / r, 1 / (1 - r), h1, h2) * cexp(I * longer);
                double complex expected = u * 2 * M_PI / sqrt(rest) / (one(x1) * one(x2));
                worst = fmax(worst, cabs(keller_edge_pair(x1, x2, r) / expected - 1));
            }
    print_message("# largest relative difference %.2g\n", worst);
    assert_true(worst < 2e-11); /* 1e-12 of longer */
}

/* Exchanging the edges changes no bit; both ways of computing meet. */
static void exchanged(void **state)
{
    (void)state;
    for (size_t i = 0; i < XS; i++)
        for (size_t j = 0; j < XS; j++)
            for (double r = -0.99; r < 1; r += 0.11) {
                double complex a = keller_edge_pair(xs[i], xs[j], r);
                assert_true(a == keller_edge_pair(xs[j], xs[i], r));
                if (r * r < 1e-6) assert_true(cabs(a - 1) < 1e-2);
            }
    for (double r = -0.999; r < 1; r += 0.111)
        for (double x = 3; x < 40; x *= 1.7)
            assert_true(cabs(keller_edge_pair(3, x, r) / keller_edge_pair(3 - 1e-13, x, r) - 1) < 2e-12);
    assert_true(keller_edge_pair(0.1, 4, 0) == 1);
}

/* Far outside of both zones there is the slope term left: 1 + j r (j/x1)(j/x2) + ... = 1 - j r/(x1 x2). */
static void far_out(void **state)
{
    (void)state;
    for (double x = 30; x < 1e6; x *= 3) {
        double z = 0.7 / (x * 2 * x);
        assert_true(cabs(keller_edge_pair(x, 2 * x, 0.7) - (1 - I * z)) < 5 * z / (x * x));
    }
}

/* ---- three edges -------------------------------------------------------------------------------------------------- */

static double complex triple_whole(double x1, double x2, double x3, double r12, double r23)
{
    return keller_edge_triple(x1, x2, x3, r12, r23) * one(x1) * one(x2) * one(x3);
}

/* At grazing all x are 0, and what is left is the share of a normal distribution of three variables in an octant: with the
 * correlations rho of the inverse of the matrix (1, -r12, 0; -r12, 1, -r23; 0, -r23, 1), 1/8 + the sum of asin(rho)/4 pi. */
static void three_at_grazing(void **state)
{
    (void)state;
    for (double r12 = -0.9; r12 < 1; r12 += 0.17)
        for (double r23 = -0.95; r23 < 1; r23 += 0.19) {
            double rest = 1 - r12 * r12 - r23 * r23;
            if (!(rest > 1e-3)) continue;
            double v1 = 1 - r23 * r23, v3 = 1 - r12 * r12; /* the inverse, times rest */
            double sum = asin(r12 / sqrt(v1)) + asin(r23 / sqrt(v3)) + asin(r12 * r23 / sqrt(v1 * v3));
            double expected = pow(2 * M_PI, 1.5) / sqrt(rest) * (0.125 + sum / (4 * M_PI));
            double off = cabs(triple_whole(0, 0, 0, r12, r23) / expected - 1);
            if (!(off < 1e-10)) fail_msg("r %g %g: off by %g", r12, r23, off);
        }
}

/* On the middle edge's boundary both signs together leave it out: what is left are the outer edges with each other. */
static void without_the_middle(void **state)
{
    (void)state;
    static const double rs[] = {-0.7, -0.2, 0.4, 0.69};
    double worst = 0;
    for (size_t i = 0; i < XS; i++)
        for (size_t j = 0; j < XS; j++)
            for (int k = 0; k < 16; k++) {
                double r12 = rs[k / 4], r23 = rs[k % 4], x1 = xs[i], x3 = xs[j], a = sqrt(1 - r12 * r12), b = sqrt(1 - r23 * r23);
                double complex both = triple_whole(x1, 0, x3, r12, r23) + triple_whole(x1, 0, x3, -r12, -r23);
                double complex pair = keller_edge_pair(x1 / a, x3 / b, r12 * r23 / (a * b)) * one(x1 / a) * one(x3 / b);
                worst = fmax(worst, cabs(both / (sqrt(2 * M_PI) / (a * b) * pair) - 1));
            }
    print_message("# the middle edge left out: %.1e\n", worst);
    assert_true(worst < 1e-9);
}

/* A brute sum over the octant, 2 cells of 5 nodes a unit. */
static double complex octant(double x1, double x2, double x3, double r12, double r23)
{
    enum { CELLS = 22 };
    double x[3] = {x1, x2, x3}, size[3], at[3][5 * CELLS], w[3][5 * CELLS];
    for (int i = 0; i < 3; i++) {
        double curve = 1 - fmax(0, fmax(r12, 0) * (i < 2) + fmax(r23, 0) * (i > 0)), slope = M_SQRT1_2 * x[i];
        size[i] = 2 * 23 / (slope + sqrt(slope * slope + 2 * 23 * curve)) / CELLS;
        for (int n = 0; n < 5 * CELLS; n++) {
            at[i][n] = size[i] * (n / 5 + 0.5 + 0.5 * node[n % 5]);
            w[i][n] = 0.5 * size[i] * weight[n % 5];
        }
    }
    double complex sum = 0;
    for (int l = 0; l < 5 * CELLS; l++)
        for (int m = 0; m < 5 * CELLS; m++)
            for (int n = 0; n < 5 * CELLS; n++) {
                double s = at[0][l], t = at[1][m], u = at[2][n];
                sum += w[0][l] * w[1][m] * w[2][n] *
                       cexp(-0.5 * (s * s + t * t + u * u) + r12 * s * t + r23 * t * u - turn * (x1 * s + x2 * t + x3 * u));
            }
    return sum;
}

static void three_by_brute_force(void **state)
{
    (void)state;
    static const double cases[4][5] = {{0.4, 1.2, 0.1, 0.3, 0.4}, {3, 0.5, 2, -0.6, 0.35}, {0, 4, 1, -0.5, -0.5}, {1, 1, 6, 0.45, -0.4}};
    for (int i = 0; i < 4; i++) {
        const double *c = cases[i];
        double off = cabs(triple_whole(c[0], c[1], c[2], c[3], c[4]) / octant(c[0], c[1], c[2], c[3], c[4]) - 1);
        if (!(off < 1e-8)) fail_msg("case %d: off by %g", i, off);
    }
}

/* No coupling on one side is a pair; the other way round is the same. */
static void three_and_two(void **state)
{
    (void)state;
    for (size_t i = 0; i < XS; i++)
        for (size_t j = 0; j < XS; j++)
            for (double r = -0.95; r < 1; r += 0.31) {
                assert_true(cabs(keller_edge_triple(xs[i], xs[j], 1.3, r, 0) / keller_edge_pair(xs[i], xs[j], r) - 1) < 1e-9);
                double complex a = keller_edge_triple(xs[i], xs[j], 1.3, r, 0.3), b = keller_edge_triple(1.3, xs[j], xs[i], 0.3, r);
                assert_true(cabs(a / b - 1) < 1e-12);
            }
}

/* ---- any number of edges -------------------------------------------------------------------------------------------- */

/* One term an edge counts, on the side `side` of its boundary; r[i] couples edge i with the one before. */
static double complex row_of(uint32_t count, const double x[], const double r[], const int side[])
{
    RowEdge edge[ROW_EDGES];
    const Matrix one_to_one = {{{-1, 0}, {0, -1}}};
    for (uint32_t i = 0; i < count; i++) {
        edge[i] = (RowEdge){.from = {{{1, 0}, {0, 1}}}, .coupling = i > 0 ? -r[i] : 0}; /* the 2nd terms have the sign -1 */
        for (int b = 0; b < 4; b++) {
            edge[i].term[b] = (UtdTerm){.x = b == 1 ? x[i] : 40, .side = b == 1 && side ? side[i] : 1, .value = b == 1};
            edge[i].matrix[b] = one_to_one;
        }
    }
    double complex field[2][2] = {{1, 0.5}, {0, 2}};
    assert_true(row_field(edge, count, field));
    assert_true(cabs(field[0][1] - 0.5 * field[0][0]) + cabs(field[1][0]) + cabs(field[1][1] - 2 * field[0][0]) < 1e-9);
    return field[0][0];
}

/* Equal spacing: r = 1/2; N edges at grazing leave 1/(N + 1), which is (1/2)^N times the ratio times the root of the determinant. */
static void row_at_grazing(void **state)
{
    (void)state;
    double x[ROW_EDGES] = {0}, r[ROW_EDGES];
    for (int i = 0; i < ROW_EDGES; i++) r[i] = 0.5;
    for (uint32_t n = 1; n <= 12; n++) {
        double determinant = (n + 1) * pow(0.5, n);
        double left = creal(row_of(n, x, r, NULL)) * pow(0.5, n) * sqrt(determinant);
        if (!(fabs(left * (n + 1) - 1) < 1e-10)) fail_msg("%u edges: %g", n, left * (n + 1));
    }
}

/* Two and three edges have functions of their own; turned round, a row is the same. */
static void row_of_few(void **state)
{
    (void)state;
    static const double rs[] = {-0.6, 0.3, 0.66};
    for (size_t i = 0; i < XS; i++)
        for (size_t j = 0; j < XS; j++)
            for (int k = 0; k < 3; k++) {
                const double x[4] = {xs[i], xs[j], xs[(i + 2) % XS], 0.7}, r[4] = {0, rs[k], rs[(k + 1) % 3], 0.4};
                const double y[4] = {x[3], x[2], x[1], x[0]}, q[4] = {0, r[3], r[2], r[1]};
                double complex two = keller_edge_pair(x[0], x[1], r[1]), three = keller_edge_triple(x[0], x[1], x[2], r[1], r[2]);
                assert_true(cabs(row_of(2, x, r, NULL) / two - 1) < 1e-10);
                assert_true(cabs(row_of(3, x, r, NULL) / three - 1) < 1e-10);
                assert_true(cabs(row_of(4, x, r, NULL) / row_of(4, y, q, NULL) - 1) < 1e-10);
            }
}

/* On the boundary of the second of four edges both of its sides together are the three others alone. Its integral over the whole line
 * leaves 1 - r12^2 of the square of s1, 1 - r23^2 of that of s3, and couples the two by r12 r23. */
static void row_without_an_edge(void **state)
{
    (void)state;
    for (size_t i = 0; i < XS; i++)
        for (size_t j = 0; j < XS; j++) {
            const double x[4] = {xs[i], 0, xs[j], 1.1}, r[4] = {0, 0.55, 0.6, -0.3};
            const int up[4] = {1, 1, 1, 1}, down[4] = {1, -1, 1, 1};
            double a = sqrt(1 - r[1] * r[1]), b = sqrt(1 - r[2] * r[2]);
            const double y[3] = {x[0] / a, x[2] / b, x[3]}, q[3] = {0, r[1] * r[2] / (a * b), r[3] / b};
            double complex both = row_of(4, x, r, up) + row_of(4, x, r, down);
            double complex without = 2 / (a * b) * row_of(3, y, q, NULL) * one(y[0]) * one(y[1]) / (one(x[0]) * one(x[2]));
            if (!(cabs(both / without - 1) < 1e-10)) fail_msg("x %g %g: off by %g", xs[i], xs[j], cabs(both / without - 1));
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(against_the_plane),
        cmocka_unit_test(against_the_double_edge),
        cmocka_unit_test(exchanged),
        cmocka_unit_test(far_out),
        cmocka_unit_test(three_at_grazing),
        cmocka_unit_test(without_the_middle),
        cmocka_unit_test(three_by_brute_force),
        cmocka_unit_test(three_and_two),
        cmocka_unit_test(row_at_grazing),
        cmocka_unit_test(row_of_few),
        cmocka_unit_test(row_without_an_edge),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
