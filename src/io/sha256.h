/* io/sha256.h -- the SHA-256 digest (FIPS 180-4), to tell configurations apart; not for secrets. */
#ifndef KELLER_IO_SHA256_H
#define KELLER_IO_SHA256_H
#include <stddef.h>

/* Digest of `size` bytes as 64 lower-case hexadecimal digits and a NUL. */
void keller_sha256(const void *data, size_t size, char hex[65]);
#endif
