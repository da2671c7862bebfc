/* The hierarchy of skewed boxes as a TreeKind. */
#include <stdlib.h>
#include <string.h>

#include "accel/dop14.h"
#include "accel/ubvh.h"
#include "base/number.h"
#include "geom/cone_lanes.h"

void ubvh_free(void *tree)
{
    Ubvh *t = tree;
    if (!t) return;
    free(t->nodes8);
    free(t->nodes4);
    free(t->along);
    dop14_free(t->dop14);
    free(t);
}

static size_t tree_bytes(const void *tree)
{
    const Ubvh *t = tree;
    if (!t) return 0;
    size_t node = t->dop14 ? 0 : t->width == 4 ? sizeof(UbvhNode4) : sizeof(UbvhNode8);
    return sizeof *t + t->node_count * node + t->along_count * sizeof *t->along + dop14_bytes(t->dop14);
}

/* ---- walking ----------------------------------------------------------------------------------------------------- */

UbvhFrustum ubvh_frustum(const Ubvh *t, const KellerConeLanes *c)
{
    UbvhFrustum f = {.near = c->near, .far = c->far, .ray = c->tan_alpha == 0 && c->x0 == 0, .lanes = c};
    f.thin = lanes_plain(c) && !cone_lanes_wide(c);
    memcpy(f.origin, c->origin, sizeof f.origin);
    memcpy(f.axis[2], c->axis[2], sizeof f.axis[2]);
    double slack = (double)c->slack;
    if (!f.ray) {
        const float *minor = c->axis[1]; /* times e; wanted over e */
        double square = 0;
        for (int k = 0; k < 3; k++) square += (double)minor[k] * (double)minor[k];
        for (int k = 0; k < 3; k++) f.axis[1][k] = (float)((double)minor[k] / square);
        memcpy(f.axis[0], c->axis[0], sizeof f.axis[0]);
        f.tan_alpha = c->tan_alpha;
        f.x0 = c->x0;
        slack *= 1 + 2 * (double)c->tan_alpha;
    }
    /* the slack is 64 u (M + x0), of which tests ask for less than half; of 96 u size slabs have 84 to spare */
    double asked = 0.5 * slack - 2.0 / 3 * t->margin;
    f.loose = asked > 0 ? float_up(asked) : 0;
    f.looser = (float)(1 + (double)f.loose / t->margin);
    return f;
}

static void walk(const void *tree, const KellerConeLanes *lanes, const WalkHow *how, LeafVisit visit, void *context, uint64_t *nodes)
{
    const Ubvh *t = tree;
    if (t && t->dop14) {
        dop14_walk(t->dop14, lanes, visit, context, nodes);
        return;
    }
    if (!t || !t->root) return;
    const UbvhFrustum f = ubvh_frustum(t, lanes);
    if (t->width == 4) ubvh_walk_4(t, t->nodes4, &f, how->contained, visit, context, nodes);
    else ubvh_walk_8(t, t->nodes8, &f, how->contained, visit, context, nodes);
}

static uint32_t root(const void *tree)
{
    const Ubvh *t = tree;
    if (t && t->dop14) return dop14_empty(t->dop14) ? KELLER_NONE : 0;
    return t && t->root ? t->root : KELLER_NONE;
}

static uint32_t open_node(const void *tree, uint32_t node, const KellerConeLanes *lanes, TreeChild child[8])
{
    const Ubvh *t = tree;
    if (t->dop14) return dop14_open(t->dop14, node, lanes, child);
    const UbvhFrustum f = ubvh_frustum(t, lanes);
    return t->width == 4 ? ubvh_open_4(t, t->nodes4, node, &f, child) : ubvh_open_8(t, t->nodes8, node, &f, child);
}

const TreeKind tree_ubvh = {"ubvh", 1, ubvh_build, ubvh_free, tree_bytes, walk, root, open_node, open_node};
