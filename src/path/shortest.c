/* With the legs u_i r_i (unit vectors times lengths) from point i to point i + 1 and d_i the lines' directions, the length's
 * gradient is d_i . (u_{i-1} - u_i), and its Hessian is tridiagonal: on the diagonal |d_i x u_{i-1}|^2/r_{i-1} + |d_i x u_i|^2/r_i,
 * beside it -(d_i x u_i).(d_{i+1} x u_i)/r_i.
 *
 * Where lines meet in a point the length has a corner, which traps Newton's method, whether the least is there or not. Then
 * legs are rounded off, r = sqrt(|leg|^2 + round^2), by less and less: each of these lengths is smooth and convex, and its
 * least place is the start for the next. If the last step, with nothing rounded off, finds a vanishing gradient, that is the
 * solution; if the least is at a corner there is none to be found. */
#include "path/shortest.h"

#include "keller/path.h"
#include "base/number.h"

enum {
    SWEEPS = 2,     /* of one point after the other, before all together: Newton's method then starts near */
    STEPS = 12,     /* where there is no corner it takes 3 to 7 */
    HALVINGS = 60,
    ROUNDS = 14     /* 1 to 8^-14, 2e-13, of the longest leg */
};

typedef struct {
    KellerVec3 source, target;
    size_t n;
    const EdgeLine *line;
} Problem;

typedef struct {
    double gradient[KELLER_MAX_BENDS], diagonal[KELLER_MAX_BENDS], beside[KELLER_MAX_BENDS];
    double shortest_leg, longest_leg;
} Slope;

static KellerVec3 point(const EdgeLine *line, double t) { return v3_madd(line->origin, line->direction, t); }

/* Equal angles to the line on both sides: the point divides the feet's distance as the distances from the line. False if
 * one of the two is on the line. */
static bool between(const EdgeLine *line, KellerVec3 a, KellerVec3 b, double rounding, double *t)
{
    KellerVec3 qa = v3_sub(a, line->origin), qb = v3_sub(b, line->origin);
    double za = v3_dot(qa, line->direction), zb = v3_dot(qb, line->direction);
    double pa = v3_norm(v3_madd(qa, line->direction, -za)), pb = v3_norm(v3_madd(qb, line->direction, -zb));
    if (!(pa > rounding && pb > rounding)) return false;
    *t = za + (zb - za) * (pa / (pa + pb));
    return true;
}

/* One point after the other where it is best for its neighbours. The far neighbour of the first sweep is a line's middle. */
static void sweep(const Problem *p, double *t)
{
    KellerVec3 before = p->source;
    for (size_t i = 0; i < p->n; i++) {
        KellerVec3 after = i + 1 < p->n ? point(&p->line[i + 1], t[i + 1]) : p->target;
        between(&p->line[i], before, after, 0, &t[i]);
        before = point(&p->line[i], t[i]);
    }
}

/* `round`: m, see above. */
static void slope(const Problem *p, const double *t, double round, Slope *s)
{
    KellerVec3 before = p->source;
    s->shortest_leg = INFINITY;
    s->longest_leg = 0;
    for (size_t i = 0; i < p->n; i++) s->gradient[i] = s->diagonal[i] = s->beside[i] = 0;
    for (size_t i = 0; i <= p->n; i++) { /* the leg to point i */
        KellerVec3 here = i < p->n ? point(&p->line[i], t[i]) : p->target, leg = v3_sub(here, before);
        double r = sqrt(v3_dot(leg, leg) + round * round), less = round * round / (r * r);
        KellerVec3 u = v3_scale(leg, 1 / r), across[2] = {u, u};
        s->shortest_leg = lesser(s->shortest_leg, r);
        s->longest_leg = greater(s->longest_leg, r);
        for (size_t k = 0; k < 2; k++) {
            size_t j = i - 1 + k; /* lines i - 1 and i */
            if (j >= p->n) continue;
            KellerVec3 d = p->line[j].direction;
            across[k] = v3_cross(d, u);
            s->gradient[j] += k ? v3_dot(d, u) : -v3_dot(d, u);
            s->diagonal[j] += (v3_dot(across[k], across[k]) + less) / r;
        }
        if (i > 0 && i < p->n)
            s->beside[i - 1] = -(v3_dot(across[0], across[1]) +
                                 less * v3_dot(p->line[i - 1].direction, p->line[i].direction)) / r;
        before = here;
    }
}

/* Solves the tridiagonal system for Newton's step; false where the matrix is not positive definite in floating point. */
static bool newton(size_t n, const Slope *s, double *step)
{
    double pivot[KELLER_MAX_BENDS];
    for (size_t i = 0; i < n; i++) {
        double share = i > 0 ? s->beside[i - 1] / pivot[i - 1] : 0;
        pivot[i] = s->diagonal[i] - (i > 0 ? share * s->beside[i - 1] : 0);
        if (!(pivot[i] > 1e-14 * s->diagonal[i])) return false;
        step[i] = -s->gradient[i] - (i > 0 ? share * step[i - 1] : 0);
    }
    for (size_t i = n; i-- > 0;) step[i] = (step[i] - (i + 1 < n ? s->beside[i] * step[i + 1] : 0)) / pivot[i];
    return true;
}

