/* io/plot.h -- pictures of a result, as gnuplot scripts. */
#ifndef KELLER_IO_PLOT_H
#define KELLER_IO_PLOT_H
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include "io/result_read.h"
#include "keller/path.h"

typedef enum {
    KELLER_PLOT_COVERAGE,
    KELLER_PLOT_DELAY,
    KELLER_PLOT_DELAY_SPREAD,
    KELLER_PLOT_ANGLE_SPREAD,
    KELLER_PLOT_LEVEL,
    KELLER_PLOT_PATHS
} KellerPlotKind;

typedef struct {
    const char *file;           /* the result, for messages */
    KellerPlotKind kind;
    bool svg;                   /* else PNG */
    size_t tx;
    bool all;                   /* LEVEL: the energies of all transmitters together; tx does not count */
    bool incoherent;            /* COVERAGE: powers are added, not fields */
    KellerAngle angle;          /* ANGLE_SPREAD */
    size_t set;                 /* the grid; for paths the receivers, SIZE_MAX: all */
    int64_t index;              /* for paths: one point of the set, -1: all */
    size_t frequency;           /* LEVEL: SIZE_MAX for the A-weighted sum of all */
} KellerPlot;

/* Writes the whole script, data included. */
KellerStatus keller_plot_map(KellerReader *reader, const KellerPlot *plot, FILE *script, KellerError *error);
KellerStatus keller_plot_paths(KellerReader *reader, const KellerPlot *plot, FILE *script, KellerError *error);

/* ---- plot_frame.c: what all pictures share ----------------------------------------------------------------------- */

typedef struct {
    double x0, x1, y0, y1;      /* m, what is shown */
} KellerPlotBox;

/* Terminal, size in true aspect ratio, axes in metres, the palette with its range and label. `subtitle` may be NULL. */
void keller_plot_frame(const KellerPlot *plot, KellerPlotBox box, const char *title, const char *subtitle,
                       const char *colour_label, double lowest, double highest, FILE *script);
/* What the scene is cut with: the plane at height z, or, where the cells of a map lie at different heights, their surface. */
typedef struct {
    double z;                   /* m: of the plane; of a surface its lowest */
    double highest;             /* m: of a surface; the same as z: it is a plane */
    uint32_t ny, nx;
    const double *x, *y, *heights;  /* of a surface: m, [nx], [ny], [ny][nx]; heights are NaN where there is none */
} KellerPlotSurface;

/* The data block $outline: where the plane cuts the scene, within the box, or the surface its walls, since all else may be what
 * the surface lies over. *any: it holds something. */
KellerStatus keller_plot_outline(KellerReader *reader, const char *file, KellerPlotBox box, const KellerPlotSurface *surface,
                                 FILE *script, bool *any, KellerError *error);
/* ---- plot_surface.c ------------------------------------------------------------------------------------------------ */

/* How far a point is over the surface, m, linear between the cells; beyond the map as at its nearest cell. NaN where there is none. */
double keller_plot_over(const KellerPlotSurface *surface, KellerVec3 p);
/* The data block $contours: lines of equal height of a surface. Returns the step between them, m; 0: there are none. */
double keller_plot_contours(const KellerPlotSurface *surface, FILE *script);

/* Where the triangle is at height 0 of its corners' heights: two points, or nothing. A corner at 0 counts as above it, so
 * that walls of two triangles show every piece once. */
bool keller_plot_cut(const KellerVec3 corner[3], const double height[3], KellerVec3 ends[2]);
/* Marks a point with its name, in the transmitters' or the receivers' colour. */
void keller_plot_mark(KellerVec3 point, KellerPlotBox box, const char *name, bool receiver, FILE *script);
#endif
