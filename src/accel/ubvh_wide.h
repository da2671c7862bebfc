/* Tests and walks of nodes of WIDE children, 8 or 4; included for both by accel/ubvh.h, and not protected.
 *
 * A ray in a slab's coordinate is at + t rate, with at = n.o - c and rate = n.d, and inside where |at + t rate| <= 1. Rounding: let
 * u = 2^-24, M = size + max |o_k|, n of the length 1 / h, and all errors be in m, that is times h. The origin is off by sqrt(3) u M, n.o by
 * 3 sqrt(3) u M, less c by 2 sqrt(3) u M; rate by 4 sqrt(3) u M at the t of any point of the scene (direction, three products); t, as
 * middle +- half, by 6 sqrt(3) u M (quotient, product, sum; |t| and half are each less than 2 sqrt(3) M away). That is 28u M, and a slab's own
 * rounding is 12u of the size (accel/sobb.c: direction, corners and sums of a k-DOP 5 sqrt(3), n and c 2 sqrt(3)). Who starts within
 * the scene has M <= 2 size: 68u of SOBB_WIDTH's 96. From farther away slabs are grown by `loose`.
 *
 * A cone reaches to either side by s R(z) along n, R = z T + x0, s^2 = (X.n)^2 + (Y.n / e)^2, as along the axes in geom/cone_lanes.c. s is
 * off by 14u (its parts by 4u and 7u, root and sum), so s R by 14u (sqrt(3) M T + x0), less than what 1 + T times 28u (M + x0) more. */
#define JOIN_(a, b) a##_##b
#define JOIN(a, b) JOIN_(a, b)
#define NAME(name) JOIN(name, WIDE)
#if WIDE == 8
#define VEC f8
#define NODE UbvhNode8
#define V(name) f8_##name
#define V_LOAD f8_load
#define EQUAL i8_equal
#else
#define VEC f4
#define NODE UbvhNode4
#define V(name) f4_##name
#define V_LOAD f4_load
#define EQUAL i4_equal
#endif
#define INLINE static inline __attribute__((always_inline))

typedef struct {
    VEC at[3], rate[3], inverse[3], half[3], begin; /* in time: middle of a slab is -at inverse */
} NAME(UbvhSlabs);

INLINE VEC NAME(ubvh_dot)(const float *n, const float p[3], VEC from)
{
    VEC sum = V(madd)(V_LOAD(n), V(set1)(p[0]), from);
    sum = V(madd)(V_LOAD(n + WIDE), V(set1)(p[1]), sum);
    return V(madd)(V_LOAD(n + 2 * WIDE), V(set1)(p[2]), sum);
}

/* Half of a slab with what it must hold beyond. */
INLINE VEC NAME(ubvh_half)(const float *n, float loose)
{
    VEC one = V(set1)(1);
    if (!(loose > 0)) return one;
    VEC length = V(add)(V(add)(V(abs)(V_LOAD(n)), V(abs)(V_LOAD(n + WIDE))), V(abs)(V_LOAD(n + 2 * WIDE)));
    return V(madd)(length, V(set1)(loose), one);
}

INLINE uint32_t NAME(ubvh_children)(const NODE *node) { return ~(uint32_t)EQUAL(node->child, 0) & ((1u << WIDE) - 1); }

/* The children whose boxes a ray meets before `far`. A slab along the ray bounds nothing: its times are not numbers, and come first. */
INLINE uint32_t NAME(ubvh_ray)(const UbvhFrustum *f, const NODE *node, float far, NAME(UbvhSlabs) *s)
{
    VEC in = V(set1)(f->near), out = V(set1)(far), zero = V(set1)(0), one = V(set1)(1);
    for (int k = 0; k < 3; k++) {
        const float *n = node->slab + 4 * k * WIDE;
        s->at[k] = NAME(ubvh_dot)(n, f->origin, V(neg)(V_LOAD(n + 3 * WIDE)));
        s->rate[k] = NAME(ubvh_dot)(n, f->axis[2], zero);
        s->inverse[k] = V(div)(one, s->rate[k]);
        s->half[k] = V(mul)(V(abs)(s->inverse[k]), NAME(ubvh_half)(n, f->loose));
        VEC middle = V(mul)(V(neg)(s->at[k]), s->inverse[k]);
        in = V(max)(V(sub)(middle, s->half[k]), in);
        out = V(min)(V(add)(middle, s->half[k]), out);
    }
    s->begin = in;
    return (uint32_t)V(mask)(V(le)(in, out)) & NAME(ubvh_children)(node);
}

