/* Slabs along whole paths: reflection and transmission against the table of coefficients, stacks of walls against the
 * product of theirs. */
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
#include "../truth/table.h"

static void wall(KellerSoup *soup, double x, double size, uint32_t material)
{
    soup_quad(soup, v3(x, -size, -size), v3(x, size, -size), v3(x, size, size), v3(x, -size, size), material);
}

static KellerScene finish(KellerSoup *soup)
{
    KellerScene scene = scene_of(soup);
    soup_release(soup);
    return scene;
}

/* ---- one slab --------------------------------------------------------------------------------------------------- */

static double complex column(const Table *t, const char *name)
{
    char part[32];
    snprintf(part, sizeof part, "%s_re", name);
    double re = table_number(t, part);
    snprintf(part, sizeof part, "%s_im", name);
    return re + I * table_number(t, part);
}

/* The wall x = 0 is met under the angle theta in the horizontal plane, 3 m behind the transmitter and 2 m before the receiver,
 * so theta-hat = -z at both ends is perpendicular to the plane of incidence (TE) and phi-hat parallel to it. Along the ray d,
 * phi-hat = z x d at the transmitter and -z x d at the receiver: through the wall the transfer is diag(T_TE, -T_TM). A mirror
 * turns z x d into -z x d' and P.2040's R_TM goes with minus the mirrored vector: reflected, it is diag(R_TE, -R_TM). Both
 * times the line of sight's lambda/(4 pi r) e^{-jkr}, and the transmitted one times e^{jkd cos(theta)}, the free space whose
 * place the slab takes. */
static double row_error(const Table *t, const KellerMedium *medium, double frequency)
{
    double theta = table_number(t, "theta_deg") * M_PI / 180, c = cos(theta), s = sin(theta);
    KellerSoup soup = soup_new();
    soup_object(&soup, "wall");
    wall(&soup, 0, 20, PARTITION);
    KellerMaterial *m = &soup.materials[PARTITION];
    m->kind = KELLER_MATERIAL_CONSTANT;
    m->permittivity = creal(medium->eta);
    m->conductivity = -cimag(medium->eta) * 2 * M_PI * frequency * KELLER_VACUUM_PERMITTIVITY;
    m->thickness = medium->thickness;
    KellerScene scene = finish(&soup);
    KellerVec3 tx = v3(-3 * c, -3 * s - 0.4, 0.7), rx[2] = {v3(2 * c, 2 * s - 0.4, 0.7), v3(-2 * c, 2 * s - 0.4, 0.7)};
    Run run = run_new(&tx, 2, rx, 1, 0, 1);
    run.transmissions = 1;
    run.frequency[0] = frequency;
    FoundPaths found = run_simulation(&scene, &run);
    double k = 2 * M_PI * frequency / KELLER_LIGHT_SPEED, off = 0;
    double complex sight = KELLER_LIGHT_SPEED / frequency / (4 * M_PI * 5) * cexp(-I * fmod(k * 5, 2 * M_PI));
    double complex instead = cexp(I * k * medium->thickness * c);
    size_t seen = 0;
    for (size_t i = 0; i < found.count; i++) {
        const Found *p = &found.path[i];
        if (p->count == 0) continue;
        bool through = p->step[0].kind == KELLER_TRANSMISSION;
        assert_true(p->count == 1 && p->rx == !through);
        assert_true(fabs(p->length - 5) < 1e-13 && v3_distance(p->position[0], v3(0, -0.4, 0.7)) < 1e-13);
        double complex te = through ? column(t, "T_TE") * instead : column(t, "R_TE");
        double complex tm = through ? column(t, "T_TM") * instead : column(t, "R_TM");
        const double complex *h = p->transfer[0];
        off = fmax(off, fmax(cabs(h[0] / sight - te), cabs(h[3] / sight + tm)));
        off = fmax(off, fmax(cabs(h[1] / sight), cabs(h[2] / sight)));
        seen++;
    }
    assert_int_equal(seen, 2);
    found_free(&found);
    keller_scene_free(&scene);
    return off;
}

