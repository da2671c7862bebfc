#include "io/pair_rows.h"

#include <stdio.h>
#include <stdlib.h>
#include "io/result_sums.h"

enum { BLOCK = 1024 };

typedef struct {
    uint32_t tx[BLOCK], rx[BLOCK], paths[BLOCK];
    double delay_spread[BLOCK], strongest_delay[BLOCK], spread[KELLER_ANGLES][BLOCK];
    double *path_gain, *path_gain_incoherent; /* [BLOCK][F] */
} Block;

KellerStatus keller_pair_count(KellerReader *reader, const char *file, uint64_t *count, KellerError *error)
{
    if (keller_reader_has(reader, "/pairs/tx")) return keller_reader_row_count(reader, "/pairs/tx", count, error);
    return keller_error(error, KELLER_BAD_INPUT, "%s: holds no sums of pairs; expected a result of this version of keller (it is of %.40s)",
                        file, keller_reader_info(reader)->program_version);
}

static KellerStatus read_block(KellerReader *reader, Block *b, uint64_t first, uint64_t n, KellerError *error)
{
    uint64_t F = keller_reader_info(reader)->frequency_count;
    const struct { const char *path; KellerCell cell; uint64_t width; void *data; } columns[] = {
        {"/pairs/tx", KELLER_CELL_U4, 1, b->tx}, {"/pairs/rx", KELLER_CELL_U4, 1, b->rx}, {"/pairs/paths", KELLER_CELL_U4, 1, b->paths},
        {"/pairs/path_gain", KELLER_CELL_F8, F, b->path_gain},
        {"/pairs/path_gain_incoherent", KELLER_CELL_F8, F, b->path_gain_incoherent},
        {"/pairs/delay_spread", KELLER_CELL_F8, 1, b->delay_spread},
        {"/pairs/strongest_delay", KELLER_CELL_F8, 1, b->strongest_delay}};
    KellerStatus status = KELLER_OK;
    for (size_t i = 0; i < sizeof columns / sizeof *columns && status == KELLER_OK; ++i)
        status = keller_reader_rows(reader, columns[i].path, columns[i].cell, columns[i].width, first, n, columns[i].data, error);
    for (int a = 0; a < KELLER_ANGLES && status == KELLER_OK; ++a) {
        char path[64];
        snprintf(path, sizeof path, "/pairs/%s", keller_spread_names[a]);
        status = keller_reader_rows(reader, path, KELLER_CELL_F8, 1, first, n, b->spread[a], error);
    }
    return status;
}

static KellerStatus visit_block(const KellerReader *reader, const Block *b, const char *file, uint64_t n, KellerVisitPair visit,
                                void *context, KellerError *error)
{
    const KellerResultInfo *info = keller_reader_info(reader);
    KellerStatus status = KELLER_OK;
    for (uint64_t p = 0; p < n && status == KELLER_OK; ++p) {
        KellerPairSums sums = {.tx = b->tx[p], .rx = b->rx[p], .paths = b->paths[p], .frequency_count = (size_t)info->frequency_count,
                               .path_gain = b->path_gain + p * info->frequency_count,
                               .path_gain_incoherent = b->path_gain_incoherent + p * info->frequency_count,
                               .delay_spread = b->delay_spread[p], .strongest_delay = b->strongest_delay[p]};
        for (int a = 0; a < KELLER_ANGLES; ++a) sums.angle_spread[a] = b->spread[a][p];
        if (sums.tx >= info->transmitter_count || sums.rx >= info->receiver_count)
            return keller_error(error, KELLER_BAD_INPUT, "%s: /pairs names a transmitter or receiver that is not there", file);
        status = visit(context, &sums, error);
    }
    return status;
}

KellerStatus keller_each_pair(KellerReader *reader, const char *file, uint64_t most, KellerVisitPair visit, void *context,
                              KellerError *error)
{
    size_t F = (size_t)keller_reader_info(reader)->frequency_count;
    uint64_t count = 0;
    KellerStatus status = keller_pair_count(reader, file, &count, error);
    if (status != KELLER_OK) return status;
    Block *b = malloc(sizeof *b);
    double *gains = malloc((2 * BLOCK * F + 1) * sizeof *gains);
    if (!b || !gains) {
        free(b);
        free(gains);
        return keller_error_memory(error, sizeof *b + 2 * BLOCK * F * sizeof *gains);
    }
    b->path_gain = gains;
    b->path_gain_incoherent = gains + BLOCK * F;
    if (count > most) count = most;
    for (uint64_t first = 0; first < count && status == KELLER_OK; first += BLOCK) {
        uint64_t n = count - first < BLOCK ? count - first : BLOCK;
        status = read_block(reader, b, first, n, error);
        if (status == KELLER_OK) status = visit_block(reader, b, file, n, visit, context, error);
    }
    free(b);
    free(gains);
    return status;
}
