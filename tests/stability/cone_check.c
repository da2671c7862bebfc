#include "cone_check.h"

#include <omp.h>
#include <stdio.h>
#include <string.h>

#include "../scalar/cone_scalar.h"
#include "base/number.h"
#include "cone_distance.h"

const char *const cone_kind_names[CONE_KINDS] = {
    "plane",
    "line",
    "edge",
    "triangle",
    "box",
    "contains",
    "contains_triangle",
    "contains_box",
    "meets_box8",
    "contains_vertex8",
    "contains_corners",
    "contained_triangle8",
    "meets_triangle8",
    "pierces_triangle8",
    "meets_edge8",
    "contains_box8"};

const ConeTally cone_tally_zero = {.first_wrong = UINT64_MAX};

void cone_tally_add(ConeTally *sum, const ConeTally *t)
{
    sum->cases += t->cases;
    sum->met += t->met;
    sum->missed += t->missed;
    sum->too_short += t->too_short;
    sum->false_positive += t->false_positive;
    sum->yes_missed += t->yes_missed;
    sum->yes_false += t->yes_false;
    sum->disagree += t->disagree;
    sum->scalar_differs += t->scalar_differs;
    sum->range_error = greater(sum->range_error, t->range_error);
    sum->plain_error = greater(sum->plain_error, t->plain_error);
    sum->point_error = greater(sum->point_error, t->point_error);
    if (t->first_wrong < sum->first_wrong) sum->first_wrong = t->first_wrong;
}

/* ---- the kernel -------------------------------------------------------------------------------------------------- */

/* The same for the kernel and its scalar build. */
#define ASK(name, prefix)                                                                                              \
    ConeAnswer name(ConeKind kind, const ConeCase *c)                                                                  \
    {                                                                                                                  \
        const KellerCone *k = &c->cone;                                                                                \
        const KellerVec3 *v = c->v;                                                                                    \
        ConeAnswer a = {0};                                                                                            \
        switch ((int)kind) {                                                                                           \
        case CONE_PLANE:                                                                                               \
            a.range = prefix##_plane(k, v[0], c->offset, c->clip, &a.nearest, &a.farthest);                            \
            a.yes = prefix##_meets_plane(k, v[0], c->offset, c->clip);                                                 \
            break;                                                                                                     \
        case CONE_LINE:                                                                                                \
            a.range = prefix##_line(k, v[0], v[1], c->clip, &a.nearest, &a.farthest);                                  \
            a.yes = prefix##_meets_line(k, v[0], v[1], c->clip);                                                       \
            break;                                                                                                     \
        case CONE_EDGE:                                                                                                \
            a.range = prefix##_edge(k, v[0], v[1], c->clip, &a.nearest, &a.farthest);                                  \
            a.yes = prefix##_meets_edge(k, v[0], v[1], c->clip);                                                       \
            break;                                                                                                     \
        case CONE_TRIANGLE:                                                                                            \
            a.range = prefix##_triangle(k, v[0], v[1], v[2], c->clip, &a.nearest, &a.farthest);                        \
            a.yes = prefix##_meets_triangle(k, v[0], v[1], v[2], c->clip);                                             \
            break;                                                                                                     \
        case CONE_BOX:                                                                                                 \
            a.range = prefix##_box(k, v[0], v[1], c->clip, &a.nearest, &a.farthest);                                   \
            a.yes = prefix##_meets_box(k, v[0], v[1], c->clip);                                                        \
            break;                                                                                                     \
        case CONE_CONTAINS:                                                                                            \
            a.yes = prefix##_contains(k, v[0]);                                                                        \
            break;                                                                                                     \
        case CONE_CONTAINS_TRIANGLE:                                                                                   \
            a.yes = prefix##_contains_triangle(k, v[0], v[1], v[2]);                                                   \
            break;                                                                                                     \
        case CONE_CONTAINS_BOX:                                                                                        \
            a.yes = prefix##_contains_box(k, v[0], v[1]);                                                              \
            break;                                                                                                     \
        }                                                                                                              \
        return a;                                                                                                      \
    }
