/* A whole simulation. For points each transmitter's tree is searched once, then each receiver's from the other end. For most grids the
 * search is from the transmitter alone: it finds the cells that each sequence leads to. Receivers are worked on in parallel in blocks and
 * handed out in order. */
#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

#include "path/batch.h"
#include "path/edge_paths.h"
#include "path/field.h"
#include "path/join.h"
#include "path/level.h"
#include "path/part.h"
#include "path/response.h"
#include "path/restore.h"
#include "path/scatter.h"
#include "base/number.h"

enum {
    BLOCK = 128,            /* points of a route worked on together */
    CELLS = 1024,           /* cells of a map worked on together */
    TARGET_RECEIVERS = 64,  /* points up to which the transmitter's search is aimed at what they see */
    BATCH = 8192            /* paths handed to the sink at once */
};
/* Candidates of a part of a map, about: where there are more, it is cut in two. The second, times split_over, is for tests of small scenes. */
static const size_t CANDIDATES = 1u << 25, CANDIDATES_SMALL = 64;
static const double SEARCH_SHARE = 0.9;  /* of the time that a map takes, about: the rest is the fields */

typedef struct {
    const KellerConfig *config;
    const KellerScene *scene;
    const KellerAccel *accel;
    const KellerPathSource *known;  /* NULL: paths are searched */
    const KellerSink *sink;
    KellerSimulationWork *work;
    FieldContext fields;
    uint32_t tx;
    Ends forward;
    TreeLimits backward;
    TreePlan plan[2];           /* of the transmitter's and of the receivers' side; for grids the first is all */
    KellerAccel *seen_by_tx, *seen_by_rx;   /* wedges in sight of the ends; NULL: not computed */
    JoinLimits join;
    KellerPathBatch batch;
    bool whole_edges;           /* all of an edge diffracts: the search looks for reflections alone, these for the edges */
    EdgeSearch edges;
    EdgeWays *lit;              /* by the transmitter */
    Scattering scattering;
    ResponsePlan *responses;    /* NULL: none are asked for */
    double done, total;         /* receivers, times transmitters */
    double worth;               /* what is left to do at each, as a share of all that is done for it */
    double reported;            /* how far the simulation was said to be */
} Simulation;

/* Tells the sink, but never less than before. */
static void report(void *context, double fraction)
{
    Simulation *s = context;
    if (!s->sink->progress || !(fraction > s->reported)) return;
    s->reported = fraction;
    s->sink->progress(s->sink->context, fraction);
}

static uint32_t least(uint32_t a, uint32_t b) { return a < b ? a : b; }

/* Is a set searched from the transmitter alone? Not where the wave may be diffracted twice: then edges would send fans to edges, where
 * both ends meet on the leg between them and need none. */
static bool searched_alone(const Simulation *s, const KellerReceiverSet *set)
{
    return set->kind == KELLER_SET_GRID && s->join.diffractions <= 1 && !s->known;
}