/* A triangle in the plane that a ray passes at t, give or take dt: where a + b <= 0 of the coordinates a, b. Other: where a + b >= 0. What
 * is not a number may be met. */
typedef struct {
    VEC away, away_other, inside, near_diagonal;
} NAME(UbvhFace);

INLINE NAME(UbvhFace) NAME(ubvh_face)(VEC t, VEC dt, VEC a_at, VEC a_rate, VEC b_at, VEC b_rate, VEC band)
{
    VEC a = V(madd)(t, a_rate, a_at), b = V(madd)(t, b_rate, b_at), da = V(mul)(V(abs)(a_rate), dt), db = V(mul)(V(abs)(b_rate), dt);
    VEC sum = V(add)(a, b), off = V(add)(V(add)(da, db), band), most = V(sub)(V(set1)(1), band);
    NAME(UbvhFace) face = {.away = V(lt)(off, sum), .away_other = V(lt)(off, V(neg)(sum))};
    face.inside = V(and)(V(le)(V(add)(V(abs)(a), da), most), V(le)(V(add)(V(abs)(b), db), most));
    face.near_diagonal = V(le)(sum, V(neg)(off));
    return face;
}

/* What a ray meets of the entries `leaves`, whose boxes it meets. Sure hits lie in [near, far]. Inlined: the one loop's check of a
 * triangle's hit (algorithm 1), of all entries at once. */
INLINE void NAME(ubvh_meet)(const UbvhFrustum *f, const NODE *node, const NAME(UbvhSlabs) *s, uint32_t leaves, float near, float far,
                            UbvhMet *met)
{
    VEC band = V(mul)(V_LOAD(node->band), V(set1)(f->looser)), middle = V(mul)(V(neg)(s->at[2]), s->inverse[2]), dt = s->half[2];
    uint32_t wings = leaves & (uint32_t)V(mask)(V(chosen)(node->child, 1)), flat = leaves & (uint32_t)V(mask)(V(chosen)(node->child, 2));
    VEC t = middle;
    if (wings) { /* the first triangle is in w = -1 */
        VEC is = V(chosen)(node->child, 1);
        t = V(blend)(is, V(sub)(middle, s->inverse[2]), t);
        dt = V(blend)(is, V(mul)(V(abs)(s->inverse[2]), band), dt);
    }
    NAME(UbvhFace) face = NAME(ubvh_face)(t, dt, s->at[0], s->rate[0], s->at[1], s->rate[1], band);
    VEC low = V(sub)(t, dt), high = V(add)(t, dt);
    VEC within = V(and)(V(le)(V(set1)(near), low), V(le)(high, V(set1)(far)));
    V(store)(met->low[0], V(max)(low, s->begin));
    V(store)(met->low[1], V(max)(low, s->begin));
    V(store)(met->high, high);
    met->child = node->child;
    met->tested = (uint32_t)(__builtin_popcount(leaves) + __builtin_popcount(wings | flat));
    met->first = leaves & ~(uint32_t)V(mask)(face.away);
    met->second = flat & ~(uint32_t)V(mask)(face.away_other);
    uint32_t inside = leaves & (uint32_t)V(mask)(V(and)(face.inside, within));
    met->sure = inside & (flat | (uint32_t)V(mask)(face.near_diagonal));
    if (!wings) return;
    VEC t2 = V(mul)(V(neg)(V(add)(s->at[0], V(set1)(1))), s->inverse[0]), dt2 = V(mul)(V(abs)(s->inverse[0]), band);
    NAME(UbvhFace) other = NAME(ubvh_face)(t2, dt2, s->at[1], s->rate[1], s->at[2], s->rate[2], band);
    VEC low2 = V(sub)(t2, dt2), high2 = V(add)(t2, dt2);
    within = V(and)(V(le)(V(set1)(near), low2), V(le)(high2, V(set1)(far)));
    uint32_t sure = wings & (uint32_t)V(mask)(V(and)(V(and)(other.inside, other.near_diagonal), within));
    V(store)(met->low[1], V(blend)(V(chosen)(node->child, 1), V(max)(low2, s->begin), V(max)(low, s->begin)));
    _Alignas(32) float ends[8];
    V(store)(ends, high2);
    for (uint32_t rest = sure; rest; rest &= rest - 1) { /* sure by both: the nearer */
        int i = __builtin_ctz(rest);
        if (!(met->sure >> i & 1) || ends[i] < met->high[i]) met->high[i] = ends[i];
    }
    met->sure |= sure;
    met->second |= wings & ~(uint32_t)V(mask)(other.away);
}

