/* Fields that vanish at an edge, but not beside it: antennas with a null there, reflections at Brewster's angle. The truth is the exact
 * field of a point source at a wedge, taken at two places of the source. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "../stability/harness.h"
#include "../stability/scenes.h"
#include "keller/wave.h"

static const double degree = M_PI / 180;

/* ---- the exact field ------------------------------------------------------------------------------------------------- */

typedef struct {
    double n, k, rho, phi;      /* of the receiver, m and rad */
} Setting;

/* e^{-jkR}/(4 pi R) */
static double complex point_source(double k, double complex R) { return cexp(-I * k * R) / (4 * M_PI * R); }

/* ../shared/truth: what edges add to the images, for the source's image at the angle psi from the receiver, by an integral over real
 * t; here from t = x to x - j 0.8 tanh 1.2x, where its integrand falls and does not oscillate. Its poles are on the imaginary axis. */
static double complex edge_integral(const Setting *s, double rho_in, double psi)
{
    enum { STEPS = 600 };
    const double far = 4;
    double complex sum = 0;
    for (int i = 0; i < STEPS; i++) {
        double v = (i + 0.5) / STEPS, x = far * v * v * v, h = 3 * far * v * v / STEPS, y = tanh(1.2 * x); /* denser near the poles */
        double complex t = x - 0.8 * I * y, dt = 1 - 0.96 * I * (1 - y * y);
        double complex R = csqrt(s->rho * s->rho + rho_in * rho_in + 2 * s->rho * rho_in * ccosh(t));
        for (int side = -1; side <= 1; side += 2) {
            double a = (M_PI + side * psi) / s->n;
            sum += h * dt * sin(a) / (ccosh(t / s->n) - cos(a)) * point_source(s->k, R);
        }
    }
    return -sum / (2 * M_PI * s->n);
}

/* What the edge adds to images for a point source in the receiver's plane across it. sign: -1 soft, 1 hard. */
static double complex diffracted(const Setting *s, int sign, double rho_in, double phi_in)
{
    return edge_integral(s, rho_in, s->phi - phi_in) + sign * edge_integral(s, rho_in, s->phi + phi_in);
}

static double complex images(const Setting *s, int sign, double rho_in, double phi_in)
{
    double complex u = 0;
    for (int image = 0; image < 2; image++)
        for (int N = -2; N <= 2; N++) {
            double a = (image ? s->phi + phi_in : s->phi - phi_in) + 2 * M_PI * s->n * N;
            double R = sqrt(s->rho * s->rho + rho_in * rho_in - 2 * s->rho * rho_in * cos(a));
            if (fabs(a) < M_PI) u += (image ? sign : 1) * point_source(s->k, R);
        }
    return u;
}

/* The whole is smooth across the boundary where the images jump by half of it: its third differences are small. */
static void truth(void **state)
{
    (void)state;
    for (int sign = -1; sign <= 1; sign += 2)
        for (double n = 1.2; n < 2; n += 0.1) {
            double complex third = 0;
            double size = 0;
            static const int weight[4] = {-1, 3, -3, 1};
            for (int i = 0; i < 4; i++) {
                Setting s = {n, 20, 3, 0.2 + M_PI + (2 * i - 3) * 0.015};
                double complex u = diffracted(&s, sign, 2.5, 0.2) + images(&s, sign, 2.5, 0.2);
                third += weight[i] * u;
                size = fmax(size, cabs(u));
            }
            if (!(cabs(third) < 0.01 * size)) fail_msg("n %g: %g", n, cabs(third) / size);
        }
}

/* ---- scenes ---------------------------------------------------------------------------------------------------------- */

static KellerVec3 around(double r, double phi) { return v3(r * cos(phi), r * sin(phi), 0); }

