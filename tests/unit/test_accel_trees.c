/* The trees under the accelerators, walked directly: whatever a frustum meets is in a block that it is shown. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "accel/box.h"
#include "accel/internal.h"
#include "accel_model.h"
#include "base/number.h"

static const TreeKind *const kinds[] = {&tree_kdtree, &tree_bvh, &tree_bvh8, &tree_bvh_mask, &tree_bvh8_mask, &tree_ubvh};
enum { KINDS = sizeof kinds / sizeof *kinds };

static KellerVec3 local(const Model *m, uint32_t i, int k) { return v3_sub(model_corner(m, i, k), m->middle); }

static void clip(void *context, uint32_t i, int axis, float lower, float upper, AccelBox *part)
{
    const Model *m = context;
    sah_clip_triangle(local(m, i, 0), local(m, i, 1), local(m, i, 2), axis, lower, upper, part);
}

static int corners(void *context, uint32_t i, KellerVec3 v[3])
{
    for (int k = 0; k < 3; k++) v[k] = local(context, i, k);
    return 3;
}

static TreeInput input_of(Model *m, AccelBox **boxes)
{
    *boxes = malloc((m->in.triangle_count + 1) * sizeof **boxes);
    for (uint32_t i = 0; i < m->in.triangle_count; i++) {
        AccelBox *b = &(*boxes)[i];
        for (int k = 0; k < 3; k++) {
            b->lower[k] = INFINITY;
            b->upper[k] = -INFINITY;
            for (int j = 0; j < 3; j++) {
                KellerVec3 p = local(m, i, j);
                double x = k == 0 ? p.x : k == 1 ? p.y : p.z;
                float low = nextafterf((float)x, -INFINITY), high = nextafterf((float)x, INFINITY);
                b->lower[k] = low < b->lower[k] ? low : b->lower[k];
                b->upper[k] = high > b->upper[k] ? high : b->upper[k];
            }
        }
    }
    return (TreeInput){m->in.triangle_count, *boxes, clip, m, 2, 0, 1, corners, {0}, {0}};
}

typedef struct {
    uint32_t *order, count;
    uint8_t *seen, *inside;   /* by block */
    const float *shorten;     /* by block: the far end that a visit leaves; NULL: none does */
    uint32_t stop;            /* the visit that ends the walk */
} Walk;

static float visit(void *context, uint32_t block, bool inside, float far)
{
    Walk *w = context;
    w->order[w->count++] = block;
    w->seen[block]++;
    w->inside[block] = inside;
    if (w->count == w->stop) return -INFINITY;
    return w->shorten && w->shorten[block] < far ? w->shorten[block] : far;
}

static Walk walk_of(uint32_t blocks)
{
    return (Walk){calloc(8 * blocks + 8, sizeof(uint32_t)), 0, calloc(blocks + 1, 1), calloc(blocks + 1, 1), NULL, 0};
}

static void walk_free(Walk *w)
{
    free(w->order);
    free(w->seen);
    free(w->inside);
}

/* Blocks hold one to eight, all primitives there are, once where parts are not split. */
static void check_leaves(const TreeInput *in, const Leaves *l, bool once)
{
    uint8_t *held = calloc(in->count + 1, 1);
    assert_int_equal(l->begin ? l->begin[0] : 0, 0);
    for (uint32_t b = 0; b < l->block_count; b++) {
        assert_true(l->begin[b + 1] > l->begin[b] && l->begin[b + 1] - l->begin[b] <= 8);
        for (uint32_t j = l->begin[b]; j < l->begin[b + 1]; j++) {
            assert_true(l->refs[j] < in->count);
            held[l->refs[j]]++;
        }
    }
    for (uint32_t i = 0; i < in->count; i++) {
        assert_true(held[i] >= 1);
        if (once) assert_int_equal(held[i], 1);
    }
    free(held);
}

/* Each triangle met before the final far end must have been shown; what is said to be inside is. */
static void check_walk(const TreeInput *in, const Leaves *l, const KellerCone *cone, const Walk *w, KellerRange *met)
{
    const Model *m = in->clip_context;
    double far = INFINITY;
    for (uint32_t b = 0; b < l->block_count; b++) {
        assert_true(w->seen[b] <= 1);
        if (w->seen[b] && w->shorten) far = lesser(far, (double)w->shorten[b]);
    }
    for (uint32_t b = 0; b < l->block_count; b++)
        for (uint32_t j = l->begin[b]; j < l->begin[b + 1]; j++) {
            uint32_t i = l->refs[j];
            if (w->seen[b]) met[i] = (KellerRange){INFINITY, -INFINITY};
            if (w->inside[b] && in->spatial == 0) /* a part's box does not hold the primitive */
                assert_true(keller_cone_contains_triangle(cone, local(m, i, 0), local(m, i, 1), local(m, i, 2)));
        }
    for (uint32_t i = 0; i < in->count; i++) assert_false(met[i].near <= lesser(met[i].far, far));
}