/* The children whose boxes a frustum may meet before `far`. */
INLINE uint32_t NAME(ubvh_cone)(const UbvhFrustum *f, const NODE *node, float far, VEC *begin)
{
    VEC in = V(set1)(f->near), out = V(set1)(far), zero = V(set1)(0), minus = V(set1)(-0.0f), infinite = V(set1)(INFINITY);
    VEC T = V(set1)(f->tan_alpha), x0 = V(set1)(f->x0);
    for (int k = 0; k < 3; k++) {
        const float *n = node->slab + 4 * k * WIDE;
        VEC at = NAME(ubvh_dot)(n, f->origin, V(neg)(V_LOAD(n + 3 * WIDE))), rate = NAME(ubvh_dot)(n, f->axis[2], zero);
        VEC x = NAME(ubvh_dot)(n, f->axis[0], zero), y = NAME(ubvh_dot)(n, f->axis[1], zero);
        VEC s = V(sqrt)(V(madd)(x, x, V(mul)(y, y))), down = V(and)(rate, minus);
        VEC half = V(madd)(s, x0, NAME(ubvh_half)(n, f->loose)), opening = V(mul)(s, T);
        at = V(xor)(at, down); /* as if it ran up the slab */
        rate = V(abs)(rate);
        VEC first = V(div)(V(neg)(V(add)(half, at)), V(add)(rate, opening)), lean = V(sub)(rate, opening);
        VEC last = V(div)(V(sub)(half, at), lean), below = V(lt)(lean, zero); /* it opens wider than it leans */
        in = V(max)(V(blend)(below, last, V(neg)(infinite)), V(max)(first, in));
        out = V(min)(V(blend)(below, infinite, last), out);
    }
    *begin = in;
    return (uint32_t)V(mask)(V(le)(in, out)) & NAME(ubvh_children)(node);
}

/* Of a ray or a frustum. */
INLINE uint32_t NAME(ubvh_meets)(const UbvhFrustum *f, const NODE *node, float far, VEC *begin)
{
    if (!f->ray) return NAME(ubvh_cone)(f, node, far, begin);
    NAME(UbvhSlabs) s;
    uint32_t hit = NAME(ubvh_ray)(f, node, far, &s);
    *begin = s.begin;
    return hit;
}

typedef struct {
    uint32_t child;
    float z;
    uint32_t inside;                /* all of it is surely in the frustum; cones only */
} NAME(UbvhWaiting);

/* A node is some cache lines, wanted soon. */
INLINE void NAME(ubvh_fetch)(const Ubvh *tree, const NODE *nodes, uint32_t child)
{
    if (child & UBVH_LEAF) return;
    bool along = child & UBVH_ALONG;
    const char *node = along ? (const char *)&tree->along[child & ~UBVH_ALONG] : (const char *)&nodes[child];
    for (size_t i = 0; i < (along ? sizeof *tree->along : sizeof *nodes); i += 64) __builtin_prefetch(node + i);
}

/* Puts the children in `hit` onto the stack, the farthest first, but the nearest, which is returned. */
INLINE NAME(UbvhWaiting) NAME(ubvh_push)(const Ubvh *tree, const NODE *nodes, const uint32_t *child, uint32_t hit, uint32_t inside,
                                         const float z[8], NAME(UbvhWaiting) *stack, int *top)
{
    int i = __builtin_ctz(hit), bottom = *top;
    NAME(UbvhWaiting) next = {child[i], z[i], inside >> i & 1};
    while (hit &= hit - 1) {
        i = __builtin_ctz(hit);
        NAME(UbvhWaiting) other = {child[i], z[i], inside >> i & 1};
        if (other.z < next.z) {
            NAME(UbvhWaiting) nearer = other;
            other = next;
            next = nearer;
        }
        NAME(ubvh_fetch)(tree, nodes, other.child);
        int j = (*top)++;
        for (; j > bottom && stack[j - 1].z < other.z; j--) stack[j] = stack[j - 1];
        stack[j] = other;
    }
    return next;
}

