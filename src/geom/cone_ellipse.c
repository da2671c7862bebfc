/* The smallest elliptic cone around points.
 *
 * Its section by the plane at distance 1 along a unit vector n is an ellipse whose area is least where n is the
 * cone's own directrix: for half-angle tangents a and b it is pi a b / (1 - (1 + a^2) nx^2 - (1 + b^2) ny^2)^(3/2).
 * So two steps in turn, neither of which can make the area larger, lead to the cone: the smallest ellipse around the
 * points projected on the plane of n; then n becomes the directrix of the cone through that ellipse. At rest it is
 * centred on n.
 *
 * The smallest ellipse is dual to the D-optimal design: weights w of sum 1 that maximise the determinant of the
 * points' weighted covariance C; it is (p - c)' C^-1 (p - c) <= 2 about the weighted mean c. Weight moves between
 * two points at a time, by exact line searches (Boehning 1986). At most five points have some in the end (John
 * 1948), so a fixed number of places does for any number of points: the farthest of all comes in until none is
 * outside. */
#include "geom/cone_frame.h"

#include <assert.h>

enum { PLACES = 24, DIRECTIONS = 6, TURNS = 60, STEPS = 1000 };

#define COS_MAX 0.17364817766693033 /* cos 80 degrees */
#define ACCURACY 1e-5 /* of the squared distance of the farthest point: 1.5e-5 of the area */
#define CENTRED 1e-5  /* rest: the centre is off n by this fraction of the ellipse: 2e-5 of the area */
#define RATIO_MAX 1e6 /* of the axes, for points in one plane with the apex */
#define MINOR_MIN 1e-12 /* least tangent of a minor half-angle: rounding stays below 0.2 % of it */

/* The projection on the plane of n, with an affine map that makes the points' extents 1. */
typedef struct {
    KellerVec3 apex, n, a, b;
    double x, y, width, height;
} Chart;

typedef struct {
    double x, y;
} Point2;

/* Some points, by index and as the chart shows them, and their weights. */
typedef struct {
    size_t count, index[PLACES];
    double weight[PLACES];
    Point2 at[PLACES];
} Design;

/* mean, and (co)variances about it */
typedef struct {
    double x, y, xx, xy, yy;
} Moments;

static Point2 chart_point(const Chart *c, KellerVec3 p)
{
    KellerVec3 q = v3_sub(p, c->apex);
    double z = v3_dot(q, c->n);
    return (Point2){(v3_dot(q, c->a) / z - c->x) / c->width, (v3_dot(q, c->b) / z - c->y) / c->height};
}

/* unit(p - apex); zero if they coincide */
static KellerVec3 sight(KellerVec3 apex, KellerVec3 p)
{
    KellerVec3 q = v3_sub(p, apex);
    double size = greater(fabs(q.x), greater(fabs(q.y), fabs(q.z)));
    return size > 0 ? v3_unit(v3_scale(q, 1 / size)) : q;
}

/* A direction from which every point is at most 83 degrees away: the mean, or, if that is not one, moved from point
 * to point towards the one of the hull of the unit vectors that is nearest to the apex (Gilbert 1966), which is the
 * centre of the smallest round cone. False if there is no round cone of 80 degrees. */
static bool facing(KellerVec3 apex, size_t count, const KellerVec3 *points, KellerVec3 *n)
{
    KellerVec3 x = v3(0, 0, 0);
    for (size_t i = 0; i < count; i++) {
        KellerVec3 u = sight(apex, points[i]);
        if (!(v3_norm(u) > 0)) return false;
        x = v3_madd(x, u, 1.0 / (double)count);
    }
    for (int step = 0; step < STEPS; step++) {
        double norm = v3_norm(x), least = INFINITY;
        KellerVec3 worst = x;
        for (size_t i = 0; i < count; i++) {
            KellerVec3 u = sight(apex, points[i]);
            double s = v3_dot(u, x);
            if (s < least) {
                least = s;
                worst = u;
            }
        }
        *n = v3_unit(x);
        if (least > 0.7 * COS_MAX * norm) return true;
        if (!(norm > COS_MAX)) return false; /* the hull comes nearer than a cap of 80 degrees allows */
        KellerVec3 d = v3_sub(worst, x);
        x = v3_madd(x, d, lesser(1, -v3_dot(x, d) / v3_dot(d, d)));
    }
    return false;
}

static Moments design_moments(const Design *design)
{
    Moments m = {0};
    for (size_t i = 0; i < design->count; i++) {
        m.x += design->weight[i] * design->at[i].x;
        m.y += design->weight[i] * design->at[i].y;
    }
    for (size_t i = 0; i < design->count; i++) {
        double x = design->at[i].x - m.x, y = design->at[i].y - m.y, w = design->weight[i];
        m.xx += w * x * x;
        m.xy += w * x * y;
        m.yy += w * y * y;
    }
    return m;
}

static void look(const Chart *chart, const KellerVec3 *points, Design *design)
{
    for (size_t i = 0; i < design->count; i++) design->at[i] = chart_point(chart, points[design->index[i]]);
}

