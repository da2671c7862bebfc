#include "cone_cases.h"
#include "../unit/random.h"
#include "base/number.h"

const char *const cone_decade_names[CONE_DECADES] = {"0",          "1e-7..1e-6", "1e-6..1e-5", "1e-5..1e-4",
                                                     "1e-4..1e-3", "1e-3..1e-2", "0.01..0.1",  "0.1..1",
                                                     "1..10",      "10..45"};
const char *const cone_roundness_names[CONE_ROUNDNESSES] = {"0", "0..0.9", "0.9..1"};

static int pick(Random *r, int count) { return (int)(random_u32(r) % (uint32_t)count); }
static double unit(Random *r) { return random_u32(r) * 0x1p-32; }
/* 10 to the power of a number in [lo, hi) */
static double log_in(Random *r, double lo, double hi) { return exp(M_LN10 * (lo + (hi - lo) * unit(r))); }

/* Seed and index well mixed (splitmix64's finaliser). */
static Random stream(ConeKind kind, uint64_t seed, uint64_t index)
{
    uint64_t x = (seed * CONE_KINDS + (uint64_t)kind) * 0xD1B54A32D192ED03u + (index + 1) * 0x9E3779B97F4A7C15u;
    x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9u;
    x = (x ^ x >> 27) * 0x94D049BB133111EBu;
    Random r = {x ^ x >> 31};
    random_u32(&r);
    return r;
}

static KellerVec3 axis_vector(int k, double sign)
{
    return v3(k == 0 ? sign : 0, k == 1 ? sign : 0, k == 2 ? sign : 0);
}

/* ---- the cone ---------------------------------------------------------------------------------------------------- */

static void draw_cone(Random *r, ConeKind kind, ConeCase *c)
{
    double angle = 0, eccentricity = 0;
    if (c->decade > 0) angle = log_in(r, c->decade - 8, c->decade == 9 ? log10(45) : c->decade - 7) * M_PI / 180;
    if (c->roundness == 1) eccentricity = 0.9 * (1 - unit(r));
    if (c->roundness == 2) eccentricity = 1 - log_in(r, -7, -1);
    c->cone.tan_alpha = tan(angle);
    c->cone.e = 1 / sqrt((1 - eccentricity) * (1 + eccentricity));
    c->cone.x0 = pick(r, 2) ? 0 : log_in(r, -6, 3);
    c->cone.z_near = 0;
    c->cone.z_far = INFINITY;
    c->cone.origin = random_point(r, pick(r, 2) ? log_in(r, -3, 5) : pick(r, 2));
    int k = pick(r, 3), style = pick(r, 4);
    bool box = kind == CONE_BOX || kind == CONE_BOX8 || kind == CONE_CONTAINS_BOX;
    if (box && (c->family == CONE_ON_GENERATOR || c->family == CONE_NEAR_GENERATOR)) { /* a generator along an axis */
        KellerVec3 ek = axis_vector(k, pick(r, 2) ? 1 : -1), ej = axis_vector((k + 1) % 3, pick(r, 2) ? 1 : -1);
        if (c->family == CONE_NEAR_GENERATOR) angle += log_in(r, -16, -3) * (pick(r, 2) ? 1 : -1);
        c->cone.directrix = v3_add(v3_scale(ek, cos(angle)), v3_scale(ej, sin(angle)));
        c->cone.major = v3_add(v3_scale(ek, -sin(angle)), v3_scale(ej, cos(angle)));
    } else if (style == 0 || (box && c->family == CONE_AXIS_PARALLEL)) {
        c->cone.directrix = axis_vector(k, pick(r, 2) ? 1 : -1);
        c->cone.major = axis_vector((k + 1 + pick(r, 2)) % 3, pick(r, 2) ? 1 : -1);
    } else {
        c->cone.directrix = random_unit(r);
        if (style == 1) { /* nearly along an axis */
            c->cone.directrix = v3_unit(v3_madd(axis_vector(k, 1), c->cone.directrix, log_in(r, -17, -1)));
        }
        KellerVec3 side = v3_perpendicular(c->cone.directrix);
        double turn = random_in(r, -M_PI, M_PI);
        c->cone.major = v3_add(v3_scale(side, cos(turn)), v3_scale(v3_cross(c->cone.directrix, side), sin(turn)));
    }
    c->cone.minor = v3_cross(c->cone.directrix, c->cone.major);
}

