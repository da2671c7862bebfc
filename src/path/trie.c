#define _GNU_SOURCE /* qsort_r */
#include "path/trie.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"

bool trie_init(Trie *t)
{
    memset(t, 0, sizeof *t);
    t->capacity = 64;
    t->slot_count = 256;
    t->nodes = malloc(t->capacity * sizeof *t->nodes);
    t->slots = calloc(t->slot_count, sizeof *t->slots);
    if (!t->nodes || !t->slots) {
        trie_free(t);
        return false;
    }
    t->nodes[0] = (TrieNode){.parent = KELLER_NONE, .pattern = PATTERN_EMPTY};
    t->count = 1;
    return true;
}

void trie_free(Trie *t)
{
    free(t->nodes);
    free(t->slots);
    memset(t, 0, sizeof *t);
}

static uint32_t slot_of(uint32_t parent, StepCode code, uint32_t slot_count)
{
    uint64_t key = (uint64_t)parent << 32 | code;
    key *= 0x9e3779b97f4a7c15u; /* 2^64 / golden ratio: multiplicative hashing */
    return (uint32_t)(key >> 33) & (slot_count - 1);
}

static bool rehash(Trie *t)
{
    uint32_t more = 2 * t->slot_count;
    uint32_t *slots = calloc(more, sizeof *slots);
    if (!slots) return false;
    for (uint32_t i = 1; i < t->count; i++) {
        uint32_t s = slot_of(t->nodes[i].parent, t->nodes[i].code, more);
        while (slots[s]) s = (s + 1) & (more - 1);
        slots[s] = i;
    }
    free(t->slots);
    t->slots = slots;
    t->slot_count = more;
    return true;
}

/* The slot of the sequence, or the free one where it belongs. */
static uint32_t find_slot(const Trie *t, uint32_t parent, StepCode code)
{
    uint32_t s = slot_of(parent, code, t->slot_count);
    for (; t->slots[s]; s = (s + 1) & (t->slot_count - 1)) {
        const TrieNode *n = &t->nodes[t->slots[s]];
        if (n->parent == parent && n->code == code) break;
    }
    return s;
}

uint32_t trie_find(const Trie *t, uint32_t parent, StepCode code)
{
    const uint32_t node = t->slots[find_slot(t, parent, code)];
    return node ? node : KELLER_NONE;
}

uint32_t trie_child(Trie *t, uint32_t parent, StepCode code)
{
    const uint32_t s = find_slot(t, parent, code);
    if (t->slots[s]) return t->slots[s];
    if (t->count == t->capacity) {
        if (t->capacity >= TRIE_MOST) return KELLER_NONE;
        TrieNode *nodes = realloc(t->nodes, 2 * (size_t)t->capacity * sizeof *nodes);
        if (!nodes) return KELLER_NONE;
        t->nodes = nodes;
        t->capacity *= 2;
    }
    uint32_t id = t->count++;
    t->nodes[id] = (TrieNode){parent, code, pattern_and(t->nodes[parent].pattern, code_is_wedge(code)), {LIT_WHOLE, 0}};
    t->slots[s] = id;
    if (2 * t->count > t->slot_count && !rehash(t)) return KELLER_NONE;
    return id;
}

static void add_light(TrieNode *node, const uint16_t lit[2])
{
    if (lit[0] < node->lit[0]) node->lit[0] = lit[0];
    if (lit[1] > node->lit[1]) node->lit[1] = lit[1];
}

static void lit_units(double from, double to, uint16_t lit[2])
{
    lit[0] = (uint16_t)floor(LIT_WHOLE * greater(0, lesser(1, from)));
    lit[1] = (uint16_t)ceil(LIT_WHOLE * greater(0, lesser(1, to)));
}

void trie_light(Trie *t, uint32_t node, double from, double to)
{
    uint16_t lit[2];
    lit_units(from, to, lit);
    add_light(&t->nodes[node], lit);
}

