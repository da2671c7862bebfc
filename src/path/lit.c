/* The rays from a point to a part of an edge fill a flat triangle. Each triangle of the scene that cuts it casts an interval of shadow on
 * the edge. What of the part lies between the first and the last lit place is all that a search needs to know. */
#include "path/lit.h"

#include <math.h>

#include "base/number.h"
#include "path/solve.h"

enum { SHADOWS_MOST = 256 };    /* more of them are not looked at: they could only narrow the part */
static const double GRAZING = 1e-3,     /* sine: flatter rays' places on the edge are not known well enough */
    NEAREST = 1e-3,             /* of the distance: nearer to the source, rounding moves a shadow too far */
    BLURRED = 1e-3,             /* of the edge's length: shadows known no better hide nothing */
    WIDEST = 1;                 /* rad, of a cone */

/* Of one triangle. Its ends are known to `blur` (m) each; side: of the mesh, on which the end is (0: none, or in one of its vertices). */
typedef struct {
    double from, to, blur;
    uint64_t side_from, side_to;
} Shadow;

typedef struct {
    const KellerScene *scene;
    const KellerFace *mirror;   /* that the leg starts from, NULL: none */
    const KellerFace *next;     /* that it ends in, NULL: it ends in the edge; else the edge is an image behind it */
    const KellerWedge *wedge;   /* or its image */
    KellerVec3 source, across, normal;  /* across: from the source to the edge's line; normal to it and to the edge */
    double distance, z;         /* m: from the source to the edge's line, and where along it the source is */
    double touch, flat, sine;   /* m: nearer to the ends of a leg nothing hides; nearer to the plane things are in it. Of the flattest ray */
    double side, next_side;     /* sign of the mirrors' sides that the source is on */
    bool slabs;                 /* may be passed through */
    bool grazes;                /* all rays graze an edge: how much of each passes is decided beside it, beyond any blur */
    uint32_t count[2];          /* of shadows: of a plane moved a little to either side */
    Shadow (*shadow)[SHADOWS_MOST];     /* [2] */
} Sight;

/* Where the triangle cuts the plane, in which vertices count as above it (`up`) or below. Each point is computed from the ends of a side
 * in the order of their ids, so that neighbours agree. *blur: how far off, m, the points may be; on[i]: the side that has p[i]. */
static bool section(const Sight *s, const uint32_t *t, const double h[3], bool up, KellerVec3 p[2], uint64_t on[2], double *blur)
{
    int found = 0;
    *blur = 0;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, a = t[i] < t[j] ? i : j, b = i + j - a;
        bool above = h[a] == 0 ? up : h[a] > 0, other = h[b] == 0 ? up : h[b] > 0;
        if (above == other) continue;
        KellerVec3 va = s->scene->vertices[t[a]], l = v3_sub(s->scene->vertices[t[b]], va);
        on[found] = h[a] != 0 && h[b] != 0 ? ((uint64_t)t[a] << 32 | t[b]) + 1 : 0;
        p[found++] = v3_madd(va, l, h[a] / (h[a] - h[b]));
        *blur = greater(*blur, s->flat * (1 + v3_norm(l) / fabs(h[a] - h[b])));
    }
    return found == 2;
}

