/* plates.h -- random scenes of a few thin plates, small enough that brute force can enumerate paths of many interactions:
 * single plates, wedges of any opening angle, tetrahedra, all slanted, some touching. */
#ifndef TEST_PLATES_H
#define TEST_PLATES_H
#include "scenes.h"

/* The triangulations of one scene: as built; every quad cut along its other diagonal, shuffled; every triangle cut into
 * several, shuffled. */
typedef enum { PLATES_AS_BUILT, PLATES_OTHER_DIAGONAL, PLATES_REFINED, PLATES_TRIANGULATIONS } PlatesTriangulation;

typedef struct {
    KellerSoup soup;
    KellerVec3 tx, rx;
} PlatesScene;

/* Three to five plates of about 3 to 8 m around the origin and two stations between them, none nearer than 0.1 m to a plate's
 * plane. Each plate is an object of its own, so that a triangle's object tells its plate. The same seed gives the same scene,
 * however it is triangulated. */
PlatesScene plates_random(uint64_t seed, PlatesTriangulation triangulation);
#endif
