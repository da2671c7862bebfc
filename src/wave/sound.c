/* Air, bands and sources of sound. */
#include "keller/sound.h"

double keller_sound_speed(double temperature, double pressure, double humidity)
{
    double t = temperature - 273.15, p = pressure, carbon = 314e-6;
    double saturated = exp(1.2811805e-5 * temperature * temperature - 1.9509874e-2 * temperature + 34.04926034 -
                           6.3536311e3 / temperature);
    double enhancement = 1.00062 + 3.14e-8 * p + 5.6e-7 * t * t;
    double water = humidity * enhancement * saturated / p; /* mole fraction */
    return 331.5024 + t * (0.603055 - 0.000528 * t) + (51.471935 + t * (0.1495874 - 0.000782 * t)) * water +
           (-1.82e-7 + t * (3.73e-8 - 2.93e-10 * t)) * p + (-85.20931 + t * (-0.228525 + 5.91e-5 * t)) * carbon -
           2.835149 * water * water - 2.15e-13 * p * p + 29.179762 * carbon * carbon + 0.000486 * water * p * carbon;
}

double keller_sound_loss(const KellerSound *sound, double frequency)
{
    if (!sound->absorbs) return 0;
    double relative = sound->pressure / 101325, theta = sound->temperature / 293.15, f2 = frequency * frequency;
    double saturated = pow(10, 4.6151 - 6.8346 * pow(273.16 / sound->temperature, 1.261)); /* over 101.325 kPa */
    double h = 100 * sound->humidity * saturated / relative;                             /* molar concentration of water, % */
    double oxygen = relative * (24 + 4.04e4 * h * (0.02 + h) / (0.391 + h));
    double nitrogen = relative / sqrt(theta) * (9 + 280 * h * exp(-4.170 * (1 / cbrt(theta) - 1)));
    double relaxation = 0.01275 * exp(-2239.1 / sound->temperature) / (oxygen + f2 / oxygen) +
                        0.1068 * exp(-3352.0 / sound->temperature) / (nitrogen + f2 / nitrogen);
    return 8.686 * f2 * (1.84e-11 / relative * sqrt(theta) + relaxation / (theta * theta * sqrt(theta)));
}

/* ---- bands ------------------------------------------------------------------------------------------------------------ */

/* Ten raised to this is the ratio of one band's middle to the next lower one's. */
static double band_step(uint32_t per_octave) { return 0.3 / per_octave; }

double keller_band_middle(uint32_t per_octave, double frequency)
{
    double step = band_step(per_octave);
    return 1000 * pow(10, step * nearbyint(log10(frequency / 1000) / step));
}

double keller_band_width(uint32_t per_octave, double middle)
{
    double half = pow(10, 0.5 * band_step(per_octave));
    return middle * (half - 1 / half);
}

double keller_a_weighting(double frequency)
{
    double f2 = frequency * frequency, low = 20.598997 * 20.598997, high = 12194.217 * 12194.217;
    double two = 107.65265 * 107.65265, three = 737.86223 * 737.86223;
    double response = high * f2 * f2 / ((f2 + low) * (f2 + high) * sqrt((f2 + two) * (f2 + three)));
    return 20 * log10(response) + 2.000;
}

/* ---- sources ----------------------------------------------------------------------------------------------------------- */

double keller_directivity(const KellerDirectivity *directivity, const double orientation[3], KellerVec3 d)
{
    /* Rz(yaw) Ry(pitch) takes +x there; roll turns about it. */
    double cosine = cos(orientation[1]);
    KellerVec3 axis = v3(cos(orientation[0]) * cosine, sin(orientation[0]) * cosine, -sin(orientation[1]));
    return 1 - directivity->order + directivity->order * v3_dot(axis, d);
}

double keller_directivity_factor(const KellerDirectivity *directivity)
{
    double dipole = directivity->order, monopole = 1 - dipole;
    return 1 / (monopole * monopole + dipole * dipole / 3);
}

double keller_source_level(double power, double factor)
{
    return 10 * log10(power / KELLER_REFERENCE_POWER * factor / (4 * M_PI));
}