/* Algorithm 1. */
INLINE void NAME(ubvh_walk_ray)(const Ubvh *tree, const NODE *nodes, const UbvhFrustum *f, float inner_near, float inner_far,
                                UbvhVisit visit_met, LeafVisit visit_block, void *context, uint64_t *tested)
{
    NAME(UbvhWaiting) stack[UBVH_STACK], next = {tree->root, -INFINITY, 0};
    const Bvh8Slabs slabs = bvh8_slabs(f->lanes);
    int top = 0;
    float far = f->far;
    for (;;) {
        _Alignas(32) float z[8];
        uint32_t hit = 0;
        if (next.child & UBVH_LEAF) {
            far = visit_block(context, (next.child & UBVH_PLACE) / 8, false, far);
            if (far == -INFINITY) return;
        } else if (next.child & UBVH_ALONG) {
            const UbvhAlong *node = &tree->along[next.child & ~UBVH_ALONG];
            f8 begin;
            hit = bvh8_meets(&slabs, &node->boxes, far, &begin);
            ++*tested;
            if (hit) {
                f8_store(z, begin);
                next = NAME(ubvh_push)(tree, nodes, node->child, hit, 0, z, stack, &top);
                if (next.z <= far) continue;
            }
        } else {
            const NODE *node = &nodes[next.child];
            NAME(UbvhSlabs) s;
            hit = NAME(ubvh_ray)(f, node, far, &s);
            uint32_t leaves = tree->unified ? hit & (uint32_t)V(mask)(V(chosen)(node->child, 0)) : 0;
            ++*tested;
            if (leaves) {
                UbvhMet met;
                NAME(ubvh_meet)(f, node, &s, leaves, inner_near, far < inner_far ? far : inner_far, &met);
                far = visit_met(context, &met, far);
                if (far == -INFINITY) return;
                hit &= ~leaves;
            }
            if (hit) {
                V(store)(z, s.begin);
                next = NAME(ubvh_push)(tree, nodes, node->child, hit, 0, z, stack, &top);
                if (next.z <= far) continue;
            }
        }
        do {
            if (top == 0) return;
            next = stack[--top];
        } while (next.z > far);
    }
}

/* The blocks of a node's entries `leaves`, a bit for each of the first 32 from the block of the first entry on; *block is that one. */
INLINE uint32_t NAME(ubvh_blocks)(const NODE *node, uint32_t leaves, uint32_t *block)
{
    uint32_t blocks = 0;
    *block = (node->child[0] & UBVH_PLACE) / 8;
    for (; leaves; leaves &= leaves - 1) {
        uint32_t child = node->child[__builtin_ctz(leaves)], place = child & UBVH_PLACE;
        blocks |= 1u << (place / 8 - *block);
        if (child & (UBVH_WINGS | UBVH_FLAT)) blocks |= 1u << ((place + 1) / 8 - *block);
    }
    return blocks;
}

/* All children of a node that the frustum contains, unasked. */
INLINE uint32_t NAME(ubvh_all_children)(const Ubvh *tree, const NODE *nodes, NAME(UbvhWaiting) next, float z[8])
{
    f8_store(z, f8_set1(next.z));
    if (!(next.child & UBVH_ALONG)) return NAME(ubvh_children)(&nodes[next.child]);
    const KellerBox8 *boxes = &tree->along[next.child & ~UBVH_ALONG].boxes;
    return (uint32_t)f8_mask(f8_le(f8_load(boxes->lower[0]), f8_load(boxes->upper[0])));
}

/* The children of a node that a frustum meets before `far`, and from where on. */
INLINE uint32_t NAME(ubvh_met_children)(const Ubvh *tree, const NODE *nodes, const UbvhFrustum *f, uint32_t number, float far,
                                        float z[8])
{
    if (number & UBVH_ALONG) {
        const UbvhAlong *node = &tree->along[number & ~UBVH_ALONG];
        if (!f->thin) return keller_cone_meets_box8(f->lanes, &node->boxes, z);
        const Bvh8Slabs slabs = bvh8_slabs(f->lanes);
        f8 begin;
        uint32_t hit = bvh8_meets(&slabs, &node->boxes, far, &begin);
        f8_store(z, begin);
        return hit;
    }
    VEC begin;
    uint32_t hit = NAME(ubvh_meets)(f, &nodes[number], far, &begin);
    V(store)(z, begin);
    return hit;
}

