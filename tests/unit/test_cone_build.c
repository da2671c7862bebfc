/* Constructors of frusta: each holds what it must and is small. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>

#include "cone_long.h"
#include "random.h"

/* `count` points around `axis`, with slopes up to `spread` times 1 along one direction and `thin` along the other, at
 * distances between 0.1 and 1000 m from the apex. */
static void random_polygon(Random *r, KellerVec3 apex, KellerVec3 axis, double spread, double thin, size_t count,
                           KellerVec3 *p)
{
    KellerVec3 u = v3_perpendicular(axis), v = v3_cross(axis, u);
    double turn = random_in(r, 0, M_PI);
    for (size_t i = 0; i < count; i++) {
        double x = spread * random_in(r, -1, 1), y = spread * thin * random_in(r, -1, 1);
        KellerVec3 d = v3_madd(v3_madd(axis, u, x * cos(turn) - y * sin(turn)), v, x * sin(turn) + y * cos(turn));
        p[i] = v3_madd(apex, d, pow(10, random_in(r, -1, 3)));
    }
}

static void elliptic_by_definition(void **state)
{
    (void)state;
    /* eccentricity 0.6: e = 1 / sqrt(1 - 0.36) = 1.25 */
    KellerCone c = keller_cone_elliptic(v3(1, 2, 3), v3(0, 0, 1), v3(3, 0, 7), atan(0.5), 0.6, 2);
    assert_frame(&c);
    assert_true(fabs(c.e - 1.25) < 1e-15 && fabs(c.tan_alpha - 0.5) < 1e-15 && c.x0 == 2 && c.z_far == INFINITY);
    assert_true(v3_distance(c.major, v3(1, 0, 0)) < 1e-15);
    Random r = {1};
    for (int i = 0; i < 10000; i++) {
        KellerVec3 d = random_unit(&r), side = v3_madd(d, random_unit(&r), pow(10, random_in(&r, -9, 0)));
        c = keller_cone_elliptic(random_point(&r, 9), d, side, random_in(&r, 0, 1.5), random_in(&r, 0, 1), 0);
        assert_frame(&c);
        assert_true(v3_dot(c.major, side) > 0);
        c = keller_cone_round(c.origin, d, 0);
        assert_frame(&c);
    }
}

static void around_holds_its_points(void **state)
{
    (void)state;
    Random r = {2};
    enum { MOST = 500 };
    static KellerVec3 p[MOST];
    for (int i = 0; i < 20000; i++) {
        KellerVec3 apex = random_point(&r, i % 4 ? 1 : 1e5);
        size_t count = i % 100 == 0 ? MOST : 1 + random_u32(&r) % 12;
        double spread = i % 3 ? pow(10, random_in(&r, -9, 0)) : tan(random_in(&r, 0, 70) * DEGREE);
        double thin = i % 5 == 0 ? 0 : i % 5 == 1 ? pow(10, random_in(&r, -9, 0)) : 1;
        random_polygon(&r, apex, random_unit(&r), spread, thin * (spread < 1 ? 1 : 0.5), count, p);
        if (i % 7 == 0) p[count - 1] = p[0];
        if (i % 11 == 0)
            for (size_t k = 0; k < count; k++) p[k] = v3_madd(apex, v3_sub(p[k], apex), 1e80);
        KellerCone c;
        if (!keller_cone_around(apex, count, p, &c)) {
            assert_true(spread > 1);
            continue;
        }
        assert_frame(&c);
        assert_true(c.origin.x == apex.x && c.x0 == 0 && c.z_near == 0 && c.z_far == INFINITY);
        assert_true(area_of(&c) < 4 * (spread + 1e-14) * (spread + 1e-14)); /* not merely large */
        for (size_t k = 0; k < count; k++) assert_true(inside(&c, longer(p[k])));
        for (int s = 0; s < 20; s++) { /* points of the hull */
            Long3 sum = {0, 0, 0};
            long double weight = 0;
            for (size_t k = 0; k < count; k++) {
                long double w = pow(random_in(&r, 0, 1), s);
                sum = long_madd(sum, long_madd(longer(p[k]), longer(apex), -1), w);
                weight += w;
            }
            KellerCone at_zero = c;
            at_zero.origin = v3(0, 0, 0);
            assert_true(inside(&at_zero, long_madd((Long3){0, 0, 0}, sum, 1 / weight)));
        }
    }
}

