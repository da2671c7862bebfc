/* A street canyon, path by path, against mirror images written out here in extended precision.
 *
 * Walls y = 0 (W0) and y = 20 (W1), ground z = 0 (G), as meshes that end far outside of what the paths need. The
 * images of the transmitter (x, y, z) in the walls are at 40 m - y (|2m - 1| wall reflections) and 40 m + y (|2m|),
 * m any whole number, each with z (no ground) or -z (one ground reflection): each image is one path, whose order of
 * hits is that in which the line from the image to the receiver crosses the planes y = 20 i and z = 0. With at most
 * K reflections that makes 1 + 3 + 4 (K - 1) = 4 K paths: 16 for K = 4. */
#include <complex.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "../stability/harness.h"
#include "../stability/scenes.h"

typedef long double Real;
typedef long double complex Complex;

#define WIDTH 20.0L
#define ORDER 4
#define PI 3.14159265358979323846264338327950288L
#define LIGHT 299792458.0L

enum { W0, W1, GROUND, SURFACES };
static const char *const surface_name[] = {"W0", "W1", "G"};

static const KellerVec3 transmitter = {0, 6, 10};
static const KellerVec3 receivers[] = {{5, 13, 1.5}, {30, 13, 1.5}, {80, 13, 1.5}, {200, 13, 1.5}, {50, 8.5, 10}};
#define RECEIVERS (sizeof receivers / sizeof *receivers)

/* ---- the materials, from ITU-R P.2040-4, table 3 ---------------------------------------------------------------- */

typedef struct {
    const char *name;      /* the truth table's */
    double frequency;      /* Hz */
    uint32_t wall, ground; /* materials of scenes.h */
} Case;

static const Case cases[] = {
    {"3.5GHz_concrete", 3.5e9, CONCRETE, CONCRETE},
    {"28GHz_concrete", 28e9, CONCRETE, CONCRETE},
    {"3.5GHz_PEC", 3.5e9, CONDUCTOR, CONDUCTOR},
    {"3.5GHz_concrete_meddryground", 3.5e9, CONCRETE, DRY_GROUND},
};
#define CASES (sizeof cases / sizeof *cases)

/* eta = a f^b - j c f^d / (2 pi f eps0), f in GHz in the powers. */
static Complex permittivity(uint32_t material, Real frequency)
{
    Real ghz = frequency / 1e9L, eps0 = 8.8541878128e-12L;
    Real real = material == CONCRETE ? 5.24L : 15 * powl(ghz, -0.1L);
    Real conductivity = material == CONCRETE ? 0.0462L * powl(ghz, 0.7822L) : 0.035L * powl(ghz, 1.63L);
    return real - I * conductivity / (2 * PI * frequency * eps0);
}

/* ---- vectors ---------------------------------------------------------------------------------------------------- */