/* Slope of the length along the step. */
static double along(size_t n, const Slope *s, const double *step)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++) sum += s->gradient[i] * step[i];
    return sum;
}

/* Goes along the step until the slope along it has fallen to half, or is close to where it turns: on a convex function that
 * is progress, and for a full step near the solution it is so at once. */
static void advance(const Problem *p, const double *step, double round, double *t, Slope *s)
{
    double from[KELLER_MAX_BENDS], start = along(p->n, s, step), low = 0, high = 1, part = 1;
    for (size_t i = 0; i < p->n; i++) from[i] = t[i];
    for (int k = 0; k < HALVINGS; k++) {
        for (size_t i = 0; i < p->n; i++) t[i] = from[i] + part * step[i];
        slope(p, t, round, s);
        double here = along(p->n, s, step);
        if (here <= -0.5 * start || !(start < 0)) return; /* not far beyond the turning point */
        if (here < 0) low = part;
        else high = part;
        part = 0.5 * (low + high);
    }
}

/* Are the points where rays from line to line keep off the lines themselves? */
static bool is_ray(const Problem *p, const double *t, double rounding)
{
    for (size_t i = 0; i < p->n; i++) {
        KellerVec3 q = point(&p->line[i], t[i]), d = p->line[i].direction;
        KellerVec3 before = v3_sub(i > 0 ? point(&p->line[i - 1], t[i - 1]) : p->source, q);
        KellerVec3 after = v3_sub(i + 1 < p->n ? point(&p->line[i + 1], t[i + 1]) : p->target, q);
        if (!(v3_norm(v3_cross(d, before)) > rounding && v3_norm(v3_cross(d, after)) > rounding)) return false;
    }
    return true;
}

/* Do both ends of an edge lie on the other's line? */
static bool in_one_line(const EdgeLine *a, const EdgeLine *b, double rounding)
{
    for (int i = 0; i < 2; i++) {
        KellerVec3 end = v3_sub(point(b, i * b->length), a->origin);
        if (v3_norm(v3_cross(a->direction, end)) > rounding) return false;
    }
    return true;
}

/* Newton's method, at most STEPS steps; false if it has not converged. */
static bool descend(const Problem *p, double round, double *t, Slope *s)
{
    double last = INFINITY;
    slope(p, t, round, s);
    for (int k = 0; k < STEPS; k++) {
        double step[KELLER_MAX_BENDS], most = 0, scale = s->longest_leg;
        if (!(s->shortest_leg > 0)) return false;
        if (!newton(p->n, s, step)) { /* a leg along a line, for now */
            sweep(p, t);
            slope(p, t, round, s);
            continue;
        }
        for (size_t i = 0; i < p->n; i++) {
            most = greater(most, fabs(step[i]));
            scale = greater(scale, fabs(t[i]));
        }
        /* converged: a step of rounding, or steps that rounding no longer lets shrink */
        if (most <= 4 * 0x1p-52 * scale || (most <= 1e-10 * scale && most > 0.5 * last)) return true;
        last = most;
        advance(p, step, round, t, s);
    }
    return false;
}

bool path_shortest(KellerVec3 source, KellerVec3 target, size_t n, const EdgeLine *line, double rounding, double *t)
{
    if (n == 1) return between(line, source, target, rounding, t);
    EdgeLine near[KELLER_MAX_BENDS]; /* what is left of the coordinates' size costs digits */
    Problem p = {v3_sub(source, line[0].origin), v3_sub(target, line[0].origin), n, near};
    for (size_t i = 0; i < n; i++) {
        near[i] = line[i];
        near[i].origin = v3_sub(line[i].origin, line[0].origin);
        t[i] = 0.5 * line[i].length;
        if (i > 0 && in_one_line(&near[i - 1], &near[i], rounding)) return false;
    }
    for (int k = 0; k < SWEEPS; k++) sweep(&p, t);
    Slope s;
    bool found = descend(&p, 0, t, &s);
    if (!found) {
        for (size_t i = 0; i < n; i++) t[i] = 0.5 * line[i].length;
        slope(&p, t, 0, &s);
        double round = s.longest_leg;
        for (int k = 0; k < ROUNDS; k++, round /= 8) descend(&p, round, t, &s);
        found = descend(&p, 0, t, &s);
    }
    double unlike = 0;
    for (size_t i = 0; i < n; i++) unlike = greater(unlike, fabs(s.gradient[i]));
    return found && s.shortest_leg > rounding && unlike <= KELLER_BOUNDARY_ANGLE + rounding / s.shortest_leg &&
           is_ray(&p, t, rounding);
}
