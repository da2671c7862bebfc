/* io/text.h -- reading a whole file, strict numbers and a cursor over the lines and words of a text.
 *
 * Numbers do not depend on the process's locale, and nothing is guessed: "1,5", "0x10", "nan" and "1e999" are not
 * numbers here. */
#ifndef KELLER_IO_TEXT_H
#define KELLER_IO_TEXT_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "keller/error.h"

/* Files above this are refused before memory is asked for: 8 GiB. */
#define KELLER_TEXT_MAX_FILE ((uint64_t)8 << 30)

/* Reads the whole regular file into *data (malloc'd, owned by the caller, followed by one NUL that *size does not count).
 * `where` (may be NULL) stands before the message of a failure: the place that named the file, "scene.xml:12".
 * Errors: KELLER_IO (cannot open or read, not a regular file), KELLER_BAD_INPUT (too large), KELLER_FAILED (memory). */
KellerStatus keller_text_load(const char *file, const char *where, char **data, size_t *size, KellerError *error);

/* Reads the longest number [+-]digits[.digits][e[+-]digits] at *p (".5" and "5." are numbers too) and moves *p behind it.
 * No blanks are skipped; what follows is the caller's concern. The value is the double nearest to the text. False, with
 * *p and *out unchanged, where there is no number or it overflows (so *out is always finite). */
bool keller_text_double(const char **p, const char *end, double *out);

/* The same for [+-]digits that fit an int64_t. */
bool keller_text_integer(const char **p, const char *end, int64_t *out);

/* Some bytes of a text: [begin, end). */
typedef struct {
    const char *begin, *end;
} KellerToken;

bool keller_token_is(KellerToken token, const char *word);
bool keller_token_is_nocase(KellerToken token, const char *word); /* ASCII letters */
/* True if the whole token is a number. */
bool keller_token_double(KellerToken token, double *out);
bool keller_token_integer(KellerToken token, int64_t *out);

/* The token's start, for a message: at most 40 bytes, control characters as `?`. */
typedef struct {
    char text[48];
} KellerQuote;
KellerQuote keller_token_quote(KellerToken token);

/* A cursor. Lines end in LF, CR LF or CR; words are separated by blanks and tabs. */
typedef struct {
    const char *file;      /* for messages */
    const char *p, *end;
    unsigned long line;    /* of p, from 1 */
    char comment;          /* this character starts a comment that ends with the line; 0: none */
    bool continuation;     /* a backslash before the line's end joins the next line */
} KellerText;

KellerText keller_text(const char *file, const char *data, size_t size);
/* The line's next word; false at the end of the line. */
bool keller_text_token(KellerText *text, KellerToken *token);
/* The rest of the line without blanks around it (comments and continuations are not looked for); may be empty. */
KellerToken keller_text_rest(KellerText *text);
/* Goes to the next line, whatever is left of this one; false where the text ends. */
bool keller_text_next_line(KellerText *text);
/* Goes on to the first line, from this one on, that holds a word; false where the text ends. */
bool keller_text_content(KellerText *text);
/* The line's next word as a finite number. Fails with a message that calls it `what`. */
KellerStatus keller_text_coordinate(KellerText *text, const char *what, double *out, KellerError *error);
#endif
