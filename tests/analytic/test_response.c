/* Impulse responses: delays in the sound file, the spectrum against the paths' own, decays against closed forms, Sabine and Eyring. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>
#include <sndfile.h>

#include "../stability/harness.h"
#include "../stability/scenes.h"
#include "io/wav.h"
#include "keller/response.h"
#include "keller/sound.h"

static KellerScene sound_scene(KellerSoup *soup, KellerMaterial all)
{
    for (uint32_t i = 0; i < MATERIAL_COUNT; i++) {
        char *name = soup->materials[i].name;
        soup->materials[i] = all;
        soup->materials[i].name = name;
    }
    KellerScene scene = scene_of(soup);
    soup_release(soup);
    scene.sound = (KellerSound){.speed = 343, .temperature = 293.15, .pressure = 101325, .humidity = 0.5};
    return scene;
}

static KellerStatus keep_response(void *context, const KellerResponse *response, KellerError *error)
{
    KellerResponse *kept = context;
    (void)error;
    size_t bytes = response->count * sizeof *kept->pressure;
    *kept = *response;
    kept->pressure = malloc(bytes);
    kept->tail = response->tail ? malloc(bytes) : NULL;
    if (!kept->pressure || (response->tail && !kept->tail)) abort();
    memcpy(kept->pressure, response->pressure, bytes);
    if (response->tail) memcpy(kept->tail, response->tail, bytes);
    return KELLER_OK;
}

static KellerResponse respond(const KellerScene *scene, KellerVec3 tx, KellerVec3 rx, uint32_t reflections,
                              uint32_t diffractions,
                              double rate, double duration, double volume)
{
    char id[] = "x";
    double frequency = 1000;
    KellerTransmitter t = {.id = id, .station = {.position = tx}};
    KellerReceiver r = {.station = {.position = rx}};
    KellerReceiverSet set = {.id = id, .kind = KELLER_SET_POINT, .count = 1};
    KellerConfig config = {.frequency_count = 1, .frequencies = &frequency, .transmitter_count = 1, .transmitters = &t,
                           .set_count = 1,
                           .sets = &set, .receiver_count = 1, .receivers = &r, .reflections = reflections, .diffractions = diffractions,
                           .interactions = reflections + diffractions, .dynamic_range = 1e4, .accelerator = "auto", .cone = M_PI / 90,
                           .threads = 1, .sound = scene->sound, .response_rate = rate, .response_duration = duration,
                           .response_volume = volume};
    KellerAccel *accel = NULL;
    KellerError error = {0};
    KellerSimulationWork work;
    KellerResponse response = {0};
    KellerSink sink = {.context = &response, .response = keep_response};
    assert_int_equal(keller_accel_build("auto", scene, &accel, &error), KELLER_OK);
    assert_int_equal(keller_simulate(&config, scene, accel, &sink, &work, &error), KELLER_OK);
    keller_accel_free(accel);
    assert_non_null(response.pressure);
    return response;
}

/* ---- delays -------------------------------------------------------------------------------------------------------------- */

/* The band-limited signal at a time in samples: Whittaker's sum over what is near. */
static double at_time(size_t count, const float *samples, double t)
{
    double sum = 0;
    for (long i = (long)t - 400; i <= (long)t + 400; i++) {
        double x = M_PI * (t - (double)i);
        if (i >= 0 && i < (long)count) sum += samples[i] * (fabs(x) < 1e-9 ? 1 : sin(x) / x);
    }
    return sum;
}

/* A source over a floor and before a wall, rigid: four paths, milliseconds apart. Each shows in the file as a peak of its amplitude at
 * its delay, to 1/100 sample, whatever part of a sample that is; the others' tails are removed first. */