/* Frusta through a model, and what they meet: the loop over all, once for all trees. */
enum { FRUSTA = 40 };
typedef struct {
    KellerCone cone[FRUSTA];
    KellerConeLanes lanes[FRUSTA];
    KellerRange *met[FRUSTA];
} Frusta;

static Frusta *frusta_of(const TreeInput *in, Random *r)
{
    const Model *m = in->clip_context;
    Frusta *f = malloc(sizeof *f);
    double size = 0;
    for (uint32_t i = 0; i < in->count; i++)
        for (int k = 0; k < 3; k++)
            size = greater(size, greater(fabs((double)in->boxes[i].lower[k]), fabs((double)in->boxes[i].upper[k])));
    for (uint32_t q = 0; q < FRUSTA; q++) {
        KellerCone *cone = &f->cone[q];
        *cone = model_cone(m, q, r);
        cone->origin = v3_sub(cone->origin, m->middle);
        KellerRange clipped = {q % 2 ? random_in(r, 0, 4) : 0, q % 3 == 1 ? random_in(r, 4, 20) : INFINITY};
        f->lanes[q] = keller_cone_lanes(cone, clipped, size);
        f->met[q] = malloc((in->count + 1) * sizeof *f->met[q]);
        for (uint32_t i = 0; i < in->count; i++)
            f->met[q][i] = keller_cone_triangle(cone, local(m, i, 0), local(m, i, 1), local(m, i, 2), clipped, NULL, NULL);
    }
    return f;
}

static void frusta_free(Frusta *f)
{
    for (uint32_t q = 0; q < FRUSTA; q++) free(f->met[q]);
    free(f);
}

static void walks(const TreeKind *kind, const TreeInput *in, const void *tree, const Leaves *l, const Frusta *f, uint64_t *work)
{
    KellerRange *left = malloc((in->count + 1) * sizeof *left);
    float *shorten = malloc((l->block_count + 1) * sizeof *shorten);
    for (uint32_t q = 0; q < FRUSTA; q++) {
        const KellerRange *met = f->met[q];
        for (uint32_t b = 0; b < l->block_count; b++) { /* as a query for the nearest would */
            shorten[b] = INFINITY;
            for (uint32_t j = l->begin[b]; j < l->begin[b + 1]; j++)
                if (met[l->refs[j]].near <= met[l->refs[j]].far)
                    shorten[b] = (float)lesser((double)shorten[b], met[l->refs[j]].near * (1 + 1e-6) + 1e-6);
        }
        for (int way = 0; way < 4; way++) { /* shortened, looking for what is contained */
            const WalkHow how = {.contained = way & 1};
            Walk w = walk_of(l->block_count);
            uint64_t nodes = 0;
            w.shorten = way & 2 ? shorten : NULL;
            kind->walk(tree, &f->lanes[q], &how, visit, &w, &nodes);
            memcpy(left, met, in->count * sizeof *met);
            check_walk(in, l, &f->cone[q], &w, left);
            *work += w.count;
            if (w.count > 1) { /* and it ends when told to */
                Walk half = walk_of(l->block_count);
                half.shorten = w.shorten;
                half.stop = w.count / 2;
                kind->walk(tree, &f->lanes[q], &how, visit, &half, &nodes);
                assert_int_equal(half.count, half.stop);
                assert_memory_equal(half.order, w.order, half.count * sizeof *w.order);
                walk_free(&half);
            }
            walk_free(&w);
        }
    }
    free(left);
    free(shorten);
}

static void same_for_threads(const TreeKind *kind, TreeInput in, const void *tree, const Leaves *l, Random *r)
{
    KellerCone cone = model_cone(in.clip_context, 0, r);
    cone.origin = v3_sub(cone.origin, ((const Model *)in.clip_context)->middle);
    KellerConeLanes lanes = keller_cone_lanes(&cone, (KellerRange){0, INFINITY}, 100);
    Walk w = walk_of(l->block_count);
    uint64_t nodes = 0;
    kind->walk(tree, &lanes, &(WalkHow){.contained = true}, visit, &w, &nodes);
    for (int threads = 2; threads <= 3; threads++) {
        void *other;
        Leaves leaves;
        in.threads = threads;
        assert_int_equal(kind->build(&in, &other, &leaves, NULL), KELLER_OK);
        assert_int_equal(leaves.block_count, l->block_count);
        assert_memory_equal(leaves.begin, l->begin, (l->block_count + 1) * sizeof *l->begin);
        assert_memory_equal(leaves.refs, l->refs, l->begin[l->block_count] * sizeof *l->refs);
        assert_int_equal(kind->bytes(other), kind->bytes(tree));
        Walk again = walk_of(l->block_count);
        uint64_t nodes_again = 0;
        kind->walk(other, &lanes, &(WalkHow){.contained = true}, visit, &again, &nodes_again);
        assert_int_equal(nodes, nodes_again);
        assert_int_equal(w.count, again.count);
        assert_memory_equal(w.order, again.order, w.count * sizeof *w.order);
        walk_free(&again);
        leaves_free(&leaves);
        kind->free(other);
    }
    walk_free(&w);
}

