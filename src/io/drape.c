#include "keller/drape.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "io/names.h"
#include "keller/ray.h"

/* Cells are looked at that lie beside a triangle by no more than this: far above the rounding of their places. */
static const double BESIDE = 1e-6; /* steps */

typedef struct {
    const KellerConfig *config;
    const KellerScene *scene;
    const KellerReceiverSet *set;
    KellerReceiver *cells;      /* of the set */
    double *near;               /* [cells] z at the nearest point of a triangle that is missed within the contact tolerance; else NaN */
    bool *counts;               /* [triangles] as surface */
} Drape;

/* ---- what is surface -------------------------------------------------------------------------------------------------- */

static const char *name_of(const KellerScene *scene, bool object, size_t i) { return object ? scene->objects[i] : scene->materials[i].name; }

static KellerStatus find_surface(const Drape *d, const KellerSurfaceName *s, uint32_t *found, KellerError *error)
{
    size_t count = s->is_object ? d->scene->object_count : d->scene->material_count;
    KellerNearest nearest = keller_nearest(s->name);
    for (size_t i = 0; i < count; i++) {
        const char *name = name_of(d->scene, s->is_object, i);
        *found = (uint32_t)i;
        if (strcmp(name, s->name) == 0) return KELLER_OK;
        keller_nearest_offer(&nearest, name);
    }
    char hint[KELLER_HINT_BYTES];
    const char *kind = s->is_object ? "object" : "material";
    return keller_error(error, KELLER_BAD_INPUT, "%s:%d: <over> names %s \"%s\", which no triangle of the scene has; expected one of its "
                        "%zu %ss%s",
                        d->config->file, s->line, kind, keller_quote(s->name).text, count, kind, keller_nearest_hint(&nearest, hint));
}

static KellerStatus choose_surface(const Drape *d, KellerError *error)
{
    const KellerScene *scene = d->scene;
    for (size_t t = 0; t < scene->triangle_count; t++) d->counts[t] = d->set->surface_count == 0;
    for (size_t i = 0; i < d->set->surface_count; i++) {
        uint32_t wanted = 0;
        KellerStatus status = find_surface(d, &d->set->surfaces[i], &wanted, error);
        if (status != KELLER_OK) return status;
        for (size_t t = 0; t < scene->triangle_count; t++) {
            uint32_t has = d->set->surfaces[i].is_object ? scene->triangle_object[t] : scene->faces[scene->triangle_face[t]].material;
            d->counts[t] = d->counts[t] || has == wanted;
        }
    }
    return KELLER_OK;
}

/* ---- one triangle ------------------------------------------------------------------------------------------------------ */

static double distance_in_plan(KellerVec3 a, KellerVec3 b) { return hypot(a.x - b.x, a.y - b.y); }

/* The z of the triangle where it is nearest to p, seen from above, if that is within `reach` (m); else NaN. p is beside it. */
static double z_nearby(const KellerVec3 v[3], KellerVec3 p, double reach)
{
    double z = NAN, best = reach;
    for (int i = 0; i < 3; i++) {
        KellerVec3 a = v[i], l = v3_sub(v[(i + 1) % 3], a);
        double square = l.x * l.x + l.y * l.y, t = ((p.x - a.x) * l.x + (p.y - a.y) * l.y) / square;
        KellerVec3 q = v3_madd(a, l, t > 0 ? lesser(t, 1) : 0);
        double distance = distance_in_plan(p, q);
        if (!(square > 0) || distance > best) continue;
        best = distance;
        z = q.z;
    }
    return z;
}

/* The cells first .. end - 1 of `count` whose places lie in [low, high], and some beside. */
static void covered(double start, double step, uint32_t count, double low, double high, uint32_t *first, uint32_t *end)
{
    double from = ceil((low - start) / step - BESIDE), to = floor((high - start) / step + BESIDE);
    *first = from > 0 ? (uint32_t)lesser(from, count) : 0;
    *end = to >= 0 ? (uint32_t)lesser(to + 1, count) : 0;
}