/* All paths to one receiver. part: NULL, or where its candidates are, as cell `cell`. `threads` > 1 where there are no others. */
static KellerStatus run_receiver(Simulation *s, uint32_t rx, const Part *part, size_t cell, uint32_t threads, PairResult *result,
                                 KellerSimulationWork *work, KellerError *error)
{
    KellerVec3 from = s->config->transmitters[s->tx].station.position, to = s->config->receivers[rx].station.position;
    JoinLimits join = s->join;
    join.threads = threads;
    PathList *list = &result->paths;
    Ends backward = {0};
    TreeWork tree_work = {0};
    JoinWork join_work = {0};
    KellerStatus status = KELLER_OK;
    double start = omp_get_wtime();
    if (isnan(to.z)) return KELLER_OK; /* a cell that has no surface below */
    if (!part && !join.alone) status = ends_search(&backward, &s->backward, to, threads, join.diffractions > 1, &tree_work, error);
    if (status != KELLER_OK) return status;
    double middle = omp_get_wtime();
    if (part) {
        status = join_known(&join, &part->trie, part->known.item, part->begin[cell], part->begin[cell + 1], from, to, list, &join_work, error);
    } else {
        status = join_ends(&join, &s->forward, &backward, from, to, list, &join_work, error);
        ends_free(&backward);
    }
    EdgeWays *seen = NULL;
    if (status == KELLER_OK && s->whole_edges) status = edge_ways_find(&s->edges, to, threads, &seen, &tree_work, error);
    if (status == KELLER_OK && s->whole_edges && !edge_paths_add(&s->edges, s->lit, seen, list))
        status = keller_error(error, KELLER_FAILED, "out of memory for the paths by edges");
    edge_ways_free(seen);
    if (status == KELLER_OK) status = scattering_add(&s->scattering, to, threads, list, &tree_work, &join_work, error);
    path_list_merge_corners(s->scene, list);
    work->valid_paths += list->count;
    if (status == KELLER_OK && !pair_fields(&s->fields, s->tx, rx, result, work))
        status = keller_error(error, KELLER_FAILED, "out of memory for the fields of the paths");
    work->seconds_search += middle - start;
    work->seconds_solve += omp_get_wtime() - middle;
    work->cones += tree_work.cones;
    work->nodes += tree_work.accel.nodes + join_work.accel.nodes;
    work->triangles += tree_work.accel.triangles + join_work.accel.triangles;
    work->candidates += join_work.candidates;
    return status;
}

static void add_work(KellerSimulationWork *to, const KellerSimulationWork *from)
{
    to->cones += from->cones;
    to->nodes += from->nodes;
    to->triangles += from->triangles;
    to->candidates += from->candidates;
    to->valid_paths += from->valid_paths;
    to->dropped_paths += from->dropped_paths;
    to->boundary_paths += from->boundary_paths;
    to->cornered_paths += from->cornered_paths;
    to->crowded_paths += from->crowded_paths;
    to->dropped_ratio = greater(to->dropped_ratio, from->dropped_ratio);
    to->seconds_search += from->seconds_search;
    to->seconds_solve += from->seconds_solve;
}

static KellerStatus hand_response(Simulation *s, uint32_t rx, const PairResult *pair, KellerError *error)
{
    KellerResponse response;
    KellerStatus status = response_of(s->responses, s->config, s->scene, s->tx, rx, &pair->paths, s->work->threads, &response, error);
    if (status != KELLER_OK) return status;
    status = s->sink->response(s->sink->context, &response, error);
    free(response.pressure);
    free(response.tail);
    return status;
}

static KellerStatus flush(Simulation *s, bool all, KellerError *error)
{
    if (s->batch.count == 0 || (!all && s->batch.count < BATCH)) return KELLER_OK;
    KellerStatus status = s->sink->paths(s->sink->context, &s->batch, error);
    batch_clear(&s->batch);
    return status;
}

/* The levels of the `count` cells from `cell` on. */
static KellerStatus levels_of(KellerCoverage *coverage, uint32_t cell, uint32_t count, const FieldContext *fields,
                              const PairResult *results, uint32_t threads, KellerError *error)
{
    KellerStatus status = KELLER_OK;
#pragma omp parallel for schedule(dynamic, 8) num_threads((int)threads) if (threads > 1)
    for (uint32_t i = 0; i < count; i++) { /* each its own cell */
        KellerError own;
        KellerStatus here = level_cell(coverage, cell + i, fields, &results[i], &own);
        if (here == KELLER_OK) continue;
#pragma omp critical(keller_simulate)
        status = keller_error(error, here, "%s", own.message);
    }
    return status;
}

/* Works on the receivers first .. first + count - 1 of a set and hands them out in order. part: NULL, or the part of the grid whose
 * cells from `cell` on they are. */