static void nothing_missed(void **state)
{
    (void)state;
    Random r = {4711};
    for (uint32_t s = 0; s < 5 * MODEL_KINDS; s++) {
        ModelKind model = (ModelKind)(s % MODEL_KINDS);
        Model m = model_make(model, s < MODEL_KINDS ? 1 + random_u32(&r) % 20 : 20 + random_u32(&r) % 2000, &r);
        AccelBox *boxes;
        TreeInput in = input_of(&m, &boxes);
        Frusta *frusta = frusta_of(&in, &r);
        for (int k = 0; k < KINDS; k++)
            for (int spatial = 0; spatial < 2; spatial++) {
                in.spatial = 0.5 * spatial;
                in.cost_ratio = s % 2 ? 0.7 : 3;
                void *tree;
                Leaves leaves;
                uint64_t work = 0;
                assert_int_equal(kinds[k]->build(&in, &tree, &leaves, NULL), KELLER_OK);
                check_leaves(&in, &leaves, !spatial && k > 0);
                walks(kinds[k], &in, tree, &leaves, frusta, &work);
                if (in.count > 300 && (model == MODEL_SPREAD || model == MODEL_GRID || model == MODEL_FAR_AWAY))
                    assert_true(work < 160 * leaves.block_count / 2); /* it does save work */
                if (in.count && s >= 4 * MODEL_KINDS) same_for_threads(kinds[k], in, tree, &leaves, &r);
                leaves_free(&leaves);
                kinds[k]->free(tree);
            }
        frusta_free(frusta);
        free(boxes);
        model_free(&m);
    }
}

/* One box as eight: the same formulas. */
static void one_box(void **state)
{
    (void)state;
    Random r = {99};
    Model m = model_make(MODEL_SPREAD, 10, &r);
    uint32_t met = 0, contained = 0;
    for (uint32_t q = 0; q < 20000; q++) {
        KellerCone cone = model_cone(&m, q, &r);
        KellerConeLanes lanes = keller_cone_lanes(&cone, (KellerRange){0, q % 2 ? 8 : INFINITY}, 40);
        KellerBox8 boxes;
        _Alignas(32) float distance[8];
        for (int i = 0; i < 8; i++) {
            KellerVec3 a = v3_madd(cone.origin, cone.directrix, random_in(&r, -1, 9));
            a = v3_add(a, random_point(&r, i % 2 ? 3 : 0.1));
            KellerVec3 h = v3_scale(random_point(&r, 1), pow(10, random_in(&r, -4, 0)));
            const double l[3] = {a.x, a.y, a.z}, s[3] = {fabs(h.x), fabs(h.y), fabs(h.z)};
            for (int k = 0; k < 3; k++) {
                boxes.lower[k][i] = (float)l[k];
                boxes.upper[k][i] = (float)(l[k] + s[k]);
            }
        }
        uint32_t mask = keller_cone_meets_box8(&lanes, &boxes, distance);
        for (int i = 0; i < 8; i++) {
            float lower[3], upper[3], z;
            for (int k = 0; k < 3; k++) {
                lower[k] = boxes.lower[k][i];
                upper[k] = boxes.upper[k][i];
            }
            bool yes = box_meets(&lanes, cone_lanes_wide(&lanes), lower, upper, &z);
            assert_int_equal(yes, mask >> i & 1);
            if (yes) assert_true(z == distance[i]);
            met += yes;
            if (!box_contained(&lanes, lower, upper)) continue;
            contained++;
            assert_true(yes && keller_cone_contains_box(&cone, v3((double)lower[0], (double)lower[1], (double)lower[2]),
                                                        v3((double)upper[0], (double)upper[1], (double)upper[2])));
        }
    }
    assert_true(met > 10000 && contained > 1000);
    model_free(&m);
}

/* Time and references stay bounded where no plane separates anything. */
static void bounded(void **state)
{
    (void)state;
    Random r = {5};
    for (int s = 0; s < 2; s++) {
        Model m = model_make(s ? MODEL_ONE_POINT : MODEL_HUGE_AND_TINY, 10000, &r);
        for (uint32_t i = 0; s == 0 && i < m.in.triangle_count * 3; i++) m.vertices[i] = random_point(&r, 10); /* all overlap */
        AccelBox *boxes;
        TreeInput in = input_of(&m, &boxes);
        for (int k = 0; k < KINDS; k++) {
            void *tree;
            Leaves leaves;
            in.spatial = 0.3;
            assert_int_equal(kinds[k]->build(&in, &tree, &leaves, NULL), KELLER_OK);
            assert_true(leaves.begin[leaves.block_count] <= 4 * in.count);
            assert_true(kinds[k]->bytes(tree) < 200 * (size_t)in.count);
            leaves_free(&leaves);
            kinds[k]->free(tree);
        }
        free(boxes);
        model_free(&m);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_box),
        cmocka_unit_test(nothing_missed),
        cmocka_unit_test(bounded),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