/* T^2 / e of the cone with this directrix, this turn of the major axis, this ratio, around the directions. */
static double area_around(KellerVec3 n, double turn, double e, size_t count, const KellerVec3 *d)
{
    KellerVec3 u = v3_perpendicular(n), v = v3_cross(n, u);
    KellerVec3 major = v3_add(v3_scale(u, cos(turn)), v3_scale(v, sin(turn))), minor = v3_cross(n, major);
    double most = 0;
    for (size_t i = 0; i < count; i++) {
        double z = v3_dot(d[i], n), x = v3_dot(d[i], major) / z, y = e * v3_dot(d[i], minor) / z;
        if (!(z > 0)) return INFINITY;
        most = fmax(most, x * x + y * y);
    }
    return most / e;
}

/* Random search, ever nearer to the best so far. */
static double search(Random *r, KellerVec3 n, double e, double spread, size_t count, const KellerVec3 *d)
{
    double turn = 0, least = INFINITY, size = 1;
    for (int i = 0; i < 100; i++) {
        double a = area_around(n, i * M_PI / 100, e, count, d);
        if (a < least) {
            least = a;
            turn = i * M_PI / 100;
        }
    }
    for (int i = 0; i < 4000; i++, size *= 0.9985) {
        KellerVec3 m = v3_unit(v3_madd(n, random_unit(r), 0.5 * size * fmin(spread, 1) * pow(10, random_in(r, -2, 0))));
        double t = turn + size * pow(10, random_in(r, -2, 0)) * random_in(r, -1, 1);
        double f = fmax(1, e * exp(0.5 * size * random_in(r, -1, 1))), a = area_around(m, t, f, count, d);
        if (a >= least) continue;
        least = a;
        n = m;
        turn = t;
        e = f;
    }
    return least;
}

static void around_is_smallest(void **state)
{
    (void)state;
    Random r = {3};
    double worst = 0;
    for (int i = 0; i < 600; i++) {
        KellerVec3 d[12], axis = random_unit(&r);
        size_t count = 3 + random_u32(&r) % 10;
        double spread = i % 2 ? tan(random_in(&r, 1, 72) * DEGREE) : pow(10, random_in(&r, -4, 0));
        double thin = pow(10, random_in(&r, -2, 0));
        random_polygon(&r, v3(0, 0, 0), axis, spread, thin, count, d);
        for (size_t k = 0; k < count; k++) d[k] = v3_unit(d[k]);
        KellerCone c;
        if (!keller_cone_around(v3(0, 0, 0), count, d, &c)) {
            assert_true(spread > 2);
            continue;
        }
        double found = fmin(search(&r, c.directrix, c.e, spread, count, d),
                            search(&r, axis, 1 / thin, spread, count, d));
        worst = fmax(worst, area_of(&c) / found - 1);
    }
    print_message("# smallest cone: at most %.2g larger than the best of a random search\n", worst);
    assert_true(worst < 0.01);
}