ASK(cone_ask, keller_cone)
static ASK(ask_scalar, keller_scalar_cone)

    static bool same_bits(const ConeAnswer *a, const ConeAnswer *b)
{
    return a->yes == b->yes && memcmp(&a->range, &b->range, sizeof a->range) == 0 &&
           memcmp(&a->nearest, &b->nearest, sizeof a->nearest) == 0 &&
           memcmp(&a->farthest, &b->farthest, sizeof a->farthest) == 0;
}

/* ---- the truth --------------------------------------------------------------------------------------------------- */

static KellerVec3 corner(const KellerVec3 bound[2], int i)
{
    return v3(bound[i & 1].x, bound[i >> 1 & 1].y, bound[i >> 2].z);
}

static ConeTruth truth_of(const ConeOracle *o, ConeKind kind, const ConeCase *c, double grow)
{
    const KellerCone *k = &c->cone;
    const KellerVec3 *v = c->v;
    switch (kind) {
    case CONE_PLANE:
        return o->plane(k, v[0], c->offset, c->clip, grow);
    case CONE_LINE:
        return o->line(k, v[0], v[1], c->clip, grow);
    case CONE_EDGE:
    case CONE_LEAF_EDGE8:
        return o->edge(k, v[0], v[1], c->clip, grow);
    case CONE_TRIANGLE:
    case CONE_LEAF_TRIANGLE8:
    case CONE_PIERCED_TRIANGLE8:
        return o->triangle(k, v[0], v[1], v[2], c->clip, grow);
    case CONE_BOX:
    case CONE_BOX8:
        return o->box(k, v[0], v[1], c->clip, grow);
    default:
        break;
    }
    ConeTruth all = {true, 0, 0}; /* containment */
    bool box = kind == CONE_CONTAINS_BOX || kind == CONE_CORNERS || kind == CONE_INSIDE_BOX8;
    int count = box ? 8 : kind == CONE_CONTAINS || kind == CONE_VERTEX8 ? 1 : 3;
    for (int i = 0; i < count && all.met; i++) all.met = o->contains(k, box ? corner(v, i) : v[i], grow);
    return all;
}

/* What errors are measured against: how far the primitive reaches from the cone's origin, and x0. A plane's offset is
 * from the world's origin; of what has no end, as far as the range goes. */
static double scale_of(ConeKind kind, const ConeCase *c, const ConeTruth *truth)
{
    double scale = c->cone.x0, ends[2] = {(double)truth->near, (double)truth->far};
    if (kind == CONE_PLANE) scale = greater(scale, greater(fabs(c->offset), v3_norm(c->cone.origin)));
    if (kind == CONE_BOX)
        for (int i = 0; i < 8; i++) scale = greater(scale, v3_distance(corner(c->v, i), c->cone.origin));
    else if (kind != CONE_PLANE)
        for (int i = 0; i < (kind == CONE_LINE ? 1 : kind == CONE_EDGE ? 2 : 3); i++)
            scale = greater(scale, v3_distance(c->v[i], c->cone.origin));
    if (kind == CONE_PLANE || kind == CONE_LINE)
        for (int i = 0; i < 2; i++)
            if (fabs(ends[i]) < scale * 0x1p23) scale = greater(scale, fabs(ends[i]));
    return scale;
}

/* How far a reported point is from the primitive, outside the cone, and beyond the reported and the true end of the
 * range. */
static double point_error(ConeKind kind, const ConeCase *c, KellerVec3 p, double end, long double true_end)
{
    long double z = cone_oracle_long.z(&c->cone, p), low = fminl(end, true_end), high = fmaxl(end, true_end);
    double off = greater((double)fmaxl(low - z, z - high), (double)cone_oracle_long.outside(&c->cone, p));
    switch (kind) {
    case CONE_PLANE:
        return greater(off, distance_to_plane(p, c->v[0], c->offset));
    case CONE_LINE:
        return greater(off, distance_to_line(p, c->v[0], c->v[1], -INFINITY, INFINITY));
    case CONE_EDGE:
        return greater(off, distance_to_line(p, c->v[0], v3_sub(c->v[1], c->v[0]), 0, 1));
    case CONE_TRIANGLE:
        return greater(off, distance_to_triangle(p, c->v));
    default:
        return greater(off, distance_to_box(p, c->v[0], c->v[1]));
    }
}

