#define _GNU_SOURCE /* strtod_l */
#include <assert.h>
#include <locale.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/embedded.h"
#include "keller/sound.h"
#include "keller/wave.h"

/* One row of the table: eps' = a f^b, sigma = c f^d, f in GHz (P.2040-4 eqs. for table 3). */
typedef struct {
    char name[sizeof((KellerMaterial *)0)->itu];
    double a, b, c, d, lower, upper;
} Row;

/* The names in the order of the table; a test holds the two against each other. */
static const char *const names[] = {"vacuum",
                                    "concrete",
                                    "brick",
                                    "plasterboard",
                                    "wood",
                                    "glass",
                                    "clear_acrylic",
                                    "ceiling_board",
                                    "chipboard",
                                    "plywood",
                                    "marble",
                                    "floorboard",
                                    "vinyl_tile",
                                    "carpet_tile",
                                    "asphalt_concrete",
                                    "metal",
                                    "very_dry_ground",
                                    "medium_dry_ground",
                                    "wet_ground",
                                    NULL};

/* Reads the row that starts at *text and moves *text to the next line; false at the end of the table. The table is part
 * of the program, so a malformed one is a programmer's error. */
static bool next_row(const char **text, locale_t c_locale, Row *row)
{
    const char *p = *text;
    while (*p == '#' || *p == '\n' || *p == '\r' || strncmp(p, "name,", 5) == 0) {
        p += strcspn(p, "\n");
        if (*p) p++;
    }
    if (!*p) return false;

    size_t length = strcspn(p, ",\n");
    assert(length > 0 && length < sizeof row->name && p[length] == ',');
    memcpy(row->name, p, length);
    row->name[length] = '\0';
    p += length;

    double *columns[] = {&row->a, &row->b, &row->c, &row->d, &row->lower, &row->upper};
    for (size_t i = 0; i < sizeof columns / sizeof *columns; i++) {
        assert(*p == ',');
        char *end;
        *columns[i] = strtod_l(p + 1, &end, c_locale);
        assert(end > p + 1);
        p = end;
    }
    if (*p == '\r') p++;
    assert(*p == '\n' || *p == '\0');
    assert(row->a >= 1 && row->c >= 0 && row->lower > 0 && row->lower < row->upper);
    *text = *p ? p + 1 : p;
    return true;
}

/* The host program's locale may write decimals with a comma; the table never does. */
static locale_t open_c_locale(void)
{
    locale_t c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    assert(c_locale);
    return c_locale;
}

bool keller_itu_known(const char *name)
{
    for (size_t i = 0; names[i]; i++)
        if (strcmp(names[i], name) == 0) return true;
    return false;
}

const char *const *keller_itu_names(void) { return names; }

/* Finds the row for a frequency. Two rows of one name may overlap; the one measured over the narrower band says more
 * about a frequency inside it. `ranges` receives the ranges of all rows of that name, for a message. */
static bool find_row(const char *name, double gigahertz, Row *best, char *ranges, size_t size)
{
    bool found = false;
    size_t used = 0;
    ranges[0] = '\0';
    locale_t c_locale = open_c_locale();
    const char *text = keller_data_itu_r_p2040_csv;
    for (Row row; next_row(&text, c_locale, &row);) {
        if (strcmp(row.name, name) != 0) continue;
        if (used < size) {
            int n = snprintf(ranges + used, size - used, "%s%g-%g GHz", used ? ", " : "", row.lower, row.upper);
            if (n > 0) used += (size_t)n;
        }
        if (gigahertz < row.lower || gigahertz > row.upper) continue;
        if (found && row.upper - row.lower >= best->upper - best->lower) continue;
        *best = row;
        found = true;
    }
    freelocale(c_locale);
    return found;
}

static double complex complex_permittivity(double permittivity, double conductivity, double frequency)
{
    return permittivity - I * (conductivity / (2 * M_PI * frequency * KELLER_VACUUM_PERMITTIVITY));
}

/* The permittivity of what a layer or a whole material is made of; `name` is the material's. */
static KellerStatus permittivity_of(const char *name, const KellerLayer *layer, double frequency, double complex *eta,
                                    KellerError *error)
{
    if (layer->kind == KELLER_MATERIAL_CONSTANT) {
        *eta = complex_permittivity(layer->permittivity, layer->conductivity, frequency);
        return KELLER_OK;
    }
    char ranges[256];
    double gigahertz = frequency / 1e9;
    Row row = {0};
    if (find_row(layer->itu, gigahertz, &row, ranges, sizeof ranges)) {
        *eta = complex_permittivity(row.a * pow(gigahertz, row.b), row.c * pow(gigahertz, row.d), frequency);
        return KELLER_OK;
    }
    if (!ranges[0])
        return keller_error(error, KELLER_BAD_INPUT,
                            "material \"%s\": \"%s\" is not in ITU-R P.2040-4; expected one of its names", name, layer->itu);
    return keller_error(error, KELLER_BAD_INPUT,
                        "material \"%s\": ITU-R P.2040-4 does not define %s at %.10g GHz; expected a frequency in %s, "
                        "or a permittivity and conductivity given outright",
                        name, layer->itu, gigahertz, ranges);
}

KellerStatus keller_medium(const KellerMaterial *material, double frequency, KellerMedium *medium, KellerError *error)
{
    assert(frequency > 0);
    const char *name = material->name ? material->name : "";
    *medium = (KellerMedium){.eta = 1, .thickness = material->thickness, .roughness = material->roughness,
                             .diffuse = material->diffuse};
    KellerStatus status = KELLER_OK;

    switch (material->kind) {
    case KELLER_MATERIAL_CONDUCTOR:
        medium->conductor = true;
        return KELLER_OK;
    case KELLER_MATERIAL_CONSTANT:
    case KELLER_MATERIAL_ITU: {
        KellerLayer whole = {.kind = material->kind, .permittivity = material->permittivity,
                             .conductivity = material->conductivity};
        memcpy(whole.itu, material->itu, sizeof whole.itu);
        return permittivity_of(name, &whole, frequency, &medium->eta, error);
    }
    case KELLER_MATERIAL_LAYERS:
        medium->layer_count = material->layer_count;
        for (uint32_t i = 0; i < material->layer_count && status == KELLER_OK; i++) {
            medium->layers[i].thickness = material->layers[i].thickness;
            status = permittivity_of(name, &material->layers[i], frequency, &medium->layers[i].eta, error);
        }
        return status;
    case KELLER_MATERIAL_RIGID:
    case KELLER_MATERIAL_ABSORPTION:
    case KELLER_MATERIAL_IMPEDANCE:
        keller_sound_medium(material, frequency, medium);
        return KELLER_OK;
    case KELLER_MATERIAL_NAMED:
        break;
    }
    return keller_error(error, KELLER_BAD_INPUT,
                        "material \"%s\" is only a name; expected an ITU-R P.2040-4 name, constants or a conductor",
                        name);
}
