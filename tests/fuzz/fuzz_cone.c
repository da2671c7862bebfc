/* Bytes as a case of one of the tests of keller/cone.h, held against the 113-bit oracle: a false negative, a range
 * that leaves out a part of the true one, or forms that disagree, abort. The bytes choose each number from small
 * integers and powers of two, from numbers used before (exactly, or some units beside), and from raw doubles, so
 * that coincidences, tangencies and degenerate primitives are common and yet every double of the documented domain
 * can be reached. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../stability/cone_check.h"
#include "base/number.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

typedef struct {
    const uint8_t *data;
    size_t left;
    double used[16]; /* numbers drawn before, for coincidences */
    unsigned count;
    double limit; /* of a magnitude */
} Bytes;

static unsigned byte(Bytes *b)
{
    if (b->left == 0) return 0;
    b->left--;
    return *b->data++;
}

static double raw(Bytes *b)
{
    uint64_t bits = 0;
    double a;
    for (int i = 0; i < 8; i++) bits = bits << 8 | byte(b);
    memcpy(&a, &bits, sizeof a);
    return a;
}

static double nudged(double a, int units)
{
    for (; units > 0; units--) a = nextafter(a, INFINITY);
    for (; units < 0; units++) a = nextafter(a, -INFINITY);
    return a;
}

/* Finite and below the limit. What is closer to 0 than the limit's inverse is 0: docs/numerics.md, limits. */
static double within(double a, double limit)
{
    if (isnan(a) || fabs(a) < 1 / limit) return 0;
    return fabs(a) < limit ? a : copysign(limit * 0.99, a);
}

static double number(Bytes *b)
{
    unsigned how = byte(b);
    int small = (int8_t)byte(b);
    double last = b->used[how >> 4], a;
    switch (how & 15) {
    case 0:
    case 1:
    case 2:
        a = small % 8;
        break;
    case 3:
        a = small / 16.0;
        break;
    case 4:
        a = ldexp(1, small % 60);
        break;
    case 5:
        a = ldexp(-1, small % 60);
        break;
    case 6:
        a = small * ldexp(1, (int8_t)byte(b) % 100);
        break;
    case 7:
    case 8:
        a = last;
        break;
    case 9:
        a = -last;
        break;
    case 10:
        a = nudged(last, small % 5);
        break;
    case 11:
        a = last * (small / 8.0);
        break;
    case 12:
        a = last + ldexp(small, -40);
        break;
    case 13: /* a raw fraction, a moderate exponent */
        a = raw(b);
        a = isfinite(a) && a != 0 ? ldexp(frexp(a, &small), small % 40) : 0;
        break;
    default:
        a = raw(b);
    }
    a = within(a, b->limit);
    b->used[b->count++ % 16] = a;
    return a;
}

static KellerVec3 vector(Bytes *b)
{
    double x = number(b), y = number(b);
    return v3(x, y, number(b));
}

/* A unit vector to rounding; a longest component of 1 first, so that nothing overflows. Zero becomes an axis. */
static KellerVec3 unit(KellerVec3 a)
{
    double most = greater(fabs(a.x), greater(fabs(a.y), fabs(a.z)));
    return most > 0 ? v3_unit(v3_unit(v3_scale(a, 1 / most))) : v3(0, 0, 1);
}

static KellerVec3 direction(Bytes *b)
{
    static const double exact[][3] = {
        {0.6, 0.8, 0}, {0.28, 0.96, 0}, {2 / 3.0, 2 / 3.0, 1 / 3.0}, {3 / 7.0, 6 / 7.0, 2 / 7.0}};
    unsigned how = byte(b);
    const double *d = exact[how >> 3 & 3];
    double s = how & 128 ? -1 : 1;
    switch (how & 7) {
    case 0:
        return v3(s, 0, 0);
    case 1:
        return v3(0, s, 0);
    case 2:
        return v3(0, 0, s);
    case 3:
        return unit(v3(d[0], s * d[1], d[2]));
    case 4:
        return unit(v3(d[2], d[0], s * d[1]));
    default:
        return unit(vector(b));
    }
}

static void draw_cone(Bytes *b, bool eight, ConeCase *c)
{
    /* half-angles to pi/2, eccentricities below 1 (keller_cone_elliptic); the lanes' limits are in cone_lanes.c */
    double most_tan = eight ? 1e4 : 1.6e16, most_e = eight ? 2300 : 6.8e7;
    KellerCone *k = &c->cone;
    k->directrix = direction(b);
    KellerVec3 side = v3_cross(v3_cross(k->directrix, direction(b)), k->directrix);
    k->major = v3_norm(side) > 1e-3 ? unit(side) : v3_perpendicular(k->directrix);
    k->minor = v3_cross(k->directrix, k->major);
    k->origin = byte(b) & 1 ? vector(b) : v3(0, 0, 0);
    k->x0 = byte(b) & 1 ? fabs(number(b)) : 0;
    k->tan_alpha = byte(b) & 3 ? lesser(fabs(number(b)), most_tan) : 0;
    k->e = byte(b) & 1 ? greater(1, lesser(fabs(number(b)), most_e)) : 1;
    unsigned how = byte(b);
    k->z_near = how & 1 ? fabs(number(b)) : 0;
    k->z_far = how & 2 ? k->z_near + fabs(number(b)) : INFINITY;
    c->clip = (KellerRange){how & 4 ? number(b) : how & 8 ? -INFINITY : 0, INFINITY};
    if (how & 16) c->clip.far = how & 32 ? c->clip.near : number(b);
}

