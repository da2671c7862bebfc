/* How a binary tree becomes one of four or eight children a node. */
#ifndef KELLER_ACCEL_WIDE_H
#define KELLER_ACCEL_WIDE_H
#include "accel/sah.h"

/* The cheapest way to collapse a binary subtree (Ylitie, Karras and Laine 2017, section 3.1), for all numbers of roots at once:
 * a node costs its area, whatever its number of children. */
typedef struct {
    float cost[8];                  /* [i - 1]: of the subtree as at most i trees, 1 <= i < width */
    uint8_t left[9];                /* [i]: as i trees, 2 to width, so many come from the left; 0: i - 1 trees are no dearer */
} WidePlan;

/* Half of the area of a box's sides. */
double wide_area(const AccelBox *box);
/* Plans for every node of the tree; width is 4 or 8. `area` is of the nodes' volumes; NULL: of their boxes. */
void wide_plan(const SahTree *binary, int width, const float *area, WidePlan *plans);
/* The children of the wide node that stands for the subtree at `root`, from left to right; a leaf is its own only child. Returns how
 * many, at most `width`. */
uint32_t wide_children(const SahTree *binary, const WidePlan *plans, int width, uint32_t root, uint32_t child[8]);
#endif
