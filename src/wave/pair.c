/* With s and t the distances from the edges' tips across the rays, turned by 45 degrees in the complex plane,
 *     I(x) = integral of e^{-s^2/2 - z s} over s > 0,  z = e^{j pi/4} x,
 * is an edge's transition function but for a factor, and two edges together have
 *     I(x1, x2, r) = integral of e^{-s^2/2 - t^2/2 + r s t - z1 s - z2 t} over s, t > 0.
 * What is computed here is I(x1, x2, r)/(I(x1) I(x2)). */
#include "wave/pair.h"

#include <assert.h>
#include <cerf.h>

#include "wave/descent.h"

/* From here on the series below is short and the recurrence for its moments forgets where it began. */
static const double series_from = 3;

/* j_m = integral of s^m e^{-s^2/2 - z s}, over that of m = 0. Integration by parts has j_{m+1} = m j_{m-1} - z j_m, of which j is the
 * solution that shrinks; so ratios q_m = j_{m+1}/j_m by q_{m-1} = m/(z + q_m) from above (Miller). What is wrong at the start falls by
 * e^{-2 x sqrt(m)} or so: at x = 3 to below 1e-13 in the moments that count. */
void pair_side(double x, PairSide *side)
{
    enum { START = PAIR_MOMENTS + 96 };
    side->x = x;
    if (x < series_from) return;
    double complex z = M_SQRT1_2 * (1 + I) * x, q = 0.5 * (csqrt(z * z + 4 * (START + 1)) - z);
    double complex ratio[PAIR_MOMENTS];
    for (int m = START; m > 0; m--) {
        double complex sum = z + q; /* of positive real part: nothing to scale in the division */
        q = m / (creal(sum) * creal(sum) + cimag(sum) * cimag(sum)) * conj(sum);
        if (m <= PAIR_MOMENTS) ratio[m - 1] = q;
    }
    side->moment[0] = 1;
    for (int m = 1; m < PAIR_MOMENTS; m++) side->moment[m] = side->moment[m - 1] * ratio[m - 1] / sqrt(m);
}

/* e^{r s t} as a power series. False if that takes too many terms. */
static bool series(const PairSide *a, const PairSide *b, double r, double complex *same, double complex *opposite)
{
    const double enough = 1e-15;
    double complex even = 1, odd = 0;
    double power = 1;
    for (int m = 1; m < PAIR_MOMENTS; m++) {
        power *= r;
        double complex term = power * (a->moment[m] * b->moment[m]);
        if (m % 2) odd += term;
        else even += term;
        if (cabs(term) < enough) {
            *same = even + odd;
            *opposite = even - odd;
            return true;
        }
    }
    return false;
}

/* The inner integral is sqrt(pi/2) e^{y^2/2} erfc(y/sqrt 2), y = z2 - r s. For Re y < 0 erfc(y) = 2 - erfc(-y), and what
 * grows is put into one exponent with what falls. */
static double complex integrand(double x1, double x2, double r, double s)
{
    double complex turn = M_SQRT1_2 * (1 + I), first = -0.5 * s * s - turn * x1 * s, y = turn * x2 - r * s;
    if (creal(y) >= 0) return cexp(first) * w_of_z(I * M_SQRT1_2 * y);
    return 2 * cexp(first + 0.5 * y * y) - cexp(first) * w_of_z(-I * M_SQRT1_2 * y);
}

typedef struct {
    double x1, x2, r;
} Edges;

static double complex at(const void *context, double s)
{
    const Edges *e = context;
    return integrand(e->x1, e->x2, e->r, s);
}

/* The two parts of the integrand fall at rates that may differ much: e^{-x1 s/sqrt 2 - s^2/2}, and, for r > 0, e^{-(x1 + r x2)
 * s/sqrt 2 - (1 - r^2) s^2/2} from where y changes sign. */
static double complex quadrature(double x1, double x2, double r)
{
    double complex turn = M_SQRT1_2 * (1 + I), one = sqrt(0.5 * M_PI) * w_of_z(I * M_SQRT1_2 * turn * x1);
    double complex other = w_of_z(I * M_SQRT1_2 * turn * x2), sum;
    Edges e = {x1, x2, r};
    double alone = descent_reach(M_SQRT1_2 * x1, 1), both = descent_reach(M_SQRT1_2 * (x1 + r * x2), 1 - r * r);
    double near = fmin(alone, both), far = fmax(alone, both);
    sum = descent_integral(at, &e, 0, near);
    if (far > near) sum += descent_integral(at, &e, near, far);
    return sum / (one * other);
}

void pair_values(const PairSide *a, const PairSide *b, double r, double complex *same, double complex *opposite)
{
    *same = *opposite = 1;
    if (r == 0) return;
    if (a->x >= series_from && b->x >= series_from && series(a, b, r, same, opposite)) return;
    /* outside, the variable in which the integrand falls faster: exchanging the edges changes nothing */
    double x1 = fmax(a->x, b->x), x2 = fmin(a->x, b->x);
    *same = quadrature(x1, x2, r);
    *opposite = quadrature(x1, x2, -r);
}

double complex keller_edge_pair(double x1, double x2, double r)
{
    assert(x1 >= 0 && x2 >= 0 && fabs(r) < 1);
    PairSide a, b;
    double complex same, opposite;
    pair_side(x1, &a);
    pair_side(x2, &b);
    pair_values(&a, &b, fabs(r), &same, &opposite);
    return r < 0 ? opposite : same;
}
