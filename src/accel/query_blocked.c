/* Is a cone wholly blocked? A surface made of the triangles that the cone meets, joined where they share an edge, has no free
 * edge inside the cone if every edge of its triangles that the cone may meet is shared by exactly two of them. If it also
 * stays clear of both ends of the frustum, its border lies on the envelope; then a curve from one end to the other within
 * the cone passes it an odd number of times if the axis does, and so at least once (intersection numbers modulo 2). All tests
 * err on the side of more edges met, so the answer yes is never wrong. */
#include <stdlib.h>
#include <string.h>

#include "accel/leaf.h"
#include "base/number.h"
#include "keller/ray.h"

typedef struct {
    uint32_t triangle;
    KellerRange range;              /* within the cone from its origin to infinity */
    bool taken;
} Candidate;

/* A side of a candidate, its vertices in ascending order. */
typedef struct {
    uint32_t vertex[2];
    uint32_t candidate;
} Side;

typedef struct {
    Candidate *list;
    size_t count, room, most;
    bool overflow;                  /* more than `most`, or than memory has room for */
    Side *sides;                    /* [3 count], sorted by vertices */
} Candidates;

static double collect(void *context, uint32_t triangle, KellerRange range)
{
    Candidates *c = context;
    if (c->count == c->room) {
        size_t room = 2 * c->room + 64 < c->most ? 2 * c->room + 64 : c->most;
        Candidate *grown = c->count < c->most ? realloc(c->list, room * sizeof *grown) : NULL;
        c->overflow = !grown;
        if (!grown) return -INFINITY;
        c->list = grown;
        c->room = room;
    }
    c->list[c->count++] = (Candidate){triangle, range, false};
    return INFINITY;
}

static int by_range(const void *a, const void *b)
{
    const Candidate *p = a, *q = b;
    if (p->range.near != q->range.near) return p->range.near < q->range.near ? -1 : 1;
    return (p->triangle > q->triangle) - (p->triangle < q->triangle);
}

static int by_vertices(const void *a, const void *b)
{
    const Side *p = a, *q = b;
    if (p->vertex[0] != q->vertex[0]) return p->vertex[0] < q->vertex[0] ? -1 : 1;
    return (p->vertex[1] > q->vertex[1]) - (p->vertex[1] < q->vertex[1]);
}

static Side side_of(uint32_t u, uint32_t v, size_t candidate)
{
    return (Side){{u < v ? u : v, u < v ? v : u}, (uint32_t)candidate};
}

static bool list_sides(const KellerAccel *a, Candidates *c)
{
    c->sides = malloc((3 * c->count + 1) * sizeof *c->sides);
    if (!c->sides) return false;
    for (size_t i = 0; i < c->count; i++)
        for (size_t j = 0; j < 3; j++) {
            const uint32_t *t = a->input.triangles[c->list[i].triangle];
            c->sides[3 * i + j] = side_of(t[j], t[(j + 1) % 3], i);
        }
    qsort(c->sides, 3 * c->count, sizeof *c->sides, by_vertices);
    return true;
}

/* The other candidate on the edge between two vertices; -1 unless there is exactly one. */
static int64_t neighbour(const Candidates *c, size_t self, uint32_t u, uint32_t v)
{
    const Side wanted = side_of(u, v, self), *end = c->sides + 3 * c->count;
    const Side *side = bsearch(&wanted, c->sides, 3 * c->count, sizeof *c->sides, by_vertices);
    while (side > c->sides && by_vertices(side - 1, &wanted) == 0) side--;
    int64_t found = -1;
    for (int on = 0; side < end && by_vertices(side, &wanted) == 0; side++) {
        if (++on > 2) return -1; /* two of one degenerate triangle too */
        if (side->candidate != self) found = side->candidate;
    }
    return found;
}

/* Takes the whole surface around a candidate into stack[0 .. *taken), which has room for all candidates; false if it has a free
 * edge, leaves the frustum or has more than `most` triangles. A part of it alone would say nothing. */
static bool follow(const KellerAccel *a, const KellerCone *cone, KellerRange clip, Candidates *c, size_t start, size_t most,
                   size_t *stack, size_t *taken)
{
    bool closed = true;
    stack[0] = start;
    *taken = 1;
    c->list[start].taken = true;
    for (size_t next = 0; next < *taken; next++) {
        const Candidate *s = &c->list[stack[next]];
        const uint32_t *t = a->input.triangles[s->triangle];
        if (!(s->range.near > clip.near && s->range.far < clip.far)) closed = false;
        for (int j = 0; j < 3; j++) {
            uint32_t u = t[j], v = t[(j + 1) % 3];
            if (u == v) {
                closed = false;
                continue;
            }
            if (!keller_cone_meets_edge(cone, a->input.vertices[u], a->input.vertices[v], (KellerRange){0, INFINITY})) continue;
            int64_t other = neighbour(c, stack[next], u, v);
            if (other < 0) {
                closed = false;
            } else if (!c->list[other].taken) {
                c->list[other].taken = true;
                stack[(*taken)++] = (size_t)other;
            }
        }
    }
    return closed && *taken <= most;
}

/* Does the axis pass the surface an odd number of times? A hit on an edge or a corner is not counted for sure: no. */
static bool odd(const KellerAccel *a, const KellerCone *cone, const Candidates *c, const size_t *stack, size_t taken)
{
    KellerRay axis = keller_ray(cone->origin, cone->directrix);
    size_t hits = 0;
    for (size_t i = 0; i < taken; i++) {
        KellerVec3 v[3];
        double weight[3];
        triangle_of(a, c->list[stack[i]].triangle, v);
        if (!keller_ray_triangle(&axis, v[0], v[1], v[2], (KellerRange){0, INFINITY}, NULL, weight)) continue;
        if (!(lesser(weight[0], lesser(weight[1], weight[2])) > 1e-9)) return false;
        hits++;
    }
    return hits % 2 == 1;
}

static int by_number(const void *a, const void *b)
{
    const size_t *p = a, *q = b;
    return (*p > *q) - (*p < *q);
}

bool keller_accel_cone_blocked(const KellerAccel *accel, const KellerCone *cone, KellerRange clip, size_t most,
                               uint32_t *triangles, size_t *count, KellerAccelWork *work)
{
    *count = 0;
    if (most > accel->input.triangle_count) most = accel->input.triangle_count;
    if (most == 0) return false;
    /* of the cone without its ends, so that a triangle's part in front of or behind them is seen */
    KellerCone whole = *cone;
    whole.z_near = 0;
    whole.z_far = INFINITY;
    clip = (KellerRange){greater(cone->z_near, clip.near), lesser(cone->z_far, clip.far)};
    enum { SPARE = 64 };
    Candidates c = {.most = 4 * most + SPARE};
    keller_accel_cone(accel, &whole, (KellerRange){0, clip.far}, collect, NULL, &c, work);
    if (c.count > 0) qsort(c.list, c.count, sizeof *c.list, by_range);
    size_t *stack = malloc((c.count + 1) * sizeof *stack), taken = 0;
    bool blocked = false;
    if (!c.overflow && stack && list_sides(accel, &c))
        for (size_t i = 0; i < c.count && !blocked; i++)
            if (!c.list[i].taken)
                blocked = follow(accel, &whole, clip, &c, i, most, stack, &taken) && odd(accel, cone, &c, stack, taken);
    if (blocked) {
        qsort(stack, taken, sizeof *stack, by_number); /* candidates are in the order of their ranges */
        for (; *count < taken; ++*count) triangles[*count] = c.list[stack[*count]].triangle;
    }
    free(c.list);
    free(c.sides);
    free(stack);
    return blocked;
}
