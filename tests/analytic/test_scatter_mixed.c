/* Paths that a patch scatters, with reflections, diffractions and transmissions before and behind it. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <gsl/gsl_integration.h>

#include "../stability/harness.h"
#include "../stability/scenes.h"
#include "keller/wave.h"
#include "path/scatter.h"

static const double lambda = KELLER_LIGHT_SPEED / 3.5e9;
static const KellerScattering lambert = {.coefficient = 0.6};
static const KellerScattering lobes = {.coefficient = 0.5, .lobe = 6, .back_lobe = 4, .share = 0.7};

static double power(double complex g) { return creal(g) * creal(g) + cimag(g) * cimag(g); }

/* Place of the scattering among the steps, or count. */
static uint32_t scattered_at(const Found *p)
{
    uint32_t i = 0;
    while (i < p->count && p->step[i].kind != KELLER_SCATTERING) i++;
    return i;
}

static bool scattered(const Found *p) { return scattered_at(p) < p->count; }

static uint32_t of_kind(const Found *p, KellerInteractionKind kind)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < p->count; i++) n += p->step[i].kind == kind;
    return n;
}

/* "RS", "SD" and so on. */
static bool is_kind(const Found *p, const char *letters)
{
    bool same = strlen(letters) == p->count;
    for (uint32_t i = 0; i < p->count && same; i++) same = letters[i] == "RDTS"[p->step[i].kind];
    return same;
}

static KellerVec3 direction(const double angles[2])
{
    return v3(sin(angles[0]) * cos(angles[1]), sin(angles[0]) * sin(angles[1]), cos(angles[0]));
}

/* ---- against ways that the program finds to and from the patches as if these were stations -------------------------------- */

enum { COLUMNS = 6, ROWS = 4, SPOTS = 2 * COLUMNS * ROWS }; /* spots: just before the middle of each patch, on either side of the wall */
static const double beside = 1e-7; /* m: from the patch; 2e-5 rad of phase, far above rounding and what counts as a boundary */

enum { REFLECTIONS = 2, DIFFRACTIONS = 1, TRANSMISSIONS = 1, INTERACTIONS = 4, WITH = 2 };

/* A wall of 6 m by 4 m in the plane y = 0 on the ground, a box of metal before it, a pane beside it, a screen behind. */
static KellerSoup yard(void)
{
    KellerSoup soup = soup_new();
    soup.materials[CONCRETE].diffuse = lobes;
    soup_object(&soup, "wall");
    soup_quad(&soup, v3(-3, 0, 0), v3(3, 0, 0), v3(3, 0, 4), v3(-3, 0, 4), CONCRETE);
    soup_object(&soup, "ground");
    soup_quad(&soup, v3(-20, -20, 0), v3(20, -20, 0), v3(20, 20, 0), v3(-20, 20, 0), DRY_GROUND);
    soup_object(&soup, "box");
    soup_box(&soup, v3(-1, 2.5, 0), v3(0.7, 3.2, 1.9), CONDUCTOR, 16);
    soup_object(&soup, "pane");
    soup_quad(&soup, v3(1.5, 1.5, 0), v3(4.2, 4.1, 0), v3(4.2, 4.1, 3.1), v3(1.5, 1.5, 3.1), GLASS);
    soup_object(&soup, "screen");
    soup_quad(&soup, v3(-4, -5, 0.3), v3(5, -4, 0.3), v3(5, -4, 3.3), v3(-4, -5, 3.3), CONDUCTOR);
    return soup;
}

static KellerVec3 spot(uint32_t i)
{
    uint32_t patch = i / 2;
    return v3(-2.5 + patch % COLUMNS, i % 2 ? -beside : beside, 0.5 + patch / COLUMNS);
}

/* Does the way touch the wall right at the spot, or run along it? */
static bool of_the_wall(const Found *p, bool at_end)
{
    if (p->count == 0) return false;
    KellerVec3 next = p->position[at_end ? p->count - 1 : 0];
    return fabs(next.y) < 1e-5;
}

