/* Which end of a path searches for what, and where they meet. */
#ifndef KELLER_PATH_PLAN_H
#define KELLER_PATH_PLAN_H
#include "path/tree.h"

/* The transmitter's side has the first `forward` steps of a sequence, the receiver's the last `backward`: together one more
 * than there are where they meet in a common step, or just as many where they meet on the leg between two wedges. */
typedef struct {
    uint32_t forward, backward;
} Meeting;

static inline bool meets_on_leg(Meeting m, Pattern pattern) { return m.forward + m.backward == pattern_length(pattern); }

/* An empty plan; false: out of memory. Then PLAN_WANT is set, and plan_uses finds the other flags. */
bool plan_init(TreePlan *plan, uint32_t bends);
void plan_uses(TreePlan *plan);
void plan_free(TreePlan *plan);

/* True if paths of this pattern (from the transmitter) are asked for. */
bool plan_asks(uint32_t reflections, uint32_t diffractions, Pattern pattern);

/* Where the ends meet for a pattern of at least one step, of `bends` at most. A fan from a wedge costs more than anything else,
 * so the fewer the better. They meet on a leg between wedges that follow each other, so that neither end fans out from these, as
 * near to the middle of the wedges as there is one; else at the middle wedge, or, of an even number, at a face between the middle two: fans of
 * both ends find more quickly what they are reflected in than one end's find all wedges behind that. Without wedges they meet in the middle.
 * alone: the transmitter's side has all. */
Meeting plan_meeting(Pattern pattern, uint32_t bends, bool alone);

/* Is it better to search from the transmitter alone, and to sift all of its sequences for each receiver? A face or a wedge is found by cones in
 * some milliseconds a receiver, and sifted in some ten nanoseconds. */
bool plan_is_alone(uint32_t diffractions, uint32_t bends, size_t receivers);

/* Fills the plans of both ends, which plan_init has made; so that for every kind of path the two ends meet. */
void plan_ends(uint32_t reflections, uint32_t diffractions, TreePlan *forward, TreePlan *backward);
/* The plan of a search from the transmitter alone: for every kind of path. */
void plan_alone(uint32_t reflections, uint32_t diffractions, TreePlan *plan);
#endif
