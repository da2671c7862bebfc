#include <assert.h>
#include "keller/wave.h"

void keller_angles(KellerVec3 d, double *zenith, double *azimuth)
{
    double r = hypot(d.x, d.y);
    if (zenith) *zenith = atan2(r, d.z);
    if (azimuth) {
        double a = r > 0 ? atan2(d.y, d.x) : 0;
        *azimuth = a == -M_PI ? M_PI : a; /* atan2(-0, -1); SPEC 1 has (-pi, pi] */
    }
}

void keller_spherical_basis(KellerVec3 d, KellerVec3 *theta_hat, KellerVec3 *phi_hat)
{
    double r = hypot(d.x, d.y), length = hypot(r, d.z);
    double cos_azimuth = r > 0 ? d.x / r : 1, sin_azimuth = r > 0 ? d.y / r : 0;
    double cos_zenith = length > 0 ? d.z / length : 1, sin_zenith = length > 0 ? r / length : 0;
    if (theta_hat) *theta_hat = v3(cos_zenith * cos_azimuth, cos_zenith * sin_azimuth, -sin_zenith);
    if (phi_hat) *phi_hat = v3(-sin_azimuth, cos_azimuth, 0);
}

/* The columns of Rz(yaw) Ry(pitch) Rx(roll): the antenna's axes in the global frame. */
typedef struct {
    KellerVec3 x, y, z;
} Axes;

static Axes antenna_axes(const double orientation[3])
{
    double cy = cos(orientation[0]), sy = sin(orientation[0]);
    double cp = cos(orientation[1]), sp = sin(orientation[1]);
    double cr = cos(orientation[2]), sr = sin(orientation[2]);
    return (Axes){v3(cy * cp, sy * cp, -sp), v3(cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr),
                  v3(cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr)};
}

static KellerVec3 to_global(const Axes *axes, KellerVec3 v)
{
    return v3_add(v3_add(v3_scale(axes->x, v.x), v3_scale(axes->y, v.y)), v3_scale(axes->z, v.z));
}

/* Half-wave dipole: |f|^2 = D (cos(pi/2 cos zenith)/sin zenith)^2 with D = 4/Cin(2 pi), because the integral of
 * cos^2(pi/2 cos zenith)/sin zenith over zenith is Cin(2 pi)/2 (Balanis, Antenna Theory, section 4.6). */
static double half_wave_dipole(double sine, double cosine)
{
    static const double sqrt_directivity = 1.2809849245735038; /* D = 1.6409223769845852 */
    if (sine == 0) return 0;
    /* cos(pi/2 |c|) = sin(pi/2 (1 - |c|)) and 1 - |c| = s^2/(1 + |c|): nothing cancels at the poles. */
    return sqrt_directivity * sin(0.5 * M_PI * sine * sine / (1 + fabs(cosine))) / sine;
}

/* 3GPP TR 38.901 table 7.3-1: 65 deg beam widths, 30 dB side lobes, 8 dBi. */
static double tr38901(double zenith, double azimuth)
{
    const double beam = 65 * M_PI / 180, side_lobes = 30, gain = 8;
    double v = (zenith - 0.5 * M_PI) / beam, h = azimuth / beam;
    double vertical = fmin(12 * v * v, side_lobes), horizontal = fmin(12 * h * h, side_lobes);
    return pow(10, (gain - fmin(vertical + horizontal, side_lobes)) / 20);
}

/* The loss in dB at an angle in degrees, linear between the cut's values. */
static double cut_loss(const double cut[KELLER_CUT_ANGLES], double angle)
{
    angle -= KELLER_CUT_ANGLES * floor(angle / KELLER_CUT_ANGLES);
    int i = (int)angle;
    double part = angle - i;
    return (1 - part) * cut[i % KELLER_CUT_ANGLES] + part * cut[(i + 1) % KELLER_CUT_ANGLES];
}

/* Vasiliadis, Dimitriou and Sergiadis, IEEE Trans. AP-53 (2005) 2212-2219, with their k = 2: the losses of both cuts, each with
 * more weight where the other cut is near its maximum. On either cut it is that cut's loss. */
static double cuts_amplitude(const KellerAntennaCuts *cuts, double zenith, double azimuth)
{
    double horizontal = cut_loss(cuts->horizontal, -azimuth * 180 / M_PI);
    double vertical = cut_loss(cuts->vertical, zenith * 180 / M_PI - 90);
    double h = pow(10, -horizontal / 10), v = pow(10, -vertical / 10);
    double weight_h = v * (1 - h), weight_v = h * (1 - v), norm = hypot(weight_h, weight_v);
    double loss = norm > 0 ? (horizontal * weight_h + vertical * weight_v) / norm : 0;
    return pow(10, (cuts->gain - loss) / 20);
}

void keller_antenna_field(const KellerAntenna *antenna, const double orientation[3], KellerVec3 d,
                          double complex *f_theta, double complex *f_phi)
{
    Axes axes = antenna_axes(orientation);
    KellerVec3 local = v3(v3_dot(axes.x, d), v3_dot(axes.y, d), v3_dot(axes.z, d));
    double sine = hypot(local.x, local.y), zenith, azimuth, amplitude = 1;
    switch (antenna->pattern) {
    case KELLER_ANTENNA_ISOTROPIC:
        break;
    case KELLER_ANTENNA_DIPOLE:
        amplitude = sqrt(1.5) * sine;
        break;
    case KELLER_ANTENNA_HALF_WAVE_DIPOLE:
        amplitude = half_wave_dipole(sine, local.z);
        break;
    case KELLER_ANTENNA_TR38901:
        keller_angles(local, &zenith, &azimuth);
        amplitude = tr38901(zenith, azimuth);
        break;
    case KELLER_ANTENNA_CUTS:
        keller_angles(local, &zenith, &azimuth);
        amplitude = cuts_amplitude(antenna->cuts, zenith, azimuth);
        break;
    default:
        assert(false);
    }

    /* H has V's power pattern along phi-hat: the header's promise, and model 2 of TR 38.901 section 7.3.2 at a slant of
     * 90 degrees. A dipole that lies down is V with roll or pitch. */
    KellerVec3 theta_hat, phi_hat, unit;
    keller_spherical_basis(local, &theta_hat, &phi_hat);
    unit = to_global(&axes, antenna->polarization == KELLER_POLARIZATION_V ? theta_hat : phi_hat);
    keller_spherical_basis(d, &theta_hat, &phi_hat);
    if (f_theta) *f_theta = amplitude * v3_dot(unit, theta_hat);
    if (f_phi) *f_phi = amplitude * v3_dot(unit, phi_hat);
}

double complex keller_array_factor(const KellerAntenna *antenna, const double orientation[3], KellerVec3 d, double k)
{
    if (antenna->element_count == 0) return 1;
    Axes axes = antenna_axes(orientation);
    KellerVec3 local = v3(v3_dot(axes.x, d), v3_dot(axes.y, d), v3_dot(axes.z, d));
    double complex sum = 0;
    for (uint32_t i = 0; i < antenna->element_count; i++)
        sum += cexp(I * (antenna->elements[i].phase + k * v3_dot(local, antenna->elements[i].position)));
    return sum / sqrt(antenna->element_count);
}
