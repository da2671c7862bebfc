#include "keller/soup.h"

#include <stdlib.h>
#include <string.h>

#include "io/soup_build.h"
#include "io/text.h"

/* The file's name without folder and extension. */
static char *stem_of(const char *file)
{
    const char *slash = strrchr(file, '/'), *base = slash ? slash + 1 : file, *dot = strrchr(base, '.');
    return strndup(base, dot && dot > base ? (size_t)(dot - base) : strlen(base));
}

typedef KellerStatus Reader(KellerBuild *, const KellerMeshFile *, KellerError *);

static KellerStatus read_mesh(KellerBuild *build, Reader *reader, const char *file, KellerError *error)
{
    char *data, *name = stem_of(file);
    if (!name) return keller_error_memory(error, strlen(file) + 1);
    KellerMeshFile mesh = {.file = file, .name = *name ? name : "mesh"};
    KellerStatus status = keller_text_load(file, NULL, &data, &mesh.size, error);
    if (status == KELLER_OK) {
        build->soup.files++;
        mesh.data = data;
        status = reader(build, &mesh, error);
        free(data);
    }
    free(name);
    return status;
}

KellerStatus keller_soup_read(const char *file, double scale, KellerSoup *soup, KellerError *error)
{
    static const struct {
        const char *extension;
        Reader *reader;
    } formats[] = {{".obj", keller_read_obj}, {".ply", keller_read_ply}, {".stl", keller_read_stl},
                   {".off", keller_read_off}, {".xml", NULL}};
    *soup = (KellerSoup){0};
    if (!(scale > 0) || !isfinite(scale))
        return keller_error(error, KELLER_BAD_INPUT, "%s: the scale is %g; expected a number above 0", file, scale);
    const char *slash = strrchr(file, '/'), *dot = strrchr(slash ? slash + 1 : file, '.');
    if (!dot) dot = "";
    KellerToken extension = {dot, dot + strlen(dot)};
    for (size_t i = 0; i < sizeof formats / sizeof *formats; i++) {
        if (!keller_token_is_nocase(extension, formats[i].extension)) continue;
        KellerBuild build = {0};
        KellerStatus status = formats[i].reader ? read_mesh(&build, formats[i].reader, file, error)
                                                : keller_read_mitsuba(&build, file, error);
        if (status == KELLER_OK) status = keller_build_finish(&build, file, scale, soup, error);
        if (status != KELLER_OK) keller_build_free(&build);
        return status;
    }
    return keller_error(error, KELLER_BAD_INPUT,
                        "%s: unknown scene format `%s`; expected a name that ends in .obj, .ply, .stl, .off or .xml", file,
                        keller_token_quote(extension).text);
}

void keller_soup_free(KellerSoup *soup)
{
    if (!soup) return;
    for (size_t i = 0; i < soup->material_count; i++) free(soup->materials[i].name);
    for (size_t i = 0; i < soup->object_count; i++) free(soup->objects[i]);
    free(soup->vertices);
    free(soup->triangles);
    free(soup->material);
    free(soup->object);
    free(soup->materials);
    free(soup->objects);
    free(soup->notes);
    *soup = (KellerSoup){0};
}
