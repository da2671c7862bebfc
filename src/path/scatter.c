/* Paths by way of patches: ways from both ends to the middle of each, that come to its face from the same side. */
#include "path/scatter.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "path/leads.h"
#include "path/solve.h"

static uint32_t least(uint32_t a, uint32_t b) { return a < b ? a : b; }

/* ---- what is asked for ---------------------------------------------------------------------------------------------------- */

/* Searches look for every sequence that may lead to a face with patches, and that face. */
static KellerStatus plan_search(Scattering *s, const KellerConfig *config, KellerError *error)
{
    s->search = (TreeLimits){.scene = s->scene, .accel = s->accel, .plan = &s->plan, .transmissions = s->transmissions,
                             .interactions = s->interactions, .tan_aperture = tan(config->cone), .split_over = config->split_over};
    if (!plan_init(&s->plan, s->bends + 1)) return keller_error_memory(error, (size_t)4 << (s->bends + 1));
    for (Pattern p = 2; p < 2u << s->bends; p++)
        if (plan_asks(s->reflections, s->diffractions, p)) s->plan.of[pattern_and(p, false)] |= PLAN_WANT;
    plan_uses(&s->plan);
    return KELLER_OK;
}

KellerStatus scattering_init(Scattering *s, const KellerConfig *config, const KellerScene *scene, const KellerAccel *accel,
                             const FaceBox *boxes, KellerError *error)
{
    *s = (Scattering){.scene = scene, .accel = accel, .boxes = boxes, .reflections = config->reflections,
                      .diffractions = config->diffractions, .transmissions = config->transmissions, .interactions = config->interactions};
    if (config->scattering == 0 || config->interactions == 0) return KELLER_OK;
    KellerError inner;
    KellerStatus status = patches_of(scene, config->patch, &s->patches, &inner);
    if (status != KELLER_OK) return keller_error(error, status, "%s:%d: %s", config->file, config->paths_line, inner.message);
    if (s->patches.count == 0) return KELLER_OK;
    s->bends = least(config->with_scattering, least(config->interactions - 1, config->reflections + config->diffractions));
    s->bends = least(s->bends, KELLER_MAX_BENDS - 1); /* the face with patches is one more step of the search */
    s->first = calloc(scene->face_count + 1, sizeof *s->first);
    s->fewest = malloc(s->patches.count);
    s->lit = malloc(s->patches.count * sizeof *s->lit);
    if (!s->first || !s->fewest || !s->lit) status = keller_error_memory(error, s->patches.count * sizeof *s->lit);
    for (size_t i = 0; i < s->patches.count && status == KELLER_OK; i++) s->first[s->patches.list[i].face + 1]++;
    for (uint32_t i = 0; i < scene->face_count && status == KELLER_OK; i++) s->first[i + 1] += s->first[i];
    if (status == KELLER_OK && s->bends > 0) status = plan_search(s, config, error);
    if (status != KELLER_OK) scattering_free(s);
    return status;
}

static void forget_ways(Scattering *s)
{
    path_list_free(&s->ways);
    free(s->way);
    free(s->way_bends);
    free(s->way_begin);
    s->way = s->way_begin = NULL;
    s->way_bends = NULL;
    s->lit_count = 0;
}

void scattering_free(Scattering *s)
{
    forget_ways(s);
    patches_free(&s->patches);
    free(s->first);
    free(s->fewest);
    free(s->lit);
    if (s->bends > 0) plan_free(&s->plan);
    *s = (Scattering){.scene = NULL};
}

/* ---- ways ----------------------------------------------------------------------------------------------------------------- */

/* Height over the patch's plane, 0 if within rounding of it. */
static double height(const KellerScene *scene, const Patch *patch, KellerVec3 p)
{
    double h = v3_dot(scene->faces[patch->face].normal, v3_sub(p, patch->middle));
    return fabs(h) > path_rounding(scene, p) ? h : 0;
}

static void go_straight(KellerVec3 a, KellerVec3 b, KellerPath *way)
{
    way->count = 0;
    way->weight = 1;
    way->patch = 0;
    way->length = v3_distance(a, b);
    way->leg[0] = v3_scale(v3_sub(b, a), 1 / way->length);
}

/* The straight way between a patch and an end, through up to `slabs` slabs; false: there is none. The face's own plane is not in the
 * way. */
