/* Masks of primitives, of children and of passages. */
#include "accel/mask.h"

#include <stdlib.h>
#include <string.h>

#include "base/number.h"

/* In cells: more than the rounding of a cell's number, in single precision 3 R 2^-24. */
#define GUARD 1e-5

static uint64_t bits_between(int first, int last) { return ((2ull << last) - 1) & ~((1ull << first) - 1); }

static int cell_of(double at, int R) { return at < 0 ? 0 : at >= R ? R - 1 : (int)at; }

bool mask_meets(int R, const Mask *a, const Mask *b)
{
    uint64_t both = 0;
    for (int z = 0; z < R; z++) both |= a->slice[z] & b->slice[z];
    return both != 0;
}

int mask_bits(int R, const Mask *m)
{
    int n = 0;
    for (int z = 0; z < R; z++) n += __builtin_popcountll(m->slice[z]);
    return n;
}

Mask mask_full(int R)
{
    Mask m = {{0}};
    for (int z = 0; z < R; z++) m.slice[z] = bits_between(0, R * R - 1);
    return m;
}

/* ---- what lies in a box ------------------------------------------------------------------------------------------- */

/* A box's cells: from coordinates to cells and their parts. */
typedef struct {
    double lower[3], scale[3], guard[3]; /* scale 0: no extent */
} Grid;

static Grid grid_of(int R, const AccelBox *box)
{
    Grid g;
    for (int k = 0; k < 3; k++) {
        double lower = (double)box->lower[k], side = (double)box->upper[k] - lower;
        double reach = greater(fabs(lower), fabs((double)box->upper[k]));
        g.lower[k] = lower;
        g.scale[k] = side > 0 && R / side < 1e30 ? R / side : 0;
        g.guard[k] = GUARD + 0x1p-48 * reach * g.scale[k]; /* corners are rounded once, to 2^-53 of the reach of their vertices */
    }
    return g;
}

/* A triangle cut by four planes: seven corners, or up to 13 where rounding makes it concave. */
typedef struct {
    int count;
    double p[16][3];
} Polygon;

/* The part where sign * p[k] <= sign * at. */
static void cut(const Polygon *in, int k, double at, double sign, Polygon *out)
{
    out->count = 0;
    for (int i = 0; i < in->count; i++) {
        const double *a = in->p[i], *b = in->p[(i + 1) % in->count];
        double from = sign * (at - a[k]), to = sign * (at - b[k]);
        if (from >= 0) memcpy(out->p[out->count++], a, sizeof out->p[0]);
        if ((from < 0) == (to < 0)) continue;
        double t = from / (from - to), *q = out->p[out->count++];
        for (int j = 0; j < 3; j++) q[j] = a[j] + t * (b[j] - a[j]);
        q[k] = at;
    }
}

static void part_between(const Polygon *in, int k, double lower, double upper, Polygon *out)
{
    Polygon half;
    cut(in, k, upper, 1, &half);
    cut(&half, k, lower, -1, out);
}

static void span(const Polygon *p, int k, double guard, int R, int *first, int *last)
{
    double lo = INFINITY, hi = -INFINITY;
    for (int i = 0; i < p->count; i++) {
        lo = lesser(lo, p->p[i][k]);
        hi = greater(hi, p->p[i][k]);
    }
    *first = lo - guard >= R || hi + guard < 0 ? R : cell_of(lo - guard, R);
    *last = cell_of(hi + guard, R);
}

void mask_add(int R, const AccelBox *box, const KellerVec3 *corners, int count, Mask *mask)
{
    Grid g = grid_of(R, box);
    Polygon whole = {.count = count}, slab, row;
    bool tellable = true;
    double most = 0;
    for (int i = 0; i < count; i++) {
        const double p[3] = {corners[i].x, corners[i].y, corners[i].z};
        for (int k = 0; k < 3; k++) {
            whole.p[i][k] = (p[k] - g.lower[k]) * g.scale[k];
            most = greater(most, fabs(whole.p[i][k]));
        }
    }
    for (int k = 0; k < 3; k++) {
        g.guard[k] += 0x1p-48 * most; /* where the primitive is large, of what is cut off */
        tellable &= g.guard[k] < 1;
    }
    if (!tellable) {
        *mask = mask_full(R);
        return;
    }
    int z, last_z, y, last_y, x, last_x;
    uint64_t row_all = bits_between(0, R - 1);
    for (span(&whole, 2, g.guard[2], R, &z, &last_z); z <= last_z; z++) {
        bool cut_z = g.scale[2] > 0;
        if (cut_z) part_between(&whole, 2, z - g.guard[2], z + 1 + g.guard[2], &slab);
        else slab = whole, last_z = R - 1;
        if (slab.count == 0) continue;
        for (span(&slab, 1, g.guard[1], R, &y, &last_y); y <= last_y; y++) {
            if (g.scale[1] > 0) part_between(&slab, 1, y - g.guard[1], y + 1 + g.guard[1], &row);
            else row = slab, last_y = R - 1;
            if (row.count == 0) continue;
            span(&row, 0, g.guard[0], R, &x, &last_x);
            if (x > last_x) continue;
            mask->slice[z] |= (g.scale[0] > 0 ? bits_between(x, last_x) : row_all) << (R * y);
        }
    }
}

