#include "path/search.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "path/lit.h"

enum {
    MUCH = 24,              /* a cone that meets more than this many faces and wedges is split, where each costs cones */
    MUCH_FIRST = 8,         /* from the end itself, where everything else multiplies on what is found, */
    MUCH_LAST = 400,        /* where each is only a candidate, */
    MUCH_FAN = 40,          /* and where it is, from an edge: such beams overlap */
    FINER = 8,              /* the first cones, and those behind which others follow, are split this much finer than the aperture, */
    FEW = 2000,             /* unless the scene has fewer faces and wedges than this: nothing is worth splitting then */
    PENDING_MOST = 1 << 17,
    START = 4               /* parallel searches begin with 6 x START x START cones */
};
static const double SPHERE = 0.2;           /* share of a search that looking around from the end is, about: the rest is what was put off */
static const double NEARBY = 0.025;         /* where most of what is seen is, in diagonals of the scene */

static void process(Search *s, const Beam *beam);

/* The beam that a face reflects, in front of it and behind; false: none. */
static bool reflected(const Query *q, const HitFace *hit, const KellerScene *scene, Beam *before, Beam *b)
{
    const KellerFace *f = &scene->faces[hit->face];
    *b = *q->beam;
    if (!bundle_narrow(&b->bundle, scene, hit->face)) return false;
    KellerRange at;
    double steep;
    if (bundle_crossing(&b->bundle, f, q->cone.origin, q->cone.directrix, &at, &steep) &&
        at.near > q->far + 4 * scene->contact / steep)
        return false;
    b->passed += slabs_before(&q->slabs, hit->near);
    *before = *b;
    b->mirror = hit->face;
    b->wedge = KELLER_NONE;
    bundle_mirror(&b->bundle, f);
    return true;
}

static void frame_of(KellerVec3 along, KellerVec3 axis[3])
{
    axis[2] = along;
    axis[0] = v3_perpendicular(along);
    axis[1] = v3_cross(axis[2], axis[0]);
}

/* Widens the slopes to hold those of the window; false if parts of it are not in front. */
static bool add_slopes(const Window *w, KellerVec3 along, Slopes *slopes)
{
    const double front = 0.2; /* cosine: of the widest frustum, and a little more */
    KellerVec3 axis[3];
    frame_of(along, axis);
    for (uint32_t i = 0; i < w->count; i++)
        if (!(v3_dot(w->corner[i], along) > front)) return false;
    for (uint32_t i = 0; i < w->count; i++)
        for (int k = 0; k < 2; k++) {
            double slope = v3_dot(w->corner[i], axis[k]) / v3_dot(w->corner[i], along), pad = BEAM_PAD * (1 + fabs(slope));
            slopes->low[k] = lesser(slopes->low[k], slope - pad);
            slopes->high[k] = greater(slopes->high[k], slope + pad);
        }
    return true;
}

/* So many of what was put off are done. */
static void followed(const Search *s, uint32_t done, uint32_t all)
{
    if (s->reports && s->last) advance(s->limits->advance, SPHERE + (1 - SPHERE) * done / all);
}

/* Follows the pending beams, then the pending fans, since those beams may add to them; fans add to neither. */
static void follow(Search *s)
{
    uint32_t count = s->pending_count;
    s->pending_count = 0;
    for (uint32_t i = 0; i < count && !s->failed; i++) {
        const Pending *p = &s->pending[i];
        Beam b = {.node = p->node, .mirror = p->mirror, .wedge = KELLER_NONE, .passed = p->passed};
        KellerVec3 axis[3];
        frame_of(p->along, axis);
        b.bundle.source_count = p->source_count;
        memcpy(b.bundle.source, p->source, sizeof p->source);
        b.bundle.window = window_of(axis, &p->slopes);
        if (bundle_narrow(&b.bundle, s->limits->scene, p->mirror)) process(s, &b);
        followed(s, i + 1, count + s->fan_count);
    }
    uint32_t fans = s->fan_count;
    s->fan_count = 0;
    for (uint32_t i = 0; i < fans && !s->failed; i++) {
        const PendingFan f = s->fan[i];
        search_fan(s, f.node, f.wedge, f.from, f.to, 1, &f.source, f.passed);
        followed(s, count + i + 1, count + fans);
    }
}

