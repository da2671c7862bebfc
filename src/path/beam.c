/* Everything here is decided by planes through the sources: with a point v of the scene at some source o plus t d, t >= 0, the
 * side's n.(v - o) <= n.d t is at most WINDOW_PAD |v - o|. */
#include "path/beam.h"

#include <string.h>

#include "base/number.h"
#include "base/simd.h"

/* ---- windows ----------------------------------------------------------------------------------------------------- */

Window window_of(const KellerVec3 axis[3], const Slopes *slopes)
{
    const double x[2] = {slopes->low[0], slopes->high[0]}, y[2] = {slopes->low[1], slopes->high[1]};
    const KellerVec3 side[4] = {v3_sub(v3_scale(axis[2], y[0]), axis[1]), v3_madd(axis[0], axis[2], -x[1]),
                                v3_madd(axis[1], axis[2], -y[1]), v3_sub(v3_scale(axis[2], x[0]), axis[0])};
    Window w = {.count = 4};
    for (int i = 0; i < 4; i++) { /* low y, high x, high y, low x */
        w.corner[i] = v3_unit(v3_madd(v3_madd(axis[2], axis[0], x[i == 1 || i == 2]), axis[1], y[i >= 2]));
        w.side[i] = v3_unit(side[i]);
    }
    return w;
}

bool window_cut(Window *w, KellerVec3 normal)
{
    double above[WINDOW_MOST];
    uint32_t in = 0, changes = 0;
    for (uint32_t i = 0; i < w->count; i++) {
        above[i] = v3_dot(normal, w->corner[i]) - WINDOW_PAD;
        in += above[i] <= 0;
    }
    if (in == w->count) return true;
    if (in == 0) return false;
    for (uint32_t i = 0; i < w->count; i++) changes += (above[i] <= 0) != (above[(i + 1) % w->count] <= 0);
    if (changes != 2) return true; /* its corners are not in convex position, by rounding */
    if (in + 2 > WINDOW_MOST) return true;
    Window cut = {.count = 0};
    for (uint32_t i = 0; i < w->count; i++) {
        uint32_t next = (i + 1) % w->count;
        if (above[i] <= 0) {
            cut.corner[cut.count] = w->corner[i];
            cut.side[cut.count++] = w->side[i];
        }
        if ((above[i] <= 0) == (above[next] <= 0)) continue;
        double share = above[i] / (above[i] - above[next]);
        cut.corner[cut.count] = v3_unit(v3_madd(w->corner[i], v3_sub(w->corner[next], w->corner[i]), share));
        cut.side[cut.count++] = above[i] <= 0 ? normal : w->side[i];
    }
    *w = cut;
    return true;
}

double window_width(const Window *w, KellerVec3 *across)
{
    double most = -1;
    for (uint32_t i = 0; i < w->count; i++)
        for (uint32_t j = 0; j < i; j++) {
            KellerVec3 d = v3_sub(w->corner[i], w->corner[j]);
            double width = v3_dot(d, d);
            if (width <= most) continue;
            most = width;
            *across = d;
        }
    return sqrt(greater(0, most));
}

void window_axes(KellerVec3 along, KellerVec3 across, KellerVec3 axis[3])
{
    axis[2] = along;
    axis[0] = across;
    axis[1] = v3_cross(axis[2], axis[0]);
}

bool window_slopes(const Window *w, const KellerVec3 axis[3], Slopes *slopes)
{
    const double front = 0.2; /* cosine: of the widest frustum, and a little more */
    for (uint32_t i = 0; i < w->count; i++)
        if (!(v3_dot(w->corner[i], axis[2]) > front)) return false;
    for (uint32_t i = 0; i < w->count; i++)
        for (int k = 0; k < 2; k++) {
            double slope = v3_dot(w->corner[i], axis[k]) / v3_dot(w->corner[i], axis[2]), pad = BEAM_PAD * (1 + fabs(slope));
            slopes->low[k] = lesser(slopes->low[k], slope - pad);
            slopes->high[k] = greater(slopes->high[k], slope + pad);
        }
    return true;
}

/* Halfway between the two corners that are farthest apart, from one of which to the other `across` points. The middle of all corners may
 * be far from one of them, where the others are close together. */
