/* Mitsuba XML, as Sionna RT writes it (version 2 and 3) and as Mitsuba 0.6 does. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "io/mitsuba.h"
#include "io/text.h"

typedef struct {
    xmlNodePtr node;
    char *type, *id;
    bool has_transform;
    KellerTransform transform;
    bool has_material;
    uint32_t material;
} Shape;

/* The shape's object: its id without the `mesh-` that Blender's exporter puts before it, else the given name. */
static KellerStatus object_of(KellerMitsuba *scene, const Shape *shape, const char *otherwise, uint32_t *object,
                              KellerError *error)
{
    const char *name = shape->id && *shape->id ? shape->id : otherwise;
    if (strncmp(name, "mesh-", 5) == 0 && name[5]) name += 5;
    return keller_build_object(scene->build, name, strlen(name), true, object, error);
}

static KellerStatus read_file(KellerMitsuba *scene, const Shape *shape, KellerError *error)
{
    KellerPlace place = keller_mitsuba_place(shape->node);
    char *name, *path, *data, where[1024];
    KellerStatus status = keller_mitsuba_property(scene, shape->node, "filename", &name, error);
    if (status != KELLER_OK) return status;
    if (!name) return keller_bad(place, error, "the shape has no filename; expected <string name=\"filename\" value=\"...\"/>");
    path = keller_mitsuba_path(shape->node, name);
    char *base = strrchr(name, '/') ? strrchr(name, '/') + 1 : name, *dot = strrchr(base, '.');
    if (dot && dot > base) *dot = '\0';
    KellerMeshFile mesh = {.file = path, .has_object = true, .has_material = shape->has_material,
                           .material = shape->material};
    status = path ? object_of(scene, shape, base, &mesh.object, error) : keller_error_memory(error, strlen(name));
    mesh.name = base;
    snprintf(where, sizeof where, "%s:%llu", place.file, (unsigned long long)place.at);
    if (status == KELLER_OK) status = keller_text_load(path, where, &data, &mesh.size, error);
    if (status == KELLER_OK) {
        mesh.data = data;
        scene->build->soup.files++;
        status = strcmp(shape->type, "ply") == 0   ? keller_read_ply(scene->build, &mesh, error)
                 : strcmp(shape->type, "obj") == 0 ? keller_read_obj(scene->build, &mesh, error)
                                                   : keller_read_stl(scene->build, &mesh, error);
        free(data);
    }
    free(path);
    free(name);
    return status;
}

/* rectangle: [-1, 1] x [-1, 1] in z = 0; cube: [-1, 1]^3. */
static KellerStatus read_primitive(KellerMitsuba *scene, const Shape *shape, KellerError *error)
{
    /* Corner i of the cube has x, y, z = +1 where bit 0, 1, 2 of i is set. */
    static const uint32_t cube[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    static const uint32_t rectangle[1][4] = {{0, 1, 3, 2}};
    bool is_cube = strcmp(shape->type, "cube") == 0;
    const uint32_t(*faces)[4] = is_cube ? cube : rectangle;
    uint32_t base = (uint32_t)scene->build->soup.vertex_count, object;
    KellerStatus status = object_of(scene, shape, shape->type, &object, error);
    for (int i = 0; i < (is_cube ? 8 : 4) && status == KELLER_OK; i++)
        status = keller_build_vertex(scene->build, v3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, !is_cube ? 0 : i & 4 ? 1 : -1), error);
    for (int f = 0; f < (is_cube ? 6 : 1) && status == KELLER_OK; f++) {
        uint32_t corners[4];
        for (int c = 0; c < 4; c++) corners[c] = base + faces[f][c];
        status = keller_build_polygon(scene->build, keller_mitsuba_place(shape->node), corners, 4, object,
                                      shape->has_material ? shape->material : KELLER_NO_MATERIAL, error);
    }
    scene->build->soup.polygons_split -= status == KELLER_OK ? (is_cube ? 6 : 1) : 0; /* not the file's polygons */
    return status;
}

static KellerStatus transform_of(KellerMitsuba *scene, Shape *shape, KellerError *error)
{
    for (xmlNodePtr child = keller_mitsuba_element(shape->node->children); child;
         child = keller_mitsuba_element(child->next)) {
        bool animation = keller_mitsuba_is(child, "animation");
        if (!animation && !keller_mitsuba_is(child, "transform")) continue;
        char *name;
        KellerStatus status = keller_mitsuba_attribute(scene, child, "name", &name, error);
        if (status != KELLER_OK) return status;
        bool to_world = name && (strcmp(name, "to_world") == 0 || strcmp(name, "toWorld") == 0);
        free(name);
        if (!to_world) continue;
        if (animation)
            return keller_bad(keller_mitsuba_place(child), error, "an animated shape; expected one that stands still");
        if (shape->has_transform)
            return keller_bad(keller_mitsuba_place(child), error, "a second transform of one shape; expected one");
        shape->has_transform = true;
        status = keller_mitsuba_transform(scene, child, &shape->transform, error);
        if (status != KELLER_OK) return status;
    }
    return KELLER_OK;
}

