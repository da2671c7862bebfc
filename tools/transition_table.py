"""Prints the table of src/wave/transition.c: Chebyshev series of H(y) = F/y, y = r/(r + 2), r the root of F's argument, as
polynomials in t from -1 to 1 on each of eight parts of y from 0 to 1. Needs mpmath. How good they are: the sum of what is left off."""
import sys

import mpmath

PARTS, TERMS, CENTRE = 8, 14, 2
mpmath.mp.dps = 50


def transition(r):
    """F(r^2) by the complementary error function; by the asymptotic series where its smallest term, e^(-r^2), is nothing."""
    if r < 11:
        z = -1j * r * mpmath.exp(3j * mpmath.pi / 4)
        return mpmath.sqrt(mpmath.pi) * r * mpmath.exp(1j * mpmath.pi / 4) * mpmath.exp(z * z) * mpmath.erfc(z)
    term, total = mpmath.mpc(1), mpmath.mpc(1)
    for m in range(1, 121):
        term *= 1j * (2 * m - 1) / (2 * r * r)
        total += term
        if abs(term) < mpmath.mpf(10) ** -45:
            break
    return total


def over_y(y):
    return transition(CENTRE * y / (1 - y)) / y


def series(low, high):
    """Coefficients of the Chebyshev series from low to high, many more than are used."""
    nodes = TERMS + 14
    angles = [mpmath.pi * (k + 0.5) / nodes for k in range(nodes)]
    values = [over_y((low + high) / 2 + (high - low) / 2 * mpmath.cos(a)) for a in angles]
    return [(1 if j == 0 else 2) * mpmath.fsum(v * mpmath.cos(j * a) for v, a in zip(values, angles)) / nodes for j in range(nodes)]


def powers(chebyshev):
    """The same polynomial by powers of t: T_(j+1) = 2 t T_j - T_(j-1)."""
    total, before, here = [mpmath.mpc(0)] * TERMS, [1] + [0] * TERMS, [0, 1] + [0] * (TERMS - 1)
    for j in range(TERMS):
        total = [s + chebyshev[j] * b for s, b in zip(total, before)]
        before, here = here, [2 * (here[i - 1] if i else 0) - before[i] for i in range(TERMS + 1)]
    return total


worst = 0
for part in range(PARTS):
    coefficients = series(mpmath.mpf(part) / PARTS, mpmath.mpf(part + 1) / PARTS)
    worst = max(worst, sum(abs(c) for c in coefficients[TERMS:]))
    words = ["{%r, %r}" % (float(c.real), float(c.imag)) for c in powers(coefficients)]
    print("    {" + ",\n     ".join(", ".join(words[i:i + 2]) for i in range(0, TERMS, 2)) + "},")
print("left off: %s" % mpmath.nstr(worst, 2), file=sys.stderr)
