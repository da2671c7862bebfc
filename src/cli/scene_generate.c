#include <stdio.h>
#include <string.h>
#include "cli/cli.h"
#include "cli/scene.h"
#include "io/generate.h"
#include "io/units.h"

enum { SEED, BLOCKS, LAYOUT, TRIANGLES, STRANDS, COUNT, SIZE, OUTPUT, FORCE, OPTIONS };

#define BIT(option) (1u << (option))
#define ALWAYS (BIT(SEED) | BIT(OUTPUT) | BIT(FORCE))

static const KellerOption options[] = {{"seed", 0, true},      {"blocks", 0, true}, {"layout", 0, true},
                                       {"triangles", 0, true}, {"strands", 0, true}, {"count", 0, true},
                                       {"size", 0, true},      {"output", 'o', true}, {"force", 0, false}, {0}};

static const struct {
    const char *name;
    unsigned allowed;
} kinds[] = {
    [KELLER_GENERATE_CITY] = {"city", ALWAYS | BIT(BLOCKS) | BIT(LAYOUT) | BIT(TRIANGLES)},
    [KELLER_GENERATE_RANDOM] = {"random", ALWAYS | BIT(TRIANGLES) | BIT(SIZE)},
    [KELLER_GENERATE_SLIVERS] = {"slivers-sphere", ALWAYS | BIT(TRIANGLES) | BIT(SIZE)},
    [KELLER_GENERATE_HAIR] = {"hair", ALWAYS | BIT(STRANDS) | BIT(SIZE)},
    [KELLER_GENERATE_LAYERS] = {"layers", ALWAYS | BIT(COUNT) | BIT(SIZE)},
    [KELLER_GENERATE_TERRAIN] = {"terrain", ALWAYS | BIT(TRIANGLES) | BIT(COUNT) | BIT(SIZE)},
};
enum { KINDS = sizeof kinds / sizeof *kinds };

typedef struct {
    KellerGenerate def;
    const char *output;
    bool force;
    unsigned given;
} Wanted;

static KellerStatus whole(const char *option, const char *text, uint32_t least, uint32_t most, uint64_t *value,
                          KellerError *error)
{
    uint32_t number = 0;
    KellerStatus status = keller_whole_number("scene", option, text, least, most, &number, error);
    *value = number;
    return status;
}

static KellerStatus kind_of(const char *name, Wanted *w, KellerError *error)
{
    for (int i = 0; i < KINDS; ++i) {
        if (strcmp(kinds[i].name, name) != 0) continue;
        w->def = keller_generate_defaults((KellerGenerateKind)i);
        return KELLER_OK;
    }
    return keller_usage(error, "scene",
                        "generate: unknown \"%.60s\"; expected city, random, slivers-sphere, hair, layers or terrain", name);
}

static KellerStatus option(Wanted *w, int what, const char *value, KellerError *error)
{
    KellerGenerate *def = &w->def;
    w->given |= BIT(what);
    switch (what) {
    case SEED: return whole("--seed", value, 0, UINT32_MAX, &def->seed, error);
    case BLOCKS: return whole("--blocks", value, 1, 10000000, &def->blocks, error);
    case TRIANGLES: return whole("--triangles", value, 1, 100000000, &def->triangles, error);
    case STRANDS: return whole("--strands", value, 1, 10000000, &def->strands, error);
    case COUNT:
        if (def->kind == KELLER_GENERATE_TERRAIN) return whole("--count", value, 0, KELLER_GENERATE_HOUSES, &def->houses, error);
        return whole("--count", value, 1, 1000000, &def->sheets, error);
    case LAYOUT:
        def->star = strcmp(value, "star") == 0;
        if (def->star || strcmp(value, "grid") == 0) return KELLER_OK;
        return keller_usage(error, "scene", "--layout is \"%.60s\"; expected grid or star", value);
    case SIZE:
        if (keller_parse_number(value, &def->size) && def->size >= 1e-3 && def->size <= 1e6) return KELLER_OK;
        return keller_usage(error, "scene", "--size is \"%.60s\"; expected metres, from 0.001 to 1000000", value);
    case OUTPUT: w->output = value; return KELLER_OK;
    default: w->force = true; return KELLER_OK;
    }
}

