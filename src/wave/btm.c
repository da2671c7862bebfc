/* Biot, Tolstoy and Medwin's solution of the rigid wedge as a line integral along the edge: Svensson, Fred and Vanderkooy, J. Acoust.
 * Soc. Am. 106 (1999) 2331-2344. docs/acoustics.md derives the forms used here. */
#include <stddef.h>
#include "keller/sound.h"
#include "wave/azimuth.h"

static const double smallest_distance = 1e-100; /* m: a source or receiver on the edge's line */

KellerRigidEdge keller_rigid_edge(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, double s_in, double s, double at,
                                  double length)
{
    EdgeAzimuth incident = edge_azimuth(wedge, v3_scale(in, -1)), diffracted = edge_azimuth(wedge, out);
    return (KellerRigidEdge){.n = wedge->n,
                             .phi_in = incident.phi,
                             .phi = diffracted.phi,
                             .r_in = fmax(s_in * incident.r, smallest_distance),
                             .r = fmax(s * diffracted.r, smallest_distance),
                             .z_in = at - s_in * v3_dot(in, wedge->direction),
                             .z = at + s * v3_dot(out, wedge->direction),
                             .z1 = 0,
                             .z2 = length};
}

/* With m = r' cosh a, z - z' = r' sinh a, and likewise b for the receiver, Svensson's eta is |a + b|; and dz/(ml) = d eta/(m + l). */
static double eta_at(const KellerRigidEdge *e, double z)
{
    return asinh((z - e->z_in) / e->r_in) + asinh((z - e->z) / e->r);
}

/* m + l, the way by the edge's point. */
static double way(const KellerRigidEdge *e, double eta)
{
    double dz = e->z - e->z_in, sum = e->r_in + e->r, s = sinh(0.5 * eta);
    return sqrt(sum * sum + dz * dz + 4 * e->r_in * e->r * s * s);
}

/* The four angles nu phi_i, less the whole turns nearest to them; 0 on a boundary, where the term's mean is 0. */
static void angles(const KellerRigidEdge *e, double angle[4])
{
    double period = 2 * M_PI * e->n;
    for (int i = 0; i < 4; i++) {
        double phi = M_PI + (i & 1 ? -e->phi_in : e->phi_in) + (i & 2 ? -e->phi : e->phi);
        phi -= period * nearbyint(phi / period);
        angle[i] = fabs(phi) < KELLER_BOUNDARY_ANGLE ? 0 : phi / e->n;
    }
}

static double beta(const KellerRigidEdge *e, const double angle[4], double eta)
{
    double sum = 0, s = sinh(0.5 * eta / e->n);
    for (int i = 0; i < 4; i++) {
        double half = sin(0.5 * angle[i]);
        if (angle[i] != 0) sum += sin(angle[i]) / (2 * (s * s + half * half));
    }
    return sum;
}

/* The integral of beta from 0: atan(tanh(nu eta/2)/tan(angle/2)) 2/nu each, whatever the pole's distance. */
static double beta_integral(const KellerRigidEdge *e, const double angle[4], double eta)
{
    double sum = 0, t = tanh(0.5 * eta / e->n);
    for (int i = 0; i < 4; i++)
        if (angle[i] != 0) sum += 2 * e->n * atan(t / tan(0.5 * angle[i]));
    return sum;
}

/* ---- frequency ---------------------------------------------------------------------------------------------------------- */

/* Gauss and Legendre, 8 nodes on [-1, 1]. */
static const double nodes[4] = {0.18343464249564980, 0.52553240991632899, 0.79666647741362674, 0.96028985649753623};
static const double weights[4] = {0.36268378337836198, 0.31370664587788729, 0.22238103445337447, 0.10122853629037626};

/* Of eta: panels grow from this by factors of two, so that a pole at any distance is seen by panels no wider than that; below it, what
 * is left of beta (e^{-jkR} - e^{-jkR0}) is less than 1e-12 of the whole. */
