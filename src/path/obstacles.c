/* What is in the way of a leg? Robust without offsets: what a leg starts or ends on is excluded by identity (its plane), and
 * what one of its ends lies on, within rounding, does not block it there. */
#include <math.h>
#include <stdlib.h>

#include "accel/nexthit.h"
#include "base/number.h"
#include "path/internal.h"

/* Tells a ray's two directions apart: no scene of round numbers has rays across it. */
static const KellerVec3 generic = {0.4118, 0.6903, 0.5949};

typedef struct {
    const KellerScene *scene;
    const PathLeg *leg;
    KellerVec3 a, d;            /* the segment is a + t d, t in [0, 1] */
    double length;
    bool ahead;                 /* its direction: of the generic one */
    double floor;               /* m: rounding of coordinates */
    bool grazes;
    uint32_t blocker;
    Crossings *crossings;
} Test;

static bool skipped(const PathLeg *leg, uint32_t plane)
{
    for (int k = 0; k < 2; k++)
        for (size_t i = 0; i < leg->skip_count[k]; i++)
            if (leg->skip[k][i] == plane) return true;
    return false;
}

bool path_lets_through(const KellerScene *scene, uint32_t face)
{
    const KellerMaterial *m = &scene->materials[scene->faces[face].material];
    return m->kind != KELLER_MATERIAL_CONDUCTOR && m->thickness > 0;
}

/* The triangle is in the way: true if that ends the leg. */
static bool meet(Test *test, uint32_t triangle)
{
    Crossings *c = test->crossings;
    uint32_t face = test->scene->triangle_face[triangle], sheets = test->scene->triangle_sheets[triangle];
    if (sheets > c->most - c->count || !path_lets_through(test->scene, face)) {
        test->blocker = triangle;
        return true;
    }
    for (uint32_t i = 0; i < sheets; i++)
        c->at[c->count++] = (Crossing){.leg = test->leg->number, .face = face, .triangle = triangle};
    return false;
}

/* One triangle against the leg by signed volumes. The volume of an edge is computed from its ends in the order of their
 * ids, so that the two triangles on an edge see one number, and no ray slips between them or meets both. A volume of
 * nothing, as of a leg from roof to roof over a ridge of the same height, has the sign of the ray's direction: so it turns over
 * with the ray, as others do. */
static bool visit(void *context, uint32_t id)
{
    Test *test = context;
    const PathLeg *leg = test->leg;
    if (skipped(leg, test->scene->faces[test->scene->triangle_face[id]].plane)) return false;
    const uint32_t *t = test->scene->triangles[id];
    const KellerVec3 *vertices = test->scene->vertices;
    KellerVec3 v[3] = {v3_sub(vertices[t[0]], test->a), v3_sub(vertices[t[1]], test->a), v3_sub(vertices[t[2]], test->a)};
    KellerVec3 n = v3_cross(v3_sub(v[1], v[0]), v3_sub(v[2], v[0]));
    double along = v3_dot(n, test->d);
    if (!(fabs(along) > 1e-14 * v3_norm(n) * test->length)) return false; /* edge-on: nothing in the way */
    double at = v3_dot(n, v[0]) / along;
    double end = 4 * test->floor / test->length;
    if (!(at > end && at < 1 - end)) return false; /* an end of the leg lies on it */
    double h = greater(test->floor, KELLER_BOUNDARY_ANGLE * test->length * at * (1 - at));
    int positive = 0, negative = 0;
    bool near_edge = false;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, first = t[i] < t[j] ? i : j, second = i + j - first;
        double volume = v3_dot(test->d, v3_cross(v[first], v[second]));
        if (!leg->strict) {
            KellerVec3 across = v3_cross(v3_sub(v[second], v[first]), test->d);
            if (fabs(volume) <= h * v3_norm(across)) {
                near_edge = true;
                continue;
            }
        }
        bool positive_volume = volume > 0 || (volume == 0 && test->ahead);
        bool up = positive_volume == (first == i);
        positive += up;
        negative += !up;
    }
    if (positive && negative) return false;
    test->grazes = test->grazes || near_edge;
    if (near_edge && leg->grazes && leg->grazes->count < PATH_MAX_GRAZES) leg->grazes->at[leg->grazes->count++] = at;
    return !near_edge && meet(test, id);
}

KellerVec3 path_crossing(const KellerScene *scene, uint32_t face, KellerVec3 a, KellerVec3 b, double *t)
{
    const KellerFace *f = &scene->faces[face];
    KellerVec3 d = v3_sub(b, a);
    double along = v3_dot(f->normal, d);
    *t = along != 0 ? greater(0, lesser(1, (f->offset - v3_dot(f->normal, a)) / along)) : 0;
    return v3_madd(a, d, *t);
}

