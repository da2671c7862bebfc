#include "path/join.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "path/edge_runs.h"
#include "path/lit.h"

enum {
    MOST = KELLER_MAX_BENDS,
    BLOCK = 128                 /* edges that are asked for at a time */
};

/* Narrows what is known to be lit of the first edges: so far only that was left out which is hidden from all of a beam. */
static void cast_shadows(Trie *trie, const TreeLimits *limits, KellerVec3 end, uint32_t threads, TreeWork *work)
{
    uint64_t nodes = 0, triangles = 0;
#pragma omp parallel for num_threads((int)threads) schedule(dynamic, 64) reduction(+ : nodes, triangles)
    for (uint32_t i = 1; i < trie->count; i++) {
        const Pattern pattern = trie->nodes[i].pattern;
        if (!(pattern & 1) || pattern_wedges(pattern) != 1) continue;
        StepCode codes[MOST];
        const uint32_t faces = trie_steps(trie, i, codes) - 1, wedge = code_id(codes[faces]);
        const double length = limits->scene->wedges[wedge].length;
        double lit[2];
        KellerAccelWork own = {0};
        trie_lit(trie, i, lit);
        double from = length * lit[0], to = length * lit[1];
        lit_way(limits, end, faces, codes, wedge, &from, &to, &own);
        trie_dim(trie, i, from / length, to / length);
        nodes += own.nodes;
        triangles += own.triangles;
    }
    work->accel.nodes += nodes;
    work->accel.triangles += triangles;
}

KellerStatus ends_search(Ends *ends, const TreeLimits *limits, KellerVec3 end, uint32_t threads, bool shadows, TreeWork *work,
                         KellerError *error)
{
    memset(ends, 0, sizeof *ends);
    ends->limits = *limits;
    KellerStatus status = tree_search(limits, end, threads, &ends->trie, NULL, work, error);
    if (status != KELLER_OK) return status;
    const Trie *trie = &ends->trie;
    if (shadows) cast_shadows(&ends->trie, limits, end, threads, work);
    bool ok = trie_list(trie, limits->plan->of, &ends->list);
    ends->arrival = ok ? malloc((ends->list.count + 1) * sizeof *ends->arrival) : NULL;
    if (!ends->arrival) {
        ends_free(ends);
        return keller_error(error, KELLER_FAILED, TRIE_FULL);
    }
    uint32_t count = 0;
    for (uint32_t i = 0; i < ends->list.count; i++) {
        uint32_t node = ends->list.nodes[i];
        while (node != 0 && !code_is_wedge(trie->nodes[node].code)) node = trie->nodes[node].parent;
        double lit[2] = {0, 1};
        if (node != 0) trie_lit(trie, node, lit);
        if (lit[0] > lit[1]) continue;
        if (node != 0) ends->arrival[count] = arrival_of(limits->scene, trie, node, end);
        ends->list.nodes[count] = ends->list.nodes[i];
        ends->list.last[count++] = ends->list.last[i];
    }
    ends->list.count = count;
    return KELLER_OK;
}

