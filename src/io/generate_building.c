/* Solids on a plot. All walls are upright and all roofs plane, also where the plot is a trapezoid: a pitched roof's
 * eaves and ridge run along the two parallel sides. */
#include "io/generate_emit.h"

typedef struct {
    double x, y;
} Place;

static double rounded(double length) { return floor(length * 64 + 0.5) * 0x1p-6; }

static Place place(const KellerPlot *plot, double u, double v)
{
    double left = plot->front[0] + v * (plot->back[0] - plot->front[0]);
    double right = plot->front[1] + v * (plot->back[1] - plot->front[1]);
    return (Place){rounded(left + u * (right - left)), rounded(plot->y[0] + v * keller_plot_depth(plot))};
}

KellerPlot keller_plot_part(const KellerPlot *plot, double u0, double u1, double v0, double v1)
{
    KellerPlot part = *plot;
    Place a = place(plot, u0, v0), b = place(plot, u1, v0), c = place(plot, u1, v1), d = place(plot, u0, v1);
    part.front[0] = a.x, part.front[1] = b.x, part.back[1] = c.x, part.back[0] = d.x;
    part.y[0] = a.y, part.y[1] = c.y;
    return part;
}

static uint32_t vertex(KellerEmit *emit, const KellerPlot *plot, Place p, double z)
{
    const double *o = plot->origin, *a = plot->along;
    return keller_emit_vertex(emit, v3(o[0] + p.x * a[0] - p.y * a[1], o[1] + p.x * a[1] + p.y * a[0], z));
}

/* `count` vertices at one height; returns the first. */
static uint32_t level(KellerEmit *emit, const KellerPlot *plot, int count, const Place *places, double z)
{
    uint32_t first = vertex(emit, plot, places[0], z);
    for (int i = 1; i < count; i++) vertex(emit, plot, places[i], z);
    return first;
}

/* The plot's corners, counter-clockwise from the front's left end, drawn in by u of the width and v of the depth. */
static void corners(const KellerPlot *plot, double u, double v, Place out[4])
{
    out[0] = place(plot, u, v), out[1] = place(plot, 1 - u, v);
    out[2] = place(plot, 1 - u, 1 - v), out[3] = place(plot, u, 1 - v);
}

/* The walls between two levels of `count` vertices each, given by their first ones; `outside` is the side they face. */
static void walls(KellerEmit *emit, int count, uint32_t low, uint32_t high, bool outside)
{
    for (int i = 0; i < count; i++) {
        uint32_t a = (uint32_t)i, b = (uint32_t)((i + 1) % count);
        if (outside) keller_emit_quad(emit, low + a, low + b, high + b, high + a);
        else keller_emit_quad(emit, low + b, low + a, high + a, high + b);
    }
}

/* Between an outer and an inner quadrangle of one height, facing up or down. */
static void frame(KellerEmit *emit, uint32_t outer, uint32_t inner, bool up)
{
    for (uint32_t a = 0; a < 4; a++) {
        uint32_t b = (a + 1) % 4;
        if (up) keller_emit_quad(emit, outer + a, outer + b, inner + b, inner + a);
        else keller_emit_quad(emit, outer + b, outer + a, inner + a, inner + b);
    }
}

static void floor_of(KellerEmit *emit, uint32_t low) { keller_emit_quad(emit, low, low + 3, low + 2, low + 1); }
static void roof_of(KellerEmit *emit, uint32_t high) { keller_emit_quad(emit, high, high + 1, high + 2, high + 3); }

void keller_emit_shed(KellerEmit *emit, const KellerPlot *plot, double height, double rise)
{
    Place base[4];
    corners(plot, 0, 0, base);
    uint32_t low = level(emit, plot, 4, base, 0), high = level(emit, plot, 2, base, height);
    level(emit, plot, 2, base + 2, height + rise);
    walls(emit, 4, low, high, true);
    floor_of(emit, low);
    roof_of(emit, high);
}

void keller_emit_box(KellerEmit *emit, const KellerPlot *plot, double height)
{
    keller_emit_shed(emit, plot, height, 0);
}

void keller_emit_ridge(KellerEmit *emit, const KellerPlot *plot, double height, double rise, double inset)
{
    Place base[4];
    corners(plot, 0, 0, base);
    uint32_t low = level(emit, plot, 4, base, 0), eave = level(emit, plot, 4, base, height);
    /* Not rounded: a gable's peak must stay in the plane of its wall. */
    Place left = {(base[0].x + base[3].x) / 2, (base[0].y + base[3].y) / 2};
    Place right = {(base[1].x + base[2].x) / 2, (base[1].y + base[2].y) / 2};
    double in = inset > 0 ? rounded(inset * (right.x - left.x)) : 0;
    left.x += in;
    right.x -= in;
    uint32_t west = vertex(emit, plot, left, height + rise), east = vertex(emit, plot, right, height + rise);
    walls(emit, 4, low, eave, true);
    floor_of(emit, low);
    keller_emit_quad(emit, eave, eave + 1, east, west);
    keller_emit_quad(emit, eave + 2, eave + 3, west, east);
    keller_emit_triangle(emit, eave + 1, eave + 2, east);
    keller_emit_triangle(emit, eave + 3, eave, west);
}

void keller_emit_ell(KellerEmit *emit, const KellerPlot *plot, double height, double cut_u, double cut_v,
                     bool mirrored)
{
    /* From the inner corner, which sees all others, counter-clockwise. */
    static const double shape[6][2] = {{2, 2}, {2, 1}, {0, 1}, {0, 0}, {1, 0}, {1, 2}};
    Place base[6];
    for (int i = 0; i < 6; i++) {
        const double *s = shape[mirrored && i > 0 ? 6 - i : i];
        double u = s[0] > 1 ? cut_u : s[0], v = s[1] > 1 ? cut_v : s[1];
        base[i] = place(plot, mirrored ? 1 - u : u, v);
    }
    uint32_t low = level(emit, plot, 6, base, 0), high = level(emit, plot, 6, base, height);
    walls(emit, 6, low, high, true);
    for (uint32_t i = 1; i < 5; i++) {
        keller_emit_triangle(emit, low, low + i + 1, low + i);
        keller_emit_triangle(emit, high, high + i, high + i + 1);
    }
}

void keller_emit_ring(KellerEmit *emit, const KellerPlot *plot, double height, double wing)
{
    Place outer[4], inner[4];
    corners(plot, 0, 0, outer);
    corners(plot, wing / keller_plot_width(plot), wing / keller_plot_depth(plot), inner);
    uint32_t low = level(emit, plot, 4, outer, 0), low_in = level(emit, plot, 4, inner, 0);
    uint32_t high = level(emit, plot, 4, outer, height), high_in = level(emit, plot, 4, inner, height);
    walls(emit, 4, low, high, true);
    walls(emit, 4, low_in, high_in, false);
    frame(emit, low, low_in, false);
    frame(emit, high, high_in, true);
}

void keller_emit_tower(KellerEmit *emit, const KellerPlot *plot, double podium, double height, double setback)
{
    Place outer[4], inner[4];
    corners(plot, 0, 0, outer);
    corners(plot, setback / keller_plot_width(plot), setback / keller_plot_depth(plot), inner);
    uint32_t low = level(emit, plot, 4, outer, 0), middle = level(emit, plot, 4, outer, podium);
    uint32_t foot = level(emit, plot, 4, inner, podium), high = level(emit, plot, 4, inner, height);
    walls(emit, 4, low, middle, true);
    frame(emit, middle, foot, true);
    walls(emit, 4, foot, high, true);
    floor_of(emit, low);
    roof_of(emit, high);
}
