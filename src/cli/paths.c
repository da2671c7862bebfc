#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "cli/cli.h"
#include "cli/pair_print.h"
#include "io/pair_rows.h"
#include "io/path_rows.h"

typedef struct {
    char *file;
    const char *tx, *rx;
    uint32_t strongest;         /* 0: all */
    KellerPathFormat format;
    bool pairs;
} Options;

/* One of the strongest paths of the present pair; owns the row's arrays. */
typedef struct {
    KellerPathRow row;
    double amplitude;
    double *doppler;
    double complex *gain;
} Kept;

typedef struct {
    const Options *options;
    const KellerResultInfo *info;
    KellerPathPrinter printer;
    size_t tx;                  /* SIZE_MAX: all */
    size_t set;                 /* SIZE_MAX: all */
    int64_t index;              /* point of the set, -1: all */
    Kept *kept;                 /* sorted, strongest first */
    size_t kept_count, kept_capacity;
} Listing;

static KellerStatus parse(int argc, char **argv, Options *o, KellerError *error)
{
    enum { TX, RX, STRONGEST, FORMAT, PAIRS };
    static const KellerOption options[] = {{"tx", 0, true}, {"rx", 0, true}, {"strongest", 0, true},
                                           {"format", 0, true}, {"pairs", 0, false}, {0}};
    KellerArguments arguments = {.verb = "paths", .argc = argc, .argv = argv};
    const char *value;
    for (;;) {
        KellerStatus status = KELLER_OK;
        switch (keller_next_argument(&arguments, options, &value, error)) {
        case TX: o->tx = value; break;
        case RX: o->rx = value; break;
        case STRONGEST:
            status = keller_whole_number("paths", "--strongest", value, 1, 1000000, &o->strongest, error);
            break;
        case FORMAT:
            if (strcmp(value, "table") == 0) o->format = KELLER_PATHS_TABLE;
            else if (strcmp(value, "csv") == 0) o->format = KELLER_PATHS_CSV;
            else if (strcmp(value, "json") == 0) o->format = KELLER_PATHS_JSON;
            else return keller_usage(error, "paths", "--format is \"%.60s\"; expected table, csv or json", value);
            break;
        case PAIRS: o->pairs = true; break;
        case KELLER_ARGUMENT_OPERAND:
            if (o->file) return keller_usage(error, "paths", "\"%s\" is one result too many", value);
            o->file = argv[arguments.next - 1];
            break;
        case KELLER_ARGUMENT_END:
            if (!o->file) return keller_usage(error, "paths", "a result file is expected");
            if (o->pairs && o->strongest > 0) return keller_usage(error, "paths", "--pairs and --strongest exclude each other");
            return KELLER_OK;
        default: return KELLER_USAGE;
        }
        if (status != KELLER_OK) return status;
    }
}

/* ---- the strongest of each pair ---------------------------------------------------------------------------------- */

static void print_kept(Listing *l)
{
    for (size_t i = 0; i < l->kept_count; ++i) keller_path_print(&l->printer, &l->kept[i].row);
    l->kept_count = 0;
}

static KellerStatus keep(Listing *l, const KellerPathRow *row, KellerError *error)
{
    size_t frequencies = (size_t)l->info->frequency_count;
    double amplitude = frequencies > 0 ? cabs(row->gain[0]) : 0;
    if (l->kept_count == l->options->strongest && !(amplitude > l->kept[l->kept_count - 1].amplitude)) return KELLER_OK;
    if (l->kept_count < l->options->strongest) {
        if (l->kept_count == l->kept_capacity) {
            size_t capacity = l->kept_capacity ? 2 * l->kept_capacity : 16;
            Kept *kept = realloc(l->kept, capacity * sizeof *kept);
            if (!kept) return keller_error_memory(error, capacity * sizeof *kept);
            memset(kept + l->kept_capacity, 0, (capacity - l->kept_capacity) * sizeof *kept);
            l->kept = kept;
            l->kept_capacity = capacity;
        }
        Kept *fresh = &l->kept[l->kept_count];
        if (!fresh->doppler) fresh->doppler = malloc((frequencies + 1) * sizeof *fresh->doppler);
        if (!fresh->gain) fresh->gain = malloc((frequencies + 1) * sizeof *fresh->gain);
        if (!fresh->doppler || !fresh->gain) return keller_error_memory(error, frequencies * 24);
        ++l->kept_count;
    }
    /* The last one's arrays go to the newcomer; equal amplitudes stay in the file's order. */
    size_t at = l->kept_count - 1;
    Kept entry = l->kept[at];
    for (; at > 0 && l->kept[at - 1].amplitude < amplitude; --at) l->kept[at] = l->kept[at - 1];
    entry.row = *row;
    entry.amplitude = amplitude;
    memcpy(entry.doppler, row->doppler, frequencies * sizeof *entry.doppler);
    memcpy(entry.gain, row->gain, frequencies * sizeof *entry.gain);
    entry.row.doppler = entry.doppler;
    entry.row.gain = entry.gain;
    l->kept[at] = entry;
    return KELLER_OK;
}