static void draw_clip(Random *r, ConeCase *c, double distance)
{
    c->clip = (KellerRange){pick(r, 4) ? 0 : -INFINITY, INFINITY};
    int how = pick(r, 8);
    if (how & 1 && how & 4) c->cone.z_near = distance * random_in(r, 0, 1.5);
    if (how & 2 && how & 4) c->cone.z_far = c->cone.z_near + distance * random_in(r, 0, 2);
    how = pick(r, 8);
    if (how & 1 && how & 4) c->clip.near = distance * random_in(r, 0, 1.2);
    if (how & 2 && how & 4) c->clip.far = greater(c->clip.near, 0) + distance * random_in(r, -0.1, 2);
    if (pick(r, 64) == 0) c->clip.far = c->clip.near;
}

static double radius(const ConeCase *c, double z) { return z * c->cone.tan_alpha + c->cone.x0; }

/* A point of the stretched frame, at (cos phi, sin phi) times `rho`. */
static KellerVec3 polar(double rho, double phi, double z) { return v3(rho * cos(phi), rho * sin(phi), z); }

static KellerVec3 world(const ConeCase *c, KellerVec3 p)
{
    const KellerCone *k = &c->cone;
    return v3_madd(v3_madd(v3_madd(k->origin, k->directrix, p.z), k->major, p.x), k->minor, p.y / k->e);
}

static KellerVec3 apex(const ConeCase *c)
{
    double z = -c->cone.x0 / c->cone.tan_alpha;
    return v3(0, 0, z > -1e5 ? z : 0); /* a cylinder has none; NaN too */
}

/* The target: `size` is the primitive's. */
static KellerVec3 draw_target(Random *r, const ConeCase *c, double size, double distance)
{
    double z = pick(r, 16) ? distance * unit(r) : pick(r, 2) ? 0 : -distance * unit(r);
    double R = radius(c, z), phi = random_in(r, -M_PI, M_PI);
    switch (pick(r, 6)) {
    case 0:
    case 1:
        return polar(R * sqrt(unit(r)), phi, z);
    case 2:
        return polar(R * (1 + (pick(r, 2) ? 1 : -1) * log_in(r, -16, -1)), phi, z);
    case 3:
        return polar(R * (1 + unit(r)), phi, z);
    case 4:
        return polar(R + size * unit(r), phi, z);
    default:
        return polar(pick(r, 2) ? R : 0, phi, z);
    }
}

/* ---- vertices ---------------------------------------------------------------------------------------------------- */

static void random_triangle(Random *r, ConeCase *c, double size, double distance)
{
    double width = size * (pick(r, 2) ? 1 : log_in(r, -6, 0)), share[3] = {unit(r), unit(r), 0};
    KellerVec3 along = random_unit(r), across = v3_unit(v3_cross(along, random_unit(r))), offset[3], at = v3(0, 0, 0);
    for (int i = 0; i < 3; i++)
        offset[i] = v3_add(v3_scale(along, size * random_in(r, -1, 1)), v3_scale(across, width * random_in(r, -1, 1)));
    if (share[0] + share[1] > 1) {
        share[0] = 1 - share[0];
        share[1] = 1 - share[1];
    }
    int where = pick(r, 4); /* on the inside, on the first edge, a vertex */
    if (where == 0) share[1] = 1 - share[0];
    if (where == 1) {
        share[0] = 1;
        share[1] = 0;
    }
    share[2] = where == 0 ? 0 : 1 - share[0] - share[1];
    for (int i = 0; i < 3; i++) at = v3_madd(at, offset[i], share[i]);
    KellerVec3 target = world(c, draw_target(r, c, size, distance));
    for (int i = 0; i < 3; i++) c->v[i] = v3_add(target, v3_sub(offset[i], at));
}

