/* Bundles of rays: from the hull of some sources, in the directions of a convex cone with flat sides. */
#ifndef KELLER_PATH_BEAM_H
#define KELLER_PATH_BEAM_H
#include "path/internal.h"

enum {
    SOURCES = 2,                /* of a bundle: one for a point, two for a piece of edge */
    WINDOW_MOST = 8,            /* corners of a window: as many as keller_cone_fan takes */
    NARROW_TRIANGLES = 8        /* to faces of more triangles nothing is cut: it would take longer than what it saves */
};

/* Sides and corners are trusted to this angle (radians): above KELLER_BOUNDARY_ANGLE and far above their rounding. A window is so
 * much wider than what it is to hold. */
#define WINDOW_PAD (4 * KELLER_BOUNDARY_ANGLE)
#define WINDOW_LEAST (16 * WINDOW_PAD)  /* narrower windows are not halved: their sides are hardly apart */
#define BEAM_PAD 1e-9           /* relative widening of slopes, far above their rounding */

/* Directions d with side[i].d <= WINDOW_PAD |d| for all i: non-negative combinations of the corners. Unit vectors; corners i and
 * i + 1 are on side i. */
typedef struct {
    uint32_t count;             /* 3 .. WINDOW_MOST */
    KellerVec3 corner[WINDOW_MOST], side[WINDOW_MOST];
} Window;

/* Bounds of slopes d.X/d.Z, d.Y/d.Z in a frame X, Y, Z. */
typedef struct {
    double low[2], high[2];
} Slopes;
#define SLOPES_NONE ((Slopes){{INFINITY, INFINITY}, {-INFINITY, -INFINITY}})

/* The directions with these slopes. */
Window window_of(const KellerVec3 axis[3], const Slopes *slopes);
/* Cuts off what is in front of the plane with this unit normal through the apex; false: nothing is left. Where the result had
 * more than WINDOW_MOST corners, it is not cut. */
bool window_cut(Window *window, KellerVec3 normal);
/* The largest distance between two corners, and the difference of the two. */
double window_width(const Window *window, KellerVec3 *across);
KellerVec3 window_middle(const Window *window);
/* Two parts, each about half as wide, that together hold the window; less than two where one is empty, 0 where it is not to be halved: at
 * most WINDOW_LEAST wide, or of many corners and nearly a half-space. */
int window_halves(const Window *window, Window half[2]);
/* A frame whose z is `along`, x is `across`, at right angles to it; unit vectors. */
void window_axes(KellerVec3 along, KellerVec3 across, KellerVec3 axis[3]);
/* Widens the slopes, in this frame, to hold those of the window; false if parts of it are not in front. */
bool window_slopes(const Window *window, const KellerVec3 axis[3], Slopes *slopes);

/* All rays that start in the hull of the sources and run in the directions of the window. */
typedef struct {
    uint32_t source_count;
    KellerVec3 source[SOURCES];
    Window window;
} Bundle;

/* What tests of many things against one bundle share: the sides moved out to the sources, in m. */
typedef struct {
    const Bundle *bundle;
    double support[WINDOW_MOST];
    double side[3][WINDOW_MOST], corner[3][WINDOW_MOST];    /* of the window, by coordinate */
    uint32_t room;              /* their number, up to a multiple of 4: the support of the rest is infinite, corners are doubled */
    double rounding;            /* m, of positions */
    double contact;             /* m: sources so near to a plane are on it */
} BundleTest;

BundleTest bundle_test(const Bundle *bundle, const KellerScene *scene);

/* Is no point of the hull of v[0 .. count), count 2 or 3, on a ray of the bundle? True only if surely so. What is behind the
 * sources may be called met. */
bool bundle_misses(const BundleTest *test, uint32_t count, const KellerVec3 *v);

/* Cuts the window down to the directions in which some source sees some point of the face: towards its plane, and, but for faces
 * of many triangles, at those of its borders that all of it is on one side of. False: there are none. Sources may be mirror
 * images in the face: rays then come through it. */
bool bundle_narrow(Bundle *bundle, const KellerScene *scene, uint32_t face);

/* The part of the segment a + t (b - a), *from <= t <= *to, that may be on rays of the bundle; false: none is. */
bool bundle_part(const BundleTest *test, KellerVec3 a, KellerVec3 b, double *from, double *to);

/* Where rays of the bundle cross the face's plane, in m along the unit vector `along` from `origin`; *steep: the least |sine| of
 * the angle between a ray and the plane. False if some do not cross it, or run nearly along it. */
bool bundle_crossing(const Bundle *bundle, const KellerFace *face, KellerVec3 origin, KellerVec3 along, KellerRange *range,
                     double *steep);

void bundle_mirror(Bundle *bundle, const KellerFace *face);
#endif
