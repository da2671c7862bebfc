#include "mesh/build.h"

#include <string.h>

typedef struct {
    KellerVec3 p;
    uint32_t index;
} Sorted;

static int by_position(const void *x, const void *y)
{
    const Sorted *a = x, *b = y;
    int order = keller_mesh_compare(a->p, b->p);
    return order ? order : (a->index > b->index) - (a->index < b->index);
}

/* A hash table of grid cells as wide as the weld distance, each a list of representatives. */
typedef struct {
    KellerVec3 lower;
    double cell;
    size_t mask;
    uint32_t *head; /* [mask + 1] */
    uint32_t *next; /* [count] */
} Grid;

static size_t slot(const Grid *grid, double i, double j, double k)
{
    uint64_t h = (uint64_t)(int64_t)i * 0x9e3779b97f4a7c15u ^ (uint64_t)(int64_t)j * 0xc2b2ae3d27d4eb4fu ^
                 (uint64_t)(int64_t)k * 0x165667b19e3779f9u;
    h ^= h >> 29;
    h *= 0xbf58476d1ce4e5b9u;
    return (size_t)(h ^ h >> 32) & grid->mask;
}

/* The nearest representative within `distance`; the first in order among equally near ones. */
static uint32_t nearest(const Grid *grid, const KellerVec3 *points, KellerVec3 p, double distance)
{
    double i = floor((p.x - grid->lower.x) / grid->cell), j = floor((p.y - grid->lower.y) / grid->cell),
           k = floor((p.z - grid->lower.z) / grid->cell);
    uint32_t found = KELLER_NONE;
    double best = distance;
    for (int n = 0; n < 27; n++) {
        size_t at = slot(grid, i + n % 3 - 1, j + n / 3 % 3 - 1, k + n / 9 - 1);
        for (uint32_t r = grid->head[at]; r != KELLER_NONE; r = grid->next[r]) {
            double d = v3_distance(points[r], p);
            if (d < best ||
                (d == best && (found == KELLER_NONE || keller_mesh_compare(points[r], points[found]) < 0))) {
                best = d;
                found = r;
            }
        }
    }
    return found;
}

bool keller_mesh_weld(KellerBuild *build, size_t count, const KellerVec3 *points, double distance, uint32_t *stands)
{
    if (!count) return true;
    Grid grid = {.cell = distance, .mask = 15};
    while (grid.mask < 2 * count) grid.mask = 2 * grid.mask + 1;
    Sorted *sorted = keller_mesh_allocate(build, count, sizeof *sorted);
    grid.head = keller_mesh_allocate(build, grid.mask + 1, sizeof *grid.head);
    grid.next = keller_mesh_allocate(build, count, sizeof *grid.next);
    bool ok = sorted && grid.head && grid.next;
    if (ok) {
        memset(grid.head, 0xff, (grid.mask + 1) * sizeof *grid.head);
        grid.lower = points[0];
        for (size_t i = 0; i < count; i++) {
            sorted[i] = (Sorted){points[i], (uint32_t)i};
            grid.lower = v3(fmin(grid.lower.x, points[i].x), fmin(grid.lower.y, points[i].y),
                            fmin(grid.lower.z, points[i].z));
        }
        qsort(sorted, count, sizeof *sorted, by_position);
        for (size_t i = 0; i < count; i++) {
            uint32_t index = sorted[i].index, found = nearest(&grid, points, sorted[i].p, distance);
            stands[index] = found != KELLER_NONE ? found : index;
            if (found != KELLER_NONE) continue;
            size_t at = slot(&grid, floor((sorted[i].p.x - grid.lower.x) / grid.cell),
                             floor((sorted[i].p.y - grid.lower.y) / grid.cell),
                             floor((sorted[i].p.z - grid.lower.z) / grid.cell));
            grid.next[index] = grid.head[at];
            grid.head[at] = index;
        }
    }
    free(sorted);
    free(grid.head);
    free(grid.next);
    return ok;
}
