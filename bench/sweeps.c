#include "sweeps.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../tests/stability/cone_oracle.h"
#include "../tests/unit/random.h"
#include "base/number.h"

const char *const method_names[METHODS] = {"listings float", "listings double", "kernel"};

static const KellerRange ALL = {0, INFINITY};

/* What one value of the varied number gave, by method. Errors in units of 2^-23 times the scale. */
typedef struct {
    int cases, met, missed[METHODS], false_yes[METHODS];
    double error[METHODS];
} Point;

static Point zero(void) { return (Point){0}; }

/* Both ends, or `near_only`. What lies 2^23 scales away is infinitely far. */
static void judge(Point *p, const ConeTruth *truth, const KellerRange r[METHODS], double scale, bool near_only)
{
    double most = scale * 0x1p23;
    p->cases++;
    p->met += truth->met;
    for (int m = 0; m < METHODS; m++) {
        bool found = r[m].near <= r[m].far;
        p->missed[m] += truth->met && !found;
        p->false_yes[m] += !truth->met && found;
        if (!truth->met || !found) continue;
        double near = (double)fabsl(r[m].near - truth->near);
        double far = fabs(lesser(r[m].far, most) - lesser((double)truth->far, most));
        p->error[m] = greater(p->error[m], (near_only ? near : greater(near, far)) / scale * 0x1p23);
    }
}

static void write(FILE *file, double x, const Point *p)
{
    fprintf(file, "%.9g,%d,%d", x, p->cases, p->met);
    for (int m = 0; m < METHODS; m++)
        fprintf(file, ",%.4g,%.4g,%.4g", 100.0 * p->missed[m] / (p->met ? p->met : 1),
                100.0 * p->false_yes[m] / (p->met ? p->met : 1), p->error[m]);
    fputc('\n', file);
}

/* A round cone of tangent T in any direction, its apex up to 1 m away. */
static KellerCone draw(Random *r, double T)
{
    KellerVec3 d = v3_unit(v3_unit(random_unit(r)));
    KellerCone c = {.origin = random_point(r, 1),
                    .directrix = d,
                    .major = v3_perpendicular(d),
                    .tan_alpha = T,
                    .e = 1,
                    .z_far = INFINITY};
    c.minor = v3_cross(c.directrix, c.major);
    return c;
}

static KellerVec3 world(const KellerCone *c, double x, double y, double z)
{
    return v3_madd(v3_madd(v3_madd(c->origin, c->directrix, z), c->major, x), c->minor, y / c->e);
}

static double reach(const KellerCone *c, const KellerVec3 *v, int count)
{
    double scale = c->x0;
    for (int i = 0; i < count; i++) scale = greater(scale, v3_distance(v[i], c->origin));
    return scale;
}

/* ---- an edge comes up to the envelope ---------------------------------------------------------------------------- */

/* The edge lies in the plane that touches the cone (half-angle 5 degrees) along a generator 10 m out, moved inwards
 * by `in` of the radius there, and crosses that generator at up to 45 degrees from across. */
static Point tangency(double in)
{
    Random r = {11};
    Point p = zero();
    for (int i = 0; i < 2000; i++) {
        KellerCone c = draw(&r, tan(5 * M_PI / 180));
        double z = 10, R = z * c.tan_alpha, phi = random_in(&r, -M_PI, M_PI), tilt = random_in(&r, 0.2, 0.8);
        KellerVec3 v[2];
        for (int k = 0; k < 2; k++) {
            double s = (k ? 1 : -1) * random_in(&r, 1, 2), at = z + s * tilt, rho = at * c.tan_alpha - in * R;
            v[k] = world(&c, rho * cos(phi) - s * sin(phi), rho * sin(phi) + s * cos(phi), at);
        }
        ConeTruth truth = cone_oracle_quad.edge(&c, v[0], v[1], ALL, 0);
        const KellerRange range[METHODS] = {listings_float.edge(&c, v[0], v[1], ALL),
                                            listings_double.edge(&c, v[0], v[1], ALL),
                                            keller_cone_edge(&c, v[0], v[1], ALL, NULL, NULL)};
        judge(&p, &truth, range, reach(&c, v, 2), false);
    }
    return p;
}

/* ---- a plane turns through the direction of a generator ---------------------------------------------------------- */

/* Half-angle 5 degrees; the plane crosses the axis 10 m out, and makes an angle with the axis greater by `turn` rad
 * than the half-angle: an ellipse; less: a hyperbola, whose range has no far end. */
