/* What the tests of scene files share: a temporary folder, files in it, and reading them. */
#ifndef SOUP_FILES_H
#define SOUP_FILES_H
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "keller/soup.h"

static char folder[512];

static inline int make_folder(void **state)
{
    (void)state;
    const char *base = getenv("TMPDIR");
    snprintf(folder, sizeof folder, "%.400s/keller-soup-XXXXXX", base && *base ? base : "/tmp");
    return mkdtemp(folder) ? 0 : -1;
}

/* The tests delete what they write, so that the folder is empty in the end. */
static inline int remove_folder(void **state)
{
    (void)state;
    return rmdir(folder);
}

static inline const char *path_of(const char *name)
{
    static char path[1024];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static inline void write_bytes(const char *name, const void *bytes, size_t size)
{
    FILE *file = fopen(path_of(name), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static inline void write_text(const char *name, const char *text) { write_bytes(name, text, strlen(text)); }
static inline void delete_file(const char *name) { assert_int_equal(unlink(path_of(name)), 0); }

/* Reads the file, which must be good. */
static inline KellerSoup read_file_soup(const char *name)
{
    KellerSoup soup;
    KellerError error = {0};
    if (keller_soup_read(path_of(name), 1, &soup, &error) != KELLER_OK) fail_msg("%s", error.message);
    return soup;
}

static inline KellerSoup read_bytes(const char *name, const void *bytes, size_t size)
{
    write_bytes(name, bytes, size);
    KellerSoup soup = read_file_soup(name);
    delete_file(name);
    return soup;
}

static inline KellerSoup read_text_soup(const char *name, const char *text) { return read_bytes(name, text, strlen(text)); }

/* Reads the file, which must fail with the status and a message that begins with the file's path followed by `place`
 * (":3: ", ": byte 12: ") and holds `words`. */
static inline void expect_failure_bytes(const char *name, const void *bytes, size_t size, KellerStatus status, const char *place,
                                        const char *words)
{
    KellerSoup soup;
    KellerError error = {0};
    char start[1200];
    write_bytes(name, bytes, size);
    KellerStatus got = keller_soup_read(path_of(name), 1, &soup, &error);
    snprintf(start, sizeof start, "%s%s", path_of(name), place);
    delete_file(name);
    if (got != status) fail_msg("status %d instead of %d: %s", got, status, error.message);
    assert_int_equal(error.status, status);
    if (strncmp(error.message, start, strlen(start)) != 0 || !strstr(error.message, words))
        fail_msg("`%s` does not begin with `%s` or lacks `%s`", error.message, start, words);
    assert_null(soup.vertices);
    assert_int_equal(soup.triangle_count, 0);
    keller_soup_free(&soup);
}

static inline void expect_failure(const char *name, const char *text, const char *place, const char *words)
{
    expect_failure_bytes(name, text, strlen(text), KELLER_BAD_INPUT, place, words);
}

static inline void assert_point(KellerVec3 p, double x, double y, double z)
{
    if (p.x != x || p.y != y || p.z != z)
        fail_msg("(%.17g, %.17g, %.17g) instead of (%.17g, %.17g, %.17g)", p.x, p.y, p.z, x, y, z);
}

static inline void assert_corners(const KellerSoup *soup, size_t triangle, uint32_t a, uint32_t b, uint32_t c)
{
    const uint32_t *t = soup->triangles[triangle];
    if (t[0] != a || t[1] != b || t[2] != c)
        fail_msg("triangle %zu is %u %u %u instead of %u %u %u", triangle, t[0], t[1], t[2], a, b, c);
}

/* Twice the sum of the triangles' areas. */
static inline double area_of(const KellerSoup *soup)
{
    double sum = 0;
    for (size_t i = 0; i < soup->triangle_count; i++) {
        KellerVec3 a = soup->vertices[soup->triangles[i][0]], b = soup->vertices[soup->triangles[i][1]];
        sum += v3_norm(v3_cross(v3_sub(b, a), v3_sub(soup->vertices[soup->triangles[i][2]], a)));
    }
    return sum;
}

/* The path of a real scene, or NULL (and a message) where the scenes are not here. */
static inline const char *real_scene(const char *name)
{
    static char path[2048];
    const char *scenes = getenv("KELLER_SCENES"), *source = getenv("KELLER_SOURCE");
    if (scenes && *scenes) snprintf(path, sizeof path, "%s/%s", scenes, name);
    else snprintf(path, sizeof path, "%s/../shared/scenes/%s", source ? source : ".", name);
    if (access(path, R_OK) == 0) return path;
    print_message("skipped: %s is not here\n", path);
    return NULL;
}
#endif
