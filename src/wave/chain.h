/* A wave over several edges, one after the other, each of which may lie in the transition zones of its neighbours.
 * docs/theory.md, "Several diffractions". */
#ifndef KELLER_WAVE_CHAIN_H
#define KELLER_WAVE_CHAIN_H
#include "wave/pair.h"
#include "wave/row.h"
#include "wave/utd.h"

/* How one edge stands in the chain. */
typedef struct {
    double distance;            /* m: the distance parameter L, but for its sin^2 beta0 */
    double coupling;            /* with the edge before, in (-1, 1); 0 for the first. With u the way of a point across the ray
                                   at an edge, towards ray x direction of the edge: the mixed second derivative of the length
                                   by the u of both, over the root of the product of those by each. Two parallel edges
                                   have -sqrt(d1 d3/((d1 + d2)(d2 + d3))), antiparallel ones the opposite */
} ChainPlace;

/* ---- of any wave -------------------------------------------------------------------------------------------------- */

/* The last edge of a chain: its terms, and what an edge behind it needs of them. */
typedef struct {
    UtdTerm term[4];
    PairSide side[4];
    double L, k;
    uint32_t edges;             /* so far */
    UtdTerm before[4];          /* of the edge before, if there is one; with it */
    double coupling[4][4];      /* [a][b]: r, as keller_edge_pair has it */
    double complex ratio[4][4]; /* the pairs' transition functions, to both edges' own */
} ChainEdge;

/* The first edge. Azimuths as in keller_utd_terms; `distance` as in ChainPlace, m. */
void chain_edge(double n, double phi, double phi_incident, double sin_beta0, double distance, double k, ChainEdge *edge);

/* From edge to edge, by the terms of the last one (c), the one before (b) and the one before that (a). */
typedef struct {
    double complex ratio[4][4];     /* [b][c]: of the pair's transition function to both edges' own */
    double complex triple[4][4][4]; /* [b][a][c]: of that of three edges to those of the pairs */
    double complex more[4][4];      /* [b][c]: what the product of the two values times the ratio lacks */
} ChainLink;

/* Puts an edge, which chain_edge has filled, behind another. */
void chain_link(const ChainEdge *before, double coupling, ChainEdge *edge, ChainLink *link);

/* A term's value behind the last edge: on a boundary its mean, 0. */
static inline double complex chain_value(const UtdTerm *term) { return term->on_boundary ? 0 : term->value; }

/* rad: what D1 and D2 are multiplied with changes places over this angle, as they are equal where phi = phi', but not their pairs'
 * functions with the terms of another edge. Far from the boundaries, which are pi off. */
#define CHAIN_BLEND 0.1

/* Functions of two and of three edges at a time are exact for three edges. From here on a ChainRow has that of all of them. */
enum { CHAIN_ROW = 4 };

/* ---- of waves with two components ---------------------------------------------------------------------------------- */

/* A long chain's edges, for the function of all of them, and what of the chain's field it takes the place of. */
typedef struct {
    uint32_t count;
    RowEdge edge[ROW_EDGES];
    double complex start[2][2]; /* what comes to the first edge, as row_field has it */
    KellerCVec3 carried[2];     /* beta0-hat and phi-hat behind the last edge so far; to be taken between edges as the rest of the chain */
    KellerCVec3 product[2][4][4]; /* of Chain.whole the part without slopes; likewise */
} ChainRow;

/* The fields of two waves (j) behind the last edge so far, by the term (b) of its coefficient and the one (a) of the edge before:
 * term[b].value times the sum of whole[j][b][a], plus rest[j][b]. Between edges each of these vectors is to be taken through what the
 * wave meets there. */
typedef struct {
    ChainEdge edge;
    KellerCVec3 whole[2][4][4], rest[2][4];
    EdgeRays rays;              /* at the last edge */
    ChainRow *row;              /* or NULL */
} Chain;

/* The first edge: unit directions `in` and `out`, incident fields e (transverse to `in`). No spreading. `row`: of a chain of CHAIN_ROW
 * edges or more (at most ROW_EDGES), to be filled, else NULL. */
void chain_begin(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, ChainPlace place, double k, const KellerCVec3 e[2],
                 ChainRow *row, Chain *chain);

/* The next edge. */
void chain_next(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, ChainPlace place, Chain *chain);

/* Both waves behind the last edge. */
void chain_fields(const Chain *chain, KellerCVec3 e[2]);

/* ---- of sound ---------------------------------------------------------------------------------------------------------- */

typedef struct {
    uint32_t count;
    RowEdge edge[ROW_EDGES];
    double complex product[4][4];
} SoundRow;

/* The same for a pressure that is 1 before the first edge. */
typedef struct {
    ChainEdge edge;
    double complex whole[4][4], rest[4];
    SoundRow *row;
} SoundChain;

void sound_chain_begin(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, ChainPlace place, double k, SoundRow *row,
                       SoundChain *chain);
void sound_chain_next(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, ChainPlace place, SoundChain *chain);
double complex sound_chain_pressure(const SoundChain *chain);
#endif
