#include "keller/scene.h"

#include <float.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include "mesh/build.h"

/* Beyond this, in m, a coordinate is a mistake; within it no area or volume overflows. */
#define FARTHEST 1e12

double keller_scene_contact(double diagonal)
{
    /* The unit in the last place without its steps at powers of two, so that a scene that is moved or turned, and so
     * rounded, keeps its tolerance. */
    return fmax(4 * (double)FLT_EPSILON * diagonal, 1e-6);
}

static KellerStatus check(const KellerSoup *soup, KellerError *error)
{
    const size_t most = UINT32_MAX - 2;
    if (soup->vertex_count > most || soup->triangle_count > most || soup->object_count > most ||
        soup->material_count > most)
        return keller_error(error, KELLER_FAILED, "the scene has more than %zu vertices or triangles; split it", most);
    for (size_t i = 0; i < soup->vertex_count; i++) {
        KellerVec3 p = soup->vertices[i];
        if (!(fabs(p.x) <= FARTHEST && fabs(p.y) <= FARTHEST && fabs(p.z) <= FARTHEST))
            return keller_error(error, KELLER_BAD_INPUT,
                                "vertex %zu is at (%g, %g, %g); expected coordinates within %g m", i, p.x, p.y, p.z,
                                FARTHEST);
    }
    return KELLER_OK;
}

static void count_edges(KellerBuild *build)
{
    KellerSceneReport *report = &build->scene->report;
    const KellerAdjacency *adjacency = &build->adjacency;
    report->edges = adjacency->edge_count;
    for (uint32_t e = 0; e < adjacency->edge_count; e++) {
        uint32_t at = adjacency->begin[e + 1] - adjacency->begin[e];
        report->boundary_edges += at == 1;
        report->complex_edges += at > 2;
        report->flat_edges += keller_mesh_edge_flat(build, e);
    }
}

static bool write_notes(KellerBuild *build)
{
    const KellerSceneReport *report = &build->scene->report;
    char text[1024];
    int used = 0;
    text[0] = '\0';
    if (report->welded_vertices)
        used += snprintf(text + used, sizeof text - (size_t)used, "%zu vertices are within %g m of others: welded\n",
                         report->welded_vertices, build->contact / 4);
    if (report->degenerate)
        used += snprintf(text + used, sizeof text - (size_t)used, "%zu triangles have no area: left out\n",
                         report->degenerate);
    if (report->duplicate)
        used += snprintf(text + used, sizeof text - (size_t)used,
                         "%zu triangles repeat others of the same material: further sheets of these\n", report->duplicate);
    if (report->complex_edges)
        used += snprintf(text + used, sizeof text - (size_t)used, "%zu edges join more than two triangles: kept\n",
                         report->complex_edges);
    if (build->adjacency.cuts)
        used += snprintf(text + used, sizeof text - (size_t)used,
                         "%zu vertices were doubled to make the half-edge mesh a manifold\n", build->adjacency.cuts);
    if (report->contact_edges)
        snprintf(text + used, sizeof text - (size_t)used, "%zu open edges lie on other faces: corners, not rims\n",
                 report->contact_edges);
    build->scene->report.notes = strdup(text);
    if (!build->scene->report.notes) build->bytes = sizeof text;
    return build->scene->report.notes != NULL;
}

static bool touch_rest(KellerBuild *build)
{
    for (uint32_t e = 0; e < build->adjacency.edge_count; e++)
        if (!keller_mesh_edge_flat(build, e) && !keller_mesh_touch(build, e)) return false;
    return true;
}

static void free_build(KellerBuild *build)
{
    keller_adjacency_free(&build->adjacency);
    keller_boxtree_free(build->tree);
    free(build->shape);
    free(build->material);
    free(build->touches);
    free(build->touch_begin);
    free(build->touch_number);
    free(build->plane_normal);
    free(build->points);
    free(build->sectors);
    free(build->planes);
}

KellerStatus keller_scene_build(const KellerSoup *soup, KellerScene *scene, KellerError *error)
{
    memset(scene, 0, sizeof *scene);
    KellerStatus status = check(soup, error);
    if (status != KELLER_OK) return status;
    KellerBuild build = {.scene = scene};
    bool ok = keller_mesh_clean(&build, soup);
    if (ok)
        status = keller_adjacency_build(scene->vertex_count, scene->vertices, scene->triangle_count,
                                        (const uint32_t (*)[3])scene->triangles, &build.adjacency, error);
    if (ok && status == KELLER_OK) {
        ok = keller_mesh_touch_creases(&build) && keller_mesh_faces(&build) && touch_rest(&build) &&
             keller_mesh_planes(&build) && keller_mesh_border(&build) && keller_mesh_sectors(&build) &&
             keller_mesh_wedges(&build) && keller_mesh_goes_on(&build) && keller_mesh_strips(&build);
        if (ok) {
            count_edges(&build);
            ok = write_notes(&build);
        }
    }
    if (!ok) {
        status = build.crowded
                     ? keller_error(error, KELLER_FAILED,
                                    "too many triangles touch each other along their edges; expected fewer than "
                                    "%d for an edge on average (is one vertex far away from all others?)",
                                    KELLER_MESH_CROWD)
                     : keller_error_memory(error, build.bytes);
    }
    free_build(&build);
    if (status != KELLER_OK) keller_scene_free(scene);
    return status;
}

void keller_scene_free(KellerScene *scene)
{
    free(scene->vertices);
    free(scene->triangles);
    free(scene->triangle_face);
    free(scene->triangle_object);
    free(scene->triangle_source);
    free(scene->triangle_sheets);
    free(scene->triangle_border);
    free(scene->faces);
    free(scene->face_triangles);
    free(scene->wedges);
    free(scene->wedge_planes);
    for (size_t i = 0; i < scene->material_count; i++) free(scene->materials[i].name);
    free(scene->materials);
    for (size_t i = 0; i < scene->object_count; i++) free(scene->objects[i]);
    free(scene->objects);
    free(scene->report.notes);
    memset(scene, 0, sizeof *scene);
}