static KellerVec3 between_farthest(const Window *w, KellerVec3 across)
{
    uint32_t first = 0, last = 0;
    for (uint32_t i = 1; i < w->count; i++) {
        const double at = v3_dot(across, w->corner[i]);
        if (at < v3_dot(across, w->corner[first])) first = i;
        if (at > v3_dot(across, w->corner[last])) last = i;
    }
    return v3_unit(v3_add(w->corner[first], w->corner[last]));
}

int window_halves(const Window *w, Window half[2])
{
    KellerVec3 across = v3(0, 0, 0), axis[3];
    int n = 0;
    if (!(window_width(w, &across) > WINDOW_LEAST)) return 0;
    across = v3_unit(across); /* from corner to corner, both of one length: halfway between them it is perpendicular */
    for (int side = -1; side <= 1; side += 2) {
        half[n] = *w;
        bool left = window_cut(&half[n], v3_scale(across, side));
        if (left && memcmp(half[n].corner, w->corner, sizeof w->corner) == 0) { /* too many corners, or none that rounding left convex: their rectangle has four */
            Slopes slopes = SLOPES_NONE;
            KellerVec3 along = between_farthest(w, across);
            across = v3_unit(v3_madd(across, along, -v3_dot(across, along)));
            window_axes(along, across, axis);
            if (!window_slopes(w, axis, &slopes)) return 0;
            for (int k = 0; k < 2; k++) {
                Slopes part = slopes;
                const double middle = 0.5 * (slopes.low[0] + slopes.high[0]);
                *(k ? &part.low[0] : &part.high[0]) = middle;
                half[k] = window_of(axis, &part);
            }
            return 2;
        }
        n += left;
    }
    return n;
}

KellerVec3 window_middle(const Window *w)
{
    KellerVec3 middle = v3(0, 0, 0);
    for (uint32_t i = 0; i < w->count; i++) middle = v3_add(middle, w->corner[i]);
    return v3_unit(middle);
}

/* ---- what a bundle meets ----------------------------------------------------------------------------------------- */

static double size_of(KellerVec3 v) { return fabs(v.x) + fabs(v.y) + fabs(v.z); }

BundleTest bundle_test(const Bundle *b, const KellerScene *scene)
{
    const Window *w = &b->window;
    BundleTest t;
    t.bundle = b;
    t.rounding = path_rounding(scene, b->source[0]);
    t.contact = 4 * scene->contact;
    t.room = (w->count + 3) / 4 * 4;
    for (uint32_t j = 1; j < b->source_count; j++) t.rounding = greater(t.rounding, path_rounding(scene, b->source[j]));
    for (uint32_t i = 0; i < t.room; i++) {
        const bool used = i < w->count;
        const KellerVec3 side = used ? w->side[i] : v3(0, 0, 0), corner = w->corner[used ? i : 0];
        t.side[0][i] = side.x, t.side[1][i] = side.y, t.side[2][i] = side.z;
        t.corner[0][i] = corner.x, t.corner[1][i] = corner.y, t.corner[2][i] = corner.z;
        t.support[i] = used ? -INFINITY : INFINITY;
        for (uint32_t j = 0; j < b->source_count; j++) t.support[i] = greater(t.support[i], v3_dot(side, b->source[j]));
    }
    return t;
}

/* How far in front of a side a point may be that is on a ray. */
static double slack(const BundleTest *t, KellerVec3 v)
{
    const Bundle *b = t->bundle;
    double far = 0;
    for (uint32_t j = 0; j < b->source_count; j++) far = greater(far, size_of(v3_sub(v, b->source[j])));
    return 2 * WINDOW_PAD * far + 4 * t->rounding;
}

/* The unit normal of the plane through the source o and the edge from a to b; false if o is so near to the edge's line that
 * rounding would turn the plane by a good part of WINDOW_PAD. */
static bool plane_through(KellerVec3 o, KellerVec3 a, KellerVec3 b, double rounding, KellerVec3 *normal)
{
    KellerVec3 l = v3_sub(b, a), n = v3_cross(v3_sub(a, o), l);
    double nn = v3_dot(n, n), pad = WINDOW_PAD;
    if (!(nn * pad * pad > 16 * rounding * rounding * v3_dot(l, l))) return false;
    *normal = v3_scale(n, 1 / sqrt(nn));
    return true;
}