/* ---- order along the leg --------------------------------------------------------------------------------------------- */

typedef struct {
    Crossing crossing;
    double t;
    uint32_t plane;
    bool ahead;
} Ordered;

static int compare(const void *pa, const void *pb)
{
    const Ordered *a = pa, *b = pb;
    if (a->t != b->t) return a->t < b->t ? -1 : 1;
    int order = (a->plane > b->plane) - (a->plane < b->plane);
    if (order == 0) order = (a->crossing.face > b->crossing.face) - (a->crossing.face < b->crossing.face);
    if (order == 0) order = (a->crossing.triangle > b->crossing.triangle) - (a->crossing.triangle < b->crossing.triangle);
    return a->ahead ? order : -order;
}

/* Sorts the crossings from `begin` on along the leg. Where faces lie in one plane, the ray meets them at one place, that of
 * the first of them, and in the order of their ids, which turns over with the ray's direction. */
static void sort(const Test *test, uint32_t begin)
{
    Crossings *c = test->crossings;
    uint32_t n = c->count - begin;
    Ordered order[KELLER_MAX_INTERACTIONS];
    for (uint32_t i = 0; i < n; i++) {
        const Crossing *x = &c->at[begin + i];
        uint32_t plane = test->scene->faces[x->face].plane, first = x->face;
        for (uint32_t j = begin; j < c->count; j++)
            if (c->at[j].face < first && test->scene->faces[c->at[j].face].plane == plane) first = c->at[j].face;
        order[i] = (Ordered){.crossing = *x, .plane = plane, .ahead = test->ahead};
        order[i].crossing.at = first;
        path_crossing(test->scene, first, test->leg->a, test->leg->b, &order[i].t);
    }
    qsort(order, n, sizeof *order, compare);
    for (uint32_t i = 0; i < n; i++) c->at[begin + i] = order[i].crossing;
}

/* Every triangle within `margin` of the leg, one after another by the total order of the next-hit iterator, until one ends the
 * leg: what is beyond is not looked for. False: no memory, and then nothing is known. */
static bool one_by_one(Test *test, const KellerAccel *accel, double margin, bool *blocked, KellerAccelWork *work)
{
    const KellerVec3 along = v3_scale(test->d, 1 / test->length);
    KellerCone cylinder = keller_cone_round(v3_madd(test->a, along, -margin), along, 0);
    KellerNexthitOptions options = {.work = work};
    KellerNexthit it;
    KellerConeHit hit;
    cylinder.x0 = margin;
    cylinder.z_far = test->length + 2 * margin;
    nexthit_open(&it);
    if (!keller_nexthit_resumes(accel)) options.method = KELLER_NEXTHIT_FILTER;
    KellerStatus status = keller_nexthit_cone(&it, accel, &cylinder, (KellerRange){0, INFINITY}, &options, NULL);
    *blocked = false;
    while (status == KELLER_OK && !*blocked) {
        status = keller_nexthit_next_cone(&it, &hit, NULL);
        if (status != KELLER_OK || hit.primitive == KELLER_NONE) break;
        *blocked = visit(test, hit.primitive);
    }
    nexthit_close(&it);
    return status == KELLER_OK;
}

bool path_leg_passes(const KellerScene *scene, const KellerAccel *accel, const PathLeg *leg, Crossings *crossings, bool *grazes,
                     KellerAccelWork *work)
{
    Test test = {.scene = scene, .leg = leg, .a = v3_add(leg->a, leg->lift), .d = v3_sub(leg->b, leg->a), .crossings = crossings};
    test.length = v3_norm(test.d);
    test.ahead = v3_dot(test.d, generic) > 0;
    test.floor = greater(path_rounding(scene, leg->a), path_rounding(scene, leg->b));
    if (test.length <= test.floor) return true;
    double margin = leg->strict ? test.floor : greater(test.floor, KELLER_BOUNDARY_ANGLE * test.length);
    uint32_t begin = crossings->count;
    uint32_t *known = crossings->most == 0 && crossings->blocker ? &crossings->blocker[leg->number] : NULL;
    bool blocked = false;
    if (known && *known != KELLER_NONE && visit(&test, *known)) return false;
    /* where nothing may be passed through, any obstacle will do */
    if (crossings->most == 0 || !one_by_one(&test, accel, margin, &blocked, work)) {
        crossings->count = begin;
        blocked = keller_accel_segment(accel, test.a, v3_add(leg->b, leg->lift), margin, visit, &test, work);
    }
    if (test.grazes) *grazes = true;
    if (blocked && known) *known = test.blocker;
    if (!blocked && crossings->count - begin > 1) sort(&test, begin);
    else if (!blocked && crossings->count > begin) crossings->at[begin].at = crossings->at[begin].face;
    return !blocked;
}
