/* Total fields around perfectly conducting wedges against exact solutions. Geometrical optics is written down here by
 * images (conductor.h); what is tested is keller_utd_terms and keller_diffract_field. */
#include <gsl/gsl_errno.h>
#include <gsl/gsl_sf_bessel.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "../truth/table.h"
#include "conductor.h"
#include "keller/wave.h"

static const double degree = M_PI / 180;

/* The vector function read as scalars: no cross-polarisation at a conductor, nothing along the ray. */
static Scalars diffracted(double n, double phi_in, double phi, double beta0, double s_in, double s, double k)
{
    Scalars d = wedge_diffracted(n, phi_in, phi, beta0, s_in, s, k);
    assert_true(d.stray < 1e-12);
    return d;
}

/* The same from the four scalar terms. */
static Scalars diffracted_terms(double n, double phi_in, double phi, double beta0, double s_in, double s, double k)
{
    double complex d[4];
    double sine = sin(beta0);
    keller_utd_terms(n, phi, phi_in, sine, k, sine * sine / (1 / s + 1 / s_in), d);
    double spreading = sqrt(1 / (s * (1 + s / s_in)));
    return (Scalars){spreading * (d[0] + d[1] - (d[2] + d[3])), spreading * (d[0] + d[1] + d[2] + d[3]), 0};
}

/* rho_in infinite: a plane wave. */
static WedgeSetting setting(double n, double phi_in, double k, double rho_in, double rho, double z)
{
    return (WedgeSetting){isinf(rho_in) ? SOURCE_PLANE : SOURCE_POINT, n, k, phi_in, rho_in, rho, z};
}

static Scalars total(double n, double phi_in, double phi, double k, double rho_in, double rho, double z, bool terms)
{
    WedgeSetting w = setting(n, phi_in, k, rho_in, rho, z);
    Scalars u = wedge_total(&w, phi);
    assert_true(u.stray < 1e-12);
    if (!terms) return u;
    assert_true(w.kind == SOURCE_PLANE);
    Scalars d = diffracted_terms(n, phi_in, phi, M_PI / 2, rho_in, rho, k);
    double complex phase = cexp(-I * k * rho);
    u = wedge_optics(&w, phi);
    return (Scalars){u.soft + d.soft * phase, u.hard + d.hard * phase, 0};
}

static Scalars exact(const Table *t)
{
    return (Scalars){table_number(t, "soft_re") + I * table_number(t, "soft_im"),
                     table_number(t, "hard_re") + I * table_number(t, "hard_im"), 0};
}

/* For a plane wave at a half-plane the uniform theory is the Sommerfeld solution itself, at every distance. */
static void check_halfplane(bool full)
{
    Table t;
    if (!table_open(&t, "a_halfplane.csv", full)) skip();
    int rows = 0;
    while (table_next(&t)) {
        double kr = table_number(&t, "kr"), phi_in = table_number(&t, "phip_deg") * degree;
        double phi = table_number(&t, "phi_deg") * degree;
        Scalars e = exact(&t);
        for (int terms = 0; terms < 2; terms++) {
            Scalars u = total(2, phi_in, phi, 1, INFINITY, kr, 0, terms);
            if (cabs(u.soft - e.soft) > 1e-12 || cabs(u.hard - e.hard) > 1e-12)
                fail_msg("kr %g phi' %g phi %g: off by %g soft, %g hard", kr, phi_in / degree, phi / degree,
                         cabs(u.soft - e.soft), cabs(u.hard - e.hard));
        }
        rows++;
    }
    assert_true(rows >= 300);
}

static void halfplane(void **state)
{
    (void)state;
    check_halfplane(false);
}
static void halfplane_full(void **state)
{
    (void)state;
    check_halfplane(true);
}

/* UTD's own largest error (relative to the incident field, soft and hard) in a row of an error table that agrees in
 * two columns of numbers; false where there is none. */
static bool own_error(const char *table, bool full, double n, const char *column, double value, const char *z_column, double z,
                      const char *soft, const char *hard, double error[2])
{
    Table t;
    assert_true(table_open(&t, table, full));
    bool found = false;
    while (table_next(&t)) {
        if (found || table_number(&t, "n") != n || table_number(&t, column) != value) continue;
        if (z_column && table_number(&t, z_column) != z) continue;
        error[0] = pow(10, table_number(&t, soft) / 20);
        error[1] = pow(10, table_number(&t, hard) / 20);
        found = true;
    }
    return found;
}

