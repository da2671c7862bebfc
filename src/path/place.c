/* Where does a point lie: in a sector, in a face, on an edge, on a border along which a wave runs? */
#include "path/solve.h"

#include <math.h>

#include "base/number.h"

bool path_in_sector(const KellerWedge *w, KellerVec3 v, double slack)
{
    double angle = atan2(v3_dot(v, w->normal0), v3_dot(v, w->tangent0)), open = w->n * M_PI;
    if (angle < 0) angle += 2 * M_PI;
    return angle <= open + slack || 2 * M_PI - angle <= slack;
}

bool path_wedge_in_plane(const KellerScene *scene, const KellerWedge *wedge, uint32_t plane)
{
    for (uint32_t i = wedge->plane_begin; i < wedge->plane_end; i++)
        if (scene->wedge_planes[i] == plane) return true;
    return false;
}

int path_along_face(const KellerWedge *w, KellerVec3 v)
{
    double angle = atan2(v3_dot(v, w->normal0), v3_dot(v, w->tangent0)), open = w->n * M_PI;
    if (fabs(angle) <= KELLER_BOUNDARY_ANGLE) return 0;
    if (angle < 0) angle += 2 * M_PI;
    return fabs(angle - open) <= KELLER_BOUNDARY_ANGLE ? 1 : -1;
}

KellerVec3 path_lift(const KellerWedge *w, KellerVec3 v, double rounding)
{
    int face = path_along_face(w, v);
    double high = 4 * KELLER_BOUNDARY_ANGLE * v3_norm(v) + 100 * rounding; /* beyond what counts as grazing an edge */
    if (face < 0) return v3(0, 0, 0);
    double open = w->n * M_PI;
    KellerVec3 up = face == 0 ? w->normal0 : v3_sub(v3_scale(w->tangent0, sin(open)), v3_scale(w->normal0, cos(open)));
    return v3_scale(up, high);
}

void path_line_distances(const KellerWedge *w, KellerVec3 a, KellerVec3 b, double *z_low, double *z_high, double *near,
                         double *far)
{
    KellerVec3 p = v3_sub(a, w->origin), q = v3_sub(b, w->origin);
    double za = v3_dot(p, w->direction), zb = v3_dot(q, w->direction);
    p = v3_madd(p, w->direction, -za);
    q = v3_madd(q, w->direction, -zb);
    KellerVec3 l = v3_sub(q, p);
    double l2 = v3_dot(l, l), t = l2 > 0 ? greater(0, lesser(1, -v3_dot(p, l) / l2)) : 0;
    *z_low = lesser(za, zb);
    *z_high = greater(za, zb);
    *near = v3_norm(v3_madd(p, l, t));
    *far = greater(v3_norm(p), v3_norm(q));
}

/* ---- is a point inside a face? --------------------------------------------------------------------------------- */

typedef struct {
    double u, v;
} Flat;

static Flat flatten(KellerVec3 p, int axis)
{
    return axis == 0 ? (Flat){p.y, p.z} : axis == 1 ? (Flat){p.z, p.x} : (Flat){p.x, p.y};
}

static double area2(Flat a, Flat b, Flat c) { return (b.u - a.u) * (c.v - a.v) - (b.v - a.v) * (c.u - a.u); }

static double segment_distance(KellerVec3 p, KellerVec3 a, KellerVec3 b)
{
    KellerVec3 l = v3_sub(b, a);
    double t = v3_dot(v3_sub(p, a), l) / v3_dot(l, l);
    return v3_distance(p, v3_madd(a, l, greater(0, lesser(1, t))));
}

double path_face_weight(const KellerScene *scene, uint32_t face, KellerVec3 p, double h, uint32_t *triangle)
{
    const KellerFace *f = &scene->faces[face];
    double nx = fabs(f->normal.x), ny = fabs(f->normal.y), nz = fabs(f->normal.z);
    int axis = nx >= ny && nx >= nz ? 0 : ny >= nz ? 1 : 2;
    Flat q = flatten(p, axis);
    uint32_t holder = KELLER_NONE, border = KELLER_NONE;
    for (uint32_t i = f->triangle_begin; i < f->triangle_end; i++) {
        uint32_t id = scene->face_triangles[i];
        const uint32_t *t = scene->triangles[id];
        KellerVec3 v[3] = {scene->vertices[t[0]], scene->vertices[t[1]], scene->vertices[t[2]]};
        Flat w[3] = {flatten(v[0], axis), flatten(v[1], axis), flatten(v[2], axis)};
        bool left = area2(w[0], w[1], w[2]) > 0, in = true;
        for (int j = 0; j < 3; j++) {
            int k = (j + 1) % 3;
            bool forward = t[j] < t[k];
            double s = forward ? area2(w[j], w[k], q) : area2(w[k], w[j], q);
            if ((s >= 0) != (forward == left)) in = false;
            if (scene->triangle_border[id] >> j & 1 && segment_distance(p, v[j], v[k]) <= h) border = id;
        }
        if (in && holder == KELLER_NONE) holder = id;
    }
    *triangle = holder != KELLER_NONE ? holder : border;
    return border != KELLER_NONE ? 0.5 : holder != KELLER_NONE ? 1 : 0;
}

