/* Hills, and houses on them. */
#include <math.h>
#include <stdio.h>

#include "io/generate_emit.h"

#define FIRST_RELIEF 0.12      /* of the size: greatest height of the widest hills; half of it of those half as wide, and so on */
#define LONGEST_SLOPE 3.0      /* m, between the highest and the lowest corner of a house */
#define APART 22.0             /* m, between the middles of two houses, at least */
#define FOUNDATION 1.0         /* m, below the lowest corner */

enum { OCTAVES = 4, TRIES = 200, HOUSES, FIRST_NODE };  /* streams of chance from HOUSES on */

typedef struct {
    KellerEmit *emit;
    uint64_t seed;
    double size;
    uint32_t across;            /* quads along a side */
} Terrain;

/* Value noise (Perlin 1985 has its smoother kin): chance at the nodes of a lattice, and a cubic that is level at them. */
static double noise(uint64_t seed, unsigned octave, double u, double v)
{
    double i = floor(u), j = floor(v), value = 0;
    double wu = (u - i) * (u - i) * (3 - 2 * (u - i)), wv = (v - j) * (v - j) * (3 - 2 * (v - j));
    for (unsigned k = 0; k < 4; k++) {
        uint64_t x = (uint64_t)i + (k & 1), y = (uint64_t)j + (k >> 1);
        KellerChance chance = keller_chance(seed, FIRST_NODE + (((uint64_t)octave << 16 | y) << 16 | x));
        value += (k & 1 ? wu : 1 - wu) * (k >> 1 ? wv : 1 - wv) * keller_chance_in(&chance, 0, 1);
    }
    return value;
}

/* At a node of the mesh. */
static double node(const Terrain *t, uint32_t i, uint32_t j)
{
    double z = 0, relief = FIRST_RELIEF * t->size, waves = 2;
    for (unsigned o = 0; o < OCTAVES; o++) {
        z += relief * noise(t->seed, o, waves * i / t->across, waves * j / t->across);
        relief /= 2;
        waves *= 2;
    }
    return z;
}

/* Of the mesh, whose quads are cut along a-c. */
static double ground(const Terrain *t, double x, double y)
{
    double u = (x / t->size + 0.5) * t->across, v = (y / t->size + 0.5) * t->across;
    uint32_t i = u > 0 ? (uint32_t)u : 0, j = v > 0 ? (uint32_t)v : 0;
    i = i < t->across ? i : t->across - 1;
    j = j < t->across ? j : t->across - 1;
    u -= i;
    v -= j;
    double a = node(t, i, j), c = node(t, i + 1, j + 1), b = node(t, i + 1, j), d = node(t, i, j + 1);
    return u >= v ? a + u * (b - a) + v * (c - b) : a + v * (d - a) + u * (c - d);
}

static void hills(const Terrain *t)
{
    const uint32_t n = t->across;
    keller_emit_object(t->emit, "terrain", "itu_medium_dry_ground");
    uint32_t first = (uint32_t)t->emit->vertices;
    for (uint32_t j = 0; j <= n; j++)
        for (uint32_t i = 0; i <= n; i++)
            keller_emit_vertex(t->emit, v3(t->size * ((double)i / n - 0.5), t->size * ((double)j / n - 0.5), node(t, i, j)));
    for (uint32_t j = 0; j < n; j++)
        for (uint32_t i = 0; i < n; i++) {
            uint32_t a = first + j * (n + 1) + i;
            keller_emit_quad(t->emit, a, a + 1, a + n + 2, a + n + 1);
        }
}

/* Walls and a pitched roof over four corners, anticlockwise; the gables are over the sides from 1 to 2 and from 3 to 0. */
static void house(const Terrain *t, uint64_t number, const KellerVec3 corner[4], double base, double eaves, double ridge)
{
    char name[40];
    uint32_t low[4], high[4], top[2];
    snprintf(name, sizeof name, "house_%llu", (unsigned long long)number);
    keller_emit_object(t->emit, name, "itu_brick");
    for (int i = 0; i < 4; i++) low[i] = keller_emit_vertex(t->emit, v3(corner[i].x, corner[i].y, base));
    for (int i = 0; i < 4; i++) high[i] = keller_emit_vertex(t->emit, v3(corner[i].x, corner[i].y, eaves));
    for (int i = 0; i < 2; i++) {
        KellerVec3 a = corner[i ? 1 : 0], b = corner[i ? 2 : 3];
        top[i] = keller_emit_vertex(t->emit, v3(0.5 * (a.x + b.x), 0.5 * (a.y + b.y), ridge));
    }
    for (uint32_t i = 0; i < 4; i++) keller_emit_quad(t->emit, low[i], low[(i + 1) % 4], high[(i + 1) % 4], high[i]);
    keller_emit_triangle(t->emit, high[1], high[2], top[1]);
    keller_emit_triangle(t->emit, high[3], high[0], top[0]);
    keller_emit_quad(t->emit, high[0], high[1], top[1], top[0]);
    keller_emit_quad(t->emit, high[2], high[3], top[0], top[1]);
}

static void village(const Terrain *t, uint64_t count)
{
    KellerChance chance = keller_chance(t->seed, HOUSES);
    double placed[KELLER_GENERATE_HOUSES][2];
    uint64_t houses = 0;
    for (uint64_t tries = 0; houses < count && tries < TRIES * count; tries++) {
        double x = keller_chance_in(&chance, -0.45, 0.45) * t->size, y = keller_chance_in(&chance, -0.45, 0.45) * t->size, cosine, sine;
        double length = keller_chance_in(&chance, 9, 14), width = keller_chance_in(&chance, 7, 9), low = INFINITY, high = -INFINITY;
        double walls = keller_chance_in(&chance, 3, 6), roof = keller_chance_in(&chance, 2, 3.5);
        keller_emit_direction(keller_chance_in(&chance, 0, 3.14159265), &cosine, &sine);
        bool free = true;
        for (uint64_t i = 0; i < houses; i++) {
            double dx = placed[i][0] - x, dy = placed[i][1] - y;
            free = free && dx * dx + dy * dy >= APART * APART;
        }
        KellerVec3 corner[4];
        for (int i = 0; i < 4; i++) {
            double u = (i == 1 || i == 2 ? 0.5 : -0.5) * length, v = (i >= 2 ? 0.5 : -0.5) * width;
            corner[i] = v3(x + cosine * u - sine * v, y + sine * u + cosine * v, 0);
            double z = ground(t, corner[i].x, corner[i].y);
            low = z < low ? z : low;
            high = z > high ? z : high;
        }
        if (!free || high - low > LONGEST_SLOPE) continue;
        placed[houses][0] = x;
        placed[houses][1] = y;
        house(t, ++houses, corner, low - FOUNDATION, high + walls, high + walls + roof);
    }
}

void keller_emit_terrain(KellerEmit *emit, const KellerGenerate *def)
{
    Terrain t = {.emit = emit, .seed = def->seed, .size = def->size, .across = 1};
    while (2.0 * t.across * (t.across + 1.0) < (double)def->triangles) t.across++; /* the nearest number of quads */
    hills(&t);
    village(&t, def->houses);
}
