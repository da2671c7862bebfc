/* Candidate sequences, each stored once: a trie of steps. */
#ifndef KELLER_PATH_TRIE_H
#define KELLER_PATH_TRIE_H
#include "path/internal.h"

/* Sequences that one end may have; beyond, the orders asked for are out of reach (2^27 take 3 GB with their table). */
#define TRIE_MOST (1u << 27)
#define TRIE_FULL "more candidate sequences than memory, or 134 million, holds; expected fewer interactions"

/* The kinds of a sequence's steps: 1, then a bit a step, the first step's first: 1 for a wedge, 0 for a face. */
typedef uint32_t Pattern;
#define PATTERN_EMPTY 1u
static inline uint32_t pattern_length(Pattern p) { return 31u - (uint32_t)__builtin_clz(p); }
static inline uint32_t pattern_wedges(Pattern p) { return (uint32_t)__builtin_popcount(p) - 1; }
static inline Pattern pattern_and(Pattern p, bool wedge) { return p << 1 | wedge; }
/* The first steps, and the last steps in reversed order, as the other end sees them. */
static inline Pattern pattern_first(Pattern p, uint32_t count) { return p >> (pattern_length(p) - count); }
static inline Pattern pattern_last(Pattern p, uint32_t count)
{
    Pattern q = PATTERN_EMPTY;
    for (uint32_t i = 0; i < count; i++) q = pattern_and(q, p >> i & 1);
    return q;
}

/* What the plan of a search says of a pattern. */
enum {
    PLAN_WANT = 1,              /* sequences like this are asked for */
    PLAN_FACE = 2,              /* another face is of use, */
    PLAN_WEDGE = 4,             /* another wedge, */
    PLAN_BEYOND = 8             /* any step after the next one */
};

enum { LIT_WHOLE = 65535 };     /* units that an edge is long */

typedef struct {
    uint32_t parent;
    StepCode code;
    Pattern pattern;
    uint16_t lit[2];            /* the part of a last wedge's edge that cones met, rounded outwards; empty: [0] > [1] */
} TrieNode;

typedef struct {
    TrieNode *nodes;            /* nodes[0]: the empty sequence */
    uint32_t count, capacity;
    uint32_t *slots;            /* open addressing over (parent, code); 0: free */
    uint32_t slot_count;        /* a power of two */
} Trie;

/* false: out of memory */
bool trie_init(Trie *trie);
void trie_free(Trie *trie);
/* The sequence `parent` followed by `code`, added if new; KELLER_NONE: out of memory, or more than TRIE_MOST. */
uint32_t trie_child(Trie *trie, uint32_t parent, StepCode code);
/* The same, if it is there; else KELLER_NONE. */
uint32_t trie_find(const Trie *trie, uint32_t parent, StepCode code);
/* Adds all sequences of `from` to `into`; returns where each of from's nodes is now, [from->count], to be freed with free(), or NULL: out
 * of memory. */
uint32_t *trie_merge(Trie *into, const Trie *from);
/* The edge of the sequence's last wedge is met in this part of it too, from its start, as shares of its length. */
void trie_light(Trie *trie, uint32_t node, double from, double to);
/* The part that is, as shares; lit[0] > lit[1]: none. */
void trie_lit(const Trie *trie, uint32_t node, double lit[2]);
/* It is no more than this part; from > to: none. */
void trie_dim(Trie *trie, uint32_t node, double from, double to);
/* Is all of this part known to be met already? */
bool trie_is_lit(const Trie *trie, uint32_t node, double from, double to);

/* The wanted sequences by pattern, those of one pattern sorted by their last step, then by the steps before. */
typedef struct {
    uint32_t *nodes;
    StepCode *last;             /* of each: its last step */
    uint32_t count;
} TrieList;
/* All sequences whose pattern the plan (as in TreePlan) wants, sorted by pattern, and so on as above; false: out of memory. Free
 * with trie_list_free. */
bool trie_list(const Trie *trie, const uint8_t *plan, TrieList *list);
void trie_list_free(TrieList *list);
/* The part of a list that has this pattern: [*begin, the returned end). */
uint32_t trie_run(const Trie *trie, const TrieList *list, Pattern pattern, uint32_t *begin);
/* Writes the steps of a sequence, first to last; returns its length. */
uint32_t trie_steps(const Trie *trie, uint32_t node, StepCode *codes);

#endif