static void around_known_cases(void **state)
{
    (void)state;
    KellerCone c;
    for (size_t n = 3; n <= 12; n++) { /* a regular polygon: its circumscribed circle */
        KellerVec3 p[12];
        for (size_t i = 0; i < n; i++) p[i] = v3(0.5 * cos(2 * M_PI * (double)i / (double)n),
                                                 0.5 * sin(2 * M_PI * (double)i / (double)n), 1);
        assert_true(keller_cone_around(v3(0, 0, 0), n, p, &c));
        assert_true(v3_distance(c.directrix, v3(0, 0, 1)) < 1e-6 && fabs(c.tan_alpha - 0.5) < 1e-5 && c.e < 1 + 1e-5);
    }
    /* a rectangle of half-sides 0.3 and 0.1: semi-axes sqrt(2) times them; points inside and in any order change
     * nothing */
    KellerVec3 q[7] = {{0.3, 0.1, 1},  {-0.3, -0.1, 1},  {0.1, 0, 1}, {0.3, -0.1, 1},
                       {-0.3, 0.1, 1}, {0.02, 0.03, 1}, {0, 0, 2}};
    assert_true(keller_cone_around(v3(0, 0, 0), 7, q, &c));
    assert_true(fabs(c.tan_alpha - 0.3 * M_SQRT2) < 1e-5 && fabs(c.e - 3) < 1e-4 && fabs(c.major.x) > 1 - 1e-9);
    /* a triangle's: Steiner's ellipse, 4 pi / (3 sqrt 3) times the area, for small angles */
    KellerVec3 t[3] = {{1e-4, 0, 1}, {0, 3e-4, 1}, {-1e-4, -1e-4, 1}};
    assert_true(keller_cone_around(v3(0, 0, 0), 3, t, &c));
    assert_true(fabs(area_of(&c) / (4 / (3 * sqrt(3)) * 0.5 * 7e-8 / 1) - 1) < 1e-3);
    /* a point; two points: in the middle of the angle; three in a plane with the apex */
    assert_true(keller_cone_around(v3(1, 1, 1), 1, (KellerVec3[]){{3, 4, 5}}, &c));
    assert_true(c.tan_alpha < 1e-14 && v3_distance(c.directrix, v3_unit(v3(2, 3, 4))) < 1e-15);
    KellerVec3 line[3] = {{1, 0, 0}, {0, 5, 0}, {2, 1, 0}};
    for (size_t n = 2; n <= 3; n++) {
        assert_true(keller_cone_around(v3(0, 0, 0), n, line, &c));
        assert_true(v3_distance(c.directrix, v3(M_SQRT1_2, M_SQRT1_2, 0)) < 1e-8 && fabs(c.tan_alpha - 1) < 1e-8);
        assert_true(c.e > 1e5);
    }
    /* most of the points in one place, one far from them: the mean direction is no help */
    static KellerVec3 many[1000];
    for (int i = 0; i < 999; i++) many[i] = v3(cos(70 * DEGREE), sin(70 * DEGREE), 1e-3 * cos(i));
    many[999] = v3(cos(70 * DEGREE), -sin(70 * DEGREE), 0);
    assert_true(keller_cone_around(v3(0, 0, 0), 1000, many, &c));
    Random r = {33};
    assert_true(area_of(&c) < 1.01 * search(&r, c.directrix, c.e, 1, 1000, many));
    /* too wide, all around, or the apex among the points */
    KellerVec3 wide[2] = {{0.1, 1, 0}, {0.1, -1, 0}}, round[4] = {{1, 1, 1}, {-1, -1, 1}, {1, -1, -1}, {-1, 1, -1}};
    assert_false(keller_cone_around(v3(0, 0, 0), 2, wide, &c));
    assert_false(keller_cone_around(v3(0, 0, 0), 4, round, &c));
    assert_false(keller_cone_around(v3(1, -1, -1), 4, round, &c));
}

/* The direction at a polar angle and an azimuth, in long double. */
static Long3 spherical(KellerVec3 pole, KellerVec3 zero, long double polar, long double azimuth)
{
    Long3 d = long_madd((Long3){0, 0, 0}, longer(pole), cosl(polar));
    d = long_madd(d, longer(zero), sinl(polar) * cosl(azimuth));
    return long_madd(d, longer(v3_cross(pole, zero)), sinl(polar) * sinl(azimuth));
}

