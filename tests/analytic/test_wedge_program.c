/* The total field around a perfectly conducting wedge, from a mesh to the sum of the paths' gains, against the exact
 * solution for a point source (truth/b_point3d.csv; the diffraction integral of Bowman, Senior and Uslenghi's type).
 *
 * The edge is the z axis, the 0-face phi = 0, the n-face phi = n pi, solid between. Transmitter at rho' = 3,
 * receiver at rho = 2, z apart by 0, 2.5 or 10 m. With isotropic antennas of polarisation V both ends' fields are
 * along theta-hat, which on every ray is in the plane of the ray and the edge: the wedge acts on it as on a soft
 * scalar (direct 1, each mirror -1, diffracted D_s). H, along phi-hat, is the hard one, with a minus sign as phi-hat
 * at the receiver belongs to the direction that points back. With u normalised to e^{-jkR}/(4 pi R) for the direct
 * wave, therefore
 *     sum of gains = lambda u_soft for V,   -lambda u_hard for H.
 * The exact solution is the field of scalar sources; UTD's rays carry the same coefficients. */
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

#define LIGHT 299792458.0
#define DEGREE (M_PI / 180)

/* Half the edge's length and the extent of the faces, m: the paths used stay within 10 m of the origin. */
#define HALF_EDGE 30.0
#define FACE 40.0

/* A screen (n = 2) or a prism with the two faces; its other edges diffract too and are left out by wedge_total. */
static KellerScene wedge_scene(double n)
{
    KellerSoup soup = soup_new();
    soup_object(&soup, "wedge");
    KellerVec3 base[3] = {v3(0, 0, -HALF_EDGE), v3(FACE, 0, -HALF_EDGE),
                          v3(FACE * cos(n * M_PI), FACE * sin(n * M_PI), -HALF_EDGE)};
    if (n == 1.5) /* exactly square */
        base[2] = v3(0, -FACE, -HALF_EDGE);
    KellerVec3 up = v3(0, 0, 2 * HALF_EDGE);
    if (n == 2)
        soup_quad(&soup, base[0], base[1], v3_add(base[1], up), v3_add(base[0], up), CONDUCTOR);
    else
        soup_prism(&soup, 3, base, up, CONDUCTOR, 0);
    KellerScene scene = scene_of(&soup);
    soup_release(&soup);
    return scene;
}

static KellerVec3 cylindrical(double rho, double phi, double z) { return v3(rho * cos(phi), rho * sin(phi), z); }

static bool in_plane(const KellerFace *face, KellerVec3 p)
{
    return fabs(v3_dot(face->normal, p) - face->offset) < 1e-9;
}

/* The sum of the gains at a receiver over the direct path, the reflections in the two faces, and the diffraction at
 * the z axis. The other faces and rims are far away and no part of the exact solution. */
static double complex wedge_total(const KellerScene *scene, const FoundPaths *found, uint32_t rx)
{
    double complex sum = 0;
    for (size_t i = 0; i < found->count; i++) {
        const Found *p = &found->path[i];
        if (p->rx != rx) continue;
        assert_true(p->count <= 1);
        bool wanted = true;
        if (p->count && p->step[0].kind == KELLER_DIFFRACTION) {
            const KellerWedge *w = &scene->wedges[p->step[0].id];
            wanted = fabs(w->direction.z) > 0.5 && hypot(w->origin.x, w->origin.y) < 1e-9;
        } else if (p->count) {
            const KellerFace *f = &scene->faces[p->step[0].id];
            wanted = in_plane(f, v3(0, 0, 0)) && in_plane(f, v3(0, 0, 1));
        }
        if (wanted) sum += p->gain[0];
    }
    return sum;
}

static FoundPaths simulate(const KellerScene *scene, const KellerVec3 *tx, size_t rx_count, const KellerVec3 *rx,
                           double k, bool hard)
{
    Run run = run_new(tx, rx_count, rx, 1, 1, 1);
    run.frequency[0] = k * LIGHT / (2 * M_PI);
    run.antenna.polarization = hard ? KELLER_POLARIZATION_H : KELLER_POLARIZATION_V;
    run.cone = 8 * DEGREE;
    return run_simulation(scene, &run);
}

/* ---- against the truth table ------------------------------------------------------------------------------------ */

