#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "cli/cli.h"
#include "cli/export.h"
#include "cli/path_print.h"
#include "io/atomic.h"
#include "io/wav.h"

static KellerStatus parse(int argc, char **argv, KellerExport *o, KellerError *error)
{
    enum { TX, RX, GRID, SUM, OUTPUT, FORCE };
    static const KellerOption options[] = {{"tx", 0, true}, {"rx", 0, true}, {"grid", 0, true}, {"sum", 0, true},
                                           {"output", 'o', true}, {"force", 0, false}, {0}};
    KellerArguments arguments = {.verb = "export", .argc = argc, .argv = argv};
    const char *value;
    for (;;) {
        switch (keller_next_argument(&arguments, options, &value, error)) {
        case TX: o->tx = value; break;
        case RX: o->rx = value; break;
        case GRID: o->grid = value; break;
        case SUM:
            o->sum = true;
            o->incoherent = strcmp(value, "incoherent") == 0;
            if (!o->incoherent && strcmp(value, "coherent") != 0)
                return keller_usage(error, "export", "--sum is \"%.60s\"; expected coherent or incoherent", value);
            break;
        case OUTPUT: o->output = value; break;
        case FORCE: o->force = true; break;
        case KELLER_ARGUMENT_OPERAND:
            if (o->file) return keller_usage(error, "export", "\"%s\" is one result too many", value);
            o->file = argv[arguments.next - 1];
            break;
        case KELLER_ARGUMENT_END: {
            if (!o->file) return keller_usage(error, "export", "a result file is expected");
            const char *dot = o->output ? strrchr(o->output, '.') : NULL;
            bool wav = dot && strcmp(dot, ".wav") == 0, csv = dot && strcmp(dot, ".csv") == 0;
            if (!wav && !csv)
                return keller_usage(error, "export", "-o is \"%.200s\"; expected a name that ends in .wav or .csv",
                                    o->output ? o->output : "");
            if (wav && (o->grid || o->sum)) return keller_usage(error, "export", "--grid and --sum are for maps, -o FILE.csv");
            if (csv && o->rx) return keller_usage(error, "export", "--rx is for impulse responses, -o FILE.wav");
            return KELLER_OK;
        }
        default: return KELLER_USAGE;
        }
    }
}

/* The row of /responses for the pair asked for; where no end is named, the first. */
static KellerStatus find_response(KellerReader *reader, const KellerExport *o, uint64_t *row, KellerError *error)
{
    const KellerResultInfo *info = keller_reader_info(reader);
    size_t tx = SIZE_MAX, set = SIZE_MAX;
    int64_t index = -1;
    KellerStatus status = o->tx ? keller_find_transmitter(info, o->file, o->tx, &tx, error) : KELLER_OK;
    if (status == KELLER_OK && o->rx) status = keller_find_receiver(info, o->file, o->rx, &set, &index, error);
    if (status != KELLER_OK) return status;
    if (info->responses == 0)
        return keller_error(error, KELLER_BAD_INPUT,
                            "%s: holds no impulse response; expected a run of domain acoustic with <response>",
                            o->file);
    for (*row = 0; *row < info->responses; ++*row) {
        uint32_t pair[2];
        status = keller_reader_rows(reader, "/responses/tx", KELLER_CELL_U4, 1, *row, 1, &pair[0], error);
        if (status == KELLER_OK) status = keller_reader_rows(reader, "/responses/rx", KELLER_CELL_U4, 1, *row, 1, &pair[1],
                                                             error);
        if (status != KELLER_OK) return status;
        if (pair[0] >= info->transmitter_count || pair[1] >= info->receiver_count)
            return keller_error(error, KELLER_BAD_INPUT,
                                "%s: /responses name a station that is not there; expected a complete result of "
                                                         "keller run", o->file);
        if (tx != SIZE_MAX && pair[0] != tx) continue;
        if (set != SIZE_MAX && info->receiver_sets[pair[1]] != set) continue;
        if (index >= 0 && info->receiver_indices[pair[1]] != index) continue;
        return KELLER_OK;
    }
    return keller_error(error, KELLER_USAGE, "%s has no impulse response of that pair; see `keller info`", o->file);
}

typedef struct {
    double rate;
    uint64_t count;
    float *samples;             /* owned */
    bool tail;                  /* a part of it is statistical */
} Sound;

