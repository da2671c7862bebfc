#include "accel/sobb.h"

#include <math.h>
#include <stdlib.h>

#include "base/number.h"
#include "base/simd.h"

/* ---- around triangles -------------------------------------------------------------------------------------------- */

/* Below this sine of the angle between its sides a triangle is taken as a segment: single precision tells no normal of it. */
#define FLAT_SINE 1e-7
/* A pair is one parallelogram if its corners are off by no more than this share of the width, which the band then holds too. */
#define OFF_SHARE 0.5
/* Bands are 2 widths for what a slab holds beyond, and the error of a test; one more for corners that are off. */
#define BAND_WIDTHS 3
/* A pair whose band is wider than this would be looked at twice more often than not. */
#define BAND_MOST 0.5

static SobbSlab slab_of(KellerVec3 n, double middle, double half)
{
    return (SobbSlab){{(float)(n.x / half), (float)(n.y / half), (float)(n.z / half)}, (float)(middle / half)};
}

/* The box with sides across the unit vectors n. */
static Sobb box_across(const KellerVec3 n[3], int count, const KellerVec3 *corners, double width, double half[3])
{
    Sobb box = {.band = INFINITY};
    for (int k = 0; k < 3; k++) {
        double lo = INFINITY, hi = -INFINITY;
        for (int j = 0; j < count; j++) {
            double at = v3_dot(n[k], corners[j]);
            lo = lesser(lo, at);
            hi = greater(hi, at);
        }
        half[k] = 0.5 * (hi - lo) + width;
        box.slab[k] = slab_of(n[k], 0.5 * (hi + lo), half[k]);
    }
    return box;
}

/* Along the longest of the sides. */
static Sobb box_along(int count, const KellerVec3 *corners, double width)
{
    KellerVec3 along = v3(0, 0, 0);
    for (int j = 0; j < count; j++) {
        KellerVec3 side = v3_sub(corners[(j + 1) % count], corners[j]);
        if (v3_norm(side) > v3_norm(along)) along = side;
    }
    KellerVec3 n[3] = {v3_norm(along) > 0 ? v3_unit(along) : v3(1, 0, 0)};
    n[1] = v3_perpendicular(n[0]);
    n[2] = v3_cross(n[0], n[1]);
    double half[3];
    return box_across(n, count, corners, width, half);
}

static KellerVec3 towards(KellerVec3 n, KellerVec3 e) { return v3_dot(n, e) < 0 ? v3_scale(n, -1) : n; }

/* The box whose side from corners[0] to corners[1] runs along u and to corners[2] along v; thin across both. */
static bool parallelogram(int count, const KellerVec3 *corners, double width, Sobb *box)
{
    KellerVec3 u = v3_sub(corners[1], corners[0]), v = v3_sub(corners[2], corners[0]), across = v3_cross(u, v);
    if (!(v3_norm(across) > FLAT_SINE * v3_norm(u) * v3_norm(v))) return false;
    across = v3_unit(across);
    const KellerVec3 n[3] = {towards(v3_unit(v3_cross(v, across)), u), towards(v3_unit(v3_cross(u, across)), v), across};
    double half[3];
    *box = box_across(n, count, corners, width, half);
    box->band = float_up(BAND_WIDTHS * width * (1 / half[0] + 1 / half[1]));
    return true;
}

Sobb sobb_around(int count, const KellerVec3 *corners, double width)
{
    int a = 0; /* opposite to the longest side, which becomes the diagonal: heights are greatest so */
    double longest = -1;
    for (int j = 0; j < count; j++) {
        double side = v3_distance(corners[(j + 1) % count], corners[(j + 2) % count]);
        if (side > longest) longest = side, a = j;
    }
    Sobb box;
    if (count == 3) {
        const KellerVec3 turned[3] = {corners[a], corners[(a + 1) % 3], corners[(a + 2) % 3]};
        if (parallelogram(3, turned, width, &box)) return box;
    }
    return box_along(count, corners, width);
}

/* Spanned by the sides from corners[0]: u, v and w to corners[1], [2] and [3]. Half of its surface, INFINITY if it has no volume. */
static double spanned(const KellerVec3 corners[4], double width, Sobb *box)
{
    const KellerVec3 u = v3_sub(corners[1], corners[0]), v = v3_sub(corners[2], corners[0]), w = v3_sub(corners[3], corners[0]);
    const KellerVec3 vw = v3_cross(v, w), wu = v3_cross(w, u), uv = v3_cross(u, v);
    if (!(v3_norm(vw) > 0 && v3_norm(wu) > 0 && v3_norm(uv) > 0)) return INFINITY;
    const KellerVec3 n[3] = {towards(v3_unit(vw), u), towards(v3_unit(wu), v), towards(v3_unit(uv), w)};
    double half[3];
    *box = box_across(n, 4, corners, width, half);
    box->band = float_up(BAND_WIDTHS * width * (1 / half[0] + 1 / half[1] + 1 / half[2]));
    return box->band <= (float)BAND_MOST ? v3_norm(vw) + v3_norm(wu) + v3_norm(uv) : INFINITY;
}

