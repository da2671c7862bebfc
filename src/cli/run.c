#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include "base/progress.h"
#include "cli/cli.h"
#include "cli/reuse.h"
#include "cli/summary.h"
#include "io/result_write.h"
#include "keller/accel.h"
#include "keller/path.h"

typedef struct {
    const char *config, *output;
    const char *reuse;          /* a result whose paths are known; NULL: they are searched */
    bool force, quiet, verbose, has_threads;
    uint32_t threads;
    KellerVariables variables;
    char *default_output, *command_line;    /* owned */
} Options;

typedef struct {
    const KellerConfig *config;
    KellerResult *result;
    KellerProgress progress;
    KellerSummary summary;
} Run;

/* ---- arguments ------------------------------------------------------------------------------------------------- */

static KellerStatus parse(int argc, char **argv, Options *o, KellerError *error)
{
    enum { OUTPUT, THREADS, DEFINE, REUSE, RESUME, FORCE, QUIET, VERBOSE };
    static const KellerOption options[] = {{"output", 'o', true}, {"threads", 'j', true}, {NULL, 'D', true},
                                           {"reuse", 0, true},    {"resume", 0, false},   {"force", 0, false},
                                           {"quiet", 'q', false}, {"verbose", 'v', false}, {0}};
    KellerArguments arguments = {.verb = "run", .argc = argc, .argv = argv};
    const char *value;
    for (;;) {
        KellerStatus status = KELLER_OK;
        switch (keller_next_argument(&arguments, options, &value, error)) {
        case OUTPUT: o->output = value; break;
        case THREADS:
            o->has_threads = true;
            status = keller_whole_number("run", "-j", value, 0, 4096, &o->threads, error);
            break;
        case DEFINE: status = keller_variables_add(&o->variables, "run", value, error); break;
        case REUSE: o->reuse = value; break;
        case RESUME: return keller_usage(error, "run", "--resume: this version does not resume runs");
        case FORCE: o->force = true; break;
        case QUIET: o->quiet = true; break;
        case VERBOSE: o->verbose = true; break;
        case KELLER_ARGUMENT_OPERAND:
            if (o->config) return keller_usage(error, "run", "\"%s\" is one configuration too many", value);
            o->config = value;
            break;
        case KELLER_ARGUMENT_END:
            if (!o->config) return keller_usage(error, "run", "a configuration is expected");
            if (o->quiet && o->verbose) return keller_usage(error, "run", "-q and -v exclude each other");
            return KELLER_OK;
        default: return KELLER_USAGE;
        }
        if (status != KELLER_OK) return status;
    }
}

/* The configuration's base name with .h5, in the current folder. */
static char *output_of(const char *config)
{
    const char *slash = strrchr(config, '/'), *name = slash ? slash + 1 : config, *dot = strrchr(name, '.');
    size_t length = dot && dot > name ? (size_t)(dot - name) : strlen(name);
    char *output = malloc(length + 4);
    if (output) sprintf(output, "%.*s.h5", (int)length, name);
    return output;
}

/* The command as a shell would take it back. */
static char *command_line_of(int argc, char **argv)
{
    size_t size = sizeof "keller run";
    for (int i = 0; i < argc; ++i) size += 4 * strlen(argv[i]) + 3;
    char *line = malloc(size), *end = line;
    if (!line) return NULL;
    end += sprintf(end, "keller run");
    static const char plain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-./=:,+@%";
    for (int i = 0; i < argc; ++i) {
        *end++ = ' ';
        if (argv[i][0] && argv[i][strspn(argv[i], plain)] == '\0') {
            end += sprintf(end, "%s", argv[i]);
            continue;
        }
        *end++ = '\'';
        for (const char *c = argv[i]; *c; ++c) {
            if (*c == '\'') end += sprintf(end, "'\\''");
            else *end++ = *c;
        }
        *end++ = '\'';
    }
    *end = '\0';
    return line;
}

/* ---- the simulation's sink -------------------------------------------------------------------------------------- */

static KellerStatus take_paths(void *context, const KellerPathBatch *batch, KellerError *error)
{
    Run *run = context;
    keller_summary_paths(&run->summary, batch);
    return run->config->output_paths ? keller_result_append(run->result, batch, error) : KELLER_OK;
}

