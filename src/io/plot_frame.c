#include <math.h>
#include <stdlib.h>
#include "io/gnuplot.h"
#include "io/plot.h"

/* Pixels: the largest plot area, the least, and what stands around it. */
static const double most_width = 1000, most_height = 700, least_width = 260, least_height = 140;
static const double side = 230, top_and_bottom = 120;

void keller_plot_frame(const KellerPlot *plot, KellerPlotBox box, const char *title, const char *subtitle,
                       const char *colour_label, double lowest, double highest, FILE *script)
{
    double dx = box.x1 - box.x0, dy = box.y1 - box.y0;
    double scale = fmin(most_width / dx, most_height / dy);
    int width = (int)(fmax(least_width, dx * scale) + side),
        height = (int)(fmax(least_height, dy * scale) + top_and_bottom);
    if (plot->svg)
        fprintf(script, "set terminal svg noenhanced size %d,%d font 'sans,13' background '#ffffff'\n", width, height);
    else
        /* The terminal of choice is missing where gnuplot was built without cairo. */
        fprintf(script,
                "if (strstrt(GPVAL_TERMINALS, 'pngcairo') > 0) {\n"
                "  set terminal pngcairo noenhanced size %d,%d font 'sans,11' background '#ffffff'\n"
                "} else {\n  set terminal png noenhanced truecolor size %d,%d\n}\n",
                width, height, width, height);
    fprintf(script, "set size ratio -1\nset border lw 0.8\nset tics out nomirror\nunset key\n"
                    "set style textbox opaque noborder margins 0.3,0.1\n"
                    "set xlabel 'x / m'\nset ylabel 'y / m'\n"
                    "set xrange [%.17g:%.17g]\nset yrange [%.17g:%.17g]\n", box.x0, box.x1, box.y0, box.y1);
    fputs("set title ", script);
    keller_gnuplot_text(script, title);
    if (subtitle) {
        fputs(".\"\\n\".", script);
        keller_gnuplot_text(script, subtitle);
    }
    fputs("\nset cblabel ", script);
    keller_gnuplot_text(script, colour_label);
    fputs(" offset 1.5,0", script); /* clear of tick labels such as -100 */
    /* viridis: lightness grows evenly, readable in grey and by the colour-blind */
    fprintf(script, "\nset cbrange [%.17g:%.17g]\nset palette defined (0 '#440154', 1 '#482475', 2 '#414487', "
                    "3 '#355f8d', 4 '#2a788e', 5 '#21918c', 6 '#22a884', 7 '#44bf70', 8 '#7ad151', 9 '#bddf26', "
                    "10 '#fde725')\n", lowest, highest);
}

void keller_plot_mark(KellerVec3 point, KellerPlotBox box, const char *name, bool receiver, FILE *script)
{
    if (!(point.x >= box.x0 && point.x <= box.x1 && point.y >= box.y0 && point.y <= box.y1)) return;
    bool right = point.x > box.x0 + 0.8 * (box.x1 - box.x0);
    const char *colour = receiver ? "#0b4fd6" : "#d62728";
    fprintf(script, "set object circle at %.17g,%.17g size screen 0.006 front fillcolor rgb '%s' fillstyle solid "
                    "border lc rgb '#ffffff'\nset label ", point.x, point.y, colour);
    keller_gnuplot_text(script, name);
    fprintf(script, " at %.17g,%.17g %s offset %s,0.7 front boxed textcolor rgb '%s'\n", point.x, point.y,
            right ? "right" : "left", right ? "-0.7" : "0.7", colour);
}

static bool is_wall(const KellerVec3 corner[3])
{
    const double steepest = 0.1; /* sine of what a wall may lean */
    KellerVec3 n = v3_cross(v3_sub(corner[1], corner[0]), v3_sub(corner[2], corner[0]));
    return fabs(n.z) <= steepest * v3_norm(n);
}

static bool cut(const KellerPlotSurface *surface, const KellerVec3 corner[3], KellerVec3 ends[2])
{
    const bool flat = surface->highest == surface->z;
    double height[3];
    if (!flat && !is_wall(corner)) return false;
    for (int i = 0; i < 3; ++i) height[i] = flat ? corner[i].z - surface->z : keller_plot_over(surface, corner[i]);
    return keller_plot_cut(corner, height, ends);
}

static bool inside(KellerPlotBox box, const KellerVec3 ends[2])
{
    return fmax(ends[0].x, ends[1].x) >= box.x0 && fmin(ends[0].x, ends[1].x) <= box.x1 &&
           fmax(ends[0].y, ends[1].y) >= box.y0 && fmin(ends[0].y, ends[1].y) <= box.y1;
}

KellerStatus keller_plot_outline(KellerReader *reader, const char *file, KellerPlotBox box, const KellerPlotSurface *surface,
                                 FILE *script, bool *any, KellerError *error)
{
    enum { BLOCK = 16384 };
    const KellerResultInfo *info = keller_reader_info(reader);
    *any = false;
    if (info->triangles == 0) return KELLER_OK;
    KellerVec3 *vertices = malloc((size_t)(info->vertices + 1) * sizeof *vertices);
    uint32_t(*triangles)[3] = malloc(BLOCK * sizeof *triangles);
    KellerStatus status = KELLER_OK;
    if (!vertices || !triangles) status = keller_error_memory(error, info->vertices * sizeof *vertices);
    if (status == KELLER_OK)
        status = keller_reader_rows(reader, "/scene/vertices", KELLER_CELL_F8, 3, 0, info->vertices, vertices, error);
    fputs("$outline << EOD\n", script);
    for (uint64_t first = 0; first < info->triangles && status == KELLER_OK; first += BLOCK) {
        uint64_t left = info->triangles - first, count = left < BLOCK ? left : BLOCK;
        status = keller_reader_rows(reader, "/scene/triangles", KELLER_CELL_U4, 3, first, count, triangles, error);
        for (uint64_t t = 0; t < count && status == KELLER_OK; ++t) {
            const uint32_t *v = triangles[t];
            if (v[0] >= info->vertices || v[1] >= info->vertices || v[2] >= info->vertices) {
                status = keller_error(error, KELLER_BAD_INPUT, "%s: triangle %llu names a vertex that is not there",
                                      file, (unsigned long long)(first + t));
                break;
            }
            const KellerVec3 corner[3] = {vertices[v[0]], vertices[v[1]], vertices[v[2]]};
            KellerVec3 ends[2];
            if (!cut(surface, corner, ends) || !inside(box, ends)) continue;
            fprintf(script, "%.10g %.10g\n%.10g %.10g\n\n", ends[0].x, ends[0].y, ends[1].x, ends[1].y);
            *any = true;
        }
    }
    fputs("EOD\n", script);
    free(vertices);
    free(triangles);
    return status;
}
