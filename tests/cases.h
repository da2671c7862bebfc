/* cases.h -- how many random cases a test draws: all of them where KELLER_LONG is set (`make test LONG=1`), a part of them
 * otherwise, and fewer with sanitizers, which look at what the code does with its memory and not at its numbers. What a test
 * expects of the whole of its cases, such as how many rays hit, is to be said as a share of their number. */
#ifndef KELLER_TESTS_CASES_H
#define KELLER_TESTS_CASES_H
#include <stdint.h>
#include <stdlib.h>

#if defined(__SANITIZE_ADDRESS__) /* gcc's way to say so, then clang's */
#define CASES_PART 50
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define CASES_PART 50
#endif
#endif
#ifndef CASES_PART
#define CASES_PART 5
#endif

/* Of `all` scenes: as many, or a part, but not fewer than `least`, which is at most `all`. */
static inline uint64_t cases_scenes(uint64_t all, uint64_t least)
{
    const char *text = getenv("KELLER_LONG");
    if (text && atoi(text) > 0) return all;
    return all / CASES_PART > least ? all / CASES_PART : least;
}

/* Of `all` rays, cones and the like; KELLER_CASES (as 1e8) is another number instead. */
static inline uint64_t cases_of(uint64_t all)
{
    const char *text = getenv("KELLER_CASES");
    double n = text ? strtod(text, NULL) : 0;
    return n >= 1 ? (uint64_t)n : cases_scenes(all, 1);
}
#endif