static Point generator(double turn)
{
    Random r = {12};
    Point p = zero();
    for (int i = 0; i < 2000; i++) {
        double half = 5 * M_PI / 180, phi = random_in(&r, -M_PI, M_PI), a = half + turn;
        KellerCone c = draw(&r, tan(half));
        KellerVec3 n = v3_add(v3_add(v3_scale(c.major, cos(a) * cos(phi)), v3_scale(c.minor, cos(a) * sin(phi))),
                              v3_scale(c.directrix, sin(a)));
        n = v3_unit(v3_unit(n));
        double offset = v3_dot(n, world(&c, 0, 0, 10));
        ConeTruth truth = cone_oracle_quad.plane(&c, n, offset, ALL, 0);
        const KellerRange range[METHODS] = {listings_float.plane(&c, n, offset, ALL),
                                            listings_double.plane(&c, n, offset, ALL),
                                            keller_cone_plane(&c, n, offset, ALL, NULL, NULL)};
        /* the error of the far end relative to that end: here without a cap */
        p.cases++;
        p.met += truth.met;
        for (int m = 0; m < METHODS; m++) {
            bool found = range[m].near <= range[m].far;
            p.missed[m] += truth.met && !found;
            if (!found || !truth.met) continue;
            double far = (double)truth.far, error = isinf(far) && isinf(range[m].far) ? 0
                                                    : isinf(far) || isinf(range[m].far)
                                                        ? 1
                                                        : fabs(range[m].far - far) / far;
            p.error[m] = greater(p.error[m], lesser(error, 1));
            /* in place of false answers, of which there are none: the far end is finite and must not be */
            p.false_yes[m] += isinf(far) && !isinf(range[m].far);
        }
    }
    return p;
}

/* ---- the half-angle vanishes ------------------------------------------------------------------------------------- */

/* Two triangles of 10 m with a shared edge, and the cone's axis through a point of it, 10 m out: at least one of
 * them is met, by however thin a cone. "Missed": by both. The error is that of the nearer of the two. */
static Point half_angle(double degrees)
{
    Random r = {13};
    Point p = zero();
    for (int i = 0; i < 2000; i++) {
        KellerCone c = draw(&r, tan(degrees * M_PI / 180));
        double turn = random_in(&r, -M_PI, M_PI), z = 10, at = random_in(&r, 2, 8);
        KellerVec3 along = v3_add(v3_scale(c.major, cos(turn)), v3_scale(c.minor, sin(turn))),
                   side = v3_cross(c.directrix, along);
        KellerVec3 a = v3_madd(world(&c, 0, 0, z), along, -at),
                   b = v3_madd(a, v3_madd(along, c.directrix, random_in(&r, -0.5, 0.5)), 10);
        /* the axis goes through the edge, to rounding */
        KellerVec3 target = v3_madd(a, v3_sub(b, a), at / 10);
        c.directrix = v3_unit(v3_unit(v3_sub(target, c.origin)));
        c.major = v3_perpendicular(c.directrix);
        c.minor = v3_cross(c.directrix, c.major);
        KellerVec3 mid = v3_scale(v3_add(a, b), 0.5),
                   t1 = v3_madd(v3_madd(mid, side, 8), c.directrix, random_in(&r, -3, 3)),
                   t2 = v3_madd(v3_madd(mid, side, -8), c.directrix, random_in(&r, -3, 3)), v[4] = {a, b, t1, t2};
        ConeTruth u = cone_oracle_quad.triangle(&c, a, b, t1, ALL, 0),
                  w = cone_oracle_quad.triangle(&c, b, a, t2, ALL, 0);
        if (!u.met && !w.met) continue;
        ConeTruth truth = {true, u.met && (!w.met || u.near < w.near) ? u.near : w.near, 0};
        KellerRange range[METHODS];
        for (int m = 0; m < METHODS; m++) {
            const Listings *l = m ? &listings_double : &listings_float;
            KellerRange q =
                m == 2 ? keller_cone_triangle(&c, a, b, t1, ALL, NULL, NULL) : l->triangle(&c, a, b, t1, ALL);
            KellerRange s =
                m == 2 ? keller_cone_triangle(&c, b, a, t2, ALL, NULL, NULL) : l->triangle(&c, b, a, t2, ALL);
            range[m] = (KellerRange){lesser(q.near, s.near), greater(q.far, s.far)};
        }
        judge(&p, &truth, range, reach(&c, v, 4), true);
    }
    return p;
}

/* ---- far from the world's origin --------------------------------------------------------------------------------- */

/* Cone and plane, moved together by `offset` m; the cone's origin in single precision, and the plane's offset is
 * that of the plane through a point in single precision, rounded to double: the question has not changed, only where
 * it is asked. The error is in units of 2^-23 of 10 m. */
static Point far_away(double offset)
{
    Random r = {14};
    Point p = zero();
    for (int i = 0; i < 2000; i++) {
        KellerCone c = draw(&r, tan(2 * M_PI / 180));
        KellerVec3 move = v3_scale(random_unit(&r), offset), n = v3_unit(v3_unit(random_unit(&r)));
        if (fabs(v3_dot(n, c.directrix)) < 0.3) continue;
        c.origin = v3_add(c.origin, move);
        volatile float o[3] = {(float)c.origin.x, (float)c.origin.y, (float)c.origin.z};
        c.origin = v3((double)o[0], (double)o[1], (double)o[2]);
        double d = v3_dot(n, world(&c, 0, 0, 10));
        ConeTruth truth = cone_oracle_quad.plane(&c, n, d, ALL, 0);
        const KellerRange range[METHODS] = {listings_float.plane(&c, n, d, ALL), listings_double.plane(&c, n, d, ALL),
                                            keller_cone_plane(&c, n, d, ALL, NULL, NULL)};
        judge(&p, &truth, range, 10, false);
    }
    return p;
}

