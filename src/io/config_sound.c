#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "io/config_read.h"
#include "io/names.h"
#include "io/text.h"
#include "io/xml.h"

/* ISO 9613-1 is stated from -20 to 50 degC, its relaxation from 50 Hz to 10 kHz; beyond those frequencies its formulas are used as
 * they are. */
static const KellerConfigRange temperature_range = {253.15, 323.15, "-20 degC to 50 degC"};
static const KellerConfigRange pressure_range = {2e4, 2e5, "20 kPa to 200 kPa"};
static const KellerConfigRange humidity_range = {0, 1, "0 % to 100 %"};
static const KellerConfigRange speed_range = {1, 1e5, "1 m/s to 100 km/s"};

/* ---- bands ------------------------------------------------------------------------------------------------------------- */

/* How far a band may be named from its middle: nominal frequencies are rounded by up to 3 % (IEC 61260-1, annex E: 315 Hz for 316.2,
 * 63 for 63.10, 16 kHz for 15.85). */
static const double name_tolerance = 0.03;

static KellerStatus read_band(const KellerConfigReader *reader, const xmlNode *node, const char *attribute, uint32_t per_octave,
                              double *middle)
{
    static const KellerConfigRange range = {1, 1e6, "a frequency from 1 Hz to 1 MHz"};
    double named = 0;
    KellerStatus status = keller_config_quantity(reader, node, attribute, "frequency", &range, &named);
    if (status != KELLER_OK) return status;
    *middle = keller_band_middle(per_octave, named);
    if (fabs(named / *middle - 1) <= name_tolerance) return KELLER_OK;
    return keller_config_fail(reader, node,
                              "%s of <bands> is %g Hz, which is no %s band; expected the middle of one, such as %.3g Hz",
                              attribute, named, per_octave == 1 ? "octave" : "third-octave", *middle);
}

static KellerStatus read_bands(KellerConfigReader *reader, const xmlNode *node)
{
    KellerConfig *config = reader->config;
    static const char *const words[] = {"1", "3", NULL};
    unsigned place = 0;
    double from = 1, to = 1;
    KellerStatus status = keller_config_word(reader, node, "per-octave", words, &place);
    uint32_t per_octave = place ? 3 : 1;
    if (status == KELLER_OK) status = read_band(reader, node, "from", per_octave, &from);
    if (status == KELLER_OK) status = read_band(reader, node, "to", per_octave, &to);
    if (status != KELLER_OK) return status;
    double steps = nearbyint(log10(to / from) * per_octave / 0.3);
    if (steps < 0)
        return keller_config_fail(reader, node,
                                  "<bands> end at %.4g Hz, below their start at %.4g Hz; expected to=\"...\" at that start or above",
                                  to, from);
    size_t count = (size_t)steps + 1; /* from 1 Hz to 1 MHz: at most 61 */
    config->frequencies = malloc(count * sizeof *config->frequencies);
    config->frequency_lines = malloc(count * sizeof *config->frequency_lines);
    if (!config->frequencies || !config->frequency_lines) return keller_error_memory(reader->error, count * sizeof(double));
    for (size_t i = 0; i < count; i++) {
        config->frequencies[i] = keller_band_middle(per_octave, from * pow(10, 0.3 * (double)i / per_octave));
        config->frequency_lines[i] = keller_xml_line(node);
    }
    config->frequency_count = count;
    config->bands_per_octave = per_octave;
    return KELLER_OK;
}

/* ---- air --------------------------------------------------------------------------------------------------------------- */

