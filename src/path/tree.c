#include "path/search.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "path/arrival.h"

enum {
    MUCH = 16,              /* a cone that meets more than this many faces and wedges is split, where each costs cones */
    MUCH_FIRST = 12,        /* from the end itself, where everything else multiplies on what is found, */
    MUCH_LAST = 400,        /* where each is only a candidate, */
    MUCH_FAN = 40,          /* but straight from an edge, wherever it leads: such beams overlap */
    FINER = 8,              /* the first cones, and those behind which others follow, are split this much finer than the aperture, */
    PIECES = 2,             /* times that the piece of edge of a mirrored beam is halved: windows multiply with it */
    FEW = 2000,             /* unless the scene has fewer faces and wedges than this: nothing is worth splitting then */
    START = 4               /* parallel searches begin with 6 x START x START cones */
};
static const double NEARBY = 0.025;         /* where most of what is seen is, in diagonals of the scene */

/* The beam that a face reflects, in front of it and behind; false: none. */
static bool reflected(const Query *q, const HitFace *hit, const KellerScene *scene, Beam *before, Beam *b)
{
    const KellerFace *f = &scene->faces[hit->face];
    *b = *q->beam;
    if (!beam_narrow(b, scene, hit->face)) return false;
    KellerRange at;
    double steep;
    if (bundle_crossing(&b->bundle, f, q->cone.origin, q->cone.directrix, &at, &steep) &&
        at.near > q->far + 4 * scene->contact / steep)
        return false;
    b->passed += slabs_before(&q->slabs, hit->near);
    *before = *b;
    b->mirror = hit->face;
    b->wedge = KELLER_NONE;
    b->whole = false;
    bundle_mirror(&b->bundle, f);
    return true;
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

int beam_halves(const Beam *beam, Beam half[2])
{
    Window window[2];
    int n = window_halves(&beam->bundle.window, window);
    for (int i = 0; i < n; i++) {
        half[i] = *beam;
        half[i].bundle.window = window[i];
    }
    return n;
}

void beam_pieces(const Beam *beam, Beam half[2])
{
    half[0] = half[1] = *beam;
    half[0].halved = half[1].halved = beam->halved + 1;
    half[0].bundle.source[1] = half[1].bundle.source[0] = v3_scale(v3_add(beam->bundle.source[0], beam->bundle.source[1]), 0.5);
    half[0].piece[1] = half[1].piece[0] = 0.5 * (beam->piece[0] + beam->piece[1]);
}

/* How wide the sources of a beam from an edge that was mirrored look from near things, as an angle: its window hides less than they
 * do. (Before the mirror the pieces that Keller's law asks for are short enough.) */
static double sources_width(const Search *s, const Beam *beam)
{
    const Bundle *b = &beam->bundle;
    const KellerScene *scene = s->limits->scene;
    if (b->source_count < 2 || beam->wedge != KELLER_NONE || beam->halved == PIECES) return 0;
    return v3_distance(b->source[0], b->source[1]) / (NEARBY * v3_distance(scene->lower, scene->upper));
}

static void split(Search *s, const Beam *beam)
{
    Beam half[2];
    KellerVec3 across;
    int n = 2;
    if (sources_width(s, beam) > window_width(&beam->bundle.window, &across)) beam_pieces(beam, half);
    else n = beam_halves(beam, half);
    if (n == 0) { /* as it is, then; if it was too wide for a cone, there is no way on */
        s->failed = s->failed || beam->whole;
        half[n] = *beam;
        half[n++].whole = true;
    }
    for (int i = 0; i < n; i++) {
        half[i].share = beam->share / n;
        search_next(s, &half[i]);
    }
}

/* A beam from the end is done. */
static void looked_around(Search *s, double share)
{
    double all;
#pragma omp atomic capture
    all = *s->looked += share;
    if (s->reports) advance(s->limits->advance, SEARCH_SPHERE * all);
}

/* Can rays of a beam from an edge reach the piece of another from a to b by Keller's law? */
static bool led_to(const KellerScene *scene, const Beam *beam, KellerVec3 a, KellerVec3 b)
{
    const double z[2] = {beam->z[0] - beam->piece[0], beam->z[1] - beam->piece[0]};
    return edge_leads_to(scene, beam->bundle.source, z, beam->rho, a, b);
}

/* The beams that faces reflect, and those that edges send out. */
static void go_on(Search *s, const Query *q, uint8_t use, Pattern pattern)
{
    const TreeLimits *l = s->limits;
    const uint8_t after_face = l->plan->of[pattern_and(pattern, false)], after_wedge = l->plan->of[pattern_and(pattern, true)];
    const bool face_goes_on = after_face & (PLAN_FACE | PLAN_WEDGE), wedge_goes_on = after_wedge & (PLAN_FACE | PLAN_WEDGE);
    const bool edge = q->beam->bundle.source_count > 1;
    /* pieces of an edge are different sources */
    const bool put_offs = !(after_face & PLAN_BEYOND) && pattern_wedges(pattern) == 0 && pattern_length(pattern) > 0;
    /* where little follows from a point, to follow it costs less than to ask; a map is asked where its cells are */
    const bool asks = (edge || after_face & PLAN_BEYOND) && (!l->cells || face_goes_on);
    for (uint32_t i = 0; i < q->faces && use & PLAN_FACE && !s->failed; i++) {
        const uint32_t face = q->face[i].face;
        const StepCode code = code_face(face);
        Beam before, child;
        if (!l->cells && !face_goes_on && trie_find(&s->trie, q->beam->node, code) != KELLER_NONE) continue; /* no more to find */
        if (q->face[i].near > q->far || !reflected(q, &q->face[i], l->scene, &before, &child)) continue;
        if (asks && way_to_face(s, &before, face).hidden) continue;
        child.node = trie_child(&s->trie, q->beam->node, code);
        if (child.node == KELLER_NONE) {
            s->failed = true;
            break;
        }
        if (l->cells && after_face & PLAN_WANT) search_mirrored(s, &before, face, child.node);
        if (face_goes_on && (!put_offs || !put_off_beam(s, &child))) search_next(s, &child);
    }
    for (uint32_t i = 0; i < q->wedges && !s->failed; i++) {
        Piece piece;
        const KellerWedge *w = &l->scene->wedges[q->wedge[i]];
        const StepCode code = code_wedge(q->wedge[i]);
        if (!query_piece(q, q->wedge[i], &piece)) continue;
        const double pad = 4 * l->scene->contact, from = (piece.from - pad) / w->length, to = (piece.to + pad) / w->length;
        uint32_t node = l->cells || wedge_goes_on ? KELLER_NONE : trie_find(&s->trie, q->beam->node, code);
        if (node != KELLER_NONE && trie_is_lit(&s->trie, node, from, to)) continue;
        const KellerVec3 a = v3_madd(w->origin, w->direction, piece.from), b = v3_madd(w->origin, w->direction, piece.to);
        if (edge && (!led_to(l->scene, q->beam, a, b) || edge_hidden(s, q->beam, a, b))) continue;
        node = trie_child(&s->trie, q->beam->node, code);
        if (node == KELLER_NONE) {
            s->failed = true;
            break;
        }
        trie_light(&s->trie, node, from, to);
        if (wedge_goes_on || (l->cells && after_wedge & PLAN_WANT)) {
            const Bundle *in = &q->beam->bundle;
            PendingFan fan = {node, q->wedge[i], q->beam->passed + slabs_before(&q->slabs, piece.near), in->source[0],
                              piece.from, piece.to};
            if (in->source_count == 1) put_off_fan(s, &fan);
            else search_fan(s, node, fan.wedge, fan.from, fan.to, 2, in->source, fan.passed);
        }
    }
}

void search_beam(Search *s, const Beam *beam)
{
    const uint8_t use = s->limits->plan->of[s->trie.nodes[beam->node].pattern];
    if (s->limits->cells && use & PLAN_WANT) search_cells(s, beam);
    if (use & (PLAN_FACE | PLAN_WEDGE)) search_next(s, beam);
}

void search_next(Search *s, const Beam *beam)
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
    s->work.cones++;
    KellerVec3 across;
    double wide = window_width(&beam->bundle.window, &across);
    bool few = scene->face_count + scene->wedge_count < FEW, first = length == 0;
    bool fan = beam->bundle.source_count > 1 && beam->wedge != KELLER_NONE;
    q.much = few ? MUCH_LAST : first ? MUCH_FIRST : fan ? MUCH_FAN : use & PLAN_BEYOND ? MUCH : MUCH_LAST;
    if (l->split_over) q.much = l->split_over;
    double least = 2 * l->tan_aperture / ((first ? FINER : 1) * (use & PLAN_BEYOND ? FINER : 1));
    /* a window narrower than the sources look wide from most things parts nothing from anything */
    if (sources_width(s, beam) == 0) least = greater(least, q.cone.x0 / (NEARBY * v3_distance(scene->lower, scene->upper)));
    q.may_split = !beam->whole && greater(wide, sources_width(s, beam)) > least;
    bool targets_only = l->targets && length + 1 == l->target_length && !(use & PLAN_FACE);
    query_scene(&q, !targets_only, use & PLAN_WEDGE);
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
    search_next(s, &b);
}

