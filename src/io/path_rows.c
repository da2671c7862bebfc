#include "io/path_rows.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    uint64_t capacity;          /* paths a block */
    uint32_t *tx, *rx;
    uint64_t *offset;
    double *length, *delay, (*departure)[2], (*arrival)[2], *doppler;
    double complex *gain;
    uint8_t *kind;              /* interactions: room for capacity * KELLER_MAX_INTERACTIONS */
    uint32_t *triangle, *wedge;
    KellerVec3 *position;
} Block;

static void block_free(Block *b)
{
    void *const owned[] = {b->tx, b->rx, b->offset, b->length, b->delay, b->departure, b->arrival, b->doppler, b->gain,
                           b->kind, b->triangle, b->wedge, b->position};
    for (size_t i = 0; i < sizeof owned / sizeof *owned; ++i) free(owned[i]);
}

static bool block_make(Block *b, uint64_t frequencies)
{
    uint64_t rows = ((uint64_t)1 << 22) / (16 * (frequencies + 1));
    b->capacity = rows < 1 ? 1 : rows > 4096 ? 4096 : rows;
    size_t n = (size_t)b->capacity, m = n * KELLER_MAX_INTERACTIONS, f = (size_t)frequencies + 1;
    b->tx = malloc(n * sizeof *b->tx);
    b->rx = malloc(n * sizeof *b->rx);
    b->offset = malloc((n + 1) * sizeof *b->offset);
    b->length = malloc(n * sizeof *b->length);
    b->delay = malloc(n * sizeof *b->delay);
    b->departure = malloc(n * sizeof *b->departure);
    b->arrival = malloc(n * sizeof *b->arrival);
    b->doppler = malloc(n * f * sizeof *b->doppler);
    b->gain = malloc(n * f * sizeof *b->gain);
    b->kind = malloc(m);
    b->triangle = malloc(m * sizeof *b->triangle);
    b->wedge = malloc(m * sizeof *b->wedge);
    b->position = malloc(m * sizeof *b->position);
    return b->tx && b->rx && b->offset && b->length && b->delay && b->departure && b->arrival && b->doppler &&
           b->gain && b->kind && b->triangle && b->wedge && b->position;
}

static KellerStatus block_read(KellerReader *reader, Block *b, const char *file, uint64_t first, uint64_t n,
                               KellerError *error)
{
    const KellerResultInfo *info = keller_reader_info(reader);
    uint64_t f = info->frequency_count;
    const struct { const char *path; KellerCell cell; uint64_t width, extra; void *data; } columns[] = {
        {"/paths/tx", KELLER_CELL_U4, 1, 0, b->tx}, {"/paths/rx", KELLER_CELL_U4, 1, 0, b->rx},
        {"/paths/offset", KELLER_CELL_U8, 1, 1, b->offset}, {"/paths/length", KELLER_CELL_F8, 1, 0, b->length},
        {"/paths/delay", KELLER_CELL_F8, 1, 0, b->delay}, {"/paths/departure", KELLER_CELL_F8, 2, 0, b->departure},
        {"/paths/arrival", KELLER_CELL_F8, 2, 0, b->arrival}, {"/paths/doppler", KELLER_CELL_F8, f, 0, b->doppler},
        {"/paths/gain", KELLER_CELL_C16, f, 0, b->gain}};
    KellerStatus status = KELLER_OK;
    for (size_t i = 0; i < sizeof columns / sizeof *columns && status == KELLER_OK; ++i)
        status = keller_reader_rows(reader, columns[i].path, columns[i].cell, columns[i].width, first,
                                    n + columns[i].extra, columns[i].data, error);
    if (status != KELLER_OK) return status;
    for (uint64_t p = 0; p < n; ++p) {
        if (b->tx[p] >= info->transmitter_count || b->rx[p] >= info->receiver_count)
            return keller_error(error, KELLER_BAD_INPUT,
                                "%s: path %llu names a transmitter or receiver that is not there", file,
                                (unsigned long long)(first + p));
        if (b->offset[p + 1] < b->offset[p] || b->offset[p + 1] > info->interactions ||
            b->offset[p + 1] - b->offset[p] > KELLER_MAX_INTERACTIONS)
            return keller_error(error, KELLER_BAD_INPUT,
                                "%s: path %llu has a wrong range of interactions; expected at most %d, in order", file,
                                (unsigned long long)(first + p), KELLER_MAX_INTERACTIONS);
    }
    uint64_t begin = b->offset[0], count = b->offset[n] - begin;
    status = keller_reader_rows(reader, "/interactions/kind", KELLER_CELL_ENUM, 1, begin, count, b->kind, error);
    if (status == KELLER_OK)
        status =
            keller_reader_rows(reader, "/interactions/triangle", KELLER_CELL_U4, 1, begin, count, b->triangle, error);
    if (status == KELLER_OK)
        status = keller_reader_rows(reader, "/interactions/wedge", KELLER_CELL_U4, 1, begin, count, b->wedge, error);
    if (status == KELLER_OK)
        status =
            keller_reader_rows(reader, "/interactions/position", KELLER_CELL_F8, 3, begin, count, b->position, error);
    for (uint64_t i = 0; i < count && status == KELLER_OK; ++i)
        if (b->kind[i] > KELLER_SCATTERING)
            status = keller_error(error, KELLER_BAD_INPUT, "%s: interaction %llu is of an unknown kind", file,
                                  (unsigned long long)(begin + i));
    return status;
}

