#define _GNU_SOURCE /* newlocale, uselocale */
#include "io/scene_write.h"

#include <errno.h>
#include <float.h>
#include <locale.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "io/soup_build.h"
#include "io/text.h"

bool keller_write_format(const char *file, KellerWriteFormat *format)
{
    static const char *const extensions[] = {".obj", ".ply", ".stl"};
    const char *slash = strrchr(file, '/'), *dot = strrchr(slash ? slash + 1 : file, '.');
    for (int i = 0; dot && i < 3; i++) {
        if (!keller_token_is_nocase((KellerToken){dot, dot + strlen(dot)}, extensions[i])) continue;
        *format = (KellerWriteFormat)i;
        return true;
    }
    return false;
}

/* ---- OBJ ---- */

/* Blanks around a name are not read back, so they become `_`; control characters no soup has. */
static void put_name(FILE *out, const char *prefix, const char *name)
{
    size_t length = strlen(name), begin = strspn(name, " "), end = length;
    while (end > begin && name[end - 1] == ' ') end--;
    fputs(prefix, out);
    for (size_t i = 0; i < length; i++) putc(i < begin || i >= end ? '_' : name[i], out);
    putc('\n', out);
}

/* True if an OBJ reader learns the material's kind and constants from its name, which is all that OBJ holds. */
static bool name_says_all(const KellerMaterial *material)
{
    KellerMaterial read;
    if (keller_material_of_name((KellerPlace){0}, material->name, &read, NULL) != KELLER_OK) return false;
    return read.kind == material->kind && strcmp(read.itu, material->itu) == 0;
}

/* A name that begins with itu_ says something by itself; where that is not so, it is no such name any more. */
static bool misleading(const KellerMaterial *material)
{
    return keller_material_is_itu_name(material->name) && !name_says_all(material);
}

static void put_material(FILE *out, const KellerMaterial *material)
{
    put_name(out, misleading(material) ? "usemtl _" : "usemtl ", material->name);
}

static void count_obj_loss(const KellerSoup *soup, KellerWriteLoss *loss)
{
    for (size_t i = 0; i < soup->material_count; i++) {
        loss->renamed += misleading(&soup->materials[i]);
        loss->constants += !name_says_all(&soup->materials[i]) || soup->materials[i].thickness > 0;
    }
}

static void write_obj(const KellerSoup *soup, FILE *out, const char *comment)
{
    if (comment) fprintf(out, "# %s\n", comment);
    for (size_t i = 0; i < soup->vertex_count; i++) {
        KellerVec3 p = soup->vertices[i];
        fprintf(out, "v %.17g %.17g %.17g\n", p.x, p.y, p.z);
    }
    uint32_t object = UINT32_MAX, material = KELLER_NO_MATERIAL;
    for (size_t t = 0; t < soup->triangle_count; t++) {
        const uint32_t *c = soup->triangles[t];
        if (soup->object[t] != object) put_name(out, "o ", soup->objects[object = soup->object[t]]);
        if (soup->material[t] != material) {
            material = soup->material[t];
            if (material == KELLER_NO_MATERIAL) fputs("usemtl\n", out);   /* from here on none */
            else put_material(out, &soup->materials[material]);
        }
        fprintf(out, "f %llu %llu %llu\n", c[0] + 1ull, c[1] + 1ull, c[2] + 1ull);
    }
}

/* ---- PLY, STL ---- */

/* Little-endian, whatever this machine is. */
static char *put_bytes(char *at, uint64_t bits, size_t size)
{
    for (size_t i = 0; i < size; i++) *at++ = (char)(bits >> 8 * i);
    return at;
}

static char *put_double(char *at, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return put_bytes(at, bits, sizeof bits);
}

static char *put_float(char *at, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return put_bytes(at, bits, sizeof bits);
}

static void write_ply(const KellerSoup *soup, FILE *out, const char *comment)
{
    fputs("ply\nformat binary_little_endian 1.0\n", out);
    if (comment) fprintf(out, "comment %s\n", comment);
    fprintf(out, "element vertex %zu\nproperty double x\nproperty double y\nproperty double z\nelement face %zu\n"
            "property list uchar uint vertex_indices\nend_header\n", soup->vertex_count, soup->triangle_count);
    char row[24];
    for (size_t i = 0; i < soup->vertex_count; i++) {
        KellerVec3 p = soup->vertices[i];
        put_double(put_double(put_double(row, p.x), p.y), p.z);
        fwrite(row, 1, 24, out);
    }
    for (size_t t = 0; t < soup->triangle_count; t++) {
        char *at = put_bytes(row, 3, 1);
        for (int i = 0; i < 3; i++) at = put_bytes(at, soup->triangles[t][i], 4);
        fwrite(row, 1, 13, out);
    }
}

