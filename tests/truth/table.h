/* truth/table.h -- reads a table of reference values for a test: named columns, numbers, fractions such as 3/2. */
#ifndef TRUTH_TABLE_H
#define TRUTH_TABLE_H
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    FILE *file;
    char header[1024], line[2048];
} Table;

/* Opens FOLDER/NAME; false where there is none. */
static inline bool table_open_in(Table *t, const char *folder, const char *name)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    t->file = fopen(path, "r");
    if (!t->file) return false;
    if (!fgets(t->header, sizeof t->header, t->file)) t->header[0] = '\0';
    t->header[strcspn(t->header, "\r\n")] = '\0';
    return true;
}

/* Opens <source>/tests/truth/NAME, or with `full` <source>/../shared/truth/NAME. */
static inline bool table_open(Table *t, const char *name, bool full)
{
    const char *source = getenv("KELLER_SOURCE");
    char folder[4000];
    snprintf(folder, sizeof folder, "%s/%s", source ? source : ".", full ? "../shared/truth" : "tests/truth");
    return table_open_in(t, folder, name);
}

static inline bool table_next(Table *t)
{
    if (!fgets(t->line, sizeof t->line, t->file)) {
        fclose(t->file);
        return false;
    }
    t->line[strcspn(t->line, "\r\n")] = '\0';
    return true;
}

/* The text of a column in the current row; the test ends where there is no such column. */
static inline const char *table_text(const Table *t, const char *column, char *buffer, size_t size)
{
    const char *h = t->header, *p = t->line;
    for (;;) {
        size_t hn = strcspn(h, ","), pn = strcspn(p, ",");
        if (hn == strlen(column) && strncmp(h, column, hn) == 0) {
            snprintf(buffer, size, "%.*s", (int)pn, p);
            return buffer;
        }
        if (!h[hn] || !p[pn]) break;
        h += hn + 1;
        p += pn + 1;
    }
    fprintf(stderr, "no column %s\n", column);
    abort();
}

static inline double table_number(const Table *t, const char *column)
{
    char text[128], *end;
    table_text(t, column, text, sizeof text);
    double value = strtod(text, &end);
    if (*end == '/') value /= strtod(end + 1, &end);
    return *text ? value : NAN;
}
#endif