static KellerStatus take_map(void *context, const KellerCoverage *map, KellerError *error)
{
    Run *run = context;
    keller_summary_map(&run->summary, map);
    return keller_result_coverage(run->result, map, error);
}

static KellerStatus take_pair(void *context, const KellerPairSums *sums, KellerError *error)
{
    return keller_result_pair(((Run *)context)->result, sums, error);
}

static KellerStatus take_response(void *context, const KellerResponse *response, KellerError *error)
{
    return keller_result_response(((Run *)context)->result, response, error);
}

static void take_progress(void *context, double fraction)
{
    keller_progress_update(&((Run *)context)->progress, fraction);
}

/* ---- statistics -------------------------------------------------------------------------------------------------- */

typedef struct {
    double accelerator, simulation, total;      /* s */
    const char *accelerator_name;
    KellerSimulationWork work;
    uint64_t reused;                            /* paths of an earlier result */
    KellerDropped dropped;                      /* by the runs that it comes from */
} Measured;

static double peak_memory(void)
{
    struct rusage usage;
    return getrusage(RUSAGE_SELF, &usage) == 0 ? 1024.0 * (double)usage.ru_maxrss : 0;
}

/* dB: what was dropped changes a pair's sum by at most so much against its strongest path. */
static double dropped_bound(double ratio) { return 20 * log10(ratio); }

static KellerStatus write_statistics(KellerResult *result, const KellerPrepared *p, const Measured *m,
                                     KellerError *error)
{
    const KellerStripCount strips = keller_count_strips(&p->config, &p->scene);
    const struct { const char *name; double value; const char *unit; } rows[] = {
        {"time_configuration", p->seconds_configuration, "s"}, {"time_read", p->seconds_read, "s"},
        {"time_scene", p->seconds_scene, "s"}, {"time_accelerator", m->accelerator, "s"},
        {"time_simulation", m->simulation, "s"}, {"time_search", m->work.seconds_search, "s"},
        {"time_solve", m->work.seconds_solve, "s"}, {"time_total", m->total, "s"},
        {"cones_traced", (double)m->work.cones, "1"}, {"nodes_visited", (double)m->work.nodes, "1"},
        {"triangles_visited", (double)m->work.triangles, "1"}, {"candidates", (double)m->work.candidates, "1"},
        {"valid_paths", (double)m->work.valid_paths, "1"}, {"dropped_paths", (double)m->work.dropped_paths, "1"},
        {"dropped_bound", dropped_bound(m->work.dropped_ratio), "dB"}, {"boundary_paths", (double)m->work.boundary_paths, "1"},
        {"cornered_paths", (double)m->work.cornered_paths, "1"}, {"crowded_paths", (double)m->work.crowded_paths, "1"},
        {"edges_as_one", (double)strips.partly, "1"},
        {"reused_paths", (double)m->reused, "1"}, {"reused_dropped_paths", m->dropped.paths, "1"},
        {"reused_dropped_bound", dropped_bound(m->dropped.ratio), "dB"},
        {"complete_reflections", p->config.reflections, "1"}, {"complete_diffractions", p->config.diffractions, "1"},
        {"complete_transmissions", p->config.transmissions, "1"}, {"complete_scattering", p->config.scattering, "1"},
        {"complete_with_scattering", p->config.with_scattering, "1"},
        {"complete_interactions", p->config.interactions, "1"},
        {"threads", m->work.threads, "1"}, {"peak_memory", peak_memory(), "B"}};
    KellerStatus status = keller_result_statistic_text(result, "accelerator", m->accelerator_name, error);
    for (size_t i = 0; i < sizeof rows / sizeof *rows && status == KELLER_OK; ++i)
        status = keller_result_statistic(result, rows[i].name, rows[i].value, rows[i].unit, error);
    return status;
}

