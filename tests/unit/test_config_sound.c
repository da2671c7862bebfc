/* Configurations of domain acoustic: what is read, what is refused and with which words; the schema agrees. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "config_files.h"
#include "io/config_read.h"
#include "io/xml.h"
#include "keller/config.h"

static const char base[] =
    "<?xml version='1.0' encoding='UTF-8'?>\n"                                                          /* 1 */
    "<simulation version='1' domain='acoustic'>\n"                                                      /* 2 */
    "<scene file='room.obj'/>\n"                                                                        /* 3 */
    "<bands from='125 Hz' to='500 Hz' per-octave='1'/>\n"                                               /* 4 */
    "<medium temperature='10 degC' humidity='70 %' pressure='100 kPa' absorption='iso9613'/>\n"         /* 5 */
    "<material name='wall' absorption='0.1 0.2 0.3' scattering='0.25'/>\n"                              /* 6 */
    "<material name='felt' impedance='7.5-2.1j 6-1.5j 5+.25j'/>\n"                                      /* 7 */
    "<material name='rock' rigid='yes'/>\n"                                                             /* 8 */
    "<transmitter id='s'><position x='1 m' y='1 m' z='1 m'/><directivity pattern='cardioid'/>\n"        /* 9 */
    "<level power='90 93 95 dB'/></transmitter>\n"                                                      /* 10 */
    "<transmitter id='t'><position x='1 m' y='1 m' z='2 m'/><level pressure='-3.5 dB'/></transmitter>\n" /* 11 */
    "<receiver id='r'><position x='2 m' y='1 m' z='1 m'/><directivity order='0.3'/></receiver>\n"       /* 12 */
    "<paths reflections='2' diffractions='1'/>\n"                                                       /* 13 */
    "<solver diffraction='btm'/>\n"                                                                     /* 14 */
    "<response rate='48 kHz' duration='250 ms' tail='yes' volume='120 m3'/>\n"                                                     /* 15 */
    "</simulation>\n";                                                                                  /* 16 */

static TestFiles files;

static KellerStatus read_text(const char *text, KellerConfig *config, KellerError *error)
{
    test_files_write(&files, "c.xml", text, strlen(text));
    return keller_config_read(test_files_path(&files, "c.xml"), 0, NULL, config, error);
}

static KellerStatus schema_alone(const char *text)
{
    test_files_write(&files, "c.xml", text, strlen(text));
    xmlDocPtr doc = NULL;
    KellerError error;
    assert_int_equal(keller_xml_read(test_files_path(&files, "c.xml"), &doc, &error), KELLER_OK);
    KellerStatus status = keller_config_check_schema("c.xml", doc, &error);
    xmlFreeDoc(doc);
    return status;
}

static void what_is_read(void **state)
{
    (void)state;
    KellerConfig c;
    KellerError error = {0};
    if (read_text(base, &c, &error) != KELLER_OK) fail_msg("%s", error.message);
    assert_int_equal(c.frequency_count, 3);
    assert_int_equal(c.bands_per_octave, 1);
    for (int i = 0; i < 3; i++) assert_true(fabs(c.frequencies[i] - 1000 * pow(10, 0.3 * (i - 3))) < 1e-10);
    assert_true(c.sound.absorbs && c.sound.edges == KELLER_EDGES_BTM);
    assert_true(fabs(c.sound.temperature - 283.15) < 1e-9 && c.sound.pressure == 1e5 && c.sound.humidity == 0.7);
    assert_true(c.sound.speed == keller_sound_speed(283.15, 1e5, 0.7));
    const KellerMaterial *wall = &c.materials[0], *felt = &c.materials[1];
    assert_int_equal(wall->kind, KELLER_MATERIAL_ABSORPTION);
    assert_true(wall->band_count == 3 && wall->surface[2][0] == 0.3 && wall->scattering == 0.25 &&
                wall->band[1] == c.frequencies[1]);
    assert_int_equal(felt->kind, KELLER_MATERIAL_IMPEDANCE);
    assert_true(felt->surface[0][0] == 7.5 && felt->surface[0][1] == -2.1 && felt->surface[2][0] == 5 &&
                felt->surface[2][1] == 0.25);
    assert_int_equal(c.materials[2].kind, KELLER_MATERIAL_RIGID);
    /* a cardioid of 90 dB has 10 lg 3 more on its axis than 90 dB - 10 lg 4 pi */
    assert_true(fabs(c.transmitters[0].level[0] - (90 - 10 * log10(4 * M_PI) + 10 * log10(3))) < 1e-9);
    double power = 1e-3 + pow(10, -2.7) + pow(10, -2.5);
    assert_true(fabs(c.transmitters[0].power - power) < 1e-12);
    for (int i = 0; i < 3; i++) assert_true(c.transmitters[1].level[i] == -3.5);
    assert_true(c.transmitters[0].station.directivity.order == 0.5 && c.receivers[0].station.directivity.order == 0.3);
    assert_true(c.response_rate == 48000 && c.response_duration == 0.25 && c.response_volume == 120);
    keller_config_free(&c);
    assert_int_equal(schema_alone(base), KELLER_OK);
}