/* The field that takes `before` to the patch and `behind` from it, as the transfer matrix of the whole. */
static void carried(const Found *before, const Found *behind, const KellerMedium *medium, double complex transfer[4])
{
    KellerVec3 in = v3_scale(direction(before->arrival), -1), out = direction(behind->departure), theta, phi, theta_out, phi_out;
    keller_spherical_basis(v3_scale(in, -1), &theta, &phi);
    keller_spherical_basis(out, &theta_out, &phi_out);
    double phase[2];
    KellerVec3 middle = spot(2 * (before->rx / 2));
    middle.y = 0;
    patch_phase(middle, phase);
    for (int t = 0; t < 2; t++) {
        double complex a = before->transfer[0][t], b = before->transfer[0][2 + t];
        KellerCVec3 e = {a * theta.x + b * phi.x, a * theta.y + b * phi.y, a * theta.z + b * phi.z};
        e = keller_scatter_field(medium, v3(0, 1, 0), in, out, 1, phase, 2 * M_PI / lambda, e);
        double complex x = e.x * theta_out.x + e.y * theta_out.y + e.z * theta_out.z;
        double complex y = e.x * phi_out.x + e.y * phi_out.y + e.z * phi_out.z;
        const double complex *then = behind->transfer[0];
        transfer[t] = (then[0] * x + then[1] * y) * 4 * M_PI / lambda;
        transfer[2 + t] = (then[2] * x + then[3] * y) * 4 * M_PI / lambda;
    }
}

static bool same_steps(const Found *p, const Found *before, const Found *behind)
{
    uint32_t at = before->count;
    if (p->count != at + 1 + behind->count || p->step[at].kind != KELLER_SCATTERING) return false;
    for (uint32_t i = 0; i < p->count; i++) {
        if (i == at) continue;
        const Found *half = i < at ? before : behind;
        uint32_t k = i < at ? i : i - at - 1;
        if (p->step[i].kind != half->step[k].kind || !(v3_distance(p->position[i], half->position[k]) < 1e-5)) return false;
    }
    return true;
}