void mask_add_child(int R, const AccelBox *box, const AccelBox *child, const Mask *of, Mask *mask)
{
    Grid g = grid_of(R, box);
    int first[3][MASK_MOST], last[3][MASK_MOST];
    for (int k = 0; k < 3; k++) {
        double lower = (double)child->lower[k], side = (double)child->upper[k] - lower;
        for (int i = 0; i < R; i++) {
            double from = lower + side * i / R, to = lower + side * (i + 1) / R;
            first[k][i] = g.scale[k] > 0 ? cell_of((from - g.lower[k]) * g.scale[k] - g.guard[k], R) : 0;
            last[k][i] = g.scale[k] > 0 ? cell_of((to - g.lower[k]) * g.scale[k] + g.guard[k], R) : R - 1;
        }
    }
    for (int z = 0; z < R; z++)
        for (int y = 0; y < R; y++)
            for (int x = 0; x < R; x++) {
                if (!(of->slice[z] >> (x + R * y) & 1)) continue;
                uint64_t row = bits_between(first[0][x], last[0][x]), fill = 0;
                for (int j = first[1][y]; j <= last[1][y]; j++) fill |= row << (R * j);
                for (int j = first[2][z]; j <= last[2][z]; j++) mask->slice[j] |= fill;
            }
}

/* ---- passages ---------------------------------------------------------------------------------------------------- */

/* The plane of a cell, (a + j h - c) r, is off by 17 u M |r|, with u = 2^-24 and M as in cone_lanes.c: 2 u M for the
 * difference, 3 u (M + M) for the side and its share, 6 u M for products and the sum, and 3 u M for h. The slack of a ray is
 * 8 u M, of which the test of the box has taken 6 already; that of a cone 64 u M. Three more of it are enough for both. */
#define PADS 3

MaskFrustum mask_frustum(const KellerConeLanes *c)
{
    MaskFrustum f = {.near = c->near, .pad = PADS * c->slack, .ray = c->x0 == 0 && c->tan_alpha == 0};
    for (int k = 0; k < 3; k++) {
        f.enter[k] = c->enter[k];
        f.leave[k] = c->leave[k];
        f.enter_rate[k] = c->enter_rate[k];
        f.leave_rate[k] = c->leave_rate[k];
        f.down[k] = c->enter_rate[k] < 0;
        f.opens[k] = f.down[k] != (c->leave_rate[k] < 0);
        f.in_pad[k] = f.pad * fabsf(c->enter_rate[k]);
        f.out_pad[k] = f.pad * fabsf(c->leave_rate[k]);
    }
    return f;
}

Mask mask_passage(int R, const AccelBox *box, const MaskFrustum *f, float far)
{
    float from[3][MASK_MOST], to[3][MASK_MOST];
    for (int k = 0; k < 3; k++) {
        float side = box->upper[k] - box->lower[k], step = side / (float)R;
        for (int i = 0; i < R; i++) {
            float low = box->lower[k] + (float)i * step, high = box->lower[k] + (float)(i + 1) * step;
            float in = ((f->down[k] ? high : low) - f->enter[k]) * f->enter_rate[k] - f->in_pad[k];
            float out = ((f->down[k] ? low : high) - f->leave[k]) * f->leave_rate[k];
            if (f->opens[k]) in = out - f->out_pad[k] > in ? out - f->out_pad[k] : in;
            from[k][i] = in > f->near ? in : f->near;
            to[k][i] = f->opens[k] || out + f->out_pad[k] > far ? far : out + f->out_pad[k];
        }
    }
    Mask m = {{0}};
    for (int z = 0; z < R; z++)
        for (int y = 0; y < R; y++)
            for (int x = 0; x < R; x++) {
                float in = from[0][x] > from[1][y] ? from[0][x] : from[1][y], out = to[0][x] < to[1][y] ? to[0][x] : to[1][y];
                in = from[2][z] > in ? from[2][z] : in;
                out = to[2][z] < out ? to[2][z] : out;
                if (!(in > out)) m.slice[z] |= 1ull << (x + R * y);
            }
    return m;
}

/* ---- tables ------------------------------------------------------------------------------------------------------ */