/* What a run that searched nothing did instead. */
static void print_reused(const char *file, const Measured *m)
{
    keller_row("reused", "%llu paths of %s; nothing was searched", (unsigned long long)m->reused, file);
    if (m->dropped.paths > 0 && !(m->dropped.ratio > 0))
        keller_row("missing", "%.0f that it had dropped as they had no field there; what they are here is not known", m->dropped.paths);
    else if (m->dropped.paths > 0)
        keller_row("missing", "%.0f that it had dropped as too weak: there of a pair together %.1f dB against its strongest, at most; "
                   "what they are here is not known", m->dropped.paths, dropped_bound(m->dropped.ratio));
}

static void print_statistics(const KellerPrepared *p, const char *reused, const Measured *m)
{
    printf("work\n");
    if (reused) {
        print_reused(reused, m);
    } else {
        keller_row("cones", "%llu", (unsigned long long)m->work.cones);
        keller_row("candidates", "%llu, of which %llu are paths", (unsigned long long)m->work.candidates,
                   (unsigned long long)m->work.valid_paths);
    }
    const KellerConfig *c = &p->config;
    keller_row("complete", "to reflections %u, diffractions %u, transmissions %u, interactions %u", c->reflections,
               c->diffractions, c->transmissions, c->interactions);
    if (m->work.dropped_paths > 0)
        keller_row("dropped", "%llu as too weak: of a pair together %.1f dB against its strongest, at most",
                   (unsigned long long)m->work.dropped_paths, dropped_bound(m->work.dropped_ratio));
    if (m->work.boundary_paths > 0)
        keller_row("too close to call", "%llu exactly on a boundary, each with its share", (unsigned long long)m->work.boundary_paths);
    if (m->work.cornered_paths > 0)
        keller_row("beyond the theory", "%llu on two boundaries at once: their shares are estimates, some 3 dB off; move an end by a hair",
                   (unsigned long long)m->work.cornered_paths);
    if (m->work.crowded_paths > 0)
        keller_row("beyond the theory", "%llu over three or more edges, not parallel, within each other's transition zones",
                   (unsigned long long)m->work.crowded_paths);
    keller_row("accelerator", "%s, %u thread%s, %.0f MB at most", m->accelerator_name, m->work.threads,
               m->work.threads == 1 ? "" : "s", peak_memory() / 1e6);
    printf("time/s\n");
    keller_row("configuration", "%9.3f", p->seconds_configuration);
    keller_row("reading", "%9.3f", p->seconds_read);
    keller_row("scene", "%9.3f", p->seconds_scene);
    keller_row("accelerator", "%9.3f", m->accelerator);
    keller_row("simulation", "%9.3f", m->simulation);
    keller_row("all", "%9.3f", m->total);
}

/* ---- the run ----------------------------------------------------------------------------------------------------- */

static KellerStatus simulate(const Options *o, KellerPrepared *p, KellerReuse *reuse, double start, KellerInterrupt *interrupt,
                             KellerError *error)
{
    Measured m = {.accelerator_name = "none", .dropped = reuse->dropped};
    KellerAccel *accel = NULL;
    KellerPathSource known = {0};
    double before = keller_seconds();
    KellerStatus status = o->reuse ? keller_reuse_start(reuse, &p->config, &p->scene, &known, error)
                                   : keller_accel_build(p->config.accelerator, &p->scene, &accel, error);
    if (status != KELLER_OK) return status;
    m.accelerator = keller_seconds() - before;
    if (accel) m.accelerator_name = keller_accel_name(accel);

    Run run = {.config = &p->config};
    keller_interrupt_hold(interrupt);
    status = keller_result_begin(o->output, o->force, &p->config, &run.result, error);
    keller_interrupt_release(interrupt, run.result ? keller_result_temporary(run.result) : NULL);
    if (status != KELLER_OK) {
        keller_accel_free(accel);
        return status;
    }
    status = keller_result_fill(run.result, &p->scene, o->command_line, error);
    KellerSink sink = {.context = &run, .paths = take_paths, .coverage = take_map, .progress = take_progress,
                       .response = take_response, .pair = take_pair};
    if (o->verbose) fprintf(stderr, "keller: simulating\n");
    keller_progress_start(&run.progress, o->quiet ? NULL : stderr, "keller: simulating");
    before = keller_seconds();
    if (status == KELLER_OK && o->reuse) status = keller_simulate_known(&p->config, &p->scene, &known, &sink, &m.work, error);
    else if (status == KELLER_OK) status = keller_simulate(&p->config, &p->scene, accel, &sink, &m.work, error);
    if (status == KELLER_OK && o->reuse) status = keller_known_count(reuse->known, &m.reused, error);
    m.simulation = keller_seconds() - before;
    keller_progress_stop(&run.progress);

    m.total = keller_seconds() - start;
    if (status == KELLER_OK) status = write_statistics(run.result, p, &m, error);
    if (status == KELLER_OK) {
        if (o->verbose) fprintf(stderr, "keller: completing %s\n", o->output);
        status = keller_result_finish(run.result, error);
    } else {
        keller_result_abandon(run.result);
    }
    if (status == KELLER_OK) {
        keller_print_scene(&p->soup, &p->scene, o->verbose);
        keller_print_surfaces(&p->config);
        keller_print_opaque(&p->config, &p->scene);
        keller_print_strips(&p->config, &p->scene);
        keller_summary_print(&run.summary, &p->config);
        print_statistics(p, o->reuse, &m);
        printf("result\n");
        keller_row("file", "%s", o->output);
    }
    keller_accel_free(accel);
    return status;
}

