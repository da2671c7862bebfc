#define _GNU_SOURCE
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "cli/cli.h"
#include "cli/export_maps.h"
#include "cli/path_print.h"
#include "io/atomic.h"
#include "io/wav.h"

typedef struct {
    char *file;
    const char *tx, *rx, *grid, *output;
    bool force, sound;          /* a sound file, else a map: */
    KellerExportFormat format;
} Options;

/* What the output's name asks for; false: nothing. */
static bool format_of(Options *o)
{
    static const char *const endings[] = {[KELLER_EXPORT_CSV] = ".csv", [KELLER_EXPORT_JSON] = ".json", [KELLER_EXPORT_XDMF] = ".xdmf"};
    const char *dot = o->output ? strrchr(o->output, '.') : NULL;
    o->sound = dot && strcmp(dot, ".wav") == 0;
    for (int i = 0; dot && i < 3; i++) {
        o->format = (KellerExportFormat)i;
        if (strcmp(dot, endings[i]) == 0) return true;
    }
    return o->sound;
}

static KellerStatus parse(int argc, char **argv, Options *o, KellerError *error)
{
    enum { TX, RX, GRID, OUTPUT, FORCE };
    static const KellerOption options[] = {{"tx", 0, true}, {"rx", 0, true}, {"grid", 0, true}, {"output", 'o', true}, {"force", 0, false}, {0}};
    KellerArguments arguments = {.verb = "export", .argc = argc, .argv = argv};
    const char *value;
    for (;;) {
        switch (keller_next_argument(&arguments, options, &value, error)) {
        case TX: o->tx = value; break;
        case RX: o->rx = value; break;
        case GRID: o->grid = value; break;
        case OUTPUT: o->output = value; break;
        case FORCE: o->force = true; break;
        case KELLER_ARGUMENT_OPERAND:
            if (o->file) return keller_usage(error, "export", "\"%s\" is one result too many", value);
            o->file = argv[arguments.next - 1];
            break;
        case KELLER_ARGUMENT_END:
            if (!o->file) return keller_usage(error, "export", "a result file is expected");
            if (!format_of(o))
                return keller_usage(error, "export", "-o is \"%.200s\"; expected a name that ends in .csv, .json, .xdmf or .wav",
                                    o->output ? o->output : "");
            if (o->sound ? o->grid != NULL : o->tx || o->rx)
                return keller_usage(error, "export", "%s is not for %s", o->sound ? "--grid" : o->tx ? "--tx" : "--rx",
                                    o->sound ? "sound files" : "maps");
            if (o->grid && o->format == KELLER_EXPORT_XDMF)
                return keller_usage(error, "export", "--grid is not for .xdmf, which describes all grids");
            return KELLER_OK;
        default: return KELLER_USAGE;
        }
    }
}

/* The row of /responses for the pair asked for; where no end is named, the first. */
static KellerStatus find_response(KellerReader *reader, const Options *o, uint64_t *row, KellerError *error)
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

static KellerStatus read_sound(const Options *o, Sound *sound, KellerError *error)
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

static KellerStatus write_sound(const Options *o, const Sound *sound, KellerError *error)
{
    KellerAtomic target = {0};
    KellerInterrupt interrupt;
    double scale = 1;
    if (!keller_interrupt_start(&interrupt)) return keller_error(error, KELLER_FAILED, "no thread for signals");
    keller_interrupt_hold(&interrupt);
    KellerStatus status = keller_atomic_begin(o->output, o->force, &target, error);
    keller_interrupt_release(&interrupt, target.temporary);
    if (status == KELLER_OK)
        status = keller_wav_write(target.temporary, o->output, (size_t)sound->count, sound->samples, sound->rate, &scale,
                                  error);
    if (status == KELLER_OK) status = keller_atomic_finish(&target, error);
    keller_atomic_abandon(&target);
    keller_interrupt_stop(&interrupt);
    if (status == KELLER_OK && scale != 1)
        fprintf(stderr, "keller: %s: multiplied by %.6g, so that nothing clips\n", o->output, scale);
    if (status == KELLER_OK && sound->tail)
        fprintf(stderr,
                "keller: %s: holds the statistical tail that was asked for; /responses/tail of the result is that part alone\n",
                o->output);
    return status;
}

/* ---- maps ---------------------------------------------------------------------------------------------------------- */

