/* Cities: where the blocks lie, and what stands on them. */
#include <stdio.h>
#include <stdlib.h>

#include "base/number.h"
#include "io/generate_emit.h"

#define STREET 14.0            /* m, with its pavements */
#define MAIN_STREET 28.0       /* every fourth one */
#define AVENUE 36.0
#define ROUNDABOUT 110.0       /* m, least radius */
#define STOREY 3.25            /* m */
#define GROUND_CELL 100.0      /* m; the ground is a mesh of such squares */
#define GROUND_MARGIN 40.0     /* m around the outermost buildings, at least */

enum { COLUMNS, ROWS, AVENUES, RINGS, FIRST_BLOCK = 16 };   /* streams of chance */

typedef struct {
    KellerEmit *emit;
    KellerChance chance;       /* the current block's */
    uint64_t buildings;
    double density;            /* of the current block: 1 in the centre, 0 at the rim */
} City;

/* ---- what stands on a block ---- */

static void building(City *city, const char *material)
{
    char name[40] = "";
    if (!city->emit->counting) snprintf(name, sizeof name, "building_%llu", (unsigned long long)++city->buildings);
    keller_emit_object(city->emit, name, material);
}

static const char *some_material(City *city)
{
    double share = keller_chance_in(&city->chance, 0, 1);
    return share < 0.5 ? "itu_concrete" : share < 0.85 ? "itu_brick" : "itu_glass";
}

/* 2 storeys and more, most often in the middle of the range, which grows towards the centre; some are much higher. */
static int some_storeys(City *city)
{
    double one = keller_chance_in(&city->chance, 0, 1), other = keller_chance_in(&city->chance, 0, 1);
    int storeys = 2 + (int)((one + other) * (2 + 2.5 * city->density));
    return keller_chance_in(&city->chance, 0, 1) < 0.04 ? 3 * storeys : storeys;
}

static void house(City *city, const KellerPlot *plot)
{
    building(city, some_material(city));
    KellerEmit *emit = city->emit;
    KellerChance *chance = &city->chance;
    int storeys = some_storeys(city);
    double height = storeys * STOREY, width = keller_plot_width(plot), depth = keller_plot_depth(plot);
    double kind = keller_chance_in(chance, 0, 1);
    double rise = keller_chance_whole(chance, 8, 20) * 0.25;   /* 2 to 5 m */
    bool mirrored = keller_chance_whole(chance, 0, 1) == 1;
    if (storeys > 8) keller_emit_box(emit, plot, height);
    else if (kind < 0.2 && width >= 14 && depth >= 12) keller_emit_ell(emit, plot, height, 0.5, 0.5, mirrored);
    else if (kind < 0.35) keller_emit_ridge(emit, plot, height, rise, 0);
    else if (kind < 0.5) keller_emit_ridge(emit, plot, height, rise, lesser(0.3, depth / 2 / width));
    else if (kind < 0.58) keller_emit_shed(emit, plot, height, rise / 2);
    else keller_emit_box(emit, plot, height);
}

/* Houses side by side along the whole width, from v0 to v1 of the depth. */
static void row_of_houses(City *city, const KellerPlot *block, double v0, double v1)
{
    double width = keller_plot_width(block), lot = keller_chance_in(&city->chance, 16, 26), begin = 0;
    int count = (int)(width / lot) > 1 ? (int)(width / lot) : 1;
    for (int i = 0; i < count; i++) {
        double end = i + 1 == count ? 1 : (i + 1 + keller_chance_in(&city->chance, -0.15, 0.15)) / count;
        double passage = i + 1 == count ? 0 : keller_chance_in(&city->chance, 1.5, 4) / width;
        KellerPlot plot = keller_plot_part(block, begin, end - passage, v0, v1);
        house(city, &plot);
        begin = end;
    }
}

