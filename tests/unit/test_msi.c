/* Antenna files: the values of a good one, an error with its line for every kind of bad one, nothing worse for any bytes, and
 * the files of the scenes' folder. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "config_files.h"
#include "keller/antenna.h"

static TestFiles files;

/* NAME, FREQUENCY, GAIN, a vendor's key, then the cuts from lines 5 and 366. */
static char *good_file(const char *gain, const char *end_of_line)
{
    char *text = malloc(1 << 16), *at = text;
    assert_non_null(text);
    at += sprintf(at, "NAME Some Antenna 12%sFREQUENCY 1845%sGAIN %s%sELECTRICAL_TILT 04%s", end_of_line, end_of_line, gain,
                  end_of_line, end_of_line);
    for (int cut = 0; cut < 2; cut++) {
        at += sprintf(at, "%s 360%s", cut ? "VERTICAL" : "HORIZONTAL", end_of_line);
        for (int i = 0; i < 360; i++) at += sprintf(at, "%d%s %.2f%s", i, cut ? ".00" : "", 0.1 * (i ^ cut), end_of_line);
    }
    return text;
}

static KellerStatus read_text(const char *text, KellerAntennaCuts *cuts, KellerError *error)
{
    test_files_write(&files, "a.msi", text, strlen(text));
    return keller_antenna_read(test_files_path(&files, "a.msi"), NULL, cuts, error);
}

static void good_files(void **state)
{
    (void)state;
    static const struct {
        const char *gain, *end;
        double expected;
    } cases[] = {{"16.95 dBd", "\n", 19.1}, {"19.08 dBi", "\r\n", 19.08}, {"16", "\n", 18.15}, {"-3.5 DBI", "\n", -3.5}};
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        KellerAntennaCuts cuts;
        KellerError error = {0};
        char *text = good_file(cases[c].gain, cases[c].end);
        if (read_text(text, &cuts, &error) != KELLER_OK) fail_msg("%s", error.message);
        free(text);
        assert_true(fabs(cuts.gain - cases[c].expected) < 1e-12);
        for (int i = 0; i < 360; i++) {
            assert_true(fabs(cuts.horizontal[i] - 0.1 * i) < 0.006);
            assert_true(fabs(cuts.vertical[i] - 0.1 * (i ^ 1)) < 0.006);
        }
    }
}

static void broken_files(void **state)
{
    (void)state;
    static const struct {
        const char *find, *replace, *line, *word;
    } cases[] = {
        {"GAIN 16 dBd", "GAIN", ":3:", "the gain is"},
        {"GAIN 16 dBd", "GAIN loud", ":3:", "\"loud\""},
        {"GAIN 16 dBd", "GAIN 16 dBm", ":3:", "\"dBm\""},
        {"GAIN 16 dBd", "GAIN 16 dBd 3", ":3:", "too much"},
        {"GAIN 16 dBd", "GAIN 81 dBd", ":3:", "-80 to 80"},
        {"GAIN 16 dBd", "GAIN nan dBd", ":3:", "\"nan\""},
        {"GAIN 16 dBd", "GAIN 16 dBd\nGAIN 16 dBd", ":4:", "already on line 3"},
        {"GAIN 16 dBd", "COMMENT 16 dBd", ":727:", "no GAIN"},
        {"HORIZONTAL 360", "HORIZONTAL", ":5:", "360, one a degree"},
        {"HORIZONTAL 360", "HORIZONTAL 361", ":5:", "\"361\""},
        {"HORIZONTAL 360", "HORIZONTAL 360 deg", ":5:", "too much"},
        {"HORIZONTAL 360", "VERTICAL 360", ":366:", "already on line 5"},
        {"\n17 1.70", "\n18 1.70", ":23:", "17 deg, the next angle of HORIZONTAL"},
        {"\n17 1.70", "", ":23:", "17 deg"},
        {"\n17 1.70", "\n17", ":23:", "the loss is"},
        {"\n17 1.70", "\n17 -1.70", ":23:", "0 to 200"},
        {"\n17 1.70", "\n17 201", ":23:", "0 to 200"},
        {"\n17 1.70", "\n17 1,70", ":23:", "\"1,70\""},
        {"\n17 1.70", "\n17 1.70 0", ":23:", "too much"},
        {"\n17 1.70", "\nVERTICAL 360", ":23:", "\"VERTICAL\""},
        {"ELECTRICAL_TILT 04", "04", ":4:", "a keyword"},
        {"\n359 35.90", "\n359 35.90\n360 0", ":366:", "a keyword"},
    };
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        KellerAntennaCuts cuts;
        KellerError error = {0};
        char *good = good_file("16 dBd", "\n"), *text = replaced(good, cases[c].find, cases[c].replace);
        KellerStatus status = read_text(text, &cuts, &error);
        if (status != KELLER_BAD_INPUT || !strstr(error.message, cases[c].line) || !strstr(error.message, cases[c].word))
            fail_msg("%s -> %s: %d %s", cases[c].find, cases[c].replace, (int)status, error.message);
        free(good);
        free(text);
    }
    /* cut short anywhere: an error, never a pattern */
    char *text = good_file("16 dBd", "\n");
    for (size_t length = 0; length < strlen(text) - 12; length += 97) {
        KellerAntennaCuts cuts;
        KellerError error = {0};
        test_files_write(&files, "a.msi", text, length);
        assert_int_equal(keller_antenna_read(test_files_path(&files, "a.msi"), NULL, &cuts, &error), KELLER_BAD_INPUT);
    }
    free(text);
}