static void delays_in_the_file(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "floor");
    soup_quad(&soup, v3(0, -50, 0), v3(99, -50, 0), v3(99, 50, 0), v3(0, 50, 0), CONCRETE);
    soup_quad(&soup, v3(0, -50, 0), v3(0, 50, 0), v3(0, 50, 50), v3(0, -50, 50), CONCRETE);
    KellerScene scene = sound_scene(&soup, (KellerMaterial){.kind = KELLER_MATERIAL_RIGID});
    KellerVec3 tx = v3(3.3, 0.2, 2.7), rx = v3(9.123, 4.4, 1.9);
    KellerResponse response = respond(&scene, tx, rx, 2, 0, 44100, 0.1, 0);
    char folder[] = "/tmp/keller-test-XXXXXX", file[64];
    assert_non_null(mkdtemp(folder));
    snprintf(file, sizeof file, "%s/r.wav", folder);
    double scale = 0;
    KellerError error;
    assert_int_equal(keller_wav_write(file, file, response.count, response.pressure, response.rate, &scale, &error), KELLER_OK);
    assert_true(scale == 1);

    SF_INFO info = {0};
    SNDFILE *wav = sf_open(file, SFM_READ, &info);
    assert_non_null(wav);
    assert_int_equal(info.samplerate, 44100);
    assert_int_equal(info.channels, 1);
    assert_int_equal(info.frames, 4410);
    float samples[4410];
    assert_int_equal(sf_read_float(wav, samples, 4410), 4410);
    sf_close(wav);
    unlink(file);
    rmdir(folder);

    double delay[4], amplitude[4];
    for (int i = 0; i < 4; i++) {
        KellerVec3 image = v3(i & 1 ? -tx.x : tx.x, tx.y, i & 2 ? -tx.z : tx.z);
        delay[i] = v3_distance(image, rx) / 343 * 44100;
        amplitude[i] = 1 / v3_distance(image, rx);
    }
    for (int i = 0; i < 4; i++) {
        float alone[4410];
        for (int n = 0; n < 4410; n++) {
            double others = 0;
            for (int j = 0; j < 4; j++) {
                double x = M_PI * (n - delay[j]);
                if (j != i) others += amplitude[j] * (fabs(x) < 1e-9 ? 1 : sin(x) / x);
            }
            alone[n] = (float)(samples[n] - others);
            assert_true(fabsf(samples[n]) <= 1);
        }
        double before = at_time(4410, alone, delay[i] - 0.1), here = at_time(4410, alone, delay[i]);
        double after = at_time(4410, alone, delay[i] + 0.1);
        double peak = 0.05 * (before - after) / (before - 2 * here + after); /* of the parabola, in samples from the delay */
        assert_true(fabs(peak) < 0.01);
        assert_true(fabs(here - amplitude[i]) < 1e-3 * amplitude[i]);
    }
    assert_true(fabs(response.arrival * 44100 - delay[0]) < 1e-6);
    /* louder than 1: nothing clips, and the factor is told */
    float loud[3] = {0.5f, -4, 1};
    assert_non_null(mkdtemp(strcpy(folder, "/tmp/keller-test-XXXXXX")));
    snprintf(file, sizeof file, "%s/r.wav", folder);
    assert_int_equal(keller_wav_write(file, file, 3, loud, 48000, &scale, &error), KELLER_OK);
    wav = sf_open(file, SFM_READ, &(SF_INFO){0});
    assert_int_equal(sf_read_float(wav, loud, 3), 3);
    sf_close(wav);
    unlink(file);
    rmdir(folder);
    assert_true(loud[1] < -0.999 && loud[1] > -1 && fabs(loud[0] - 0.5 * scale) < 1e-6);
    free(response.pressure);
    keller_scene_free(&scene);
}

/* ---- spectrum -------------------------------------------------------------------------------------------------------------- */

/* A screen on a floor, wide where the uniform theory would fade out towards its ends, which is a filter that knows no time (half of it comes
 * before the path); air that absorbs: the transform of the response at a bin is the sum of the paths' gains at its frequency, with
 * either method of diffraction. What is left is the interpolation over frequency, and what the response leaves out after its end. */