/* The tables print the theory's own error to 0.01 dB. */
#define ROUNDED 1.0012

/* In every cell no more than the theory's own error, from kr = 1. */
static void check_wedge_plane(bool full)
{
    Table t;
    if (!table_open(&t, "b_wedge_plane.csv", full)) skip();
    int rows = 0;
    double last_n = 0, last_kr = 0, bound[2] = {0, 0};
    while (table_next(&t)) {
        double n = table_number(&t, "n"), kr = table_number(&t, "kr");
        if (n != last_n || kr != last_kr)
            assert_true(own_error("b_utd_error_2d.csv", false, n, "kr", kr, NULL, 0, "max_err_dB_re_inc_soft",
                                  "max_err_dB_re_inc_hard", bound));
        last_n = n;
        last_kr = kr;
        double phi_in = table_number(&t, "phip_deg") * degree, phi = table_number(&t, "phi_deg") * degree;
        Scalars e = exact(&t), u = total(n, phi_in, phi, 1, INFINITY, kr, 0, false);
        if (cabs(u.soft - e.soft) > ROUNDED * bound[0] || cabs(u.hard - e.hard) > ROUNDED * bound[1])
            fail_msg("n %g kr %g phi' %g phi %g: off by %g of %g soft, %g of %g hard", n, kr, phi_in / degree,
                     phi / degree, cabs(u.soft - e.soft), bound[0], cabs(u.hard - e.hard), bound[1]);
        rows++;
    }
    assert_true(rows >= 270);
}

static void wedge_plane(void **state)
{
    (void)state;
    check_wedge_plane(false);
}
static void wedge_plane_full(void **state)
{
    (void)state;
    check_wedge_plane(true);
}

/* The same for a line source, two distances from the edge. */
static void wedge_line_full(void **state)
{
    (void)state;
    Table t;
    if (!table_open(&t, "b_wedge_line.csv", true)) skip();
    int rows = 0;
    double key[3] = {0, 0, 0}, bound[2] = {0, 0};
    while (table_next(&t)) {
        WedgeSetting w = {.kind = SOURCE_LINE, .n = table_number(&t, "n"), .k = 1, .rho = table_number(&t, "kr"),
                          .rho_in = table_number(&t, "krp"), .phi_in = table_number(&t, "phip_deg") * degree};
        if (w.n != key[0] || w.rho != key[1] || w.rho_in != key[2])
            assert_true(own_error("b_utd_error_2d.csv", true, w.n, "kr", w.rho, "krp", w.rho_in, "max_err_dB_re_inc_soft",
                                  "max_err_dB_re_inc_hard", bound));
        key[0] = w.n;
        key[1] = w.rho;
        key[2] = w.rho_in;
        double phi = table_number(&t, "phi_deg") * degree, incident = wedge_incident(&w);
        Scalars e = exact(&t), u = wedge_total(&w, phi);
        if (cabs(u.soft - e.soft) > ROUNDED * bound[0] * incident || cabs(u.hard - e.hard) > ROUNDED * bound[1] * incident)
            fail_msg("n %g kr %g kr' %g phi' %g phi %g: off by %g of %g soft, %g of %g hard", w.n, w.rho, w.rho_in,
                     w.phi_in / degree, phi / degree, cabs(u.soft - e.soft) / incident, bound[0],
                     cabs(u.hard - e.hard) / incident, bound[1]);
        rows++;
    }
    assert_int_equal(rows, 6448);
}

