/* The edges of a path as its field has them: two edges much nearer to each other than a wavelength are one. */
#ifndef KELLER_PATH_EDGES_H
#define KELLER_PATH_EDGES_H
#include "path/internal.h"

typedef struct {
    uint32_t begin, end;        /* steps: of one diffraction, or of two in a row at a strip's two edges */
    uint32_t first;             /* KELLER_NONE, or the first twin of the strip whose edges are taken as one */
    double share;               /* begin < end: how much of the way between them goes to the leg before */
} PathEdge;

typedef struct {
    uint32_t count;
    PathEdge edge[KELLER_MAX_BENDS];
    double weight;              /* of the path: of all paths over a strip's edges those that stand for the one edge have 1 in sum */
    double widest;              /* m: of the strips that were taken as one; 0 without */
} PathEdges;

/* Wavelengths: up to the first width a strip's edges are one, from the second on two, and in between by and by from the one to the
 * other. */
static const double path_one_edge = 0.25, path_two_edges = 0.5;

/* Strips up to `width` (m) wide are taken as one edge each. docs/theory.md, "Two edges as one". */
void path_edges(const KellerScene *scene, const KellerPath *path, double width, PathEdges *edges);

/* The wedge that a strip's edges are together: outer faces, opening n_1 + n_2 - 1. Without media and model. */
KellerWedgeWave path_strip_wedge(const KellerScene *scene, uint32_t first);

/* The wedge of one of the path's edges, or of two that are taken as one, with its media of one frequency. */
KellerWedgeWave path_edge_wave(const KellerScene *scene, const KellerPath *path, const PathEdge *edge, const KellerMedium *media);

/* A ray's direction from the wedge outwards. Along a screen from one of its rims to another the azimuth is 0 or 2 pi by rounding: the
 * wave is taken to be on the side of the face's normal, which both rims and both directions agree on. */
KellerVec3 path_beside_screen(const KellerScene *scene, uint32_t wedge, KellerVec3 outwards);
#endif
