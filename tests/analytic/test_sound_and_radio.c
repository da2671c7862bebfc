/* Sound at rigid walls is radio at conductors with H along the edges: where everything happens in a plane across parallel edges, H obeys
 * the wave equation of the pressure with du/dn = 0. Both have one geometry and two implementations of the fields: one edge, two and
 * three in a row, in each other's transition zones, strips that count as one edge, edges that end. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "../stability/harness.h"
#include "../stability/scenes.h"
#include "keller/sound.h"

static const double speed = 343; /* m/s */

typedef struct {
    const char *name;
    void (*build)(KellerSoup *soup, double half); /* everything is 2 half wide along y */
    uint32_t reflections, diffractions;
} Case;

static void quad(KellerSoup *s, double half, double x0, double z0, double x1, double z1)
{
    soup_quad(s, v3(x0, -half, z0), v3(x0, half, z0), v3(x1, half, z1), v3(x1, -half, z1), CONDUCTOR);
}

static void one_screen(KellerSoup *s, double half) { quad(s, half, 0, -half, 0, 2); }

static void two_screens(KellerSoup *s, double half)
{
    quad(s, half, -1, -half, -1, 2);
    quad(s, half, 2, -half, 2, 2.05);
}

static void three_screens(KellerSoup *s, double half)
{
    two_screens(s, half);
    quad(s, half, 3, -half, 3, 1.9);
}

static void ridge(KellerSoup *s, double half)
{
    const KellerVec3 base[3] = {{-2, -half, 0}, {2.5, -half, 0}, {0.3, -half, 1.8}};
    soup_prism(s, 3, base, v3(0, 2 * half, 0), CONDUCTOR, 1u << 0);
    quad(s, half, -30, 0, -2, 0);
    quad(s, half, 2.5, 0, 30, 0);
}

static void thick_wall(KellerSoup *s, double half) { soup_box(s, v3(-0.1, -half, -half), v3(0.15, half, 2), CONDUCTOR, 1u << 4); }

static KellerScene build(const Case *c, double half, bool sound)
{
    KellerSoup soup = soup_new();
    soup_object(&soup, "scene");
    c->build(&soup, half);
    if (sound)
        for (uint32_t i = 0; i < MATERIAL_COUNT; i++)
            soup.materials[i] = (KellerMaterial){.name = soup.materials[i].name, .kind = KELLER_MATERIAL_RIGID};
    KellerScene scene = scene_of(&soup);
    soup_release(&soup);
    if (sound) scene.sound.speed = speed;
    return scene;
}

/* Paths by the far ends of things leave the plane; the rest do not. */
static bool in_plane(const Found *p)
{
    for (uint32_t i = 0; i < p->count; i++)
        if (fabs(p->position[i].y) > 1e-9 || hypot(p->position[i].x, p->position[i].z) > 60) return false;
    return true;
}

static void sound_is_radio(void **state)
{
    const Case *c = *state;
    double worst = 0, halves[2] = {200, 1.1};
    size_t paths = 0, longest = 0;
    for (int h = 0; h < 2; h++) {
        KellerScene scenes[2] = {build(c, halves[h], false), build(c, halves[h], true)};
        for (int i = 0; i < (c->diffractions > 2 ? 5 : 14); i++) {
            KellerVec3 tx = v3(-5 - 0.3 * i, 0, 0.4 + 0.2 * i), rx = v3(6 + 0.4 * i, 0, 3 - 0.19 * i);
            FoundPaths found[2];
            for (int s = 0; s < 2; s++) {
                Run run = run_new(&tx, 1, &rx, c->reflections, c->diffractions, c->reflections + c->diffractions);
                run.frequency_count = 2;
                for (int f = 0; f < 2; f++) run.frequency[f] = (f ? 1700 : 170) * (s ? 1 : KELLER_LIGHT_SPEED / speed);
                found[s] = run_simulation(&scenes[s], &run);
            }
            assert_int_equal(found[0].count, found[1].count);
            for (size_t p = 0; p < found[0].count; p++) {
                const Found *radio = &found[0].path[p], *sound = &found[1].path[p];
                if (!in_plane(radio)) continue;
                for (int f = 0; f < 2; f++) {
                    double lambda = speed / (f ? 1700 : 170);
                    /* E along theta-hat is H along phi-hat, which is y or -y as the ray runs towards x or -x */
                    double turned = cos(radio->departure[1]) * -cos(radio->arrival[1]) > 0 ? 1 : -1;
                    double complex expected = turned * radio->transfer[f][0] * 4 * M_PI / lambda;
                    worst = fmax(worst, cabs(sound->gain[f] - expected) * radio->length);
                }
                paths++;
                longest = radio->count > longest ? radio->count : longest;
            }
            for (int s = 0; s < 2; s++) found_free(&found[s]);
        }
        for (int s = 0; s < 2; s++) keller_scene_free(&scenes[s]);
    }
    printf("# %s: %zu paths of up to %zu steps, off by %.2g of the free field\n", c->name, paths, longest, worst);
    assert_true(paths > 20);
    assert_true(longest >= c->diffractions);
    assert_true(worst < 1e-10);
}

int main(void)
{
    static const Case cases[] = {{"one screen", one_screen, 0, 1}, {"two screens", two_screens, 0, 2},
                                 {"three screens", three_screens, 0, 3}, {"ridge on the ground", ridge, 2, 1},
                                 {"thick wall", thick_wall, 0, 2}};
    struct CMUnitTest tests[5];
    for (int i = 0; i < 5; i++) tests[i] = (struct CMUnitTest){cases[i].name, sound_is_radio, NULL, NULL, (void *)(uintptr_t)&cases[i]};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