static void cells_hold_their_directions(void **state)
{
    (void)state;
    Random r = {4};
    int refused = 0;
    for (int i = 0; i < 10000; i++) {
        KellerVec3 pole = random_unit(&r), zero = v3_perpendicular(pole);
        double high = i % 2 ? pow(10, random_in(&r, -9, -1)) : random_in(&r, 0, 1.5),
               wide = i % 3 ? pow(10, random_in(&r, -9, 0)) : random_in(&r, 0, 2 * M_PI);
        KellerRange polar, azimuth = {random_in(&r, -7, 7), 0};
        polar.near = i % 5 == 0 ? 0 : i % 5 == 1 ? M_PI - high : random_in(&r, 0, M_PI - high);
        polar.far = fmin(M_PI, polar.near + high);
        if (i % 30 == 0) wide = 2 * M_PI;
        azimuth.far = azimuth.near + wide;
        KellerCone c;
        if (!keller_cone_cell(random_point(&r, 1e5), pole, zero, polar, azimuth, &c)) {
            assert_true(high > 1 || wide > 1);
            refused++;
            continue;
        }
        assert_frame(&c);
        for (int k = 0; k < 50; k++) {
            double a = k < 20 ? k % 2 : random_in(&r, 0, 1), b = k < 20 ? k / 2 % 2 : random_in(&r, 0, 1);
            if (k < 20 && k > 3) *(k % 4 < 2 ? &a : &b) = random_in(&r, 0, 1); /* corners, then borders */
            long double theta = polar.near + a * ((long double)polar.far - polar.near),
                        phi = azimuth.near + b * ((long double)azimuth.far - azimuth.near);
            assert_true(direction_inside(&c, spherical(pole, zero, theta, phi)));
        }
    }
    assert_true(refused < 3000);
    /* a whole turn about the pole up to 30 degrees: a round cone, but for the polygon around it; and the other
     * pole's */
    KellerCone c;
    for (int i = 0; i < 2; i++) {
        KellerRange polar = i ? (KellerRange){150 * DEGREE, M_PI} : (KellerRange){0, 30 * DEGREE};
        assert_true(keller_cone_cell(v3(5, 5, 5), v3(0, 0, 1), v3(1, 0, 0), polar, (KellerRange){0, 2 * M_PI}, &c));
        assert_true(fabs(c.tan_alpha / tan(30 * DEGREE) - 1) < 0.004 && c.e < 1.001 && c.origin.x == 5);
        assert_true(fabs(c.directrix.z - (i ? -1 : 1)) < 1e-6);
    }
    /* half the sphere, and a belt around the equator, do not fit */
    KellerRange turn = {0, 2 * M_PI};
    assert_false(keller_cone_cell(v3(0, 0, 0), v3(0, 0, 1), v3(1, 0, 0), (KellerRange){0, M_PI / 2}, turn, &c));
    assert_false(keller_cone_cell(v3(0, 0, 0), v3(0, 0, 1), v3(1, 0, 0), (KellerRange){1.5, 1.6}, turn, &c));
    /* the smallest ellipse around a cell, taken as 400 points of its border, is no more than 1 % smaller than ours */
    double worst = 0;
    for (int i = 0; i < 200; i++) {
        KellerRange polar = {random_in(&r, 0, 1.2), 0}, azimuth = {0, random_in(&r, 0.01, 2)};
        polar.far = fmin(1.4, polar.near + azimuth.far * random_in(&r, 0.1, 1));
        KellerVec3 border[400];
        for (int k = 0; k < 400; k++) {
            double t = k / 4 / 99.0, theta = k % 4 == 0 ? polar.near : polar.far, phi = azimuth.far * t;
            if (k % 4 > 1) {
                theta = polar.near + t * (polar.far - polar.near);
                phi = k % 4 == 2 ? 0 : azimuth.far;
            }
            border[k] = v3(sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta));
        }
        KellerCone least;
        if (!keller_cone_cell(v3(0, 0, 0), v3(0, 0, 1), v3(1, 0, 0), polar, azimuth, &c)) continue;
        assert_true(keller_cone_around(v3(0, 0, 0), 400, border, &least));
        worst = fmax(worst, area_of(&c) / area_of(&least) - 1);
    }
    print_message("# cells: at most %.2g larger than around 400 points of the border\n", worst);
    assert_true(worst < 0.01);
}

