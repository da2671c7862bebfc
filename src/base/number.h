/* Plain minimum, maximum and length: one instruction each, where fmin, fmax and hypot are calls that also care for NaN,
 * signed zeros and overflow. */
#ifndef KELLER_BASE_NUMBER_H
#define KELLER_BASE_NUMBER_H
#include <math.h>

static inline double lesser(double a, double b) { return a < b ? a : b; }
static inline double greater(double a, double b) { return a > b ? a : b; }
static inline double length2(double x, double y) { return sqrt(x * x + y * y); }
#endif
