/* A whole simulation: for each transmitter its tree once, then the receivers in units (a point, or a patch of a grid),
 * each with its own tree from the other end. Units are worked on in parallel in blocks and handed out in order. */
#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

#include "path/batch.h"
#include "path/edge_ends.h"
#include "path/field.h"
#include "path/join.h"
#include "path/level.h"
#include "path/response.h"
#include "path/scatter.h"
#include "base/number.h"

enum {
    PATCH = 8,              /* cells along a side of a patch */
    BLOCK = 128,            /* points of a route worked on together */
    TARGET_RECEIVERS = 64,  /* points up to which the transmitter's search is aimed at what they see */
    BATCH = 8192            /* paths handed to the sink at once */
};

typedef struct {
    uint32_t count;
    uint32_t receiver[PATCH * PATCH];
} Unit;

typedef struct {
    const KellerConfig *config;
    const KellerScene *scene;
    const KellerAccel *accel;
    const KellerSink *sink;
    KellerSimulationWork *work;
    FieldContext fields;
    uint32_t tx;
    Ends forward;
    TreeLimits backward;
    TreePlan plan[2];           /* of the transmitter's and of the receivers' side */
    KellerAccel *seen_by_tx, *seen_by_rx;   /* wedges in sight of the ends; NULL: not computed */
    JoinLimits join;
    KellerPathBatch batch;
    Patches patches;            /* of all faces that scatter, if asked for */
    uint32_t *seen_patches;     /* from the transmitter, the first seen_count */
    size_t seen_count;
    ResponsePlan *responses;    /* NULL: none are asked for */
    uint64_t done, total;       /* receivers, times transmitters */
} Simulation;

/* Reflections and diffractions that one path may have together. */
static uint32_t longest_sequence(const KellerConfig *config)
{
    uint32_t orders = config->reflections + config->diffractions;
    return config->interactions < orders ? config->interactions : orders;
}

KellerStatus keller_simulation_check(const KellerConfig *config, const KellerScene *scene, KellerError *error)
{
    const char *file = config->file;
    int line = config->paths_line;
    if (config->interactions > KELLER_MAX_INTERACTIONS)
        return keller_error(error, KELLER_BAD_INPUT, "%s:%d: interactions=\"%u\" is too many; expected at most %d", file,
                            line, config->interactions, KELLER_MAX_INTERACTIONS);
    uint32_t bends = longest_sequence(config);
    if (bends > KELLER_MAX_BENDS)
        return keller_error(error, KELLER_BAD_INPUT,
                            "%s:%d: up to %u reflections and diffractions on one path are too many; expected at most %d, or "
                            "interactions=\"...\" to bound them",
                            file, line, bends, KELLER_MAX_BENDS);
    if (scene->sound.speed > 0 && path_sound_check(config, scene, error) != KELLER_OK) return KELLER_BAD_INPUT;
    for (size_t f = 0; f < config->frequency_count; f++) {
        KellerMedium *media;
        KellerError inner;
        KellerStatus status = keller_media_table(scene, 1, &config->frequencies[f], &media, &inner);
        if (status != KELLER_OK)
            return keller_error(error, status, "%s:%d: %s", file,
                                config->frequency_lines ? config->frequency_lines[f] : 0, inner.message);
        free(media);
    }
    return KELLER_OK;
}

/* The corners of the patch that the unit's receivers span (all at one height), or the point itself. */
static uint32_t unit_hull(const KellerConfig *config, const Unit *unit, KellerVec3 hull[SOURCES])
{
    KellerVec3 lo = config->receivers[unit->receiver[0]].station.position, hi = lo;
    for (uint32_t i = 1; i < unit->count; i++) {
        KellerVec3 p = config->receivers[unit->receiver[i]].station.position;
        lo = v3(lesser(lo.x, p.x), lesser(lo.y, p.y), lesser(lo.z, p.z));
        hi = v3(greater(hi.x, p.x), greater(hi.y, p.y), greater(hi.z, p.z));
    }
    uint32_t n = 0;
    hull[n++] = lo;
    if (hi.x > lo.x) hull[n++] = v3(hi.x, lo.y, lo.z);
    if (hi.y > lo.y) {
        hull[n++] = v3(lo.x, hi.y, lo.z);
        if (hi.x > lo.x) hull[n++] = v3(hi.x, hi.y, lo.z);
    }
    return n;
}