/* along: it is of a side that lies in the plane of all rays. */
static void add_shadow(Sight *s, int side, KellerVec3 p[2], uint64_t on[2], double blur, bool along)
{
    const KellerVec3 whole[2] = {p[0], p[1]};
    double rho[2], z[2];
    for (int i = 0; i < 2 && s->mirror; i++) rho[i] = -s->side * (v3_dot(s->mirror->normal, p[i]) - s->mirror->offset) - s->touch;
    if (s->mirror && !path_cut(p, rho[0], rho[1])) return;
    for (int i = 0; i < 2 && s->next; i++) rho[i] = s->next_side * (v3_dot(s->next->normal, p[i]) - s->next->offset) - s->touch;
    if (s->next && !path_cut(p, rho[0], rho[1])) return;
    const double near = greater(s->touch, NEAREST * s->distance);
    for (int i = 0; i < 2; i++) rho[i] = v3_dot(s->across, v3_sub(p[i], s->source));
    if (!path_cut(p, rho[0] - near, rho[1] - near)) return;
    for (int i = 0; i < 2; i++) rho[i] = v3_dot(s->across, v3_sub(p[i], s->source));
    if (!path_cut(p, s->distance - s->touch - rho[0], s->distance - s->touch - rho[1])) return;
    s->grazes = s->grazes || along;
    for (int i = 0; i < 2; i++) {
        KellerVec3 from = v3_sub(p[i], s->source);
        double scale = s->distance / v3_dot(s->across, from);
        blur = greater(blur, blur * scale / (s->sine * s->sine));
        z[i] = s->z + v3_dot(s->wedge->direction, from) * scale;
        if (v3_distance(p[i], whole[i]) > 0) on[i] = 0; /* cut off */
    }
    if (!(blur < BLURRED * s->wedge->length) || s->count[side] == SHADOWS_MOST) return;
    const int first = z[0] <= z[1] ? 0 : 1;
    s->shadow[side][s->count[side]++] = (Shadow){z[first], z[1 - first], blur, on[first], on[1 - first]};
}

static double visit(void *context, uint32_t id, KellerRange range)
{
    Sight *s = context;
    (void)range;
    const KellerScene *scene = s->scene;
    const uint32_t face = scene->triangle_face[id], plane = scene->faces[face].plane, *t = scene->triangles[id];
    if (s->next ? s->next->plane == plane : path_wedge_in_plane(scene, s->wedge, plane)) return INFINITY;
    if (s->mirror && s->mirror->plane == plane) return INFINITY;
    if (s->slabs && path_lets_through(scene, face)) return INFINITY;
    /* from within its plane rays graze it, and may pass by either side */
    if (fabs(v3_dot(scene->faces[face].normal, s->source) - scene->faces[face].offset) <= s->touch) return INFINITY;
    double h[3], blur;
    int in_plane = 0;
    for (int i = 0; i < 3; i++) {
        h[i] = v3_dot(s->normal, v3_sub(scene->vertices[t[i]], s->source));
        if (fabs(h[i]) > s->flat) continue;
        h[i] = 0;
        in_plane++;
    }
    if (in_plane == 3) return INFINITY; /* edge-on */
    for (int side = 0; side < 2; side++) {
        KellerVec3 p[2];
        uint64_t on[2];
        if (section(s, t, h, side == 0, p, on, &blur)) add_shadow(s, side, p, on, blur, in_plane == 2);
    }
    return INFINITY;
}

/* Where the first lit place is at the earliest, going from `at` in the direction of growing z (way 1) or the other one. A shadow goes on
 * where another ends if it surely reaches beyond that, or if both end on the same side of the mesh: whatever rounding does to one it does to
 * the other. Two that only touch in a vertex may have light between them. */
static double first_lit(uint32_t count, const Shadow *shadow, double at, int way)
{
    double slack = 0;           /* m: how well the place is known */
    uint64_t side = 0;
    for (bool moved = true; moved;) {
        moved = false;
        for (uint32_t i = 0; i < count; i++) {
            const Shadow *s = &shadow[i];
            const double begin = way > 0 ? s->from : -s->to, end = way > 0 ? s->to : -s->from, here = way * at;
            const uint64_t begins_on = way > 0 ? s->side_from : s->side_to, ends_on = way > 0 ? s->side_to : s->side_from;
            if (!(end > here) || !(begin + s->blur <= here - slack || (side != 0 && begins_on == side))) continue;
            at = way * end;
            slack = s->blur;
            side = ends_on;
            moved = true;
        }
    }
    return at - way * slack;
}

/* The sign of the face's side that the point is on; false: too near to tell. */
static bool side_of(const KellerFace *f, KellerVec3 p, double touch, double *side)
{
    const double height = v3_dot(f->normal, p) - f->offset;
    *side = height > 0 ? 1 : -1;
    return fabs(height) > touch;
}

