/* Materials, reflection and transmission, the transition function and the four terms of the UTD coefficient. */
#include <locale.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "../truth/table.h"
#include "../truth/transition.h"
#include "base/embedded.h"
#include "keller/wave.h"

static KellerMaterial itu(const char *name)
{
    static char wall[] = "wall";
    KellerMaterial m = {.name = wall, .kind = KELLER_MATERIAL_ITU};
    snprintf(m.itu, sizeof m.itu, "%s", name);
    return m;
}

static double complex column(const Table *t, const char *name)
{
    char re[32], im[32];
    snprintf(re, sizeof re, "%s_re", name);
    snprintf(im, sizeof im, "%s_im", name);
    return table_number(t, re) + I * table_number(t, im);
}

/* ---- materials -------------------------------------------------------------------------------------------------- */

/* eps' = a f^b, sigma = c f^d (f in GHz), eta = eps' - j sigma/(2 pi f eps0). */
static void check_itu(const char *name, double f, double permittivity, double conductivity)
{
    KellerMaterial m = itu(name);
    KellerMedium medium;
    KellerError error = {KELLER_OK, ""};
    if (keller_medium(&m, f, &medium, &error)) fail_msg("%s", error.message);
    double loss = conductivity / (2 * M_PI * f * 8.8541878128e-12);
    assert_false(medium.conductor);
    assert_true(fabs(creal(medium.eta) - permittivity) <= 1e-14 * permittivity);
    assert_true(fabs(cimag(medium.eta) + loss) <= 1e-13 * loss);
}

static void itu_constants(void **state)
{
    (void)state;
    check_itu("vacuum", 3.5e9, 1, 0);
    check_itu("concrete", 3.5e9, 5.24, 0.0462 * pow(3.5, 0.7822));
    check_itu("wood", 1e6, 1.99, 0.0047 * pow(0.001, 1.0718)); /* the first frequency of its range */
    check_itu("glass", 0.1e9, 6.31, 0.0036 * pow(0.1, 1.3394));
    check_itu("concrete", 100e9, 5.24, 0.0462 * pow(100, 0.7822)); /* the last */
    check_itu("concrete", 140e9, 5.17, 0.0145 * pow(140, 1.09));
    check_itu("metal", 28e9, 1, 1e7);
    check_itu("wet_ground", 10e9, 30 * pow(10, -0.4), 0.15 * pow(10, 1.3));
    check_itu("clear_acrylic", 330e9, 2.58, 0.0001 * pow(330, 1.6524));
    /* several rows hold the frequency: the narrowest; 220-450 before 100-400, 1-100 before 100-400 */
    check_itu("glass", 300e9, 5.79, 0.0004 * pow(300, 1.658));
    check_itu("glass", 200e9, 6.5767, 0.0012 * pow(200, 1.4697));
    check_itu("plasterboard", 100e9, 2.73, 0.0085 * pow(100, 0.9395));
    check_itu("floorboard", 350e9, 5.27, 0.0003 * pow(350, 2.0298));
    check_itu("floorboard", 450e9, 5.27, 49.8726);
    check_itu("floorboard", 120e9, 3.1575, 0.001675 * pow(120, 1.32775));
}

/* Every name of the table is in the list and the other way round, in one order; every row is found in its range. */
static void itu_table(void **state)
{
    (void)state;
    const char *const *names = keller_itu_names();
    size_t count = 0, rows = 0;
    char last[32] = "";
    const char *p = keller_data_itu_r_p2040_csv;
    for (; *p; p += strcspn(p, "\n"), p += *p == '\n') {
        char name[32];
        double a, b, c, d, lower, upper;
        if (sscanf(p, "%31[^,\n],%lf,%lf,%lf,%lf,%lf,%lf", name, &a, &b, &c, &d, &lower, &upper) != 7) continue;
        if (strcmp(name, last) != 0) assert_string_equal(names[count++], name);
        strcpy(last, name);
        assert_true(keller_itu_known(name));
        KellerMaterial m = itu(name);
        KellerMedium medium;
        assert_int_equal(keller_medium(&m, lower * 1e9, &medium, NULL), KELLER_OK);
        assert_int_equal(keller_medium(&m, upper * 1e9, &medium, NULL), KELLER_OK);
        rows++;
    }
    assert_int_equal(rows, 38);
    assert_int_equal(count, 19);
    assert_null(names[count]);
    assert_false(keller_itu_known("itu_concrete"));
    assert_false(keller_itu_known(""));
    assert_false(keller_itu_known("name"));
}

