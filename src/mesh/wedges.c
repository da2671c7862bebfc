/* Wedges from chained sectors: exact ends, frames and opening angles. */
#include "mesh/build.h"

#include <string.h>

#define PI 3.14159265358979323846

typedef struct {
    uint32_t end[2], model;   /* ends as in KellerSector; the sector that stands for the whole */
    bool reversed;            /* the model runs from end[1] to end[0] */
    size_t plane_begin, plane_end;
    KellerWedge wedge;
} Draft;

typedef struct {
    Draft *drafts;
    size_t count, capacity;
    uint32_t *planes;
    size_t planes_count, planes_capacity;
} Drafts;

static int by_number(const void *x, const void *y)
{
    uint32_t a = *(const uint32_t *)x, b = *(const uint32_t *)y;
    return (a > b) - (a < b);
}

static bool collect(KellerBuild *build, void *context, uint32_t from, uint32_t to, size_t count,
                    const uint32_t *sectors, uint32_t model, bool reversed)
{
    Drafts *drafts = context;
    if (!keller_mesh_reserve(build, (void **)&drafts->drafts, &drafts->capacity, drafts->count + 1,
                             sizeof *drafts->drafts))
        return false;
    Draft draft = {.end = {from, to}, .model = model, .reversed = reversed, .plane_begin = drafts->planes_count};
    for (size_t i = 0; i < count; i++) {
        const KellerSector *sector = &build->sectors[sectors[i]];
        size_t more = sector->plane_end - sector->plane_begin;
        if (!keller_mesh_reserve(build, (void **)&drafts->planes, &drafts->planes_capacity, drafts->planes_count + more,
                                 sizeof *drafts->planes))
            return false;
        memcpy(drafts->planes + drafts->planes_count, build->planes + sector->plane_begin,
               more * sizeof *drafts->planes);
        drafts->planes_count += more;
    }
    uint32_t *planes = drafts->planes + draft.plane_begin;
    size_t all = drafts->planes_count - draft.plane_begin, kept = 0;
    qsort(planes, all, sizeof *planes, by_number);
    for (size_t i = 0; i < all; i++)
        if (!i || planes[i] != planes[i - 1]) planes[kept++] = planes[i];
    drafts->planes_count = draft.plane_end = draft.plane_begin + kept;
    drafts->drafts[drafts->count++] = draft;
    return true;
}

/* ---- vertices that the mesh does not have ---- */

typedef struct {
    KellerVec3 p;
    uint32_t index;
} Place;

static int by_position(const void *x, const void *y)
{
    const Place *a = x, *b = y;
    int order = keller_mesh_compare(a->p, b->p);
    return order ? order : (a->index > b->index) - (a->index < b->index);
}

/* A wedge that ends in a crossing: at the lowest vertex among the wedges' ends within the contact tolerance if there is
 * one, else at a new vertex. */
static bool append_vertices(KellerBuild *build, Drafts *drafts)
{
    KellerScene *scene = build->scene;
    size_t ends = 2 * drafts->count, old = scene->vertex_count, fresh = 0;
    KellerVec3 *places = keller_mesh_allocate(build, ends, sizeof *places);
    uint32_t *stands = keller_mesh_allocate(build, ends, sizeof *stands);
    uint32_t *name = keller_mesh_allocate(build, ends, sizeof *name); /* by the end that stands for others */
    Place *order = keller_mesh_allocate(build, ends, sizeof *order);
    bool ok = places && stands && name && order;
    for (size_t i = 0; ok && i < ends; i++) {
        uint32_t point = drafts->drafts[i / 2].end[i % 2];
        places[i] = point < old ? scene->vertices[point] : build->points[point - old];
    }
    ok = ok && keller_mesh_weld(build, ends, places, build->contact, stands);
    if (ok) {
        memset(name, 0xff, ends * sizeof *name);
        for (size_t i = 0; i < ends; i++) {
            uint32_t point = drafts->drafts[i / 2].end[i % 2];
            if (point < old && point < name[stands[i]]) name[stands[i]] = point;
        }
        for (uint32_t i = 0; i < ends; i++)
            if (stands[i] == i && name[i] == KELLER_NONE) order[fresh++] = (Place){places[i], i};
        qsort(order, fresh, sizeof *order, by_position);
        KellerVec3 *vertices = realloc(scene->vertices, (old + fresh + 1) * sizeof *vertices);
        if (vertices) scene->vertices = vertices;
        else build->bytes = (unsigned long long)(old + fresh + 1) * sizeof *vertices;
        ok = vertices != NULL;
    }
    if (ok) {
        for (size_t i = 0; i < fresh; i++) {
            scene->vertices[old + i] = order[i].p;
            name[order[i].index] = (uint32_t)(old + i);
        }
        scene->vertex_count = old + fresh;
        for (size_t i = 0; i < ends; i++) {
            uint32_t *end = &drafts->drafts[i / 2].end[i % 2];
            if (*end >= old) *end = name[stands[i]];
        }
    }
    free(places);
    free(stands);
    free(name);
    free(order);
    return ok;
}