/* The same for a point source, at oblique incidence too; the incident field is that of the straightened path. */
static void check_wedge_point(bool full)
{
    Table t;
    if (!table_open(&t, "b_point3d.csv", full)) skip();
    int rows = 0;
    double key[3] = {0, 0, 0}, bound[2] = {0, 0};
    while (table_next(&t)) {
        double n = table_number(&t, "n"), k = table_number(&t, "k"), z = table_number(&t, "z");
        double rho_in = table_number(&t, "rhop"), rho = table_number(&t, "rho");
        if (n != key[0] || k != key[1] || z != key[2])
            assert_true(
                own_error("b_utd_error_3d.csv", false, n, "k", k, "z", z, "max_err_dB_soft", "max_err_dB_hard", bound));
        key[0] = n;
        key[1] = k;
        key[2] = z;
        double phi_in = table_number(&t, "phip_deg") * degree, phi = table_number(&t, "phi_deg") * degree;
        double incident = 1 / (4 * M_PI * hypot(rho + rho_in, z));
        Scalars e = exact(&t), u = total(n, phi_in, phi, k, rho_in, rho, z, false);
        if (cabs(u.soft - e.soft) > ROUNDED * bound[0] * incident || cabs(u.hard - e.hard) > ROUNDED * bound[1] * incident)
            fail_msg("n %g k %g z %g phi' %g phi %g: off by %g of %g soft, %g of %g hard", n, k, z, phi_in / degree,
                     phi / degree, cabs(u.soft - e.soft) / incident, bound[0], cabs(u.hard - e.hard) / incident,
                     bound[1]);
        rows++;
    }
    assert_true(rows >= 400);
}

static void wedge_point(void **state)
{
    (void)state;
    check_wedge_point(false);
}
static void wedge_point_full(void **state)
{
    (void)state;
    check_wedge_point(true);
}

/* Exact plane-wave solution of a sector of any n, U(psi) = (1/n) sum_m eps_m e^{j m pi/2n} J_{m/n}(kr) cos(m psi/n),
 * eps_0 = 1, else 2. J_nu(kr) falls faster than exponentially beyond nu = kr. */
enum { MOST_TERMS = 256 };

static int bessel_terms(double n, double kr, double complex term[MOST_TERMS])
{
    int m = 0;
    for (; m / n < kr + 60; m++) {
        gsl_sf_result j;
        int status = gsl_sf_bessel_Jnu_e(m / n, kr, &j);
        if (status != GSL_SUCCESS && status != GSL_EUNDRFLW) fail_msg("J_%g(%g): %s", m / n, kr, gsl_strerror(status));
        assert_true(m < MOST_TERMS);
        term[m] = (m == 0 ? 1 : 2) / n * j.val * cexp(I * (m * M_PI / (2 * n)));
    }
    return m;
}

static double complex bessel_sum(int count, const double complex term[MOST_TERMS], double n, double psi)
{
    double complex sum = 0;
    for (int m = 0; m < count; m++) sum += term[m] * cos(m * psi / n);
    return sum;
}

/* Largest error over the sector, exact boundaries included (pi and the angles of all images are whole degrees). */
static double largest_error(double n, double kr)
{
    double complex term[MOST_TERMS];
    int count = bessel_terms(n, kr, term), opening = (int)lround(180 * n);
    double largest = 0;
    for (int phi_in = 7; phi_in < opening; phi_in += 23)
        for (int phi = 0; phi <= opening; phi += opening > 60 ? 3 : 1) {
            double complex minus = bessel_sum(count, term, n, (phi - phi_in) * degree);
            double complex plus = bessel_sum(count, term, n, (phi + phi_in) * degree);
            Scalars u = total(n, phi_in * degree, phi * degree, 1, INFINITY, kr, 0, false);
            largest = fmax(largest, fmax(cabs(u.soft - (minus - plus)), cabs(u.hard - (minus + plus))));
        }
    return largest;
}

/* Sectors of any opening, those below pi with multiply reflected waves and their boundaries. The theory's error goes as
 * 1/kr with a constant that grows as the sector narrows (a second pole comes near); 0.1/n^2 is 1.1 to 2 times what is
 * found. A wrong pole is an error of 0.5 whatever kr. */
static void sectors(void **state)
{
    (void)state;
    gsl_set_error_handler_off();
    for (int opening = 50; opening <= 350; opening += 20)
        for (double kr = 10; kr < 100; kr *= 4) {
            double n = opening / 180.0, error = largest_error(n, kr);
            if (error > 0.1 / (n * n * kr)) fail_msg("n %g kr %g: off by %g", n, kr, error);
        }
}

