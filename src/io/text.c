#define _GNU_SOURCE /* newlocale, strtod_l */
#include "io/text.h"

#include <errno.h>
#include <fcntl.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static KellerStatus fill(int descriptor, const char *file, const char *prefix, const char *colon, char **data,
                         size_t *size, KellerError *error)
{
    struct stat status;
    if (fstat(descriptor, &status) != 0)
        return keller_error(error, KELLER_IO, "%s%scannot read `%s`: %s", prefix, colon, file, strerror(errno));
    /* A pipe or a device could deliver without end. */
    if (!S_ISREG(status.st_mode))
        return keller_error(error, KELLER_IO, "%s%scannot read `%s`: it is %s; expected a regular file", prefix, colon,
                            file, S_ISDIR(status.st_mode) ? "a folder" : "a pipe or a device");
    if ((uint64_t)status.st_size > KELLER_TEXT_MAX_FILE)
        return keller_error(error, KELLER_BAD_INPUT, "%s%s%s: the file has %lld bytes; expected at most %llu", prefix,
                            colon, file, (long long)status.st_size, (unsigned long long)KELLER_TEXT_MAX_FILE);
    size_t length = (size_t)status.st_size, done = 0;
    char *buffer = malloc(length + 1);
    if (!buffer) return keller_error_memory(error, length + 1);
    while (done < length) {
        ssize_t got = read(descriptor, buffer + done, length - done);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) {
            int reason = errno;
            free(buffer);
            return keller_error(error, KELLER_IO, "%s%scannot read `%s`: %s", prefix, colon, file, strerror(reason));
        }
        if (got == 0) break; /* it became shorter meanwhile: the reader will find it truncated */
        done += (size_t)got;
    }
    buffer[done] = '\0';
    *data = buffer;
    *size = done;
    return KELLER_OK;
}

