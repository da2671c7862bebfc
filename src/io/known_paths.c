#include "io/known_paths.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct KellerKnownPaths {
    const char *file;
    const KellerScene *scene;
    KellerPathCursor *cursor;
    const KellerPathRow *next;  /* NULL: behind the last */
    uint64_t count, all;
};

KellerStatus keller_known_open(KellerReader *reader, const char *file, const KellerScene *scene, KellerKnownPaths **known,
                               KellerError *error)
{
    KellerKnownPaths *k = calloc(1, sizeof *k);
    *known = NULL;
    if (!k) return keller_error_memory(error, sizeof *k);
    *k = (KellerKnownPaths){.file = file, .scene = scene, .all = keller_reader_info(reader)->paths};
    KellerStatus status = keller_cursor_open(reader, file, KELLER_ROWS_GEOMETRY, &k->cursor, error);
    if (status == KELLER_OK) status = keller_cursor_next(k->cursor, &k->next, error);
    if (status == KELLER_OK) *known = k;
    else keller_known_close(k);
    return status;
}

void keller_known_close(KellerKnownPaths *known)
{
    if (!known) return;
    keller_cursor_close(known->cursor);
    free(known);
}

static KellerStatus bad_path(const KellerKnownPaths *k, const char *what, KellerError *error)
{
    return keller_error(error, KELLER_BAD_INPUT, "%s: path %llu %s; expected a complete result of keller run", k->file,
                        (unsigned long long)k->next->number, what);
}

/* All of the path but its legs; false if it names what the scene has not, or its numbers are none. */
static bool path_of(const KellerScene *scene, const KellerPathRow *row, KellerPath *p)
{
    uint32_t patches = 0;
    p->count = row->count;
    p->length = row->length;
    p->weight = row->weight;
    p->patch = row->patch;
    memcpy(p->part, row->part, sizeof p->part);
    memset(p->leg, 0, (row->count + 1) * sizeof *p->leg);
    for (uint32_t i = 0; i < row->count; ++i) {
        bool edge = row->kind[i] == KELLER_DIFFRACTION;
        if (row->id[i] >= (edge ? scene->wedge_count : scene->triangle_count)) return false;
        p->step[i] = (KellerStep){(KellerInteractionKind)row->kind[i], edge ? row->id[i] : scene->triangle_face[row->id[i]]};
        p->triangle[i] = edge ? KELLER_NONE : row->id[i];
        p->position[i] = row->position[i];
        p->free_end[i] = row->free_end[i] & 3;
        patches += row->kind[i] == KELLER_SCATTERING;
    }
    return p->weight > 0 && p->weight <= 1 && p->length > 0 && isfinite(p->length) && isfinite(p->part[0]) && isfinite(p->part[1]) &&
           patches <= 1 && (patches ? p->patch > 0 && isfinite(p->patch) : p->patch == 0);
}

static KellerStatus hand_out(void *context, uint32_t tx, uint32_t rx, KellerPathFound found, void *found_context, KellerError *error)
{
    KellerKnownPaths *k = context;
    for (; k->next; ) {
        if (k->next->tx < tx || (k->next->tx == tx && k->next->rx < rx)) return bad_path(k, "is out of order", error);
        if (k->next->tx != tx || k->next->rx != rx) break;
        KellerPath path;
        if (!path_of(k->scene, k->next, &path)) return bad_path(k, "does not fit the scene, or has numbers that are none", error);
        if (!found(found_context, &path)) return keller_error(error, KELLER_FAILED, "out of memory for the paths of %s", k->file);
        k->count++;
        KellerStatus status = keller_cursor_next(k->cursor, &k->next, error);
        if (status != KELLER_OK) return status;
    }
    return KELLER_OK;
}

KellerPathSource keller_known_source(KellerKnownPaths *known) { return (KellerPathSource){known, known->file, hand_out}; }

KellerStatus keller_known_count(const KellerKnownPaths *known, uint64_t *count, KellerError *error)
{
    *count = known->count;
    return known->next ? bad_path(known, "is out of order", error) : KELLER_OK;
}
