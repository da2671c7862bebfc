/* keller-bench-stability -- where the printed formulas of the cone paper fail and what the kernel makes of the same
 * cases: the numbers and pictures of docs/numerics.md.
 *
 * usage: keller-bench-stability [--csv] [--cases N] [--seed N]
 *        keller-bench-stability --sweeps FOLDER | --examples
 *
 * The first form runs the paper's listings 1 to 5 (listings.h), in single and in double precision, and keller/cone.h
 * over the same cases, those of tests/stability with every family as often as any other, and prints by family and by
 * decade of the half-angle:
 *   missed      the truth (cone_oracle.h) is yes, the answer no
 *   false_yes   the other way round
 *   short       the reported range leaves out a part of the true one
 *   clearly     the same, and it is not rounding of single precision: missed though a cone that is narrower, and a clip
 *               range that is shorter, by 2^-20 of the coordinates is met; yes though a wider one is not; short by more
 *               than 2^-20 of what the narrower one takes
 *   short_eps, long_eps   the largest of what the range leaves out or takes too much, in units of 2^-23 times how far
 *               the primitive reaches from the cone's origin
 * Coordinates, x0, e and the tangent are rounded to single precision beforehand, so that single precision is charged
 * for its arithmetic, not for its input; the cone's axes and a plane's normal are not, as they would no longer be of
 * unit length.
 *
 * The second form writes the sweeps behind the pictures, numerics-NAME.csv (sweeps.h); tools/numerics.sh draws them.
 * Status 1 if the kernel misses anything, 2 on wrong usage. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../tests/stability/cone_check.h"
#include "base/number.h"
#include "sweeps.h"

enum { TESTS = 5 };
static const ConeKind kinds[TESTS] = {CONE_PLANE, CONE_EDGE, CONE_TRIANGLE, CONE_BOX, CONE_BOX8};
static const char *const family_names[CONE_FAMILIES] = {
    "random",          "tangent",    "through apex",   "on a generator", "parallel to the axis", "near a generator",
    "on the envelope", "degenerate", "clip at vertex", "at the origin",  "with the axis",        "behind the apex"};

typedef struct {
    uint64_t cases, met, missed, missed_clearly, false_yes, false_yes_clearly, too_short, short_clearly;
    double short_eps, long_eps;
} Tally;

/* Through memory: gcc 12 drops the conversion there and back where it makes vectors of two (-O2, SLP). */
static double to_float(double a)
{
    volatile float f = (float)a;
    return (double)f;
}
static KellerVec3 to_floats(KellerVec3 a) { return v3(to_float(a.x), to_float(a.y), to_float(a.z)); }

static void round_case(ConeKind kind, ConeCase *c)
{
    KellerCone *k = &c->cone;
    k->origin = to_floats(k->origin);
    k->x0 = to_float(k->x0);
    k->tan_alpha = to_float(k->tan_alpha);
    k->e = to_float(k->e);
    k->z_near = to_float(k->z_near);
    k->z_far = to_float(k->z_far);
    c->clip = (KellerRange){to_float(c->clip.near), to_float(c->clip.far)};
    c->offset = to_float(c->offset);
    for (int i = kind == CONE_PLANE; i < 3; i++) c->v[i] = to_floats(c->v[i]);
}

static ConeTruth truth_of(const ConeOracle *o, ConeKind kind, const ConeCase *c)
{
    const KellerVec3 *v = c->v;
    switch (kind) {
    case CONE_PLANE:
        return o->plane(&c->cone, v[0], c->offset, c->clip, 0);
    case CONE_EDGE:
        return o->edge(&c->cone, v[0], v[1], c->clip, 0);
    case CONE_TRIANGLE:
        return o->triangle(&c->cone, v[0], v[1], v[2], c->clip, 0);
    default:
        return o->box(&c->cone, v[0], v[1], c->clip, 0);
    }
}

static double scale_of(ConeKind kind, const ConeCase *c, const ConeTruth *truth)
{
    const KellerVec3 *v = c->v;
    double scale = c->cone.x0;
    if (kind == CONE_PLANE) {
        scale = greater(scale, greater(fabs(c->offset), v3_norm(c->cone.origin)));
        if (truth->met && truth->near < scale * 0x1p23) scale = greater(scale, (double)truth->near);
        if (truth->met && truth->far < scale * 0x1p23) scale = greater(scale, (double)truth->far);
        return scale;
    }
    int count = kind == CONE_EDGE ? 2 : kind == CONE_TRIANGLE ? 3 : 8;
    for (int i = 0; i < count; i++) {
        KellerVec3 p = count < 8 ? v[i] : v3(v[i & 1].x, v[i >> 1 & 1].y, v[i >> 2].z);
        scale = greater(scale, v3_distance(p, c->cone.origin));
    }
    return scale;
}

