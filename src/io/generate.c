#include "io/generate.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

#include "io/generate_emit.h"

void keller_emit_direction(double angle, double *cosine, double *sine)
{
    /* Taylor's series at a 32nd of the angle, below 0.25, where 7 terms leave less than 1e-18; then the angle is
     * doubled five times. */
    double x = angle / 32, square = x * x, s = 0, c = 0;
    for (int n = 14; n >= 2; n -= 2) {
        s = (1 - s) * square / (n * (n + 1));
        c = (1 - c) * square / (n * (n - 1));
    }
    s = x * (1 - s);
    c = 1 - c;
    for (int i = 0; i < 5; i++) {
        double doubled = 2 * s * c;
        c = (c - s) * (c + s);
        s = doubled;
    }
    double length = sqrt(s * s + c * c);
    *sine = s / length;
    *cosine = c / length;
}

void keller_emit_object(KellerEmit *emit, const char *name, const char *material)
{
    if (emit->counting || emit->status != KELLER_OK) return;
    KellerMaterial made;
    emit->status = keller_material_of_name((KellerPlace){.file = "generated scene"}, material, &made, emit->error);
    if (emit->status == KELLER_OK)
        emit->status = keller_build_material(&emit->build, &made, &emit->material, emit->error);
    if (emit->status == KELLER_OK)
        emit->status = keller_build_object(&emit->build, name, strlen(name), false, &emit->object, emit->error);
}

uint32_t keller_emit_vertex(KellerEmit *emit, KellerVec3 p)
{
    uint32_t index = (uint32_t)emit->vertices++;
    if (emit->counting) {
        double xy[2] = {p.x, p.y};
        for (int i = 0; i < 2; i++) {
            if (index == 0 || xy[i] < emit->lower[i]) emit->lower[i] = xy[i];
            if (index == 0 || xy[i] > emit->upper[i]) emit->upper[i] = xy[i];
        }
    } else if (emit->status == KELLER_OK) {
        emit->status = keller_build_vertex(&emit->build, p, emit->error);
    }
    return index;
}

void keller_emit_triangle(KellerEmit *emit, uint32_t a, uint32_t b, uint32_t c)
{
    emit->triangles++;
    if (emit->counting || emit->status != KELLER_OK) return;
    uint32_t corners[3] = {a, b, c};
    emit->status = keller_build_polygon(&emit->build, (KellerPlace){0}, corners, 3, emit->object, emit->material,
                                        emit->error);
}

void keller_emit_quad(KellerEmit *emit, uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    keller_emit_triangle(emit, a, b, c);
    keller_emit_triangle(emit, a, c, d);
}

/* ---- hard on accelerators ---- */

static KellerVec3 point_in(KellerChance *chance, KellerVec3 middle, double side)
{
    double x = keller_chance_in(chance, -side / 2, side / 2), y = keller_chance_in(chance, -side / 2, side / 2);
    return v3_add(middle, v3(x, y, keller_chance_in(chance, -side / 2, side / 2)));
}

static void random_triangles(KellerEmit *emit, const KellerGenerate *def)
{
    KellerChance chance = keller_chance(def->seed, 0);
    double across = 1;
    while (across * across * across < (double)def->triangles) across++;
    double side = def->size / across;
    keller_emit_object(emit, "random", "itu_concrete");
    for (uint64_t i = 0; i < def->triangles; i++) {
        KellerVec3 middle = point_in(&chance, v3(0, 0, 0), def->size - side);
        uint32_t corner[3];
        for (int k = 0; k < 3; k++) corner[k] = keller_emit_vertex(emit, point_in(&chance, middle, side));
        keller_emit_triangle(emit, corner[0], corner[1], corner[2]);
    }
}

