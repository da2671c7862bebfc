/* Building: top-down binned SAH on centroids (Wald 2007), then every inner node takes in its grandchildren until it has
 * four children. */
#include "accel/bvh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"

enum { BINS = 16, LEAF = 4, LEAF_MOST = 8, SAH_DEPTH = 64 };

typedef struct {
    BvhBox box;
    uint32_t left, right; /* children, or begin and end of a leaf */
    bool leaf;
} Binary;

typedef struct {
    const BvhBox *boxes;
    uint32_t *order;
    Binary *nodes;
    uint32_t used;
} Builder;

BvhBox bvh_box(size_t count, const KellerVec3 *points)
{
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < count; i++) {
        const double p[3] = {points[i].x, points[i].y, points[i].z};
        for (int k = 0; k < 3; k++) {
            lo[k] = lesser(lo[k], p[k]);
            hi[k] = greater(hi[k], p[k]);
        }
    }
    BvhBox box;
    for (int k = 0; k < 3; k++) {
        box.lower[k] = nextafterf((float)lo[k], -INFINITY);
        box.upper[k] = nextafterf((float)hi[k], INFINITY);
    }
    return box;
}

static BvhBox empty_box(void)
{
    return (BvhBox){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

static void grow(BvhBox *a, const BvhBox *b)
{
    for (int k = 0; k < 3; k++) {
        a->lower[k] = a->lower[k] < b->lower[k] ? a->lower[k] : b->lower[k];
        a->upper[k] = a->upper[k] > b->upper[k] ? a->upper[k] : b->upper[k];
    }
}

/* Half the surface, in double: the order of summation is fixed, so builds are the same everywhere. */
static double half_area(const BvhBox *b)
{
    double d[3];
    for (int k = 0; k < 3; k++) {
        d[k] = (double)b->upper[k] - (double)b->lower[k];
        if (!(d[k] >= 0)) return 0;
    }
    return d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
}

static double centroid(const BvhBox *b, int k) { return 0.5 * ((double)b->lower[k] + (double)b->upper[k]); }

/* Chooses a split; returns the position of the first primitive on the right, or 0 for "make a leaf". */
static uint32_t split(Builder *b, uint32_t begin, uint32_t end, int depth)
{
    uint32_t n = end - begin;
    if (n <= 1) return 0;
    if (depth < SAH_DEPTH) {
        double best = INFINITY, best_low = 0, best_scale = 0;
        int best_axis = -1, best_bin = 0;
        for (int k = 0; k < 3; k++) {
            double lo = INFINITY, hi = -INFINITY;
            for (uint32_t i = begin; i < end; i++) {
                double c = centroid(&b->boxes[b->order[i]], k);
                lo = lesser(lo, c);
                hi = greater(hi, c);
            }
            if (!(hi > lo)) continue;
            double scale = BINS * (1 - 1e-9) / (hi - lo);
            BvhBox bin[BINS], right[BINS];
            uint32_t count[BINS] = {0};
            for (int j = 0; j < BINS; j++) bin[j] = empty_box();
            for (uint32_t i = begin; i < end; i++) {
                const BvhBox *p = &b->boxes[b->order[i]];
                int j = (int)((centroid(p, k) - lo) * scale);
                j = j < 0 ? 0 : j >= BINS ? BINS - 1 : j;
                grow(&bin[j], p);
                count[j]++;
            }
            right[BINS - 1] = bin[BINS - 1];
            for (int j = BINS - 2; j >= 0; j--) {
                right[j] = right[j + 1];
                grow(&right[j], &bin[j]);
            }
            BvhBox left = empty_box();
            uint32_t left_count = 0;
            for (int j = 0; j + 1 < BINS; j++) {
                grow(&left, &bin[j]);
                left_count += count[j];
                if (left_count == 0 || left_count == n) continue;
                double cost = half_area(&left) * left_count + half_area(&right[j + 1]) * (n - left_count);
                if (cost < best) {
                    best = cost;
                    best_axis = k;
                    best_bin = j;
                    best_low = lo;
                    best_scale = scale;
                }
            }
        }
        if (best_axis >= 0 && n > LEAF) {
            uint32_t i = begin, j = end;
            while (i < j) {
                int bin = (int)((centroid(&b->boxes[b->order[i]], best_axis) - best_low) * best_scale);
                if (bin <= best_bin) {
                    i++;
                } else {
                    uint32_t t = b->order[i];
                    b->order[i] = b->order[--j];
                    b->order[j] = t;
                }
            }
            if (i > begin && i < end) return i;
        }
    }
    return n > LEAF_MOST ? begin + n / 2 : 0; /* equal centroids, or too deep: halves by count */
}

static uint32_t build(Builder *b, uint32_t begin, uint32_t end, int depth)
{
    uint32_t id = b->used++;
    BvhBox box = empty_box();
    for (uint32_t i = begin; i < end; i++) grow(&box, &b->boxes[b->order[i]]);
    uint32_t middle = split(b, begin, end, depth);
    Binary node = {.box = box, .left = begin, .right = end, .leaf = middle == 0};
    if (middle) {
        node.left = build(b, begin, middle, depth + 1);
        node.right = build(b, middle, end, depth + 1);
    }
    b->nodes[id] = node;
    return id;
}

static uint32_t collapse(const Binary *binary, uint32_t root, Bvh *bvh, int depth)
{
    uint32_t id = bvh->node_count++, child[4] = {root}, n = 1;
    if (depth > bvh->depth) bvh->depth = depth;
    for (;;) { /* open the child with the largest surface */
        int open = -1;
        double most = -1;
        for (uint32_t i = 0; i < n; i++) {
            double area = half_area(&binary[child[i]].box);
            if (!binary[child[i]].leaf && area > most) {
                most = area;
                open = (int)i;
            }
        }
        if (open < 0 || n == 4) break;
        uint32_t opened = child[open];
        child[open] = binary[opened].left;
        child[n++] = binary[opened].right;
    }
    BvhNode *node = &bvh->nodes[id];
    for (uint32_t i = 0; i < 4; i++) {
        BvhBox box = i < n ? binary[child[i]].box : empty_box();
        for (int k = 0; k < 3; k++) {
            node->lower[k][i] = box.lower[k];
            node->upper[k][i] = box.upper[k];
        }
        node->child[i] = node->count[i] = 0;
        if (i >= n) continue;
        const Binary *c = &binary[child[i]];
        if (c->leaf) {
            node->child[i] = c->left;
            node->count[i] = c->right - c->left;
        } else {
            uint32_t below = collapse(binary, child[i], bvh, depth + 1);
            bvh->nodes[id].child[i] = below;
        }
    }
    return id;
}

KellerStatus bvh_build(uint32_t count, const BvhBox *boxes, Bvh *bvh, KellerError *error)
{
    memset(bvh, 0, sizeof *bvh);
    if (count == 0) return KELLER_OK;
    size_t most = 2 * (size_t)count;
    Builder b = {.boxes = boxes, .order = malloc(count * sizeof(uint32_t)), .nodes = malloc(most * sizeof(Binary))};
    bvh->nodes = aligned_alloc(64, most * sizeof(BvhNode));
    if (!b.order || !b.nodes || !bvh->nodes) {
        free(b.order);
        free(b.nodes);
        bvh_free(bvh);
        return keller_error_memory(error, most * (sizeof(BvhNode) + sizeof(Binary)));
    }
    for (uint32_t i = 0; i < count; i++) b.order[i] = i;
    build(&b, 0, count, 0);
    collapse(b.nodes, 0, bvh, 1);
    free(b.nodes);
    bvh->primitives = b.order;
    bvh->primitive_count = count;
    size_t bytes = bvh->node_count * sizeof(BvhNode);
    BvhNode *fit = aligned_alloc(64, (bytes + 63) / 64 * 64);
    if (fit) {
        memcpy(fit, bvh->nodes, bytes);
        free(bvh->nodes);
        bvh->nodes = fit;
    }
    return KELLER_OK;
}

void bvh_free(Bvh *bvh)
{
    free(bvh->nodes);
    free(bvh->primitives);
    memset(bvh, 0, sizeof *bvh);
}
