/* Sectors that follow each other along a line are one wedge, so that cutting a wall into more triangles adds none. */
#include "mesh/build.h"

/* More ends than this of one pair of faces at one point are no line; they stay apart. */
enum { MOST_AT_NODE = 64 };

/* One end of a sector, seen from outside: away from it the sector lies between face[0] and, counter-clockwise,
 * face[1]. */
typedef struct {
    uint32_t node, face[2], sector, end;
} End;

typedef struct {
    KellerBuild *build;
    uint32_t *node;      /* [2 sectors] ends within the contact tolerance share one */
    End *ends;           /* [2 sectors] */
    uint32_t *link;      /* [2 sectors] end 2 s + e -> the end that continues it, or KELLER_NONE */
    bool *done;          /* by sector */
    uint32_t *chain;     /* sectors in order */
    uint32_t *entry;     /* the end by which each is entered */
} Chains;

static KellerVec3 place(const KellerBuild *build, uint32_t point)
{
    size_t vertices = build->scene->vertex_count;
    return point < vertices ? build->scene->vertices[point] : build->points[point - vertices];
}

static KellerVec3 end_place(const KellerBuild *build, uint32_t end)
{
    return place(build, build->sectors[end / 2].end[end % 2]);
}

static int by_node(const void *x, const void *y)
{
    const End *a = x, *b = y;
    uint32_t low_a = a->face[0] < a->face[1] ? a->face[0] : a->face[1], high_a = a->face[0] ^ a->face[1] ^ low_a;
    uint32_t low_b = b->face[0] < b->face[1] ? b->face[0] : b->face[1], high_b = b->face[0] ^ b->face[1] ^ low_b;
    if (a->node != b->node) return a->node < b->node ? -1 : 1;
    if (low_a != low_b) return low_a < low_b ? -1 : 1;
    if (high_a != high_b) return high_a < high_b ? -1 : 1;
    if (a->sector != b->sector) return a->sector < b->sector ? -1 : 1;
    return (a->end > b->end) - (a->end < b->end);
}

static double off_line(KellerVec3 p, KellerVec3 a, KellerVec3 b)
{
    KellerVec3 d = v3_unit(v3_sub(b, a)), q = v3_sub(p, a);
    return v3_norm(v3_madd(q, d, -v3_dot(q, d)));
}

/* Cosine of the bend from a to b where b continues a in a straight line with the same sector, else 2. */
static double bend(const KellerBuild *build, const End *a, const End *b)
{
    if (a->sector == b->sector || a->face[0] != b->face[1] || a->face[1] != b->face[0]) return 2;
    uint32_t i = 2 * a->sector + a->end, j = 2 * b->sector + b->end;
    KellerVec3 far_a = end_place(build, i ^ 1), far_b = end_place(build, j ^ 1);
    KellerVec3 near_a = end_place(build, i), near_b = end_place(build, j);
    double cosine = v3_dot(v3_unit(v3_sub(far_a, near_a)), v3_unit(v3_sub(far_b, near_b)));
    if (cosine >= 0 || fmax(off_line(near_a, far_a, far_b), off_line(near_b, far_a, far_b)) > build->contact) return 2;
    const KellerSector *p = &build->sectors[a->sector], *q = &build->sectors[b->sector];
    /* Seen from outside, the first face of a is tangent[end]; it is the second of b. */
    for (uint32_t k = 0; k < 2; k++)
        if (v3_dot(p->tangent[a->end ^ k], q->tangent[b->end ^ k ^ 1]) <= 0) return 2;
    return cosine;
}

static const End *best_partner(const KellerBuild *build, const End *end, const End *begin, const End *stop)
{
    const End *best = NULL;
    double least = 1;
    for (const End *other = begin; other < stop; other++) {
        double cosine = bend(build, end, other);
        if (cosine >= least) continue;
        least = cosine;
        best = other;
    }
    return best;
}

static void link_ends(Chains *chains, size_t count)
{
    for (size_t i = 0, j; i < count; i = j) {
        const End *begin = &chains->ends[i];
        uint32_t low = begin->face[0] < begin->face[1] ? begin->face[0] : begin->face[1];
        uint32_t both = begin->face[0] ^ begin->face[1];
        for (j = i + 1; j < count; j++) {
            const End *e = &chains->ends[j];
            uint32_t other = e->face[0] < e->face[1] ? e->face[0] : e->face[1];
            if (e->node != begin->node || other != low || (e->face[0] ^ e->face[1]) != both) break;
        }
        const End *stop = &chains->ends[j];
        if (j - i > MOST_AT_NODE) continue;
        for (const End *end = begin; end < stop; end++) {
            const End *partner = best_partner(chains->build, end, begin, stop);
            if (partner && best_partner(chains->build, partner, begin, stop) == end)
                chains->link[2 * end->sector + end->end] = 2 * partner->sector + partner->end;
        }
    }
}

