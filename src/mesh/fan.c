/* The fan of half-planes around each edge, piece by piece, and the sectors of it that diffract. */
#include "mesh/build.h"

#define PI 3.14159265358979323846

/* What one touching triangle adds to the fan. */
typedef struct {
    double angle;        /* around the edge, by the normal of the face's plane group: equal within a group */
    KellerVec3 tangent;  /* from the edge into the face, by the face's own normal */
    uint32_t face, touch;
    bool thin;
} HalfPlane;

/* A possible end of a piece. */
typedef struct {
    double t;
    uint32_t point;      /* vertex, crossing (from vertex_count on) or KELLER_NONE: not named yet */
} Cut;

/* A stretch of an edge whose fan is known; another edge in the same place has nothing to add there. */
typedef struct {
    double begin, end;
} Span;

typedef struct {
    KellerBuild *build;
    uint32_t edge;
    KellerVec3 a, d, across, up; /* the edge's first vertex and frame; across x up = d */
    double length;
    HalfPlane *halves, *present;
    size_t half_count, half_capacity, present_count, present_capacity;
    uint32_t *active;                 /* half-planes over the piece at hand, in order of their touches */
    size_t active_count, active_capacity, next_half;
    Cut *cuts;
    size_t cut_count, cut_capacity;
    Span *spans;
    size_t span_count, span_capacity;
    size_t *span_begin, *span_number; /* by edge */
    size_t *cluster;                  /* [cluster_capacity] the member of `present` that stands for each direction */
    size_t cluster_count, cluster_capacity;
} Fan;

/* ---- half-planes ---- */

/* The direction in which the triangle lies, seen from the edge: that of its corner farthest from the edge. */
static KellerVec3 outward(const Fan *fan, uint32_t triangle)
{
    KellerVec3 far = {0, 0, 0};
    double most = -1;
    for (int i = 0; i < 3; i++) {
        KellerVec3 p = v3_sub(keller_mesh_corner(fan->build->scene, triangle, i), fan->a);
        p = v3_madd(p, fan->d, -v3_dot(p, fan->d));
        if (v3_norm(p) > most) {
            most = v3_norm(p);
            far = p;
        }
    }
    return far;
}

/* The unit vector in the plane with this normal, perpendicular to the edge, on the side of `far`; `far` itself where
 * the plane does not hold the edge (only faces smaller than the tolerance do that). */
static KellerVec3 tangent_of(const Fan *fan, KellerVec3 normal, KellerVec3 far)
{
    KellerVec3 n = v3_madd(normal, fan->d, -v3_dot(normal, fan->d));
    if (v3_norm(n) < 0.5) return v3_unit(far);
    KellerVec3 tangent = v3_cross(v3_unit(n), fan->d);
    return v3_dot(tangent, far) < 0 ? v3_scale(tangent, -1) : tangent;
}

static bool add_half(Fan *fan, uint32_t touch, uint32_t triangle, KellerVec3 far)
{
    KellerBuild *build = fan->build;
    if (!keller_mesh_reserve(build, (void **)&fan->halves, &fan->half_capacity, fan->half_count + 1,
                             sizeof *fan->halves))
        return false;
    uint32_t face = build->scene->triangle_face[triangle];
    KellerVec3 common = tangent_of(fan, build->plane_normal[build->scene->faces[face].plane], far);
    KellerVec3 own = tangent_of(fan, build->scene->faces[face].normal, common);
    fan->halves[fan->half_count++] = (HalfPlane){atan2(v3_dot(common, fan->up), v3_dot(common, fan->across)), own, face,
                                                 touch, keller_mesh_thin(build, triangle)};
    return true;
}

static int by_angle(const void *x, const void *y)
{
    const HalfPlane *a = x, *b = y;
    if (a->angle != b->angle) return a->angle < b->angle ? -1 : 1;
    if (a->face != b->face) return a->face < b->face ? -1 : 1;
    return (a->touch > b->touch) - (a->touch < b->touch);
}

static bool add_cut(Fan *fan, double t, uint32_t point)
{
    if (!keller_mesh_reserve(fan->build, (void **)&fan->cuts, &fan->cut_capacity, fan->cut_count + 1,
                             sizeof *fan->cuts))
        return false;
    fan->cuts[fan->cut_count++] = (Cut){t, point};
    return true;
}

