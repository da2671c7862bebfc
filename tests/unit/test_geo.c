/* keller/geo.h against values from first principles: the WGS84 ellipsoid (a = 6378137 m, f = 1/298.257223563). */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "keller/geo.h"

#define A 6378137.0
#define B (A * (1 - 1 / 298.257223563))

static const KellerGeodetic munich = {48.137154, 11.576124, 519};

static void assert_near(KellerVec3 p, double x, double y, double z, double tolerance)
{
    assert_true(fabs(p.x - x) <= tolerance);
    assert_true(fabs(p.y - y) <= tolerance);
    assert_true(fabs(p.z - z) <= tolerance);
}

static void origin_is_zero(void **state)
{
    (void)state;
    assert_near(keller_geo_to_local(munich, munich), 0, 0, 0, 1e-8);
}

/* A point straight above is on the z axis. */
static void height_is_up(void **state)
{
    (void)state;
    KellerGeodetic point = munich;
    point.height += 100;
    assert_near(keller_geo_to_local(munich, point), 0, 0, 100, 1e-8);
}

/* From (0, 0) on the equator, x is the sine of the longitude on a circle of radius a: x = a sin(1 deg), z = a (cos -
 * 1). */
static void equator(void **state)
{
    (void)state;
    double angle = 3.14159265358979323846 / 180;
    KellerVec3 p = keller_geo_to_local((KellerGeodetic){0, 0, 0}, (KellerGeodetic){0, 1, 0});
    assert_near(p, A * sin(angle), 0, A * (cos(angle) - 1), 1e-8);
}

/* From (0, 0), the north pole is b to the north and a below. */
static void pole(void **state)
{
    (void)state;
    assert_near(keller_geo_to_local((KellerGeodetic){0, 0, 0}, (KellerGeodetic){90, 0, 0}), 0, B, -A, 1e-8);
}

static void there_and_back(void **state)
{
    (void)state;
    KellerVec3 p = {-812.5, 1234.25, 87.125};
    assert_near(keller_geo_to_local(munich, keller_geo_from_local(munich, p)), p.x, p.y, p.z, 1e-8);
    KellerGeodetic north = keller_geo_from_local(munich, v3(0, 1000, 0));
    assert_true(north.latitude > munich.latitude && fabs(north.longitude - munich.longitude) < 1e-12);
}

/* A latitude beyond the pole has no position; what is thrown stays inside. */
static void impossible_is_nan(void **state)
{
    (void)state;
    assert_true(isnan(keller_geo_to_local((KellerGeodetic){91, 0, 0}, munich).x));
    assert_true(isnan(keller_geo_to_local(munich, (KellerGeodetic){-91, 0, 0}).x));
    assert_true(isnan(keller_geo_from_local((KellerGeodetic){91, 0, 0}, v3(1, 2, 3)).latitude));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(origin_is_zero), cmocka_unit_test(height_is_up),   cmocka_unit_test(equator),
        cmocka_unit_test(pole),           cmocka_unit_test(there_and_back), cmocka_unit_test(impossible_is_nan),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests_name("geo", tests, NULL, NULL);
}