/* Visits what is left of a node's entries: blocks of triangles first; what is left of the others is returned. */
INLINE uint32_t NAME(ubvh_visit_leaves)(const Ubvh *tree, const NODE *node, uint32_t hit, bool inside, LeafVisit visit, void *context,
                                        float *far)
{
    uint32_t block, leaves = tree->unified ? hit & (uint32_t)V(mask)(V(chosen)(node->child, 0)) : 0;
    if (!leaves) return hit;
    for (uint32_t blocks = NAME(ubvh_blocks)(node, leaves, &block); blocks && *far != -INFINITY; blocks &= blocks - 1)
        *far = visit(context, block + (uint32_t)__builtin_ctz(blocks), inside, *far);
    return hit & ~leaves;
}

/* TreeKind's walk. */
INLINE void NAME(ubvh_walk)(const Ubvh *tree, const NODE *nodes, const UbvhFrustum *f, bool contained, LeafVisit visit, void *context,
                            uint64_t *tested)
{
    NAME(UbvhWaiting) stack[UBVH_STACK], next = {tree->root, -INFINITY, 0};
    int top = 0;
    float far = f->far;
    for (;;) {
        if (next.child & UBVH_LEAF) {
            far = visit(context, (next.child & UBVH_PLACE) / 8, next.inside, far);
        } else {
            _Alignas(32) float z[8];
            bool along = next.child & UBVH_ALONG;
            const uint32_t *child = along ? tree->along[next.child & ~UBVH_ALONG].child : nodes[next.child].child;
            uint32_t hit = next.inside ? NAME(ubvh_all_children)(tree, nodes, next, z)
                                       : NAME(ubvh_met_children)(tree, nodes, f, next.child, far, z);
            uint32_t inside = next.inside ? hit : 0;
            *tested += !next.inside;
            if (along && contained && hit && !inside)
                inside = hit & keller_cone_contains_box8(f->lanes, &tree->along[next.child & ~UBVH_ALONG].boxes);
            if (!along && hit) hit = NAME(ubvh_visit_leaves)(tree, &nodes[next.child], hit, next.inside, visit, context, &far);
            if (hit && far != -INFINITY) {
                next = NAME(ubvh_push)(tree, nodes, child, hit, inside, z, stack, &top);
                if (next.z <= far) continue;
            }
        }
        if (far == -INFINITY) return;
        do {
            if (top == 0) return;
            next = stack[--top];
        } while (next.z > far);
    }
}

/* TreeKind's open. */
INLINE uint32_t NAME(ubvh_open)(const Ubvh *tree, const NODE *nodes, uint32_t number, const UbvhFrustum *f, TreeChild child[8])
{
    _Alignas(32) float z[8];
    const uint32_t *children = number & UBVH_ALONG ? tree->along[number & ~UBVH_ALONG].child : nodes[number].child;
    uint32_t n = 0, hit = NAME(ubvh_met_children)(tree, nodes, f, number, f->far, z);
    for (; hit; hit &= hit - 1) {
        int i = __builtin_ctz(hit);
        uint32_t c = children[i], place = c & UBVH_PLACE, end = place / 8;
        if (!(c & UBVH_LEAF)) {
            child[n++] = (TreeChild){z[i], c};
            continue;
        }
        if (c & (UBVH_WINGS | UBVH_FLAT)) end = (place + 1) / 8;
        for (uint32_t block = place / 8; block <= end; block++) { /* entries share blocks: the nearest tells for all */
            uint32_t j = 0;
            while (j < n && child[j].child != (TREE_LEAF | block)) j++;
            if (j == n) child[n++] = (TreeChild){z[i], TREE_LEAF | block};
            else if (z[i] < child[j].distance) child[j].distance = z[i];
        }
    }
    return n;
}

#undef JOIN_
#undef JOIN
#undef NAME
#undef VEC
#undef NODE
#undef V
#undef V_LOAD
#undef EQUAL
#undef INLINE