/* ---- geometry ---- */

/* Unit vector from the edge into the face, perpendicular to the edge's direction d, near `rough`; exact to rounding for
 * a face whose plane holds the edge. */
static KellerVec3 into_face(const KellerFace *face, KellerVec3 d, KellerVec3 rough)
{
    KellerVec3 n = v3_madd(face->normal, d, -v3_dot(face->normal, d));
    if (v3_norm(n) < 0.5) return v3_unit(v3_madd(rough, d, -v3_dot(rough, d)));
    KellerVec3 tangent = v3_cross(v3_unit(n), d);
    return v3_dot(tangent, rough) < 0 ? v3_scale(tangent, -1) : tangent;
}

/* Fills the wedge; false if it is shorter than the contact tolerance and so has no direction. */
static bool finish(const KellerBuild *build, Draft *draft)
{
    const KellerScene *scene = build->scene;
    const KellerSector *model = &build->sectors[draft->model];
    KellerWedge *wedge = &draft->wedge;
    KellerVec3 a = scene->vertices[draft->end[0]], b = scene->vertices[draft->end[1]];
    if (draft->end[0] == draft->end[1] || v3_distance(a, b) <= build->contact) return false;
    bool swap = keller_mesh_compare(a, b) > 0, turned = swap != draft->reversed;
    if (swap) {
        KellerVec3 p = a;
        a = b;
        b = p;
    }
    KellerVec3 rough[2] = {model->tangent[turned], model->tangent[!turned]};
    *wedge = (KellerWedge){.vertex = {draft->end[swap], draft->end[!swap]},
                           .face = {model->face[turned], model->face[!turned]},
                           .origin = a, .direction = v3_unit(v3_sub(b, a)), .length = v3_distance(a, b), .n = 2};
    KellerVec3 d = wedge->direction;
    wedge->tangent0 = into_face(&scene->faces[wedge->face[0]], d, rough[0]);
    wedge->normal0 = v3_cross(d, wedge->tangent0);
    if (wedge->face[0] != wedge->face[1]) {
        KellerVec3 tangent = into_face(&scene->faces[wedge->face[1]], d, rough[1]);
        double angle = atan2(v3_dot(tangent, wedge->normal0), v3_dot(tangent, wedge->tangent0));
        angle += 2 * PI * round((model->angle - angle) / (2 * PI));
        wedge->n = fmin(2, angle / PI);
    }
    return true;
}

static int by_wedge(const void *x, const void *y)
{
    const KellerWedge *a = &((const Draft *)x)->wedge, *b = &((const Draft *)y)->wedge;
    for (int i = 0; i < 2; i++)
        if (a->vertex[i] != b->vertex[i]) return a->vertex[i] < b->vertex[i] ? -1 : 1;
    for (int i = 0; i < 2; i++)
        if (a->face[i] != b->face[i]) return a->face[i] < b->face[i] ? -1 : 1;
    int order = keller_mesh_compare(a->tangent0, b->tangent0);
    return order ? order : (a->n > b->n) - (a->n < b->n);
}

static bool same(const KellerWedge *a, const KellerWedge *b)
{
    return a->vertex[0] == b->vertex[0] && a->vertex[1] == b->vertex[1] && a->face[0] == b->face[0] &&
           a->face[1] == b->face[1] && v3_dot(a->tangent0, b->tangent0) > 0;
}

bool keller_mesh_wedges(KellerBuild *build)
{
    KellerScene *scene = build->scene;
    Drafts drafts = {0};
    bool ok = keller_mesh_chains(build, collect, &drafts) && append_vertices(build, &drafts);
    if (ok) {
        size_t finished = 0;
        for (size_t i = 0; i < drafts.count; i++)
            if (finish(build, &drafts.drafts[i])) drafts.drafts[finished++] = drafts.drafts[i];
        if (finished) qsort(drafts.drafts, finished, sizeof *drafts.drafts, by_wedge);
        scene->wedges = keller_mesh_allocate(build, finished, sizeof *scene->wedges);
        scene->wedge_planes = keller_mesh_allocate(build, drafts.planes_count, sizeof *scene->wedge_planes);
        ok = scene->wedges && scene->wedge_planes;
        for (size_t i = 0; ok && i < finished; i++) {
            Draft *draft = &drafts.drafts[i];
            if (scene->wedge_count && same(&scene->wedges[scene->wedge_count - 1], &draft->wedge)) continue;
            draft->wedge.plane_begin = (uint32_t)scene->wedge_plane_count;
            for (size_t k = draft->plane_begin; k < draft->plane_end; k++)
                scene->wedge_planes[scene->wedge_plane_count++] = drafts.planes[k];
            draft->wedge.plane_end = (uint32_t)scene->wedge_plane_count;
            scene->wedges[scene->wedge_count++] = draft->wedge;
        }
    }
    free(drafts.drafts);
    free(drafts.planes);
    return ok;
}
