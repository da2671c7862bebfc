/* keller scene: generate, convert, stats. */
#include "cli/scene.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include "cli/cli.h"
#include "io/atomic.h"
#include "io/scene_write.h"

KellerStatus keller_cli_scene(int argc, char **argv, KellerError *error)
{
    static const struct {
        const char *name;
        KellerStatus (*run)(int argc, char **argv, KellerError *error);
    } parts[] = {{"generate", keller_cli_scene_generate}, {"convert", keller_cli_scene_convert},
                 {"stats", keller_cli_scene_stats}};
    if (argc == 0) return keller_usage(error, "scene", "one of generate, convert or stats is expected");
    for (size_t i = 0; i < sizeof parts / sizeof *parts; ++i)
        if (strcmp(parts[i].name, argv[0]) == 0) return parts[i].run(argc - 1, argv + 1, error);
    return keller_usage(error, "scene", "unknown \"%.60s\"; expected generate, convert or stats", argv[0]);
}

KellerStatus keller_cli_scene_check_output(const char *output, bool force, KellerError *error)
{
    KellerWriteFormat format;
    if (!output) return keller_usage(error, "scene", "-o FILE is expected, FILE being .obj, .ply or .stl");
    if (!keller_write_format(output, &format))
        return keller_usage(error, "scene", "-o is \"%.200s\"; expected a name that ends in .obj, .ply or .stl",
                            output);
    return keller_atomic_check(output, force, error);
}

void keller_cli_scene_notes(const char *notes)
{
    while (*notes) {
        char line[400];
        size_t length = strcspn(notes, "\n");
        snprintf(line, sizeof line, "%.*s", (int)(length < sizeof line ? length : sizeof line - 1), notes);
        printf("  %-18s ", "note");
        keller_put_text(line);
        putchar('\n');
        notes += length + (notes[length] == '\n');
    }
}

static void print_written(const KellerSoup *soup, const char *output, KellerWriteFormat format,
                          const KellerWriteLoss *loss)
{
    static const char *const formats[] = {"OBJ", "PLY, binary, double precision", "STL, binary, single precision"};
    struct stat status;
    char number[32];
    printf("written\n");
    keller_row("file", "%s", output);
    keller_row("format", "%s", formats[format]);
    if (stat(output, &status) == 0) keller_row("size", "%s", keller_si((double)status.st_size, "B", number));
    keller_row("triangles", "%zu", soup->triangle_count);
    keller_row("vertices", "%zu", format == KELLER_WRITE_STL ? 3 * soup->triangle_count : soup->vertex_count);
    keller_row("objects", "%zu", soup->object_count - loss->objects);
    keller_row("materials", "%zu", soup->material_count - loss->materials);
    if (loss->objects + loss->materials > 0)
        keller_row("note", "the names of %zu objects and %zu materials are lost: %s holds none", loss->objects,
                   loss->materials, format == KELLER_WRITE_STL ? "STL" : "PLY");
    if (loss->constants > 0)
        keller_row("note", "%zu materials are names only: OBJ holds no thickness, permittivity or conductivity",
                   loss->constants);
    if (loss->renamed > 0)
        keller_row("note", "%zu materials got a _ before a name that would say something else", loss->renamed);
    if (loss->moved > 0)
        keller_row("note", "corners were rounded to single precision, by %s at most",
                   keller_si(loss->moved, "m", number));
}

KellerStatus keller_cli_scene_write_file(const KellerSoup *soup, const char *output, bool force, const char *comment,
                                         KellerError *error)
{
    KellerWriteFormat format = KELLER_WRITE_OBJ;
    KellerWriteLoss loss;
    KellerAtomic file = {0};
    KellerInterrupt interrupt;
    keller_write_format(output, &format);
    if (!keller_interrupt_start(&interrupt)) return keller_error(error, KELLER_FAILED, "no thread for signals");
    keller_interrupt_hold(&interrupt);
    KellerStatus status = keller_atomic_begin(output, force, &file, error);
    keller_interrupt_release(&interrupt, file.temporary);
    if (status == KELLER_OK) {
        status = keller_scene_write(soup, format, file.temporary, output, comment, &loss, error);
        if (status == KELLER_OK) status = keller_atomic_finish(&file, error);
    }
    keller_atomic_abandon(&file);
    keller_interrupt_stop(&interrupt);
    if (status == KELLER_OK) print_written(soup, output, format, &loss);
    return status;
}

KellerStatus keller_cli_scene_convert(int argc, char **argv, KellerError *error)
{
    enum { OUTPUT, FORCE };
    static const KellerOption options[] = {{"output", 'o', true}, {"force", 0, false}, {0}};
    KellerArguments arguments = {.verb = "scene", .argc = argc, .argv = argv};
    const char *value, *input = NULL, *output = NULL;
    bool force = false;
    for (int what; (what = keller_next_argument(&arguments, options, &value, error)) != KELLER_ARGUMENT_END;) {
        if (what == KELLER_ARGUMENT_WRONG) return KELLER_USAGE;
        if (what == OUTPUT) output = value;
        else if (what == FORCE) force = true;
        else if (input) return keller_usage(error, "scene", "convert: \"%.200s\" is one scene too many", value);
        else input = value;
    }
    if (!input) return keller_usage(error, "scene", "convert: a scene is expected");
    KellerStatus status = output ? keller_refuse_input(output, input, "the scene to convert", error) : KELLER_OK;
    if (status == KELLER_OK) status = keller_cli_scene_check_output(output, force, error);
    KellerSoup soup = {0};
    if (status == KELLER_OK) status = keller_soup_read(input, 1, &soup, error);
    if (status != KELLER_OK) return status;
    const char *slash = strrchr(input, '/');
    char comment[300];
    snprintf(comment, sizeof comment, "keller %s, converted from %.200s", KELLER_VERSION, slash ? slash + 1 : input);
    for (char *c = comment; *c; ++c)
        if ((unsigned char)*c < 32 || *c == 127) *c = '?';
    status = keller_cli_scene_write_file(&soup, output, force, comment, error);
    if (status == KELLER_OK) keller_cli_scene_notes(soup.notes);
    keller_soup_free(&soup);
    return status;
}
