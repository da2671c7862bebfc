#include "keller/error.h"

#include <stdarg.h>
#include <stdio.h>

KellerStatus keller_error(KellerError *error, KellerStatus status, const char *format, ...)
{
    if (!error) return status;
    error->status = status;
    va_list args;
    va_start(args, format);
    vsnprintf(error->message, sizeof error->message, format, args);
    va_end(args);
    return status;
}

KellerStatus keller_error_memory(KellerError *error, unsigned long long bytes)
{
    return keller_error(error, KELLER_FAILED, "out of memory: %llu bytes were needed", bytes);
}
