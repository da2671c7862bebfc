/* Faces in one plane share an id. Greedy from the largest face: what lies within the contact tolerance of its plane all
 * over joins it; with each joiner the plane is fitted again, which steadies it over the distance between the faces. */
#include "mesh/build.h"

#include <string.h>

enum { MOST_ROUNDS = 4 };

typedef struct {
    KellerVec3 normal, point;
} Plane;

typedef struct {
    KellerBuild *build;
    double *area;             /* by face */
    uint32_t *plane;          /* by face */
    KellerVec3 *corner;       /* by face, any: most faces are dismissed by it, without their triangles */
    const uint32_t *candidates; /* faces by item of the tree being searched */
    uint32_t *found;          /* faces in the plane being gathered */
    size_t count;
    Plane now;
} Gathering;

static double height(Plane plane, KellerVec3 p)
{
    return v3_dot(plane.normal, v3_sub(p, plane.point));
}

static void visit(void *context, uint32_t item)
{
    Gathering *gathering = context;
    uint32_t face = gathering->candidates[item];
    if (gathering->plane[face] != KELLER_NONE) return;
    if (fabs(height(gathering->now, gathering->corner[face])) > gathering->build->contact) return;
    const KellerScene *scene = gathering->build->scene;
    const KellerFace *f = &scene->faces[face];
    for (uint32_t i = f->triangle_begin; i < f->triangle_end; i++)
        for (int k = 0; k < 3; k++) {
            KellerVec3 p = keller_mesh_corner(scene, scene->face_triangles[i], k);
            if (fabs(height(gathering->now, p)) > gathering->build->contact) return;
        }
    gathering->found[gathering->count++] = face;
}

static double minor(const double m[3][4], int c0, int c1, int c2)
{
    return m[0][c0] * (m[1][c1] * m[2][c2] - m[1][c2] * m[2][c1]) -
           m[0][c1] * (m[1][c0] * m[2][c2] - m[1][c2] * m[2][c0]) +
           m[0][c2] * (m[1][c0] * m[2][c1] - m[1][c1] * m[2][c0]);
}

/* The height over the present plane is fitted by h = p u + q v + r, least squares over the corners weighted with the
 * triangles' areas, by Cramer's rule. */
static Plane fit(const Gathering *gathering)
{
    const KellerBuild *build = gathering->build;
    const KellerScene *scene = build->scene;
    KellerVec3 u = v3_perpendicular(gathering->now.normal), v = v3_cross(gathering->now.normal, u);
    double m[3][4] = {{0}};
    for (size_t i = 0; i < gathering->count; i++) {
        const KellerFace *face = &scene->faces[gathering->found[i]];
        for (uint32_t k = face->triangle_begin; k < face->triangle_end; k++)
            for (int c = 0; c < 3; c++) {
                uint32_t t = scene->face_triangles[k];
                KellerVec3 p = v3_sub(keller_mesh_corner(scene, t, c), gathering->now.point);
                double row[4] = {v3_dot(p, u), v3_dot(p, v), 1, v3_dot(p, gathering->now.normal)};
                for (int r = 0; r < 3; r++)
                    for (int s = 0; s < 4; s++) m[r][s] += build->shape[t].area * row[r] * row[s];
            }
    }
    double whole = minor(m, 0, 1, 2);
    if (!(whole > 1e-12 * m[0][0] * m[1][1] * m[2][2])) return gathering->now;
    double p = minor(m, 3, 1, 2) / whole, q = minor(m, 0, 3, 2) / whole, r = minor(m, 0, 1, 3) / whole;
    Plane plane = {v3_unit(v3_sub(gathering->now.normal, v3_add(v3_scale(u, p), v3_scale(v, q)))),
                   v3_madd(gathering->now.point, gathering->now.normal, r)};
    return plane;
}

typedef struct {
    double area;
    uint32_t face;
} Leader;

static int by_area(const void *x, const void *y)
{
    const Leader *a = x, *b = y;
    if (a->area != b->area) return a->area > b->area ? -1 : 1;
    return (a->face > b->face) - (a->face < b->face);
}

static int by_number(const void *x, const void *y)
{
    uint32_t a = *(const uint32_t *)x, b = *(const uint32_t *)y;
    return (a > b) - (a < b);
}

/* ---- which faces may lie in a plane: an index in the space of planes ---- */