/* A tiling of the sphere: every direction is in the cone of the cell that its rounded angles belong to. */
static void cells_tile_the_sphere(void **state)
{
    (void)state;
    Random r = {5};
    enum { ROWS = 12, COLUMNS = 24 };
    KellerVec3 pole = v3_unit(v3(0.3, -0.2, 0.7)), zero = v3_perpendicular(pole), side = v3_cross(pole, zero);
    KellerCone cell[ROWS][COLUMNS];
    for (int i = 0; i < ROWS; i++)
        for (int k = 0; k < COLUMNS; k++) {
            KellerRange polar = {i * M_PI / ROWS, (i + 1) * M_PI / ROWS};
            KellerRange azimuth = {k * 2 * M_PI / COLUMNS, (k + 1) * 2 * M_PI / COLUMNS};
            assert_true(keller_cone_cell(v3(1, 2, 3), pole, zero, polar, azimuth, &cell[i][k]));
        }
    for (int i = 0; i < 200000; i++) {
        KellerVec3 d = random_unit(&r);
        if (i % 4 == 0) { /* on the border of two columns, or four cells */
            double theta = i % 8 ? random_in(&r, 0, M_PI) : (random_u32(&r) % (ROWS + 1)) * M_PI / ROWS,
                   phi = (random_u32(&r) % COLUMNS) * 2 * M_PI / COLUMNS;
            d = v3_add(v3_scale(pole, cos(theta)), v3_scale(v3_add(v3_scale(zero, cos(phi)), v3_scale(side, sin(phi))),
                                                            sin(theta)));
        }
        double x = v3_dot(d, zero), y = v3_dot(d, side), phi = atan2(y, x);
        if (phi < 0) phi += 2 * M_PI;
        int row = (int)(atan2(hypot(x, y), v3_dot(d, pole)) * ROWS / M_PI), column = (int)(phi * COLUMNS / (2 * M_PI));
        row = row < ROWS ? row : ROWS - 1;
        column = column < COLUMNS ? column : COLUMNS - 1;
        assert_true(direction_inside(&cell[row][column], longer(d)));
    }
}

static void mirrored_holds_reflections(void **state)
{
    (void)state;
    Random r = {6};
    int built = 0;
    for (int i = 0; i < 20000; i++) {
        KellerVec3 centre = random_point(&r, i % 3 ? 10 : 1e5), normal = random_unit(&r);
        double offset = v3_dot(normal, centre), size = pow(10, random_in(&r, -6, 1));
        KellerVec3 u = v3_perpendicular(normal), v = v3_cross(normal, u), foot[6];
        KellerVec3 apex = v3_madd(v3_add(centre, random_point(&r, 5)), normal, random_in(&r, 1, 100));
        size_t count = 3 + random_u32(&r) % 4;
        for (size_t k = 0; k < count; k++)
            foot[k] = v3_madd(v3_madd(centre, u, size * random_in(&r, -1, 1)), v, size * random_in(&r, -1, 1));
        KellerCone c;
        if (!keller_cone_mirrored(apex, normal, offset, count, foot, &c)) continue;
        built++;
        assert_frame(&c);
        assert_true(c.x0 > 0);
        /* the true image of the apex in the plane of the true unit normal */
        Long3 n = longer(normal), a = longer(apex);
        long double far = 2 * (offset - long_dot(n, a)) / long_dot(n, n);
        Long3 image = long_madd(a, n, far);
        for (int s = 0; s < 20; s++) {
            Long3 p = {0, 0, 0};
            long double weight = 0;
            for (size_t k = 0; k < count; k++) {
                long double w = s < (int)count ? (int)k == s : random_in(&r, 0, 1);
                p = long_madd(p, longer(foot[k]), w);
                weight += w;
            }
            p = long_madd((Long3){0, 0, 0}, p, 1 / weight);
            Long3 out = long_madd(p, image, -1);
            assert_true(inside(&c, p));
            for (int k = -2; k < 5; k++) assert_true(inside(&c, long_madd(p, out, powl(10, k))));
        }
        double z = INFINITY; /* the origin is near the footprint's nearest corner, before it */
        for (size_t k = 0; k < count; k++) z = fmin(z, (double)local(&c, longer(foot[k])).z);
        assert_true(z >= 0 && z < 1e-9);
    }
    assert_true(built > 15000);
}