static void fill_block(City *city, const KellerPlot *block)
{
    KellerChance *chance = &city->chance;
    double depth = keller_plot_depth(block), kind = keller_chance_in(chance, 0, 1);
    bool wide = keller_plot_width(block) >= 36;   /* all are at least 44 m deep */
    if (wide && kind < 0.15) {
        building(city, some_material(city));
        double wing = keller_chance_in(chance, 11, 14);
        keller_emit_ring(city->emit, block, (2 + some_storeys(city)) * STOREY, wing);
    } else if (wide && kind < 0.2 + 0.1 * city->density) {
        building(city, "itu_glass");
        double base = keller_chance_in(chance, 10, 20), more = keller_chance_in(chance, 0, 20) * city->density;
        double setback = keller_chance_in(chance, 6, 12);
        keller_emit_tower(city->emit, block, 2 * STOREY, (int)(base + more) * STOREY, setback);
    } else {
        double wing = keller_chance_in(chance, 11, 14) / depth;
        row_of_houses(city, block, 0, wing);
        row_of_houses(city, block, 1 - wing, 1);
    }
}

static void next_block(City *city, uint64_t seed, uint64_t number, const KellerPlot *block, double distance,
                       double radius)
{
    city->chance = keller_chance(seed, FIRST_BLOCK + number);
    city->density = greater(0, 1 - distance / radius);
    fill_block(city, block);
}

/* ---- grid ---- */

/* Blocks and the streets between them along one axis: block i runs from begin[2i] to begin[2i + 1]; centred on 0. NULL:
 * memory. */
static double *lines(uint64_t seed, uint64_t stream, uint64_t count, int least, int most)
{
    double *line = malloc((size_t)count * 2 * sizeof *line), at = 0;
    if (!line) return NULL;
    KellerChance chance = keller_chance(seed, stream);
    for (uint64_t i = 0; i < count; i++) {
        line[2 * i] = at;
        line[2 * i + 1] = at += 2 * keller_chance_whole(&chance, least / 2, most / 2);
        at += i % 4 == 3 ? MAIN_STREET : STREET;
    }
    double middle = floor(line[2 * count - 1] / 2);
    for (uint64_t i = 0; i < 2 * count; i++) line[i] -= middle;
    return line;
}

static void grid(City *city, uint64_t seed, uint64_t blocks)
{
    uint64_t columns = (uint64_t)sqrt((double)blocks);
    while (columns * columns < blocks) columns++;
    uint64_t rows = (blocks + columns - 1) / columns;
    double *x = lines(seed, COLUMNS, columns, 60, 110), *y = lines(seed, ROWS, rows, 44, 80);
    if (!x || !y) city->emit->status = keller_error_memory(city->emit->error, 16 * (columns + rows));
    double radius = x && y ? length2(x[2 * columns - 1], y[2 * rows - 1]) : 0;
    for (uint64_t i = 0; i < blocks && city->emit->status == KELLER_OK; i++) {
        const double *a = x + 2 * (i % columns), *b = y + 2 * (i / columns);
        KellerPlot block = {.along = {1, 0}, .front = {a[0], a[1]}, .back = {a[0], a[1]}, .y = {b[0], b[1]}};
        next_block(city, seed, i, &block, length2((a[0] + a[1]) / 2, (b[0] + b[1]) / 2), radius);
    }
    free(x);
    free(y);
}

/* ---- star ---- */

enum { MOST_AVENUES = 12 };

/* Between two neighbouring avenues: its axis, and the lines half_width(y) = y tangent - lost that bound it. */
typedef struct {
    double along[2], tangent, lost;
} Sector;

static double half_width(const Sector *sector, double y) { return y * sector->tangent - sector->lost; }