/* One leg: `mirror` and `next` as in Sight, `mirrors` on the whole way. */
static bool lit_leg(const TreeLimits *limits, KellerVec3 source, const KellerFace *mirror, const KellerFace *next,
                    const KellerWedge *w, uint32_t mirrors, double *from, double *to, KellerAccelWork *work)
{
    const KellerScene *scene = limits->scene;
    Shadow shadow[2][SHADOWS_MOST]; /* not cleared: most edges have few */
    Sight s = {.scene = scene, .mirror = mirror, .next = next, .wedge = w, .source = source, .slabs = limits->transmissions > 0,
               .touch = 4 * scene->contact, .shadow = shadow};
    KellerVec3 v = v3_sub(w->origin, source);
    s.z = -v3_dot(v, w->direction);
    v = v3_madd(v, w->direction, s.z);
    s.distance = v3_norm(v);
    const double reach = hypot(s.distance, greater(fabs(*from - s.z), fabs(*to - s.z)));
    const double rounding = (mirrors + 1) * path_rounding(scene, source);
    s.sine = s.distance / reach;
    s.flat = 4 * (rounding + KELLER_BOUNDARY_ANGLE * reach);
    if (!(s.sine > GRAZING) || !(s.distance > 4 * s.touch)) return true;
    if (s.mirror && !side_of(s.mirror, source, s.touch, &s.side)) return true;
    if (s.next) {
        double beyond[2];
        const bool told = side_of(s.next, source, s.touch, &s.next_side) &&
                          side_of(s.next, v3_madd(w->origin, w->direction, *from), s.touch, &beyond[0]) &&
                          side_of(s.next, v3_madd(w->origin, w->direction, *to), s.touch, &beyond[1]);
        if (!told || beyond[0] == s.next_side || beyond[1] == s.next_side) return true;
    }
    s.across = v3_scale(v, 1 / s.distance);
    s.normal = v3_cross(s.across, w->direction);
    const double low = atan2(*from - s.z, s.distance), high = atan2(*to - s.z, s.distance);
    const int pieces = 1 + (int)((high - low) / WIDEST);
    for (int i = 0; i < pieces; i++) {
        KellerVec3 direction[2];
        for (int k = 0; k < 2; k++) {
            double angle = low + (high - low) * (i + k) / pieces;
            direction[k] = v3_add(v3_scale(s.across, cos(angle)), v3_scale(w->direction, sin(angle)));
        }
        KellerCone cone;
        if (keller_cone_fan(1, &source, 2, direction, &cone, NULL))
            keller_accel_cone(limits->accel, &cone, (KellerRange){0, reach + rounding}, visit, NULL, &s, work);
    }
    if (s.grazes) return true;
    double first = INFINITY, last = -INFINITY;
    for (int side = 0; side < 2; side++) {
        first = lesser(first, first_lit(s.count[side], s.shadow[side], *from, 1));
        last = greater(last, first_lit(s.count[side], s.shadow[side], *to, -1));
    }
    *from = greater(*from, first);
    *to = lesser(*to, last);
    return *from <= *to;
}

bool lit_way(const TreeLimits *limits, KellerVec3 end, uint32_t count, const uint32_t *face, uint32_t wedge, double *from,
             double *to, KellerAccelWork *work)
{
    const KellerScene *scene = limits->scene;
    KellerVec3 image[KELLER_MAX_BENDS + 1] = {end};
    KellerWedge line = scene->wedges[wedge];
    for (uint32_t i = 0; i < count; i++) {
        const KellerFace *f = &scene->faces[face[i]];
        image[i + 1] = v3_mirror_point(image[i], f->normal, f->offset);
    }
    for (uint32_t leg = count + 1; leg-- > 0;) { /* the last one first: it hides most */
        const KellerFace *next = leg < count ? &scene->faces[face[leg]] : NULL;
        if (next) {
            line.origin = v3_mirror_point(line.origin, next->normal, next->offset);
            line.direction = v3_mirror_direction(line.direction, next->normal);
        }
        const KellerFace *mirror = leg > 0 ? &scene->faces[face[leg - 1]] : NULL;
        if (!lit_leg(limits, image[leg], mirror, next, &line, count, from, to, work)) return false;
    }
    return true;
}
