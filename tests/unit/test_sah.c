/* The builder of hierarchies: what every tree must be, for ordinary and hostile boxes, for any number of threads. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

#include "accel/sah.h"
#include "random.h"
#include "real_scene.h"
#include "sah_boxes.h"

typedef struct {
    uint32_t count;
    AccelBox *boxes;
    KellerVec3 (*corners)[3]; /* of triangles; NULL: boxes only */
} Input;

typedef enum { SMALL, STICKS, SAME_BOX, ONE_POINT, HUGE_AND_TINY, EXPONENTIAL, NESTED, INFINITE, EMPTY, OVERFLOW, FLAT,
               SAME_TRIANGLE, KINDS } Kind;

static Input new_input(uint32_t count, bool triangles)
{
    Input in = {count, malloc((count + 1) * sizeof *in.boxes), NULL};
    if (triangles) in.corners = malloc((count + 1) * sizeof *in.corners);
    assert_true(in.boxes && (in.corners || !triangles));
    return in;
}

static void free_input(Input *in)
{
    free(in->boxes);
    free(in->corners);
}

static Input make(Kind kind, uint32_t count, uint64_t seed)
{
    Random r = {seed};
    bool triangles = kind == SMALL || kind == STICKS || kind == HUGE_AND_TINY || kind == SAME_TRIANGLE;
    Input in = new_input(count, triangles);
    for (uint32_t i = 0; i < count; i++) {
        KellerVec3 middle = random_point(&r, 100), size = v3(0.5, 0.5, 0.5);
        if (kind == HUGE_AND_TINY) size = i == count / 2 ? v3(1e4, 1e4, 1e4) : v3(1e-3, 1e-3, 1e-3);
        if (kind == FLAT) middle.z = size.z = 0;
        AccelBox *box = &in.boxes[i];
        if (triangles) {
            KellerVec3 along = kind == STICKS && i % 50 == 0 ? v3_scale(random_unit(&r), 100) : v3(0, 0, 0);
            for (int k = 0; k < 3; k++) {
                KellerVec3 p = v3_add(middle, v3(random_in(&r, -1, 1) * size.x, random_in(&r, -1, 1) * size.y,
                                                 random_in(&r, -1, 1) * size.z));
                in.corners[i][k] = kind == SAME_TRIANGLE && i ? in.corners[0][k] : v3_madd(p, along, k - 1);
            }
            *box = box_of(in.corners[i]);
            continue;
        }
        for (int k = 0; k < 3; k++) {
            double m = coordinate(middle, k), s = coordinate(size, k);
            if (kind == SAME_BOX) m = 1, s = 2;
            if (kind == ONE_POINT) m = 1, s = 0;
            if (kind == EXPONENTIAL) m = k == 0 ? pow(2, random_in(&r, -140, 120)) : 0, s = 0;
            if (kind == NESTED) m = 0, s = pow(2, -100.0 * i / count);
            box->lower[k] = (float)(m - s);
            box->upper[k] = (float)(m + s);
            if (kind == INFINITE && i % 3 == 0 && random_u32(&r) % 2) box->lower[k] = -INFINITY;
            if (kind == INFINITE && i % 3 == 0 && random_u32(&r) % 2) box->upper[k] = INFINITY;
            if (kind == OVERFLOW) box->lower[k] *= 1e36f, box->upper[k] *= 3e38f;
        }
        if (kind == FLAT && i % 2) box->lower[2] = box->upper[2] = -0.0f;
        if (kind == OVERFLOW && box->lower[0] > box->upper[0]) box->lower[0] = -INFINITY;
        if (kind == EMPTY && i % 2) *box = (AccelBox){{1, -0.0f, 0}, {0, 0, 3}};
    }
    return in;
}

static void clip(void *context, uint32_t i, int axis, float lower, float upper, AccelBox *part)
{
    KellerVec3 (*p)[3] = context;
    sah_clip_triangle(p[i][0], p[i][1], p[i][2], axis, lower, upper, part);
}