typedef struct {
    char n[8];
    double k, source_rho, source_phi, source_z, rho, phi, z;
    double complex exact[2], utd[2]; /* soft, hard */
} Row;

/* Columns: n,interior_deg,k,rhop,phip_deg,zp,rho,phi_deg,z,boundary,n_GO_terms, then pairs: soft, hard, diff_soft,
 * diff_hard, utd_soft, utd_hard, ... */
static bool read_row(FILE *file, Row *row)
{
    char line[4096], *column[32] = {line};
    int columns = 1;
    if (!fgets(line, sizeof line, file)) return false;
    for (char *at = line; *at && columns < 32; at++)
        if (*at == ',') {
            *at = 0;
            column[columns++] = at + 1;
        }
    assert_true(columns >= 23);
    double value[23];
    for (int i = 0; i < 23; i++) value[i] = atof(column[i]);
    snprintf(row->n, sizeof row->n, "%.7s", column[0]);
    row->k = value[2];
    row->source_rho = value[3];
    row->source_phi = value[4] * DEGREE;
    row->source_z = value[5];
    row->rho = value[6];
    row->phi = value[7] * DEGREE;
    row->z = value[8];
    for (int i = 0; i < 2; i++) {
        row->exact[i] = value[11 + 2 * i] + I * value[12 + 2 * i];
        row->utd[i] = value[19 + 2 * i] + I * value[20 + 2 * i];
    }
    return true;
}

static double n_of(const char *text)
{
    return strcmp(text, "3/2") == 0 ? 1.5 : strcmp(text, "5/3") == 0 ? 5.0 / 3 : strcmp(text, "4/3") == 0 ? 4.0 / 3 : 2;
}

static FILE *open_truth(const char *name)
{
    const char *source = getenv("KELLER_SOURCE");
    char path[4096];
    snprintf(path, sizeof path, "%s/../shared/truth/%s", source ? source : ".", name);
    FILE *file = fopen(path, "r");
    if (!file) printf("# no %s\n", path);
    return file;
}

enum { MAX_ROWS = 64 };

typedef struct {
    size_t points;
    double worst_ratio; /* of the largest error over UTD's own largest, over the groups */
    double worst_utd;   /* largest difference from the table's UTD, relative to the direct wave's size */
} Score;

/* Rows with the same wedge, wavenumber, source and z: one simulation a polarisation. */
static void compare_group(const KellerScene *scene, size_t count, const Row *rows, double largest[2], double utd[2],
                          Score *score)
{
    KellerVec3 tx = cylindrical(rows[0].source_rho, rows[0].source_phi, 0), rx[MAX_ROWS];
    double wave = 2 * M_PI / rows[0].k;
    for (size_t i = 0; i < count; i++) rx[i] = cylindrical(rows[i].rho, rows[i].phi, rows[i].z);
    double direct = 1 / (4 * M_PI * hypot(rows[0].rho + rows[0].source_rho, rows[0].z));
    for (int hard = 0; hard < 2; hard++) {
        FoundPaths found = simulate(scene, &tx, count, rx, rows[0].k, hard);
        for (uint32_t i = 0; i < count; i++) {
            double complex u = wedge_total(scene, &found, i) / wave * (hard ? -1 : 1);
            largest[hard] = fmax(largest[hard], cabs(u - rows[i].exact[hard]) / direct);
            utd[hard] = fmax(utd[hard], cabs(rows[i].utd[hard] - rows[i].exact[hard]) / direct);
            double off = cabs(u - rows[i].utd[hard]) / direct;
            if (!(off <= 1e-9))
                printf("# n %s, k %g, phi' %g, phi %.9g, z %g, %s: %.9g %+.9gj, UTD of the table %.9g %+.9gj\n",
                       rows[i].n, rows[i].k, rows[i].source_phi / DEGREE, rows[i].phi / DEGREE, rows[i].z,
                       hard ? "hard" : "soft", creal(u), cimag(u), creal(rows[i].utd[hard]), cimag(rows[i].utd[hard]));
            score->worst_utd = fmax(score->worst_utd, isnan(off) ? INFINITY : off);
            score->points++;
        }
        found_free(&found);
    }
}