void *search_room(Search *s, void *array, uint32_t count, uint32_t *capacity, size_t size)
{
    if (count < *capacity) return array;
    uint32_t more = *capacity ? 2 * *capacity : 32;
    void *grown = realloc(array, more * size);
    s->failed = s->failed || !grown;
    if (!grown) return array;
    *capacity = more;
    return grown;
}

/* Where the node has its place among the pending ones, which may be another's; NULL, and the search failed, without memory. */
static uint32_t *place_of(Search *s, uint32_t node)
{
    if (s->place_capacity < s->trie.capacity) {
        uint32_t *grown = realloc(s->place, s->trie.capacity * sizeof *grown);
        s->failed = s->failed || !grown;
        if (!grown) return NULL;
        memset(grown + s->place_capacity, 0, (s->trie.capacity - s->place_capacity) * sizeof *grown);
        s->place = grown;
        s->place_capacity = s->trie.capacity;
    }
    return &s->place[node];
}

/* Puts the fan off, together with others of its sequence. */
static void put_off_fan(Search *s, const PendingFan *f)
{
    uint32_t *at = place_of(s, f->node);
    if (!at) return;
    if (*at < s->fan_count && s->fan[*at].node == f->node) {
        PendingFan *p = &s->fan[*at];
        p->from = lesser(p->from, f->from);
        p->to = greater(p->to, f->to);
        p->passed = f->passed < p->passed ? f->passed : p->passed;
        return;
    }
    if (s->fan_count == PENDING_MOST) follow(s);
    s->fan = search_room(s, s->fan, s->fan_count, &s->fan_room, sizeof *s->fan);
    at = place_of(s, f->node); /* following may have moved it */
    if (s->failed) return;
    *at = s->fan_count;
    s->fan[s->fan_count++] = *f;
}

/* Puts the beam off, together with others of its sequence; false if that cannot be. */
static bool put_off(Search *s, const Beam *b)
{
    uint32_t *at = place_of(s, b->node);
    if (!at) return false;
    if (*at < s->pending_count && s->pending[*at].node == b->node) {
        Pending *p = &s->pending[*at];
        Slopes both = p->slopes;
        if (!add_slopes(&b->bundle.window, p->along, &both)) return false;
        p->slopes = both;
        p->passed = b->passed < p->passed ? b->passed : p->passed;
        return true;
    }
    Pending fresh = {b->node, b->mirror, b->passed, b->bundle.source_count, {{0, 0, 0}}, window_middle(&b->bundle.window), SLOPES_NONE};
    memcpy(fresh.source, b->bundle.source, sizeof fresh.source);
    if (!add_slopes(&b->bundle.window, fresh.along, &fresh.slopes)) return false;
    if (s->pending_count == PENDING_MOST) follow(s);
    s->pending = search_room(s, s->pending, s->pending_count, &s->pending_room, sizeof *s->pending);
    at = place_of(s, b->node);
    if (s->failed) return false;
    *at = s->pending_count;
    s->pending[s->pending_count++] = fresh;
    return true;
}

int beam_halves(const Beam *beam, Beam half[2])
{
    KellerVec3 across = v3(0, 0, 0);
    window_width(&beam->bundle.window, &across);
    across = v3_unit(across); /* from corner to corner, both of one length: halfway between them it is perpendicular */
    int n = 0;
    for (int side = -1; side <= 1; side += 2) {
        half[n] = *beam;
        n += window_cut(&half[n].bundle.window, v3_scale(across, side));
    }
    return n;
}

static void split(Search *s, const Beam *beam)
{
    Beam half[2];
    int n = beam_halves(beam, half);
    for (int i = 0; i < n; i++) {
        half[i].share = beam->share / n;
        process(s, &half[i]);
    }
}

/* A beam from the end is done. */
static void looked_around(Search *s, double share)
{
    double all;
#pragma omp atomic capture
    all = *s->looked += share;
    if (s->reports) advance(s->limits->advance, SPHERE * all);
}