typedef struct {
    const KellerScene *scene;
    uint32_t face, plane;
    KellerVec3 p;
} Owner;

static bool visit_owner(void *context, uint32_t id)
{
    Owner *o = context;
    uint32_t face = o->scene->triangle_face[id], triangle;
    return face < o->face && o->scene->faces[face].plane == o->plane &&
           path_face_weight(o->scene, face, o->p, -1, &triangle) > 0;
}

bool path_owns(const KellerScene *scene, const KellerAccel *accel, uint32_t face, KellerVec3 p, KellerAccelWork *work)
{
    Owner o = {scene, face, scene->faces[face].plane, p};
    KellerVec3 n = v3_scale(scene->faces[face].normal, 2 * scene->contact);
    return !keller_accel_segment(accel, v3_sub(p, n), v3_add(p, n), scene->contact, visit_owner, &o, work);
}

bool path_on_edge(const KellerScene *scene, uint32_t id, double z, double h)
{
    const KellerWedge *w = &scene->wedges[id];
    if (z > h && z < w->length - h) return true;
    if (!(fabs(z) <= h)) return false; /* outside, or at the far end */
    return w->goes_on[0];
}

double path_end_fade(const KellerScene *scene, const KellerPath *path, uint32_t i, double stiffness)
{
    const double zone = 1.5; /* root of rad: the way over a point so far off is 0.18 wavelengths longer */
    const KellerWedge *w = &scene->wedges[path->step[i].id];
    double z = v3_dot(v3_sub(path->position[i], w->origin), w->direction), cosine = v3_dot(path->leg[i], w->direction), fade = 1;
    double scale = sqrt(stiffness * greater(0, 1 - cosine * cosine)) / zone;
    for (int end = 0; end < 2; end++) {
        double part = scale * greater(0, end == 0 ? z : w->length - z);
        if (part < 1 && path->free_end[i] >> end & 1 && !w->goes_on[end]) fade *= sin(0.5 * M_PI * part);
    }
    return fade;
}

/* ---- borders ---------------------------------------------------------------------------------------------------- */

typedef struct {
    const KellerScene *scene;
    KellerVec3 p;
    double rounding;
    uint32_t plane;             /* of the face reflected in */
    KellerVec3 leg[2];          /* from p backwards and forwards, as long as the boundary test looks around */
} Rim;

static bool visit_rim(void *context, uint32_t id)
{
    const Rim *r = context;
    uint32_t face = r->scene->triangle_face[id], triangle;
    const KellerFace *f = &r->scene->faces[face];
    if (f->plane == r->plane || fabs(v3_dot(f->normal, r->p) - f->offset) > 4 * r->rounding) return false;
    for (int i = 0; i < 2; i++)
        if (fabs(v3_dot(f->normal, r->leg[i])) <= KELLER_BOUNDARY_ANGLE * v3_norm(r->leg[i]) &&
            path_face_weight(r->scene, face, v3_add(r->p, r->leg[i]), -1, &triangle) > 0)
            return true;
    return false;
}

double path_around_step(const KellerScene *scene, const KellerPath *path, double rounding)
{
    return greater(1e-6 * lesser(path->length, v3_distance(scene->lower, scene->upper)), 1e3 * rounding);
}

bool path_runs_along_border(const KellerScene *scene, const KellerAccel *accel, const KellerPath *path, size_t i,
                              double rounding, KellerAccelWork *work)
{
    const KellerFace *f = &scene->faces[path->step[i].id];
    double step = path_around_step(scene, path, rounding);
    Rim r = {scene, path->position[i], rounding, f->plane,
             {v3_scale(path->leg[i], -step), v3_scale(path->leg[i + 1], step)}};
    KellerVec3 n = v3_scale(f->normal, 4 * rounding);
    return keller_accel_segment(accel, v3_sub(r.p, n), v3_add(r.p, n), 4 * rounding, visit_rim, &r, work);
}
