#include "accuracy.h"

#include "../tests/analytic/double_edge_forms.h"
#include "../tests/analytic/edge_end.h"
#include "../tests/analytic/lossy_errors.h"

static FILE *create(const char *folder, const char *name)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/accuracy-%s.csv", folder, name);
    FILE *f = fopen(path, "w");
    if (!f) fprintf(stderr, "keller-bench-accuracy: cannot create %s\n", path);
    return f;
}

static double level(double complex u) { return 20 * log10(cabs(u)); }

/* Around each wedge, plane wave, kr = 10: the table's exact level and this library's on finer angles. */
static bool field_curves(const char *folder, const char *truth)
{
    static const double sources[ACCURACY_WEDGES] = {45, 30, 30, 30}; /* degrees, of those in the tables */
    for (int i = 0; i < ACCURACY_WEDGES; i++) {
        const AccuracyWedge *wedge = &accuracy_wedges[i];
        char name[32];
        snprintf(name, sizeof name, "field-%d", (int)lround(360 - 180 * wedge->n));
        FILE *f = create(folder, name);
        if (!f) return false;
        fputs("phi_deg,kind,soft_dB,hard_dB\n", f);
        WedgeSetting w = {.kind = SOURCE_PLANE, .n = wedge->n, .k = 1, .rho = 10, .phi_in = sources[i] * M_PI / 180};
        for (int j = 0; j <= 720; j++) {
            double phi = j / 720.0 * wedge->n * M_PI;
            Scalars u = wedge_total(&w, phi);
            fprintf(f, "%.4f,0,%.4f,%.4f\n", phi * 180 / M_PI, level(u.soft), level(u.hard));
        }
        Table t;
        if (table_open_in(&t, truth, wedge->n == 2 ? "a_halfplane.csv" : "b_wedge_plane.csv"))
            while (table_next(&t)) {
                char text[16];
                if (wedge->n < 2 && strcmp(table_text(&t, "n", text, sizeof text), wedge->name) != 0) continue;
                if (table_number(&t, "kr") != 10 || table_number(&t, "phip_deg") != sources[i]) continue;
                fprintf(f, "%.4f,1,%.4f,%.4f\n", table_number(&t, "phi_deg"),
                        level(table_number(&t, "soft_re") + I * table_number(&t, "soft_im")),
                        level(table_number(&t, "hard_re") + I * table_number(&t, "hard_im")));
            }
        fclose(f);
    }
    return true;
}

/* A corner of concrete, the coefficients of the models and the exact one around it, source at 40 degrees. */
static bool lossy_curves(const char *folder)
{
    FILE *f = create(folder, "lossy");
    if (!f) return false;
    fputs("phi_deg,polarization,exact_dB,reciprocal_dB,luebbers_dB,holm_dB,reciprocal_error,luebbers_error,holm_error\n", f);
    double n = 1.5, phi_in = 40 * M_PI / 180;
    for (int across = 0; across < 2; across++) {
        for (int j = 1; j < 540; j++) {
            double phi = j * 0.5 * M_PI / 180;
            double complex eta = 5.24 - 0.632 * I, exact = lossy_exact(n, eta, across, phi_in, phi), d[LOSSY_MODELS];
            for (int m = 0; m < LOSSY_MODELS; m++) d[m] = lossy_coefficient((KellerWedgeModel)m, n, eta, across, phi_in, phi);
            fprintf(f, "%g,%d,%.4f,%.4f,%.4f,%.4f", j * 0.5, across, level(exact), level(d[0]), level(d[1]), level(d[2]));
            for (int m = 0; m < LOSSY_MODELS; m++) fprintf(f, ",%.4f", level(d[m] - exact));
            fputc('\n', f);
        }
        fputs("\n\n", f);
    }
    fclose(f);
    return true;
}

/* Two screens of one height over the line of sight, by the local Fresnel number of each: errors of loss. */
static bool edge_curves(const char *folder)
{
    static const double spacings[][3] = {{1000, 1000, 1000}, {5000, 200, 5000}};
    FILE *f = create(folder, "edges");
    if (!f) return false;
    fputs("nu,loss_dB,product_dB,slopes_dB\n", f);
    for (int s = 0; s < 2; s++) {
        double d1 = spacings[s][0], d2 = spacings[s][1], d3 = spacings[s][2], k = 1e6;
        for (int i = 0; i <= 120; i++) {
            /* both edges turn the path by alpha = nu sqrt(lambda/2L), at the height alpha d1 over the line as d1 = d3 */
            double nu = i * 0.05, alpha = nu * sqrt(M_PI / k * (1 / d1 + 1 / d2)), h = alpha * d1;
            double complex u = keller_double_edge(k, d1, d2, d3, h, h), plain, with;
            two_edges(k, d1, d2, d3, alpha, alpha, 1 / (1 / d2 + 1 / d3), &plain, &with);
            fprintf(f, "%g,%.5f,%.5f,%.5f\n", nu, -level(u), level(u) - level(plain), level(u) - level(with));
        }
        fputs("\n\n", f);
    }
    fclose(f);
    return true;
}

/* place, the program's wave, the exact one, and the error with and without the fade; a block an azimuth. */
static bool end_curves(const char *folder)
{
    FILE *f = create(folder, "end");
    if (!f) return false;
    for (int phi = 220; phi <= 300; phi += 80) {
        const EdgeEnd whole = edge_end_whole(phi * M_PI / 180);
        for (double place = -6; place < 6.05; place += 0.1) {
            EdgeEnd e = edge_end_at(place, phi * M_PI / 180, &whole);
            fprintf(f, "%.2f,%.6f,%.6f,%.6f,%.6f\n", place, cabs(e.program), cabs(e.exact), cabs(e.program - e.exact),
                    cabs((place > 0) - e.exact));
        }
        fprintf(f, "\n\n");
    }
    return fclose(f) == 0;
}

bool accuracy_curves(const char *folder, const char *truth)
{
    return field_curves(folder, truth) && lossy_curves(folder) && edge_curves(folder) && end_curves(folder);
}
