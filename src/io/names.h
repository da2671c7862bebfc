/* io/names.h -- finding things by name: a sorted index, and the nearest miss for a message. */
#ifndef KELLER_IO_NAMES_H
#define KELLER_IO_NAMES_H
#include "io/text.h"
#include <stdbool.h>
#include <stddef.h>

#define KELLER_NO_NAME ((size_t)-1)

typedef struct {
    const char *name; /* not owned */
    size_t item;
} KellerNameEntry;

typedef struct {
    size_t count;
    KellerNameEntry *entries; /* sorted by name, then item */
} KellerNameIndex;

/* An index over names[0], names[1], ..., the names `stride` bytes apart (they may be fields of structs). False:
 * memory. */
bool keller_names_build(KellerNameIndex *index, size_t count, char *const *names, size_t stride);
void keller_names_free(KellerNameIndex *index);
/* The lowest item of that name, or KELLER_NO_NAME. */
size_t keller_names_find(const KellerNameIndex *index, const char *name);
/* The lowest item whose name an earlier item has, or KELLER_NO_NAME. */
size_t keller_names_duplicate(const KellerNameIndex *index);

/* Collects the candidate nearest to `word` in edit distance. */
typedef struct {
    const char *word, *best;
    size_t distance;
} KellerNearest;
KellerNearest keller_nearest(const char *word);
void keller_nearest_offer(KellerNearest *nearest, const char *candidate);
/* The best candidate where it is near enough to be a slip of the pen, as `; did you mean "..."?`, else "". Written to
 * hint and returned. */
#define KELLER_HINT_BYTES 96
const char *keller_nearest_hint(const KellerNearest *nearest, char hint[KELLER_HINT_BYTES]);

/* `text`, blanks at its ends dropped, for a message (keller_token_quote). */
KellerQuote keller_quote(const char *text);
#endif
