/* A soup made by hand, for tests of the scene: pieces are added one by one, each with vertices of its own. */
#ifndef KELLER_TESTS_MODEL_H
#define KELLER_TESTS_MODEL_H
#include <stdbool.h>
#include <stdint.h>
#include "keller/scene.h"
#include "keller/soup.h"

typedef struct {
    KellerSoup soup;
    size_t vertex_capacity, triangle_capacity;
    uint64_t random;
} Model;

/* Two materials, "brick" (0) and "concrete" (1), and two objects, "a" and "b". */
void model_open(Model *model, uint64_t seed);
void model_close(Model *model);

double model_random(Model *model, double low, double high);
void model_triangle(Model *model, KellerVec3 a, KellerVec3 b, KellerVec3 c, uint32_t material);
/* a, b, c, d in order around; cut along a-c, or along b-d where other_diagonal. */
void model_quad(Model *model, KellerVec3 a, KellerVec3 b, KellerVec3 c, KellerVec3 d, bool other_diagonal,
                uint32_t material);
/* An upright prism over a convex polygon, counter-clockwise; lids as asked. */
void model_prism(Model *model, size_t corners, const double (*xy)[2], double z0, double z1, bool bottom, bool top,
                 uint32_t material);
void model_box(Model *model, KellerVec3 lower, KellerVec3 upper, bool bottom, uint32_t material);

/* A random rotation, then a translation, of everything. */
void model_turn(Model *model);
void model_move(Model *model, KellerVec3 by);
/* Cuts triangles at random: in three at an inner point, in two at a point of a side -- with the neighbour, or
 * without it where junctions (a T-junction). */
void model_cut(Model *model, int times, bool junctions);
void model_flip(Model *model, bool all);
void model_shuffle(Model *model);

/* Builds and asserts success. */
KellerScene model_scene(const Model *model);
#endif
