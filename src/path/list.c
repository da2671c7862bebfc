#define _GNU_SOURCE /* qsort_r */
#include <math.h>
#include <stdlib.h>

#include "path/internal.h"
#include "base/number.h"

static bool grow(void **array, size_t needed, size_t *capacity, size_t size)
{
    if (needed <= *capacity) return true;
    size_t more = *capacity ? needed + *capacity : needed + 15;
    void *grown = realloc(*array, more * size);
    if (!grown) return false;
    *array = grown;
    *capacity = more;
    return true;
}

bool path_list_push(PathList *list, const KellerPath *path)
{
    uint32_t n = path->count;
    if (!grow((void **)&list->items, list->count + 1, &list->capacity, sizeof *list->items) ||
        !grow((void **)&list->nodes, list->node_count + n + 1, &list->node_capacity, sizeof *list->nodes))
        return false;
    PathNode *node = &list->nodes[list->node_count];
    for (uint32_t i = 0; i < n; i++) node[i] = (PathNode){path->leg[i], path->position[i], path->step[i], path->triangle[i], path->free_end[i]};
    node[n] = (PathNode){.leg = path->leg[n]};
    list->items[list->count++] = (PathItem){path->length, path->weight, path->patch, {path->part[0], path->part[1]}, list->node_count, n};
    list->node_count += n + 1;
    return true;
}

void path_list_get(const PathList *list, size_t index, KellerPath *path)
{
    const PathItem *item = &list->items[index];
    const PathNode *node = &list->nodes[item->begin];
    path->count = item->count;
    path->length = item->length;
    path->weight = item->weight;
    for (int i = 0; i < 2; i++) path->part[i] = item->part[i];
    path->patch = item->patch;
    for (uint32_t i = 0; i < item->count; i++) {
        path->leg[i] = node[i].leg;
        path->position[i] = node[i].position;
        path->step[i] = node[i].step;
        path->triangle[i] = node[i].triangle;
        path->free_end[i] = node[i].free_end;
    }
    path->leg[item->count] = node[item->count].leg;
}

void path_list_free(PathList *list)
{
    free(list->items);
    free(list->nodes);
    *list = (PathList){0};
}

bool path_list_append(PathList *to, const PathList *from)
{
    size_t items = to->count, nodes = to->node_count;
    if (from->count == 0) return true;
    if (!grow((void **)&to->items, items + from->count, &to->capacity, sizeof *to->items) ||
        !grow((void **)&to->nodes, nodes + from->node_count, &to->node_capacity, sizeof *to->nodes))
        return false;
    for (size_t i = 0; i < from->count; i++) {
        to->items[items + i] = from->items[i];
        to->items[items + i].begin += nodes;
    }
    for (size_t i = 0; i < from->node_count; i++) to->nodes[nodes + i] = from->nodes[i];
    to->count += from->count;
    to->node_count += from->node_count;
    return true;
}

static int compare(const void *pa, const void *pb, void *context)
{
    const PathItem *a = pa, *b = pb;
    const PathNode *nodes = context;
    if (a->length != b->length) return a->length < b->length ? -1 : 1;
    if (a->count != b->count) return a->count < b->count ? -1 : 1;
    for (uint32_t i = 0; i < a->count; i++) {
        KellerStep s = nodes[a->begin + i].step, t = nodes[b->begin + i].step;
        if (s.kind != t.kind) return s.kind < t.kind ? -1 : 1;
        if (s.id != t.id) return s.id < t.id ? -1 : 1;
        if (s.kind != KELLER_SCATTERING) continue;
        /* patches of one face, as symmetry has it */
        KellerVec3 p = nodes[a->begin + i].position, q = nodes[b->begin + i].position;
        double d = p.x != q.x ? p.x - q.x : p.y != q.y ? p.y - q.y : p.z - q.z;
        if (d != 0) return d < 0 ? -1 : 1;
    }
    return (a->part[0] > b->part[0]) - (a->part[0] < b->part[0]);
}

void path_list_sort(PathList *list)
{
    if (list->count > 1) qsort_r(list->items, list->count, sizeof *list->items, compare, list->nodes);
}

/* ---- corners ----------------------------------------------------------------------------------------------------------- */

/* One image, reached through the same points, in planes that take turns otherwise. (Halves of one reflection in two coplanar
 * faces that meet there are not that: each has its own material.) */
static bool same_image(const KellerScene *scene, const PathList *list, const PathItem *a, const PathItem *b)
{
    const PathNode *x = &list->nodes[a->begin], *y = &list->nodes[b->begin];
    uint32_t n = a->count;
    double near = KELLER_BOUNDARY_ANGLE * a->length;
    bool turns = false;
    if (n != b->count || fabs(a->length - b->length) > near || v3_distance(x[0].leg, y[0].leg) > KELLER_BOUNDARY_ANGLE ||
        v3_distance(x[n].leg, y[n].leg) > KELLER_BOUNDARY_ANGLE)
        return false;
    for (uint32_t i = 0; i < n; i++) {
        KellerStep s = x[i].step, t = y[i].step;
        if (s.kind != t.kind || v3_distance(x[i].position, y[i].position) > near) return false;
        if (s.kind == KELLER_REFLECTION) turns = turns || scene->faces[s.id].plane != scene->faces[t.id].plane;
        else if (s.id != t.id) return false;
    }
    return turns;
}

static bool precedes(const PathList *list, const PathItem *a, const PathItem *b)
{
    for (uint32_t i = 0; i < a->count; i++) {
        uint32_t s = list->nodes[a->begin + i].step.id, t = list->nodes[b->begin + i].step.id;
        if (s != t) return s < t;
    }
    return false;
}

void path_list_merge_corners(const KellerScene *scene, PathList *list)
{
    for (size_t i = 0; i < list->count; i++) {
        if (list->items[i].weight >= 1) continue;
        for (size_t j = i + 1; j < list->count; j++) {
            PathItem *a = &list->items[i], *b = &list->items[j];
            if (b->weight >= 1 || !same_image(scene, list, a, b)) continue;
            double weight = lesser(a->weight + b->weight, 1);
            if (precedes(list, b, a)) *a = *b;
            a->weight = weight;
            list->items[j--] = list->items[--list->count];
        }
    }
}