static KellerStatus run_block(Simulation *s, const KellerReceiverSet *set, uint32_t first, uint32_t count, const Part *part,
                              size_t cell, KellerCoverage *coverage, KellerError *error)
{
    PairResult *results = calloc(count, sizeof *results);
    if (!results) return keller_error_memory(error, count * sizeof *results);
    uint32_t threads = s->work->threads, across = count > 1 ? threads : 1, within = count > 1 ? 1 : threads;
    KellerStatus status = s->known ? known_take(s->known, s->tx, first, count, results, error) : KELLER_OK;
    uint32_t finished = 0;
#pragma omp parallel num_threads((int)across) if (across > 1)
    {
        KellerSimulationWork work = {0};
#pragma omp for schedule(dynamic, 1)
        for (uint32_t i = 0; i < count; i++) {
            KellerStatus seen;
#pragma omp atomic read
            seen = status;
            if (seen != KELLER_OK) continue;
            KellerError own_error;
            KellerStatus own_status = s->known ? known_fields(s->known, &s->fields, s->tx, first + i, &results[i], &work, &own_error)
                                               : run_receiver(s, first + i, part, cell + i, within, &results[i], &work, &own_error);
            if (own_status != KELLER_OK) {
#pragma omp critical(keller_simulate)
                {
                    if (status == KELLER_OK) keller_error(error, own_status, "%s", own_error.message);
#pragma omp atomic write
                    status = own_status;
                }
            }
            uint32_t now;
#pragma omp atomic capture
            now = ++finished;
            if (omp_get_thread_num() == 0) report(s, (s->done + s->worth * now) / s->total);
        }
#pragma omp critical(keller_simulate)
        add_work(s->work, &work);
    }
    if (status == KELLER_OK && coverage && coverage->level)
        status = levels_of(coverage, first - set->first, count, &s->fields, results, threads, error);
    for (uint32_t i = 0; i < count; i++) {
        if (status == KELLER_OK && coverage) coverage_cell(coverage, first - set->first + i, &results[i].sums);
        if (status == KELLER_OK && s->sink->pair && set->kind != KELLER_SET_GRID)
            status = s->sink->pair(s->sink->context, &results[i].sums, error);
        if (status == KELLER_OK && s->sink->paths && s->config->output_paths) {
            if (!batch_append(&s->batch, &s->fields, s->tx, first + i, &results[i]))
                status = keller_error(error, KELLER_FAILED, "out of memory for the paths of a batch");
            if (status == KELLER_OK) status = flush(s, false, error);
        }
        if (status == KELLER_OK && s->responses && set->kind != KELLER_SET_GRID)
            status = hand_response(s, first + i, &results[i], error);
        pair_free(&results[i]);
    }
    free(results);
    s->done += s->worth * count;
    return status;
}

/* The search for a part of a grid, whose place is set. *full: it has too many candidates, and nothing is returned. */
static KellerStatus part_search(Simulation *s, const KellerReceiverSet *set, Part *p, bool *full, KellerError *error)
{
    CellGrid grid;
    if (!cells_of(s->config, set, p->x, p->y, p->nx, p->ny, &grid)) {
        cells_free(&grid);
        return keller_error(error, KELLER_FAILED, "out of memory for the cells of a grid of %u x %u", set->ny, set->nx);
    }
    TreeLimits limits = s->backward; /* both sides have the same */
    limits.plan = &s->plan[0];
    limits.targets = NULL;
    limits.cells = &grid;
    limits.cells_most = p->nx == 1 && p->ny == 1 ? SIZE_MAX : limits.split_over ? CANDIDATES_SMALL * limits.split_over : CANDIDATES;
    limits.boxes = s->join.boxes;
    const double cells = (double)p->nx * p->ny;
    const Advance piece = {report, s, s->done / s->total, (s->done + SEARCH_SHARE * cells) / s->total};
    limits.advance = &piece;
    TreeWork work = {0};
    double start = omp_get_wtime();
    KellerStatus status = tree_search(&limits, s->config->transmitters[s->tx].station.position, s->work->threads, &p->trie, &p->known,
                                      &work, error);
    cells_free(&grid);
    *full = p->known.full;
    if (!*full) s->done += SEARCH_SHARE * cells;
    if (status == KELLER_OK && !*full) status = part_sort(p, error);
    s->work->seconds_search += omp_get_wtime() - start;
    s->work->cones += work.cones;
    s->work->candidates += work.solved;
    s->work->nodes += work.accel.nodes;
    s->work->triangles += work.accel.triangles;
    return status;
}