static bool has_point(const AccelBox *b, KellerVec3 p)
{
    for (int k = 0; k < 3; k++)
        if (!((double)b->lower[k] <= coordinate(p, k) && coordinate(p, k) <= (double)b->upper[k])) return false;
    return true;
}

typedef struct {
    const Input *in;
    const SahTree *tree;
    const SahOptions *options;
    uint32_t next_node, next_ref, *seen;
    int depth;
} Walk;

static void check_node(Walk *w, uint32_t id, int depth)
{
    assert_int_equal(id, w->next_node++);
    const SahNode *node = &w->tree->nodes[id];
    if (depth > w->depth) w->depth = depth;
    assert_int_equal(node->first, w->next_ref);
    if (node->count == 0) {
        const uint32_t child[2] = {node->left, node->right};
        for (int c = 0; c < 2; c++) {
            assert_in_range(child[c], id + 1, w->tree->node_count - 1);
            assert_true(holds(&node->box, &w->tree->nodes[child[c]].box));
            check_node(w, child[c], depth + 1);
        }
    }
    assert_true(node->count <= w->options->leaf_most);
    for (uint32_t i = 0; i < node->count; i++) {
        uint32_t ref = w->tree->refs[w->next_ref + i];
        assert_true(ref < w->in->count);
        assert_true(i == 0 || w->tree->refs[w->next_ref + i - 1] < ref);
        assert_true(w->options->spatial || holds(&node->box, &w->in->boxes[ref]));
        w->seen[ref]++;
    }
    w->next_ref += node->count;
    assert_int_equal(node->end, w->next_ref);
}

/* Corners and random points of each triangle are in the box of a leaf that has the triangle. */
static void check_cover(const Input *in, const SahTree *tree)
{
    enum { POINTS = 12 };
    uint16_t *covered = calloc(in->count, sizeof *covered);
    for (uint32_t n = 0; n < tree->node_count; n++) {
        const SahNode *node = &tree->nodes[n];
        for (uint32_t i = node->first; i < node->first + node->count; i++) {
            const KellerVec3 *c = in->corners[tree->refs[i]];
            Random r = {tree->refs[i]};
            for (int k = 0; k < POINTS; k++) {
                double u = random_in(&r, 0, 1), v = random_in(&r, 0, 1) * (1 - u);
                KellerVec3 p = k < 3 ? c[k] : v3_madd(v3_madd(c[0], v3_sub(c[1], c[0]), u), v3_sub(c[2], c[0]), v);
                if (has_point(&node->box, p)) covered[tree->refs[i]] |= (uint16_t)(1 << k);
            }
        }
    }
    for (uint32_t i = 0; i < in->count; i++) assert_int_equal(covered[i], (1 << POINTS) - 1);
    free(covered);
}

static void check(const Input *in, const SahTree *tree, const SahOptions *options)
{
    Walk w = {in, tree, options, 0, 0, calloc(in->count + 1, sizeof(uint32_t)), 0};
    if (in->count) check_node(&w, 0, 1);
    assert_int_equal(w.next_node, tree->node_count);
    assert_int_equal(w.next_ref, tree->ref_count);
    assert_int_equal(w.depth, tree->depth);
    assert_true(tree->depth <= SAH_DEPTH + 32);
    for (uint32_t i = 0; i < in->count; i++) assert_true(options->spatial ? w.seen[i] >= 1 : w.seen[i] == 1);
    double most = in->count * (1 + (options->spatial ? options->budget : 0));
    assert_true(tree->ref_count <= most);
    free(w.seen);
    if (options->spatial && in->corners) check_cover(in, tree);
}

static SahTree build(const Input *in, const SahOptions *options)
{
    SahTree tree;
    KellerError error;
    KellerStatus status = sah_build(in->count, in->boxes, clip, in->corners, options, &tree, &error);
    if (status != KELLER_OK) fail_msg("%s", error.message);
    return tree;
}

