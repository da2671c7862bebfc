/* A rectangular room, path by path, against mirror images written out here.
 *
 * Along an axis of length L the images of x are numbered i: at iL + x for even i, (i + 1)L - x for odd i, behind |i|
 * reflections: those in the wall x = L and those in x = 0 alternate, the last one (nearest to the receiver) in x = L for i > 0.
 * A path to image (i, j, k) meets all walls of an axis at the same angle, whose cosine is the image's distance along
 * that axis over the whole. Images of up to N reflections: (2N + 1)(2N^2 + 2N + 3)/3. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "../stability/harness.h"
#include "../stability/scenes.h"
#include "keller/sound.h"

enum { ORDER = 6, IMAGES = (2 * ORDER + 1) * (2 * ORDER * ORDER + 2 * ORDER + 3) / 3 };

static const double size[3] = {5.1, 3.7, 2.9};
static const KellerVec3 source = {1.3, 2.2, 1.1}, receiver = {4.2, 0.9, 1.75};

/* Materials are those of the soup, by index; wall w of axis a is 2 a + w, and there are five: two walls share one. */
static const uint32_t wall_material[6] = {CONCRETE, CONDUCTOR, DRY_GROUND, PARTITION, GLASS, CONDUCTOR};

typedef enum { RIGID, IMPEDANCE, MIXED } Walls;

static KellerMaterial material(Walls walls, uint32_t which)
{
    static const double impedance[MATERIAL_COUNT][2] = {{7.5, -2.1}, {30, -10}, {12, -8}, {3.2, 1.4}, {1.7, -0.3}};
    KellerMaterial m = {.kind = KELLER_MATERIAL_RIGID};
    if (walls == RIGID || (walls == MIXED && which == GLASS)) return m;
    m.kind = walls == MIXED && which % 2 ? KELLER_MATERIAL_ABSORPTION : KELLER_MATERIAL_IMPEDANCE;
    m.band_count = 1;
    m.band[0] = 1000;
    m.surface[0][0] = impedance[which][0] / (m.kind == KELLER_MATERIAL_ABSORPTION ? 40 : 1);
    m.surface[0][1] = m.kind == KELLER_MATERIAL_ABSORPTION ? 0 : impedance[which][1];
    m.scattering = walls == MIXED ? 0.1 : 0;
    return m;
}

static KellerScene room(Walls walls)
{
    KellerSoup soup = soup_new();
    soup_object(&soup, "room");
    for (int axis = 0; axis < 3; axis++)
        for (int wall = 0; wall < 2; wall++) {
            double corner[4][3];
            int u = (axis + 1) % 3, v = (axis + 2) % 3;
            for (int c = 0; c < 4; c++) {
                corner[c][axis] = wall * size[axis];
                corner[c][u] = c == 1 || c == 2 ? size[u] : 0;
                corner[c][v] = c >= 2 ? size[v] : 0;
            }
            soup_quad(&soup, v3(corner[0][0], corner[0][1], corner[0][2]), v3(corner[1][0], corner[1][1], corner[1][2]),
                      v3(corner[2][0], corner[2][1], corner[2][2]), v3(corner[3][0], corner[3][1], corner[3][2]),
                      wall_material[2 * axis + wall]);
        }
    for (uint32_t i = 0; i < MATERIAL_COUNT; i++) {
        char *name = soup.materials[i].name;
        soup.materials[i] = material(walls, i);
        soup.materials[i].name = name;
    }
    KellerScene scene = scene_of(&soup);
    soup_release(&soup);
    scene.sound = (KellerSound){.speed = keller_sound_speed(293.15, 101325, 0.5), .absorbs = walls == MIXED,
                                .temperature = 293.15,
                                .pressure = 101325, .humidity = 0.5};
    return scene;
}

typedef struct {
    int reflections;
    long double length, direction[3]; /* of arrival: from the receiver to the image */
    long double complex pressure;
} Image;

static double image_along(int axis, double x, int i) { return i % 2 == 0 ? i * size[axis] + x : (i + 1) * size[axis] - x; }

