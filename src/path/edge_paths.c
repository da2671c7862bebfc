/* The search of tree.c finds the edges on which the shortest way lies. Biot, Tolstoy and Medwin's diffraction comes from all points of
 * an edge, so here every sequence of mirrors to an edge is taken from both ends, whatever Keller's law says of it. */
#include "path/edge_paths.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "path/plan.h"

typedef struct {
    EdgeWay way;
    EdgeParts seen;
} SeenWay;

struct EdgeWays {
    uint32_t count;
    SeenWay *way;               /* [count] by wedge */
};

void edge_ways_free(EdgeWays *ways)
{
    if (!ways) return;
    for (size_t i = 0; ways->way && i < ways->count; i++) free(ways->way[i].seen.part);
    free(ways->way);
    free(ways);
}

static int by_wedge(const void *pa, const void *pb)
{
    const SeenWay *a = pa, *b = pb;
    if (a->way.wedge != b->way.wedge) return a->way.wedge < b->way.wedge ? -1 : 1;
    if (a->way.count != b->way.count) return a->way.count < b->way.count ? -1 : 1;
    return memcmp(a->way.face, b->way.face, a->way.count * sizeof *a->way.face);
}

/* Every sequence of mirrors that ends in a wedge, from the tree's trie. */
static bool take_sequences(const Trie *trie, const TreePlan *plan, const KellerScene *scene, EdgeWays *ways)
{
    TrieList list;
    if (!trie_list(trie, plan->of, &list)) return false;
    ways->way = calloc((size_t)list.count + 1, sizeof *ways->way);
    if (!ways->way) {
        trie_list_free(&list);
        return false;
    }
    ways->count = list.count;
    for (uint32_t i = 0; i < list.count; i++) {
        StepCode codes[KELLER_MAX_BENDS];
        EdgeWay *way = &ways->way[i].way;
        way->scene = scene;
        way->count = trie_steps(trie, list.nodes[i], codes) - 1;
        way->wedge = code_id(codes[way->count]);
        memcpy(way->face, codes, way->count * sizeof *codes);
    }
    trie_list_free(&list);
    qsort(ways->way, ways->count, sizeof *ways->way, by_wedge);
    return true;
}

KellerStatus edge_ways_find(const EdgeSearch *search, KellerVec3 end, uint32_t threads, EdgeWays **found, TreeWork *work,
                            KellerError *error)
{
    TreeLimits limits = search->limits;
    TreePlan plan;
    Trie trie = {0};
    EdgeWays *ways = calloc(1, sizeof *ways);
    *found = ways;
    if (!ways || !plan_init(&plan, search->reflections + 1)) return keller_error_memory(error, (size_t)8 << search->reflections);
    for (uint32_t i = 0; i <= search->reflections; i++) plan.of[pattern_and(PATTERN_EMPTY << i, true)] |= PLAN_WANT;
    plan_uses(&plan);
    limits.plan = &plan;
    limits.targets = NULL;
    KellerStatus status = tree_search(&limits, end, threads, &trie, NULL, work, error);
    if (status == KELLER_OK && !take_sequences(&trie, &plan, limits.scene, ways)) status = keller_error_memory(error, trie.count);
    trie_free(&trie);
    plan_free(&plan);
    if (status != KELLER_OK) return status;
    bool ok = true;
    for (uint32_t i = 0; i < ways->count && ok; i++) {
        ways->way[i].way.end = end;
        ok = edge_sight(&ways->way[i].way, limits.accel, &ways->way[i].seen, &work->accel);
    }
    return ok ? KELLER_OK : keller_error(error, KELLER_FAILED, "out of memory for what is seen of edges");
}

/* The point of the part over which the way between both images is shortest. */
static double nearest(const EdgeWay *a, const EdgeWay *b, const EdgePart *part)
{
    const KellerWedge *w = &a->scene->wedges[a->wedge];
    KellerVec3 image[2] = {a->image, b->image};
    double z[2], rho[2];
    for (int i = 0; i < 2; i++) {
        KellerVec3 from = v3_sub(image[i], w->origin);
        z[i] = v3_dot(from, w->direction);
        rho[i] = v3_norm(v3_madd(from, w->direction, -z[i]));
    }
    return greater(part->from, lesser(part->to, (z[0] * rho[1] + z[1] * rho[0]) / (rho[0] + rho[1])));
}

static bool add_path(const EdgeWay *a, const EdgeWay *b, const EdgePart *part, PathList *list)
{
    double z = nearest(a, b, part);
    const KellerWedge *w = &a->scene->wedges[a->wedge];
    uint32_t before = a->count, behind = b->count, triangle[KELLER_MAX_BENDS];
    KellerVec3 position[KELLER_MAX_BENDS], leg[KELLER_MAX_BENDS + 1];
    KellerPath path = {.count = before + 1 + behind, .weight = part->weight, .part = {part->from, part->to}};
    path.length = edge_way_points(a, z, path.position, path.triangle, path.leg);
    for (uint32_t i = 0; i < before; i++) path.step[i] = (KellerStep){KELLER_REFLECTION, code_id(a->face[i])};
    path.step[before] = (KellerStep){KELLER_DIFFRACTION, a->wedge};
    path.position[before] = v3_madd(w->origin, w->direction, z);
    path.triangle[before] = KELLER_NONE;
    path.length += edge_way_points(b, z, position, triangle, leg);
    for (uint32_t i = 0; i < behind; i++) { /* the other way round */
        uint32_t at = before + 1 + i, from = behind - 1 - i;
        path.step[at] = (KellerStep){KELLER_REFLECTION, code_id(b->face[from])};
        path.position[at] = position[from];
        path.triangle[at] = triangle[from];
    }
    for (uint32_t i = 0; i <= behind; i++) path.leg[before + 1 + i] = v3_scale(leg[behind - i], -1);
    return path_list_push(list, &path);
}

bool edge_paths_add(const EdgeSearch *search, const EdgeWays *tx, const EdgeWays *rx, PathList *list)
{
    const SeenWay *others = rx->way;
    uint32_t first = 0;
    bool ok = true;
    for (uint32_t i = 0; i < tx->count && ok; i++) {
        const SeenWay *a = &tx->way[i];
        while (first < rx->count && others[first].way.wedge < a->way.wedge) first++;
        for (uint32_t j = first; j < rx->count && others[j].way.wedge == a->way.wedge && ok; j++) {
            const SeenWay *b = &others[j];
            if (a->way.count + b->way.count > search->reflections) continue;
            EdgeParts common = {0};
            ok = edge_parts_common(&a->seen, &b->seen, &common);
            for (uint32_t p = 0; p < common.count && ok; p++) ok = add_path(&a->way, &b->way, &common.part[p], list);
            free(common.part);
        }
    }
    return ok;
}