/* Splits the chain at the point farthest from the chord until no point is off by more than the contact tolerance
 * (Douglas and Peucker), so that a fine polygon does not become one edge by many small bends. */
static bool emit_pieces(Chains *chains, size_t count, size_t (*stack)[2], KellerEmitWedge emit, void *context)
{
    KellerBuild *build = chains->build;
    size_t depth = 0;
    stack[depth][0] = 0;
    stack[depth++][1] = count;
    while (depth) {
        depth--;
        size_t begin = stack[depth][0], end = stack[depth][1], split = 0;
        uint32_t from = 2 * chains->chain[begin] + chains->entry[begin];
        uint32_t to = 2 * chains->chain[end - 1] + (chains->entry[end - 1] ^ 1);
        KellerVec3 a = end_place(build, from), b = end_place(build, to);
        double most = build->contact;
        size_t model = begin;
        double longest = -1;
        for (size_t i = begin; i < end; i++) {
            const KellerSector *sector = &build->sectors[chains->chain[i]];
            double length = v3_distance(place(build, sector->end[0]), place(build, sector->end[1]));
            double off =
                i + 1 < end ? off_line(end_place(build, 2 * chains->chain[i] + (chains->entry[i] ^ 1)), a, b) : 0;
            if (off > most) {
                most = off;
                split = i + 1;
            }
            if (length > longest) {
                longest = length;
                model = i;
            }
        }
        if (split) {
            stack[depth][0] = split;
            stack[depth++][1] = end;
            stack[depth][0] = begin;
            stack[depth++][1] = split;
            continue;
        }
        if (!emit(build, context, build->sectors[from / 2].end[from % 2], build->sectors[to / 2].end[to % 2],
                  end - begin, chains->chain + begin, chains->chain[model], chains->entry[model] == 1))
            return false;
    }
    return true;
}

/* Follows the links from the sector entered by `entry` to the end of its chain. */
static size_t follow(Chains *chains, uint32_t sector, uint32_t entry)
{
    size_t count = 0;
    while (!chains->done[sector]) {
        chains->done[sector] = true;
        chains->chain[count] = sector;
        chains->entry[count++] = entry;
        uint32_t next = chains->link[2 * sector + (entry ^ 1)];
        if (next == KELLER_NONE) break;
        sector = next / 2;
        entry = next % 2;
    }
    return count;
}

bool keller_mesh_chains(KellerBuild *build, KellerEmitWedge emit, void *context)
{
    size_t count = build->sector_count;
    Chains chains = {.build = build};
    KellerVec3 *places = keller_mesh_allocate(build, 2 * count, sizeof *places);
    size_t (*stack)[2] = keller_mesh_allocate(build, count + 2, sizeof *stack);
    chains.node = keller_mesh_allocate(build, 2 * count, sizeof *chains.node);
    chains.ends = keller_mesh_allocate(build, 2 * count, sizeof *chains.ends);
    chains.link = keller_mesh_allocate(build, 2 * count, sizeof *chains.link);
    chains.done = keller_mesh_allocate(build, count, sizeof *chains.done);
    chains.chain = keller_mesh_allocate(build, count, sizeof *chains.chain);
    chains.entry = keller_mesh_allocate(build, count, sizeof *chains.entry);
    bool ok =
        places && stack && chains.node && chains.ends && chains.link && chains.done && chains.chain && chains.entry;
    for (uint32_t i = 0; ok && i < 2 * count; i++) places[i] = end_place(build, i);
    ok = ok && keller_mesh_weld(build, 2 * count, places, build->contact, chains.node);
    if (ok) {
        for (uint32_t i = 0; i < 2 * count; i++) {
            const KellerSector *sector = &build->sectors[i / 2];
            chains.ends[i] = (End){chains.node[i], {sector->face[i % 2], sector->face[1 - i % 2]}, i / 2, i % 2};
            chains.link[i] = KELLER_NONE;
        }
        qsort(chains.ends, 2 * count, sizeof *chains.ends, by_node);
        link_ends(&chains, 2 * count);
        /* Open chains from their ends first; what is left are loops. */
        for (int loops = 0; ok && loops < 2; loops++)
            for (uint32_t i = 0; ok && i < 2 * count; i++) {
                if (chains.done[i / 2] || (!loops && chains.link[i] != KELLER_NONE)) continue;
                ok = emit_pieces(&chains, follow(&chains, i / 2, i % 2), stack, emit, context);
            }
    }
    free(places);
    free(stack);
    free(chains.node);
    free(chains.ends);
    free(chains.link);
    free(chains.done);
    free(chains.chain);
    free(chains.entry);
    return ok;
}