static KellerStatus run_part(Simulation *s, const KellerReceiverSet *set, Part part, KellerCoverage *coverage, KellerError *error)
{
    bool full = false;
    KellerStatus status = part_search(s, set, &part, &full, error);
    if (status == KELLER_OK && full) {
        Part half[2];
        part_halves(&part, half);
        for (int i = 0; i < 2 && status == KELLER_OK; i++) status = run_part(s, set, half[i], coverage, error);
        return status;
    }
    uint32_t first = set->first + part.y * set->nx + part.x, cells = part.nx * part.ny;
    for (uint32_t at = 0; at < cells && status == KELLER_OK; at += CELLS)
        status = run_block(s, set, first + at, cells - at < CELLS ? cells - at : CELLS, &part, at, coverage, error);
    part_free(&part);
    return status;
}

static KellerStatus run_grid(Simulation *s, uint32_t set_index, KellerError *error)
{
    const KellerReceiverSet *set = &s->config->sets[set_index];
    bool maps = s->sink->coverage && s->config->output_coverage;
    KellerCoverage coverage = {0};
    bool room = !maps || coverage_init(&coverage, s->tx, set_index, set->ny, set->nx, s->config->frequency_count);
    if (room && maps && s->scene->sound.speed > 0) room = level_init(&coverage);
    if (!room) {
        coverage_free(&coverage);
        return keller_error(error, KELLER_FAILED, "out of memory for a grid of %u x %u cells", set->ny, set->nx);
    }
    KellerStatus status = KELLER_OK;
    if (searched_alone(s, set)) {
        status = run_part(s, set, (Part){.nx = set->nx, .ny = set->ny}, maps ? &coverage : NULL, error);
    } else {
        for (uint32_t at = 0; at < set->count && status == KELLER_OK; at += CELLS)
            status = run_block(s, set, set->first + at, least(CELLS, set->count - at), NULL, 0, maps ? &coverage : NULL, error);
    }
    if (maps) coverage_nowhere(&coverage, &s->config->receivers[set->first]);
    if (status == KELLER_OK && maps) status = s->sink->coverage(s->sink->context, &coverage, error);
    coverage_free(&coverage);
    return status;
}

static KellerStatus run_points(Simulation *s, uint32_t first_set, uint32_t end_set, KellerError *error)
{
    const KellerReceiverSet *sets = s->config->sets;
    uint32_t first = sets[first_set].first, end = sets[end_set - 1].first + sets[end_set - 1].count;
    KellerStatus status = KELLER_OK;
    for (uint32_t at = first; at < end && status == KELLER_OK; at += BLOCK)
        status = run_block(s, &sets[first_set], at, end - at < BLOCK ? end - at : BLOCK, NULL, 0, NULL, error);
    return status;
}

/* The wedges that any of the points sees directly, as an accelerator of their own. */
static KellerStatus visible_wedges(Simulation *s, uint32_t count, const KellerVec3 *points, TreeWork *work,
                                   KellerAccel **accel, KellerError *error)
{
    uint8_t uses[8] = {0};
    TreePlan plan = {1, uses};
    plan.of[pattern_and(PATTERN_EMPTY, true)] = PLAN_WANT;
    plan_uses(&plan);
    TreeLimits limits = {.scene = s->scene, .accel = s->accel, .plan = &plan, .tan_aperture = tan(s->config->cone),
                         .split_over = s->config->split_over, .transmissions = s->join.transmissions,
                         .interactions = s->join.interactions};
    uint8_t *seen = calloc(s->scene->wedge_count + 1, sizeof *seen);
    uint32_t *wedges = malloc((s->scene->wedge_count + 1) * sizeof *wedges), n = 0;
    KellerStatus status = seen && wedges ? KELLER_OK : keller_error_memory(error, s->scene->wedge_count * sizeof *wedges);
    for (uint32_t i = 0; i < count && status == KELLER_OK; i++) {
        Trie trie;
        status = tree_search(&limits, points[i], s->work->threads, &trie, NULL, work, error);
        if (status != KELLER_OK) break;
        for (uint32_t j = 1; j < trie.count; j++) seen[code_id(trie.nodes[j].code)] = 1;
        trie_free(&trie);
    }
    for (uint32_t i = 0; i < s->scene->wedge_count && status == KELLER_OK; i++)
        if (seen[i]) wedges[n++] = i;
    if (status == KELLER_OK) status = keller_accel_build_wedges(s->scene, n, wedges, accel, error);
    free(seen);
    free(wedges);
    return status;
}