static KellerStatus read_air(KellerConfigReader *reader, const xmlNode *node)
{
    KellerSound *sound = &reader->config->sound;
    *sound = (KellerSound){.absorbs = true, .temperature = 293.15, .pressure = 101325, .humidity = 0.5};
    static const char *const absorptions[] = {"iso9613", "none", NULL};
    static const char *const state[] = {"temperature", "pressure", "humidity"};
    unsigned place = 0;
    KellerStatus status = KELLER_OK;
    if (node) status = keller_config_word(reader, node, "absorption", absorptions, &place);
    if (node && status == KELLER_OK)
        status = keller_config_quantity(reader, node, state[0], "temperature", &temperature_range, &sound->temperature);
    if (node && status == KELLER_OK)
        status = keller_config_quantity(reader, node, state[1], "pressure", &pressure_range, &sound->pressure);
    if (node && status == KELLER_OK)
        status = keller_config_quantity(reader, node, state[2], "share", &humidity_range, &sound->humidity);
    if (status != KELLER_OK) return status;
    sound->absorbs = place == 0;
    sound->speed = keller_sound_speed(sound->temperature, sound->pressure, sound->humidity);
    if (!node || !keller_config_attribute(node, "speed")) return KELLER_OK;
    for (int i = 0; i < 3 && !sound->absorbs; i++)
        if (keller_config_attribute(node, state[i]))
            return keller_config_fail(reader, node, "<medium> has a speed and a %s that nothing uses; expected one of them, or "
                                                    "absorption=\"iso9613\"", state[i]);
    return keller_config_quantity(reader, node, "speed", "speed", &speed_range, &sound->speed);
}

/* ---- responses ---------------------------------------------------------------------------------------------------------- */

static KellerStatus read_response(KellerConfigReader *reader, const xmlNode *node)
{
    KellerConfig *config = reader->config;
    static const KellerConfigRange rate = {1000, 384000, "a sampling rate from 1 kHz to 384 kHz"};
    static const KellerConfigRange duration = {1e-3, 60, "1 ms to 60 s"};
    KellerStatus status = keller_config_quantity(reader, node, "rate", "frequency", &rate, &config->response_rate);
    if (status == KELLER_OK && config->response_rate != nearbyint(config->response_rate))
        return keller_config_fail(reader, node, "rate of <response> is %.10g Hz; expected a whole number of hertz",
                                  config->response_rate);
    if (status == KELLER_OK)
        status = keller_config_quantity(reader, node, "duration", "time", &duration, &config->response_duration);
    static const KellerConfigRange volume = {1e-3, 1e9, "0.001 m3 to 1e9 m3"};
    bool tail = false, given = keller_config_attribute(node, "volume");
    if (status == KELLER_OK) status = keller_config_flag(reader, node, "tail", &tail);
    if (status == KELLER_OK && tail != given)
        return keller_config_fail(reader, node,
                                  "<response> has %s; expected both tail=\"yes\" and the room's volume=\"120 m3\", or "
                                                "neither", tail ? "a tail and no volume" : "a volume and no tail=\"yes\"");
    return status == KELLER_OK && tail
               ? keller_config_quantity(reader, node, "volume", "volume", &volume, &config->response_volume) : status;
}

KellerStatus keller_config_read_sound(KellerConfigReader *reader, const xmlNode *root)
{
    const xmlNode *bands = keller_config_child(root, "bands"), *response = keller_config_child(root, "response");
    KellerStatus status = bands ? read_bands(reader, bands) : KELLER_OK;
    if (status == KELLER_OK) status = read_air(reader, keller_config_child(root, "medium"));
    if (status == KELLER_OK && response) status = read_response(reader, response);
    return status;
}

/* ---- lists of values ----------------------------------------------------------------------------------------------------- */

/* Reads a number, or with `paired` a complex one such as 7.5-2.1j. */
static bool read_value(const char **p, const char *end, bool paired, double value[2])
{
    value[1] = 0;
    if (!keller_text_double(p, end, &value[0])) return false;
    if (!paired || (**p != '+' && **p != '-')) return true;
    if (!keller_text_double(p, end, &value[1]) || **p != 'j') return false;
    ++*p;
    return true;
}

