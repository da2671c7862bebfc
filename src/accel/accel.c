/* Building an accelerator, and choosing one. */
#include <stdlib.h>
#include <string.h>

#include "accel/leaf.h"
#include "base/number.h"

/* Times the size: from farther away single precision loses too much. */
#define FAR 2

static const TreeKind *const kinds[] = {&tree_kdtree, &tree_bvh, &tree_bvh8, &tree_bvh_mask, &tree_bvh8_mask, &tree_ubvh,
                                        &tree_dacrt};

/* ---- what the trees are built from ------------------------------------------------------------------------------- */

static AccelBox box_of(const KellerAccel *a, const KellerVec3 *v, int count)
{
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int i = 0; i < count; i++) {
        KellerVec3 q = v3_sub(v[i], a->middle);
        const double p[3] = {q.x, q.y, q.z};
        for (int k = 0; k < 3; k++) {
            lo[k] = lesser(lo[k], p[k]);
            hi[k] = greater(hi[k], p[k]);
        }
    }
    AccelBox box;
    for (int k = 0; k < 3; k++) { /* outwards, past the roundings of the difference and of the conversion */
        box.lower[k] = nextafterf((float)lo[k], -INFINITY);
        box.upper[k] = nextafterf((float)hi[k], INFINITY);
    }
    return box;
}

/* What the clip function below knows of the primitives. */
typedef struct {
    const KellerAccel *accel;
    const uint32_t *alone;          /* edges that are primitives of their own, after the triangles */
} Parts;

/* A primitive's corners; returns how many. */
static int corners_of(const Parts *p, uint32_t ref, KellerVec3 v[3])
{
    const KellerAccel *a = p->accel;
    if (ref < a->input.triangle_count) triangle_of(a, ref, v);
    else edge_of(a, p->alone[ref - a->input.triangle_count], v);
    return ref < a->input.triangle_count ? 3 : 2;
}

static int local_corners(void *context, uint32_t ref, KellerVec3 v[3])
{
    const Parts *p = context;
    int count = corners_of(p, ref, v);
    for (int j = 0; j < count; j++) v[j] = v3_sub(v[j], p->accel->middle);
    return count;
}

/* A triangle's edges lie in the parts of the triangle. */
static void clip(void *context, uint32_t ref, int axis, float lower, float upper, AccelBox *part)
{
    KellerVec3 v[3];
    int count = local_corners(context, ref, v);
    if (count == 3) sah_clip_triangle(v[0], v[1], v[2], axis, lower, upper, part);
    else sah_clip_segment(v[0], v[1], axis, lower, upper, part);
}

static bool single(double a) { return (double)(float)a == a; }

/* The middle of what is there, and how far from it things reach. Where the triangles' coordinates are of single precision and the
 * world's origin is not far from them, that is as good a middle, and the blocks then hold the vertices as they are. */
static void measure(KellerAccel *a)
{
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    bool exact[2] = {true, true};
    for (int edges = 0; edges < 2; edges++)
        for (uint32_t i = 0; i < (edges ? a->input.edge_count : a->input.triangle_count); i++) {
            KellerVec3 v[3];
            if (edges) edge_of(a, i, v);
            else triangle_of(a, i, v);
            for (int j = 0; j < (edges ? 2 : 3); j++) {
                const double p[3] = {v[j].x, v[j].y, v[j].z};
                exact[edges] = exact[edges] && single(p[0]) && single(p[1]) && single(p[2]);
                for (int k = 0; k < 3; k++) {
                    lo[k] = lesser(lo[k], p[k]);
                    hi[k] = greater(hi[k], p[k]);
                }
            }
        }
    if (!(lo[0] <= hi[0])) return;
    const double middle[3] = {0.5 * (lo[0] + hi[0]), 0.5 * (lo[1] + hi[1]), 0.5 * (lo[2] + hi[2])};
    double size = 0, about_0 = 0;
    for (int k = 0; k < 3; k++) {
        size = greater(size, 0.5 * (hi[k] - lo[k]) * (1 + 0x1p-20));
        about_0 = greater(about_0, greater(fabs(lo[k]), fabs(hi[k])));
    }
    bool near_0 = exact[0] && about_0 <= FAR * size;
    a->exact_triangles = near_0;
    a->exact_edges = near_0 && exact[1];
    a->size = near_0 ? about_0 : size;
    if (!near_0) a->middle = v3(middle[0], middle[1], middle[2]);
}

/* ---- choice ------------------------------------------------------------------------------------------------------ */