bool sobb_around_pair(const KellerVec3 first[3], const KellerVec3 second[3], double width, Sobb *box, SobbPlace *place)
{
    const KellerVec3 a = first[0], b = first[1], c = first[2], d = second[2];
    const KellerVec3 flat[4] = {c, a, b, d};
    double off = v3_distance(v3_add(a, b), v3_add(c, d));
    *place = SOBB_FLAT;
    if (off <= OFF_SHARE * width) return parallelogram(4, flat, width, box) && box->band <= (float)BAND_MOST;
    *place = SOBB_WINGS;
    Sobb other;
    double area = spanned((KellerVec3[]){a, c, b, d}, width, box), area_other = spanned((KellerVec3[]){b, c, a, d}, width, &other);
    if (area_other < area) *box = other;
    return lesser(area, area_other) < INFINITY;
}

/* ---- k-DOPs ------------------------------------------------------------------------------------------------------ */

static void set_direction(Dops *d, int i, KellerVec3 n)
{
    d->direction[0][i] = (float)n.x;
    d->direction[1][i] = (float)n.y;
    d->direction[2][i] = (float)n.z;
}

static KellerVec3 direction_of(const Dops *d, int i)
{
    return v3((double)d->direction[0][i], (double)d->direction[1][i], (double)d->direction[2][i]);
}

/* The axes, and the rest spread over a hemisphere by the golden angle (Swinbank and Purser 2006). */
static void spread_directions(Dops *d)
{
    const double turn = M_PI * (3 - sqrt(5));
    for (int i = 0; i < 3; i++) set_direction(d, i, v3(i == 0, i == 1, i == 2));
    for (int i = 3; i < d->count; i++) {
        double z = (i - 2.5) / (d->count - 3), r = sqrt(1 - z * z);
        set_direction(d, i, v3(r * cos(turn * i), r * sin(turn * i), z));
    }
}

/* The axes, and rotations spread by super-Fibonacci spirals (Alexa 2022): quaternions (x, y, z, w). */
static void spread_frames(Dops *d)
{
    const double phi = sqrt(2), psi = 1.533751168755204288118041;
    int frames = d->count / 3;
    for (int f = 0; f < frames; f++) {
        double s = f + 0.5, t = s / frames, r = sqrt(t), R = sqrt(1 - t), alpha = 2 * M_PI * s / phi, beta = 2 * M_PI * s / psi;
        double x = r * sin(alpha), y = r * cos(alpha), z = R * sin(beta), w = R * cos(beta);
        if (f == 0) x = y = z = 0, w = 1;
        set_direction(d, 3 * f, v3(1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)));
        set_direction(d, 3 * f + 1, v3(2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)));
        set_direction(d, 3 * f + 2, v3(2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)));
    }
}

KellerStatus dops_make(Dops *d, bool frames, KellerError *error)
{
    const float never = 1e30f; /* for three that are not independent, or not three */
    *d = (Dops){.frames = frames, .count = frames ? DOP_MOST : DOP_AXES};
    if (frames) {
        spread_frames(d);
        return KELLER_OK;
    }
    spread_directions(d);
    size_t bytes = DOP_AXES * sizeof *d->inverse;
    d->inverse = aligned_alloc(64, bytes);
    if (!d->inverse) return keller_error_memory(error, bytes);
    for (int i = 0; i < DOP_AXES; i++)
        for (int j = 0; j < DOP_AXES; j++) {
            KellerVec3 cross = v3_cross(direction_of(d, i), direction_of(d, j));
            double norm = v3_norm(cross);
            d->pair[i][j] = norm > 1e-6 ? (float)(1 / norm) : never;
            for (int k = 0; k < DOP_AXES; k++) {
                double det = fabs(v3_dot(cross, direction_of(d, k)));
                d->inverse[i][j][k] = det > 1e-6 ? (float)(1 / det) : never;
            }
        }
    return KELLER_OK;
}

void dops_fourteen(Dops *d)
{
    const double c = sqrt(1 / 3.0);
    *d = (Dops){.count = 8};
    for (int i = 0; i < 8; i++)
        set_direction(d, i, i < 3 ? v3(i == 0, i == 1, i == 2) : v3(i & 1 ? c : -c, i & 2 ? c : -c, c));
}

void dops_free(Dops *d)
{
    free(d->inverse);
    d->inverse = NULL;
}

void dop_around(const Dops *d, int count, const KellerVec3 *corners, float *dop)
{
    for (int i = 0; i < d->count; i += 8) {
        f8 most = f8_set1(-INFINITY), against = most;
        for (int j = 0; j < count; j++) {
            const KellerVec3 p = corners[j];
            f8 at = f8_mul(f8_load(&d->direction[0][i]), f8_set1((float)p.x));
            at = f8_madd(f8_load(&d->direction[1][i]), f8_set1((float)p.y), at);
            at = f8_madd(f8_load(&d->direction[2][i]), f8_set1((float)p.z), at);
            most = f8_max(most, at);
            against = f8_max(against, f8_neg(at));
        }
        f8_store(dop + i, most);
        f8_store(dop + d->count + i, against);
    }
}

