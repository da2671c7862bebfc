#include "cli/path_print.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "cli/cli.h"
#include "io/result_tables.h"

static const double degrees = 180 / M_PI;

void keller_receiver_of(const KellerResultInfo *info, uint32_t rx, char *name, size_t size)
{
    uint32_t set = info->receiver_sets[rx];
    keller_receiver_name(info->set_ids[set], info->set_kinds[set], info->receiver_indices[rx], name, size);
}

bool keller_is_sound(const KellerResultInfo *info) { return strcmp(info->domain, "acoustic") == 0; }

void keller_put_ids(const char *tx, const char *rx)
{
    /* Padding counts bytes; ids beyond ASCII shift their row, no more. */
    const char *const names[] = {tx, rx};
    for (int i = 0; i < 2; ++i) {
        keller_put_text(names[i]);
        int width = i ? 14 : 10, length = (int)strlen(names[i]);
        printf("%*s ", length < width ? width - length : 0, "");
    }
}

void keller_put_json_frequencies(const KellerResultInfo *info)
{
    fputs("{\"frequencies_Hz\": [", stdout);
    for (uint64_t f = 0; f < info->frequency_count; ++f) {
        if (f) fputs(", ", stdout);
        keller_put_json_number(stdout, info->frequencies[f]);
    }
    putchar(']');
}

/* ---- formats ----------------------------------------------------------------------------------------------------- */

void keller_path_print_start(KellerPathPrinter *printer, const KellerResultInfo *info, KellerPathFormat format)
{
    *printer = (KellerPathPrinter){.info = info, .format = format};
    char number[32];
    switch (format) {
    case KELLER_PATHS_TABLE:
        printf("%-10s %-14s %10s %12s", "tx", "rx", "length/m", keller_is_sound(info) ? "delay/ms" : "delay/ns");
        for (uint64_t f = 0; f < info->frequency_count; ++f) {
            char head[48];
            snprintf(head, sizeof head, "dB@%s", keller_si(info->frequencies[f], "Hz", number));
            printf(" %13s %9s %9s", head, "phase/deg", "doppl./Hz");
        }
        printf(" %7s %7s %7s %7s  %s\n", "dep.zen", "dep.az", "arr.zen", "arr.az", "sequence");
        break;
    case KELLER_PATHS_CSV:
        printf("tx,rx,sequence,length_m,delay_s");
        for (uint64_t f = 0; f < info->frequency_count; ++f) {
            double hertz = info->frequencies[f];
            printf(",gain_dB_%.15gHz,phase_deg_%.15gHz,doppler_Hz_%.15gHz", hertz, hertz, hertz);
        }
        puts(",departure_zenith_deg,departure_azimuth_deg,arrival_zenith_deg,arrival_azimuth_deg");
        break;
    case KELLER_PATHS_JSON:
        keller_put_json_frequencies(info);
        fputs(", \"paths\": [", stdout);
        break;
    }
}

static void print_table(const KellerResultInfo *info, const KellerPathRow *row, const char *rx, const char *sequence)
{
    keller_put_ids(info->transmitter_ids[row->tx], rx);
    printf("%10.3f %12.4f", row->length, row->delay * (keller_is_sound(info) ? 1e3 : 1e9));
    for (uint64_t f = 0; f < info->frequency_count; ++f)
        printf(" %13.2f %9.2f %9.2f", keller_decibel(cabs(row->gain[f])), carg(row->gain[f]) * degrees,
               row->doppler[f]);
    printf(" %7.2f %7.2f %7.2f %7.2f  %s\n", row->departure[0] * degrees, row->departure[1] * degrees,
           row->arrival[0] * degrees, row->arrival[1] * degrees, sequence);
}

static void print_csv(const KellerResultInfo *info, const KellerPathRow *row, const char *rx, const char *sequence)
{
    keller_put_csv(stdout, info->transmitter_ids[row->tx]);
    putchar(',');
    keller_put_csv(stdout, rx);
    printf(",%s,%.17g,%.17g", sequence, row->length, row->delay);
    for (uint64_t f = 0; f < info->frequency_count; ++f)
        printf(",%.12g,%.12g,%.12g", keller_decibel(cabs(row->gain[f])), carg(row->gain[f]) * degrees, row->doppler[f]);
    printf(",%.12g,%.12g,%.12g,%.12g\n", row->departure[0] * degrees, row->departure[1] * degrees,
           row->arrival[0] * degrees, row->arrival[1] * degrees);
}

