/* The parts of the exact solution: where points lie (place.c), the points of one sequence and its validity (solve.c), and
 * what is exactly on a boundary (around.c, grazing.c). */
#ifndef KELLER_PATH_SOLVE_H
#define KELLER_PATH_SOLVE_H
#include "path/internal.h"

/* How far the receiver's or source's image may be on the wrong side of a plane: rounding only. */
#define PATH_SIDE_SLACK 1e-12

/* Where the line from `image` (behind the plane) to `target` (in front of it) meets the face's plane; false if both are on
 * one side or the line runs along it. */
static inline bool path_cross_plane(const KellerFace *f, KellerVec3 image, KellerVec3 target, KellerVec3 *p)
{
    double hi = v3_dot(f->normal, image) - f->offset, ht = v3_dot(f->normal, target) - f->offset;
    double span = hi - ht;
    if (!(fabs(span) > PATH_SIDE_SLACK * v3_distance(image, target))) return false;
    double t = hi / span;
    if (!(t >= -PATH_SIDE_SLACK && t <= 1 + PATH_SIDE_SLACK)) return false;
    *p = v3_madd(image, v3_sub(target, image), greater(0, lesser(1, t)));
    return true;
}

/* Cuts the segment p[0] p[1] to where a height, linear along it and h0, h1 at its ends, is not negative; false if nowhere. */
static inline bool path_cut(KellerVec3 p[2], double h0, double h1)
{
    if (h0 < 0 && h1 < 0) return false;
    KellerVec3 at = v3_madd(p[0], v3_sub(p[1], p[0]), h0 / (h0 - h1));
    if (h0 < 0) p[0] = at;
    else if (h1 < 0) p[1] = at;
    return true;
}

/* 1 inside, 0 outside, 1/2 within h of the face's border (h < 0: never); *triangle is the one that holds p (the one nearest to
 * p's border otherwise). On an edge between two triangles of the face exactly one claims p: the edge's function is
 * evaluated with its ends in the order of ids, and zero belongs to the forward side. */
double path_face_weight(const KellerScene *scene, uint32_t face, KellerVec3 p, double h, uint32_t *triangle);

/* Where faces of one plane coincide, the wave meets one of them: true for the one with the lowest id (SPEC 6). */
bool path_owns(const KellerScene *scene, const KellerAccel *accel, uint32_t face, KellerVec3 p, KellerAccelWork *work);

/* Is the point at z (m, from the edge's origin) along the wedge's edge on it, given rounding h (m)? At an end exactly, no,
 * unless the edge goes on beyond it as another wedge: then the one that begins there claims it (both point the same way, in
 * canonical order). */
bool path_on_edge(const KellerScene *scene, uint32_t wedge, double z, double h);

/* The lift (PathLeg) of a leg v from a point on the wedge's edge: zero where it does not run along one of the sector's faces. */
KellerVec3 path_lift(const KellerWedge *wedge, KellerVec3 v, double rounding);

/* How far the positions are that decide what is exactly on a boundary, m: beyond rounding, too near for anything else. */
double path_around_step(const KellerScene *scene, const KellerPath *path, double rounding);

enum { PATH_DIRECTIONS = 4, PATH_AROUND = 8 * PATH_DIRECTIONS };

/* The i-th (< PATH_AROUND) of the pairs of positions around a and b. They come in opposite pairs, and exchanging a and b exchanges them. */
void path_around(int i, double step, KellerVec3 a, KellerVec3 b, KellerVec3 *beside_a, KellerVec3 *beside_b);

/* Does the wave of this path, reflected in step i at the border of its face, run along one face up to its border with
 * another? No share of it can be said to reflect there. */
bool path_runs_along_border(const KellerScene *scene, const KellerAccel *accel, const KellerPath *path, size_t i,
                            double rounding, KellerAccelWork *work);

/* Solves a sequence; the slabs on its legs are appended to the crossings and not yet steps of the path. strict: every decision
 * by sign alone. Else what is too close to call counts as a path and *boundary is set: a reflection at a face's border or in
 * the corner of two faces, a leg that grazes an edge. ground: planes that tx and rx lie in, whose faces are not in the way
 * there; KELLER_NONE: in none that is known. */
bool path_solve_sequence(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, KellerVec3 rx, const uint32_t ground[2],
                         size_t count, const KellerStep *steps, bool strict, KellerPath *path, Crossings *crossings, bool *boundary,
                         KellerAccelWork *work);

/* keller_path_solve between ends of which one or both lie in a plane of the scene (ground, as above). */
bool path_solve_on(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, KellerVec3 rx, const uint32_t ground[2],
                   size_t count, const KellerStep *steps, uint32_t transmissions, KellerPathFound found, void *context,
                   KellerAccelWork *work);
/* The planes in which a step's point is. */
const uint32_t *path_planes_of(const KellerScene *scene, const KellerStep *step, size_t *count);

/* The weight of a path without slabs whose legs graze several edges, one after the other, and that is on no other boundary. The waves
 * over the edges make good for each of them by itself, so each has its own share: the product, 1/4 for two. One is enough on a leg
 * between two diffractions, which positions around the stations would not move off a plane. False: not such a path. An edge
 * that follows another across a face, along which the leg runs, is no other boundary than that. */
bool path_several_grazed(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, KellerVec3 rx, const KellerPath *path,
                         double *weight, KellerAccelWork *work);

/* *whole: the path with the slabs on its legs as steps among the others. Together they are at most KELLER_MAX_INTERACTIONS. */
void path_insert(const KellerScene *scene, KellerVec3 tx, KellerVec3 rx, const KellerPath *path, const Crossings *crossings,
                 KellerPath *whole);
#endif
