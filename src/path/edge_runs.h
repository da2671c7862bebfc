/* The last edges of one end's sequences, as they are seen where the two ends meet between two edges. */
#ifndef KELLER_PATH_EDGE_RUNS_H
#define KELLER_PATH_EDGE_RUNS_H
#include "path/arrival.h"

/* A run of sequences [begin, end) that agree in the steps from their last wedge on. */
typedef struct {
    uint32_t begin, end, wedge, faces, face[KELLER_MAX_BENDS];  /* the last face first */
    EdgeImage line;             /* as seen where the two ends meet */
    Arrival all;                /* of all of them */
} EdgeRun;

typedef struct {
    EdgeRun *run;
    uint32_t count;
    double rounding;            /* m, of positions of any of them */
    double *end[6];             /* [count] x, y, z of where the lit part of each begins, and of where it ends, as seen like `line` */
} EdgeRuns;

/* All runs of the sequences nodes[begin .. end) of the trie, which are sorted by them, mirrored but for the last `without` faces; arrival: of
 * each node. Those without a wedge end the list. False: out of memory. Free with edge_runs_free in any case. */
bool edge_runs_init(EdgeRuns *runs, const KellerScene *scene, const Trie *trie, const uint32_t *nodes, const Arrival *arrival, uint32_t begin,
                    uint32_t end, uint32_t without);
void edge_runs_free(EdgeRuns *runs);

/* Keller's law at one edge: can rays that arrive at it go on to where those of the runs `begin` .. begin + count - 1 are lit? room[i] < 0:
 * surely not to that of begin + i. What millions of pairs are asked first, several at a time. */
void edge_runs_led_to(const EdgeRun *from, const EdgeRuns *to, uint32_t begin, uint32_t count, double *room);
#endif