/* Every pair of ways is found, as often as it should be, with its field, and nothing else. */
static void all_combinations(void **state)
{
    (void)state;
    const KellerVec3 tx = {-2.2, 5.1, 1.4}, rx[2] = {{2.4, 5.7, 1.2}, {0.6, -3.1, 2.6}};
    KellerVec3 spots[SPOTS];
    for (uint32_t i = 0; i < SPOTS; i++) spots[i] = spot(i);
    KellerSoup soup = yard();
    KellerScene scene = scene_of(&soup);
    scene.transmissions = TRANSMISSIONS;
    KellerMedium medium;
    KellerError error;
    assert_int_equal(keller_medium(&soup.materials[CONCRETE], 3.5e9, &medium, &error), KELLER_OK);
    Run run = run_new(&tx, SPOTS, spots, REFLECTIONS, DIFFRACTIONS, INTERACTIONS - 1), back = run, mixed = run;
    run.transmissions = TRANSMISSIONS;
    FoundPaths to = run_simulation(&scene, &run);
    back = run;
    back.tx_count = SPOTS;
    back.tx = spots;
    back.rx_count = 2;
    back.rx = rx;
    FoundPaths from = run_simulation(&scene, &back);
    mixed = run;
    mixed.rx_count = 2;
    mixed.rx = rx;
    mixed.interactions = INTERACTIONS;
    mixed.patch = 1;
    mixed.with_scattering = WITH;
    FoundPaths found = run_simulation(&scene, &mixed);
    bool *used = calloc(found.count, sizeof *used);
    size_t expected = 0, matched = 0, kinds[3] = {0};
    double worst = 0, longest = 0;
    for (size_t i = 0; i < to.count; i++)
        for (size_t j = 0; j < from.count; j++) {
            const Found *a = &to.path[i], *b = &from.path[j];
            if (a->rx != b->tx || of_the_wall(a, true) || of_the_wall(b, false)) continue;
            uint32_t r = of_kind(a, KELLER_REFLECTION) + of_kind(b, KELLER_REFLECTION);
            uint32_t d = of_kind(a, KELLER_DIFFRACTION) + of_kind(b, KELLER_DIFFRACTION);
            uint32_t t = of_kind(a, KELLER_TRANSMISSION) + of_kind(b, KELLER_TRANSMISSION);
            if (r > REFLECTIONS || d > DIFFRACTIONS || t > TRANSMISSIONS || r + d > WITH || r + d + t + 1 > INTERACTIONS) continue;
            expected++;
            double complex transfer[4];
            carried(a, b, &medium, transfer);
            for (size_t k = 0; k < found.count; k++) {
                const Found *p = &found.path[k];
                if (p->rx != b->rx || used[k] || !same_steps(p, a, b)) continue;
                KellerVec3 middle = p->position[a->count];
                if (!(v3_distance(middle, spot(a->rx)) < 2 * beside)) continue;
                used[k] = true;
                matched++;
                kinds[0] += r > 0, kinds[1] += d > 0, kinds[2] += t > 0;
                longest = fmax(longest, fabs(p->length - a->length - b->length));
                double size = 0, off = 0;
                for (int c = 0; c < 4; c++) size += power(transfer[c]), off += power(p->transfer[0][c] - transfer[c]);
                worst = fmax(worst, sqrt(off / size));
                break;
            }
        }
    size_t total = 0;
    for (size_t k = 0; k < found.count; k++) total += scattered(&found.path[k]);
    print_message("# %zu paths (%zu reflected, %zu diffracted, %zu through the pane), fields within %.1e\n", total, kinds[0], kinds[1],
                  kinds[2], worst);
    assert_int_equal(matched, expected);
    assert_int_equal(total, expected);
    assert_true(kinds[0] > 300 && kinds[1] > 300 && kinds[2] > 30);
    assert_true(longest < 3 * beside && worst < 1e-3);
    free(used);
    found_free(&to);
    found_free(&from);
    found_free(&found);
    keller_scene_free(&scene);
    soup_release(&soup);
}

/* ---- orders --------------------------------------------------------------------------------------------------------------- */

static size_t mixed_count(const FoundPaths *found, uint32_t with, uint32_t interactions)
{
    size_t n = 0;
    for (size_t i = 0; i < found->count; i++) {
        const Found *p = &found->path[i];
        n += scattered(p) && of_kind(p, KELLER_REFLECTION) + of_kind(p, KELLER_DIFFRACTION) <= with && p->count <= interactions;
    }
    return n;
}

/* Each bound leaves out what is beyond it and nothing else; and nothing depends on threads, the aperture or the accelerator. */
static void within_the_orders(void **state)
{
    (void)state;
    const KellerVec3 tx = {-2.2, 5.1, 1.4}, rx[2] = {{2.4, 5.7, 1.2}, {0.6, -3.1, 2.6}};
    KellerSoup soup = yard();
    KellerScene scene = scene_of(&soup);
    scene.transmissions = TRANSMISSIONS;
    Run run = run_new(&tx, 2, rx, REFLECTIONS, DIFFRACTIONS, INTERACTIONS);
    run.transmissions = TRANSMISSIONS;
    run.patch = 2;
    run.with_scattering = WITH;
    FoundPaths all = run_simulation(&scene, &run);
    static const uint32_t orders[5][2] = {{0, 1}, {1, 2}, {1, 3}, {2, 2}, {2, 3}}; /* beside the scattering; all together */
    for (int i = 0; i < 5; i++) {
        Run less = run;
        less.with_scattering = orders[i][0];
        less.interactions = orders[i][1];
        FoundPaths some = run_simulation(&scene, &less);
        assert_int_equal(mixed_count(&some, UINT32_MAX, UINT32_MAX), mixed_count(&all, orders[i][0], orders[i][1]));
        found_free(&some);
    }
    Run other = run;
    other.threads = 3;
    other.cone = 0.2;
    other.split_over = 3;
    other.accelerator = "kdtree";
    FoundPaths again = run_simulation(&scene, &other);
    assert_int_equal(again.count, all.count);
    for (size_t i = 0; i < all.count; i++) {
        assert_int_equal(again.path[i].count, all.path[i].count);
        assert_true(again.path[i].gain[0] == all.path[i].gain[0] && again.path[i].length == all.path[i].length);
    }
    found_free(&all);
    found_free(&again);
    keller_scene_free(&scene);
    soup_release(&soup);
}

