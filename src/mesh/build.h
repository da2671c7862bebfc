/* mesh/build.h -- what the stages of keller_scene_build share. In order: clean, adjacency, contact (touches), faces,
 * planes, border, fan (sectors), wedges. Every stage returns false only when memory runs out (or when the scene is
 * too crowded). */
#ifndef KELLER_MESH_BUILD_H
#define KELLER_MESH_BUILD_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include "geom/boxtree.h"
#include "keller/scene.h"
#include "mesh/adjacency.h"

/* A triangle thinner than the contact tolerance has no direction of its own: its sides touch each other. */
typedef struct {
    KellerVec3 normal;   /* unit; by the corners' order */
    double area, height; /* m^2; m, the smallest altitude */
} KellerTriangleShape;

typedef enum {
    KELLER_TOUCH_SIDE,   /* a side of the triangle runs along the edge */
    KELLER_TOUCH_INSIDE, /* the edge runs through the triangle's interior, in its plane */
    KELLER_TOUCH_THROUGH /* the triangle is reached over thin triangles that lie at the edge */
} KellerTouchKind;

/* A triangle that touches an edge along the piece [begin, end], in metres from the edge's first vertex. */
typedef struct {
    double begin, end;
    uint32_t begin_vertex, end_vertex; /* the vertex that ends the piece, or KELLER_NONE: the edge of a triangle does */
    uint32_t triangle;
    uint32_t edge;                     /* the mesh edge that runs along, for SIDE and THROUGH; else KELLER_NONE */
    KellerTouchKind kind;
    bool mesh;                         /* the mesh itself joins the triangle to the edge */
} KellerTouch;

/* A piece of edge with a sector that diffracts. Points below the scene's vertex_count are vertices, others index
 * `points` after it. Directions are those of end[0] to end[1]; the sector runs counter-clockwise around it. */
typedef struct {
    uint32_t end[2];
    uint32_t face[2];
    KellerVec3 tangent[2]; /* roughly, from the edge into the two faces */
    double angle;          /* roughly, radians */
    size_t plane_begin, plane_end;
} KellerSector;

/* More touches than this for an edge on average are refused: each edge may touch all others, and a file may say so. */
#define KELLER_MESH_CROWD 200

typedef struct {
    KellerScene *scene;
    double contact;
    KellerAdjacency adjacency;
    KellerTriangleShape *shape;  /* [triangle_count] */
    uint32_t *material;          /* [triangle_count] index into the scene's materials */
    KellerBoxTree *tree;         /* of the triangles */
    KellerTouch *touches;
    size_t touch_count, touch_capacity;
    size_t *touch_begin;         /* [edge_count] */
    uint32_t *touch_number;      /* [edge_count] 0: not looked for */
    KellerVec3 *plane_normal;    /* [plane_count] */
    KellerVec3 *points;          /* crossings: ends of pieces that are no vertex */
    size_t point_count, point_capacity;
    KellerSector *sectors;
    size_t sector_count, sector_capacity;
    uint32_t *planes;            /* of the sectors */
    size_t planes_count, planes_capacity;
    unsigned long long bytes;    /* size of the allocation that failed */
    bool crowded;                /* or it was not memory: see KELLER_MESH_CROWD */
} KellerBuild;

/* Makes room for `need` elements of `size` bytes; false, with build->bytes set, if there is no memory. */
static inline bool keller_mesh_reserve(KellerBuild *build, void **array, size_t *capacity, size_t need, size_t size)
{
    if (need <= *capacity) return true;
    size_t more = *capacity + *capacity / 2 > need ? *capacity + *capacity / 2 : need + 16;
    void *memory = realloc(*array, more * size);
    if (!memory) {
        build->bytes = (unsigned long long)more * size;
        return false;
    }
    *array = memory;
    *capacity = more;
    return true;
}

/* calloc of at least one element, with build->bytes set where it fails. */
static inline void *keller_mesh_allocate(KellerBuild *build, size_t count, size_t size)
{
    void *memory = calloc(count ? count : 1, size);
    if (!memory) build->bytes = (unsigned long long)count * size;
    return memory;
}

static inline KellerVec3 keller_mesh_corner(const KellerScene *scene, uint32_t triangle, int corner)
{
    return scene->vertices[scene->triangles[triangle][corner]];
}

static inline bool keller_mesh_thin(const KellerBuild *build, uint32_t triangle)
{
    return build->shape[triangle].height < build->contact;
}

/* True if a precedes b by x, then y, then z. */
static inline int keller_mesh_compare(KellerVec3 a, KellerVec3 b)
{
    if (a.x != b.x) return a.x < b.x ? -1 : 1;
    if (a.y != b.y) return a.y < b.y ? -1 : 1;
    if (a.z != b.z) return a.z < b.z ? -1 : 1;
    return 0;
}

/* weld.c: for each point the point that stands for it. Points are taken in lexicographic order; one that has
 * a representative within `distance` joins the nearest, another becomes one. So no point moves farther than that, no
 * chain of near points collapses, and the order of the points does not matter (of equal points the first stands). */
bool keller_mesh_weld(KellerBuild *build, size_t count, const KellerVec3 *points, double distance, uint32_t *stands);

/* clean.c: fills the scene's vertices, triangles, objects, materials, bounds and contact, and the build's shapes. */
bool keller_mesh_clean(KellerBuild *build, const KellerSoup *soup);

/* contact.c: finds all triangles that touch the edge, unless that is done already. */
bool keller_mesh_touch(KellerBuild *build, uint32_t edge);
/* The same for all edges that are not plainly inside a plane surface of one material. */
bool keller_mesh_touch_creases(KellerBuild *build);

/* faces.c: grows faces and fits their planes. */
bool keller_mesh_faces(KellerBuild *build);

/* planes.c: gives faces in one plane one id, and fits the planes. */
bool keller_mesh_planes(KellerBuild *build);

/* border.c: the triangles' border bits, and whether an edge lies inside one face. */
bool keller_mesh_edge_flat(const KellerBuild *build, uint32_t edge);
bool keller_mesh_border(KellerBuild *build);

/* fan.c: the sectors around all edges that are not flat, piece by piece. */
bool keller_mesh_sectors(KellerBuild *build);

/* chain.c: joins sectors that follow each other along a line; calls `emit` for each maximal piece with the sectors
 * in it. `from` and `to` are its ends (as in KellerSector); `reversed` tells for the sector that stands for the
 * piece (the longest) whether it runs from `to` to `from`. */
typedef bool (*KellerEmitWedge)(KellerBuild *build, void *context, uint32_t from, uint32_t to, size_t count,
                                const uint32_t *sectors, uint32_t model, bool reversed);
bool keller_mesh_chains(KellerBuild *build, KellerEmitWedge emit, void *context);

/* wedges.c: the scene's wedges, their planes and appended vertices. */
bool keller_mesh_wedges(KellerBuild *build);

/* strips.c: wedges whose edge goes on as another's (KellerWedge.goes_on); pairs of wedges with a narrow face between them
 * (KellerFace.strip, KellerWedge.twin). */
bool keller_mesh_goes_on(KellerBuild *build);
bool keller_mesh_strips(KellerBuild *build);
#endif
