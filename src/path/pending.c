/* What a search puts off: the many small beams of a sequence, or of an edge, are followed later as one. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "path/lit.h"
#include "path/search.h"

enum { PENDING_MOST = 1 << 17 };

static bool add_slopes(const Window *w, KellerVec3 along, Slopes *slopes)
{
    KellerVec3 axis[3];
    window_axes(along, v3_perpendicular(along), axis);
    return window_slopes(w, axis, slopes);
}

static Beam beam_of(const Pending *p)
{
    Beam b = {.node = p->node, .mirror = p->mirror, .wedge = KELLER_NONE, .passed = p->passed};
    KellerVec3 axis[3];
    window_axes(p->along, v3_perpendicular(p->along), axis);
    b.bundle.source_count = p->source_count;
    memcpy(b.bundle.source, p->source, sizeof p->source);
    b.bundle.window = window_of(axis, &p->slopes);
    return b;
}

static void follow_beam(Search *s, const Pending *p)
{
    Beam b = beam_of(p);
    if (!s->failed && bundle_narrow(&b.bundle, s->limits->scene, p->mirror)) search_next(s, &b);
}

static void follow_fan(Search *s, const PendingFan *f)
{
    StepCode codes[KELLER_MAX_BENDS];
    if (s->failed) return;
    const uint32_t faces = trie_steps(&s->trie, f->node, codes) - 1;
    double from = f->from, to = f->to;
    if (lit_way(s->limits, s->end, faces, codes, f->wedge, &from, &to, &s->work.accel))
        search_fan(s, f->node, f->wedge, from, to, 1, &f->source, f->passed);
}

/* So many of what was put off are done. */
static void followed(const Search *s, uint32_t done, uint32_t all)
{
    if (s->reports) advance(s->limits->advance, SEARCH_SPHERE + (1 - SEARCH_SPHERE) * done / all);
}

void pending_follow(Search *s)
{
    uint32_t count = s->pending_count;
    s->pending_count = 0;
    for (uint32_t i = 0; i < count; i++) {
        const Pending p = s->pending[i];
        follow_beam(s, &p);
        if (s->last) followed(s, i + 1, count + s->fan_count);
    }
    uint32_t fans = s->fan_count;
    s->fan_count = 0;
    for (uint32_t i = 0; i < fans; i++) {
        const PendingFan f = s->fan[i];
        follow_fan(s, &f);
        if (s->last) followed(s, count + i + 1, count + fans);
    }
}

/* Where the node has its place among what is put off, which may be another's; NULL, and the search failed, without memory. */
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

void put_off_fan(Search *s, const PendingFan *f)
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
    if (s->fan_count == PENDING_MOST && !s->gathers) pending_follow(s);
    s->fan = search_room(s, s->fan, s->fan_count, &s->fan_room, sizeof *s->fan);
    at = place_of(s, f->node); /* following may have moved it */
    if (s->failed) return;
    *at = s->fan_count;
    s->fan[s->fan_count++] = *f;
}

bool put_off_beam(Search *s, const Beam *b)
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
    if (s->pending_count == PENDING_MOST && !s->gathers) pending_follow(s);
    s->pending = search_room(s, s->pending, s->pending_count, &s->pending_room, sizeof *s->pending);
    at = place_of(s, b->node);
    if (s->failed) return false;
    *at = s->pending_count;
    s->pending[s->pending_count++] = fresh;
    return true;
}

/* ---- sharing it among threads ----------------------------------------------------------------------------------------- */

/* Hands what the thread put off to all; a beam that cannot be one with another's of its sequence stays. */
static bool hand_over(Search *s, Search *all)
{
    uint32_t *map = s->failed || all->failed ? NULL : trie_merge(&all->trie, &s->trie), kept = 0;
    if (!map) return false;
    for (uint32_t i = 0; i < s->pending_count; i++) {
        Beam b = beam_of(&s->pending[i]);
        b.node = map[b.node];
        if (!put_off_beam(all, &b)) s->pending[kept++] = s->pending[i];
    }
    s->pending_count = kept;
    for (uint32_t i = 0; i < s->fan_count; i++) {
        PendingFan f = s->fan[i];
        f.node = map[f.node];
        put_off_fan(all, &f);
    }
    s->fan_count = 0;
    free(map);
    return !all->failed;
}

/* The thread's own node for the sequence of a shared one. */
static uint32_t own_node(Search *s, const Trie *shared, uint32_t node)
{
    StepCode codes[KELLER_MAX_BENDS];
    const uint32_t count = trie_steps(shared, node, codes);
    uint32_t own = 0;
    for (uint32_t i = 0; i < count && own != KELLER_NONE; i++) own = trie_child(&s->trie, own, codes[i]);
    s->failed = s->failed || own == KELLER_NONE;
    return own;
}

void pending_share(Search *s, Search *all)
{
    for (int fans = 0; fans < 2; fans++) {
#pragma omp critical(keller_pending)
        all->failed = !hand_over(s, all) || all->failed;
#pragma omp barrier
        if (!fans) pending_follow(s); /* what stayed */
        const uint32_t count = fans ? all->fan_count : all->pending_count;
#pragma omp for schedule(dynamic, 1)
        for (uint32_t i = 0; i < count; i++) {
            if (s->failed || all->failed) continue;
            if (fans) {
                PendingFan f = all->fan[i];
                f.node = own_node(s, &all->trie, f.node);
                follow_fan(s, &f);
            } else {
                Pending p = all->pending[i];
                p.node = own_node(s, &all->trie, p.node);
                follow_beam(s, &p);
            }
            followed(s, (fans ? all->pending_count : 0) + i + 1, all->pending_count + all->fan_count);
        }
    }
}