static KellerStatus place_in_world(KellerMitsuba *scene, const Shape *shape, size_t first, KellerError *error)
{
    KellerSoup *soup = &scene->build->soup;
    for (size_t i = first; i < soup->vertex_count; i++) {
        KellerVec3 p = keller_transform_point(&shape->transform, soup->vertices[i]);
        if (!isfinite(p.x) || !isfinite(p.y) || !isfinite(p.z))
            return keller_bad(keller_mitsuba_place(shape->node), error, "the transform takes a vertex to (%g, %g, %g); expected "
                              "finite coordinates", p.x, p.y, p.z);
        soup->vertices[i] = p;
    }
    return KELLER_OK;
}

static bool is_one_of(const char *word, const char *const *list)
{
    for (; *list; list++)
        if (strcmp(word, *list) == 0) return true;
    return false;
}

static KellerStatus read_typed(KellerMitsuba *scene, Shape *shape, KellerError *error)
{
    static const char *const files[] = {"ply", "obj", "stl", NULL}, *const primitives[] = {"rectangle", "cube", NULL};
    KellerPlace place = keller_mitsuba_place(shape->node);
    if (!shape->type) return keller_bad(place, error, "the shape has no type; expected such as type=\"ply\"");
    bool file = is_one_of(shape->type, files);
    if (!file && !is_one_of(shape->type, primitives))
        return keller_build_note(scene->build, error, "%s:%llu: shape `%.100s` of type `%.40s` is left out: only ply, obj, stl, "
                                 "rectangle and cube are read", place.file, (unsigned long long)place.at,
                                 shape->id ? shape->id : "", shape->type);
    size_t first = scene->build->soup.vertex_count;
    KellerStatus status = keller_mitsuba_material(scene, shape->node, &shape->has_material, &shape->material, error);
    if (status == KELLER_OK) status = transform_of(scene, shape, error);
    if (status == KELLER_OK) status = file ? read_file(scene, shape, error) : read_primitive(scene, shape, error);
    if (status == KELLER_OK && shape->has_transform) status = place_in_world(scene, shape, first, error);
    return status;
}

static KellerStatus read_shape(KellerMitsuba *scene, xmlNodePtr node, KellerError *error)
{
    Shape shape = {.node = node};
    KellerStatus status = keller_mitsuba_attribute(scene, node, "type", &shape.type, error);
    if (status == KELLER_OK) status = keller_mitsuba_attribute(scene, node, "id", &shape.id, error);
    if (status == KELLER_OK) status = read_typed(scene, &shape, error);
    free(shape.type);
    free(shape.id);
    return status;
}

static KellerStatus read_document(KellerMitsuba *scene, size_t index, KellerError *error)
{
    /* What has no part in the geometry. An element that Mitsuba does not know is an error: it may be a misspelt shape. */
    static const char *const known[] = {"default", "bsdf",   "alias",     "path",     "integrator", "sensor",  "camera",
                                        "emitter", "luminaire", "medium", "texture",  "volume",     "phase",   "film",
                                        "sampler", "rfilter", "subsurface", "spectrum", "rgb",      "srgb",    "blackbody",
                                        "string",  "integer", "float",    "boolean",  "vector",     "point",   "transform",
                                        "animation", "ref",   NULL};
    KellerStatus status = KELLER_OK;
    for (xmlNodePtr node = keller_mitsuba_element(xmlDocGetRootElement(scene->documents[index]->doc)->children);
         node && status == KELLER_OK; node = keller_mitsuba_element(node->next)) {
        if (keller_mitsuba_is(node, "shape")) status = read_shape(scene, node, error);
        else if (keller_mitsuba_is(node, "include")) status = read_document(scene, (uintptr_t)node->_private, error);
        else if (!is_one_of((const char *)node->name, known))
            status = keller_bad(keller_mitsuba_place(node), error, "<%.100s> in a scene; expected an element of Mitsuba such as "
                                "bsdf or shape", node->name);
    }
    return status;
}

KellerStatus keller_read_mitsuba(KellerBuild *build, const char *file, KellerError *error)
{
    KellerMitsuba scene = {.build = build};
    KellerStatus status = keller_mitsuba_load(&scene, file, error);
    if (status == KELLER_OK) status = read_document(&scene, 0, error);
    keller_mitsuba_free(&scene);
    return status;
}
