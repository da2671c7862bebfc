/* A part of a map, and what the search for it found. */
#ifndef KELLER_PATH_PART_H
#define KELLER_PATH_PART_H
#include "path/tree.h"

/* Candidates of its cell c are known.item[begin[c] .. begin[c + 1]), each once. */
typedef struct {
    Trie trie;
    CellCandidates known;
    size_t *begin;
    uint32_t x, y, nx, ny;      /* of the grid: whole rows, or a part of one, so that its receivers follow each other */
} Part;

/* Sorts the candidates by cells. KELLER_FAILED: memory. */
KellerStatus part_sort(Part *part, KellerError *error);
/* Two halves, the first ones of the receivers first, with nothing found. The part has two cells at least. */
void part_halves(const Part *part, Part half[2]);
void part_free(Part *part);
#endif
