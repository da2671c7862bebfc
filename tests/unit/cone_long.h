/* The elliptic conic frustum by its definition (eq. 2), in long double and without any slack: what constructors are
 * judged by. Include after cmocka.h. */
#ifndef KELLER_TESTS_CONE_LONG_H
#define KELLER_TESTS_CONE_LONG_H
#include "keller/cone.h"

#define DEGREE (M_PI / 180)

/* A point, or a direction, with 64 bits. */
typedef struct {
    long double x, y, z;
} Long3;

static inline Long3 longer(KellerVec3 v) { return (Long3){v.x, v.y, v.z}; }
static inline Long3 long_madd(Long3 a, Long3 b, long double s)
{
    return (Long3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}
static inline long double long_dot(Long3 a, Long3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/* Local coordinates from the origin: x, e y, z. */
static inline Long3 local(const KellerCone *c, Long3 p)
{
    Long3 q = long_madd(p, longer(c->origin), -1);
    return (Long3){long_dot(q, longer(c->major)), c->e * long_dot(q, longer(c->minor)),
                   long_dot(q, longer(c->directrix))};
}

static inline bool inside(const KellerCone *c, Long3 p)
{
    Long3 q = local(c, p);
    long double R = q.z * c->tan_alpha + c->x0;
    return R >= 0 && q.x * q.x + q.y * q.y <= R * R && q.z >= c->z_near && q.z <= c->z_far;
}

/* The same for a direction from the cone's apex: the ray stays inside at infinity. */
static inline bool direction_inside(const KellerCone *c, Long3 d)
{
    KellerCone cone = *c;
    cone.origin = v3(0, 0, 0);
    cone.x0 = 0;
    return inside(&cone, d);
}

static inline void assert_frame(const KellerCone *c)
{
    assert_true(fabs(v3_norm(c->directrix) - 1) < 1e-15 && fabs(v3_norm(c->major) - 1) < 1e-15);
    assert_true(fabs(v3_dot(c->directrix, c->major)) < 1e-15);
    assert_true(v3_distance(v3_cross(c->major, c->minor), c->directrix) < 2e-15);
    assert_true(c->e >= 1 && c->tan_alpha >= 0 && c->x0 >= 0 && c->z_near >= 0 && c->z_near <= c->z_far);
}

/* Area of the section, over pi, at distance 1 from the apex. */
static inline double area_of(const KellerCone *c) { return c->tan_alpha * c->tan_alpha / c->e; }
#endif
