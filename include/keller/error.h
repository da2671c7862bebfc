/* keller/error.h -- how functions report failure.
 *
 * Two kinds of error. A programmer's error is an assertion. A user's error is a status other than KELLER_OK and a
 * message for a person: `FILE:LINE: what is wrong; what was expected`, without the program's name and without a final
 * newline. The message travels up; only the command line prints it. */
#ifndef KELLER_ERROR_H
#define KELLER_ERROR_H

#ifdef __cplusplus
extern "C" {
#endif

/* The values are the program's exit statuses. */
typedef enum {
    KELLER_OK = 0,
    KELLER_FAILED = 1,    /* the run failed (out of memory, interrupted) */
    KELLER_USAGE = 2,     /* wrong usage of the command line */
    KELLER_BAD_INPUT = 3, /* bad configuration, scene or result file */
    KELLER_IO = 4         /* input or output failed: disk full, no permission */
} KellerStatus;

typedef struct {
    KellerStatus status;
    char message[1024];
} KellerError;

/* Fills *error (may be NULL) with a status and a printf-style message and returns the status, so that a caller can
 * write `return keller_error(err, KELLER_BAD_INPUT, "%s:%d: ...", ...)`. The message is cut at 1023 bytes. */
KellerStatus keller_error(KellerError *error, KellerStatus status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* The same for a failed allocation of `bytes` bytes: KELLER_FAILED. */
KellerStatus keller_error_memory(KellerError *error, unsigned long long bytes);

#ifdef __cplusplus
}
#endif
#endif
