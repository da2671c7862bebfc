#include "accel/wide.h"

#include <math.h>

double wide_area(const AccelBox *b)
{
    double x = (double)b->upper[0] - (double)b->lower[0], y = (double)b->upper[1] - (double)b->lower[1],
           z = (double)b->upper[2] - (double)b->lower[2];
    return x * y + y * z + z * x;
}

void wide_plan(const SahTree *binary, int width, const float *area, WidePlan *plans)
{
    for (uint32_t n = binary->node_count; n-- > 0;) { /* children have greater numbers */
        const SahNode *node = &binary->nodes[n];
        WidePlan *p = &plans[n];
        *p = (WidePlan){.cost = {0}};
        if (node->count) continue; /* leaves are given: they cost nothing more */
        const float *left = plans[node->left].cost, *right = plans[node->right].cost;
        float whole = INFINITY, best[9];
        for (int i = 2; i <= width; i++) {
            best[i] = INFINITY;
            p->left[i] = 1;
            for (int k = 1; k < i; k++)
                if (left[k - 1] + right[i - k - 1] < best[i]) {
                    best[i] = left[k - 1] + right[i - k - 1];
                    p->left[i] = (uint8_t)k;
                }
            whole = best[i];
        }
        p->cost[0] = whole + (area ? area[n] : (float)wide_area(&node->box));
        for (int i = 2; i < width; i++) {
            p->cost[i - 1] = best[i];
            if (best[i] < p->cost[i - 2]) continue;
            p->cost[i - 1] = p->cost[i - 2];
            p->left[i] = 0;
        }
    }
}

/* The roots of a subtree as at most `most` trees, from left to right, so that blocks are numbered in order. */
static void roots_of(const SahTree *binary, const WidePlan *plans, uint32_t n, int most, uint32_t roots[8], uint32_t *count)
{
    const SahNode *node = &binary->nodes[n];
    while (most > 1 && plans[n].left[most] == 0 && !node->count) most--;
    if (most == 1 || node->count) {
        roots[(*count)++] = n;
        return;
    }
    int left = plans[n].left[most];
    roots_of(binary, plans, node->left, left, roots, count);
    roots_of(binary, plans, node->right, most - left, roots, count);
}

uint32_t wide_children(const SahTree *binary, const WidePlan *plans, int width, uint32_t root, uint32_t child[8])
{
    uint32_t n = 0;
    if (binary->nodes[root].count) {
        child[n++] = root;
    } else {
        int left = plans[root].left[width];
        roots_of(binary, plans, binary->nodes[root].left, left, child, &n);
        roots_of(binary, plans, binary->nodes[root].right, width - left, child, &n);
    }
    return n;
}
