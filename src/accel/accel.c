/* The accelerator: one hierarchy over the triangles, one over the wedges. */
#include "keller/accel.h"

#include <stdlib.h>
#include <string.h>

#include "accel/bvh.h"
#include "base/number.h"

struct KellerAccel {
    const KellerScene *scene;
    Bvh triangles, wedges;
    uint32_t *wedge_ids;        /* of the wedges in the hierarchy; NULL: all, in order */
};

static KellerVec3 wedge_end(const KellerWedge *w) { return v3_madd(w->origin, w->direction, w->length); }

KellerStatus keller_accel_build(const char *name, const KellerScene *scene, KellerAccel **accel, KellerError *error)
{
    *accel = NULL;
    if (strcmp(name, "auto") != 0 && strcmp(name, "bvh") != 0)
        return keller_error(error, KELLER_BAD_INPUT, "accelerator \"%s\" is not known; expected auto or bvh", name);
    size_t most = scene->triangle_count > scene->wedge_count ? scene->triangle_count : scene->wedge_count;
    KellerAccel *a = calloc(1, sizeof *a);
    BvhBox *boxes = malloc((most ? most : 1) * sizeof *boxes);
    if (!a || !boxes) {
        free(a);
        free(boxes);
        return keller_error_memory(error, most * sizeof *boxes);
    }
    a->scene = scene;
    for (size_t i = 0; i < scene->triangle_count; i++) {
        const uint32_t *t = scene->triangles[i];
        boxes[i] = bvh_box(3, (KellerVec3[]){scene->vertices[t[0]], scene->vertices[t[1]], scene->vertices[t[2]]});
    }
    KellerStatus status = bvh_build((uint32_t)scene->triangle_count, boxes, &a->triangles, error);
    for (size_t i = 0; i < scene->wedge_count; i++)
        boxes[i] = bvh_box(2, (KellerVec3[]){scene->wedges[i].origin, wedge_end(&scene->wedges[i])});
    if (status == KELLER_OK) status = bvh_build((uint32_t)scene->wedge_count, boxes, &a->wedges, error);
    free(boxes);
    if (status != KELLER_OK) {
        keller_accel_free(a);
        return status;
    }
    *accel = a;
    return KELLER_OK;
}

KellerStatus keller_accel_build_wedges(const KellerScene *scene, uint32_t count, const uint32_t *wedges,
                                       KellerAccel **accel, KellerError *error)
{
    KellerAccel *a = *accel = calloc(1, sizeof *a);
    BvhBox *boxes = malloc((count + 1) * sizeof *boxes);
    if (a) a->wedge_ids = malloc((count + 1) * sizeof *wedges);
    KellerStatus status = KELLER_OK;
    if (!a || !boxes || !a->wedge_ids) {
        status = keller_error_memory(error, count * sizeof *boxes);
    } else {
        a->scene = scene;
        for (uint32_t i = 0; i < count; i++) {
            const KellerWedge *w = &scene->wedges[a->wedge_ids[i] = wedges[i]];
            boxes[i] = bvh_box(2, (KellerVec3[]){w->origin, wedge_end(w)});
        }
        status = bvh_build(count, boxes, &a->wedges, error);
    }
    free(boxes);
    if (status == KELLER_OK) return status;
    keller_accel_free(a);
    *accel = NULL;
    return status;
}

void keller_accel_free(KellerAccel *accel)
{
    if (!accel) return;
    free(accel->wedge_ids);
    bvh_free(&accel->triangles);
    bvh_free(&accel->wedges);
    free(accel);
}

const char *keller_accel_name(const KellerAccel *accel)
{
    (void)accel;
    return "bvh";
}

bool keller_accel_segment(const KellerAccel *accel, KellerVec3 a, KellerVec3 b, double margin, KellerVisitTriangle visit,
                          void *context, KellerAccelWork *work)
{
    return bvh_segment(&accel->triangles, a, b, margin, visit, context, work);
}

typedef struct {
    const KellerScene *scene;
    const uint32_t *wedge_ids;
    const KellerCone *cone;
    double near;
    KellerVisitCone visit;
    void *context;
} ConeQuery;

static double visit_triangle(void *context, uint32_t id, double far)
{
    const ConeQuery *q = context;
    const uint32_t *t = q->scene->triangles[id];
    const KellerVec3 *v = q->scene->vertices;
    KellerRange range = keller_cone_triangle(q->cone, v[t[0]], v[t[1]], v[t[2]], (KellerRange){q->near, far}, NULL, NULL);
    return range.near <= range.far ? lesser(far, q->visit(q->context, id, range)) : far;
}

static double visit_wedge(void *context, uint32_t id, double far)
{
    const ConeQuery *q = context;
    if (q->wedge_ids) id = q->wedge_ids[id];
    const KellerWedge *w = &q->scene->wedges[id];
    KellerRange range = keller_cone_edge(q->cone, w->origin, wedge_end(w), (KellerRange){q->near, far}, NULL, NULL);
    return range.near <= range.far ? lesser(far, q->visit(q->context, id, range)) : far;
}

void keller_accel_cone(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, KellerVisitCone visit,
                       void *context, KellerAccelWork *work)
{
    ConeQuery q = {accel->scene, accel->wedge_ids, cone, clip.near, visit, context};
    bvh_cone(&accel->triangles, cone, clip, visit_triangle, &q, work);
}

void keller_accel_cone_wedges(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, KellerVisitCone visit,
                              void *context, KellerAccelWork *work)
{
    ConeQuery q = {accel->scene, accel->wedge_ids, cone, clip.near, visit, context};
    bvh_cone(&accel->wedges, cone, clip, visit_wedge, &q, work);
}
