#include "path/sieve.h"

#include <stdlib.h>

#include "path/solve.h"

FaceBox *face_boxes(const KellerScene *scene)
{
    FaceBox *boxes = malloc((scene->face_count + 1) * sizeof *boxes);
    for (size_t f = 0; boxes && f < scene->face_count; f++) {
        FaceBox box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
        for (uint32_t i = scene->faces[f].triangle_begin; i < scene->faces[f].triangle_end; i++)
            for (int k = 0; k < 3; k++) {
                KellerVec3 v = scene->vertices[scene->triangles[scene->face_triangles[i]][k]];
                box.lower = v3(lesser(box.lower.x, v.x), lesser(box.lower.y, v.y), lesser(box.lower.z, v.z));
                box.upper = v3(greater(box.upper.x, v.x), greater(box.upper.y, v.y), greater(box.upper.z, v.z));
            }
        boxes[f] = box;
    }
    return boxes;
}

/* Of a point, along the wedge's edge and away from its line. */
static void from_edge(const KellerWedge *w, KellerVec3 p, double *z, double *rho)
{
    KellerVec3 q = v3_sub(p, w->origin);
    *z = v3_dot(q, w->direction);
    *rho = v3_norm(v3_madd(q, w->direction, -*z));
}

bool sieve_make(Sieve *s, const KellerScene *scene, const FaceBox *boxes, KellerVec3 tx, uint32_t count, const KellerStep *steps,
                const double lit[2], bool *useful)
{
    *useful = false;
    s->scene = scene;
    s->boxes = boxes;
    s->count = s->wedge = count;
    s->rounding = path_rounding(scene, tx);
    s->image[0] = tx;
    for (uint32_t i = 0; i < count; i++) {
        s->step[i] = steps[i];
        if (steps[i].kind == KELLER_DIFFRACTION) {
            if (s->wedge < count) return true;
            s->wedge = i;
            s->lit[0] = lit ? lit[0] : 0;
            s->lit[1] = lit ? lit[1] : scene->wedges[steps[i].id].length;
            from_edge(&scene->wedges[steps[i].id], s->image[i], &s->z, &s->rho);
            continue;
        }
        const KellerFace *f = &scene->faces[steps[i].id];
        if (i > 0 && steps[i - 1].kind == KELLER_REFLECTION && scene->faces[steps[i - 1].id].plane == f->plane) return false;
        if (s->wedge == count) s->image[i + 1] = v3_mirror_point(s->image[i], f->normal, f->offset);
    }
    *useful = true;
    return true;
}

/* Is the point p of a ray of this length within the face's box, or near enough for its border? */
static bool in_box(const FaceBox *box, KellerVec3 p, double margin)
{
    return p.x >= box->lower.x - margin && p.x <= box->upper.x + margin && p.y >= box->lower.y - margin &&
           p.y <= box->upper.y + margin && p.z >= box->lower.z - margin && p.z <= box->upper.z + margin;
}

/* Goes from `target` to the image that is mirrored in `count` faces, the steps first, first + way, ... */
static bool passes_faces(const Sieve *s, const KellerVec3 *image, KellerVec3 target, double rounding, uint32_t first, int way,
                         uint32_t count)
{
    double margin = 4 * (rounding + KELLER_BOUNDARY_ANGLE * v3_distance(image[count], target));
    for (uint32_t i = count; i-- > 0;) {
        uint32_t step = way > 0 ? first + i : first - i, face = s->step[step].id;
        KellerVec3 p;
        if (!path_cross_plane(&s->scene->faces[face], image[i + 1], target, &p)) return false;
        if (!in_box(&s->boxes[face], p, margin)) return false;
        target = p;
    }
    return true;
}

bool sieve_passes(const Sieve *s, KellerVec3 rx, double *place)
{
    const double rounding = greater(s->rounding, path_rounding_at(rx)); /* the scene's is in it */
    if (s->wedge == s->count) return passes_faces(s, s->image, rx, rounding, 0, 1, s->count);
    KellerVec3 image[KELLER_MAX_BENDS + 1] = {rx}; /* of the receiver, from behind */
    uint32_t behind = s->count - s->wedge - 1;
    for (uint32_t i = 0; i < behind; i++) {
        const KellerFace *f = &s->scene->faces[s->step[s->count - 1 - i].id];
        image[i + 1] = v3_mirror_point(image[i], f->normal, f->offset);
    }
    const KellerWedge *w = &s->scene->wedges[s->step[s->wedge].id];
    double z, rho;
    from_edge(w, image[behind], &z, &rho);
    double t = s->z + (z - s->z) * (s->rho / (s->rho + rho)); /* as path_shortest has it */
    if (!(s->rho + rho > 0) || t < s->lit[0] - 4 * rounding || t > s->lit[1] + 4 * rounding) return false;
    if (place) *place = t;
    KellerVec3 q = v3_madd(w->origin, w->direction, t);
    return passes_faces(s, s->image, q, rounding, 0, 1, s->wedge) &&
           passes_faces(s, image, q, rounding, s->count - 1, -1, behind);
}