static bool straight_way(const Scattering *s, const Patch *patch, KellerVec3 end, bool to_end, uint32_t slabs, KellerPath *way,
                         KellerAccelWork *work)
{
    PathLeg leg = {.a = to_end ? patch->middle : end, .b = to_end ? end : patch->middle, .strict = true};
    leg.skip[0] = &s->scene->faces[patch->face].plane;
    leg.skip_count[0] = 1;
    Crossings crossings = {.most = slabs};
    bool grazes;
    if (!path_leg_passes(s->scene, s->accel, &leg, &crossings, &grazes, work)) return false;
    KellerPath open, *straight = crossings.count > 0 ? &open : way;
    go_straight(leg.a, leg.b, straight);
    if (crossings.count > 0) path_insert(s->scene, leg.a, leg.b, straight, &crossings, way);
    return true;
}

static uint32_t slabs_of_straight(const Scattering *s) { return least(s->transmissions, s->interactions - 1); }

/* Steps of the path of one kind. */
static uint32_t of_kind(const KellerPath *path, KellerInteractionKind kind)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < path->count; i++) n += path->step[i].kind == kind;
    return n;
}

static bool in_order(const Scattering *s, const KellerPath *before, const KellerPath *behind)
{
    uint32_t r = of_kind(before, KELLER_REFLECTION) + of_kind(behind, KELLER_REFLECTION);
    uint32_t d = of_kind(before, KELLER_DIFFRACTION) + of_kind(behind, KELLER_DIFFRACTION);
    return r <= s->reflections && d <= s->diffractions && r + d <= s->bends &&
           of_kind(before, KELLER_TRANSMISSION) + of_kind(behind, KELLER_TRANSMISSION) <= s->transmissions &&
           before->count + 1 + behind->count <= s->interactions;
}

/* Appends the steps of `way`, and the leg behind the last of them. */
static void append(KellerPath *path, const KellerPath *way)
{
    uint32_t n = path->count;
    memcpy(path->step + n, way->step, way->count * sizeof *way->step);
    memcpy(path->position + n, way->position, way->count * sizeof *way->position);
    memcpy(path->triangle + n, way->triangle, way->count * sizeof *way->triangle);
    memcpy(path->free_end + n, way->free_end, way->count * sizeof *way->free_end);
    memcpy(path->leg + n, way->leg, (way->count + 1) * sizeof *way->leg);
    path->count += way->count;
}

/* The path of two ways, one that comes to the patch and one that leaves it, if they are on one side of it and within the orders
 * asked for. false: memory. */
static bool combine(const Scattering *s, const Patch *patch, const KellerPath *before, const KellerPath *behind, KellerVec3 rx,
                    PathList *list)
{
    KellerVec3 last = before->count > 0 ? before->position[before->count - 1] : s->tx;
    KellerVec3 next = behind->count > 0 ? behind->position[0] : rx;
    if (!(height(s->scene, patch, last) * height(s->scene, patch, next) > 0) || !in_order(s, before, behind)) return true;
    KellerPath path;
    path.count = 0;
    append(&path, before);
    uint32_t n = path.count++;
    path.step[n] = (KellerStep){KELLER_SCATTERING, patch->face};
    path.position[n] = patch->middle;
    path.triangle[n] = patch->triangle;
    path.free_end[n] = 0;
    append(&path, behind);
    path.length = before->length + behind->length;
    path.weight = before->weight * behind->weight;
    path.patch = patch->area;
    path.part[0] = path.part[1] = 0;
    return path_list_push(list, &path);
}

/* ---- from the transmitter ------------------------------------------------------------------------------------------------- */

/* Which patches can be seen from the transmitter. */
static void see_patches(Scattering *s, uint32_t threads, KellerAccelWork *work)
{
#pragma omp parallel num_threads((int)threads)
    {
        KellerAccelWork own = {0};
        KellerPath way;
#pragma omp for schedule(dynamic, 256)
        for (size_t i = 0; i < s->patches.count; i++) {
            const Patch *p = &s->patches.list[i];
            bool seen = height(s->scene, p, s->tx) != 0 && straight_way(s, p, s->tx, false, slabs_of_straight(s), &way, &own) &&
                        path_owns(s->scene, s->accel, p->face, p->middle, &own);
            s->fewest[i] = seen ? 0 : PATCH_DARK;
        }
#pragma omp critical(keller_patches)
        {
            work->nodes += own.nodes;
            work->triangles += own.triangles;
        }
    }
}