/* The cells of a map have the paths that receivers at their places have, and the sum of powers. */
static void cells_are_receivers(void **state)
{
    (void)state;
    const KellerVec3 tx = {-2.2, 5.1, 1.4};
    KellerVec3 rx[6];
    for (int i = 0; i < 6; i++) rx[i] = v3(1.1 + 0.7 * (i % 3), 4.3 + 0.7 * (i / 3), 1.2);
    KellerSoup soup = yard();
    KellerScene scene = scene_of(&soup);
    Run run = run_new(&tx, 6, rx, 1, 1, 3);
    run.patch = 2;
    run.with_scattering = 1;
    FoundPaths points = run_simulation(&scene, &run);
    run.grid_step = 0.7;
    run.grid_rows = 2;
    FoundPaths cells = run_simulation(&scene, &run);
    assert_int_equal(cells.count, points.count);
    double sum[6] = {0};
    double complex coherent[6] = {0};
    for (size_t i = 0; i < points.count; i++) {
        const Found *p = &points.path[i];
        assert_true(cabs(cells.path[i].gain[0] - p->gain[0]) <= 1e-12 * cabs(p->gain[0]));
        if (scattered(p)) sum[p->rx] += power(p->gain[0]);
        else coherent[p->rx] += p->gain[0];
    }
    for (int i = 0; i < 6; i++) assert_true(fabs(cells.coverage[i] / (power(coherent[i]) + sum[i]) - 1) < 1e-9);
    found_free(&points);
    found_free(&cells);
    keller_scene_free(&scene);
    soup_release(&soup);
}

/* ---- a conducting ground: mirror images ------------------------------------------------------------------------------------ */

static KellerVec3 below(KellerVec3 p) { return v3(p.x, p.y, -p.z); }

/* |gain|^2 by the surface integral over the wall, with the transmitter or the receiver mirrored in the ground. Vertical antennas: the
 * image of a vertical current has its sign, and theta-hat mirrored is minus theta-hat of the mirrored direction, which squares away. */
static double integral(const KellerSoup *soup, KellerVec3 tx, KellerVec3 rx)
{
    enum { NODES = 40 };
    KellerMedium medium;
    KellerError error;
    const double none[2] = {0, 0};
    assert_int_equal(keller_medium(&soup->materials[CONCRETE], 3.5e9, &medium, &error), KELLER_OK);
    gsl_integration_glfixed_table *table = gsl_integration_glfixed_table_alloc(NODES);
    double sum = 0;
    for (size_t i = 0; i < NODES; i++)
        for (size_t j = 0; j < NODES; j++) {
            double x, z, wx, wz;
            gsl_integration_glfixed_point(-3, 3, i, &x, &wx, table);
            gsl_integration_glfixed_point(1, 5, j, &z, &wz, table);
            KellerVec3 p = v3(x, 0, z), in = v3_unit(v3_sub(p, tx)), out = v3_unit(v3_sub(rx, p)), e0, e1;
            keller_spherical_basis(in, &e0, NULL);
            keller_spherical_basis(v3_scale(out, -1), &e1, NULL);
            KellerCVec3 e = keller_scatter_field(&medium, v3(0, 1, 0), in, out, 1, none, 2 * M_PI / lambda, (KellerCVec3){e0.x, e0.y, e0.z});
            double r = v3_distance(tx, p) * v3_distance(p, rx) * 4 * M_PI / lambda;
            sum += wx * wz * power(e.x * e1.x + e.y * e1.y + e.z * e1.z) / (r * r);
        }
    gsl_integration_glfixed_table_free(table);
    return sum;
}

