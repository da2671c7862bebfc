/* How a path carries a wave: through the faces before its first edge, over its edges, through the faces behind the last one; and
 * how that changes with the direction in which the wave sets out or arrives. docs/theory.md, "Fields that change across an edge". */
#ifndef KELLER_PATH_CARRY_H
#define KELLER_PATH_CARRY_H
#include "path/cascade.h"

typedef struct {
    const KellerScene *scene;
    const KellerPath *path;
    const KellerMedium *media;  /* of the frequency */
    KellerVec3 tx;
    double k;                   /* rad/m */
    PathEdges edges;
    Cascade cascade;
    double spreading;           /* 1/m; 0: the path carries nothing */
    uint32_t first, behind;     /* steps before `first` and from `behind` on are faces; without edges first = behind = count */
    struct {                    /* at the transmitter's and at the receiver's end, if there are edges */
        KellerVec3 edge;        /* direction of the edge nearest to it along the path */
        KellerVec3 axis;        /* the same edge as it is seen from there, by way of the reflections between */
        int sense;              /* -1: mirrored */
        double zone;            /* rad, about the axis: half the width of the first Fresnel zone at the edge, at most 0.2 */
        double complex slope;   /* keller_slope_factor */
    } end[2];
} PathWave;

/* Strips up to `width` (m) wide are one edge each. Not for paths that are scattered. */
PathWave path_wave(const KellerScene *scene, const KellerPath *path, double width, KellerVec3 tx, double k, const KellerMedium *media);

/* Of the 2x2 transfer matrix, but for weight, air and phase. */
void path_carry(const PathWave *wave, double complex transfer[4]);

/* What the derivative of an antenna's pattern at one end (0: transmitter, 1: receiver) takes the place of the pattern with: of its
 * components by the angle about the axis, growing as its ray turns towards growing azimuth at the edge, and for components along
 * theta-hat and phi-hat of the path's direction. `change`: how much of itself the pattern changes over the zone. Less than path_even does
 * not count. */
void path_carry_slope(const PathWave *wave, int end, double change, double complex slope[4]);

/* v turned about the end's axis, as its ray turns by `angle` (rad) towards growing azimuth at the edge. */
KellerVec3 path_turned(const PathWave *wave, int end, double angle, KellerVec3 v);

/* Slopes cost as much as the field, over several edges up to six times as much; they come in by and by from the first change to the
 * second, below which they are no more than the theory's own error. */
static const double path_even = 0.005, path_uneven = 0.01;
#endif