/* Slabs that a scattered path may pass through. */
static uint32_t slabs_of_scattered(const KellerConfig *config)
{
    return config->transmissions < config->interactions ? config->transmissions : config->interactions - 1;
}

/* All paths of one unit; results[i] belongs to its i-th receiver. `threads` > 1 where there are no other units. */
static KellerStatus run_unit(Simulation *s, const Unit *unit, uint32_t threads, PairResult *results,
                             KellerSimulationWork *work, KellerError *error)
{
    KellerVec3 hull[SOURCES], rx[PATCH * PATCH];
    PathList lists[PATCH * PATCH];
    memset(lists, 0, sizeof lists);
    uint32_t hull_count = unit_hull(s->config, unit, hull);
    for (uint32_t i = 0; i < unit->count; i++) rx[i] = s->config->receivers[unit->receiver[i]].station.position;
    JoinLimits join = s->join;
    join.threads = threads;
    Ends backward;
    TreeWork tree_work = {0};
    JoinWork join_work = {0};
    double start = omp_get_wtime();
    KellerStatus status = ends_search(&backward, &s->backward, hull_count, hull, threads, &tree_work, error);
    double middle = omp_get_wtime();
    if (status != KELLER_OK) return status;
    status = join_ends(&join, &s->forward, &backward, s->config->transmitters[s->tx].station.position, unit->count, rx,
                       hull_count, hull, lists, &join_work, error);
    ends_free(&backward);
    bool ends = s->scene->sound.edges == KELLER_EDGES_BTM && s->join.diffractions > 0 && s->join.bends > 0;
    for (uint32_t i = 0; i < unit->count; i++) {
        if (status == KELLER_OK && ends &&
            !edge_ends_add(s->scene, s->accel, s->config->transmitters[s->tx].station.position, rx[i], &lists[i],
                           &join_work.accel))
            status = keller_error(error, KELLER_FAILED, "out of memory for the paths by ends of edges");
        if (status == KELLER_OK && s->seen_count > 0 &&
            !scatter_add(s->scene, s->accel, s->config->transmitters[s->tx].station.position, rx[i], slabs_of_scattered(s->config),
                         &s->patches, s->seen_count, s->seen_patches, &lists[i], &join_work.accel))
            status = keller_error(error, KELLER_FAILED, "out of memory for the scattered paths");
        path_list_merge_corners(s->scene, &lists[i]);
        results[i].paths = lists[i];
        work->valid_paths += lists[i].count;
        if (status == KELLER_OK && !pair_fields(&s->fields, s->tx, unit->receiver[i], &results[i], work))
            status = keller_error(error, KELLER_FAILED, "out of memory for the fields of the paths");
    }
    work->seconds_search += middle - start;
    work->seconds_solve += omp_get_wtime() - middle;
    work->cones += tree_work.cones;
    work->nodes += tree_work.accel.nodes + join_work.accel.nodes;
    work->triangles += tree_work.accel.triangles + join_work.accel.triangles;
    work->candidates += join_work.candidates + s->seen_count * unit->count;
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
    KellerStatus status = response_of(s->responses, s->config, s->scene, s->tx, rx, &pair->paths, &response, error);
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

/* Works on the receivers first .. first + count - 1 of a set, cut into `unit_count` units, and hands them out in order. */
static KellerStatus run_block(Simulation *s, const KellerReceiverSet *set, uint32_t first, uint32_t count,
                              const Unit *units, uint32_t unit_count, KellerCoverage *coverage, KellerError *error)
{
    PairResult *results = calloc(count, sizeof *results);
    if (!results) return keller_error_memory(error, count * sizeof *results);
    uint32_t threads = s->work->threads, across = unit_count > 1 ? threads : 1, within = unit_count > 1 ? 1 : threads;
    KellerStatus status = KELLER_OK;
    uint32_t finished = 0;
#pragma omp parallel num_threads((int)across) if (across > 1)
    {
        KellerSimulationWork work = {0};
#pragma omp for schedule(dynamic, 1)
        for (uint32_t u = 0; u < unit_count; u++) {
            KellerStatus seen;
#pragma omp atomic read
            seen = status;
            if (seen != KELLER_OK) continue;
            PairResult own[PATCH * PATCH];
            memset(own, 0, sizeof own);
            KellerError own_error;
            KellerStatus own_status = run_unit(s, &units[u], within, own, &work, &own_error);
            for (uint32_t i = 0; i < units[u].count; i++) results[units[u].receiver[i] - first] = own[i];
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
            now = finished += units[u].count;
            if (s->sink->progress && omp_get_thread_num() == 0)
                s->sink->progress(s->sink->context, (double)(s->done + now) / (double)s->total);
        }
#pragma omp critical(keller_simulate)
        add_work(s->work, &work);
    }
    for (uint32_t i = 0; i < count; i++) {
        if (status == KELLER_OK && coverage) coverage_cell(coverage, first - set->first + i, path_wave_speed(s->scene),
                                                           &results[i]);
        if (status == KELLER_OK && coverage && coverage->level)
            level_cell(coverage, first - set->first + i, &s->fields, &results[i]);
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
    s->done += count;
    return status;
}

/* A grid in bands of PATCH rows, each band in patches. */
static KellerStatus run_grid(Simulation *s, uint32_t set_index, KellerError *error)
{
    const KellerReceiverSet *set = &s->config->sets[set_index];
    uint32_t patches = (set->nx + PATCH - 1) / PATCH;
    bool maps = s->sink->coverage && s->config->output_coverage;
    KellerCoverage coverage = {0};
    Unit *units = malloc(patches * sizeof *units);
    bool room = !maps || coverage_init(&coverage, s->tx, set_index, set->ny, set->nx, s->config->frequency_count);
    if (room && maps && s->scene->sound.speed > 0) room = level_init(&coverage);
    if (!units || !room) {
        coverage_free(&coverage);
        free(units);
        return keller_error(error, KELLER_FAILED, "out of memory for a grid of %u x %u cells", set->ny, set->nx);
    }
    KellerStatus status = KELLER_OK;
    for (uint32_t y = 0; y < set->ny && status == KELLER_OK; y += PATCH) {
        uint32_t rows = set->ny - y < PATCH ? set->ny - y : PATCH;
        for (uint32_t p = 0; p < patches; p++) {
            units[p].count = 0;
            for (uint32_t j = 0; j < rows; j++)
                for (uint32_t x = p * PATCH; x < set->nx && x < (p + 1) * PATCH; x++)
                    units[p].receiver[units[p].count++] = set->first + (y + j) * set->nx + x;
        }
        status = run_block(s, set, set->first + y * set->nx, rows * set->nx, units, patches, maps ? &coverage : NULL, error);
    }
    if (status == KELLER_OK && maps) status = s->sink->coverage(s->sink->context, &coverage, error);
    coverage_free(&coverage);
    free(units);
    return status;
}

static KellerStatus run_points(Simulation *s, uint32_t first_set, uint32_t end_set, KellerError *error)
{
    const KellerReceiverSet *sets = s->config->sets;
    uint32_t first = sets[first_set].first, end = sets[end_set - 1].first + sets[end_set - 1].count;
    Unit *units = malloc(BLOCK * sizeof *units);
    if (!units) return keller_error_memory(error, BLOCK * sizeof *units);
    KellerStatus status = KELLER_OK;
    for (uint32_t at = first; at < end && status == KELLER_OK; at += BLOCK) {
        uint32_t n = end - at < BLOCK ? end - at : BLOCK;
        for (uint32_t i = 0; i < n; i++) {
            units[i].count = 1;
            units[i].receiver[0] = at + i;
        }
        status = run_block(s, &sets[first_set], at, n, units, n, NULL, error);
    }
    free(units);
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
        status = tree_search(&limits, 1, &points[i], s->work->threads, &trie, work, error);
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
static KellerStatus find_targets(Simulation *s, bool grids, TreeWork *work, KellerError *error)
{
    const KellerConfig *c = s->config;
    KellerVec3 points[TARGET_RECEIVERS];
    uint32_t n = 0, total = 0;
    if (c->diffractions == 0 || s->join.bends < 2) return KELLER_OK;
    KellerStatus status = visible_wedges(s, 1, &c->transmitters[s->tx].station.position, work, &s->seen_by_tx, error);
    if (grids) return status;
    for (size_t i = 0; i < c->set_count; i++) {
        if (c->sets[i].kind == KELLER_SET_GRID) continue;
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
    keller_accel_free(s->seen_by_tx);
    keller_accel_free(s->seen_by_rx);
    s->seen_by_tx = s->seen_by_rx = NULL;
}

/* The transmitter's side of the search, for points or for grids. */
static KellerStatus search_forward(Simulation *s, bool grids, KellerError *error)
{
    const KellerConfig *c = s->config;
    TreeLimits forward = {.scene = s->scene, .accel = s->accel, .tan_aperture = tan(c->cone),
                          .split_over = c->split_over, .transmissions = s->join.transmissions,
                          .interactions = s->join.interactions, .target_length = s->join.bends};
    TreeWork work = {0};
    double start = omp_get_wtime();
    s->backward = forward;
    KellerStatus status = find_targets(s, grids, &work, error);
    if (status != KELLER_OK) return status;
    if (!plan_init(&s->plan[0], s->join.bends) || !plan_init(&s->plan[1], s->join.bends))
        return keller_error_memory(error, (size_t)4 << s->join.bends);
    plan_ends(c->reflections, c->diffractions, grids, &s->plan[0], &s->plan[1]);
    forward.plan = &s->plan[0];
    s->backward.plan = &s->plan[1];
    s->join.grids = grids;
    forward.targets = s->seen_by_rx;
    s->backward.targets = s->seen_by_tx;
    status = ends_search(&s->forward, &forward, 1, &c->transmitters[s->tx].station.position, s->work->threads, &work, error);
    s->work->seconds_search += omp_get_wtime() - start;
    s->work->cones += work.cones;
    s->work->nodes += work.accel.nodes;
    s->work->triangles += work.accel.triangles;
    return status;
}

static KellerStatus run_transmitter(Simulation *s, KellerError *error)
{
    const KellerConfig *c = s->config;
    KellerStatus status = KELLER_OK;
    int searched = -1; /* 0: for points, 1: for grids */
    if (s->patches.count > 0) {
        KellerAccelWork work = {0};
        s->seen_count = patches_seen(s->scene, s->accel, c->transmitters[s->tx].station.position, slabs_of_scattered(c),
                                     s->work->threads, &s->patches, s->seen_patches, &work);
        s->work->nodes += work.nodes;
        s->work->triangles += work.triangles;
    }
    for (uint32_t i = 0; i < c->set_count && status == KELLER_OK;) {
        bool grid = c->sets[i].kind == KELLER_SET_GRID;
        uint32_t end = i + 1;
        while (!grid && end < c->set_count && c->sets[end].kind != KELLER_SET_GRID) end++;
        if (searched != grid) {
            forget_forward(s);
            status = search_forward(s, grid, error);
            searched = grid;
        }
        if (status == KELLER_OK) status = grid ? run_grid(s, i, error) : run_points(s, i, end, error);
        i = end;
    }
    forget_forward(s);
    return status;
}

KellerStatus keller_simulate(const KellerConfig *config, const KellerScene *scene, const KellerAccel *accel,
                             const KellerSink *sink, KellerSimulationWork *work, KellerError *error)
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
    Simulation s = {.config = config, .scene = scene, .accel = accel, .sink = sink, .work = work};
    s.fields = (FieldContext){config, scene, media};
    s.total = (uint64_t)config->transmitter_count * config->receiver_count;
    s.join = (JoinLimits){.scene = scene, .accel = accel, .boxes = boxes, .reflections = config->reflections,
                          .diffractions = config->diffractions, .transmissions = config->transmissions,
                          .interactions = config->interactions, .bends = longest_sequence(config)};
    if (sink->response && scene->sound.speed > 0 && config->response_rate > 0) {
        s.responses = response_plan(config, scene, error);
        if (!s.responses) status = KELLER_FAILED;
    }
    if (status == KELLER_OK && config->scattering > 0 && config->interactions > 0) {
        KellerError inner;
        status = patches_of(scene, config->patch, &s.patches, &inner);
        if (status != KELLER_OK) keller_error(error, status, "%s:%d: %s", config->file, config->paths_line, inner.message);
        s.seen_patches = malloc((s.patches.count + 1) * sizeof *s.seen_patches);
        if (status == KELLER_OK && !s.seen_patches) status = keller_error_memory(error, s.patches.count * sizeof *s.seen_patches);
    }
    for (s.tx = 0; s.tx < config->transmitter_count && status == KELLER_OK; s.tx++) status = run_transmitter(&s, error);
    if (status == KELLER_OK && sink->paths) status = flush(&s, true, error);
    if (status == KELLER_OK && sink->progress) sink->progress(sink->context, 1);
    patches_free(&s.patches);
    free(s.seen_patches);
    response_plan_free(s.responses);
    batch_free(&s.batch);
    free(boxes);
    free(media);
    return status;
}