/* By how much the range reaches beyond the true one; what lies 2^23 scales away is taken for infinitely far. */
static double excess(KellerRange r, const ConeTruth *truth, double scale)
{
    double end = scale * 0x1p23, near = truth->near < end ? (double)(truth->near - r.near) : 0;
    return greater(near, lesser(r.far, end) - lesser((double)truth->far, end));
}

static void measure(ConeKind kind, const ConeCase *c, const ConeAnswer *a, const ConeTruth *truth, ConeTally *t)
{
    double scale = greater(scale_of(kind, c, truth), 1e-300), unit = scale * 0x1p-23, end = scale * 0x1p23;
    double plain = excess(a->range, truth, scale) / unit, error = plain;
    if (plain > 1e-3) { /* where the slack moves the end of the range far, that is no error */
        ConeCase wide = *c;
        wide.cone.x0 += 4 * KELLER_CONE_SLACK * ((c->cone.e + c->cone.tan_alpha) * scale + c->cone.x0);
        ConeTruth most = truth_of(&cone_oracle_long, kind, &wide, 0);
        if (most.met) error = greater(0, excess(a->range, &most, scale) / unit);
    }
    if (c->family == CONE_RANDOM) t->plain_error = greater(t->plain_error, plain);
    t->range_error = greater(t->range_error, error);
    if (fabs(a->range.near) < end)
        t->point_error = greater(t->point_error, point_error(kind, c, a->nearest, a->range.near, truth->near) / unit);
    if (fabs(a->range.far) < end)
        t->point_error = greater(t->point_error, point_error(kind, c, a->farthest, a->range.far, truth->far) / unit);
}

/* ---- judgement --------------------------------------------------------------------------------------------------- */

static bool covers(KellerRange r, const ConeTruth *t) { return !t->met || (r.near <= t->near && r.far >= t->far); }

void cone_judge(ConeKind kind, const ConeCase *c, const ConeAnswer *a, bool quad, ConeTally *t)
{
    bool ranged = kind <= CONE_BOX, found = ranged ? a->range.near <= a->range.far : a->yes;
    ConeTruth truth =
        quad ? truth_of(&cone_oracle_quad, kind, c, 0) : truth_of(&cone_oracle_long, kind, c, CONE_ORACLE_GROW);
    if (!quad && truth.met && (!found || !a->yes || (ranged && !covers(a->range, &truth))))
        truth = truth_of(&cone_oracle_quad, kind, c, 0);
    t->cases++;
    if (truth.met && !found)
        t->missed++;
    else if (truth.met && ranged && !covers(a->range, &truth))
        t->too_short++;
    if (ranged) {
        t->yes_missed += truth.met && !a->yes;
        t->disagree += (found && !a->yes) || (kind != CONE_BOX && found != a->yes);
    }
    t->met += truth.met;
    t->false_positive += found && !truth.met;
    t->yes_false += ranged && a->yes && !truth.met;
    if (ranged && found && truth.met) measure(kind, c, a, &truth, t);
}

/* ---- eight at a time --------------------------------------------------------------------------------------------- */

typedef struct {
    uint32_t mask, contained;
    _Alignas(32) float near[8];
    _Alignas(32) float far[8];
    _Alignas(32) float at[8];
} Answer8;

static void corners_of(const KellerBox8 *b, int lane, float lower[3], float upper[3])
{
    for (int k = 0; k < 3; k++) {
        lower[k] = b->lower[k][lane];
        upper[k] = b->upper[k][lane];
    }
}