/* Ways to patches, and which patch each leads to. */
typedef struct {
    const Scattering *s;
    PathList ways;
    uint32_t *patch;
    size_t capacity;
    KellerAccelWork work;
} Ways;

static bool room_for(Ways *w, size_t count)
{
    if (count <= w->capacity) return true;
    size_t more = count + w->capacity / 2 + 64;
    uint32_t *grown = realloc(w->patch, more * sizeof *grown);
    if (!grown) return false;
    w->patch = grown;
    w->capacity = more;
    return true;
}

static bool keep_way(void *context, uint32_t patch, const KellerPath *way)
{
    Ways *w = context;
    const Patch *p = &w->s->patches.list[patch];
    if (height(w->s->scene, p, way->position[way->count - 1]) == 0 ||
        !path_owns(w->s->scene, w->s->accel, p->face, p->middle, &w->work))
        return true;
    if (!room_for(w, w->ways.count + 1) || !path_list_push(&w->ways, way)) return false;
    w->patch[w->ways.count - 1] = patch;
    return true;
}

/* What a thread found to what all did. */
static bool take_ways(Ways *to, const Ways *from)
{
    size_t n = to->ways.count;
    to->work.nodes += from->work.nodes;
    to->work.triangles += from->work.triangles;
    if (!room_for(to, n + from->ways.count) || !path_list_append(&to->ways, &from->ways)) return false;
    if (from->ways.count > 0) memcpy(to->patch + n, from->patch, from->ways.count * sizeof *to->patch);
    return true;
}

/* All ways with bends from the transmitter; false: memory. */
static bool walk_leads(const Scattering *s, const Leads *leads, uint32_t threads, Ways *all)
{
    bool ok = true;
#pragma omp parallel num_threads((int)threads)
    {
        Ways own = {.s = s};
        JoinWork work = {0};
        bool own_ok = true;
#pragma omp for schedule(dynamic, 1) nowait
        for (uint32_t i = 0; i < leads->count; i++)
            if (own_ok) own_ok = leads_walk(s, leads, i, false, NULL, keep_way, &own, &work);
        own.work.nodes += work.accel.nodes;
        own.work.triangles += work.accel.triangles;
#pragma omp critical(keller_patches)
        ok = take_ways(all, &own) && own_ok && ok;
        path_list_free(&own.ways);
        free(own.patch);
    }
    return ok;
}

static uint32_t bends_of(const PathList *list, size_t index)
{
    const PathItem *item = &list->items[index];
    uint32_t bends = 0;
    for (uint32_t i = 0; i < item->count; i++) bends += list->nodes[item->begin + i].step.kind != KELLER_TRANSMISSION;
    return bends;
}

/* Sorts the ways by their patches, those with fewer bends first. */
static bool order_ways(Scattering *s, Ways *all)
{
    size_t n = all->ways.count;
    s->ways = all->ways;
    s->way = malloc((n + 1) * sizeof *s->way);
    s->way_bends = malloc(n + 1);
    s->way_begin = calloc(s->patches.count + 2, sizeof *s->way_begin);
    if (!s->way || !s->way_bends || !s->way_begin || n > UINT32_MAX) return false;
    uint32_t *at = s->way_begin + 1; /* where the next of each patch goes; in the end, where those of the next patch begin */
    for (size_t i = 0; i < n; i++) at[all->patch[i] + 1]++;
    for (size_t p = 0; p < s->patches.count; p++) at[p + 1] += at[p];
    for (uint32_t bends = 1; bends <= s->bends; bends++)
        for (size_t i = 0; i < n; i++) {
            uint32_t patch = all->patch[i];
            if (bends_of(&s->ways, i) != bends) continue;
            s->way_bends[at[patch]] = (uint8_t)bends;
            s->way[at[patch]++] = (uint32_t)i;
            if (bends < s->fewest[patch]) s->fewest[patch] = (uint8_t)bends;
        }
    return true;
}

KellerStatus scattering_from(Scattering *s, KellerVec3 tx, uint32_t threads, TreeWork *tree, KellerError *error)
{
    forget_ways(s);
    s->tx = tx;
    if (s->patches.count == 0) return KELLER_OK;
    see_patches(s, threads, &tree->accel);
    if (s->bends > 0) {
        Leads leads;
        KellerStatus status = leads_find(s, tx, threads, &leads, tree, error);
        if (status != KELLER_OK) return status;
        Ways all = {.s = s};
        bool ok = walk_leads(s, &leads, threads, &all);
        leads_free(&leads);
        ok = order_ways(s, &all) && ok;
        free(all.patch);
        tree->accel.nodes += all.work.nodes;
        tree->accel.triangles += all.work.triangles;
        if (!ok) return keller_error(error, KELLER_FAILED, "out of memory for %zu ways to patches that scatter", all.ways.count);
    }
    for (size_t i = 0; i < s->patches.count; i++)
        if (s->fewest[i] != PATCH_DARK) s->lit[s->lit_count++] = (uint32_t)i;
    return KELLER_OK;
}

