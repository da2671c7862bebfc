/* Blocks of eight primitives, and the memory of those already reported. */
#include "accel/leaf.h"

#include <stdlib.h>
#include <string.h>

static void put(KellerVertex8 *corner, int lane, KellerVec3 p, KellerVec3 middle)
{
    corner->p[0][lane] = (float)(p.x - middle.x);
    corner->p[1][lane] = (float)(p.y - middle.y);
    corner->p[2][lane] = (float)(p.z - middle.z);
}

void leaf_triangles(const KellerAccel *a, const Leaves *leaves, TriangleBlock *blocks)
{
    for (uint32_t b = 0; b < leaves->block_count; b++)
        for (uint32_t lane = 0, n = leaves->begin[b + 1] - leaves->begin[b]; lane < 8; lane++) {
            uint32_t id = leaves->refs[leaves->begin[b] + (lane < n ? lane : 0)];
            KellerVec3 v[3];
            triangle_of(a, id, v);
            for (int j = 0; j < 3; j++) put(&blocks[b].corner[j], (int)lane, v[j], a->middle);
            blocks[b].id[lane] = lane < n ? id : KELLER_NONE;
        }
}

void leaf_edges(const KellerAccel *a, const Leaves *leaves, EdgeBlock *blocks)
{
    for (uint32_t b = 0; b < leaves->block_count; b++)
        for (uint32_t lane = 0, n = leaves->begin[b + 1] - leaves->begin[b]; lane < 8; lane++) {
            uint32_t id = leaves->refs[leaves->begin[b] + (lane < n ? lane : 0)];
            KellerVec3 v[2];
            edge_of(a, id, v);
            for (int j = 0; j < 2; j++) put(&blocks[b].corner[j], (int)lane, v[j], a->middle);
            blocks[b].id[lane] = lane < n ? id : KELLER_NONE;
        }
}

void seen_start(Seen *s)
{
    memset(s->small, 0, sizeof s->small);
    s->slot = s->small;
    s->mask = sizeof s->small / sizeof *s->small - 1;
    s->count = 0;
}

static bool insert(uint32_t *slot, uint32_t mask, uint32_t id)
{
    uint32_t i = id * 2654435769u & mask; /* Fibonacci hashing (Knuth 6.4) */
    while (slot[i] && slot[i] != id + 1) i = (i + 1) & mask;
    bool new = slot[i] == 0;
    slot[i] = id + 1;
    return new;
}

bool seen_before(Seen *s, uint32_t id)
{
    if (s->count * 2 > s->mask) {
        uint32_t *larger = calloc(4 * ((size_t)s->mask + 1), sizeof *larger);
        if (!larger && s->count + 1 > s->mask) return false;
        if (larger) {
            for (uint32_t i = 0; i <= s->mask; i++)
                if (s->slot[i]) insert(larger, 4 * s->mask + 3, s->slot[i] - 1);
            seen_end(s);
            s->slot = larger;
            s->mask = 4 * s->mask + 3;
        }
    }
    if (!insert(s->slot, s->mask, id)) return true;
    s->count++;
    return false;
}

void seen_end(Seen *s)
{
    if (s->slot != s->small) free(s->slot);
    s->slot = s->small;
}
