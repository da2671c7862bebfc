#include "lossy_errors.h"
#include "maliuzhinets.h"

enum { SOURCES = 11, RECEIVERS = 47 };

double complex lossy_coefficient(KellerWedgeModel model, double n, double complex eta, int across, double phi_in, double phi)
{
    const double k = 1e12;
    KellerMedium medium = {.eta = eta};
    KellerWedgeWave w = {.n = n, .direction = {0, 0, 1}, .tangent0 = {1, 0, 0}, .normal0 = {0, 1, 0},
                         .medium = {medium, medium}, .model = model};
    KellerVec3 in = v3(-cos(phi_in), -sin(phi_in), 0), out = v3(cos(phi), sin(phi), 0);
    KellerVec3 from = across ? v3(sin(phi_in), -cos(phi_in), 0) : v3(0, 0, 1);
    KellerVec3 to = across ? v3(-sin(phi), cos(phi), 0) : v3(0, 0, 1);
    KellerCVec3 e = keller_diffract_field(&w, in, out, INFINITY, 1, k, (KellerCVec3){from.x, from.y, from.z});
    return sqrt(k) * (e.x * to.x + e.y * to.y + e.z * to.z);
}

double complex lossy_exact(double n, double complex eta, int across, double phi_in, double phi)
{
    double complex sine = across ? 1 / csqrt(eta) : csqrt(eta);
    return maliuzhinets_coefficient(n, phi, phi_in, sine, sine);
}

void lossy_errors(double n, double complex eta, int across, LossyErrors errors[LOSSY_MODELS])
{
    const double away = 10 * M_PI / 180;
    int shadow = 0, all = 0;
    for (int m = 0; m < LOSSY_MODELS; m++) errors[m] = (LossyErrors){0, 0, 0, 0, 0};
    for (int i = 0; i < SOURCES; i++)
        for (int j = 0; j < RECEIVERS; j++) {
            double phi_in = (0.03 + 0.94 * i / (SOURCES - 1)) * n * M_PI;
            double phi = (0.013 + 0.974 * j / (RECEIVERS - 1)) * n * M_PI;
            double boundary[] = {phi_in + M_PI, phi_in - M_PI, M_PI - phi_in, (2 * n - 1) * M_PI - phi_in};
            bool near = false;
            for (int b = 0; b < 4; b++) near |= fabs(phi - boundary[b]) < away;
            if (near) continue;
            double complex exact = lossy_exact(n, eta, across, phi_in, phi);
            bool dark = fabs(phi - phi_in) > M_PI;
            all++;
            shadow += dark;
            for (int m = 0; m < LOSSY_MODELS; m++) {
                double complex d = lossy_coefficient((KellerWedgeModel)m, n, eta, across, phi_in, phi);
                errors[m].everywhere += pow(cabs(d - exact), 2);
                if (!dark) continue;
                double level = 20 * log10(cabs(d) / cabs(exact));
                errors[m].shadow += level * level;
                errors[m].worst_shadow = fmax(errors[m].worst_shadow, fabs(level));
            }
        }
    for (int m = 0; m < LOSSY_MODELS; m++) {
        errors[m].shadow = sqrt(errors[m].shadow / shadow);
        errors[m].everywhere = sqrt(errors[m].everywhere / all);
        errors[m].shadow_points = shadow;
        errors[m].points = all;
    }
}