/* Vertices in the plane that touches the cone along a generator, moved inwards by `in` and turned by `turn`. */
static void tangent_triangle(Random *r, ConeCase *c, double size, double distance, double in, double turn)
{
    double phi = pick(r, 4) ? random_in(r, -M_PI, M_PI) : pick(r, 4) * M_PI_2, z0 = distance * random_in(r, -0.2, 1);
    for (int i = 0; i < 3; i++) {
        double z = z0 + size * random_in(r, -1, 1), s = size * random_in(r, -1, 1);
        double R = radius(c, z) * (1 - in) + turn * (z - z0);
        c->v[i] = world(c, v3(R * cos(phi) - s * sin(phi), R * sin(phi) + s * cos(phi), z));
    }
}

static void adversarial_triangle(Random *r, ConeCase *c, double size, double distance)
{
    double z[2] = {distance * random_in(r, -0.2, 1), distance * random_in(r, -0.2, 1)};
    double phi = pick(r, 4) ? random_in(r, -M_PI, M_PI) : pick(r, 4) * M_PI_2;
    random_triangle(r, c, size, distance);
    switch (c->family) {
    case CONE_TANGENT:
        tangent_triangle(r, c, size, distance, pick(r, 2) ? 0 : (pick(r, 2) ? 1 : -1) * log_in(r, -16, -3), 0);
        break;
    case CONE_NEAR_GENERATOR:
        tangent_triangle(r, c, size, distance, pick(r, 2) ? unit(r) : 0, (pick(r, 2) ? 1 : -1) * log_in(r, -17, -2));
        break;
    case CONE_THROUGH_APEX: {
        KellerVec3 a = apex(c),
                   d = pick(r, 2) ? random_unit(r) : polar(c->cone.tan_alpha * random_in(r, -2, 2), phi, 1);
        c->v[0] = world(c, v3_madd(a, d, size * unit(r)));
        c->v[1] = world(c, v3_madd(a, d, pick(r, 4) ? -size * unit(r) : 0));
        break;
    }
    case CONE_ON_GENERATOR:
        for (int i = 0; i < 2; i++) c->v[i] = world(c, polar(radius(c, z[i]), phi, z[i]));
        if (pick(r, 2)) c->v[2] = world(c, polar(radius(c, z[0]) * random_in(r, 0, 2), phi, z[0] + size * unit(r)));
        break;
    case CONE_AXIS_PARALLEL: {
        double rho = pick(r, 3) ? radius(c, greater(z[0], 0)) * (pick(r, 2) ? 1 : unit(r)) : pick(r, 2) ? 0 : size;
        for (int i = 0; i < 2; i++) c->v[i] = world(c, polar(rho, phi, z[i]));
        break;
    }
    case CONE_ON_ENVELOPE:
        for (int i = 0; i < 3; i++) {
            double at = distance * random_in(r, -0.1, 1);
            c->v[i] = world(c, polar(radius(c, at), random_in(r, -M_PI, M_PI), at));
        }
        break;
    case CONE_DEGENERATE:
        switch (pick(r, 4)) {
        case 0:
            c->v[1] = c->v[2] = c->v[0];
            break;
        case 1:
            c->v[pick(r, 2)] = c->v[2];
            break;
        case 2:
            c->v[2] = v3_madd(c->v[0], v3_sub(c->v[1], c->v[0]), random_in(r, -1, 2));
            break;
        default:
            c->v[2] =
                v3_madd(v3_madd(c->v[0], v3_sub(c->v[1], c->v[0]), unit(r)), random_unit(r), size * log_in(r, -16, -6));
        }
        break;
    case CONE_AT_ORIGIN:
        c->v[0] = c->cone.origin;
        if (pick(r, 2)) c->v[1] = world(c, polar(radius(c, z[0]), phi, z[0]));
        break;
    case CONE_WITH_AXIS:
        for (int i = 0; i < 3; i++) {
            double at = distance * random_in(r, -0.2, 1);
            c->v[i] =
                world(c, polar(pick(r, 3) ? radius(c, at) * random_in(r, -2, 2) : size * random_in(r, -1, 1), phi, at));
        }
        break;
    case CONE_BEHIND: {
        double z0 = apex(c).z;
        for (int i = 0; i < 3; i++) {
            double at = z0 - distance * random_in(r, i ? -0.5 : 0, 1);
            c->v[i] = world(c, polar(radius(c, at) * random_in(r, -2, 2), pick(r, 2) ? phi : -phi, at));
        }
        c->clip.near = -INFINITY;
        break;
    }
    default:
        break;
    }
}

