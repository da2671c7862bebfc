/* keller-bench-accuracy -- the fields of this library against exact solutions: the numbers and pictures of docs/accuracy.md.
 *
 * usage: keller-bench-accuracy [--csv] [--truth FOLDER] [--curves FOLDER] | [--csv] --transition
 *
 * The exact fields of conductors are tables (a_halfplane, b_wedge_plane, b_wedge_line, b_point3d, e_double_knife .csv) in FOLDER,
 * ../shared/truth if not given; without them only what is computed here is measured, and a line says so. Rows:
 *   conductor  a wedge, source, polarisation and k or kr: all angles of source and receiver together
 *   lossy      a wedge of a half-space's material against Maliuzhinets' exact impedance wedge, by model
 *   edges      two screens: the paths of this program, the product of coefficients, the product with slopes, and three
 *              constructions, by the smaller of the two local Fresnel numbers
 *   boundary   a kind of boundary of paths in a scene: the largest jump of the field on lines across it
 * and columns:
 *   max_dB, rms_dB  the error's size over the incident field's (lossy: over that of a field 1/sqrt(kr)), in dB; boundary: the
 *                   jump over the free field
 *   level_dB        conductor, lossy: the largest error of the level in the shadow; edges: of the loss
 *   theory_dB       conductor: the largest error of the table's own uniform theory, as max_dB
 * --transition prints instead what the transition function costs: x_from, x_to, ns a call by the Faddeeva function and as it is, their ratio,
 * and the largest relative difference.
 * --curves writes the curves behind the pictures (accuracy.h); tools/accuracy.sh draws them. Status 1 if a conductor's error is
 * larger than the theory's own or paths over two screens are off by 0.3 dB or the
 * field jumps, 2 on wrong usage. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../tests/analytic/continuity.h"
#include "../tests/analytic/double_edge_forms.h"
#include "../tests/analytic/knife_scene.h"
#include "../tests/analytic/lossy_errors.h"
#include "accuracy.h"

const AccuracyWedge accuracy_wedges[ACCURACY_WEDGES] = {
    {"2", "half-plane", 2}, {"5/3", "60 deg", 5.0 / 3}, {"3/2", "90 deg", 1.5}, {"4/3", "120 deg", 4.0 / 3}};

/* The table's own errors are from the same formula with other roundings. */
#define ROUNDING 1e-9

static bool csv;

static void print_row(const char *part, const char *wedge, const char *what, const char *polarization, const char *k,
                      int points, const double values[4])
{
    char cell[4][24];
    for (int i = 0; i < 4; i++) {
        cell[i][0] = '\0';
        if (!isnan(values[i])) snprintf(cell[i], sizeof cell[i], i == 2 ? "%.3f" : "%.1f", values[i]);
    }
    printf(csv ? "%s,%s,%s,%s,%s,%d,%s,%s,%s,%s\n" : "%-10s %-11s %-24s %-5s %7s %7d %8s %8s %9s %9s\n", part, wedge, what,
           polarization, k, points, cell[0], cell[1], cell[2], cell[3]);
}

static double decibels(double ratio) { return 20 * log10(ratio); }

/* ---- conductors --------------------------------------------------------------------------------------------------- */

WedgeSetting accuracy_setting(const Table *t, SourceKind kind, double n)
{
    WedgeSetting w = {.kind = kind, .n = n, .k = 1, .phi_in = table_number(t, "phip_deg") * M_PI / 180};
    if (kind == SOURCE_POINT) {
        w.k = table_number(t, "k");
        w.rho_in = table_number(t, "rhop");
        w.rho = table_number(t, "rho");
        w.z = table_number(t, "z");
    } else {
        w.rho = table_number(t, "kr");
        if (kind == SOURCE_LINE) w.rho_in = table_number(t, "krp");
    }
    return w;
}

typedef struct {
    double k, other; /* kr and kr', or k and z */
    int points, shadow;
    double max[2], square[2], level[2], theory[2];
} Cell;

static bool same_cell(const Cell *c, double k, double other) { return c->k == k && (c->other == other || isnan(other)); }

