/* Angles around an edge. */
#ifndef KELLER_WAVE_AZIMUTH_H
#define KELLER_WAVE_AZIMUTH_H
#include <math.h>
#include "keller/wave.h"

/* Where a direction from the edge outwards lies: x and y across the edge, along tangent0 and normal0. */
typedef struct {
    double x, y, r;             /* r = hypot(x, y): the sine of the angle to the edge for a unit vector */
    double phi;                 /* in [0, n pi] */
} EdgeAzimuth;

static inline EdgeAzimuth edge_azimuth(const KellerWedgeWave *wedge, KellerVec3 side)
{
    EdgeAzimuth a = {.x = v3_dot(side, wedge->tangent0), .y = v3_dot(side, wedge->normal0)};
    double opening = wedge->n * M_PI;
    a.r = hypot(a.x, a.y);
    a.phi = atan2(a.y, a.x);
    if (a.phi < 0) a.phi += 2 * M_PI;
    /* A point on a face may have been rounded to behind it. */
    if (a.phi > opening) a.phi = a.phi - opening < 2 * M_PI - a.phi ? opening : 0;
    return a;
}
#endif
