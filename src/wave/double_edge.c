/* Two straight edges in each other's transition zones: the double knife edge of Millington, Hewitt and Immirzi (Proc. IEE 109C
 * (1962) 419-429) and Vogler (Radio Sci. 17 (1982) 1541-1546), as one integral along a path of steepest descent. */
#include <assert.h>
#include <cerf.h>
#include "keller/wave.h"
#include "wave/descent.h"

/* a = 1/d1 + 1/d2 and b = 1/d2 + 1/d3: the inverse distance parameters of the edges, c of the first with the second
 * away. */
typedef struct {
    double k, d1, d2, d3, h1, h2, a, b, c;
} Edges;

static Edges edges(double k, double d1, double d2, double d3, double h1, double h2)
{
    return (Edges){k, d1, d2, d3, h1, h2, 1 / d1 + 1 / d2, 1 / d2 + 1 / d3, 1 / d1 + 1 / (d2 + d3)};
}

/* The angle by which the first edge stands in the way from the source to the second. */
static double first_angle(const Edges *e) { return e->a * e->h1 - e->h2 / e->d2; }

static Edges turned_round(const Edges *e) { return edges(e->k, e->d3, e->d2, e->d1, e->h2, e->h1); }

/* One edge of height h over the line, `c` the sum of the inverse distances: erfc(e^{j pi/4} h sqrt(kc/2))/2. */
static double complex single_edge(double k, double c, double h)
{
    double r = 0.5 * h * sqrt(k * c);
    return 0.5 * cerfc(r + I * r);
}

/* e^{-jkc y^2/2} erfc(e^{j pi/4} sqrt(kb/2) (h2 - y/(b d2)))/2 at y = h1 + e^{-j pi/4} s: the wave in the plane of the first
 * edge, times what the second edge leaves of it. With both exponents taken together nothing overflows. */
static double complex integrand(const void *context, double s)
{
    const Edges *e = context;
    double complex rotation = M_SQRT1_2 * (1 + I), y = e->h1 + s / rotation;
    double complex z = rotation * sqrt(0.5 * e->k * e->b) * (e->h2 - y / (e->b * e->d2));
    double complex open = -0.5 * I * e->k * e->c * y * y, tail = open - z * z;
    /* erfc(z) = e^{-z^2} w(jz), and 2 less that of -z */
    if (creal(z) >= 0) return 0.5 * cexp(tail) * w_of_z(I * z);
    return cexp(open) - 0.5 * cexp(tail) * w_of_z(-I * z);
}

/* For a first edge above the line and in the way: then both parts of the integrand fall, one like e^{-k (c h1 s/sqrt 2 +
 * c s^2/2)}, the other like e^{-k (angle s/sqrt 2 + a s^2/2)}, which may be many times faster or slower. */
static double complex steepest_descent(const Edges *e)
{
    double open = descent_reach(M_SQRT1_2 * e->k * e->c * e->h1, e->k * e->c);
    double tail = descent_reach(M_SQRT1_2 * e->k * first_angle(e), e->k * e->a);
    double near = fmin(open, tail), far = fmax(open, tail);
    return sqrt(e->k * e->c / (2 * M_PI)) * (descent_integral(integrand, e, 0, near) + descent_integral(integrand, e, near, far));
}

static bool stands_in_the_way(const Edges *e) { return e->h1 >= 0 && first_angle(e) >= 0; }

double complex keller_double_edge(double k, double d1, double d2, double d3, double h1, double h2)
{
    assert(k > 0 && d1 > 0 && d2 > 0 && d3 > 0);
    Edges e = edges(k, d1, d2, d3, h1, h2), back = turned_round(&e);
    if (stands_in_the_way(&e)) return steepest_descent(&e);
    if (stands_in_the_way(&back)) return steepest_descent(&back);
    /* Neither: then one of the complementary pair does. What passes above both is what passes above the second, less what
     * passes below the first, more what passes below both; below is above, mirrored. */
    double complex above = single_edge(k, 1 / (d1 + d2) + 1 / d3, h2);
    double complex below = single_edge(k, e.c, -h1);
    return above - below + keller_double_edge(k, d1, d2, d3, -h1, -h2);
}