/* ---- boxes ------------------------------------------------------------------------------------------------------- */

static void draw_box(Random *r, ConeCase *c, double size, double distance)
{
    double side[3], at[3], target[3], outward[3];
    KellerVec3 p = draw_target(r, c, size, distance);
    if (c->family == CONE_THROUGH_APEX || c->family == CONE_AT_ORIGIN)
        p = c->family == CONE_AT_ORIGIN ? v3(0, 0, 0) : apex(c);
    if (c->family == CONE_BEHIND) p = v3_madd(apex(c), v3(p.x, p.y, -1), distance * unit(r));
    if (c->family == CONE_TANGENT || c->family == CONE_ON_GENERATOR || c->family == CONE_NEAR_GENERATOR) {
        double z = distance * random_in(r, -0.1, 1);
        p = c->family == CONE_TANGENT ? polar(radius(c, z), random_in(r, -M_PI, M_PI), z)
                                      : v3(-radius(c, z) * (pick(r, 2) ? 1 : 1 + log_in(r, -16, -2)), 0, z);
    }
    KellerVec3 w = world(c, p),
               n = v3_sub(world(c, v3(p.x, p.y * c->cone.e * c->cone.e, p.z)), world(c, v3(0, 0, p.z)));
    n = v3_madd(n, c->cone.directrix, -c->cone.tan_alpha * length2(p.x, p.y));
    target[0] = w.x, target[1] = w.y, target[2] = w.z;
    outward[0] = n.x, outward[1] = n.y, outward[2] = n.z;
    bool flat = c->family == CONE_DEGENERATE || pick(r, 8) == 0;
    for (int k = 0; k < 3; k++) {
        side[k] = flat && pick(r, 2) ? 0 : size * (pick(r, 2) ? 1 : log_in(r, -4, 0));
        at[k] = pick(r, 4) ? unit(r) : pick(r, 2);
        if (c->family == CONE_TANGENT && pick(r, 16)) at[k] = outward[k] > 0 ? 0 : 1;
        if (c->family == CONE_ON_ENVELOPE) at[k] = pick(r, 2);
    }
    c->v[0] = v3(target[0] - at[0] * side[0], target[1] - at[1] * side[1], target[2] - at[2] * side[2]);
    c->v[1] =
        v3(target[0] + (1 - at[0]) * side[0], target[1] + (1 - at[1]) * side[1], target[2] + (1 - at[2]) * side[2]);
}

/* ---- a case ------------------------------------------------------------------------------------------------------ */

