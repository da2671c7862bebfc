#include "path/restore.h"

#include <math.h>
#include <omp.h>

/* A path without its transmissions, which bend no leg: stretches of reflections between nodes, which are its ends, edges and patches. */
typedef struct {
    const KellerScene *scene;
    uint32_t count, nodes;
    uint32_t step[KELLER_MAX_BENDS];    /* of the path, in order */
    uint32_t node[KELLER_MAX_BENDS];    /* places in `step` */
} Bends;

static bool bends_of(const KellerScene *scene, const KellerPath *path, Bends *b)
{
    *b = (Bends){.scene = scene};
    for (uint32_t i = 0; i < path->count; i++) {
        const KellerStep *s = &path->step[i];
        bool edge = s->kind == KELLER_DIFFRACTION;
        if (s->id >= (edge ? scene->wedge_count : scene->face_count)) return false;
        if (s->kind == KELLER_TRANSMISSION) continue;
        if (b->count == KELLER_MAX_BENDS) return false;
        if (s->kind != KELLER_REFLECTION) b->node[b->nodes++] = b->count;
        b->step[b->count++] = i;
    }
    return true;
}

static const KellerFace *mirror(const Bends *b, const KellerPath *path, uint32_t bend)
{
    return &b->scene->faces[path->step[b->step[bend]].id];
}

static KellerVec3 turned(KellerVec3 v, bool around) { return around ? v3_scale(v, -1) : v; }

/* The directions of all legs between bends, leg[count] the last, and the path's length. */
static double legs_between(const Bends *b, const KellerPath *path, KellerVec3 tx, KellerVec3 rx, KellerVec3 *leg)
{
    uint32_t first = b->nodes > 0 ? b->node[0] : b->count;
    KellerVec3 image = tx, node = b->nodes > 0 ? path->position[b->step[first]] : rx;
    for (uint32_t i = 0; i < first; i++) image = v3_mirror_point(image, mirror(b, path, i)->normal, mirror(b, path, i)->offset);
    KellerVec3 along = v3_sub(node, image);
    double length = v3_norm(along), total = length;
    KellerVec3 direction = v3_scale(along, 1 / length);
    const bool around = path->part[1] > path->part[0]; /* edge_paths.c comes from the receiver: zeros have other signs */
    leg[first] = direction;
    for (uint32_t i = first; i-- > 0;) leg[i] = direction = v3_mirror_direction(direction, mirror(b, path, i)->normal);
    for (uint32_t n = 0; n < b->nodes; n++) {
        uint32_t at = b->node[n], end = n + 1 < b->nodes ? b->node[n + 1] : b->count;
        node = path->position[b->step[at]];
        image = n + 1 < b->nodes ? path->position[b->step[end]] : rx;
        for (uint32_t i = end; i-- > at + 1;) image = v3_mirror_point(image, mirror(b, path, i)->normal, mirror(b, path, i)->offset);
        along = around ? v3_sub(node, image) : v3_sub(image, node);
        length = v3_norm(along);
        direction = v3_scale(along, 1 / length);
        leg[at + 1] = turned(direction, around);
        for (uint32_t i = at + 1; i < end; i++) {
            direction = v3_mirror_direction(direction, mirror(b, path, i)->normal);
            leg[i + 1] = turned(direction, around);
        }
        total += length;
    }
    return total;
}

/* The same of any path: one that is scattered was solved as two, to its patch and from there. */
static double legs_of(const Bends *b, const KellerPath *path, KellerVec3 tx, KellerVec3 rx, KellerVec3 *leg)
{
    for (uint32_t n = 0; n < b->nodes; n++) {
        const uint32_t at = b->node[n];
        if (path->step[b->step[at]].kind != KELLER_SCATTERING) continue;
        KellerVec3 middle = path->position[b->step[at]];
        Bends before = *b, behind = {.scene = b->scene, .count = b->count - at - 1, .nodes = b->nodes - n - 1};
        before.count = at;
        before.nodes = n;
        for (uint32_t i = 0; i < behind.count; i++) behind.step[i] = b->step[at + 1 + i];
        for (uint32_t i = 0; i < behind.nodes; i++) behind.node[i] = b->node[n + 1 + i] - at - 1;
        return legs_between(&before, path, tx, middle, leg) + legs_between(&behind, path, middle, rx, leg + at + 1);
    }
    return legs_between(b, path, tx, rx, leg);
}