static void finer_patches_over_a_mirror(void **state)
{
    (void)state;
    const KellerVec3 tx = {-4, 5, 3}, rx = {2, 7, 1.5};
    static const char *const kinds[4] = {"S", "RS", "SR", "RSR"};
    KellerSoup soup = soup_new();
    soup.materials[CONCRETE].diffuse = lobes;
    soup_object(&soup, "wall");
    soup_quad(&soup, v3(-3, 0, 1), v3(3, 0, 1), v3(3, 0, 5), v3(-3, 0, 5), CONCRETE);
    soup_object(&soup, "ground");
    soup_quad(&soup, v3(-90, -90, 0), v3(90, -90, 0), v3(90, 90, 0), v3(-90, 90, 0), CONDUCTOR);
    KellerScene scene = scene_of(&soup);
    double error[4][3];
    for (int size = 0; size < 3; size++) {
        Run run = run_new(&tx, 1, &rx, 2, 0, 3);
        run.patch = pow(0.5, size);
        run.with_scattering = 2;
        FoundPaths found = run_simulation(&scene, &run);
        for (int k = 0; k < 4; k++) {
            double sum = 0;
            for (size_t i = 0; i < found.count; i++)
                if (is_kind(&found.path[i], kinds[k])) sum += power(found.path[i].gain[0]);
            error[k][size] = sum / integral(&soup, k % 2 ? below(tx) : tx, k / 2 ? below(rx) : rx) - 1;
        }
        found_free(&found);
    }
    for (int k = 0; k < 4; k++) {
        print_message("# %s: patches of 1, 1/2, 1/4 m are off by %+.1e %+.1e %+.1e\n", kinds[k], error[k][0], error[k][1], error[k][2]);
        assert_true(fabs(error[k][0]) < 0.03 && fabs(error[k][2]) < 2e-3);
        for (int i = 1; i < 3; i++) assert_true(fabs(error[k][i]) < fmax(0.35 * fabs(error[k][i - 1]), 1e-4));
    }
    keller_scene_free(&scene);
    soup_release(&soup);
}

/* A small plate over the ground, and a quarter of a sphere around both: what comes through is S^2 of all that falls on the plate, straight
 * and by way of the ground, on whichever way it leaves: nothing is lost and nothing made. */
