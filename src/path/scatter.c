/* Paths by way of patches: each seen from both of its ends, from the same side of its face. */
#include "path/scatter.h"

#include <math.h>
#include <stdlib.h>

#include "path/solve.h"

/* The leg between a patch and an end of the path passes; the face's own plane is not in the way. */
static bool sees(const KellerScene *scene, const KellerAccel *accel, const Patch *patch, KellerVec3 end, uint32_t number,
                 Crossings *crossings, KellerAccelWork *work)
{
    PathLeg leg = {.number = number, .a = number == 0 ? end : patch->middle, .b = number == 0 ? patch->middle : end, .strict = true};
    leg.skip[number == 0] = &scene->faces[patch->face].plane;
    leg.skip_count[number == 0] = 1;
    bool grazes;
    return path_leg_passes(scene, accel, &leg, crossings, &grazes, work);
}

/* Height over the patch's plane, 0 if within rounding of it. */
static double height(const KellerScene *scene, const Patch *patch, KellerVec3 p)
{
    double h = v3_dot(scene->faces[patch->face].normal, v3_sub(p, patch->middle));
    return fabs(h) > path_rounding(scene, p) ? h : 0;
}

size_t patches_seen(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, uint32_t transmissions, uint32_t threads,
                    const Patches *patches, uint32_t *seen, KellerAccelWork *work)
{
#pragma omp parallel num_threads((int)threads)
    {
        KellerAccelWork own = {0};
#pragma omp for schedule(dynamic, 256)
        for (size_t i = 0; i < patches->count; i++) {
            const Patch *p = &patches->list[i];
            Crossings crossings = {.most = transmissions};
            bool there = height(scene, p, tx) != 0 && sees(scene, accel, p, tx, 0, &crossings, &own) &&
                         path_owns(scene, accel, p->face, p->middle, &own);
            seen[i] = there ? (uint32_t)i : KELLER_NONE;
        }
#pragma omp critical(keller_patches)
        {
            work->nodes += own.nodes;
            work->triangles += own.triangles;
        }
    }
    size_t n = 0;
    for (size_t i = 0; i < patches->count; i++)
        if (seen[i] != KELLER_NONE) seen[n++] = seen[i];
    return n;
}

bool scatter_add(const KellerScene *scene, const KellerAccel *accel, KellerVec3 tx, KellerVec3 rx, uint32_t transmissions,
                 const Patches *patches, size_t seen_count, const uint32_t *seen, PathList *list, KellerAccelWork *work)
{
    for (size_t i = 0; i < seen_count; i++) {
        const Patch *p = &patches->list[seen[i]];
        if (!(height(scene, p, tx) * height(scene, p, rx) > 0)) continue;
        Crossings crossings = {.most = transmissions};
        if (transmissions > 0 && !sees(scene, accel, p, tx, 0, &crossings, work)) continue;
        if (!sees(scene, accel, p, rx, 1, &crossings, work)) continue;
        KellerPath path = {.count = 1, .weight = 1, .patch = p->area}, whole;
        double before = v3_distance(tx, p->middle), behind = v3_distance(p->middle, rx);
        path.step[0] = (KellerStep){KELLER_SCATTERING, p->face};
        path.position[0] = p->middle;
        path.triangle[0] = p->triangle;
        path.leg[0] = v3_scale(v3_sub(p->middle, tx), 1 / before);
        path.leg[1] = v3_scale(v3_sub(rx, p->middle), 1 / behind);
        path.length = before + behind;
        if (crossings.count > 0) path_insert(scene, tx, rx, &path, &crossings, &whole);
        if (!path_list_push(list, crossings.count > 0 ? &whole : &path)) return false;
    }
    return true;
}

/* SplitMix64's finisher (Steele, Lea and Flood 2014). */
static uint64_t mixed(uint64_t x)
{
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
    x = (x ^ x >> 27) * 0x94d049bb133111ebu;
    return x ^ x >> 31;
}

void patch_phase(KellerVec3 middle, double phase[2])
{
    /* m: far above rounding; no multiple of it and a half is a round number, on which the middle of a patch could be by design */
    const double quantum = 6.180339887498949e-4;
    const double coordinate[3] = {middle.x, middle.y, middle.z};
    uint64_t state = 0;
    for (int i = 0; i < 3; i++) state = mixed(state + 0x9e3779b97f4a7c15u + (uint64_t)llround(coordinate[i] / quantum));
    for (int i = 0; i < 2; i++) {
        state = mixed(state + 0x9e3779b97f4a7c15u);
        phase[i] = 2 * M_PI * 0x1p-53 * (double)(state >> 11);
    }
}