static void truth_table(void **state)
{
    const char *wedge = *state;
    FILE *file = open_truth("b_point3d.csv");
    if (!file) skip();
    char header[4096];
    assert_non_null(fgets(header, sizeof header, file));
    KellerScene scene = wedge_scene(n_of(wedge));
    Row rows[MAX_ROWS], row;
    size_t count = 0;
    Score score = {0};
    /* Errors by (k, z): largest over the sources and receivers, as the table of UTD's own errors has them. */
    enum { GROUPS = 64 };
    struct {
        double k, z, largest[2], utd[2];
    } group[GROUPS] = {0};
    size_t groups = 0;
    bool more = true;
    while (more) {
        more = read_row(file, &row);
        bool same = more && count && strcmp(row.n, rows[0].n) == 0 && row.k == rows[0].k && row.z == rows[0].z &&
                    row.source_phi == rows[0].source_phi;
        if (!same && count) {
            size_t g = 0;
            while (g < groups && (group[g].k != rows[0].k || group[g].z != rows[0].z)) g++;
            if (g == groups) {
                assert_true(groups < GROUPS);
                group[groups].k = rows[0].k;
                group[groups++].z = rows[0].z;
            }
            compare_group(&scene, count, rows, group[g].largest, group[g].utd, &score);
            count = 0;
        }
        /* From one wavelength outwards (rho = 2 and 3: k rho > 2 pi), and not on the faces themselves, where the
         * receiver is in the wall. */
        bool on_face = row.phi < 1e-9 || row.phi > n_of(row.n) * M_PI - 1e-9;
        if (more && strcmp(row.n, wedge) == 0 && row.k * row.rho >= 2 * M_PI && !on_face) {
            assert_true(count < MAX_ROWS);
            rows[count++] = row;
        }
    }
    fclose(file);
    for (size_t g = 0; g < groups; g++)
        for (int hard = 0; hard < 2; hard++) {
            double ratio = group[g].largest[hard] / group[g].utd[hard];
            if (!(ratio <= 1.1))
                printf("# n %s, k %g, z %g, %s: error %.3g, UTD's own %.3g\n", wedge, group[g].k, group[g].z,
                       hard ? "hard" : "soft", group[g].largest[hard], group[g].utd[hard]);
            score.worst_ratio = fmax(score.worst_ratio, isnan(ratio) ? INFINITY : ratio);
        }
    printf("# n %s: %zu points, error %.4f of UTD's own, from the table's UTD %.3g of the direct wave\n", wedge,
           score.points, score.worst_ratio, score.worst_utd);
    assert_true(score.points > 500);
    assert_true(score.worst_ratio <= 1.1);
    /* The same formulas: what is left are roundings, k r = 2000 rad at 2^-53 and the table's own. */
    assert_true(score.worst_utd <= 1e-9);
    keller_scene_free(&scene);
}

/* ---- across the boundaries -------------------------------------------------------------------------------------- */

static void no_jumps(void **state)
{
    (void)state;
    static const struct {
        double n, source; /* source angle in degrees */
    } wedges[] = {{2, 60}, {2, 20}, {1.5, 40}, {1.5, 100}, {1.5, 200}};
    enum { STEPS = 401 };
    const double k = 73.4, step = 1e-4 * DEGREE; /* 3.5 GHz: from one step to the next 2.5e-4 rad of phase at rho = 2 */
    size_t bad = 0, crossed = 0;
    for (size_t w = 0; w < sizeof wedges / sizeof *wedges; w++) {
        KellerScene scene = wedge_scene(wedges[w].n);
        double source = wedges[w].source, open = 180 * wedges[w].n;
        const double boundary[] = {source + 180, source - 180, 180 - source, 2 * open - 180 - source};
        for (int b = 0; b < 4; b++) {
            if (boundary[b] <= 0.1 || boundary[b] >= open - 0.1) continue;
            crossed++;
            for (int oblique = 0; oblique < 2; oblique++)
                for (int hard = 0; hard < 2; hard++) {
                    KellerVec3 tx = cylindrical(3, source * DEGREE, 0), rx[STEPS];
                    for (int i = 0; i < STEPS; i++)
                        rx[i] = cylindrical(2, boundary[b] * DEGREE + (i - STEPS / 2) * step, oblique ? 2.5 : 0);
                    FoundPaths found = simulate(&scene, &tx, STEPS, rx, k, hard);
                    double last = 0, largest = 0;
                    int where = 0;
                    for (uint32_t i = 0; i < STEPS; i++) {
                        double level = 20 * log10(cabs(wedge_total(&scene, &found, i)));
                        double jump = i ? fabs(level - last) : 0;
                        if (!(jump <= largest)) {
                            largest = isnan(jump) ? INFINITY : jump;
                            where = (int)i;
                        }
                        last = level;
                    }
                    if (!(largest <= 0.01)) {
                        printf(
                            "# n %g, source at %g, boundary at %g degrees, %s%s: a jump of %.4f dB at step %d of %d\n",
                            wedges[w].n, source, boundary[b], hard ? "hard" : "soft", oblique ? ", oblique" : "",
                            largest, where, STEPS);
                        bad++;
                    }
                    found_free(&found);
                }
        }
        keller_scene_free(&scene);
    }
    assert_true(crossed >= 9);
    assert_int_equal(bad, 0);
}

