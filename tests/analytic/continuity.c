#include "continuity.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../stability/harness.h"
#include "../stability/scenes.h"
#include "keller/wave.h"

static const double degree = M_PI / 180, nearby = 40; /* m */

/* A line of receivers from a to b that crosses the boundary of one path: that of the kinds `watch` (R, D, T in order), all of
 * whose points are within `radius` of `focus`. Paths by way of the far ends of things, 300 m away, do not count: their boundaries,
 * of orders that are not asked for, lie where they like. */
typedef struct {
    const KellerScene *scene;
    KellerVec3 tx, a, b;
    uint32_t reflections, diffractions, transmissions;
    const char *watch;
    KellerVec3 focus;
    double radius;
} Line;

typedef struct {
    double complex t[4];
    size_t watched;
} Field;

static bool within(const Found *p, KellerVec3 centre, double radius)
{
    for (uint32_t i = 0; i < p->count; i++)
        if (v3_distance(p->position[i], centre) > radius) return false;
    return true;
}

static bool is_watched(const Line *l, const Found *p)
{
    if (p->count != strlen(l->watch) || !within(p, l->focus, l->radius)) return false;
    for (uint32_t i = 0; i < p->count; i++)
        if ("RDTS"[p->step[i].kind] != l->watch[i]) return false;
    return true;
}

static KellerVec3 at(const Line *l, double t) { return v3_madd(l->a, v3_sub(l->b, l->a), t); }

static Field field_at(const Line *l, double t)
{
    KellerVec3 rx = at(l, t);
    Run run = run_new(&l->tx, 1, &rx, l->reflections, l->diffractions, l->reflections + l->diffractions + l->transmissions);
    run.transmissions = l->transmissions;
    FoundPaths found = run_simulation(l->scene, &run);
    Field f = {0};
    for (size_t i = 0; i < found.count; i++) {
        if (!within(&found.path[i], v3(0, 0, 0), nearby)) continue;
        f.watched += is_watched(l, &found.path[i]);
        for (int k = 0; k < 4; k++) f.t[k] += found.path[i].transfer[0][k];
    }
    found_free(&found);
    return f;
}

/* The jump where the watched path comes or goes, over the free field. */
static double jump_on(const Line *l)
{
    const double hair = 3e-8; /* m: beyond what counts as on the boundary, 1e-9 rad, some 10 m away */
    double low = 0, high = 1, step = hair / v3_distance(l->a, l->b), jump = 0;
    size_t begin = field_at(l, 0).watched;
    if (field_at(l, 1).watched == begin) return NAN; /* nothing to cross */
    while (high - low > 0.01 * step) {
        double middle = 0.5 * (low + high);
        if (field_at(l, middle).watched == begin) low = middle;
        else high = middle;
    }
    /* the first change may be that to the boundary's own shares: both sides are some hairs away; twice the difference less the one
     * of twice the distance has no slope in it */
    Field f[4];
    double centre = 0.5 * (low + high);
    for (int i = 0; i < 4; i++) f[i] = field_at(l, centre + (i % 2 ? 2 : 1) * (i < 2 ? -1 : 1) * 3 * step);
    double wave = KELLER_LIGHT_SPEED / 3.5e9, free_field = wave / (4 * M_PI * v3_distance(l->tx, at(l, centre)));
    for (int k = 0; k < 4; k++) {
        double complex near = f[2].t[k] - f[0].t[k], far = f[3].t[k] - f[1].t[k];
        jump = fmax(jump, cabs(2 * near - far) / free_field);
    }
    return jump;
}

/* ---- scenes ------------------------------------------------------------------------------------------------------------ */

/* Around the z axis, azimuths in degrees. */
static KellerVec3 around(double r, double azimuth, double z) { return v3(r * cos(azimuth * degree), r * sin(azimuth * degree), z); }

static KellerScene finish(KellerSoup *soup)
{
    KellerScene scene = scene_of(soup);
    soup_release(soup);
    return scene;
}

/* Faces from the z axis at some azimuths, from z = -300 to `top`. */
static KellerScene fan(size_t count, const double azimuth[], uint32_t material, double thickness, double top)
{
    KellerSoup soup = soup_new();
    soup.materials[material].thickness = thickness;
    soup_object(&soup, "fan");
    for (size_t i = 0; i < count; i++)
        soup_quad(&soup, v3(0, 0, -300), around(400, azimuth[i], -300), around(400, azimuth[i], top), v3(0, 0, top), material);
    return finish(&soup);
}

/* The worst of two ways across the boundary between azimuths from and to: in a plane, and along a slanted line. */
static double across(const KellerScene *scene, double source, double from, double to, uint32_t reflections, uint32_t transmissions,
                     const char *watch)
{
    double worst = 0;
    for (int i = 0; i < 4; i++) {
        double slant = i % 2 ? 4 : 0, z = i / 2 ? 6 : 0.3;
        Line l = {scene, around(9, source, 0), around(12, from, z), around(12, to, z + slant), reflections, 1, transmissions, watch, {0, 0, 0}, nearby};
        double jump = jump_on(&l);
        if (!(jump <= worst)) worst = jump; /* NaN stays */
    }
    return worst;
}

static double fan_jump(size_t count, const double azimuth[], uint32_t material, double thickness, double source, double from,
                       double to, uint32_t reflections, uint32_t transmissions, const char *watch)
{
    KellerScene scene = fan(count, azimuth, material, thickness, 300);
    scene.transmissions = transmissions;
    double jump = across(&scene, source, from, to, reflections, transmissions, watch);
    keller_scene_free(&scene);
    return jump;
}