/* A locale with decimal commas in the host program changes nothing. Skipped where none is installed. */
static void itu_locale(void **state)
{
    (void)state;
    static const char *const comma[] = {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8"};
    bool set = false;
    for (int i = 0; i < 3 && !set; i++) set = setlocale(LC_ALL, comma[i]) != NULL;
    if (!set) skip();
    check_itu("concrete", 3.5e9, 5.24, 0.0462 * pow(3.5, 0.7822));
    setlocale(LC_ALL, "C");
}

static void check_error(KellerMaterial m, double f, const char *message)
{
    KellerMedium medium;
    KellerError error = {KELLER_OK, ""};
    assert_int_equal(keller_medium(&m, f, &medium, &error), KELLER_BAD_INPUT);
    assert_string_equal(error.message, message);
    assert_int_equal(error.status, KELLER_BAD_INPUT);
}

static void material_errors(void **state)
{
    (void)state;
    check_error(
        itu("concrete"), 105e9,
        "material \"wall\": ITU-R P.2040-4 does not define concrete at 105 GHz; expected a frequency in 1-100 GHz, "
        "110-330 GHz, or a permittivity and conductivity given outright");
    check_error(itu("very_dry_ground"), 28e9,
                "material \"wall\": ITU-R P.2040-4 does not define very_dry_ground at 28 GHz; expected a frequency in "
                "1-10 GHz, or a permittivity and conductivity given outright");
    check_error(itu("wood"), 0.9999e6,
                "material \"wall\": ITU-R P.2040-4 does not define wood at 0.0009999 GHz; expected a frequency in "
                "0.001-100 GHz, 110-330 GHz, 100-400 GHz, or a permittivity and conductivity given outright");
    check_error(itu("cheese"), 1e9,
                "material \"wall\": \"cheese\" is not in ITU-R P.2040-4; expected one of its names");
    KellerMaterial named = itu("concrete");
    named.kind = KELLER_MATERIAL_NAMED;
    check_error(named, 1e9,
                "material \"wall\" is only a name; expected an ITU-R P.2040-4 name, constants or a conductor");
}

static void constant_and_conductor(void **state)
{
    (void)state;
    KellerMaterial m = {
        .kind = KELLER_MATERIAL_CONSTANT, .permittivity = 6.31, .conductivity = 0.0036, .thickness = 0.006};
    KellerMedium medium;
    assert_int_equal(keller_medium(&m, 1e9, &medium, NULL), KELLER_OK);
    /* 0.0036/(2 pi 1e9 8.8541878128e-12) = 0.06471037290428 */
    assert_true(cabs(medium.eta - (6.31 - 0.064710372904280 * I)) < 1e-12);
    assert_true(medium.thickness == 0.006 && !medium.conductor);
    m.kind = KELLER_MATERIAL_CONDUCTOR;
    assert_int_equal(keller_medium(&m, 1e9, &medium, NULL), KELLER_OK);
    assert_true(medium.conductor);
}

/* ---- reflection and transmission -------------------------------------------------------------------------------- */

static void check_fresnel(bool full)
{
    Table t;
    if (!table_open(&t, "f_fresnel_slab.csv", full)) skip();
    int rows = 0;
    while (table_next(&t)) {
        /* The table carries rows outside a material's range too; the constants of its nearest row below 100 GHz. */
        char name[32];
        KellerMaterial m = itu(table_text(&t, "material", name, sizeof name));
        double f = table_number(&t, "f_GHz") * 1e9, k = 2 * M_PI * f / KELLER_LIGHT_SPEED;
        KellerMedium medium;
        if (keller_medium(&m, f, &medium, NULL)) continue;
        medium.thickness = table_number(&t, "thickness_m");
        if (isinf(medium.thickness)) medium.thickness = 0;
        double c = cos(table_number(&t, "theta_deg") * M_PI / 180);
        double complex r[2], s[2];
        keller_reflection(&medium, c, k, &r[0], &r[1]);
        keller_transmission(&medium, c, k, &s[0], &s[1]);
        double off = fmax(cabs(r[0] - column(&t, "R_TE")), cabs(r[1] - column(&t, "R_TM")));
        if (medium.thickness > 0)
            off = fmax(off, fmax(cabs(s[0] - column(&t, "T_TE")), cabs(s[1] - column(&t, "T_TM"))));
        else
            assert_true(s[0] == 0 && s[1] == 0);
        if (!(off < 1e-12)) fail_msg("%s: off by %g", t.line, off);
        rows++;
    }
    assert_true(rows >= 90);
}

static void fresnel(void **state)
{
    (void)state;
    check_fresnel(false);
}
static void fresnel_full(void **state)
{
    (void)state;
    check_fresnel(true);
}

/* |R|^2 + |T|^2 is 1 without loss and less with it; finite for any thickness and angle. */
static void slab_energy(void **state)
{
    (void)state;
    static const double thicknesses[] = {1e-12, 0.0123, 0.3, 1e3, 1e9}, cosines[] = {0, 1e-300, 1e-12, 1e-3, 0.5, 1};
    static const double losses[] = {0, 1e-6, 0.6, 1e2, 1e9};
    for (int a = 0; a < 5; a++)
        for (int b = 0; b < 6; b++)
            for (int c = 0; c < 5; c++)
                for (double eps = 1; eps < 40; eps *= 2.29) {
                    KellerMedium m = {.eta = eps - I * losses[c], .thickness = thicknesses[a]};
                    double complex r[2], s[2];
                    keller_reflection(&m, cosines[b], 73, &r[0], &r[1]);
                    keller_transmission(&m, cosines[b], 73, &s[0], &s[1]);
                    for (int i = 0; i < 2; i++) {
                        double energy = creal(r[i] * conj(r[i])) + creal(s[i] * conj(s[i]));
                        assert_true(energy <= 1 + 1e-12);
                        if (losses[c] == 0) assert_true(energy >= 1 - 1e-12);
                    }
                }
}

/* A slab of air is no slab: nothing reflected, and the phase of the free space it fills, k d cos theta. A grazing wave
 * is wholly reflected, R = -1 for both polarisations, by everything but air and a conductor's TM. */
static void limits_of_slabs(void **state)
{
    (void)state;
    KellerMedium air = {.eta = 1, .thickness = 0.2}, wall = {.eta = 5.24 - 0.6 * I}, plate = wall;
    KellerMedium metal = {.conductor = true, .thickness = 0.1};
    double complex te, tm;
    for (double c = 0; c <= 1; c += 0.25) {
        keller_reflection(&air, c, 73, &te, &tm);
        assert_true(cabs(te) < 1e-15 && cabs(tm) < 1e-15);
        keller_transmission(&air, c, 73, &te, &tm);
        assert_true(cabs(te - cexp(-I * 73 * 0.2 * c)) < 1e-14 && cabs(tm - te) < 1e-14);
        keller_reflection(&metal, c, 73, &te, &tm);
        assert_true(te == -1 && tm == 1);
        keller_transmission(&metal, c, 73, &te, &tm);
        assert_true(te == 0 && tm == 0);
    }
    plate.thickness = 0.05;
    for (int i = 0; i < 2; i++) {
        keller_reflection(i ? &plate : &wall, 0, 73, &te, &tm);
        assert_true(cabs(te + 1) < 1e-15 && cabs(tm + 1) < 1e-15);
        keller_reflection(i ? &plate : &wall, 1, 73, &te, &tm);
        assert_true(cabs(te + tm) < 1e-15);
    }
    keller_transmission(&plate, 0, 73, &te, &tm);
    assert_true(te == 0 && tm == 0);
}

/* A conductor's reflected field is -e + 2 (e.n) n in any geometry; a wall's is R_TE and R_TM in the plane of incidence.
 * */
static void reflected_field(void **state)
{
    (void)state;
    KellerMedium metal = {.conductor = true}, wall = {.eta = 5.24 - 0.6 * I};
    KellerVec3 n = v3_unit(v3(0.3, -0.2, 0.9)), in = v3_unit(v3(1, 2, -0.7)), a = v3_perpendicular(in);
    KellerVec3 b = v3_cross(in, a);
    KellerCVec3 e = {a.x + 2 * I * b.x, a.y + 2 * I * b.y, a.z + 2 * I * b.z};
    double complex en = e.x * n.x + e.y * n.y + e.z * n.z;
    for (int side = 1; side >= -1; side -= 2) {
        KellerCVec3 r = keller_reflect_field(&metal, v3_scale(n, side), in, 73, e);
        assert_true(cabs(r.x - (2 * en * n.x - e.x)) < 1e-15 && cabs(r.y - (2 * en * n.y - e.y)) < 1e-15 &&
                    cabs(r.z - (2 * en * n.z - e.z)) < 1e-15);
    }
    double complex te, tm;
    keller_reflection(&wall, 0.6, 73, &te, &tm);
    KellerVec3 up = v3(0, 0, 1), down = v3(0.8, 0, -0.6);
    /* perpendicular: y stays; parallel: (0.6, 0, 0.8) in, and (-0.6, 0, 0.8) out with R_TM (a conductor keeps z) */
    KellerCVec3 r = keller_reflect_field(&wall, up, down, 73, (KellerCVec3){0.6, 3, 0.8});
    assert_true(cabs(r.x + 0.6 * tm) < 1e-15 && cabs(r.y - 3 * te) < 1e-15 && cabs(r.z - 0.8 * tm) < 1e-15);
    /* normal incidence, exactly and nearly: R_TE whatever the polarisation */
    keller_reflection(&wall, 1, 73, &te, &tm);
    for (double tilt = 0; tilt < 1e-7; tilt = tilt == 0 ? 1e-17 : tilt * 10) {
        r = keller_reflect_field(&wall, up, v3_unit(v3(tilt, -tilt, -1)), 73, (KellerCVec3){0.6, -0.8 * I, 0});
        assert_true(cabs(r.x - 0.6 * te) < 1e-7 && cabs(r.y + 0.8 * I * te) < 1e-7 && cabs(r.z) < 1e-6);
    }
}

/* T_TE and T_TM in the plane of incidence, in the direction of the incoming wave, from either side, with the free space taken
 * out whose place the slab takes: air changes nothing, and glass of no thickness to speak of next to nothing. */
static void transmitted_field(void **state)
{
    (void)state;
    KellerMedium metal = {.conductor = true, .thickness = 0.1}, half_space = {.eta = 5.24 - 0.6 * I};
    KellerMedium wall = {.eta = 5.24 - 0.6 * I, .thickness = 0.3}, air = {.eta = 1, .thickness = 7};
    KellerMedium film = {.eta = 6.31, .thickness = 1e-12};
    KellerVec3 down = v3(0.8, 0, -0.6);
    KellerCVec3 e = {0.6, 3 * I, 0.8};
    double complex te, tm, instead = cexp(I * 73 * 0.3 * 0.6);
    keller_transmission(&wall, 0.6, 73, &te, &tm);
    for (int side = 1; side >= -1; side -= 2) {
        KellerVec3 up = v3(0, 0, side);
        KellerCVec3 s = keller_transmit_field(&wall, up, down, 73, e);
        assert_true(cabs(s.x - 0.6 * tm * instead) < 1e-15 && cabs(s.y - 3 * I * te * instead) < 1e-15 &&
                    cabs(s.z - 0.8 * tm * instead) < 1e-15);
        s = keller_transmit_field(&air, up, down, 73, e);
        assert_true(cabs(s.x - e.x) + cabs(s.y - e.y) + cabs(s.z - e.z) < 1e-12);
        s = keller_transmit_field(&film, up, down, 73, e);
        assert_true(cabs(s.x - e.x) + cabs(s.y - e.y) + cabs(s.z - e.z) < 1e-8);
        const KellerMedium *const nothing[] = {&metal, &half_space};
        for (int i = 0; i < 2; i++) {
            s = keller_transmit_field(nothing[i], up, down, 73, e);
            assert_true(s.x == 0 && s.y == 0 && s.z == 0);
        }
    }
    keller_transmission(&wall, 1, 73, &te, &tm);
    instead = cexp(I * 73 * 0.3);
    for (double tilt = 0; tilt < 1e-7; tilt = tilt == 0 ? 1e-17 : tilt * 10) { /* normal incidence, exactly and nearly */
        KellerCVec3 s = keller_transmit_field(&wall, v3(0, 0, 1), v3_unit(v3(tilt, -tilt, -1)), 73, (KellerCVec3){0.6, -0.8, 0});
        assert_true(cabs(s.x - 0.6 * te * instead) < 1e-7 && cabs(s.y + 0.8 * te * instead) < 1e-7);
    }
}

/* ---- diffraction ------------------------------------------------------------------------------------------------ */

static void transition(void **state)
{
    (void)state;
    Table t;
    assert_true(table_open(&t, "c_F_transition.csv", false));
    int rows = 0;
    for (; table_next(&t); rows++) {
        double complex f = column(&t, "F");
        double x = table_number(&t, "x"), off = cabs(keller_transition(x) - f);
        if (!(off <= 5e-16 * cabs(f))) fail_msg("F(%g): off by %g", x, off);
    }
    assert_int_equal(rows, 43);
    assert_true(keller_transition(2e8) == 1 + I * 2.5e-9);
    assert_true(keller_transition(INFINITY) == 1);
    assert_true(keller_transition(0) == 0);
}

/* Polynomials against the Faddeeva function, which is the less exact of the two, everywhere; and where two polynomials meet, y = r/(r + 2)
 * at eighths, x = r^2 = (2 y/(1 - y))^2, and where the asymptotic series begins, one goes over into the next. */
static void transition_everywhere(void **state)
{
    (void)state;
    double worst = 0;
    for (int i = 0; i <= 40000; i++) {
        double x = pow(10, -18 + 36.0 * i / 40000), off = cabs(keller_transition(x) / transition_by_faddeeva(x) - 1);
        worst = fmax(worst, off);
    }
    print_message("# F by polynomials and by Faddeeva's function: within %.1e\n", worst);
    assert_true(worst < 2e-14);
    double x[8] = {1e8};
    for (int i = 1; i < 8; i++) x[i] = pow(2 * (i / 8.0) / (1 - i / 8.0), 2);
    for (int i = 0; i < 8; i++) {
        double complex below = keller_transition(x[i] * (1 - 1e-15)), above = keller_transition(x[i] * (1 + 1e-15));
        assert_true(cabs(above - below) < 2e-15);
    }
}

static void check_terms(bool full)
{
    Table t;
    if (!table_open(&t, "c_utd.csv", full)) skip();
    int rows = 0;
    double worst = 0;
    double complex one_side[4] = {0, 0, 0, 0};
    while (table_next(&t)) {
        double beta0 = table_number(&t, "beta0_deg") * M_PI / 180, L = table_number(&t, "L");
        double n = table_number(&t, "n"), k = table_number(&t, "k"), side = table_number(&t, "side");
        double phi = table_number(&t, "phi_deg") * M_PI / 180, phi_in = table_number(&t, "phip_deg") * M_PI / 180;
        double complex d[4], expected[4];
        double size = 0;
        keller_utd_terms(n, phi, phi_in, sin(beta0), k, L, d);
        for (int i = 0; i < 4; i++) {
            char name[8];
            snprintf(name, sizeof name, "D%d", i + 1);
            expected[i] = column(&t, name);
            size = fmax(size, cabs(expected[i]));
        }
        for (int i = 0; i < 4; i++) {
            if (side == 0) {
                worst = fmax(worst, cabs(d[i] - expected[i]) / size);
            } else if (side == -1) {
                /* the pair of rows holds both limits; on the pole the mean of them */
                worst = fmax(worst, cabs(d[i] - 0.5 * (expected[i] + one_side[i])) / size);
            }
            one_side[i] = expected[i];
        }
        if (worst > 1e-13) fail_msg("%s: off by %g", t.line, worst);
        if (side != 0) {
            /* the limits, approached from 1e-8 rad at either side: D varies there with (2 k L)^(1/2) n eps; which
             * side of phi that is depends on the term, so both orders will do for all terms at once but no other */
            double complex below[4], above[4];
            keller_utd_terms(n, phi - 1e-8, phi_in, sin(beta0), k, L, below);
            keller_utd_terms(n, phi + 1e-8, phi_in, sin(beta0), k, L, above);
            for (int i = 0; i < 4; i++)
                assert_true(fmin(cabs(below[i] - expected[i]), cabs(above[i] - expected[i])) < 1e-6 * size);
        }
        rows++;
    }
    assert_int_equal(rows, 243);
}

static void terms(void **state)
{
    (void)state;
    check_terms(false);
}
static void terms_full(void **state)
{
    (void)state;
    check_terms(true);
}

/* Within KELLER_BOUNDARY_ANGLE of a pole the singular term is 0, just outside it is its one-sided limit:
 * |D| = n sqrt(2 pi k L)/(2 n sqrt(2 pi k)) = sqrt(L)/2. Incident boundary: phi - phi' = pi, the pole of D2. */
static void boundary_angle(void **state)
{
    (void)state;
    double complex d[4];
    for (int side = -1; side <= 1; side += 2) {
        keller_utd_terms(1.5, 1 + M_PI + side * 0.9e-9, 1, 1, 20, 1.44, d);
        assert_true(d[1] == 0);
        keller_utd_terms(1.5, 1 + M_PI + side * 1.1e-9, 1, 1, 20, 1.44, d);
        /* beyond the boundary (phi larger) D2 restores the field, as the minus sign of D and E_d = +D E say */
        assert_true(cabs(d[1] - side * 0.6) < 1e-6);
        assert_true(cabs(d[0]) < 0.2);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(itu_constants),
        cmocka_unit_test(itu_table),
        cmocka_unit_test(itu_locale),
        cmocka_unit_test(material_errors),
        cmocka_unit_test(constant_and_conductor),
        cmocka_unit_test(fresnel),
        cmocka_unit_test(fresnel_full),
        cmocka_unit_test(slab_energy),
        cmocka_unit_test(limits_of_slabs),
        cmocka_unit_test(reflected_field),
        cmocka_unit_test(transmitted_field),
        cmocka_unit_test(transition), cmocka_unit_test(transition_everywhere),
        cmocka_unit_test(terms),
        cmocka_unit_test(terms_full),
        cmocka_unit_test(boundary_angle),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