/* Faces from the z axis at phi = 0 and n pi. */
static KellerScene wedge_scene(double n, uint32_t material)
{
    KellerSoup soup = soup_new();
    soup.materials[material].thickness = 0;
    soup_object(&soup, "wedge");
    for (int i = 0; i < (n < 2 ? 2 : 1); i++) {
        KellerVec3 far = around(400, i * n * M_PI);
        soup_quad(&soup, v3(0, 0, -300), v3(far.x, far.y, -300), v3(far.x, far.y, 300), v3(0, 0, 300), material);
    }
    KellerScene scene = scene_of(&soup);
    soup_release(&soup);
    return scene;
}

typedef struct {
    double complex with, without; /* slopes */
} Gain;

/* The sum over all paths by way of the edge of the gain, and of antennas times transfer alone. */
static Gain gain_of(const KellerScene *scene, const Run *run)
{
    FoundPaths found = run_simulation(scene, run);
    const KellerAntenna *a = &run->antenna, *b = run->rx_antenna ? run->rx_antenna : a;
    double k = 2 * M_PI * run->frequency[0] / KELLER_LIGHT_SPEED;
    Gain g = {0, 0};
    for (size_t i = 0; i < found.count; i++) {
        const Found *p = &found.path[i];
        bool near = true, bends = false;
        for (uint32_t j = 0; j < p->count; j++) {
            near = near && v3_norm(p->position[j]) < 100;
            bends = bends || p->step[j].kind == KELLER_DIFFRACTION;
        }
        if (!near || !bends) continue;
        double complex t[2], r[2];
        KellerVec3 d[2];
        for (int e = 0; e < 2; e++) {
            const double *angles = e ? p->arrival : p->departure;
            d[e] = v3(sin(angles[0]) * cos(angles[1]), sin(angles[0]) * sin(angles[1]), cos(angles[0]));
        }
        keller_antenna_field(a, run->orientation[0], d[0], &t[0], &t[1]);
        keller_antenna_field(b, run->orientation[1], d[1], &r[0], &r[1]);
        const double complex *m = p->transfer[0];
        g.with += p->gain[0];
        g.without += (r[0] * (m[0] * t[0] + m[1] * t[1]) + r[1] * (m[2] * t[0] + m[3] * t[1])) *
                     keller_array_factor(a, run->orientation[0], d[0], k) * keller_array_factor(b, run->orientation[1], d[1], k);
    }
    found_free(&found);
    return g;
}

static double decibels(double x) { return 20 * log10(x); }

/* On a boundary of one of two sources that are some radians apart, and not of the other. */
static bool between_elements(const Setting *s, double phi_in, double apart)
{
    double off[4] = {s->phi - phi_in - M_PI, s->phi - phi_in + M_PI, s->phi + phi_in - M_PI, s->phi + phi_in - (2 * s->n - 1) * M_PI};
    bool between = false;
    for (int i = 0; i < 4; i++) between = between || fabs(off[i]) < apart;
    return between;
}

/* Two elements in opposite phase, a twentieth of a wavelength off the middle across the ray to the edge: nothing goes to the edge. All
 * around, against the difference of two exact fields, over the largest field that the pair makes at that distance without the wedge. */
