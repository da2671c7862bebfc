/* scenes.h -- triangle soups built in memory, and a seeded generator of random small scenes. */
#ifndef TEST_SCENES_H
#define TEST_SCENES_H
#include "keller/soup.h"
#include "keller/vec.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* ---- random numbers: PCG XSH RR 64/32 (O'Neill 2014), the same on every machine --------------------------------- */

typedef struct {
    uint64_t state;
} Random;

Random random_seeded(uint64_t seed);
uint32_t random_bits(Random *random);
double random_range(Random *random, double lower, double upper);
uint32_t random_below(Random *random, uint32_t bound); /* in [0, bound), bound > 0 */

/* ---- soups ------------------------------------------------------------------------------------------------------ */

/* The materials that every soup here has, by index. */
enum { CONCRETE, CONDUCTOR, DRY_GROUND, PARTITION, GLASS, MATERIAL_COUNT };

/* An empty soup with those materials: concrete and medium dry ground by their ITU names, half-spaces; partitions of 13 mm
 * plasterboard and panes of 6 mm glass, slabs that a wave passes through. */
KellerSoup soup_new(void);
void soup_release(KellerSoup *soup);
KellerSoup soup_copy(const KellerSoup *soup);
/* Starts an object "<prefix>_<number>" and returns its index. */
uint32_t soup_object(KellerSoup *soup, const char *prefix);
uint32_t soup_vertex(KellerSoup *soup, KellerVec3 position);
/* The triangle belongs to the object that was started last. */
void soup_triangle(KellerSoup *soup, uint32_t a, uint32_t b, uint32_t c, uint32_t material);
/* A convex polygon as a fan, with vertices of its own. */
void soup_polygon(KellerSoup *soup, size_t count, const KellerVec3 *corners, uint32_t material);
void soup_quad(KellerSoup *soup, KellerVec3 a, KellerVec3 b, KellerVec3 c, KellerVec3 d, uint32_t material);
/* A closed solid: the convex polygon `base` swept along `sweep`; shared vertices. Bits of `leave_out`: side i (from
 * corner i to i + 1) is bit i, the base is bit count, the top bit count + 1. */
void soup_prism(KellerSoup *soup, size_t count, const KellerVec3 *base, KellerVec3 sweep, uint32_t material,
                uint32_t leave_out);
/* An axis-aligned box; sides in the order -y, +x, +y, -x, then bottom, top (bits 0 to 5 of `leave_out`). */
void soup_box(KellerSoup *soup, KellerVec3 lower, KellerVec3 upper, uint32_t material, uint32_t leave_out);

/* ---- changes that must not change any result -------------------------------------------------------------------- */

/* Shuffles triangles and vertices, rotates and flips corners. */
void soup_shuffle(KellerSoup *soup, Random *random);
/* Cuts every triangle into random ones around a point inside; edges are cut at random points, at the same ones for all
 * triangles that share the edge, so that the mesh stays conforming. */
void soup_refine(KellerSoup *soup, Random *random);
void soup_material(KellerSoup *soup, uint32_t material); /* all triangles of that material */

/* ---- random scenes ---------------------------------------------------------------------------------------------- */

/* Vertical prisms and walls only, all coordinates multiples of 2^-20 m, so that a shift by 10 km and a quarter turn
 * about z are exact in double precision. */
#define SCENE_UPRIGHT 1u

/* Thin walls: most faces are slabs, some sheets lie on others or are there twice, and stations may be inside of solids. */
#define SCENE_THIN 2u

/* One or two objects only. */
#define SCENE_SMALL 4u

#define SCENE_RECEIVERS 2
typedef struct {
    KellerSoup soup;
    KellerVec3 tx;
    KellerVec3 rx[SCENE_RECEIVERS]; /* along x: rx[1] = rx[0] + (step, 0, 0) */
    double step;
} RandomScene;

/* Two to six boxes, screens, prisms, most on a ground, some touching, overlapping or interpenetrating, and stations
 * outside of the solids. The same seed gives the same scene. */
RandomScene scene_random(uint64_t seed, uint32_t flags);
#endif