/* A plane's range is without end: there the angle counts too. */
static ConeTruth changed(ConeKind kind, const ConeCase *c, double by, double scale)
{
    ConeCase other = *c;
    other.cone.x0 += by * ((c->cone.e + c->cone.tan_alpha) * scale + c->cone.x0);
    if (kind == CONE_PLANE) other.cone.tan_alpha = greater(0, other.cone.tan_alpha + by * (1 + c->cone.tan_alpha));
    other.cone.z_near -= by * scale;
    other.cone.z_far += by * scale;
    other.clip.near -= by * scale;
    other.clip.far += by * scale;
    return truth_of(&cone_oracle_long, kind, &other);
}

/* What is further away is taken for infinitely far. */
static double within(double a, double most) { return greater(-most, lesser(a, most)); }

/* `bound`: only the near end is reported. */
static void judge(Tally *t, ConeKind kind, const ConeCase *c, KellerRange r, bool exact, bool bound)
{
    ConeTruth truth = truth_of(&cone_oracle_long, kind, c);
    bool found = r.near <= r.far;
    double scale = greater(scale_of(kind, c, &truth), 1e-300), most = scale * 0x1p23, unit = scale * 0x1p-23;
    double left_out = 0, too_much = 0;
    for (int again = 0; again < 2; again++) {
        double near = within(r.near, most) - within((double)truth.near, most),
               far = within((double)truth.far, most) - within(r.far, most);
        if (exact) { /* not even by the rounding of the difference */
            if (r.near <= truth.near) near = lesser(near, 0);
            if (r.far >= truth.far) far = lesser(far, 0);
        }
        left_out = bound ? near : greater(near, far);
        too_much = bound ? -near : greater(-near, -far);
        if (!exact || !truth.met || (found && left_out <= 0)) break;
        truth = truth_of(&cone_oracle_quad, kind, c);
    }
    t->cases++;
    t->met += truth.met;
    t->missed += truth.met && !found;
    t->false_yes += !truth.met && found;
    if (truth.met && !found) t->missed_clearly += changed(kind, c, -0x1p-20, scale).met;
    if (!truth.met && found) t->false_yes_clearly += !changed(kind, c, 0x1p-20, scale).met;
    if (!truth.met || !found) return;
    t->long_eps = greater(t->long_eps, too_much / unit);
    if (left_out <= 0) return;
    t->too_short++;
    t->short_eps = greater(t->short_eps, left_out / unit);
    ConeTruth narrow = changed(kind, c, -0x1p-20, scale);
    if (!narrow.met) return;
    double by = 0x1p-20 * scale;
    t->short_clearly +=
        r.near > narrow.near + by || (!bound && lesser(r.far, most) < lesser((double)narrow.far, most) - by);
}

static void add(Tally *sum, const Tally *t)
{
    sum->cases += t->cases;
    sum->met += t->met;
    sum->missed += t->missed;
    sum->missed_clearly += t->missed_clearly;
    sum->false_yes += t->false_yes;
    sum->false_yes_clearly += t->false_yes_clearly;
    sum->too_short += t->too_short;
    sum->short_clearly += t->short_clearly;
    sum->short_eps = greater(sum->short_eps, t->short_eps);
    sum->long_eps = greater(sum->long_eps, t->long_eps);
}

static KellerRange listed(const Listings *l, ConeKind kind, const ConeCase *c)
{
    const KellerVec3 *v = c->v;
    switch (kind) {
    case CONE_PLANE:
        return l->plane(&c->cone, v[0], c->offset, c->clip);
    case CONE_EDGE:
        return l->edge(&c->cone, v[0], v[1], c->clip);
    case CONE_TRIANGLE:
        return l->triangle(&c->cone, v[0], v[1], v[2], c->clip);
    default:
        return l->box(&c->cone, v[0], v[1], c->clip);
    }
}

static void one(ConeKind kind, uint64_t seed, uint64_t index, Tally t[METHODS], int *decade)
{
    ConeCase c = cone_case(kind, seed, index, -1, -1, (int)(index % CONE_FAMILIES));
    round_case(kind, &c);
    *decade = c.decade;
    ConeAnswer a = cone_ask(kind, &c);
    judge(&t[0], kind, &c, listed(&listings_float, kind, &c), false, false);
    judge(&t[1], kind, &c, listed(&listings_double, kind, &c), false, false);
    judge(&t[2], kind, &c, a.range, true, false);
}