/* The same of all points, each with the same weight. */
static Moments all_moments(const Chart *chart, size_t count, const KellerVec3 *points)
{
    Moments m = {0};
    for (size_t i = 0; i < count; i++) {
        Point2 p = chart_point(chart, points[i]);
        double dx = p.x - m.x, dy = p.y - m.y, w = 1 / (double)(i + 1); /* running, Welford 1962 */
        m.x += dx * w;
        m.y += dy * w;
        m.xx += (dx * (p.x - m.x) - m.xx) * w;
        m.xy += (dx * (p.y - m.y) - m.xy) * w;
        m.yy += (dy * (p.y - m.y) - m.yy) * w;
    }
    return m;
}

/* Turns a, b so that the first points along the larger principal axis. */
static void turn(Chart *c, double xx, double xy, double yy)
{
    double angle = 0.5 * atan2(2 * xy, xx - yy), co = cos(angle), si = sin(angle);
    KellerVec3 a = v3_add(v3_scale(c->a, co), v3_scale(c->b, si));
    c->a = v3_unit(v3_madd(a, c->n, -v3_dot(a, c->n)));
    c->b = v3_cross(c->n, c->a);
}

/* The plain projection along n. */
static Chart plain_chart(KellerVec3 apex, KellerVec3 n)
{
    Chart c = {.apex = apex, .n = n, .a = v3_perpendicular(n), .width = 1, .height = 1};
    c.b = v3_cross(n, c.a);
    return c;
}

/* Scales a plain chart to the points' extents; false where one vanishes: the points lie in a plane with the apex. */
static bool fit_chart(Chart *c, size_t count, const KellerVec3 *points)
{
    KellerRange x = {INFINITY, -INFINITY}, y = x;
    for (size_t i = 0; i < count; i++) {
        Point2 p = chart_point(c, points[i]);
        x = (KellerRange){lesser(x.near, p.x), greater(x.far, p.x)};
        y = (KellerRange){lesser(y.near, p.y), greater(y.far, p.y)};
    }
    c->x = 0.5 * (x.near + x.far);
    c->y = 0.5 * (y.near + y.far);
    c->width = 0.5 * (x.far - x.near);
    c->height = 0.5 * (y.far - y.near);
    double least = greater(c->width / RATIO_MAX, MINOR_MIN);
    bool flat = !(c->height > least && c->width > least);
    c->width = greater(c->width, least);
    c->height = greater(c->height, least);
    return !flat;
}

/* The first design: all points if there is a place for each, else those that are extreme in some directions. */
static void first_design(Chart *chart, size_t count, const KellerVec3 *points, Design *design)
{
    design->count = count <= PLACES ? count : 0;
    for (size_t i = 0; i < design->count; i++) design->index[i] = i;
    if (count > PLACES) {
        Moments m = all_moments(chart, count, points);
        turn(chart, m.xx, m.xy, m.yy);
        fit_chart(chart, count, points);
        for (int k = 0; k < 2 * DIRECTIONS; k++) {
            double co = cos(k * M_PI / DIRECTIONS), si = sin(k * M_PI / DIRECTIONS), most = -INFINITY;
            size_t far = 0;
            for (size_t i = 0; i < count; i++) {
                Point2 p = chart_point(chart, points[i]);
                double s = co * p.x + si * p.y;
                if (s > most) {
                    most = s;
                    far = i;
                }
            }
            design->index[design->count++] = far;
        }
    }
    for (size_t i = 0; i < design->count; i++) design->weight[i] = 1.0 / (double)design->count;
}

/* p' C^-1 q about the mean: 2 for p = q on the ellipse. Extents are 1: a determinant below 1e-14 is a design on one
 * line, to which all others look far enough. */
static double product(const Moments *m, Point2 p, Point2 q)
{
    double px = p.x - m->x, py = p.y - m->y, qx = q.x - m->x, qy = q.y - m->y;
    return (m->yy * px * qx - m->xy * (px * qy + py * qx) + m->xx * py * qy) /
           greater(m->xx * m->yy - m->xy * m->xy, 1e-14);
}

/* Moves weight to the farthest place from the nearest that has some, until none is outside by more than ACCURACY. With
 * k = 1 + product, moving t changes the determinant by (1 + t k_far) (1 - t k_near) + t^2 k_both^2. */
static Moments settle(Design *d)
{
    for (int step = 0;; step++) {
        Moments m = design_moments(d);
        double far = -1, near = INFINITY;
        size_t to = 0, from = 0;
        for (size_t i = 0; i < d->count; i++) {
            double g = product(&m, d->at[i], d->at[i]);
            if (g > far) {
                far = g;
                to = i;
            }
            if (g < near && d->weight[i] > 0) {
                near = g;
                from = i;
            }
        }
        if (far <= 2 * (1 + ACCURACY) || to == from || step == STEPS) return m;
        double both = 1 + product(&m, d->at[to], d->at[from]);
        double t = (far - near) / (2 * greater((1 + far) * (1 + near) - both * both, 1e-14));
        if (t < d->weight[from]) {
            d->weight[from] -= t;
        } else {
            t = d->weight[from];
            d->weight[from] = 0;
        }
        d->weight[to] += t;
    }
}

