#include "path/leads.h"

#include <stdlib.h>

#include "path/solve.h"

static uint32_t least(uint32_t a, uint32_t b) { return a < b ? a : b; }

static bool has_patches(const Scattering *s, StepCode code)
{
    return !code_is_wedge(code) && s->first[code_id(code)] < s->first[code_id(code) + 1];
}

KellerStatus leads_find(const Scattering *s, KellerVec3 end, uint32_t threads, Leads *leads, TreeWork *work, KellerError *error)
{
    *leads = (Leads){.end = end};
    KellerStatus status = tree_search(&s->search, end, threads, &leads->trie, NULL, work, error);
    if (status != KELLER_OK) return status;
    const Trie *trie = &leads->trie;
    leads->node = malloc(trie->count * sizeof *leads->node);
    if (!leads->node) {
        leads_free(leads);
        return keller_error_memory(error, trie->count * sizeof *leads->node);
    }
    for (uint32_t i = 1; i < trie->count; i++)
        if (s->plan.of[trie->nodes[i].pattern] & PLAN_WANT && has_patches(s, trie->nodes[i].code)) leads->node[leads->count++] = i;
    return KELLER_OK;
}

void leads_free(Leads *leads)
{
    free(leads->node);
    trie_free(&leads->trie);
    *leads = (Leads){.node = NULL};
}

/* Would the last leg run along the patches' own plane? */
static bool along_plane(const KellerScene *scene, StepCode last, uint32_t face)
{
    uint32_t plane = scene->faces[face].plane;
    uint32_t id = code_id(last);
    return code_is_wedge(last) ? path_wedge_in_plane(scene, &scene->wedges[id], plane) : scene->faces[id].plane == plane;
}

typedef struct {
    LeadFound found;
    void *context;
    uint32_t patch;
} Walk;

static bool hand_on(void *context, const KellerPath *path)
{
    const Walk *w = context;
    return w->found(w->context, w->patch, path);
}

bool leads_walk(const Scattering *s, const Leads *leads, uint32_t lead, bool to_end, const uint8_t *fewest, LeadFound found,
                void *context, JoinWork *work)
{
    StepCode codes[KELLER_MAX_BENDS];
    KellerStep steps[KELLER_MAX_BENDS], back[KELLER_MAX_BENDS];
    uint32_t count = trie_steps(&leads->trie, leads->node[lead], codes) - 1, face = code_id(codes[count]);
    if (along_plane(s->scene, codes[count - 1], face)) return true;
    for (uint32_t i = 0; i < count; i++) {
        steps[i] = (KellerStep){code_is_wedge(codes[i]) ? KELLER_DIFFRACTION : KELLER_REFLECTION, code_id(codes[i])};
        back[count - 1 - i] = steps[i];
    }
    Sieve sieve;
    bool useful;
    if (!sieve_make(&sieve, s->scene, s->boxes, leads->end, count, steps, NULL, &useful)) return true;
    const uint32_t slabs = least(s->transmissions, s->interactions - 1 - count), plane = s->scene->faces[face].plane;
    const uint32_t ground[2] = {to_end ? plane : KELLER_NONE, to_end ? KELLER_NONE : plane};
    Walk walk = {.found = found, .context = context};
    for (uint32_t i = s->first[face]; i < s->first[face + 1]; i++) {
        KellerVec3 middle = s->patches.list[i].middle;
        if (fewest && (fewest[i] == PATCH_DARK || fewest[i] + count > s->bends)) continue;
        work->candidates++;
        if (useful && !sieve_passes(&sieve, middle, NULL)) continue;
        walk.patch = i;
        if (!path_solve_on(s->scene, s->accel, to_end ? middle : leads->end, to_end ? leads->end : middle, ground, count,
                           to_end ? back : steps, slabs, hand_on, &walk, &work->accel))
            return false;
    }
    return true;
}