KellerStatus keller_text_load(const char *file, const char *where, char **data, size_t *size, KellerError *error)
{
    const char *prefix = where ? where : "", *colon = where ? ": " : "";
    *data = NULL;
    *size = 0;
    /* O_NONBLOCK: opening a pipe that nobody writes to must not hang. */
    int descriptor = open(file, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (descriptor < 0)
        return keller_error(error, KELLER_IO, "%s%scannot open `%s`: %s", prefix, colon, file, strerror(errno));
    KellerStatus status = fill(descriptor, file, prefix, colon, data, size, error);
    close(descriptor);
    return status;
}

static bool digit(char c) { return c >= '0' && c <= '9'; }

/* Reads through the C locale, whatever the process's locale is. */
static double slow_double(const char *begin, const char *end)
{
    char copy[1024];
    size_t length = (size_t)(end - begin);
    memcpy(copy, begin, length);
    copy[length] = '\0';
    /* In glibc and musl this returns a static object. */
    locale_t c = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (c == (locale_t)0) return HUGE_VAL;
    double value = strtod_l(copy, NULL, c);
    freelocale(c);
    return value;
}

bool keller_text_double(const char **p, const char *end, double *out)
{
    static const double power[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                   1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    const char *q = *p;
    bool negative = q < end && *q == '-';
    if (q < end && (*q == '-' || *q == '+')) q++;
    uint64_t mantissa = 0;
    int digits = 0, significant = 0;
    long exponent = 0;
    bool fraction = false;
    for (; q < end && (digit(*q) || (*q == '.' && !fraction)); q++) {
        if (*q == '.') {
            fraction = true;
            continue;
        }
        digits = 1;
        if (significant < 19) mantissa = mantissa * 10 + (uint64_t)(*q - '0');
        if (mantissa > 0) significant += significant < 100;
        if (fraction) exponent--;
    }
    if (!digits) return false;
    const char *e = q;
    if (e < end && (*e == 'e' || *e == 'E')) {
        e++;
        bool minus = e < end && *e == '-';
        if (e < end && (*e == '-' || *e == '+')) e++;
        if (e < end && digit(*e)) {
            long value = 0;
            for (; e < end && digit(*e); e++)
                if (value < 100000) value = value * 10 + (*e - '0');
            exponent += minus ? -value : value;
            q = e;
        }
    }
    double value;
    /* Clinger 1990: with a mantissa below 2^53 and a power of ten that is a double, one operation rounds once. */
    if (significant <= 18 && mantissa < (1ull << 53) && exponent >= -22 && exponent <= 22) {
        value = exponent < 0 ? (double)mantissa / power[-exponent] : (double)mantissa * power[exponent];
        if (negative) value = -value;
    } else if (q - *p < 1024) {
        value = slow_double(*p, q);
    } else {
        return false;
    }
    if (!isfinite(value)) return false;
    *p = q;
    *out = value;
    return true;
}

bool keller_text_integer(const char **p, const char *end, int64_t *out)
{
    const char *q = *p;
    bool negative = q < end && *q == '-';
    if (q < end && (*q == '-' || *q == '+')) q++;
    if (q >= end || !digit(*q)) return false;
    int64_t value = 0;
    for (; q < end && digit(*q); q++) {
        int d = *q - '0';
        if (value > (INT64_MAX - d) / 10) return false;
        value = value * 10 + d;
    }
    *p = q;
    *out = negative ? -value : value;
    return true;
}

bool keller_token_is(KellerToken token, const char *word)
{
    size_t length = strlen(word);
    return (size_t)(token.end - token.begin) == length && memcmp(token.begin, word, length) == 0;
}

bool keller_token_is_nocase(KellerToken token, const char *word)
{
    const char *p = token.begin;
    for (; p < token.end && *word; p++, word++) {
        char a = *p >= 'A' && *p <= 'Z' ? (char)(*p + 32) : *p, b = *word >= 'A' && *word <= 'Z' ? (char)(*word + 32) : *word;
        if (a != b) return false;
    }
    return p == token.end && !*word;
}

bool keller_token_double(KellerToken token, double *out)
{
    const char *p = token.begin;
    double value;
    if (!keller_text_double(&p, token.end, &value) || p != token.end) return false;
    *out = value;
    return true;
}

bool keller_token_integer(KellerToken token, int64_t *out)
{
    const char *p = token.begin;
    int64_t value;
    if (!keller_text_integer(&p, token.end, &value) || p != token.end) return false;
    *out = value;
    return true;
}

KellerQuote keller_token_quote(KellerToken token)
{
    KellerQuote quote;
    size_t length = (size_t)(token.end - token.begin), cut = length;
    if (length > 40) {
        cut = 40;
        while (cut > 0 && ((unsigned char)token.begin[cut] & 0xc0) == 0x80) cut--; /* not inside a UTF-8 character */
    }
    for (size_t i = 0; i < cut; i++) {
        unsigned char c = (unsigned char)token.begin[i];
        quote.text[i] = c < 32 || c == 127 ? '?' : (char)c;
    }
    strcpy(quote.text + cut, cut < length ? "..." : "");
    return quote;
}

KellerText keller_text(const char *file, const char *data, size_t size)
{
    return (KellerText){.file = file, .p = data, .end = data + size, .line = 1};
}

static bool line_end(char c) { return c == '\n' || c == '\r'; }
static bool blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }

/* Behind the line end at p, or p where there is none. */
static const char *after_line_end(const char *p, const char *end)
{
    if (p < end && *p == '\r') return p + 1 < end && p[1] == '\n' ? p + 2 : p + 1;
    return p < end && *p == '\n' ? p + 1 : p;
}

bool keller_text_token(KellerText *text, KellerToken *token)
{
    const char *p = text->p, *end = text->end;
    for (;;) {
        while (p < end && blank(*p)) p++;
        if (!text->continuation || p >= end || *p != '\\' || p + 1 >= end || !line_end(p[1])) break;
        p = after_line_end(p + 1, end);
        text->line++;
    }
    if (p < end && text->comment && *p == text->comment)
        while (p < end && !line_end(*p)) p++;
    const char *begin = p;
    while (p < end && !blank(*p) && !line_end(*p) && !(text->comment && *p == text->comment)) {
        if (text->continuation && *p == '\\' && p + 1 < end && line_end(p[1])) break;
        p++;
    }
    text->p = p;
    *token = (KellerToken){begin, p};
    return p > begin;
}

KellerToken keller_text_rest(KellerText *text)
{
    const char *p = text->p, *end = text->end;
    while (p < end && blank(*p)) p++;
    const char *begin = p;
    while (p < end && !line_end(*p)) p++;
    text->p = p;
    while (p > begin && blank(p[-1])) p--;
    return (KellerToken){begin, p};
}

bool keller_text_next_line(KellerText *text)
{
    const char *p = text->p;
    while (p < text->end && !line_end(*p)) p++;
    text->p = after_line_end(p, text->end);
    if (text->p > p) text->line++;
    return text->p < text->end;
}

bool keller_text_content(KellerText *text)
{
    do {
        KellerText ahead = *text;
        KellerToken token;
        if (keller_text_token(&ahead, &token)) return true;
    } while (keller_text_next_line(text));
    return false;
}

KellerStatus keller_text_coordinate(KellerText *text, const char *what, double *out, KellerError *error)
{
    KellerToken token;
    if (!keller_text_token(text, &token))
        return keller_error(error, KELLER_BAD_INPUT, "%s:%lu: the line ends before %s; expected a finite number",
                            text->file, text->line, what);
    if (!keller_token_double(token, out))
        return keller_error(error, KELLER_BAD_INPUT, "%s:%lu: %s is `%s`; expected a finite number such as -12.5",
                            text->file, text->line, what, keller_token_quote(token).text);
    return KELLER_OK;
}
