/* keller/geo.h -- geodetic positions, by GeographicLib::LocalCartesian on WGS84. */
#ifndef KELLER_GEO_H
#define KELLER_GEO_H
#include "keller/vec.h"
#ifdef __cplusplus
extern "C" {
#endif
typedef struct {
    double latitude, longitude; /* degrees, [-90, 90] and [-180, 180] */
    double height;              /* m above the ellipsoid */
} KellerGeodetic;

/* The position `point` in the east-north-up frame whose origin is `origin`; metres. */
KellerVec3 keller_geo_to_local(KellerGeodetic origin, KellerGeodetic point);
/* The inverse. */
KellerGeodetic keller_geo_from_local(KellerGeodetic origin, KellerVec3 point);
#ifdef __cplusplus
}
#endif
#endif