/* Bytes changed at random: what is read is in range. */
static void any_bytes(void **state)
{
    (void)state;
    uint32_t random = 1;
    int accepted = 0;
    char *good = good_file("16 dBd", "\n");
    size_t size = strlen(good);
    for (int i = 0; i < 2000; i++) {
        char *text = strdup(good);
        for (int j = 0; j < 1 + i % 4; j++) {
            random = random * 1664525u + 1013904223u;
            size_t at = (random >> 8) % size;
            random = random * 1664525u + 1013904223u;
            text[at] = i % 3 ? "0123456789.- \nA"[(random >> 24) % 15] : (char)(random >> 24);
        }
        KellerAntennaCuts cuts;
        KellerError error = {0};
        test_files_write(&files, "a.msi", text, size);
        if (keller_antenna_read(test_files_path(&files, "a.msi"), NULL, &cuts, &error) == KELLER_OK) {
            accepted++;
            assert_true(fabs(cuts.gain) < 83);
            for (int k = 0; k < 360; k++) {
                assert_true(cuts.horizontal[k] >= 0 && cuts.horizontal[k] <= 200);
                assert_true(cuts.vertical[k] >= 0 && cuts.vertical[k] <= 200);
            }
        }
        free(text);
    }
    free(good);
    assert_true(accepted > 20 && accepted < 1000);
}

static void no_file(void **state)
{
    (void)state;
    KellerAntennaCuts cuts;
    KellerError error = {0};
    assert_int_equal(keller_antenna_read("/nowhere/a.msi", "c.xml:7", &cuts, &error), KELLER_IO);
    assert_non_null(strstr(error.message, "c.xml:7"));
    assert_int_equal(keller_antenna_read("/tmp", NULL, &cuts, &error), KELLER_IO);
    char *large = calloc(1, 2 << 20);
    memset(large, '\n', 2 << 20);
    test_files_write(&files, "a.msi", large, 2 << 20);
    free(large);
    assert_int_equal(keller_antenna_read(test_files_path(&files, "a.msi"), NULL, &cuts, &error), KELLER_BAD_INPUT);
    assert_non_null(strstr(error.message, "at most 1 MiB"));
}

/* Gain over the sphere: 0 dB or less for an antenna, but two cuts tell too little to come nearer than some 2 dB. */
static double mean_gain(const KellerAntennaCuts *cuts)
{
    KellerAntenna a = {.pattern = KELLER_ANTENNA_CUTS, .polarization = KELLER_POLARIZATION_V, .cuts = cuts};
    double sum = 0, weight = 0;
    for (int i = 0; i < 360; i++)
        for (int j = 0; j < 720; j++) {
            double zenith = (i + 0.5) * M_PI / 360, azimuth = j * M_PI / 360;
            double complex t, p;
            keller_antenna_field(&a, (double[]){0, 0, 0}, v3(sin(zenith) * cos(azimuth), sin(zenith) * sin(azimuth), cos(zenith)),
                                 &t, &p);
            sum += sin(zenith) * creal(t * conj(t) + p * conj(p));
            weight += sin(zenith);
        }
    return sum / weight;
}

static void real_files(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        double gain, horizontal_at, vertical_at; /* the file's own, angles of the maxima */
    } cases[] = {{"AMB4520R8v06_05T", 16.95 + 2.15, 32, 5},          {"AMB4520R8v06_1845_M45_04T_y2", 16.94 + 2.15, 327, 4},
                 {"AMB4520R8v06_1845_P45_04T_y1", 16.46 + 2.15, 31, 4}, {"SV460-SF2SNM_0960_00T", 15 + 2.15, 0, 359},
                 {"merged_04T", 19.08, 327, 4},                      {"simulated_05T", 19.09, 0, 5}};
    const char *scenes = getenv("KELLER_SCENES"), *source = getenv("KELLER_SOURCE");
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        char path[4096];
        if (scenes)
            snprintf(path, sizeof path, "%s/antenna/%s.msi", scenes, cases[c].name);
        else
            snprintf(path, sizeof path, "%s/../shared/scenes/antenna/%s.msi", source ? source : ".", cases[c].name);
        KellerAntennaCuts cuts;
        KellerError error = {0};
        KellerStatus status = keller_antenna_read(path, NULL, &cuts, &error);
        if (status == KELLER_IO) skip();
        if (status != KELLER_OK) fail_msg("%s", error.message);
        assert_true(fabs(cuts.gain - cases[c].gain) < 1e-12);
        assert_true(cuts.horizontal[(int)cases[c].horizontal_at] < 0.02 && cuts.vertical[(int)cases[c].vertical_at] < 0.03);
        double mean = mean_gain(&cuts);
        print_message("# %s: mean gain over the sphere %.2f dB\n", cases[c].name, 10 * log10(mean));
        assert_true(mean > 0.3 && mean < 2);
    }
}

static int make(void **state)
{
    (void)state;
    return test_files_make(&files);
}

static int remove_all(void **state)
{
    (void)state;
    static const char *const names[] = {"a.msi", NULL};
    test_files_remove(&files, names);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(good_files), cmocka_unit_test(broken_files), cmocka_unit_test(any_bytes),
        cmocka_unit_test(no_file),    cmocka_unit_test(real_files),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, make, remove_all);
}
