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
    uint32_t *found;          /* faces in the plane being gathered */
    size_t count;
    Plane now;
} Gathering;

static double height(Plane plane, KellerVec3 p)
{
    return v3_dot(plane.normal, v3_sub(p, plane.point));
}

static void visit(void *context, uint32_t face)
{
    Gathering *gathering = context;
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
    return m[0][c0] * (m[1][c1] * m[2][c2] - m[1][c2] * m[2][c1]) - m[0][c1] * (m[1][c0] * m[2][c2] - m[1][c2] * m[2][c0]) +
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

static void gather(Gathering *gathering, const KellerBoxTree *tree, uint32_t leader)
{
    const KellerScene *scene = gathering->build->scene;
    const KellerFace *face = &scene->faces[leader];
    KellerVec3 corner = gathering->corner[leader];
    gathering->now = (Plane){face->normal, v3_madd(corner, face->normal, face->offset - v3_dot(face->normal, corner))};
    size_t before = 0;
    for (int i = 0; i < MOST_ROUNDS; i++) {
        gathering->count = 0;
        keller_boxtree_plane(tree, gathering->now.normal, v3_dot(gathering->now.normal, gathering->now.point),
                             gathering->build->contact, visit, gathering);
        qsort(gathering->found, gathering->count, sizeof *gathering->found, by_number);
        if (gathering->count <= 1 || gathering->count == before) break;
        before = gathering->count;
        gathering->now = fit(gathering);
    }
}

static void face_box(const KellerScene *scene, const KellerFace *face, KellerVec3 *lower, KellerVec3 *upper)
{
    *lower = v3(INFINITY, INFINITY, INFINITY);
    *upper = v3(-INFINITY, -INFINITY, -INFINITY);
    for (uint32_t i = face->triangle_begin; i < face->triangle_end; i++)
        for (int k = 0; k < 3; k++) {
            KellerVec3 p = keller_mesh_corner(scene, scene->face_triangles[i], k);
            *lower = v3(fmin(lower->x, p.x), fmin(lower->y, p.y), fmin(lower->z, p.z));
            *upper = v3(fmax(upper->x, p.x), fmax(upper->y, p.y), fmax(upper->z, p.z));
        }
}

/* Ids in the order of the lowest face in each plane, so that they do not depend on areas. */
static bool number(KellerBuild *build, const uint32_t *plane, const KellerVec3 *normals)
{
    KellerScene *scene = build->scene;
    uint32_t *id = keller_mesh_allocate(build, scene->plane_count, sizeof *id);
    build->plane_normal = keller_mesh_allocate(build, scene->plane_count, sizeof *build->plane_normal);
    bool ok = id && build->plane_normal;
    if (ok) {
        memset(id, 0xff, scene->plane_count * sizeof *id);
        uint32_t next = 0;
        for (size_t f = 0; f < scene->face_count; f++) {
            if (id[plane[f]] == KELLER_NONE) {
                build->plane_normal[next] = normals[plane[f]];
                id[plane[f]] = next++;
            }
            scene->faces[f].plane = id[plane[f]];
        }
    }
    free(id);
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
    KellerVec3 *lower = keller_mesh_allocate(build, count, sizeof *lower);
    KellerVec3 *upper = keller_mesh_allocate(build, count, sizeof *upper);
    KellerVec3 *normals = keller_mesh_allocate(build, count, sizeof *normals);
    KellerBoxTree *tree = NULL;
    bool ok = gathering.area && gathering.plane && gathering.corner && gathering.found && leaders && lower && upper && normals;
    for (size_t f = 0; ok && f < count; f++) {
        face_box(scene, &scene->faces[f], &lower[f], &upper[f]);
        gathering.corner[f] = keller_mesh_corner(scene, scene->face_triangles[scene->faces[f].triangle_begin], 0);
    }
    if (ok && !(tree = keller_boxtree_build(count, lower, upper))) {
        build->bytes = (unsigned long long)count * 200;
        ok = false;
    }
    if (ok) {
        for (size_t t = 0; t < scene->triangle_count; t++)
            gathering.area[scene->triangle_face[t]] += build->shape[t].area;
        for (uint32_t f = 0; f < count; f++) leaders[f] = (Leader){gathering.area[f], f};
        qsort(leaders, count, sizeof *leaders, by_area);
        memset(gathering.plane, 0xff, count * sizeof *gathering.plane);
        for (size_t i = 0; i < count; i++) {
            uint32_t leader = leaders[i].face;
            if (gathering.plane[leader] != KELLER_NONE) continue;
            gather(&gathering, tree, leader);
            uint32_t plane = (uint32_t)scene->plane_count++;
            for (size_t k = 0; k < gathering.count; k++) gathering.plane[gathering.found[k]] = plane;
            gathering.plane[leader] = plane; /* even where its own corners stray from its plane */
            normals[plane] = gathering.now.normal;
        }
        ok = number(build, gathering.plane, normals);
    }
    keller_boxtree_free(tree);
    free(gathering.area);
    free(gathering.plane);
    free(gathering.corner);
    free(gathering.found);
    free(leaders);
    free(lower);
    free(upper);
    free(normals);
    return ok;
}
