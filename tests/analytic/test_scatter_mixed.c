/* Paths that a patch scatters, with reflections, diffractions and transmissions before and behind it. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "../stability/harness.h"
#include "../stability/scenes.h"
#include "keller/wave.h"
#include "path/scatter.h"
#include "scatter_found.h"

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

/* ---- reciprocal, and only once ---------------------------------------------------------------------------------------- */

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
        cmocka_unit_test(ends_exchanged),
        cmocka_unit_test(through_a_corner),
        cmocka_unit_test(coincident_faces),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