static void pair_with_a_null(void **state)
{
    (void)state;
    const double ns[3] = {2, 1.5, 4.0 / 3}, rho_in = 3, phi_in = 50 * degree;
    for (int c = 0; c < 3; c++)
        for (int hard = 0; hard < 2; hard++)
            for (int f = 0; f < 2; f++) {
                KellerScene scene = wedge_scene(ns[c], CONDUCTOR);
                double frequency = f ? 3e9 : 0.5e9, wave = KELLER_LIGHT_SPEED / frequency, k = 2 * M_PI / wave, off = 0.05 * wave;
                KellerVec3 tx = around(rho_in, phi_in), across = v3(-sin(phi_in), cos(phi_in), 0);
                const KellerArrayElement elements[2] = {{v3_scale(across, off), 0}, {v3_scale(across, -off), M_PI}};
                const KellerAntenna one = {.pattern = KELLER_ANTENNA_ISOTROPIC,
                                           .polarization = hard ? KELLER_POLARIZATION_H : KELLER_POLARIZATION_V};
                double worst = 0, worst_without = 0, shadow = 0, worst_dark = 0;
                int dark = 0;
                for (int i = 1; i < 40; i++) {
                    Setting s = {ns[c], k, 2.2, i / 40.0 * ns[c] * M_PI + 0.003};
                    KellerVec3 rx = around(s.rho, s.phi);
                    double turn = atan2(off, rho_in), away = hypot(off, rho_in);
                    if (between_elements(&s, phi_in, 2 * turn)) continue;
                    Run run = run_new(&tx, 1, &rx, 0, 1, 1);
                    run.frequency[0] = frequency;
                    run.antenna = one;
                    run.antenna.element_count = 2;
                    run.antenna.elements = elements;
                    run.rx_antenna = &one;
                    double complex u = wave * M_SQRT1_2 * (diffracted(&s, hard ? 1 : -1, away, phi_in + turn) -
                                                           diffracted(&s, hard ? 1 : -1, away, phi_in - turn));
                    if (hard) u = -u;
                    double most = wave / (4 * M_PI * (rho_in + s.rho)) * M_SQRT2 * sin(k * off);
                    Gain g = gain_of(&scene, &run);
                    worst = fmax(worst, cabs(g.with - u) / most);
                    worst_without = fmax(worst_without, cabs(g.without - u) / most);
                    if (s.phi > phi_in + M_PI) {
                        shadow = fmax(shadow, fabs(decibels(cabs(g.with / u))));
                        worst_dark = fmax(worst_dark, cabs(g.without) / most);
                        dark++;
                    }
                }
                print_message("# n %.3f, %s, k %.0f: error %.1f dB of the largest field, without slopes %.1f; in the shadow %.2f dB of "
                              "the level\n", ns[c], hard ? "hard" : "soft", k, decibels(worst), decibels(worst_without), shadow);
                assert_true(dark > 0 && worst_dark < 1e-12); /* without slopes there is no field in the shadow at all */
                assert_true(decibels(worst) < (f ? -85 : -62) && decibels(worst_without) > (f ? -40 : -29));
                assert_true(shadow < (f ? 0.02 : 0.1));
                keller_scene_free(&scene);
            }
}

/* The same from the derivative of the exact field, for a dipole that points at the edge, at either end: H across, as the current has it.
 * A dipole along a has the pattern of a difference across: sqrt(3/2) times the sine of the angle from its axis. */
static void dipole_that_points_at_the_edge(void **state)
{
    (void)state;
    const double frequency = 1e9, wave = KELLER_LIGHT_SPEED / frequency, k = 2 * M_PI / wave, rho_in = 3, phi_in = 50 * degree, h = 1e-3;
    KellerScene scene = wedge_scene(1.5, CONDUCTOR);
    const KellerAntenna dipole = {.pattern = KELLER_ANTENNA_DIPOLE}, other = {.polarization = KELLER_POLARIZATION_H};
    for (int way = 0; way < 2; way++)
        for (double phi = 232 * degree; phi < 268 * degree; phi += 4 * degree) {
            Setting s = {1.5, k, 2.2, phi};
            KellerVec3 tx = around(rho_in, phi_in), rx = around(s.rho, phi);
            Run run = way ? run_new(&rx, 1, &tx, 0, 1, 1) : run_new(&tx, 1, &rx, 0, 1, 1);
            run.frequency[0] = frequency;
            run.antenna = way ? other : dipole;
            run.rx_antenna = way ? &dipole : &other;
            run.orientation[way][0] = phi_in;
            run.orientation[way][1] = M_PI / 2; /* its axis is horizontal, away from the edge */
            double complex u = (diffracted(&s, 1, rho_in, phi_in + h) - diffracted(&s, 1, rho_in, phi_in - h)) / (2 * h);
            u *= sqrt(1.5) * wave / (I * k * rho_in);
            Gain g = gain_of(&scene, &run);
            assert_true(fabs(decibels(cabs(g.with / u))) < 0.05 && fabs(fabs(creal(g.with / u)) - 1) < 0.01);
            assert_true(cabs(g.without) < 1e-9 * cabs(u));
        }
    keller_scene_free(&scene);
}