/* The scene's model reaches the field of a lossy corner: at normal incidence the diffracted path's gain is lambda/(4 pi s')
 * times keller_diffract_field's component along the edge, in each of the three models; exchanging the ends changes the
 * gain in all but the reciprocal one. */
static void wedge_models(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "corner");
    KellerVec3 base[3] = {v3(0, 0, -HALF_EDGE), v3(FACE, 0, -HALF_EDGE), v3(0, -FACE, -HALF_EDGE)};
    soup_prism(&soup, 3, base, v3(0, 0, 2 * HALF_EDGE), CONCRETE, 0);
    KellerScene scene = scene_of(&soup);
    soup_release(&soup);
    KellerVec3 a = cylindrical(3, 50 * DEGREE, 0), b = cylindrical(2, 80 * DEGREE, 0);
    double k = 70, wave = 2 * M_PI / k;
    KellerMedium medium;
    assert_int_equal(keller_medium(&(KellerMaterial){.kind = KELLER_MATERIAL_ITU, .itu = "concrete"},
                                   k * LIGHT / (2 * M_PI), &medium, NULL), KELLER_OK);
    for (int m = 0; m < 3; m++) {
        scene.wedge_model = (KellerWedgeModel)m;
        double complex gain[2] = {0, 0};
        for (int way = 0; way < 2; way++) {
            FoundPaths found = simulate(&scene, way ? &b : &a, 1, way ? &a : &b, k, false);
            for (size_t i = 0; i < found.count; i++) {
                const Found *p = &found.path[i];
                if (p->count == 1 && p->step[0].kind == KELLER_DIFFRACTION && hypot(p->position[0].x, p->position[0].y) < 1e-9)
                    gain[way] = p->gain[0];
            }
            found_free(&found);
        }
        KellerWedgeWave w = {.n = 1.5, .direction = {0, 0, 1}, .tangent0 = {1, 0, 0}, .normal0 = {0, 1, 0},
                             .medium = {medium, medium}, .model = scene.wedge_model};
        KellerCVec3 e = keller_diffract_field(&w, v3_scale(v3_unit(a), -1), v3_unit(b), 3, 2, k, (KellerCVec3){0, 0, 1});
        double complex expected = wave / (4 * M_PI * 3) * cexp(-I * k * 5) * e.z;
        assert_true(cabs(gain[0] - expected) < 1e-9 * cabs(expected));
        double change = cabs(gain[1] - gain[0]) / cabs(gain[0]);
        if (scene.wedge_model == KELLER_WEDGE_RECIPROCAL)
            assert_true(change < 1e-12);
        else
            assert_true(change > 1e-3);
    }
    keller_scene_free(&scene);
}

int main(void)
{
    static char n2[] = "2", n32[] = "3/2", n53[] = "5/3", n43[] = "4/3";
    const struct CMUnitTest tests[] = {
        {"point_source_screen", truth_table, NULL, NULL, n2},
        {"point_source_wedge_90", truth_table, NULL, NULL, n32},
        {"point_source_wedge_60", truth_table, NULL, NULL, n53},
        {"point_source_wedge_120", truth_table, NULL, NULL, n43},
        cmocka_unit_test(no_jumps),
        cmocka_unit_test(wedge_models),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
