/* Arrays of hits, their heaps, and their sorting. */
#include <stdlib.h>

#include "accel/nexthit.h"

bool found_grow(FoundArray *a)
{
    if (a->count < a->capacity) return true;
    size_t capacity = a->capacity ? 2 * a->capacity : 64;
    Found *at = realloc(a->at, capacity * sizeof *at);
    if (!at) return false;
    a->at = at;
    a->capacity = capacity;
    return true;
}

/* Does a belong above b? */
static inline bool above(Found a, Found b, bool greatest) { return greatest ? found_before(b, a) : found_before(a, b); }

void found_sift_up(Found *at, size_t i, Found f, bool greatest)
{
    while (i > 0 && above(f, at[(i - 1) / 2], greatest)) {
        at[i] = at[(i - 1) / 2];
        i = (i - 1) / 2;
    }
    at[i] = f;
}

void found_sift_down(Found *at, size_t count, size_t i, Found f, bool greatest)
{
    for (size_t child; (child = 2 * i + 1) < count; i = child) {
        if (child + 1 < count && above(at[child + 1], at[child], greatest)) child++;
        if (!above(at[child], f, greatest)) break;
        at[i] = at[child];
    }
    at[i] = f;
}

/* Leaves come from front to back, so hits do, more or less: this many moves a hit before insertion gives up. */
enum { PATIENCE = 8 };

void found_sort(Found *at, size_t count)
{
    size_t moves = 0;
    for (size_t i = 1; i < count; i++) {
        Found f = at[i];
        size_t j = i;
        for (; j > 0 && found_before(f, at[j - 1]); j--) at[j] = at[j - 1];
        at[j] = f;
        moves += i - j;
        if (moves > PATIENCE * count) break;
    }
    if (moves <= PATIENCE * count) return;
    for (size_t i = count / 2; i-- > 0;) found_sift_down(at, count, i, at[i], true);
    for (size_t n = count; n-- > 1;) {
        Found f = at[n];
        at[n] = at[0];
        found_sift_down(at, n, 0, f, true);
    }
}