static char *put_point(char *at, KellerVec3 p)
{
    return put_float(put_float(put_float(at, (float)p.x), (float)p.y), (float)p.z);
}

/* volatile: gcc 12 takes the two conversions for none where it makes vectors of them */
static double single1(double a)
{
    volatile float f = (float)a;
    return (double)f;
}
static KellerVec3 single(KellerVec3 p) { return v3(single1(p.x), single1(p.y), single1(p.z)); }

static KellerStatus write_stl(const KellerSoup *soup, FILE *out, const char *file, const char *comment,
                              KellerWriteLoss *loss, KellerError *error)
{
    for (size_t i = 0; i < soup->vertex_count; i++) {
        KellerVec3 p = soup->vertices[i];
        const double most = (double)FLT_MAX;
        if (fabs(p.x) > most || fabs(p.y) > most || fabs(p.z) > most)
            return keller_error(error, KELLER_BAD_INPUT,
                                "%s: vertex %zu is at (%g, %g, %g); expected coordinates that STL's single precision "
                                "holds, within %g", file, i, p.x, p.y, p.z, most);
    }
    char header[84] = "STL, binary; ", row[50] = {0};   /* no header may begin with `solid` */
    if (comment) strncat(header, comment, 80 - strlen(header) - 1);
    put_bytes(header + 80, soup->triangle_count, 4);
    fwrite(header, 1, sizeof header, out);
    for (size_t t = 0; t < soup->triangle_count; t++) {
        KellerVec3 corner[3];
        for (int i = 0; i < 3; i++) corner[i] = soup->vertices[soup->triangles[t][i]];
        KellerVec3 normal = v3_unit(v3_cross(v3_sub(corner[1], corner[0]), v3_sub(corner[2], corner[0])));
        if (!isfinite(v3_dot(normal, normal))) normal = v3(0, 0, 0);   /* as for one without area */
        char *at = put_point(row, normal);
        for (int i = 0; i < 3; i++) {
            at = put_point(at, corner[i]);
            loss->moved = greater(loss->moved, v3_distance(corner[i], single(corner[i])));
        }
        fwrite(row, 1, sizeof row, out);
    }
    return KELLER_OK;
}

/* ---- all ---- */

KellerStatus keller_scene_write(const KellerSoup *soup, KellerWriteFormat format, const char *path, const char *file,
                                const char *comment, KellerWriteLoss *loss, KellerError *error)
{
    *loss = (KellerWriteLoss){0};
    FILE *out = fopen(path, "wb");
    if (!out) return keller_error(error, KELLER_IO, "%s: cannot be written: %s", file, strerror(errno));
    locale_t c = newlocale(LC_ALL_MASK, "C", (locale_t)0);   /* numbers with a point */
    if (c == (locale_t)0) {
        fclose(out);
        return keller_error_memory(error, 1024);
    }
    locale_t before = uselocale(c);
    errno = 0;
    setvbuf(out, NULL, _IOFBF, 1 << 20);
    KellerStatus status = KELLER_OK;
    switch (format) {
    case KELLER_WRITE_OBJ:
        count_obj_loss(soup, loss);
        write_obj(soup, out, comment);
        break;
    case KELLER_WRITE_PLY: write_ply(soup, out, comment); break;
    case KELLER_WRITE_STL: status = write_stl(soup, out, file, comment, loss, error); break;
    }
    if (format != KELLER_WRITE_OBJ) loss->objects = soup->object_count, loss->materials = soup->material_count;
    bool failed = fflush(out) != 0 || ferror(out);
    failed |= fclose(out) != 0;
    int reason = failed && errno ? errno : EIO;
    uselocale(before);
    freelocale(c);
    if (status == KELLER_OK && failed)
        status = keller_error(error, KELLER_IO, "%s: cannot be written: %s", file, strerror(reason));
    return status;
}
