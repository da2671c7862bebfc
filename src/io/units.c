#include "io/units.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "io/text.h"
#include "keller/config.h"

#define PI 3.14159265358979323846

static bool blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
static bool digit(char c) { return c >= '0' && c <= '9'; }

static const char *skip_blanks(const char *p)
{
    while (blank(*p)) p++;
    return p;
}

bool keller_parse_number(const char *text, double *value)
{
    const char *p = skip_blanks(text);
    return keller_text_double(&p, p + strlen(p), value) && *skip_blanks(p) == '\0';
}

bool keller_parse_count(const char *text, uint32_t limit, uint32_t *value)
{
    const char *p = skip_blanks(text);
    if (!digit(*p)) return false;
    uint64_t n = 0;
    for (; digit(*p); p++) {
        n = n * 10 + (uint64_t)(*p - '0');
        if (n > limit) return false;
    }
    if (*skip_blanks(p) != '\0') return false;
    *value = (uint32_t)n;
    return true;
}

typedef struct {
    const char *name;
    double multiply, divide; /* SI value = number * multiply / divide: "30 cm" becomes the double nearest to 0.3, which
                                    30 * 1e-2 would miss */
    bool decibel;            /* 10^(number/10) in place of the number */
} Unit;

#define MAX_UNITS 8

typedef struct {
    const char *kind, *expected;
    Unit units[MAX_UNITS]; /* ended by a NULL name */
} Kind;

/* docs/configuration.md and the patterns in data/keller.rng list the same units. */
static const Kind kinds[] = {
    {"length",
     "a length with its unit, such as \"2.5 m\" (m, km, cm, mm, um)",
     {{"m", 1, 1, false}, {"km", 1e3, 1, false}, {"cm", 1, 1e2, false}, {"mm", 1, 1e3, false}, {"um", 1, 1e6, false}}},
    {"angle", "an angle with its unit, such as \"45 deg\" (deg, rad)", {{"deg", PI, 180, false}, {"rad", 1, 1, false}}},
    {"frequency",
     "a frequency with its unit, such as \"3.5 GHz\" (Hz, kHz, MHz, GHz, THz)",
     {{"Hz", 1, 1, false},
      {"kHz", 1e3, 1, false},
      {"MHz", 1e6, 1, false},
      {"GHz", 1e9, 1, false},
      {"THz", 1e12, 1, false}}},
    {"speed",
     "a speed with its unit, such as \"1.5 m/s\" (m/s, km/h)",
     {{"m/s", 1, 1, false}, {"km/h", 1, 3.6, false}}},
    {"power",
     "a power with its unit, such as \"30 dBm\" (dBm, dBW, mW, W, kW)",
     {{"dBm", 1, 1e3, true}, {"dBW", 1, 1, true}, {"mW", 1, 1e3, false}, {"W", 1, 1, false}, {"kW", 1e3, 1, false}}},
    {"conductivity", "a conductivity with its unit, such as \"0.01 S/m\" (S/m)", {{"S/m", 1, 1, false}}},
    {"temperature", "a temperature with its unit, such as \"15 degC\" (degC, K)", {{"K", 1, 1, false}, {"degC", 1, 1, false}}},
    {"pressure",
     "a pressure with its unit, such as \"101.325 kPa\" (Pa, hPa, kPa)",
     {{"Pa", 1, 1, false}, {"hPa", 1e2, 1, false}, {"kPa", 1e3, 1, false}}},
    {"share", "a percentage, such as \"50 %\" (%)", {{"%", 1, 1e2, false}}},
    {"rain", "a rain rate with its unit, such as \"25 mm/h\" (mm/h)", {{"mm/h", 1, 3.6e6, false}}},
    {"time",
     "a time with its unit, such as \"1.5 s\" (s, ms)",
     {{"s", 1, 1, false}, {"ms", 1, 1e3, false}}},
    {"volume", "a volume with its unit, such as \"120 m3\" (m3)", {{"m3", 1, 1, false}}},
    {"ratio", "a ratio in decibels, such as \"150 dB\" (dB)", {{"dB", 1, 1, false}}},
};

const char *keller_parse_quantity(const char *text, const char *kind, double *value)
{
    const Kind *found = NULL;
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (strcmp(kinds[i].kind, kind) == 0) found = &kinds[i];
    if (!found) return "a quantity of a known kind";

    const char *p = skip_blanks(text);
    double number = 0;
    if (!keller_text_double(&p, p + strlen(p), &number)) return found->expected;
    p = skip_blanks(p);
    size_t length = strlen(p);
    while (length && blank(p[length - 1])) length--;
    for (const Unit *unit = found->units; unit < found->units + MAX_UNITS && unit->name; unit++) {
        if (strlen(unit->name) != length || strncmp(unit->name, p, length) != 0) continue;
        double result = (unit->decibel ? pow(10, number / 10) : number) * unit->multiply / unit->divide;
        if (strcmp(unit->name, "degC") == 0) result += 273.15;
        if (!isfinite(result)) return found->expected;
        *value = result;
        return NULL;
    }
    return found->expected;
}
