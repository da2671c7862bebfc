/* io/generate_emit.h -- what the generators share: chance, angles, and a mesh that grows. */
#ifndef KELLER_IO_GENERATE_EMIT_H
#define KELLER_IO_GENERATE_EMIT_H
#include <stdbool.h>
#include <stdint.h>
#include "io/generate.h"
#include "io/soup_build.h"

/* ---- chance: SplitMix64 (Steele, Lea, Flood 2014). Each stream of a seed is a generator of its own. ---- */

typedef struct {
    uint64_t state;
} KellerChance;

static inline uint64_t keller_chance_bits(KellerChance *chance)
{
    uint64_t z = chance->state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

static inline KellerChance keller_chance(uint64_t seed, uint64_t stream)
{
    KellerChance a = {seed}, b = {~stream};
    return (KellerChance){keller_chance_bits(&a) ^ keller_chance_bits(&b)};
}

/* Uniform in [low, high). */
static inline double keller_chance_in(KellerChance *chance, double low, double high)
{
    return low + (high - low) * ((double)(keller_chance_bits(chance) >> 11) * 0x1p-53);
}

/* Uniform among least, ..., most. */
static inline int keller_chance_whole(KellerChance *chance, int least, int most)
{
    return least + (int)(keller_chance_bits(chance) % (uint64_t)(most - least + 1));
}

/* The unit vector at this angle, in radians and within 8 of 0. libm's sine may differ in the last bit from one
 * machine to the next; this one does not. */
void keller_emit_direction(double angle, double *cosine, double *sine);

/* ---- the mesh. An error sticks in `status`, and what follows it does nothing. ---- */

typedef struct {
    KellerBuild build;
    bool counting;                  /* nothing is stored */
    uint64_t vertices, triangles;   /* emitted */
    double lower[2], upper[2];      /* of the vertices' x and y, while counting */
    uint32_t object, material;
    KellerStatus status;
    KellerError *error;
} KellerEmit;

/* From here on triangles belong to this object and this material of the ITU table ("itu_brick"). */
void keller_emit_object(KellerEmit *emit, const char *name, const char *material);
/* Returns the vertex's index. */
uint32_t keller_emit_vertex(KellerEmit *emit, KellerVec3 p);
void keller_emit_triangle(KellerEmit *emit, uint32_t a, uint32_t b, uint32_t c);
/* a, b, c, d around; cut along a-c. */
void keller_emit_quad(KellerEmit *emit, uint32_t a, uint32_t b, uint32_t c, uint32_t d);

/* generate_terrain.c */
void keller_emit_terrain(KellerEmit *emit, const KellerGenerate *def);

/* ---- cities ---- */

/* generate_city.c: the whole city; with `ground`, bounds that were counted before. */
void keller_emit_city(KellerEmit *emit, uint64_t seed, bool star, uint64_t blocks, const KellerEmit *counted);

/* A plot of land with two parallel sides, in a frame of its own: (x, y) is origin + x along + y (along turned left).
 * The front runs from x = front[0] to front[1] at y = y[0], the back from back[0] to back[1] at y = y[1]. */
typedef struct {
    double origin[2], along[2];
    double front[2], back[2], y[2];
} KellerPlot;

/* The part with u0 <= u <= u1 of the width and v0 <= v <= v1 of the depth, all in [0, 1]; coordinates are rounded to
 * 1/64 m. */
KellerPlot keller_plot_part(const KellerPlot *plot, double u0, double u1, double v0, double v1);
static inline double keller_plot_depth(const KellerPlot *plot) { return plot->y[1] - plot->y[0]; }
/* Of the narrower side. */
static inline double keller_plot_width(const KellerPlot *plot)
{
    double front = plot->front[1] - plot->front[0], back = plot->back[1] - plot->back[0];
    return front < back ? front : back;
}

/* generate_building.c: solids on a plot; heights in m. */
void keller_emit_box(KellerEmit *emit, const KellerPlot *plot, double height);
/* The roof rises by `rise` from front to back. */
void keller_emit_shed(KellerEmit *emit, const KellerPlot *plot, double height, double rise);
/* A ridge along the middle; its ends stay `inset` of the width inside (0: gables, else hips). */
void keller_emit_ridge(KellerEmit *emit, const KellerPlot *plot, double height, double rise, double inset);
/* What is left when the part u > cut_u, v > cut_v is gone; mirrored: u < 1 - cut_u. */
void keller_emit_ell(KellerEmit *emit, const KellerPlot *plot, double height, double cut_u, double cut_v,
                     bool mirrored);
/* Around a courtyard that stays the wings' depth away from all sides. */
void keller_emit_ring(KellerEmit *emit, const KellerPlot *plot, double height, double wing);
/* A tower that stands back from all sides of its podium. */
void keller_emit_tower(KellerEmit *emit, const KellerPlot *plot, double podium, double height, double setback);
#endif