/* For the longest paths with a wedge next to one end, the other end need only look for wedges that this end sees. With
 * many receivers nearly all are seen by one or another, so there the transmitter looks for all. */
static KellerStatus find_targets(Simulation *s, TreeWork *work, KellerError *error)
{
    const KellerConfig *c = s->config;
    KellerVec3 points[TARGET_RECEIVERS];
    uint32_t n = 0, total = 0;
    if (s->join.diffractions == 0 || s->join.alone) return KELLER_OK;
    KellerStatus status = visible_wedges(s, 1, &c->transmitters[s->tx].station.position, work, &s->seen_by_tx, error);
    for (size_t i = 0; i < c->set_count; i++) {
        if (searched_alone(s, &c->sets[i])) continue;
        total += c->sets[i].count;
        for (uint32_t j = 0; j < c->sets[i].count && n < TARGET_RECEIVERS; j++)
            points[n++] = c->receivers[c->sets[i].first + j].station.position;
    }
    if (status == KELLER_OK && n == total) status = visible_wedges(s, n, points, work, &s->seen_by_rx, error);
    return status;
}

static void forget_forward(Simulation *s)
{
    ends_free(&s->forward);
    for (int i = 0; i < 2; i++) plan_free(&s->plan[i]);
    edge_ways_free(s->lit);
    s->lit = NULL;
    keller_accel_free(s->seen_by_tx);
    keller_accel_free(s->seen_by_rx);
    s->seen_by_tx = s->seen_by_rx = NULL;
}

/* The transmitter's side of the search: all of it (alone), or to where it meets that of each receiver. */
static KellerStatus search_forward(Simulation *s, bool alone, KellerError *error)
{
    const KellerConfig *c = s->config;
    TreeLimits forward = {.scene = s->scene, .accel = s->accel, .tan_aperture = tan(c->cone),
                          .split_over = c->split_over, .transmissions = s->join.transmissions,
                          .interactions = s->join.interactions, .target_length = s->join.bends};
    const KellerVec3 tx = c->transmitters[s->tx].station.position;
    TreeWork work = {0};
    double start = omp_get_wtime();
    s->backward = forward;
    if (!plan_init(&s->plan[0], s->join.bends) || !plan_init(&s->plan[1], s->join.bends))
        return keller_error_memory(error, (size_t)4 << s->join.bends);
    s->edges.limits = forward;
    KellerStatus status = KELLER_OK;
    if (s->whole_edges) status = edge_ways_find(&s->edges, tx, s->work->threads, &s->lit, &work, error);
    s->join.alone = plan_is_alone(s->join.diffractions, s->join.bends, c->receiver_count);
    if (alone || s->join.alone) plan_alone(c->reflections, s->join.diffractions, &s->plan[0]); /* each part of a grid has its own search */
    else plan_ends(c->reflections, s->join.diffractions, &s->plan[0], &s->plan[1]);
    if (status == KELLER_OK && !alone) status = find_targets(s, &work, error);
    forward.plan = &s->plan[0];
    s->backward.plan = &s->plan[1];
    forward.targets = s->seen_by_rx;
    s->backward.targets = s->seen_by_tx;
    s->backward.target_end = &c->transmitters[s->tx].station.position;
    if (status == KELLER_OK && !alone) status = ends_search(&s->forward, &forward, tx, s->work->threads, s->join.diffractions > 1, &work, error);
    s->work->seconds_search += omp_get_wtime() - start;
    s->work->cones += work.cones;
    s->work->nodes += work.accel.nodes;
    s->work->triangles += work.accel.triangles;
    return status;
}