static KellerStatus read_sound(const KellerExport *o, Sound *sound, KellerError *error)
{
    KellerReader *reader = NULL;
    uint64_t row = 0;
    KellerStatus status = keller_reader_open(o->file, &reader, error);
    if (status != KELLER_OK) return status;
    status = find_response(reader, o, &row, error);
    sound->count = keller_reader_info(reader)->response_samples;
    sound->tail = keller_reader_has(reader, "/responses/tail");
    double *values = malloc((sound->count + 1) * sizeof *values);
    sound->samples = malloc((sound->count + 1) * sizeof *sound->samples);
    if (status == KELLER_OK && (!values || !sound->samples)) status = keller_error_memory(error, sound->count * sizeof *values);
    if (status == KELLER_OK) status = keller_reader_box(reader, "/responses/rate", KELLER_CELL_F8, 0, NULL, NULL,
                                                        &sound->rate, error);
    if (status == KELLER_OK && !(sound->rate >= 1 && sound->rate <= 1e6))
        status = keller_error(error, KELLER_BAD_INPUT, "%s: /responses/rate is %g; expected a sampling rate", o->file,
                              sound->rate);
    if (status == KELLER_OK)
        status = keller_reader_rows(reader, "/responses/pressure", KELLER_CELL_F8, sound->count, row, 1, values, error);
    for (uint64_t i = 0; i < sound->count && status == KELLER_OK; i++) sound->samples[i] = (float)values[i];
    free(values);
    keller_reader_close(reader);
    return status;
}

KellerStatus keller_export_file(const KellerExport *o, KellerStatus (*write)(void *context, const char *temporary, KellerError *error),
                                void *context, KellerError *error)
{
    KellerAtomic target = {0};
    KellerInterrupt interrupt;
    if (!keller_interrupt_start(&interrupt)) return keller_error(error, KELLER_FAILED, "no thread for signals");
    keller_interrupt_hold(&interrupt);
    KellerStatus status = keller_atomic_begin(o->output, o->force, &target, error);
    keller_interrupt_release(&interrupt, target.temporary);
    if (status == KELLER_OK) status = write(context, target.temporary, error);
    if (status == KELLER_OK) status = keller_atomic_finish(&target, error);
    keller_atomic_abandon(&target);
    keller_interrupt_stop(&interrupt);
    return status;
}

typedef struct {
    const KellerExport *options;
    const Sound *sound;
    double scale;
} SoundFile;

static KellerStatus write_wav(void *context, const char *temporary, KellerError *error)
{
    SoundFile *f = context;
    return keller_wav_write(temporary, f->options->output, (size_t)f->sound->count, f->sound->samples, f->sound->rate, &f->scale, error);
}

static KellerStatus write_sound(const KellerExport *o, const Sound *sound, KellerError *error)
{
    SoundFile file = {.options = o, .sound = sound, .scale = 1};
    KellerStatus status = keller_export_file(o, write_wav, &file, error);
    double scale = file.scale;
    if (status == KELLER_OK && scale != 1)
        fprintf(stderr, "keller: %s: multiplied by %.6g, so that nothing clips\n", o->output, scale);
    if (status == KELLER_OK && sound->tail)
        fprintf(stderr,
                "keller: %s: holds the statistical tail that was asked for; /responses/tail of the result is that part alone\n",
                o->output);
    return status;
}

static KellerStatus export(void *context, KellerError *error)
{
    const KellerExport *o = context;
    if (strcmp(strrchr(o->output, '.'), ".csv") == 0) return keller_export_maps(o, error);
    Sound sound = {0};
    struct rlimit before;
    keller_limit_memory(o->file, &before);
    KellerStatus status = read_sound(o, &sound, error);
    keller_lift_memory_limit(&before);
    if (status == KELLER_OK) status = write_sound(o, &sound, error);
    free(sound.samples);
    return status;
}

KellerStatus keller_cli_export(int argc, char **argv, KellerError *error)
{
    KellerExport options = {0};
    KellerStatus status = parse(argc, argv, &options, error);
    if (status == KELLER_OK) status = keller_refuse_input(options.output, options.file, "the result to export", error);
    if (status == KELLER_OK) status = keller_atomic_check(options.output, options.force, error);
    return status == KELLER_OK ? keller_guarded(options.file, export, &options, error) : status;
}
