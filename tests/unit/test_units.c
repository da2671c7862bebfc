/* Quantities with units, plain numbers, and the digest. */
#include <locale.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "io/sha256.h"
#include "io/units.h"
#include "keller/config.h"

#define PI 3.14159265358979323846

static double parsed(const char *text, const char *kind)
{
    double value = 0;
    const char *expected = keller_parse_quantity(text, kind, &value);
    if (expected) fail_msg("\"%s\" as %s: refused, expected %s", text, kind, expected);
    return value;
}

/* Expected values are the C literals: the nearest doubles, so equality is exact. */
static void test_each_unit(void **state)
{
    (void)state;
    static const struct {
        const char *text, *kind;
        double value;
    } cases[] = {
        {"2.5 m", "length", 2.5},        {"1.2 km", "length", 1200},
        {"35 cm", "length", 0.35}, /* 35 * 1e-2 would be 0.35000000000000003 */
        {"6 mm", "length", 0.006},       {"7 um", "length", 7e-6},
        {"-3 m", "length", -3},          {"90 deg", "angle", PI / 2},
        {"180 deg", "angle", PI},        {"1.5 rad", "angle", 1.5},
        {"50 Hz", "frequency", 50},      {"3 kHz", "frequency", 3e3},
        {"868 MHz", "frequency", 868e6}, {"3.5 GHz", "frequency", 3.5e9},
        {"0.3 THz", "frequency", 3e11},  {"1.5 m/s", "speed", 1.5},
        {"36 km/h", "speed", 10},        {"30 dBm", "power", 1},
        {"0 dBm", "power", 0.001},       {"10 dBW", "power", 10},
        {"250 mW", "power", 0.25},       {"2 W", "power", 2},
        {"3 kW", "power", 3000},         {"0.0036 S/m", "conductivity", 0.0036},
        {"150 dB", "ratio", 150},        {"15 degC", "temperature", 288.15},
        {"280 K", "temperature", 280},   {"101.325 kPa", "pressure", 101325},
        {"1013.25 hPa", "pressure", 101325}, {"50 %", "share", 0.5},
        {"3.6 mm/h", "rain", 1e-6},      {"-40 degC", "temperature", 233.14999999999998},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        double value = parsed(cases[i].text, cases[i].kind);
        if (value != cases[i].value) fail_msg("\"%s\" became %.17g", cases[i].text, value);
    }
}

static void test_notation(void **state)
{
    (void)state;
    assert_true(parsed("2.5m", "length") == 2.5);
    assert_true(parsed("  2.5 \t m\n", "length") == 2.5);
    assert_true(parsed("+.5e1 m", "length") == 5);
    assert_true(parsed("5. m", "length") == 5);
    assert_true(parsed("1E-3 km", "length") == 1);
    assert_true(parsed("1e-400 m", "length") == 0);
}

static void test_refused(void **state)
{
    (void)state;
    static const char *const lengths[] = {
        "",         " ",       "m",        "5",        "5 ",      "5 M",   "5 metres", "5 mm m", "5 m/s",
        "5 e3 m",   "5e m",    "5,5 m",    "0x10 m",   "1_000 m", "nan m", "inf m",    "-inf m", "infinity m",
        "nan(1) m", "1e999 m", "-1e999 m", "1e308 km", "5 m;",    "--5 m", "+ 5 m",    ". m",    "5 µm2",
    };
    for (size_t i = 0; i < sizeof lengths / sizeof *lengths; i++) {
        double value = 42;
        const char *expected = keller_parse_quantity(lengths[i], "length", &value);
        if (!expected || value != 42) fail_msg("\"%s\" was taken for a length", lengths[i]);
        assert_non_null(strstr(expected, "a length with its unit, such as \"2.5 m\""));
    }
    double value;
    assert_non_null(strstr(keller_parse_quantity("3.5 Ghz", "frequency", &value), "3.5 GHz"));
    assert_non_null(strstr(keller_parse_quantity("90", "angle", &value), "45 deg"));
    assert_non_null(strstr(keller_parse_quantity("9999 dBm", "power", &value), "30 dBm"));
    assert_non_null(keller_parse_quantity("1 m", "no such kind", &value));
}

/* A locale whose decimal separator is a comma must change nothing. */
static void test_locale(void **state)
{
    (void)state;
    static const char *const names[] = {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "fr_FR.utf8"};
    const char *set = NULL;
    for (size_t i = 0; i < sizeof names / sizeof *names && !set; i++) set = setlocale(LC_ALL, names[i]);
    if (!set) {
        print_message("# no locale with a decimal comma is installed\n");
        skip();
    }
    double value = parsed("2.5 m", "length"), number = 0, other = 0;
    bool good = keller_parse_number("0.125", &number), comma = keller_parse_number("0,125", &other);
    setlocale(LC_ALL, "C");
    assert_true(value == 2.5);
    assert_true(good && number == 0.125);
    assert_false(comma);
}

static void test_numbers(void **state)
{
    (void)state;
    double value = 0;
    assert_true(keller_parse_number(" -1.25e2 ", &value) && value == -125);
    assert_false(keller_parse_number("1 2", &value));
    assert_false(keller_parse_number("NaN", &value));
    assert_false(keller_parse_number("", &value));
    uint32_t n = 7;
    assert_true(keller_parse_count(" 16 ", 16, &n) && n == 16);
    assert_true(keller_parse_count("4294967295", UINT32_MAX, &n) && n == UINT32_MAX);
    n = 7;
    assert_false(keller_parse_count("17", 16, &n));
    assert_false(keller_parse_count("4294967296", UINT32_MAX, &n));
    assert_false(keller_parse_count("99999999999999999999999", UINT32_MAX, &n));
    assert_false(keller_parse_count("-1", 16, &n));
    assert_false(keller_parse_count("1.0", 16, &n));
    assert_false(keller_parse_count("", 16, &n));
    assert_int_equal(n, 7);
}

/* The examples of FIPS 180-4's companion (csrc.nist.gov, "SHA256.pdf"), the empty message and one million `a`;
 * lengths 55 and 56 are where the padding takes a second block. */
static void test_sha256(void **state)
{
    (void)state;
    char hex[65];
    keller_sha256("", 0, hex);
    assert_string_equal(hex, "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    keller_sha256("abc", 3, hex);
    assert_string_equal(hex, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    keller_sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq", 56, hex);
    assert_string_equal(hex, "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
    char *block = malloc(1000000);
    assert_non_null(block);
    memset(block, 'a', 1000000);
    keller_sha256(block, 1000000, hex);
    assert_string_equal(hex, "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
    /* sha256sum of 55 times `a` */
    keller_sha256(block, 55, hex);
    assert_string_equal(hex, "9f4390f8d30c2dd92ec9f095b65e2b9ae9b0a925a5258e241c9f1e910f734318");
    free(block);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_each_unit), cmocka_unit_test(test_notation), cmocka_unit_test(test_refused),
        cmocka_unit_test(test_locale),    cmocka_unit_test(test_numbers),  cmocka_unit_test(test_sha256),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
