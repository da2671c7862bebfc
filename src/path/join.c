#include "path/join.h"

#include <stdlib.h>
#include <string.h>

KellerStatus ends_search(Ends *ends, const TreeLimits *limits, uint32_t count, const KellerVec3 *end, uint32_t threads,
                         TreeWork *work, KellerError *error)
{
    memset(ends, 0, sizeof *ends);
    ends->length = limits->length;
    if (limits->length == 0) return KELLER_OK;
    KellerStatus status = tree_search(limits, count, end, threads, &ends->trie, work, error);
    if (status == KELLER_OK && !trie_lists(&ends->trie, ends->length, ends->lists)) {
        trie_free(&ends->trie);
        memset(ends, 0, sizeof *ends);
        status = keller_error(error, KELLER_FAILED, "out of memory in the candidate search");
    }
    return status;
}

void ends_free(Ends *ends)
{
    for (uint32_t i = 0; i < ends->length; i++) free(ends->lists[i].nodes);
    trie_free(&ends->trie);
    memset(ends, 0, sizeof *ends);
}

static StepCode last_code(const Ends *e, uint32_t length, uint32_t i)
{
    return e->trie.nodes[e->lists[length - 1].nodes[i]].code;
}

/* The end of the run of equal last steps that begins at i. */
static uint32_t run_end(const Ends *e, uint32_t length, uint32_t i)
{
    StepCode code = last_code(e, length, i);
    uint32_t n = e->lists[length - 1].count;
    while (i < n && last_code(e, length, i) == code) i++;
    return i;
}

/* One common step: forward sequences [f0, f1), backward sequences [b0, b1). */
typedef struct {
    uint32_t f0, f1, b0, b1;
} Meeting;

static size_t count_pairs(const Ends *f, uint32_t a, const Ends *b, uint32_t c, Meeting *meetings, size_t *meeting_count)
{
    size_t pairs = 0;
    uint32_t i = 0, j = 0, nf = f->lists[a - 1].count, nb = b->lists[c - 1].count;
    *meeting_count = 0;
    while (i < nf && j < nb) {
        StepCode x = last_code(f, a, i), y = last_code(b, c, j);
        uint32_t fe = run_end(f, a, i), be = run_end(b, c, j);
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
    const Ends *forward, *backward;
    uint32_t a, b;
    KellerVec3 tx;
    uint32_t receivers;
    const KellerVec3 *rx;
} Job;

static void step_of(StepCode code, KellerStep *step)
{
    *step = (KellerStep){code_is_wedge(code) ? KELLER_DIFFRACTION : KELLER_REFLECTION, code_id(code)};
}

/* All pairs of one forward sequence with the backward sequences of its meeting. */
static bool solve_row(const Job *job, uint32_t forward_index, const Meeting *m, PathList *lists, JoinWork *work)
{
    const JoinLimits *l = job->limits;
    StepCode codes[KELLER_MAX_INTERACTIONS], tail[KELLER_MAX_INTERACTIONS];
    KellerStep steps[KELLER_MAX_INTERACTIONS];
    uint32_t node = job->forward->lists[job->a - 1].nodes[forward_index];
    uint32_t wedges_here = job->forward->trie.nodes[node].wedges, k = job->a + job->b - 1;
    trie_steps(&job->forward->trie, node, codes);
    for (uint32_t i = 0; i < job->a; i++) step_of(codes[i], &steps[i]);
    uint32_t common_wedge = code_is_wedge(codes[job->a - 1]);
    for (uint32_t j = m->b0; j < m->b1; j++) {
        uint32_t back = job->backward->lists[job->b - 1].nodes[j];
        uint32_t wedges = wedges_here + job->backward->trie.nodes[back].wedges - common_wedge;
        if (wedges > l->diffractions || k - wedges > l->reflections) continue;
        trie_steps(&job->backward->trie, back, tail);
        for (uint32_t i = 0; i + 1 < job->b; i++) step_of(tail[job->b - 2 - i], &steps[job->a + i]);
        for (uint32_t r = 0; r < job->receivers; r++) {
            KellerPath path;
            work->candidates++;
            if (keller_path_solve(l->scene, l->accel, job->tx, job->rx[r], k, steps, &path, &work->accel) &&
                !path_list_push(&lists[r], &path))
                return false;
        }
    }
    return true;
}

static bool append(PathList *to, const PathList *from)
{
    for (size_t i = 0; i < from->count; i++)
        if (!path_list_push(to, &from->items[i])) return false;
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
            for (uint32_t r = 0; own_ok && r < job->receivers; r++) own_ok = append(&lists[r], &own[r]);
            ok = ok && own_ok;
            work->candidates += own_work.candidates;
            work->accel.nodes += own_work.accel.nodes;
            work->accel.triangles += own_work.accel.triangles;
        }
        for (uint32_t r = 0; own && r < job->receivers; r++) free(own[r].items);
        free(own);
    }
    return ok;
}

KellerStatus join_ends(const JoinLimits *limits, const Ends *forward, const Ends *backward, KellerVec3 tx, uint32_t count,
                       const KellerVec3 *rx, PathList *lists, JoinWork *work, KellerError *error)
{
    bool ok = true;
    for (uint32_t r = 0; r < count && ok; r++) { /* line of sight */
        KellerPath path;
        work->candidates++;
        if (keller_path_solve(limits->scene, limits->accel, tx, rx[r], 0, NULL, &path, &work->accel))
            ok = path_list_push(&lists[r], &path);
    }
    for (uint32_t k = 1; k <= limits->interactions && ok; k++) {
        Job job = {limits, forward, backward, 0, 0, tx, count, rx};
        size_t best = SIZE_MAX, meeting_count = 0;
        for (uint32_t a = 1; a <= k && a <= forward->length; a++) { /* the split with the fewest pairs */
            uint32_t b = k + 1 - a;
            if (b > backward->length) continue;
            size_t meetings_here, pairs = count_pairs(forward, a, backward, b, NULL, &meetings_here);
            if (pairs < best) {
                best = pairs;
                meeting_count = meetings_here;
                job.a = a;
                job.b = b;
            }
        }
        if (meeting_count == 0) continue;
        Meeting *meetings = malloc(meeting_count * sizeof *meetings);
        if (!meetings) {
            ok = false;
            break;
        }
        count_pairs(forward, job.a, backward, job.b, meetings, &meeting_count);
        ok = solve_meetings(&job, meetings, meeting_count, lists, work);
        free(meetings);
    }
    return ok ? KELLER_OK : keller_error(error, KELLER_FAILED, "out of memory in the path solution");
}