static void what_is_left_out(void **state)
{
    (void)state;
    KellerConfig c;
    KellerError error = {0};
    const char *text = "<simulation version='1' domain='acoustic'><scene file='a.obj'/><frequency>1 kHz</frequency>"
                       "<frequency>250 Hz</frequency><material name='m' absorption='0.5 0.25'/><transmitter id='s'>"
                       "<position x='0 m' y='0 m' z='0 m'/></transmitter><grid id='g' z='1 m'><from x='0 m' y='0 m'/>"
                       "<to x='1 m' y='1 m'/><step>1 m</step></grid></simulation>";
    if (read_text(text, &c, &error) != KELLER_OK) fail_msg("%s", error.message);
    assert_int_equal(c.bands_per_octave, 0);
    assert_true(c.sound.absorbs && c.sound.speed == keller_sound_speed(293.15, 101325, 0.5) &&
                c.sound.edges == KELLER_EDGES_UTD);
    assert_true(fabs(c.transmitters[0].level[0] + 10 * log10(4 * M_PI)) < 1e-12 && c.response_rate == 0);
    /* values go to their frequencies in whatever order */
    assert_true(c.materials[0].band[0] == 250 && c.materials[0].surface[0][0] == 0.25 && c.materials[0].surface[1][0] == 0.5);
    keller_config_free(&c);
    assert_int_equal(schema_alone(text), KELLER_OK);
}

typedef struct {
    int line;
    const char *find, *replace, *words, *more_words;
    bool schema;                /* the schema refuses it too */
} Broken;