static double area(const AccelBox *b)
{
    if (is_empty(b)) return 0;
    double x = (double)b->upper[0] - (double)b->lower[0], y = (double)b->upper[1] - (double)b->lower[1];
    double z = (double)b->upper[2] - (double)b->lower[2];
    return x * y + y * z + z * x;
}

/* Expected steps of a ray that meets the root: 1 for an inner node, cost_ratio for a block in a leaf. */
static double cost(const SahTree *tree, const SahOptions *o)
{
    double sum = 0;
    for (uint32_t i = 0; i < tree->node_count; i++) {
        const SahNode *node = &tree->nodes[i];
        sum += area(&node->box) * (node->count ? o->cost_ratio * ceil((double)node->count / o->block) : 1);
    }
    return sum / area(&tree->nodes[0].box);
}

/* References handled, over all levels: what an inner node costs to build is proportional to those below it. */
static double work(const SahTree *tree)
{
    double sum = 0;
    for (uint32_t i = 0; i < tree->node_count; i++)
        if (tree->nodes[i].count == 0) sum += tree->nodes[i].end - tree->nodes[i].first;
    return sum;
}

static void trees_are_sound(void **state)
{
    (void)state;
    for (int kind = 0; kind < KINDS; kind++) {
        for (uint32_t i = 0; i < 24; i++) {
            uint32_t count = i < 20 ? i : i < 23 ? 1000 * i : 100;
            Input in = make((Kind)kind, count, i);
            SahOptions o = sah_defaults();
            o.cost_ratio = (double[]){1, 0.2, 4, 100}[i % 4];
            o.leaf_most = (uint32_t[]){8, 1, 4, 20}[i / 2 % 4];
            o.block = (uint32_t[]){8, 1, 3}[i % 3];
            o.breadth = (float[]){0, 1, 1e30f}[i % 3];
            o.budget = i % 4 < 2 ? 0.3 : 2;
            for (int spatial = 0; spatial < (in.corners ? 2 : 1); spatial++) {
                o.spatial = spatial;
                SahTree tree = build(&in, &o);
                check(&in, &tree, &o);
                sah_free(&tree);
            }
            free_input(&in);
        }
    }
}

static void threads_change_nothing(void **state)
{
    (void)state;
    for (int kind = 0; kind < KINDS; kind++) {
        Input in = make((Kind)kind, 70000, 7);
        for (int spatial = 0; spatial < (in.corners ? 2 : 1); spatial++) {
            SahOptions o = sah_defaults();
            o.spatial = spatial;
            SahTree one = build(&in, &o);
            for (o.threads = 2; o.threads <= 3; o.threads++) {
                SahTree many = build(&in, &o);
                assert_int_equal(many.node_count, one.node_count);
                assert_int_equal(many.ref_count, one.ref_count);
                assert_int_equal(many.depth, one.depth);
                assert_memory_equal(many.nodes, one.nodes, one.node_count * sizeof *one.nodes);
                assert_memory_equal(many.refs, one.refs, one.ref_count * sizeof *one.refs);
                sah_free(&many);
            }
            sah_free(&one);
        }
        free_input(&in);
    }
}

/* The tree depends on the set of boxes, not on their order: turned round, it is the same with other numbers. */
static void order_changes_nothing(void **state)
{
    (void)state;
    enum { N = 5000 };
    Input in = make(STICKS, N, 3), turned = new_input(N, true);
    for (uint32_t i = 0; i < N; i++) {
        turned.boxes[i] = in.boxes[N - 1 - i];
        memcpy(turned.corners[i], in.corners[N - 1 - i], sizeof *in.corners);
    }
    SahOptions o = sah_defaults();
    o.spatial = true;
    SahTree a = build(&in, &o), b = build(&turned, &o);
    assert_int_equal(a.node_count, b.node_count);
    assert_memory_equal(a.nodes, b.nodes, a.node_count * sizeof *a.nodes);
    sah_free(&a);
    sah_free(&b);
    free_input(&in);
    free_input(&turned);
}

