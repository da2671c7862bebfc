#define _GNU_SOURCE /* asprintf */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "io/config_read.h"
#include "io/names.h"
#include "io/text.h"
#include "io/xml.h"

/* 10 million points of 100 bytes each. */
#define MAX_ROUTE_BYTES ((off_t)1 << 30)

typedef struct {
    KellerText text;
    KellerError *error;
    bool geodetic;
    int column[3]; /* which of the three fields holds x, y, z or lat, lon, height */
} Route;

static KellerStatus fail(const Route *route, const char *what, KellerToken token, const char *expected)
{
    return keller_error(route->error, KELLER_BAD_INPUT, "%s:%lu: %s \"%s\"; expected %s", route->text.file,
                        route->text.line, what, keller_token_quote(token).text, expected);
}

static bool blank(char c) { return c == ' ' || c == '\t'; }

/* Splits a line at its commas into exactly three fields. */
static bool split(KellerToken line, KellerToken field[3])
{
    const char *p = line.begin;
    for (int i = 0; i < 3; i++) {
        const char *end = p;
        while (end < line.end && *end != ',') end++;
        if ((i < 2) != (end < line.end)) return false;
        field[i] = (KellerToken){p, end};
        while (field[i].begin < field[i].end && blank(*field[i].begin)) field[i].begin++;
        while (field[i].end > field[i].begin && blank(field[i].end[-1])) field[i].end--;
        p = end + 1;
    }
    return true;
}

/* Goes to the next line that is neither empty nor a comment; false at the end of the file. */
static bool next_row(KellerText *text, bool *started, KellerToken *row)
{
    for (;;) {
        if (*started && !keller_text_next_line(text)) return false;
        if (!*started && text->p >= text->end) return false;
        *started = true;
        *row = keller_text_rest(text);
        if (row->begin < row->end && *row->begin != '#') return true;
    }
}

static KellerStatus read_header(Route *route, KellerToken row)
{
    static const char *const names[2][3] = {{"x", "y", "z"}, {"lat", "lon", "height"}};
    const char *expected = "the columns x,y,z or lat,lon,height, each once, separated by commas";
    KellerToken field[3];
    if (!split(row, field)) return fail(route, "the header line is", row, expected);
    for (int set = 0; set < 2; set++) {
        int found = 0;
        for (int c = 0; c < 3; c++)
            for (int f = 0; f < 3; f++)
                if (keller_token_is(field[f], names[set][c])) {
                    route->column[c] = f;
                    found |= 1 << c;
                }
        route->geodetic = set == 1;
        if (found == 7) return KELLER_OK;
    }
    return fail(route, "the header line is", row, expected);
}

static KellerStatus read_point(const Route *route, KellerToken row, KellerGeodetic origin, KellerVec3 *point)
{
    KellerToken field[3];
    double value[3];
    if (!split(row, field))
        return fail(route, "the line is", row, "three numbers separated by commas, as the header says");
    for (int c = 0; c < 3; c++) {
        bool angle = route->geodetic && c < 2;
        double limit = !angle ? KELLER_MAX_COORDINATE : c == 0 ? 90 : 180;
        const char *expected = !angle   ? "a number of metres (no unit), within 1e9 m"
                               : c == 0 ? "a latitude in degrees (no unit) from -90 to 90"
                                        : "a longitude in degrees (no unit) from -180 to 180";
        KellerToken token = field[route->column[c]];
        if (!keller_token_double(token, &value[c]) || !(value[c] >= -limit && value[c] <= limit))
            return fail(route, "a coordinate is", token, expected);
    }
    *point = route->geodetic ? keller_geo_to_local(origin, (KellerGeodetic){value[0], value[1], value[2]})
                             : v3(value[0], value[1], value[2]);
    return KELLER_OK;
}

static KellerStatus read_rows(Route *route, const KellerConfigReader *reader, size_t limit, KellerVec3 **points,
                              size_t *count)
{
    KellerToken row;
    bool started = false;
    size_t capacity = 0;
    if (!next_row(&route->text, &started, &row))
        return keller_error(route->error, KELLER_BAD_INPUT,
                            "%s:1: the file has no header line; expected x,y,z or lat,lon,height", route->text.file);
    KellerStatus status = read_header(route, row);
    if (status == KELLER_OK && route->geodetic && !reader->config->has_origin)
        status =
            keller_error(route->error, KELLER_BAD_INPUT,
                         "%s:%lu: columns lat,lon,height need an origin; expected <origin lat= lon= height=> in %s",
                         route->text.file, route->text.line, reader->file);
    while (status == KELLER_OK && next_row(&route->text, &started, &row)) {
        if (*count == limit)
            return keller_error(route->error, KELLER_BAD_INPUT,
                                "%s:%lu: more than %u receivers in one configuration; expected a shorter route",
                                route->text.file, route->text.line, KELLER_MAX_RECEIVERS);
        if (!keller_config_grow((void **)points, &capacity, *count, 1, sizeof **points))
            return keller_error_memory(route->error, (*count + 1) * sizeof **points);
        status = read_point(route, row, reader->config->origin, &(*points)[*count]);
        ++*count;
    }
    if (status == KELLER_OK && !*count)
        status = keller_error(route->error, KELLER_BAD_INPUT,
                              "%s:%lu: the route has no points; expected at least one line below the header",
                              route->text.file, route->text.line);
    return status;
}

KellerStatus keller_config_read_points(const KellerConfigReader *reader, const xmlNode *node, const char *path,
                                       size_t limit, KellerVec3 **points, size_t *count)
{
    *points = NULL;
    *count = 0;
    struct stat st;
    if (stat(path, &st) == 0 && st.st_size > MAX_ROUTE_BYTES)
        return keller_error(reader->error, KELLER_BAD_INPUT, "%s:1: the file has %lld bytes; expected at most 1 GiB",
                            path, (long long)st.st_size);
    char *where = NULL, *data = NULL;
    if (asprintf(&where, "%s:%d", reader->file, keller_xml_line(node)) < 0)
        return keller_error_memory(reader->error, strlen(reader->file) + 16);
    size_t size = 0;
    KellerStatus status = keller_text_load(path, where, &data, &size, reader->error);
    free(where);
    if (status != KELLER_OK) return status;
    /* a byte-order mark, as spreadsheets write it */
    size_t skip = size >= 3 && memcmp(data, "\xef\xbb\xbf", 3) == 0 ? 3 : 0;
    Route route = {.text = keller_text(path, data + skip, size - skip), .error = reader->error};
    status = read_rows(&route, reader, limit, points, count);
    free(data);
    if (status != KELLER_OK) {
        free(*points);
        *points = NULL;
        *count = 0;
    }
    return status;
}
