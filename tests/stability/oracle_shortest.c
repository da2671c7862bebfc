#include "oracle_shortest.h"
#include <assert.h>
#include <math.h>
#include <string.h>

enum { MOST = ORACLE_MAX_STEPS, SWEEPS = 6, FEW = 8, STEPS = 12 };

Point lines_point(const Lines *l, size_t i, const Real *t)
{
    return i == 0 ? l->source : i > l->n ? l->target : plus(l->origin[i - 1], l->direction[i - 1], t[i - 1]);
}

/* Each leg r counts as sqrt(r^2 + round^2). */
static Real rounded_length(const Lines *l, const Real *t, Real round)
{
    Real sum = 0;
    for (size_t i = 0; i <= l->n; i++) {
        Point leg = minus(lines_point(l, i + 1, t), lines_point(l, i, t));
        sum += sqrtl(dot(leg, leg) + round * round);
    }
    return sum;
}

Real lines_length(const Lines *l, const Real *t) { return rounded_length(l, t, 0); }

/* The gradient, and on and beside the diagonal the second derivatives. */
static void derive(const Lines *l, const Real *t, Real round, Real *g, Real *on, Real *beside)
{
    for (size_t i = 0; i < l->n; i++) g[i] = on[i] = beside[i] = 0;
    for (size_t i = 0; i <= l->n; i++) {
        Point leg = minus(lines_point(l, i + 1, t), lines_point(l, i, t));
        Real r = sqrtl(dot(leg, leg) + round * round);
        Point u = plus((Point){0, 0, 0}, leg, 1 / r);
        for (int k = 0; k < 2; k++) { /* lines i - 1 and i, counted from 0 */
            if (i + (size_t)k < 1 || i + (size_t)k > l->n) continue;
            size_t j = i + (size_t)k - 1;
            Real c = dot(u, l->direction[j]);
            g[j] += k ? c : -c;
            on[j] += (1 - c * c) / r;
        }
        if (i > 0 && i < l->n)
            beside[i - 1] = -(dot(l->direction[i - 1], l->direction[i]) -
                              dot(u, l->direction[i - 1]) * dot(u, l->direction[i])) / r;
    }
}

Real lines_gradient(const Lines *l, const Real *t)
{
    Real g[MOST], on[MOST], beside[MOST], most = 0;
    derive(l, t, 0, g, on, beside);
    for (size_t i = 0; i < l->n; i++) most = fmaxl(most, isnan(g[i]) ? INFINITY : fabsl(g[i]));
    return most;
}

static void sweep(const Lines *l, Real *t)
{
    for (size_t i = 0; i < l->n; i++) {
        Point a = minus(lines_point(l, i, t), l->origin[i]), b = minus(lines_point(l, i + 2, t), l->origin[i]);
        Point d = l->direction[i];
        Real za = dot(a, d), zb = dot(b, d), ra = norm(cross(d, a)), rb = norm(cross(d, b));
        if (ra + rb > 0) t[i] = (za * rb + zb * ra) / (ra + rb);
    }
}

/* Newton's step, halved until the path gets shorter. False if it does not. */
static bool newton(const Lines *l, Real *t, Real round)
{
    size_t n = l->n;
    Real g[MOST], on[MOST], beside[MOST], step[MOST], next[MOST], length = rounded_length(l, t, round);
    derive(l, t, round, g, on, beside);
    for (size_t i = 0; i < n; i++) {
        if (i > 0) {
            on[i] -= beside[i - 1] * beside[i - 1] / on[i - 1];
            g[i] -= g[i - 1] * beside[i - 1] / on[i - 1];
        }
        if (!(on[i] > 0)) return false;
    }
    for (size_t i = n; i-- > 0;) step[i] = (-g[i] - (i + 1 < n ? beside[i] * step[i + 1] : 0)) / on[i];
    for (Real part = 1; part > 1e-15L; part /= 2) {
        for (size_t i = 0; i < n; i++) next[i] = t[i] + part * step[i];
        Real now = rounded_length(l, next, round);
        if (!(now < length || (part == 1 && now == length))) continue;
        memcpy(t, next, n * sizeof *t);
        return true;
    }
    return false;
}

static bool apart_everywhere(const Lines *l, const Real *t)
{
    for (size_t i = 0; i <= l->n; i++)
        if (apart(lines_point(l, i, t), lines_point(l, i + 1, t)) < LINES_TOGETHER) return false;
    return true;
}

/* Two lines that meet in a point: is the way through it the shortest? The length grows there in every direction (v, w) along
 * the lines if g v + h w + |v d - w e| >= 0, g and h being the slopes of the outer legs: if the dual norm of (g, h) is at most 1. */
static bool through_corner(const Lines *l)
{
    Point d = l->direction[0], e = l->direction[1], across = cross(d, e), from = minus(l->origin[1], l->origin[0]);
    Real sine2 = dot(across, across), cosine = dot(d, e);
    if (l->n != 2 || sine2 < 1e-12L || fabsl(dot(across, from)) > 1e-13L * sqrtl(sine2)) return false;
    Point corner = plus(l->origin[0], d, dot(cross(from, e), across) / sine2);
    Point a = minus(corner, l->source), b = minus(corner, l->target);
    Real g = dot(a, d) / norm(a), h = dot(b, e) / norm(b);
    return (g * g + h * h + 2 * cosine * g * h) / sine2 <= 1;
}

static const Real solved = 1e-15L; /* of the gradient; rounding leaves some 1e-18 */

bool lines_shortest(const Lines *l, Real *t)
{
    Real first[MOST];
    assert(l->n <= MOST);
    if (through_corner(l)) return false;
    memcpy(first, t, l->n * sizeof *t);
    for (int i = 0; i < SWEEPS; i++) sweep(l, t);
    for (int i = 0; i < FEW && newton(l, t, 0); i++)
        if (lines_gradient(l, t) < solved && apart_everywhere(l, t)) return true;
    memcpy(t, first, l->n * sizeof *t);
    for (Real round = 1; round > 1e-12L; round /= 32)
        for (int i = 0; i < STEPS && newton(l, t, round); i++) continue;
    if (!apart_everywhere(l, t)) return false;
    for (int i = 0; i < STEPS && newton(l, t, 0); i++) continue;
    return apart_everywhere(l, t);
}
