/* The vector field of a wedge of any material: reciprocity, continuity of the total field with reflected rays, the two
 * ways to look at one wedge, the limits. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "../truth/table.h"
#include "keller/wave.h"

static uint64_t seed;

/* xorshift64*, in [0, 1) */
static double random_unit(void)
{
    seed ^= seed >> 12;
    seed ^= seed << 25;
    seed ^= seed >> 27;
    return (double)((seed * 2685821657736338717u) >> 11) * 0x1p-53;
}

static double between(double a, double b) { return a + (b - a) * random_unit(); }

static KellerVec3 random_direction(void)
{
    double z = between(-1, 1), a = between(-M_PI, M_PI), r = sqrt(1 - z * z);
    return v3(r * cos(a), r * sin(a), z);
}

static KellerMedium random_medium(void)
{
    double kind = random_unit();
    KellerMedium medium = {.eta = between(1.5, 30) - I * between(0, 10)};
    medium.conductor = kind < 0.2;
    medium.thickness = kind > 0.6 ? between(0.003, 0.4) : 0;
    if (kind > 0.8) {
        medium.layer_count = 2;
        for (int i = 0; i < 2; i++) {
            medium.layers[i].eta = between(1.5, 30) - I * between(0, 10);
            medium.layers[i].thickness = medium.thickness / 2;
        }
    }
    if (fmod(kind, 0.2) > 0.15) medium.roughness = between(0, 0.01);
    return medium;
}

static const KellerWedgeModel models[] = {KELLER_WEDGE_RECIPROCAL, KELLER_WEDGE_LUEBBERS, KELLER_WEDGE_HOLM};

static KellerWedgeWave random_wedge(double n)
{
    KellerWedgeWave w = {.n = n, .direction = random_direction(), .medium = {random_medium(), random_medium()}};
    w.tangent0 = v3_unit(v3_cross(w.direction, random_direction()));
    w.normal0 = v3_cross(w.direction, w.tangent0);
    return w;
}

/* The unit vector at the azimuth phi of the wedge, beta0 from its edge. */
static KellerVec3 around(const KellerWedgeWave *w, double phi, double beta0)
{
    KellerVec3 radial = v3_add(v3_scale(w->tangent0, cos(phi)), v3_scale(w->normal0, sin(phi)));
    return v3_add(v3_scale(radial, sin(beta0)), v3_scale(w->direction, cos(beta0)));
}

static KellerCVec3 times(KellerVec3 v, double complex a) { return (KellerCVec3){a * v.x, a * v.y, a * v.z}; }
static KellerCVec3 sum(KellerCVec3 a, KellerCVec3 b) { return (KellerCVec3){a.x + b.x, a.y + b.y, a.z + b.z}; }
static double norm(KellerCVec3 a) { return sqrt(creal(a.x * conj(a.x) + a.y * conj(a.y) + a.z * conj(a.z))); }
static double distance(KellerCVec3 a, KellerCVec3 b) { return norm(sum(a, (KellerCVec3){-b.x, -b.y, -b.z})); }
static KellerVec3 axis(int i) { return v3(i == 0, i == 1, i == 2); }
static double complex component(KellerCVec3 e, int i) { return i == 0 ? e.x : i == 1 ? e.y : e.z; }

/* The 3x3 dyad of the whole way from a unit source at s_in to the receiver at s, without phase. */
static double dyad(const KellerWedgeWave *w, KellerVec3 in, KellerVec3 out, double s_in, double s, double k,
                   double complex d[3][3])
{
    double largest = 0;
    for (int j = 0; j < 3; j++) {
        KellerCVec3 e = keller_diffract_field(w, in, out, s_in, s, k, times(axis(j), 1 / s_in));
        for (int i = 0; i < 3; i++) {
            d[i][j] = component(e, i);
            largest = fmax(largest, cabs(d[i][j]));
        }
    }
    return largest;
}

/* D(in, out) = D(-out, -in)^T, so that any two antennas see the same |H| from either end: over random sectors,
 * materials and frames. */
