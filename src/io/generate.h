/* io/generate.h -- scenes made by rule and chance: cities, and scenes that are hard on accelerators.
 *
 * The same definition gives the same scene, bit for bit, on every machine and with every compiler: all chance comes
 * from one generator of our own, and coordinates are computed by +, -, *, / and sqrt alone, which IEEE 754 rounds
 * correctly. Lengths in metres, z up. */
#ifndef KELLER_IO_GENERATE_H
#define KELLER_IO_GENERATE_H
#include <stdbool.h>
#include <stdint.h>
#include "keller/soup.h"

typedef enum {
    /* Street blocks on a ground plane z = 0. Every building is an object, building_1, building_2, ...: a closed solid
     * whose floor lies on the ground, of triangles that face outwards and share their vertices, of itu_concrete,
     * itu_brick or itu_glass; buildings neither touch nor overlap. Boxes, L-shapes, pitched roofs (gable, hip, shed),
     * rings around a courtyard, towers on a podium; 2 to 40 storeys, more towards the centre. The ground is one more
     * object, of itu_medium_dry_ground, a mesh of squares of 100 m. About 85 triangles a block, the ground's included.
     * Grid: straight streets of 14 m, every fourth one 28 m. Coordinates are multiples of 1/128 m, so that single
     * precision holds them exactly. Star: 12 avenues of 36 m (6 where there are fewer than 24 blocks) meet in a
     * roundabout of at least 110 m radius, and streets of 14 and 28 m run around it. */
    KELLER_GENERATE_CITY,
    /* Independent triangles in a cube of side `size` around the origin: each one's corners are uniform in a small
     * cube, which is uniform in the large one and whose side is size / ceil(cbrt(triangles)), the mean distance of
     * neighbours. */
    KELLER_GENERATE_RANDOM,
    /* A closed sphere of diameter `size`, of 8 belts of thin, slightly slanted triangles from pole to pole; the number
     * of triangles is `triangles` rounded to a multiple of 14, at least 42. */
    KELLER_GENERATE_SLIVERS,
    /* `strands` hairs that grow, and curl, from a square of side `size` in z = 0: strips of 31 triangles, each a
     * thousandth of `size` wide at the root and half of `size` long, more or less. */
    KELLER_GENERATE_HAIR,
    /* `sheets` thin walls of side `size`, size / 20 apart, nearly perpendicular to z, each with 16 windows, and each
     * an object of 130 triangles. None meets another. The z axis meets them all, and so do parallels to it no farther
     * than size / 36 away in x or y. */
    KELLER_GENERATE_LAYERS,
    /* Hills over a square of side `size` around the origin, of itu_medium_dry_ground, the object "terrain": as many quads, cut in two, as
     * make about `triangles`; heights are from 0 to 0.225 of the size. On it stand up to `houses` houses of itu_brick, house_1, house_2,
     * ..., 22 m apart where the slope allows for them: walls, 3 to 6 m high, and a pitched roof; walls go 1 m into the ground. */
    KELLER_GENERATE_TERRAIN
} KellerGenerateKind;

#define KELLER_GENERATE_HOUSES 1000u    /* on one terrain, at most */

typedef struct {
    KellerGenerateKind kind;
    uint64_t seed;
    bool star;              /* CITY: avenues that meet in a star, instead of a grid */
    uint64_t blocks;        /* CITY: >= 1 */
    uint64_t triangles;     /* RANDOM, SLIVERS, TERRAIN: >= 1 */
    uint64_t strands;       /* HAIR: >= 1 */
    uint64_t sheets;        /* LAYERS: >= 1 */
    uint64_t houses;        /* TERRAIN: <= KELLER_GENERATE_HOUSES */
    double size;            /* all but CITY: m, in [1e-3, 1e6] */
} KellerGenerate;

/* Seed 1; a grid of 100 blocks, 10000 triangles, 1000 strands, 64 sheets, no houses, a size of 10 m, of a terrain 500 m. */
KellerGenerate keller_generate_defaults(KellerGenerateKind kind);

/* The number of blocks (at least 1) with which a city has about that many triangles: to 1 % or two blocks, whichever is
 * more. */
uint64_t keller_generate_blocks(uint64_t seed, bool star, uint64_t triangles);

/* Makes the scene. On success *soup is owned by the caller (keller_soup_free); on failure it is empty.
 * Errors: KELLER_FAILED (memory: about 50 bytes a triangle are needed; more than 2^32 - 2 vertices or triangles). */
KellerStatus keller_generate(const KellerGenerate *def, KellerSoup *soup, KellerError *error);
#endif