static void check_table(bool full)
{
    Table t;
    if (!table_open(&t, "f_fresnel_slab.csv", full)) skip();
    int rows = 0;
    while (table_next(&t)) {
        KellerMaterial m = {.kind = KELLER_MATERIAL_ITU};
        KellerMedium medium;
        table_text(&t, "material", m.itu, sizeof m.itu);
        double frequency = table_number(&t, "f_GHz") * 1e9;
        if (keller_medium(&m, frequency, &medium, NULL)) continue; /* the table extrapolates, the program does not */
        medium.thickness = table_number(&t, "thickness_m");
        if (isinf(medium.thickness)) continue;
        double off = row_error(&t, &medium, frequency);
        if (!(off < 1e-10)) fail_msg("%s: off by %g", t.line, off);
        rows++;
    }
    assert_true(rows >= (full ? 200 : 50));
}

static void table(void **state)
{
    (void)state;
    check_table(false);
}

static void table_full(void **state)
{
    (void)state;
    check_table(true);
}

/* ---- fifty ------------------------------------------------------------------------------------------------------ */

enum { SLABS = 50 };

/* Fifty slabs 0.5 m apart, of two materials in turn, but for five places where two or three lie in one plane: alike, alike
 * but cut along the other diagonal, or of two materials. */
static KellerScene fifty(uint32_t material[SLABS], double at[SLABS])
{
    KellerSoup soup = soup_new();
    soup_object(&soup, "walls");
    double x = 1;
    for (int i = 0; i < SLABS; i++) {
        bool alike = i == 7 || i == 8 || i == 21 || i == 49, other = i == 30;
        if (!alike && !other) x += 0.5;
        material[i] = alike ? material[i - 1] : i % 2 ? GLASS : PARTITION;
        at[i] = x;
        if (i == 21)
            soup_quad(&soup, v3(x, 30, -30), v3(x, 30, 30), v3(x, -30, 30), v3(x, -30, -30), material[i]);
        else
            wall(&soup, x, 30, material[i]);
    }
    return finish(&soup);
}

static void fifty_slabs(void **state)
{
    (void)state;
    uint32_t material[SLABS];
    double at[SLABS];
    KellerScene scene = fifty(material, at);
    KellerVec3 tx = v3(-2, 1.3, 0.4), rx = v3(40, -9.1, 0.4);
    KellerMedium medium[2];
    const KellerMaterial materials[2] = {{.kind = KELLER_MATERIAL_ITU, .itu = "plasterboard", .thickness = 0.013},
                                         {.kind = KELLER_MATERIAL_ITU, .itu = "glass", .thickness = 0.006}};
    double frequency = 3.5e9, lambda = KELLER_LIGHT_SPEED / frequency, k = 2 * M_PI / lambda;
    double r = v3_distance(tx, rx), c = 42 / r;
    double complex product[2] = {1, 1};
    for (int i = 0; i < 2; i++) assert_int_equal(keller_medium(&materials[i], frequency, &medium[i], NULL), KELLER_OK);
    for (int i = 0; i < SLABS; i++) {
        double complex te, tm;
        const KellerMedium *m = &medium[material[i] == GLASS];
        keller_transmission(m, c, k, &te, &tm);
        product[0] *= te * cexp(I * k * m->thickness * c);
        product[1] *= tm * cexp(I * k * m->thickness * c);
    }
    const double cones[] = {45, 1};
    for (int way = 0; way < 4; way++) {
        bool back = way & 1;
        Run run = run_new(back ? &rx : &tx, 1, back ? &tx : &rx, 0, 0, SLABS);
        run.cone = cones[way >> 1] * M_PI / 180;
        run.transmissions = SLABS - 1; /* one too few */
        FoundPaths found = run_simulation(&scene, &run);
        assert_int_equal(found.count, 0);
        found_free(&found);
        run.transmissions = SLABS;
        found = run_simulation(&scene, &run);
        assert_int_equal(found.count, 1);
        const Found *p = &found.path[0];
        assert_int_equal(p->count, SLABS);
        for (int i = 0; i < SLABS; i++) {
            int j = back ? SLABS - 1 - i : i;
            assert_int_equal(p->step[i].kind, KELLER_TRANSMISSION);
            assert_true(fabs(p->position[i].x - at[j]) < 1e-12);
            assert_int_equal(scene.triangle_face[p->triangle[i]], p->step[i].id);
            if (i > 0 && at[j] == at[back ? j + 1 : j - 1]) continue; /* of one plane, in the order of faces */
            const char *name = scene.materials[scene.faces[p->step[i].id].material].name;
            if (j < 29 || j > 30) assert_string_equal(name, material[j] == GLASS ? "pane" : "partition");
        }
        double complex sight = lambda / (4 * M_PI * r) * cexp(-I * fmod(k * r, 2 * M_PI));
        double complex te = sight * product[0], tm = -sight * product[1];
        assert_true(fabs(cabs(p->transfer[0][0]) / cabs(te) - 1) < 1e-12);
        assert_true(fabs(cabs(p->transfer[0][3]) / cabs(tm) - 1) < 1e-12);
        assert_true(fabs(cabs(p->gain[0]) / cabs(te) - 1) < 1e-12);
        assert_true(cabs(p->transfer[0][0] - te) < 1e-11 * cabs(te) && cabs(p->transfer[0][3] - tm) < 1e-11 * cabs(tm));
        assert_true(p->length == r && p->delay == r / KELLER_LIGHT_SPEED);
        found_free(&found);
    }
    keller_scene_free(&scene);
}

