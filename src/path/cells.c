#include "path/cells.h"

#include <math.h>
#include <stdlib.h>

#include "base/number.h"

/* Cells of a block of a surface along x and y: so few that its heights are about those of each cell, so many that beams pass by most. */
enum { BLOCK_SIDE = 16 };

/* What a cell's place may be off by, and more: cells on a border are inside. */
static const double MARGIN = 0.25; /* steps */

static void add_height(KellerRange *range, double z)
{
    if (isnan(z)) return;
    range->near = lesser(range->near, z);
    range->far = greater(range->far, z);
}

bool cells_of(const KellerConfig *config, const KellerReceiverSet *set, uint32_t x, uint32_t y, uint32_t nx, uint32_t ny, CellGrid *g)
{
    const KellerRange none = {INFINITY, -INFINITY};
    KellerRange all = none;
    *g = (CellGrid){.nx = nx, .ny = ny, .x0 = set->x0 + x * set->step, .y0 = set->y0 + y * set->step, .step = set->step};
    g->position = malloc((size_t)nx * ny * sizeof *g->position);
    if (!g->position) return false;
    for (uint32_t j = 0; j < ny; j++)
        for (uint32_t i = 0; i < nx; i++) {
            KellerVec3 p = config->receivers[set->first + (y + j) * set->nx + x + i].station.position;
            g->position[(size_t)j * nx + i] = p;
            add_height(&all, p.z);
        }
    if (!(all.near < all.far)) { /* one height, or nowhere */
        if (all.near == all.far) g->low = g->high = all.near;
        return true;
    }
    g->low = all.near;
    g->high = all.far;
    g->blocks_x = (nx - 1) / BLOCK_SIDE + 1;
    size_t blocks = (size_t)g->blocks_x * ((ny - 1) / BLOCK_SIDE + 1);
    g->heights = malloc(blocks * sizeof *g->heights);
    if (!g->heights) return false;
    for (size_t b = 0; b < blocks; b++) g->heights[b] = none;
    for (uint32_t j = 0; j < ny; j++)
        for (uint32_t i = 0; i < nx; i++)
            add_height(&g->heights[(size_t)(j / BLOCK_SIDE) * g->blocks_x + i / BLOCK_SIDE], cell_position(g, i, j).z);
    return true;
}