bool trie_is_lit(const Trie *t, uint32_t node, double from, double to)
{
    const uint16_t *known = t->nodes[node].lit;
    uint16_t lit[2];
    lit_units(from, to, lit);
    return known[0] <= lit[0] && known[1] >= lit[1];
}

void trie_lit(const Trie *t, uint32_t node, double lit[2])
{
    for (int k = 0; k < 2; k++) lit[k] = (double)t->nodes[node].lit[k] / LIT_WHOLE;
}

void trie_dim(Trie *t, uint32_t node, double from, double to)
{
    const uint16_t none[2] = {LIT_WHOLE, 0};
    uint16_t lit[2];
    lit_units(from, to, lit);
    memcpy(t->nodes[node].lit, from <= to ? lit : none, sizeof lit);
}

uint32_t *trie_merge(Trie *into, const Trie *from)
{
    uint32_t *map = malloc(from->count * sizeof *map);
    if (!map) return NULL;
    map[0] = 0;
    bool ok = true;
    for (uint32_t i = 1; i < from->count && ok; i++) { /* parents come before their children */
        map[i] = trie_child(into, map[from->nodes[i].parent], from->nodes[i].code);
        ok = map[i] != KELLER_NONE;
        if (ok) add_light(&into->nodes[map[i]], from->nodes[i].lit);
    }
    if (ok) return map;
    free(map);
    return NULL;
}

static int compare(const void *pa, const void *pb, void *context)
{
    const Trie *t = context;
    uint32_t a = *(const uint32_t *)pa, b = *(const uint32_t *)pb;
    if (t->nodes[a].pattern != t->nodes[b].pattern) return t->nodes[a].pattern < t->nodes[b].pattern ? -1 : 1;
    while (a != b) { /* equal lengths: the roots meet at the latest */
        const TrieNode *na = &t->nodes[a], *nb = &t->nodes[b];
        if (na->code != nb->code) return na->code < nb->code ? -1 : 1;
        a = na->parent;
        b = nb->parent;
    }
    return 0;
}

bool trie_list(const Trie *t, const uint8_t *plan, TrieList *list)
{
    *list = (TrieList){0};
    for (uint32_t i = 1; i < t->count; i++) list->count += plan[t->nodes[i].pattern] & PLAN_WANT;
    list->nodes = malloc((list->count + 1) * sizeof *list->nodes);
    list->last = malloc((list->count + 1) * sizeof *list->last);
    if (!list->nodes || !list->last) {
        trie_list_free(list);
        return false;
    }
    uint32_t n = 0;
    for (uint32_t i = 1; i < t->count; i++)
        if (plan[t->nodes[i].pattern] & PLAN_WANT) list->nodes[n++] = i;
    qsort_r(list->nodes, n, sizeof(uint32_t), compare, (void *)(uintptr_t)t);
    for (uint32_t i = 0; i < n; i++) list->last[i] = t->nodes[list->nodes[i]].code;
    return true;
}

void trie_list_free(TrieList *list)
{
    free(list->nodes);
    free(list->last);
    *list = (TrieList){0};
}

/* The first place in the list whose pattern is not below. */
static uint32_t first_of(const Trie *t, const TrieList *list, Pattern pattern)
{
    uint32_t low = 0, high = list->count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (t->nodes[list->nodes[middle]].pattern < pattern) low = middle + 1;
        else high = middle;
    }
    return low;
}

uint32_t trie_run(const Trie *t, const TrieList *list, Pattern pattern, uint32_t *begin)
{
    *begin = first_of(t, list, pattern);
    return first_of(t, list, pattern + 1);
}

uint32_t trie_steps(const Trie *t, uint32_t node, StepCode *codes)
{
    uint32_t length = pattern_length(t->nodes[node].pattern);
    for (uint32_t i = length; i-- > 0; node = t->nodes[node].parent) codes[i] = t->nodes[node].code;
    return length;
}
