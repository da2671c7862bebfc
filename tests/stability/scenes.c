#include "scenes.h"
#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- random numbers --------------------------------------------------------------------------------------------- */

Random random_seeded(uint64_t seed)
{
    Random random = {seed * 0x9e3779b97f4a7c15u + 0x1234567u};
    for (int i = 0; i < 4; i++) random_bits(&random);
    return random;
}

uint32_t random_bits(Random *random)
{
    uint64_t state = random->state;
    random->state = state * 6364136223846793005u + 1442695040888963407u;
    uint32_t shifted = (uint32_t)(((state >> 18) ^ state) >> 27), turn = (uint32_t)(state >> 59);
    return shifted >> turn | shifted << ((32 - turn) & 31);
}

double random_range(Random *random, double lower, double upper)
{
    return lower + (upper - lower) * (((double)random_bits(random) + 0.5) * 0x1p-32);
}

uint32_t random_below(Random *random, uint32_t bound)
{
    return (uint32_t)(((uint64_t)random_bits(random) * bound) >> 32);
}

/* ---- soups ------------------------------------------------------------------------------------------------------ */

static void *allocated(void *memory)
{
    if (!memory) {
        fprintf(stderr, "out of memory\n");
        abort();
    }
    return memory;
}

/* Room for one element more: doubles at powers of two. */
static void *room(void *array, size_t count, size_t size)
{
    if (count & (count - 1)) return array;
    return allocated(realloc(array, (count ? 2 * count : 1) * size));
}

static char *copy_text(const char *text) { return strcpy(allocated(malloc(strlen(text) + 1)), text); }

KellerSoup soup_new(void)
{
    KellerSoup soup = {0};
    soup.material_count = MATERIAL_COUNT;
    soup.materials = allocated(calloc(MATERIAL_COUNT, sizeof *soup.materials));
    soup.materials[CONCRETE] = (KellerMaterial){.name = copy_text("concrete"), .kind = KELLER_MATERIAL_ITU, .itu = "concrete"};
    soup.materials[CONDUCTOR] = (KellerMaterial){.name = copy_text("conductor"), .kind = KELLER_MATERIAL_CONDUCTOR};
    soup.materials[DRY_GROUND] =
        (KellerMaterial){.name = copy_text("ground"), .kind = KELLER_MATERIAL_ITU, .itu = "medium_dry_ground"};
    soup.materials[PARTITION] =
        (KellerMaterial){.name = copy_text("partition"), .kind = KELLER_MATERIAL_ITU, .itu = "plasterboard", .thickness = 0.013};
    soup.materials[GLASS] = (KellerMaterial){.name = copy_text("pane"), .kind = KELLER_MATERIAL_ITU, .itu = "glass", .thickness = 0.006};
    soup.files = 1;
    soup.notes = copy_text("");
    return soup;
}

void soup_release(KellerSoup *soup) { keller_soup_free(soup); }

KellerSoup soup_copy(const KellerSoup *soup)
{
    KellerSoup copy = soup_new();
    for (size_t i = 0; i < soup->vertex_count; i++) soup_vertex(&copy, soup->vertices[i]);
    for (size_t i = 0; i < soup->object_count; i++) {
        copy.objects = room(copy.objects, copy.object_count, sizeof *copy.objects);
        copy.objects[copy.object_count++] = copy_text(soup->objects[i]);
    }
    for (size_t i = 0; i < soup->triangle_count; i++) {
        const uint32_t *t = soup->triangles[i];
        soup_triangle(&copy, t[0], t[1], t[2], soup->material[i]);
        copy.object[i] = soup->object[i];
    }
    return copy;
}

uint32_t soup_object(KellerSoup *soup, const char *prefix)
{
    char name[64];
    snprintf(name, sizeof name, "%s_%zu", prefix, soup->object_count);
    soup->objects = room(soup->objects, soup->object_count, sizeof *soup->objects);
    soup->objects[soup->object_count] = copy_text(name);
    return (uint32_t)soup->object_count++;
}

