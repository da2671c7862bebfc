/* Cells of a map that the beams of a sequence reach. */
#include <math.h>
#include <stdlib.h>

#include "path/search.h"
#include "path/solve.h"

enum {
    FEW = 128,                  /* cells, about: to look for what hides so many would take longer than to look at each */
    MANY = 4                    /* times as many are not looked at before what may hide some of them is */
};

static const size_t CHUNK = 64; /* candidates between two looks at how many the threads have together */

static uint32_t few_of(const TreeLimits *l) { return l->split_over ? 1 : FEW; }

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
static bool leads_to(Search *s, uint32_t count, const KellerStep *steps, KellerVec3 cell, uint32_t *blocker)
{
    const TreeLimits *l = s->limits;
    const uint32_t left = l->interactions - count;
    KellerPath path;
    Crossings crossings;
    bool boundary = false;
    crossings.most = l->transmissions < left ? l->transmissions : left;
    crossings.count = 0;
    crossings.blocker = blocker;
    s->work.solved++;
    static const uint32_t none[2] = {KELLER_NONE, KELLER_NONE};
    return path_solve_sequence(l->scene, l->accel, s->end, cell, none, count, steps, false, &path, &crossings, &boundary, &s->work.accel);
}

static void add_cells(Search *s, const Beam *beam, const BundleTest *test, const Footprint *f)
{
    const TreeLimits *l = s->limits;
    StepCode codes[KELLER_MAX_BENDS];
    KellerStep steps[KELLER_MAX_BENDS];
    uint32_t count = trie_steps(&s->trie, beam->node, codes), blocker[KELLER_MAX_BENDS + 1];
    for (uint32_t i = 0; i < count; i++)
        steps[i] = (KellerStep){code_is_wedge(codes[i]) ? KELLER_DIFFRACTION : KELLER_REFLECTION, code_id(codes[i])};
    for (uint32_t i = 0; i <= count; i++) blocker[i] = KELLER_NONE;
    Sieve sieve;
    bool useful;
    bool edge = beam->bundle.source_count > 1;
    if (!sieve_make(&sieve, l->scene, l->boxes, s->end, count, steps, edge ? beam->piece : NULL, &useful)) return;
    for (CellRun run = {0}; !s->failed && footprint_next(l->cells, f, &run);) {
        for (uint32_t x = run.from; x < run.to; x++) {
            double t = 0;
            KellerVec3 p = cell_position(l->cells, x, run.row);
            if (!footprint_has(l->cells, f, p)) continue;
            if (useful && (!sieve_passes(&sieve, p, &t) || (edge && !on_ray_from(beam, test, t, p)))) continue;
            if (!leads_to(s, count, steps, p, blocker) || add(s, beam->node, run.row * l->cells->nx + x)) continue;
            s->failed = true;
            break;
        }
    }
}

/* The two halves of a beam: of its window, or of the piece of edge that it comes from where that is longer than the window is wide at
 * `distance` (m). None where both are shorter than a quarter of the cells' spacing: what hides so little is found cell by cell. */
static int sharper(const Beam *beam, double distance, const CellGrid *cells, Beam half[2])
{
    const KellerVec3 *v = beam->bundle.source;
    KellerVec3 across;
    const double wide = window_width(&beam->bundle.window, &across) * distance;
    const double piece = beam->bundle.source_count > 1 ? v3_distance(v[0], v[1]) : 0;
    if (!(greater(wide, piece) > 0.25 * cells->step)) return 0;
    if (wide > piece) return beam_halves(beam, half);
    beam_pieces(beam, half);
    return 2;
}

void search_mirrored(Search *s, const Beam *before, uint32_t face, uint32_t node)
{
    const TreeLimits *l = s->limits;
    const KellerFace *f = &l->scene->faces[face];
    Beam after = *before, half[2];
    after.node = node;
    after.mirror = face;
    after.wedge = KELLER_NONE;
    bundle_mirror(&after.bundle, f);
    BundleTest test = bundle_test(&after.bundle, l->scene);
    Footprint foot;
    int halves = 0;
    if (s->failed || !footprint_of(l->cells, &test, f, beam_front(&after, l->scene), &foot)) return;
    if (footprint_cells(l->cells, &foot, few_of(l) + 1) > few_of(l)) {
        WayTo way = way_to_face(s, before, face);
        if (way.hidden) return;
        if (way.met) halves = sharper(before, way.length, l->cells, half);
    }
    for (int i = 0; i < halves; i++)
        if (beam_narrow(&half[i], l->scene, face)) search_mirrored(s, &half[i], face, node);
    if (halves == 0) search_cells(s, &after);
}

void search_cells(Search *s, const Beam *beam)
{
    const TreeLimits *l = s->limits;
    const KellerFace *mirror = beam->mirror != KELLER_NONE ? &l->scene->faces[beam->mirror] : NULL;
    const uint32_t left = l->interactions - pattern_length(s->trie.nodes[beam->node].pattern);
    if (s->failed || beam->passed > (l->transmissions < left ? l->transmissions : left)) return;
    BundleTest test = bundle_test(&beam->bundle, l->scene);
    Footprint f;
    Beam half[2];
    Query q;
    int halves = 0;
    if (!footprint_of(l->cells, &test, mirror, beam_front(beam, l->scene), &f)) return;
    const uint32_t many = MANY * few_of(l), cells = footprint_cells(l->cells, &f, many + 1);
    if (cells > few_of(l)) {
        if (!query_of(&q, s, beam, 0)) {
            halves = beam_halves(beam, half);
        } else {
            KellerRange at = footprint_extent(l->cells, &f, q.cone.origin, q.cone.directrix);
            KellerVec3 b = footprint_middle(l->cells, &f);
            bool met;
            if (query_hides(&q, b, at.near, KELLER_NONE, &met)) {
                query_free(&q);
                return;
            }
            if (met || cells > many) halves = sharper(beam, at.far - q.start_near, l->cells, half);
            query_free(&q);
        }
    }
    for (int i = 0; i < halves; i++) search_cells(s, &half[i]);
    if (halves == 0) add_cells(s, beam, &test, &f);
}
