/* A folder of its own for the files of one test program, and a configuration to break. */
#ifndef KELLER_TESTS_CONFIG_FILES_H
#define KELLER_TESTS_CONFIG_FILES_H
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct {
    char folder[200], path[256];
} TestFiles;

static inline int test_files_make(TestFiles *files)
{
    const char *tmp = getenv("TMPDIR");
    snprintf(files->folder, sizeof files->folder, "%s/keller-test-XXXXXX", tmp && strlen(tmp) < 150 ? tmp : "/tmp");
    return mkdtemp(files->folder) ? 0 : -1;
}

/* The path of a file in the folder; valid until the next call. */
static inline const char *test_files_path(TestFiles *files, const char *name)
{
    snprintf(files->path, sizeof files->path, "%.*s/%s", 199, files->folder, name);
    return files->path;
}

static inline void test_files_write(TestFiles *files, const char *name, const void *data, size_t size)
{
    FILE *f = fopen(test_files_path(files, name), "wb");
    if (!f || fwrite(data, 1, size, f) != size || fclose(f) != 0) abort();
}

static inline void test_files_remove(TestFiles *files, const char *const *names)
{
    for (; *names; names++) unlink(test_files_path(files, *names));
    rmdir(files->folder);
}

/* Line 1 is the XML declaration; the broken cases count on these lines. */
static const char
    base_config[] =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"                                                      /* 1 */
        "<simulation version=\"1\" domain=\"rf\">\n"                                                        /* 2 */
        "<scene file=\"street.obj\" scale=\"2\"/>\n"                                                        /* 3 */
        "<origin lat=\"48.137154\" lon=\"11.576124\" height=\"519 m\"/>\n"                                  /* 4 */
        "<frequency>3.5 GHz</frequency>\n"                                                                  /* 5 */
        "<material name=\"wall\" itu=\"concrete\" thickness=\"30 cm\"/>\n"                                  /* 6 */
        "<material name=\"glass\" permittivity=\"6.31\" conductivity=\"0.0036 S/m\" thickness=\"6 mm\"/>\n" /* 7 */
        "<material name=\"steel\" conductor=\"perfect\"/>\n"                                                /* 8 */
        "<default-material name=\"wall\"/>\n"                                                               /* 9 */
        "<assign object=\"building_1\" material=\"glass\"/>\n"                                              /* 10 */
        "<transmitter id=\"tx1\">\n"                                                                        /* 11 */
        "<position x=\"1 m\" y=\"-2 m\" z=\"10 m\"/>\n"                                                     /* 12 */
        "<antenna pattern=\"tr38901\" polarization=\"H\"/>\n"                                               /* 13 */
        "<orientation yaw=\"90 deg\" pitch=\"0.1 rad\" roll=\"0 deg\"/>\n"                                  /* 14 */
        "<velocity x=\"36 km/h\" y=\"0 m/s\" z=\"0 m/s\"/>\n"                                               /* 15 */
        "<power>30 dBm</power>\n"                                                                           /* 16 */
        "</transmitter>\n"                                                                                  /* 17 */
        "<receiver id=\"rx1\"><position x=\"40 m\" y=\"3 m\" z=\"1.5 m\"/></receiver>\n"                    /* 18 */
        "<receivers id=\"walk\" file=\"walk.csv\"/>\n"                                                      /* 19 */
        "<grid id=\"street\" z=\"1.5 m\">\n"                                                                /* 20 */
        "<from x=\"-5 m\" y=\"-1 m\"/>\n"                                                                   /* 21 */
        "<to x=\"5 m\" y=\"1 m\"/>\n"                                                                       /* 22 */
        "<step>1 m</step>\n"                                                                                /* 23 */
        "</grid>\n"                                                                                         /* 24 */
        "<paths reflections=\"3\" diffractions=\"1\" transmissions=\"0\" interactions=\"4\" dynamic-range=\"120 "
        "dB\" wedge=\"holm\"/>\n"                                    /* 25 */
        "<solver accelerator=\"bvh\" cone=\"2 deg\" threads=\"2\"/>\n" /* 26 */
        "<output paths=\"yes\" coverage=\"no\" scene=\"yes\"/>\n"      /* 27 */
        "</simulation>\n";                                             /* 28 */

/* A copy of `text` with its first `find` replaced; aborts if there is none. */
static inline char *replaced(const char *text, const char *find, const char *replace)
{
    const char *at = strstr(text, find);
    if (!at) abort();
    size_t head = (size_t)(at - text), size = strlen(text) - strlen(find) + strlen(replace) + 1;
    char *result = malloc(size);
    if (!result) abort();
    memcpy(result, text, head);
    snprintf(result + head, size - head, "%s%s", replace, at + strlen(find));
    return result;
}
#endif
