/* Cells of a map that the beams of a sequence reach. */
#include <math.h>
#include <stdlib.h>

#include "path/search.h"
#include "path/solve.h"

enum {
    FEW_CELLS = 5000,             /* to look for what hides so many would take longer than to look at each */
    HIDING_MOST = 32            /* a beam that meets more faces than this is split at once */
};

static const size_t CHUNK = 64; /* candidates between two looks at how many the threads have together */

static bool add(Search *s, uint32_t node, uint32_t cell)
{
    CellCandidates *r = &s->reached;
    if (r->count == r->room) {
        size_t room = r->room ? r->room + r->room / 2 : CHUNK;
        CellCandidate *grown = realloc(r->item, room * sizeof *grown);
        if (!grown) return false;
        r->item = grown;
        r->room = room;
    }
    r->item[r->count++] = (CellCandidate){cell, node};
    if (r->count % CHUNK) return true;
    size_t together;
#pragma omp atomic capture
    together = *s->together += CHUNK;
    if (together <= s->limits->cells_most) return true;
    s->full = true;
    return false;
}

/* Is p on a ray of the beam from the place t (m) on its piece of edge? */
static bool on_ray_from(const Beam *beam, const BundleTest *test, double t, KellerVec3 p)
{
    const Bundle *b = &beam->bundle;
    double length = beam->piece[1] - beam->piece[0], share = length > 0 ? (t - beam->piece[0]) / length : 0;
    KellerVec3 v = v3_sub(p, v3_madd(b->source[0], v3_sub(b->source[1], b->source[0]), share));
    double slack = 2 * WINDOW_PAD * v3_norm(v) + 4 * test->rounding;
    for (uint32_t i = 0; i < b->window.count; i++)
        if (v3_dot(b->window.side[i], v) > slack) return false;
    return true;
}

/* Is there a path of these steps to the cell? They will be solved again, cell by cell, but most are none. */
static bool leads_to(Search *s, uint32_t count, const KellerStep *steps, KellerVec3 cell)
{
    const TreeLimits *l = s->limits;
    const uint32_t left = l->interactions - count;
    KellerPath path;
    Crossings crossings;
    bool boundary = false;
    crossings.most = l->transmissions < left ? l->transmissions : left;
    crossings.count = 0;
    s->work.solved++;
    static const uint32_t none[2] = {KELLER_NONE, KELLER_NONE};
    return path_solve_sequence(l->scene, l->accel, s->end, cell, none, count, steps, false, &path, &crossings, &boundary, &s->work.accel);
}

static void add_cells(Search *s, const Beam *beam, const BundleTest *test, const Footprint *f)
{
    const TreeLimits *l = s->limits;
    StepCode codes[KELLER_MAX_BENDS];
    KellerStep steps[KELLER_MAX_BENDS];
    uint32_t count = trie_steps(&s->trie, beam->node, codes);
    for (uint32_t i = 0; i < count; i++)
        steps[i] = (KellerStep){code_is_wedge(codes[i]) ? KELLER_DIFFRACTION : KELLER_REFLECTION, code_id(codes[i])};
    Sieve sieve;
    bool useful;
    bool edge = beam->bundle.source_count > 1;
    if (!sieve_make(&sieve, l->scene, l->boxes, s->end, count, steps, edge ? beam->piece : NULL, &useful)) return;
    for (uint32_t y = f->row; y < f->end && !s->failed; y++) {
        uint32_t from, to;
        footprint_row(l->cells, f, y, &from, &to);
        for (uint32_t x = from; x < to; x++) {
            double t = 0;
            KellerVec3 p = cell_position(l->cells, x, y);
            if (useful && (!sieve_passes(&sieve, p, &t) || (edge && !on_ray_from(beam, test, t, p)))) continue;
            if (!leads_to(s, count, steps, p) || add(s, beam->node, y * l->cells->nx + x)) continue;
            s->failed = true;
            break;
        }
    }
}

static void halve(Search *s, const Beam *beam)
{
    Beam half[2];
    int n = beam_halves(beam, half);
    for (int i = 0; i < n && !s->failed; i++) search_cells(s, &half[i]);
}

void search_cells(Search *s, const Beam *beam)
{
    const TreeLimits *l = s->limits;
    const KellerScene *scene = l->scene;
    const KellerFace *mirror = beam->mirror != KELLER_NONE ? &scene->faces[beam->mirror] : NULL;
    const uint32_t left = l->interactions - pattern_length(s->trie.nodes[beam->node].pattern);
    const uint32_t slabs = l->transmissions < left ? l->transmissions : left;
    if (s->failed || beam->passed > slabs) return;
    BundleTest test = bundle_test(&beam->bundle, scene);
    Footprint f;
    if (!footprint_of(l->cells, &test, mirror, beam_front(beam, scene), &f)) return;
    const uint32_t few = l->split_over ? 1 : FEW_CELLS;
    uint32_t cells = footprint_cells(l->cells, &f, few + 1);
    if (cells == 0) return;
    if (cells <= few) {
        add_cells(s, beam, &test, &f);
        return;
    }
    Query q;
    if (!query_of(&q, s, beam, slabs - beam->passed)) {
        halve(s, beam);
        return;
    }
    KellerVec3 across;
    KellerRange at = footprint_extent(l->cells, &f, q.cone.origin, q.cone.directrix);
    double touch = 4 * scene->contact, first = INFINITY, last = -INFINITY; /* the sources' heights */
    for (uint32_t j = 0; j < beam->bundle.source_count; j++) {
        first = lesser(first, beam->bundle.source[j].z);
        last = greater(last, beam->bundle.source[j].z);
    }
    if (first > l->cells->high) q.lowest = l->cells->low - touch;  /* what is behind the cells hides none of them */
    if (last < l->cells->low) q.highest = l->cells->high + touch;
    q.much = HIDING_MOST;
    q.may_split = window_width(&beam->bundle.window, &across) * at.far > q.cone.x0;
    q.far = at.far + touch;
    query_faces(&q);
    bool hidden = at.near > q.far, some = false;
    for (uint32_t i = 0; i < q.faces; i++) some = some || q.face[i].near <= q.far;
    double far = q.far;
    const bool split = !hidden && q.may_split && (some || q.too_much);
    KellerVec3 origin = q.cone.origin, directrix = q.cone.directrix;
    query_free(&q);
    if (s->failed || hidden) return;
    if (split) halve(s, beam);
    else if (!(far < at.far) || footprint_cut(l->cells, directrix, far + touch + v3_dot(directrix, origin), &f))
        add_cells(s, beam, &test, &f);
}
