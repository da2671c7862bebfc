#include "harness.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void stop(const char *what, const KellerError *error)
{
    fprintf(stderr, "%s: %s\n", what, error ? error->message : "out of memory");
    abort();
}

static void *zeroed(size_t count, size_t size)
{
    void *memory = calloc(count ? count : 1, size);
    if (!memory) stop("harness", NULL);
    return memory;
}

Run run_new(const KellerVec3 *tx, size_t rx_count, const KellerVec3 *rx, uint32_t reflections, uint32_t diffractions,
            uint32_t interactions)
{
    return (Run){.tx_count = 1,
                 .tx = tx,
                 .rx_count = rx_count,
                 .rx = rx,
                 .frequency_count = 1,
                 .frequency = {3.5e9},
                 .antenna = {.pattern = KELLER_ANTENNA_ISOTROPIC, .polarization = KELLER_POLARIZATION_V},
                 .reflections = reflections,
                 .diffractions = diffractions,
                 .interactions = interactions,
                 .cone = 2 * 0.017453292519943295,
                 .threads = 1};
}

KellerScene scene_of(const KellerSoup *soup)
{
    KellerScene scene;
    KellerError error = {0};
    if (keller_scene_build(soup, &scene, &error) != KELLER_OK) stop("keller_scene_build", &error);
    return scene;
}

static KellerStatus keep_paths(void *context, const KellerPathBatch *batch, KellerError *error)
{
    FoundPaths *found = context;
    (void)error;
    for (size_t i = 0; i < batch->count; i++) {
        if (found->count == found->capacity) {
            found->capacity = found->capacity ? 2 * found->capacity : 256;
            found->path = realloc(found->path, found->capacity * sizeof *found->path);
            if (!found->path) stop("harness", NULL);
        }
        Found *p = &found->path[found->count++];
        *p = (Found){.tx = batch->tx[i], .rx = batch->rx[i], .length = batch->length[i], .delay = batch->delay[i]};
        memcpy(p->departure, batch->departure[i], sizeof p->departure);
        memcpy(p->arrival, batch->arrival[i], sizeof p->arrival);
        for (size_t f = 0; f < batch->frequency_count; f++) {
            p->gain[f] = batch->gain[i * batch->frequency_count + f];
            if (batch->transfer) memcpy(p->transfer[f], &batch->transfer[4 * (i * batch->frequency_count + f)],
                                        sizeof p->transfer[f]);
        }
        uint64_t begin = batch->offset[i], end = batch->offset[i + 1];
        p->count = (uint32_t)(end - begin);
        if (p->count > KELLER_MAX_INTERACTIONS) stop("a path of too many interactions", &(KellerError){0});
        for (uint32_t k = 0; k < p->count; k++) {
            p->step[k].kind = (KellerInteractionKind)batch->interaction_kind[begin + k];
            p->position[k] = batch->interaction_position[begin + k];
            p->triangle[k] = batch->interaction_triangle[begin + k];
            /* The face is looked up by run_simulation, which has the scene. */
            p->step[k].id = batch->interaction_wedge[begin + k];
        }
    }
    return KELLER_OK;
}

static KellerStatus keep_coverage(void *context, const KellerCoverage *coverage, KellerError *error)
{
    FoundPaths *found = context;
    (void)error;
    found->coverage_count = (size_t)coverage->nx * coverage->ny;
    for (size_t i = 0; i < found->coverage_count && i < 8; i++) found->coverage[i] = coverage->path_gain[i];
    return KELLER_OK;
}

static void keep_progress(void *context, double fraction)
{
    FoundPaths *found = context;
    found->went_back = found->went_back || !(fraction >= found->progress && fraction <= 1);
    found->progress = fraction;
    found->reports++;
}