static KellerStatus run_transmitter(Simulation *s, KellerError *error)
{
    const KellerConfig *c = s->config;
    int searched = -1; /* alone, or not */
    TreeWork work = {0};
    double start = omp_get_wtime();
    KellerStatus status = scattering_from(&s->scattering, c->transmitters[s->tx].station.position, s->work->threads, &work, error);
    s->work->seconds_search += omp_get_wtime() - start;
    s->work->cones += work.cones;
    s->work->nodes += work.accel.nodes;
    s->work->triangles += work.accel.triangles;
    for (uint32_t i = 0; i < c->set_count && status == KELLER_OK;) {
        bool grid = c->sets[i].kind == KELLER_SET_GRID, alone = searched_alone(s, &c->sets[i]);
        uint32_t end = i + 1;
        while (!grid && end < c->set_count && c->sets[end].kind != KELLER_SET_GRID) end++;
        s->worth = alone ? 1 - SEARCH_SHARE : 1;
        if (searched != alone && !s->known) {
            forget_forward(s);
            status = search_forward(s, alone, error);
            searched = alone;
        }
        if (status == KELLER_OK) status = grid ? run_grid(s, i, error) : run_points(s, i, end, error);
        i = end;
    }
    forget_forward(s);
    return status;
}

static KellerStatus simulate(const KellerConfig *config, const KellerScene *scene, const KellerAccel *accel,
                             const KellerPathSource *known, const KellerSink *sink, KellerSimulationWork *work, KellerError *error)
{
    memset(work, 0, sizeof *work);
    KellerStatus status = keller_simulation_check(config, scene, error);
    if (status != KELLER_OK) return status;
    work->threads = config->threads ? config->threads : (uint32_t)omp_get_num_procs();
    KellerMedium *media;
    status = keller_media_table(scene, config->frequency_count, config->frequencies, &media, error);
    if (status != KELLER_OK) return status;
    FaceBox *boxes = face_boxes(scene);
    if (!boxes) {
        free(media);
        return keller_error_memory(error, scene->face_count * sizeof *boxes);
    }
    Simulation s = {.config = config, .scene = scene, .accel = accel, .known = known, .sink = sink, .work = work};
    s.fields = (FieldContext){config, scene, media};
    s.total = (double)config->transmitter_count * (double)config->receiver_count;
    s.join = (JoinLimits){.scene = scene, .accel = accel, .boxes = boxes, .reflections = config->reflections,
                          .diffractions = config->diffractions, .transmissions = config->transmissions,
                          .interactions = config->interactions, .bends = path_longest_sequence(config)};
    s.whole_edges = scene->sound.edges == KELLER_EDGES_BTM && scene->sound.speed > 0 && s.join.diffractions > 0 && s.join.bends > 0;
    if (s.whole_edges) {
        s.join.diffractions = 0;
        s.join.bends = least(config->interactions, config->reflections);
        s.edges.reflections = least(config->interactions - 1, config->reflections);
    }
    if (sink->response && scene->sound.speed > 0 && config->response_rate > 0) {
        s.responses = response_plan(config, scene, error);
        if (!s.responses) status = KELLER_FAILED;
    }
    if (status == KELLER_OK && !known) status = scattering_init(&s.scattering, config, scene, accel, boxes, error);
    for (s.tx = 0; s.tx < config->transmitter_count && status == KELLER_OK; s.tx++) status = run_transmitter(&s, error);
    if (status == KELLER_OK && sink->paths) status = flush(&s, true, error);
    if (status == KELLER_OK) report(&s, 1);
    scattering_free(&s.scattering);
    response_plan_free(s.responses);
    batch_free(&s.batch);
    free(boxes);
    free(media);
    return status;
}

KellerStatus keller_simulate(const KellerConfig *config, const KellerScene *scene, const KellerAccel *accel,
                             const KellerSink *sink, KellerSimulationWork *work, KellerError *error)
{
    return simulate(config, scene, accel, NULL, sink, work, error);
}

KellerStatus keller_simulate_known(const KellerConfig *config, const KellerScene *scene, const KellerPathSource *source,
                                   const KellerSink *sink, KellerSimulationWork *work, KellerError *error)
{
    return simulate(config, scene, NULL, source, sink, work, error);
}