/* 1/n whole: images alone solve the problem and the terms cancel. */
static void no_diffraction(void **state)
{
    (void)state;
    for (int m = 1; m <= 4; m++) {
        double n = 1.0 / m;
        for (double phi = 0; phi <= 1; phi += 0.125) {
            Scalars d = diffracted(n, 0.3 * n * M_PI, phi * n * M_PI, 1.1, 3, 2, 20);
            assert_true(cabs(d.soft) < 1e-13 && cabs(d.hard) < 1e-13);
        }
    }
}

/* Across every boundary of a half-plane, a 90 degree wedge and an inner sector the level changes by less than 0.01 dB
 * from one side to the other and to the boundary itself. 1e-7 rad to either side the true field changes by 1e-6 or so.
 * */
static void no_jumps(void **state)
{
    (void)state;
    static const double openings[] = {2, 1.5, 0.7};
    for (int i = 0; i < 3; i++) {
        double n = openings[i];
        int boundaries = 0;
        for (double part = 0.05; part < 1; part += 0.15) {
            double phi_in = part * n * M_PI;
            for (int sign = -1; sign <= 1; sign += 2)
                for (int image = -1; image <= 1; image++)
                    for (int side = -1; side <= 1; side += 2) {
                        double phi = side * M_PI + sign * phi_in + 2 * M_PI * n * image;
                        if (phi < 0.01 || phi > n * M_PI - 0.01) continue;
                        Scalars u[3];
                        for (int j = 0; j < 3; j++) u[j] = total(n, phi_in, phi + (j - 1) * 1e-7, 20, 3, 2, 2.5, false);
                        for (int j = 0; j < 3; j += 2) {
                            assert_true(fabs(20 * log10(cabs(u[j].soft) / cabs(u[1].soft))) < 0.01);
                            assert_true(fabs(20 * log10(cabs(u[j].hard) / cabs(u[1].hard))) < 0.01);
                        }
                        boundaries++;
                    }
        }
        assert_true(boundaries >= 7);
    }
}

/* ---- common mistakes ---------------------------------------------------------------------------------------------- */

typedef enum { CORRECT, F_IS_ONE, N_IS_ZERO, CONJUGATED, LONG_L, NO_SINE, PLANE_L } Mistake;

/* The sum of the terms with a mistake in it, hard, behind a unit field at the edge; s_in may be infinite. */
static double complex mistaken(Mistake mistake, double n, double phi_in, double phi, double beta0, double s_in, double s)
{
    double sine = sin(beta0), L = sine * sine / (1 / s + 1 / s_in);
    if (mistake == LONG_L) L = 1 / (1 / s + 1 / s_in);
    if (mistake == PLANE_L) L = s * sine * sine;
    double complex sum = 0, factor = -cexp(-I * M_PI / 4) / (2 * n * sqrt(2 * M_PI) * (mistake == NO_SINE ? 1 : sine));
    double beta[4] = {phi - phi_in, phi_in - phi, phi + phi_in, -phi - phi_in};
    for (int i = 0; i < 4; i++) {
        double angle = M_PI + beta[i], N = nearbyint(angle / (2 * M_PI * n)), off = angle - 2 * M_PI * n * N;
        if (fabs(off) < KELLER_BOUNDARY_ANGLE) continue;
        double half = mistake == N_IS_ZERO ? angle / 2 : off / 2;
        double complex F = mistake == F_IS_ONE ? 1 : keller_transition(2 * L * sin(half) * sin(half));
        sum += F / tan(off / (2 * n));
    }
    if (mistake == CONJUGATED) factor = conj(factor);
    return factor * sum * sqrt(1 / (s * (1 + s / s_in)));
}

/* What common mistakes cost (h_pitfalls.csv): the largest error of the hard field, relative to the incident one, is the
 * table's to its 0.1 dB, for what this program does and for the same formula with each mistake. */