FoundPaths run_simulation(const KellerScene *scene, const Run *run)
{
    char id[] = "x", text[] = "";
    KellerConfig config = {.file = text,
                           .text = text,
                           .scene_file = text,
                           .scene_scale = 1,
                           .frequency_count = run->frequency_count,
                           .reflections = run->reflections,
                           .diffractions = run->diffractions,
                           .transmissions = run->transmissions,
                           .interactions = run->interactions,
                           .scattering = run->patch > 0,
                           .patch = run->patch,
                           .with_scattering = run->with_scattering,
                           .dynamic_range = 1e4,
                           .accelerator = "auto",
                           .cone = run->cone,
                           .threads = run->threads,
                           .split_over = run->split_over,
                           .output_paths = true,
                           .output_coverage = run->grid_step > 0};
    double frequency[HARNESS_FREQUENCIES];
    memcpy(frequency, run->frequency, sizeof frequency);
    config.frequencies = frequency;
    config.transmitter_count = run->tx_count;
    config.transmitters = zeroed(run->tx_count, sizeof *config.transmitters);
    for (size_t i = 0; i < run->tx_count; i++)
        config.transmitters[i] = (KellerTransmitter){
            .id = id, .station = {.position = run->tx[i], .antenna = run->antenna}, .power = 1e-3};
    for (size_t i = 0; i < run->tx_count; i++)
        memcpy(config.transmitters[i].station.orientation, run->orientation[0], sizeof run->orientation[0]);
    bool grid = run->grid_step > 0;
    config.set_count = grid ? 1 : run->rx_count;
    config.sets = zeroed(config.set_count, sizeof *config.sets);
    config.receiver_count = run->rx_count;
    config.receivers = zeroed(run->rx_count, sizeof *config.receivers);
    for (uint32_t i = 0; i < run->rx_count; i++) {
        config.receivers[i] = (KellerReceiver){
            .set = grid ? 0 : i, .index = grid ? i : 0, .station = {.position = run->rx[i], .antenna = run->rx_antenna ? *run->rx_antenna : run->antenna}};
        memcpy(config.receivers[i].station.orientation, run->orientation[1], sizeof run->orientation[1]);
        if (!grid) config.sets[i] = (KellerReceiverSet){.id = id, .kind = KELLER_SET_POINT, .first = i, .count = 1};
    }
    if (grid)
        config.sets[0] = (KellerReceiverSet){.id = id,
                                             .kind = KELLER_SET_GRID,
                                             .ny = run->grid_rows ? run->grid_rows : 1,
                                             .nx = (uint32_t)run->rx_count / (run->grid_rows ? run->grid_rows : 1),
                                             .count = (uint32_t)run->rx_count,
                                             .x0 = run->rx[0].x,
                                             .y0 = run->rx[0].y,
                                             .z = run->rx[0].z,
                                             .step = run->grid_step};
    FoundPaths found = {0};
    KellerAccel *accel = NULL;
    KellerError error = {0};
    KellerSimulationWork work = {0};
    KellerSink sink = {.context = &found, .paths = keep_paths, .coverage = keep_coverage, .progress = keep_progress};
    if (keller_accel_build(run->accelerator ? run->accelerator : "auto", scene, &accel, &error) != KELLER_OK) stop("keller_accel_build", &error);
    if (keller_simulate(&config, scene, accel, &sink, &work, &error) != KELLER_OK) stop("keller_simulate", &error);
    keller_accel_free(accel);
    found.work = work;
    free(config.transmitters);
    free(config.sets);
    free(config.receivers);
    for (size_t i = 0; i < found.count; i++)
        for (uint32_t k = 0; k < found.path[i].count; k++)
            if (found.path[i].step[k].kind != KELLER_DIFFRACTION)
                found.path[i].step[k].id = scene->triangle_face[found.path[i].triangle[k]];
    return found;
}

void found_free(FoundPaths *found)
{
    free(found->path);
    *found = (FoundPaths){0};
}

double complex found_total(const FoundPaths *found, uint32_t rx, size_t frequency)
{
    double complex sum = 0;
    for (size_t i = 0; i < found->count; i++)
        if (found->path[i].rx == rx) sum += found->path[i].gain[frequency];
    return sum;
}

size_t found_count(const FoundPaths *found, uint32_t rx)
{
    size_t count = 0;
    for (size_t i = 0; i < found->count; i++) count += found->path[i].rx == rx;
    return count;
}

const char *path_text(uint32_t count, const KellerStep *steps, char *text, size_t size)
{
    size_t used = 0;
    snprintf(text, size, "direct");
    for (uint32_t i = 0; i < count && used < size; i++)
        used += (size_t)snprintf(text + used, size - used, "%s%c%u", i ? " " : "",
                                 "FWTS"[steps[i].kind], steps[i].id);
    return text;
}

/* ---- comparing -------------------------------------------------------------------------------------------------- */

static double frobenius(const double complex m[4])
{
    double sum = 0;
    for (int i = 0; i < 4; i++) sum += creal(m[i] * conj(m[i]));
    return sqrt(sum);
}