/* Where a + t (b - a) > at (sign 1) or < at (-1), of [*from, *to]. */
static void halve(double a, double b, double at, double sign, double *from, double *to)
{
    double fa = sign * (a - at), fb = sign * (b - at);
    if (fa <= 0 && fb <= 0) *to = -1;
    else if (fa <= 0) *from = greater(*from, fa / (fa - fb));
    else if (fb <= 0) *to = lesser(*to, fa / (fa - fb));
}

/* The cells of the plane that are met, in more than their border, by the convex hull of two rectangles. */
static uint64_t sweep(int R, const double ax[2], const double ay[2], const double bx[2], const double by[2])
{
    const double touch = 1e-9; /* in cells: all coordinates are whole numbers, and quotients of some */
    uint64_t plane = 0;
    for (int y = 0; y < R; y++) {
        double from = 0, to = 1;
        halve(ay[1], by[1], y + touch, 1, &from, &to);
        halve(ay[0], by[0], y + 1 - touch, -1, &from, &to);
        if (from > to) continue;
        double low = lesser(ax[0] + from * (bx[0] - ax[0]), ax[0] + to * (bx[0] - ax[0])) + touch;
        double high = greater(ax[1] + from * (bx[1] - ax[1]), ax[1] + to * (bx[1] - ax[1])) - touch;
        if (high < 0 || low >= R) continue;
        plane |= bits_between(cell_of(low, R), cell_of(high, R)) << (R * y);
    }
    return plane;
}

/* The cells with the numbers first and last, which differ by 0 or 1, from their sum; number 0 is the one before the box's. */
static void cells_of(int sum, double range[2])
{
    range[0] = sum / 2 - 1;
    range[1] = (sum + 1) / 2;
}

KellerStatus mask_table(int R, MaskTable *table, KellerError *error)
{
    int ends = 2 * R + 3, all = ends * ends;
    size_t bytes = (size_t)all * (size_t)all * sizeof *table->plane;
    *table = (MaskTable){R, malloc(bytes)};
    if (!table->plane) return keller_error_memory(error, bytes);
    for (int a = 0; a < all; a++)
        for (int b = 0; b < all; b++) {
            double ax[2], ay[2], bx[2], by[2];
            cells_of(a % ends, ax);
            cells_of(a / ends, ay);
            cells_of(b % ends, bx);
            cells_of(b / ends, by);
            table->plane[a * all + b] = sweep(R, ax, ay, bx, by);
        }
    return KELLER_OK;
}

void mask_table_free(MaskTable *table)
{
    free(table->plane);
    *table = (MaskTable){0};
}

/* The product of three shadows: xy, xz and yz, x + R y in each. */
static Mask product(int R, uint64_t xy, uint64_t xz, uint64_t yz)
{
    Mask m = {{0}};
    uint64_t row = bits_between(0, R - 1);
    for (int z = 0; z < R; z++) {
        uint64_t x = xz >> (R * z) & row, y = yz >> (R * z) & row;
        for (int j = 0; j < R; j++)
            if (y >> j & 1) m.slice[z] |= x << (R * j);
        m.slice[z] &= xy;
    }
    return m;
}

Mask mask_lookup(const MaskTable *table, const AccelBox *box, const MaskFrustum *f, float far)
{
    int R = table->R, ends = 2 * R + 3, sum[2][3];
    double z[2] = {(double)f->near, (double)far};
    for (int k = 0; k < 3; k++) { /* the way through the box, as its own test has it */
        float in = ((f->down[k] ? box->upper[k] : box->lower[k]) - f->enter[k]) * f->enter_rate[k];
        float out = ((f->down[k] ? box->lower[k] : box->upper[k]) - f->leave[k]) * f->leave_rate[k];
        z[0] = greater(z[0], (double)in);
        z[1] = lesser(z[1], (double)out);
    }
    for (int k = 0; k < 3; k++) {
        double side = (double)box->upper[k] - (double)box->lower[k], scale = side > 0 ? R / side : INFINITY;
        double guard = (double)f->pad * scale + GUARD, at = 0.5 * ((double)f->enter[k] + (double)f->leave[k]);
        if (!(guard < 0.5)) return mask_full(R);
        for (int end = 0; end < 2; end++) {
            double cell = (at + z[end] / (double)f->enter_rate[k] - (double)box->lower[k]) * scale;
            double first = floor(cell - guard), last = floor(cell + guard);
            if (!(first >= -1 && last <= R)) return mask_full(R);
            sum[end][k] = (int)first + (int)last + 2;
        }
    }
    uint64_t plane[3];
    static const int axes[3][2] = {{0, 1}, {0, 2}, {1, 2}};
    for (int i = 0; i < 3; i++) {
        int u = axes[i][0], v = axes[i][1];
        plane[i] = table->plane[(sum[0][u] + ends * sum[0][v]) * ends * ends + sum[1][u] + ends * sum[1][v]];
    }
    return product(R, plane[0], plane[1], plane[2]);
}
