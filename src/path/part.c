#include "path/part.h"

#include <stdlib.h>

void part_free(Part *p)
{
    trie_free(&p->trie);
    free(p->known.item);
    free(p->begin);
    *p = (Part){0};
}

static int compare_candidates(const void *pa, const void *pb)
{
    const CellCandidate *a = pa, *b = pb;
    if (a->cell != b->cell) return a->cell < b->cell ? -1 : 1;
    return a->node < b->node ? -1 : a->node > b->node;
}

KellerStatus part_sort(Part *p, KellerError *error)
{
    size_t cells = (size_t)p->nx * p->ny, n = p->known.count, at = 0, kept = 0;
    CellCandidate *item = p->known.item;
    p->begin = malloc((cells + 1) * sizeof *p->begin);
    if (!p->begin) return keller_error_memory(error, (cells + 1) * sizeof *p->begin);
    if (n > 0) qsort(item, n, sizeof *item, compare_candidates);
    for (size_t c = 0; c < cells; c++) {
        p->begin[c] = kept;
        for (; at < n && item[at].cell == c; at++)
            if (at == 0 || compare_candidates(&item[at - 1], &item[at]) != 0) item[kept++] = item[at];
    }
    p->begin[cells] = kept;
    return KELLER_OK;
}

void part_halves(const Part *p, Part half[2])
{
    half[0] = half[1] = (Part){.x = p->x, .y = p->y, .nx = p->nx, .ny = p->ny};
    if (p->ny > 1) {
        half[0].ny = p->ny / 2;
        half[1].y += half[0].ny;
        half[1].ny -= half[0].ny;
    } else {
        half[0].nx = p->nx / 2;
        half[1].x += half[0].nx;
        half[1].nx -= half[0].nx;
    }
}