static void spectrum_is_that_of_the_paths(void **state)
{
    KellerEdgeMethod edges = (KellerEdgeMethod)(uintptr_t)*state;
    double half = edges == KELLER_EDGES_BTM ? 5 : 45; /* m */
    KellerSoup soup = soup_new();
    soup_object(&soup, "floor");
    soup_quad(&soup, v3(-60, -60, 0), v3(60, -60, 0), v3(60, 60, 0), v3(-60, 60, 0), CONCRETE);
    soup_quad(&soup, v3(0, -half, 0), v3(0, half, 0), v3(0, half, 2.5), v3(0, -half, 2.5), CONCRETE);
    KellerScene scene = sound_scene(&soup, (KellerMaterial){.kind = KELLER_MATERIAL_RIGID});
    scene.sound.absorbs = true;
    scene.sound.edges = edges;
    KellerVec3 tx = v3(-6, 0.3, 1), rx = v3(5, -0.7, 1.4);
    enum { RATE = 16000 };
    KellerResponse response = respond(&scene, tx, rx, 1, 1, RATE, 0.5, 0);
    for (int octave = 0; octave < 6; octave++) {
        double frequency = 110 * pow(2, octave), w = 2 * M_PI * frequency / RATE;
        Run run = run_new(&tx, 1, &rx, 1, 1, 2);
        run.frequency[0] = frequency;
        FoundPaths found = run_simulation(&scene, &run);
        double complex sum = found_total(&found, 0, 0), transform = 0;
        double scale = 0;
        for (size_t i = 0; i < found.count; i++) scale += cabs(found.path[i].gain[0]);
        for (size_t n = 0; n < response.count; n++) transform += response.pressure[n] * cexp(-I * w * (double)n);
        printf("# %g Hz, %zu paths: off by %.2g of their amplitudes\n", frequency, found.count, cabs(transform - sum) / scale);
        assert_true(found.count >= 4);
        assert_true(cabs(transform - sum) < 5e-4 * scale);
        found_free(&found);
    }
    free(response.pressure);
    keller_scene_free(&scene);
}

/* ---- decays ----------------------------------------------------------------------------------------------------------------- */

/* Energy e^{-at}, a = ln(10^6)/T: all times are T, the energy before t is 1 - e^{-at} of all. */
static void exponential_decay(void **state)
{
    (void)state;
    enum { COUNT = 200000 };
    double rate = 48000, T = 0.8, a = log(1e6) / T;
    double *energy = malloc(COUNT * sizeof *energy);
    assert_non_null(energy);
    for (int i = 0; i < COUNT; i++) energy[i] = exp(-a * i / rate);
    KellerRoom room = keller_room_of_energy(COUNT, energy, rate, 1);
    assert_true(fabs(room.edt - T) < 1e-3 * T && fabs(room.t20 - T) < 1e-3 * T && fabs(room.t30 - T) < 1e-3 * T);
    assert_true(fabs(room.c80 - 10 * log10(exp(a * 0.08) - 1)) < 1e-6);
    assert_true(fabs(room.c50 - 10 * log10(exp(a * 0.05) - 1)) < 1e-6);
    assert_true(fabs(room.d50 - (1 - exp(-a * 0.05))) < 1e-6);
    assert_true(fabs(room.g - 10 * log10(1 / (1 - exp(-a / rate)))) < 1e-6);
    /* a response that ends before it has fallen has no reverberation time to tell */
    room = keller_room_of_energy((size_t)1, energy, rate, 1);
    assert_true(isnan(room.t30) && isnan(room.edt));
    free(energy);
    /* one that ends before: what it lacks bends the decay */
    double *cut = malloc(COUNT * sizeof *cut);
    assert_non_null(cut);
    for (int i = 0; i < COUNT; i++) cut[i] = exp(-a * i / rate);
    room = keller_room_of_energy(4800, cut, rate, 1); /* 0.1 s: 8 dB */
    assert_true(isnan(room.edt) && isnan(room.t20) && isnan(room.t30));
    room = keller_room_of_energy(24000, cut, rate, 1); /* 0.5 s: 38 dB */
    assert_true(fabs(room.t20 - T) < 0.02 * T && isnan(room.t30));
    /* two slopes: each time is that of its own part of the decay. By linear regression in another program */
    for (int i = 0; i < 96000; i++) cut[i] = exp(-log(1e6) * i / rate / 0.4) + 0.01 * exp(-log(1e6) * i / rate / 1.6);
    room = keller_room_of_energy(96000, cut, rate, 1);
    assert_true(fabs(room.edt - 0.43189) < 1e-4 && fabs(room.t20 - 0.79981) < 1e-4 && fabs(room.t30 - 1.20282) < 1e-4);
    free(cut);
    /* one impulse of 0.1, as in a free field at 10 m: G = 0 dB in every band, all of it early */
    float impulse[24000] = {0};
    impulse[100] = 0.1f;
    KellerResponse response = {.rate = 48000, .arrival = 100.0 / 48000, .count = 24000, .pressure = impulse};
    double middle[KELLER_ROOM_BANDS];
    KellerRoom rooms[KELLER_ROOM_BANDS];
    size_t bands = keller_room_bands(48000, middle);
    assert_int_equal(bands, 8);
    assert_int_equal(keller_room_bands(16000, middle), 7);
    keller_room_bands(48000, middle);
    assert_true(keller_room(&response, bands, middle, rooms));
    for (size_t b = 0; b < bands; b++) assert_true(fabs(rooms[b].g) < 0.01 && rooms[b].d50 > 0.999);
}