/* The same for the kernel and its scalar build. */
#define ASK8(name, prefix)                                                                                             \
    static void name(ConeKind kind, const ConeCase8 *c, Answer8 *a)                                                    \
    {                                                                                                                  \
        KellerConeLanes lanes = prefix##_lanes(&c->one.cone, c->one.clip, c->size);                                    \
        memset(a, 0, sizeof *a);                                                                                       \
        if (kind == CONE_BOX8) a->mask = prefix##_meets_box8(&lanes, &c->boxes, a->near);                              \
        if (kind == CONE_VERTEX8) a->mask = prefix##_contains_vertex8(&lanes, &c->vertices[0]);                        \
        if (kind == CONE_TRIANGLE8) prefix##_contained_triangle8(&lanes, c->vertices, a->near, a->far);                \
        if (kind == CONE_LEAF_TRIANGLE8)                                                                               \
            a->mask = prefix##_meets_triangle8(&lanes, c->vertices, a->near, a->far, &a->contained);                   \
        if (kind == CONE_PIERCED_TRIANGLE8)                                                                            \
            a->mask = prefix##_pierces_triangle8(&lanes, c->vertices, a->near, a->far, &a->contained, a->at);          \
        if (kind == CONE_LEAF_EDGE8)                                                                                   \
            a->mask = prefix##_meets_edge8(&lanes, c->vertices, a->near, a->far, &a->contained);                       \
        if (kind == CONE_INSIDE_BOX8) a->mask = prefix##_contains_box8(&lanes, &c->boxes);                             \
        for (int i = 0; kind == CONE_CORNERS && i < 8; i++) {                                                          \
            float lower[3], upper[3];                                                                                  \
            corners_of(&c->boxes, i, lower, upper);                                                                    \
            a->mask |= (uint32_t)prefix##_contains_corners(&lanes, lower, upper) << i;                                 \
        }                                                                                                              \
    }
ASK8(ask8, keller_cone)
ASK8(ask8_scalar, keller_scalar_cone)

/* Lane i as a case of its own; false if it is an empty box. */
static bool lane_of(ConeKind kind, const ConeCase8 *c, int i, ConeCase *one)
{
    *one = c->one;
    const KellerBox8 *b = &c->boxes;
    if (kind == CONE_BOX8 || kind == CONE_CORNERS ||
        kind == CONE_INSIDE_BOX8) {
        one->v[0] = v3(b->lower[0][i], b->lower[1][i], b->lower[2][i]);
        one->v[1] = v3(b->upper[0][i], b->upper[1][i], b->upper[2][i]);
        return b->lower[0][i] <= b->upper[0][i];
    }
    for (int j = 0; j < 3; j++) one->v[j] = v3(c->vertices[j].p[0][i], c->vertices[j].p[1][i], c->vertices[j].p[2][i]);
    return true;
}

static void judge_lane(ConeKind kind, const ConeCase8 *c, const Answer8 *a, int lane, bool quad, ConeTally *t)
{
    ConeCase one;
    bool full = lane_of(kind, c, lane, &one), found = a->mask >> lane & 1;
    double unit = (c->size + v3_norm(one.cone.origin) + one.cone.x0) * 0x1p-23;
    t->cases++;
    if (!full) {
        t->false_positive += found;
        t->disagree += found;
        return;
    }
    /* the lanes' frustum is cut by the clip range */
    one.cone.z_near = greater(one.cone.z_near, one.clip.near);
    one.cone.z_far = lesser(one.cone.z_far, one.clip.far);
    if (kind == CONE_TRIANGLE8) { /* speaks of contained triangles only */
        if (!truth_of(&cone_oracle_long, kind, &one, 0).met) return;
        long double low = INFINITY, high = -INFINITY;
        for (int j = 0; j < 3; j++) {
            long double z = cone_oracle_long.z(&one.cone, one.v[j]);
            low = z < low ? z : low;
            high = z > high ? z : high;
        }
        t->met++;
        t->too_short += !(a->near[lane] <= low && a->far[lane] >= high);
        t->range_error = greater(t->range_error, (double)(low - a->near[lane]) / unit);
        t->range_error = greater(t->range_error, (double)(a->far[lane] - high) / unit);
        return;
    }
    ConeTruth truth =
        quad ? truth_of(&cone_oracle_quad, kind, &one, 0) : truth_of(&cone_oracle_long, kind, &one, CONE_ORACLE_GROW);
    if (kind == CONE_INSIDE_BOX8) { /* may say no to what is inside, never yes to what is not */
        bool contained = truth_of(&cone_oracle_quad, kind, &one, 0).met;
        t->met += contained;
        t->false_positive += found && !contained;
        t->disagree += found && !contained;
        return;
    }
    bool leaf = kind == CONE_LEAF_TRIANGLE8 || kind == CONE_PIERCED_TRIANGLE8 || kind == CONE_LEAF_EDGE8;
    bool bound = kind == CONE_BOX8 || leaf;
    if (!quad && truth.met && (!found || (bound && a->near[lane] > truth.near)))
        truth = truth_of(&cone_oracle_quad, kind, &one, 0);
    bool pierced = kind == CONE_PIERCED_TRIANGLE8 && a->contained >> lane & 1;
    if (pierced) {
        ConeTruth exact = truth_of(&cone_oracle_quad, kind, &one, 0);
        t->disagree += !found || !exact.met || exact.near > a->at[lane];
    }
    /* what is said to be contained is, with all its corners */
    for (int j = 0; !pierced && a->contained >> lane & 1 && j < (kind == CONE_LEAF_EDGE8 ? 2 : 3); j++)
        t->disagree += !found || !cone_oracle_quad.contains(&one.cone, one.v[j], 0);
    t->missed += truth.met && !found;
    t->too_short += truth.met && found && bound && a->near[lane] > truth.near;
    t->too_short += truth.met && found && leaf && a->far[lane] < truth.far;
    t->met += truth.met;
    t->false_positive += found && !truth.met;
    if (bound && found && truth.met)
        t->range_error = greater(t->range_error, (double)(truth.near - a->near[lane]) / unit);
}