/* Measured (docs/performance.md): the 8-wide hierarchy wins, or draws, for every aperture tried, but for batches of no more rays than
 * there are triangles its building takes longer than to divide and conquer. */
static const TreeKind *automatic(const KellerAccelInput *input, const KellerAccelOptions *o)
{
    const double cone = 3; /* rays that one costs as much as, without a structure */
    double asked = (double)o->rays + cone * (double)o->cones;
    return asked > 0 && asked <= input->triangle_count ? &tree_dacrt : &tree_bvh8;
}

static const TreeKind *kind_of(const KellerAccelInput *input, const KellerAccelOptions *o, KellerError *error)
{
    const char *name = o->name;
    if (!name || strcmp(name, "auto") == 0) return automatic(input, o);
    if (strcmp(name, "auto+mask") == 0) return &tree_bvh8_mask;
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (strcmp(kinds[i]->name, name) == 0) return kinds[i];
    keller_error(error, KELLER_BAD_INPUT, "accelerator \"%s\" is not known; expected auto, kdtree, bvh, "
                 "bvh8, bvh+mask, bvh8+mask, ubvh or dacrt", name);
    return NULL;
}

/* ---- building ---------------------------------------------------------------------------------------------------- */

/* Which edges go with which triangles. */
static KellerStatus attach(const KellerAccel *a, Attached *attached, KellerError *error)
{
    const uint32_t(*edges)[2] = a->input.edges, count = a->input.edge_count;
    uint32_t(*ends)[2] = NULL;
    if (a->kind == &tree_dacrt) return spread_edges(a->input.triangle_count, count, attached, error);
    if (a->scene) {
        ends = malloc(((size_t)count + 1) * sizeof *ends);
        if (!ends) return keller_error_memory(error, ((size_t)count + 1) * sizeof *ends);
        for (uint32_t i = 0; i < count; i++) memcpy(ends[i], a->scene->wedges[a->wedge[a->wedge_begin[i]]].vertex, sizeof *ends);
        edges = (const uint32_t(*)[2])ends;
    }
    KellerStatus status = attach_edges(a->input.triangle_count, a->input.triangles, count, edges, attached, error);
    free(ends);
    return status;
}

static KellerStatus plant(KellerAccel *a, const KellerAccelOptions *o, KellerError *error)
{
    Attached attached;
    KellerStatus status = attach(a, &attached, error);
    if (status != KELLER_OK) return status;
    uint32_t count = a->input.triangle_count + attached.alone;
    if (count < attached.alone) { /* more than 2^32; builders refuse far fewer */
        attached_free(&attached);
        return keller_error(error, KELLER_FAILED, "%u triangles and %u edges are too many for one accelerator",
                            a->input.triangle_count, attached.alone);
    }
    Parts parts = {a, attached.edges + attached.begin[a->input.triangle_count]};
    Leaves leaves = {0};
    AccelBox *boxes = malloc(((size_t)count + 1) * sizeof *boxes);
    if (boxes) {
        for (uint32_t i = 0; i < count && a->kind != &tree_dacrt; i++) { /* which has no use for them */
            KellerVec3 v[3];
            int corners = corners_of(&parts, i, v);
            boxes[i] = box_of(a, v, corners);
        }
        TreeInput in = {.count = count, .boxes = boxes, .clip = clip, .clip_context = &parts,
                        .cost_ratio = o->cost_ratio > 0 ? o->cost_ratio : a->kind->cost_ratio, .spatial = o->spatial,
                        .threads = o->threads, .corners = local_corners, .masks = o->masks,
                        .skewed = o->skewed};
        status = count ? a->kind->build(&in, &a->tree, &leaves, error) : KELLER_OK;
        free(boxes);
    } else {
        status = keller_error_memory(error, count * sizeof *boxes);
    }
    if (status == KELLER_OK) status = leaf_blocks(a, &leaves, &attached, error);
    leaves_free(&leaves);
    attached_free(&attached);
    return status;
}

/* Owns `wedge` and `begin` from here on. */
static KellerStatus build(const KellerAccelInput *input, const KellerAccelOptions *o, const KellerScene *scene,
                          uint32_t *wedge, uint32_t *begin, KellerAccel **accel, KellerError *error)
{
    *accel = NULL;
    const TreeKind *kind = kind_of(input, o, error);
    KellerAccel *a = kind ? calloc(1, sizeof *a) : NULL;
    if (!a) {
        free(wedge);
        free(begin);
        return kind ? keller_error_memory(error, sizeof *a) : KELLER_BAD_INPUT;
    }
    a->kind = kind;
    a->input = *input;
    a->scene = scene;
    a->wedge = wedge;
    a->wedge_begin = begin;
    a->how = (WalkHow){.leaf_boxes = o->leaf_boxes, .order = o->order};
    a->contained = o->contained;
    a->repeats = o->spatial > 0 || kind == &tree_kdtree;
    measure(a);
    KellerStatus status = plant(a, o, error);
    if (status != KELLER_OK) {
        keller_accel_free(a);
        return status;
    }
    *accel = a;
    return KELLER_OK;
}