/* ---- to a receiver -------------------------------------------------------------------------------------------------------- */

typedef struct {
    const Scattering *s;
    KellerVec3 rx;
    PathList *list;
    KellerAccelWork *work;
} Sender;

/* Every way from the transmitter to the patch, followed by this one. */
static bool send_on(void *context, uint32_t patch, const KellerPath *behind)
{
    const Sender *f = context;
    const Scattering *s = f->s;
    const Patch *p = &s->patches.list[patch];
    KellerPath before;
    if (s->fewest[patch] == 0) {
        uint32_t slabs = slabs_of_straight(s);
        if (slabs == 0) go_straight(s->tx, p->middle, &before); /* it is known to be free */
        if ((slabs == 0 || straight_way(s, p, s->tx, false, slabs, &before, f->work)) &&
            !combine(s, p, &before, behind, f->rx, f->list))
            return false;
    }
    uint32_t bends = of_kind(behind, KELLER_REFLECTION) + of_kind(behind, KELLER_DIFFRACTION);
    for (uint32_t i = s->way_begin ? s->way_begin[patch] : 0, end = s->way_begin ? s->way_begin[patch + 1] : 0; i < end; i++) {
        if (bends + s->way_bends[i] > s->bends) break;
        path_list_get(&s->ways, s->way[i], &before);
        if (!combine(s, p, &before, behind, f->rx, f->list)) return false;
    }
    return true;
}

/* Straight from all patches with a way from the transmitter; false: memory. */
static bool send_straight(const Sender *f)
{
    const Scattering *s = f->s;
    for (size_t i = 0; i < s->lit_count; i++) {
        const Patch *p = &s->patches.list[s->lit[i]];
        KellerPath behind;
        double side = height(s->scene, p, f->rx);
        if (side == 0 || (s->bends == 0 && !(side * height(s->scene, p, s->tx) > 0))) continue;
        if (!straight_way(s, p, f->rx, true, slabs_of_straight(s), &behind, f->work)) continue;
        if (!send_on((void *)(uintptr_t)f, s->lit[i], &behind)) return false;
    }
    return true;
}

/* By way of reflections and diffractions; false: memory. */
static bool send_over_leads(const Sender *f, const Leads *leads, uint32_t threads, JoinWork *work)
{
    const Scattering *s = f->s;
    bool ok = true;
#pragma omp parallel num_threads((int)threads) if (threads > 1)
    {
        PathList own = {0};
        JoinWork own_work = {0};
        Sender sender = {.s = s, .rx = f->rx, .list = &own, .work = &own_work.accel};
        bool own_ok = true;
#pragma omp for schedule(dynamic, 1) nowait
        for (uint32_t i = 0; i < leads->count; i++)
            if (own_ok) own_ok = leads_walk(s, leads, i, true, s->fewest, send_on, &sender, &own_work);
#pragma omp critical(keller_patches)
        {
            ok = own_ok && path_list_append(f->list, &own) && ok;
            work->candidates += own_work.candidates;
            work->accel.nodes += own_work.accel.nodes;
            work->accel.triangles += own_work.accel.triangles;
        }
        path_list_free(&own);
    }
    return ok;
}

KellerStatus scattering_add(const Scattering *s, KellerVec3 rx, uint32_t threads, PathList *list, TreeWork *tree, JoinWork *work,
                            KellerError *error)
{
    if (s->lit_count == 0) return KELLER_OK;
    Sender sender = {.s = s, .rx = rx, .list = list, .work = &work->accel};
    work->candidates += s->lit_count;
    bool ok = send_straight(&sender);
    if (ok && s->bends > 0) {
        Leads leads;
        KellerStatus status = leads_find(s, rx, threads, &leads, tree, error);
        if (status != KELLER_OK) return status;
        ok = send_over_leads(&sender, &leads, threads, work);
        leads_free(&leads);
    }
    return ok ? KELLER_OK : keller_error(error, KELLER_FAILED, "out of memory for the scattered paths");
}
