#include "path/join.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "path/arrival.h"

enum { MOST = KELLER_MAX_BENDS };

KellerStatus ends_search(Ends *ends, const TreeLimits *limits, KellerVec3 end, uint32_t threads, TreeWork *work, KellerError *error)
{
    memset(ends, 0, sizeof *ends);
    ends->limits = *limits;
    KellerStatus status = tree_search(limits, end, threads, &ends->trie, NULL, work, error);
    if (status != KELLER_OK) return status;
    const Trie *trie = &ends->trie;
    bool ok = trie_list(trie, limits->plan->of, &ends->list);
    ends->arrival = ok ? malloc((ends->list.count + 1) * sizeof *ends->arrival) : NULL;
    if (!ends->arrival) {
        ends_free(ends);
        return keller_error(error, KELLER_FAILED, TRIE_FULL);
    }
    for (uint32_t i = 0; i < ends->list.count; i++)
        if (code_is_wedge(trie->nodes[ends->list.nodes[i]].code))
            ends->arrival[i] = arrival_of(limits->scene, trie, ends->list.nodes[i], end);
    return KELLER_OK;
}

void ends_free(Ends *ends)
{
    free(ends->list.nodes);
    free(ends->arrival);
    trie_free(&ends->trie);
    memset(ends, 0, sizeof *ends);
}

/* Sequences of one end with one pattern: a run of its list. */
typedef struct {
    const Ends *ends;
    uint32_t length, begin, end;
} Side;

static Side side_of(const Ends *ends, Pattern pattern)
{
    Side s = {.ends = ends, .length = pattern_length(pattern)};
    s.end = trie_run(&ends->trie, &ends->list, pattern, &s.begin);
    return s;
}

static StepCode last_code(const Side *s, uint32_t i) { return s->ends->trie.nodes[s->ends->list.nodes[i]].code; }

/* The end of the run of equal last steps that begins at i. */
static uint32_t run_end(const Side *s, uint32_t i)
{
    StepCode code = last_code(s, i);
    while (i < s->end && last_code(s, i) == code) i++;
    return i;
}

/* Forward sequences [f0, f1) that end in one step, and backward sequences [b0, b1): with the same last step, or, meeting on a
 * leg, all. */
typedef struct {
    uint32_t f0, f1, b0, b1;
} Group;

static size_t count_pairs(const Side *f, const Side *b, Group *groups, size_t *group_count)
{
    size_t pairs = 0;
    uint32_t i = f->begin, j = b->begin;
    *group_count = 0;
    while (i < f->end && j < b->end) {
        StepCode x = last_code(f, i), y = last_code(b, j);
        uint32_t fe = run_end(f, i), be = run_end(b, j);
        if (x == y) {
            pairs += (size_t)(fe - i) * (be - j);
            if (groups) groups[*group_count] = (Group){i, fe, j, be};
            ++*group_count;
        }
        if (x <= y) i = fe;
        if (y <= x) j = be;
    }
    return pairs;
}

static void count_on_leg(const Side *f, const Side *b, Group *groups, size_t *group_count)
{
    *group_count = 0;
    for (uint32_t i = f->begin, end; i < f->end; i = end) {
        end = run_end(f, i);
        if (groups) groups[*group_count] = (Group){i, end, b->begin, b->end};
        ++*group_count;
    }
}