/* A vertex: plainly; in the cone's frame; on the envelope; another vertex, or between two; the origin. */
static KellerVec3 vertex(Bytes *b, const ConeCase *c, int known)
{
    const KellerCone *k = &c->cone;
    unsigned how = byte(b);
    KellerVec3 p, a = c->v[known > 0 ? (how >> 4) % (unsigned)known : 0];
    switch (how & 7) {
    case 0:
    case 1:
        p = vector(b);
        break;
    case 2:
        if (known > 0) return a;
        return k->origin;
    case 3:
        p = v3_madd(a, v3_sub(c->v[0], a), number(b));
        break;
    case 4: {
        double z = number(b), R = z * k->tan_alpha + k->x0, s = (how >> 3 & 1) ? -R : R;
        if (how & 16)
            p = v3(s, 0, z);
        else if (how & 32)
            p = v3(0, s, z);
        else
            p = v3(0.6 * s, 0.8 * R, z);
        p = v3_madd(v3_madd(v3_madd(k->origin, k->directrix, p.z), k->major, p.x), k->minor, p.y / k->e);
        break;
    }
    default: {
        double x = number(b), y = number(b), z = number(b);
        p = v3_madd(v3_madd(v3_madd(k->origin, k->directrix, z), k->major, x), k->minor, y / k->e);
    }
    }
    return v3(within(p.x, b->limit), within(p.y, b->limit), within(p.z, b->limit));
}

static void order(double *a, double *b)
{
    double low = lesser(*a, *b), high = greater(*a, *b);
    *a = low;
    *b = high;
}

static void draw_primitive(Bytes *b, ConeKind kind, ConeCase *c)
{
    for (int i = 0; i < 3; i++) c->v[i] = vertex(b, c, i);
    if (kind == CONE_BOX || kind == CONE_CONTAINS_BOX || kind == CONE_BOX8 || kind == CONE_CORNERS ||
        kind == CONE_INSIDE_BOX8) {
        order(&c->v[0].x, &c->v[1].x);
        order(&c->v[0].y, &c->v[1].y);
        order(&c->v[0].z, &c->v[1].z);
    }
    if (kind == CONE_LINE) {
        c->v[1] = byte(b) & 1 ? direction(b) : v3_sub(c->v[1], c->v[0]);
        if (c->v[1].x == 0 && c->v[1].y == 0 && c->v[1].z == 0) c->v[1] = v3(0, 0, 1);
    }
    if (kind == CONE_PLANE) {
        KellerVec3 n =
            byte(b) & 1 ? direction(b) : unit(v3_cross(unit(v3_sub(c->v[1], c->v[0])), unit(v3_sub(c->v[2], c->v[0]))));
        c->offset = within(v3_dot(n, c->v[0]), b->limit);
        c->v[0] = n;
    }
}

static void eight(Bytes *b, ConeKind kind, ConeTally *t, ConeCase8 *c)
{
    c->size = 0;
    for (int i = 0; i < 8; i++) {
        /* a lane for which no bytes are left repeats the first */
        if (i == 0 || b->left > 0) draw_primitive(b, kind, &c->one);
        for (int j = 0; j < 3; j++) {
            const double p[3] = {c->one.v[j].x, c->one.v[j].y, c->one.v[j].z};
            for (int k = 0; k < 3; k++) {
                float f = (float)p[k];
                c->vertices[j].p[k][i] = f;
                if (j == 0) c->boxes.lower[k][i] = f;
                if (j == 1) c->boxes.upper[k][i] = f;
                c->size = greater(c->size, fabs((double)f));
            }
        }
    }
    cone_check8(kind, c, true, t);
}

static void print_cone(ConeKind kind, const ConeCase *c, const ConeAnswer *a, const ConeTally *t)
{
    const KellerVec3 *v = c->v;
    ConeTruth u = {0};
    if (kind == CONE_PLANE) u = cone_oracle_quad.plane(&c->cone, v[0], c->offset, c->clip, 0);
    if (kind == CONE_LINE) u = cone_oracle_quad.line(&c->cone, v[0], v[1], c->clip, 0);
    if (kind == CONE_EDGE) u = cone_oracle_quad.edge(&c->cone, v[0], v[1], c->clip, 0);
    if (kind == CONE_TRIANGLE) u = cone_oracle_quad.triangle(&c->cone, v[0], v[1], v[2], c->clip, 0);
    if (kind == CONE_BOX) u = cone_oracle_quad.box(&c->cone, v[0], v[1], c->clip, 0);
    cone_case_print(kind, c);
    printf("# truth: met %d, range %La %La\n", u.met, u.near, u.far);
    printf("# missed %d, too short %d, Boolean missed %d, disagree %d; range %a %a\n", (int)t->missed,
           (int)t->too_short, (int)t->yes_missed, (int)t->disagree, a->range.near, a->range.far);
    fflush(stdout);
    abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 4) return 0;
    ConeKind kind = (ConeKind)(data[0] % CONE_KINDS);
    bool lanes = kind >= CONE_BOX8;
    Bytes b = {data + 1, size - 1, {1, 0.5, 0.25, 0.75, 1e-3, 100}, 6, lanes ? 1e15 : 1e100};
    ConeTally t = cone_tally_zero;
    ConeCase8 c8;
    memset(&c8, 0, sizeof c8);
    ConeCase *c = &c8.one;
    ConeAnswer a = {0};
    draw_cone(&b, lanes, c);
    if (lanes) {
        eight(&b, kind, &t, &c8);
    } else {
        draw_primitive(&b, kind, c);
        a = cone_ask(kind, c);
        cone_judge(kind, c, &a, true, &t);
    }
    if (cone_tally_wrong(&t)) print_cone(kind, c, &a, &t);
    return 0;
}