static bool open_fan(Fan *fan, uint32_t edge)
{
    const KellerBuild *build = fan->build;
    const uint32_t *ends = build->adjacency.vertices[edge];
    KellerVec3 b = build->scene->vertices[ends[1]];
    fan->edge = edge;
    fan->a = build->scene->vertices[ends[0]];
    fan->d = v3_unit(v3_sub(b, fan->a));
    fan->length = v3_distance(fan->a, b);
    fan->across = v3_perpendicular(fan->d);
    fan->up = v3_cross(fan->d, fan->across);
    fan->half_count = fan->cut_count = fan->active_count = fan->next_half = 0;
    if (!add_cut(fan, 0, ends[0]) || !add_cut(fan, fan->length, ends[1])) return false;
    const KellerTouch *touch = build->touches + build->touch_begin[edge];
    for (uint32_t i = 0; i < build->touch_number[edge]; i++) {
        KellerVec3 far = outward(fan, touch[i].triangle);
        if (touch[i].kind == KELLER_TOUCH_INSIDE && !add_half(fan, i, touch[i].triangle, v3_scale(far, -1)))
            return false;
        if (!add_half(fan, i, touch[i].triangle, far)) return false;
        if (!add_cut(fan, touch[i].begin, touch[i].begin_vertex) || !add_cut(fan, touch[i].end, touch[i].end_vertex))
            return false;
    }
    return true;
}

/* ---- pieces ---- */

static int by_place(const void *x, const void *y)
{
    const Cut *a = x, *b = y;
    if (a->t != b->t) return a->t < b->t ? -1 : 1;
    return (a->point > b->point) - (a->point < b->point);
}

/* Cuts within the contact tolerance of each other are one; a vertex names it before a crossing does, the edge's own
 * ends before other vertices. */
static void join_cuts(Fan *fan)
{
    double slack = fmin(fan->build->contact, 0.25 * fan->length);
    const uint32_t *ends = fan->build->adjacency.vertices[fan->edge];
    qsort(fan->cuts, fan->cut_count, sizeof *fan->cuts, by_place);
    size_t kept = 0;
    double first = -INFINITY;
    for (size_t i = 0; i < fan->cut_count; i++) {
        Cut cut = fan->cuts[i];
        if (cut.t <= slack) cut = (Cut){0, ends[0]};
        if (cut.t >= fan->length - slack) cut = (Cut){fan->length, ends[1]};
        /* The last cluster must not run into the end, which keeps its own place. */
        bool end = cut.t == fan->length && kept && fan->cuts[kept - 1].t != fan->length;
        if (kept && !end && cut.t - first <= slack) {
            if (cut.point < fan->cuts[kept - 1].point && first > 0 && cut.t < fan->length) fan->cuts[kept - 1] = cut;
            continue;
        }
        first = cut.t;
        fan->cuts[kept++] = cut;
    }
    fan->cut_count = kept;
}

/* Brings the half-planes over the point at t up to date; t only ever grows, and touches are in order of their
 * beginnings, so that a long edge with many short touches takes no more than a sweep. */
static bool advance(Fan *fan, double t)
{
    const KellerTouch *touch = fan->build->touches + fan->build->touch_begin[fan->edge];
    if (!keller_mesh_reserve(fan->build, (void **)&fan->active, &fan->active_capacity, fan->half_count,
                             sizeof *fan->active))
        return false;
    for (; fan->next_half < fan->half_count && touch[fan->halves[fan->next_half].touch].begin <= t; fan->next_half++)
        fan->active[fan->active_count++] = (uint32_t)fan->next_half;
    size_t kept = 0;
    for (size_t i = 0; i < fan->active_count; i++)
        if (touch[fan->halves[fan->active[i]].touch].end >= t) fan->active[kept++] = fan->active[i];
    fan->active_count = kept;
    return true;
}

/* The half-planes that make the fan, in order of angle. A thin triangle has no direction: it counts only where nothing
 * else is. */
static bool select_present(Fan *fan)
{
    if (!keller_mesh_reserve(fan->build, (void **)&fan->present, &fan->present_capacity, fan->active_count,
                             sizeof *fan->present))
        return false;
    for (int thin = 0; thin < 2; thin++) {
        fan->present_count = 0;
        for (size_t i = 0; i < fan->active_count; i++) {
            const HalfPlane *half = &fan->halves[fan->active[i]];
            if (half->thin == (thin == 1)) fan->present[fan->present_count++] = *half;
        }
        if (fan->present_count) break;
    }
    if (fan->present_count) qsort(fan->present, fan->present_count, sizeof *fan->present, by_angle);
    return true;
}