/* Values separated by blanks and, if there is one, a unit behind the last. One for all frequencies, or one for each. */
static KellerStatus read_list(const KellerConfigReader *reader, const xmlNode *node, const char *attribute, bool paired,
                              const char *unit, const char *expected, size_t capacity, double (*values)[2], size_t *count)
{
    const char *text = keller_config_attribute(node, attribute), *p = text, *end = p + strlen(p), *blanks = " \t\r\n";
    *count = 0;
    for (p += strspn(p, blanks); p < end && *count < capacity; p += strspn(p, blanks)) {
        if (*count > 0 && unit && strncmp(p, unit, strlen(unit)) == 0) break;
        const char *before = p;
        if (!read_value(&p, end, paired, values[*count]) || (*p && !strchr(blanks, *p) && !(unit && *p == *unit))) {
            p = before;
            break;
        }
        ++*count;
    }
    bool united = !unit || strncmp(p, unit, strlen(unit)) == 0;
    if (unit && united) p += strlen(unit);
    p += strspn(p, blanks);
    if (*count == 0 || p < end || !united)
        return keller_config_fail(reader, node, "%s of <%s> is \"%s\"; expected %s", attribute, (const char *)node->name,
                                  keller_quote(text).text, expected);
    if (*count == 1 || *count == reader->config->frequency_count) return KELLER_OK;
    return keller_config_fail(reader, node,
                              "%s of <%s> has %zu values; expected one, or one for each of the %zu frequencies", attribute,
                              (const char *)node->name, *count, reader->config->frequency_count);
}

/* ---- surfaces -------------------------------------------------------------------------------------------------------------- */

static KellerStatus check_surface(const KellerConfigReader *reader, const xmlNode *node, const KellerMaterial *m)
{
    for (uint32_t i = 0; i < m->band_count; i++) {
        double re = m->surface[i][0], im = m->surface[i][1];
        if (m->kind == KELLER_MATERIAL_ABSORPTION && !(re >= 0 && re <= 1))
            return keller_config_fail(reader, node, "absorption of material \"%s\" holds %g; expected values from 0 to 1",
                                      keller_quote(m->name).text, re);
        if (m->kind == KELLER_MATERIAL_IMPEDANCE && (!(re >= 0) || hypot(re, im) < 1e-6 || hypot(re, im) > 1e9))
            return keller_config_fail(reader, node,
                                      "impedance of material \"%s\" holds %g%+gj; expected a real part of 0 or more (a "
                                                    "surface gives no energy) and a magnitude from 1e-6 to 1e9, over rho c",
                                      keller_quote(m->name).text, re, im);
    }
    return KELLER_OK;
}

static int by_band(const void *a, const void *b)
{
    const double *x = a, *y = b;
    return x[0] < y[0] ? -1 : x[0] > y[0];
}

/* Puts the values to the frequencies, in rising order. */
static KellerStatus place_values(const KellerConfigReader *reader, const xmlNode *node, size_t count, double (*values)[2],
                                 KellerMaterial *m)
{
    double rows[KELLER_MAX_BANDS][3];
    for (size_t i = 0; i < count; i++) {
        rows[i][0] = reader->config->frequencies[i];
        memcpy(&rows[i][1], values[i], sizeof values[i]);
    }
    qsort(rows, count, sizeof *rows, by_band);
    m->band_count = (uint32_t)count;
    for (size_t i = 0; i < count; i++) {
        if (i > 0 && rows[i][0] == rows[i - 1][0])
            return keller_config_fail(reader, node,
                                      "material \"%s\" has two values for %g Hz, which <frequency> names twice; expected "
                                                    "different frequencies, or one value",
                                      keller_quote(m->name).text, rows[i][0]);
        m->band[i] = rows[i][0];
        memcpy(m->surface[i], &rows[i][1], sizeof m->surface[i]);
    }
    return check_surface(reader, node, m);
}