static void power_through_a_quarter_sphere(void **state)
{
    (void)state;
    enum { ZENITHS = 10, AZIMUTHS = 14 };
    KellerVec3 rx[ZENITHS * AZIMUTHS];
    double weight[ZENITHS * AZIMUTHS];
    const double radius = 1e7, side = 0.5, height = 10; /* seen from the sphere plate and ground are in one place to 1e-6 */
    gsl_integration_glfixed_table *z = gsl_integration_glfixed_table_alloc(ZENITHS), *a = gsl_integration_glfixed_table_alloc(AZIMUTHS);
    for (size_t i = 0; i < ZENITHS; i++)
        for (size_t j = 0; j < AZIMUTHS; j++) {
            double zenith, w, azimuth, v;
            gsl_integration_glfixed_point(0, 0.5 * M_PI, i, &zenith, &w, z);
            gsl_integration_glfixed_point(-0.5 * M_PI, 0.5 * M_PI, j, &azimuth, &v, a);
            rx[i * AZIMUTHS + j] = v3_scale(v3(sin(zenith) * cos(azimuth), sin(zenith) * sin(azimuth), cos(zenith)), radius);
            weight[i * AZIMUTHS + j] = w * v * sin(zenith) * radius * radius;
        }
    gsl_integration_glfixed_table_free(z);
    gsl_integration_glfixed_table_free(a);
    KellerSoup soup = soup_new();
    /* metal that scatters, and (concrete's place) metal that does not */
    soup.materials[CONCRETE].kind = KELLER_MATERIAL_CONDUCTOR;
    soup.materials[CONDUCTOR].diffuse = lobes;
    soup.materials[CONDUCTOR].diffuse.cross = 0.2;
    soup_object(&soup, "plate");
    double h = 0.5 * side, low = height - h, high = height + h;
    soup_quad(&soup, v3(0, -h, low), v3(0, h, low), v3(0, h, high), v3(0, -h, high), CONDUCTOR);
    soup_object(&soup, "ground");
    soup_quad(&soup, v3(-1, -1e5, 0), v3(1e5, -1e5, 0), v3(1e5, 1e5, 0), v3(-1, 1e5, 0), CONCRETE);
    KellerScene scene = scene_of(&soup);
    KellerVec3 source = v3(30, 12, 25), plate = v3(0, 0, height);
    Run run = run_new(&source, ZENITHS * AZIMUTHS, rx, 2, 0, 3);
    run.patch = 1;
    run.with_scattering = 2;
    FoundPaths found = run_simulation(&scene, &run);
    double sum[2] = {0, 0}, incident = 0;
    for (size_t i = 0; i < found.count; i++)
        for (int t = 0; t < 2 && scattered(&found.path[i]); t++) {
            const Found *p = &found.path[i];
            sum[t] += weight[p->rx] * (power(p->transfer[0][t]) + power(p->transfer[0][2 + t])) * pow(4 * M_PI / lambda, 2);
        }
    for (int image = 0; image < 2; image++) {
        KellerVec3 to = v3_sub(plate, image ? below(source) : source);
        incident += side * side * fabs(to.x) / pow(v3_norm(to), 3);
    }
    print_message("# of what falls on the plate, scattered: %.8f and %.8f\n", sum[0] / incident, sum[1] / incident);
    for (int t = 0; t < 2; t++) assert_true(fabs(sum[t] / (0.25 * incident) - 1) < 1e-5);
    found_free(&found);
    keller_scene_free(&scene);
    soup_release(&soup);
}

/* ---- passive and reciprocal ------------------------------------------------------------------------------------------------ */

/* A closed room of metal walls that scatter S^2 and reflect the rest: all that leaves the transmitter falls on the walls, and again after
 * each interaction. So with t = 1 - S^2 and s = S^2, of all paths with one interaction the power through the walls is t + s = 1, of those
 * with two t t + t s + s t = 1 - s s, what is scattered twice being left out. Receivers are Gauss and Legendre's nodes on each wall. */