static double turn(double from, double to)
{
    double angle = to - from;
    return angle < 0 ? angle + 2 * PI : angle;
}

/* Half-planes in one direction, within the flat angle, are one; the lowest face stands for it. */
static bool find_clusters(Fan *fan)
{
    size_t count = fan->present_count, start = 0;
    if (!keller_mesh_reserve(fan->build, (void **)&fan->cluster, &fan->cluster_capacity, count, sizeof *fan->cluster))
        return false;
    fan->cluster_count = 0;
    while (start < count && count > 1 &&
           turn(fan->present[(start + count - 1) % count].angle, fan->present[start].angle) <= KELLER_FLAT_ANGLE)
        start++;
    for (size_t i = 0; i < count; i++) {
        size_t now = (start + i) % count, last = (start + i + count - 1) % count;
        if (i && turn(fan->present[last].angle, fan->present[now].angle) <= KELLER_FLAT_ANGLE) {
            size_t *stands = &fan->cluster[fan->cluster_count - 1];
            if (fan->present[now].face < fan->present[*stands].face) *stands = now;
        } else {
            fan->cluster[fan->cluster_count++] = now;
        }
    }
    return true;
}

/* ---- sectors ---- */

/* A sector diffracts if its angle is none of pi, pi/2, pi/3, ... */
static bool diffracts(double angle)
{
    double m = fmax(1, floor(PI / angle));
    return fabs(angle - PI / m) > KELLER_FLAT_ANGLE && fabs(angle - PI / (m + 1)) > KELLER_FLAT_ANGLE;
}

static bool name_cut(Fan *fan, size_t cut)
{
    KellerBuild *build = fan->build;
    if (fan->cuts[cut].point != KELLER_NONE) return true;
    if (!keller_mesh_reserve(build, (void **)&build->points, &build->point_capacity, build->point_count + 1,
                             sizeof *build->points))
        return false;
    fan->cuts[cut].point = (uint32_t)(build->scene->vertex_count + build->point_count);
    build->points[build->point_count++] = v3_madd(fan->a, fan->d, fan->cuts[cut].t);
    return true;
}

static bool add_planes(Fan *fan, size_t *begin, size_t *end)
{
    KellerBuild *build = fan->build;
    *begin = build->planes_count;
    for (size_t i = 0; i < fan->active_count; i++) {
        uint32_t plane = build->scene->faces[fan->halves[fan->active[i]].face].plane;
        bool known = false;
        for (size_t k = *begin; k < build->planes_count && !known; k++) known = build->planes[k] == plane;
        if (known) continue;
        if (!keller_mesh_reserve(build, (void **)&build->planes, &build->planes_capacity, build->planes_count + 1,
                                 sizeof *build->planes))
            return false;
        build->planes[build->planes_count++] = plane;
    }
    *end = build->planes_count;
    return true;
}

static bool add_sectors(Fan *fan, size_t cut)
{
    KellerBuild *build = fan->build;
    size_t plane_begin = 0, plane_end = 0;
    bool any = false;
    for (size_t i = 0; i < fan->cluster_count; i++) {
        const HalfPlane *from = &fan->present[fan->cluster[i]];
        const HalfPlane *to = &fan->present[fan->cluster[(i + 1) % fan->cluster_count]];
        double angle = 2 * PI;
        if (fan->cluster_count > 1) {
            if (build->scene->faces[from->face].plane == build->scene->faces[to->face].plane) continue;
            KellerVec3 up = v3_cross(fan->d, from->tangent);
            angle = atan2(v3_dot(to->tangent, up), v3_dot(to->tangent, from->tangent));
            /* The common angle says which turn is meant where the faces' own one is near zero. */
            angle += 2 * PI * round((turn(from->angle, to->angle) - angle) / (2 * PI));
            if (angle <= KELLER_FLAT_ANGLE || !diffracts(angle)) continue;
        }
        if (!any && (!name_cut(fan, cut) || !name_cut(fan, cut + 1) || !add_planes(fan, &plane_begin, &plane_end)))
            return false;
        any = true;
        if (!keller_mesh_reserve(build, (void **)&build->sectors, &build->sector_capacity, build->sector_count + 1,
                                 sizeof *build->sectors))
            return false;
        build->sectors[build->sector_count++] = (KellerSector){{fan->cuts[cut].point, fan->cuts[cut + 1].point},
                                                               {from->face, to->face},
                                                               {from->tangent, to->tangent},
                                                               angle, plane_begin, plane_end};
    }
    return true;
}