KellerStatus keller_accel_new(const KellerAccelInput *input, const KellerAccelOptions *options, KellerAccel **accel,
                              KellerError *error)
{
    const KellerAccelOptions defaults = {0};
    return build(input, options ? options : &defaults, NULL, NULL, NULL, accel, error);
}

/* A wedge and its edge: the lesser vertex first. */
typedef struct {
    uint32_t vertex[2], wedge;
} OnEdge;

static int by_edge(const void *a, const void *b)
{
    const OnEdge *p = a, *q = b;
    for (int k = 0; k < 2; k++)
        if (p->vertex[k] != q->vertex[k]) return p->vertex[k] < q->vertex[k] ? -1 : 1;
    return (p->wedge > q->wedge) - (p->wedge < q->wedge);
}

/* Over all triangles and the given wedges (NULL: all) of a scene, or wedges alone. */
static KellerStatus over_scene(const char *name, const KellerScene *scene, bool triangles, uint32_t count,
                               const uint32_t *wedges, KellerAccel **accel, KellerError *error)
{
    *accel = NULL;
    OnEdge *on = malloc((count + 1) * sizeof *on);
    uint32_t *wedge = malloc((count + 1) * sizeof *wedge), *begin = malloc((count + 1) * sizeof *begin), edges = 0;
    if (!on || !wedge || !begin) {
        free(on);
        free(wedge);
        free(begin);
        return keller_error_memory(error, count * (sizeof *on + 2 * sizeof *wedge));
    }
    for (uint32_t i = 0; i < count; i++) {
        uint32_t id = wedges ? wedges[i] : i;
        const uint32_t *v = scene->wedges[id].vertex;
        on[i] = (OnEdge){{v[0] < v[1] ? v[0] : v[1], v[0] < v[1] ? v[1] : v[0]}, id};
    }
    qsort(on, count, sizeof *on, by_edge);
    for (uint32_t i = 0; i < count; i++) {
        if (i == 0 || memcmp(on[i].vertex, on[i - 1].vertex, sizeof on[i].vertex) != 0) begin[edges++] = i;
        wedge[i] = on[i].wedge;
    }
    begin[edges] = count;
    free(on);
    uint32_t *fit = realloc(begin, (edges + 1) * sizeof *begin);
    KellerAccelInput input = {.vertices = scene->vertices, .triangles = (const uint32_t(*)[3])scene->triangles,
                              .triangle_count = triangles ? (uint32_t)scene->triangle_count : 0, .edge_count = edges};
    KellerAccelOptions options = {.name = name};
    return build(&input, &options, scene, wedge, fit ? fit : begin, accel, error);
}

KellerStatus keller_accel_build(const char *name, const KellerScene *scene, KellerAccel **accel, KellerError *error)
{
    return over_scene(name, scene, true, (uint32_t)scene->wedge_count, NULL, accel, error);
}

KellerStatus keller_accel_build_wedges(const KellerScene *scene, uint32_t count, const uint32_t *wedges,
                                       KellerAccel **accel, KellerError *error)
{
    return over_scene(NULL, scene, false, count, wedges, accel, error);
}

void keller_accel_free(KellerAccel *accel)
{
    if (!accel) return;
    accel->kind->free(accel->tree);
    free(accel->triangles);
    free(accel->edges);
    free(accel->edge_begin);
    free(accel->wedge);
    free(accel->wedge_begin);
    free(accel);
}

const char *keller_accel_name(const KellerAccel *accel) { return accel->kind->name; }

size_t keller_accel_bytes(const KellerAccel *a)
{
    size_t leaves = a->leaf_count, edge_blocks = a->edge_begin[leaves], edges = a->input.edge_count;
    size_t bytes = sizeof *a + a->kind->bytes(a->tree) + (leaves + 1) * sizeof *a->edge_begin + edge_blocks * sizeof(EdgeBlock);
    if (a->triangles) bytes += leaves * sizeof(TriangleBlock);
    if (a->scene) bytes += (a->wedge_begin[edges] + edges + 1) * sizeof(uint32_t);
    return bytes;
}