static void power_in_a_room(void **state)
{
    (void)state;
    enum { NODES = 5, POINTS = 6 * NODES * NODES };
    const double size[3] = {3, 2.5, 2}, inside = 1e-6;
    KellerVec3 rx[POINTS], tx = v3(1.3, 1.4, 0.9);
    double weight[POINTS];
    gsl_integration_glfixed_table *table = gsl_integration_glfixed_table_alloc(NODES);
    for (size_t i = 0; i < POINTS; i++) {
        size_t wall = i / (NODES * NODES), axis = wall / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        double at[3], wu, wv;
        gsl_integration_glfixed_point(0, size[u], i % NODES, &at[u], &wu, table);
        gsl_integration_glfixed_point(0, size[v], i / NODES % NODES, &at[v], &wv, table);
        at[axis] = wall % 2 ? size[axis] - inside : inside;
        rx[i] = v3(at[0], at[1], at[2]);
        weight[i] = wu * wv;
    }
    gsl_integration_glfixed_table_free(table);
    KellerSoup soup = soup_new();
    soup.materials[CONDUCTOR].diffuse = lambert;
    soup_object(&soup, "room");
    soup_box(&soup, v3(0, 0, 0), v3(size[0], size[1], size[2]), CONDUCTOR, 0);
    KellerScene scene = scene_of(&soup);
    Run run = run_new(&tx, POINTS, rx, 2, 0, 2);
    run.patch = 0.5;
    run.with_scattering = 1;
    FoundPaths found = run_simulation(&scene, &run);
    static const char *const kinds[6] = {"", "R", "S", "RR", "RS", "SR"};
    const double s = lambert.coefficient * lambert.coefficient, t = 1 - s, expected[6] = {1, t, s, t * t, t * s, s * t};
    double sum[6] = {0};
    for (size_t i = 0; i < found.count; i++) {
        const Found *p = &found.path[i];
        KellerVec3 arrival = direction(p->arrival);
        const double along[3] = {arrival.x, arrival.y, arrival.z};
        uint32_t wall = p->rx / (NODES * NODES);
        double onto = (wall % 2 ? -1 : 1) * along[wall / 2], flux = 0; /* what comes from the wall itself has fallen on it before */
        for (int c = 0; c < 4 && onto > 0; c++) flux += 0.5 * power(p->transfer[0][c]) * pow(4 * M_PI / lambda, 2);
        flux *= weight[p->rx] * onto / (4 * M_PI);
        for (int k = 0; k < 6; k++)
            if (is_kind(p, kinds[k])) sum[k] += flux;
    }
    for (int k = 0; k < 6; k++) {
        print_message("# through the walls of a room: \"%s\" %.4f of the power, expected %.4f\n", kinds[k], sum[k], expected[k]);
        /* patches of half a metre are in corners as near as that */
        assert_true(fabs(sum[k] / expected[k] - 1) < (k == 2 || k > 3 ? 0.02 : 2e-3));
    }
    found_free(&found);
    keller_scene_free(&scene);
    soup_release(&soup);
}

/* Lambert's law at perfect conductors does not tell the ends apart, whatever else is on the path: concrete, slabs, edges. */
static void ends_exchanged(void **state)
{
    (void)state;
    size_t bent = 0;
    for (uint64_t seed = 5301; seed <= 5306; seed++) {
        RandomScene world = scene_random(seed, SCENE_SMALL | (seed % 2 ? SCENE_THIN : 0));
        world.soup.materials[CONDUCTOR].diffuse = lambert;
        soup_object(&world.soup, "reflector");
        soup_quad(&world.soup, v3(-9, 31, 1), v3(9, 33, 1), v3(9, 33, 9), v3(-9, 31, 9), CONDUCTOR);
        KellerScene scene = scene_of(&world.soup);
        scene.transmissions = seed % 2;
        double complex h[2];
        double sum = 0;
        FoundPaths found[2];
        for (int way = 0; way < 2; way++) {
            KellerVec3 from = way ? world.rx[0] : world.tx, to = way ? world.tx : world.rx[0];
            Run run = run_new(&from, 1, &to, 1, 1, 3);
            run.transmissions = scene.transmissions;
            run.patch = 3;
            run.with_scattering = 2;
            found[way] = run_simulation(&scene, &run);
            h[way] = found_total(&found[way], 0, 0);
        }
        PathDifference d = paths_compare(&found[0], 0, &found[1], 0, 1e-7, true, NULL, true);
        assert_true(d.only_a == 0 && d.only_b == 0 && d.gain_error < 1e-9);
        for (size_t i = 0; i < found[0].count; i++) {
            sum += cabs(found[0].path[i].gain[0]);
            bent += scattered(&found[0].path[i]) && found[0].path[i].count > 1;
        }
        assert_true(fabs(cabs(h[0]) - cabs(h[1])) <= 1e-12 * sum);
        for (int way = 0; way < 2; way++) found_free(&found[way]);
        keller_scene_free(&scene);
        soup_release(&world.soup);
    }
    print_message("# %zu paths scattered and bent\n", bent);
    assert_true(bent > 100);
}