void ends_free(Ends *ends)
{
    trie_list_free(&ends->list);
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

static StepCode last_code(const Side *s, uint32_t i) { return s->ends->list.last[i]; }

/* The end of the run of equal last steps that begins at i. */
static uint32_t run_end(const Side *s, uint32_t i)
{
    StepCode code = last_code(s, i);
    while (i < s->end && last_code(s, i) == code) i++;
    return i;
}

/* Forward sequences [f0, f1) and backward sequences [b0, b1) with one last step, or, meeting on a leg, all of them. */
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

typedef struct {
    const JoinLimits *limits;
    Side forward, backward;
    bool alone;                 /* there is no backward side */
    bool on_leg, between;       /* between two wedges, on the leg or at a face */
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

/* A candidate, after the sieve. lit: the part of the edge that both ends light, NULL for all. */
static bool sift_sequence(const Job *job, uint32_t count, const KellerStep *steps, const double *lit, PathList *list, JoinWork *work)
{
    Sieve sieve;
    bool useful;
    if (!sieve_make(&sieve, job->limits->scene, job->limits->boxes, job->tx, count, steps, lit, &useful)) return true;
    if (!useful || sieve_passes(&sieve, job->rx, NULL)) return solve_sequence(job->limits, job->tx, job->rx, count, steps, list, work);
    work->candidates++;
    return true;
}

/* A sequence of the transmitter's alone. */
static bool solve_alone(const Job *job, uint32_t forward, PathList *list, JoinWork *work)
{
    StepCode codes[MOST];
    KellerStep steps[MOST];
    uint32_t count = steps_of(&job->forward, forward, codes);
    for (uint32_t i = 0; i < count; i++) step_of(codes[i], &steps[i]);
    const Arrival *a = &job->forward.ends->arrival[forward];
    const double lit[2] = {a->lit[0], a->lit[1]};
    return sift_sequence(job, count, steps, code_is_wedge(codes[count - 1]) ? lit : NULL, list, work);
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
    double lit[2], *common = NULL; /* of the edge at which they meet */
    if (!job->on_leg && code_is_wedge(codes[a - 1])) {
        const Arrival *there = &job->forward.ends->arrival[forward], *back = &job->backward.ends->arrival[backward];
        lit[0] = greater(there->lit[0], back->lit[0]);
        lit[1] = lesser(there->lit[1], back->lit[1]);
        common = lit;
    }
    return sift_sequence(job, a + b, steps, common, list, work);
}

/* All pairs of two runs that agree at both wedges. */
static bool solve_runs(const Job *job, const EdgeRun *there, const EdgeRun *back, PathList *list, JoinWork *work)
{
    const JoinLimits *l = job->limits;
    EdgePair pair;
    uint32_t faces = 0, face[2 * MOST]; /* between the two, from the transmitter's side on; the common one once */
    if (!edge_pair(&there->line, &back->line, &pair)) return true;
    const uint32_t *vertex[2] = {l->scene->wedges[there->wedge].vertex, l->scene->wedges[back->wedge].vertex};
    if (job->on_leg && vertex[0][0] == vertex[1][0] && vertex[0][1] == vertex[1][1]) return true; /* one edge twice */
    double lit[2][2];
    if (!edges_agree(&pair, &there->all, &back->all, lit)) return true;
    for (uint32_t k = there->faces; k-- > 0;) face[faces++] = there->face[k];
    for (uint32_t k = !job->on_leg; k < back->faces; k++) face[faces++] = back->face[k];
    for (uint32_t m = there->begin; m < there->end; m++)
        for (uint32_t n = back->begin; n < back->end; n++) {
            const Arrival *a = &job->forward.ends->arrival[m], *b = &job->backward.ends->arrival[n];
            if (!edges_agree(&pair, a, b, lit)) continue;
            if (!faces_between(l->scene, l->boxes, there->wedge, back->wedge, faces, face, lit, arrival_reach(a) + arrival_reach(b))) continue;
            if (!solve_pair(job, m, n, list, work)) return false;
        }
    return true;
}

/* Those of one group that meet between two wedges. */
typedef struct {
    EdgeRuns there, back;
} Runs;

static bool runs_of(EdgeRuns *runs, const Job *job, const Side *s, uint32_t begin, uint32_t end, uint32_t without)
{
    return edge_runs_init(runs, job->limits->scene, &s->ends->trie, s->ends->list.nodes, s->ends->arrival, begin, end, without);
}

static bool runs_init(Runs *r, const Job *job, const Group *g)
{
    *r = (Runs){0};
    return runs_of(&r->there, job, &job->forward, g->f0, g->f1, 0) && runs_of(&r->back, job, &job->backward, g->b0, g->b1, !job->on_leg);
}

static void runs_free(Runs *r)
{
    edge_runs_free(&r->there);
    edge_runs_free(&r->back);
}

/* One of the transmitter's with all of the receiver's. */
static bool solve_run(const Job *job, const Runs *r, uint32_t index, PathList *list, JoinWork *work)
{
    const EdgeRun *there = &r->there.run[index];
    const EdgeRuns *back = &r->back;
    for (uint32_t begin = 0; begin < back->count; begin += BLOCK) {
        double room[BLOCK];
        const uint32_t count = back->count - begin < BLOCK ? back->count - begin : BLOCK;
        edge_runs_led_to(there, back, begin, count, room);
        for (uint32_t i = 0; i < count; i++)
            if (!(room[i] < 0) && !solve_runs(job, there, &back->run[begin + i], list, work)) return false;
    }
    return true;
}

/* Those pairs of one group whose lit parts agree. */
static bool solve_group(const Job *job, const Group *g, PathList *list, JoinWork *work)
{
    const Side *f = &job->forward, *b = &job->backward;
    bool ok = true;
    if (job->between) {
        Runs runs;
        ok = runs_init(&runs, job, g);
        for (uint32_t i = 0; i < runs.there.count && ok; i++) ok = solve_run(job, &runs, i, list, work);
        runs_free(&runs);
        return ok;
    }
    const bool at_edge = code_is_wedge(last_code(f, g->f0));
    for (uint32_t i = g->f0; i < g->f1 && ok && job->alone; i++) ok = solve_alone(job, i, list, work);
    for (uint32_t i = g->f0; i < g->f1 && !job->alone; i++)
        for (uint32_t k = g->b0; k < g->b1; k++)
            if ((!at_edge || meet_at_edge(&f->ends->arrival[i], &b->ends->arrival[k])) && !solve_pair(job, i, k, list, work)) return false;
    return ok;
}

typedef struct {
    PathList list;
    JoinWork work;
    bool ok;
} Own;

/* What one thread of a team does of the groups. runs: of the only group that meets on a leg. */
static void solve_share(const Job *job, const Group *groups, size_t count, const Runs *runs, Own *own)
{
    if (job->on_leg) {
#pragma omp for schedule(dynamic, 1) nowait
        for (uint32_t i = 0; i < runs->there.count; i++)
            if (own->ok) own->ok = solve_run(job, runs, i, &own->list, &own->work);
    } else if (job->between) {
#pragma omp for schedule(dynamic, 1) nowait
        for (size_t m = 0; m < count; m++)
            if (own->ok) own->ok = solve_group(job, &groups[m], &own->list, &own->work);
    } else {
        for (size_t m = 0; m < count; m++) { /* few groups: their rows are shared */
#pragma omp for schedule(dynamic, 16) nowait
            for (uint32_t i = groups[m].f0; i < groups[m].f1; i++) {
                Group row = {i, i + 1, groups[m].b0, groups[m].b1};
                if (own->ok) own->ok = solve_group(job, &row, &own->list, &own->work);
            }
        }
    }
}

static bool solve_groups(const Job *job, const Group *groups, size_t count, PathList *list, JoinWork *work)
{
    uint32_t threads = job->limits->threads;
    bool ok = true;
    if (threads <= 1) {
        for (size_t m = 0; m < count && ok; m++) ok = solve_group(job, &groups[m], list, work);
        return ok;
    }
    Runs runs = {0};
    if (job->on_leg && !runs_init(&runs, job, groups)) {
        runs_free(&runs);
        return false;
    }
#pragma omp parallel num_threads((int)threads)
    {
        Own own = {.ok = true};
        solve_share(job, groups, count, &runs, &own);
#pragma omp critical(keller_join)
        {
            ok = ok && own.ok && path_list_append(list, &own.list);
            work->candidates += own.work.candidates;
            work->accel.nodes += own.work.accel.nodes;
            work->accel.triangles += own.work.accel.triangles;
        }
        path_list_free(&own.list);
    }
    runs_free(&runs);
    return ok;
}

/* Where the ends meet for a pattern: as planned, or, of the common steps that both ends happen to have reached, that with fewest
 * pairs. */
static void choose_meeting(Job *job, const Ends *forward, const Ends *backward, Pattern pattern, size_t *group_count)
{
    uint32_t k = pattern_length(pattern);
    Meeting planned = plan_meeting(pattern, job->limits->bends, job->limits->alone);
    job->alone = planned.backward == 0;
    if (job->alone) {
        job->forward = side_of(forward, pattern);
        *group_count = job->forward.begin < job->forward.end;
        return;
    }
    job->on_leg = meets_on_leg(planned, pattern);
    if (job->on_leg) {
        job->forward = side_of(forward, pattern_first(pattern, planned.forward));
        job->backward = side_of(backward, pattern_last(pattern, planned.backward));
        job->between = true;
        *group_count = job->forward.begin < job->forward.end && job->backward.begin < job->backward.end;
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
        job->between = pattern_wedges(first) > 0 && pattern_wedges(last) > 0 && !(first & 1);
    }
    assert(fewest != SIZE_MAX); /* plan_ends made the ends meet */
}

bool join_pattern(const JoinLimits *limits, const Ends *forward, const Ends *backward, Pattern pattern, KellerVec3 tx, KellerVec3 rx,
                  PathList *list, JoinWork *work)
{
    Job job = {.limits = limits, .tx = tx, .rx = rx};
    size_t group_count = 0;
    choose_meeting(&job, forward, backward, pattern, &group_count);
    if (group_count == 0) return true;
    Group *groups = malloc(group_count * sizeof *groups);
    if (!groups) return false;
    if (job.on_leg || job.alone) groups[0] = (Group){job.forward.begin, job.forward.end, job.backward.begin, job.backward.end};
    else count_pairs(&job.forward, &job.backward, groups, &group_count);
    const bool ok = solve_groups(&job, groups, group_count, list, work);
    free(groups);
    return ok;
}

KellerStatus join_ends(const JoinLimits *limits, const Ends *forward, const Ends *backward, KellerVec3 tx, KellerVec3 rx, PathList *list,
                       JoinWork *work, KellerError *error)
{
    bool ok = solve_sequence(limits, tx, rx, 0, NULL, list, work); /* line of sight */
    for (Pattern p = 2; p < 2u << limits->bends && ok; p++)
        if (plan_asks(limits->reflections, limits->diffractions, p)) ok = join_pattern(limits, forward, backward, p, tx, rx, list, work);
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
