/* Where a face goes on across an edge, and where it ends. */
#include "mesh/build.h"

/* +1 or -1: the side of the edge (first vertex a, along `way`) on which the triangle lies, seen from its face. */
static int side_of(const KellerBuild *build, uint32_t triangle, KellerVec3 a, KellerVec3 way)
{
    const KellerScene *scene = build->scene;
    KellerVec3 across = v3_cross(scene->faces[scene->triangle_face[triangle]].normal, way);
    double sum = 0;
    for (int i = 0; i < 3; i++) sum += v3_dot(across, v3_sub(keller_mesh_corner(scene, triangle, i), a));
    return sum < 0 ? -1 : 1;
}

static KellerVec3 edge_start(const KellerBuild *build, uint32_t edge, KellerVec3 *way)
{
    const uint32_t *ends = build->adjacency.vertices[edge];
    KellerVec3 a = build->scene->vertices[ends[0]];
    *way = v3_sub(build->scene->vertices[ends[1]], a);
    return a;
}

bool keller_mesh_edge_flat(const KellerBuild *build, uint32_t edge)
{
    const KellerAdjacency *adjacency = &build->adjacency;
    uint32_t begin = adjacency->begin[edge];
    if (adjacency->begin[edge + 1] - begin != 2) return false;
    uint32_t t = adjacency->triangles[begin], u = adjacency->triangles[begin + 1];
    if (build->scene->triangle_face[t] != build->scene->triangle_face[u]) return false;
    if (keller_mesh_thin(build, t) || keller_mesh_thin(build, u)) return false;
    KellerVec3 way, a = edge_start(build, edge, &way);
    return side_of(build, t, a, way) != side_of(build, u, a, way);
}

/* True if triangles of t's face continue it over the whole edge, up to gaps of two contact tolerances. The touches are
 * in the order of their beginnings. */
static bool continues(const KellerBuild *build, uint32_t t, uint32_t edge)
{
    if (!build->touch_number[edge]) return true; /* not looked for: flat */
    const KellerScene *scene = build->scene;
    KellerVec3 way, a = edge_start(build, edge, &way);
    int side = side_of(build, t, a, way);
    double covered = 0, slack = 2 * build->contact;
    const KellerTouch *touch = build->touches + build->touch_begin[edge];
    for (uint32_t i = 0; i < build->touch_number[edge]; i++) {
        uint32_t u = touch[i].triangle;
        if (u == t || scene->triangle_face[u] != scene->triangle_face[t]) continue;
        bool either = touch[i].kind == KELLER_TOUCH_INSIDE || keller_mesh_thin(build, t) || keller_mesh_thin(build, u);
        if (!either && side_of(build, u, a, way) == side) continue;
        if (touch[i].begin > covered + slack) return false;
        covered = fmax(covered, touch[i].end);
    }
    return covered >= v3_norm(way) - fmin(slack, 0.5 * v3_norm(way));
}

bool keller_mesh_border(KellerBuild *build)
{
    KellerScene *scene = build->scene;
    scene->triangle_border = keller_mesh_allocate(build, scene->triangle_count, sizeof *scene->triangle_border);
    if (!scene->triangle_border) return false;
    for (uint32_t t = 0; t < scene->triangle_count; t++)
        for (int i = 0; i < 3; i++)
            if (!continues(build, t, build->adjacency.edge[t][i]))
                scene->triangle_border[t] = (uint8_t)(scene->triangle_border[t] | 1u << i);
    return true;
}