static void slivers(KellerEmit *emit, const KellerGenerate *def)
{
    enum { BELTS = 8 };
    const double pi = 3.141592653589793;
    KellerChance chance = keller_chance(def->seed, 0);
    uint32_t around = def->triangles < 49 ? 3 : (uint32_t)((def->triangles + 7) / 14);
    double radius = def->size / 2, cosine, sine;
    keller_emit_object(emit, "sphere", "itu_concrete");
    uint32_t south = keller_emit_vertex(emit, v3(0, 0, -radius)), north = keller_emit_vertex(emit, v3(0, 0, radius));
    for (uint32_t belt = 1; belt < BELTS; belt++) {
        double high, wide, phase = keller_chance_in(&chance, 0, 1);
        keller_emit_direction(pi * belt / BELTS, &high, &wide);
        for (uint32_t i = 0; i < around; i++) {
            keller_emit_direction(2 * pi * (i + phase) / around, &cosine, &sine);
            keller_emit_vertex(emit, v3(radius * wide * cosine, radius * wide * sine, -radius * high));
        }
    }
    for (uint32_t i = 0; i < around; i++) {
        uint32_t j = (i + 1) % around, last = north + 1 + (BELTS - 2) * around;
        keller_emit_triangle(emit, south, north + 1 + j, north + 1 + i);
        keller_emit_triangle(emit, north, last + i, last + j);
        for (uint32_t low = north + 1; low < last; low += around)
            keller_emit_quad(emit, low + i, low + j, low + around + j, low + around + i);
    }
}

static void hair(KellerEmit *emit, const KellerGenerate *def)
{
    enum { SEGMENTS = 16 };
    KellerChance chance = keller_chance(def->seed, 0);
    const double size = def->size;
    keller_emit_object(emit, "hair", "itu_wood");
    for (uint64_t i = 0; i < def->strands; i++) {
        double x = keller_chance_in(&chance, -size / 2, size / 2), y = keller_chance_in(&chance, -size / 2, size / 2);
        KellerVec3 at = v3(x, y, 0), heading = v3_unit(v3_add(v3(0, 0, 1.5), point_in(&chance, v3(0, 0, 0), 1)));
        KellerVec3 across = point_in(&chance, v3(1, 0, 0), 1), curl = point_in(&chance, v3(0, 0, -0.05), 0.3);
        double step = size * keller_chance_in(&chance, 0.25, 0.75) / SEGMENTS;
        uint32_t left = 0, right = 0;
        for (int k = 0; k <= SEGMENTS; k++) {
            KellerVec3 side = v3_scale(v3_unit(v3_cross(heading, across)), size * 0.0005 * (SEGMENTS - k) / SEGMENTS);
            uint32_t l = keller_emit_vertex(emit, v3_sub(at, side)), r = l;   /* the tip is one point */
            if (k < SEGMENTS) r = keller_emit_vertex(emit, v3_add(at, side));
            if (k > 0) keller_emit_triangle(emit, left, right, r);
            if (k > 0 && k < SEGMENTS) keller_emit_triangle(emit, left, r, l);
            left = l, right = r;
            at = v3_madd(at, heading, step);
            heading = v3_unit(v3_add(v3_add(heading, curl), point_in(&chance, v3(0, 0, 0), 0.2)));
        }
    }
}

static void layers(KellerEmit *emit, const KellerGenerate *def)
{
    /* Bars and windows take turns, LINES - 1 strips across. The middle strip is a bar as wide as a window, and a sheet
     * is shifted by a quarter of it at most: so the axis never meets a window. The tilt lifts a sheet's corner by less
     * than half of the distance to the next. */
    enum { LINES = 10 };
    KellerChance chance = keller_chance(def->seed, 0);
    const double apart = def->size / 20, strip = def->size / (LINES - 1);
    for (uint64_t n = 0; n < def->sheets; n++) {
        char name[40];
        snprintf(name, sizeof name, "sheet_%llu", (unsigned long long)n + 1);
        keller_emit_object(emit, name, n % 2 ? "itu_glass" : "itu_concrete");
        double tilt[2], shift[2];
        for (int i = 0; i < 2; i++) {
            tilt[i] = keller_chance_in(&chance, -0.02, 0.02);
            shift[i] = keller_chance_in(&chance, -strip / 4, strip / 4);
        }
        uint32_t first = (uint32_t)emit->vertices;
        for (int j = 0; j < LINES; j++)
            for (int i = 0; i < LINES; i++) {
                double x = (i - (LINES - 1) / 2.0) * strip, y = (j - (LINES - 1) / 2.0) * strip;
                keller_emit_vertex(emit, v3(x + shift[0], y + shift[1],
                                            ((double)n + 1) * apart + tilt[0] * x + tilt[1] * y));
            }
        for (uint32_t j = 0; j + 1 < LINES; j++)
            for (uint32_t i = 0; i + 1 < LINES; i++) {
                uint32_t a = first + j * LINES + i;
                if (i % 2 == 0 || j % 2 == 0) keller_emit_quad(emit, a, a + 1, a + LINES + 1, a + LINES);
            }
    }
}

