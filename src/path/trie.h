/* Candidate sequences, each stored once: a trie of steps. */
#ifndef KELLER_PATH_TRIE_H
#define KELLER_PATH_TRIE_H
#include "path/internal.h"

typedef struct {
    uint32_t parent;
    StepCode code;
    uint8_t length, wedges;     /* of the sequence from the root */
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
/* The sequence `parent` followed by `code`, added if new; KELLER_NONE: out of memory. */
uint32_t trie_child(Trie *trie, uint32_t parent, StepCode code);
/* Adds all sequences of `from` to `into`; false: out of memory. */
bool trie_merge(Trie *into, const Trie *from);

/* The sequences of one length, sorted by their last step, then by the steps before. */
typedef struct {
    uint32_t *nodes;
    uint32_t count;
} TrieList;
/* lists[0 .. length_max - 1] for lengths 1 .. length_max; false: out of memory. Free each with free(list.nodes). */
bool trie_lists(const Trie *trie, uint32_t length_max, TrieList *lists);
/* Writes the steps of a sequence, first to last; returns its length. */
uint32_t trie_steps(const Trie *trie, uint32_t node, StepCode *codes);

#endif
