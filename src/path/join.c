#include "path/join.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = KELLER_MAX_BENDS };

void plan_ends(uint32_t reflections, uint32_t diffractions, uint32_t bends, bool grids, TreeLimits *forward,
               TreeLimits *backward)
{
    memset(forward->want, 0, sizeof forward->want);
    memset(backward->want, 0, sizeof backward->want);
    uint32_t half = (bends + 1) / 2;
    for (uint32_t k = 1; k <= bends; k++)
        for (uint32_t w = 0; w <= k; w++) { /* place of the wedge, counted from the receiver */
            if (k - (w > 0) > reflections || (w > 0) > diffractions) continue;
            uint32_t m = k < half ? k : half; /* the common step, counted from the receiver */
            if (w > 0 && (w <= half || !grids)) m = w;
            backward->want[m][w == m ? m : 0] = true;
            forward->want[k + 1 - m][w > 0 ? k + 1 - w : 0] = true;
        }
}

KellerStatus ends_search(Ends *ends, const TreeLimits *limits, uint32_t count, const KellerVec3 *end, uint32_t threads,
                         TreeWork *work, KellerError *error)
{
    memset(ends, 0, sizeof *ends);
    ends->limits = *limits;
    KellerStatus status = tree_search(limits, count, end, threads, &ends->trie, work, error);
    for (uint32_t l = 1; l <= MOST && status == KELLER_OK; l++)
        for (uint32_t w = 0; w <= l && status == KELLER_OK; w++)
            if (limits->want[l][w] && !trie_list(&ends->trie, l, w, &ends->lists[l][w]))
                status = keller_error(error, KELLER_FAILED, TRIE_FULL);
    if (status != KELLER_OK) ends_free(ends);
    return status;
}

void ends_free(Ends *ends)
{
    for (uint32_t l = 0; l <= MOST; l++)
        for (uint32_t w = 0; w <= MOST; w++) free(ends->lists[l][w].nodes);
    trie_free(&ends->trie);
    memset(ends, 0, sizeof *ends);
}

/* Sequences of one end with one length and place of the wedge. */
typedef struct {
    const Trie *trie;
    const TrieList *list;
    uint32_t length;
} Side;

static StepCode last_code(const Side *s, uint32_t i) { return s->trie->nodes[s->list->nodes[i]].code; }

/* The end of the run of equal last steps that begins at i. */
static uint32_t run_end(const Side *s, uint32_t i)
{
    StepCode code = last_code(s, i);
    while (i < s->list->count && last_code(s, i) == code) i++;
    return i;
}

/* One common step: forward sequences [f0, f1), backward sequences [b0, b1). */
typedef struct {
    uint32_t f0, f1, b0, b1;
} Meeting;

static size_t count_pairs(const Side *f, const Side *b, Meeting *meetings, size_t *meeting_count)
{
    size_t pairs = 0;
    uint32_t i = 0, j = 0;
    *meeting_count = 0;
    while (i < f->list->count && j < b->list->count) {
        StepCode x = last_code(f, i), y = last_code(b, j);
        uint32_t fe = run_end(f, i), be = run_end(b, j);
        if (x == y) {
            pairs += (size_t)(fe - i) * (be - j);
            if (meetings) meetings[*meeting_count] = (Meeting){i, fe, j, be};
            ++*meeting_count;
        }
        if (x <= y) i = fe;
        if (y <= x) j = be;
    }
    return pairs;
}

typedef struct {
    const JoinLimits *limits;
    Side forward, backward;
    KellerVec3 tx;
    uint32_t receivers;
    const KellerVec3 *rx;
} Job;

static void step_of(StepCode code, KellerStep *step)
{
    *step = (KellerStep){code_is_wedge(code) ? KELLER_DIFFRACTION : KELLER_REFLECTION, code_id(code)};
}

static bool keep(void *list, const KellerPath *path) { return path_list_push(list, path); }

/* Finds the paths of one sequence; false: out of memory. */
static bool solve_sequence(const JoinLimits *l, KellerVec3 tx, KellerVec3 rx, uint32_t count, const KellerStep *steps,
                           PathList *list, JoinWork *work)
{
    uint32_t left = l->interactions - count;
    work->candidates++;
    return keller_path_solve(l->scene, l->accel, tx, rx, count, steps, left < l->transmissions ? left : l->transmissions,
                             keep, list, &work->accel);
}

