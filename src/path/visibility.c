/* Is a leg free? Robust without offsets: what a leg starts or ends on is excluded by identity (its plane), and what one of
 * its ends lies on, within rounding, does not block it there. */
#include <math.h>

#include "path/internal.h"
#include "base/number.h"

typedef struct {
    const KellerScene *scene;
    KellerVec3 a, d;            /* the segment is a + t d, t in [0, 1] */
    double length;
    double floor;               /* m: rounding of coordinates */
    const uint32_t *skip[2];
    size_t skip_count[2];
    bool strict, grazes;
} Leg;

static bool skipped(const Leg *leg, uint32_t plane)
{
    for (int k = 0; k < 2; k++)
        for (size_t i = 0; i < leg->skip_count[k]; i++)
            if (leg->skip[k][i] == plane) return true;
    return false;
}

/* One triangle against the leg by signed volumes. The volume of an edge is computed from its ends in the order of their
 * ids, so that the two triangles on an edge see one number, and no ray slips between them. */
static bool visit(void *context, uint32_t id)
{
    Leg *leg = context;
    if (skipped(leg, leg->scene->faces[leg->scene->triangle_face[id]].plane)) return false;
    const uint32_t *t = leg->scene->triangles[id];
    const KellerVec3 *vertices = leg->scene->vertices;
    KellerVec3 v[3] = {v3_sub(vertices[t[0]], leg->a), v3_sub(vertices[t[1]], leg->a), v3_sub(vertices[t[2]], leg->a)};
    KellerVec3 n = v3_cross(v3_sub(v[1], v[0]), v3_sub(v[2], v[0]));
    double along = v3_dot(n, leg->d);
    if (!(fabs(along) > 1e-14 * v3_norm(n) * leg->length)) return false; /* edge-on: nothing in the way */
    double at = v3_dot(n, v[0]) / along;
    double end = 4 * leg->floor / leg->length;
    if (!(at > end && at < 1 - end)) return false; /* an end of the leg lies on it */
    double h = greater(leg->floor, KELLER_BOUNDARY_ANGLE * leg->length * at * (1 - at));
    int positive = 0, negative = 0;
    bool near_edge = false;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, first = t[i] < t[j] ? i : j, second = i + j - first;
        double volume = v3_dot(leg->d, v3_cross(v[first], v[second]));
        if (!leg->strict) {
            KellerVec3 across = v3_cross(v3_sub(v[second], v[first]), leg->d);
            if (fabs(volume) <= h * v3_norm(across)) {
                near_edge = true;
                continue;
            }
        }
        bool up = (volume >= 0) == (first == i);
        positive += up;
        negative += !up;
    }
    if (positive && negative) return false;
    leg->grazes = leg->grazes || near_edge;
    return !near_edge;
}

bool path_leg_free(const KellerScene *scene, const KellerAccel *accel, KellerVec3 a, KellerVec3 b, const uint32_t *skip_a,
                   size_t skip_a_count, const uint32_t *skip_b, size_t skip_b_count, bool strict, bool *grazes,
                   KellerAccelWork *work)
{
    Leg leg = {.scene = scene, .a = a, .d = v3_sub(b, a), .skip = {skip_a, skip_b},
               .skip_count = {skip_a_count, skip_b_count}, .strict = strict};
    leg.length = v3_norm(leg.d);
    leg.floor = greater(path_rounding(scene, a), path_rounding(scene, b));
    if (leg.length <= leg.floor) return true;
    double margin = strict ? leg.floor : greater(leg.floor, KELLER_BOUNDARY_ANGLE * leg.length);
    bool free_leg = !keller_accel_segment(accel, a, b, margin, visit, &leg, work);
    if (leg.grazes) *grazes = true;
    return free_leg;
}