static void add_point(Cell *cell, const WedgeSetting *w, double phi, const Table *t, bool has_theory)
{
    static const char *const names[2][2] = {{"soft_re", "soft_im"}, {"hard_re", "hard_im"}};
    static const char *const own[2][2] = {{"utd_soft_re", "utd_soft_im"}, {"utd_hard_re", "utd_hard_im"}};
    Scalars total = wedge_total(w, phi);
    double complex u[2] = {total.soft, total.hard};
    bool dark = fabs(phi - w->phi_in) > M_PI + KELLER_BOUNDARY_ANGLE;
    double incident = wedge_incident(w);
    cell->points++;
    cell->shadow += dark;
    for (int i = 0; i < 2; i++) {
        double complex exact = table_number(t, names[i][0]) + I * table_number(t, names[i][1]);
        double error = cabs(u[i] - exact) / incident;
        cell->max[i] = fmax(cell->max[i], error);
        cell->square[i] += error * error;
        if (dark && cabs(exact) > 1e-6 * incident)
            cell->level[i] = fmax(cell->level[i], fabs(decibels(cabs(u[i]) / cabs(exact))));
        if (!has_theory) continue;
        double complex theory = table_number(t, own[i][0]) + I * table_number(t, own[i][1]);
        cell->theory[i] = fmax(cell->theory[i], cabs(theory - exact) / incident);
    }
}

/* One table and wedge; `source` says what the second column is. Returns whether an error is larger than the theory's own;
 * *found: whether there is such a table. */
static bool conductor(const char *truth, const char *table, SourceKind kind, const AccuracyWedge *wedge, bool *found)
{
    enum { CELLS = 64 };
    Cell cells[CELLS];
    int count = 0;
    Table t;
    if (!table_open_in(&t, truth, table)) return false;
    *found = true;
    bool halfplane = kind == SOURCE_PLANE && wedge->n == 2, has_theory = strstr(t.header, "utd_soft_re");
    while (table_next(&t)) {
        char name[16];
        if (!halfplane && strcmp(table_text(&t, "n", name, sizeof name), wedge->name) != 0) continue;
        WedgeSetting w = accuracy_setting(&t, kind, wedge->n);
        double k = kind == SOURCE_POINT ? w.k : w.rho, other = kind == SOURCE_POINT ? w.z : w.rho_in;
        int i = 0;
        while (i < count && !same_cell(&cells[i], k, other)) i++;
        if (i == CELLS) continue;
        if (i == count) cells[count++] = (Cell){.k = k, .other = other};
        add_point(&cells[i], &w, table_number(&t, "phi_deg") * M_PI / 180, &t, has_theory);
    }
    bool worse = false;
    for (int i = 0; i < count; i++)
        for (int hard = 0; hard < 2; hard++) {
            const Cell *c = &cells[i];
            char what[40], k[24];
            snprintf(what, sizeof what, kind == SOURCE_PLANE ? "plane" : kind == SOURCE_LINE ? "line kr'=%g" : "point z=%g m",
                     c->other);
            snprintf(k, sizeof k, "%g", c->k);
            double shadow = c->shadow ? c->level[hard] : NAN;
            double theory = has_theory ? decibels(c->theory[hard]) : NAN;
            print_row("conductor", wedge->text, what, hard ? "hard" : "soft", k, c->points,
                      (double[]){decibels(c->max[hard]), decibels(sqrt(c->square[hard] / c->points)), shadow, theory});
            /* at a half-plane the theory is exact; a cut of a table has no column of the theory's own */
            if (halfplane || has_theory) worse |= c->max[hard] > c->theory[hard] + ROUNDING;
        }
    return worse;
}

static bool conductors(const char *truth)
{
    bool worse = false, found = false;
    for (int i = 0; i < ACCURACY_WEDGES; i++) {
        const AccuracyWedge *w = &accuracy_wedges[i];
        worse |= conductor(truth, w->n == 2 ? "a_halfplane.csv" : "b_wedge_plane.csv", SOURCE_PLANE, w, &found);
        if (w->n < 2) worse |= conductor(truth, "b_wedge_line.csv", SOURCE_LINE, w, &found);
        worse |= conductor(truth, "b_point3d.csv", SOURCE_POINT, w, &found);
    }
    if (!found) fprintf(stderr, "keller-bench-accuracy: no tables of exact fields in %s; expected --truth FOLDER\n", truth);
    return worse;
}

/* ---- finite conductivity ------------------------------------------------------------------------------------------ */

static void lossy(void)
{
    static const struct {
        const char *name;
        double complex eta;
    } materials[] = {{"concrete", 5.24 - 0.632 * I}, {"wet ground", 30 - 3 * I}, {"1000-1000j", 1000 - 1000 * I}};
    static const char *const models[LOSSY_MODELS] = {"reciprocal", "luebbers", "holm"};
    for (int w = 1; w < ACCURACY_WEDGES; w++)
        for (int m = 0; m < 3; m++)
            for (int across = 0; across < 2; across++) {
                LossyErrors e[LOSSY_MODELS];
                lossy_errors(accuracy_wedges[w].n, materials[m].eta, across, e);
                for (int i = 0; i < LOSSY_MODELS; i++) {
                    char what[40];
                    snprintf(what, sizeof what, "%s %s", materials[m].name, models[i]);
                    print_row("lossy", accuracy_wedges[w].text, what, across ? "hard" : "soft", "", e[i].points,
                              (double[]){NAN, decibels(e[i].everywhere), e[i].worst_shadow, NAN});
                }
            }
}