/* A perfect tree handles each reference log2(n / 8) times; in a comb it would be n / 16 times. */
static void work_grows_as_n_log_n(void **state)
{
    (void)state;
    for (int kind = 0; kind < KINDS; kind++) {
        for (uint32_t n = 1 << 10; n <= 1 << 18; n <<= 4) {
            Input in = make((Kind)kind, n, n);
            SahOptions o = sah_defaults();
            SahTree tree = build(&in, &o);
            double levels = work(&tree) / n;
            /* 260 octaves, where 16 bins part the last four: a comb, of a length that does not grow with n */
            double most = 2 * log2(n) + (kind == EXPONENTIAL ? 260 / 4 : 0);
            if (levels > most) fail_msg("kind %d, %u boxes: %g levels", kind, n, levels);
            sah_free(&tree);
            free_input(&in);
        }
    }
}

/* Equal boxes: every split costs the same, and the tree is balanced. */
static void equals_are_balanced(void **state)
{
    (void)state;
    Input in = make(SAME_BOX, 1 << 14, 1);
    SahOptions o = sah_defaults();
    SahTree tree = build(&in, &o);
    assert_int_equal(tree.depth, 12); /* 2^11 leaves of 8 */
    assert_int_equal(tree.node_count, (1 << 12) - 1);
    sah_free(&tree);
    for (uint32_t i = 0; i < in.count; i++) { /* sheets so near each other that it does not change the area */
        float x = 1e-10f * (float)i;
        in.boxes[i] = (AccelBox){{x, -100, -100}, {x, 100, 100}};
    }
    tree = build(&in, &o);
    assert_true(tree.depth <= 13);
    sah_free(&tree);
    free_input(&in);
}

/* Points on a line have no area: lengths decide, and the tree is balanced. */
static void a_line_is_balanced(void **state)
{
    (void)state;
    Input in = new_input(1 << 12, false);
    for (uint32_t i = 0; i < in.count; i++) {
        float x = (float)(i * 2654435761u % in.count);
        in.boxes[i] = (AccelBox){{x, 1, 2}, {x + 0.5f, 1, 2}};
    }
    SahOptions o = sah_defaults();
    SahTree tree = build(&in, &o);
    assert_true(tree.depth <= 12);
    for (uint32_t i = 0; i < tree.node_count; i++) {
        const SahNode *n = &tree.nodes[i];
        assert_true(n->count > 0 || tree.nodes[n->left].box.upper[0] < tree.nodes[n->right].box.lower[0]);
    }
    sah_free(&tree);
    free_input(&in);
}

/* What is empty adds nothing to a box; what is infinite, even one way, is parted from the rest at once. */
static void empty_and_infinite_come_apart(void **state)
{
    (void)state;
    Input in = make(SMALL, 100, 1);
    SahOptions o = sah_defaults();
    SahTree tree = build(&in, &o);
    AccelBox whole = tree.nodes[0].box;
    sah_free(&tree);
    in.boxes[100] = (AccelBox){{1000, 1000, 1000}, {-1000, 2000, 2000}};
    in.count = 101;
    tree = build(&in, &o);
    assert_memory_equal(&tree.nodes[0].box, &whole, sizeof whole);
    sah_free(&tree);
    for (int sides = 1; sides <= 2; sides++) {
        float lower = sides == 1 ? 0 : -INFINITY;
        in.boxes[100] = (AccelBox){{lower, lower, lower}, {INFINITY, INFINITY, INFINITY}};
        tree = build(&in, &o);
        assert_int_equal(tree.nodes[tree.nodes[0].right].count, 1);
        assert_memory_equal(&tree.nodes[tree.nodes[0].left].box, &whole, sizeof whole);
        sah_free(&tree);
    }
    free_input(&in);
}

/* Two clusters far from each other: the root's children are the clusters. By hand: any other split has a child as large as
 * the root. */