/* A room of 5.2 m x 4.7 m x 4.1 m, all walls alike: the energies of all images to an order that reaches -40 dB, one by one. Sabine's time
 * 0.161 V/(alpha S) is above Eyring's 0.161 V/(-S ln(1 - alpha)); the decay of mirror images in a box is not that of a diffuse
 * field, being slower where rays run along one axis: between Eyring's and, within 15 %, Sabine's. */
static void sabine_and_eyring(void **state)
{
    (void)state;
    enum { RATE = 8000, COUNT = 4000 };
    double X = 5.2, Y = 4.7, Z = 4.1, volume = X * Y * Z, surface = 2 * (X * Y + Y * Z + Z * X);
    static const double alphas[] = {0.4, 0.6};
    for (int i = 0; i < 2; i++) {
        KellerSoup soup = soup_new();
        soup_object(&soup, "room");
        soup_box(&soup, v3(0, 0, 0), v3(X, Y, Z), CONCRETE, 0);
        KellerMaterial m = {.kind = KELLER_MATERIAL_ABSORPTION, .band_count = 1, .band = {1000}, .surface = {{alphas[i]}}};
        KellerScene scene = sound_scene(&soup, m);
        uint32_t order = i == 0 ? 12 : 9;
        KellerVec3 tx = v3(1.7, 1.4, 1.2), rx = v3(3.6, 3.5, 2.4);
        Run run = run_new(&tx, 1, &rx, order, 0, order);
        FoundPaths found = run_simulation(&scene, &run);
        double energy[COUNT] = {0}, first = INFINITY;
        for (size_t p = 0; p < found.count; p++) first = fmin(first, found.path[p].delay);
        for (size_t p = 0; p < found.count; p++) {
            size_t at = (size_t)((found.path[p].delay - first) * RATE);
            if (at < COUNT) energy[at] += pow(cabs(found.path[p].gain[0]), 2);
        }
        KellerRoom room = keller_room_of_energy(COUNT, energy, RATE, 1);
        double sabine = 24 * log(10) / 343 * volume / (alphas[i] * surface), eyring = sabine * alphas[i] / -log(1 - alphas[i]);
        printf("# alpha %g: %zu paths, T20 %.3f s, Sabine %.3f s, Eyring %.3f s\n", alphas[i], found.count, room.t20,
               sabine, eyring);
        assert_true(room.t20 > 0.95 * eyring && room.t20 < 1.15 * sabine);
        found_free(&found);
        keller_scene_free(&scene);
    }
}

