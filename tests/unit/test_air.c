/* Air and rain: the ITU's validation examples, limits, and what a path loses by them. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "../stability/harness.h"
#include "../stability/scenes.h"

/* ITU-R's validation examples (CG-3M3J-13, P.676): dry air of 1013.25 hPa and 7.5 g/m^3 of vapour at 288.15 K, dB/km of
 * oxygen and of vapour. e = rho T/216.7 hPa. */
static void gases_of_the_examples(void **state)
{
    (void)state;
    static const double examples[][3] = {{12, 0.008698264, 0.009535388},  {20, 0.011883550, 0.097047304},
                                         {60, 14.623474796, 0.154841841}, {90, 0.038869711, 0.341973394},
                                         {130, 0.041509083, 0.751844704}};
    double vapour = 7.5 * 288.15 / 216.7 * 100;
    KellerAir air = {.gases = true, .temperature = 288.15, .pressure = 101325 + vapour, .vapour = vapour};
    for (size_t i = 0; i < sizeof examples / sizeof *examples; i++) {
        double loss = 1e3 * keller_air_loss(&air, examples[i][0] * 1e9), expected = examples[i][1] + examples[i][2];
        assert_true(fabs(loss - expected) < 2e-9 * (1 + expected));
    }
    /* without vapour less, without air nothing; the lines where they are */
    KellerAir dry = {.gases = true, .temperature = 288.15, .pressure = 101325};
    assert_true(keller_air_loss(&dry, 22.235e9) < 0.1 * keller_air_loss(&air, 22.235e9));
    assert_true(1e3 * keller_air_loss(&air, 183.31e9) > 20 && 1e3 * keller_air_loss(&air, 118.75e9) > 1.5);
    KellerAir none = {.gases = true, .temperature = 288.15}, off = {.temperature = 288.15, .pressure = 101325};
    assert_true(keller_air_loss(&none, 60e9) == 0 && keller_air_loss(&off, 60e9) == 0);
}

/* The same collection, P.838: elevation and tilt in degrees, GHz, mm/h, dB/km. */
static void rain_of_the_examples(void **state)
{
    (void)state;
    static const double examples[][5] = {
        {31.07699124, 14.25, 26.48052, 0, 1.58130839},      {40.232036, 14.25, 33.936232, 0, 2.06173213},
        {46.35969261, 29, 27.13586832, 0, 5.03135479},      {22.27833468, 14.25, 50.639304, 0, 3.32139638},
        {52.67898486, 29, 78.2994993, 0, 13.59290086},      {48.24117054, 14.25, 63.62668149, 90, 3.72901264},
        {85.80459566, 29, 99.13558978, 90, 16.3183686},     {20.14335809, 29, 42.91007183, 90, 6.83364556}};
    for (size_t i = 0; i < sizeof examples / sizeof *examples; i++) {
        const double *e = examples[i];
        double loss = keller_rain_loss(e[1] * 1e9, e[2] / 3.6e6, e[0] * M_PI / 180, e[3] * M_PI / 180);
        assert_true(fabs(1e3 * loss - e[4]) < 2e-8);
    }
    KellerAir rain = {.rain = 25 / 3.6e6}, both = {true, 288.15, 101325, 1000, 25 / 3.6e6}, air = both;
    air.rain = 0;
    assert_true(keller_rain_loss(28e9, 0, 0, 0) == 0);
    double loss = keller_air_loss(&rain, 28e9), v = keller_rain_loss(28e9, rain.rain, 0, M_PI / 2);
    assert_true(loss > v && loss < keller_rain_loss(28e9, rain.rain, 0, 0));
    assert_true(fabs(keller_air_loss(&both, 28e9) - loss - keller_air_loss(&air, 28e9)) < 1e-15);
}

/* P.453-14's saturation: 6.1121 hPa at 0 degC, 17.0 hPa at 15 degC; 23.4 at 20, 42.4 at 30 (steam tables), 0.5 % more in air. */
static void vapour(void **state)
{
    (void)state;
    static const double table[][2] = {{0, 611.21}, {15, 1705.8}, {20, 2339}, {30, 4247}};
    for (int i = 0; i < 4; i++) {
        double e = keller_vapour_pressure(273.15 + table[i][0], 101325, 1);
        assert_true(e > table[i][1] && e < 1.006 * table[i][1]);
        assert_true(fabs(keller_vapour_pressure(273.15 + table[i][0], 101325, 0.4) - 0.4 * e) < 1e-9);
    }
}

/* Every path of a scene is weaker by its own length's loss, and otherwise the same. */
static void paths_lose_by_length(void **state)
{
    (void)state;
    KellerSoup soup = soup_new();
    soup_object(&soup, "ground");
    soup_quad(&soup, v3(-500, -500, 0), v3(500, -500, 0), v3(500, 500, 0), v3(-500, 500, 0), CONDUCTOR);
    KellerScene scene = scene_of(&soup);
    soup_release(&soup);
    KellerVec3 tx = v3(0, 0, 40), rx = v3(300, 0, 10);
    Run run = run_new(&tx, 1, &rx, 1, 0, 1);
    run.frequency[0] = 60e9;
    FoundPaths clear = run_simulation(&scene, &run);
    scene.air = (KellerAir){true, 288.15, 101325, 1000, 10 / 3.6e6};
    FoundPaths rainy = run_simulation(&scene, &run);
    double loss = keller_air_loss(&scene.air, 60e9);
    assert_true(1e3 * loss > 15);
    assert_int_equal(clear.count, 2);
    assert_int_equal(rainy.count, 2);
    for (int i = 0; i < 2; i++) {
        double complex expected = clear.path[i].gain[0] * pow(10, -loss * clear.path[i].length / 20);
        assert_true(cabs(rainy.path[i].gain[0] - expected) < 1e-12 * cabs(expected));
    }
    found_free(&clear);
    found_free(&rainy);
    keller_scene_free(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gases_of_the_examples),
        cmocka_unit_test(rain_of_the_examples),
        cmocka_unit_test(vapour),
        cmocka_unit_test(paths_lose_by_length),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