static bool selected(const Listing *l, uint32_t tx, uint32_t rx)
{
    return (l->tx == SIZE_MAX || tx == l->tx) && (l->set == SIZE_MAX || l->info->receiver_sets[rx] == l->set) &&
           (l->index < 0 || l->info->receiver_indices[rx] == l->index);
}

static KellerStatus take_pair(void *context, const KellerPairSums *sums, KellerError *error)
{
    Listing *l = context;
    (void)error;
    if (selected(l, sums->tx, sums->rx)) keller_pair_print(&l->printer, sums);
    return KELLER_OK;
}

static KellerStatus take_path(void *context, const KellerPathRow *row, KellerError *error)
{
    Listing *l = context;
    if (!selected(l, row->tx, row->rx)) return KELLER_OK;
    if (l->options->strongest == 0) {
        keller_path_print(&l->printer, row);
        return KELLER_OK;
    }
    if (l->kept_count > 0 && (l->kept[0].row.tx != row->tx || l->kept[0].row.rx != row->rx)) print_kept(l);
    return keep(l, row, error);
}

/* ---- which paths ------------------------------------------------------------------------------------------------- */

static KellerStatus select_pairs(Listing *l, KellerError *error)
{
    const Options *o = l->options;
    l->tx = l->set = SIZE_MAX;
    l->index = -1;
    KellerStatus status = o->tx ? keller_find_transmitter(l->info, o->file, o->tx, &l->tx, error) : KELLER_OK;
    if (status == KELLER_OK && o->rx) status = keller_find_receiver(l->info, o->file, o->rx, &l->set, &l->index, error);
    return status;
}

static KellerStatus list(void *context, KellerError *error)
{
    const Options *o = context;
    struct rlimit before;
    keller_limit_memory(o->file, &before);
    KellerReader *reader = NULL;
    KellerStatus status = keller_reader_open(o->file, &reader, error);
    if (status != KELLER_OK) return status;
    Listing l = {.options = o, .info = keller_reader_info(reader)};
    status = select_pairs(&l, error);
    uint64_t count;
    if (status == KELLER_OK && o->pairs) {
        status = keller_pair_count(reader, o->file, &count, error);
        if (status == KELLER_OK) {
            keller_pair_print_start(&l.printer, l.info, o->format);
            status = keller_each_pair(reader, o->file, count, take_pair, &l, error);
            keller_pair_print_end(&l.printer);
        }
    } else if (status == KELLER_OK) {
        keller_path_print_start(&l.printer, l.info, o->format);
        status = keller_each_path(reader, o->file, take_path, &l, error);
        print_kept(&l);
        keller_path_print_end(&l.printer);
    }
    for (size_t i = 0; i < l.kept_capacity; ++i) {
        free(l.kept[i].doppler);
        free(l.kept[i].gain);
    }
    free(l.kept);
    keller_reader_close(reader);
    return status;
}

KellerStatus keller_cli_paths(int argc, char **argv, KellerError *error)
{
    Options options = {0};
    KellerStatus status = parse(argc, argv, &options, error);
    return status == KELLER_OK ? keller_guarded(options.file, list, &options, error) : status;
}
