/* cone_distance.h -- how far a point is from a primitive, in long double. */
#ifndef TEST_CONE_DISTANCE_H
#define TEST_CONE_DISTANCE_H
#include "keller/vec.h"
#include <stdbool.h>

typedef struct {
    long double x, y, z;
} Long3;

static inline Long3 long_sub(KellerVec3 a, KellerVec3 b)
{
    return (Long3){(long double)a.x - b.x, (long double)a.y - b.y, (long double)a.z - b.z};
}
static inline long double long_dot(Long3 a, Long3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline Long3 long_cross(Long3 a, Long3 b)
{
    return (Long3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline Long3 long_of(KellerVec3 a) { return (Long3){a.x, a.y, a.z}; }

static inline double distance_to_plane(KellerVec3 p, KellerVec3 normal, double offset)
{
    Long3 n = long_of(normal);
    return (double)fabsl((long_dot(n, long_of(p)) - offset) / sqrtl(long_dot(n, n)));
}

/* From the points a + t l, t in [t1, t2]. */
static inline double distance_to_long_line(Long3 q, Long3 l, double t1, double t2)
{
    long double ll = long_dot(l, l), t = ll > 0 ? long_dot(q, l) / ll : 0;
    t = t < t1 ? t1 : t > t2 ? t2 : t;
    Long3 d = {q.x - t * l.x, q.y - t * l.y, q.z - t * l.z};
    return (double)sqrtl(long_dot(d, d));
}
static inline double distance_to_line(KellerVec3 p, KellerVec3 a, KellerVec3 l, double t1, double t2)
{
    return distance_to_long_line(long_sub(p, a), long_of(l), t1, t2);
}

/* Above the inside: the distance to the plane; otherwise to the nearest side. */
static inline double distance_to_triangle(KellerVec3 p, const KellerVec3 v[3])
{
    Long3 n = long_cross(long_sub(v[1], v[0]), long_sub(v[2], v[0]));
    long double nn = long_dot(n, n);
    bool above = nn > 0;
    double nearest = INFINITY;
    for (int i = 0; i < 3; i++) {
        Long3 l = long_sub(v[(i + 1) % 3], v[i]), q = long_sub(p, v[i]);
        if (long_dot(long_cross(l, q), n) < 0) above = false;
        double d = distance_to_long_line(q, l, 0, 1);
        if (d < nearest) nearest = d;
    }
    if (!above) return nearest;
    double d = (double)(fabsl(long_dot(long_sub(p, v[0]), n)) / sqrtl(nn));
    return d < nearest ? d : nearest;
}

static inline double distance_to_box(KellerVec3 p, KellerVec3 lower, KellerVec3 upper)
{
    Long3 a = long_sub(lower, p), b = long_sub(p, upper);
    Long3 d = {fmaxl(0, fmaxl(a.x, b.x)), fmaxl(0, fmaxl(a.y, b.y)), fmaxl(0, fmaxl(a.z, b.z))};
    return (double)sqrtl(long_dot(d, d));
}
#endif