static void print_json(const KellerPathPrinter *printer, const KellerPathRow *row, const char *rx, const char *sequence)
{
    const KellerResultInfo *info = printer->info;
    fputs(printer->printed ? ",\n {\"tx\": " : "\n {\"tx\": ", stdout);
    keller_put_json(stdout, info->transmitter_ids[row->tx]);
    fputs(", \"rx\": ", stdout);
    keller_put_json(stdout, rx);
    printf(", \"sequence\": \"%s\", \"length_m\": ", sequence);
    keller_put_json_number(stdout, row->length);
    fputs(", \"delay_s\": ", stdout);
    keller_put_json_number(stdout, row->delay);
    static const char *const names[] = {"gain_dB", "phase_deg", "doppler_Hz"};
    for (int what = 0; what < 3; ++what) {
        printf(", \"%s\": [", names[what]);
        for (uint64_t f = 0; f < info->frequency_count; ++f) {
            if (f) fputs(", ", stdout);
            keller_put_json_number(stdout, what == 0   ? keller_decibel(cabs(row->gain[f]))
                            : what == 1 ? carg(row->gain[f]) * degrees
                                        : row->doppler[f]);
        }
        putchar(']');
    }
    const double angles[4] = {row->departure[0], row->departure[1], row->arrival[0], row->arrival[1]};
    static const char *const angle_names[] = {"departure_zenith_deg", "departure_azimuth_deg", "arrival_zenith_deg",
                                              "arrival_azimuth_deg"};
    for (int i = 0; i < 4; ++i) {
        printf(", \"%s\": ", angle_names[i]);
        keller_put_json_number(stdout, angles[i] * degrees);
    }
    putchar('}');
}

void keller_path_print(KellerPathPrinter *printer, const KellerPathRow *row)
{
    char sequence[KELLER_SEQUENCE_SIZE], rx[300];
    keller_path_sequence(row, sequence);
    keller_receiver_of(printer->info, row->rx, rx, sizeof rx);
    switch (printer->format) {
    case KELLER_PATHS_TABLE: print_table(printer->info, row, rx, sequence); break;
    case KELLER_PATHS_CSV: print_csv(printer->info, row, rx, sequence); break;
    case KELLER_PATHS_JSON: print_json(printer, row, rx, sequence); break;
    }
    ++printer->printed;
}

void keller_path_print_end(KellerPathPrinter *printer)
{
    if (printer->format == KELLER_PATHS_JSON) fputs("\n]}\n", stdout);
}

/* ---- selection --------------------------------------------------------------------------------------------------- */

static KellerStatus unknown_id(KellerError *error, const char *file, const char *what, const char *id, char **ids,
                               uint64_t count)
{
    char known[400] = "";
    size_t length = 0;
    for (uint64_t i = 0; i < count && i < 8; ++i)
        length += (size_t)snprintf(known + length, sizeof known - length, "%s%.40s", i ? ", " : "", ids[i]);
    return keller_error(error, KELLER_USAGE, "%s has no %s \"%.60s\"; expected one of: %s%s", file, what, id, known,
                        count > 8 ? ", ..." : "");
}

KellerStatus keller_find_transmitter(const KellerResultInfo *info, const char *file, const char *id, size_t *tx,
                                     KellerError *error)
{
    for (*tx = 0; *tx < info->transmitter_count; ++*tx)
        if (strcmp(info->transmitter_ids[*tx], id) == 0) return KELLER_OK;
    return unknown_id(error, file, "transmitter", id, info->transmitter_ids, info->transmitter_count);
}

KellerStatus keller_find_receiver(const KellerResultInfo *info, const char *file, const char *id, size_t *set,
                                  int64_t *index, KellerError *error)
{
    *index = -1;
    for (*set = 0; *set < info->set_count; ++*set)
        if (strcmp(info->set_ids[*set], id) == 0) return KELLER_OK;
    size_t length = strlen(id);
    const char *bracket = strrchr(id, '[');
    if (bracket && length > 2 && id[length - 1] == ']' && strspn(bracket + 1, "0123456789") == strlen(bracket) - 2 &&
        bracket[1] != ']' && strlen(bracket) < 14) {
        size_t stem = (size_t)(bracket - id);
        *index = strtoll(bracket + 1, NULL, 10);
        for (*set = 0; *set < info->set_count; ++*set) {
            if (strlen(info->set_ids[*set]) != stem || strncmp(info->set_ids[*set], id, stem) != 0) continue;
            for (uint64_t r = 0; r < info->receiver_count; ++r)
                if (info->receiver_sets[r] == *set && info->receiver_indices[r] == *index) return KELLER_OK;
        }
    }
    return unknown_id(error, file, "receiver", id, info->set_ids, info->set_count);
}