static const Broken broken[] = {
    {8, "rigid='yes'", "itu='concrete'", "unknown attribute \"itu\"", "it belongs to domain \"rf\"", true},
    {12, "<directivity order='0.3'/>", "<antenna/>", "unknown element <antenna>", "it belongs to domain \"rf\"", true},
    {13, "<paths ", "<paths transmissions='1' ", "unknown attribute \"transmissions\"", "domain \"rf\"", true},
    {10, "<level power='90 93 95 dB'/>", "<power>1 W</power>", "unknown element <power>", "domain \"rf\"", true},
    {5, "absorption='iso9613'", "rain='1 mm/h'", "unknown attribute \"rain\"", "domain \"rf\"", true},
    {5, "absorption='iso9613'", "absorption='p676'", "absorption of <medium>", "\"iso9613\" or \"none\"", true},
    {5, "10 degC", "60 degC", "temperature of <medium>", "-20 degC to 50 degC", false},
    {5, "absorption='iso9613'", "absorption='none' speed='340 m/s'", "has a speed and a temperature", NULL, false},
    {2, "<bands from='125 Hz' to='500 Hz' per-octave='1'/>", "", "neither <bands> nor <frequency>", NULL, true},
    {2, "<bands", "<frequency>1 kHz</frequency><bands", "both <bands> and <frequency>", NULL, true},
    {4, "125 Hz", "140 Hz", "from of <bands> is 140 Hz, which is no octave band", "126 Hz", false},
    {4, "to='500 Hz'", "to='63 Hz'", "end at 63.1 Hz, below their start", "at that start or above", false},
    {4, "per-octave='1'", "per-octave='2'", "per-octave of <bands>", "\"1\" or \"3\"", true},
    {6, "0.1 0.2 0.3", "0.1 0.2", "has 2 values", "one for each of the 3 frequencies", false},
    {6, "0.1 0.2 0.3", "0.1 0.2 1.3", "holds 1.3", "from 0 to 1", false},
    {6, "0.1 0.2 0.3", "0.1, 0.2, 0.3", "absorption of <material> is \"0.1, 0.2, 0.3\"", "such as", true},
    {6, "scattering='0.25'", "scattering='2'", "scattering of <material>", "from 0 to 1", false},
    {6, "scattering='0.25'", "rigid='yes'", "in more than one way", "exactly one of", true},
    {8, "rigid='yes'", "", "without any property", "exactly one of", true},
    {7, "7.5-2.1j", "-7.5-2.1j", "holds -7.5-2.1j", "a real part of 0 or more", false},
    {7, "7.5-2.1j", "7.5-2.1i", "impedance of <material>", "7.5-2.1j", true},
    {7, "7.5-2.1j", "0", "holds 0+0j", "magnitude", false},
    {10, "power='90 93 95 dB'", "power='90 93 95'", "power of <level>", "in decibels", true},
    {10, "power='90 93 95 dB'", "power='90 dB' pressure='3 dB'", "both a power and a pressure", NULL, true},
    {10, "power='90 93 95 dB'", "power='90 9e9 95 dB'", "holds 9e+09 dB", "-400 to 400", false},
    {9, "pattern='cardioid'", "pattern='cardiod'", "pattern of <directivity>", "did you mean \"cardioid\"?", true},
    {9, "pattern='cardioid'", "pattern='cardioid' order='1'", "both a pattern and an order", NULL, true},
    {14, "btm", "bem", "diffraction of <solver>", "\"utd\" or \"btm\"", true},
    {15, "48 kHz", "48.0001 kHz", "rate of <response> is 48000.1 Hz", "whole number", false},
    {15, "volume='120 m3'", "", "a tail and no volume", "volume=\"120 m3\"", false},
    {15, "tail='yes'", "", "a volume and no tail", NULL, false},
    {15, "120 m3", "120", "volume of <response>", "a volume with its unit", true},
    {15, "250 ms", "250", "duration of <response>", "a time with its unit", true},
};

static void what_is_refused(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof broken / sizeof *broken; i++) {
        const Broken *b = &broken[i];
        char *text = replaced(base, b->find, b->replace), start[300];
        KellerConfig config;
        KellerError error = {KELLER_OK, "(none)"};
        KellerStatus status = read_text(text, &config, &error);
        snprintf(start, sizeof start, "%s:%d: ", test_files_path(&files, "c.xml"), b->line);
        if (status != KELLER_BAD_INPUT || strncmp(error.message, start, strlen(start)) != 0 || !strstr(error.message,
                                                                                                       b->words) ||
            (b->more_words && !strstr(error.message, b->more_words)))
            fail_msg("\"%s\": expected line %d, \"%s\" and \"%s\"; got %d: %s", b->replace, b->line, b->words,
                     b->more_words ? b->more_words : "", status, error.message);
        assert_null(config.text);
        if (b->schema) {
            if (schema_alone(text) != KELLER_BAD_INPUT) fail_msg("the schema accepts \"%s\"", b->replace);
        }
        free(text);
    }
}

static int setup(void **state)
{
    (void)state;
    return test_files_make(&files);
}

static int teardown(void **state)
{
    (void)state;
    static const char *const names[] = {"c.xml", NULL};
    test_files_remove(&files, names);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(what_is_read), cmocka_unit_test(what_is_left_out),
                                       cmocka_unit_test(what_is_refused)};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, setup, teardown);
}
