#include <math.h>
#include <stdio.h>
#include <string.h>
#include "base/progress.h"
#include "cli/cli.h"
#include "keller/drape.h"
#include "keller/path.h"
#include "keller/resolve.h"

KellerStatus keller_prepare_config(const char *file, const KellerVariables *variables, KellerPrepared *p,
                                   KellerError *error)
{
    memset(p, 0, sizeof *p);
    double start = keller_seconds();
    KellerStatus status = keller_config_read(file, variables->count, variables->list, &p->config, error);
    p->seconds_configuration = keller_seconds() - start;
    return status;
}

KellerStatus keller_build_scene_of(const char *file, const KellerSoup *soup, KellerScene *scene, KellerError *error)
{
    KellerStatus status = keller_scene_build(soup, scene, error);
    if (status == KELLER_OK) return KELLER_OK;
    KellerError plain = *error;
    return keller_error(error, status, "%s: %s", file, plain.message);
}

/* The reader knows the scene's name but not who gave it. */
static KellerStatus read_scene(KellerPrepared *p, KellerError *error)
{
    const KellerConfig *c = &p->config;
    KellerStatus status = keller_soup_read(c->scene_file, c->scene_scale, &p->soup, error);
    if (status != KELLER_IO || strncmp(error->message, "cannot ", 7) != 0) return status;
    KellerError plain = *error;
    return keller_error(error, status, "%s:%d: %s", c->file, c->scene_line, plain.message);
}

KellerStatus keller_prepare_scene(KellerPrepared *p, KellerError *error)
{
    double start = keller_seconds();
    KellerStatus status = read_scene(p, error);
    if (status == KELLER_OK) status = keller_config_resolve(&p->config, &p->soup, error);
    double read = keller_seconds();
    if (status == KELLER_OK) status = keller_build_scene_of(p->config.scene_file, &p->soup, &p->scene, error);
    p->scene.wedge_model = p->config.wedge_model;
    p->scene.air = p->config.air;
    p->scene.transmissions = p->config.transmissions;
    p->scene.sound = p->config.sound;
    if (status == KELLER_OK) status = keller_config_drape(&p->config, &p->scene, error);
    if (status == KELLER_OK) status = keller_simulation_check(&p->config, &p->scene, error);
    p->seconds_read = read - start;
    p->seconds_scene = keller_seconds() - read;
    return status;
}

void keller_prepared_free(KellerPrepared *p)
{
    keller_scene_free(&p->scene);
    keller_soup_free(&p->soup);
    keller_config_free(&p->config);
    memset(p, 0, sizeof *p);
}

static const char *material_text(const KellerMaterial *m, char text[120])
{
    char thickness[40] = "half-space", number[32];
    if (m->thickness > 0) snprintf(thickness, sizeof thickness, "%s thick", keller_si(m->thickness, "m", number));
    switch (m->kind) {
    case KELLER_MATERIAL_NAMED: snprintf(text, 120, "named only"); break;
    case KELLER_MATERIAL_ITU: snprintf(text, 120, "ITU %s, %s", m->itu, thickness); break;
    case KELLER_MATERIAL_CONSTANT:
        snprintf(text, 120, "permittivity %g, conductivity %g S/m, %s", m->permittivity, m->conductivity, thickness);
        break;
    case KELLER_MATERIAL_CONDUCTOR: snprintf(text, 120, "perfect conductor"); break;
    case KELLER_MATERIAL_LAYERS: snprintf(text, 120, "%u layers, %s", m->layer_count, thickness); break;
    case KELLER_MATERIAL_RIGID: snprintf(text, 120, "rigid"); break;
    case KELLER_MATERIAL_ABSORPTION:
        snprintf(text, 120, "absorption %g%s", m->surface[0][0], m->band_count > 1 ? " and on" : "");
        break;
    case KELLER_MATERIAL_IMPEDANCE:
        snprintf(text, 120, "impedance %g%+gj%s", m->surface[0][0], m->surface[0][1], m->band_count > 1 ? " and on" : "");
        break;
    }
    return text;
}