/* A plane that is steepest along an axis is a height over the other two: h = p u + q v + r, with r taken at the
 * middle of the scene, and |p|, |q| <= 1. Each axis has a tree of boxes in (p, q, r), p and q scaled to lengths. If
 * all corners of a face lie within the tolerance of a plane, that plane and the face's own differ in height by at
 * most m at the corners, hence by a slope of at most 2 m over the width of the face's shadow, and in r by m and that
 * slope times the way to the middle: the face's box. */
typedef struct {
    KellerBoxTree *tree[3];
    uint32_t *face[3];        /* by item of the tree */
    KellerVec3 middle;
    double scale;
} PlaneIndex;

/* Faces steeper than this over an axis are not in its tree: sqrt(1/0.3^2 - 1) = 3.2, more than a plane's sqrt(2) and
 * the difference of 1 up to which slopes are compared at all. */
#define LEAST_COMPONENT 0.3

static double component(KellerVec3 p, int axis)
{
    return axis == 0 ? p.x : axis == 1 ? p.y : p.z;
}

static KellerVec3 coordinates(const PlaneIndex *index, Plane plane, int axis)
{
    double n = component(plane.normal, axis);
    double p = -component(plane.normal, (axis + 1) % 3) / n, q = -component(plane.normal, (axis + 2) % 3) / n;
    return v3(p * index->scale, q * index->scale, v3_dot(plane.normal, v3_sub(plane.point, index->middle)) / n);
}

/* The box of a face, or false if no plane of this axis comes near it. */
static bool face_box(const KellerBuild *build, const PlaneIndex *index, const KellerFace *face, KellerVec3 corner,
                     int axis, KellerVec3 *lower, KellerVec3 *upper)
{
    const KellerScene *scene = build->scene;
    double width = 0, stray = 0, near = INFINITY, everywhere = 1e30;
    for (uint32_t i = face->triangle_begin; i < face->triangle_end; i++) {
        uint32_t t = scene->face_triangles[i];
        width = fmax(width, build->shape[t].height);
        for (int k = 0; k < 3; k++) {
            KellerVec3 p = keller_mesh_corner(scene, t, k);
            stray = fmax(stray, fabs(v3_dot(face->normal, p) - face->offset));
            near = fmin(near, v3_distance(p, index->middle));
        }
    }
    double rounding = 1e-13 * (index->scale + v3_norm(index->middle));
    double m = 2 * build->contact + 4 * stray + rounding; /* 1/0.57 and 1/0.3 of the distances are heights */
    double slope = 2 * m / (LEAST_COMPONENT * width);
    if (!(slope < 1)) { /* too small to have a direction */
        *lower = v3(-everywhere, -everywhere, -everywhere);
        *upper = v3(everywhere, everywhere, everywhere);
        return true;
    }
    if (fabs(component(face->normal, axis)) < LEAST_COMPONENT) return false;
    Plane plane = {face->normal, v3_madd(corner, face->normal, face->offset - v3_dot(face->normal, corner))};
    KellerVec3 at = coordinates(index, plane, axis);
    KellerVec3 reach =
        v3(slope * index->scale + rounding, slope * index->scale + rounding, m + slope * near + rounding);
    *lower = v3_sub(at, reach);
    *upper = v3_add(at, reach);
    return true;
}

static void free_index(PlaneIndex *index)
{
    for (int axis = 0; axis < 3; axis++) {
        keller_boxtree_free(index->tree[axis]);
        free(index->face[axis]);
    }
}

static bool build_index(KellerBuild *build, const KellerVec3 *corners, PlaneIndex *index)
{
    const KellerScene *scene = build->scene;
    size_t count = scene->face_count;
    index->middle = v3_scale(v3_add(scene->lower, scene->upper), 0.5);
    index->scale = v3_distance(scene->lower, scene->upper);
    KellerVec3 *lower = keller_mesh_allocate(build, count, sizeof *lower);
    KellerVec3 *upper = keller_mesh_allocate(build, count, sizeof *upper);
    bool ok = lower && upper;
    for (int axis = 0; ok && axis < 3; axis++) {
        size_t used = 0;
        index->face[axis] = keller_mesh_allocate(build, count, sizeof *index->face[axis]);
        for (uint32_t f = 0; index->face[axis] && f < count; f++)
            if (face_box(build, index, &scene->faces[f], corners[f], axis, &lower[used], &upper[used]))
                index->face[axis][used++] = f;
        index->tree[axis] = keller_boxtree_build(used, lower, upper);
        ok = index->face[axis] && index->tree[axis];
        if (!index->tree[axis]) build->bytes = (unsigned long long)used * 200;
    }
    free(lower);
    free(upper);
    return ok;
}