/* True if an edge that lies here as well, or across thin triangles, has been dealt with at the point at t. */
static bool claimed(const Fan *fan, double t)
{
    const KellerBuild *build = fan->build;
    const KellerTouch *touch = build->touches + build->touch_begin[fan->edge];
    KellerVec3 p = v3_madd(fan->a, fan->d, t);
    for (size_t i = 0; i < fan->active_count; i++) {
        uint32_t other = touch[fan->halves[fan->active[i]].touch].edge;
        if (other == KELLER_NONE || other == fan->edge) continue;
        const uint32_t *ends = build->adjacency.vertices[other];
        KellerVec3 a = build->scene->vertices[ends[0]];
        double s = v3_dot(v3_sub(p, a), v3_unit(v3_sub(build->scene->vertices[ends[1]], a)));
        for (size_t k = 0; k < fan->span_number[other]; k++) {
            const Span *span = &fan->spans[fan->span_begin[other] + k];
            if (span->begin <= s && s <= span->end) return true;
        }
    }
    return false;
}

static bool scan(Fan *fan)
{
    KellerBuild *build = fan->build;
    const KellerAdjacency *adjacency = &build->adjacency;
    bool rim = adjacency->begin[fan->edge + 1] - adjacency->begin[fan->edge] == 1, corner = false;
    size_t first = fan->span_count;
    for (size_t i = 0; i + 1 < fan->cut_count; i++) {
        double begin = fan->cuts[i].t, end = fan->cuts[i + 1].t, middle = 0.5 * (begin + end);
        if (!advance(fan, middle) || !select_present(fan) || !find_clusters(fan)) return false;
        corner = corner || fan->cluster_count > 1;
        if (claimed(fan, middle)) continue;
        if (!keller_mesh_reserve(build, (void **)&fan->spans, &fan->span_capacity, fan->span_count + 1,
                                 sizeof *fan->spans))
            return false;
        if (fan->span_count > first && fan->spans[fan->span_count - 1].end == begin)
            fan->spans[fan->span_count - 1].end = end;
        else fan->spans[fan->span_count++] = (Span){begin, end};
        if (!add_sectors(fan, i)) return false;
    }
    fan->span_begin[fan->edge] = first;
    fan->span_number[fan->edge] = fan->span_count - first;
    build->scene->report.contact_edges += rim && corner;
    return true;
}

/* Edges of triangles that have a width come first: the others see them, but not the other way round. */
typedef struct {
    bool thin;
    double length;
    uint32_t edge;
} Order;

static int by_rank(const void *x, const void *y)
{
    const Order *a = x, *b = y;
    if (a->thin != b->thin) return a->thin ? 1 : -1;
    if (a->length != b->length) return a->length > b->length ? -1 : 1;
    return (a->edge > b->edge) - (a->edge < b->edge);
}

bool keller_mesh_sectors(KellerBuild *build)
{
    const KellerScene *scene = build->scene;
    size_t edges = build->adjacency.edge_count, count = 0;
    Fan fan = {.build = build};
    fan.span_begin = keller_mesh_allocate(build, edges, sizeof *fan.span_begin);
    fan.span_number = keller_mesh_allocate(build, edges, sizeof *fan.span_number);
    Order *order = keller_mesh_allocate(build, edges, sizeof *order);
    bool ok = fan.span_begin && fan.span_number && order;
    for (uint32_t e = 0; ok && e < edges; e++) {
        if (keller_mesh_edge_flat(build, e)) continue;
        const uint32_t *ends = build->adjacency.vertices[e];
        bool thin = true;
        for (uint32_t k = build->adjacency.begin[e]; k < build->adjacency.begin[e + 1]; k++)
            thin = thin && keller_mesh_thin(build, build->adjacency.triangles[k]);
        order[count++] = (Order){thin, v3_distance(scene->vertices[ends[0]], scene->vertices[ends[1]]), e};
    }
    if (ok) qsort(order, count, sizeof *order, by_rank);
    for (size_t i = 0; ok && i < count; i++) {
        ok = open_fan(&fan, order[i].edge);
        if (!ok) break;
        join_cuts(&fan);
        ok = scan(&fan);
    }
    free(fan.halves);
    free(fan.present);
    free(fan.active);
    free(fan.cuts);
    free(fan.spans);
    free(fan.span_begin);
    free(fan.span_number);
    free(fan.cluster);
    free(order);
    return ok;
}