static void pitfalls(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        Mistake mistake;
        bool oblique;
    } rows[] = {
        {"\"correct K-P, float64\"", CORRECT, false},
        {"F=1 (Keller GTD)", F_IS_ONE, false},
        {"N+-=0 always", N_IS_ZERO, false},
        {"wrong time convention of D only (conjugated e^{-j pi/4})", CONJUGATED, false},
        {"oblique (beta0=63.4deg) point source: correct", CORRECT, true},
        {"oblique (beta0=63.4deg) point source: L without sin^2(beta0)", LONG_L, true},
        {"oblique (beta0=63.4deg) point source: no 1/sin(beta0)", NO_SINE, true},
        {"oblique (beta0=63.4deg) point source: plane-wave L=s sin^2(beta0)", PLANE_L, true},
    };
    enum { ROWS = sizeof rows / sizeof *rows };
    double error[ROWS][3] = {{0}}, program[2][3] = {{0}};
    for (int oblique = 0; oblique < 2; oblique++) {
        Table t;
        if (!table_open(&t, oblique ? "b_point3d.csv" : "b_wedge_plane.csv", true)) skip();
        while (table_next(&t)) {
            double k = table_number(&t, oblique ? "k" : "kr");
            int at = k == 1 ? 0 : k == 10 ? 1 : k == 100 ? 2 : -1;
            if (at < 0 || (oblique && table_number(&t, "z") != 2.5)) continue;
            char boundary[16];
            bool on = *table_text(&t, "boundary", boundary, sizeof boundary) != '\0';
            if (oblique && on) continue;
            double n = table_number(&t, "n"), phi_in = table_number(&t, "phip_deg") * degree;
            double phi = table_number(&t, "phi_deg") * degree;
            double rho_in = oblique ? table_number(&t, "rhop") : INFINITY, z = oblique ? 2.5 : 0;
            double rho = oblique ? table_number(&t, "rho") : k;
            double beta0 = oblique ? atan2(rho + rho_in, z) : M_PI / 2, s = rho / sin(beta0), s_in = rho_in / sin(beta0);
            /* lengths in units of 1/k */
            double unit = oblique ? k : 1, incident = oblique ? 1 / (4 * M_PI * hypot(rho + rho_in, z)) : 1;
            double complex at_edge = oblique ? cexp(-I * k * s_in) / (4 * M_PI * s_in) : 1;
            double complex e = exact(&t).hard, go;
            WedgeSetting w = setting(n, phi_in, oblique ? k : 1, rho_in, rho, z);
            go = wedge_optics(&w, phi).hard;
            for (int r = 0; r < ROWS; r++) {
                if (rows[r].oblique != oblique) continue;
                double complex d = mistaken(rows[r].mistake, n, phi_in, phi, beta0, s_in * unit, s * unit);
                error[r][at] = fmax(error[r][at], cabs(go + d * at_edge * cexp(-I * unit * s) - e) / incident);
            }
            double complex u = total(n, phi_in, phi, oblique ? k : 1, rho_in, rho, z, false).hard;
            program[oblique][at] = fmax(program[oblique][at], cabs(u - e) / incident);
        }
    }
    Table t;
    assert_true(table_open(&t, "h_pitfalls.csv", true));
    int found = 0;
    while (table_next(&t)) {
        for (int r = 0; r < ROWS; r++) {
            size_t length = strlen(rows[r].name);
            if (strncmp(t.line, rows[r].name, length) != 0 || t.line[length] != ',') continue;
            double expected[6] = {NAN, NAN, NAN, NAN, NAN, NAN}; /* soft and hard by kr */
            char *at = t.line + length;
            for (int c = 0; c < 6 && *at == ','; c++) {
                char *end;
                double value = strtod(at + 1, &end);
                if (end > at + 1) expected[c] = value;
                at = end;
            }
            for (int c = 0; c < 3; c++) {
                assert_true(fabs(20 * log10(error[r][c]) - expected[2 * c + 1]) < 0.051);
                if (rows[r].mistake == CORRECT)
                    assert_true(fabs(20 * log10(program[rows[r].oblique][c]) - expected[2 * c + 1]) < 0.051);
            }
            found++;
        }
    }
    assert_int_equal(found, ROWS);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(halfplane),        cmocka_unit_test(halfplane_full), cmocka_unit_test(wedge_plane),
        cmocka_unit_test(wedge_plane_full), cmocka_unit_test(wedge_line_full), cmocka_unit_test(wedge_point),    cmocka_unit_test(wedge_point_full),
        cmocka_unit_test(sectors),          cmocka_unit_test(no_diffraction), cmocka_unit_test(no_jumps),
        cmocka_unit_test(pitfalls),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