static void reciprocity(void **state)
{
    (void)state;
    seed = 1;
    for (int i = 0; i < 3000; i++) {
        KellerWedgeWave w = random_wedge(between(0.2, 2));
        double beta0 = between(0.05, M_PI - 0.05), s_in = between(0.1, 50), s = between(0.1, 50), k = between(1, 600);
        KellerVec3 in = v3_scale(around(&w, between(0, w.n * M_PI), M_PI - beta0), -1);
        KellerVec3 out = around(&w, between(0, w.n * M_PI), beta0);
        double complex d[3][3], t[3][3];
        double size = dyad(&w, in, out, s_in, s, k, d);
        dyad(&w, v3_scale(out, -1), v3_scale(in, -1), s, s_in, k, t);
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                if (!(cabs(d[a][b] - t[b][a]) <= 1e-12 * size))
                    fail_msg("case %d, n %g: %g of %g", i, w.n, cabs(d[a][b] - t[b][a]), size);
    }
}

/* One wedge seen from its other face: edge turned over, faces exchanged. */
static void other_face(void **state)
{
    (void)state;
    seed = 2;
    for (int i = 0; i < 1000; i++) {
        KellerWedgeWave w = random_wedge(between(0.2, 2)), v;
        w.model = models[i % 2 ? 0 : 2]; /* Luebbers' faces have unlike parts */
        v = w;
        v.direction = v3_scale(w.direction, -1);
        v.tangent0 = around(&w, w.n * M_PI, M_PI / 2);
        v.normal0 = v3_cross(v.direction, v.tangent0);
        v.medium[0] = w.medium[1];
        v.medium[1] = w.medium[0];
        double beta0 = between(0.1, M_PI - 0.1);
        KellerVec3 in = v3_scale(around(&w, between(0, w.n * M_PI), M_PI - beta0), -1);
        KellerVec3 out = around(&w, between(0, w.n * M_PI), beta0);
        double complex d[3][3], t[3][3];
        double size = dyad(&w, in, out, 3, 4, 70, d);
        dyad(&v, in, out, 3, 4, 70, t);
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++) assert_true(cabs(d[a][b] - t[a][b]) <= 1e-11 * size);
    }
}

/* A source and a receiver around a wedge; the source radiates moment transverse to the ray, e^{-jkr}/r. */
typedef struct {
    KellerWedgeWave wedge;
    double phi_in, rho_in, rho, z, k;
    KellerVec3 moment;
} Setting;

static KellerVec3 place(const KellerWedgeWave *w, double phi, double rho, double z)
{
    return v3_add(v3_scale(around(w, phi, M_PI / 2), rho), v3_scale(w->direction, z));
}

static KellerCVec3 radiated(KellerVec3 moment, KellerVec3 d, double complex amplitude)
{
    return times(v3_madd(moment, d, -v3_dot(moment, d)), amplitude);
}

/* Geometrical optics with every sequence of alternating reflections: the image of the source by mirroring, its azimuth
 * a; the wave exists where |phi - a| < pi, on whichever side of it `side` says where that is a boundary. */
static KellerCVec3 optics(const Setting *t, double phi)
{
    const KellerWedgeWave *w = &t->wedge;
    KellerVec3 receiver = place(w, phi, t->rho, t->z);
    KellerVec3 normal[2] = {w->normal0, around(w, w->n * M_PI - M_PI / 2, M_PI / 2)};
    KellerCVec3 total = {0, 0, 0};
    for (int first = 0; first < 2; first++)
        for (int count = first; count < 12; count++) {
            KellerVec3 image = place(w, t->phi_in, t->rho_in, 0);
            double a = t->phi_in;
            for (int i = 0, face = first; i < count; i++, face = 1 - face) {
                image = v3_mirror_point(image, normal[face], 0);
                a = face == 0 ? -a : 2 * M_PI * w->n - a;
            }
            if (fabs(phi - a) > M_PI) continue;
            KellerVec3 leg[12];
            leg[count] = v3_unit(v3_sub(receiver, image));
            for (int i = count - 1, face = (first + count - 1) % 2; i >= 0; i--, face = 1 - face)
                leg[i] = v3_mirror_direction(leg[i + 1], normal[face]);
            double r = v3_distance(receiver, image);
            KellerCVec3 e = radiated(t->moment, leg[0], cexp(-I * t->k * r) / r);
            for (int i = 0, face = first; i < count; i++, face = 1 - face)
                e = keller_reflect_field(&w->medium[face], normal[face], leg[i], t->k, e);
            total = sum(total, e);
        }
    return total;
}