static void print_sound(const KellerConfig *c)
{
    const KellerSound *s = &c->sound;
    char absorption[100] = "takes nothing";
    if (s->absorbs)
        snprintf(absorption, sizeof absorption, "ISO 9613-1 at %.4g degC, %.3g %%, %.6g kPa", s->temperature - 273.15,
                 100 * s->humidity,
                 s->pressure / 1e3);
    keller_row("air", "%.5g m/s, %s", s->speed, absorption);
    if (c->bands_per_octave > 0) keller_row("levels", "means over %s bands",
                                            c->bands_per_octave == 1 ? "octave" : "third-octave");
    keller_row("diffraction", "%s", s->edges == KELLER_EDGES_BTM ? "Biot, Tolstoy and Medwin" : "uniform theory");
    if (c->response_rate > 0)
        keller_row("responses", "%g s at %g Hz%s", c->response_duration, c->response_rate,
                   c->response_volume > 0 ? ", with a statistical tail" : "");
}

void keller_print_configuration(const KellerConfig *c)
{
    char number[32], wavelength[32];
    bool sound = c->sound.speed > 0;
    double speed = sound ? c->sound.speed : KELLER_LIGHT_SPEED;
    printf("configuration\n");
    keller_row("file", "%s", c->file);
    keller_row("scene", "%s", c->scene_file);
    for (size_t f = 0; f < c->frequency_count; ++f) {
        if (f == 8 && c->frequency_count > 9) {
            keller_row("", "and %zu more", c->frequency_count - f);
            break;
        }
        keller_row(f ? "" : "frequencies", "%s, wavelength %s", keller_si(c->frequencies[f], "Hz", number),
                   keller_si(speed / c->frequencies[f], "m", wavelength));
    }
    keller_row("transmitters", "%zu", c->transmitter_count);
    size_t points = 0, routes = 0, grids = 0;
    for (size_t s = 0; s < c->set_count; ++s) {
        points += c->sets[s].kind == KELLER_SET_POINT;
        routes += c->sets[s].kind == KELLER_SET_ROUTE;
        grids += c->sets[s].kind == KELLER_SET_GRID;
    }
    keller_row("receivers", "%zu (%zu single, %zu route%s, %zu grid%s)", c->receiver_count, points, routes,
               routes == 1 ? "" : "s", grids, grids == 1 ? "" : "s");
    keller_row("orders", "%u reflections, %u diffractions, %u transmissions, at most %u together", c->reflections,
               c->diffractions, c->transmissions, c->interactions);
    if (c->scattering > 0)
        keller_row("scattering", "one of a path, by patches of at most %s; reflections and diffractions beside it: at most %u",
                   keller_si(c->patch, "m", number), c->with_scattering);
    static const char *const models[] = {
        [KELLER_WEDGE_RECIPROCAL] = "reciprocal", [KELLER_WEDGE_LUEBBERS] = "luebbers", [KELLER_WEDGE_HOLM] = "holm"};
    keller_row("wedges", "%s", models[c->wedge_model]);
    if (c->air.gases || c->air.rain > 0)
        keller_row("air", "gases %s, rain %g mm/h", c->air.gases ? "as in ITU-R P.676" : "ignored", c->air.rain * 3.6e6);
    if (sound) print_sound(c);
    keller_row("dynamic range", "%g dB", c->dynamic_range);
    keller_row("accelerator", "%s, cones of half-angle %.3g deg", c->accelerator, c->cone * 180 / M_PI);
    keller_row("output", "%s%s%s%s", c->output_paths ? "paths " : "", c->output_coverage ? "coverage " : "",
               c->output_scene ? "scene" : "", c->output_paths || c->output_coverage || c->output_scene ? "" : "none");
}

/* Vertices that no triangle has: where an edge was cut because a face touches or crosses it. */
static size_t cut_points(const KellerScene *scene)
{
    size_t welded = 0;
    for (size_t t = 0; t < scene->triangle_count; ++t)
        for (int i = 0; i < 3; ++i)
            if (scene->triangles[t][i] >= welded) welded = (size_t)scene->triangles[t][i] + 1;
    return scene->vertex_count - welded;
}