static void find(Gathering *gathering, const PlaneIndex *index)
{
    KellerVec3 n = gathering->now.normal;
    int axis = fabs(n.x) >= fabs(n.y) && fabs(n.x) >= fabs(n.z) ? 0 : fabs(n.y) >= fabs(n.z) ? 1 : 2;
    KellerVec3 at = coordinates(index, gathering->now, axis);
    gathering->count = 0;
    gathering->candidates = index->face[axis];
    keller_boxtree_segment(index->tree[axis], at, at, 0, visit, gathering);
    qsort(gathering->found, gathering->count, sizeof *gathering->found, by_number);
}

static void gather(Gathering *gathering, const PlaneIndex *index, uint32_t leader)
{
    const KellerFace *face = &gathering->build->scene->faces[leader];
    KellerVec3 corner = gathering->corner[leader];
    gathering->now = (Plane){face->normal, v3_madd(corner, face->normal, face->offset - v3_dot(face->normal, corner))};
    size_t before = 0;
    for (int i = 0; i < MOST_ROUNDS; i++) {
        find(gathering, index);
        if (gathering->count <= 1 || gathering->count == before) break;
        before = gathering->count;
        gathering->now = fit(gathering);
    }
}

/* Ids in the order of the lowest face in each plane, so that they do not depend on areas; and each face's forerunner in its plane. */
static bool number(KellerBuild *build, const uint32_t *plane, const KellerVec3 *normals)
{
    KellerScene *scene = build->scene;
    uint32_t *last = keller_mesh_allocate(build, scene->plane_count, sizeof *last);
    build->plane_normal = keller_mesh_allocate(build, scene->plane_count, sizeof *build->plane_normal);
    bool ok = last && build->plane_normal;
    if (ok) {
        memset(last, 0xff, scene->plane_count * sizeof *last);
        uint32_t next = 0;
        for (uint32_t f = 0; f < scene->face_count; f++) {
            KellerFace *face = &scene->faces[f];
            face->before = last[plane[f]];
            face->plane = face->before == KELLER_NONE ? next : scene->faces[face->before].plane;
            if (face->before == KELLER_NONE) build->plane_normal[next++] = normals[plane[f]];
            last[plane[f]] = f;
        }
    }
    free(last);
    return ok;
}

bool keller_mesh_planes(KellerBuild *build)
{
    KellerScene *scene = build->scene;
    size_t count = scene->face_count;
    Gathering gathering = {.build = build};
    gathering.area = keller_mesh_allocate(build, count, sizeof *gathering.area);
    gathering.plane = keller_mesh_allocate(build, count, sizeof *gathering.plane);
    gathering.corner = keller_mesh_allocate(build, count, sizeof *gathering.corner);
    gathering.found = keller_mesh_allocate(build, count, sizeof *gathering.found);
    Leader *leaders = keller_mesh_allocate(build, count, sizeof *leaders);
    KellerVec3 *normals = keller_mesh_allocate(build, count, sizeof *normals);
    PlaneIndex index = {0};
    bool ok = gathering.area && gathering.plane && gathering.corner && gathering.found && leaders && normals;
    for (size_t f = 0; ok && f < count; f++)
        gathering.corner[f] = keller_mesh_corner(scene, scene->face_triangles[scene->faces[f].triangle_begin], 0);
    ok = ok && build_index(build, gathering.corner, &index);
    if (ok) {
        for (size_t t = 0; t < scene->triangle_count; t++)
            gathering.area[scene->triangle_face[t]] += build->shape[t].area;
        for (uint32_t f = 0; f < count; f++) leaders[f] = (Leader){gathering.area[f], f};
        qsort(leaders, count, sizeof *leaders, by_area);
        memset(gathering.plane, 0xff, count * sizeof *gathering.plane);
        for (size_t i = 0; i < count; i++) {
            uint32_t leader = leaders[i].face;
            if (gathering.plane[leader] != KELLER_NONE) continue;
            gather(&gathering, &index, leader);
            uint32_t plane = (uint32_t)scene->plane_count++;
            for (size_t k = 0; k < gathering.count; k++) gathering.plane[gathering.found[k]] = plane;
            gathering.plane[leader] = plane; /* even where its own corners stray from its plane */
            normals[plane] = gathering.now.normal;
        }
        ok = number(build, gathering.plane, normals);
    }
    free_index(&index);
    free(gathering.area);
    free(gathering.plane);
    free(gathering.corner);
    free(gathering.found);
    free(leaders);
    free(normals);
    return ok;
}