static bool alike(const Found *a, const Found *b, double tolerance, bool reversed, PointMap map)
{
    if (a->count != b->count) return false;
    for (uint32_t i = 0; i < a->count; i++) {
        uint32_t k = reversed ? a->count - 1 - i : i;
        KellerVec3 p = map ? map(a->position[i]) : a->position[i];
        /* Written so that a NaN is no match. */
        if (a->step[i].kind != b->step[k].kind || !(v3_distance(p, b->position[k]) <= tolerance)) return false;
    }
    return true;
}

static bool same_path(const Found *a, const Found *b, size_t frequencies)
{
    return a->rx == b->rx && a->count == b->count && memcmp(a->step, b->step, a->count * sizeof *a->step) == 0 && a->length == b->length &&
           memcmp(a->gain, b->gain, frequencies * sizeof *a->gain) == 0;
}

bool found_same(const FoundPaths *a, const FoundPaths *b, size_t frequencies)
{
    size_t i = 0; /* both come sorted by transmitter, receiver, delay, steps */
    while (i < a->count && i < b->count && same_path(&a->path[i], &b->path[i], frequencies)) i++;
    if (i == a->count && i == b->count) return true;
    printf("# %zu paths and %zu paths, of which the first %zu are the same\n", a->count, b->count, i);
    for (int k = 0; k < 2; k++) {
        const FoundPaths *found = k ? b : a;
        char text[256];
        if (i < found->count)
            printf("# then rx %u, %s\n", found->path[i].rx, path_text(found->path[i].count, found->path[i].step, text, sizeof text));
    }
    return false;
}

static void print_only(const char *where, const Found *p)
{
    char text[256];
    printf("# only in %s: rx %u, %s, length %.9f:", where, p->rx, path_text(p->count, p->step, text, sizeof text),
           p->length);
    for (uint32_t k = 0; k < p->count; k++)
        printf(" (%.7f %.7f %.7f)", p->position[k].x, p->position[k].y, p->position[k].z);
    printf("\n");
}

static void note_error(PathDifference *difference, double error, double scale)
{
    double relative = error == 0 ? 0 : error / scale;
    if (!(relative <= difference->gain_error)) difference->gain_error = isnan(relative) ? INFINITY : relative;
}

PathDifference paths_compare(const FoundPaths *a, uint32_t rx_a, const FoundPaths *b, uint32_t rx_b, double tolerance,
                             bool reversed, PointMap map, bool verbose)
{
    PathDifference difference = {0};
    bool *used = zeroed(b->count, sizeof *used);
    for (size_t i = 0; i < a->count; i++) {
        const Found *p = &a->path[i];
        if (p->rx != rx_a) continue;
        size_t j = 0;
        while (j < b->count && (used[j] || b->path[j].rx != rx_b || !alike(p, &b->path[j], tolerance, reversed, map)))
            j++;
        if (j == b->count) {
            difference.only_a++;
            if (verbose) print_only("the first", p);
            continue;
        }
        used[j] = true;
        difference.matched++;
        /* Along a lossy face, direct and reflected wave cancel to rounding: what is left is no field to compare. */
        double nothing = 1e-7 * 299792458.0 / 3.5e9 / (4 * 3.141592653589793 * p->length);
        double scale = fmax(frobenius(p->transfer[0]), nothing);
        for (int k = 0; k < 4; k++) {
            /* Reciprocity: the way back has the transposed transfer matrix. */
            int other = reversed ? (k == 1 ? 2 : k == 2 ? 1 : k) : k;
            note_error(&difference, cabs(p->transfer[0][k] - b->path[j].transfer[0][other]), scale);
        }
        note_error(&difference, cabs(p->gain[0] - b->path[j].gain[0]), scale);
    }
    for (size_t j = 0; j < b->count; j++)
        if (b->path[j].rx == rx_b && !used[j]) {
            difference.only_b++;
            if (verbose) print_only("the second", &b->path[j]);
        }
    free(used);
    return difference;
}

size_t paths_doubled(const FoundPaths *found, uint32_t rx, double tolerance)
{
    size_t doubled = 0;
    for (size_t i = 0; i < found->count; i++)
        for (size_t j = 0; j < i; j++)
            doubled += found->path[i].rx == rx && found->path[j].rx == rx &&
                       alike(&found->path[i], &found->path[j], tolerance, false, NULL);
    return doubled;
}