/* A mirror behind the slabs, which the wave passes on its way there and back: with 5 of them, 10 transmissions. */
static void there_and_back(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "walls");
    for (int i = 0; i < 5; i++) wall(&soup, 1 + i, 20, PARTITION);
    wall(&soup, 7, 20, CONDUCTOR);
    KellerScene scene = finish(&soup);
    KellerVec3 tx = v3(-1, -2, 0.3), rx = v3(-2, 3, 0.3);
    Run run = run_new(&tx, 1, &rx, 1, 0, 11);
    for (uint32_t transmissions = 0; transmissions <= 12; transmissions++) {
        /* The line of sight, and the reflections in the walls 1, 2, ... with 0, 2, ... transmissions. */
        run.transmissions = transmissions;
        FoundPaths found = run_simulation(&scene, &run);
        assert_int_equal(found.count, 2 + (transmissions > 10 ? 10 : transmissions) / 2);
        found_free(&found);
    }
    run.transmissions = 12;
    for (uint32_t interactions = 0; interactions <= 13; interactions++) { /* all kinds together: 1 + 2 i */
        run.interactions = interactions;
        FoundPaths found = run_simulation(&scene, &run);
        assert_int_equal(found.count, 1 + ((interactions > 11 ? 11 : interactions) + 1) / 2);
        found_free(&found);
    }
    keller_scene_free(&scene);
}

/* Delay, angles and positions of a transmitted path are those of the straight ray. */
static void straight(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "walls");
    wall(&soup, 1, 20, GLASS);
    wall(&soup, 2, 20, PARTITION);
    KellerScene scene = finish(&soup);
    KellerVec3 tx = v3(0, 0, 0), rx = v3(3, 4, 1);
    Run run = run_new(&tx, 1, &rx, 0, 0, 2);
    run.transmissions = 2;
    FoundPaths found = run_simulation(&scene, &run);
    assert_int_equal(found.count, 1);
    const Found *p = &found.path[0];
    assert_true(fabs(p->departure[0] - acos(1 / sqrt(26))) < 1e-15 && fabs(p->departure[1] - atan2(4, 3)) < 1e-15);
    assert_true(fabs(p->arrival[0] - acos(-1 / sqrt(26))) < 1e-15 && fabs(p->arrival[1] - atan2(-4, -3)) < 1e-15);
    assert_true(p->delay == sqrt(26) / KELLER_LIGHT_SPEED);
    assert_true(v3_distance(p->position[0], v3(1, 4.0 / 3, 1.0 / 3)) < 1e-15);
    assert_true(v3_distance(p->position[1], v3(2, 8.0 / 3, 2.0 / 3)) < 1e-15);
    found_free(&found);
    keller_scene_free(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(table),       cmocka_unit_test(table_full),     cmocka_unit_test(straight),
        cmocka_unit_test(fifty_slabs), cmocka_unit_test(there_and_back),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