typedef struct {
    const JoinLimits *limits;
    Side forward, backward;
    bool on_leg;
    KellerVec3 tx, rx;
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

/* Do both ends light a common part of the edge at which they meet? */
static bool meet_at_edge(const Arrival *a, const Arrival *b) { return a->lit[0] <= b->lit[1] && b->lit[0] <= a->lit[1]; }

static uint32_t steps_of(const Side *s, uint32_t index, StepCode *codes)
{
    return trie_steps(&s->ends->trie, s->ends->list.nodes[index], codes);
}

/* One forward with one backward sequence. */
static bool solve_pair(const Job *job, uint32_t forward, uint32_t backward, PathList *list, JoinWork *work)
{
    StepCode codes[MOST], tail[MOST];
    KellerStep steps[2 * MOST];
    uint32_t a = steps_of(&job->forward, forward, codes), b = steps_of(&job->backward, backward, tail);
    if (!job->on_leg) b--; /* the common step */
    for (uint32_t i = 0; i < a; i++) step_of(codes[i], &steps[i]);
    for (uint32_t i = 0; i < b; i++) step_of(tail[b - 1 - i], &steps[a + i]);
    Sieve sieve;
    bool useful;
    double lit[2], *common = NULL; /* of the edge at which they meet */
    if (!job->on_leg && code_is_wedge(codes[a - 1])) {
        const Arrival *there = &job->forward.ends->arrival[forward], *back = &job->backward.ends->arrival[backward];
        lit[0] = greater(there->lit[0], back->lit[0]);
        lit[1] = lesser(there->lit[1], back->lit[1]);
        common = lit;
    }
    if (!sieve_make(&sieve, job->limits->scene, job->limits->boxes, job->tx, a + b, steps, common, &useful)) return true;
    if (!useful || sieve_passes(&sieve, job->rx, NULL)) return solve_sequence(job->limits, job->tx, job->rx, a + b, steps, list, work);
    work->candidates++;
    return true;
}

/* All pairs of one group whose lit parts and angles agree. */
static bool solve_group(const Job *job, const Group *g, PathList *list, JoinWork *work)
{
    const Side *f = &job->forward, *b = &job->backward;
    StepCode first = last_code(f, g->f0);
    const Arrival *there = f->ends->arrival, *back = b->ends->arrival;
    for (uint32_t j = g->b0, end; j < g->b1; j = end) { /* runs of one last step: only one unless they meet on a leg */
        EdgePair pair;
        end = job->on_leg ? run_end(b, j) : g->b1;
        if (job->on_leg && !edge_pair(job->limits->scene, code_id(first), code_id(last_code(b, j)), &pair)) continue;
        for (uint32_t i = g->f0; i < g->f1; i++)
            for (uint32_t k = j; k < end; k++) {
                if (job->on_leg ? !edges_agree(&pair, &there[i], &back[k])
                                : code_is_wedge(first) && !meet_at_edge(&there[i], &back[k]))
                    continue;
                if (!solve_pair(job, i, k, list, work)) return false;
            }
    }
    return true;
}

static bool solve_groups(const Job *job, const Group *groups, size_t count, PathList *list, JoinWork *work)
{
    uint32_t threads = job->limits->threads;
    bool ok = true;
    if (threads <= 1) {
        for (size_t m = 0; m < count && ok; m++) ok = solve_group(job, &groups[m], list, work);
        return ok;
    }
#pragma omp parallel num_threads((int)threads)
    {
        PathList own = {0};
        JoinWork own_work = {0};
        bool own_ok = true;
        for (size_t m = 0; m < count && !job->on_leg; m++) { /* few groups: their rows are shared */
#pragma omp for schedule(dynamic, 16) nowait
            for (uint32_t i = groups[m].f0; i < groups[m].f1; i++) {
                Group row = {i, i + 1, groups[m].b0, groups[m].b1};
                if (own_ok) own_ok = solve_group(job, &row, &own, &own_work);
            }
        }
        if (job->on_leg) {
#pragma omp for schedule(dynamic, 1) nowait
            for (size_t m = 0; m < count; m++)
                if (own_ok) own_ok = solve_group(job, &groups[m], &own, &own_work);
        }
#pragma omp critical(keller_join)
        {
            ok = ok && own_ok && path_list_append(list, &own);
            work->candidates += own_work.candidates;
            work->accel.nodes += own_work.accel.nodes;
            work->accel.triangles += own_work.accel.triangles;
        }
        path_list_free(&own);
    }
    return ok;
}

/* Where the ends meet for a pattern: as planned, or, of the common steps that both ends happen to have reached, that with fewest
 * pairs. */
static void choose_meeting(Job *job, const Ends *forward, const Ends *backward, Pattern pattern, size_t *group_count)
{
    uint32_t k = pattern_length(pattern);
    Meeting planned = plan_meeting(pattern, job->limits->bends);
    job->on_leg = meets_on_leg(planned, pattern);
    if (job->on_leg) {
        job->forward = side_of(forward, pattern_first(pattern, planned.forward));
        job->backward = side_of(backward, pattern_last(pattern, planned.backward));
        count_on_leg(&job->forward, &job->backward, NULL, group_count);
        return;
    }
    size_t fewest = SIZE_MAX;
    for (uint32_t a = 1; a <= k; a++) {
        Pattern first = pattern_first(pattern, a), last = pattern_last(pattern, k + 1 - a);
        if (!(forward->limits.plan->of[first] & PLAN_WANT) || !(backward->limits.plan->of[last] & PLAN_WANT)) continue;
        Side f = side_of(forward, first), b = side_of(backward, last);
        size_t groups_here, pairs = count_pairs(&f, &b, NULL, &groups_here);
        if (pairs >= fewest) continue;
        fewest = pairs;
        *group_count = groups_here;
        job->forward = f;
        job->backward = b;
    }
    assert(fewest != SIZE_MAX); /* plan_ends made the ends meet */
}

KellerStatus join_ends(const JoinLimits *limits, const Ends *forward, const Ends *backward, KellerVec3 tx, KellerVec3 rx, PathList *list,
                       JoinWork *work, KellerError *error)
{
    bool ok = solve_sequence(limits, tx, rx, 0, NULL, list, work); /* line of sight */
    for (Pattern p = 2; p < 2u << limits->bends && ok; p++) {
        if (!plan_asks(limits->reflections, limits->diffractions, p)) continue;
        Job job = {.limits = limits, .tx = tx, .rx = rx};
        size_t group_count = 0;
        choose_meeting(&job, forward, backward, p, &group_count);
        if (group_count == 0) continue;
        Group *groups = malloc(group_count * sizeof *groups);
        ok = groups != NULL;
        if (ok && job.on_leg) count_on_leg(&job.forward, &job.backward, groups, &group_count);
        else if (ok) count_pairs(&job.forward, &job.backward, groups, &group_count);
        ok = ok && solve_groups(&job, groups, group_count, list, work);
        free(groups);
    }
    return ok ? KELLER_OK : keller_error(error, KELLER_FAILED, "out of memory in the path solution");
}

KellerStatus join_known(const JoinLimits *limits, const Trie *trie, const CellCandidate *known, size_t begin, size_t end, KellerVec3 tx,
                        KellerVec3 rx, PathList *list, JoinWork *work, KellerError *error)
{
    bool ok = solve_sequence(limits, tx, rx, 0, NULL, list, work);
    for (size_t i = begin; i < end && ok; i++) {
        StepCode codes[MOST];
        KellerStep steps[MOST];
        uint32_t length = trie_steps(trie, known[i].node, codes);
        for (uint32_t j = 0; j < length; j++) step_of(codes[j], &steps[j]);
        ok = solve_sequence(limits, tx, rx, length, steps, list, work);
    }
    return ok ? KELLER_OK : keller_error(error, KELLER_FAILED, "out of memory in the path solution");
}