static KellerCVec3 total(const Setting *t, double phi)
{
    const KellerWedgeWave *w = &t->wedge;
    KellerVec3 source = place(w, t->phi_in, t->rho_in, 0), receiver = place(w, phi, t->rho, t->z);
    KellerVec3 edge = v3_scale(w->direction, t->z * t->rho_in / (t->rho_in + t->rho));
    double s_in = v3_distance(source, edge), s = v3_distance(edge, receiver);
    KellerVec3 in = v3_unit(v3_sub(edge, source)), out = v3_unit(v3_sub(receiver, edge));
    KellerCVec3 e = radiated(t->moment, in, cexp(-I * t->k * s_in) / s_in);
    e = keller_diffract_field(w, in, out, s_in, s, t->k, e);
    double complex phase = cexp(-I * t->k * s);
    e = (KellerCVec3){e.x * phase, e.y * phase, e.z * phase};
    return sum(e, optics(t, phi));
}

/* The limit of a field at the boundary phi from one side, by a straight line through two points; its second derivative
 * over the field is at most some (2 k rho)^2 < 3e6, so that the error is below 3e6 * 3 h^2 / 2 < 1e-7. */
static KellerCVec3 limit(KellerCVec3 (*field)(const Setting *, double), const Setting *t, double phi, double side)
{
    const double h = 1e-7;
    KellerCVec3 a = field(t, phi + side * h), b = field(t, phi + 3 * side * h);
    return (KellerCVec3){1.5 * a.x - 0.5 * b.x, 1.5 * a.y - 0.5 * b.y, 1.5 * a.z - 0.5 * b.z};
}

/* The total field is continuous across the boundary of every geometrical wave, whatever the faces are made of: the jump
 * is below 1e-6 of the incident field. Boundaries lie at phi = a +- pi, a the azimuth of an image. Returns how many
 * there were. */
static int check_boundaries(const Setting *t)
{
    double n = t->wedge.n, incident = 1 / hypot(t->rho + t->rho_in, t->z);
    int found = 0;
    for (int sign = -1; sign <= 1; sign += 2)
        for (int image = -6; image <= 6; image++)
            for (int side = -1; side <= 1; side += 2) {
                double phi = sign * t->phi_in + 2 * M_PI * n * image + side * M_PI;
                if (phi < 1e-3 || phi > n * M_PI - 1e-3) continue;
                double jump = distance(limit(total, t, phi, -1), limit(total, t, phi, 1)) / incident;
                if (!(jump < 1e-6)) fail_msg("n %g phi' %g phi %g: jump %g", n, t->phi_in, phi, jump);
                /* and there was something to be made up for */
                double optical = distance(limit(optics, t, phi, -1), limit(optics, t, phi, 1)) / incident;
                found += optical > 1e-3;
            }
    return found;
}

static void continuity(void **state)
{
    (void)state;
    seed = 3;
    int found[3] = {0, 0, 0};
    for (int i = 0; i < 900; i++) {
        double n = i % 3 == 0 ? between(0.2, 0.5) : i % 3 == 1 ? between(0.5, 1) : between(1, 2);
        Setting t = {.wedge = random_wedge(n),
                     .rho_in = between(0.5, 8),
                     .rho = between(0.5, 8),
                     .z = between(-8, 8),
                     .k = between(10, 100),
                     .moment = random_direction()};
        t.wedge.model = models[i / 3 % 3];
        t.phi_in = between(0.02, 0.98) * n * M_PI;
        found[i % 3] += check_boundaries(&t);
    }
    for (int i = 0; i < 3; i++) assert_true(found[i] > 300);
}