void keller_print_scene(const KellerSoup *soup, const KellerScene *scene, bool notes)
{
    const KellerSceneReport *r = &scene->report;
    char text[120];
    printf("scene\n");
    keller_row("read", "%zu triangles, %zu vertices, %zu objects from %zu file%s", soup->triangle_count,
               soup->vertex_count, soup->object_count, soup->files, soup->files == 1 ? "" : "s");
    keller_row("model", "%zu triangles, %zu vertices, %zu faces, %zu wedges", scene->triangle_count,
               scene->vertex_count, scene->face_count, scene->wedge_count);
    if (scene->triangle_count == 0)
        printf("  note: %s: free space only\n",
               soup->triangle_count == 0 ? "the scene has no triangles" : "no triangle of the scene has an area");
    keller_row("cut points added", "%zu", cut_points(scene));
    if (soup->object_count > 0) keller_row_of_texts("objects", soup->objects, soup->object_count, 20);
    if (scene->triangle_count > 0)
        keller_row("box", "(%g, %g, %g) to (%g, %g, %g) m", scene->lower.x, scene->lower.y, scene->lower.z,
                   scene->upper.x, scene->upper.y, scene->upper.z);
    keller_row("repaired", "%zu vertices welded, %zu degenerate triangles left out, %zu doubled ones joined, %zu polygons split",
               r->welded_vertices, r->degenerate, r->duplicate, soup->polygons_split);
    keller_row("edges", "%zu: %zu flat, %zu with one face (%zu of them stand on another face), %zu with more than two",
               r->edges, r->flat_edges, r->boundary_edges, r->contact_edges, r->complex_edges);
    for (size_t i = 0; i < scene->material_count; ++i) {
        if (i == 12 && scene->material_count > 13) {
            keller_row("", "and %zu more", scene->material_count - i);
            break;
        }
        keller_row(i ? "" : "materials", "%s: %s", scene->materials[i].name,
                   material_text(&scene->materials[i], text));
    }
    const char *const lists[] = {soup->notes, r->notes};
    for (int i = 0; i < 2 && notes; ++i)
        for (const char *line = lists[i]; line && *line;) {
            size_t length = strcspn(line, "\n");
            if (length > 0) keller_row("note", "%.*s", (int)(length < 400 ? length : 400), line);
            line += length + (line[length] == '\n');
        }
}

void keller_print_opaque(const KellerConfig *config, const KellerScene *scene)
{
    if (config->transmissions == 0 || scene->face_count == 0) return;
    for (size_t f = 0; f < scene->face_count; ++f) {
        const KellerMaterial *m = &scene->materials[scene->faces[f].material];
        if (m->kind != KELLER_MATERIAL_CONDUCTOR && m->thickness > 0) return;
    }
    printf("  note: no wall lets anything through: its material would need a thickness\n");
}

KellerStripCount keller_count_strips(const KellerConfig *config, const KellerScene *scene)
{
    KellerStripCount count = {0};
    bool sound = config->sound.speed > 0;
    double speed = sound ? config->sound.speed : KELLER_LIGHT_SPEED;
    for (size_t f = 0; f < config->frequency_count; ++f) count.wavelength = fmax(count.wavelength, speed / config->frequencies[f]);
    if (config->diffractions == 0 || (sound && config->sound.edges == KELLER_EDGES_BTM)) return count;
    for (size_t f = 0; f < scene->face_count; ++f) {
        double width = scene->faces[f].strip;
        count.partly += width > 0 && width < 0.5 * count.wavelength;
        count.entirely += width > 0 && width <= 0.25 * count.wavelength;
    }
    return count;
}

void keller_print_strips(const KellerConfig *config, const KellerScene *scene)
{
    KellerStripCount count = keller_count_strips(config, scene);
    if (count.partly == 0) return;
    char number[32];
    printf("  note: %zu pair%s of edges less than half a wavelength apart (of %s; %zu of them less than a quarter) count as one edge, "
           "those less than a quarter entirely\n", count.partly, count.partly == 1 ? "" : "s", keller_si(count.wavelength, "m", number),
           count.entirely);
    if (config->diffractions == 1)
        printf("  note: where an end sees only one edge of such a pair, the path over both has two diffractions; expected "
               "diffractions=\"2\" or more for all of the field behind it\n");
}
