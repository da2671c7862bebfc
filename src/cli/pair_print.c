#include "cli/pair_print.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include "cli/cli.h"

static const double degrees = 180 / M_PI;

/* Heads of the table are those of 3GPP TR 38.901: angular spread of departure, zenith spread of departure, and of arrival. What follows
 * the gains, in this order: delays, then the spreads of the angles in the order of KellerAngle. */
enum { DELAYS = 2, NUMBERS = DELAYS + KELLER_ANGLES };
static const char *const names[NUMBERS] = {
    "strongest_delay_s", "delay_spread_s", "departure_azimuth_spread_deg", "departure_zenith_spread_deg", "arrival_azimuth_spread_deg",
    "arrival_zenith_spread_deg"};

static void numbers_of(const KellerPairSums *sums, double number[NUMBERS])
{
    number[0] = sums->strongest_delay;
    number[1] = sums->delay_spread;
    for (int a = 0; a < KELLER_ANGLES; ++a) number[DELAYS + a] = sums->angle_spread[a] * degrees;
}

static double decibel_of_power(double power) { return 10 * log10(power); }

void keller_pair_print_start(KellerPathPrinter *printer, const KellerResultInfo *info, KellerPathFormat format)
{
    *printer = (KellerPathPrinter){.info = info, .format = format};
    char number[32], head[48];
    switch (format) {
    case KELLER_PATHS_TABLE:
        printf("%-10s %-14s %6s", "tx", "rx", "paths");
        for (uint64_t f = 0; f < info->frequency_count; ++f) {
            snprintf(head, sizeof head, "dB@%s", keller_si(info->frequencies[f], "Hz", number));
            printf(" %13s %11s", head, "incoherent");
        }
        printf(" %12s %12s", keller_is_sound(info) ? "delay/ms" : "delay/ns",
               keller_is_sound(info) ? "spread/ms" : "spread/ns");
        printf(" %8s %8s %8s %8s\n", "ASD/deg", "ZSD/deg", "ASA/deg", "ZSA/deg");
        break;
    case KELLER_PATHS_CSV:
        printf("tx,rx,paths");
        for (uint64_t f = 0; f < info->frequency_count; ++f)
            printf(",gain_dB_%.15gHz,incoherent_dB_%.15gHz", info->frequencies[f], info->frequencies[f]);
        for (int i = 0; i < NUMBERS; ++i) printf(",%s", names[i]);
        putchar('\n');
        break;
    case KELLER_PATHS_JSON:
        keller_put_json_frequencies(info);
        fputs(", \"pairs\": [", stdout);
        break;
    }
}

static void print_table(const KellerResultInfo *info, const KellerPairSums *sums, const char *rx)
{
    double number[NUMBERS], unit = keller_is_sound(info) ? 1e3 : 1e9;
    numbers_of(sums, number);
    keller_put_ids(info->transmitter_ids[sums->tx], rx);
    printf("%6zu", sums->paths);
    for (size_t f = 0; f < sums->frequency_count; ++f)
        printf(" %13.2f %11.2f", decibel_of_power(sums->path_gain[f]), decibel_of_power(sums->path_gain_incoherent[f]));
    printf(" %12.4f %12.4f", number[0] * unit, number[1] * unit);
    for (int i = DELAYS; i < NUMBERS; ++i) printf(" %8.2f", number[i]);
    putchar('\n');
}

static void print_csv(const KellerResultInfo *info, const KellerPairSums *sums, const char *rx)
{
    double number[NUMBERS];
    numbers_of(sums, number);
    keller_put_csv(stdout, info->transmitter_ids[sums->tx]);
    putchar(',');
    keller_put_csv(stdout, rx);
    printf(",%zu", sums->paths);
    for (size_t f = 0; f < sums->frequency_count; ++f)
        printf(",%.12g,%.12g", decibel_of_power(sums->path_gain[f]), decibel_of_power(sums->path_gain_incoherent[f]));
    for (int i = 0; i < NUMBERS; ++i) printf(",%.17g", number[i]);
    putchar('\n');
}

static void put_gains(const char *name, size_t count, const double *gain)
{
    printf(", \"%s\": [", name);
    for (size_t f = 0; f < count; ++f) {
        if (f) fputs(", ", stdout);
        keller_put_json_number(stdout, decibel_of_power(gain[f]));
    }
    putchar(']');
}

static void print_json(const KellerPathPrinter *printer, const KellerPairSums *sums, const char *rx)
{
    double number[NUMBERS];
    numbers_of(sums, number);
    fputs(printer->printed ? ",\n {\"tx\": " : "\n {\"tx\": ", stdout);
    keller_put_json(stdout, printer->info->transmitter_ids[sums->tx]);
    fputs(", \"rx\": ", stdout);
    keller_put_json(stdout, rx);
    printf(", \"paths\": %zu", sums->paths);
    put_gains("gain_dB", sums->frequency_count, sums->path_gain);
    put_gains("incoherent_dB", sums->frequency_count, sums->path_gain_incoherent);
    for (int i = 0; i < NUMBERS; ++i) {
        printf(", \"%s\": ", names[i]);
        keller_put_json_number(stdout, number[i]);
    }
    putchar('}');
}

void keller_pair_print(KellerPathPrinter *printer, const KellerPairSums *sums)
{
    char rx[300];
    keller_receiver_of(printer->info, sums->rx, rx, sizeof rx);
    switch (printer->format) {
    case KELLER_PATHS_TABLE: print_table(printer->info, sums, rx); break;
    case KELLER_PATHS_CSV: print_csv(printer->info, sums, rx); break;
    case KELLER_PATHS_JSON: print_json(printer, sums, rx); break;
    }
    ++printer->printed;
}

void keller_pair_print_end(KellerPathPrinter *printer) { keller_path_print_end(printer); }