/* The case: a concrete corner at 3.5 GHz (eta = 5.24 - j 0.1231/(2 pi 3.5e9 eps0)), oblique, both faces: the
 * reflection boundaries of the 0-face (phi' = 50 deg) and of the n-face (phi' = 220 deg), and the shadow boundary. */
static void concrete_corner(void **state)
{
    (void)state;
    KellerMedium concrete = {.eta = 5.24 - 0.63213503 * I};
    KellerWedgeWave w = {
        .n = 1.5, .direction = {0, 0, 1}, .tangent0 = {1, 0, 0}, .normal0 = {0, 1, 0}, .medium = {concrete, concrete}};
    double phi_in[] = {50, 220};
    for (int i = 0; i < 2; i++) {
        Setting t = {.wedge = w,
                     .phi_in = phi_in[i] * M_PI / 180,
                     .rho_in = 10,
                     .rho = 7,
                     .z = 6,
                     .k = 73.35,
                     .moment = v3_unit(v3(0.3, -0.5, 0.8))};
        assert_int_equal(check_boundaries(&t), 2);
    }
}

/* No jump where the receiver passes the plane of source and edge, at which the reciprocal choice of terms turns over, or
 * anywhere else off the boundaries: over a step of 1e-9 rad the field changes by no more than the terms do. */
static void no_jump_between_boundaries(void **state)
{
    (void)state;
    seed = 7;
    for (int i = 0; i < 600; i++) {
        KellerWedgeWave w = random_wedge(between(1.02, 2));
        w.model = models[i % 3];
        double beta0 = between(0.2, M_PI - 0.2), phi = between(0.05, 0.95) * w.n * M_PI;
        if (fabs(phi - 0.5 * M_PI) < 0.02 || fabs((w.n - 0.5) * M_PI - phi) < 0.02) continue; /* reflection boundaries */
        KellerVec3 in = v3_scale(around(&w, phi, M_PI - beta0), -1);
        KellerCVec3 e = times(v3_perpendicular(in), 1);
        KellerCVec3 f[2];
        for (int j = 0; j < 2; j++)
            f[j] = keller_diffract_field(&w, in, around(&w, phi + (j ? 1e-9 : -1e-9), beta0), 3, 4, 70, e);
        if (!(distance(f[0], f[1]) < 1e-6 * norm(f[0]) + 1e-9))
            fail_msg("case %d, n %g phi %g: %g of %g", i, w.n, phi, distance(f[0], f[1]), norm(f[0]));
    }
}

/* At beta0 = 90 deg each polarisation keeps to itself: the scalar field behind the edge for E (0) or H (1) along it,
 * without e^{-jks}, of a unit field there. E across the edge: -E_phi' in, E_phi out (test_utd.c). */
static double complex scalar_field(const KellerWedgeWave *w, int across, double phi_in, double phi, double s_in, double s,
                                   double k)
{
    KellerVec3 in = v3_scale(around(w, phi_in, M_PI / 2), -1), out = around(w, phi, M_PI / 2);
    KellerVec3 from = w->direction, to = w->direction;
    if (across) {
        from = v3_scale(around(w, phi_in + M_PI / 2, M_PI / 2), -1);
        to = around(w, phi + M_PI / 2, M_PI / 2);
    }
    KellerCVec3 f = keller_diffract_field(w, in, out, s_in, s, k, times(from, 1));
    double complex along = f.x * to.x + f.y * to.y + f.z * to.z;
    assert_true(distance(f, times(to, along)) < 1e-13);
    return along;
}

