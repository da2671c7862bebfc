#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "cli/cli.h"
#include "cli/pair_print.h"
#include "io/pair_rows.h"

/* ---- a result ---------------------------------------------------------------------------------------------------- */

static void print_statistic(void *context, const char *name, double value, const char *unit, const char *text)
{
    (void)context;
    printf("  ");
    keller_put_text(name);
    printf("%*s ", (int)(strlen(name) < 18 ? 18 - strlen(name) : 0), "");
    if (text) keller_put_text(text);
    else if (strcmp(unit, "1") == 0) printf("%.15g", value);
    else printf("%.6g ", value), keller_put_text(unit);
    putchar('\n');
}

static KellerStatus print_pair(void *context, const KellerPairSums *sums, KellerError *error)
{
    (void)error;
    printf("  ");
    keller_pair_print(context, sums);
    return KELLER_OK;
}

/* The first pairs; results of earlier programs have none. */
static KellerStatus print_pairs(KellerReader *reader, const char *file, KellerError *error)
{
    enum { SHOWN = 8 };
    KellerPathPrinter printer;
    uint64_t count = 0;
    if (!keller_reader_has(reader, "/pairs/tx")) return KELLER_OK;
    KellerStatus status = keller_pair_count(reader, file, &count, error);
    if (status != KELLER_OK || count == 0) return status;
    printf("pairs\n  ");
    keller_pair_print_start(&printer, keller_reader_info(reader), KELLER_PATHS_TABLE);
    status = keller_each_pair(reader, file, SHOWN, print_pair, &printer, error);
    if (status == KELLER_OK && count > SHOWN) printf("  and %llu more: keller paths --pairs\n", (unsigned long long)(count - SHOWN));
    return status;
}

static KellerStatus result_info(void *context, KellerError *error)
{
    const char *file = context;
    struct rlimit before;
    keller_limit_memory(file, &before);
    KellerReader *reader = NULL;
    KellerStatus status = keller_reader_open(file, &reader, error);
    if (status != KELLER_OK) return status;
    const KellerResultInfo *info = keller_reader_info(reader);
    char number[32];
    printf("result\n");
    keller_row("file", "%s", file);
    const struct { const char *name, *text; } attributes[] = {
        {"program version", info->program_version}, {"created", info->created},
        {"domain", info->domain}, {"config sha256", info->config_sha256}, {"command line", info->command_line}};
    keller_row("format version", "%u", info->format_version);
    for (size_t i = 0; i < sizeof attributes / sizeof *attributes; ++i) {
        printf("  %-18s ", attributes[i].name);
        keller_put_text(attributes[i].text);
        putchar('\n');
    }
    printf("  %-18s", "frequencies");
    for (uint64_t f = 0; f < info->frequency_count && f < 12; ++f)
        printf("%s %s", f ? "," : "", keller_si(info->frequencies[f], "Hz", number));
    puts(info->frequency_count > 12 ? ", ..." : "");
    keller_row_of_texts("transmitters", info->transmitter_ids, info->transmitter_count, 12);
    keller_row("receivers", "%llu", (unsigned long long)info->receiver_count);
    uint64_t shown = info->set_count < 20 ? info->set_count : 20;
    for (uint64_t s = 0; s < shown; ++s) {
        static const char *const kinds[] = {"point", "route", "grid"};
        printf("  %-18s ", s ? "" : "sets");
        keller_put_text(info->set_ids[s]);
        printf(": %s", kinds[info->set_kinds[s]]);
        if (info->set_kinds[s] == KELLER_SET_GRID) printf(", %u x %u", info->set_shapes[s][1], info->set_shapes[s][0]);
        putchar('\n');
    }
    if (shown < info->set_count) keller_row("", "and %llu more", (unsigned long long)(info->set_count - shown));
    keller_row_of_texts("materials", info->materials, info->material_count, 12);
    if (info->triangles > 0)
        keller_row("scene", "%llu triangles, %llu vertices, %llu objects, %llu wedges",
                   (unsigned long long)info->triangles, (unsigned long long)info->vertices,
                   (unsigned long long)info->objects, (unsigned long long)info->wedges);
    else keller_row("scene", "not stored, or empty");
    keller_row("paths", "%llu with %llu interactions", (unsigned long long)info->paths,
               (unsigned long long)info->interactions);
    status = print_pairs(reader, file, error);
    if (status == KELLER_OK) {
        printf("statistics\n");
        status = keller_reader_statistics(reader, print_statistic, NULL, error);
    }
    keller_reader_close(reader);
    return status;
}

/* ---- a configuration, a scene ------------------------------------------------------------------------------------ */

static KellerStatus config_info(const char *file, const KellerVariables *variables, KellerError *error)
{
    KellerConfig config;
    KellerStatus status = keller_config_read(file, variables->count, variables->list, &config, error);
    if (status != KELLER_OK) return status;
    keller_print_configuration(&config);
    keller_config_free(&config);
    return KELLER_OK;
}