/* ---- two edges ---------------------------------------------------------------------------------------------------- */

static bool edges(const char *truth)
{
    enum { FORMS = 6 };
    static const char *const forms[FORMS] = {"paths", "product", "product with slopes", "Epstein-Peterson", "Deygout", "Bullington"};
    static const double limits[] = {0, 0.5, 2, INFINITY};
    static const char *const ranges[] = {"nu 0 to 0.5", "nu 0.5 to 2", "nu from 2"};
    double worst[FORMS][3] = {{0}};
    int points[3] = {0};
    Table t;
    if (!table_open_in(&t, truth, "e_double_knife.csv")) return false;
    while (table_next(&t)) {
        /* the table is paraxial: angles a thousand times as small */
        double k = 2 * M_PI * table_number(&t, "f_Hz") / table_number(&t, "c"), exact = table_number(&t, "loss_exact_dB");
        double d1 = table_number(&t, "d1"), d2 = table_number(&t, "d2"), d3 = table_number(&t, "d3");
        double nu = fmin(table_number(&t, "nu1_local"), table_number(&t, "nu2_local"));
        double complex u[3];
        Knife knife = knife_of_row(&t);
        u[0] = knife_total(&knife, NULL);
        two_edges(1e6 * k, d1, d2, d3, 1e-3 * table_number(&t, "alpha1_rad"), 1e-3 * table_number(&t, "alpha2_rad"),
                  1 / (1 / d2 + 1 / d3), &u[1], &u[2]);
        int range = 0;
        while (nu >= limits[range + 1]) range++;
        points[range]++;
        double loss[FORMS] = {-decibels(cabs(u[0])), -decibels(cabs(u[1])), -decibels(cabs(u[2])),
                              table_number(&t, "loss_EpsteinPeterson_dB"), table_number(&t, "loss_Deygout_dB"),
                              table_number(&t, "loss_Bullington_dB")};
        for (int f = 0; f < FORMS; f++) worst[f][range] = fmax(worst[f][range], fabs(loss[f] - exact));
    }
    for (int f = 0; f < FORMS; f++)
        for (int r = 0; r < 3; r++)
            print_row("edges", forms[f], ranges[r], "", "", points[r], (double[]){NAN, NAN, worst[f][r], NAN});
    return worst[0][0] > 0.3 || worst[0][1] > 0.3 || worst[0][2] > 0.3;
}

/* ---- boundaries --------------------------------------------------------------------------------------------------- */

static bool boundaries(void)
{
    Jump jumps[CONTINUITY_KINDS];
    bool wrong = false;
    continuity_measure(jumps);
    for (int i = 0; i < CONTINUITY_KINDS; i++) {
        if (csv) print_row("boundary", "", jumps[i].kind, "", "", 1, (double[]){decibels(jumps[i].jump), NAN, NAN, NAN});
        else printf("%-10s %-58s %8.1f\n", "boundary", jumps[i].kind, decibels(jumps[i].jump));
        wrong |= !(jumps[i].jump < jumps[i].bound);
    }
    return wrong;
}

int main(int argc, char **argv)
{
    const char *truth = "../shared/truth", *curves = NULL;
    bool transition = false;
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--csv") == 0) {
            csv = true;
        } else if (strcmp(argv[i], "--truth") == 0 && i + 1 < argc) {
            truth = argv[++i];
        } else if (strcmp(argv[i], "--curves") == 0 && i + 1 < argc) {
            curves = argv[++i];
        } else if (strcmp(argv[i], "--transition") == 0) {
            transition = true;
        } else {
            fprintf(stderr,
                    "keller-bench-accuracy: \"%s\" is unknown or lacks its value; usage: keller-bench-accuracy [--csv] "
                    "[--truth FOLDER] [--curves FOLDER] | [--csv] --transition\n", argv[i]);
            return 2;
        }
    }
    if (transition) {
        accuracy_transition(csv);
        return 0;
    }
    if (csv)
        puts("part,wedge,case,polarization,k,points,max_dB,rms_dB,level_dB,theory_dB");
    else
        printf("%-10s %-11s %-24s %-5s %7s %7s %8s %8s %9s %9s\n", "part", "wedge", "case", "pol.", "k", "points", "max_dB",
               "rms_dB", "level_dB", "theory_dB");
    bool wrong = conductors(truth);
    lossy();
    wrong |= edges(truth);
    wrong |= boundaries();
    if (curves && !accuracy_curves(curves, truth)) return 1;
    return wrong;
}
