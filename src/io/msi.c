#include "keller/antenna.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "io/text.h"

#define MAX_FILE_BYTES ((off_t)1 << 20)

/* dBi over dBd: the directivity of a half-wave dipole, 1.64. */
#define DIPOLE_GAIN 2.15 /* dB */

/* Angles are written with up to two decimals. */
#define ANGLE_ROUNDING 0.005 /* deg */

static const double largest_gain = 80, largest_loss = 200; /* dB */

typedef struct {
    KellerText text;
    KellerAntennaCuts *cuts;
    KellerError *error;
    unsigned long gain_line, cut_line[2]; /* 0: not seen */
} Reader;

static KellerStatus fail(const Reader *r, const char *what, KellerToken token, const char *expected)
{
    return keller_error(r->error, KELLER_BAD_INPUT, "%s:%lu: %s \"%s\"; expected %s", r->text.file, r->text.line, what,
                        keller_token_quote(token).text, expected);
}

/* The rest of the line is empty. */
static KellerStatus end_of_line(Reader *r, const char *expected)
{
    KellerToken token;
    return keller_text_token(&r->text, &token) ? fail(r, "too much on the line:", token, expected) : KELLER_OK;
}

static KellerStatus once(const Reader *r, const char *key, unsigned long *line)
{
    if (*line)
        return keller_error(r->error, KELLER_BAD_INPUT, "%s:%lu: %s is already on line %lu; expected it once", r->text.file,
                            r->text.line, key, *line);
    *line = r->text.line;
    return KELLER_OK;
}

static KellerStatus read_gain(Reader *r)
{
    static const char *const expected = "GAIN and a number from -80 to 80 with dBd or dBi, such as 16.5 dBd";
    KellerToken value = {r->text.p, r->text.p}, unit;
    KellerStatus status = once(r, "GAIN", &r->gain_line);
    if (status != KELLER_OK) return status;
    double gain;
    if (!keller_text_token(&r->text, &value) || !keller_token_double(value, &gain) ||
        !(gain >= -largest_gain && gain <= largest_gain))
        return fail(r, "the gain is", value, expected);
    bool over_dipole = true;
    if (keller_text_token(&r->text, &unit)) {
        over_dipole = keller_token_is_nocase(unit, "dBd");
        if (!over_dipole && !keller_token_is_nocase(unit, "dBi")) return fail(r, "the gain's unit is", unit, expected);
    }
    r->cuts->gain = gain + (over_dipole ? DIPOLE_GAIN : 0);
    return end_of_line(r, expected);
}

static KellerStatus read_cut(Reader *r, int which)
{
    static const char *const names[2] = {"HORIZONTAL", "VERTICAL"};
    static const char *const expected = "an angle and a loss in dB from 0 to 200";
    double *loss = which ? r->cuts->vertical : r->cuts->horizontal;
    KellerToken token = {r->text.p, r->text.p};
    KellerStatus status = once(r, names[which], &r->cut_line[which]);
    if (status != KELLER_OK) return status;
    int64_t count;
    if (!keller_text_token(&r->text, &token) || !keller_token_integer(token, &count) || count != KELLER_CUT_ANGLES)
        return fail(r, "the number of angles of a cut is", token, "360, one a degree");
    status = end_of_line(r, "HORIZONTAL 360 or VERTICAL 360");
    for (int i = 0; i < KELLER_CUT_ANGLES && status == KELLER_OK; i++) {
        if (!keller_text_next_line(&r->text) || !keller_text_content(&r->text) || !keller_text_token(&r->text, &token))
            return keller_error(r->error, KELLER_BAD_INPUT, "%s:%lu: the file ends after %d of 360 angles of %s; expected all",
                                r->text.file, r->text.line, i, names[which]);
        double angle;
        if (!keller_token_double(token, &angle) || !(fabs(angle - i) <= ANGLE_ROUNDING)) {
            char next[64];
            snprintf(next, sizeof next, "%d deg, the next angle of %s", i, names[which]);
            return fail(r, "the angle is", token, next);
        }
        token = (KellerToken){r->text.p, r->text.p};
        if (!keller_text_token(&r->text, &token) || !keller_token_double(token, &loss[i]) ||
            !(loss[i] >= 0 && loss[i] <= largest_loss))
            return fail(r, "the loss is", token, expected);
        status = end_of_line(r, expected);
    }
    return status;
}

static KellerStatus read_lines(Reader *r)
{
    while (keller_text_content(&r->text)) {
        KellerToken key = {r->text.p, r->text.p};
        keller_text_token(&r->text, &key);
        KellerStatus status = KELLER_OK;
        if (!isalpha((unsigned char)*key.begin))
            return fail(r, "the line begins with", key, "a keyword, such as GAIN, HORIZONTAL or VERTICAL");
        if (keller_token_is_nocase(key, "GAIN")) status = read_gain(r);
        if (keller_token_is_nocase(key, "HORIZONTAL")) status = read_cut(r, 0);
        if (keller_token_is_nocase(key, "VERTICAL")) status = read_cut(r, 1);
        if (status != KELLER_OK) return status;
        if (!keller_text_next_line(&r->text)) break;
    }
    const char *missing = !r->gain_line ? "GAIN" : !r->cut_line[0] ? "HORIZONTAL" : !r->cut_line[1] ? "VERTICAL" : NULL;
    if (missing)
        return keller_error(r->error, KELLER_BAD_INPUT, "%s:%lu: the file has no %s; expected GAIN, HORIZONTAL and VERTICAL",
                            r->text.file, r->text.line, missing);
    return KELLER_OK;
}

KellerStatus keller_antenna_read(const char *file, const char *where, KellerAntennaCuts *cuts, KellerError *error)
{
    struct stat st;
    if (stat(file, &st) == 0 && st.st_size > MAX_FILE_BYTES)
        return keller_error(error, KELLER_BAD_INPUT, "%s:1: the file has %lld bytes; expected at most 1 MiB", file,
                            (long long)st.st_size);
    char *data = NULL;
    size_t size = 0;
    KellerStatus status = keller_text_load(file, where, &data, &size, error);
    if (status != KELLER_OK) return status;
    Reader reader = {.text = keller_text(file, data, size), .cuts = cuts, .error = error};
    status = read_lines(&reader);
    free(data);
    return status;
}