/* A wave that a wall of eta = 4, without loss, sends to an edge at Brewster's angle, tan = 2: what is left there is the change of the
 * coefficient from ray to ray, times the derivative of the exact field of the image. Either way round. */
static void brewster(void **state)
{
    (void)state;
    const double frequency = 1e9, wave = KELLER_LIGHT_SPEED / frequency, k = 2 * M_PI / wave, angle = atan(2), h = 1e-4;
    const double rho_in = 14, phi_in = M_PI - angle;
    KellerSoup soup = soup_new();
    soup.materials[GLASS].kind = KELLER_MATERIAL_CONSTANT;
    soup.materials[GLASS].permittivity = 4;
    soup.materials[GLASS].conductivity = 0;
    soup.materials[GLASS].thickness = 0;
    soup_object(&soup, "screen");
    soup_quad(&soup, v3(0, 0, -300), v3(400, 0, -300), v3(400, 0, 300), v3(0, 0, 300), CONDUCTOR);
    soup_object(&soup, "wall");
    soup_quad(&soup, v3(-4, -500, -300), v3(-4, 500, -300), v3(-4, 500, 300), v3(-4, -500, 300), GLASS);
    KellerScene scene = scene_of(&soup);
    Setting s = {2, k, 3, 320 * degree};
    KellerVec3 image = around(rho_in, phi_in), tx = v3(-8 - image.x, image.y, 0), rx = around(s.rho, s.phi);
    KellerMedium glass = {.eta = 4};
    double complex te, more, less, none;
    keller_reflection(&glass, cos(angle), k, &te, &none);
    keller_reflection(&glass, cos(angle + h), k, &te, &more);
    keller_reflection(&glass, cos(angle - h), k, &te, &less);
    assert_true(cabs(none) < 1e-12);
    double complex u = (diffracted(&s, 1, rho_in, phi_in + h) - diffracted(&s, 1, rho_in, phi_in - h)) / (2 * h);
    u *= (more - less) / (2 * h) * wave / (I * k * rho_in);
    for (int way = 0; way < 2; way++) {
        Run run = way ? run_new(&rx, 1, &tx, 1, 1, 2) : run_new(&tx, 1, &rx, 1, 1, 2);
        run.frequency[0] = frequency;
        run.antenna.polarization = KELLER_POLARIZATION_H;
        FoundPaths found = run_simulation(&scene, &run);
        int seen = 0;
        for (size_t i = 0; i < found.count; i++) {
            const Found *p = &found.path[i];
            if (p->count != 2 || fabs(p->length - rho_in - s.rho) > 1e-9) continue;
            seen++;
            assert_true(fabs(decibels(cabs(p->gain[0] / u))) < 0.05 && fabs(fabs(creal(p->gain[0] / u)) - 1) < 0.01);
        }
        assert_int_equal(seen, 1);
        found_free(&found);
    }
    keller_scene_free(&scene);
    soup_release(&soup);
}