/* A room of 8.2 m x 6.1 m x 3.3 m with absorption 0.15 and scattering 0.3, images to order 4: alone they end too early; with the tail the
 * times are Eyring's, the energy is that of the direct sound and the diffuse field, 1/r^2 + 4 pi c/(V delta), and what was added
 * is told apart. */
static void tail_completes(void **state)
{
    (void)state;
    double X = 8.2, Y = 6.1, Z = 3.3, V = X * Y * Z, S = 2 * (X * Y + Y * Z + Z * X), alpha = 0.15;
    KellerSoup soup = soup_new();
    soup_object(&soup, "room");
    soup_box(&soup, v3(0, 0, 0), v3(X, Y, Z), CONCRETE, 0);
    KellerMaterial m = {.kind = KELLER_MATERIAL_ABSORPTION, .band_count = 1, .band = {1000}, .surface = {{alpha}},
                        .scattering = 0.3};
    KellerScene scene = sound_scene(&soup, m);
    KellerVec3 tx = v3(2.1, 1.7, 1.2), rx = v3(6.3, 4.1, 1.6);
    KellerResponse without = respond(&scene, tx, rx, 4, 0, 24000, 1.6, 0), with = respond(&scene, tx, rx, 4, 0, 24000, 1.6, V);
    KellerResponse again = respond(&scene, tx, rx, 4, 0, 24000, 1.6, V);
    assert_null(without.tail);
    for (size_t i = 0; i < with.count; i++) {
        assert_true(fabsf(with.pressure[i] - with.tail[i] - without.pressure[i]) < 1e-6f);
        assert_true(with.pressure[i] == again.pressure[i]);
        assert_true((double)i / with.rate >= with.arrival || with.tail[i] == 0);
    }
    double middle[KELLER_ROOM_BANDS], delta = -343 * S * log(1 - alpha) / (4 * V), eyring = log(1e6) / delta;
    KellerRoom short_rooms[KELLER_ROOM_BANDS], rooms[KELLER_ROOM_BANDS];
    size_t bands = keller_room_bands(24000, middle);
    assert_true(keller_room(&without, bands, middle, short_rooms) && keller_room(&with, bands, middle, rooms));
    double energy = 0, expected = 1 / pow(v3_distance(tx, rx), 2) + 4 * M_PI * 343 / (V * delta);
    for (size_t i = 0; i < with.count; i++) energy += (double)with.pressure[i] * with.pressure[i];
    printf("# Eyring %.3f s; energy %.4f, expected %.4f;", eyring, energy, expected);
    for (size_t b = 1; b < bands; b++) printf(" %.3f (%.3f)", rooms[b].t30, short_rooms[b].t30);
    printf(" s with (without) the tail\n");
    for (size_t b = 3; b < bands; b++) { /* below, a band has too few bins for an envelope of noise to be smooth */
        assert_true(fabs(rooms[b].t30 - eyring) < 0.1 * eyring);
        assert_true(!(short_rooms[b].t30 > 0.6 * eyring));
    }
    assert_true(fabs(10 * log10(energy / expected)) < 1.5); /* mirror images of low order are no diffuse field */
    free(without.pressure);
    free(with.pressure);
    free(with.tail);
    free(again.pressure);
    free(again.tail);
    keller_scene_free(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(delays_in_the_file),
        {"spectrum_utd", spectrum_is_that_of_the_paths, NULL, NULL, (void *)(uintptr_t)KELLER_EDGES_UTD},
        {"spectrum_btm", spectrum_is_that_of_the_paths, NULL, NULL, (void *)(uintptr_t)KELLER_EDGES_BTM},
        cmocka_unit_test(exponential_decay),
        cmocka_unit_test(sabine_and_eyring),
        cmocka_unit_test(tail_completes),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
