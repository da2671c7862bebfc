/* Bytes as a scene file: the first one chooses the format, the rest is the file. Looks for crashes, hangs and results that
 * break the contract of keller/soup.h. */
#define _GNU_SOURCE /* memfd_create */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "io/soup_build.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void require(int condition, const char *what)
{
    if (condition) return;
    fprintf(stderr, "contract broken: %s\n", what);
    abort();
}

static void check(const KellerSoup *soup)
{
    for (size_t i = 0; i < soup->vertex_count; i++)
        require(isfinite(soup->vertices[i].x) && isfinite(soup->vertices[i].y) && isfinite(soup->vertices[i].z), "finite");
    for (size_t i = 0; i < soup->triangle_count; i++) {
        for (int k = 0; k < 3; k++) require(soup->triangles[i][k] < soup->vertex_count, "vertex index");
        require(soup->object[i] < soup->object_count, "object index");
        require(soup->material[i] == KELLER_NO_MATERIAL || soup->material[i] < soup->material_count, "material index");
    }
    for (size_t i = 0; i < soup->object_count; i++) require(soup->objects[i][0] != '\0', "object name");
    require(soup->notes != NULL, "notes");
}

static KellerStatus read_xml(KellerBuild *build, const char *data, size_t size, KellerError *error)
{
    char path[64];
    int file = memfd_create("scene", 0);
    require(file >= 0 && write(file, data, size) == (ssize_t)size, "memory file");
    snprintf(path, sizeof path, "/proc/self/fd/%d", file);
    KellerStatus status = keller_read_mitsuba(build, path, error);
    close(file);
    return status;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size == 0) return 0;
    /* An exact copy, so that a read behind it is seen; the NUL is what keller_text_load appends. */
    char *copy = malloc(size);
    require(copy != NULL, "memory");
    memcpy(copy, data + 1, size - 1);
    copy[size - 1] = '\0';
    KellerMeshFile mesh = {.file = "fuzz", .data = copy, .size = size - 1, .name = "fuzz"};
    KellerBuild build = {0};
    KellerSoup soup = {0};
    KellerError error = {0};
    KellerStatus status;
    switch (data[0] % 5) {
    case 0: status = keller_read_obj(&build, &mesh, &error); break;
    case 1: status = keller_read_ply(&build, &mesh, &error); break;
    case 2: status = keller_read_stl(&build, &mesh, &error); break;
    case 3: status = keller_read_off(&build, &mesh, &error); break;
    default: status = read_xml(&build, copy, size - 1, &error); break;
    }
    if (status == KELLER_OK) status = keller_build_finish(&build, "fuzz", 1, &soup, &error);
    if (status == KELLER_OK) {
        check(&soup);
    } else {
        require(error.status == status && error.message[0] != '\0', "a message");
        keller_build_free(&build);
    }
    keller_soup_free(&soup);
    free(copy);
    return 0;
}
