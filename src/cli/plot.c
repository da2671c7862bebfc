#include <errno.h>
#include <stdio.h>
#include <string.h>
#include "cli/cli.h"
#include "cli/path_print.h"
#include "io/atomic.h"
#include "io/gnuplot.h"
#include "io/plot.h"

typedef struct {
    char *file;
    const char *tx, *rx, *grid, *output;
    uint32_t frequency;         /* from 1; 0: not given */
    KellerPlotKind kind;
    bool force, svg;
} Options;

static KellerStatus parse(int argc, char **argv, Options *o, KellerError *error)
{
    enum { WHAT, TX, RX, GRID, SET, FREQUENCY, OUTPUT, FORCE };
    static const KellerOption options[] = {{"what", 0, true}, {"tx", 0, true}, {"rx", 0, true}, {"grid", 0, true},
                                           {"set", 0, true}, {"frequency", 0, true}, {"output", 'o', true},
                                           {"force", 0, false}, {0}};
    KellerArguments arguments = {.verb = "plot", .argc = argc, .argv = argv};
    const char *value;
    for (;;) {
        KellerStatus status = KELLER_OK;
        switch (keller_next_argument(&arguments, options, &value, error)) {
        case WHAT:
            if (strcmp(value, "coverage") == 0) o->kind = KELLER_PLOT_COVERAGE;
            else if (strcmp(value, "delay") == 0) o->kind = KELLER_PLOT_DELAY;
            else if (strcmp(value, "level") == 0) o->kind = KELLER_PLOT_LEVEL;
            else if (strcmp(value, "paths") == 0) o->kind = KELLER_PLOT_PATHS;
            else return keller_usage(error, "plot", "--what is \"%.60s\"; expected coverage, delay, level or paths", value);
            break;
        case TX: o->tx = value; break;
        case RX: o->rx = value; break;
        case GRID:
        case SET: o->grid = value; break;
        case FREQUENCY:
            status = keller_whole_number("plot", "--frequency", value, 1, 1000000, &o->frequency, error);
            break;
        case OUTPUT: o->output = value; break;
        case FORCE: o->force = true; break;
        case KELLER_ARGUMENT_OPERAND:
            if (o->file) return keller_usage(error, "plot", "\"%s\" is one result too many", value);
            o->file = argv[arguments.next - 1];
            break;
        case KELLER_ARGUMENT_END: {
            if (!o->file) return keller_usage(error, "plot", "a result file is expected");
            if (!o->output) return keller_usage(error, "plot", "-o FILE.png or -o FILE.svg is expected");
            if (o->kind == KELLER_PLOT_DELAY && o->frequency > 0)
                return keller_usage(error, "plot", "--frequency: the delay map is that of the first frequency only");
            if (o->frequency == 0 && o->kind != KELLER_PLOT_LEVEL) o->frequency = 1;
            const char *dot = strrchr(o->output, '.');
            o->svg = dot && strcmp(dot, ".svg") == 0;
            if (!o->svg && (!dot || strcmp(dot, ".png") != 0))
                return keller_usage(error, "plot", "-o is \"%.200s\"; expected a name that ends in .png or .svg",
                                    o->output);
            return KELLER_OK;
        }
        default: return KELLER_USAGE;
        }
        if (status != KELLER_OK) return status;
    }
}

/* The grid with this id, or the first one. */
static KellerStatus find_grid(const KellerResultInfo *info, const Options *o, size_t *set, KellerError *error)
{
    const char *id = o->grid ? o->grid : o->rx;
    for (*set = 0; *set < info->set_count; ++*set)
        if (info->set_kinds[*set] == KELLER_SET_GRID && (!id || strcmp(info->set_ids[*set], id) == 0)) return KELLER_OK;
    if (!id)
        return keller_error(error, KELLER_BAD_INPUT, "%s: holds no grid; expected a result with a <grid>", o->file);
    return keller_error(error, KELLER_USAGE, "%s has no grid \"%.60s\"; see `keller info`", o->file, id);
}

static KellerStatus choose(const KellerResultInfo *info, const Options *o, KellerPlot *plot, KellerError *error)
{
    *plot = (KellerPlot){.file = o->file, .kind = o->kind, .svg = o->svg, .set = SIZE_MAX, .index = -1,
                         .frequency = o->frequency ? o->frequency - 1 : SIZE_MAX, .all = o->kind == KELLER_PLOT_LEVEL && !o->tx};
    if (info->transmitter_count == 0)
        return keller_error(error, KELLER_BAD_INPUT, "%s: holds no transmitter", o->file);
    if (o->frequency > info->frequency_count)
        return keller_error(error, KELLER_USAGE, "--frequency is %u, but %s has %llu", o->frequency, o->file,
                            (unsigned long long)info->frequency_count);
    KellerStatus status = o->tx ? keller_find_transmitter(info, o->file, o->tx, &plot->tx, error) : KELLER_OK;
    if (status != KELLER_OK) return status;
    if (o->kind != KELLER_PLOT_PATHS) return find_grid(info, o, &plot->set, error);
    const char *receivers = o->rx ? o->rx : o->grid;
    return receivers ? keller_find_receiver(info, o->file, receivers, &plot->set, &plot->index, error) : KELLER_OK;
}

static KellerStatus write_script(const Options *o, FILE *script, KellerError *error)
{
    KellerReader *reader = NULL;
    KellerPlot plot;
    KellerStatus status = keller_reader_open(o->file, &reader, error);
    if (status != KELLER_OK) return status;
    status = choose(keller_reader_info(reader), o, &plot, error);
    if (status == KELLER_OK)
        status = o->kind == KELLER_PLOT_PATHS ? keller_plot_paths(reader, &plot, script, error)
                                              : keller_plot_map(reader, &plot, script, error);
    keller_reader_close(reader);
    return status;
}

/* All of the result is read before the picture is begun. */
static KellerStatus draw(void *context, KellerError *error)
{
    const Options *o = context;
    FILE *script = tmpfile();
    if (!script) return keller_error(error, KELLER_IO, "%s: no temporary file: %s", o->output, strerror(errno));
    struct rlimit before;
    keller_limit_memory(o->file, &before);
    KellerStatus status = write_script(o, script, error);
    keller_lift_memory_limit(&before);
    KellerAtomic picture = {0};
    KellerInterrupt interrupt;
    if (status == KELLER_OK && !keller_interrupt_start(&interrupt))
        status = keller_error(error, KELLER_FAILED, "no thread for signals");
    else if (status == KELLER_OK) {
        keller_interrupt_hold(&interrupt);
        status = keller_atomic_begin(o->output, o->force, &picture, error);
        keller_interrupt_release(&interrupt, picture.temporary);
        if (status == KELLER_OK) {
            status = keller_gnuplot(script, picture.temporary, o->output, error);
            if (status == KELLER_OK) status = keller_atomic_finish(&picture, error);
        }
        keller_atomic_abandon(&picture);
        keller_interrupt_stop(&interrupt);
    }
    fclose(script);
    return status;
}

KellerStatus keller_cli_plot(int argc, char **argv, KellerError *error)
{
    Options options = {0};
    KellerStatus status = parse(argc, argv, &options, error);
    if (status == KELLER_OK) status = keller_refuse_input(options.output, options.file, "the result to draw", error);
    if (status == KELLER_OK) status = keller_atomic_check(options.output, options.force, error);
    return status == KELLER_OK ? keller_guarded(options.file, draw, &options, error) : status;
}
