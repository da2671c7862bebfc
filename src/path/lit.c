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

typedef struct {
    double from, to;
} Shadow;

typedef struct {
    const KellerScene *scene;
    const KellerFace *mirror;   /* NULL: none */
    const KellerWedge *wedge;
    KellerVec3 source, across, normal;  /* across: from the source to the edge's line; normal to it and to the edge */
    double distance, z;         /* m: from the source to the edge's line, and where along it the source is */
    double touch, flat, sine;   /* m: nearer to the ends of a leg nothing hides; nearer to the plane things are in it. Of the flattest ray */
    double side;                /* sign of the mirror's side that the source is on */
    double blur;                /* m: how far shadows may end from where they do */
    bool slabs;                 /* may be passed through */
    uint32_t count[2];          /* of shadows: of a plane moved a little to either side */
    Shadow shadow[2][SHADOWS_MOST];
} Sight;

/* Where the triangle cuts the plane, in which vertices count as above it (`up`) or below. Each point is computed from the ends of a side
 * in the order of their ids, so that neighbours agree. *blur: how far off, m, the points may be. */
static bool section(const Sight *s, const uint32_t *t, const double h[3], bool up, KellerVec3 p[2], double *blur)
{
    int found = 0;
    *blur = 0;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, a = t[i] < t[j] ? i : j, b = i + j - a;
        bool above = h[a] == 0 ? up : h[a] > 0, other = h[b] == 0 ? up : h[b] > 0;
        if (above == other) continue;
        KellerVec3 va = s->scene->vertices[t[a]], l = v3_sub(s->scene->vertices[t[b]], va);
        p[found++] = v3_madd(va, l, h[a] / (h[a] - h[b]));
        *blur = greater(*blur, s->flat * (1 + v3_norm(l) / fabs(h[a] - h[b])));
    }
    return found == 2;
}

static void add_shadow(Sight *s, int side, KellerVec3 p[2], double blur)
{
    double rho[2], z[2];
    for (int i = 0; i < 2 && s->mirror; i++) rho[i] = -s->side * (v3_dot(s->mirror->normal, p[i]) - s->mirror->offset) - s->touch;
    if (s->mirror && !path_cut(p, rho[0], rho[1])) return;
    const double near = greater(s->touch, NEAREST * s->distance);
    for (int i = 0; i < 2; i++) rho[i] = v3_dot(s->across, v3_sub(p[i], s->source));
    if (!path_cut(p, rho[0] - near, rho[1] - near)) return;
    for (int i = 0; i < 2; i++) rho[i] = v3_dot(s->across, v3_sub(p[i], s->source));
    if (!path_cut(p, s->distance - s->touch - rho[0], s->distance - s->touch - rho[1])) return;
    for (int i = 0; i < 2; i++) {
        KellerVec3 from = v3_sub(p[i], s->source);
        double scale = s->distance / v3_dot(s->across, from);
        blur = greater(blur, blur * scale / (s->sine * s->sine));
        z[i] = s->z + v3_dot(s->wedge->direction, from) * scale;
    }
    if (!(blur < BLURRED * s->wedge->length) || s->count[side] == SHADOWS_MOST) return;
    s->blur = greater(s->blur, blur);
    s->shadow[side][s->count[side]++] = (Shadow){lesser(z[0], z[1]), greater(z[0], z[1])};
}

static double visit(void *context, uint32_t id, KellerRange range)
{
    Sight *s = context;
    (void)range;
    const KellerScene *scene = s->scene;
    const uint32_t face = scene->triangle_face[id], plane = scene->faces[face].plane, *t = scene->triangles[id];
    if (path_wedge_in_plane(scene, s->wedge, plane) || (s->mirror && s->mirror->plane == plane)) return INFINITY;
    if (s->slabs && path_lets_through(scene, face)) return INFINITY;
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
        if (section(s, t, h, side == 0, p, &blur)) add_shadow(s, side, p, blur);
    }
    return INFINITY;
}

/* What shadows leave of a part between the first and the last lit place; gaps up to `gap` (m) between them are of rounding. */
static bool narrow(uint32_t count, const Shadow *shadow, double gap, double *from, double *to)
{
    bool moved = true;
    while (moved && *from < *to) {
        moved = false;
        for (uint32_t i = 0; i < count; i++) {
            if (shadow[i].from <= *from + gap && shadow[i].to > *from + gap) {
                *from = shadow[i].to;
                moved = true;
            }
            if (shadow[i].to >= *to - gap && shadow[i].from < *to - gap) {
                *to = shadow[i].from;
                moved = true;
            }
        }
    }
    return *from < *to;
}

bool lit_part(const TreeLimits *limits, KellerVec3 source, uint32_t mirror, uint32_t wedge, double *from, double *to, KellerAccelWork *work)
{
    const KellerScene *scene = limits->scene;
    const KellerWedge *w = &scene->wedges[wedge];
    Sight s = {.scene = scene, .mirror = mirror != KELLER_NONE ? &scene->faces[mirror] : NULL, .wedge = w, .source = source,
               .slabs = limits->transmissions > 0, .touch = 4 * scene->contact};
    KellerVec3 v = v3_sub(w->origin, source);
    s.z = -v3_dot(v, w->direction);
    v = v3_madd(v, w->direction, s.z);
    s.distance = v3_norm(v);
    const double reach = hypot(s.distance, greater(fabs(*from - s.z), fabs(*to - s.z))), rounding = path_rounding(scene, source);
    s.sine = s.distance / reach;
    s.flat = 4 * (rounding + KELLER_BOUNDARY_ANGLE * reach);
    if (!(s.sine > GRAZING) || !(s.distance > 4 * s.touch)) return true;
    if (s.mirror) {
        double height = v3_dot(s.mirror->normal, source) - s.mirror->offset;
        if (!(fabs(height) > s.touch)) return true;
        s.side = height > 0 ? 1 : -1;
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
    double first = INFINITY, last = -INFINITY;
    for (int side = 0; side < 2; side++) {
        double a = *from, b = *to;
        if (!narrow(s.count[side], s.shadow[side], 4 * rounding, &a, &b)) continue;
        first = lesser(first, a);
        last = greater(last, b);
    }
    *from = greater(*from, first - s.blur);
    *to = lesser(*to, last + s.blur);
    return *from <= *to;
}
