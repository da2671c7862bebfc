/* Blocks of eight primitives, and the memory of those already reported. */
#include "accel/leaf.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void put(KellerVertex8 *corner, int lane, KellerVec3 p, KellerVec3 middle)
{
    corner->p[0][lane] = (float)(p.x - middle.x);
    corner->p[1][lane] = (float)(p.y - middle.y);
    corner->p[2][lane] = (float)(p.z - middle.z);
}

static void put_triangles(const KellerAccel *a, const uint32_t *refs, uint32_t n, TriangleBlock *block)
{
    uint32_t used = 0;
    for (uint32_t i = 0; i < n; i++) {
        if (refs[i] >= a->input.triangle_count) continue;
        KellerVec3 v[3];
        triangle_of(a, refs[i], v);
        /* the rest repeat the last */
        for (uint32_t lane = used; lane < 8; lane++) {
            for (int j = 0; j < 3; j++) put(&block->corner[j], (int)lane, v[j], a->middle);
            block->id[lane] = lane == used ? refs[i] : KELLER_NONE;
        }
        used++;
    }
    if (used == 0) { /* edges alone: triangles that nothing meets */
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                for (int lane = 0; lane < 8; lane++) block->corner[j].p[k][lane] = NAN;
        for (int lane = 0; lane < 8; lane++) block->id[lane] = KELLER_NONE;
    }
}

static void put_edge(const KellerAccel *a, EdgeBlock *blocks, uint32_t at, uint32_t edge)
{
    EdgeBlock *block = &blocks[at / 8];
    KellerVec3 v[2];
    edge_of(a, edge, v);
    for (uint32_t lane = at % 8; lane < 8; lane++) {
        for (int j = 0; j < 2; j++) put(&block->corner[j], (int)lane, v[j], a->middle);
        block->id[lane] = lane == at % 8 ? edge : KELLER_NONE;
    }
}

/* The edges of a primitive of the tree. */
static uint32_t edges_with(const KellerAccel *a, const Attached *t, uint32_t ref, const uint32_t **edges)
{
    uint32_t triangles = a->input.triangle_count;
    *edges = &t->edges[ref < triangles ? t->begin[ref] : t->begin[triangles] + (ref - triangles)];
    return ref < triangles ? t->begin[ref + 1] - t->begin[ref] : 1;
}

static void *aligned(size_t bytes, size_t *all)
{
    *all += bytes;
    return aligned_alloc(64, (bytes + 127) / 64 * 64);
}

KellerStatus leaf_blocks(KellerAccel *a, const Leaves *leaves, const Attached *attached, KellerError *error)
{
    const uint32_t *edges, n = a->leaf_count = leaves->block_count;
    size_t bytes = ((size_t)n + 1) * sizeof *a->edge_begin;
    a->edge_begin = malloc(bytes);
    if (!a->edge_begin) return keller_error_memory(error, bytes);
    a->edge_begin[0] = 0;
    uint64_t blocks = 0;
    for (uint32_t b = 0; b < n; b++) {
        uint32_t count = 0;
        for (uint32_t i = leaves->begin[b]; i < leaves->begin[b + 1]; i++) count += edges_with(a, attached, leaves->refs[i], &edges);
        blocks += (count + 7) / 8;
        if (blocks > UINT32_MAX) return keller_error(error, KELLER_FAILED, "edges are copied to more leaves than can be counted");
        a->edge_begin[b + 1] = (uint32_t)blocks;
    }
    if (a->input.triangle_count) a->triangles = aligned(n * sizeof *a->triangles, &bytes);
    a->edges = aligned(a->edge_begin[n] * sizeof *a->edges, &bytes);
    if ((!a->triangles && a->input.triangle_count) || !a->edges) return keller_error_memory(error, bytes);
    for (uint32_t b = 0; b < n; b++) {
        const uint32_t *refs = &leaves->refs[leaves->begin[b]], count = leaves->begin[b + 1] - leaves->begin[b];
        if (a->triangles) put_triangles(a, refs, count, &a->triangles[b]);
        for (uint32_t i = 0, at = 0; i < count; i++)
            for (uint32_t k = edges_with(a, attached, refs[i], &edges); k-- > 0; at++)
                put_edge(a, &a->edges[a->edge_begin[b]], at, *edges++);
    }
    return KELLER_OK;
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