/* ---- eight boxes ------------------------------------------------------------------------------------------------- */

/* Boxes of 0.1 to 1 m up to 10 m out, near the cone: in units of the boxes that are met, how many are visited in
 * vain? */
static Point boxes(double degrees, double eccentricity)
{
    Random r = {15};
    Point p = zero();
    for (int i = 0; i < 1500; i++) {
        KellerCone c = draw(&r, tan(degrees * M_PI / 180));
        c.e = 1 / sqrt((1 - eccentricity) * (1 + eccentricity));
        KellerBox8 b;
        double size = 0, distance[2][8];
        for (int k = 0; k < 8; k++) {
            double z = random_in(&r, 0, 10), side = pow(10, random_in(&r, -1, 0)), most = z * c.tan_alpha + side;
            double x = random_in(&r, -1.5, 1.5) * most, y = random_in(&r, -1.5, 1.5) * most;
            KellerVec3 m = v3_madd(v3_madd(v3_madd(c.origin, c.directrix, z), c.major, x), c.minor, y);
            const double at[3] = {m.x, m.y, m.z};
            for (int j = 0; j < 3; j++) {
                double h = side * random_in(&r, 0.25, 0.5);
                b.lower[j][k] = (float)(at[j] - h);
                b.upper[j][k] = (float)(at[j] + h);
                size = greater(size, fabs(at[j]) + h);
            }
        }
        _Alignas(32) float near[8];
        KellerConeLanes lanes = keller_cone_lanes(&c, ALL, size * (1 + 1e-6));
        const uint32_t mask[METHODS] = {listings_float.box8(&c, &b, INFINITY, distance[0]),
                                        listings_double.box8(&c, &b, INFINITY, distance[1]),
                                        keller_cone_meets_box8(&lanes, &b, near)};
        for (int k = 0; k < 8; k++) {
            KellerVec3 lower = v3((double)b.lower[0][k], (double)b.lower[1][k], (double)b.lower[2][k]);
            KellerVec3 upper = v3((double)b.upper[0][k], (double)b.upper[1][k], (double)b.upper[2][k]);
            ConeTruth truth = cone_oracle_long.box(&c, lower, upper, ALL, 0);
            p.cases++;
            p.met += truth.met;
            for (int m = 0; m < METHODS; m++) {
                p.missed[m] += truth.met && !(mask[m] >> k & 1);
                p.false_yes[m] += !truth.met && mask[m] >> k & 1;
            }
        }
    }
    return p;
}

/* ---- files ------------------------------------------------------------------------------------------------------- */

static FILE *begin(const char *folder, const char *name, const char *x)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/numerics-%s.csv", folder, name);
    FILE *file = fopen(path, "w");
    if (!file) {
        perror(path);
        return NULL;
    }
    fprintf(file, "%s,cases,met", x);
    for (int m = 0; m < METHODS; m++) fprintf(file, ",missed_percent_%d,false_percent_%d,error_%d", m, m, m);
    fputc('\n', file);
    return file;
}

/* x = 10^from, ... 10^to in `steps` a decade, times `sign`. */
static void scan(FILE *file, Point (*f)(double), double from, double to, int steps, double sign)
{
    int count = (int)lround(fabs(to - from) * steps);
    for (int i = 0; i <= count; i++) {
        double x = sign * pow(10, from + (to - from) * i / count);
        Point p = f(x);
        write(file, x, &p);
    }
}

static bool end(FILE *file)
{
    bool ok = !ferror(file);
    return fclose(file) == 0 && ok;
}

bool sweeps(const char *folder)
{
    FILE *file = begin(folder, "tangency", "inside");
    if (!file) return false;
    scan(file, tangency, -1, -17, 2, 1);
    bool ok = end(file);
    file = begin(folder, "generator", "turn");
    if (!file) return false;
    scan(file, generator, -1.2, -17, 2, 1);
    scan(file, generator, -17, -1.2, 2, -1);
    ok &= end(file);
    file = begin(folder, "half-angle", "degrees");
    if (!file) return false;
    Point ray = half_angle(0);
    write(file, 0, &ray);
    scan(file, half_angle, -12, log10(45), 2, 1);
    ok &= end(file);
    file = begin(folder, "offset", "metres");
    if (!file) return false;
    scan(file, far_away, 0, 7, 4, 1);
    ok &= end(file);
    for (int flat = 0; flat < 2; flat++) {
        file = begin(folder, flat ? "boxes-flat" : "boxes-round", "degrees");
        if (!file) return false;
        for (int i = 0; i <= 20; i++) {
            double degrees = pow(10, -2 + i * (log10(45) + 2) / 20);
            Point p = boxes(degrees, flat ? 0.995 : 0);
            write(file, degrees, &p);
        }
        ok &= end(file);
    }
    return ok;
}
