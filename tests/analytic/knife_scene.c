#include "knife_scene.h"

#include <math.h>
#include <stdlib.h>

#include "../stability/harness.h"
#include "../stability/scenes.h"
#include "keller/wave.h"

#define WIDE 20000.0 /* m */

static void screen(KellerSoup *soup, KellerVec3 top, double askew)
{
    double x = WIDE * tan(askew);
    soup_object(soup, "screen");
    soup_quad(soup, v3_add(top, v3(-x, -WIDE, 0)), v3_add(top, v3(x, WIDE, 0)), v3_add(top, v3(x, WIDE, -WIDE)),
              v3_add(top, v3(-x, -WIDE, -WIDE)), CONDUCTOR);
}

/* bend_1 = a h_1 - h_2/d_2, bend_2 = b h_2 - h_1/d_2 */
void knife_raise(Knife *g)
{
    const double *d = g->d;
    double a = 1 / d[0] + 1 / d[1], b = 1 / d[1] + 1 / d[2], det = (d[0] + d[1] + d[2]) / (d[0] * d[1] * d[2]);
    g->h[0] = (b * g->bend[0] + g->bend[1] / d[1]) / det;
    g->h[1] = (a * g->bend[1] + g->bend[0] / d[1]) / det;
}

Knife knife_of_row(const Table *t)
{
    const double flat = 0.05; /* rad */
    Knife g = {.d = {table_number(t, "d1"), table_number(t, "d2"), table_number(t, "d3")},
                  .bend = {table_number(t, "alpha1_rad"), table_number(t, "alpha2_rad")},
                  .frequency = table_number(t, "f_Hz") * KELLER_LIGHT_SPEED / table_number(t, "c")};
    double shrink = fmin(1, flat / fmax(fabs(g.bend[0]), fabs(g.bend[1])));
    g.frequency /= shrink * shrink;
    for (int i = 0; i < 2; i++) g.bend[i] *= shrink;
    knife_raise(&g);
    return g;
}

/* On the upper edge, not at the far ends of the screens. */
static bool on_top(KellerVec3 p, KellerVec3 top) { return hypot(p.x - top.x, p.z - top.z) < 1e-6 && fabs(p.y) < 0.5 * WIDE; }

double complex knife_total(const Knife *g, int paths[4])
{
    KellerVec3 tx = v3(-g->d[0], 0, 0), rx = v3(g->d[1] + g->d[2], g->along, 0);
    KellerVec3 top[2] = {v3(0, 0, g->h[0]), v3(g->d[1], 0, g->h[1])};
    KellerSoup soup = soup_new();
    for (int i = 0; i < 2; i++) screen(&soup, top[i], 0);
    KellerScene scene = scene_of(&soup);
    Run run = run_new(&tx, 1, &rx, 0, 2, 2);
    run.frequency[0] = g->frequency;
    FoundPaths found = run_simulation(&scene, &run);
    double complex sum = 0;
    for (size_t i = 0; i < found.count; i++) {
        const Found *p = &found.path[i];
        int kind = 0; /* direct, over the first, over the second, over both */
        bool upper = true;
        for (uint32_t j = 0; j < p->count; j++) {
            bool first = on_top(p->position[j], top[0]), second = on_top(p->position[j], top[1]);
            upper = upper && (first || second);
            kind += first ? 1 : 2;
        }
        if (!upper || (p->count == 2 && !on_top(p->position[0], top[0]))) continue;
        if (paths) paths[kind]++;
        sum += 0.5 * (p->transfer[0][0] - p->transfer[0][3]);
    }
    double length = v3_distance(tx, rx), k = 2 * M_PI * g->frequency / KELLER_LIGHT_SPEED;
    double complex free_space = KELLER_LIGHT_SPEED / g->frequency / (4 * M_PI * length) * cexp(-I * fmod(k * length, 2 * M_PI));
    found_free(&found);
    keller_scene_free(&scene);
    soup_release(&soup);
    return sum / free_space;
}

double complex knife_row(int edges, double spacing, double frequency, double askew, uint64_t *crowded)
{
    const double hair = 1e-8; /* rad */
    KellerVec3 tx = v3(0, 0, 0), rx = v3((edges + 1) * spacing, 0, 0);
    KellerSoup soup = soup_new();
    /* (2 h_i - h_(i-1) - h_(i+1))/spacing = hair */
    for (int i = 1; i <= edges; i++) screen(&soup, v3(i * spacing, 0, 0.5 * hair * spacing * i * (edges + 1 - i)), i % 2 ? 0 : askew);
    KellerScene scene = scene_of(&soup);
    Run run = run_new(&tx, 1, &rx, 0, (uint32_t)edges, (uint32_t)edges);
    run.frequency[0] = frequency;
    FoundPaths found = run_simulation(&scene, &run);
    double complex sum = 0;
    for (size_t i = 0; i < found.count; i++) {
        const Found *p = &found.path[i];
        bool upper = p->count == (uint32_t)edges;
        for (uint32_t j = 0; j < p->count; j++) upper = upper && v3_distance(p->position[j], v3((j + 1) * spacing, 0, 0)) < 1e-3;
        if (upper) sum += 0.5 * (p->transfer[0][0] - p->transfer[0][3]);
    }
    if (crowded) *crowded = found.work.crowded_paths;
    found_free(&found);
    keller_scene_free(&scene);
    soup_release(&soup);
    return sum * 4 * M_PI * v3_distance(tx, rx) * frequency / KELLER_LIGHT_SPEED;
}
