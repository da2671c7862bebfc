/* keller/vec.h -- vectors of three doubles; all inline, all pure. Lengths in metres unless a caller says otherwise. */
#ifndef KELLER_VEC_H
#define KELLER_VEC_H
#include <math.h>

typedef struct {
    double x, y, z;
} KellerVec3;

static inline KellerVec3 v3(double x, double y, double z) { return (KellerVec3){x, y, z}; }
static inline KellerVec3 v3_add(KellerVec3 a, KellerVec3 b) { return v3(a.x + b.x, a.y + b.y, a.z + b.z); }
static inline KellerVec3 v3_sub(KellerVec3 a, KellerVec3 b) { return v3(a.x - b.x, a.y - b.y, a.z - b.z); }
static inline KellerVec3 v3_scale(KellerVec3 a, double s) { return v3(a.x * s, a.y * s, a.z * s); }
/* a + s b */
static inline KellerVec3 v3_madd(KellerVec3 a, KellerVec3 b, double s)
{
    return v3(a.x + s * b.x, a.y + s * b.y, a.z + s * b.z);
}
static inline double v3_dot(KellerVec3 a, KellerVec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline KellerVec3 v3_cross(KellerVec3 a, KellerVec3 b)
{
    return v3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
static inline double v3_norm(KellerVec3 a) { return sqrt(v3_dot(a, a)); }
static inline double v3_distance(KellerVec3 a, KellerVec3 b) { return v3_norm(v3_sub(a, b)); }
/* The unit vector along a; the zero vector stays zero. */
static inline KellerVec3 v3_unit(KellerVec3 a)
{
    double n = v3_norm(a);
    return n > 0 ? v3_scale(a, 1 / n) : a;
}
/* A unit vector perpendicular to the unit vector a (a deterministic, continuous-almost-everywhere choice). */
static inline KellerVec3 v3_perpendicular(KellerVec3 a)
{
    double x = fabs(a.x), y = fabs(a.y), z = fabs(a.z);
    KellerVec3 axis = x <= y && x <= z ? v3(1, 0, 0) : y <= z ? v3(0, 1, 0) : v3(0, 0, 1);
    return v3_unit(v3_cross(a, axis));
}
/* The mirror image of the point p in the plane {q : normal.q = offset}; normal is a unit vector. */
static inline KellerVec3 v3_mirror_point(KellerVec3 p, KellerVec3 normal, double offset)
{
    return v3_madd(p, normal, 2 * (offset - v3_dot(normal, p)));
}
/* The mirror image of a direction in a plane with that unit normal. */
static inline KellerVec3 v3_mirror_direction(KellerVec3 d, KellerVec3 normal)
{
    return v3_madd(d, normal, -2 * v3_dot(normal, d));
}
#endif