uint32_t soup_vertex(KellerSoup *soup, KellerVec3 position)
{
    soup->vertices = room(soup->vertices, soup->vertex_count, sizeof *soup->vertices);
    soup->vertices[soup->vertex_count] = position;
    return (uint32_t)soup->vertex_count++;
}

void soup_triangle(KellerSoup *soup, uint32_t a, uint32_t b, uint32_t c, uint32_t material)
{
    size_t count = soup->triangle_count;
    assert(soup->object_count > 0);
    soup->triangles = room(soup->triangles, count, sizeof *soup->triangles);
    soup->material = room(soup->material, count, sizeof *soup->material);
    soup->object = room(soup->object, count, sizeof *soup->object);
    soup->triangles[count][0] = a;
    soup->triangles[count][1] = b;
    soup->triangles[count][2] = c;
    soup->material[count] = material;
    soup->object[count] = (uint32_t)soup->object_count - 1;
    soup->triangle_count++;
}

void soup_polygon(KellerSoup *soup, size_t count, const KellerVec3 *corners, uint32_t material)
{
    uint32_t first = (uint32_t)soup->vertex_count;
    for (size_t i = 0; i < count; i++) soup_vertex(soup, corners[i]);
    for (uint32_t i = 2; i < count; i++) soup_triangle(soup, first, first + i - 1, first + i, material);
}

void soup_quad(KellerSoup *soup, KellerVec3 a, KellerVec3 b, KellerVec3 c, KellerVec3 d, uint32_t material)
{
    soup_polygon(soup, 4, (KellerVec3[]){a, b, c, d}, material);
}

void soup_prism(KellerSoup *soup, size_t count, const KellerVec3 *base, KellerVec3 sweep, uint32_t material,
                uint32_t leave_out)
{
    uint32_t lower = (uint32_t)soup->vertex_count, n = (uint32_t)count, upper = lower + n;
    for (size_t i = 0; i < count; i++) soup_vertex(soup, base[i]);
    for (size_t i = 0; i < count; i++) soup_vertex(soup, v3_add(base[i], sweep));
    for (uint32_t i = 0; i < n; i++) {
        if (leave_out >> i & 1) continue;
        uint32_t j = (i + 1) % n;
        soup_triangle(soup, lower + i, lower + j, upper + j, material);
        soup_triangle(soup, lower + i, upper + j, upper + i, material);
    }
    for (uint32_t i = 2; i < n; i++) {
        if (!(leave_out >> n & 1)) soup_triangle(soup, lower, lower + i, lower + i - 1, material);
        if (!(leave_out >> (n + 1) & 1)) soup_triangle(soup, upper, upper + i - 1, upper + i, material);
    }
}

void soup_box(KellerSoup *soup, KellerVec3 lower, KellerVec3 upper, uint32_t material, uint32_t leave_out)
{
    KellerVec3 base[4] = {lower, v3(upper.x, lower.y, lower.z), v3(upper.x, upper.y, lower.z),
                          v3(lower.x, upper.y, lower.z)};
    uint32_t first = (uint32_t)soup->vertex_count;
    soup_prism(soup, 4, base, v3(0, 0, upper.z - lower.z), material, leave_out);
    for (uint32_t i = 0; i < 4; i++)
        soup->vertices[first + 4 + i].z = upper.z; /* the sum above may be off by a rounding */
}

/* ---- changes that must not change any result -------------------------------------------------------------------- */

