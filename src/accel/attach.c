#include "accel/attach.h"

#include <stdlib.h>
#include <string.h>

#include "keller/vec.h"

#define NONE UINT32_MAX

/* A hash table of the edges by their ends: a chain of edges a slot, linked by `next`. */
typedef struct {
    uint32_t *slot, *next, mask;
} Table;

static uint32_t hash(uint32_t a, uint32_t b) /* the same either way round; multipliers of Knuth 6.4 and of MurmurHash3 */
{
    uint64_t low = a < b ? a : b, high = a < b ? b : a, h = low * 2654435769u ^ (high * 0xff51afd7ed558ccdu);
    return (uint32_t)(h >> 32 ^ h);
}

static void fill(Table *t, uint32_t count, const uint32_t (*edges)[2])
{
    memset(t->slot, 0xff, ((size_t)t->mask + 1) * sizeof *t->slot);
    for (uint32_t i = count; i-- > 0;) {
        uint32_t s = hash(edges[i][0], edges[i][1]) & t->mask;
        t->next[i] = t->slot[s];
        t->slot[s] = i;
    }
}

/* Takes edges from a to b out of the table: all of them but where there are very many, as they are copied along with the triangle. */
enum { TAKE_MOST = 4 };

static void take(Table *t, const uint32_t (*edges)[2], uint32_t a, uint32_t b, uint32_t triangle, uint32_t *owner)
{
    int taken = 0;
    for (uint32_t *link = &t->slot[hash(a, b) & t->mask]; *link != NONE && taken < TAKE_MOST;) {
        const uint32_t *e = edges[*link];
        if ((e[0] == a && e[1] == b) || (e[0] == b && e[1] == a)) {
            owner[*link] = triangle;
            *link = t->next[*link];
            taken++;
        } else {
            link = &t->next[*link];
        }
    }
}

KellerStatus attach_edges(uint32_t triangle_count, const uint32_t (*triangles)[3], uint32_t edge_count,
                          const uint32_t (*edges)[2], Attached *attached, KellerError *error)
{
    Table t = {.mask = 1};
    while (t.mask < edge_count) t.mask = 2 * t.mask + 1;
    size_t slots = (size_t)t.mask + 1, bytes = (slots + 3 * (size_t)edge_count + triangle_count + 2) * sizeof(uint32_t);
    t.slot = malloc(slots * sizeof *t.slot);
    t.next = malloc(((size_t)edge_count + 1) * sizeof *t.next);
    uint32_t *owner = malloc(((size_t)edge_count + 1) * sizeof *owner);
    *attached = (Attached){calloc((size_t)triangle_count + 2, sizeof *attached->begin),
                           malloc(((size_t)edge_count + 1) * sizeof *attached->edges), 0};
    KellerStatus status = KELLER_OK;
    if (!t.slot || !t.next || !owner || !attached->begin || !attached->edges) {
        attached_free(attached);
        status = keller_error_memory(error, bytes);
    } else {
        fill(&t, edge_count, edges);
        memset(owner, 0xff, (size_t)edge_count * sizeof *owner);
        for (uint32_t i = 0; i < triangle_count; i++)
            for (int k = 0; k < 3; k++) take(&t, edges, triangles[i][k], triangles[i][(k + 1) % 3], i, owner);
        /* a counting sort by owner, which keeps the order of the edges; those alone come last */
        uint32_t *begin = attached->begin;
        for (uint32_t i = 0; i < edge_count; i++) {
            if (owner[i] == NONE) owner[i] = triangle_count;
            begin[owner[i] + 1]++;
        }
        attached->alone = begin[triangle_count + 1];
        for (uint32_t i = 0; i <= triangle_count; i++) begin[i + 1] += begin[i];
        for (uint32_t i = edge_count; i-- > 0;) attached->edges[--begin[owner[i] + 1]] = i;
        memmove(begin, begin + 1, ((size_t)triangle_count + 1) * sizeof *begin);
    }
    free(t.slot);
    free(t.next);
    free(owner);
    return status;
}

KellerStatus spread_edges(uint32_t triangle_count, uint32_t edge_count, Attached *attached, KellerError *error)
{
    size_t bytes = ((size_t)triangle_count + edge_count + 3) * sizeof *attached->edges;
    *attached = (Attached){malloc(((size_t)triangle_count + 2) * sizeof *attached->begin),
                           malloc(((size_t)edge_count + 1) * sizeof *attached->edges), triangle_count ? 0 : edge_count};
    if (!attached->begin || !attached->edges) {
        attached_free(attached);
        return keller_error_memory(error, bytes);
    }
    for (uint32_t i = 0; i < edge_count; i++) attached->edges[i] = i;
    attached->begin[0] = 0;
    for (uint32_t i = 1; i <= triangle_count; i++) attached->begin[i] = (uint32_t)((uint64_t)edge_count * i / triangle_count);
    return KELLER_OK;
}

void attached_free(Attached *attached)
{
    free(attached->begin);
    free(attached->edges);
    *attached = (Attached){0};
}
