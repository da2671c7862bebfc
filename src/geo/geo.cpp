// keller/geo.h by GeographicLib; no exception leaves this file: a position that cannot be computed is NaN.
#include "keller/geo.h"

#include <GeographicLib/LocalCartesian.hpp>
#include <limits>

namespace {
constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

GeographicLib::LocalCartesian frame(const KellerGeodetic &origin)
{
    return GeographicLib::LocalCartesian(origin.latitude, origin.longitude, origin.height,
                                         GeographicLib::Geocentric::WGS84());
}
} // namespace

extern "C" KellerVec3 keller_geo_to_local(KellerGeodetic origin, KellerGeodetic point)
{
    try {
        KellerVec3 local;
        frame(origin).Forward(point.latitude, point.longitude, point.height, local.x, local.y, local.z);
        return local;
    } catch (...) {
        return KellerVec3{nan_value, nan_value, nan_value};
    }
}

extern "C" KellerGeodetic keller_geo_from_local(KellerGeodetic origin, KellerVec3 point)
{
    try {
        KellerGeodetic geodetic;
        frame(origin).Reverse(point.x, point.y, point.z, geodetic.latitude, geodetic.longitude, geodetic.height);
        return geodetic;
    } catch (...) {
        return KellerGeodetic{nan_value, nan_value, nan_value};
    }
}
