#include "path/cells.h"

#include "base/number.h"

CellGrid cells_of(const KellerConfig *config, const KellerReceiverSet *set, uint32_t x, uint32_t y, uint32_t nx, uint32_t ny)
{
    CellGrid g = {config->receivers, set->first + y * set->nx + x, set->nx, nx, ny, set->x0 + x * set->step,
                  set->y0 + y * set->step, set->step, INFINITY, -INFINITY};
    for (uint32_t j = 0; j < ny; j++)
        for (uint32_t i = 0; i < nx; i++) {
            double z = cell_position(&g, i, j).z;
            g.low = lesser(g.low, z);
            g.high = greater(g.high, z);
        }
    return g;
}

/* What is left of the polygon on the side ax x + ay y <= c. */
static void clip(Footprint *f, double ax, double ay, double c)
{
    double kept[sizeof f->corner / sizeof *f->corner];
    uint32_t n = 0;
    for (uint32_t i = 0; i < f->corners; i++) {
        const double *p = &f->corner[2 * i], *q = &f->corner[2 * ((i + 1) % f->corners)];
        double hp = ax * p[0] + ay * p[1] - c, hq = ax * q[0] + ay * q[1] - c;
        if (hp <= 0) {
            kept[2 * n] = p[0];
            kept[2 * n++ + 1] = p[1];
        }
        if ((hp <= 0) == (hq <= 0) || 2 * n + 2 > sizeof kept / sizeof *kept) continue;
        double t = hp / (hp - hq);
        kept[2 * n] = p[0] + t * (q[0] - p[0]);
        kept[2 * n++ + 1] = p[1] + t * (q[1] - p[1]);
    }
    f->corners = n;
    for (uint32_t i = 0; i < 2 * n; i++) f->corner[i] = kept[i];
}

/* The rows that the polygon's corners span, and one more on either side. */
static bool find_rows(const CellGrid *g, Footprint *f)
{
    double low = INFINITY, high = -INFINITY;
    for (uint32_t i = 0; i < f->corners; i++) {
        low = lesser(low, f->corner[2 * i + 1]);
        high = greater(high, f->corner[2 * i + 1]);
    }
    double first = floor((low - g->y0) / g->step), last = ceil((high - g->y0) / g->step);
    f->row = first > 0 ? (uint32_t)lesser(first, g->ny) : 0;
    f->end = last >= 0 ? (uint32_t)lesser(last + 1, g->ny) : 0;
    return f->corners > 0 && f->row < f->end;
}

/* The polygon loses nothing by this: its corners are good to rounding, and rows to a cell. */
bool footprint_cut(const CellGrid *g, KellerVec3 normal, double offset, Footprint *f)
{
    double c = offset - lesser(normal.z * g->low, normal.z * g->high);
    f->ax[f->count] = normal.x;
    f->ay[f->count] = normal.y;
    f->c[f->count++] = c;
    clip(f, normal.x, normal.y, c);
    return find_rows(g, f);
}

bool footprint_of(const CellGrid *g, const BundleTest *test, const KellerFace *mirror, double front, Footprint *f)
{
    const Bundle *b = test->bundle;
    const double margin = 0.25 * g->step; /* cells on the rectangle's border are inside it */
    double left = g->x0 - margin, right = g->x0 + (g->nx - 1) * g->step + margin;
    double bottom = g->y0 - margin, top = g->y0 + (g->ny - 1) * g->step + margin;
    *f = (Footprint){.corner = {left, bottom, right, bottom, right, top, left, top}, .corners = 4};
    double far = 0;
    for (uint32_t j = 0; j < b->source_count; j++)
        for (int i = 0; i < 4; i++) {
            KellerVec3 d = v3_sub(v3(f->corner[2 * i], f->corner[2 * i + 1], g->low), b->source[j]);
            far = greater(far, fabs(d.x) + fabs(d.y) + fabs(d.z) + g->high - g->low);
        }
    double slack = 2 * WINDOW_PAD * far + 4 * test->rounding;
    for (uint32_t i = 0; i < b->window.count; i++)
        if (!footprint_cut(g, b->window.side[i], test->support[i] + slack, f)) return false;
    if (!mirror || front == 0) return true;
    return footprint_cut(g, v3_scale(mirror->normal, -front), -front * mirror->offset + 4 * test->contact + slack, f);
}

void footprint_row(const CellGrid *g, const Footprint *f, uint32_t row, uint32_t *from, uint32_t *to)
{
    double y = g->y0 + row * g->step, low = -INFINITY, high = INFINITY;
    *from = *to = 0;
    for (uint32_t i = 0; i < f->count; i++) {
        double left = f->c[i] - f->ay[i] * y;
        if (f->ax[i] > 0) high = lesser(high, left / f->ax[i]);
        else if (f->ax[i] < 0) low = greater(low, left / f->ax[i]);
        else if (left < 0) return;
    }
    /* a cell more than the slack, so that the quotients' rounding takes nothing away */
    low = ceil((low - g->x0) / g->step - 1e-6);
    high = floor((high - g->x0) / g->step + 1e-6);
    if (!(low <= high && high >= 0 && low < g->nx)) return;
    *from = low > 0 ? (uint32_t)low : 0;
    *to = high < g->nx ? (uint32_t)high + 1 : g->nx;
}

uint32_t footprint_cells(const CellGrid *g, const Footprint *f, uint32_t most)
{
    uint32_t n = 0;
    for (uint32_t row = f->row; row < f->end && n < most; row++) {
        uint32_t from, to;
        footprint_row(g, f, row, &from, &to);
        n += to - from;
    }
    return n < most ? n : most;
}

KellerVec3 footprint_middle(const CellGrid *g, const Footprint *f)
{
    KellerVec3 p = v3(0, 0, 0.5 * (g->low + g->high));
    for (uint32_t i = 0; i < f->corners; i++) p = v3_add(p, v3(f->corner[2 * i] / f->corners, f->corner[2 * i + 1] / f->corners, 0));
    return p;
}

KellerRange footprint_extent(const CellGrid *g, const Footprint *f, KellerVec3 origin, KellerVec3 direction)
{
    KellerRange r = {INFINITY, -INFINITY};
    for (uint32_t i = 0; i < f->corners; i++)
        for (int k = 0; k < 2; k++) {
            double d = v3_dot(direction, v3_sub(v3(f->corner[2 * i], f->corner[2 * i + 1], k ? g->high : g->low), origin));
            r = (KellerRange){lesser(r.near, d), greater(r.far, d)};
        }
    return r;
}
