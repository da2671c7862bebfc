/* What mixed scattered paths carry, in power: against surface integrals with mirrored ends, through a sphere, onto the walls of a room. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <gsl/gsl_integration.h>

#include "../stability/scenes.h"
#include "scatter_found.h"

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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(finer_patches_over_a_mirror),
        cmocka_unit_test(power_through_a_quarter_sphere),
        cmocka_unit_test(power_in_a_room),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
