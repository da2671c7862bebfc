/* keller/scene.h -- the scene as the search sees it: welded triangles, planar faces, diffracting wedges.
 *
 * Everything here is in canonical order (vertices sorted by x, y, z; triangles by their sorted vertices, then material
 * and object names), so that nothing depends on the order of triangles, of vertices or of corners in the file. */
#ifndef KELLER_SCENE_H
#define KELLER_SCENE_H
#include <stddef.h>
#include <stdint.h>
#include "keller/error.h"
#include "keller/material.h"
#include "keller/soup.h"
#include "keller/vec.h"

#define KELLER_NONE UINT32_MAX

/* A maximal set of coplanar, edge-connected triangles of one material (SPEC 1). */
typedef struct {
    KellerVec3 normal;              /* unit; orientation arbitrary but canonical */
    double offset;                  /* the face's plane is {p : normal.p = offset} */
    uint32_t plane;                 /* faces in one plane (within the contact tolerance) share this id */
    uint32_t before;                /* the next lower face in the same plane; KELLER_NONE: there is none */
    uint32_t material;              /* index into the scene's materials */
    uint32_t triangle_begin, triangle_end; /* range in face_triangles */
    double strip;                   /* m: the face's width if it is a strip between two wedges that are twins; else 0 */
} KellerFace;

/* A sector of space between two faces around an edge, with an opening angle n pi that diffracts (1/n not whole).
 * Angles around the edge: phi(v) = atan2(v.normal0, v.tangent0), from 0 (on the 0-face) to n pi (on the n-face).
 * tangent0 x normal0 = direction. */
typedef struct {
    uint32_t vertex[2];             /* ends of the edge; direction points from the first to the second */
    uint32_t face[2];               /* 0-face and n-face; the same face twice at a rim */
    double n;                       /* opening angle / pi, in (0, 2] */
    KellerVec3 origin;              /* position of vertex[0] */
    KellerVec3 direction;           /* unit, along the edge */
    double length;                  /* m */
    KellerVec3 tangent0;            /* unit, perpendicular to the edge, in the 0-face and away from the edge */
    KellerVec3 normal0;             /* unit, perpendicular to the edge and the 0-face, into the sector */
    uint32_t plane_begin, plane_end; /* range in wedge_planes: planes of all faces that contain the edge */
    bool goes_on[2];                /* beyond vertex 0, 1 the edge goes on, straight, as another wedge */
    uint32_t twin[2];               /* the wedge on the other side of the 0-face, of the n-face, if that is a strip; else KELLER_NONE.
                                       Twins run side by side, one's n-face is the other's 0-face */
} KellerWedge;

typedef struct {
    size_t read_triangles, degenerate, duplicate, welded_vertices;  /* repaired, joined or left out */
    size_t edges, boundary_edges, complex_edges, flat_edges;        /* of the welded mesh */
    size_t contact_edges;           /* rims that lie on another face and so are corners */
    char *notes;                    /* owned; further lines of text, or "" */
} KellerSceneReport;

typedef struct {
    size_t vertex_count;
    KellerVec3 *vertices;
    size_t triangle_count;
    uint32_t (*triangles)[3];
    uint32_t *triangle_face;        /* [triangle_count] */
    uint32_t *triangle_object;      /* [triangle_count] */
    uint32_t *triangle_source;      /* [triangle_count] index of the triangle in the soup */
    uint32_t *triangle_sheets;      /* [triangle_count] 1, or how many triangles of the same corners and material it stands
                                       for: as many slabs lie there, one on the other */
    uint8_t *triangle_border;       /* [triangle_count] bit i set: the edge from corner i to corner (i+1)%3 is on the
                                       face's border (no triangle of the same face continues across it) */
    size_t face_count;
    KellerFace *faces;
    uint32_t *face_triangles;       /* [triangle_count] triangle ids grouped by face */
    size_t plane_count;
    size_t wedge_count;
    KellerWedge *wedges;
    size_t wedge_plane_count;
    uint32_t *wedge_planes;
    size_t material_count;
    KellerMaterial *materials;      /* all resolved: none of kind NAMED */
    size_t object_count;
    char **objects;
    KellerVec3 lower, upper;        /* bounding box; both zero where there are no triangles */
    double contact;                 /* m: things nearer than this touch (keller_scene_contact) */
    KellerWedgeModel wedge_model;   /* how the wedges diffract; the caller's to change once the scene is built */
    KellerAir air;                  /* likewise what the air takes; nothing as built */
    uint32_t transmissions;         /* likewise how many slabs paths may pass through: from one on, an edge of a screen that is a slab
                                       is diffracted at knowing what comes through, from two on, one of a body; 0 as built */
    KellerSound sound;              /* likewise; all zero as built: radio waves */
    KellerSceneReport report;
} KellerScene;

/* Two sectors' worth of angle: below this deviation from pi/m (m = 1, 2, ...) a sector counts as not diffracting, and
 * below it two triangles may be one face. Radians. */
#define KELLER_FLAT_ANGLE 1e-3

/* The contact tolerance for a scene with this bounding-box diagonal, in m: 4 units in the last place of single
 * precision at the diagonal, since files carry single-precision coordinates; at least 1e-6 m. */
double keller_scene_contact(double diagonal);

/* Builds the model from a soup whose materials are all resolved (no kind NAMED; every triangle has one). The soup is
 * read only. On success *scene is owned by the caller (keller_scene_free).
 * Errors: KELLER_FAILED (memory, more than 2^32 - 2 of anything, far too many triangles touching each other),
 * KELLER_BAD_INPUT (a coordinate that is not finite or beyond 1e12 m). Zero triangles are allowed. */
KellerStatus keller_scene_build(const KellerSoup *soup, KellerScene *scene, KellerError *error);

/* Frees what *scene owns and empties it. */
void keller_scene_free(KellerScene *scene);
#endif
