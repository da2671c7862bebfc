#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include "cli/cli.h"

KellerStatus keller_usage(KellerError *error, const char *verb, const char *format, ...)
{
    char text[800];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return keller_error(error, KELLER_USAGE, "%s: %s; see `keller help %s`", verb, text, verb);
}

static int wrong(const KellerArguments *a, KellerError *error, const char *what, const char *option, int length)
{
    keller_usage(error, a->verb, "%s %.*s", what, length, option);
    return KELLER_ARGUMENT_WRONG;
}

static int long_option(KellerArguments *a, const KellerOption *options, const char *text, const char **value,
                       KellerError *error)
{
    const char *equals = strchr(text, '=');
    size_t length = equals ? (size_t)(equals - text) : strlen(text);
    for (int i = 0; options[i].name || options[i].letter; ++i) {
        const char *name = options[i].name;
        if (!name || strlen(name) != length - 2 || strncmp(text + 2, name, length - 2) != 0) continue;
        if (!options[i].has_value) {
            if (equals) return wrong(a, error, "no value is expected after", text, (int)length);
            return i;
        }
        if (equals) *value = equals + 1;
        else if (a->next < a->argc) *value = a->argv[a->next++];
        else return wrong(a, error, "a value is expected after", text, (int)length);
        return i;
    }
    return wrong(a, error, "unknown option", text, (int)length);
}

static int short_option(KellerArguments *a, const KellerOption *options, const char **value, KellerError *error)
{
    char letter[3] = {'-', *a->cluster++, '\0'};
    for (int i = 0; options[i].name || options[i].letter; ++i) {
        if (options[i].letter != letter[1]) continue;
        if (options[i].has_value) {
            if (*a->cluster) *value = a->cluster;
            else if (a->next < a->argc) *value = a->argv[a->next++];
            else return wrong(a, error, "a value is expected after", letter, 2);
            a->cluster = NULL;
        }
        return i;
    }
    return wrong(a, error, "unknown option", letter, 2);
}

int keller_next_argument(KellerArguments *a, const KellerOption *options, const char **value, KellerError *error)
{
    *value = NULL;
    if (a->cluster && *a->cluster) return short_option(a, options, value, error);
    if (a->next >= a->argc) return KELLER_ARGUMENT_END;
    const char *text = a->argv[a->next++];
    if (!a->operands_only && strcmp(text, "--") == 0) {
        a->operands_only = true;
        return keller_next_argument(a, options, value, error);
    }
    if (a->operands_only || text[0] != '-' || text[1] == '\0') {
        *value = text;
        return KELLER_ARGUMENT_OPERAND;
    }
    if (text[1] == '-') return long_option(a, options, text, value, error);
    a->cluster = text + 1;
    return short_option(a, options, value, error);
}

KellerStatus keller_refuse_input(const char *output, const char *input, const char *role, KellerError *error)
{
    struct stat out, in;
    if (stat(output, &out) != 0 || stat(input, &in) != 0) return KELLER_OK;
    if (out.st_dev != in.st_dev || out.st_ino != in.st_ino) return KELLER_OK;
    return keller_error(error, KELLER_IO,
                        "%s: is %s, which is never replaced, not even with --force; name another file with -o", output,
                        role);
}

KellerStatus keller_whole_number(const char *verb, const char *option, const char *text, uint32_t least, uint32_t most,
                                 uint32_t *value, KellerError *error)
{
    char *end;
    errno = 0;
    unsigned long long number = strtoull(text, &end, 10);
    if (*text < '0' || *text > '9' || *end || errno || number < least || number > most)
        return keller_usage(error, verb, "%s is \"%.60s\"; expected a whole number from %u to %u", option, text, least,
                            most);
    *value = (uint32_t)number;
    return KELLER_OK;
}

static bool name_character(char c, bool first)
{
    return c == '_' || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (!first && c >= '0' && c <= '9');
}

KellerStatus keller_variables_add(KellerVariables *variables, const char *verb, const char *text, KellerError *error)
{
    const char *equals = strchr(text, '=');
    bool good = equals && equals > text;
    for (const char *c = text; good && c < equals; ++c) good = name_character(*c, c == text);
    if (!good) return keller_usage(error, verb, "-D is followed by \"%.100s\"; expected NAME=VALUE", text);
    size_t bytes = (variables->count + 1) * sizeof *variables->list;
    KellerVariable *list = realloc(variables->list, bytes);
    if (!list) return keller_error_memory(error, bytes);
    variables->list = list;
    KellerVariable variable = {strndup(text, (size_t)(equals - text)), strdup(equals + 1)};
    if (!variable.name || !variable.value) {
        free(variable.name);
        free(variable.value);
        return keller_error_memory(error, strlen(text));
    }
    list[variables->count++] = variable;
    return KELLER_OK;
}

void keller_variables_free(KellerVariables *variables)
{
    for (size_t i = 0; i < variables->count; ++i) {
        free(variables->list[i].name);
        free(variables->list[i].value);
    }
    free(variables->list);
    *variables = (KellerVariables){0};
}