void dop_add(const Dops *d, float *dop, const float *other)
{
    for (int i = 0; i < 2 * d->count; i += 8) f8_store(dop + i, f8_max(f8_load(dop + i), f8_load(other + i)));
}

/* The surface of a parallelepiped with heights a, b, c across its sides is 2 (ab + bc + ca) / |det| of its unit normals. */
static float least_of_frames(const Dops *d, const float *height, int chosen[3])
{
    float least = INFINITY;
    for (int i = 0; i < d->count; i += 3) {
        float a = height[i], b = height[i + 1], c = height[i + 2], area = a * b + b * c + c * a;
        if (!(area < least)) continue;
        least = area;
        for (int k = 0; k < 3; k++) chosen[k] = i + k;
    }
    return least;
}

/* The direction of least height[k] factor(k), by what was chosen before: a good box to begin with. */
static float least_third(const Dops *d, const float *height, int chosen[3])
{
    int i = 0, j = -1, k = -1;
    float two = INFINITY, three = INFINITY;
    for (int a = 1; a < DOP_AXES; a++)
        if (height[a] < height[i]) i = a;
    for (int a = 0; a < DOP_AXES; a++) {
        if (!(height[i] * height[a] * d->pair[i][a] < two)) continue;
        two = height[i] * height[a] * d->pair[i][a];
        j = a;
    }
    for (int a = 0; a < DOP_AXES; a++) {
        float area = (height[i] * height[j] + (height[i] + height[j]) * height[a]) * d->inverse[i][j][a];
        if (!(area < three)) continue;
        three = area;
        k = a;
    }
    chosen[0] = i, chosen[1] = j, chosen[2] = k;
    return three;
}

/* The third direction, if any makes a smaller box with i and j. */
static inline void try_thirds(const Dops *d, const float *height, int i, int j, float *least, int chosen[3])
{
    float two = height[i] * height[j], sum = height[i] + height[j];
    for (int k = 0; k < DOP_AXES; k += 8) {
        f8 area = f8_mul(f8_madd(f8_set1(sum), f8_load(height + k), f8_set1(two)), f8_load(&d->inverse[i][j][k]));
        uint32_t less = (uint32_t)f8_mask(f8_lt(area, f8_set1(*least)));
        if (!less) continue;
        _Alignas(32) float at[8];
        f8_store(at, area);
        for (; less; less &= less - 1) {
            int lane = __builtin_ctz(less);
            if (!(at[lane] < *least)) continue;
            *least = at[lane];
            chosen[0] = i, chosen[1] = j, chosen[2] = k + lane;
        }
    }
}

/* With a <= b <= c and |det| <= |u x v| <= 1 no three make less than 3 a^2, and no two less than (2 a b + b^2) / |u x v|: few of all
 * 496 twos are left to try. All bounds are rounded as they may be; what is lost is no smaller by more than that. */
static float least_of_threes(const Dops *d, const float *height, int chosen[3])
{
    float least = least_third(d, height, chosen);
    for (int i = 0; i < DOP_AXES; i++) {
        float a = height[i];
        if (!(3 * a * a < least)) continue;
        for (int j = 0; j < DOP_AXES; j += 8) {
            f8 b = f8_load(height + j), bound = f8_mul(f8_mul(f8_add(f8_set1(2 * a), b), b), f8_load(&d->pair[i][j]));
            uint32_t left = (uint32_t)f8_mask(f8_and(f8_lt(bound, f8_set1(least)), f8_le(f8_set1(a), b)));
            for (; left; left &= left - 1) try_thirds(d, height, i, j + __builtin_ctz(left), &least, chosen);
        }
    }
    return least;
}

SobbFit sobb_fit(const Dops *d, const float *dop, double width)
{
    _Alignas(32) float height[DOP_MOST];
    int chosen[3] = {0, 1, 2};
    for (int i = 0; i < d->count; i++) height[i] = dop[i] + dop[d->count + i] + (float)(2 * width);
    SobbFit fit = {.area = d->frames ? least_of_frames(d, height, chosen) : least_of_threes(d, height, chosen)};
    for (int k = 0; k < 3; k++) {
        double hi = (double)dop[chosen[k]], lo = -(double)dop[d->count + chosen[k]];
        fit.direction[k] = (uint8_t)chosen[k];
        fit.middle[k] = (float)(0.5 * (hi + lo));
        fit.half[k] = (float)(0.5 * (hi - lo) + width);
    }
    return fit;
}

Sobb sobb_of_fit(const Dops *d, const SobbFit *fit)
{
    Sobb box = {.band = INFINITY};
    for (int k = 0; k < 3; k++)
        box.slab[k] = slab_of(direction_of(d, fit->direction[k]), (double)fit->middle[k], (double)fit->half[k]);
    return box;
}
