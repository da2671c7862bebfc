/* keller-bench-stability --examples: the smallest cases in which the listings fail by what they say, not by
 * rounding; all can be followed by hand. The cone's origin is 0, its axis z, its major axis x. */
#include "sweeps.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "../tests/stability/cone_oracle.h"

static KellerCone cone_of(double T, double x0, double e)
{
    return (KellerCone){.directrix = {0, 0, 1},
                        .major = {1, 0, 0},
                        .minor = {0, 1, 0},
                        .tan_alpha = T,
                        .x0 = x0,
                        .e = e,
                        .z_far = INFINITY};
}

static void put(double near, double far)
{
    char text[64];
    if (near > far)
        snprintf(text, sizeof text, "none");
    else
        snprintf(text, sizeof text, "[%.7g, %.7g]", near, far);
    printf(" %-24s", text);
}

static void line(const char *what, const KellerRange r[METHODS], ConeTruth truth)
{
    printf("%-66s", what);
    for (int m = 0; m < METHODS; m++) put(r[m].near, r[m].far);
    if (truth.met)
        put((double)truth.near, (double)truth.far);
    else
        put(1, 0);
    putchar('\n');
}

static void plane(const char *what, KellerCone c, KellerVec3 n, double offset, KellerRange clip)
{
    const KellerRange r[METHODS] = {listings_float.plane(&c, n, offset, clip),
                                    listings_double.plane(&c, n, offset, clip),
                                    keller_cone_plane(&c, n, offset, clip, NULL, NULL)};
    line(what, r, cone_oracle_quad.plane(&c, n, offset, clip, 0));
}

static void edge(const char *what, KellerCone c, KellerVec3 a, KellerVec3 b, KellerRange clip)
{
    const KellerRange r[METHODS] = {listings_float.edge(&c, a, b, clip), listings_double.edge(&c, a, b, clip),
                                    keller_cone_edge(&c, a, b, clip, NULL, NULL)};
    line(what, r, cone_oracle_quad.edge(&c, a, b, clip, 0));
}

static void triangle(const char *what, KellerCone c, const KellerVec3 v[3], KellerRange clip)
{
    const KellerRange r[METHODS] = {listings_float.triangle(&c, v[0], v[1], v[2], clip),
                                    listings_double.triangle(&c, v[0], v[1], v[2], clip),
                                    keller_cone_triangle(&c, v[0], v[1], v[2], clip, NULL, NULL)};
    line(what, r, cone_oracle_quad.triangle(&c, v[0], v[1], v[2], clip, 0));
}

static void box(const char *what, KellerCone c, KellerVec3 lower, KellerVec3 upper, KellerRange clip)
{
    const KellerRange r[METHODS] = {listings_float.box(&c, lower, upper, clip),
                                    listings_double.box(&c, lower, upper, clip),
                                    keller_cone_box(&c, lower, upper, clip, NULL, NULL)};
    line(what, r, cone_oracle_quad.box(&c, lower, upper, clip, 0));
}

/* The distance at which the first of eight equal boxes is entered. */
static void box8(const char *what, KellerCone c, const float lower[3], const float upper[3])
{
    const KellerRange all = {0, INFINITY};
    KellerBox8 b;
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 8; i++) {
            b.lower[k][i] = lower[k];
            b.upper[k][i] = upper[k];
        }
    KellerConeLanes lanes = keller_cone_lanes(&c, all, 100);
    _Alignas(32) float near[8];
    double distance[2][8];
    const uint32_t mask[METHODS] = {listings_float.box8(&c, &b, INFINITY, distance[0]),
                                    listings_double.box8(&c, &b, INFINITY, distance[1]),
                                    keller_cone_meets_box8(&lanes, &b, near)};
    KellerRange r[METHODS];
    for (int m = 0; m < METHODS; m++)
        r[m] = mask[m] & 1 ? (KellerRange){m == 2 ? (double)near[0] : distance[m][0], INFINITY} : (KellerRange){1, 0};
    ConeTruth truth = cone_oracle_quad.box(&c, v3((double)lower[0], (double)lower[1], (double)lower[2]),
                                           v3((double)upper[0], (double)upper[1], (double)upper[2]), all, 0);
    truth.far = INFINITY;
    line(what, r, truth);
}

void examples(void)
{
    const KellerRange all = {0, INFINITY};
    const KellerCone apex = cone_of(0.5, 0, 1), frustum = cone_of(0.5, 1, 1), cylinder = cone_of(0, 1, 1),
                     ray = cone_of(0, 0, 1);
    const KellerCone wide = cone_of(0.5, 0, 10);
    printf("%-66s %-24s %-24s %-24s %-24s\n", "", method_names[0], method_names[1], method_names[2], "truth");
    plane("listing 1: plane z = 3, nearly", apex, v3(1e-25, 1e-25, 1), 3, all);
    plane("listing 1: plane x = 1, apex cone (x0 = 0)", apex, v3(1, 0, 0), 1, all);
    plane("listing 1: the same plane, x0 = 1", frustum, v3(1, 0, 0), 3, all);
    plane("listing 1: plane x = 0 along a cylinder (T = 0)", cylinder, v3(1, 0, 0), 0, all);
    plane("listing 1: plane z = -3 behind an apex cone", apex, v3(0, 0, 1), -3, all);
    edge("listing 2: edge up, from behind the apex into the cone", frustum, v3(0.2, 0, -7), v3(0.2, 0, 5), all);
    edge("listing 2: the same edge, down", frustum, v3(0.2, 0, 5), v3(0.2, 0, -7), all);
    edge("listing 2: edge across (l_z = 0)", apex, v3(9, 0, 4), v3(-9, 0, 4), all);
    const KellerVec3 up[3] = {{0.2, 0.1, 5}, {0.2, 0.1, -7}, {0.2, 9, -7}};
    triangle("listing 4: triangle with such an edge", frustum, up, all);
    box("listing 3: box around a piece of the cone cut by near and far", frustum, v3(-9, -9, 1), v3(9, 9, 9),
        (KellerRange){3, 4});
    box("listing 3: the same, not cut", frustum, v3(-9, -9, 1), v3(9, 9, 9), all);
    box8("listing 5: ray in the plane of a box's face, first axis", ray, (float[3]){0, -1, 2}, (float[3]){1, 1, 3});
    box8("listing 5: the same, last axis, ray along x",
         (KellerCone){.directrix = {1, 0, 0}, .major = {0, 1, 0}, .minor = {0, 0, 1}, .e = 1, .z_far = INFINITY},
         (float[3]){2, -1, 0}, (float[3]){3, 1, 1});
    box8("listing 5: box beside a cone; it reaches far, and is near", apex, (float[3]){2.5f, -1, 0},
         (float[3]){4, 1, 6});
    box8("listing 5: box beside the flat side (e = 10)", wide, (float[3]){-1, 1, 1}, (float[3]){1, 2, 3});
}
