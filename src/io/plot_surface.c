#include <math.h>
#include "io/plot.h"

bool keller_plot_cut(const KellerVec3 corner[3], const double height[3], KellerVec3 ends[2])
{
    int found = 0;
    for (int i = 0; i < 3; ++i)
        if (isnan(height[i])) return false;
    for (int i = 0; i < 3 && found < 2; ++i) {
        int j = (i + 1) % 3;
        if ((height[i] >= 0) == (height[j] >= 0)) continue;
        double t = height[i] / (height[i] - height[j]);
        ends[found++] = v3_madd(corner[i], v3_sub(corner[j], corner[i]), t);
    }
    return found == 2;
}

/* The cell at or before `at` and how far beyond it, in [0, 1]; 0 of the last one. */
static uint32_t place(const double *axis, uint32_t count, double at, double *beyond)
{
    double step = count > 1 ? axis[1] - axis[0] : 1, i = (at - axis[0]) / step;
    *beyond = 0;
    if (!(i > 0)) return 0;
    if (i >= count - 1) return count - 1;
    *beyond = i - floor(i);
    return (uint32_t)i;
}

double keller_plot_over(const KellerPlotSurface *s, KellerVec3 p)
{
    double u, v, z = 0;
    uint32_t i = place(s->x, s->nx, p.x, &u), j = place(s->y, s->ny, p.y, &v);
    for (uint32_t k = 0; k < 4; ++k) {
        double weight = (k & 1 ? u : 1 - u) * (k & 2 ? v : 1 - v);
        if (weight > 0) z += weight * s->heights[(size_t)(j + (k >> 1)) * s->nx + i + (k & 1)];
    }
    return p.z - z;
}

/* 1, 2 or 5 times a power of ten: about a tenth of the range. */
static double step_of(double range)
{
    double unit = pow(10, floor(log10(range / 10))), least = range / 10 / unit;
    return unit * (least > 5 ? 10 : least > 2 ? 5 : least > 1 ? 2 : 1);
}

static KellerVec3 cell(const KellerPlotSurface *s, uint32_t i, uint32_t j)
{
    return v3(s->x[i], s->y[j], s->heights[(size_t)j * s->nx + i]);
}

static void contours_of(const KellerVec3 corner[3], double step, FILE *script)
{
    double low = fmin(corner[0].z, fmin(corner[1].z, corner[2].z)), high = fmax(corner[0].z, fmax(corner[1].z, corner[2].z));
    for (double n = ceil(low / step); n <= floor(high / step); ++n) {
        KellerVec3 ends[2];
        double height[3];
        for (int k = 0; k < 3; ++k) height[k] = corner[k].z - n * step;
        if (keller_plot_cut(corner, height, ends))
            fprintf(script, "%.10g %.10g\n%.10g %.10g\n\n", ends[0].x, ends[0].y, ends[1].x, ends[1].y);
    }
}

double keller_plot_contours(const KellerPlotSurface *s, FILE *script)
{
    double range = s->highest - s->z;
    if (!(range > 0) || !isfinite(range)) return 0;
    double step = step_of(range);
    fputs("$contours << EOD\n", script);
    for (uint32_t j = 0; j + 1 < s->ny; ++j)
        for (uint32_t i = 0; i + 1 < s->nx; ++i) {
            KellerVec3 a = cell(s, i, j), b = cell(s, i + 1, j), c = cell(s, i + 1, j + 1), d = cell(s, i, j + 1);
            if (isnan(a.z) || isnan(b.z) || isnan(c.z) || isnan(d.z)) continue;
            contours_of((KellerVec3[]){a, b, c}, step, script);
            contours_of((KellerVec3[]){a, c, d}, step, script);
        }
    fputs("EOD\n", script);
    return step;
}