/* All pairs of one forward sequence with the backward sequences of its meeting. */
static bool solve_row(const Job *job, uint32_t forward_index, const Meeting *m, PathList *lists, JoinWork *work)
{
    const JoinLimits *l = job->limits;
    StepCode codes[MOST], tail[MOST];
    KellerStep steps[MOST];
    uint32_t a = job->forward.length, b = job->backward.length, k = a + b - 1;
    trie_steps(job->forward.trie, job->forward.list->nodes[forward_index], codes);
    for (uint32_t i = 0; i < a; i++) step_of(codes[i], &steps[i]);
    for (uint32_t j = m->b0; j < m->b1; j++) {
        trie_steps(job->backward.trie, job->backward.list->nodes[j], tail);
        for (uint32_t i = 0; i + 1 < b; i++) step_of(tail[b - 2 - i], &steps[a + i]);
        for (uint32_t r = 0; r < job->receivers; r++)
            if (!solve_sequence(l, job->tx, job->rx[r], k, steps, &lists[r], work)) return false;
    }
    return true;
}

static bool solve_meetings(const Job *job, const Meeting *meetings, size_t count, PathList *lists, JoinWork *work)
{
    uint32_t threads = job->limits->threads;
    bool ok = true;
    if (threads <= 1) {
        for (size_t m = 0; m < count && ok; m++)
            for (uint32_t i = meetings[m].f0; i < meetings[m].f1 && ok; i++)
                ok = solve_row(job, i, &meetings[m], lists, work);
        return ok;
    }
#pragma omp parallel num_threads((int)threads)
    {
        PathList *own = calloc(job->receivers, sizeof *own);
        JoinWork own_work = {0};
        bool own_ok = own != NULL;
        for (size_t m = 0; m < count; m++) {
#pragma omp for schedule(dynamic, 16) nowait
            for (uint32_t i = meetings[m].f0; i < meetings[m].f1; i++)
                if (own_ok) own_ok = solve_row(job, i, &meetings[m], own, &own_work);
        }
#pragma omp critical(keller_join)
        {
            for (uint32_t r = 0; own_ok && r < job->receivers; r++) own_ok = path_list_append(&lists[r], &own[r]);
            ok = ok && own_ok;
            work->candidates += own_work.candidates;
            work->accel.nodes += own_work.accel.nodes;
            work->accel.triangles += own_work.accel.triangles;
        }
        for (uint32_t r = 0; own && r < job->receivers; r++) path_list_free(&own[r]);
        free(own);
    }
    return ok;
}

KellerStatus join_ends(const JoinLimits *limits, const Ends *forward, const Ends *backward, KellerVec3 tx, uint32_t count,
                       const KellerVec3 *rx, PathList *lists, JoinWork *work, KellerError *error)
{
    bool ok = true;
    for (uint32_t r = 0; r < count && ok; r++) /* line of sight */
        ok = solve_sequence(limits, tx, rx[r], 0, NULL, &lists[r], work);
    for (uint32_t k = 1; k <= limits->bends && ok; k++)
        for (uint32_t w = 0; w <= k && ok; w++) { /* place of the wedge, 0: none */
            if (k - (w > 0) > limits->reflections || (w > 0) > limits->diffractions) continue;
            Job best = {.limits = limits, .tx = tx, .receivers = count, .rx = rx};
            size_t fewest = SIZE_MAX, meeting_count = 0;
            for (uint32_t a = 1; a <= k; a++) { /* of the common steps that both ends reached, the one with fewest pairs */
                uint32_t b = k + 1 - a, wf = w <= a ? w : 0, wb = w >= a ? k + 1 - w : 0;
                if (!forward->limits.want[a][wf] || !backward->limits.want[b][wb]) continue;
                Side f = {&forward->trie, &forward->lists[a][wf], a}, g = {&backward->trie, &backward->lists[b][wb], b};
                size_t meetings_here, pairs = count_pairs(&f, &g, NULL, &meetings_here);
                if (pairs >= fewest) continue;
                fewest = pairs;
                meeting_count = meetings_here;
                best.forward = f;
                best.backward = g;
            }
            assert(fewest != SIZE_MAX); /* plan_ends made the ends meet */
            if (meeting_count == 0) continue;
            Meeting *meetings = malloc(meeting_count * sizeof *meetings);
            if (!meetings) {
                ok = false;
                break;
            }
            count_pairs(&best.forward, &best.backward, meetings, &meeting_count);
            ok = solve_meetings(&best, meetings, meeting_count, lists, work);
            free(meetings);
        }
    return ok ? KELLER_OK : keller_error(error, KELLER_FAILED, "out of memory in the path solution");
}