static KellerStatus refuse_inputs(const Options *o, const KellerConfig *config, KellerError *error)
{
    const char *output = o->output;
    KellerStatus status = o->reuse ? keller_refuse_input(output, o->reuse, "the result that this run reuses", error) : KELLER_OK;
    if (status == KELLER_OK) status = keller_refuse_input(output, config->file, "the configuration of this run", error);
    if (status == KELLER_OK)
        status = keller_refuse_input(output, config->scene_file, "the scene file of this run", error);
    for (size_t s = 0; s < config->set_count && status == KELLER_OK; ++s)
        if (config->sets[s].file)
            status = keller_refuse_input(output, config->sets[s].file, "a route file of this run", error);
    return status;
}

static KellerStatus prepare_and_simulate(const Options *o, KellerInterrupt *interrupt, KellerError *error)
{
    double start = keller_seconds();
    KellerPrepared prepared;
    KellerReuse reuse = {0};
    KellerStatus status = keller_prepare_config(o->config, &o->variables, &prepared, error);
    /* before anything slow */
    if (status == KELLER_OK) status = refuse_inputs(o, &prepared.config, error);
    if (status == KELLER_OK) status = keller_result_check_target(o->output, o->force, error);
    if (status == KELLER_OK && o->reuse) status = keller_reuse_open(o->reuse, &prepared.config, &reuse, error);
    if (status == KELLER_OK) {
        if (o->verbose) fprintf(stderr, "keller: reading %s\n", prepared.config.scene_file);
        if (o->has_threads) prepared.config.threads = o->threads;
        status = keller_prepare_scene(&prepared, error);
    }
    if (status == KELLER_OK) status = simulate(o, &prepared, &reuse, start, interrupt, error);
    keller_reuse_close(&reuse);
    keller_prepared_free(&prepared);
    return status;
}

static KellerStatus run(void *context, KellerError *error)
{
    KellerInterrupt interrupt;
    if (!keller_interrupt_start(&interrupt)) return keller_error(error, KELLER_FAILED, "no thread for signals");
    KellerStatus status = prepare_and_simulate(context, &interrupt, error);
    keller_interrupt_stop(&interrupt);
    return status;
}

KellerStatus keller_cli_run(int argc, char **argv, KellerError *error)
{
    Options o = {0};
    KellerStatus status = parse(argc, argv, &o, error);
    if (status == KELLER_OK) {
        o.default_output = output_of(o.config);
        o.command_line = command_line_of(argc, argv);
        if (!o.output) o.output = o.default_output;
        if (!o.default_output || !o.command_line) status = keller_error_memory(error, 4096);
        else status = o.reuse ? keller_guarded(o.reuse, run, &o, error) : run(&o, error);
    }
    keller_variables_free(&o.variables);
    free(o.default_output);
    free(o.command_line);
    return status;
}