KellerStatus keller_config_read_surface(const KellerConfigReader *reader, const xmlNode *node, KellerMaterial *material)
{
    bool absorption = keller_config_attribute(node, "absorption"), impedance = keller_config_attribute(node, "impedance");
    bool rigid = keller_config_attribute(node, "rigid");
    if (absorption + impedance + rigid != 1)
        return keller_config_fail(reader, node, "material \"%s\" is given %s; expected exactly one of absorption=\"0.02 ...\", "
                                                "impedance=\"7.5-2.1j ...\" and rigid=\"yes\"",
                                  keller_quote(material->name).text,
                                  absorption || impedance || rigid ? "in more than one way" : "without any property");
    static const KellerConfigRange share = {0, 1, "a share from 0 to 1"};
    static const char *const yes[] = {"yes", NULL};
    unsigned ignored;
    double values[KELLER_MAX_BANDS][2];
    size_t count = 0;
    KellerStatus status = keller_config_quantity(reader, node, "scattering", NULL, &share, &material->scattering);
    material->kind = rigid ? KELLER_MATERIAL_RIGID : impedance ? KELLER_MATERIAL_IMPEDANCE : KELLER_MATERIAL_ABSORPTION;
    if (status == KELLER_OK && rigid) return keller_config_word(reader, node, "rigid", yes, &ignored);
    if (status == KELLER_OK)
        status = read_list(reader, node, impedance ? "impedance" : "absorption", impedance, NULL,
                           impedance ? "up to 64 complex numbers, such as \"7.5-2.1j 6-1.5j\"" : "up to 64 numbers, such as \"0.02 0.03\"",
                           KELLER_MAX_BANDS, values, &count);
    return status == KELLER_OK ? place_values(reader, node, count, values, material) : status;
}

/* ---- sources ----------------------------------------------------------------------------------------------------------------- */

KellerStatus keller_config_read_directivity(const KellerConfigReader *reader, const xmlNode *node,
                                            KellerDirectivity *directivity)
{
    static const char *const patterns[] = {"omnidirectional", "cardioid", "supercardioid", "hypercardioid",
                                           "figure-of-eight", NULL};
    /* supercardioid: most from the front half, (3 - sqrt 3)/2; hypercardioid: largest directivity factor, 3/4 */
    static const double orders[] = {0, 0.5, 0.6339745962155614, 0.75, 1};
    static const KellerConfigRange range = {0, 1, "a number from 0 (all around) to 1 (a dipole)"};
    const xmlNode *child = keller_config_child(node, "directivity");
    unsigned place = 0;
    if (!child) return KELLER_OK;
    if (keller_config_attribute(child, "pattern") && keller_config_attribute(child, "order"))
        return keller_config_fail(reader, child, "<directivity> has both a pattern and an order; expected one of them");
    KellerStatus status = keller_config_word(reader, child, "pattern", patterns, &place);
    directivity->order = orders[place];
    return status == KELLER_OK ? keller_config_quantity(reader, child, "order", NULL, &range, &directivity->order) : status;
}

KellerStatus keller_config_read_level(const KellerConfigReader *reader, const xmlNode *node, KellerTransmitter *tx)
{
    const xmlNode *child = keller_config_child(node, "level");
    size_t frequencies = reader->config->frequency_count, count = 1;
    double(*values)[2] = calloc(frequencies, sizeof *values); /* 0 dB of power where there is no <level> */
    tx->level = malloc(frequencies * sizeof *tx->level);
    if (!values || !tx->level) {
        free(values);
        return keller_error_memory(reader->error, frequencies * sizeof *values);
    }
    bool power = !child || keller_config_attribute(child, "power");
    bool pressure = child && keller_config_attribute(child, "pressure");
    KellerStatus status = KELLER_OK;
    if (power == pressure)
        status = keller_config_fail(reader, child, "<level> has %s; expected exactly one of power=\"94 dB\" (re 1 pW) and "
                                                   "pressure=\"83 dB\" (re 20 uPa, at 1 m)",
                                    power ? "both a power and a pressure" : "neither a power nor a pressure");
    else if (child)
        status = read_list(reader, child, power ? "power" : "pressure", false, "dB",
                           "levels in decibels, such as \"80 82 85 dB\"",
                           frequencies, values, &count);
    double on_axis = keller_source_level(KELLER_REFERENCE_POWER, keller_directivity_factor(&tx->station.directivity));
    tx->power = 0;
    for (size_t f = 0; f < frequencies && status == KELLER_OK; f++) {
        double level = values[count == 1 ? 0 : f][0];
        if (!(fabs(level) <= 400))
            status = keller_config_fail(reader, child, "<level> holds %g dB; expected levels from -400 to 400 dB", level);
        tx->level[f] = power ? level + on_axis : level;
        tx->power += KELLER_REFERENCE_POWER * pow(10, (tx->level[f] - on_axis) / 10);
    }
    free(values);
    return status;
}