/* The three models written out in scalars. Shadow, both faces lit, and the source nearer to either face. */
static void models_at_normal_incidence(void **state)
{
    (void)state;
    KellerMedium concrete = {.eta = 5.24 - 0.63 * I}, glass = {.eta = 6.31 - 0.1 * I, .thickness = 0.006};
    KellerWedgeWave w = {
        .n = 1.7, .direction = {0, 0, 1}, .tangent0 = {1, 0, 0}, .normal0 = {0, 1, 0}, .medium = {concrete, glass}};
    double k = 73, s_in = 12, s = 5, opening = 1.7 * M_PI;
    static const double cases[][2] = {{0.7, 4.1}, {0.7, 0.4}, {2.5, 2.9}, {2.5, 1.4}, {4.9, 1.1}, {4.9, 5.2}, {2.9, 5.1}};
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        double phi_in = cases[c][0], phi = cases[c][1], first = fmin(phi_in, phi), last = fmax(phi_in, phi);
        double complex d[4], in0[2], out_n[2], near0[2], near_n[2];
        keller_utd_terms(1.7, phi, phi_in, 1, k, s_in * s / (s_in + s), d);
        keller_reflection(&concrete, fabs(sin(phi_in)), k, &in0[0], &in0[1]);
        keller_reflection(&glass, fabs(sin(opening - phi)), k, &out_n[0], &out_n[1]);
        keller_reflection(&concrete, fabs(sin(first)), k, &near0[0], &near0[1]);
        keller_reflection(&glass, fabs(sin(opening - last)), k, &near_n[0], &near_n[1]);
        for (int i = 0; i < 2; i++) {
            double complex both = near0[i] * near_n[i], reflected = near_n[i] * d[2] + near0[i] * d[3];
            double complex expected[] = {(phi > phi_in ? both * d[0] + d[1] : d[0] + both * d[1]) + reflected,
                                         d[0] + d[1] + out_n[i] * d[2] + in0[i] * d[3],
                                         (phi_in <= opening / 2 ? both * d[0] + d[1] : d[0] + both * d[1]) + reflected};
            for (int m = 0; m < 3; m++) {
                w.model = models[m];
                double complex u = scalar_field(&w, i, phi_in, phi, s_in, s, k);
                assert_true(cabs(u - expected[m] * sqrt(s_in / (s * (s_in + s)))) < 1e-14);
            }
        }
    }
}

/* A conductor, given as such or as the limit of a conductivity, has Kouyoumjian and Pathak's D_s and D_h in every model:
 * with |eta| = 1e16 the Fresnel coefficients are within 4e-8 of it where cos theta > 0.1. */
static void conductor_in_all_models(void **state)
{
    (void)state;
    seed = 8;
    for (int i = 0; i < 300; i++) {
        KellerWedgeWave metal = random_wedge(between(1.02, 2)), copper;
        metal.medium[0] = metal.medium[1] = (KellerMedium){.conductor = true};
        copper = metal;
        copper.medium[0] = copper.medium[1] = (KellerMedium){.eta = 1 - 1e16 * I};
        double phi_in = between(0.2, metal.n * M_PI - 0.2), phi = between(0.2, metal.n * M_PI - 0.2);
        double complex d[4];
        keller_utd_terms(metal.n, phi, phi_in, 1, 70, 12.0 / 7, d);
        for (int m = 0; m < 3; m++) {
            metal.model = copper.model = models[m];
            for (int across = 0; across < 2; across++) {
                double complex expected = (d[0] + d[1] + (across ? 1 : -1) * (d[2] + d[3])) * sqrt(3.0 / 28);
                double size = (cabs(d[0]) + cabs(d[1]) + cabs(d[2]) + cabs(d[3])) * sqrt(3.0 / 28);
                assert_true(cabs(scalar_field(&metal, across, phi_in, phi, 3, 4, 70) - expected) < 1e-12 * size);
                double margin = fmin(fmin(fabs(sin(phi)), fabs(sin(phi_in))),
                                     fmin(fabs(sin(metal.n * M_PI - phi)), fabs(sin(metal.n * M_PI - phi_in))));
                if (margin > 0.1)
                    assert_true(cabs(scalar_field(&copper, across, phi_in, phi, 3, 4, 70) - expected) < 1e-6 * size);
            }
        }
    }
}