static d4 dot4(const double v[3][WINDOW_MOST], uint32_t i, KellerVec3 p)
{
    return d4_add(d4_add(d4_mul(d4_load(&v[0][i]), d4_set1(p.x)), d4_mul(d4_load(&v[1][i]), d4_set1(p.y))),
                  d4_mul(d4_load(&v[2][i]), d4_set1(p.z)));
}

/* On which side of the plane with this normal through the apex is all of the window: 1 in front of it, -1 behind, 0 neither? */
static int window_beside(const BundleTest *t, KellerVec3 normal)
{
    d4 low = dot4(t->corner, 0, normal), high = low;
    for (uint32_t i = 4; i < t->room; i += 4) {
        const d4 at = dot4(t->corner, i, normal);
        low = d4_min(low, at);
        high = d4_max(high, at);
    }
    if (d4_mask(d4_lt(d4_set1(2 * WINDOW_PAD), low)) == 15) return 1;
    return d4_mask(d4_lt(high, d4_set1(-2 * WINDOW_PAD))) == 15 ? -1 : 0;
}

/* Is some side's outer half-space, moved out to the sources, that of all the points? */
static bool beyond_a_side(const BundleTest *t, uint32_t count, const KellerVec3 *v)
{
    d4 loose[3];
    for (uint32_t j = 0; j < count; j++) loose[j] = d4_set1(slack(t, v[j]));
    for (uint32_t i = 0; i < t->room; i += 4) {
        const d4 support = d4_load(&t->support[i]);
        d4 out = d4_lt(d4_add(support, loose[0]), dot4(t->side, i, v[0]));
        for (uint32_t j = 1; j < count; j++) out = d4_and(out, d4_lt(d4_add(support, loose[j]), dot4(t->side, i, v[j])));
        if (d4_mask(out)) return true;
    }
    return false;
}

/* Has the plane with this normal, through a source and a, all of the bundle on one side and all of v[0 .. count) on the other? */
static bool parts(const BundleTest *t, KellerVec3 normal, KellerVec3 a, uint32_t count, const KellerVec3 *v)
{
    const Bundle *b = t->bundle;
    const int beside = window_beside(t, normal);
    if (beside == 0) return false;
    if (beside < 0) normal = v3_scale(normal, -1);
    for (uint32_t j = 0; j < b->source_count; j++)
        if (!(v3_dot(normal, v3_sub(b->source[j], a)) >= -t->rounding)) return false;
    for (uint32_t k = 0; k < count; k++)
        if (!(v3_dot(normal, v3_sub(v[k], a)) <= t->rounding)) return false;
    return true;
}

bool bundle_misses(const BundleTest *t, uint32_t count, const KellerVec3 *v)
{
    const Bundle *b = t->bundle;
    if (beyond_a_side(t, count, v)) return true;
    if (count == 3) { /* from a source on its plane a triangle is met at the source */
        KellerVec3 n = v3_cross(v3_sub(v[1], v[0]), v3_sub(v[2], v[0]));
        for (uint32_t j = 0; j < b->source_count; j++)
            if (!(fabs(v3_dot(n, v3_sub(b->source[j], v[0]))) > t->contact * v3_norm(n))) return false;
    }
    for (uint32_t j = 0; j < b->source_count; j++)
        for (uint32_t i = 0; i < (count == 3 ? 3 : 1); i++) {
            KellerVec3 p = v[i], q = v[(i + 1) % count], n;
            if (!plane_through(b->source[j], p, q, t->rounding, &n)) continue;
            if (parts(t, n, p, count, v)) return true;
        }
    return false;
}

/* Is what is seen of the points from any source behind the plane with this normal through it? */
static bool behind(const Bundle *b, KellerVec3 normal, uint32_t count, const KellerVec3 *v, double rounding)
{
    double highest = -INFINITY, lowest = INFINITY;
    for (uint32_t k = 0; k < count; k++) highest = greater(highest, v3_dot(normal, v[k]));
    for (uint32_t j = 0; j < b->source_count; j++) lowest = lesser(lowest, v3_dot(normal, b->source[j]));
    return highest - lowest <= rounding;
}

