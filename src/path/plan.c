#include "path/plan.h"

#include <stdlib.h>

enum { ALONE_RECEIVERS = 2 };   /* a second step costs the transmitter's side as much as the first one costs so many receivers, about */

bool plan_init(TreePlan *plan, uint32_t bends)
{
    *plan = (TreePlan){bends, calloc((size_t)4 << bends, 1)};
    return plan->of != NULL;
}

void plan_free(TreePlan *plan)
{
    free(plan->of);
    *plan = (TreePlan){0};
}

void plan_uses(TreePlan *plan)
{
    enum { ON = PLAN_FACE | PLAN_WEDGE };
    for (Pattern p = (1u << plan->bends) - 1; p >= PATTERN_EMPTY; p--) { /* the longer ones first */
        uint8_t face = plan->of[pattern_and(p, false)], wedge = plan->of[pattern_and(p, true)];
        if (face & (PLAN_WANT | ON)) plan->of[p] |= PLAN_FACE;
        if (wedge & (PLAN_WANT | ON)) plan->of[p] |= PLAN_WEDGE;
        if ((face | wedge) & ON) plan->of[p] |= PLAN_BEYOND;
    }
}

bool plan_is_alone(uint32_t diffractions, uint32_t bends, size_t receivers)
{
    return bends == 1 || (bends == 2 && diffractions == 0 && receivers >= ALONE_RECEIVERS);
}

bool plan_asks(uint32_t reflections, uint32_t diffractions, Pattern pattern)
{
    uint32_t wedges = pattern_wedges(pattern);
    return wedges <= diffractions && pattern_length(pattern) - wedges <= reflections;
}

/* Places are counted from the receiver, from 1. */
static bool wedge_at(Pattern pattern, uint32_t place) { return pattern >> (place - 1) & 1; }

Meeting plan_meeting(Pattern pattern, uint32_t bends, bool alone)
{
    uint32_t k = pattern_length(pattern), wedges = pattern_wedges(pattern), half = (bends + 1) / 2, m = k < half ? k : half;
    uint32_t first = 1; /* the receiver's first wedge */
    if (alone) return (Meeting){k, 0};
    while (first <= k && !wedge_at(pattern, first)) first++;
    if (wedges == 0) return (Meeting){k + 1 - m, m};
    if (wedges == 1) return (Meeting){k + 1 - first, first};
    uint32_t best = 0, nearest = UINT32_MAX, passed = 0, ideal = (wedges + 1) / 2;
    for (uint32_t i = first; i < k; i++) {
        passed += wedge_at(pattern, i);
        uint32_t from_ideal = passed > ideal ? passed - ideal : ideal - passed;
        if (!wedge_at(pattern, i) || !wedge_at(pattern, i + 1) || from_ideal >= nearest) continue;
        nearest = from_ideal;
        best = i;
    }
    if (best) return (Meeting){k - best, best};
    uint32_t before = first;
    for (m = first, passed = 1; passed < wedges / 2 + 1;) {
        before = wedge_at(pattern, m) ? m : before;
        passed += wedge_at(pattern, ++m);
    }
    if (wedges % 2 == 0) m = (before + m + 1) / 2;
    return (Meeting){k + 1 - m, m};
}

void plan_ends(uint32_t reflections, uint32_t diffractions, TreePlan *forward, TreePlan *backward)
{
    for (Pattern p = 2; p < 2u << forward->bends; p++) {
        if (!plan_asks(reflections, diffractions, p)) continue;
        Meeting m = plan_meeting(p, forward->bends, false);
        forward->of[pattern_first(p, m.forward)] |= PLAN_WANT;
        backward->of[pattern_last(p, m.backward)] |= PLAN_WANT;
    }
    plan_uses(forward);
    plan_uses(backward);
}

void plan_alone(uint32_t reflections, uint32_t diffractions, TreePlan *plan)
{
    for (Pattern p = 2; p < 2u << plan->bends; p++)
        if (plan_asks(reflections, diffractions, p)) plan->of[p] |= PLAN_WANT;
    plan_uses(plan);
}