/* Improves the design until its ellipse, ACCURACY larger, holds all points; its moments. */
static Moments improve(const Chart *chart, size_t count, const KellerVec3 *points, Design *d)
{
    look(chart, points, d);
    for (int step = 0;; step++) {
        Moments m = settle(d);
        if (count <= PLACES || step == STEPS) return m;
        double far = -1;
        size_t farthest = 0, place = 0;
        for (size_t i = 0; i < count; i++) {
            Point2 p = chart_point(chart, points[i]);
            double g = product(&m, p, p);
            if (g > far) {
                far = g;
                farthest = i;
            }
        }
        if (far <= 2 * (1 + ACCURACY)) return m;
        for (size_t i = 1; i < d->count; i++)
            if (d->weight[i] < d->weight[place]) place = i;
        if (d->count < PLACES) {
            place = d->count++;
            d->weight[place] = 0;
        }
        d->index[place] = farthest; /* with the least weight, if not none, of the one that had the place */
        d->at[place] = chart_point(chart, points[farthest]);
    }
}

/* The directrix, (vx, vy, 1), of the cone through the ellipse with centre (cx, cy) and squared semi-axes sx, sy
 * along x and y in the plane z = 1. The matrix [S - c c', -c; -c', -1] is inverse to the cone's and stays finite for
 * S = 0; its eigenvector of the negative eigenvalue -k solves v = k c / (s + k), and k = 1 - c.v becomes the concave
 * 1 - sum c^2/(s + k) = 1/k. */
static void directrix_of(double cx, double cy, double sx, double sy, double *vx, double *vy)
{
    double k = 1;
    for (int i = 0; i < 50; i++) { /* Newton from below: monotone */
        double fx = cx / (sx + k), fy = cy / (sy + k), f = 1 - fx * cx - fy * cy - 1 / k;
        double step = -f / (fx * fx + fy * fy + 1 / (k * k));
        k += step;
        if (!(step > 1e-15 * k)) break;
    }
    *vx = k * cx / (sx + k);
    *vy = k * cy / (sy + k);
}

/* Widens the cone, whose axes and e are set, to hold all points in spite of rounding: every coordinate over z is off
 * by a few units of 2^-53, and the minor ones count e times. */
static bool widen(size_t count, const KellerVec3 *points, KellerCone *cone)
{
    double most = 0;
    for (size_t i = 0; i < count; i++) {
        KellerVec3 q = sight(cone->origin, points[i]);
        double z = v3_dot(q, cone->directrix);
        if (!(z > 0)) return false;
        most = greater(most, length2(v3_dot(q, cone->major), cone->e * v3_dot(q, cone->minor)) / z);
    }
    cone->tan_alpha = most * (1 + 1e-12) + 16 * 0x1p-53 * (cone->e + most * most);
    return cone->tan_alpha < TAN_MAX;
}

bool keller_cone_around(KellerVec3 apex, size_t count, const KellerVec3 *points, KellerCone *cone)
{
    assert(count >= 1);
    KellerVec3 n;
    *cone = (KellerCone){.origin = apex, .e = 1, .z_far = INFINITY};
    if (!facing(apex, count, points, &n)) return false;
    Chart chart = plain_chart(apex, n);
    Design design;
    first_design(&chart, count, points, &design);
    for (int i = 0;; i++) {
        chart = plain_chart(apex, n);
        look(&chart, points, &design);
        Moments m = design_moments(&design);
        turn(&chart, m.xx, m.xy, m.yy);
        if (fit_chart(&chart, count, points)) m = improve(&chart, count, points, &design);
        else m = (Moments){.xx = 0.5, .yy = 0.5}; /* the extents themselves are the semi-axes */
        /* principal axes of the ellipse in the plane; the smaller by way of the determinant, which does not cancel */
        double w = chart.width, h = chart.height, xx = 2 * w * w * m.xx, yy = 2 * h * h * m.yy, xy = 2 * w * h * m.xy;
        double cx = chart.x + w * m.x, cy = chart.y + h * m.y;
        double large = 0.5 * (xx + yy) + length2(0.5 * (xx - yy), xy);
        double small = 4 * w * w * h * h * (m.xx * m.yy - m.xy * m.xy) / large;
        small = lesser(large, greater(small, large / (RATIO_MAX * RATIO_MAX)));
        KellerVec3 old = chart.a, across = chart.b;
        turn(&chart, xx, xy, yy);
        double co = v3_dot(old, chart.a), si = v3_dot(across, chart.a), vx, vy;
        directrix_of(co * cx + si * cy, co * cy - si * cx, large, small, &vx, &vy);
        cone->directrix = chart.n;
        cone->major = chart.a;
        cone->minor = chart.b;
        cone->e = sqrt(large / small);
        if (i == TURNS || vx * vx / large + vy * vy / small < CENTRED * CENTRED) break;
        n = v3_unit(v3_madd(v3_madd(n, chart.a, vx), chart.b, vy));
    }
    return widen(count, points, cone);
}