static void keller_holds_diffracted_rays(void **state)
{
    (void)state;
    Random r = {7};
    int built = 0;
    for (int i = 0; i < 20000; i++) {
        KellerVec3 a = random_point(&r, i % 3 ? 10 : 1e5), along = random_unit(&r), zero = v3_perpendicular(along);
        KellerVec3 b = v3_madd(a, along, pow(10, random_in(&r, -4, 2))), source = v3_add(a, random_point(&r, 30));
        along = v3_unit(v3_sub(b, a));
        zero = v3_unit(v3_madd(zero, along, -v3_dot(zero, along)));
        KellerRange azimuth = {random_in(&r, -4, 4), 0};
        azimuth.far = azimuth.near + (i % 2 ? pow(10, random_in(&r, -9, 0)) : random_in(&r, 0, 3.1));
        KellerCone c;
        double start;
        if (!keller_cone_keller(a, b, source, zero, azimuth, &c, &start)) continue;
        built++;
        assert_frame(&c);
        Long3 A = longer(a), u = long_madd(longer(b), A, -1);
        long double length = sqrtl(long_dot(u, u));
        u = long_madd((Long3){0, 0, 0}, u, 1 / length);
        Long3 x = long_madd(longer(zero), u, -long_dot(u, longer(zero)));
        Long3 y = {u.y * x.z - u.z * x.y, u.z * x.x - u.x * x.z, u.x * x.y - u.y * x.x};
        for (int k = 0; k < 40; k++) {
            long double t = k < 8 ? k % 2 : random_in(&r, 0, 1), s = k < 8 ? k / 2 % 2 : random_in(&r, 0, 1);
            Long3 p = long_madd(A, u, t * length), in = long_madd(p, longer(source), -1);
            long double across = sqrtl(long_dot(in, in) - long_dot(in, u) * long_dot(in, u));
            long double phi = azimuth.near + s * ((long double)azimuth.far - azimuth.near);
            Long3 out = long_madd((Long3){0, 0, 0}, u, long_dot(in, u));
            out = long_madd(long_madd(out, x, across * cosl(phi)), y, across * sinl(phi));
            assert_true(direction_inside(&c, out));
            /* the ray from its start on; seen from a, as 64 bits are too few for tiny steps far from zero */
            KellerCone near_a = c;
            near_a.origin = v3_sub(c.origin, a);
            Long3 q = long_madd((Long3){0, 0, 0}, u, t * length);
            assert_true(local(&near_a, q).z <= start);
            for (int j = -3; j < 5; j++) assert_true(inside(&near_a, j < -2 ? q : long_madd(q, out, powl(10, j))));
        }
    }
    print_message("# Keller fans: %d of 20000 fit\n", built);
    assert_true(built > 10000);
    KellerCone c;
    KellerVec3 a = v3(0, 0, 0), b = v3(0, 0, 1), x = v3(1, 0, 0);
    KellerRange azimuth = {0, 0.5};
    assert_false(keller_cone_keller(a, a, v3(3, 0, 0), x, azimuth, &c, NULL));
    assert_false(keller_cone_keller(a, b, v3(0, 0, -3), x, azimuth, &c, NULL));
    assert_false(keller_cone_keller(a, b, v3(0, 0, 0.5), x, azimuth, &c, NULL));
    /* lit at a right angle from far away, over 0.5 rad: around the middle; the origin ellipse holds the piece */
    assert_true(keller_cone_keller(a, b, v3(-1e9, 0, 0.5), x, azimuth, &c, NULL));
    assert_true(v3_distance(c.directrix, v3(cos(0.25), sin(0.25), 0)) < 1e-3 && c.x0 >= 0.5);
}

int main(void)
{
    cmocka_set_message_output(CM_OUTPUT_TAP);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(elliptic_by_definition),
        cmocka_unit_test(around_holds_its_points),
        cmocka_unit_test(around_is_smallest),
        cmocka_unit_test(around_known_cases),
        cmocka_unit_test(cells_hold_their_directions),
        cmocka_unit_test(cells_tile_the_sphere),
        cmocka_unit_test(mirrored_holds_reflections),
        cmocka_unit_test(keller_holds_diffracted_rays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