bool bundle_narrow(Bundle *b, const KellerScene *scene, uint32_t face)
{
    const KellerFace *f = &scene->faces[face];
    double rounding = 0, low = INFINITY, high = -INFINITY, on = 4 * scene->contact; /* of the sources over the plane */
    for (uint32_t j = 0; j < b->source_count; j++) {
        double h = v3_dot(f->normal, b->source[j]) - f->offset;
        low = lesser(low, h);
        high = greater(high, h);
        rounding = greater(rounding, path_rounding(scene, b->source[j]));
    }
    if (!(low > on || high < -on)) return true;
    if (!window_cut(&b->window, low > on ? f->normal : v3_scale(f->normal, -1))) return false;
    if (f->triangle_end - f->triangle_begin > NARROW_TRIANGLES) return true;
    KellerVec3 v[3 * NARROW_TRIANGLES];
    uint32_t count = 0;
    for (uint32_t i = f->triangle_begin; i < f->triangle_end; i++)
        for (int k = 0; k < 3; k++) v[count++] = scene->vertices[scene->triangles[scene->face_triangles[i]][k]];
    for (uint32_t i = f->triangle_begin; i < f->triangle_end; i++)
        for (uint32_t k = 0; k < 3; k++) {
            if (!(scene->triangle_border[scene->face_triangles[i]] >> k & 1)) continue;
            const KellerVec3 *corner = &v[3 * (i - f->triangle_begin)];
            for (uint32_t j = 0; j < b->source_count; j++) {
                KellerVec3 n;
                if (!plane_through(b->source[j], corner[k], corner[(k + 1) % 3], rounding, &n)) continue;
                if (!behind(b, n, count, v, rounding)) n = v3_scale(n, -1);
                if (!behind(b, n, count, v, rounding)) continue;
                if (!window_cut(&b->window, n)) return false;
                break;
            }
        }
    return true;
}

bool bundle_part(const BundleTest *t, KellerVec3 a, KellerVec3 b, double *from, double *to)
{
    const Window *w = &t->bundle->window;
    KellerVec3 l = v3_sub(b, a);
    double loose = greater(slack(t, a), slack(t, b));
    for (uint32_t i = 0; i < w->count; i++) {
        double start = v3_dot(w->side[i], a) - t->support[i] - loose, rise = v3_dot(w->side[i], l);
        if (rise > 0) *to = lesser(*to, -start / rise);
        else if (rise < 0) *from = greater(*from, -start / rise);
        else if (start > 0) return false;
    }
    return *from <= *to;
}

bool bundle_crossing(const Bundle *b, const KellerFace *f, KellerVec3 origin, KellerVec3 along, KellerRange *range, double *steep)
{
    const double least = 1e-6; /* sine */
    *range = (KellerRange){INFINITY, -INFINITY};
    *steep = INFINITY;
    for (uint32_t k = 0; k < b->window.count; k++) {
        KellerVec3 d = b->window.corner[k];
        double down = v3_dot(f->normal, d), z = v3_dot(along, d);
        *steep = lesser(*steep, fabs(down));
        for (uint32_t j = 0; j < b->source_count; j++) {
            double t = (f->offset - v3_dot(f->normal, b->source[j])) / down;
            if (!(fabs(down) > least && t > 0)) return false;
            double at = v3_dot(along, v3_sub(b->source[j], origin)) + t * z;
            *range = (KellerRange){lesser(range->near, at), greater(range->far, at)};
        }
    }
    return true;
}

void bundle_mirror(Bundle *b, const KellerFace *f)
{
    for (uint32_t j = 0; j < b->source_count; j++) b->source[j] = v3_mirror_point(b->source[j], f->normal, f->offset);
    for (uint32_t i = 0; i < b->window.count; i++) {
        b->window.corner[i] = v3_mirror_direction(b->window.corner[i], f->normal);
        b->window.side[i] = v3_mirror_direction(b->window.side[i], f->normal);
    }
}
