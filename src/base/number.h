/* Plain minimum, maximum and length: one instruction each, where fmin, fmax and hypot are calls that also care for NaN,
 * signed zeros and overflow. */
#ifndef KELLER_BASE_NUMBER_H
#define KELLER_BASE_NUMBER_H
#include <math.h>
#include <stdint.h>
#include <string.h>

static inline double lesser(double a, double b) { return a < b ? a : b; }
static inline double greater(double a, double b) { return a > b ? a : b; }
/* The least single-precision number that is not below a, and the greatest that is not above; a is not NaN. */
static inline float float_up(double a)
{
    float f = (float)a;
    if ((double)f >= a) return f;
    uint32_t bits; /* one further from zero, or nearer to it */
    memcpy(&bits, &f, sizeof bits);
    bits = f == 0 ? 1 : f > 0 ? bits + 1 : bits - 1;
    memcpy(&f, &bits, sizeof f);
    return f;
}
static inline float float_down(double a) { return -float_up(-a); }
/* a b - product, for product = a b rounded: exact unless it over- or underflows. */
static inline double product_error(double a, double b, double product) { return fma(a, b, -product); }
static inline double length2(double x, double y) { return sqrt(x * x + y * y); }
#endif