static KellerStatus find_grid(const KellerResultInfo *info, const Options *o, size_t *set, KellerError *error)
{
    for (*set = 0; *set < info->set_count; ++*set)
        if (info->set_kinds[*set] == KELLER_SET_GRID && (!o->grid || strcmp(info->set_ids[*set], o->grid) == 0)) return KELLER_OK;
    if (o->grid) return keller_error(error, KELLER_USAGE, "%s has no grid \"%.60s\"; see `keller info`", o->file, o->grid);
    return keller_error(error, KELLER_BAD_INPUT, "%s: holds no grid; expected a result with a <grid>", o->file);
}

/* The result as the description's folder sees it: by its name where it lies there too, else from the root. Owned by the caller. */
static char *link_of(const Options *o)
{
    char *folder = strdup(o->output), *slash = folder ? strrchr(folder, '/') : NULL;
    if (slash) slash[1] = '\0';
    char *here = folder ? realpath(slash ? folder : ".", NULL) : NULL, *there = realpath(o->file, NULL), *name = there ? strrchr(there, '/') : NULL;
    bool beside = here && name && strlen(here) == (size_t)(name - there) && strncmp(here, there, strlen(here)) == 0;
    char *link = beside ? strdup(name + 1) : there ? strdup(there) : NULL;
    free(folder);
    free(here);
    free(there);
    return link;
}

static KellerStatus read_maps(const Options *o, FILE *out, KellerError *error)
{
    KellerReader *reader = NULL;
    size_t set = 0;
    KellerStatus status = keller_reader_open(o->file, &reader, error);
    if (status != KELLER_OK) return status;
    char *link = link_of(o);
    if (!link) status = keller_error(error, KELLER_IO, "%s: its folder cannot be found: %s", o->output, strerror(errno));
    if (status == KELLER_OK) status = find_grid(keller_reader_info(reader), o, &set, error);
    if (status == KELLER_OK) status = keller_export_maps(reader, o->file, set, o->format, link, out, error);
    free(link);
    keller_reader_close(reader);
    return status;
}

/* From a temporary file, so that no interruption leaves the target behind half-written, or what reading it did. */
static KellerStatus copy(FILE *from, const KellerAtomic *target, const char *name, KellerError *error)
{
    char block[65536];
    FILE *to = fopen(target->temporary, "wb");
    bool good = to && fflush(from) == 0 && fseeko(from, 0, SEEK_SET) == 0;
    for (size_t n; good && (n = fread(block, 1, sizeof block, from)) > 0;) good = fwrite(block, 1, n, to) == n;
    good = good && !ferror(from);
    if (to) good = fclose(to) == 0 && good;
    return good ? KELLER_OK : keller_error(error, KELLER_IO, "%s: cannot be written: %s", name, strerror(errno));
}

static KellerStatus export_map(void *context, KellerError *error)
{
    const Options *o = context;
    FILE *text = tmpfile();
    if (!text) return keller_error(error, KELLER_IO, "%s: no temporary file: %s", o->output, strerror(errno));
    struct rlimit before;
    keller_limit_memory(o->file, &before);
    KellerStatus status = read_maps(o, text, error);
    keller_lift_memory_limit(&before);
    KellerAtomic target = {0};
    KellerInterrupt interrupt;
    if (status == KELLER_OK && !keller_interrupt_start(&interrupt)) {
        status = keller_error(error, KELLER_FAILED, "no thread for signals");
    } else if (status == KELLER_OK) {
        keller_interrupt_hold(&interrupt);
        status = keller_atomic_begin(o->output, o->force, &target, error);
        keller_interrupt_release(&interrupt, target.temporary);
        if (status == KELLER_OK) status = copy(text, &target, o->output, error);
        if (status == KELLER_OK) status = keller_atomic_finish(&target, error);
        keller_atomic_abandon(&target);
        keller_interrupt_stop(&interrupt);
    }
    fclose(text);
    return status;
}

static KellerStatus export_sound(void *context, KellerError *error)
{
    const Options *o = context;
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
    Options options = {0};
    KellerStatus status = parse(argc, argv, &options, error);
    if (status == KELLER_OK) status = keller_refuse_input(options.output, options.file, "the result to export", error);
    if (status == KELLER_OK) status = keller_atomic_check(options.output, options.force, error);
    return status == KELLER_OK ? keller_guarded(options.file, options.sound ? export_sound : export_map, &options, error) : status;
}