void cells_free(CellGrid *g)
{
    free(g->position);
    free(g->heights);
    g->position = NULL;
    g->heights = NULL;
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

/* Of what a half-space allows for x and y, at some z of the range. */
static double allowed(const Footprint *f, uint32_t side, KellerRange z)
{
    return f->offset[side] - lesser(f->side[side].z * z.near, f->side[side].z * z.far);
}

/* The polygon loses nothing by this: its corners are good to rounding, and rows to a cell. */
static bool footprint_cut(const CellGrid *g, KellerVec3 normal, double offset, Footprint *f)
{
    if (fabs(normal.x) < 1e-30) normal.x = 0; /* below rounding; and its quotients are finite */
    const uint32_t i = f->count++;
    f->side[i] = normal;
    f->offset[i] = offset;
    const double left = allowed(f, i, (KellerRange){g->low, g->high});
    f->at[i] = left / normal.x;
    f->rise[i] = -normal.y / normal.x;
    clip(f, normal.x, normal.y, left);
    return find_rows(g, f);
}

bool footprint_of(const CellGrid *g, const BundleTest *test, const KellerFace *mirror, double front, Footprint *f)
{
    const Bundle *b = test->bundle;
    const double margin = MARGIN * g->step;
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

/* The columns of [first, end) from x = low to high (m), [*from, *to), and those a millionth of a step beside it: rounding takes none away. */
static void columns_between(const CellGrid *g, double low, double high, uint32_t first, uint32_t end, uint32_t *from, uint32_t *to)
{
    *from = *to = first;
    low = ceil((low - g->x0) / g->step - 1e-6);
    high = floor((high - g->x0) / g->step + 1e-6);
    if (!(low <= high && high >= first && low < end)) return;
    *from = low > first ? (uint32_t)low : first;
    *to = high < end ? (uint32_t)high + 1 : end;
}

/* The columns that may lie in it in the rows from..last, where z is in the range. */
static void columns(const CellGrid *g, const Footprint *f, uint32_t row, uint32_t last, KellerRange z, uint32_t first, uint32_t end,
                    uint32_t *from, uint32_t *to)
{
    double y = g->y0 + row * g->step, y_last = g->y0 + last * g->step, low = -INFINITY, high = INFINITY;
    *from = *to = first;
    for (uint32_t i = 0; i < f->count; i++) {
        KellerVec3 n = f->side[i];
        double left = allowed(f, i, z) - lesser(n.y * y, n.y * y_last);
        if (n.x > 0) high = lesser(high, left / n.x);
        else if (n.x < 0) low = greater(low, left / n.x);
        else if (left < 0) return;
    }
    columns_between(g, low, high, first, end, from, to);
}

/* The columns of one row where all cells are at one height. */
static void columns_of_row(const CellGrid *g, const Footprint *f, uint32_t row, uint32_t *from, uint32_t *to)
{
    double y = g->y0 + row * g->step, low = -INFINITY, high = INFINITY;
    *from = *to = 0;
    for (uint32_t i = 0; i < f->count; i++) {
        const double x = f->at[i] + f->rise[i] * y, nx = f->side[i].x;
        if (nx > 0) high = lesser(high, x);
        else if (nx < 0) low = greater(low, x);
        else if (allowed(f, i, (KellerRange){g->low, g->high}) < f->side[i].y * y) return;
    }
    columns_between(g, low, high, 0, g->nx, from, to);
}

/* Is all of the block, columns first .. end - 1, outside of one side? */
static bool block_misses(const CellGrid *g, const Footprint *f, const CellRun *run, uint32_t first, uint32_t end)
{
    double x[2] = {g->x0 + (first - MARGIN) * g->step, g->x0 + (end - 1 + MARGIN) * g->step};
    double y[2] = {g->y0 + (run->band - MARGIN) * g->step, g->y0 + (run->band_end - 1 + MARGIN) * g->step};
    for (uint32_t i = 0; i < f->count; i++) {
        KellerVec3 n = f->side[i];
        if (lesser(n.x * x[0], n.x * x[1]) + lesser(n.y * y[0], n.y * y[1]) > allowed(f, i, run->z)) return true;
    }
    return false;
}

static uint32_t block_end(const CellGrid *g, uint32_t block)
{
    return (block + 1) * BLOCK_SIDE < g->nx ? (block + 1) * BLOCK_SIDE : g->nx;
}

/* Goes on to the next block that the footprint may touch. */
static bool next_block(const CellGrid *g, const Footprint *f, CellRun *run)
{
    for (;; run->block++) {
        while (!run->begun || run->block >= run->block_end) {
            uint32_t from, to;
            run->band = run->begun ? run->band_end : f->row;
            run->begun = true;
            if (run->band >= f->end) return false;
            run->band_end = (run->band / BLOCK_SIDE + 1) * BLOCK_SIDE;
            if (run->band_end > f->end) run->band_end = f->end;
            columns(g, f, run->band, run->band_end - 1, (KellerRange){g->low, g->high}, 0, g->nx, &from, &to);
            run->block = from / BLOCK_SIDE;
            run->block_end = from < to ? (to - 1) / BLOCK_SIDE + 1 : run->block;
        }
        run->next = run->band;
        run->z = g->heights[(size_t)(run->band / BLOCK_SIDE) * g->blocks_x + run->block];
        if (run->z.near <= run->z.far && !block_misses(g, f, run, run->block * BLOCK_SIDE, block_end(g, run->block))) return true;
    }
}

bool footprint_next(const CellGrid *g, const Footprint *f, CellRun *run)
{
    uint32_t first = 0, end = g->nx, last = f->end;
    if (!g->heights && !run->begun) *run = (CellRun){.begun = true, .next = f->row, .z = {g->low, g->high}};
    for (;;) {
        if (g->heights) {
            if (!run->begun || run->next >= run->band_end) {
                run->block += run->begun;
                if (!next_block(g, f, run)) return false;
            }
            first = run->block * BLOCK_SIDE;
            end = block_end(g, run->block);
            last = run->band_end;
        }
        while (run->next < last) {
            run->row = run->next++;
            if (g->heights) columns(g, f, run->row, run->row, run->z, first, end, &run->from, &run->to);
            else columns_of_row(g, f, run->row, &run->from, &run->to);
            if (run->from < run->to) return true;
        }
        if (!g->heights) return false;
    }
}

uint32_t footprint_cells(const CellGrid *g, const Footprint *f, uint32_t most)
{
    uint32_t n = 0;
    CellRun run = {0};
    while (n < most && footprint_next(g, f, &run)) {
        if (!g->heights) n += run.to - run.from;
        for (uint32_t x = run.from; x < run.to && g->heights; x++) n += footprint_has(g, f, cell_position(g, x, run.row));
    }
    return n < most ? n : most;
}

KellerVec3 footprint_middle(const CellGrid *g, const Footprint *f)
{
    KellerVec3 p = v3(0, 0, 0.5 * (g->low + g->high));
    for (uint32_t i = 0; i < f->corners; i++) p = v3_add(p, v3(f->corner[2 * i] / f->corners, f->corner[2 * i + 1] / f->corners, 0));
    const double x = round((p.x - g->x0) / g->step), y = round((p.y - g->y0) / g->step);
    if (!g->heights || !(x >= 0 && x < g->nx && y >= 0 && y < g->ny)) return p;
    KellerVec3 cell = cell_position(g, (uint32_t)x, (uint32_t)y);
    return isnan(cell.z) ? p : cell;
}

static void add_extent(KellerRange *range, KellerVec3 direction, KellerVec3 p)
{
    double d = v3_dot(direction, p);
    *range = (KellerRange){lesser(range->near, d), greater(range->far, d)};
}

KellerRange footprint_extent(const CellGrid *g, const Footprint *f, KellerVec3 origin, KellerVec3 direction)
{
    KellerRange r = {INFINITY, -INFINITY};
    for (uint32_t i = 0; i < f->corners && !g->heights; i++)
        add_extent(&r, direction, v3_sub(v3(f->corner[2 * i], f->corner[2 * i + 1], g->low), origin));
    CellRun run = {0};
    while (g->heights && footprint_next(g, f, &run))
        for (int i = 0; i < 4; i++) {
            double x = g->x0 + (i & 1 ? run.from : run.to - 1) * g->step, y = g->y0 + run.row * g->step;
            add_extent(&r, direction, v3_sub(v3(x, y, i & 2 ? run.z.far : run.z.near), origin));
        }
    return r;
}