static KellerStatus parse(int argc, char **argv, Wanted *w, KellerError *error)
{
    /* The kind may stand anywhere; its defaults must be there before the options. */
    KellerArguments arguments = {.verb = "scene", .argc = argc, .argv = argv};
    const char *value, *kind = NULL;
    for (int what; (what = keller_next_argument(&arguments, options, &value, error)) != KELLER_ARGUMENT_END;) {
        if (what == KELLER_ARGUMENT_WRONG) return KELLER_USAGE;
        if (what != KELLER_ARGUMENT_OPERAND) continue;
        if (kind) return keller_usage(error, "scene", "generate: \"%.60s\" is one kind of scene too many", value);
        kind = value;
    }
    if (!kind)
        return keller_usage(error, "scene", "generate: city, random, slivers-sphere, hair, layers or terrain is expected");
    KellerStatus status = kind_of(kind, w, error);
    arguments = (KellerArguments){.verb = "scene", .argc = argc, .argv = argv};
    for (int what; status == KELLER_OK &&
                   (what = keller_next_argument(&arguments, options, &value, error)) != KELLER_ARGUMENT_END;)
        if (what >= 0) status = option(w, what, value, error);
    for (int i = 0; status == KELLER_OK && i < OPTIONS; ++i)
        if (w->given & ~kinds[w->def.kind].allowed & BIT(i))
            status = keller_usage(error, "scene", "generate %s: --%s is not for this kind of scene", kind,
                                  options[i].name);
    if (status == KELLER_OK && w->given & BIT(BLOCKS) && w->given & BIT(TRIANGLES))
        status = keller_usage(error, "scene", "--blocks and --triangles exclude each other");
    return status;
}

/* How to make the scene again. */
static void recipe(const KellerGenerate *def, char *text, size_t size)
{
    const unsigned long long seed = def->seed;
    const char *name = kinds[def->kind].name;
    int used = snprintf(text, size, "keller %s scene generate %s --seed %llu", KELLER_VERSION, name, seed);
    text += used;
    size -= (size_t)used;
    switch (def->kind) {
    case KELLER_GENERATE_CITY:
        snprintf(text, size, " --blocks %llu --layout %s", (unsigned long long)def->blocks,
                 def->star ? "star" : "grid");
        break;
    case KELLER_GENERATE_RANDOM:
    case KELLER_GENERATE_SLIVERS:
        snprintf(text, size, " --triangles %llu --size %.17g", (unsigned long long)def->triangles, def->size);
        break;
    case KELLER_GENERATE_HAIR:
        snprintf(text, size, " --strands %llu --size %.17g", (unsigned long long)def->strands, def->size);
        break;
    case KELLER_GENERATE_LAYERS:
        snprintf(text, size, " --count %llu --size %.17g", (unsigned long long)def->sheets, def->size);
        break;
    case KELLER_GENERATE_TERRAIN:
        snprintf(text, size, " --triangles %llu --count %llu --size %.17g", (unsigned long long)def->triangles,
                 (unsigned long long)def->houses, def->size);
        break;
    }
}

KellerStatus keller_cli_scene_generate(int argc, char **argv, KellerError *error)
{
    Wanted wanted = {0};
    KellerSoup soup = {0};
    KellerStatus status = parse(argc, argv, &wanted, error);
    if (status == KELLER_OK) status = keller_cli_scene_check_output(wanted.output, wanted.force, error);
    if (status != KELLER_OK) return status;
    KellerGenerate *def = &wanted.def;
    if (def->kind == KELLER_GENERATE_CITY && wanted.given & BIT(TRIANGLES))
        def->blocks = keller_generate_blocks(def->seed, def->star, def->triangles);
    status = keller_generate(def, &soup, error);
    if (status == KELLER_OK) {
        char text[300];
        recipe(def, text, sizeof text);
        status = keller_cli_scene_write_file(&soup, wanted.output, wanted.force, text, error);
        if (status == KELLER_OK) keller_row("made by", "%s", text);
    }
    keller_soup_free(&soup);
    return status;
}