/* Of x on the triangle's borders, between the heights low and high of y. */
static KellerRange across(const KellerVec3 v[3], double low, double high)
{
    KellerRange x = {INFINITY, -INFINITY};
    for (int i = 0; i < 3; i++) {
        KellerVec3 a = v[i], b = v[(i + 1) % 3];
        for (int k = 0; k < 2; k++) {
            double y = k ? high : low;
            if ((a.y < y) == (b.y < y)) continue;
            double at = a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y));
            x = (KellerRange){lesser(x.near, at), greater(x.far, at)};
        }
        if (a.y >= low && a.y <= high) x = (KellerRange){lesser(x.near, a.x), greater(x.far, a.x)};
    }
    return x;
}

static void drape_triangle(const Drape *d, const KellerVec3 v[3])
{
    const KellerReceiverSet *set = d->set;
    const double reach = d->scene->contact;
    KellerVec3 n = v3_cross(v3_sub(v[1], v[0]), v3_sub(v[2], v[0]));
    const bool steep = fabs(n.z) <= KELLER_FLAT_ANGLE * v3_norm(n); /* a wall is met by no vertical but its own */
    uint32_t row, row_end;
    covered(set->y0, set->step, set->ny, lesser(v[0].y, lesser(v[1].y, v[2].y)) - reach,
            greater(v[0].y, greater(v[1].y, v[2].y)) + reach, &row, &row_end);
    for (; row < row_end; row++) {
        uint32_t x, x_end;
        double y = set->y0 + row * set->step, pad = reach + BESIDE * set->step;
        KellerRange along = across(v, y - pad, y + pad);
        covered(set->x0, set->step, set->nx, along.near - reach, along.far + reach, &x, &x_end);
        for (; x < x_end; x++) {
            size_t cell = (size_t)row * set->nx + x;
            KellerVec3 p = d->cells[cell].station.position;
            KellerRay up = keller_ray(v3(p.x, p.y, 0), v3(0, 0, 1));
            double z;
            if (keller_ray_triangle(&up, v[0], v[1], v[2], (KellerRange){-INFINITY, INFINITY}, &z, NULL))
                d->cells[cell].station.position.z = isnan(p.z) ? z : greater(p.z, z);
            else if (!steep && !isnan(z = z_nearby(v, p, reach))) d->near[cell] = isnan(d->near[cell]) ? z : greater(d->near[cell], z);
        }
    }
}

static KellerStatus drape_set(Drape *d, KellerReceiverSet *set, KellerError *error)
{
    const KellerScene *scene = d->scene;
    d->set = set;
    KellerStatus status = choose_surface(d, error);
    if (status != KELLER_OK) return status;
    d->near = malloc((set->count + 1) * sizeof *d->near);
    if (!d->near) return keller_error_memory(error, set->count * sizeof *d->near);
    for (uint32_t i = 0; i < set->count; i++) d->near[i] = d->cells[i].station.position.z = NAN;
    for (size_t t = 0; t < scene->triangle_count; t++) {
        const uint32_t *corner = scene->triangles[t];
        const KellerVec3 v[3] = {scene->vertices[corner[0]], scene->vertices[corner[1]], scene->vertices[corner[2]]};
        if (d->counts[t]) drape_triangle(d, v);
    }
    set->nowhere = 0;
    for (uint32_t i = 0; i < set->count; i++) {
        double *z = &d->cells[i].station.position.z;
        if (isnan(*z)) *z = d->near[i];
        *z += set->height;
        set->nowhere += isnan(*z) ? 1 : 0;
    }
    free(d->near);
    return KELLER_OK;
}

KellerStatus keller_config_drape(KellerConfig *config, const KellerScene *scene, KellerError *error)
{
    Drape d = {.config = config, .scene = scene, .counts = malloc(scene->triangle_count + 1)};
    if (!d.counts) return keller_error_memory(error, scene->triangle_count + 1);
    KellerStatus status = KELLER_OK;
    for (size_t s = 0; s < config->set_count && status == KELLER_OK; s++) {
        d.cells = &config->receivers[config->sets[s].first];
        if (config->sets[s].draped) status = drape_set(&d, &config->sets[s], error);
    }
    free(d.counts);
    return status;
}