/* A scene's names alone do not say what it is made of; for its geometry a stand-in will do. */
static KellerStatus stand_in_materials(KellerSoup *soup, KellerError *error)
{
    bool without = false;
    for (size_t t = 0; t < soup->triangle_count; ++t) without |= soup->material[t] == KELLER_NO_MATERIAL;
    for (size_t i = 0; i < soup->material_count; ++i)
        if (soup->materials[i].kind == KELLER_MATERIAL_NAMED) soup->materials[i].kind = KELLER_MATERIAL_CONDUCTOR;
    if (!without) return KELLER_OK;
    size_t bytes = (soup->material_count + 1) * sizeof *soup->materials;
    KellerMaterial *materials = realloc(soup->materials, bytes);
    if (!materials) return keller_error_memory(error, bytes);
    soup->materials = materials;
    materials[soup->material_count] = (KellerMaterial){.name = strdup("(none)"), .kind = KELLER_MATERIAL_CONDUCTOR};
    if (!materials[soup->material_count].name) return keller_error_memory(error, 8);
    for (size_t t = 0; t < soup->triangle_count; ++t)
        if (soup->material[t] == KELLER_NO_MATERIAL) soup->material[t] = (uint32_t)soup->material_count;
    ++soup->material_count;
    return KELLER_OK;
}

static KellerStatus scene_info(const char *file, KellerError *error)
{
    KellerSoup soup;
    KellerStatus status = keller_soup_read(file, 1, &soup, error);
    if (status != KELLER_OK) return status;
    printf("file %s\nmaterials of the scene\n", file);
    for (size_t i = 0; i < soup.material_count && i < 40; ++i) {
        const KellerMaterial *m = &soup.materials[i];
        keller_row(m->name, "%s%s",
                   m->kind == KELLER_MATERIAL_ITU     ? "ITU "
                   : m->kind == KELLER_MATERIAL_NAMED ? "to be defined by a configuration"
                                                      : "defined by the scene",
                   m->kind == KELLER_MATERIAL_ITU ? m->itu : "");
    }
    if (soup.material_count > 40) keller_row("", "and %zu more", soup.material_count - 40);
    KellerScene scene;
    status = stand_in_materials(&soup, error);
    if (status == KELLER_OK) status = keller_build_scene_of(file, &soup, &scene, error);
    if (status == KELLER_OK) {
        size_t materials = scene.material_count;
        scene.material_count = 0;   /* told above, as the file says it */
        keller_print_scene(&soup, &scene, true);
        scene.material_count = materials;
        keller_scene_free(&scene);
    }
    keller_soup_free(&soup);
    return status;
}

/* ---- which of them ----------------------------------------------------------------------------------------------- */

typedef enum { RESULT, CONFIGURATION, SCENE } Kind;

/* True if the first element of this XML text is <simulation>. */
static bool is_simulation(const char *text)
{
    if (strncmp(text, "\xef\xbb\xbf", 3) == 0) text += 3;
    for (;;) {
        text = strchr(text, '<');
        if (!text) return false;
        const char *end = NULL;
        if (strncmp(text, "<!--", 4) == 0) end = strstr(text, "-->");
        else if (text[1] == '?') end = strstr(text, "?>");
        else if (text[1] == '!') end = strchr(text, '>');
        else return strncmp(text, "<simulation", 11) == 0;
        if (!end) return false;
        text = end;
    }
}

static KellerStatus kind_of(const char *file, Kind *kind, KellerError *error)
{
    FILE *stream = fopen(file, "rb");
    if (!stream) return keller_error(error, KELLER_IO, "%s: cannot be opened: %s", file, strerror(errno));
    char head[65536];
    size_t size = fread(head, 1, sizeof head - 1, stream);
    if (ferror(stream)) {
        fclose(stream);
        return keller_error(error, KELLER_IO, "%s: cannot be read: %s", file, strerror(errno));
    }
    fclose(stream);
    head[size] = '\0';
    const char *dot = strrchr(file, '.');
    bool xml = dot && strcmp(dot, ".xml") == 0, h5 = dot && strcmp(dot, ".h5") == 0;
    static const char signature[] = "\x89HDF\r\n\x1a\n";
    if (h5 || (size >= 8 && memcmp(head, signature, 8) == 0)) *kind = RESULT;
    else if (is_simulation(head)) *kind = CONFIGURATION;
    else if (xml && !strstr(head, "<scene")) *kind = CONFIGURATION;   /* its reader says what is wrong */
    else *kind = SCENE;
    return KELLER_OK;
}

KellerStatus keller_cli_info(int argc, char **argv, KellerError *error)
{
    enum { DEFINE };
    static const KellerOption options[] = {{NULL, 'D', true}, {0}};
    KellerArguments arguments = {.verb = "info", .argc = argc, .argv = argv};
    KellerVariables variables = {0};
    const char *value;
    char *file = NULL;
    KellerStatus status = KELLER_OK;
    for (int what; status == KELLER_OK &&
                   (what = keller_next_argument(&arguments, options, &value, error)) != KELLER_ARGUMENT_END;) {
        if (what == DEFINE) status = keller_variables_add(&variables, "info", value, error);
        else if (what == KELLER_ARGUMENT_WRONG) status = KELLER_USAGE;
        else if (file) status = keller_usage(error, "info", "\"%s\" is one file too many", value);
        else file = argv[arguments.next - 1];
    }
    if (status == KELLER_OK && !file) status = keller_usage(error, "info", "a file is expected");
    Kind kind = SCENE;
    if (status == KELLER_OK) status = kind_of(file, &kind, error);
    if (status == KELLER_OK) {
        switch (kind) {
        case RESULT: status = keller_guarded(file, result_info, file, error); break;
        case CONFIGURATION: status = config_info(file, &variables, error); break;
        case SCENE: status = scene_info(file, error); break;
        }
    }
    keller_variables_free(&variables);
    return status;
}