/* The beams that faces reflect, and those that edges send out. */
static void go_on(Search *s, const Query *q, uint8_t use, Pattern pattern)
{
    const TreeLimits *l = s->limits;
    const uint8_t after_face = l->plan->of[pattern_and(pattern, false)], after_wedge = l->plan->of[pattern_and(pattern, true)];
    /* pieces of an edge are different sources */
    const bool put_offs = !(after_face & PLAN_BEYOND) && pattern_wedges(pattern) == 0 && pattern_length(pattern) > 0;
    for (uint32_t i = 0; i < q->faces && use & PLAN_FACE && !s->failed; i++) {
        Beam before, child;
        if (q->face[i].near > q->far || !reflected(q, &q->face[i], l->scene, &before, &child)) continue;
        child.node = trie_child(&s->trie, q->beam->node, code_face(q->face[i].face));
        if (child.node == KELLER_NONE) {
            s->failed = true;
            break;
        }
        if (l->cells && after_face & PLAN_WANT) search_mirrored(s, &before, q->face[i].face, child.node);
        if (after_face & (PLAN_FACE | PLAN_WEDGE) && (!put_offs || !put_off(s, &child))) process(s, &child);
    }
    for (uint32_t i = 0; i < q->wedges && !s->failed; i++) {
        Piece piece;
        if (!query_piece(q, q->wedge[i], &piece)) continue;
        const bool goes_on = after_wedge & (PLAN_FACE | PLAN_WEDGE) || (l->cells && after_wedge & PLAN_WANT);
        if (goes_on && q->beam->bundle.source_count == 1 && !lit_part(l, q->beam->bundle.source[0], q->beam->mirror, q->wedge[i], &piece.from, &piece.to,
                                                           &s->work.accel))
            continue;
        uint32_t node = trie_child(&s->trie, q->beam->node, code_wedge(q->wedge[i]));
        if (node == KELLER_NONE) {
            s->failed = true;
            break;
        }
        const double whole = l->scene->wedges[q->wedge[i]].length, pad = 4 * l->scene->contact;
        trie_light(&s->trie, node, (piece.from - pad) / whole, (piece.to + pad) / whole);
        if (goes_on) {
            const Bundle *in = &q->beam->bundle;
            PendingFan fan = {node, q->wedge[i], q->beam->passed + slabs_before(&q->slabs, piece.near), in->source[0], piece.from, piece.to};
            if (in->source_count == 1) put_off_fan(s, &fan);
            else search_fan(s, node, fan.wedge, fan.from, fan.to, 2, in->source, fan.passed);
        }
    }
}

void search_beam(Search *s, const Beam *beam)
{
    const uint8_t use = s->limits->plan->of[s->trie.nodes[beam->node].pattern];
    if (s->limits->cells && use & PLAN_WANT) search_cells(s, beam);
    if (use & (PLAN_FACE | PLAN_WEDGE)) process(s, beam);
}

/* Looks for what follows the beam's sequence. */
static void process(Search *s, const Beam *beam)
{
    const TreeLimits *l = s->limits;
    const KellerScene *scene = l->scene;
    if (s->failed) return;
    const Pattern pattern = s->trie.nodes[beam->node].pattern;
    const uint8_t use = l->plan->of[pattern];
    const uint32_t length = pattern_length(pattern);
    uint32_t together = l->interactions - (length + 1); /* the next step is none of them */
    uint32_t slabs = l->transmissions < together ? l->transmissions : together;
    if (beam->passed > slabs) return;
    Query q;
    if (!query_of(&q, s, beam, slabs - beam->passed)) {
        split(s, beam);
        return;
    }
    KellerVec3 across;
    double wide = window_width(&beam->bundle.window, &across);
    bool few = scene->face_count + scene->wedge_count < FEW, first = length == 0;
    q.much = l->split_over ? l->split_over : few ? MUCH_LAST : first ? MUCH_FIRST : use & PLAN_BEYOND ? MUCH : beam->wedge != KELLER_NONE ? MUCH_FAN : MUCH_LAST;
    /* a window narrower than the sources look wide from most things parts nothing from anything */
    double least = 2 * l->tan_aperture / ((first ? FINER : 1) * (use & PLAN_BEYOND ? FINER : 1));
    q.may_split = wide > greater(least, q.cone.x0 / (NEARBY * v3_distance(scene->lower, scene->upper)));
    bool targets_only = l->targets && length + 1 == l->target_length && !(use & PLAN_FACE);
    if (!targets_only) query_faces(&q);
    if (use & PLAN_WEDGE) query_wedges(&q, targets_only ? l->targets : l->accel);
    if (q.too_much) {
        split(s, beam);
    } else {
        go_on(s, &q, use, pattern);
        if (first) looked_around(s, beam->share);
    }
    query_free(&q);
}