/* Listing 5 knows no near plane: z from 0 to infinity. */
static void eight(uint64_t seed, uint64_t index, Tally t[METHODS], int *decade)
{
    ConeCase8 c8 = cone_case8(CONE_BOX8, seed, index, -1, -1, (int)(index % CONE_FAMILIES));
    ConeCase *c = &c8.one;
    c->cone.z_near = 0;
    c->cone.z_far = INFINITY;
    c->clip = (KellerRange){0, INFINITY};
    round_case(CONE_BOX8, c);
    *decade = c->decade;
    for (int i = 0; i < 8; i++) /* no empty lanes */
        if (c8.boxes.lower[0][i] > c8.boxes.upper[0][i]) c8.boxes.lower[0][i] = c8.boxes.upper[0][i];
    KellerConeLanes lanes = keller_cone_lanes(&c->cone, c->clip, c8.size);
    _Alignas(32) float near[8];
    double distance[METHODS][8];
    uint32_t mask[METHODS] = {listings_float.box8(&c->cone, &c8.boxes, INFINITY, distance[0]),
                              listings_double.box8(&c->cone, &c8.boxes, INFINITY, distance[1]),
                              keller_cone_meets_box8(&lanes, &c8.boxes, near)};
    for (int i = 0; i < 8; i++) {
        distance[2][i] = (double)near[i];
        c->v[0] = v3((double)c8.boxes.lower[0][i], (double)c8.boxes.lower[1][i], (double)c8.boxes.lower[2][i]);
        c->v[1] = v3((double)c8.boxes.upper[0][i], (double)c8.boxes.upper[1][i], (double)c8.boxes.upper[2][i]);
        for (int m = 0; m < METHODS; m++) {
            bool found = mask[m] >> i & 1;
            KellerRange r = {found ? distance[m][i] : INFINITY, found ? INFINITY : -INFINITY};
            judge(&t[m], CONE_BOX, c, r, m == 2, true);
        }
    }
}

static void print(bool csv, const char *test, const char *by, const char *group, const char *method, const Tally *t)
{
    const char *form = csv ? "%s,%s,%s,%s,%llu,%llu,%llu,%llu,%llu,%llu,%llu,%llu,%.3g,%.3g\n"
                           : "%-10s %-10s %-20s %-16s %8llu %8llu %7llu %7llu %7llu %7llu %7llu %7llu %9.2g %9.2g\n";
    printf(form, test, by, group, method, (unsigned long long)t->cases, (unsigned long long)t->met,
           (unsigned long long)t->missed, (unsigned long long)t->missed_clearly, (unsigned long long)t->false_yes,
           (unsigned long long)t->false_yes_clearly, (unsigned long long)t->too_short,
           (unsigned long long)t->short_clearly, t->short_eps, t->long_eps);
}

static bool tables(bool csv, uint64_t cases, uint64_t seed)
{
    bool ok = true;
    if (csv)
        puts("test,by,group,method,cases,met,missed,missed_clearly,false_yes,false_yes_clearly,short,short_clearly,"
             "short_eps,"
             "long_eps");
    else
        puts("test       by         group                method              cases      met  missed clearly   false "
             "clearly"
             "   short clearly short_eps  long_eps");
    for (int k = 0; k < TESTS; k++) {
        static Tally family[CONE_FAMILIES][METHODS], decade[CONE_DECADES][METHODS], all[METHODS];
        memset(family, 0, sizeof family);
        memset(decade, 0, sizeof decade);
        memset(all, 0, sizeof all);
        bool wide = kinds[k] == CONE_BOX8;
        for (uint64_t i = 0; i < (wide ? cases / 8 : cases); i++) {
            Tally t[METHODS] = {{0}};
            int row;
            if (wide)
                eight(seed, i, t, &row);
            else
                one(kinds[k], seed, i, t, &row);
            for (int m = 0; m < METHODS; m++) {
                add(&family[i % CONE_FAMILIES][m], &t[m]);
                add(&decade[row][m], &t[m]);
                add(&all[m], &t[m]);
            }
        }
        const char *test = cone_kind_names[kinds[k]];
        for (int m = 0; m < METHODS; m++) print(csv, test, "all", "all", method_names[m], &all[m]);
        for (int f = 0; f < CONE_FAMILIES; f++)
            for (int m = 0; m < METHODS; m++)
                print(csv, test, "family", family_names[f], method_names[m], &family[f][m]);
        for (int d = 0; d < CONE_DECADES; d++)
            for (int m = 0; m < METHODS; m++)
                print(csv, test, "half_angle", cone_decade_names[d], method_names[m], &decade[d][m]);
        ok &= all[2].missed == 0 && all[2].too_short == 0;
    }
    return ok;
}

int main(int argc, char **argv)
{
    bool csv = false;
    uint64_t cases = 120000, seed = 5;
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--csv") == 0)
            csv = true;
        else if (strcmp(argv[i], "--cases") == 0 && i + 1 < argc)
            cases = (uint64_t)strtod(argv[++i], NULL);
        else if (strcmp(argv[i], "--seed") == 0 && i + 1 < argc)
            seed = strtoull(argv[++i], NULL, 10);
        else if (strcmp(argv[i], "--examples") == 0)
            return examples(), 0;
        else if (strcmp(argv[i], "--sweeps") == 0 && i + 1 < argc)
            return sweeps(argv[i + 1]) ? 0 : 1;
        else {
            fprintf(stderr, "usage: %s [--csv] [--cases N] [--seed N] | --sweeps FOLDER | --examples; found %s\n",
                    argv[0], argv[i]);
            return 2;
        }
    }
    return tables(csv, cases, seed) ? 0 : 1;
}