static void row_of(const Block *b, uint64_t first, uint64_t p, uint64_t frequencies, KellerPathRow *row)
{
    *row = (KellerPathRow){.number = first + p, .tx = b->tx[p], .rx = b->rx[p], .length = b->length[p],
                           .delay = b->delay[p], .doppler = b->doppler + p * frequencies,
                           .gain = b->gain + p * frequencies};
    memcpy(row->departure, b->departure[p], sizeof row->departure);
    memcpy(row->arrival, b->arrival[p], sizeof row->arrival);
    uint64_t begin = b->offset[p] - b->offset[0];
    row->count = (uint32_t)(b->offset[p + 1] - b->offset[p]);
    for (uint32_t i = 0; i < row->count; ++i) {
        row->kind[i] = b->kind[begin + i];
        row->id[i] = row->kind[i] == KELLER_DIFFRACTION ? b->wedge[begin + i] : b->triangle[begin + i];
        row->position[i] = b->position[begin + i];
    }
}

KellerStatus keller_each_path(KellerReader *reader, const char *file, KellerVisitPath visit, void *context,
                              KellerError *error)
{
    const KellerResultInfo *info = keller_reader_info(reader);
    Block b = {0};
    KellerStatus status = KELLER_OK;
    if (!block_make(&b, info->frequency_count)) status = keller_error_memory(error, 1 << 24);
    for (uint64_t first = 0; first < info->paths && status == KELLER_OK; first += b.capacity) {
        uint64_t left = info->paths - first, n = left < b.capacity ? left : b.capacity;
        status = block_read(reader, &b, file, first, n, error);
        for (uint64_t p = 0; p < n && status == KELLER_OK; ++p) {
            KellerPathRow row;
            row_of(&b, first, p, info->frequency_count, &row);
            status = visit(context, &row, error);
        }
    }
    block_free(&b);
    return status;
}

void keller_path_sequence(const KellerPathRow *row, char text[KELLER_SEQUENCE_SIZE])
{
    static const char letters[] = "RDTS";
    size_t at = 0;
    for (uint32_t i = 0; i < row->count; ++i)
        at += (size_t)snprintf(text + at, KELLER_SEQUENCE_SIZE - at, "%s%c%u", i ? " " : "", letters[row->kind[i]],
                               row->id[i]);
    if (row->count == 0) snprintf(text, KELLER_SEQUENCE_SIZE, "LOS");
}