static void clusters_come_apart(void **state)
{
    (void)state;
    Input in = make(SMALL, 100, 1);
    for (uint32_t i = 0; i < 100; i++) {
        float shift = i % 3 ? 0 : 1e6f;
        in.boxes[i].lower[1] += shift;
        in.boxes[i].upper[1] += shift;
    }
    SahOptions o = sah_defaults();
    SahTree tree = build(&in, &o);
    const SahNode *left = &tree.nodes[tree.nodes[0].left];
    assert_int_equal(left->end - left->first, 66);
    for (uint32_t i = left->first; i < left->end; i++) assert_true(tree.refs[i] % 3 != 0);
    sah_free(&tree);
    free_input(&in);
}

static void leaves_are_filled(void **state)
{
    (void)state;
    Input in = make(SMALL, 50000, 1);
    SahOptions o = sah_defaults();
    SahTree tree = build(&in, &o);
    double leaves = (tree.node_count + 1) / 2.0;
    assert_true(tree.ref_count / leaves > 6.5);
    double shallow = cost(&tree, &o);
    sah_free(&tree);
    o.cost_ratio = 20; /* leaves that cost more are smaller, and cost less by that measure */
    tree = build(&in, &o);
    assert_true((tree.node_count + 1) / 2.0 > 1.2 * leaves);
    o.cost_ratio = 1;
    assert_true(shallow < cost(&tree, &o));
    sah_free(&tree);
    free_input(&in);
}

static void spatial_splits_pay(void **state)
{
    (void)state;
    Input in = make(STICKS, 20000, 5);
    SahOptions o = sah_defaults();
    SahTree tree = build(&in, &o);
    double object = cost(&tree, &o);
    sah_free(&tree);
    o.spatial = true;
    tree = build(&in, &o);
    assert_true(tree.ref_count > in.count);
    if (!(cost(&tree, &o) < 0.9 * object)) fail_msg("%g, %g without spatial splits", cost(&tree, &o), object);
    sah_free(&tree);
    o.budget = 0; /* nothing to spend */
    tree = build(&in, &o);
    assert_int_equal(tree.ref_count, in.count);
    assert_true(cost(&tree, &o) == object);
    sah_free(&tree);
    free_input(&in);
}

static void munich(void **state)
{
    (void)state;
    KellerSoup soup = real_scene("sionna/munich/munich.xml");
    Input in = new_input((uint32_t)soup.triangle_count, true);
    for (uint32_t i = 0; i < in.count; i++) {
        for (int k = 0; k < 3; k++) in.corners[i][k] = soup.vertices[soup.triangles[i][k]];
        in.boxes[i] = box_of(in.corners[i]);
    }
    SahOptions o = sah_defaults();
    SahTree tree = build(&in, &o);
    check(&in, &tree, &o);
    double object = cost(&tree, &o);
    sah_free(&tree);
    o.spatial = true;
    tree = build(&in, &o);
    check(&in, &tree, &o);
    assert_true(cost(&tree, &o) <= object);
    sah_free(&tree);
    free_input(&in);
    keller_soup_free(&soup);
}

static void too_many_are_refused(void **state)
{
    (void)state;
    SahOptions o = sah_defaults();
    SahTree tree;
    KellerError error;
    AccelBox box = {{0, 0, 0}, {1, 1, 1}};
    assert_int_equal(sah_build((1u << 30) + 1, &box, NULL, NULL, &o, &tree, &error), KELLER_FAILED);
    assert_null(tree.nodes);
    o.spatial = true;
    o.budget = 1e12;
    assert_int_equal(sah_build(1, &box, clip, NULL, &o, &tree, &error), KELLER_FAILED);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(trees_are_sound),        cmocka_unit_test(threads_change_nothing),
        cmocka_unit_test(order_changes_nothing),  cmocka_unit_test(work_grows_as_n_log_n),
        cmocka_unit_test(equals_are_balanced),    cmocka_unit_test(clusters_come_apart),
        cmocka_unit_test(leaves_are_filled),      cmocka_unit_test(spatial_splits_pay),
        cmocka_unit_test(munich),                 cmocka_unit_test(a_line_is_balanced),
        cmocka_unit_test(too_many_are_refused),   cmocka_unit_test(empty_and_infinite_come_apart),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
