#include "io/path_rows.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A column of /paths as a block holds it. */
typedef struct {
    const char *path;
    KellerCell cell;
    size_t bytes;               /* of a row */
    uint64_t width;
} Column;

enum { TX, RX, OFFSET, LENGTH, DELAY, DEPARTURE, ARRIVAL, DOPPLER, GAIN, WEIGHT, PATCH, PART, COLUMNS };

/* Is the column one that this part of the paths needs? */
static bool wanted(KellerRowsPart part, int column)
{
    return column <= LENGTH || (part == KELLER_ROWS_FIELDS ? column <= GAIN : column >= WEIGHT);
}

static void list_columns(uint64_t frequencies, Column list[COLUMNS])
{
    const uint64_t F = frequencies;
    const Column columns[COLUMNS] = {
        [TX] = {"/paths/tx", KELLER_CELL_U4, 4, 1}, [RX] = {"/paths/rx", KELLER_CELL_U4, 4, 1},
        [OFFSET] = {"/paths/offset", KELLER_CELL_U8, 8, 1}, [LENGTH] = {"/paths/length", KELLER_CELL_F8, 8, 1},
        [DELAY] = {"/paths/delay", KELLER_CELL_F8, 8, 1}, [DEPARTURE] = {"/paths/departure", KELLER_CELL_F8, 16, 2},
        [ARRIVAL] = {"/paths/arrival", KELLER_CELL_F8, 16, 2}, [DOPPLER] = {"/paths/doppler", KELLER_CELL_F8, 8 * F, F},
        [GAIN] = {"/paths/gain", KELLER_CELL_C16, 16 * F, F}, [WEIGHT] = {"/paths/weight", KELLER_CELL_F8, 8, 1},
        [PATCH] = {"/paths/patch", KELLER_CELL_F8, 8, 1}, [PART] = {"/paths/part", KELLER_CELL_F8, 16, 2}};
    memcpy(list, columns, sizeof columns);
}

struct KellerPathCursor {
    KellerReader *reader;
    const char *file;
    KellerRowsPart part;
    uint64_t capacity;          /* paths a block */
    uint64_t first, count, at;  /* the block's first path, its paths, the next one of them */
    Column list[COLUMNS];
    void *column[COLUMNS];      /* NULL where it is not wanted */
    uint8_t *kind, *free_end;   /* interactions: room for capacity * KELLER_MAX_INTERACTIONS */
    uint32_t *triangle, *wedge;
    KellerVec3 *position;
    KellerPathRow row;
};

void keller_cursor_close(KellerPathCursor *c)
{
    if (!c) return;
    for (int i = 0; i < COLUMNS; ++i) free(c->column[i]);
    free(c->kind);
    free(c->free_end);
    free(c->triangle);
    free(c->wedge);
    free(c->position);
    free(c);
}

KellerStatus keller_cursor_open(KellerReader *reader, const char *file, KellerRowsPart part, KellerPathCursor **cursor,
                                KellerError *error)
{
    uint64_t frequencies = keller_reader_info(reader)->frequency_count, rows = ((uint64_t)1 << 22) / (16 * (frequencies + 1));
    *cursor = NULL;
    KellerPathCursor *c = calloc(1, sizeof *c);
    if (!c) return keller_error_memory(error, sizeof *c);
    *c = (KellerPathCursor){.reader = reader, .file = file, .part = part, .capacity = rows < 1 ? 1 : rows > 4096 ? 4096 : rows};
    size_t n = (size_t)c->capacity, m = n * KELLER_MAX_INTERACTIONS;
    bool room = true;
    list_columns(frequencies, c->list);
    for (int i = 0; i < COLUMNS; ++i) {
        if (!wanted(part, i)) continue;
        c->column[i] = malloc((n + 1) * (c->list[i].bytes + 1)); /* of /paths/offset one row more; of no frequencies something */
        room = room && c->column[i];
    }
    c->kind = malloc(m);
    c->free_end = malloc(m);
    c->triangle = malloc(m * sizeof *c->triangle);
    c->wedge = malloc(m * sizeof *c->wedge);
    c->position = malloc(m * sizeof *c->position);
    if (!room || !c->kind || !c->free_end || !c->triangle || !c->wedge || !c->position) {
        keller_cursor_close(c);
        return keller_error_memory(error, m * sizeof *c->position);
    }
    *cursor = c;
    return KELLER_OK;
}

/* Pairs and interactions that are there. */
static KellerStatus check_block(const KellerPathCursor *c, KellerError *error)
{
    const KellerResultInfo *info = keller_reader_info(c->reader);
    const uint32_t *tx = c->column[TX], *rx = c->column[RX];
    const uint64_t *offset = c->column[OFFSET];
    for (uint64_t p = 0; p < c->count; ++p) {
        if (tx[p] >= info->transmitter_count || rx[p] >= info->receiver_count)
            return keller_error(error, KELLER_BAD_INPUT,
                                "%s: path %llu names a transmitter or receiver that is not there", c->file,
                                (unsigned long long)(c->first + p));
        if (offset[p + 1] < offset[p] || offset[p + 1] > info->interactions || offset[p + 1] - offset[p] > KELLER_MAX_INTERACTIONS)
            return keller_error(error, KELLER_BAD_INPUT,
                                "%s: path %llu has a wrong range of interactions; expected at most %d, in order", c->file,
                                (unsigned long long)(c->first + p), KELLER_MAX_INTERACTIONS);
    }
    return KELLER_OK;
}