/* Grazing a lossy face direct and reflected wave cancel, and with Holm's terms so does what is diffracted: R_0 = -1 leaves
 * -R_n D_1 + D_2 + R_n D_3 - D_4 with D_1 = D_3 and D_2 = D_4. Luebbers' terms leave something. */
static void nothing_at_grazing_incidence(void **state)
{
    (void)state;
    KellerMedium concrete = {.eta = 5.24 - 0.63 * I};
    KellerWedgeWave w = {
        .n = 1.5, .direction = {0, 0, 1}, .tangent0 = {1, 0, 0}, .normal0 = {0, 1, 0}, .medium = {concrete, concrete}};
    for (int m = 0; m < 3; m++)
        for (int across = 0; across < 2; across++) {
            w.model = models[m];
            double complex at_0 = scalar_field(&w, across, 0, 4.2, 12, 5, 73);
            double complex at_n = scalar_field(&w, across, 1, 1.5 * M_PI, 12, 5, 73);
            if (m == 1)
                assert_true(cabs(at_0) > 1e-3 && cabs(at_n) > 1e-3);
            else
                assert_true(cabs(at_0) < 1e-13 && cabs(at_n) < 1e-13);
        }
}

/* Luebbers' coefficient from the table, D1 + D2 + R_n D3 + R_0 D4 with R_0 taken at phi' and R_n at n pi - phi: of the
 * terms and Fresnel coefficients, and at beta0 = 90 deg of the field. */
static void check_luebbers(bool full, int expected_rows)
{
    Table t;
    if (!table_open(&t, "c_utd_luebbers.csv", full)) skip();
    int rows = 0, fields = 0;
    for (; table_next(&t); rows++) {
        char name[32];
        KellerMaterial material = {.kind = KELLER_MATERIAL_ITU};
        snprintf(material.itu, sizeof material.itu, "%s", table_text(&t, "material", name, sizeof name));
        KellerMedium medium;
        assert_int_equal(keller_medium(&material, table_number(&t, "f_GHz") * 1e9, &medium, NULL), KELLER_OK);
        double n = table_number(&t, "n"), phi_in = table_number(&t, "phip_deg") * M_PI / 180;
        double phi = table_number(&t, "phi_deg") * M_PI / 180, beta0 = table_number(&t, "beta0_deg") * M_PI / 180;
        double k = table_number(&t, "k"), s_in = table_number(&t, "sp"), s = table_number(&t, "s"), sine = sin(beta0);
        double complex d[4], r0[2], rn[2];
        keller_utd_terms(n, phi, phi_in, sine, k, s * s_in / (s + s_in) * sine * sine, d);
        keller_reflection(&medium, sine * fabs(sin(phi_in)), k, &r0[0], &r0[1]);
        keller_reflection(&medium, sine * fabs(sin(n * M_PI - phi)), k, &rn[0], &rn[1]);
        double complex expected[2] = {table_number(&t, "D_TE_re") + I * table_number(&t, "D_TE_im"),
                                      table_number(&t, "D_TM_re") + I * table_number(&t, "D_TM_im")};
        KellerWedgeWave w = {.n = n, .direction = {0, 0, 1}, .tangent0 = {1, 0, 0}, .normal0 = {0, 1, 0},
                             .medium = {medium, medium}, .model = KELLER_WEDGE_LUEBBERS};
        for (int i = 0; i < 2; i++) {
            assert_true(cabs(d[0] + d[1] + rn[i] * d[2] + r0[i] * d[3] - expected[i]) < 1e-12);
            if (sine < 1) continue;
            double complex u = scalar_field(&w, i, phi_in, phi, s_in, s, k) / sqrt(s_in / (s * (s_in + s)));
            assert_true(cabs(u - expected[i]) < 1e-12);
            fields++;
        }
    }
    assert_int_equal(rows, expected_rows);
    assert_true(fields >= expected_rows / 2);
}

static void luebbers(void **state)
{
    (void)state;
    check_luebbers(false, 32);
}