void soup_shuffle(KellerSoup *soup, Random *random)
{
    size_t vertices = soup->vertex_count;
    uint32_t *place = allocated(malloc((vertices + 1) * sizeof *place));
    for (uint32_t i = 0; i < vertices; i++) place[i] = i;
    for (uint32_t i = (uint32_t)vertices; i > 1; i--) {
        uint32_t j = random_below(random, i), keep = place[i - 1];
        place[i - 1] = place[j];
        place[j] = keep;
    }
    KellerVec3 *moved = allocated(malloc((vertices + 1) * sizeof *moved));
    for (size_t i = 0; i < vertices; i++) moved[place[i]] = soup->vertices[i];
    memcpy(soup->vertices, moved, vertices * sizeof *moved);
    free(moved);
    for (uint32_t i = (uint32_t)soup->triangle_count; i > 0; i--) {
        uint32_t j = random_below(random, i), *a = soup->triangles[i - 1], *b = soup->triangles[j];
        uint32_t turn = random_below(random, 3), flip = random_below(random, 2), swap[3];
        memcpy(swap, a, sizeof swap);
        memcpy(a, b, sizeof swap);
        memcpy(b, swap, sizeof swap);
        uint32_t material = soup->material[i - 1], object = soup->object[i - 1];
        soup->material[i - 1] = soup->material[j];
        soup->object[i - 1] = soup->object[j];
        soup->material[j] = material;
        soup->object[j] = object;
        for (uint32_t k = 0; k < 3; k++) swap[k] = place[a[(flip ? 3 - k + turn : k + turn) % 3]];
        memcpy(a, swap, sizeof swap);
    }
    free(place);
}

