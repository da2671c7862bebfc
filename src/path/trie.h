/* Candidate sequences, each stored once: a trie of steps. */
#ifndef KELLER_PATH_TRIE_H
#define KELLER_PATH_TRIE_H
#include "path/internal.h"

/* Sequences that one end may have; beyond, the orders asked for are out of reach (2^27 take 3 GB with their table). */
#define TRIE_MOST (1u << 27)
#define TRIE_FULL "more candidate sequences than memory, or 134 million, holds; expected fewer interactions"

typedef struct {
    uint32_t parent;
    StepCode code;
    uint8_t length;             /* of the sequence from the root */
    uint8_t wedge_at;           /* place of its wedge, from 1; 0: none */
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
/* Adds all sequences of `from` to `into`; false: out of memory. */
bool trie_merge(Trie *into, const Trie *from);

/* The sequences of one length with the wedge at one place, sorted by their last step, then by the steps before. */
typedef struct {
    uint32_t *nodes;
    uint32_t count;
} TrieList;
/* false: out of memory. Free with free(list->nodes). */
bool trie_list(const Trie *trie, uint32_t length, uint32_t wedge_at, TrieList *list);
/* Writes the steps of a sequence, first to last; returns its length. */
uint32_t trie_steps(const Trie *trie, uint32_t node, StepCode *codes);

#endif