static bool search_init(Search *s, const TreeLimits *limits, KellerVec3 end)
{
    const size_t faces = limits->scene->face_count + 1;
    *s = (Search){.limits = limits, .end = end, .stamp = calloc(faces, sizeof *s->stamp), .slot = malloc(faces * sizeof *s->slot)};
    return trie_init(&s->trie) && s->stamp && s->slot;
}

static void search_free(Search *s)
{
    free(s->pending);
    free(s->fan);
    free(s->place);
    free(s->stamp);
    free(s->slot);
    free(s->reached.item);
    trie_free(&s->trie);
}

static void add_work(TreeWork *to, const TreeWork *from)
{
    to->cones += from->cones;
    to->solved += from->solved;
    to->accel.nodes += from->accel.nodes;
    to->accel.triangles += from->accel.triangles;
}

/* Adds what one thread found to what all did. */
static bool gather(Search *s, Trie *trie, CellCandidates *candidates, TreeWork *work)
{
    add_work(work, &s->work);
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

/* The whole search by several threads. all: what they share; its trie then has all that they found. */
static void search_together(Search *all, uint32_t threads, CellCandidates *candidates, TreeWork *work)
{
    enum { WINDOWS = 6 * START * START };
    bool failed = false;
    all->gathers = true;
#pragma omp parallel num_threads((int)threads)
    {
        Search s;
        s.failed = !search_init(&s, all->limits, all->end);
        s.together = all->together;
        s.looked = all->looked;
        s.reports = omp_get_thread_num() == 0;
#pragma omp for schedule(dynamic, 1)
        for (int c = 0; c < WINDOWS; c++)
            if (!s.failed) search_side(&s, c / (START * START), c / START % START, c % START, START);
        pending_share(&s, all);
#pragma omp critical(keller_tree)
        failed = !gather(&s, &all->trie, candidates, work) || failed;
        search_free(&s);
    }
    all->failed = all->failed || failed;
}

/* By one thread. */
static void search_by_one(Search *s, CellCandidates *candidates, TreeWork *work)
{
    s->reports = true;
    for (int side = 0; side < 6 && !s->failed; side++) search_side(s, side, 0, 0, 1);
    s->last = true;
    pending_follow(s);
    add_work(work, &s->work);
    if (!candidates) return;
    *candidates = s->reached;
    candidates->full = s->full;
    s->reached = (CellCandidates){0};
}

KellerStatus tree_search(const TreeLimits *limits, KellerVec3 end, uint32_t threads, Trie *trie, CellCandidates *candidates,
                         TreeWork *work, KellerError *error)
{
    size_t together = 0;
    double looked = 0;
    Search s;
    if (candidates) *candidates = (CellCandidates){0};
    s.failed = !search_init(&s, limits, end);
    s.together = &together;
    s.looked = &looked;
    if (!s.failed && threads > 1) search_together(&s, threads, candidates, work);
    else if (!s.failed) search_by_one(&s, candidates, work);
    const bool failed = s.failed;
    if (!failed) {
        *trie = s.trie;
        s.trie = (Trie){0};
    }
    search_free(&s);
    if (!failed) return KELLER_OK;
    if (candidates) {
        free(candidates->item);
        *candidates = (CellCandidates){.full = candidates->full};
        if (candidates->full) return KELLER_OK;
    }
    return keller_error(error, KELLER_FAILED, TRIE_FULL);
}