/* ---- all of them ---- */

KellerGenerate keller_generate_defaults(KellerGenerateKind kind)
{
    return (KellerGenerate){.kind = kind, .seed = 1, .blocks = 100, .triangles = 10000, .strands = 1000, .sheets = 64,
                            .size = kind == KELLER_GENERATE_TERRAIN ? 500 : 10};
}

static void emit_all(KellerEmit *emit, const KellerGenerate *def, const KellerEmit *counted)
{
    switch (def->kind) {
    case KELLER_GENERATE_CITY: keller_emit_city(emit, def->seed, def->star, def->blocks, counted); break;
    case KELLER_GENERATE_RANDOM: random_triangles(emit, def); break;
    case KELLER_GENERATE_SLIVERS: slivers(emit, def); break;
    case KELLER_GENERATE_HAIR: hair(emit, def); break;
    case KELLER_GENERATE_LAYERS: layers(emit, def); break;
    case KELLER_GENERATE_TERRAIN: keller_emit_terrain(emit, def); break;
    }
}

static uint64_t city_triangles(uint64_t seed, bool star, uint64_t blocks)
{
    KellerEmit emit = {.counting = true};
    keller_emit_city(&emit, seed, star, blocks, NULL);
    return emit.triangles;
}

uint64_t keller_generate_blocks(uint64_t seed, bool star, uint64_t triangles)
{
    /* The count per block hardly depends on the number of blocks: a few corrections find it, but for jumps where the
     * streets are laid out anew. So the neighbours are tried as well, where they cost little. */
    uint64_t blocks = triangles / 85 + 1, best = blocks, least = UINT64_MAX;
    for (int i = 0; i < 4; i++) {
        uint64_t radius = blocks < 1000 ? 8 : 0, low = blocks > radius ? blocks - radius : 1;
        uint64_t next = blocks;
        for (uint64_t b = low; b <= blocks + radius; b++) {
            uint64_t count = city_triangles(seed, star, b);
            uint64_t off = count > triangles ? count - triangles : triangles - count;
            if (off < least) least = off, best = b;
            if (b == blocks && count > 0) next = (uint64_t)((double)b * (double)triangles / (double)count + 0.5);
        }
        if (next == blocks) break;
        blocks = next > 0 ? next : 1;
    }
    return best;
}

KellerStatus keller_generate(const KellerGenerate *def, KellerSoup *soup, KellerError *error)
{
    assert(def->blocks > 0 && def->triangles > 0 && def->strands > 0 && def->sheets > 0);
    assert(def->houses <= KELLER_GENERATE_HOUSES);
    assert(def->size >= 1e-3 && def->size <= 1e6);
    *soup = (KellerSoup){0};
    KellerEmit counted = {.counting = true, .error = error};
    emit_all(&counted, def, NULL);
    if (counted.status != KELLER_OK) return counted.status;
    if (counted.vertices >= UINT32_MAX - 1 || counted.triangles >= UINT32_MAX - 1)
        return keller_error(error, KELLER_FAILED, "the scene would have %llu triangles; expected fewer than %u",
                            (unsigned long long)counted.triangles, UINT32_MAX - 1);
    KellerEmit emit = {.error = error};
    KellerBuild *build = &emit.build;
    /* all at once: an array that is doubled as it grows takes three times the memory */
    KellerStatus status = keller_grow(&build->soup.vertices, &build->vertex_capacity, counted.vertices,
                                      sizeof *build->soup.vertices, error);
    if (status == KELLER_OK)
        status = keller_grow(&build->soup.triangles, &build->triangle_capacity, counted.triangles,
                             sizeof *build->soup.triangles, error);
    if (status == KELLER_OK)
        status = keller_grow(&build->soup.object, &build->index_capacity[0], counted.triangles,
                             sizeof *build->soup.object, error);
    if (status == KELLER_OK)
        status = keller_grow(&build->soup.material, &build->index_capacity[1], counted.triangles,
                             sizeof *build->soup.material, error);
    emit.status = status;
    if (status == KELLER_OK) emit_all(&emit, def, &counted);
    status = emit.status;
    if (status == KELLER_OK) status = keller_build_finish(build, "generated scene", 1, soup, error);
    if (status != KELLER_OK) keller_build_free(build);
    return status;
}
