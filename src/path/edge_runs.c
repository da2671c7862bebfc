#include "path/edge_runs.h"

#include <stdlib.h>
#include <string.h>

#include "base/number.h"

/* False: it has no wedge. */
static bool run_at(EdgeRun *run, const Trie *trie, const uint32_t *nodes, uint32_t index)
{
    const TrieNode *n = &trie->nodes[nodes[index]];
    *run = (EdgeRun){.begin = index, .end = index + 1};
    for (; n != trie->nodes; n = &trie->nodes[n->parent]) {
        if (code_is_wedge(n->code)) {
            run->wedge = code_id(n->code);
            return true;
        }
        run->face[run->faces++] = code_id(n->code);
    }
    return false;
}

static bool same_steps(const EdgeRun *a, const EdgeRun *b)
{
    return a->wedge == b->wedge && a->faces == b->faces && memcmp(a->face, b->face, sizeof a->face) == 0;
}

static bool add_runs(EdgeRuns *runs, const Trie *trie, const uint32_t *nodes, uint32_t begin, uint32_t end)
{
    uint32_t room = 0;
    EdgeRun next;
    for (uint32_t i = begin; i < end && run_at(&next, trie, nodes, i); i++) {
        if (runs->count && same_steps(&runs->run[runs->count - 1], &next)) {
            runs->run[runs->count - 1].end = i + 1;
            continue;
        }
        if (runs->count == room) {
            room = room ? 2 * room : 16;
            EdgeRun *grown = realloc(runs->run, room * sizeof *grown);
            if (!grown) return false;
            runs->run = grown;
        }
        runs->run[runs->count++] = next;
    }
    return true;
}

bool edge_runs_init(EdgeRuns *runs, const KellerScene *scene, const Trie *trie, const uint32_t *nodes, const Arrival *arrival, uint32_t begin,
                    uint32_t end, uint32_t without)
{
    *runs = (EdgeRuns){0};
    if (!add_runs(runs, trie, nodes, begin, end)) return false;
    runs->end[0] = malloc((6 * (size_t)runs->count + 1) * sizeof *runs->end[0]);
    if (!runs->end[0]) return false;
    for (int k = 1; k < 6; k++) runs->end[k] = runs->end[0] + (size_t)k * runs->count;
    for (uint32_t i = 0; i < runs->count; i++) {
        EdgeRun *r = &runs->run[i];
        uint32_t face[KELLER_MAX_BENDS], faces = r->faces - without;
        for (uint32_t k = 0; k < faces; k++) face[k] = r->face[r->faces - 1 - k];
        r->line = edge_image(scene, r->wedge, faces, face);
        r->all = arrival_of_all(&arrival[r->begin], r->end - r->begin);
        runs->rounding = greater(runs->rounding, r->line.rounding);
        for (int side = 0; side < 2; side++) {
            const KellerVec3 p = v3_madd(r->line.origin, r->line.direction, r->all.lit[side]);
            runs->end[3 * side][i] = p.x;
            runs->end[3 * side + 1][i] = p.y;
            runs->end[3 * side + 2][i] = p.z;
        }
    }
    return true;
}

void edge_runs_free(EdgeRuns *runs)
{
    free(runs->run);
    free(runs->end[0]);
    *runs = (EdgeRuns){0};
}

void edge_runs_led_to(const EdgeRun *from, const EdgeRuns *to, uint32_t begin, uint32_t count, double *restrict room)
{
    const KellerVec3 o = from->line.origin, d = from->line.direction;
    const double rounding = greater(from->line.rounding, to->rounding), lit[2] = {from->all.lit[0], from->all.lit[1]};
    const double za[2] = {from->all.z[0], from->all.z[1]}, ra[2] = {greater(0, from->all.rho[0]), from->all.rho[1]};
    const double *restrict ax = to->end[0] + begin, *restrict ay = to->end[1] + begin, *restrict az = to->end[2] + begin;
    const double *restrict bx = to->end[3] + begin, *restrict by = to->end[4] + begin, *restrict bz = to->end[5] + begin;
    for (uint32_t i = 0; i < count; i++) { /* without branches: the compiler takes several at a time */
        double px = ax[i] - o.x, py = ay[i] - o.y, pz = az[i] - o.z, qx = bx[i] - o.x, qy = by[i] - o.y, qz = bz[i] - o.z;
        const double z0 = px * d.x + py * d.y + pz * d.z, z1 = qx * d.x + qy * d.y + qz * d.z;
        px -= z0 * d.x, py -= z0 * d.y, pz -= z0 * d.z; /* away from the edge's line */
        qx -= z1 * d.x, qy -= z1 * d.y, qz -= z1 * d.z;
        const double lx = qx - px, ly = qy - py, lz = qz - pz, l2 = lx * lx + ly * ly + lz * lz;
        double t = -(px * lx + py * ly + pz * lz) / l2; /* where it is nearest; a point's is anywhere */
        t = lesser(greater(t, 0), 1);
        const double nx = px + t * lx, ny = py + t * ly, nz = pz + t * lz;
        const double near = greater(0, sqrt(nx * nx + ny * ny + nz * nz) - rounding);
        const double far = sqrt(greater(px * px + py * py + pz * pz, qx * qx + qy * qy + qz * qz)) + rounding;
        const double zb[2] = {lesser(z0, z1), greater(z0, z1)}, rb[2] = {near, far};
        double on[2] = {lit[0], lit[1]};
        narrow_between(za, ra, zb, rb, on);
        room[i] = on[1] - on[0];
    }
}