static void draw_primitive(Random *r, ConeKind kind, ConeCase *c, double distance)
{
    /* primitives of a containment test are small against the cone as often as not */
    bool contained = kind == CONE_CONTAINS_BOX || kind == CONE_CONTAINS_TRIANGLE || kind >= CONE_CORNERS;
    double size = lesser(1e4, greater(1e-4, distance * log_in(r, -2, 2)));
    if (contained && pick(r, 4)) size = greater(1e-9, radius(c, distance * unit(r)) * log_in(r, -2, 0));
    if (kind == CONE_BOX || kind == CONE_CONTAINS_BOX || kind == CONE_BOX8 || kind == CONE_CORNERS ||
        kind == CONE_INSIDE_BOX8) {
        draw_box(r, c, size, distance);
    } else if (c->family == CONE_RANDOM || c->family == CONE_CLIP_VERTEX) {
        random_triangle(r, c, size, distance);
    } else {
        adversarial_triangle(r, c, size, distance);
    }
    if (c->family == CONE_CLIP_VERTEX) {
        double z = v3_dot(v3_sub(c->v[pick(r, 2)], c->cone.origin), c->cone.directrix);
        switch (pick(r, 4)) {
        case 0:
            c->clip.far = z;
            break;
        case 1:
            c->cone.z_far = greater(z, c->cone.z_near);
            break;
        case 2:
            c->clip.near = z;
            break;
        default:
            c->cone.z_near = greater(z, 0);
            c->cone.z_far = greater(c->cone.z_far, c->cone.z_near);
        }
    }
    KellerVec3 direction = v3_sub(c->v[1], c->v[0]);
    if (kind == CONE_LINE) {
        if (!(v3_norm(direction) > 0)) direction = random_unit(r);
        if (c->family == CONE_DEGENERATE) direction = pick(r, 2) ? c->cone.directrix : axis_vector(pick(r, 3), 1);
        c->v[1] = v3_scale(direction, log_in(r, -3, 3));
    }
    if (kind == CONE_PLANE) {
        KellerVec3 n = v3_cross(direction, v3_sub(c->v[2], c->v[0]));
        if (!(v3_norm(n) > 1e-8 * v3_dot(direction, direction))) n = random_unit(r);
        if (c->family == CONE_DEGENERATE) n = pick(r, 2) ? c->cone.directrix : axis_vector(pick(r, 3), 1);
        n = v3_unit(v3_unit(n));
        c->offset = v3_dot(n, c->v[0]);
        c->v[0] = n;
    }
}

static void begin(Random *r, ConeKind kind, ConeCase *c, int decade, int roundness, int family, double *distance)
{
    *c = (ConeCase){.decade = decade < 0 ? pick(r, CONE_DECADES) : decade,
                    .roundness = roundness < 0 ? pick(r, CONE_ROUNDNESSES) : roundness};
    c->family = (ConeFamily)(family >= 0 ? family : pick(r, 2) ? CONE_RANDOM : 1 + pick(r, CONE_FAMILIES - 1));
    draw_cone(r, kind, c);
    *distance = log_in(r, -3, 4);
    draw_clip(r, c, *distance);
}

ConeCase cone_case(ConeKind kind, uint64_t seed, uint64_t index, int decade, int roundness, int family)
{
    Random r = stream(kind, seed, index);
    double distance;
    ConeCase c;
    begin(&r, kind, &c, decade, roundness, family, &distance);
    draw_primitive(&r, kind, &c, distance);
    return c;
}

ConeCase8 cone_case8(ConeKind kind, uint64_t seed, uint64_t index, int decade, int roundness, int family)
{
    Random r = stream(kind, seed, index);
    double distance;
    ConeCase8 c;
    begin(&r, kind, &c.one, decade, roundness, family, &distance);
    c.size = 0;
    for (int i = 0; i < 8; i++) {
        if (i > 0 && family < 0)
            c.one.family = (ConeFamily)(pick(&r, 2) ? CONE_RANDOM : 1 + pick(&r, CONE_FAMILIES - 1));
        draw_primitive(&r, kind, &c.one, distance);
        for (int j = 0; j < 3; j++) {
            const double p[3] = {c.one.v[j].x, c.one.v[j].y, c.one.v[j].z};
            for (int k = 0; k < 3; k++) {
                float f = (float)p[k];
                c.vertices[j].p[k][i] = f;
                if (j == 0) c.boxes.lower[k][i] = f;
                if (j == 1) c.boxes.upper[k][i] = f;
                c.size = greater(c.size, fabs((double)f));
            }
        }
        if (kind == CONE_BOX8 && pick(&r, 16) == 0) { /* an empty lane */
            c.boxes.lower[0][i] = 1;
            c.boxes.upper[0][i] = -1;
            c.size = greater(c.size, 1);
        }
    }
    if (pick(&r, 4) == 0) c.size *= 1 + unit(&r);
    return c;
}