static bool same_point(KellerVec3 a, KellerVec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

typedef struct {
    KellerVec3 a, b;
    bool cut;
    KellerVec3 at;
} Cut;

/* The cut of the edge a-b: decided once for every pair of positions. */
static const Cut *cut_of(Cut **cuts, size_t *count, KellerVec3 a, KellerVec3 b, Random *random)
{
    for (size_t i = 0; i < *count; i++) {
        const Cut *c = &(*cuts)[i];
        if ((same_point(c->a, a) && same_point(c->b, b)) || (same_point(c->a, b) && same_point(c->b, a))) return c;
    }
    *cuts = room(*cuts, *count, sizeof **cuts);
    bool cut = random_below(random, 2) == 0;
    KellerVec3 at = v3_madd(a, v3_sub(b, a), random_range(random, 0.2, 0.8));
    /* An edge along an axis keeps its common coordinates to the bit. */
    at = v3(a.x == b.x ? a.x : at.x, a.y == b.y ? a.y : at.y, a.z == b.z ? a.z : at.z);
    (*cuts)[*count] = (Cut){a, b, cut, at};
    return &(*cuts)[(*count)++];
}

void soup_refine(KellerSoup *soup, Random *random)
{
    KellerSoup old = *soup, fresh = soup_copy(soup);
    fresh.triangle_count = 0;
    free(fresh.triangles);
    free(fresh.material);
    free(fresh.object);
    fresh.triangles = NULL;
    fresh.material = fresh.object = NULL;
    Cut *cuts = NULL;
    size_t cut_count = 0;
    for (size_t i = 0; i < old.triangle_count; i++) {
        KellerVec3 corner[3], ring[6];
        uint32_t ring_count = 0;
        for (int k = 0; k < 3; k++) corner[k] = old.vertices[old.triangles[i][k]];
        for (int k = 0; k < 3; k++) {
            ring[ring_count++] = corner[k];
            const Cut *cut = cut_of(&cuts, &cut_count, corner[k], corner[(k + 1) % 3], random);
            if (cut->cut) ring[ring_count++] = cut->at;
        }
        double u = random_range(random, 0.2, 0.4), v = random_range(random, 0.2, 0.4);
        KellerVec3 inside =
            v3_madd(v3_madd(corner[0], v3_sub(corner[1], corner[0]), u), v3_sub(corner[2], corner[0]), v);
        uint32_t centre = soup_vertex(&fresh, inside), first = (uint32_t)fresh.vertex_count;
        for (uint32_t k = 0; k < ring_count; k++) soup_vertex(&fresh, ring[k]);
        for (uint32_t k = 0; k < ring_count; k++) {
            soup_triangle(&fresh, centre, first + k, first + (k + 1) % ring_count, old.material[i]);
            fresh.object[fresh.triangle_count - 1] = old.object[i];
        }
    }
    free(cuts);
    soup_release(soup);
    *soup = fresh;
}

void soup_material(KellerSoup *soup, uint32_t material)
{
    for (size_t i = 0; i < soup->triangle_count; i++) soup->material[i] = material;
}

/* ---- random scenes ---------------------------------------------------------------------------------------------- */

#define MAX_SOLIDS 8
#define MAX_CORNERS 5

/* Convex solids, kept to place the stations outside of them and other objects beside them. */
typedef struct {
    size_t corners;
    KellerVec3 base[MAX_CORNERS], sweep;
    bool box;
    KellerVec3 lower, upper;
} Solid;

typedef struct {
    Random random;
    uint32_t flags;
    KellerSoup soup;
    size_t solid_count;
    Solid solid[MAX_SOLIDS];
    bool ground;
} Builder;

static double rounded(const Builder *b, double x)
{
    return b->flags & SCENE_UPRIGHT ? ldexp(nearbyint(ldexp(x, 20)), -20) : x;
}

static KellerVec3 rounded3(const Builder *b, KellerVec3 p)
{
    return v3(rounded(b, p.x), rounded(b, p.y), rounded(b, p.z));
}

static double draw(Builder *b, double lower, double upper)
{
    return rounded(b, random_range(&b->random, lower, upper));
}

static uint32_t draw_material(Builder *b)
{
    static const uint32_t thin[] = {CONDUCTOR, CONCRETE, PARTITION, PARTITION, PARTITION, GLASS, GLASS, GLASS};
    if (b->flags & SCENE_THIN) return thin[random_below(&b->random, sizeof thin / sizeof *thin)];
    return random_below(&b->random, 3) == 0 ? CONDUCTOR : CONCRETE;
}

/* The signed distance of p to the nearest side of the solid: positive outside. */
static double outside(const Solid *s, KellerVec3 p)
{
    KellerVec3 centre = v3_scale(s->sweep, 0.5);
    for (size_t i = 0; i < s->corners; i++) centre = v3_madd(centre, s->base[i], 1.0 / (double)s->corners);
    KellerVec3 cap = v3_unit(v3_cross(v3_sub(s->base[1], s->base[0]), v3_sub(s->base[2], s->base[0])));
    double most = -INFINITY;
    for (size_t i = 0; i < s->corners + 2; i++) {
        KellerVec3 normal =
            i < s->corners ? v3_unit(v3_cross(v3_sub(s->base[(i + 1) % s->corners], s->base[i]), s->sweep)) : cap;
        KellerVec3 foot = i == s->corners + 1 ? v3_add(s->base[0], s->sweep) : s->base[i % s->corners];
        double side = v3_dot(normal, v3_sub(centre, foot)), distance = v3_dot(normal, v3_sub(p, foot));
        double out = side > 0 ? -distance : distance;
        most = out > most ? out : most;
    }
    return most;
}

static void add_solid(Builder *b, const Solid *s)
{
    soup_object(&b->soup, s->box ? "box" : "prism");
    if (s->box)
        soup_box(&b->soup, s->lower, s->upper, draw_material(b), 0);
    else
        soup_prism(&b->soup, s->corners, s->base, s->sweep, draw_material(b), 0);
    b->solid[b->solid_count++] = *s;
}

static void add_box(Builder *b, KellerVec3 lower, KellerVec3 upper)
{
    Solid s = {.corners = 4, .box = true, .lower = lower, .upper = upper, .sweep = v3(0, 0, upper.z - lower.z)};
    s.base[0] = lower;
    s.base[1] = v3(upper.x, lower.y, lower.z);
    s.base[2] = v3(upper.x, upper.y, lower.z);
    s.base[3] = v3(lower.x, upper.y, lower.z);
    add_solid(b, &s);
}

static void add_free_box(Builder *b)
{
    KellerVec3 lower = v3(draw(b, -9, 5), draw(b, -9, 5), 0);
    uint32_t stand = random_below(&b->random, 4);
    lower.z = stand == 0 ? draw(b, 0.3, 3) : stand == 1 ? draw(b, -0.5, -0.1) : 0;
    add_box(b, lower, v3_add(lower, v3(draw(b, 1, 6), draw(b, 1, 6), draw(b, 1, 7))));
}

/* A box beside, on top of, or into one that is there. */
static void add_neighbour_box(Builder *b)
{
    const Solid *other = NULL;
    for (size_t i = 0; i < b->solid_count; i++)
        if (b->solid[i].box && (!other || random_below(&b->random, 2))) other = &b->solid[i];
    if (!other) {
        add_free_box(b);
        return;
    }
    KellerVec3 l = other->lower, u = other->upper, lower = l, upper = u;
    switch (random_below(&b->random, 6)) {
    case 0: /* face to face along x, elsewhere along y, of another height */
        lower = v3(u.x, draw(b, l.y - 1, u.y - 0.3), l.z);
        upper = v3(u.x + draw(b, 1, 4), lower.y + draw(b, 1, 5), l.z + draw(b, 1, 7));
        break;
    case 1: /* flush towers: one front, another height */
        lower = v3(u.x, l.y, l.z);
        upper =
            v3(u.x + draw(b, 1, 4), random_below(&b->random, 2) ? u.y : draw(b, l.y + 1, l.y + 5), l.z + draw(b, 1, 7));
        break;
    case 2: /* stacked on the same footprint */
        lower.z = u.z;
        upper.z = u.z + draw(b, 1, 4);
        break;
    case 3: /* stacked, smaller or overhanging */
        lower = v3(draw(b, l.x - 0.7, u.x - 0.5), draw(b, l.y - 0.7, u.y - 0.5), u.z);
        upper = v3(lower.x + draw(b, 0.5, 3), lower.y + draw(b, 0.5, 3), u.z + draw(b, 1, 4));
        break;
    case 4: /* the same height and front, a gap between */
        lower.x = u.x + draw(b, 0.5, 3);
        upper.x = lower.x + draw(b, 1, 4);
        break;
    default: /* interpenetrating */
        lower = v3(draw(b, l.x, u.x - 0.2), draw(b, l.y - 1, u.y - 0.2), draw(b, l.z, u.z - 0.2));
        upper = v3_add(lower, v3(draw(b, 1, 5), draw(b, 1, 5), draw(b, 1, 5)));
        break;
    }
    add_box(b, lower, upper);
}

static void add_prism(Builder *b)
{
    Solid s = {.corners = random_below(&b->random, 2) ? 3 : 5};
    double radius = draw(b, 1, 3), turn = random_range(&b->random, 0, 6.283185307);
    KellerVec3 centre = v3(draw(b, -7, 7), draw(b, -7, 7), 0), axis = v3(0, 0, 1);
    if (!(b->flags & SCENE_UPRIGHT) && random_below(&b->random, 3)) {
        axis = v3_unit(v3(draw(b, -1, 1), draw(b, -1, 1), draw(b, -1, 1)));
        centre.z = draw(b, 0, 4);
    }
    KellerVec3 e1 = v3_perpendicular(axis), e2 = v3_cross(axis, e1);
    for (size_t i = 0; i < s.corners; i++) {
        double angle = turn + 6.283185307179586 * (double)i / (double)s.corners + random_range(&b->random, -0.2, 0.2);
        s.base[i] = rounded3(b, v3_madd(v3_madd(centre, e1, radius * cos(angle)), e2, radius * sin(angle)));
    }
    s.sweep = rounded3(b, v3_scale(axis, random_range(&b->random, 1.5, 6)));
    add_solid(b, &s);
}

/* A screen: standing, hanging, slanted, or with one rim on a wall of a box. */
static void add_screen(Builder *b)
{
    KellerVec3 a = v3(draw(b, -8, 8), draw(b, -8, 8), random_below(&b->random, 2) ? 0 : draw(b, 0.3, 2));
    KellerVec3 along = v3(draw(b, -5, 5), draw(b, -5, 5), 0), up = v3(0, 0, draw(b, 2, 6));
    if (!(b->flags & SCENE_UPRIGHT) && random_below(&b->random, 3) == 0)
        up = v3(draw(b, -3, 3), draw(b, -3, 3), draw(b, 1, 5));
    for (size_t i = 0; i < b->solid_count; i++)
        if (b->solid[i].box && random_below(&b->random, 4) == 0) {
            KellerVec3 l = b->solid[i].lower, u = b->solid[i].upper;
            a = v3(u.x, draw(b, l.y + 0.1, u.y - 0.1), l.z);
            along = v3(draw(b, 1, 4), draw(b, -1, 1), 0);
            up = v3(0, 0, draw(b, 0.5, u.z - l.z));
            break;
        }
    soup_object(&b->soup, "screen");
    KellerVec3 c = v3_add(a, along);
    uint32_t material = draw_material(b);
    soup_quad(&b->soup, a, c, v3_add(c, up), v3_add(a, up), material);
    if (!(b->flags & SCENE_THIN)) return;
    switch (random_below(&b->random, 4)) {
    case 0: /* the same once more, of another material or not */
        soup_quad(&b->soup, a, c, v3_add(c, up), v3_add(a, up), random_below(&b->random, 2) ? material : draw_material(b));
        break;
    case 1: /* the same once more, cut along its other diagonal */
        soup_quad(&b->soup, c, v3_add(c, up), v3_add(a, up), a, material);
        break;
    case 2: /* a poster on it */
        soup_quad(&b->soup, v3_madd(a, along, 0.25), v3_madd(a, along, 0.75), v3_madd(v3_madd(a, along, 0.75), up, 0.5),
                  v3_madd(v3_madd(a, along, 0.25), up, 0.5), draw_material(b));
        break;
    }
}

static bool is_free(const Builder *b, KellerVec3 p)
{
    for (size_t i = 0; i < b->solid_count; i++) {
        double distance = outside(&b->solid[i], p);
        if ((b->flags & SCENE_THIN ? fabs(distance) : distance) < 0.05) return false;
    }
    return !b->ground || p.z > 0.05;
}

RandomScene scene_random(uint64_t seed, uint32_t flags)
{
    Builder b = {.random = random_seeded(seed), .flags = flags, .soup = soup_new()};
    b.ground = random_below(&b.random, 10) < 7;
    uint32_t objects = flags & SCENE_SMALL ? 1 + random_below(&b.random, 2) : 2 + random_below(&b.random, b.ground ? 4 : 5);
    if (b.ground) {
        double size = draw(&b, 6, 15);
        soup_object(&b.soup, "ground");
        soup_quad(&b.soup, v3(-size, -size, 0), v3(size, -size, 0), v3(size, size, 0), v3(-size, size, 0), CONCRETE);
    }
    for (uint32_t i = 0; i < objects; i++) {
        uint32_t kind = random_below(&b.random, 8);
        if (kind < 2)
            add_free_box(&b);
        else if (kind < 5)
            add_neighbour_box(&b);
        else if (kind < 6)
            add_prism(&b);
        else
            add_screen(&b);
    }
    RandomScene scene = {.soup = b.soup};
    do scene.tx = v3(draw(&b, -11, 11), draw(&b, -11, 11), draw(&b, 0.2, 9));
    while (!is_free(&b, scene.tx));
    do {
        scene.step = draw(&b, 0.5, 3);
        scene.rx[0] = v3(draw(&b, -11, 9), draw(&b, -11, 11), draw(&b, 0.2, 9));
        scene.rx[1] = v3(scene.rx[0].x + scene.step, scene.rx[0].y, scene.rx[0].z);
    } while (!is_free(&b, scene.rx[0]) || !is_free(&b, scene.rx[1]));
    return scene;
}