/* Two walls of metal at a right angle, transmitter and a patch both on the plane that halves it: the wave that both walls reflect goes
 * through the very corner, in either order. It is there once, as it is beside that plane. */
static void through_a_corner(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup.materials[CONCRETE].diffuse = lambert;
    soup_object(&soup, "corner");
    soup_quad(&soup, v3(0, -50, 0), v3(0, 50, 0), v3(0, 50, 40), v3(0, -50, 40), CONDUCTOR);
    soup_quad(&soup, v3(0, -50, 0), v3(40, -50, 0), v3(40, 50, 0), v3(0, 50, 0), CONDUCTOR);
    soup_object(&soup, "plate");
    soup_quad(&soup, v3(1.5, 9, 1.5), v3(2.5, 9, 1.5), v3(2.5, 9, 2.5), v3(1.5, 9, 2.5), CONCRETE);
    KellerScene scene = scene_of(&soup);
    KellerVec3 rx = v3(7, -3, 4);
    double sum[2] = {0, 0};
    size_t count[2] = {0, 0};
    for (int aside = 0; aside < 2; aside++) {
        KellerVec3 tx = v3(4, 1, 4 + 1e-5 * aside);
        Run run = run_new(&tx, 1, &rx, 2, 0, 3);
        run.patch = 2;
        run.with_scattering = 2;
        FoundPaths found = run_simulation(&scene, &run);
        for (size_t i = 0; i < found.count; i++)
            if (is_kind(&found.path[i], "RRS")) count[aside]++, sum[aside] += power(found.path[i].gain[0]);
        found_free(&found);
    }
    assert_int_equal(count[0], 1);
    assert_int_equal(count[1], 1);
    assert_true(fabs(sum[0] / sum[1] - 1) < 1e-4);
    keller_scene_free(&scene);
    soup_release(&soup);
}

/* Two faces of different materials in one place: one of them scatters, on bent paths too. */
static void coincident_faces(void **state)
{
    (void)state;
    const KellerVec3 tx = {-2.2, 5.1, 1.4}, rx = {2.4, 5.7, 1.2};
    size_t count[2] = {0, 0}, doubled = 0;
    for (int both = 0; both < 2; both++) {
        KellerSoup soup = soup_new();
        soup.materials[CONCRETE].diffuse = lobes;
        soup.materials[CONDUCTOR].diffuse = lambert;
        for (int sheet = 0; sheet <= both; sheet++) {
            soup_object(&soup, "wall");
            soup_quad(&soup, v3(-3, 0, 0.5), v3(3, 0, 0.5), v3(3, 0, 4), v3(-3, 0, 4), sheet ? CONDUCTOR : CONCRETE);
        }
        soup_object(&soup, "ground");
        soup_quad(&soup, v3(-20, -20, 0), v3(20, -20, 0), v3(20, 20, 0), v3(-20, 20, 0), DRY_GROUND);
        KellerScene scene = scene_of(&soup);
        Run run = run_new(&tx, 1, &rx, 2, 0, 3);
        run.patch = 1;
        run.with_scattering = 2;
        FoundPaths found = run_simulation(&scene, &run);
        for (size_t i = 0; i < found.count; i++) count[both] += scattered(&found.path[i]) && found.path[i].count > 1;
        doubled += paths_doubled(&found, 0, 1e-9);
        found_free(&found);
        keller_scene_free(&scene);
        soup_release(&soup);
    }
    assert_true(count[0] > 40 && doubled == 0);
    assert_int_equal(count[0], count[1]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_combinations),
        cmocka_unit_test(within_the_orders),
        cmocka_unit_test(cells_are_receivers),
        cmocka_unit_test(finer_patches_over_a_mirror),
        cmocka_unit_test(power_through_a_quarter_sphere),
        cmocka_unit_test(power_in_a_room),
        cmocka_unit_test(ends_exchanged),
        cmocka_unit_test(through_a_corner),
        cmocka_unit_test(coincident_faces),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