/* Returns the distance from the centre at which all sectors are wide enough for a first block. */
static double sectors(uint64_t seed, int count, Sector *sector)
{
    const double turn = 6.283185307179586 / count, least = 12;
    KellerChance chance = keller_chance(seed, AVENUES);
    double angle[MOST_AVENUES + 1], first = ROUNDABOUT;
    for (int i = 0; i < count; i++) angle[i] = (i + keller_chance_in(&chance, -0.1, 0.1)) * turn;
    angle[count] = angle[0] + 6.283185307179586;
    for (int i = 0; i < count; i++) {
        Sector *s = &sector[i];
        double cosine, sine;
        keller_emit_direction((angle[i] + angle[i + 1]) / 2, &cosine, &sine);
        s->along[0] = sine, s->along[1] = -cosine;   /* turned left, it points outwards */
        keller_emit_direction((angle[i + 1] - angle[i]) / 2, &cosine, &sine);
        s->tangent = sine / cosine;
        s->lost = AVENUE / 2 / cosine;
        first = greater(first, (least + s->lost) / s->tangent);
    }
    return first;
}

/* Walks the blocks from the centre outwards and fills them, or only finds how far they reach (city NULL). */
static double star(City *city, uint64_t seed, uint64_t blocks, double radius)
{
    Sector sector[MOST_AVENUES];
    int count = blocks < 24 ? 6 : MOST_AVENUES;
    double y = floor(sectors(seed, count, sector)) + 1;
    KellerChance chance = keller_chance(seed, RINGS);
    for (uint64_t number = 0, ring = 0; number < blocks; ring++) {
        double back = y + 2 * keller_chance_whole(&chance, 22, 38);
        for (int i = 0; i < count && number < blocks; i++) {
            const Sector *s = &sector[i];
            double near = half_width(s, y), far = half_width(s, back);
            int pieces = (int)(2 * near / 100) + 1;
            double front_piece = (2 * near - (pieces - 1) * STREET) / pieces;
            double back_piece = (2 * far - (pieces - 1) * STREET) / pieces;
            for (int k = 0; k < pieces && number < blocks; k++, number++) {
                if (!city) continue;
                if (city->emit->status != KELLER_OK) return radius;
                double f = -near + k * (front_piece + STREET), b = -far + k * (back_piece + STREET);
                KellerPlot block = {.along = {s->along[0], s->along[1]}, .front = {f, f + front_piece},
                                    .back = {b, b + back_piece}, .y = {y, back}};
                block = keller_plot_part(&block, 0, 1, 0, 1);   /* rounds */
                next_block(city, seed, number, &block, length2((y + back) / 2, f + front_piece / 2), radius);
            }
        }
        radius = city ? radius : back;
        y = back + (ring % 4 == 3 ? MAIN_STREET : STREET);
    }
    return radius;
}

/* ---- all of it ---- */

static void ground(KellerEmit *emit, const KellerEmit *counted)
{
    double from[2];
    uint32_t cells[2];
    for (int i = 0; i < 2; i++) {
        from[i] = GROUND_CELL * floor((counted->lower[i] - GROUND_MARGIN) / GROUND_CELL);
        cells[i] = (uint32_t)ceil((counted->upper[i] + GROUND_MARGIN - from[i]) / GROUND_CELL);
    }
    keller_emit_object(emit, "ground", "itu_medium_dry_ground");
    uint32_t first = (uint32_t)emit->vertices, row = cells[0] + 1;
    for (uint32_t j = 0; j <= cells[1]; j++)
        for (uint32_t i = 0; i <= cells[0]; i++)
            keller_emit_vertex(emit, v3(from[0] + i * GROUND_CELL, from[1] + j * GROUND_CELL, 0));
    for (uint32_t j = 0; j < cells[1]; j++)
        for (uint32_t i = 0; i < cells[0]; i++) {
            uint32_t a = first + j * row + i;
            keller_emit_quad(emit, a, a + 1, a + row + 1, a + row);
        }
}

void keller_emit_city(KellerEmit *emit, uint64_t seed, bool star_shaped, uint64_t blocks, const KellerEmit *counted)
{
    City city = {.emit = emit};
    if (counted) ground(emit, counted);
    if (star_shaped) star(&city, seed, blocks, star(NULL, seed, blocks, 0));
    else grid(&city, seed, blocks);
    if (emit->counting) {
        KellerEmit walls = *emit;
        ground(emit, &walls);
    }
}