/* Over two ridges, with a pair whose null is towards the first: against the difference of two sources, each traced by itself. */
static void chain_with_a_null(void **state)
{
    (void)state;
    const double frequency = 1e9, wave = KELLER_LIGHT_SPEED / frequency, off = 0.01 * wave;
    KellerSoup soup = soup_new();
    for (int i = 0; i < 2; i++) {
        soup_object(&soup, "ridge");
        for (int side = -1; side <= 1; side += 2)
            soup_quad(&soup, v3(5 * i, -300, 0), v3(5 * i, 300, 0), v3(5 * i + side * 100, 300, -400), v3(5 * i + side * 100, -300, -400),
                      CONDUCTOR);
    }
    KellerScene scene = scene_of(&soup);
    const double heights[3] = {-1.5, -0.2, -1e-3}; /* of the source: from far out of the zone of the first edge to its middle */
    for (int hard = 0; hard < 2; hard++)
        for (int way = 0; way < 2; way++)
            for (int i = 0; i < 3; i++) {
                KellerVec3 at = v3(-6, 0, heights[i]), to = v3(12, 0, -1);
                KellerVec3 across = v3_unit(v3(heights[i], 0, 6));
                const KellerArrayElement elements[2] = {{v3_scale(across, off), 0}, {v3_scale(across, -off), M_PI}};
                const KellerAntenna one = {.polarization = hard ? KELLER_POLARIZATION_V : KELLER_POLARIZATION_H};
                KellerAntenna pair = one;
                pair.element_count = 2;
                pair.elements = elements;
                Run run = way ? run_new(&to, 1, &at, 0, 2, 2) : run_new(&at, 1, &to, 0, 2, 2);
                run.frequency[0] = frequency;
                run.antenna = way ? one : pair;
                run.rx_antenna = way ? &pair : &one;
                Gain g = gain_of(&scene, &run);
                double complex u = 0;
                for (int side = 1; side >= -1; side -= 2) {
                    KellerVec3 moved = v3_madd(at, across, side * off);
                    Run single = run;
                    if (way) single.rx = &moved;
                    else single.tx = &moved;
                    single.antenna = one;
                    single.rx_antenna = NULL;
                    u += side * M_SQRT1_2 * gain_of(&scene, &single).with;
                }
                double wrong = cabs(g.with - u) / cabs(u), without = cabs(g.without - u) / cabs(u);
                print_message("# %s, source at %g: %.4f of the field, without slopes %.4f\n", hard ? "hard" : "soft", heights[i], wrong,
                              without);
                if (!(wrong < 0.01 && without > 0.9)) fail_msg("off by %g", wrong);
            }
    keller_scene_free(&scene);
    soup_release(&soup);
}

/* Nothing jumps where a path over a corner of concrete begins or ends, whatever the antennas do there. */
static void no_jumps(void **state)
{
    (void)state;
    const double phi_in = 40 * degree, boundary[2] = {phi_in + M_PI, M_PI - phi_in}, hair = 3e-8; /* rad */
    KellerScene scene = wedge_scene(1.5, CONCRETE);
    const KellerVec3 tx = around(9, phi_in);
    for (int b = 0; b < 2; b++)
        for (int tilt = 0; tilt < 3; tilt++) {
            double complex at[4];
            for (int i = 0; i < 4; i++) {
                double off = (i % 2 ? 2 : 1) * (i < 2 ? -hair : hair);
                KellerVec3 rx = around(12, boundary[b] + off);
                rx.z = 2;
                Run run = run_new(&tx, 1, &rx, 1, 1, 2);
                run.antenna.pattern = KELLER_ANTENNA_DIPOLE;
                run.orientation[0][0] = phi_in;
                run.orientation[0][1] = 1.4 - 0.5 * tilt;
                run.orientation[1][2] = 0.8;
                FoundPaths found = run_simulation(&scene, &run);
                at[i] = 0;
                for (size_t j = 0; j < found.count; j++)
                    if (found.path[j].length < 100) at[i] += found.path[j].gain[0];
                found_free(&found);
            }
            double free_field = KELLER_LIGHT_SPEED / 3.5e9 / (4 * M_PI * 21);
            double jump = cabs(2 * (at[2] - at[0]) - (at[3] - at[1])) / free_field;
            if (!(jump < 1e-8)) fail_msg("boundary %d, tilt %d: %g", b, tilt, jump);
        }
    keller_scene_free(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(truth), cmocka_unit_test(pair_with_a_null),
                                       cmocka_unit_test(dipole_that_points_at_the_edge), cmocka_unit_test(brewster),
                                       cmocka_unit_test(chain_with_a_null), cmocka_unit_test(no_jumps)};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
