/* oracle_sequence.h -- what oracle.c (one sequence) and oracle_enumerate.c (all of them) share. */
#ifndef TEST_ORACLE_SEQUENCE_H
#define TEST_ORACLE_SEQUENCE_H
#include "oracle.h"
#include <math.h>

typedef long double Real;

typedef struct {
    Real x, y, z;
} Point;

static inline Point wide(KellerVec3 v) { return (Point){v.x, v.y, v.z}; }
static inline KellerVec3 narrow(Point p) { return v3((double)p.x, (double)p.y, (double)p.z); }
static inline Point plus(Point a, Point b, Real s) { return (Point){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z}; }
static inline Point minus(Point a, Point b) { return plus(a, b, -1); }
static inline Real dot(Point a, Point b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline Real norm(Point a) { return sqrtl(dot(a, a)); }
static inline Real apart(Point a, Point b) { return norm(minus(a, b)); }
static inline Point cross(Point a, Point b)
{
    return (Point){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/* A conjunction of decisions. It flips to true only if all that failed flip, to false if one does. */
typedef struct {
    bool valid;
    Real least;  /* smallest margin of all decisions that held */
    Real failed; /* largest margin of those that failed */
} Verdict;

static inline double verdict_margin(const Verdict *v) { return (double)(v->valid ? v->least : v->failed); }

static inline Real height(const KellerScene *scene, uint32_t face, Point p)
{
    return dot(wide(scene->faces[face].normal), p) - scene->faces[face].offset;
}

static inline Point image(const KellerScene *scene, uint32_t face, Point p)
{
    return plus(p, wide(scene->faces[face].normal), -2 * height(scene, face, p));
}

static inline bool wedge_has_plane(const KellerScene *scene, uint32_t wedge, uint32_t plane)
{
    const KellerWedge *w = &scene->wedges[wedge];
    for (uint32_t i = w->plane_begin; i < w->plane_end; i++)
        if (scene->wedge_planes[i] == plane) return true;
    return false;
}

typedef struct {
    size_t before, after;                     /* reflections before and after the diffraction */
    uint32_t face_before[ORACLE_MAX_STEPS];   /* in order from the transmitter */
    uint32_t face_after[ORACLE_MAX_STEPS];    /* in order from the receiver */
    Point image_before[ORACLE_MAX_STEPS + 1]; /* of the transmitter: [i] after i mirrors */
    Point image_after[ORACLE_MAX_STEPS + 1];  /* of the receiver */
    uint32_t wedge;                           /* KELLER_NONE: reflections only, all of them `before` */
} Sequence;

/* Adds a decision; true while it is worth going on. */
bool oracle_decide(Verdict *v, bool holds, Real margin);

/* Walks back from `target` through `count` faces to the source of the images: image[i] is the source mirrored in
 * faces 0 to i - 1. Fills point[0..count-1]. */
bool oracle_walk_back(const KellerScene *scene, size_t count, const uint32_t *faces, const Point *images, Point target,
                      Point *point, Verdict *v);

/* Judges the points of a path, point[0] the transmitter and point[count + 1] the receiver: each in its face, sectors, free legs.
 * The steps and points are in *path only if it came so far. */
void oracle_judge(const KellerScene *scene, uint32_t count, const KellerStep *steps, const Point *point,
                  uint32_t transmissions, OraclePath *path, Verdict *v);

/* One edge, in whatever sector, or edges that lie in one line. */
bool oracle_same_edge(const KellerScene *scene, uint32_t a, uint32_t b);
bool oracle_follows_rules(const KellerScene *scene, uint32_t count, const KellerStep *steps);

/* A sequence with two diffractions or more. */
Verdict oracle_solve_edges(const KellerScene *scene, Point tx, Point rx, uint32_t count, const KellerStep *steps,
                           uint32_t transmissions, OraclePath *path);

/* Solves the sequence; the points and steps are in *path only if it came so far. */
Verdict oracle_solve_sequence(const KellerScene *scene, const Sequence *s, uint32_t transmissions, OraclePath *path);
#endif
