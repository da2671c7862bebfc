#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include "cli/cli.h"

void keller_row(const char *name, const char *format, ...)
{
    printf("  %-18s ", name);
    va_list args;
    va_start(args, format);
    vprintf(format, args);
    va_end(args);
    putchar('\n');
}

void keller_row_of_texts(const char *name, char *const *texts, uint64_t count, uint64_t most)
{
    enum { START = 21, WIDTH = 118 };
    int at = printf("  %-18s %llu", name, (unsigned long long)count);
    for (uint64_t i = 0; i < count && i < most; ++i) {
        size_t length = strlen(texts[i]);
        bool wrap = i > 0 && (length > WIDTH || at + 2 + (int)length > WIDTH);
        at = (wrap ? START : at + 2) + (int)(length < WIDTH ? length : WIDTH);
        if (wrap) printf(",\n%*s", START, "");
        else fputs(i ? ", " : ": ", stdout);
        keller_put_text(texts[i]);
    }
    if (count > most) printf(" and %llu more", (unsigned long long)(count - most));
    putchar('\n');
}

const char *keller_si(double value, const char *unit, char text[32])
{
    static const struct { double factor; const char *prefix; } prefixes[] = {
        {1e12, "T"}, {1e9, "G"}, {1e6, "M"}, {1e3, "k"}, {1, ""}, {1e-3, "m"}, {1e-6, "u"}, {1e-9, "n"}};
    size_t i = 0, last = sizeof prefixes / sizeof *prefixes - 1;
    while (i < last && !(fabs(value) >= prefixes[i].factor)) ++i;
    if (value == 0 || !isfinite(value)) snprintf(text, 32, "%g %s", value, unit);
    else snprintf(text, 32, "%.6g %s%s", value / prefixes[i].factor, prefixes[i].prefix, unit);
    return text;
}

void keller_put_text(const char *text)
{
    for (; *text; ++text) putchar((unsigned char)*text < 32 || *text == 127 ? '?' : *text);
}

double keller_decibel(double amplitude) { return 20 * log10(amplitude); }

/* Length of the UTF-8 character at text, 0 if it is not one. */
static size_t character(const unsigned char *text)
{
    size_t length = text[0] < 0x80 ? 1 : text[0] >= 0xc2 && text[0] < 0xe0 ? 2 : text[0] >= 0xe0 && text[0] < 0xf0 ? 3
                    : text[0] >= 0xf0 && text[0] < 0xf5 ? 4 : 0;
    for (size_t i = 1; i < length; ++i)
        if ((text[i] & 0xc0) != 0x80) return 0;
    /* overlong forms, surrogates, beyond U+10FFFF */
    if ((text[0] == 0xe0 && text[1] < 0xa0) || (text[0] == 0xed && text[1] > 0x9f) ||
        (text[0] == 0xf0 && text[1] < 0x90) || (text[0] == 0xf4 && text[1] > 0x8f)) return 0;
    return length;
}

void keller_put_json(FILE *out, const char *text)
{
    fputc('"', out);
    for (const unsigned char *c = (const unsigned char *)text; *c;) {
        size_t length = character(c);
        if (length == 0) fputs("\\ufffd", out);
        else if (*c == '"' || *c == '\\') fprintf(out, "\\%c", *c);
        else if (*c < 32) fprintf(out, "\\u%04x", *c);
        else fwrite(c, 1, length, out);
        c += length ? length : 1;
    }
    fputc('"', out);
}

void keller_put_csv(FILE *out, const char *text)
{
    if (!strpbrk(text, ",\"\r\n")) {
        fputs(text, out);
        return;
    }
    fputc('"', out);
    for (; *text; ++text) {
        if (*text == '"') fputc('"', out);
        fputc(*text, out);
    }
    fputc('"', out);
}

void keller_put_json_number(FILE *out, double value)
{
    if (isfinite(value)) fprintf(out, "%.17g", value);
    else fputs("null", out);
}