static Image image(const KellerScene *scene, Walls walls, const int index[3], double frequency)
{
    const double s[3] = {source.x, source.y, source.z}, r[3] = {receiver.x, receiver.y, receiver.z};
    Image result = {.pressure = 1};
    long double d[3], sum = 0;
    for (int a = 0; a < 3; a++) {
        d[a] = (long double)image_along(a, s[a], index[a]) - r[a];
        sum += d[a] * d[a];
    }
    result.length = sqrtl(sum);
    for (int a = 0; a < 3; a++) {
        result.direction[a] = d[a] / result.length;
        int count = abs(index[a]), last = (count + 1) / 2, other = count / 2;
        result.reflections += count;
        for (int w = 0; w < 2; w++) {
            KellerMaterial m = material(walls, wall_material[2 * a + w]);
            long double complex factor = sqrtl(1 - (long double)m.scattering);
            if (m.kind == KELLER_MATERIAL_ABSORPTION) factor *= sqrtl(1 - (long double)m.surface[0][0]);
            if (m.kind == KELLER_MATERIAL_IMPEDANCE) {
                long double complex zc = (m.surface[0][0] + (long double complex)I * m.surface[0][1]) * fabsl(result.direction[a]);
                factor *= (zc - 1) / (zc + 1);
            }
            int times = (w == 1) == (index[a] > 0) ? last : other;
            for (int k = 0; k < times; k++) result.pressure *= factor;
        }
    }
    long double k = 2 * acosl(-1) * frequency / scene->sound.speed;
    result.pressure *= powl(10, -(long double)keller_sound_loss(&scene->sound, frequency) * result.length / 20);
    result.pressure *= cexpl(-I * k * result.length) / result.length;
    return result;
}

static void images_one_to_one(void **state)
{
    Walls walls = (Walls)(uintptr_t)*state;
    KellerScene scene = room(walls);
    Run run = run_new(&source, 1, &receiver, ORDER, 1, ORDER); /* a room without edges that diffract */
    run.frequency_count = 2;
    run.frequency[0] = 125;
    run.frequency[1] = 3150;
    FoundPaths found = run_simulation(&scene, &run);
    assert_int_equal(found.count, IMAGES);
    for (int f = 0; f < 2; f++) {
        bool taken[IMAGES] = {false};
        long double complex sum = 0;
        long double scale = 0;
        int count = 0, index[3];
        for (index[0] = -ORDER; index[0] <= ORDER; index[0]++)
            for (index[1] = -ORDER; index[1] <= ORDER; index[1]++)
                for (index[2] = -ORDER; index[2] <= ORDER; index[2]++) {
                    if (abs(index[0]) + abs(index[1]) + abs(index[2]) > ORDER) continue;
                    Image expected = image(&scene, walls, index, run.frequency[f]);
                    int matches = 0;
                    for (size_t i = 0; i < found.count; i++) {
                        const Found *p = &found.path[i];
                        double z = p->arrival[0], a = p->arrival[1];
                        KellerVec3 from = v3(sin(z) * cos(a), sin(z) * sin(a), cos(z));
                        KellerVec3 to = v3((double)expected.direction[0], (double)expected.direction[1],
                                           (double)expected.direction[2]);
                        if (fabsl(p->length - expected.length) > 1e-9L || v3_distance(from, to) > 1e-9) continue;
                        matches++;
                        assert_false(taken[i]);
                        taken[i] = true;
                        assert_int_equal(p->count, expected.reflections);
                        assert_true(fabs(p->delay - p->length / scene.sound.speed) < 1e-15);
                        assert_true(cabsl(p->gain[f] - expected.pressure) <= 1e-10L * cabsl(expected.pressure));
                    }
                    assert_int_equal(matches, 1);
                    sum += expected.pressure;
                    scale += cabsl(expected.pressure) * cabsl(expected.pressure);
                    count++;
                }
        assert_int_equal(count, IMAGES);
        long double off = cabsl(found_total(&found, 0, (size_t)f) - sum) / sqrtl(scale);
        printf("# %g Hz: the response is off by %.2Lg of its rms\n", run.frequency[f], off);
        assert_true(off <= 1e-9L);
    }
    found_free(&found);
    keller_scene_free(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        {"rigid", images_one_to_one, NULL, NULL, (void *)(uintptr_t)RIGID},
        {"impedance", images_one_to_one, NULL, NULL, (void *)(uintptr_t)IMPEDANCE},
        {"mixed_with_air_and_scattering", images_one_to_one, NULL, NULL, (void *)(uintptr_t)MIXED},
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