/* Not by less than `near`: numbers that are none are not. */
static bool is_on(const KellerScene *scene, const KellerStep *step, KellerVec3 p, double near)
{
    if (step->kind != KELLER_DIFFRACTION) {
        const KellerFace *f = &scene->faces[step->id];
        return fabs(v3_dot(f->normal, p) - f->offset) <= near;
    }
    const KellerWedge *w = &scene->wedges[step->id];
    KellerVec3 from = v3_sub(p, w->origin);
    double z = v3_dot(from, w->direction);
    return z >= -near && z <= w->length + near && v3_norm(v3_madd(from, w->direction, -z)) <= near;
}

static bool restore(const KellerScene *scene, KellerVec3 tx, KellerVec3 rx, KellerPath *path)
{
    Bends b;
    KellerVec3 leg[KELLER_MAX_BENDS + 1], last = tx;
    const double near = scene->contact;
    if (!bends_of(scene, path, &b)) return false;
    double length = legs_of(&b, path, tx, rx, leg);
    if (!(fabs(length - path->length) <= near)) return false;
    for (uint32_t i = 0, bend = 0; i <= path->count; i++) {
        KellerVec3 p = i < path->count ? path->position[i] : rx;
        path->leg[i] = leg[bend];
        if (!(v3_distance(p, v3_madd(last, leg[bend], v3_distance(last, p))) <= near)) return false;
        last = p;
        if (i == path->count) break;
        if (!is_on(scene, &path->step[i], p, near)) return false;
        bend += bend < b.count && b.step[bend] == i;
    }
    return true;
}

bool path_list_restore(const KellerScene *scene, KellerVec3 tx, KellerVec3 rx, PathList *list)
{
    for (size_t i = 0; i < list->count; i++) {
        KellerPath path;
        path_list_get(list, i, &path);
        if (!restore(scene, tx, rx, &path)) return false;
        for (uint32_t j = 0; j <= path.count; j++) list->nodes[list->items[i].begin + j].leg = path.leg[j];
    }
    return true;
}

static bool keep_path(void *list, const KellerPath *path) { return path_list_push(list, path); }

KellerStatus known_take(const KellerPathSource *source, uint32_t tx, uint32_t first, uint32_t count, PairResult *results,
                        KellerError *error)
{
    KellerStatus status = KELLER_OK;
    for (uint32_t i = 0; i < count && status == KELLER_OK; i++)
        status = source->pair(source->context, tx, first + i, keep_path, &results[i].paths, error);
    return status;
}

KellerStatus known_fields(const KellerPathSource *source, const FieldContext *c, uint32_t tx, uint32_t rx, PairResult *pair,
                          KellerSimulationWork *work, KellerError *error)
{
    const KellerTransmitter *t = &c->config->transmitters[tx];
    double start = omp_get_wtime();
    if (!path_list_restore(c->scene, t->station.position, c->config->receivers[rx].station.position, &pair->paths))
        return keller_error(error, KELLER_BAD_INPUT, "%s: a path from \"%s\" to receiver %u does not fit its sequence in this scene; "
                            "expected a complete result of keller run", source->name, t->id, rx);
    work->valid_paths += pair->paths.count;
    bool done = pair_fields(c, tx, rx, pair, work);
    work->seconds_solve += omp_get_wtime() - start;
    return done ? KELLER_OK : keller_error(error, KELLER_FAILED, "out of memory for the fields of the paths");
}
