#include "io/polygon.h"

#include <assert.h>
#include <stdlib.h>

typedef struct KellerPolygonCorner {
    double x, y;      /* in a coordinate plane, counter-clockwise */
    double turn;      /* twice the area of (previous, this, next): > 0 convex */
    double quality;   /* of the ear at this corner; <= 0: not an ear */
    uint32_t previous, next;
} Corner;

static double area2(const Corner *a, const Corner *b, const Corner *c)
{
    return (b->x - a->x) * (c->y - a->y) - (b->y - a->y) * (c->x - a->x);
}

static double distance2(const Corner *a, const Corner *b)
{
    return (a->x - b->x) * (a->x - b->x) + (a->y - b->y) * (a->y - b->y);
}

static bool same_place(const Corner *a, const Corner *b) { return a->x == b->x && a->y == b->y; }

static void set_turn(Corner *corners, uint32_t i)
{
    corners[i].turn = area2(&corners[corners[i].previous], &corners[i], &corners[corners[i].next]);
}

/* An ear may be clipped when its area is positive and no other corner lies in it. Testing the corners that are not convex
 * suffices: where any corner of a simple polygon lies in the triangle, one of these does (Eberly, "Triangulation by ear
 * clipping", 2002). The border counts as inside, so that a cut never passes through a corner; corners at the place of
 * one of the ear's own are the two sides of a bridge to a hole. */
static void set_ear(Corner *corners, uint32_t i)
{
    const Corner *b = &corners[i], *a = &corners[b->previous], *c = &corners[b->next];
    corners[i].quality = 0;
    if (!(b->turn > 0)) return;
    for (uint32_t j = c->next; j != b->previous; j = corners[j].next) {
        const Corner *p = &corners[j];
        if (p->turn > 0 || same_place(p, a) || same_place(p, b) || same_place(p, c)) continue;
        if (area2(a, b, p) >= 0 && area2(b, c, p) >= 0 && area2(c, a, p) >= 0) return;
    }
    /* Area over squared edges: 0 for a sliver, largest for an equilateral triangle. A fan would make slivers of corners
     * that are collinear but for rounding, and a sliver's normal is noise. */
    corners[i].quality = b->turn / (distance2(a, b) + distance2(b, c) + distance2(c, a));
}

/* Newell's normal: its components are twice the areas of the polygon's shadows on the coordinate planes. */
static KellerVec3 newell(const KellerVec3 *points, const uint32_t *index, size_t count)
{
    KellerVec3 normal = v3(0, 0, 0), origin = points[index[0]];
    for (size_t i = 0; i < count; i++) {
        KellerVec3 p = v3_sub(points[index[i]], origin), q = v3_sub(points[index[(i + 1) % count]], origin);
        normal = v3_add(normal, v3_cross(p, q));
    }
    return normal;
}

/* The shadow on the coordinate plane that shows most of the polygon has the same ears as the polygon in its own plane,
 * and taking coordinates as they are rounds nothing. */
static void project(const KellerVec3 *points, const uint32_t *index, size_t count, KellerVec3 n, Corner *corners)
{
    double x = fabs(n.x), y = fabs(n.y), z = fabs(n.z);
    for (size_t i = 0; i < count; i++) {
        KellerVec3 p = points[index[i]];
        double u, v, sense;
        if (z >= x && z >= y) u = p.x, v = p.y, sense = n.z;
        else if (y >= x) u = p.z, v = p.x, sense = n.y;
        else u = p.y, v = p.z, sense = n.x;
        corners[i] = (Corner){.x = sense < 0 ? v : u, .y = sense < 0 ? u : v,
                              .previous = (uint32_t)((i + count - 1) % count), .next = (uint32_t)((i + 1) % count)};
    }
}

/* The best ear left; on equal terms the first one from `start` on. Without an ear, a corner without area loses nothing;
 * else any corner will do, and the polygon is not simple. */
static uint32_t choose(const Corner *corners, uint32_t start, bool *simple)
{
    uint32_t best = start, flat = UINT32_MAX, convex = UINT32_MAX, i = start;
    do {
        if (corners[i].quality > corners[best].quality) best = i;
        if (corners[i].turn == 0 && flat == UINT32_MAX) flat = i;
        if (corners[i].turn > 0 && convex == UINT32_MAX) convex = i;
        i = corners[i].next;
    } while (i != start);
    if (corners[best].quality > 0) return best;
    if (flat != UINT32_MAX) return flat;
    *simple = false;
    return convex != UINT32_MAX ? convex : start;
}

/* The border of a simple polygon turns once (Hopf's Umlaufsatz). A border that runs back on itself turns by half a circle
 * there, either way: then nothing is known. */
static bool turns_once(const Corner *corners, size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < count; i++) {
        const Corner *a = &corners[corners[i].previous], *b = &corners[i], *c = &corners[b->next];
        double along = (b->x - a->x) * (c->x - b->x) + (b->y - a->y) * (c->y - b->y);
        if (b->turn == 0 && along <= 0) return true;
        sum += atan2(b->turn, along);
    }
    return fabs(sum - 2 * M_PI) < M_PI; /* a multiple of 2 pi but for rounding */
}

KellerStatus keller_polygon_cut(const KellerVec3 *points, const uint32_t *index, size_t count,
                                uint32_t (*triangles)[3], bool *simple, KellerPolygonScratch *scratch,
                                KellerError *error)
{
    assert(count >= 3 && count <= KELLER_POLYGON_MAX_CORNERS);
    bool is_simple = true;
    if (count > scratch->capacity) {
        Corner *grown = realloc(scratch->corners, count * sizeof *grown);
        if (!grown) return keller_error_memory(error, count * sizeof *grown);
        scratch->corners = grown;
        scratch->capacity = count;
    }
    Corner *corners = scratch->corners;
    KellerVec3 normal = newell(points, index, count);
    project(points, index, count, normal, corners);
    for (uint32_t i = 0; i < count; i++) set_turn(corners, i);
    if ((normal.x == 0 && normal.y == 0 && normal.z == 0) || !turns_once(corners, count)) is_simple = false;
    for (uint32_t i = 0; i < count; i++) set_ear(corners, i);
    uint32_t start = 1; /* so that a rectangle is cut as a fan from its first corner */
    for (size_t left = count, done = 0; left >= 3; left--, done++) {
        uint32_t i = left == 3 ? start : choose(corners, start, &is_simple);
        uint32_t before = corners[i].previous, after = corners[i].next;
        triangles[done][0] = index[before];
        triangles[done][1] = index[i];
        triangles[done][2] = index[after];
        corners[before].next = after;
        corners[after].previous = before;
        if (left == 3) break;
        if (i == start) start = after;
        /* Clipping an ear changes only its two neighbours: the remaining polygon's diagonals are those of the former one
         * that lie in it (O'Rourke, Computational Geometry in C, 1.5). */
        set_turn(corners, before);
        set_turn(corners, after);
        set_ear(corners, before);
        set_ear(corners, after);
    }
    if (simple) *simple = is_simple;
    return KELLER_OK;
}

void keller_polygon_free(KellerPolygonScratch *scratch)
{
    free(scratch->corners);
    *scratch = (KellerPolygonScratch){0};
}