/* ---- the whole sphere ------------------------------------------------------------------------------------------------ */

static void search_side(Search *s, int side, int i, int j, int n)
{
    int k = side / 2;
    double sign = side % 2 ? -1 : 1;
    KellerVec3 unit[3] = {v3(1, 0, 0), v3(0, 1, 0), v3(0, 0, 1)};
    Beam b = {.node = 0, .mirror = KELLER_NONE, .wedge = KELLER_NONE, .share = 1 / (6.0 * n * n)};
    KellerVec3 axis[3] = {unit[(k + 1) % 3]};
    axis[2] = v3_scale(unit[k], sign);
    axis[1] = v3_cross(axis[2], axis[0]);
    const Slopes bounds = {{-1 + 2.0 * i / n - BEAM_PAD, -1 + 2.0 * j / n - BEAM_PAD},
                           {-1 + 2.0 * (i + 1) / n + BEAM_PAD, -1 + 2.0 * (j + 1) / n + BEAM_PAD}};
    b.bundle = (Bundle){1, {s->end}, window_of(axis, &bounds)};
    process(s, &b);
}

/* Adds what one thread found to what all did. */
static bool gather(Search *s, Trie *trie, CellCandidates *candidates, TreeWork *work)
{
    work->cones += s->work.cones;
    work->solved += s->work.solved;
    work->accel.nodes += s->work.accel.nodes;
    work->accel.triangles += s->work.accel.triangles;
    if (candidates) candidates->full = candidates->full || s->full;
    if (s->failed) return false;
    uint32_t *map = trie_merge(trie, &s->trie);
    if (!map) return false;
    size_t count = s->reached.count;
    if (count > 0) {
        CellCandidate *grown = realloc(candidates->item, (candidates->count + count) * sizeof *grown);
        if (grown) {
            for (size_t i = 0; i < count; i++)
                grown[candidates->count + i] = (CellCandidate){s->reached.item[i].cell, map[s->reached.item[i].node]};
            candidates->item = grown;
            candidates->room = candidates->count += count;
        }
        count = grown ? count : 0;
    }
    free(map);
    return count == s->reached.count;
}

KellerStatus tree_search(const TreeLimits *limits, KellerVec3 end, uint32_t threads, Trie *trie, CellCandidates *candidates,
                         TreeWork *work, KellerError *error)
{
    int n = threads > 1 ? START : 1, windows = 6 * n * n;
    bool failed = !trie_init(trie);
    size_t faces = limits->scene->face_count + 1, together = 0;
    double looked = 0;
    if (candidates) *candidates = (CellCandidates){0};
#pragma omp parallel num_threads((int)threads) if (threads > 1)
    {
        Search s = {.limits = limits, .end = end, .together = &together, .looked = &looked, .reports = omp_get_thread_num() == 0, .stamp = calloc(faces, sizeof(uint32_t)),
                    .slot = malloc(faces * sizeof(uint32_t))};
        s.failed = !s.stamp || !s.slot || !trie_init(&s.trie);
#pragma omp for schedule(dynamic, 1)
        for (int c = 0; c < windows; c++)
            if (!s.failed) search_side(&s, c / (n * n), c / n % n, c % n, n);
        s.last = true;
        follow(&s);
        free(s.pending);
        free(s.fan);
        free(s.place);
        free(s.stamp);
        free(s.slot);
#pragma omp critical(keller_tree)
        failed = !gather(&s, trie, candidates, work) || failed;
        trie_free(&s.trie);
        free(s.reached.item);
    }
    if (!failed) return KELLER_OK;
    trie_free(trie);
    if (candidates) {
        free(candidates->item);
        *candidates = (CellCandidates){.full = candidates->full};
        if (candidates->full) return KELLER_OK;
    }
    return keller_error(error, KELLER_FAILED, TRIE_FULL);
}