/* A screen below the edge from a to b. */
static void screen(KellerSoup *soup, KellerVec3 a, KellerVec3 b)
{
    KellerVec3 down = v3(0, 0, -400);
    soup_object(soup, "screen");
    soup_quad(soup, a, b, v3_add(b, down), v3_add(a, down), CONDUCTOR);
}

/* Two screens, the edge of the second one sloping by `slope`. The receiver sinks into the shadow of the second (the path over the first
 * ends), or, the line turned round, of the first. */
static double two_screens(double slope, bool turned)
{
    KellerSoup soup = soup_new();
    screen(&soup, v3(0, -300, 0), v3(0, 300, 0));
    screen(&soup, v3(6, -300, -300 * slope - 0.2), v3(6, 300, 300 * slope - 0.2));
    KellerScene scene = finish(&soup);
    KellerVec3 low = v3(-8, 1, -1.2), from = v3(15, -2, 1.4), to = v3(15, -2, -2.5);
    if (turned) low = v3(15, 1, -2.6), from = v3(-8, -2, 1.7), to = v3(-8, -2, -2);
    Line l = {&scene, low, from, to, 0, 2, 0, "D", {turned ? 6 : 0, 0, 0}, 5};
    double jump = jump_on(&l);
    keller_scene_free(&scene);
    return jump;
}

/* A screen and a plate behind it, in whose end the wave from the screen is reflected last. */
static double plate_behind(void)
{
    KellerSoup soup = soup_new();
    screen(&soup, v3(0, -300, 0), v3(0, 300, 0));
    soup_object(&soup, "plate");
    soup_quad(&soup, v3(8, -300, -6), v3(8, 300, -6), v3(3, 300, -6), v3(3, -300, -6), CONDUCTOR);
    KellerScene scene = finish(&soup);
    Line l = {&scene, v3(-8, 0.5, -1), v3(11, -1, -3), v3(20, -1, -3), 1, 2, 0, "DR", {0, 0, 0}, nearby};
    double jump = jump_on(&l);
    keller_scene_free(&scene);
    return jump;
}

/* Three screens: the path over the first two comes into the shadow of the third. */
static double three_screens(void)
{
    KellerSoup soup = soup_new();
    for (int i = 0; i < 3; i++) screen(&soup, v3(5 * i, -300, -0.1 * i * i), v3(5 * i, 300, -0.1 * i * i));
    KellerScene scene = finish(&soup);
    Line l = {&scene, v3(-6, 1, -2), v3(17, -2, 0.8), v3(17, -2, -2.5), 0, 3, 0, "DD", {2.5, 0, 0}, 5};
    double jump = jump_on(&l);
    keller_scene_free(&scene);
    return jump;
}

/* A thin box whose two edges count as one: another of its edges comes into the receiver's sight. */
static double thin_box(double source, double from, double to)
{
    KellerSoup soup = soup_new();
    soup_object(&soup, "plate");
    soup_box(&soup, v3(0, -0.02, -300), v3(400, 0, 300), CONDUCTOR, 0);
    KellerScene scene = finish(&soup);
    Line l = {&scene, around(9, source, 0), around(12, from, 0.3), around(12, to, 4), 1, 2, 0, "D", {0, 0, 0}, 5};
    double jump = jump_on(&l);
    keller_scene_free(&scene);
    return jump;
}

/* A screen that ends in z = 0: the point on its edge runs up to its upper end and over it. */
static double edge_end(void)
{
    static const double azimuth[] = {0};
    KellerScene scene = fan(1, azimuth, CONDUCTOR, 0, 0);
    Line l = {&scene, around(9, 80, -3), around(12, 290, -2), around(12, 290, 12), 0, 1, 0, "D", {0, 0, 0}, 5};
    double jump = jump_on(&l);
    keller_scene_free(&scene);
    return jump;
}

void continuity_measure(Jump jumps[CONTINUITY_KINDS])
{
    static const double plate[] = {0}, corner[] = {0, 270}, inner[] = {0, 120};
    const double smooth = 1e-6;
    Jump list[CONTINUITY_KINDS] = {
        {"shadow: conducting screen", fan_jump(1, plate, CONDUCTOR, 0, 70, 240, 260, 0, 0, ""), smooth},
        {"shadow: conducting corner", fan_jump(2, corner, CONDUCTOR, 0, 40, 210, 230, 0, 0, ""), smooth},
        {"shadow: concrete corner", fan_jump(2, corner, CONCRETE, 0, 40, 210, 230, 0, 0, ""), smooth},
        {"reflection: conducting corner", fan_jump(2, corner, CONDUCTOR, 0, 40, 130, 150, 1, 0, "R"), smooth},
        {"reflection: concrete corner", fan_jump(2, corner, CONCRETE, 0, 40, 130, 150, 1, 0, "R"), smooth},
        {"two reflections: conducting inner corner", fan_jump(2, inner, CONDUCTOR, 0, 100, 30, 50, 2, 0, "RR"), smooth},
        {"shadow of an edge behind an edge", two_screens(0, false), smooth},
        {"shadow of an edge behind an edge: sloping", fmax(two_screens(0.3, false), two_screens(0.3, true)), smooth},
        {"reflection behind an edge", plate_behind(), smooth},
        {"shadow of a third edge", three_screens(), smooth},
        {"shadow: concrete slab passed through", fan_jump(1, plate, CONCRETE, 0.05, 70, 240, 260, 1, 1, "T"), smooth},
        {"shadow: concrete house passed through", fan_jump(2, corner, CONCRETE, 0.05, 40, 210, 230, 0, 2, "TT"), smooth},
        {"end of an edge", edge_end(), smooth},
        {"second edge of a thin plate: behind it", thin_box(60, 260, 280), smooth},
        {"second edge of a thin plate: before it", thin_box(110, 100, 80), smooth},
    };
    memcpy(jumps, list, sizeof list);
}