void cone_check8(ConeKind kind, const ConeCase8 *c, bool quad, ConeTally *t)
{
    Answer8 a, scalar;
    ask8(kind, c, &a);
    ask8_scalar(kind, c, &scalar);
    t->scalar_differs += memcmp(&a, &scalar, sizeof a) != 0;
    for (int i = 0; i < 8; i++) judge_lane(kind, c, &a, i, quad, t);
}

/* ---- many -------------------------------------------------------------------------------------------------------- */

void cone_check(ConeKind kind, uint64_t seed, uint64_t index, bool quad, ConeTally rows[CONE_ROWS])
{
    ConeTally t = cone_tally_zero;
    int row;
    if (kind < CONE_BOX8) {
        ConeCase c = cone_case(kind, seed, index, -1, -1, -1);
        ConeAnswer a = cone_ask(kind, &c), scalar = ask_scalar(kind, &c);
        cone_judge(kind, &c, &a, quad, &t);
        t.scalar_differs += !same_bits(&a, &scalar);
        row = c.decade * CONE_ROUNDNESSES + c.roundness;
    } else {
        ConeCase8 c = cone_case8(kind, seed, index, -1, -1, -1);
        cone_check8(kind, &c, quad, &t);
        row = c.one.decade * CONE_ROUNDNESSES + c.one.roundness;
    }
    if (cone_tally_wrong(&t)) t.first_wrong = index;
    cone_tally_add(&rows[row], &t);
}

void cone_check_all(ConeKind kind, uint64_t seed, uint64_t count, int threads, uint64_t quad_every,
                    ConeTally rows[CONE_ROWS])
{
    for (int i = 0; i < CONE_ROWS; i++) rows[i] = cone_tally_zero;
    if (threads < 1) threads = omp_get_max_threads();
#pragma omp parallel num_threads(threads)
    {
        ConeTally own[CONE_ROWS];
        for (int i = 0; i < CONE_ROWS; i++) own[i] = cone_tally_zero;
#pragma omp for schedule(dynamic, 4096)
        for (uint64_t i = 0; i < count; i++) cone_check(kind, seed, i, i % quad_every == 0, own);
#pragma omp critical
        for (int i = 0; i < CONE_ROWS; i++) cone_tally_add(&rows[i], &own[i]);
    }
}

static void print3(const char *name, KellerVec3 v) { printf("# %s %a %a %a\n", name, v.x, v.y, v.z); }

void cone_case_print(ConeKind kind, const ConeCase *c)
{
    printf("# %s, family %d\n", cone_kind_names[kind], (int)c->family);
    print3("origin", c->cone.origin);
    print3("directrix", c->cone.directrix);
    print3("major", c->cone.major);
    print3("minor", c->cone.minor);
    printf("# x0 %a tan %a e %a z %a %a clip %a %a\n", c->cone.x0, c->cone.tan_alpha, c->cone.e, c->cone.z_near,
           c->cone.z_far, c->clip.near, c->clip.far);
    for (int i = 0; i < 3; i++) print3("v", c->v[i]);
    printf("# offset %a\n", c->offset);
}