static KellerStatus read_interactions(KellerPathCursor *c, KellerError *error)
{
    const uint64_t *offset = c->column[OFFSET], begin = offset[0], count = offset[c->count] - begin;
    const struct { const char *path; KellerCell cell; uint64_t width; void *data; } columns[] = {
        {"/interactions/kind", KELLER_CELL_ENUM, 1, c->kind}, {"/interactions/triangle", KELLER_CELL_U4, 1, c->triangle},
        {"/interactions/wedge", KELLER_CELL_U4, 1, c->wedge}, {"/interactions/position", KELLER_CELL_F8, 3, c->position},
        {"/interactions/free_end", KELLER_CELL_U1, 1, c->free_end}};
    size_t last = c->part == KELLER_ROWS_GEOMETRY ? 5 : 4;
    KellerStatus status = KELLER_OK;
    for (size_t i = 0; i < last && status == KELLER_OK; ++i)
        status = keller_reader_rows(c->reader, columns[i].path, columns[i].cell, columns[i].width, begin, count, columns[i].data, error);
    for (uint64_t i = 0; i < count && status == KELLER_OK; ++i)
        if (c->kind[i] > KELLER_SCATTERING)
            status = keller_error(error, KELLER_BAD_INPUT, "%s: interaction %llu is of an unknown kind", c->file,
                                  (unsigned long long)(begin + i));
    return status;
}

static KellerStatus read_block(KellerPathCursor *c, KellerError *error)
{
    uint64_t left = keller_reader_info(c->reader)->paths - c->first;
    KellerStatus status = KELLER_OK;
    c->count = left < c->capacity ? left : c->capacity;
    c->at = 0;
    for (int i = 0; i < COLUMNS && status == KELLER_OK; ++i)
        if (c->column[i])
            status = keller_reader_rows(c->reader, c->list[i].path, c->list[i].cell, c->list[i].width, c->first,
                                        c->count + (i == OFFSET), c->column[i], error);
    if (status == KELLER_OK) status = check_block(c, error);
    return status == KELLER_OK ? read_interactions(c, error) : status;
}

static void set_row(KellerPathCursor *c, uint64_t p)
{
    KellerPathRow *row = &c->row;
    const uint64_t *offset = c->column[OFFSET], begin = offset[p] - offset[0], frequencies = c->list[DOPPLER].width;
    row->number = c->first + p;
    row->tx = ((const uint32_t *)c->column[TX])[p];
    row->rx = ((const uint32_t *)c->column[RX])[p];
    row->length = ((const double *)c->column[LENGTH])[p];
    row->count = (uint32_t)(offset[p + 1] - offset[p]);
    for (uint32_t i = 0; i < row->count; ++i) {
        row->kind[i] = c->kind[begin + i];
        row->id[i] = row->kind[i] == KELLER_DIFFRACTION ? c->wedge[begin + i] : c->triangle[begin + i];
        row->position[i] = c->position[begin + i];
    }
    if (c->part == KELLER_ROWS_FIELDS) {
        row->delay = ((const double *)c->column[DELAY])[p];
        memcpy(row->departure, (const double *)c->column[DEPARTURE] + 2 * p, sizeof row->departure);
        memcpy(row->arrival, (const double *)c->column[ARRIVAL] + 2 * p, sizeof row->arrival);
        row->doppler = (const double *)c->column[DOPPLER] + p * frequencies;
        row->gain = (const double complex *)c->column[GAIN] + p * frequencies;
    } else {
        row->weight = ((const double *)c->column[WEIGHT])[p];
        row->patch = ((const double *)c->column[PATCH])[p];
        memcpy(row->part, (const double *)c->column[PART] + 2 * p, sizeof row->part);
        memcpy(row->free_end, c->free_end + begin, row->count);
    }
}

KellerStatus keller_cursor_next(KellerPathCursor *c, const KellerPathRow **row, KellerError *error)
{
    *row = NULL;
    if (c->at == c->count) {
        c->first += c->count;
        c->count = c->at = 0;
        if (c->first == keller_reader_info(c->reader)->paths) return KELLER_OK;
        KellerStatus status = read_block(c, error);
        if (status != KELLER_OK) return status;
    }
    set_row(c, c->at++);
    *row = &c->row;
    return KELLER_OK;
}

KellerStatus keller_each_path(KellerReader *reader, const char *file, KellerVisitPath visit, void *context,
                              KellerError *error)
{
    KellerPathCursor *cursor = NULL;
    const KellerPathRow *row = NULL;
    KellerStatus status = keller_cursor_open(reader, file, KELLER_ROWS_FIELDS, &cursor, error);
    if (status == KELLER_OK) status = keller_cursor_next(cursor, &row, error);
    while (status == KELLER_OK && row) {
        status = visit(context, row, error);
        if (status == KELLER_OK) status = keller_cursor_next(cursor, &row, error);
    }
    keller_cursor_close(cursor);
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
