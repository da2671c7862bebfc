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
    KellerAngle angle;
    bool force, svg, sum, incoherent;
} Options;

static KellerStatus parse_what(const char *value, Options *o, KellerError *error)
{
    static const struct { const char *name; KellerPlotKind kind; KellerAngle angle; } kinds[] = {
        {"coverage", KELLER_PLOT_COVERAGE, 0}, {"delay", KELLER_PLOT_DELAY, 0}, {"delay-spread", KELLER_PLOT_DELAY_SPREAD, 0},
        {"level", KELLER_PLOT_LEVEL, 0}, {"paths", KELLER_PLOT_PATHS, 0},
        {"departure-azimuth-spread", KELLER_PLOT_ANGLE_SPREAD, KELLER_DEPARTURE_AZIMUTH},
        {"departure-zenith-spread", KELLER_PLOT_ANGLE_SPREAD, KELLER_DEPARTURE_ZENITH},
        {"arrival-azimuth-spread", KELLER_PLOT_ANGLE_SPREAD, KELLER_ARRIVAL_AZIMUTH},
        {"arrival-zenith-spread", KELLER_PLOT_ANGLE_SPREAD, KELLER_ARRIVAL_ZENITH}};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; ++i) {
        if (strcmp(value, kinds[i].name) != 0) continue;
        o->kind = kinds[i].kind;
        o->angle = kinds[i].angle;
        return KELLER_OK;
    }
    return keller_usage(error, "plot", "--what is \"%.60s\"; expected coverage, delay, delay-spread, level, paths, or "
                        "departure-azimuth-spread, departure-zenith-spread, arrival-azimuth-spread, arrival-zenith-spread", value);
}

/* Options that say nothing about what is drawn. */
static KellerStatus refuse_useless(const Options *o, KellerError *error)
{
    bool of_first = o->kind == KELLER_PLOT_DELAY || o->kind == KELLER_PLOT_DELAY_SPREAD || o->kind == KELLER_PLOT_ANGLE_SPREAD;
    if (of_first && o->frequency > 0)
        return keller_usage(error, "plot", "--frequency: maps of delays and of spreads are those of the first frequency only");
    if (o->sum && o->kind != KELLER_PLOT_COVERAGE) return keller_usage(error, "plot", "--sum is for --what coverage");
    return KELLER_OK;
}

static KellerStatus parse(int argc, char **argv, Options *o, KellerError *error)
{
    enum { WHAT, SUM, TX, RX, GRID, SET, FREQUENCY, OUTPUT, FORCE };
    static const KellerOption options[] = {{"what", 0, true}, {"sum", 0, true}, {"tx", 0, true}, {"rx", 0, true}, {"grid", 0, true},
                                           {"set", 0, true}, {"frequency", 0, true}, {"output", 'o', true},
                                           {"force", 0, false}, {0}};
    KellerArguments arguments = {.verb = "plot", .argc = argc, .argv = argv};
    const char *value;
    for (;;) {
        KellerStatus status = KELLER_OK;
        switch (keller_next_argument(&arguments, options, &value, error)) {
        case WHAT:
            status = parse_what(value, o, error);
            break;
        case SUM:
            o->sum = true;
            o->incoherent = strcmp(value, "incoherent") == 0;
            if (!o->incoherent && strcmp(value, "coherent") != 0)
                status = keller_usage(error, "plot", "--sum is \"%.60s\"; expected coherent or incoherent", value);
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
            if (refuse_useless(o, error) != KELLER_OK) return KELLER_USAGE;
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
    *plot = (KellerPlot){.file = o->file, .kind = o->kind, .incoherent = o->incoherent, .angle = o->angle, .svg = o->svg, .set = SIZE_MAX, .index = -1,
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