static const double first_panel = 1e-7, widest_panel = 0.5;
static const double panel_phase = 2; /* rad */

/* The integral over [0, end] of beta (e^{-jk(R - R0)}/R - 1/R0), plus that of beta/R0 in closed form. */
static double complex half_edge(const KellerRigidEdge *e, const double angle[4], double k, double end)
{
    double r0 = way(e, 0), a = 0, ra = r0;
    double complex sum = beta_integral(e, angle, end) / r0;
    while (a < end) {
        double b = fmin(end, a + fmin(widest_panel, fmax(a, first_panel)));
        double rb = way(e, b);
        while (k * (rb - ra) > panel_phase) {
            b = a + (b - a) * fmax(0.25, 0.9 * panel_phase / (k * (rb - ra)));
            rb = way(e, b);
        }
        double middle = 0.5 * (a + b), half = 0.5 * (b - a);
        for (int i = 0; i < 8; i++) {
            double eta = middle + (i & 1 ? half : -half) * nodes[i / 2], r = way(e, eta);
            double complex g = cexp(-I * k * (r - r0)) / r - 1 / r0;
            sum += half * weights[i / 2] * beta(e, angle, eta) * g;
        }
        a = b;
        ra = rb;
    }
    return sum;
}

double complex keller_btm(const KellerRigidEdge *e, double k)
{
    double angle[4], eta1 = eta_at(e, e->z1), eta2 = eta_at(e, e->z2);
    angles(e, angle);
    double complex first = half_edge(e, angle, k, fabs(eta1)), second = half_edge(e, angle, k, fabs(eta2));
    return -((eta2 < 0 ? -second : second) - (eta1 < 0 ? -first : first)) / (4 * M_PI * e->n);
}

double keller_btm_shortest(const KellerRigidEdge *e) { return way(e, 0); }

/* ---- time ---------------------------------------------------------------------------------------------------------------- */

/* The eta > 0 at which the way is r. */
static double eta_of(const KellerRigidEdge *e, double r)
{
    double dz = e->z - e->z_in, sum = e->r_in + e->r, square = (r * r - sum * sum - dz * dz) / (4 * e->r_in * e->r);
    return square > 0 ? 2 * asinh(sqrt(square)) : 0;
}

/* Of eta: the first piece, and how much longer each may be than what lies before it. Next to a boundary nearly all comes from the
 * shortest way, at an eta as small as the angle to the boundary, 1e-9 at least. */
static const double first_piece = 1e-10, piece_growth = 0.5;

/* Adds what the points of the edge between eta = 0 and `end` bring, with a sign, piece by piece of half a sample or less; each piece is
 * shared by the two samples around its middle. */
static void add_half(const KellerRigidEdge *e, const double angle[4], double end, double sign, double speed, double rate,
                     double start,
                     size_t count, double *h)
{
    double a = 0, integral = 0, scale = -sign * rate / (4 * M_PI * e->n);
    while (a < end) {
        double longest = eta_of(e, way(e, a) + 0.5 * speed / rate);
        double b = fmin(end, fmin(longest, a + fmax(piece_growth * a, first_piece)));
        double next = beta_integral(e, angle, b), r = way(e, 0.5 * (a + b)), at = (r / speed - start) * rate;
        double i = floor(at), share = at - i, weight = scale * (next - integral) / r;
        if (i + 1 >= (double)count) return;
        if (i >= 0) {
            h[(size_t)i] += (1 - share) * weight;
            h[(size_t)i + 1] += share * weight;
        }
        a = b;
        integral = next;
    }
}

void keller_btm_response(const KellerRigidEdge *e, double speed, double rate, double start, size_t count, double *h)
{
    double angle[4], eta1 = eta_at(e, e->z1), eta2 = eta_at(e, e->z2);
    angles(e, angle);
    add_half(e, angle, fabs(eta2), eta2 < 0 ? -1 : 1, speed, rate, start, count, h);
    add_half(e, angle, fabs(eta1), eta1 < 0 ? 1 : -1, speed, rate, start, count, h);
}
