#include "io/names.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int compare_entries(const void *a, const void *b)
{
    const KellerNameEntry *x = a, *y = b;
    int order = strcmp(x->name, y->name);
    return order ? order : (x->item > y->item) - (x->item < y->item);
}

bool keller_names_build(KellerNameIndex *index, size_t count, char *const *names, size_t stride)
{
    *index = (KellerNameIndex){0};
    if (!count) return true;
    index->entries = malloc(count * sizeof *index->entries);
    if (!index->entries) return false;
    index->count = count;
    const char *field = (const char *)names;
    for (size_t i = 0; i < count; i++, field += stride) {
        const char *name;
        memcpy(&name, field, sizeof name);
        index->entries[i] = (KellerNameEntry){name, i};
    }
    qsort(index->entries, count, sizeof *index->entries, compare_entries);
    return true;
}

void keller_names_free(KellerNameIndex *index)
{
    free(index->entries);
    *index = (KellerNameIndex){0};
}

size_t keller_names_find(const KellerNameIndex *index, const char *name)
{
    size_t low = 0, high = index->count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (strcmp(index->entries[middle].name, name) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    bool found = low < index->count && strcmp(index->entries[low].name, name) == 0;
    return found ? index->entries[low].item : KELLER_NO_NAME;
}

size_t keller_names_duplicate(const KellerNameIndex *index)
{
    size_t lowest = KELLER_NO_NAME;
    for (size_t i = 1; i < index->count; i++)
        if (strcmp(index->entries[i - 1].name, index->entries[i].name) == 0 && index->entries[i].item < lowest)
            lowest = index->entries[i].item;
    return lowest;
}

#define LONGEST 48

/* Edits (insert, delete, replace, exchange two neighbours) that turn a into b; both at most LONGEST bytes. */
static size_t edit_distance(const char *a, size_t n, const char *b, size_t m)
{
    uint8_t row[3][LONGEST + 1] = {{0}};
    uint8_t *before = row[0], *last = row[1], *now = row[2];
    for (size_t j = 0; j <= m; j++) last[j] = (uint8_t)j;
    for (size_t i = 1; i <= n; i++) {
        now[0] = (uint8_t)i;
        for (size_t j = 1; j <= m; j++) {
            int best = last[j - 1] + (a[i - 1] != b[j - 1]);
            if (last[j] + 1 < best) best = last[j] + 1;
            if (now[j - 1] + 1 < best) best = now[j - 1] + 1;
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] && before[j - 2] + 1 < best)
                best = before[j - 2] + 1;
            now[j] = (uint8_t)best;
        }
        uint8_t *free_row = before;
        before = last;
        last = now;
        now = free_row;
    }
    return last[m];
}

KellerNearest keller_nearest(const char *word) { return (KellerNearest){.word = word, .distance = KELLER_NO_NAME}; }

void keller_nearest_offer(KellerNearest *nearest, const char *candidate)
{
    size_t n = strlen(nearest->word), m = strlen(candidate);
    if (n > LONGEST || m > LONGEST) return;
    size_t distance = edit_distance(nearest->word, n, candidate, m);
    if (distance < nearest->distance) {
        nearest->distance = distance;
        nearest->best = candidate;
    }
}

const char *keller_nearest_hint(const KellerNearest *nearest, char hint[KELLER_HINT_BYTES])
{
    hint[0] = '\0';
    if (nearest->best && nearest->distance <= strlen(nearest->word) / 3)
        snprintf(hint, KELLER_HINT_BYTES, "; did you mean \"%s\"?", nearest->best);
    return hint;
}

KellerQuote keller_quote(const char *text)
{
    while (*text && (unsigned char)*text <= ' ') text++;
    const char *end = text + strlen(text);
    while (end > text && (unsigned char)end[-1] <= ' ') end--;
    return keller_token_quote((KellerToken){text, end});
}