static void luebbers_full(void **state)
{
    (void)state;
    check_luebbers(true, 64);
}

/* Finite wherever a path can be: rays in the faces, along the edge, points at the edge; and the limits are reached. */
static void limits(void **state)
{
    (void)state;
    seed = 4;
    static const double tiny[] = {0, 1e-300, 1e-30, 1e-9, 1, 1e9}, angles[] = {0, 1e-300, 1e-15, 1e-8, 1};
    for (int i = 0; i < 200; i++) {
        KellerWedgeWave w = random_wedge(i % 2 ? 2 : between(0.2, 2));
        double faces[] = {0, w.n * M_PI, M_PI * fmin(1, w.n), 0.4 * w.n * M_PI};
        for (int a = 0; a < 4; a++)
            for (int b = 0; b < 4; b++)
                for (int c = 0; c < 5; c++)
                    for (int d = 0; d < 6; d++) {
                        double beta0 = angles[c];
                        KellerVec3 in = v3_scale(around(&w, faces[a], M_PI - beta0), -1),
                                   out = around(&w, faces[b], beta0);
                        KellerCVec3 e = times(v3_perpendicular(in), 1);
                        double near = norm(keller_diffract_field(&w, in, out, 3, tiny[d], 70, e));
                        double far = norm(keller_diffract_field(&w, in, out, tiny[d], 3, 70, e));
                        assert_true(isfinite(near) && isfinite(far));
                        if (d < 5 && c == 4) assert_true(near < 30 && far < 30);
                    }
    }
    /* At the edge F(x) = sqrt(pi x) e^{j pi/4}: D A -> -cot(eps/2n) |sin(eps/2)|/2n for a term (2n = 3), whatever k, s
     * and beta0. */
    KellerMedium metal = {.conductor = true};
    KellerWedgeWave w = {
        .n = 1.5, .direction = {0, 0, 1}, .tangent0 = {1, 0, 0}, .normal0 = {0, 1, 0}, .medium = {metal, metal}};
    double phi_in = 0.5, phi = 2, expected = 0;
    double eps[] = {M_PI + 1.5, M_PI - 1.5, M_PI + 2.5 - 3 * M_PI, M_PI - 2.5};
    eps[0] -= 3 * M_PI * nearbyint(eps[0] / (3 * M_PI));
    for (int i = 0; i < 4; i++) expected += (i < 2 ? -1 : 1) * fabs(sin(eps[i] / 2)) / tan(eps[i] / 3) / 3;
    KellerVec3 in = v3_scale(around(&w, phi_in, M_PI / 2), -1), out = around(&w, phi, M_PI / 2);
    assert_true(distance(keller_diffract_field(&w, in, out, 3, 1e-20, 70, times(w.direction, 1)),
                         times(w.direction, expected)) < 1e-8);
    double beta0 = 1e-10;
    in = v3_scale(around(&w, phi_in, M_PI - beta0), -1);
    out = around(&w, phi, beta0);
    KellerVec3 beta_hat = v3_cross(v3(-sin(phi), cos(phi), 0), out),
               beta_in = v3_cross(v3(-sin(phi_in), cos(phi_in), 0), in);
    /* spreading and L: sqrt(s_in/(s (s_in + s))) sqrt(s s_in/(s + s_in)) = s_in/(s_in + s) = 3/5 */
    assert_true(distance(keller_diffract_field(&w, in, out, 3, 2, 70, times(beta_in, 1)),
                         times(beta_hat, -0.6 * expected)) < 1e-7);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reciprocity),     cmocka_unit_test(other_face),       cmocka_unit_test(continuity),
        cmocka_unit_test(concrete_corner), cmocka_unit_test(no_jump_between_boundaries),
        cmocka_unit_test(models_at_normal_incidence), cmocka_unit_test(conductor_in_all_models),
        cmocka_unit_test(nothing_at_grazing_incidence), cmocka_unit_test(luebbers), cmocka_unit_test(luebbers_full),
        cmocka_unit_test(limits),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