static Real dot(const Real a[3], const Real b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const Real a[3], const Real b[3], Real c[3])
{
    for (int i = 0; i < 3; i++) c[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

static void basis(const Real d[3], Real theta[3], Real phi[3])
{
    Real rho = hypotl(d[0], d[1]), c = d[0] / rho, s = d[1] / rho;
    theta[0] = d[2] * c;
    theta[1] = d[2] * s;
    theta[2] = -rho;
    phi[0] = -s;
    phi[1] = c;
    phi[2] = 0;
}

/* ---- the image method ------------------------------------------------------------------------------------------- */

typedef struct {
    int count, surface[ORDER];
    Real length, departure[3], arrival[3], point[ORDER][3];
    Real direction[ORDER + 1][3];
} Image;

/* The path of the image at (x, y, z): unfolded, it is a line. */
static Image image_path(Real image_y, Real image_z, KellerVec3 rx)
{
    Image p = {0};
    Real from[3] = {transmitter.x, image_y, image_z}, to[3] = {rx.x, rx.y, rx.z}, d[3], at[ORDER];
    for (int i = 0; i < 3; i++) d[i] = to[i] - from[i];
    p.length = sqrtl(dot(d, d));
    /* Crossings of y = i W: an even i is the wall W0, seen in the mirrors. */
    for (int i = -ORDER - 1; i <= ORDER + 1; i++) {
        Real t = (i * WIDTH - image_y) / d[1];
        if (t > 0 && t < 1) {
            p.surface[p.count] = i % 2 ? W1 : W0;
            at[p.count++] = t;
        }
    }
    if (image_z < 0) {
        p.surface[p.count] = GROUND;
        at[p.count++] = -image_z / d[2];
    }
    for (int i = 1; i < p.count; i++)
        for (int j = i; j > 0 && at[j] < at[j - 1]; j--) {
            Real t = at[j];
            int s = p.surface[j];
            at[j] = at[j - 1];
            p.surface[j] = p.surface[j - 1];
            at[j - 1] = t;
            p.surface[j - 1] = s;
        }
    for (int i = 0; i < p.count; i++) {
        Real y = from[1] + at[i] * d[1], period = 2 * WIDTH;
        y -= period * floorl(y / period);
        p.point[i][0] = from[0] + at[i] * d[0];
        p.point[i][1] = y <= WIDTH ? y : period - y;
        p.point[i][2] = fabsl(from[2] + at[i] * d[2]);
    }
    /* The last leg has the line's direction; backwards, each surface mirrors it. */
    for (int k = 0; k < 3; k++) p.direction[p.count][k] = d[k] / p.length;
    for (int i = p.count; i-- > 0;) {
        memcpy(p.direction[i], p.direction[i + 1], sizeof p.direction[i]);
        int axis = p.surface[i] == GROUND ? 2 : 1;
        p.direction[i][axis] = -p.direction[i][axis];
    }
    return p;
}

static int images(KellerVec3 rx, Image list[4 * ORDER])
{
    int count = 0;
    for (int ground = 0; ground < 2; ground++)
        for (int m = -ORDER; m <= ORDER; m++)
            for (int odd = 0; odd < 2; odd++) {
                int walls = odd ? abs(2 * m - 1) : abs(2 * m);
                if (walls + ground > ORDER) continue;
                Real y = odd ? 2 * m * WIDTH - transmitter.y : 2 * m * WIDTH + transmitter.y;
                Image p = image_path(y, ground ? -transmitter.z : transmitter.z, rx);
                assert_int_equal(p.count, walls + ground);
                list[count++] = p;
            }
    return count;
}

/* The transfer matrix [received][transmitted] of a path: the Fresnel coefficients of P.2040-4 (equations 31), the
 * plane of incidence at each surface, the bases of SPEC 1 at both ends. */
static void transfer(const Image *p, const Case *c, Complex result[4])
{
    static const Real normals[SURFACES][3] = {{0, 1, 0}, {0, -1, 0}, {0, 0, 1}};
    Real wave = LIGHT / (Real)c->frequency, back[3], in[2][3], out[2][3];
    for (int k = 0; k < 3; k++) back[k] = -p->direction[p->count][k];
    basis(p->direction[0], in[0], in[1]);
    basis(back, out[0], out[1]);
    Complex spreading = wave / (4 * PI * p->length) * cexpl(-I * 2 * PI * p->length / wave);
    for (int t = 0; t < 2; t++) {
        Complex e[3] = {in[t][0], in[t][1], in[t][2]};
        for (int i = 0; i < p->count; i++) {
            const Real *n = normals[p->surface[i]], *k = p->direction[i], *after = p->direction[i + 1];
            uint32_t material = p->surface[i] == GROUND ? c->ground : c->wall;
            Complex te = -1, tm = 1;
            if (material != CONDUCTOR) {
                Complex eta = permittivity(material, c->frequency);
                Real cosine = fabsl(dot(k, n));
                Complex root = csqrtl(eta - (1 - cosine * cosine));
                te = (cosine - root) / (cosine + root);
                tm = (eta * cosine - root) / (eta * cosine + root);
            }
            Real perpendicular[3], parallel[3], mirrored[3];
            cross(k, n, perpendicular);
            Real sine = sqrtl(dot(perpendicular, perpendicular));
            for (int a = 0; a < 3; a++) perpendicular[a] /= sine;
            cross(perpendicular, k, parallel);
            cross(perpendicular, after, mirrored);
            Complex s = 0, q = 0;
            for (int a = 0; a < 3; a++) {
                s += e[a] * perpendicular[a];
                q += e[a] * parallel[a];
            }
            for (int a = 0; a < 3; a++) e[a] = te * s * perpendicular[a] + tm * q * mirrored[a];
        }
        for (int r = 0; r < 2; r++) {
            Complex sum = 0;
            for (int a = 0; a < 3; a++) sum += e[a] * out[r][a];
            result[2 * r + t] = spreading * sum;
        }
    }
}

/* ---- the program ------------------------------------------------------------------------------------------------ */

static KellerScene canyon(uint32_t wall, uint32_t ground)
{
    KellerSoup soup = soup_new();
    double a = -60, b = 260, height = 60;
    soup_object(&soup, "W0");
    soup_quad(&soup, v3(a, 0, 0), v3(b, 0, 0), v3(b, 0, height), v3(a, 0, height), wall);
    soup_object(&soup, "W1");
    soup_quad(&soup, v3(a, 20, 0), v3(b, 20, 0), v3(b, 20, height), v3(a, 20, height), wall);
    soup_object(&soup, "G");
    soup_quad(&soup, v3(a, 0, 0), v3(b, 0, 0), v3(b, 20, 0), v3(a, 20, 0), ground);
    KellerScene scene = scene_of(&soup);
    soup_release(&soup);
    return scene;
}

static int surface_of(const KellerScene *scene, uint32_t triangle)
{
    const char *object = scene->objects[scene->triangle_object[triangle]];
    return object[0] == 'G' ? GROUND : object[1] == '0' ? W0 : W1;
}

static FoundPaths simulate(const KellerScene *scene, const Case *c, KellerPolarization polarization, bool grid)
{
    Run run = run_new(&transmitter, RECEIVERS, receivers, ORDER, 0, ORDER);
    run.frequency[0] = c->frequency;
    run.antenna.polarization = polarization;
    if (grid) {
        run.rx_count = 1;
        run.grid_step = 1;
    }
    return run_simulation(scene, &run);
}

static const Found *match(const KellerScene *scene, const FoundPaths *found, uint32_t rx, const Image *image)
{
    const Found *result = NULL;
    for (size_t i = 0; i < found->count; i++) {
        const Found *p = &found->path[i];
        bool same = p->rx == rx && (int)p->count == image->count;
        for (int k = 0; same && k < image->count; k++)
            same = p->step[k].kind == KELLER_REFLECTION && surface_of(scene, p->triangle[k]) == image->surface[k];
        /* W0 W1 is one sequence for each of two images only if lengths differ; here they never do. */
        if (same) {
            assert_null(result);
            result = p;
        }
    }
    return result;
}

static void compare(const KellerScene *scene, const FoundPaths *found, const Case *c, KellerPolarization polarization,
                    uint32_t rx)
{
    Image list[4 * ORDER];
    int count = images(receivers[rx], list);
    assert_int_equal(count, 4 * ORDER);
    assert_int_equal(found_count(found, rx), 4 * ORDER);
    for (int i = 0; i < count; i++) {
        const Found *p = match(scene, found, rx, &list[i]);
        assert_non_null(p);
        assert_true(fabsl(p->length - list[i].length) <= 1e-12L * list[i].length);
        assert_true(fabsl(p->delay - list[i].length / LIGHT) <= 1e-12L * list[i].length / LIGHT);
        for (int k = 0; k < list[i].count; k++) {
            const Real *at = list[i].point[k];
            assert_true(v3_distance(p->position[k], v3((double)at[0], (double)at[1], (double)at[2])) <= 1e-10);
        }
        const Real *d = list[i].direction[0], *a = list[i].direction[list[i].count];
        assert_true(fabsl(p->departure[0] - acosl(d[2])) <= 1e-12L);
        assert_true(fabsl(p->departure[1] - atan2l(d[1], d[0])) <= 1e-12L);
        assert_true(fabsl(p->arrival[0] - acosl(-a[2])) <= 1e-12L);
        assert_true(fabsl(p->arrival[1] - atan2l(-a[1], -a[0])) <= 1e-12L);
        Complex expected[4];
        transfer(&list[i], c, expected);
        Complex gain = expected[polarization == KELLER_POLARIZATION_V ? 0 : 3];
        Real spreading = LIGHT / (Real)c->frequency / (4 * PI * list[i].length);
        Real off = cabsl(p->gain[0] - gain) / cabsl(gain);
        if (!(off <= 1e-9L))
            printf("# %s, receiver %u, image %d: gain %.12g %+.12gj, expected %.12Lg %+.12Lgj, off by %.3Lg\n", c->name,
                   rx, i, creal(p->gain[0]), cimag(p->gain[0]), creall(gain), cimagl(gain), off);
        assert_true(off <= 1e-9L);
        /* The cross-polar terms of a single reflection may be zero: there the spreading is the measure. */
        for (int k = 0; k < 4; k++)
            assert_true(cabsl(p->transfer[0][k] - expected[k]) <= 1e-9L * cabsl(expected[k]) + 1e-12L * spreading);
    }
}

static void paths_match_images(void **state)
{
    const Case *c = *state;
    KellerScene scene = canyon(c->wall, c->ground);
    for (int h = 0; h < 2; h++) {
        KellerPolarization polarization = h ? KELLER_POLARIZATION_H : KELLER_POLARIZATION_V;
        FoundPaths found = simulate(&scene, c, polarization, false);
        for (uint32_t rx = 0; rx < RECEIVERS; rx++) compare(&scene, &found, c, polarization, rx);
        found_free(&found);
        found = simulate(&scene, c, polarization, true);
        compare(&scene, &found, c, polarization, 0);
        found_free(&found);
    }
    keller_scene_free(&scene);
}

/* ---- the sum of all paths ---------------------------------------------------------------------------------------- */

/* 1000 receivers between the walls, both polarisations: the coherent sum of the paths against that of the images. */
static void sum_of_images(void **state)
{
    enum { COUNT = 1000 };
    const Case *c = *state;
    KellerScene scene = canyon(c->wall, c->ground);
    KellerVec3 *rx = malloc(COUNT * sizeof *rx);
    assert_non_null(rx);
    Random random = random_seeded(20);
    for (int i = 0; i < COUNT; i++)
        rx[i] = v3(random_range(&random, 2, 200), random_range(&random, 0.5, 19.5), random_range(&random, 0.5, 25));
    double worst = 0, worst_of_sum = 0;
    for (int h = 0; h < 2; h++) {
        Run run = run_new(&transmitter, COUNT, rx, ORDER, 0, ORDER);
        run.frequency[0] = c->frequency;
        run.antenna.polarization = h ? KELLER_POLARIZATION_H : KELLER_POLARIZATION_V;
        FoundPaths found = run_simulation(&scene, &run);
        assert_int_equal(found.count, COUNT * 4 * ORDER);
        double complex *total = calloc(COUNT, sizeof *total);
        assert_non_null(total);
        for (size_t i = 0; i < found.count; i++) total[found.path[i].rx] += found.path[i].gain[0];
        for (int i = 0; i < COUNT; i++) {
            Image list[4 * ORDER];
            Complex sum = 0, t[4];
            Real sizes = 0;
            int count = images(rx[i], list);
            for (int k = 0; k < count; k++) {
                transfer(&list[k], c, t);
                sum += t[h ? 3 : 0];
                sizes += cabsl(t[h ? 3 : 0]);
            }
            worst = fmax(worst, (double)(cabsl(total[i] - sum) / sizes));
            worst_of_sum = fmax(worst_of_sum, (double)(cabsl(total[i] - sum) / cabsl(sum)));
        }
        free(total);
        found_free(&found);
    }
    print_message("# %s: off by at most %.2g of the sum, %.2g of the sum of sizes\n", c->name, worst_of_sum, worst);
    assert_true(worst_of_sum <= 1e-9);
    free(rx);
    keller_scene_free(&scene);
}

/* ---- the table of the truth folder, where there is one ---------------------------------------------------------- */

enum { COLUMNS = 30 };

static void truth_table(void **state)
{
    const char *source = getenv("KELLER_SOURCE");
    char name[4096];
    (void)state;
    snprintf(name, sizeof name, "%s/../shared/truth/d_canyon_rf_paths.csv", source ? source : ".");
    FILE *file = fopen(name, "r");
    if (!file) {
        printf("# no %s\n", name);
        skip();
    }
    char line[4096];
    size_t compared = 0;
    KellerScene scenes[CASES];
    FoundPaths found[CASES];
    for (size_t i = 0; i < CASES; i++) {
        scenes[i] = canyon(cases[i].wall, cases[i].ground);
        found[i] = simulate(&scenes[i], &cases[i], KELLER_POLARIZATION_V, false);
    }
    while (fgets(line, sizeof line, file)) {
        /* case,rx,path,order,n_wall,n_ground,sequence,length_m, 8 columns of coefficients, T_thth, T_thph, T_phth,
         * T_phph (received, transmitted; re and im each), a_VV (re, im), 4 more */
        char *column[COLUMNS] = {line};
        int columns = 1;
        for (char *at = line; *at && columns < COLUMNS; at++)
            if (*at == ',') {
                *at = 0;
                column[columns++] = at + 1;
            }
        size_t i = 0;
        while (i < CASES && strcmp(cases[i].name, column[0]) != 0) i++;
        if (i == CASES || atoi(column[3]) > ORDER) continue;
        uint32_t rx = (uint32_t)atoi(column[1]);
        Image sequence = {0};
        for (const char *at = column[6]; *at;) {
            for (int s = 0; s < SURFACES; s++)
                if (strncmp(at, surface_name[s], strlen(surface_name[s])) == 0) sequence.surface[sequence.count] = s;
            sequence.count++;
            at += strcspn(at, " ");
            at += *at == ' ';
        }
        const Found *p = match(&scenes[i], &found[i], rx, &sequence);
        assert_non_null(p);
        double length = atof(column[7]), wave = 299792458.0 / cases[i].frequency;
        double complex expected = atof(column[24]) + I * atof(column[25]);
        double complex spreading = wave / (4 * M_PI * length) * cexp(-I * 2 * M_PI * length / wave);
        assert_true(fabs(p->length - length) <= 1e-12 * length);
        assert_true(cabs(p->gain[0] - expected) <= 1e-9 * cabs(expected));
        for (int k = 0; k < 4; k++) {
            double complex t = spreading * (atof(column[16 + 2 * k]) + I * atof(column[17 + 2 * k]));
            assert_true(cabs(p->transfer[0][k] - t) <= 1e-9 * cabs(t) + 1e-12 * cabs(spreading));
        }
        compared++;
    }
    fclose(file);
    assert_int_equal(compared, CASES * RECEIVERS * 4 * ORDER);
    for (size_t i = 0; i < CASES; i++) {
        found_free(&found[i]);
        keller_scene_free(&scenes[i]);
    }
}

int main(void)
{
    struct CMUnitTest tests[CASES + 3];
    for (size_t i = 0; i < CASES; i++)
        tests[i] = (struct CMUnitTest){cases[i].name, paths_match_images, NULL, NULL, (void *)(uintptr_t)&cases[i]};
    for (size_t i = 0; i < 2; i++) /* concrete */
        tests[CASES + i] = (struct CMUnitTest){i ? "sum_at_28GHz" : "sum_at_3.5GHz", sum_of_images, NULL, NULL,
                                               (void *)(uintptr_t)&cases[i]};
    tests[CASES + 2] = (struct CMUnitTest){"truth_table", truth_table, NULL, NULL, NULL};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
